! SPDX-License-Identifier: MIT
!> F-bar averaging: the volume ratios J of a body's particles in a cell are relaxed towards their
!> mean, so that the volume follows the mean divergence: one constraint per cell instead of one per
!> particle, which avoids locking in nearly incompressible flow.
!>
!> A nearly incompressible elastic material takes the mean in every step. Where metal flows, the
!> relaxed fraction is such that pressures of neighbours, which differ by about K rate dt more after
!> each step, differ by the flow stress at most: taking the full mean in every step would remove
!> variations that the cells resolve, and add noise to the velocities.
!>
!> Cells of the grid are used instead of those around its nodes: the divergence around a node is
!> that of central differences, which are 0 for a field that alternates along a single axis.
module mpm_fbar
  use base_kinds, only: nlane, rp
  use particles_block, only: block_t
  use particles_store, only: f_flow, f_jac, f_mass, f_rate
  use state_nodes, only: nodes_t
  use state_scene, only: average_always, average_never, scene_t
  implicit none (type, external)
  private

  public :: clear_volume, add_volume, sum_volume, relax_volume

contains

  !> Clear the sums before a transfer to the grid.
  subroutine clear_volume(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    integer :: r

    if (.not. scene%method%fbar) return
    do r = 1, nodes%n_ranges
      nodes%volume(:, nodes%range(1, r):nodes%range(2, r)) = 0.0_rp
    end do
  end subroutine clear_volume

  !> Fraction of the way to the mean by which the volume ratio of each particle is relaxed in a
  !> step: min(1, K rate dt/flow stress) where metal flows.
  pure function averaging_fraction(averaging, bulk, dt, rate, flow) result(share)
    integer, intent(in) :: averaging                       !! average_* of the body
    real(rp), intent(in) :: bulk, dt                       !! K [Pa], length of the last step [s]
    real(rp), intent(in) :: rate(nlane)   !! plastic strain rate [1/s]
    real(rp), intent(in) :: flow(nlane)   !! flow stress [Pa]
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
  end function averaging_fraction

  !> Add mass and mass times J of a block, weighted by the averaging fractions, to the lowest nodes
  !> of the cells of its particles.
  pure subroutine add_volume(averaging, bulk, dt, block, stride, rows, nn, volume)
    integer, intent(in) :: averaging
    real(rp), intent(in) :: bulk, dt                       !! K [Pa], length of the last step [s]
    type(block_t), intent(in) :: block
    integer, intent(in) :: stride(3), rows, nn
    real(rp), intent(inout) :: volume(rows, nn)
    real(rp) :: mass(nlane)
    integer :: cell(nlane), p, r

    if (averaging == average_never) return
    associate (ps => block%ps)
      mass = ps(:, f_mass)*averaging_fraction(averaging, bulk, dt, ps(:, f_rate), ps(:, f_flow))
      cell = cells_of(block%w, block%first, stride)
      r = 2*block%body - 1
      do p = 1, block%n
        volume(r, cell(p)) = volume(r, cell(p)) + mass(p)
        volume(r + 1, cell(p)) = volume(r + 1, cell(p)) + mass(p)*ps(p, f_jac)
      end do
    end associate
  end subroutine add_volume

  !> Lowest node of each particle's cell, from its weights: of the three nodes along an axis, the
  !> middle one is the nearest, and the outer node of the other cell has the smaller weight.
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

  !> Sum the masses and volumes of the cells over the ranks.
  subroutine sum_volume(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes

    if (.not. scene%method%fbar) return
    call nodes%halo%sum(size(nodes%volume, 1), nodes%patch%nn, nodes%volume)
  end subroutine sum_volume

  !> Relax J of the particles of a block towards the mean of their cells.
  pure subroutine relax_volume(averaging, bulk, dt, stride, rows, nn, volume, block)
    integer, intent(in) :: averaging, stride(3), rows, nn
    real(rp), intent(in) :: bulk, dt                       !! K [Pa], length of the last step [s]
    real(rp), intent(in) :: volume(rows, nn)
    type(block_t), intent(inout) :: block
    real(rp) :: share(nlane)
    integer :: cell(nlane), p, r

    associate (ps => block%ps)
      share = averaging_fraction(averaging, bulk, dt, ps(:, f_rate), ps(:, f_flow))
      cell = cells_of(block%w, block%first, stride)
      r = 2*block%body - 1
      do p = 1, block%n
        if (share(p)*ps(p, f_mass) <= 0.0_rp) cycle
        ps(p, f_jac) = ps(p, f_jac) &
                       + share(p)*(volume(r + 1, cell(p))/volume(r, cell(p)) - ps(p, f_jac))
      end do
    end associate
  end subroutine relax_volume

end module mpm_fbar
