! SPDX-License-Identifier: MIT
!> Right-hand side of conduction on a mesh:
!> C dtheta/dt = sum k A (phi_j - phi_i)/d - sum A (T - T_amb)/(1/h + d/k) + sources, with the state
!> theta and potential phi of heat_curve; the sum of C theta is the heat content.
module heat_rates
  use base_kinds, only: rp
  use base_world, only: world_t
  use heat_curve, only: property_t
  use heat_mesh, only: heat_mesh_t
  use heat_sources, only: heat_source_t, kind_stir, wall_films_t
  implicit none (type, external)
  private

  public :: heat_t, b_source, b_film, n_heats

  integer, parameter :: b_source = 1, b_film = 2, n_heats = 2  !! indices of powers [W] or heats [J]

  !> Mesh, properties, boundary conditions, sources and state of a conduction problem.
  type :: heat_t
    type(world_t) :: world
    type(heat_mesh_t) :: mesh
    type(property_t) :: property
    real(rp), allocatable :: conductivity(:)  !! conductivity of each body [W/(m K)], if constant
    type(wall_films_t) :: film
    type(heat_source_t), allocatable :: source(:)
    logical, allocatable :: is_on(:)              !! active sources in the current step
    real(rp), allocatable :: theta(:)             !! (1-np:np(nx+1)) state [K]
    real(rp) :: max_decay_rate = 0.0_rp           !! upper bound of the decay rates [1/s]
    integer :: evaluations = 0                    !! evaluations of the rates so far
    real(rp), allocatable, private :: phi(:), temperature(:)   !! fields for variable properties [K]
  contains
    procedure :: prepare, add_films, set_sources, fill, rate, stage, slope, conduct, temperatures
    procedure :: content, size => field_size
  end type heat_t

