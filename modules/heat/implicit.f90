! SPDX-License-Identifier: MIT
!> Implicit steps: backward Euler, and TR-BDF2 as a diagonally implicit Runge-Kutta scheme (Hosea &
!> Shampine 1996, Appl. Numer. Math. 20, 21), L-stable and of order 2. Stages are solved by Newton's
!> method; the new state follows from the fluxes at the stages, so that heat is conserved whatever
!> the tolerances.
module heat_implicit
  use base_kinds, only: rp
  use heat_linear, only: backward_euler, by_petsc, linear_t, tr_bdf2
  use heat_rates, only: heat_t, n_heats
  implicit none (type, external)
  private

  public :: implicit_t, order_of

  integer, parameter :: max_newton = 12
  real(rp), parameter :: root2 = sqrt(2.0_rp)
  !> gamma, end of the first stage as a fraction of the step.
  real(rp), parameter :: first_end = 2.0_rp - root2
  real(rp), parameter :: diagonal = 0.5_rp*first_end     !! d, diagonal coefficient of the scheme
  real(rp), parameter :: weight = 0.25_rp*root2          !! w, weight of the first two stages
  real(rp), parameter :: error_weight(3) = [(4.0_rp*weight - 1.0_rp)/3.0_rp, -1.0_rp/3.0_rp, &
                                            2.0_rp*diagonal/3.0_rp]

  !> State of the implicit integrator.
  type :: implicit_t
    integer :: method = tr_bdf2
    integer :: solver = 0                         !! by_cg, by_fft, by_petsc
    real(rp) :: tolerance = 1.0e-3_rp             !! residual of a stage [K]
    integer :: newtons = 0                        !! Newton steps so far
    logical :: has_failed = .false.               !! a stage of the last step did not converge
    type(linear_t) :: linear
    logical, private :: has_mean = .false.
    real(rp), allocatable, private, dimension(:) :: m2, f, base, d, scale, y, rhs, x
    real(rp), allocatable, private :: mean(:)     !! mean rate of the last step [K/s]
  contains
    procedure :: start, step, save_mean_rate, estimate, pack_restart_data, unpack_restart_data
  end type implicit_t

