! SPDX-License-Identifier: MIT
!> Transfer from a block of particles to the grid. Neighbours in the block mostly have the same 27
!> nodes, since particles are sorted by node: their sums stay in registers and are added to the
!> nodes at the end of the run. Weights add up to one and slopes to zero on each axis, so that sums
!> over all particles with the two outer weights and without a weight suffice, with a third fewer
!> multiplications; the middle node gets the difference. Records are those of transfer_kernels,
!> which handles particles with nodes of their own.
module transfer_scatter
#ifdef STIRPOINT_CONTRACTS
  use base_errors, only: fatal
#endif
  use base_kinds, only: nlane, rp
  use base_system, only: prefetch_lines
  use transfer_kernels, only: p2g_slopes, p2g_values, run_length, to_slopes
  implicit none (type, external)
  private

  public :: p2g_affine_block, p2g_block, p2g_values_block

  integer, parameter :: min_run = 3    ! shortest run of particles that is vectorised
  integer, parameter :: max_run = 16    ! longest run: memory is prefetched between runs
  integer, parameter :: n_sloped = 9 - to_slopes   !! lanes that a run adds by slopes at once

contains

  !> Add the records of `n` particles to the nodes: values by weights, `rec(5:8,2:4,:)` by slopes;
  !> `rec(1:4,2:4,:)` must be 0.
  subroutine p2g_block(n, w, first, rec, stride, nn, g)
    integer, intent(in) :: n, nn, stride(3), first(nlane)
    real(rp), intent(in) :: w(nlane, 18)
    real(rp), intent(in) :: rec(8, 4, nlane)    !! value part; x, y and z slope parts
    real(rp), intent(inout) :: g(8, nn)

#ifdef STIRPOINT_CONTRACTS
    if (any(abs(rec(1:4, 2:4, 1:n)) > 0.0_rp)) then
      call fatal('p2g_block: lanes 1:4 of a record have slope parts, which are dropped')
    end if
#endif
    call p2g_lanes(.true., n, w, first, rec, stride, nn, g)
  end subroutine p2g_block

  !> Add only the values in lanes 1:4 of `n` particles to the nodes.
  subroutine p2g_values_block(n, w, first, rec, stride, nn, g)
    integer, intent(in) :: n, nn, stride(3), first(nlane)
    real(rp), intent(in) :: w(nlane, 18), rec(8, 4, nlane)
    real(rp), intent(inout) :: g(8, nn)

    call p2g_lanes(.false., n, w, first, rec, stride, nn, g)
  end subroutine p2g_values_block

  !> Add all lanes, or only the values of lanes 1:4, run by run.
  subroutine p2g_lanes(all_lanes, n, w, first, rec, stride, nn, g)
    logical, intent(in) :: all_lanes
    integer, intent(in) :: n, nn, stride(3), first(nlane)
    real(rp), intent(in) :: w(nlane, 18), rec(8, 4, nlane)
    real(rp), intent(inout) :: g(8, nn)
    integer :: m, p
    logical :: with_values                      ! lanes 1:4 are added separately

    with_values = to_slopes > 1 .or. .not. all_lanes
    p = 1
    do while (p <= n)
      m = run_length(min(max_run, n - p + 1), first(p))
      if (m < min_run) m = 1
      call prefetch_lines(2*m)
      if (m == 1) then
        if (with_values) call p2g_values(p, w, first(p), rec, stride, nn, g)
        if (all_lanes) call p2g_slopes(to_slopes, 8, p, w, first(p), rec, stride, nn, g)
      else
        if (with_values) call p2g_values_run(p, m, w, first(p), rec, stride, nn, g)
        if (all_lanes) call p2g_slopes_run(p, m, w, first(p), rec(to_slopes, 1, 1), stride, &
                                           g(to_slopes, 1))
      end if
      call prefetch_lines(2*m)
      p = p + m
    end do
  end subroutine p2g_lanes

  !> Add lanes 5:8 of `n` particles by weights and slopes, and lanes 1:4 by those of `moment`: first
  !> moments in place of slopes, which add up to zero as well.
  subroutine p2g_affine_block(n, w, moment, first, rec, stride, nn, g)
    integer, intent(in) :: n, nn, stride(3), first(nlane)
    real(rp), intent(in) :: w(nlane, 18), moment(nlane, 18), rec(8, 4, nlane)
    real(rp), intent(inout) :: g(8, nn)
    integer :: m, p

    p = 1
    do while (p <= n)
      m = run_length(min(max_run, n - p + 1), first(p))
      if (m < min_run .or. n_sloped /= 4) m = 1
      call prefetch_lines(2*m)
      if (m == 1) then
        call p2g_slopes(1, 4, p, moment, first(p), rec, stride, nn, g)
        call p2g_slopes(5, 8, p, w, first(p), rec, stride, nn, g)
      else
        call p2g_slopes_run(p, m, moment, first(p), rec(1, 1, 1), stride, g(1, 1))
        call prefetch_lines(m)
        call p2g_slopes_run(p, m, w, first(p), rec(5, 1, 1), stride, g(5, 1))
      end if
      call prefetch_lines(2*m)
      p = p + m
    end do
  end subroutine p2g_affine_block

  ! Sums t(lane, z, y, x) over the particles of a run, and their addition to the nodes.
