! SPDX-License-Identifier: MIT
!> Backward Euler for conduction between particles and nodes: nodal temperatures at the end of a
!> step by matrix-free conjugate gradients, built-in or of PETSc.
module heat_nodes_implicit
  use base_kinds, only: rp
  use boundary_symmetry, only: r_temperature, r_warming, restore
  use heat_exchange, only: contacts_t
  use heat_gaps, only: gaps_t
  use heat_linear, only: by_petsc, max_iterations
  use heat_nodes, only: gather_flux, stable_conduction, sum_all_nodes
  use heat_petsc, only: operator_t, solve_by_petsc
  use particles_store, only: particles_t
  use state_clock, only: clock_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use transfer_conduction, only: min_capacity
  implicit none (type, external)
  private

  public :: solve_implicit

  !> Linear operator C x - (F(x) - F(0)) on the free nodes, with nodal capacities C and the heat F
  !> of `gather_flux`.
  type, extends(operator_t) :: nodal_system_t
    type(scene_t), pointer :: scene => null()
    type(particles_t), pointer :: particles => null()
    type(nodes_t), pointer :: nodes => null()
    type(contacts_t), pointer :: contacts => null()
    type(gaps_t), pointer :: gaps => null()
    logical :: is_unsolved = .false.
    real(rp) :: dt = 0.0_rp                     !! conduction step [s]
    integer :: n = 1                            !! heat groups, each with all nodes
    real(rp), allocatable :: at_zero(:, :)      !! F(0) [J]
    logical, allocatable :: is_free(:, :)       !! nodes with an unknown temperature
    logical, allocatable :: is_own(:, :)        !! free nodes owned by this rank
    real(rp) :: min_residual = 0.0_rp           !! residual norm (weight 1/C) at rounding level
  contains
    procedure :: multiply => multiply_rows
    procedure, private :: apply
  end type nodal_system_t

