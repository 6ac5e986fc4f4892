! SPDX-License-Identifier: MIT
!> Shape functions of a block of particles: one branch-free formula for uGIMP and quadratic B-spline
!> functions (uGIMP: Bardenhagen & Kober 2004, CMES 5:477; half length l = h/2 gives the B-spline).
!> Weights of single positions: of a point, and of a face of a particle.
module transfer_weights
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: block_corners, block_weights, domain_weights, face_weights, graded_axis
  public :: moment_weights, own_weights, point_nodes, uniform_axis

! Weights and slopes on axis N with half length L of the domain, I4 = 1/(4L), I2 = 1/(2L h).
#define AXIS(N, I, O, L, I4, I2) \
    s = (x(p, N) - origin(N))*inv_h(N); \
    I = int(s + 0.5_rp); d = s - real(I, rp); \
    a = max(0.0_rp, L + d); b = max(0.0_rp, d - L); \
    c = max(0.0_rp, L - d); e = max(0.0_rp, -d - L); \
    w1 = (c*c - e*e)*(I4); w3 = (a*a - b*b)*(I4); \
    g1 = (e - c)*(I2); g3 = (a - b)*(I2); \
    w(p, O+1) = w1; w(p, O+2) = 1.0_rp - w1 - w3; w(p, O+3) = w3; \
    w(p, O+10) = g1; w(p, O+11) = -(g1 + g3); w(p, O+12) = g3

