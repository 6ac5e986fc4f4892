! SPDX-License-Identifier: MIT
!> From the grid to a block of particles. Neighbours in the block mostly have the same 27 nodes, since
!> particles are sorted by node: then they fill the lanes of vectors and share what is loaded of a node,
!> and only what is wanted of a record is worked on. That takes half the operations of one particle
!> at a time with a node's record in a vector (transfer_kernels), which is left for those that have
!> nodes of their own. Sum-factorised; nodes lie z-fastest.
module transfer_gather
  use base_kinds, only: nlane, rp
  use base_system, only: fetch_some
  use transfer_kernels, only: g2p_one
  implicit none (type, external)
  private

  public :: gather_block, lanes_t

  integer, parameter :: few = 6    !! lines of memory of the next block, fetched between the lanes of eight particles

  !> Which lanes of the records are wanted: some with slopes, of some the values alone.
  type :: lanes_t
    integer :: steep, n_steep      !! first lane with slopes, and how many
    integer :: plain, n_plain      !! first lane without, and how many
  end type lanes_t

contains

  !> Values at `n` particles, and slopes along x, y, z of those lanes that have them: (s(:, 1:3) of the
  !> first); what other particles get is not said.
  subroutine gather_block(lanes, n, w, first, stride, nn, g, rec, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)       !! scratch
    real(rp), intent(out) :: v(nlane, lanes%n_steep), s(nlane, 3*lanes%n_steep), u(nlane, lanes%n_plain)
    integer :: m, p

    p = 1
    do while (p <= n)
      m = run_length(min(8, n - p + 1), first(p))
      if (m > 4 .and. p + 7 <= nlane) then        ! lanes of others are overwritten by their own later
        call gather_eight(lanes, p, w, first(p), stride, nn, g, v, s, u)
      else if (m > 2 .and. p + 3 <= nlane) then
        m = min(m, 4)
        call gather_four(lanes, p, w, first(p), stride, nn, g, v, s, u)
      else
        m = 1
        call gather_one(lanes, p, w, first, stride, nn, g, rec, v, s, u)
      end if
      p = p + m
    end do
  end subroutine gather_block

  !> How many of `n` particles have the first one's nodes, up to the first that has others.
  pure integer function run_length(n, first) result(m)
    integer, intent(in) :: n, first(n)

    do m = 1, n - 1
      if (first(m + 1) /= first(1)) return
    end do
    m = n
  end function run_length

  !> Particle p by its record.
  subroutine gather_one(lanes, p, w, first, stride, nn, g, rec, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp), intent(inout) :: v(nlane, lanes%n_steep), s(nlane, 3*lanes%n_steep), u(nlane, lanes%n_plain)
    integer :: k

    call g2p_one(p, w, first, stride, nn, g, rec)
    do k = 1, lanes%n_steep
      v(p, k) = rec(lanes%steep + k - 1, 1, p)
      s(p, 3*k - 2:3*k) = rec(lanes%steep + k - 1, 2:4, p)
    end do
    do k = 1, lanes%n_plain
      u(p, k) = rec(lanes%plain + k - 1, 1, p)
    end do
  end subroutine gather_one

  !> The records of 27 nodes from q on, row by row along z.
  pure subroutine copy_nodes(q, stride, nn, g, c)
    integer, intent(in) :: q, stride(3), nn
    real(rp), intent(in) :: g(8, nn)
    real(rp), intent(out) :: c(8, 3, 9)
    integer :: i, j, k

    do i = 0, 2
      do j = 0, 2
        k = q + i*stride(1) + j*stride(2)
        c(:, 1, 3*i + j + 1) = g(:, k)
        c(:, 2, 3*i + j + 1) = g(:, k + 1)
        c(:, 3, 3*i + j + 1) = g(:, k + 2)
      end do
    end do
  end subroutine copy_nodes

  ! Lane f of the nodes at particle i: value and slopes, or the value alone.
