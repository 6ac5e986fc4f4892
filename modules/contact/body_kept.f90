! SPDX-License-Identifier: MIT
!> Normals that are kept while both bodies move by less than a small distance. Meanwhile surfaces
!> move with the velocity of their body there. After a sort all normals are found anew.
module contact_body_kept
  use base_kinds, only: rp
  use contact_body_near, only: far_distance
  use grid_geometry, only: grid_t, patch_t
  use mapping_nodes, only: min_node_mass, nodes_t
  use simulation_node_pairs, only: n_kept, node_pairs_t
  use state_run, only: clock_t
  use state_scene, only: scene_t
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: keep_entries, recall

  real(rp), parameter :: longest_way = 0.01_rp    !! path of a body with one normal [shortest cell
                                                  !! edges]
  real(rp), parameter :: elsewhere = -1.0e9_rp    !! surface at a node of another rank [m]

contains

  !> Take normals and surfaces over from the last step; entries without them are due.
  subroutine recall(grid, clock, patch, pairs)
    type(grid_t), intent(in) :: grid
    type(clock_t), intent(in) :: clock
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    integer :: e, o

    pairs%is_due = pairs%may_touch
    pairs%gap = far_distance
    pairs%normal = 0.0_rp
    pairs%ends = 0.0_rp
    pairs%way = 0.0_rp
    if (clock%sorted_at == clock%step) return
    o = 1
    do e = 1, pairs%n
      do while (o <= size(pairs%kept, 2))
        if (pairs%kept(1, o) >= key(grid, patch, pairs, e)) exit
        o = o + 1
      end do
      if (o > size(pairs%kept, 2)) exit
      associate (kept => pairs%kept(:, o))
        if (kept(1) > key(grid, patch, pairs, e) .or. .not. pairs%may_touch(e)) cycle
        if (kept(7) > longest_way*minval(patch%edges_at(pairs%x(:, e)))) cycle
        pairs%is_due(e) = .false.
        pairs%normal(:, e) = kept(2:4)
        pairs%ends(:, e) = kept(5:6)
        pairs%way(e) = kept(7)
      end associate
    end do
  end subroutine recall

  !> Number of an entry, the same for every patch of nodes; it increases from entry to entry.
  pure real(rp) function key(grid, patch, pairs, e)
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(in) :: pairs
    integer, intent(in) :: e
    integer, parameter :: beyond = 8       ! nodes beyond either side of the grid, at most
    real(rp) :: row(3)

    row = real(patch%indices(pairs%node(e)) + beyond, rp)
    key = (row(1)*(grid%n(2) + 2*beyond) + row(2))*(grid%n(3) + 2*beyond) + row(3) &
      + scale(real(pairs%pair(e), rp), -20)
  end function key

  !> Keep the entries with a gap for the next step, after a step of length `dt` in which particles
  !> move with the velocities `g`. The rank that owns a node moves its surfaces.
  subroutine keep_entries(scene, nodes, dt, g, pairs)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt               !! [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), allocatable :: kept(:, :)
    real(rp) :: at(3), out(3), speed(2), v(3)
    integer :: e, k, n

    allocate (kept(n_kept, pairs%n))
    n = 0
    do e = 1, pairs%n
      if (pairs%gap(e) >= far_distance) cycle
      n = n + 1
      at = nodes%patch%linear_place(pairs%x(:, e))
      do k = 1, 2
        kept(4 + k, n) = elsewhere
        out = (3 - 2*k)*pairs%normal(:, e)
        associate (group => scene%contact(pairs%pair(e))%group(k))
          speed(k) = norm2(g(:3, pairs%node(e), group))
          if (.not. pairs%is_owned(e)) cycle
          v = velocity_near(nodes, at, pairs%x(:, e) + pairs%ends(k, e)*out, g(:, :, group))
          kept(4 + k, n) = pairs%ends(k, e) + dt*dot_product(out, v)
        end associate
      end do
      kept(:4, n) = [key(scene%grid, nodes%patch, pairs, e), pairs%normal(:, e)]
      kept(7, n) = pairs%way(e) + dt*maxval(speed)
    end do
    pairs%kept = kept(:, :n)
  end subroutine keep_entries

  !> Velocity of a body at `x`, at most two cells from the node at `place`, between its nodes [m/s].
  pure function velocity_near(nodes, place, x, g) result(v)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: place(3), x(3), g(8, nodes%patch%nn)
    real(rp), parameter :: reach = 2.0_rp - 1.0e-6_rp
    real(rp) :: v(3), weight(8)
    integer :: k, q(8)

    call point_nodes(max(place - reach, min(place + reach, nodes%patch%linear_place(x))), &
                     nodes%patch%stride, 8, min_node_mass, nodes%patch%nn, g, q, weight)
    do k = 1, 3
      v(k) = sum(weight*g(k, q))
    end do
  end function velocity_near

end module contact_body_kept