contains

  !> Weights and slopes of the 3 nodes around the nearest one on each axis, and the first of the
  !> 27 nodes. Positions are measured in cells from the first node of the patch.
  subroutine block_weights(origin, inv_h, l, stride, x, w, first)
    real(rp), intent(in) :: origin(3)        !! position of the patch's first node [m]
    real(rp), intent(in) :: inv_h(3)         !! 1/edges of a cell [1/m]
    real(rp), intent(in) :: l(3)             !! half lengths of a particle's domain [cells]
    integer, intent(in) :: stride(3)         !! node index steps along x, y, z
    real(rp), intent(in) :: x(nlane, 3)      !! positions [m]
    real(rp), intent(out) :: w(nlane, 18)    !! weights of x, y, z (1:9), slopes [1/m] (10:18)
    integer, intent(out) :: first(nlane)     !! index of the first of 27 nodes
    real(rp) :: a, b, c, d, e, i2(3), i4(3), s, w1, w3, g1, g3
    integer :: i, j, k, p

    i4 = 1.0_rp/(4.0_rp*l)
    i2 = inv_h/(2.0_rp*l)
    !$omp simd private(i, j, k, a, b, c, d, e, s, w1, w3, g1, g3)
    do p = 1, nlane
      AXIS(1, i, 0, l(1), i4(1), i2(1))
      AXIS(2, j, 3, l(2), i4(2), i2(2))
      AXIS(3, k, 6, l(3), i4(3), i2(3))
      first(p) = 1 + (i - 1)*stride(1) + (j - 1)*stride(2) + (k - 1)*stride(3)
    end do
  end subroutine block_weights

  !> B-spline weights and slopes of a graded axis (grid_grading). The particles are in the spans
  !> `at` of the patch, whose centres, inverse widths and neighbour coefficients are in `span`.
  subroutine graded_axis(n_span, span, at, x, w, slope)
    integer, intent(in) :: n_span                    !! number of spans of the patch
    real(rp), intent(in) :: span(5, 0:n_span - 1)    !! data of the spans, as in grading_t
    integer, intent(in) :: at(nlane)                 !! span of each particle, from 0
    real(rp), intent(in) :: x(nlane)                 !! positions [m]
    real(rp), intent(out) :: w(nlane, 3), slope(nlane, 3)   !! weights [-], slopes [1/m]
    real(rp) :: d, g1, g3
    real(rp), dimension(nlane) :: below, above, inv, off
    integer :: p

    do p = 1, nlane
      off(p) = span(1, at(p))
      inv(p) = span(2, at(p))
      below(p) = span(3, at(p))
      above(p) = span(4, at(p))
    end do
    !$omp simd private(d, g1, g3)
    do p = 1, nlane
      d = (x(p) - off(p))*inv(p)
      g1 = below(p)*(0.5_rp - d); g3 = above(p)*(0.5_rp + d)
      w(p, 1) = g1*(0.5_rp - d); w(p, 3) = g3*(0.5_rp + d)
      w(p, 2) = 1.0_rp - w(p, 1) - w(p, 3)
      slope(p, 1) = -2.0_rp*inv(p)*g1; slope(p, 3) = 2.0_rp*inv(p)*g3
      slope(p, 2) = -(slope(p, 1) + slope(p, 3))
    end do
  end subroutine graded_axis

  !> Weights and slopes on a uniform axis, and the spans `at` of the particles.
  subroutine uniform_axis(origin, inv_h, x, at, w, slope)
    real(rp), intent(in) :: origin                   !! position of the patch's first node [m]
    real(rp), intent(in) :: inv_h, x(nlane)          !! inverse cell edge [1/m], position [m]
    integer, intent(out) :: at(nlane)
    real(rp), intent(out) :: w(nlane, 3), slope(nlane, 3)   !! weights [-], slopes [1/m]
    real(rp) :: d, g1, g3, s
    integer :: p

    !$omp simd private(d, g1, g3, s)
    do p = 1, nlane
      s = (x(p) - origin)*inv_h
      at(p) = int(s + 0.5_rp)
      d = s - at(p)
      g1 = 0.5_rp - d; g3 = 0.5_rp + d
      w(p, 1) = 0.5_rp*g1*g1; w(p, 3) = 0.5_rp*g3*g3
      w(p, 2) = 1.0_rp - w(p, 1) - w(p, 3)
      slope(p, 1) = -g1*inv_h; slope(p, 3) = g3*inv_h
      slope(p, 2) = -(slope(p, 1) + slope(p, 3))
    end do
  end subroutine uniform_axis

  !> First of the 27 nodes of each particle.
  pure subroutine block_corners(origin, inv_h, stride, x, first)
    real(rp), intent(in) :: origin(3), inv_h(3), x(nlane, 3)
    integer, intent(in) :: stride(3)
    integer, intent(out) :: first(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      first(p) = 1 + (int((x(p, 1) - origin(1))*inv_h(1) + 0.5_rp) - 1)*stride(1) &
                 + (int((x(p, 2) - origin(2))*inv_h(2) + 0.5_rp) - 1)*stride(2) &
                 + (int((x(p, 3) - origin(3))*inv_h(3) + 0.5_rp) - 1)*stride(3)
    end do
  end subroutine block_corners

  !> Weights and slopes with individual half lengths `l` [cells].
  subroutine own_weights(origin, inv_h, l, stride, x, w, first)
    real(rp), intent(in) :: origin(3), inv_h(3), l(nlane, 3), x(nlane, 3)
    integer, intent(in) :: stride(3)
    real(rp), intent(out) :: w(nlane, 18)
    integer, intent(out) :: first(nlane)
    real(rp) :: a, b, c, d, e, s, t, w1, w3, g1, g3
    integer :: i, j, k, p

    !$omp simd private(i, j, k, a, b, c, d, e, s, t, w1, w3, g1, g3)
    do p = 1, nlane
      t = 1.0_rp/(4.0_rp*l(p, 1))
      AXIS(1, i, 0, l(p, 1), t, 2.0_rp*inv_h(1)*t)
      t = 1.0_rp/(4.0_rp*l(p, 2))
      AXIS(2, j, 3, l(p, 2), t, 2.0_rp*inv_h(2)*t)
      t = 1.0_rp/(4.0_rp*l(p, 3))
      AXIS(3, k, 6, l(p, 3), t, 2.0_rp*inv_h(3)*t)
      first(p) = 1 + (i - 1)*stride(1) + (j - 1)*stride(2) + (k - 1)*stride(3)
    end do
  end subroutine own_weights

  !> First moments w (x_i - x_p) of the weights, stored in place of the slopes, and second moments
  !> `square` = sum w (x_i - x_p)^2 on each axis.
  subroutine moment_weights(origin, edge, x, w, moment, square)
    real(rp), intent(in) :: origin(3), edge(3)   !! first node, cell edges [m]
    real(rp), intent(in) :: x(nlane, 3)          !! positions [m]
    real(rp), intent(in) :: w(nlane, 18)         !! weights
    real(rp), intent(out) :: moment(nlane, 18)   !! first moments [m]
    real(rp), intent(out) :: square(nlane, 3)    !! second moments [m2]
    real(rp) :: s, d, h, inv_h
    integer :: a, o, p

    do a = 1, 3
      h = edge(a)
      inv_h = 1.0_rp/h                       ! nearest node by the same rounding as for the weights
      o = 3*(a - 1)
      !$omp simd private(s, d)
      do p = 1, nlane
        s = (x(p, a) - origin(a))*inv_h
        d = h*(s - int(s + 0.5_rp))
        moment(p, o + 1) = w(p, o + 1); moment(p, o + 2) = w(p, o + 2)
        moment(p, o + 3) = w(p, o + 3)
        moment(p, o + 10) = -w(p, o + 1)*(h + d)
        moment(p, o + 11) = -w(p, o + 2)*d
        moment(p, o + 12) = w(p, o + 3)*(h - d)
        square(p, a) = w(p, o + 1)*(h + d)**2 + w(p, o + 2)*d**2 + w(p, o + 3)*(h - d)**2
      end do
    end do
  end subroutine moment_weights

  !> Eight nodes around a point and their linear weights, normalised over the non-empty ones; all
  !> weights are zero if all nodes are empty.
  pure subroutine point_nodes(s, stride, lane, least, nn, g, q, weight)
    real(rp), intent(in) :: s(3)             !! position from the first node of the patch [cells]
    integer, intent(in) :: stride(3), nn
    integer, intent(in) :: lane    !! lane of the records that decides whether a node is empty
    real(rp), intent(in) :: least  !! largest value of an empty node
    real(rp), intent(in) :: g(8, nn)
    integer, intent(out) :: q(0:7)
    real(rp), intent(out) :: weight(0:7)
    real(rp) :: f(3)
    integer :: base(3), c, d(3)

    base = floor(s + 1.0e-9_rp)
    f = s - base
    do c = 0, 7
      d = [iand(c, 1), iand(ishft(c, -1), 1), iand(ishft(c, -2), 1)]
      q(c) = 1 + sum((base + d)*stride)
      weight(c) = product(merge(f, 1.0_rp - f, d == 1))
      if (g(lane, q(c)) <= least) weight(c) = 0.0_rp
    end do
    if (sum(weight) > 0.0_rp) then
      weight = weight/sum(weight)
    else
      weight = 0.0_rp
    end if
  end subroutine point_nodes

  !> Weights of three nodes for a domain around `d` that lies between them: the mean of the linear
  !> nodal functions over the domain.
  pure function domain_weights(d, half) result(w)
    real(rp), intent(in) :: d                !! centre of the domain from the middle node [cells]
    real(rp), intent(in) :: half             !! half length of the domain, above 0 [cells]
    real(rp) :: w(3)

    w(1) = 0.5_rp*(upper(half - d) - upper(-half - d))
    w(3) = 0.5_rp*(upper(half + d) - upper(-half + d))
    w([1, 3]) = w([1, 3])/(2.0_rp*half)
    w(2) = 1.0_rp - w(1) - w(3)
  contains
    !> Integral of 2 max(0, t).
    pure real(rp) function upper(t)
      real(rp), intent(in) :: t

      upper = max(0.0_rp, t)**2
    end function upper
  end function domain_weights

  !> Weights, across a face, of the three nodes around the one nearest to its particle: the mean of
  !> linear functions at `layers` places around the face. Slopes of the particles' weights are
  !> differences of these functions: a uniform stress in the particles of a lattice and the
  !> traction on its faces that belongs to it cancel at every node, and no node gets a weight to
  !> which the particle gives no mass.
  pure function face_weights(d, side, half, reach, layers, spacing) result(w)
    real(rp), intent(in) :: d        !! particle position from its nearest node [cells]
    integer, intent(in) :: side      !! -1 or 1: direction of the outward normal along the axis
    real(rp), intent(in) :: half     !! half length of the particle's weights [cells]
    real(rp), intent(in) :: reach    !! distance of the outermost evaluation point [cells]
    integer, intent(in) :: layers    !! particles within the length of the domain
    real(rp), intent(in) :: spacing  !! particle spacing [cells]
    real(rp) :: w(3), out, t
    integer :: j

    w = 0.0_rp
    out = side*d
    do j = 0, layers - 1
      t = out + reach - j*spacing
      if (out + half <= 0.0_rp) t = min(t, 0.0_rp)    ! the outer node has no mass
      w = w + [max(0.0_rp, -t), 1.0_rp - abs(t), max(0.0_rp, t)]/layers
    end do
    if (side < 0) w = w(3:1:-1)
  end function face_weights

end module transfer_weights