contains

  !> Collective. Set lane 4 to the temperatures at the end of a backward Euler step, whose
  !> increments x solve C x - (F(x) - F(0)) = F(T) + pending heat. The nodes then receive the fluxes
  !> at these temperatures, so that heat is conserved whatever the tolerance. The next step is
  !> chosen from the error dt^2/2 d2T/dt2, filtered by a second solve. A failed solve sets
  !> `clock%now%is_unsolved` on all ranks.
  subroutine solve_implicit(scene, clock, particles, nodes, contacts, gaps, dt)
    type(scene_t), intent(in), target :: scene
    type(clock_t), intent(inout) :: clock
    type(particles_t), intent(in), target :: particles
    type(nodes_t), intent(inout), target :: nodes
    type(contacts_t), intent(inout), target :: contacts
    type(gaps_t), intent(in), target :: gaps
    real(rp), intent(in) :: dt                  !! conduction step [s]
    real(rp), parameter :: fine = 1.0e-8_rp, rough = 0.1_rp   ! relative residuals of the solution
                                                              ! and of the error filter
    real(rp), dimension(nodes%patch%nn, scene%n_heat_groups) :: before, b, error, x
    real(rp) :: lost(8, size(scene%symmetry))
    real(rp) :: worst(1)                        ! largest error [K]
    type(nodal_system_t) :: system
    integer :: k, n

    lost = nodes%boundary%mirrors%lost
    n = scene%n_heat_groups
    before = nodes%g(4, :, :n)
    call gather_flux(scene, particles, nodes, contacts, gaps, dt, .true.)
    b = nodes%g2(5, :, :n) + nodes%g(3, :, :n)
    call init_system(scene, particles, nodes, system, contacts, gaps, dt)
    where (.not. system%is_free) b = 0.0_rp
    call solve(system, fine, b, x)
    associate (method => scene%method)
      if (method%heat_interval == 0 .and. method%heat_step <= 0.0_rp) then
        b = merge(0.5_rp*(nodes%g(1, :, :n)*x - b), 0.0_rp, system%is_free)
        call solve(system, rough, b, error)
        worst = max(maxval(abs(error), mask=system%is_own), tiny(1.0_rp))
        call nodes%halo%world%max(worst)
        clock%heat_step = max(stable_conduction(scene), 0.2_rp*dt, &
                              min(1.5_rp*max(dt, clock%heat_step), &
                                  0.8_rp*dt*sqrt(method%heat_tolerance/worst(1))))
      end if
    end associate
    nodes%g(4, :, :n) = before + x
    if (system%is_unsolved) clock%now%is_unsolved = .true.
    do k = 1, n
      call restore(scene, nodes, r_temperature, nodes%g(:, :, k))
    end do
    nodes%boundary%mirrors%lost = lost
  end subroutine solve_implicit

  !> Set up the system of a step. Free nodes are those in use with a capacity, not behind a wall.
  subroutine init_system(scene, particles, nodes, system, contacts, gaps, dt)
    type(nodal_system_t), intent(out) :: system
    type(scene_t), intent(in), target :: scene
    type(particles_t), intent(in), target :: particles
    type(nodes_t), intent(inout), target :: nodes
    type(contacts_t), intent(inout), target :: contacts
    type(gaps_t), intent(in), target :: gaps
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp), parameter :: min_change = 1.0e-9_rp     ! rms temperature change at rounding level [K]
    real(rp) :: all(1)
    integer :: r

    system%scene => scene
    system%particles => particles
    system%nodes => nodes
    system%contacts => contacts
    system%gaps => gaps
    system%dt = dt
    system%n = scene%n_heat_groups
    allocate (system%is_free(nodes%patch%nn, system%n), system%is_own(nodes%patch%nn, system%n), &
              source=.false.)
    do r = 1, nodes%n_ranges
      associate (first => nodes%range(1, r), last => nodes%range(2, r))
        system%is_free(first:last, :) = nodes%g(1, first:last, :system%n) > min_capacity
        system%is_own(first:last, :) = nodes%range(3, r) == 1
      end associate
    end do
    system%is_free(nodes%boundary%mirrors%pair(1, :nodes%boundary%mirrors%n_pairs), :) = .false.
    system%is_own = system%is_own .and. system%is_free
    nodes%g(4, :, :system%n) = 0.0_rp
    call gather_flux(scene, particles, nodes, contacts, gaps, dt, .true.)
    system%at_zero = nodes%g2(5, :, :system%n)
    all = sum(nodes%g(1, :, :system%n), mask=system%is_own)
    call nodes%halo%world%sum(all)
    system%min_residual = min_change*sqrt(all(1))
  end subroutine init_system

  !> Collective. Solve for x on the free nodes, equal on all ranks that store a node, until the
  !> residual norm with weight 1/C falls to `relative` times that of b, or to rounding level.
  subroutine solve(system, relative, b, x)
    type(nodal_system_t), intent(inout) :: system
    real(rp), intent(in) :: relative            !! tolerance of the residual
    real(rp), intent(in) :: b(:, :)             !! right-hand side [J]
    real(rp), intent(out) :: x(:, :)            !! solution [K]
    real(rp), allocatable :: rows(:)
    integer :: iterations

    if (system%scene%method%heat_solver /= by_petsc) then
      call conjugate_gradients(system, relative, b, x)
      return
    end if
    allocate (rows(count(system%is_own)))
    call solve_by_petsc(system%nodes%halo%world, system, &
                        pack(system%nodes%g(1, :, :system%n), system%is_own), &
                        pack(b, system%is_own), relative, system%min_residual, rows, iterations)
    call scatter_rows(system, rows, x)
  end subroutine solve

  !> Conjugate gradients with diagonal preconditioning.
  subroutine conjugate_gradients(system, relative, b, x)
    type(nodal_system_t), intent(inout) :: system
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
    do i = 1, max_iterations
      q = 0.0_rp
      where (system%is_free) q = r/system%nodes%g(1, :, :system%n)
      rho = sum(r*q, mask=system%is_own)
      call system%nodes%halo%world%sum(rho)
      if (first < 0.0_rp) first = rho(1)
      if (rho(1) <= max(relative**2*first, system%min_residual**2)) return
      p = q + (rho(1)/last)*p
      last = rho(1)
      call system%apply(p, q)
      curvature = sum(p*q, mask=system%is_own)
      call system%nodes%halo%world%sum(curvature)
      if (.not. curvature(1) > 0.0_rp) exit
      x = x + (rho(1)/curvature(1))*p
      r = r - (rho(1)/curvature(1))*q
    end do
    if (rho(1) > 0.0_rp) system%is_unsolved = .true.   ! non-finite states are diagnosed elsewhere
  end subroutine conjugate_gradients

  !> Collective. Product q = A p on all nodes; p must be equal on all ranks that store a node.
  subroutine apply(self, p, q)
    class(nodal_system_t), intent(inout) :: self
    real(rp), intent(in) :: p(:, :)             !! vector [K]
    real(rp), intent(out) :: q(:, :)            !! product [J]
    integer :: k

    associate (g => self%nodes%g, n => self%n)
      g(4, :, :n) = p
      do k = 1, n
        call restore(self%scene, self%nodes, r_warming, g(:, :, k))
      end do
      call gather_flux(self%scene, self%particles, self%nodes, self%contacts, self%gaps, self%dt, &
                       .true.)
      q = merge(g(1, :, :n)*p - (self%nodes%g2(5, :, :n) - self%at_zero), 0.0_rp, self%is_free)
    end associate
  end subroutine apply

  !> Collective. Product on the rows of this rank.
  subroutine multiply_rows(self, x, y)
    class(nodal_system_t), intent(inout) :: self
    real(rp), intent(in) :: x(:)
    real(rp), intent(out) :: y(:)
    real(rp), dimension(size(self%is_own, 1), size(self%is_own, 2)) :: p, q

    call scatter_rows(self, x, p)
    call self%apply(p, q)
    y = pack(q, self%is_own)
  end subroutine multiply_rows

  !> Collective. Scatter row values of all ranks to all nodes stored here.
  subroutine scatter_rows(system, rows, all)
    class(nodal_system_t), intent(inout) :: system
    real(rp), intent(in) :: rows(:)
    real(rp), intent(out) :: all(:, :)
    integer :: k

    all = unpack(rows, system%is_own, 0.0_rp)
    do k = 1, system%n
      call sum_all_nodes(system%scene, system%nodes, 1, all(:, k))
    end do
  end subroutine scatter_rows

end module heat_nodes_implicit
