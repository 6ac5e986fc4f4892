! SPDX-License-Identifier: MIT
!> Node pairs of bodies in contact and the gaps there. A gap is that between the particles
!> themselves: a surface is where the foremost of its particles with weight at the node ends.
module body_contact_gaps
  use base_kinds, only: rp
  use body_contact_links, only: find_surfaces, list_links
  use body_contact_node_pairs, only: n_sums_all, n_sums_gradient, n_trials, node_pairs_t
  use body_contact_normals, only: average_normals, choose_normals, try_normals
  use boundary_held, only: boundary_t
  use comm_world, only: world_t
  use contact_pair, only: normal_regression
  use mapping_nodes, only: least_mass, nodes_t
  use particles_store, only: particles_t
  use state_blocks, only: blocks_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: find_node_pairs

  real(rp), parameter :: clearly = 1.0e-3_rp        !! less gap of a better direction [cells]

contains

  !> Collective. List the nodes with mass of two groups, their normals and gaps.
  subroutine find_node_pairs(world, scene, particles, blocks, nodes, boundary, pairs, g)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: k

    call list_nodes(scene, nodes, pairs, g)
    call note_walls(scene, boundary, pairs)
    call list_links(scene, particles, blocks, nodes, pairs)
    call sum_entries(world, nodes, pairs, .false., size(pairs%sums, 1), pairs%sums)
    call try_normals(scene, nodes, pairs)
    call find_all_surfaces(world, scene, nodes, pairs, 1, n_trials - 1)
    pairs%gap = -huge(1.0_rp)
    pairs%normal = 0.0_rp
    do k = n_trials - 1, 1, -1
      call choose_normals(pairs, k, merge(0.0_rp, -clearly*minval(nodes%patch%h), k > 2))
    end do
    call average_normals(scene, nodes, pairs, g, pairs%trial(:, n_trials, :))
    call sum_entries(world, nodes, pairs, .false., 3, pairs%trial(:, n_trials, :))
    call find_all_surfaces(world, scene, nodes, pairs, n_trials, n_trials)
    call choose_normals(pairs, n_trials, -clearly*minval(nodes%patch%h))
    pairs%is_known = .true.
  end subroutine find_node_pairs

  !> Collective. Surfaces of both bodies along the trial normals `from` to `to`.
  subroutine find_all_surfaces(world, scene, nodes, pairs, from, to)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: from, to

    call find_surfaces(scene, pairs, from, to)
    call sum_entries(world, nodes, pairs, .true., 2*(to - from + 1), &
                     pairs%surface(2*from - 1:2*to, :))
  end subroutine find_all_surfaces

  subroutine sum_entries(world, nodes, pairs, largest, width, values)
    type(world_t), intent(in) :: world
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    logical, intent(in) :: largest
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, pairs%n)

    call nodes%halo%combine(world, largest, nodes%patch%nn, pairs%first, pairs%n, pairs%node, &
                            width, values)
  end subroutine sum_entries

  !> An entry for each pair of groups with mass at a node.
  subroutine list_nodes(scene, nodes, pairs, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: c, e, i, pass, r, width

    call pairs%forget(nodes%patch%nn)
    width = n_sums_gradient
    if (any(scene%contact%normal == normal_regression)) width = n_sums_all
    do pass = 1, 2
      e = 0
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          do c = 1, size(scene%contact)
            if (any(g(8, i, scene%contact(c)%group) <= least_mass)) cycle
            e = e + 1
            if (pass == 1) cycle
            pairs%node(e) = i
            pairs%pair(e) = c
            pairs%is_owned(e) = nodes%range(3, r) == 1
            pairs%x(:, e) = nodes%patch%position(i)
            if (pairs%first(i) == 0) pairs%first(i) = e
          end do
        end do
      end do
      if (pass == 1) call pairs%reserve(e, width)
    end do
    pairs%free = 1.0_rp
  end subroutine list_nodes

  !> Directions in which a wall or clamp holds the nodes.
  subroutine note_walls(scene, boundary, pairs)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(node_pairs_t), intent(inout) :: pairs
    integer :: i

    do i = 1, boundary%n_fixed
      call note_node(pairs, boundary%fixed(1, i), scene%clamp(boundary%fixed(2, i))%clamp%held)
    end do
    do i = 1, boundary%mirrors%n_planes
      associate (plane => boundary%mirrors%plane(:, i))
        call note_node(pairs, plane(1), scene%symmetry(plane(2))%odd)
      end associate
    end do
  end subroutine note_walls

  !> The entries of node `q` are not free in directions that are `held`.
  pure subroutine note_node(pairs, q, held)
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: q
    logical, intent(in) :: held(3)
    integer :: e

    e = pairs%first(q)
    if (e == 0) return
    do while (pairs%node(e) == q)
      where (held) pairs%free(:, e) = 0.0_rp
      e = e + 1
      if (e > pairs%n) exit
    end do
  end subroutine note_node

end module body_contact_gaps
