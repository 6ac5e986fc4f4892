! SPDX-License-Identifier: MIT
!> Normals that are kept while both bodies move by less than a small distance. Meanwhile surfaces
!> move with the velocity of their body there. The rank that owns a node keeps its normals.
module contact_body_kept
  use base_kinds, only: rp
  use contact_body_near, only: far_distance
  use grid_geometry, only: patch_t
  use state_node_pairs, only: min_weight, n_kept, node_pairs_t
  use state_nodes, only: min_node_mass, nodes_t
  use state_scene, only: scene_t
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: keep_entries, recall

  !> Path of a body up to which its normal stays the same [shortest cell edges].
  real(rp), parameter :: max_path = 0.005_rp

contains

  !> Normal, surfaces and path of each entry of this rank's nodes; -huge for entries without stored
  !> values and for those whose bodies have moved too far.
  pure subroutine recall(scene, patch, pairs, values)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(in) :: pairs
    real(rp), intent(out) :: values(n_kept - 1, pairs%n)
    real(rp) :: sought
    integer :: e, o

    values = -huge(1.0_rp)
    o = 1
    do e = 1, pairs%n
      if (.not. (pairs%is_owned(e) .and. pairs%may_touch(e))) cycle
      sought = key(scene, patch, pairs, e)
      do while (o <= size(pairs%kept, 2))
        if (pairs%kept(1, o) >= sought) exit
        o = o + 1
      end do
      if (o > size(pairs%kept, 2)) exit
      if (pairs%kept(1, o) > sought) cycle
      if (pairs%kept(n_kept, o) > max_path*minval(patch%edges_at(pairs%x(:, e)))) cycle
      values(:, e) = pairs%kept(2:, o)
    end do
  end subroutine recall

  !> Identifier of an entry, the same on all ranks; it increases from entry to entry.
  pure real(rp) function key(scene, patch, pairs, e)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(in) :: pairs
    integer, intent(in) :: e
    integer, parameter :: beyond = 8       ! largest number of nodes beyond either side of the grid
    real(rp) :: width(3), row(3)

    width = real(scene%grid%n + 2*beyond, rp)
    row = real(patch%indices(pairs%node(e)) + beyond, rp)
    key = ((row(1)*width(2) + row(2))*width(3) + row(3))*size(scene%contact) + pairs%pair(e)
  end function key

  !> Keep the entries with a gap of this rank's nodes for the next step, after a step of length `dt`
  !> in which particles move with the velocities `g`.
  subroutine keep_entries(scene, nodes, dt, g, pairs)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt               !! time step [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), allocatable :: kept(:, :)
    real(rp) :: at(3), ends(2), out(3), speed(2)
    integer :: e, k, n

    allocate (kept(n_kept, pairs%n))
    n = 0
    do e = 1, pairs%n
      if (pairs%gap(e) >= far_distance .or. .not. pairs%is_owned(e)) cycle
      n = n + 1
      at = nodes%patch%linear_place(pairs%x(:, e))
      do k = 1, 2
        out = (3 - 2*k)*pairs%normal(:, e)
        associate (group => scene%contact(pairs%pair(e))%group(k), x => pairs%x(:, e))
          speed(k) = norm2(g(:3, pairs%node(e), group))
          ends(k) = pairs%ends(k, e) + dt*dot_product(out, velocity_near( &
                    nodes, at, x + pairs%ends(k, e)*out, g(:, :, group)))
        end associate
      end do
      kept(:, n) = [key(scene, nodes%patch, pairs, e), pairs%normal(:, e), ends, &
                    pairs%way(e) + dt*max(speed(1), speed(2))]
    end do
    pairs%kept = kept(:, :n)
  end subroutine keep_entries

  !> Velocity of a body at `x`, at most two cells from the node at `place`, between its nodes [m/s].
  !> Nodes without a particle that counts for the surface do not: they are light and may be fast.
  pure function velocity_near(nodes, place, x, g) result(v)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: place(3), x(3), g(8, nodes%patch%nn)
    real(rp), parameter :: reach = 2.0_rp - 1.0e-6_rp
    real(rp) :: v(3), weight(8)
    integer :: k, q(8)

    call point_nodes(max(place - reach, min(place + reach, nodes%patch%linear_place(x))), &
                     nodes%patch%stride, 8, min_node_mass, nodes%patch%nn, g, q, weight)
    where (g(8, q) <= min_weight*maxval(g(8, q))) weight = 0.0_rp
    if (sum(weight) > 0.0_rp) weight = weight/sum(weight)
    do k = 1, 3
      v(k) = sum(weight*g(k, q))
    end do
  end function velocity_near

end module contact_body_kept