#define FIRST(T, A) T = A
#define NEXT(T, A) T = T + A
#define MIDDLE(K, J) t(f, K, J, 2) = t(f, K, J, 2) - t(f, K, J, 1) - t(f, K, J, 3)
#define MIDDLE_PLANE \
      MIDDLE(1, 1); MIDDLE(2, 1); MIDDLE(3, 1); \
      MIDDLE(1, 2); MIDDLE(2, 2); MIDDLE(3, 2); \
      MIDDLE(1, 3); MIDDLE(2, 3); MIDDLE(3, 3)
#define ROW_TO_NODES(Q, J) \
        g(f, Q) = g(f, Q) + t(f, 1, J, i); \
        g(f, Q+1) = g(f, Q+1) + (t(f, 2, J, i) - t(f, 1, J, i) - t(f, 3, J, i)); \
        g(f, Q+2) = g(f, Q+2) + t(f, 3, J, i)
#define PLANE_TO_NODES(Q) \
        ROW_TO_NODES(Q, 1); \
        ROW_TO_NODES(Q+2*sy, 3); \
        a = t(f, 1, 2, i) - t(f, 1, 1, i) - t(f, 1, 3, i); \
        b = t(f, 2, 2, i) - t(f, 2, 1, i) - t(f, 2, 3, i); \
        d = t(f, 3, 2, i) - t(f, 3, 1, i) - t(f, 3, 3, i); \
        g(f, Q+sy) = g(f, Q+sy) + a; \
        g(f, Q+sy+1) = g(f, Q+sy+1) + (b - a - d); \
        g(f, Q+sy+2) = g(f, Q+sy+2) + d

  !> Add lanes 1:4 of `m` particles from p on, which have the same nodes from q on, by weights.
  subroutine p2g_values_run(p, m, w, q, rec, stride, nn, g)
    integer, intent(in) :: p, m, q, nn, stride(3)
    real(rp), intent(in) :: w(nlane, 18), rec(8, 4, nlane)
    real(rp), intent(inout) :: g(8, nn)
    real(rp) :: a0, r0, a, b, d, t(4, 3, 3, 3)
    integer :: f, i, k, o, sy

#define ROW(TAKE, J, I, R0) \
        TAKE(t(f, 2, J, I), R0); \
        TAKE(t(f, 1, J, I), w(k, 7)*R0); \
        TAKE(t(f, 3, J, I), w(k, 9)*R0)
