! SPDX-License-Identifier: MIT
!> Rigid bodies of particles: their nodes and particles follow the schedule of the tool whose shape
!> they are.
module mapping_rigid
  use base_kinds, only: nlane, rp
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_pos, f_vel, particles_t
  use state_run, only: clock_t
  use state_scene, only: scene_t
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)
  private

  public :: set_rigid_velocities, move_rigid, start_rigid

contains

  !> Set the nodes of rigid bodies to the mean velocity over the next `dt`.
  subroutine set_rigid_velocities(scene, clock, tool, nodes, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(rigid_t) :: rigid
    integer :: i, k, r

    do k = 1, nodes%n_groups
      if (.not. scene%is_rigid_group(k)) cycle
      rigid = tool(scene%tool_of(k))%mean_motion(clock%time, dt)
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          g(1:3, i, k) = rigid%velocity_at(nodes%patch%position(i))
          g(5:7, i, k) = 0.0_rp
        end do
      end do
    end do
  end subroutine set_rigid_velocities

  !> Move a block of a rigid body with its tool; keep the largest squared speed.
  subroutine move_rigid(tool, k, n, x, v, max_speed2)
    type(tool_t), intent(in) :: tool(:)
    integer, intent(in) :: k, n
    real(rp), intent(inout) :: x(nlane, 3), v(nlane, 3)
    real(rp), intent(inout) :: max_speed2         !! running maximum of the squared speed [m2/s2]
    integer :: p

    do p = 1, n
      x(p, :) = tool(k)%move_point(x(p, :))
      v(p, :) = tool(k)%surface_velocity(x(p, :))
      max_speed2 = max(max_speed2, sum(v(p, :)**2))
    end do
  end subroutine move_rigid

  !> Set the velocities of the particles of rigid bodies at t = 0.
  subroutine start_rigid(scene, tool, particles)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    integer :: b, p, k

    do b = 1, particles%nblk
      k = scene%body(particles%body(b))%tool
      if (k == 0) cycle
      do p = 1, particles%count(b)
        associate (x => particles%ps(p, f_pos:f_pos + 2, b))
          particles%ps(p, f_vel:f_vel + 2, b) = tool(k)%surface_velocity(x)
        end associate
      end do
    end do
  end subroutine start_rigid

end module mapping_rigid
