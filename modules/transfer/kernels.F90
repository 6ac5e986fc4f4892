! SPDX-License-Identifier: MIT
!> The two transfers of the Material Point Method for one particle at a time, sum-factorised over
!> the 27 nodes; most particles are processed in runs that share nodes (transfer_scatter,
!> transfer_gather). A node record holds 8 reals; the bodies are written out because a loop inside a
!> vector loop is not vectorised. Nodes lie z-fastest: `stride(3)` must be 1.
!>
!> Records hold two groups of four lanes, since most lanes need either values or slopes:
!>   to the grid   1:4 mass, momentum (values)          5:8 force (slopes), temperature (value)
!>   from the grid 1:4 velocity, temperature (+slopes)  5:8 velocity change, spare (values)
!> Where a vector register holds a whole record, all lanes are processed with slopes: parts that are
!> not needed are 0 in the transfer to the grid and not read in the transfer back.
module transfer_kernels
  use base_kinds, only: nlane, rp
  use base_system, only: prefetch_lines
  implicit none (type, external)
  private

  public :: run_length, p2g_values, p2g_slopes, g2p_one

  ! First lane scattered with slopes, last lane gathered with them.
#ifdef STIRPOINT_AVX512
  integer, parameter :: back_slopes = 8
#else
  integer, parameter :: back_slopes = 4
#endif
#if defined(STIRPOINT_AVX512) && !defined(STIRPOINT_HALVES)
  integer, parameter, public :: to_slopes = 1
#else
  integer, parameter, public :: to_slopes = 5
#endif

contains

  !> Number of leading particles, of `n`, with the nodes of the first one.
  pure integer function run_length(n, first) result(m)
    integer, intent(in) :: n, first(n)

    do m = 1, n - 1
      if (first(m + 1) /= first(1)) return
    end do
    m = n
  end function run_length

  !> Add lanes 1:4 of one particle by weights.
  subroutine p2g_values(p, w, q, rec, stride, nn, g)
    integer, intent(in) :: p, q, nn, stride(3)
    real(rp), intent(in) :: w(nlane, 18), rec(8, 4, nlane)
    real(rp), intent(inout) :: g(8, nn)
    integer :: f, sx, sy
    real(rp) :: a0, r0

    sx = stride(1)
    sy = stride(2)
#define ROW(J, Q) \
        r0 = w(p, 3+J)*a0; \
        g(f, Q) = g(f, Q) + w(p, 7)*r0; \
        g(f, Q+1) = g(f, Q+1) + w(p, 8)*r0; \
        g(f, Q+2) = g(f, Q+2) + w(p, 9)*r0
#define PLANE(I, Q) \
        a0 = w(p, I)*rec(f, 1, p); \
        ROW(1, Q); \
        ROW(2, Q+sy); \
        ROW(3, Q+2*sy)
    !$omp simd private(a0, r0)
    do f = 1, 4
      PLANE(1, q)
      PLANE(2, q+sx)
      PLANE(3, q+2*sx)
    end do
#undef ROW
#undef PLANE
  end subroutine p2g_values

  !> Add lanes `low` to `high` of one particle by weights and slopes.
  subroutine p2g_slopes(low, high, p, w, q, rec, stride, nn, g)
    integer, intent(in) :: low, high, p, q, nn, stride(3)
    real(rp), intent(in) :: w(nlane, 18), rec(8, 4, nlane)
    real(rp), intent(inout) :: g(8, nn)
    integer :: f, sx, sy
    real(rp) :: a0, ay, az, r0, r1

    sx = stride(1)
    sy = stride(2)
#define ROW(J, Q) \
        r0 = w(p, 3+J)*a0 + w(p, 12+J)*ay; r1 = w(p, 3+J)*az; \
        g(f, Q) = g(f, Q) + w(p, 7)*r0 + w(p, 16)*r1; \
        g(f, Q+1) = g(f, Q+1) + w(p, 8)*r0 + w(p, 17)*r1; \
        g(f, Q+2) = g(f, Q+2) + w(p, 9)*r0 + w(p, 18)*r1
#define PLANE(I, Q) \
        a0 = w(p, I)*rec(f, 1, p) + w(p, 9+I)*rec(f, 2, p); \
        ay = w(p, I)*rec(f, 3, p); az = w(p, I)*rec(f, 4, p); \
        ROW(1, Q); \
        ROW(2, Q+sy); \
        ROW(3, Q+2*sy)
    !$omp simd private(a0, ay, az, r0, r1)
    do f = low, high
      PLANE(1, q)
      PLANE(2, q+sx)
      PLANE(3, q+2*sx)
    end do
#undef ROW
#undef PLANE
  end subroutine p2g_slopes

  !> Interpolate the node records to particle `p` of a block: values of all lanes, slopes of
  !> lanes 1:4.
  subroutine g2p_one(p, w, first, stride, nn, g, rec)
    integer, intent(in) :: p, nn, stride(3), first(nlane)
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    integer :: f, q, sx, sy
    real(rp) :: a0, a1, a2, a3, x0, x1, y0, y1, y2, t1, t2, t3

    sx = stride(1)
    sy = stride(2)
    q = first(p)
    call prefetch_lines(4)
#define ROW(J, Q) \
        t1 = g(f, Q); t2 = g(f, Q+1); t3 = g(f, Q+2); \
        x0 = w(p, 7)*t1 + w(p, 8)*t2 + w(p, 9)*t3; \
        x1 = w(p, 16)*t1 + w(p, 17)*t2 + w(p, 18)*t3; \
        y0 = y0 + w(p, 3+J)*x0; y1 = y1 + w(p, 3+J)*x1; y2 = y2 + w(p, 12+J)*x0
#define PLANE(I, Q) \
        y0 = 0.0_rp; y1 = 0.0_rp; y2 = 0.0_rp; \
        ROW(1, Q); \
        ROW(2, Q+sy); \
        ROW(3, Q+2*sy); \
        a0 = a0 + w(p, I)*y0; a1 = a1 + w(p, 9+I)*y0; \
        a2 = a2 + w(p, I)*y2; a3 = a3 + w(p, I)*y1
    !$omp simd private(a0, a1, a2, a3, x0, x1, y0, y1, y2, t1, t2, t3)
    do f = 1, back_slopes
      a0 = 0.0_rp; a1 = 0.0_rp; a2 = 0.0_rp; a3 = 0.0_rp
      PLANE(1, q)
      PLANE(2, q+sx)
      PLANE(3, q+2*sx)
      rec(f, 1, p) = a0; rec(f, 2, p) = a1; rec(f, 3, p) = a2; rec(f, 4, p) = a3
    end do
#undef ROW
#undef PLANE
#ifndef STIRPOINT_AVX512
#define ROW(J, Q) \
        x0 = w(p, 7)*g(f, Q) + w(p, 8)*g(f, Q+1) + w(p, 9)*g(f, Q+2); \
        y0 = y0 + w(p, 3+J)*x0
#define PLANE(I, Q) \
        y0 = 0.0_rp; \
        ROW(1, Q); \
        ROW(2, Q+sy); \
        ROW(3, Q+2*sy); \
        a0 = a0 + w(p, I)*y0
    !$omp simd private(a0, x0, y0)
    do f = back_slopes + 1, 8
      a0 = 0.0_rp
      PLANE(1, q)
      PLANE(2, q+sx)
      PLANE(3, q+2*sx)
      rec(f, 1, p) = a0
    end do
#undef ROW
#undef PLANE
#endif
  end subroutine g2p_one

end module transfer_kernels
