! SPDX-License-Identifier: MIT
!> Heat flow through the boundary of a mesh, films and moving sources. Films lose heat through half
!> a cell, a constant coefficient and radiation: A (T - T_s)/(d/k) = A (h (T_s - T_a) + r (T_s^4 -
!> T_a^4)). A disc lies on upward boundary faces, with a given power or as a tool that shears the
!> surface with the heat flux q = share omega r tau(T_s). The surface temperature half a cell above
!> the centre is T_s = T_c + q d/k with the mean flux over the face, also where the disc covers a
!> part of it.
module heat_sources
  use base_kinds, only: rp
  use heat_curve, only: curve_t
  use heat_mesh, only: boundary_face_t, heat_mesh_t
  use heat_volume, only: volume_t
  use heat_volumes, only: make_volume
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: heat_source_t, wall_films_t

  !> Boundary faces with heat loss.
  type :: wall_films_t
    integer :: n = 0
    logical :: radiates = .false.                 !! any face radiates
    integer, allocatable :: cell(:)               !! own cell of each face
    real(rp), allocatable :: area(:)              !! [m2]
    real(rp), allocatable :: coefficient(:)       !! heat-transfer coefficients [W/(m2 K)]
    real(rp), allocatable :: depth(:)             !! depth of the cell centre [m]
    real(rp), allocatable :: ambient(:)           !! ambient temperatures [K]
    real(rp), allocatable :: radiation(:)         !! emissivity times sigma [W/(m2 K4)]
    real(rp), allocatable :: conductance(:)       !! A/(1/h + d/k) with the reference k [W/K]
    real(rp), allocatable :: max_conductance(:)   !! upper bound over all temperatures [W/K]
    real(rp), allocatable :: per_capacity(:)      !! conductance over capacity of the cell [1/s]
  contains
    procedure :: init, loss
  end type wall_films_t

  integer, parameter, public :: kind_disc = 1, kind_volume = 2, kind_stir = 3

  !> A heat source, and the faces or cells under it in the current step.
  type :: heat_source_t
    integer :: kind = kind_disc
    real(rp) :: power = 0.0_rp                       !! power of a disc or volume [W]
    real(rp) :: position(3) = 0.0_rp                 !! centre at t = 0 [m]
    real(rp) :: velocity(3) = 0.0_rp                 !! [m/s]
    real(rp) :: radius = 0.0_rp                      !! radius of a disc [m]
    class(volume_t), allocatable :: volume           !! volume that is heated
    real(rp) :: begin = 0.0_rp, end = huge(1.0_rp)   !! times between which the source acts [s]
    real(rp) :: spin = 0.0_rp   !! heat share times angular speed of stirring [rad/s]
    type(curve_t) :: shear      !! shear stress of stirring over temperature [Pa]
    real(rp), private :: max_shear = 0.0_rp          !! largest shear stress [Pa]
    integer, allocatable, private :: wall(:)         !! boundary faces at its height
    integer :: n = 0   !! faces or cells covered at the start or the end
    integer, allocatable :: cell(:)                  !! own cell of each covered face or cell
    real(rp), allocatable :: insulance(:)         !! centre depth over face area [1/m]
    !> At the start and at the end of the step: area and integral of the radius over the covered
    !> part of a face (`disc_moments`), or covered capacity and 0, (4, n).
    real(rp), allocatable :: moment(:, :)
    real(rp) :: total(2) = 0.0_rp                    !! moments 1 and 3, sums over all ranks
  contains
    procedure :: read_keys, find_walls, move, is_on, heat_of
  end type heat_source_t

