! SPDX-License-Identifier: MIT
!> Backward Euler for the conduction of the particles: the temperatures of the nodes at the end of a
!> step, by conjugate gradients without a matrix, of its own or of PETSc.
module heat_implicit
  use base_kinds, only: rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: r_temperature, r_warming, restore
  use comm_world, only: world_t
  use heat_gaps, only: gaps_t
  use heat_nodes, only: gather_flux, stable_conduction, sum_all_nodes
  use heat_sinks, only: touched_t
  use heat_solvers_method, only: by_petsc, most_iterations
  use heat_solvers_operator, only: operator_t
  use heat_solvers_petsc, only: solve_by_petsc
  use mapping_nodes, only: nodes_t
  use particles_store, only: particles_t
  use state_books, only: books_t, e_film
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  use transfer_conduction, only: least_capacity
  implicit none (type, external)
  private

  public :: foresee_temperature

  !> C - (F - F(0)) on the free nodes: C their capacities, F the heat that `gather_flux` finds.
  type, extends(operator_t) :: nodal_t
    type(world_t), pointer :: world => null()
    type(scene_t), pointer :: scene => null()
    type(particles_t), pointer :: particles => null()
    type(nodes_t), pointer :: nodes => null()
    type(boundary_t), pointer :: boundary => null()
    type(touched_t), pointer :: touched => null()
    type(gaps_t), pointer :: gaps => null()
    type(books_t), pointer :: books => null()
    logical :: is_unsolved = .false.
    real(rp) :: dt = 0.0_rp                     !! [s]
    integer :: n = 1                            !! groups of heat, each with all nodes
    real(rp), allocatable :: at_zero(:, :)      !! F(0) [J]
    logical, allocatable :: is_free(:, :)       !! has a temperature of its own
    logical, allocatable :: is_own(:, :)        !! such, and a row of this rank
    real(rp) :: nothing = 0.0_rp                !! residual, weighted by 1/C, that is rounding
  contains
    procedure :: multiply => multiply_rows
    procedure, private :: apply
  end type nodal_t

