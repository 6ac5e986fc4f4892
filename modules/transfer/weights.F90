! SPDX-License-Identifier: MIT
!> Shape functions of a block of particles: one branch-free formula for the linear, uGIMP and
!> quadratic B-spline functions (uGIMP: Bardenhagen & Kober 2004, CMES 5:477; half length l = h/2
!> gives the B-spline, l -> 0 the linear function).
module transfer_weights
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: block_weights

contains

  !> Weights and slopes of the 3 nodes around the nearest one on each axis, and the first of the
  !> 27 nodes. Positions are measured in cells from the first node of the patch.
  subroutine block_weights(origin, inv_h, l, stride, x, w, first)
    real(rp), intent(in) :: origin(3)        !! position of the patch's first node [m]
    real(rp), intent(in) :: inv_h            !! 1/cell size [1/m]
    real(rp), intent(in) :: l                !! half length of a particle's domain [cells]
    integer, intent(in) :: stride(3)         !! node index steps along x, y, z
    real(rp), intent(in) :: x(nlane, 3)      !! positions [m]
    real(rp), intent(out) :: w(nlane, 18)    !! weights of x, y, z (1:9), slopes [1/m] (10:18)
    integer, intent(out) :: first(nlane)     !! node index of the stencil's corner
    real(rp) :: a, b, c, d, e, i2, i4, s, w1, w3, g1, g3
    integer :: i, j, k, p

    i4 = 1.0_rp/(4.0_rp*l)
    i2 = inv_h/(2.0_rp*l)
#define AXIS(N, I, O) \
    s = (x(p, N) - origin(N))*inv_h; \
    I = int(s + 0.5_rp); d = s - real(I, rp); \
    a = max(0.0_rp, l + d); b = max(0.0_rp, d - l); \
    c = max(0.0_rp, l - d); e = max(0.0_rp, -d - l); \
    w1 = (c*c - e*e)*i4; w3 = (a*a - b*b)*i4; \
    g1 = (e - c)*i2; g3 = (a - b)*i2; \
    w(p, O+1) = w1; w(p, O+2) = 1.0_rp - w1 - w3; w(p, O+3) = w3; \
    w(p, O+10) = g1; w(p, O+11) = -(g1 + g3); w(p, O+12) = g3
    !$omp simd private(i, j, k, a, b, c, d, e, s, w1, w3, g1, g3)
    do p = 1, nlane
      AXIS(1, i, 0)
      AXIS(2, j, 3)
      AXIS(3, k, 6)
      first(p) = 1 + (i - 1)*stride(1) + (j - 1)*stride(2) + (k - 1)*stride(3)
    end do
  end subroutine block_weights

end module transfer_weights
