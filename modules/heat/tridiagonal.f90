! SPDX-License-Identifier: MIT
!> Tridiagonal systems along z of an implicit step in a box, one for each pair of cosine modes:
!> (1 + a (lambda + zm + zp + loss)) x_k - a zm x_k-1 - a zp x_k+1 = b_k. Pairs of cells along z are
!> the real and imaginary parts of complex numbers.
module heat_tridiagonal
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: tridiagonal_t

  integer, parameter :: lanes = 8        !! systems solved at once

  !> Coefficients of the systems.
  type :: tridiagonal_t
    integer :: nx = 0, nz = 0
    real(rp), allocatable :: lambda_x(:)             !! (nx) decay rates of cosine modes [1/s]
    !> Rates to the cells below and above, and of film losses [1/s], (nz).
    real(rp), allocatable, dimension(:) :: zm, zp, loss
  contains
    procedure :: solve, response
  end type tridiagonal_t

contains

  !> Solve the systems, `lanes` at once: elimination, back substitution, or both.
  pure subroutine solve(self, a, lambda_y, eliminates, substitutes, work)
    class(tridiagonal_t), intent(in) :: self
    real(rp), intent(in) :: a                     !! implicit step [s]
    real(rp), intent(in) :: lambda_y              !! decay rate along y [1/s]
    logical, intent(in) :: eliminates, substitutes
    complex(rp), intent(inout) :: work((self%nz + 1)/2, self%nx)
    real(rp) :: lambda(lanes), x(lanes, self%nz + 1), up(lanes, self%nz), pivot(lanes), &
                y(lanes, self%nz + 1)
    integer :: i, k, m

    x = 0.0_rp
    lambda = 0.0_rp
    do i = 1, self%nx, lanes
      m = min(lanes, self%nx - i + 1)
      lambda(:m) = lambda_y + self%lambda_x(i:i + m - 1)
      do k = 1, (self%nz + 1)/2
        x(:m, 2*k - 1) = work(k, i:i + m - 1)%re
        x(:m, 2*k) = work(k, i:i + m - 1)%im
      end do
      y = x
      call eliminate(self%nz, a, lambda, self%zm, self%zp, self%loss, y, up, pivot)
      if (eliminates) x = y
      if (substitutes) then              ! begins at the top
        do k = self%nz - 1, 1, -1
          x(:, k) = x(:, k) + up(:, k)*x(:, k + 1)
        end do
      end if
      do k = 1, (self%nz + 1)/2
        work(k, i:i + m - 1) = cmplx(x(:m, 2*k - 1), x(:m, 2*k), rp)
      end do
    end do
  end subroutine solve

  !> Solution in the top plane for a unit right-hand side there.
  pure subroutine response(self, a, lambda_y, g)
    class(tridiagonal_t), intent(in) :: self
    real(rp), intent(in) :: a                     !! implicit step [s]
    real(rp), intent(in) :: lambda_y              !! decay rate along y [1/s]
    real(rp), intent(out) :: g(self%nx)
    real(rp) :: lambda(lanes), x(lanes, self%nz), up(lanes, self%nz), pivot(lanes)
    integer :: i, m

    x = 0.0_rp
    lambda = 0.0_rp
    do i = 1, self%nx, lanes
      m = min(lanes, self%nx - i + 1)
      lambda(:m) = lambda_y + self%lambda_x(i:i + m - 1)
      call eliminate(self%nz, a, lambda, self%zm, self%zp, self%loss, x, up, pivot)
      g(i:i + m - 1) = pivot(:m)
      x = 0.0_rp
    end do
  end subroutine response

  !> Elimination from the bottom; `pivot` is the inverse of the last pivot.
  pure subroutine eliminate(nz, a, lambda, zm, zp, loss, x, up, pivot)
    integer, intent(in) :: nz
    real(rp), intent(in) :: a, lambda(lanes), zm(nz), zp(nz), loss(nz)
    real(rp), intent(inout) :: x(lanes, nz)
    real(rp), intent(out) :: up(lanes, nz), pivot(lanes)
    real(rp) :: d(lanes), up_before(lanes), before(lanes)
    integer :: k

    up_before = 0.0_rp
    before = 0.0_rp
    do k = 1, nz
      d = 1.0_rp/(1.0_rp + a*(lambda + zm(k) + zp(k) + loss(k)) - a*zm(k)*up_before)
      before = (x(:, k) + a*zm(k)*before)*d
      up_before = a*zp(k)*d
      up(:, k) = up_before
      x(:, k) = before
    end do
    pivot = d
  end subroutine eliminate

end module heat_tridiagonal
