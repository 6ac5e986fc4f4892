! SPDX-License-Identifier: MIT
!> Weights of single places between the nodes: of a point, and of a face of a particle.
module transfer_points
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: point_nodes, face_weights

contains

  !> The eight nodes around a point and their linear weights, over their sum for those that are not
  !> empty; all weights are zero if none is.
  pure subroutine point_nodes(s, stride, lane, least, nn, g, q, weight)
    real(rp), intent(in) :: s(3)             !! place, from the first node of the patch [cells]
    integer, intent(in) :: stride(3), nn
    integer, intent(in) :: lane              !! of the records that says if a node is empty,
    real(rp), intent(in) :: least            !! being no larger than this
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

  !> Weights, across a face, of the three nodes around the one nearest to its particle: the mean of
  !> linear functions at `layers` places around the face. Slopes of the particles' weights are
  !> differences of these functions: a uniform stress in the particles of a lattice and the
  !> traction on its faces that belongs to it cancel at every node, and no node gets a weight to
  !> which the particle gives no mass.
  pure function face_weights(d, side, half, reach, layers, spacing) result(w)
    real(rp), intent(in) :: d                !! of the particle from its nearest node [cells]
    integer, intent(in) :: side              !! -1 or 1: where the face looks to along the axis
    real(rp), intent(in) :: half             !! half length of the particle's weights [cells]
    real(rp), intent(in) :: reach            !! to the farthest place [cells]
    integer, intent(in) :: layers            !! particles within the length of the weights
    real(rp), intent(in) :: spacing          !! of particles [cells]
    real(rp) :: w(3), out, t
    integer :: j

    w = 0.0_rp
    out = side*d
    do j = 0, layers - 1
      t = out + reach - j*spacing
      if (out + half <= 0.0_rp) t = min(t, 0.0_rp)    ! no mass at the next node
      w = w + [max(0.0_rp, -t), 1.0_rp - abs(t), max(0.0_rp, t)]/layers
    end do
    if (side < 0) w = w(3:1:-1)
  end function face_weights

end module transfer_points