#define PLANE(TAKE, I) \
        ROW(TAKE, 2, I, a0); \
        r0 = w(k, 4)*a0; \
        ROW(TAKE, 1, I, r0); \
        r0 = w(k, 6)*a0; \
        ROW(TAKE, 3, I, r0)
#define PARTICLE(TAKE) \
        a0 = rec(f, 1, k); \
        PLANE(TAKE, 2); \
        a0 = w(k, 1)*rec(f, 1, k); \
        PLANE(TAKE, 1); \
        a0 = w(k, 3)*rec(f, 1, k); \
        PLANE(TAKE, 3)
    k = p
    !$omp simd private(a0, r0)
    do f = 1, 4
      PARTICLE(FIRST)
    end do
    do k = p + 1, p + m - 1
      !$omp simd private(a0, r0)
      do f = 1, 4
        PARTICLE(NEXT)
      end do
    end do
#undef ROW
#undef PLANE
#undef PARTICLE
    !$omp simd
    do f = 1, 4
      MIDDLE_PLANE
    end do
    sy = stride(2)
    do i = 1, 3
      o = q + (i - 1)*stride(1)
      !$omp simd private(a, b, d)
      do f = 1, 4
        PLANE_TO_NODES(o)
      end do
    end do
  end subroutine p2g_values_run

  !> Add `n_sloped` lanes by weights and slopes.
  subroutine p2g_slopes_run(p, m, w, q, rec, stride, g)
    integer, intent(in) :: p, m, q, stride(3)
    real(rp), intent(in) :: w(nlane, 18)    !! weights
    real(rp), intent(in) :: rec(8, 4, *)    !! records, from the first of the added lanes on
    real(rp), intent(inout) :: g(8, *)
    real(rp) :: a0, ay, az, r0, r1, a, b, d, t(n_sloped, 3, 3, 3)
    integer :: f, i, k, o, sy

#define ROW(TAKE, J, I, R0, R1) \
        TAKE(t(f, 2, J, I), R0); \
        TAKE(t(f, 1, J, I), w(k, 7)*R0 + w(k, 16)*R1); \
        TAKE(t(f, 3, J, I), w(k, 9)*R0 + w(k, 18)*R1)
#define PLANE(TAKE, I) \
        ROW(TAKE, 2, I, a0, az); \
        r0 = w(k, 4)*a0 + w(k, 13)*ay; r1 = w(k, 4)*az; \
        ROW(TAKE, 1, I, r0, r1); \
        r0 = w(k, 6)*a0 + w(k, 15)*ay; r1 = w(k, 6)*az; \
        ROW(TAKE, 3, I, r0, r1)
#define OUTER_PLANE(TAKE, I) \
        a0 = w(k, I)*rec(f, 1, k) + w(k, 9+I)*rec(f, 2, k); \
        ay = w(k, I)*rec(f, 3, k); az = w(k, I)*rec(f, 4, k); \
        PLANE(TAKE, I)
#define PARTICLE(TAKE) \
        a0 = rec(f, 1, k); ay = rec(f, 3, k); az = rec(f, 4, k); \
        PLANE(TAKE, 2); \
        OUTER_PLANE(TAKE, 1); \
        OUTER_PLANE(TAKE, 3)
    k = p
    !$omp simd private(a0, ay, az, r0, r1)
    do f = 1, n_sloped
      PARTICLE(FIRST)
    end do
    do k = p + 1, p + m - 1
      !$omp simd private(a0, ay, az, r0, r1)
      do f = 1, n_sloped
        PARTICLE(NEXT)
      end do
    end do
#undef ROW
#undef PLANE
#undef OUTER_PLANE
#undef PARTICLE
    !$omp simd
    do f = 1, n_sloped
      MIDDLE_PLANE
    end do
    sy = stride(2)
    do i = 1, 3
      o = q + (i - 1)*stride(1)
      !$omp simd private(a, b, d)
      do f = 1, n_sloped
        PLANE_TO_NODES(o)
      end do
    end do
  end subroutine p2g_slopes_run

end module transfer_scatter
