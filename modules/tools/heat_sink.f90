! SPDX-License-Identifier: MIT
!> Heat sinks of bodies, a tool or a column of a backing plate: a rod behind the face in which heat
!> is conducted along one axis, or a body of uniform temperature. Time integration is backward
!> Euler; the face temperature is linear in the heat flow, so that the temperatures of metal and
!> sink at the end of a step are solved for together.
!>
!> Stationary bodies behind heat films, which heat up: a plate in which heat is conducted away from
!> the face in independent columns, or a body of uniform temperature.
module tools_heat_sink
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: backing_t, find_backing, heat_sink_t

  !> Length of a rod whose end has no influence [m].
  real(rp), parameter :: semi_infinite_length = 10.0_rp
  real(rp), parameter :: growth = 1.1_rp  !! growth ratio of the cells behind the face

  type :: heat_sink_t
    logical :: is_on = .false.  !! the sink has a temperature that follows the absorbed heat
    !> First of its two particle fields, contact area times time [m2 s] and heat of the face [J].
    integer :: place = 0
    !> Heat-transfer coefficient of the gap at the face [W/(m2 K)].
    real(rp) :: gap_coefficient = huge(1.0_rp)
    real(rp) :: cooling = 0.0_rp  !! cooling at the far end, or of a uniform body [W/K]
    real(rp) :: coolant = 298.0_rp                !! temperature of the coolant [K]
    real(rp), allocatable :: capacity(:)  !! heat capacity of each cell, from the face on [J/K]
    !> Conductance from each cell to the next one or to the coolant [W/K].
    real(rp), allocatable :: link_conductance(:)
    !> Conductance from the first cell centre to the face [W/K].
    real(rp) :: face_conductance = huge(1.0_rp)
    ! State, equal on all ranks:
    real(rp), allocatable :: temperature(:)       !! cell temperatures [K]
    real(rp) :: face_temperature = 298.0_rp       !! face temperature [K]
    real(rp) :: gained = 0.0_rp   !! heat taken from the bodies [J]
    real(rp) :: lost = 0.0_rp     !! heat given to the coolant [J]
    ! Cell temperatures at the end of the step without heat flow [K], and their rise with it [K/W]:
    real(rp), allocatable, private :: alone(:), per_watt(:)
  contains
    procedure :: make_rod, make_lumped, face_response, absorb, content, range => range_of, state
    procedure :: set_state
  end type heat_sink_t

  type :: backing_t
    character(:), allocatable :: name
    integer :: body = 0, face = 0   !! body, and its face: 1 to 6 for xmin, xmax, ymin, ...
    integer :: across(2) = 0        !! axes along the face
    real(rp) :: lower(2) = 0.0_rp   !! lower corner of the columns [m]
    real(rp) :: width(2) = 1.0_rp   !! width of a column [m]
    integer :: n(2) = 1             !! numbers of columns along the face
    real(rp) :: period(2) = 0.0_rp  !! period of the grid along the face [m]; 0: not periodic
    type(heat_sink_t), allocatable :: column(:)
  contains
    procedure :: column_at, max_face_temperature, content => backing_content
  end type backing_t