contains

  !> Order of a method; backward Euler has 1, all others of which errors are estimated 2.
  pure real(rp) function order_of(method)
    integer, intent(in) :: method

    order_of = merge(1.0_rp, 2.0_rp, method == backward_euler)
  end function order_of

  !> Allocate the fields and start the linear solver.
  subroutine start(self, heat, method)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    integer, intent(in) :: method
    integer :: lo, hi, n

    self%method = method
    lo = lbound(heat%theta, 1)
    hi = ubound(heat%theta, 1)
    n = heat%size()
    allocate (self%m2(lo:hi), self%f(lo:hi), self%base(lo:hi), self%y(lo:hi), source=0.0_rp)
    allocate (self%d(n), self%scale(n), self%rhs(n), self%x(n), self%mean(n), source=0.0_rp)
    self%scale = 1.0_rp
    call self%linear%start(heat, self%solver)
  end subroutine start

  !> One step from state `y0` with rates `m0` and powers `p0` at its start.
  subroutine step(self, heat, dt, y0, m0, p0, gain)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: dt                    !! time step [s]
    real(rp), allocatable, intent(in) :: y0(:)    !! state at the start [K]
    real(rp), allocatable, intent(in) :: m0(:)    !! rates at the start [K/s]
    real(rp), intent(in) :: p0(n_heats)           !! powers of sources and films at the start [W]
    real(rp), intent(out) :: gain(n_heats)        !! heat of the step [J]
    real(rp) :: p(n_heats)
    integer :: n

    n = heat%size()
    self%has_failed = .false.
    self%y = y0
    if (self%method == backward_euler) then
      self%base = y0
      if (self%has_mean) self%y(1:n) = y0(1:n) + dt*self%mean
      call solve_stage(self, heat, dt, 1.0_rp, p)
      heat%theta = y0 + dt*self%f
      gain = dt*p
      return
    end if
    self%base = y0 + diagonal*dt*m0
    if (self%has_mean) self%y(1:n) = y0(1:n) + first_end*dt*self%mean
    call solve_stage(self, heat, diagonal*dt, first_end, p)
    self%m2 = self%f
    self%base = y0 + weight*dt*(m0 + self%m2)
    self%y = y0 + (self%y - y0)/first_end
    gain = weight*dt*(p0 + p)
    call solve_stage(self, heat, diagonal*dt, 1.0_rp, p)
    heat%theta = self%base + diagonal*dt*self%f
    gain = gain + diagonal*dt*p
  end subroutine step

  !> Store the mean rate of an accepted step, which predicts the next one.
  subroutine save_mean_rate(self, heat, dt, y0)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: dt
    real(rp), allocatable, intent(in) :: y0(:)
    integer :: n

    n = heat%size()
    self%mean = (heat%theta(1:n) - y0(1:n))/dt
    self%has_mean = .true.
  end subroutine save_mean_rate

  !> Data for a restart: mean rate of the last step, and the data of the preconditioner.
  subroutine pack_restart_data(self, fields, numbers)
    class(implicit_t), intent(in) :: self
    real(rp), intent(out) :: fields(:, :), numbers(2)      !! (cells, 2)

    fields = 0.0_rp
    if (self%has_mean) fields(:, 1) = self%mean
    numbers(1) = merge(1.0_rp, 0.0_rp, self%has_mean)
    call self%linear%petsc%pack_restart_data(fields(:, 2), numbers(2))
  end subroutine pack_restart_data

  !> Collective. Restore the data of `pack_restart_data`.
  subroutine unpack_restart_data(self, fields, numbers)
    class(implicit_t), intent(inout) :: self
    real(rp), intent(in) :: fields(:, :), numbers(2)

    self%has_mean = numbers(1) > 0.0_rp
    self%mean = fields(:, 1)
    if (self%linear%solver == by_petsc) then
      call self%linear%petsc%unpack_restart_data(fields(:, 2), numbers(2))
    end if
  end subroutine unpack_restart_data

  !> Collective. Solve the stage y = base + a f(y) at a fraction of the step by an inexact Newton
  !> method; returns the rates f and the powers p at y.
  subroutine solve_stage(self, heat, a, step_fraction, p)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: a                     !! coefficient of the rate [s]
    real(rp), intent(in) :: step_fraction
    real(rp), intent(out) :: p(n_heats)
    real(rp) :: worst(1), before, relative
    integer :: k, n

    n = heat%size()
    before = huge(1.0_rp)
    do k = 1, max_newton
      call heat%rate(self%y, step_fraction, self%f, p)
      call residual(n, a, heat%mesh%capacity, self%base(1:n), self%f(1:n), self%y(1:n), self%rhs, &
                    worst(1))
      call heat%world%max(worst)
      if (worst(1) <= self%tolerance) return
      if (k > 4 .and. worst(1) >= 0.9_rp*before) exit
      before = worst(1)
      call linearise(self, heat, step_fraction)
      relative = max(1.0e-6_rp, min(0.1_rp, 0.3_rp*self%tolerance/worst(1)))
      call self%linear%solve(heat, a, self%scale, self%d, self%rhs, relative, self%x)
      self%y(1:n) = self%y(1:n) + self%x/self%scale
      self%newtons = self%newtons + 1
    end do
    self%has_failed = .true.
  end subroutine solve_stage

  !> Residual base + a f - y in the solid as heat r [J], and its maximum [K].
  pure subroutine residual(n, a, capacity, base, f, y, r, worst)
    integer, intent(in) :: n
    real(rp), intent(in) :: a, capacity(n), base(n), f(n), y(n)
    real(rp), intent(out) :: r(n), worst
    real(rp) :: defect
    integer :: i

    worst = 0.0_rp
    !$omp simd reduction(max: worst) private(defect)
    do i = 1, n
      defect = merge(base(i) + a*f(i) - y(i), 0.0_rp, capacity(i) > 0.0_rp)
      worst = max(worst, abs(defect))
      r(i) = capacity(i)*defect
    end do
  end subroutine residual

  !> Linearize: dphi/dtheta of each cell, and the slope of its boundary heat flow by phi.
  subroutine linearise(self, heat, step_fraction)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: step_fraction
    real(rp) :: k, t
    integer :: c

    call heat%slope(self%y, step_fraction, self%d)
    self%scale = 1.0_rp
    if (heat%property%is_constant) return
    do c = 1, heat%size()
      t = heat%property%temperature_at(self%y(c))
      k = 1.0_rp/(heat%property%k_ref*heat%property%resistivity%at(t))
      self%scale(c) = k/heat%property%capacity%at(t)
      self%d(c) = self%d(c)/k
    end do
  end subroutine linearise

  !> Largest error of this rank's cells in the last step [K], with stiff components filtered by a
  !> linear solve.
  subroutine estimate(self, heat, dt, m0, m1, error)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: dt
    real(rp), allocatable, intent(in) :: m0(:), m1(:)
    real(rp), intent(out) :: error
    real(rp) :: a
    integer :: n

    n = heat%size()
    if (self%method == backward_euler) then
      a = dt
      self%rhs = 0.5_rp*dt*(m1(1:n) - m0(1:n))*heat%mesh%capacity
    else
      a = diagonal*dt
      self%rhs = dt*(error_weight(1)*m0(1:n) + error_weight(2)*self%m2(1:n) &
                     + error_weight(3)*m1(1:n))*heat%mesh%capacity
    end if
    call linearise(self, heat, 1.0_rp)
    self%linear%has_failed = .false.
    call self%linear%filter(heat, a, self%scale, self%d, self%rhs, self%x)
    error = 0.0_rp
    if (n > 0) error = maxval(abs(self%x/self%scale))
    if (self%has_failed .or. self%linear%has_failed) error = huge(1.0_rp)
  end subroutine estimate

end module heat_implicit
