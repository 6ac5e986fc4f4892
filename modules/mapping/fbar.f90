! SPDX-License-Identifier: MIT
!> F-bar. The volume ratios of a body's particles in a cell approach their mean, so that the volume
!> follows the mean divergence there: one constraint a cell instead of one a particle, and nearly
!> incompressible flow does not lock.
!>
!> A nearly incompressible elastic material has the mean in every step. Where metal flows, the part
!> of the way is such that pressures of neighbours, which differ by about K rate dt more after each
!> step, differ by about the flow stress at most: all of the way in every step would take from the
!> field what the cells do resolve, and give noise to the velocities.
!>
!> Cells of the grid, not those around its nodes: the divergence around a node is that of central
!> differences, which do not feel a pressure that alternates along a single axis.
module mapping_fbar
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_flow, f_jac, f_mass, f_rate
  use state_scene, only: average_always, average_never, scene_t
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

  !> Part of the way to the mean that the volume ratio of each particle of a block goes in a step:
  !> min(1, K rate dt/flow stress) where metal flows.
  pure function share_of_mean(averaging, bulk, dt, rate, flow) result(share)
    integer, intent(in) :: averaging                       !! average_* of the body
    real(rp), intent(in) :: bulk, dt                       !! K [Pa], last step [s]
    real(rp), intent(in) :: rate(nlane), flow(nlane)       !! [1/s], [Pa]
    real(rp) :: share(nlane)
    integer :: p

    if (averaging == average_always) then
      share = 1.0_rp
      return
    end if
    !$omp simd
    do p = 1, nlane
      share(p) = min(bulk*dt*rate(p), flow(p))/max(flow(p), tiny(1.0_rp))
    end do
  end function share_of_mean

  !> Add mass and mass times J of a block, by the shares of its particles, to the lowest nodes of
  !> their cells.
  pure subroutine add_volume(averaging, bulk, dt, body, n, w, first, stride, nf, ps, rows, nn, &
                             volume)
    integer, intent(in) :: averaging, body, n, first(nlane), stride(3), nf, rows, nn
    real(rp), intent(in) :: bulk, dt                       !! K [Pa], last step [s]
    real(rp), intent(in) :: w(nlane, 18), ps(nlane, nf)
    real(rp), intent(inout) :: volume(rows, nn)
    real(rp) :: mass(nlane)
    integer :: cell(nlane), p, r

    if (averaging == average_never) return
    mass = ps(:, f_mass)*share_of_mean(averaging, bulk, dt, ps(:, f_rate), ps(:, f_flow))
    cell = cells_of(w, first, stride)
    r = 2*body - 1
    do p = 1, n
      volume(r, cell(p)) = volume(r, cell(p)) + mass(p)
      volume(r + 1, cell(p)) = volume(r + 1, cell(p)) + mass(p)*ps(p, f_jac)
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

  !> Take the particles of a block their shares of the way to the mean J of their cells.
  pure subroutine take_volume(averaging, bulk, dt, body, n, w, first, stride, rows, nn, volume, &
                              nf, ps)
    integer, intent(in) :: averaging, body, n, first(nlane), stride(3), rows, nn, nf
    real(rp), intent(in) :: bulk, dt                       !! K [Pa], last step [s]
    real(rp), intent(in) :: w(nlane, 18), volume(rows, nn)
    real(rp), intent(inout) :: ps(nlane, nf)
    real(rp) :: share(nlane)
    integer :: cell(nlane), p, r

    share = share_of_mean(averaging, bulk, dt, ps(:, f_rate), ps(:, f_flow))
    cell = cells_of(w, first, stride)
    r = 2*body - 1
    do p = 1, n
      if (share(p)*ps(p, f_mass) <= 0.0_rp) cycle
      ps(p, f_jac) = ps(p, f_jac) &
                     + share(p)*(volume(r + 1, cell(p))/volume(r, cell(p)) - ps(p, f_jac))
    end do
  end subroutine take_volume

end module mapping_fbar
