! SPDX-License-Identifier: MIT
!> Backward Euler for the conduction of the particles: the temperatures of the nodes at the end of a
!> step, by conjugate gradients without a matrix, of its own or of PETSc.
module time_heat_implicit
  use base_kinds, only: rp
  use comm_world, only: world_t
  use thermal_conduction, only: least_capacity
  use thermal_method, only: by_petsc, most_iterations
  use thermal_operator, only: operator_t
  use thermal_petsc, only: solve_by_petsc
  use time_audit, only: e_film
  use time_heat_nodes, only: gather_flux, stable_conduction, sum_all_nodes
  use time_mirrors, only: r_temperature, r_warming, unfold
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: foresee_temperature

  !> C - (F - F(0)) on the free nodes: C their capacities, F the heat that `gather_flux` finds.
  type, extends(operator_t) :: nodal_t
    type(world_t), pointer :: world => null()
    type(simulation_t), pointer :: sim => null()
    real(rp) :: dt = 0.0_rp                     !! [s]
    real(rp), allocatable :: at_zero(:)         !! F(0) [J]
    logical, allocatable :: is_free(:)          !! has a temperature of its own
    logical, allocatable :: is_own(:)           !! such, and a row of this rank
    real(rp) :: nothing = 0.0_rp                !! residual, weighted by 1/C, that is rounding
  contains
    procedure :: multiply => multiply_rows
    procedure, private :: apply
  end type nodal_t