contains

  !> Make a rod of this cross-section and length (0: semi-infinite) at temperature `start`, whose
  !> cells grow from `first_width` at the face.
  pure subroutine make_rod(self, area, length, first_width, conductivity, capacity, start)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: area          !! cross-section [m2]
    real(rp), intent(in) :: length        !! [m]
    real(rp), intent(in) :: first_width   !! width of the first cell [m]
    real(rp), intent(in) :: conductivity               !! [W/(m K)]
    real(rp), intent(in) :: capacity                   !! density times specific heat [J/(m3 K)]
    real(rp), intent(in) :: start                      !! initial temperature [K]
    real(rp), allocatable :: width(:)
    real(rp) :: total_length
    integer :: i, n

    total_length = length
    if (length <= 0.0_rp) total_length = semi_infinite_length
    n = max(3, ceiling(log(1.0_rp + (growth - 1.0_rp)*total_length/first_width)/log(growth)))
    allocate (width(n), source=[(growth**i, i=0, n - 1)])
    width = total_length*width/sum(width)
    self%is_on = .true.
    self%capacity = capacity*area*width
    allocate (self%link_conductance(n))
    self%link_conductance(:n - 1) = 2.0_rp*conductivity*area/(width(:n - 1) + width(2:))
    self%link_conductance(n) = 0.0_rp
    if (self%cooling > 0.0_rp) then
      self%link_conductance(n) = 1.0_rp/(1.0_rp/self%cooling + 0.5_rp*width(n)/(conductivity*area))
    end if
    self%face_conductance = 2.0_rp*conductivity*area/width(1)
    allocate (self%temperature(n), source=start)
    self%face_temperature = start
  end subroutine make_rod

  !> Make a body of uniform temperature.
  pure subroutine make_lumped(self, capacity, start)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: capacity              !! heat capacity [J/K]
    real(rp), intent(in) :: start                 !! initial temperature [K]

    self%is_on = .true.
    self%capacity = [capacity]
    self%link_conductance = [self%cooling]
    self%temperature = [start]
    self%face_temperature = start
  end subroutine make_lumped

  !> Face temperature at the end of a step as a linear function of the heat flow from the bodies:
  !> `t_face0` [K] without it, and the derivative `dt_face_dp` [K/W]. The temperatures of the cells
  !> are kept for `absorb`: backward Euler with elimination from the far end.
  pure subroutine face_response(self, dt, t_face0, dt_face_dp)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: dt                    !! time step [s]
    real(rp), intent(out) :: t_face0, dt_face_dp
    real(rp), dimension(size(self%temperature)) :: diagonal, right
    integer :: i, n

    n = size(self%temperature)
    diagonal = self%capacity/dt + self%link_conductance
    right = self%capacity/dt*self%temperature
    right(n) = right(n) + self%link_conductance(n)*self%coolant
    if (.not. allocated(self%alone)) allocate (self%alone(n), self%per_watt(n))
    associate (link => self%link_conductance, alone => self%alone, per_watt => self%per_watt)
      do i = n - 1, 1, -1
        diagonal(i + 1) = diagonal(i + 1) + link(i)
        diagonal(i) = diagonal(i) - link(i)**2/diagonal(i + 1)
        right(i) = right(i) + link(i)*right(i + 1)/diagonal(i + 1)
      end do
      alone(1) = right(1)/diagonal(1)
      per_watt(1) = 1.0_rp/diagonal(1)
      do i = 1, n - 1
        alone(i + 1) = (right(i + 1) + link(i)*alone(i))/diagonal(i + 1)
        per_watt(i + 1) = link(i)*per_watt(i)/diagonal(i + 1)
      end do
      t_face0 = alone(1)
      dt_face_dp = per_watt(1) + 1.0_rp/self%face_conductance
    end associate
  end subroutine face_response

  !> End the step of the last `face_response`, of length `dt`, with the heat flow `power` from the
  !> bodies.
  pure subroutine absorb(self, dt, power)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: dt, power             !! time step [s], power [W]
    integer :: n

    n = size(self%temperature)
    self%temperature = self%alone + power*self%per_watt
    self%face_temperature = self%temperature(1) + power/self%face_conductance
    self%gained = self%gained + dt*power
    self%lost = self%lost + dt*self%link_conductance(n)*(self%temperature(n) - self%coolant)
  end subroutine absorb

  !> Heat above 0 K [J].
  pure real(rp) function content(self)
    class(heat_sink_t), intent(in) :: self

    content = 0.0_rp
    if (self%is_on) content = sum(self%capacity*self%temperature)
  end function content

  !> Lowest and highest temperature of the sink and its coolant [K].
  pure function range_of(self) result(range)
    class(heat_sink_t), intent(in) :: self
    real(rp) :: range(2)

    range = [minval(self%temperature), maxval(self%temperature)]
    if (self%cooling > 0.0_rp) range = [min(range(1), self%coolant), max(range(2), self%coolant)]
  end function range_of

  !> State for a checkpoint.
  pure function state(self) result(values)
    class(heat_sink_t), intent(in) :: self
    real(rp), allocatable :: values(:)

    allocate (values(0))
    if (self%is_on) values = [self%face_temperature, self%gained, self%lost, self%temperature]
  end function state

  !> Set the state from a checkpoint.
  pure subroutine set_state(self, values)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: values(:)

    if (.not. self%is_on) return
    self%face_temperature = values(1)
    self%gained = values(2)
    self%lost = values(3)
    self%temperature = values(4:)
  end subroutine set_state

  !> Index of the column behind the position `x`, or behind an image of it on a periodic grid; of
  !> the nearest column for positions beside the columns.
  pure integer function column_at(self, x)
    class(backing_t), intent(in) :: self
    real(rp), intent(in) :: x(3)                  !! position [m]
    integer :: place(2)
    real(rp) :: along(2)                          !! position from the corner of the columns [m]

    along = x(self%across) - self%lower
    where (self%period > 0.0_rp) &
      along = along - self%period*anint((along - 0.5_rp*self%n*self%width)/self%period)
    place = max(0, min(self%n - 1, floor(along/self%width)))
    column_at = 1 + place(1) + self%n(1)*place(2)
  end function column_at

  !> Largest face temperature [K].
  pure real(rp) function max_face_temperature(self)
    class(backing_t), intent(in) :: self

    max_face_temperature = maxval(self%column%face_temperature)
  end function max_face_temperature

  !> Heat above 0 K [J].
  pure real(rp) function backing_content(self)
    class(backing_t), intent(in) :: self
    integer :: i

    backing_content = 0.0_rp
    do i = 1, size(self%column)
      backing_content = backing_content + self%column(i)%content()
    end do
  end function backing_content

  !> Index of the backing of a face of a body; 0 if it has none.
  pure integer function find_backing(backing, body, face) result(k)
    type(backing_t), intent(in) :: backing(:)
    integer, intent(in) :: body, face

    do k = size(backing), 1, -1
      if (backing(k)%body == body .and. backing(k)%face == face) exit
    end do
  end function find_backing

end module tools_heat_sink
