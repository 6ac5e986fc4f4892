! SPDX-License-Identifier: MIT
!> Velocities with which particles move, S S+ v, for output and for the inertial stress. They differ
!> from the velocities carried by the particles where metal flows (null modes), and near surfaces,
!> where constraints change the nodal velocities.
module step_motion
  use base_kinds, only: nlane, rp
  use base_world, only: world_t
  use boundary_symmetry, only: r_filter, r_momentum, reflect, restore
  use mpm_blocks, only: gather_lanes, weights_of
  use particles_store, only: f_mass, f_vel
  use simulation_nodes, only: clear_nodes, min_node_mass, nodes_t
  use simulation_parts, only: boundary_t, simulation_t
  use simulation_scene, only: scene_t
  use transfer_scatter, only: p2g_values_block
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
      if (flows(k)) then
        call add_momentum(sim%scene, sim%nodes, sim%particles%body(b), sim%particles%count(b), &
                          sim%particles%nf, sim%particles%ps(:, :, b), sim%nodes%rec, &
                          sim%nodes%g2(:, :, k))
      end if
    end do
    call find_velocities(sim%world, sim%scene, sim%nodes, sim%boundary)
    do i = 1, sim%particles%n_awake
      b = sim%particles%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      if (flows(k)) then
        call interpolate_velocity(sim%scene, sim%nodes, sim%particles%body(b), &
                                  sim%particles%count(b), sim%particles%nf, &
                                  sim%particles%ps(:, :, b), sim%nodes%g2(:, :, k), sim%nodes%rec, &
                                  sim%particles%motion(:, :, b))
      end if
    end do
  end subroutine find_motion

  !> Add mass and momentum of a block to lanes 1:4 of the nodes.
  subroutine add_momentum(scene, nodes, body, n, nf, ps, rec, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nodes%patch%nn)
    integer :: first(nlane), p
    real(rp) :: w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    do p = 1, n
      rec(1:4, 1, p) = ps(p, f_mass)*[1.0_rp, ps(p, f_vel:f_vel + 2)]
    end do
    call p2g_values_block(n, w, first, rec, nodes%patch%stride, nodes%patch%nn, g)
  end subroutine add_momentum

  !> Collective. Sum the nodal momenta over the ranks and divide by mass: velocities in lanes 5:7.
  subroutine find_velocities(world, scene, nodes, boundary)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    real(rp) :: lost(8, size(scene%symmetry))
    integer :: i, k, r

    associate (g => nodes%g2)
      lost = 0.0_rp                            ! not used
      do k = 1, nodes%n_groups
        call reflect(scene, nodes, boundary, r_momentum, g(:, :, k), lost)
        call nodes%halo%sum(world, 8, nodes%patch%nn, g(:, :, k))
        do r = 1, nodes%n_ranges
          do i = nodes%range(1, r), nodes%range(2, r)
            if (g(1, i, k) > min_node_mass) g(5:7, i, k) = g(2:4, i, k)/g(1, i, k)
          end do
        end do
        call restore(scene, nodes, boundary, r_filter, g(:, :, k))
      end do
    end associate
  end subroutine find_velocities

  !> Interpolate the nodal velocities, lanes 5:7, to the particles of a block.
  subroutine interpolate_velocity(scene, nodes, body, n, nf, ps, g, rec, v)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf), g(8, nodes%patch%nn)
    real(rp), intent(inout) :: rec(8, 4, nlane), v(nlane, 3)
    integer :: first(nlane)
    real(rp) :: u(nlane, 3), w(nlane, 18)

    call gather_lanes(scene, nodes, body, n, nf, ps, 5, 3, g, rec, w, first, u)
    v(:n, :) = u(:n, :)
  end subroutine interpolate_velocity

end module step_motion