contains

  !> Collective: lane 4 becomes the temperature at the end of a step of backward Euler: its change x
  !> solves C x - (F(x) - F(0)) = F(T) + waiting heat. The fluxes at the result are what the nodes
  !> get, so that heat is exact whatever the tolerance. The next step follows from dt^2/2 d2T/dt2,
  !> freed of its stiff part by another solve. What is not solved for is `sim%is_unsolved`, on all ranks.
  subroutine foresee_temperature(world, sim, dt)
    type(world_t), intent(in), target :: world
    type(simulation_t), intent(inout), target :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), parameter :: fine = 1.0e-8_rp, rough = 0.1_rp   ! residuals at the end
    real(rp), dimension(sim%patch%nn) :: before, b, error, x
    real(rp) :: lost(8, size(sim%scene%constraint)), film, worst(1)
    type(nodal_t) :: system

    lost = 0.0_rp
    film = sim%sums(e_film)                     ! what is lost here is only tried
    before = sim%g(4, :, 1)
    call gather_flux(world, sim, dt, lost)
    b = sim%g2(5, :, 1) + sim%g(3, :, 1)
    call start(system, world, sim, dt)
    where (.not. system%is_free) b = 0.0_rp
    call solve(system, fine, b, x)
    associate (method => sim%scene%method)
      if (method%heat_every == 0 .and. method%heat_step <= 0.0_rp) then
        b = merge(0.5_rp*(sim%g(1, :, 1)*x - b), 0.0_rp, system%is_free)
        call solve(system, rough, b, error)
        worst = maxval(abs(error), mask=system%is_own)
        worst = max(worst, tiny(1.0_rp))
        call world%max(worst)
        sim%clock%heat_step = max(stable_conduction(sim), dt*max(0.2_rp, &
          min(1.5_rp, 0.8_rp*sqrt(method%heat_tolerance/worst(1)))))
      end if
    end associate
    sim%g(4, :, 1) = before + x
    call unfold(sim, r_temperature, sim%g(:, :, 1))
    sim%sums(e_film) = film
  end subroutine foresee_temperature

  !> The system of a step `dt`. Free are the nodes in use that are not empty nor behind a wall.
  subroutine start(system, world, sim, dt)
    type(nodal_t), intent(out) :: system
    type(world_t), intent(in), target :: world
    type(simulation_t), intent(inout), target :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), parameter :: least_change = 1.0e-9_rp   ! of temperatures, rms [K]
    real(rp) :: lost(8, size(sim%scene%constraint)), all(1)
    integer :: r

    system%world => world
    system%sim => sim
    system%dt = dt
    allocate (system%is_free(sim%patch%nn), system%is_own(sim%patch%nn), source=.false.)
    do r = 1, sim%n_runs
      associate (first => sim%run(1, r), last => sim%run(2, r))
        system%is_free(first:last) = sim%g(1, first:last, 1) > least_capacity
        system%is_own(first:last) = sim%run(3, r) == 1
      end associate
    end do
    system%is_free(sim%mirrors%pair(1, :sim%mirrors%n_pairs)) = .false.
    system%is_own = system%is_own .and. system%is_free
    lost = 0.0_rp
    sim%g(4, :, 1) = 0.0_rp
    call gather_flux(world, sim, dt, lost)
    system%at_zero = sim%g2(5, :, 1)
    all = sum(sim%g(1, :, 1), mask=system%is_own)
    call world%sum(all)
    system%nothing = least_change*sqrt(all(1))
  end subroutine start

  !> Collective: x for b on free nodes, the same on all ranks that store one, until the residual
  !> weighted by 1/C is `relative` of that of b, or rounding.
  subroutine solve(system, relative, b, x)
    type(nodal_t), intent(inout) :: system
    real(rp), intent(in) :: relative, b(:)      !! [J]
    real(rp), intent(out) :: x(:)               !! [K]
    real(rp), allocatable :: rows(:)
    integer :: iterations

    if (system%sim%scene%method%heat_solver /= by_petsc) then
      call conjugate_gradients(system, relative, b, x)
      return
    end if
    allocate (rows(count(system%is_own)))
    call solve_by_petsc(system%world, system, pack(system%sim%g(1, :, 1), system%is_own), &
                        pack(b, system%is_own), relative, system%nothing, rows, &
                        iterations)
    call tell_all(system, rows, x)
  end subroutine solve

  !> The solver of a program without PETSc.
  subroutine conjugate_gradients(system, relative, b, x)
    type(nodal_t), intent(inout) :: system
    real(rp), intent(in) :: relative, b(:)
    real(rp), intent(out) :: x(:)
    real(rp), dimension(size(b)) :: p, q, r
    real(rp) :: rho(1), first, last, curvature(1)
    integer :: i

    x = 0.0_rp
    p = 0.0_rp
    r = b
    first = -1.0_rp
    last = 1.0_rp
    do i = 1, most_iterations
      q = 0.0_rp
      where (system%is_free) q = r/system%sim%g(1, :, 1)
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
    if (rho(1) > 0.0_rp) system%sim%is_unsolved = .true.   ! what is not a number is for others to find
  end subroutine conjugate_gradients

  !> Collective: q = A p on all nodes, from the same p on all ranks that store a node.
  subroutine apply(self, p, q)
    class(nodal_t), intent(inout) :: self
    real(rp), intent(in) :: p(:)                !! [K]
    real(rp), intent(out) :: q(:)               !! [J]
    real(rp) :: lost(8, size(self%sim%scene%constraint))

    lost = 0.0_rp
    associate (sim => self%sim)
      sim%g(4, :, 1) = p
      call unfold(sim, r_warming, sim%g(:, :, 1))
      call gather_flux(self%world, sim, self%dt, lost)
      q = merge(sim%g(1, :, 1)*p - (sim%g2(5, :, 1) - self%at_zero), 0.0_rp, self%is_free)
    end associate
  end subroutine apply

  !> The same on the rows of this rank.
  subroutine multiply_rows(self, x, y)
    class(nodal_t), intent(inout) :: self
    real(rp), intent(in) :: x(:)
    real(rp), intent(out) :: y(:)
    real(rp), dimension(size(self%is_own)) :: p, q

    call tell_all(self, x, p)
    call self%apply(p, q)
    y = pack(q, self%is_own)
  end subroutine multiply_rows

  !> Collective: values of the rows of this rank on all nodes, those of other ranks among them.
  subroutine tell_all(system, rows, all)
    class(nodal_t), intent(inout) :: system
    real(rp), intent(in) :: rows(:)
    real(rp), intent(out) :: all(:)

    all = unpack(rows, system%is_own, 0.0_rp)
    call sum_all_nodes(system%world, system%sim, 1, all)
  end subroutine tell_all

end module time_heat_implicit
