! SPDX-License-Identifier: MIT
!> Transfer from the grid to a block of particles. Neighbours in the block mostly have the same 27
!> nodes, since particles are sorted by node: such runs fill the lanes of vectors, share the loads
!> of a node, and use only the required lanes of a record. This takes a third of the operations of
!> processing one particle at a time with a node's record in a vector (transfer_kernels), which is
!> used for particles with nodes of their own. Sum-factorised; nodes lie z-fastest.
module transfer_gather
  use base_kinds, only: nlane, rp
  use base_system, only: prefetch_lines
  use transfer_kernels, only: g2p_one, run_length
  implicit none (type, external)
  private

  public :: gather_block, lanes_t

  integer, parameter :: min_run = 3   ! shortest run of particles with the same nodes that is
                                      ! vectorised
  !> Cache lines of the next block prefetched per lane of eight particles.
  integer, parameter :: lines_per_eight = 6

  ! Lanes of a node that are copied at once: a record is one register, or two.
#if defined(STIRPOINT_AVX512) && !defined(STIRPOINT_HALVES)
  integer, parameter :: n_copied = 8
#else
  integer, parameter :: n_copied = 4
#endif

  !> Lanes of the records to gather: some with slopes, some with values only.
  type :: lanes_t
    integer :: sloped, n_sloped  !! first lane gathered with slopes, and number of such lanes
    integer :: plain, n_plain    !! first lane gathered without slopes, and number of such lanes
  contains
    procedure :: has
  end type lanes_t

contains

  !> Gather values at `n` particles, and for the sloped lanes slopes along x, y, z (s(:, 1:3) for
  !> the first one); unused lanes are undefined.
  subroutine gather_block(lanes, n, w, first, stride, nn, g, rec, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)       !! scratch
    real(rp), intent(out) :: v(nlane, lanes%n_sloped), s(nlane, 3*lanes%n_sloped), &
      u(nlane, lanes%n_plain)
    integer :: m, p

    p = 1
    do while (p <= n)
      m = run_length(n - p + 1, first(p))
      if (m >= min_run) then
        call gather_run(lanes, p, m, w, first, stride, nn, g, rec, v, s, u)
      else
        m = 1
        call gather_one(lanes, p, w, first, stride, nn, g, rec, v, s, u)
      end if
      p = p + m
    end do
  end subroutine gather_block

  !> Gather for particles p to p+m-1, which have the same nodes. Lanes behind them are overwritten
  !> and gathered later.
  subroutine gather_run(lanes, p, m, w, first, stride, nn, g, rec, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p, m, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp), intent(inout) :: v(nlane, lanes%n_sloped), s(nlane, 3*lanes%n_sloped), &
      u(nlane, lanes%n_plain)
    real(rp) :: c(8, 3, 3, 3)
    integer :: i

    do i = 1, 8, n_copied
      if (lanes%has(i, i + n_copied - 1)) call copy_nodes(first(p), stride, g(i, 1), c(i, 1, 1, 1))
    end do
    i = p
    do while (i < p + m)
      if (p + m - i > 4 .and. i + 7 <= nlane) then
        call gather_eight(lanes, i, w, c, v, s, u)
        i = i + 8
      else if (i + 3 <= nlane) then
        call gather_four(lanes, i, w, c, v, s, u)
        i = i + 4
      else
        call gather_one(lanes, i, w, first, stride, nn, g, rec, v, s, u)
        i = i + 1
      end if
    end do
  end subroutine gather_run

  !> Gather for particle p through a record.
  subroutine gather_one(lanes, p, w, first, stride, nn, g, rec, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp), intent(inout) :: v(nlane, lanes%n_sloped), s(nlane, 3*lanes%n_sloped), &
      u(nlane, lanes%n_plain)
    integer :: k

    call g2p_one(p, w, first, stride, nn, g, rec)
    do k = 1, lanes%n_sloped
      v(p, k) = rec(lanes%sloped + k - 1, 1, p)
      s(p, 3*k - 2:3*k) = rec(lanes%sloped + k - 1, 2:4, p)
    end do
    do k = 1, lanes%n_plain
      u(p, k) = rec(lanes%plain + k - 1, 1, p)
    end do
  end subroutine gather_one

  !> True if some of the lanes `low` to `high` are to be gathered.
  pure logical function has(self, low, high)
    class(lanes_t), intent(in) :: self
    integer, intent(in) :: low, high

    has = max(low, self%sloped) < min(high + 1, self%sloped + self%n_sloped) .or. &
          max(low, self%plain) < min(high + 1, self%plain + self%n_plain)
  end function has

  !> Copy `n_copied` lanes of 27 nodes from q on, row by row along z. Weights add up to one and
  !> slopes to zero on each axis, so that outer nodes stored as differences from the middle one save
  !> its multiplication.
  pure subroutine copy_nodes(q, stride, g, c)
    integer, intent(in) :: q, stride(3)
    real(rp), intent(in) :: g(8, *)  !! records, from the first of the copied lanes on
    real(rp), intent(inout) :: c(8, 3, 3, *)
    real(rp) :: a1, a2, a3, b1, b2, b3, d1, d2, d3, m1, m2, m3, m4, m5, m6, m7, m8, m9
    integer :: f, sx, sy

    sx = stride(1)
    sy = stride(2)
#define NODES(Q, A, B, D) \
      B = g(f, Q+1); \
      A = g(f, Q) - B; \
      D = g(f, Q+2) - B
#define LAYER(Q) \
      NODES(Q, a1, b1, d1); \
      NODES(Q+sy, a2, b2, d2); \
      NODES(Q+2*sy, a3, b3, d3)
