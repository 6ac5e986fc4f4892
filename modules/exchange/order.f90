! SPDX-License-Identifier: MIT
!> Order of the blocks in the transfer to the grid: those that may reach shared nodes, the border,
!> come first, so that their sums are sent while the other blocks are processed. A sort decides
!> which blocks these are and stores it in the tags, so that a resumed run sums in the same order.
module exchange_order
  use base_kinds, only: nlane, rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: split_mirrors
  use grid_geometry, only: halo, storage_nodes
  use grid_marks, only: dilate
  use mapping_nodes, only: nodes_t
  use particles_store, only: border_bit, f_pos, particles_t, set_bit
  use state_run, only: blocks_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: mark_border, list_to_grid_order

contains

  !> Mark what is processed first: reflections at walls, and after a sort the awake border blocks.
  subroutine mark_border(scene, particles, blocks, nodes, boundary, is_sorted_anew)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(inout) :: boundary
    logical, intent(in) :: is_sorted_anew
    logical, allocatable :: near(:, :, :)
    integer :: b

    call mark_nodes(nodes, boundary, near)
    if (.not. is_sorted_anew) return
    call dilate(near, halo)
    do b = 1, blocks%n_awake
      associate (tag => particles%tag(1, b))
        tag = set_bit(tag, border_bit, &
                      is_near(scene, nodes, particles%count(b), &
                              particles%ps(:, f_pos:f_pos + 2, b), size(near), near))
      end associate
    end do
  end subroutine mark_border

  !> True if the nearest node of one of the `n` particles of a block is marked.
  pure logical function is_near(scene, nodes, n, x, nn, marked)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, nn
    real(rp), intent(in) :: x(nlane, 3)
    logical, intent(in) :: marked(nn)
    integer :: node(nlane)
    logical :: is_own(nlane)

    call storage_nodes(scene%grid, nodes%patch, nlane, x, node, is_own)
    is_near = any(marked(node(:n)))
  end function is_near

  !> True if messages can overlap with computation; periodic images and several velocity fields are
  !> summed without overlap.
  pure logical function can_overlap(nodes)
    type(nodes_t), intent(in) :: nodes

    can_overlap = nodes%halo%n > 0 .and. nodes%n_groups == 1 .and. all(nodes%patch%period == 0)
  end function can_overlap

  !> Mark the nodes, as (z, y, x), that must be complete before the exchange: shared ones, and their
  !> mirror nodes.
  subroutine mark_nodes(nodes, boundary, near)
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(inout) :: boundary
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: marked(nodes%patch%nn)
    integer :: n(3)

    n = 0
    if (nodes%patch%nn > 0) n = nodes%patch%all%hi - nodes%patch%all%lo + 1
    marked = .not. can_overlap(nodes)
    marked(nodes%halo%shared) = .true.
    call split_mirrors(boundary, marked)
    near = reshape(marked, n([3, 2, 1]))
  end subroutine mark_nodes

  !> Order of the awake blocks in the transfer to the grid: the border first.
  subroutine list_to_grid_order(particles, blocks)
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(inout) :: blocks
    logical :: is_border(blocks%n_awake)
    integer :: b

    is_border = btest(particles%tag(1, :blocks%n_awake), border_bit)
    blocks%n_border = count(is_border)
    blocks%turn = [pack([(b, b=1, blocks%n_awake)], is_border), &
                pack([(b, b=1, blocks%n_awake)], .not. is_border)]
  end subroutine list_to_grid_order

end module exchange_order