#define ROW(J, Q) \
        t1 = c(f, 1, Q); t2 = c(f, 2, Q); t3 = c(f, 3, Q); \
        x0 = w(i, 7)*t1 + w(i, 8)*t2 + w(i, 9)*t3; \
        x1 = w(i, 16)*t1 + w(i, 17)*t2 + w(i, 18)*t3; \
        y0 = y0 + w(i, 3+J)*x0; y1 = y1 + w(i, 3+J)*x1; y2 = y2 + w(i, 12+J)*x0
#define PLANE(I) \
        y0 = 0.0_rp; y1 = 0.0_rp; y2 = 0.0_rp; \
        ROW(1, 3*I-2); \
        ROW(2, 3*I-1); \
        ROW(3, 3*I); \
        a0 = a0 + w(i, I)*y0; a1 = a1 + w(i, 9+I)*y0; \
        a2 = a2 + w(i, I)*y2; a3 = a3 + w(i, I)*y1
#define VALUE_ROW(J, Q) \
        y0 = y0 + w(i, 3+J)*(w(i, 7)*c(f, 1, Q) + w(i, 8)*c(f, 2, Q) + w(i, 9)*c(f, 3, Q))
#define VALUE_PLANE(I) \
        y0 = 0.0_rp; \
        VALUE_ROW(1, 3*I-2); \
        VALUE_ROW(2, 3*I-1); \
        VALUE_ROW(3, 3*I); \
        a0 = a0 + w(i, I)*y0
#define WITH_SLOPES \
        a0 = 0.0_rp; a1 = 0.0_rp; a2 = 0.0_rp; a3 = 0.0_rp; \
        PLANE(1); \
        PLANE(2); \
        PLANE(3); \
        v(i, k) = a0; s(i, 3*k-2) = a1; s(i, 3*k-1) = a2; s(i, 3*k) = a3
#define VALUE_ALONE \
        a0 = 0.0_rp; \
        VALUE_PLANE(1); \
        VALUE_PLANE(2); \
        VALUE_PLANE(3); \
        u(i, k) = a0

  !> Particles p to p+7, which have the same nodes from q on.
  subroutine gather_eight(lanes, p, w, q, stride, nn, g, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p, q, stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: v(nlane, lanes%n_steep), s(nlane, 3*lanes%n_steep), u(nlane, lanes%n_plain)
    real(rp) :: a0, a1, a2, a3, x0, x1, y0, y1, y2, t1, t2, t3, c(8, 3, 9)
    integer :: f, i, k

    call copy_nodes(q, stride, nn, g, c)
    do k = 1, lanes%n_steep
      call fetch_some(few)
      f = lanes%steep + k - 1
      !$omp simd private(a0, a1, a2, a3, x0, x1, y0, y1, y2, t1, t2, t3)
      do i = p, p + 7
        WITH_SLOPES
      end do
    end do
    do k = 1, lanes%n_plain
      call fetch_some(few)
      f = lanes%plain + k - 1
      !$omp simd private(a0, y0)
      do i = p, p + 7
        VALUE_ALONE
      end do
    end do
  end subroutine gather_eight

  !> Particles p to p+3.
  subroutine gather_four(lanes, p, w, q, stride, nn, g, v, s, u)
    type(lanes_t), intent(in) :: lanes
    integer, intent(in) :: p, q, stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn)
    real(rp), intent(inout) :: v(nlane, lanes%n_steep), s(nlane, 3*lanes%n_steep), u(nlane, lanes%n_plain)
    real(rp) :: a0, a1, a2, a3, x0, x1, y0, y1, y2, t1, t2, t3, c(8, 3, 9)
    integer :: f, i, k

    call copy_nodes(q, stride, nn, g, c)
    do k = 1, lanes%n_steep
      call fetch_some(few/2)
      f = lanes%steep + k - 1
      !$omp simd private(a0, a1, a2, a3, x0, x1, y0, y1, y2, t1, t2, t3)
      do i = p, p + 3
        WITH_SLOPES
      end do
    end do
    do k = 1, lanes%n_plain
      call fetch_some(few/2)
      f = lanes%plain + k - 1
      !$omp simd private(a0, y0)
      do i = p, p + 3
        VALUE_ALONE
      end do
    end do
  end subroutine gather_four

end module transfer_gather
