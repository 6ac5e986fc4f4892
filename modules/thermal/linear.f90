! SPDX-License-Identifier: MIT
!> Linear systems of an implicit step, [C/s + a (G - D)] x = b: capacities C over a scale s,
!> conductances G, slopes D <= 0 of what walls give. By conjugate gradients without a matrix,
!> preconditioned by the diagonal or by the exact solution for the whole box (thermal_fft), or by
!> PETSc (thermal_petsc).
module thermal_linear
  use base_kinds, only: rp
  use thermal_fft, only: fft_t
  use thermal_method, only: by_cg, by_fft, by_petsc
  use thermal_petsc, only: petsc_t
  use thermal_rates, only: heat_t
  implicit none (type, external)
  private

  public :: linear_t

  real(rp), parameter :: relative = 1.0e-4_rp    !! residual at the end, of that at the start
  integer, parameter :: most_iterations = 2000

  type :: linear_t
    integer :: solver = by_cg
    integer :: solves = 0, iterations = 0
    type(fft_t) :: fft
    type(petsc_t) :: petsc
    real(rp), allocatable, private :: p(:), g(:), diagonal(:)
  contains
    procedure :: start
    procedure :: solve
  end type linear_t

contains

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
    allocate (rate(6, heat%size()))
    call heat%mesh%all_rates(rate)
    self%diagonal = sum(rate, dim=1)*heat%mesh%capacity
    if (solver == by_fft) call self%fft%start(heat)
    if (solver == by_petsc) call self%petsc%start(heat, rate)
  end subroutine start

  !> Collective: x of own cells for `b`, both 0 outside the solid.
  subroutine solve(self, heat, a, scale, d, b, x)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, scale(:), d(:), b(:)
    real(rp), intent(out) :: x(:)
    integer :: iterations

    if (self%solver == by_petsc) then
      call self%petsc%solve(heat%mesh%capacity/scale - a*d, a, b, relative, x, iterations)
    else
      call conjugate_gradients(self, heat, a, scale, d, b, x, iterations)
    end if
    self%solves = self%solves + 1
    self%iterations = self%iterations + iterations
  end subroutine solve

  !> Preconditioned conjugate gradients from 0.
  subroutine conjugate_gradients(self, heat, a, scale, d, b, x, iterations)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, scale(:), d(:), b(:)
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations
    real(rp), allocatable :: r(:), z(:), q(:)
    real(rp) :: rho, before, now(2), first, alpha, curvature
    integer :: n

    n = size(b)
    x = 0.0_rp
    allocate (z(n), q(n))
    allocate (r, source=b)
    first = -1.0_rp
    before = 1.0_rp
    do iterations = 0, most_iterations
      call precondition(self, heat, a, scale, d, r, z)
      now = [dot_product(r, z), dot_product(r, r)]
      call heat%world%sum(now)
      if (first < 0.0_rp) first = now(2)
      if (now(2) <= relative**2*first .or. now(2) <= 0.0_rp) exit
      rho = now(1)
      if (iterations == 0) then
        self%p(1:n) = z
      else
        self%p(1:n) = z + (rho/before)*self%p(1:n)
      end if
      before = rho
      call heat%conduct(self%p, self%g)
      q = (heat%mesh%capacity/scale - a*d)*self%p(1:n) - a*heat%mesh%capacity*self%g(1:n)
      now(1) = dot_product(self%p(1:n), q)
      call heat%world%sum(now(1:1))
      curvature = now(1)
      if (curvature <= 0.0_rp) exit
      alpha = rho/curvature
      x = x + alpha*self%p(1:n)
      r = r - alpha*q
    end do
  end subroutine conjugate_gradients

  subroutine precondition(self, heat, a, scale, d, r, z)
    class(linear_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, scale(:), d(:), r(:)
    real(rp), intent(out) :: z(:)

    if (self%solver == by_fft) then
      call self%fft%apply(heat, a, r, z)
    else
      z = 0.0_rp
      where (heat%mesh%capacity > 0.0_rp) &
        z = r/(heat%mesh%capacity/scale - a*d + a*self%diagonal)
    end if
  end subroutine precondition

end module thermal_linear
