! SPDX-License-Identifier: MIT
!> Implicit steps: backward Euler, and TR-BDF2 in its form of one diagonally implicit scheme (Hosea
!> & Shampine 1996, Appl. Numer. Math. 20, 21), L-stable and of order 2. Stages are solved by Newton
!> steps; the new state is that of the fluxes at the stages, so that heat is exact whatever the
!> tolerances.
module heat_solvers_implicit
  use base_kinds, only: rp
  use heat_mesh_rates, only: heat_t, n_books
  use heat_solvers_linear, only: linear_t
  use heat_solvers_method, only: backward_euler, by_petsc, tr_bdf2
  implicit none (type, external)
  private

  public :: implicit_t, order_of

  integer, parameter :: most_newton = 12
  real(rp), parameter :: root2 = sqrt(2.0_rp)
  real(rp), parameter :: first_end = 2.0_rp - root2      !! gamma: end of the first stage
  real(rp), parameter :: diagonal = 0.5_rp*first_end     !! d
  real(rp), parameter :: weight = 0.25_rp*root2          !! w
  real(rp), parameter :: error_weight(3) = [(4.0_rp*weight - 1.0_rp)/3.0_rp, -1.0_rp/3.0_rp, &
                                            2.0_rp*diagonal/3.0_rp]

  type :: implicit_t
    integer :: method = tr_bdf2
    integer :: solver = 0                         !! by_cg, by_fft, by_petsc
    real(rp) :: tolerance = 1.0e-3_rp             !! of a stage [K]
    integer :: newtons = 0                        !! Newton steps so far
    logical :: has_failed = .false.               !! the last step has a stage that was not solved
    type(linear_t) :: linear
    logical, private :: has_mean = .false.
    real(rp), allocatable, private, dimension(:) :: m2, f, base, d, scale, y, rhs, x
    real(rp), allocatable, private :: mean(:)     !! mean rate of the last step [K/s]
  contains
    procedure :: start
    procedure :: step
    procedure :: keep
    procedure :: estimate
    procedure :: pack_memory
    procedure :: unpack_memory
  end type implicit_t

contains

  !> Order of a method.
  pure real(rp) function order_of(method)
    integer, intent(in) :: method

    order_of = merge(1.0_rp, 2.0_rp, method == backward_euler)
  end function order_of

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

  !> One step of length `dt` from `y0` with rates `m0`, powers `p0`; `gain`: the heats of the step.
  subroutine step(self, heat, dt, y0, m0, p0, gain)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: dt
    real(rp), allocatable, intent(in) :: y0(:), m0(:)
    real(rp), intent(in) :: p0(n_books)
    real(rp), intent(out) :: gain(n_books)
    real(rp) :: p(n_books)
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

  !> The step from `y0` to the present state is done: its mean rate predicts the next one.
  subroutine keep(self, heat, dt, y0)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: dt
    real(rp), allocatable, intent(in) :: y0(:)
    integer :: n

    n = heat%size()
    self%mean = (heat%theta(1:n) - y0(1:n))/dt
    self%has_mean = .true.
  end subroutine keep

  !> Pace of the last step and what the preconditioner was built from, for a run that goes on.
  subroutine pack_memory(self, fields, numbers)
    class(implicit_t), intent(in) :: self
    real(rp), intent(out) :: fields(:, :), numbers(2)      !! (cells, 2)

    fields = 0.0_rp
    if (self%has_mean) fields(:, 1) = self%mean
    numbers(1) = merge(1.0_rp, 0.0_rp, self%has_mean)
    call self%linear%petsc%pack_memory(fields(:, 2), numbers(2))
  end subroutine pack_memory

  !> Collective. Take up what `pack_memory` gave.
  subroutine unpack_memory(self, fields, numbers)
    class(implicit_t), intent(inout) :: self
    real(rp), intent(in) :: fields(:, :), numbers(2)

    self%has_mean = numbers(1) > 0.0_rp
    self%mean = fields(:, 1)
    if (self%linear%solver == by_petsc) then
      call self%linear%petsc%unpack_memory(fields(:, 2), numbers(2))
    end if
  end subroutine unpack_memory

  !> y = base + a f(y) at a part `blend` of the step; f and the powers p are those of y. Linear
  !> systems are solved as far as the stage needs.
  subroutine solve_stage(self, heat, a, blend, p)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: a                     !! [s]
    real(rp), intent(in) :: blend
    real(rp), intent(out) :: p(n_books)
    real(rp) :: worst(1), before, relative
    integer :: k, n

    n = heat%size()
    before = huge(1.0_rp)
    do k = 1, most_newton
      call heat%rate(self%y, blend, self%f, p)
      call residual(n, a, heat%mesh%capacity, self%base(1:n), self%f(1:n), self%y(1:n), self%rhs, &
                    worst(1))
      call heat%world%max(worst)
      if (worst(1) <= self%tolerance) return
      if (k > 4 .and. worst(1) >= 0.9_rp*before) exit
      before = worst(1)
      call linearise(self, heat, blend)
      relative = max(1.0e-6_rp, min(0.1_rp, 0.3_rp*self%tolerance/worst(1)))
      call self%linear%solve(heat, a, self%scale, self%d, self%rhs, relative, self%x)
      self%y(1:n) = self%y(1:n) + self%x/self%scale
      self%newtons = self%newtons + 1
    end do
    self%has_failed = .true.
  end subroutine solve_stage

  !> What base + a f - y is short of 0: its heat r [J] in the solid, and the largest [K].
  pure subroutine residual(n, a, capacity, base, f, y, r, worst)
    integer, intent(in) :: n
    real(rp), intent(in) :: a, capacity(n), base(n), f(n), y(n)
    real(rp), intent(out) :: r(n), worst
    real(rp) :: short
    integer :: i

    worst = 0.0_rp
    !$omp simd reduction(max: worst) private(short)
    do i = 1, n
      short = merge(base(i) + a*f(i) - y(i), 0.0_rp, capacity(i) > 0.0_rp)
      worst = max(worst, abs(short))
      r(i) = capacity(i)*short
    end do
  end subroutine residual

  !> dphi/dtheta of each cell, and the slope by phi of what walls give it.
  subroutine linearise(self, heat, blend)
    class(implicit_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: blend
    real(rp) :: k, t
    integer :: c

    call heat%slope(self%y, blend, self%d)
    self%scale = 1.0_rp
    if (heat%property%is_constant) return
    do c = 1, heat%size()
      t = heat%property%temperature_at(self%y(c))
      k = 1.0_rp/(heat%property%k_ref*heat%property%resistivity%at(t))
      self%scale(c) = k/heat%property%capacity%at(t)
      self%d(c) = self%d(c)/k
    end do
  end subroutine linearise

  !> Largest error of this rank's cells in the step just made [K], freed of its stiff part by a
  !> solve.
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

end module heat_solvers_implicit