contains

  !> List the boundary faces with heat loss, with coefficients by direction and body.
  subroutine init(self, wall, capacity, conductivity, coefficient, radiation, ambient)
    class(wall_films_t), intent(inout) :: self
    type(boundary_face_t), intent(in) :: wall(:)
    real(rp), intent(in) :: capacity(:)           !! capacity of the cells [J/K]
    real(rp), intent(in) :: conductivity(:)       !! conductivity of the bodies [W/(m K)]
    real(rp), intent(in) :: coefficient(:, :)  !! (6, bodies) heat-transfer coefficients [W/(m2 K)]
    real(rp), intent(in) :: radiation(:, :)       !! (6, bodies) emissivity times sigma [W/(m2 K4)]
    real(rp), intent(in) :: ambient(:, :)         !! (6, bodies) ambient temperatures [K]
    real(rp) :: h
    integer :: i, n

    n = size(wall)
    allocate (self%cell(n), self%area(n), self%coefficient(n), self%depth(n), self%ambient(n), &
              self%radiation(n), self%conductance(n), self%max_conductance(n), self%per_capacity(n))
    n = 0
    do i = 1, size(wall)
      associate (w => wall(i))
        if (coefficient(w%face, w%body) <= 0.0_rp .and. radiation(w%face, w%body) <= 0.0_rp) cycle
        n = n + 1
        self%cell(n) = w%cell
        self%area(n) = w%area
        self%coefficient(n) = coefficient(w%face, w%body)
        self%radiation(n) = radiation(w%face, w%body)
        self%depth(n) = w%depth
        self%ambient(n) = ambient(w%face, w%body)
        h = self%coefficient(n) + 4.0_rp*self%radiation(n)*self%ambient(n)**3
        self%conductance(n) = w%area/(1.0_rp/h + w%depth/conductivity(w%body))
        self%max_conductance(n) = self%conductance(n)
        if (self%radiation(n) > 0.0_rp) then
          self%radiates = .true.
          self%max_conductance(n) = w%area*conductivity(w%body)/w%depth
        end if
        self%per_capacity(n) = self%conductance(n)/capacity(w%cell)
      end associate
    end do
    self%n = n
  end subroutine init

  !> Heat loss of face `i` at a cell temperature, and its derivative. The surface temperature of a
  !> radiating face is found by Newton's method from the hotter side, from which it converges
  !> monotonically.
  elemental subroutine loss(self, i, t, resistivity, heat, slope)
    class(wall_films_t), intent(in) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: t                     !! temperature of the cell [K]
    real(rp), intent(in) :: resistivity           !! 1/k of the cell [m K/W]
    real(rp), intent(out) :: heat                 !! loss [W]
    real(rp), intent(out) :: slope                !! derivative of the loss by temperature [W/K]
    integer, parameter :: max_iterations = 50
    real(rp), parameter :: close = 1.0e-14_rp
    real(rp) :: change, s
    integer :: k

    associate (h => self%coefficient(i), r => self%radiation(i), a => self%ambient(i), &
               cell_resistance => self%depth(i)*resistivity)
      if (r <= 0.0_rp) then
        slope = self%area(i)/(1.0_rp/h + cell_resistance)
        heat = slope*(t - a)
        return
      end if
      s = max(t, a)
      do k = 1, max_iterations
        slope = h + 4.0_rp*r*s**3
        heat = (h + r*(s + a)*(s*s + a*a))*(s - a)
        change = (cell_resistance*heat - (t - s))/(1.0_rp + cell_resistance*slope)
        s = s - change
        if (abs(change) <= close*s) exit
      end do
      heat = self%area(i)*(h + r*(s + a)*(s*s + a*a))*(s - a)
      slope = self%area(i)/(1.0_rp/(h + 4.0_rp*r*s**3) + cell_resistance)
    end associate
  end subroutine loss

  !> Read the keys of the `i`-th &SOURCE but for those of stirring.
  subroutine read_keys(self, input, i)
    class(heat_source_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    select case (input%text('SOURCE', i, 'KIND'))
    case ('disc'); self%kind = kind_disc
    case ('stir'); self%kind = kind_stir
    case default; self%kind = kind_volume
    end select
    self%power = input%real('SOURCE', i, 'POWER')
    self%position = input%reals('SOURCE', i, 'POSITION', 3)
    self%velocity = input%reals('SOURCE', i, 'VELOCITY', 3)
    self%radius = input%real('SOURCE', i, 'RADIUS')
    self%begin = input%real('SOURCE', i, 'BEGIN')
    if (input%real('SOURCE', i, 'END') > 0.0_rp) self%end = input%real('SOURCE', i, 'END')
    call make_volume(input%text('SOURCE', i, 'KIND'), self%volume)
    call self%volume%read_keys(input, i)
  end subroutine read_keys

  !> True if the source acts in a step that starts at `t`.
  elemental logical function is_on(self, t)
    class(heat_source_t), intent(in) :: self
    real(rp), intent(in) :: t

    is_on = t >= self%begin*(1.0_rp - 1.0e-12_rp) .and. t < self%end*(1.0_rp - 1.0e-12_rp)
  end function is_on

  !> List the boundary faces on which a disc can lie: upward faces within half a cell of its height.
  subroutine find_walls(self, mesh)
    class(heat_source_t), intent(inout) :: self
    type(heat_mesh_t), intent(in) :: mesh
    integer :: i
    logical :: is_level(size(mesh%wall))

    is_level = .false.
    do i = 1, size(mesh%wall)
      if (mesh%wall(i)%face /= 6 .or. mesh%wall(i)%at(1) == 0) cycle
      associate (k => mesh%wall(i)%at(3))
        is_level(i) = abs(mesh%z(k) - self%position(3)) <= 0.5_rp*(mesh%z(k) - mesh%z(k - 1))
      end associate
    end do
    self%wall = pack([(i, i=1, size(mesh%wall))], is_level)
    self%n = 0
    if (self%kind == kind_stir) self%max_shear = maxval(self%shear%value)
    allocate (self%cell(0), self%insulance(0), self%moment(4, 0))
  end subroutine find_walls

  !> Set the faces or cells covered at the start and the end of a step.
  subroutine move(self, mesh, t0, t1)
    class(heat_source_t), intent(inout) :: self
    type(heat_mesh_t), intent(in) :: mesh
    real(rp), intent(in) :: t0, t1                   !! start and end of the step [s]
    real(rp) :: c0(3), c1(3), m(4), b(3, 2), fraction
    integer :: i, n

    c0 = self%position + t0*self%velocity
    c1 = self%position + t1*self%velocity
    n = 0
    if (self%kind == kind_volume) then
      call cover_volume(self, mesh, c0, c1)
      return
    end if
    if (size(self%cell) < size(self%wall)) then
      deallocate (self%cell, self%insulance, self%moment)
      allocate (self%cell(size(self%wall)), self%insulance(size(self%wall)), &
                self%moment(4, size(self%wall)))
    end if
    do i = 1, size(self%wall)
      associate (w => mesh%wall(self%wall(i)))
        b(1:2, 1) = [mesh%x(w%at(1) - 1), mesh%y(w%at(2) - 1)]
        b(1:2, 2) = [mesh%x(w%at(1)), mesh%y(w%at(2))]
        if (any(b(1:2, 1) - max(c0(1:2), c1(1:2)) > self%radius) .or. &
            any(min(c0(1:2), c1(1:2)) - b(1:2, 2) > self%radius)) cycle
        call disc_moments(b(1:2, 1) - c0(1:2), b(1:2, 2) - c0(1:2), self%radius, m(1:2))
        call disc_moments(b(1:2, 1) - c1(1:2), b(1:2, 2) - c1(1:2), self%radius, m(3:4))
        if (maxval(m) <= 0.0_rp) cycle
        fraction = w%area/((b(1, 2) - b(1, 1))*(b(2, 2) - b(2, 1)))
        n = n + 1
        self%cell(n) = w%cell
        self%insulance(n) = w%depth/w%area
        self%moment(:, n) = fraction*m
      end associate
    end do
    self%n = n
  end subroutine move

  !> Set the capacities covered by a volume.
  subroutine cover_volume(self, mesh, c0, c1)
    class(heat_source_t), intent(inout) :: self
    type(heat_mesh_t), intent(in) :: mesh
    real(rp), intent(in) :: c0(3), c1(3)
    real(rp) :: width, x(3), m(2)
    integer :: c, pass, n

    do pass = 1, 2
      n = 0
      do c = 1, size(mesh%capacity)
        if (mesh%capacity(c) <= 0.0_rp) cycle
        x = mesh%centre(c)
        width = mesh%x(1) - mesh%x(0)
        m = [self%volume%weight(x - c0, width), self%volume%weight(x - c1, width)]
        if (all(m <= 0.0_rp)) cycle
        n = n + 1
        if (pass == 1) cycle
        m = m*mesh%capacity(c)
        self%cell(n) = c
        self%insulance(n) = 0.0_rp
        self%moment(:, n) = [m(1), 0.0_rp, m(2), 0.0_rp]
      end do
      if (pass == 1 .and. n > size(self%cell)) then
        deallocate (self%cell, self%insulance, self%moment)
        allocate (self%cell(n), self%insulance(n), self%moment(4, n))
      end if
    end do
    self%n = n
  end subroutine cover_volume

  !> Area m(1) [m2] and integral of the radius m(2) [m3] over the part of a rectangle inside a disc
  !> about the origin, by Gauss quadrature over chords.
  pure subroutine disc_moments(lower, upper, radius, m)
    real(rp), intent(in) :: lower(2), upper(2), radius
    real(rp), intent(out) :: m(2)
    real(rp), parameter :: g3(3) = [-0.774596669241483377_rp, 0.0_rp, 0.774596669241483377_rp]
    real(rp), parameter :: w3(3) = [5.0_rp, 8.0_rp, 5.0_rp]/18.0_rp
    real(rp) :: near(2), a, b, y, y0, y1, chord, width
    integer :: i, j, s, strips

    m = 0.0_rp
    near = max(lower, min(0.0_rp, upper))
    if (sum(near**2) >= radius**2) return
    ! only rows within the disc, where the chord is a smooth function
    y0 = max(lower(2), -radius)
    y1 = min(upper(2), radius)
    strips = merge(1, 3, sum(max(abs(lower), abs(upper))**2) <= radius**2)
    width = (y1 - y0)/strips
    do s = 0, strips - 1
      do i = 1, 3
        y = y0 + width*(s + 0.5_rp*(1.0_rp + g3(i)))
        chord = sqrt(max(0.0_rp, radius**2 - y**2))
        a = max(lower(1), -chord)
        b = min(upper(1), chord)
        if (b <= a) cycle
        m(1) = m(1) + w3(i)*width*(b - a)
        do j = 1, 3
          m(2) = m(2) + w3(i)*width*w3(j)*(b - a) &
                 *sqrt((0.5_rp*(a + b + (b - a)*g3(j)))**2 + y**2)
        end do
      end do
    end do
  end subroutine disc_moments

  !> Power into the cell of covered face or cell `i` at a fraction of the step.
  pure subroutine heat_of(self, i, step_fraction, t, resistivity, power, slope)
    class(heat_source_t), intent(in) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: step_fraction
    real(rp), intent(in) :: t                        !! temperature of the cell [K]
    real(rp), intent(in) :: resistivity              !! resistivity of the cell [m K/W]
    real(rp), intent(out) :: power                   !! [W]
    real(rp), intent(out) :: slope                   !! derivative of the power by temperature [W/K]
    integer, parameter :: max_iterations = 40
    real(rp) :: a, f, high, low, m1, tau, d, x
    integer :: n

    power = 0.0_rp
    slope = 0.0_rp
    if (self%kind /= kind_stir) then
      associate (all => self%total)
        if (all(1) > 0.0_rp) power = (1.0_rp - step_fraction)*self%power*self%moment(1, i)/all(1)
        if (all(2) > 0.0_rp) power = power + step_fraction*self%power*self%moment(3, i)/all(2)
      end associate
      return
    end if
    m1 = (1.0_rp - step_fraction)*self%moment(2, i) + step_fraction*self%moment(4, i)
    if (m1 <= 0.0_rp) return
    ! T_s - t - a tau(T_s) = 0 by Newton steps within a bracket
    a = self%spin*m1*self%insulance(i)*resistivity
    low = t
    high = t + a*self%max_shear
    x = t
    do n = 1, max_iterations
      call evaluate_curve(self%shear, x, tau, d)
      f = x - t - a*tau
      if (abs(f) <= 1.0e-9_rp .or. high - low <= 1.0e-9_rp) exit
      if (f > 0.0_rp) then
        high = x
      else
        low = x
      end if
      x = x - f/(1.0_rp - a*d)
      if (.not. (x > low .and. x < high)) x = 0.5_rp*(low + high)
    end do
    power = self%spin*m1*tau
    slope = self%spin*m1*min(d, 0.0_rp)/(1.0_rp - a*min(d, 0.0_rp))
  end subroutine heat_of

  !> Value and slope of a curve at `x`.
  pure subroutine evaluate_curve(curve, x, value, slope)
    type(curve_t), intent(in) :: curve
    real(rp), intent(in) :: x
    real(rp), intent(out) :: value, slope
    real(rp) :: s
    integer :: i

    s = (x - curve%first)/curve%step
    i = int(max(0.0_rp, min(s, real(size(curve%value) - 2, rp))))
    slope = curve%value(i + 2) - curve%value(i + 1)
    value = curve%value(i + 1) + (s - real(i, rp))*slope
    slope = slope/curve%step
  end subroutine evaluate_curve

end module heat_sources
