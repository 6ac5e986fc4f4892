! SPDX-License-Identifier: MIT
!> Linear systems of an implicit step, [C/s + a (G - D)] x = b, with capacities C, scale s,
!> conductances G and slopes D <= 0 of the boundary heat flow. They are solved by matrix-free
!> conjugate gradients with the diagonal or the direct solution of the bounding box (heat_fft) as
!> preconditioner, or by PETSc (heat_petsc). The names of the solvers and of the methods of time
!> integration are defined here.
module heat_linear
  use base_kinds, only: rp
  use heat_fft, only: fft_t
  use heat_petsc, only: petsc_t
  use heat_rates, only: heat_t
  implicit none (type, external)
  private

  public :: linear_t

  integer, parameter, public :: euler = 1, rkl2 = 2, backward_euler = 3, tr_bdf2 = 4
  integer, parameter, public :: by_cg = 1, by_fft = 2, by_petsc = 3
  !> Largest number of iterations of conjugate gradients.
  integer, parameter, public :: max_iterations = 2000

  character(14), parameter, public :: method_names(4) = [character(14) :: &
    'explicit', 'rkl2', 'backward-euler', 'tr-bdf2']
  character(5), parameter, public :: solver_names(3) = [character(5) :: 'cg', 'fftw', 'petsc']

  !> Solver and its work arrays.
  type :: linear_t
    integer :: solver = by_cg, solves = 0, iterations = 0
    logical :: has_failed = .false.               !! a solve did not converge, equal on all ranks
    type(fft_t) :: fft
    type(petsc_t) :: petsc
    real(rp), allocatable, private, dimension(:) :: p, g, diagonal, main, r, z, q
  contains
    procedure :: start, solve, filter
  end type linear_t

contains

  !> Allocate the fields and start the solver.
  subroutine start(self, heat, solver)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    integer, intent(in) :: solver
    real(rp), allocatable :: rate(:, :)
    integer :: lo, hi

    self%solver = solver
    lo = lbound(heat%theta, 1)
    hi = ubound(heat%theta, 1)
    allocate (self%p(lo:hi), self%g(lo:hi), source=0.0_rp)
    allocate (self%r(heat%size()), self%z(heat%size()), self%q(heat%size()), source=0.0_rp)
    allocate (self%main(heat%size()), source=0.0_rp)
    allocate (rate(6, heat%size()))
    call heat%mesh%all_rates(rate)
    self%diagonal = sum(rate, dim=1)*heat%mesh%capacity
    if (solver == by_fft) call self%fft%start(heat)
    if (solver == by_petsc) call self%petsc%start(heat, rate)
  end subroutine start

  !> Collective. Solve for x of the own cells until the residual is `relative` times b; otherwise
  !> set `has_failed`. x and b are 0 outside the solid.
  subroutine solve(self, heat, a, scale, d, b, relative, x)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, scale(:), d(:), b(:), relative
    real(rp), intent(out) :: x(:)
    integer :: iterations

    if (self%solver /= by_fft .or. .not. self%fft%is_exact) then
      self%main = heat%mesh%capacity/scale - a*d
    end if
    if (self%solver == by_petsc) then
      call self%petsc%solve(self%main, a, b, relative, x, iterations)
    else if (self%solver == by_fft .and. self%fft%is_exact) then
      call self%fft%solve(heat, a, d, b, x)
      iterations = 1
    else
      call conjugate_gradients(self, heat, a, b, relative, x, iterations)
    end if
    self%solves = self%solves + 1
    self%iterations = self%iterations + iterations
  end subroutine solve

  !> Collective. Approximate solution that filters an error estimate, by the bounding box where
  !> possible.
  subroutine filter(self, heat, a, scale, d, b, x)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, scale(:), d(:), b(:)
    real(rp), intent(out) :: x(:)
    real(rp), parameter :: coarse = 0.1_rp

    if (self%solver == by_fft) then
      call self%fft%apply(heat, a, b, x)
    else
      call self%solve(heat, a, scale, d, b, coarse, x)
    end if
  end subroutine filter

  !> Preconditioned conjugate gradients from 0; `main` is the diagonal without the conductances.
  subroutine conjugate_gradients(self, heat, a, b, relative, x, iterations)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, b(:), relative
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations
    real(rp) :: rho(1), before, rr(1), target, curvature(1)
    integer :: n

    n = size(b)
    x = 0.0_rp
    self%r = b
    self%p = 0.0_rp
    rr = dot_product(b, b)
    call heat%world%sum(rr)
    target = relative**2*rr(1)
    before = 1.0_rp
    do iterations = 0, max_iterations
      if (rr(1) <= target) exit
      call precondition(self, heat, a)
      rho = dot_product(self%r, self%z)
      call heat%world%sum(rho)
      self%p(1:n) = self%z + (rho(1)/before)*self%p(1:n)
      before = rho(1)
      call heat%conduct(self%p, self%g)
      call multiply(n, a, self%main, heat%mesh%capacity, self%p(1:n), self%g(1:n), self%q, &
                    curvature(1))
      call heat%world%sum(curvature)
      if (.not. curvature(1) > 0.0_rp) exit
      call advance(n, rho(1)/curvature(1), self%p(1:n), self%q, x, self%r, rr(1))
      call heat%world%sum(rr)
    end do
    if (rr(1) > target) self%has_failed = .true.   ! non-finite states are diagnosed elsewhere
  end subroutine conjugate_gradients

  !> q = main p - a capacity g and p q.
  pure subroutine multiply(n, a, main, capacity, p, g, q, pq)
    integer, intent(in) :: n
    real(rp), intent(in) :: a, main(n), capacity(n), p(n), g(n)
    real(rp), intent(out) :: q(n), pq
    integer :: i

    pq = 0.0_rp
    !$omp simd reduction(+: pq)
    do i = 1, n
      q(i) = main(i)*p(i) - a*capacity(i)*g(i)
      pq = pq + p(i)*q(i)
    end do
  end subroutine multiply

  !> Update x and the residual r along p, and compute r r.
  pure subroutine advance(n, alpha, p, q, x, r, rr)
    integer, intent(in) :: n
    real(rp), intent(in) :: alpha, p(n), q(n)
    real(rp), intent(inout) :: x(n), r(n)
    real(rp), intent(out) :: rr
    integer :: i

    rr = 0.0_rp
    !$omp simd reduction(+: rr)
    do i = 1, n
      x(i) = x(i) + alpha*p(i)
      r(i) = r(i) - alpha*q(i)
      rr = rr + r(i)**2
    end do
  end subroutine advance

  !> Precondition r to z by the box or by the diagonal.
  subroutine precondition(self, heat, a)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a

    if (self%solver == by_fft) then
      call self%fft%apply(heat, a, self%r, self%z)
    else
      self%z = 0.0_rp
      where (heat%mesh%capacity > 0.0_rp) self%z = self%r/(self%main + a*self%diagonal)
    end if
  end subroutine precondition

end module heat_linear