#define KEEP(I, A1, B1, D1, A2, B2, D2, A3, B3, D3) \
      c(f, 1, 1, I) = A1; c(f, 2, 1, I) = B1; c(f, 3, 1, I) = D1; \
      c(f, 1, 2, I) = A2; c(f, 2, 2, I) = B2; c(f, 3, 2, I) = D2; \
      c(f, 1, 3, I) = A3; c(f, 2, 3, I) = B3; c(f, 3, 3, I) = D3
    !$omp simd private(a1, a2, a3, b1, b2, b3, d1, d2, d3, m1, m2, m3, m4, m5, m6, m7, m8, m9)
    do f = 1, n_copied
      LAYER(q+sx)
      m1 = a1 - a2; m2 = b1 - b2; m3 = d1 - d2
      m4 = a2; m5 = b2; m6 = d2
      m7 = a3 - a2; m8 = b3 - b2; m9 = d3 - d2
      KEEP(2, m1, m2, m3, m4, m5, m6, m7, m8, m9)
      LAYER(q)
      KEEP(1, a1-a2-m1, b1-b2-m2, d1-d2-m3, a2-m4, b2-m5, d2-m6, a3-a2-m7, b3-b2-m8, d3-d2-m9)
      LAYER(q+2*sx)
      KEEP(3, a1-a2-m1, b1-b2-m2, d1-d2-m3, a2-m4, b2-m5, d2-m6, a3-a2-m7, b3-b2-m8, d3-d2-m9)
    end do
#undef NODES
#undef LAYER
#undef KEEP
  end subroutine copy_nodes

  ! Lane f of the nodes at particle i: value and slopes, or the value only.
#define ROW(J, I) \
        x0 = c(f, 2, J, I) + w(i, 7)*c(f, 1, J, I) + w(i, 9)*c(f, 3, J, I); \
        x1 = w(i, 16)*c(f, 1, J, I) + w(i, 18)*c(f, 3, J, I)
#define PLANE(I) \
        ROW(2, I); \
        y0 = x0; y1 = x1; \
        ROW(1, I); \
        y0 = y0 + w(i, 4)*x0; y1 = y1 + w(i, 4)*x1; y2 = w(i, 13)*x0; \
        ROW(3, I); \
        y0 = y0 + w(i, 6)*x0; y1 = y1 + w(i, 6)*x1; y2 = y2 + w(i, 15)*x0
#define WITH_SLOPES \
        PLANE(2); \
        a0 = y0; a2 = y2; a3 = y1; \
        PLANE(1); \
        a0 = a0 + w(i, 1)*y0; a1 = w(i, 10)*y0; a2 = a2 + w(i, 1)*y2; a3 = a3 + w(i, 1)*y1; \
        PLANE(3); \
        a0 = a0 + w(i, 3)*y0; a1 = a1 + w(i, 12)*y0; a2 = a2 + w(i, 3)*y2; a3 = a3 + w(i, 3)*y1; \
        v(i, k) = a0; s(i, 3*k-2) = a1; s(i, 3*k-1) = a2; s(i, 3*k) = a3
#define VALUE_ROW(J, I) (c(f, 2, J, I) + w(i, 7)*c(f, 1, J, I) + w(i, 9)*c(f, 3, J, I))
#define VALUE_PLANE(I) (VALUE_ROW(2, I) + w(i, 4)*VALUE_ROW(1, I) + w(i, 6)*VALUE_ROW(3, I))
#define VALUE_ALONE \
        u(i, k) = VALUE_PLANE(2) + w(i, 1)*VALUE_PLANE(1) + w(i, 3)*VALUE_PLANE(3)

  !> Gather for particles p to p+7, with the nodes copied in `c`.
  subroutine gather_eight(lanes, p, w, c, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p
    real(rp), intent(in) :: w(nlane, 18), c(8, 3, 3, 3)
    real(rp), intent(inout) :: v(nlane, lanes%n_sloped), s(nlane, 3*lanes%n_sloped), &
      u(nlane, lanes%n_plain)
    real(rp) :: a0, a1, a2, a3, x0, x1, y0, y1, y2
    integer :: f, i, k

    do k = 1, lanes%n_sloped
      call prefetch_lines(lines_per_eight)
      f = lanes%sloped + k - 1
      !$omp simd private(a0, a1, a2, a3, x0, x1, y0, y1, y2)
      do i = p, p + 7
        WITH_SLOPES
      end do
    end do
    do k = 1, lanes%n_plain
      call prefetch_lines(lines_per_eight)
      f = lanes%plain + k - 1
      !$omp simd
      do i = p, p + 7
        VALUE_ALONE
      end do
    end do
  end subroutine gather_eight

  !> Gather for particles p to p+3.
  subroutine gather_four(lanes, p, w, c, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p
    real(rp), intent(in) :: w(nlane, 18), c(8, 3, 3, 3)
    real(rp), intent(inout) :: v(nlane, lanes%n_sloped), s(nlane, 3*lanes%n_sloped), &
      u(nlane, lanes%n_plain)
    real(rp) :: a0, a1, a2, a3, x0, x1, y0, y1, y2
    integer :: f, i, k

    do k = 1, lanes%n_sloped
      call prefetch_lines(lines_per_eight/2)
      f = lanes%sloped + k - 1
      !$omp simd private(a0, a1, a2, a3, x0, x1, y0, y1, y2)
      do i = p, p + 3
        WITH_SLOPES
      end do
    end do
    do k = 1, lanes%n_plain
      call prefetch_lines(lines_per_eight/2)
      f = lanes%plain + k - 1
      !$omp simd
      do i = p, p + 3
        VALUE_ALONE
      end do
    end do
  end subroutine gather_four

end module transfer_gather