contains

  !> Number of own cells.
  pure integer function field_size(self)
    class(heat_t), intent(in) :: self

    field_size = self%mesh%np*self%mesh%nx
  end function field_size

  !> Allocate fields and compute bounds. Mesh, properties and films must have been set.
  subroutine prepare(self, world)
    class(heat_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    real(rp), allocatable :: rate(:, :)
    real(rp) :: largest(1), loss(self%size()), factor
    integer :: c, i, n

    self%world = world
    n = self%size()
    allocate (self%theta(1 - self%mesh%np:n + self%mesh%np), source=298.0_rp)
    if (.not. self%property%is_constant) then
      allocate (self%phi(1 - self%mesh%np:n + self%mesh%np), source=298.0_rp)
      allocate (self%temperature(n), source=298.0_rp)
    end if
    allocate (rate(6, n))
    call self%mesh%all_rates(rate)
    loss = 0.0_rp
    do i = 1, self%film%n
      c = self%film%cell(i)
      factor = 1.0_rp
      if (self%film%radiation(i) > 0.0_rp) factor = diffusivity_ratio(self%property)
      loss(c) = loss(c) + factor*self%film%max_conductance(i)/self%mesh%capacity(c)
    end do
    largest = 0.0_rp
    if (n > 0) largest = maxval(2.0_rp*sum(rate, dim=1)*diffusivity_ratio(self%property) + loss)
    call world%max(largest)
    self%max_decay_rate = largest(1)
    allocate (self%is_on(size(self%source)), source=.false.)
    do i = 1, size(self%source)
      call self%source(i)%find_walls(self%mesh)
    end do
  end subroutine prepare

  !> Ratio of the largest to the reference diffusivity.
  pure real(rp) function diffusivity_ratio(property)
    type(property_t), intent(in) :: property

    diffusivity_ratio = 1.0_rp
    if (.not. property%is_constant) diffusivity_ratio = &
      maxval(1.0_rp/(property%resistivity%value*property%k_ref*property%capacity%value))
  end function diffusivity_ratio

  !> Set film coefficients, radiation and ambient temperatures by direction and body.
  subroutine add_films(self, coefficient, radiation, ambient)
    class(heat_t), intent(inout) :: self
    real(rp), intent(in) :: coefficient(:, :)  !! (6, bodies) heat-transfer coefficient [W/(m2 K)]
    real(rp), intent(in) :: radiation(:, :)       !! (6, bodies) emissivity times sigma [W/(m2 K4)]
    real(rp), intent(in) :: ambient(:, :)         !! (6, bodies) ambient temperature [K]

    call self%film%init(self%mesh%wall, self%mesh%capacity, self%conductivity, coefficient, &
                        radiation, ambient)
  end subroutine add_films

  !> Collective. Set the cells covered by the sources in a step, within which none may begin or end.
  subroutine set_sources(self, t, t_end)
    class(heat_t), intent(inout) :: self
    real(rp), intent(in) :: t, t_end              !! start and end of the step [s]
    integer :: i

    do i = 1, size(self%source)
      self%is_on(i) = self%source(i)%is_on(t)
      if (.not. self%is_on(i)) cycle
      associate (s => self%source(i))
        call s%move(self%mesh, t, t_end)
        if (s%kind == kind_stir) cycle
        s%total = sum(s%moment(1:3:2, :s%n), dim=2)
        call self%world%sum(s%total)
      end associate
    end do
  end subroutine set_sources

  !> Temperatures of the own cells for a state.
  subroutine temperatures(self, y, t)
    class(heat_t), intent(in) :: self
    real(rp), intent(in) :: y(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1))
    real(rp), intent(out) :: t(self%mesh%np*self%mesh%nx)

    t = y(1:size(t))
    if (self%property%is_constant) return
    t = self%property%temperature%at(y(1:size(t)))
  end subroutine temperatures

  !> Heat content of this rank relative to `datum` [K], in J.
  pure real(rp) function content(self, y, datum)
    class(heat_t), intent(in) :: self
    real(rp), intent(in) :: y(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1)), datum

    content = sum(self%mesh%capacity*(y(1:self%mesh%np*self%mesh%nx) - datum))
  end function content

  !> Rate dtheta/dt [K/s] of a state at a fraction of the step, and the powers of this rank.
  subroutine rate(self, y, step_fraction, dydt, power)
    class(heat_t), intent(inout) :: self
    real(rp), intent(inout) :: y(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1))
    real(rp), intent(in) :: step_fraction
    real(rp), intent(out) :: dydt(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1))
    real(rp), intent(out) :: power(n_heats)       !! [W]

    dydt = 0.0_rp
    call self%fill(y)
    call self%stage([0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp], y, dydt, y, y, step_fraction, power)
    dydt(self%mesh%void) = 0.0_rp
  end subroutine rate

  !> Collective. Fill the halo planes of a state before `stage`.
  subroutine fill(self, y)
    class(heat_t), intent(in) :: self
    real(rp), intent(inout) :: y(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1))

    if (self%property%is_constant) call self%mesh%swap(self%world, y)
  end subroutine fill

  !> Stage of an explicit scheme, out = a1 y + a2 out + a3 y0 + a4 dtheta/dt(y) + a5 m0, and the
  !> powers at y.
  subroutine stage(self, a, y, out, y0, m0, step_fraction, power)
    class(heat_t), intent(inout) :: self
    real(rp), intent(in) :: a(5)
    real(rp), intent(in), dimension(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1)) :: y, y0, m0
    real(rp), intent(inout) :: out(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1))
    real(rp), intent(in) :: step_fraction
    real(rp), intent(out) :: power(n_heats)
    integer :: n

    n = self%size()
    self%evaluations = self%evaluations + 1
    if (self%property%is_constant) then
      call sweep_all(self%mesh, a, y, y, out, y0, m0)
      call add_walls(self, n, a(4), y(1:n), out(1:n), step_fraction, power)
    else
      self%phi(1:n) = self%property%potential%at(y(1:n))
      self%temperature = self%property%temperature%at(y(1:n))
      call self%mesh%swap(self%world, self%phi)
      call sweep_all(self%mesh, a, self%phi, y, out, y0, m0)
      call add_walls(self, n, a(4), self%temperature, out(1:n), step_fraction, power)
    end if
  end subroutine stage

  !> Collective. Conduction alone, out = dtheta/dt of a potential, whose halo is filled here. `out`
  !> must be finite on entry.
  subroutine conduct(self, phi, out)
    class(heat_t), intent(in) :: self
    real(rp), intent(inout), dimension(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1)) :: phi, out

    call self%mesh%swap(self%world, phi)
    call sweep_all(self%mesh, [0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp], phi, phi, out, phi, phi)
  end subroutine conduct

  !> Conductive rates: uncut cells by lines, then corrections of irregular cells.
  subroutine sweep_all(mesh, a, phi, y, out, y0, m0)
    type(heat_mesh_t), intent(in) :: mesh
    real(rp), intent(in) :: a(5)
    real(rp), intent(in), dimension(1 - mesh%np:mesh%np*(mesh%nx + 1)) :: phi, y, y0, m0
    real(rp), intent(inout) :: out(1 - mesh%np:mesh%np*(mesh%nx + 1))
    real(rp) :: kept(size(mesh%irregular)), r
    integer :: c, i

    if (mesh%nx == 0) return
    kept = out(mesh%irregular)
    call sweep(mesh, a, phi, y, out, y0, m0)
    do i = 1, size(mesh%irregular)
      c = mesh%irregular(i)
      associate (q => mesh%irregular_rate(:, i))
        r = q(1)*(phi(c - mesh%np) - phi(c)) + q(2)*(phi(c + mesh%np) - phi(c)) &
            + q(3)*(phi(c - mesh%n(3)) - phi(c)) + q(4)*(phi(c + mesh%n(3)) - phi(c)) &
            + q(5)*(phi(c - 1) - phi(c)) + q(6)*(phi(c + 1) - phi(c))
      end associate
      out(c) = a(1)*y(c) + a(2)*kept(i) + a(3)*y0(c) + a(4)*r + a(5)*m0(c)
    end do
  end subroutine sweep_all

  !> Conductive rates of all cells as if uncut. At the ends a rate of 0 multiplies neighbouring
  !> memory.
  subroutine sweep(mesh, a, phi, y, out, y0, m0)
    type(heat_mesh_t), intent(in) :: mesh
    real(rp), intent(in) :: a(5)
    real(rp), intent(in), dimension(1 - mesh%np:mesh%np*(mesh%nx + 1)) :: phi, y, y0, m0
    real(rp), intent(inout) :: out(1 - mesh%np:mesh%np*(mesh%nx + 1))
    real(rp) :: f, r
    integer :: c, i, np, nz, o

    np = mesh%np
    nz = mesh%n(3)
    do i = 1, mesh%nx
      o = (i - 1)*np
      !$omp simd private(f, r)
      do c = 1, np
        f = phi(o + c)
        r = mesh%xm(i)*(phi(o + c - np) - f) + mesh%xp(i)*(phi(o + c + np) - f) &
            + mesh%ym(c)*(phi(o + c - nz) - f) + mesh%yp(c)*(phi(o + c + nz) - f) &
            + mesh%zm(c)*(phi(o + c - 1) - f) + mesh%zp(c)*(phi(o + c + 1) - f)
        out(o + c) = a(1)*y(o + c) + a(2)*out(o + c) + a(3)*y0(o + c) + a(4)*r + a(5)*m0(o + c)
      end do
    end do
  end subroutine sweep

  !> Add `factor` times the rates of films and sources to `out`.
  subroutine add_walls(self, n, factor, t, out, step_fraction, power)
    class(heat_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: factor, t(n), step_fraction
    real(rp), intent(inout) :: out(n)
    real(rp), intent(out) :: power(n_heats)
    real(rp) :: heat, slope
    integer :: c, i, s

    power = 0.0_rp
    if (self%property%is_constant .and. .not. self%film%radiates) then
      call add_constant_films(self%film, factor, t, out, power(b_film))
    else
      do i = 1, self%film%n
        c = self%film%cell(i)
        call self%film%loss(i, t(c), resistivity(self, c, t(c)), heat, slope)
        out(c) = out(c) - factor*heat/self%mesh%capacity(c)
        power(b_film) = power(b_film) + heat
      end do
    end if
    do s = 1, size(self%source)
      if (.not. self%is_on(s)) cycle
      do i = 1, self%source(s)%n
        c = self%source(s)%cell(i)
        call self%source(s)%heat_of(i, step_fraction, t(c), resistivity(self, c, t(c)), heat, slope)
        out(c) = out(c) + factor*heat/self%mesh%capacity(c)
        power(b_source) = power(b_source) + heat
      end do
    end do
  end subroutine add_walls

  !> Add the rates of films with constant conductance.
  pure subroutine add_constant_films(film, factor, t, out, power)
    type(wall_films_t), intent(in) :: film
    real(rp), intent(in) :: factor, t(:)
    real(rp), intent(inout) :: out(:), power
    real(rp) :: excess
    integer :: c, i

    do i = 1, film%n
      c = film%cell(i)
      excess = t(c) - film%ambient(i)
      out(c) = out(c) - factor*film%per_capacity(i)*excess
      power = power + film%conductance(i)*excess
    end do
  end subroutine add_constant_films

  !> Thermal resistivity 1/k of a cell at a temperature [m K/W].
  pure real(rp) function resistivity(self, c, t)
    class(heat_t), intent(in) :: self
    integer, intent(in) :: c
    real(rp), intent(in) :: t

    if (self%property%is_constant) then
      resistivity = 1.0_rp/self%conductivity(self%mesh%body(c))
    else
      resistivity = self%property%resistivity%at(t)
    end if
  end function resistivity

  !> Derivative of the boundary heat flow into each cell by its temperature [W/K], at most 0.
  subroutine slope(self, y, step_fraction, d)
    class(heat_t), intent(in) :: self
    real(rp), intent(in) :: y(1 - self%mesh%np:self%mesh%np*(self%mesh%nx + 1)), step_fraction
    real(rp), intent(out) :: d(self%mesh%np*self%mesh%nx)
    real(rp) :: heat, t, one
    integer :: c, i, s

    d = 0.0_rp
    do i = 1, self%film%n
      c = self%film%cell(i)
      t = self%property%temperature_at(y(c))
      call self%film%loss(i, t, resistivity(self, c, t), heat, one)
      d(c) = d(c) - one
    end do
    do s = 1, size(self%source)
      if (.not. self%is_on(s)) cycle
      do i = 1, self%source(s)%n
        c = self%source(s)%cell(i)
        t = self%property%temperature_at(y(c))
        call self%source(s)%heat_of(i, step_fraction, t, resistivity(self, c, t), heat, one)
        d(c) = d(c) + one
      end do
    end do
  end subroutine slope

end module heat_rates
