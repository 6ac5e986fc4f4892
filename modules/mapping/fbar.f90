! SPDX-License-Identifier: MIT
!> F-bar. One volume ratio for all particles of a body next to a node. Since it is restored in every
!> step, the volume follows the mean divergence there, one constraint a node instead of one a
!> particle, and nearly incompressible flow does not lock.
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

  !> Add mass and mass times J of a block to the nodes nearest to its particles.
  pure subroutine add_volume(n, first, stride, mass, jac, body, rows, nn, volume)
    integer, intent(in) :: n, first(nlane), stride(3), body, rows, nn
    real(rp), intent(in) :: mass(nlane), jac(nlane)
    real(rp), intent(inout) :: volume(rows, nn)
    real(rp) :: m, v
    integer :: p, q, r

    r = 2*body - 1
    p = 1
    do while (p <= n)
      q = first(p)
      m = 0.0_rp
      v = 0.0_rp
      do while (first(p) == q)                 ! neighbours in the block share the node
        m = m + mass(p)
        v = v + mass(p)*jac(p)
        p = p + 1
        if (p > n) exit
      end do
      q = q + sum(stride)
      volume(r, q) = volume(r, q) + m
      volume(r + 1, q) = volume(r + 1, q) + v
    end do
  end subroutine add_volume

  !> Sum over ranks.
  subroutine sum_volume(world, scene, nodes)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes

    if (.not. scene%method%fbar) return
    call nodes%halo%sum(world, size(nodes%volume, 1), nodes%patch%nn, nodes%volume)
  end subroutine sum_volume

  !> Give the particles of a block the mean J of their nodes.
  pure subroutine take_volume(n, first, stride, body, rows, nn, volume, jac)
    integer, intent(in) :: n, first(nlane), stride(3), body, rows, nn
    real(rp), intent(in) :: volume(rows, nn)
    real(rp), intent(inout) :: jac(nlane)
    integer :: p, q, r

    r = 2*body - 1
    !$omp simd private(q)
    do p = 1, n
      q = first(p) + sum(stride)
      jac(p) = volume(r + 1, q)/volume(r, q)
    end do
  end subroutine take_volume

end module mapping_fbar
