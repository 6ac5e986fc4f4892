! SPDX-License-Identifier: MIT
!> Order of the blocks in the transfer to the grid: those that may reach shared nodes, the border,
!> come first, so that their sums are sent while the other blocks are processed. A sort decides
!> which blocks these are and stores it in the tags, so that a resumed run sums in the same order.
module run_order
  use base_kinds, only: nlane, rp
  use boundary_symmetry, only: split_mirrors
  use grid_geometry, only: halo, storage_nodes
  use grid_neighbours, only: dilate
  use particles_store, only: border_bit, f_pos, particles_t, set_bit
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: mark_border, list_to_grid_order

contains

  !> Mark pairs at walls that are reflected first, and after a sort the awake border blocks.
  subroutine mark_border(scene, particles, nodes, is_sorted_anew)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    logical, intent(in) :: is_sorted_anew
    logical, allocatable :: near(:, :, :)
    integer :: b

    call mark_nodes(scene, nodes, near)
    if (.not. is_sorted_anew) return
    call dilate(near, halo)
    do b = 1, particles%n_awake
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

  !> Mark the nodes, as (z, y, x), that must be complete before the exchange: shared ones, and their
  !> mirror nodes.
  subroutine mark_nodes(scene, nodes, near)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: marked(nodes%patch%nn)
    integer :: n(3)

    n = 0
    if (nodes%patch%nn > 0) n = nodes%patch%all%hi - nodes%patch%all%lo + 1
    ! Periodic images and several velocity fields are summed before the computation goes on.
    marked = nodes%halo%n == 0 .or. nodes%n_groups > 1 .or. any(nodes%patch%period /= 0)
    marked(nodes%halo%shared) = .true.
    call split_mirrors(scene, nodes, marked)
    near = reshape(marked, n([3, 2, 1]))
  end subroutine mark_nodes

  !> Order of the awake blocks in the transfer to the grid: the border first.
  subroutine list_to_grid_order(particles)
    type(particles_t), intent(inout) :: particles
    logical :: is_border(particles%n_awake)
    integer :: b

    is_border = btest(particles%tag(1, :particles%n_awake), border_bit)
    particles%n_border = count(is_border)
    particles%turn = [pack([(b, b=1, particles%n_awake)], is_border), &
                      pack([(b, b=1, particles%n_awake)], .not. is_border)]
  end subroutine list_to_grid_order

end module run_order