contains

  !> Collective. Lane 4 becomes the temperature at the end of a step of backward Euler: its change x
  !> solves C x - (F(x) - F(0)) = F(T) + waiting heat. The fluxes at the result are what the nodes
  !> get, so that heat is exact whatever the tolerance. The next step follows from dt^2/2 d2T/dt2,
  !> freed of its stiff part by another solve, and from what the heat of friction and plastic work
  !> that waited warms a node: until a step is made metal has the strength of its old temperature.
  !> What is not solved for is `step%is_unsolved`, on all ranks.
  subroutine foresee_temperature(world, scene, clock, step, particles, nodes, boundary, touched, &
                                 gaps, books, dt)
    type(world_t), intent(in), target :: world
    type(scene_t), intent(in), target :: scene
    type(clock_t), intent(inout), target :: clock
    type(step_t), intent(inout), target :: step
    type(particles_t), intent(in), target :: particles
    type(nodes_t), intent(inout), target :: nodes
    type(boundary_t), intent(in), target :: boundary
    type(touched_t), intent(inout), target :: touched
    type(gaps_t), intent(in), target :: gaps
    type(books_t), intent(inout), target :: books
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), parameter :: fine = 1.0e-8_rp, rough = 0.1_rp   ! residuals at the end
    real(rp), dimension(nodes%patch%nn, scene%n_heat_groups) :: before, b, error, x
    real(rp) :: lost(8, size(scene%symmetry)), film
    real(rp) :: worst(2)                        ! error, warming [K]
    type(nodal_t) :: system
    integer :: k, n

    lost = 0.0_rp
    film = books%sums(e_film)                     ! what is lost here is only tried
    n = scene%n_heat_groups
    before = nodes%g(4, :, :n)
    call gather_flux(world, scene, particles, nodes, boundary, touched, gaps, books, dt, lost)
    b = nodes%g2(5, :, :n) + nodes%g(3, :, :n)
    call start(system, world, scene, particles, nodes, boundary, touched, gaps, books, dt)
    where (.not. system%is_free) b = 0.0_rp
    call solve(system, fine, b, x)
    associate (method => scene%method)
      if (method%heat_every == 0 .and. method%heat_step <= 0.0_rp) then
        b = merge(0.5_rp*(nodes%g(1, :, :n)*x - b), 0.0_rp, system%is_free)
        call solve(system, rough, b, error)
        worst(1) = maxval(abs(error), mask=system%is_own)
        worst(2) = maxval(abs(nodes%g(3, :, :n))/max(nodes%g(1, :, :n), least_capacity), &
                          mask=system%is_own)
        worst = max(worst, tiny(1.0_rp))
        call world%max(worst)
        clock%heat_step = max(stable_conduction(scene), dt*max(0.2_rp, min(1.5_rp, &
                              0.8_rp*sqrt(method%heat_tolerance/worst(1)), &
                              method%heat_tolerance/worst(2))))
      end if
    end associate
    nodes%g(4, :, :n) = before + x
    if (system%is_unsolved) step%is_unsolved = .true.
    do k = 1, n
      call restore(scene, nodes, boundary, r_temperature, nodes%g(:, :, k))
    end do
    books%sums(e_film) = film
  end subroutine foresee_temperature

  !> The system of a step `dt`. Free are the nodes in use that are not empty nor behind a wall.
  subroutine start(system, world, scene, particles, nodes, boundary, touched, gaps, books, dt)
    type(nodal_t), intent(out) :: system
    type(world_t), intent(in), target :: world
    type(scene_t), intent(in), target :: scene
    type(particles_t), intent(in), target :: particles
    type(nodes_t), intent(inout), target :: nodes
    type(boundary_t), intent(in), target :: boundary
    type(touched_t), intent(inout), target :: touched
    type(gaps_t), intent(in), target :: gaps
    type(books_t), intent(inout), target :: books
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), parameter :: least_change = 1.0e-9_rp   ! of temperatures, rms [K]
    real(rp) :: lost(8, size(scene%symmetry)), all(1)
    integer :: r

    system%world => world
    system%scene => scene
    system%particles => particles
    system%nodes => nodes
    system%boundary => boundary
    system%touched => touched
    system%gaps => gaps
    system%books => books
    system%dt = dt
    system%n = scene%n_heat_groups
    allocate (system%is_free(nodes%patch%nn, system%n), system%is_own(nodes%patch%nn, system%n), &
              source=.false.)
    do r = 1, nodes%n_ranges
      associate (first => nodes%range(1, r), last => nodes%range(2, r))
        system%is_free(first:last, :) = nodes%g(1, first:last, :system%n) > least_capacity
        system%is_own(first:last, :) = nodes%range(3, r) == 1
      end associate
    end do
    system%is_free(boundary%mirrors%pair(1, :boundary%mirrors%n_pairs), :) = .false.
    system%is_own = system%is_own .and. system%is_free
    lost = 0.0_rp
    nodes%g(4, :, :system%n) = 0.0_rp
    call gather_flux(world, scene, particles, nodes, boundary, touched, gaps, books, dt, lost)
    system%at_zero = nodes%g2(5, :, :system%n)
    all = sum(nodes%g(1, :, :system%n), mask=system%is_own)
    call world%sum(all)
    system%nothing = least_change*sqrt(all(1))
  end subroutine start

  !> Collective. X for b on free nodes, the same on all ranks that store one, until the residual
  !> weighted by 1/C is `relative` of that of b, or rounding.
  subroutine solve(system, relative, b, x)
    type(nodal_t), intent(inout) :: system
    real(rp), intent(in) :: relative, b(:, :)      !! [J]
    real(rp), intent(out) :: x(:, :)            !! [K]
    real(rp), allocatable :: rows(:)
    integer :: iterations

    if (system%scene%method%heat_solver /= by_petsc) then
      call conjugate_gradients(system, relative, b, x)
      return
    end if
    allocate (rows(count(system%is_own)))
    call solve_by_petsc(system%world, system, pack(system%nodes%g(1, :, :system%n), &
                                                            system%is_own), &
                        pack(b, system%is_own), relative, system%nothing, rows, iterations)
    call tell_all(system, rows, x)
  end subroutine solve

  !> The solver of a program without PETSc.
  subroutine conjugate_gradients(system, relative, b, x)
    type(nodal_t), intent(inout) :: system
    real(rp), intent(in) :: relative, b(:, :)
    real(rp), intent(out) :: x(:, :)
    real(rp), dimension(size(b, 1), size(b, 2)) :: p, q, r
    real(rp) :: rho(1), first, last, curvature(1)
    integer :: i

    x = 0.0_rp
    p = 0.0_rp
    r = b
    first = -1.0_rp
    last = 1.0_rp
    do i = 1, most_iterations
      q = 0.0_rp
      where (system%is_free) q = r/system%nodes%g(1, :, :system%n)
      rho = sum(r*q, mask=system%is_own)
      call system%world%sum(rho)
      if (first < 0.0_rp) first = rho(1)
      if (rho(1) <= max(relative**2*first, system%nothing**2)) return
      p = q + (rho(1)/last)*p
      last = rho(1)
      call system%apply(p, q)
      curvature = sum(p*q, mask=system%is_own)
      call system%world%sum(curvature)
      if (.not. curvature(1) > 0.0_rp) exit
      x = x + (rho(1)/curvature(1))*p
      r = r - (rho(1)/curvature(1))*q
    end do
    if (rho(1) > 0.0_rp) system%is_unsolved = .true.   ! what is not a number is for others to find
  end subroutine conjugate_gradients

  !> Collective. Q = A p on all nodes, from the same p on all ranks that store a node.
  subroutine apply(self, p, q)
    class(nodal_t), intent(inout) :: self
    real(rp), intent(in) :: p(:, :)             !! [K]
    real(rp), intent(out) :: q(:, :)            !! [J]
    real(rp) :: lost(8, size(self%scene%symmetry))
    integer :: k

    lost = 0.0_rp
    associate (g => self%nodes%g, n => self%n)
      g(4, :, :n) = p
      do k = 1, n
        call restore(self%scene, self%nodes, self%boundary, r_warming, g(:, :, k))
      end do
      call gather_flux(self%world, self%scene, self%particles, self%nodes, self%boundary, &
                       self%touched, self%gaps, self%books, self%dt, lost)
      q = merge(g(1, :, :n)*p - (self%nodes%g2(5, :, :n) - self%at_zero), 0.0_rp, self%is_free)
    end associate
  end subroutine apply

  !> The same on the rows of this rank.
  subroutine multiply_rows(self, x, y)
    class(nodal_t), intent(inout) :: self
    real(rp), intent(in) :: x(:)
    real(rp), intent(out) :: y(:)
    real(rp), dimension(size(self%is_own, 1), size(self%is_own, 2)) :: p, q

    call tell_all(self, x, p)
    call self%apply(p, q)
    y = pack(q, self%is_own)
  end subroutine multiply_rows

  !> Collective. Values of the rows of this rank on all nodes, those of other ranks among them.
  subroutine tell_all(system, rows, all)
    class(nodal_t), intent(inout) :: system
    real(rp), intent(in) :: rows(:)
    real(rp), intent(out) :: all(:, :)
    integer :: k

    all = unpack(rows, system%is_own, 0.0_rp)
    do k = 1, system%n
      call sum_all_nodes(system%world, system%scene, system%nodes, 1, all(:, k))
    end do
  end subroutine tell_all

end module heat_implicit
