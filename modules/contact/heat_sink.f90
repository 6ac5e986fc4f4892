! SPDX-License-Identifier: MIT
!> What takes heat from bodies, a tool or a column of a backing plate: a rod behind its face in
!> which heat is conducted along one axis, or a body of one temperature. A step is one of backward
!> Euler; what the face answers to a flow of heat is linear, so that the temperatures of metal and
!> sink at the end of a step are solved for together.
module contact_heat_sink
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: heat_sink_t

  real(rp), parameter :: without_end = 10.0_rp    !! as long as a rod that never feels its end [m]
  real(rp), parameter :: growth = 1.1_rp          !! of the cells behind the face

  type :: heat_sink_t
    logical :: is_on = .false.                    !! its temperature follows the heat that it takes
    integer :: place = 0                          !! of its fields of the particles: area in contact
                                                  !! times time [m2 s], heat of the face [J]
    real(rp) :: conductance = huge(1.0_rp)        !! of the gap at the face [W/(m2 K)]
    real(rp) :: cooling = 0.0_rp                  !! at the far end, or of all of it [W/K]
    real(rp) :: coolant = 298.0_rp                !! temperature there [K]
    real(rp), allocatable :: capacity(:)          !! of each cell, from the face on [J/K]
    real(rp), allocatable :: between(:)           !! conductance behind each, before the next or the
                                                  !! coolant [W/K]
    real(rp) :: to_face = huge(1.0_rp)            !! from the first centre to the face [W/K]
    ! State, equal on all ranks.
    real(rp), allocatable :: temperature(:)       !! of the cells [K]
    real(rp) :: face = 298.0_rp                   !! temperature of the face [K]
    real(rp) :: gained = 0.0_rp, lost = 0.0_rp    !! heat taken from the bodies, given away [J]
  contains
    procedure :: make_rod
    procedure :: make_lumped
    procedure :: answer
    procedure :: take
    procedure :: content
    procedure :: state
    procedure :: set_state
  end type heat_sink_t

contains

  !> A rod of this cross-section and length (0: without end) at temperature `start`, whose cells
  !> grow from `first` at the face.
  pure subroutine make_rod(self, area, length, first, conductivity, capacity, start)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: area, length, first   !! [m2], [m], [m]
    real(rp), intent(in) :: conductivity          !! [W/(m K)]
    real(rp), intent(in) :: capacity              !! density times specific heat [J/(m3 K)]
    real(rp), intent(in) :: start                 !! [K]
    real(rp), allocatable :: width(:)
    real(rp) :: whole
    integer :: i, n

    whole = length
    if (length <= 0.0_rp) whole = without_end
    n = max(3, ceiling(log(1.0_rp + (growth - 1.0_rp)*whole/first)/log(growth)))
    allocate (width(n), source=[(growth**i, i=0, n - 1)])
    width = whole*width/sum(width)
    self%is_on = .true.
    self%capacity = capacity*area*width
    allocate (self%between(n))
    self%between(:n - 1) = 2.0_rp*conductivity*area/(width(:n - 1) + width(2:))
    self%between(n) = 0.0_rp
    if (self%cooling > 0.0_rp) then
      self%between(n) = 1.0_rp/(1.0_rp/self%cooling + 0.5_rp*width(n)/(conductivity*area))
    end if
    self%to_face = 2.0_rp*conductivity*area/width(1)
    allocate (self%temperature(n), source=start)
    self%face = start
  end subroutine make_rod

  !> A body of one temperature, at first `start`.
  pure subroutine make_lumped(self, capacity, start)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: capacity              !! [J/K]
    real(rp), intent(in) :: start                 !! [K]

    self%is_on = .true.
    self%capacity = [capacity]
    self%between = [self%cooling]
    self%temperature = [start]
    self%face = start
  end subroutine make_lumped

  !> Temperature of the face at the end of a step, `still` [K] without heat from the bodies and
  !> `per_power` [K/W] more for each watt.
  pure subroutine answer(self, dt, still, per_power)
    class(heat_sink_t), intent(in) :: self
    real(rp), intent(in) :: dt                    !! [s]
    real(rp), intent(out) :: still, per_power
    real(rp), dimension(size(self%temperature)) :: cold, unit

    call solve(self, dt, 0.0_rp, cold)
    call solve(self, dt, 1.0_rp, unit)
    still = cold(1)
    per_power = unit(1) - cold(1) + 1.0_rp/self%to_face
  end subroutine answer

  !> A step in which the bodies give `power`.
  pure subroutine take(self, dt, power)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: dt, power             !! [s], [W]
    real(rp), dimension(size(self%temperature)) :: t
    integer :: n

    n = size(t)
    call solve(self, dt, power, t)
    self%temperature = t
    self%face = t(1) + power/self%to_face
    self%gained = self%gained + dt*power
    self%lost = self%lost + dt*self%between(n)*(t(n) - self%coolant)
  end subroutine take

  !> Temperatures after a step of backward Euler with `power` into the first cell: elimination from
  !> the far end.
  pure subroutine solve(self, dt, power, t)
    class(heat_sink_t), intent(in) :: self
    real(rp), intent(in) :: dt, power
    real(rp), intent(out) :: t(size(self%temperature))
    real(rp), dimension(size(self%temperature)) :: diagonal, right
    integer :: i, n

    n = size(t)
    diagonal = self%capacity/dt + self%between
    right = self%capacity/dt*self%temperature
    right(1) = right(1) + power
    right(n) = right(n) + self%between(n)*self%coolant
    do i = n - 1, 1, -1
      associate (g => self%between(i))
        diagonal(i + 1) = diagonal(i + 1) + g
        diagonal(i) = diagonal(i) - g*g/diagonal(i + 1)
        right(i) = right(i) + g*right(i + 1)/diagonal(i + 1)
      end associate
    end do
    t(1) = right(1)/diagonal(1)
    do i = 1, n - 1
      t(i + 1) = (right(i + 1) + self%between(i)*t(i))/diagonal(i + 1)
    end do
  end subroutine solve

  !> Heat above 0 K [J].
  pure real(rp) function content(self)
    class(heat_sink_t), intent(in) :: self

    content = 0.0_rp
    if (self%is_on) content = sum(self%capacity*self%temperature)
  end function content

  !> What a checkpoint keeps of it.
  pure function state(self) result(values)
    class(heat_sink_t), intent(in) :: self
    real(rp), allocatable :: values(:)

    allocate (values(0))
    if (self%is_on) values = [self%face, self%gained, self%lost, self%temperature]
  end function state

  !> The same from a checkpoint.
  pure subroutine set_state(self, values)
    class(heat_sink_t), intent(inout) :: self
    real(rp), intent(in) :: values(:)

    if (.not. self%is_on) return
    self%face = values(1)
    self%gained = values(2)
    self%lost = values(3)
    self%temperature = values(4:)
  end subroutine set_state

end module contact_heat_sink
