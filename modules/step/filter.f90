! SPDX-License-Identifier: MIT
!> Velocity filters that remove particle velocities invisible to the grid: v(k) = (1 + A + .. +
!> A^(k-1)) v, A = 1 - S+ S, where S maps nodes to particles and S+ particles to nodes (FMPM: Nairn
!> 2021, CMES 126:1243; applied to the velocity before the step, XPIC: Hammerquist & Nairn 2017,
!> CMAME 318:724).
module step_filter
  use base_kinds, only: nlane, rp
  use boundary_clamps, only: release_held
  use boundary_symmetry, only: reflect, r_filter, restore
  use contact_body_pairs, only: join_increments
  use mpm_blocks, only: gather_lanes, values_to_grid
  use particles_block, only: block_t, view_block
  use particles_store, only: f_mass
  use state_clock, only: clock_t
  use state_nodes, only: clear_nodes, nodes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t, transfer_xpic
  implicit none (type, external)
  private

  public :: filter_velocity

contains

  !> Replace the nodal velocities by v(k). Nodes on walls keep their velocities, as their increments
  !> are zero.
  subroutine filter_velocity(sim, g, mapped, increment)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout), dimension(8, sim%nodes%patch%nn, sim%nodes%n_groups) :: g
    real(rp), intent(inout), dimension(8, sim%nodes%patch%nn, sim%nodes%n_groups) :: mapped, &
      increment
    real(rp) :: old, lost(8, size(sim%scene%symmetry))
    integer :: k, power

    old = merge(1.0_rp, 0.0_rp, sim%scene%method%transfer == transfer_xpic)
    call start_increment(sim%nodes, old, g, increment)
    lost = 0.0_rp                                ! not used
    call clear_nodes(sim%nodes, mapped)
    do power = 2, sim%scene%method%order
      call map_and_return(sim, increment, mapped)
      do k = 1, sim%nodes%n_groups
        call reflect(sim%scene, sim%nodes, r_filter, mapped(:, :, k), lost)
        call sim%nodes%halo%sum(8, sim%nodes%patch%nn, mapped(:, :, k))
      end do
      call update_increment(sim%nodes, g, mapped, increment)
      call release_held(sim%scene, sim%nodes, g, increment)
      if (sim%nodes%n_groups > 1) then
        call join_increments(sim%scene, sim%nodes, sim%pairs, g, increment)
      end if
      do k = 1, sim%nodes%n_groups
        call restore(sim%scene, sim%nodes, r_filter, increment(:, :, k))
      end do
      call add_increment(sim%nodes, increment, g)
    end do
  end subroutine filter_velocity

  !> Start the series, in lanes 5:7, with the new velocities less `old` times those before the step.
  subroutine start_increment(nodes, old, g, increment)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: old, g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(inout) :: increment(8, nodes%patch%nn, nodes%n_groups)
    integer :: i, k, r

    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          increment(5:7, i, k) = g(1:3, i, k) - old*g(5:7, i, k)
          increment(8, i, k) = 0.0_rp
        end do
      end do
    end do
  end subroutine start_increment

  !> Map the increment to the particles, and the momentum of the particles at these velocities back
  !> to the nodes.
  subroutine map_and_return(sim, increment, mapped)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: increment(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    real(rp), intent(inout) :: mapped(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(block_t) :: block
    integer :: b, k

    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, f_mass)
      call view_block(sim%particles, b, block)
      k = sim%scene%body(block%body)%group
      call map_block(sim%scene, sim%clock, sim%nodes, block, increment(:, :, k), mapped(:, :, k))
    end do
  end subroutine map_and_return

  !> Map the increment of one block to its particles and back.
  subroutine map_block(scene, clock, nodes, block, increment, mapped)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: increment(8, nodes%patch%nn)
    real(rp), intent(inout) :: mapped(8, nodes%patch%nn)
    integer :: p
    real(rp) :: u(nlane, 3)

    call gather_lanes(scene, nodes, 5, 3, increment, block, u)
    do p = 1, block%n
      nodes%rec(1:4, 1, p) = clock%mass_scaling*block%ps(p, f_mass) &
                             *[u(p, 1), u(p, 2), u(p, 3), 0.0_rp]
    end do
    call values_to_grid(nodes, block, mapped)
  end subroutine map_block

  !> Apply d' = (1 - S+ S) d to the increment, and clear `mapped`.
  subroutine update_increment(nodes, g, mapped, increment)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(inout), dimension(8, nodes%patch%nn, nodes%n_groups) :: mapped, increment
    integer :: i, k, r

    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          if (g(8, i, k) > 0.0_rp) then
            increment(5:7, i, k) = increment(5:7, i, k) - mapped(1:3, i, k)/g(8, i, k)
          end if
          mapped(:, i, k) = 0.0_rp
        end do
      end do
    end do
  end subroutine update_increment

  !> Add the increment to the nodal velocities.
  subroutine add_increment(nodes, increment, g)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: increment(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: i, k, r

    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          g(1:3, i, k) = g(1:3, i, k) + increment(5:7, i, k)
        end do
      end do
    end do
  end subroutine add_increment

end module step_filter
