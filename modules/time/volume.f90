! SPDX-License-Identifier: MIT
!> F-bar: one volume ratio for all particles of a body next to a node. Since it is restored in every
!> step, the volume follows the mean divergence there, one constraint a node instead of one a
!> particle, and nearly incompressible flow does not lock.
module time_volume
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: clear_volume, add_volume, share_volume, take_volume

contains

  !> Before a transfer to the grid.
  subroutine clear_volume(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: r

    if (.not. sim%scene%method%fbar) return
    do r = 1, sim%n_runs
      sim%volume(:, sim%run(1, r):sim%run(2, r)) = 0.0_rp
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
  subroutine share_volume(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim

    if (.not. sim%scene%method%fbar) return
    call sim%halo%sum(world, size(sim%volume, 1), sim%patch%nn, sim%volume)
  end subroutine share_volume

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

end module time_volume
