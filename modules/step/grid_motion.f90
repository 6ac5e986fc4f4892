! SPDX-License-Identifier: MIT
!> Velocities with which particles move, S S+ v, for output and for the inertial stress. They differ
!> from the velocities carried by the particles where metal flows (null modes), and near surfaces,
!> where constraints change the nodal velocities.
module step_grid_motion
  use base_kinds, only: nlane, rp
  use boundary_symmetry, only: r_filter, r_momentum, reflect, restore
  use mpm_blocks, only: gather_lanes, values_to_grid, weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_mass, f_vel
  use state_nodes, only: clear_nodes, min_node_mass, nodes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: find_motion

contains

  !> Collective, between two steps. Fill `sim%particles%motion` with the grid velocities for awake
  !> particles of bodies that can flow, and with the particles' own velocities for all others. Do
  !> nothing in scenes that do not output them.
  subroutine find_motion(sim)
    type(simulation_t), intent(inout) :: sim
    logical :: flows(sim%nodes%n_groups)
    type(block_t) :: block
    real(rp) :: v(nlane, 3)
    integer :: b, i, k

    if (.not. sim%scene%method%shows_motion) return
    flows = [(sim%scene%can_flow(k), k=1, sim%nodes%n_groups)]
    if (allocated(sim%particles%motion)) deallocate (sim%particles%motion)
    allocate (sim%particles%motion, source=sim%particles%ps(:, f_vel:f_vel + 2, &
                                                            :sim%particles%nblk))
    call clear_nodes(sim%nodes, sim%nodes%g2)
    do i = 1, sim%particles%n_mapped  ! including sleepers that share nodes with awake particles
      b = i
      if (i <= sim%particles%n_awake) b = sim%particles%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      call view_block(sim%particles, b, block)
      if (flows(k)) call add_momentum(sim%scene, sim%nodes, block, sim%nodes%g2(:, :, k))
    end do
    call find_velocities(sim%scene, sim%nodes)
    do i = 1, sim%particles%n_awake
      b = sim%particles%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      if (.not. flows(k)) cycle
      call view_block(sim%particles, b, block)
      call gather_lanes(sim%scene, sim%nodes, 5, 3, sim%nodes%g2(:, :, k), block, v)
      sim%particles%motion(:block%n, :, b) = v(:block%n, :)
    end do
  end subroutine find_motion

  !> Add mass and momentum of a block to lanes 1:4 of the nodes.
  subroutine add_momentum(scene, nodes, block, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: p

    call weights_of(scene, nodes, block)
    do p = 1, block%n
      nodes%rec(1:4, 1, p) = block%ps(p, f_mass)*[1.0_rp, block%ps(p, f_vel:f_vel + 2)]
    end do
    call values_to_grid(nodes, block, g)
  end subroutine add_momentum

  !> Collective. Sum the nodal momenta over the ranks and divide by mass: velocities in lanes 5:7.
  subroutine find_velocities(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    real(rp) :: lost(8, size(scene%symmetry))
    integer :: i, k, r

    associate (g => nodes%g2)
      lost = 0.0_rp                            ! not used
      do k = 1, nodes%n_groups
        call reflect(scene, nodes, r_momentum, g(:, :, k), lost)
        call nodes%halo%sum(8, nodes%patch%nn, g(:, :, k))
        do r = 1, nodes%n_ranges
          do i = nodes%range(1, r), nodes%range(2, r)
            if (g(1, i, k) > min_node_mass) g(5:7, i, k) = g(2:4, i, k)/g(1, i, k)
          end do
        end do
        call restore(scene, nodes, r_filter, g(:, :, k))
      end do
    end associate
  end subroutine find_velocities

end module step_grid_motion
