! SPDX-License-Identifier: MIT
!> F-bar. One volume ratio for all particles of a body in a cell. Since it is restored in every
!> step, the volume follows the mean divergence there, one constraint a cell instead of one a
!> particle, and nearly incompressible flow does not lock.
!>
!> Cells of the grid, not those around its nodes: the divergence around a node is that of central
!> differences, which do not feel a pressure that alternates along a single axis.
module mapping_fbar
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use mapping_nodes, only: nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: clear_volume, add_volume, sum_volume, take_volume

contains

  !> Before a transfer to the grid.
  subroutine clear_volume(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    integer :: r

    if (.not. scene%method%fbar) return
    do r = 1, nodes%n_ranges
      nodes%volume(:, nodes%range(1, r):nodes%range(2, r)) = 0.0_rp
    end do
  end subroutine clear_volume

  !> Add mass and mass times J of a block to the lowest nodes of the particles' cells.
  pure subroutine add_volume(n, w, first, stride, mass, jac, body, rows, nn, volume)
    integer, intent(in) :: n, first(nlane), stride(3), body, rows, nn
    real(rp), intent(in) :: w(nlane, 18), mass(nlane), jac(nlane)
    real(rp), intent(inout) :: volume(rows, nn)
    integer :: cell(nlane), p, r

    cell = cells_of(w, first, stride)
    r = 2*body - 1
    do p = 1, n
      volume(r, cell(p)) = volume(r, cell(p)) + mass(p)
      volume(r + 1, cell(p)) = volume(r + 1, cell(p)) + mass(p)*jac(p)
    end do
  end subroutine add_volume

  !> The lowest node of each particle's cell, by its weights: of the three nodes along an axis, the
  !> nearest of which is in the middle, the one beyond has less weight.
  pure function cells_of(w, first, stride) result(cell)
    real(rp), intent(in) :: w(nlane, 18)
    integer, intent(in) :: first(nlane), stride(3)
    integer :: cell(nlane), p

    !$omp simd
    do p = 1, nlane
      cell(p) = first(p) + merge(stride(1), 0, w(p, 1) <= w(p, 3)) &
                + merge(stride(2), 0, w(p, 4) <= w(p, 6)) + merge(stride(3), 0, w(p, 7) <= w(p, 9))
    end do
  end function cells_of

  !> Sum over ranks.
  subroutine sum_volume(world, scene, nodes)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes

    if (.not. scene%method%fbar) return
    call nodes%halo%sum(world, size(nodes%volume, 1), nodes%patch%nn, nodes%volume)
  end subroutine sum_volume

  !> Give the particles of a block the mean J of their cells.
  pure subroutine take_volume(n, w, first, stride, body, rows, nn, volume, jac)
    integer, intent(in) :: n, first(nlane), stride(3), body, rows, nn
    real(rp), intent(in) :: w(nlane, 18), volume(rows, nn)
    real(rp), intent(inout) :: jac(nlane)
    integer :: cell(nlane), p, r

    cell = cells_of(w, first, stride)
    r = 2*body - 1
    do p = 1, n
      jac(p) = volume(r + 1, cell(p))/volume(r, cell(p))
    end do
  end subroutine take_volume

end module mapping_fbar
