! SPDX-License-Identifier: MIT
!> Rigid bodies made of particles: their nodes and particles move as the schedule of the tool says
!> whose shape they are.
module time_rigid
  use base_kinds, only: nlane, rp
  use contact_tool, only: rigid_t
  use particles_store, only: f_pos, f_vel
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: hold_rigid, move_rigid, start_rigid

contains

  !> Give the nodes of rigid bodies their mean velocity over the `dt` to come.
  subroutine hold_rigid(sim, dt, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    type(rigid_t) :: rigid
    integer :: i, k, r

    do k = 1, sim%n_groups
      if (sim%scene%tool_of(k) == 0) cycle
      rigid = sim%tool(sim%scene%tool_of(k))%mean_motion(sim%clock%time, dt)
      do r = 1, sim%n_runs
        do i = sim%run(1, r), sim%run(2, r)
          g(1:3, i, k) = rigid%velocity_at(sim%patch%position(i))
          g(5:7, i, k) = 0.0_rp
        end do
      end do
    end do
  end subroutine hold_rigid

  !> Carry a block of a rigid body to where its tool is now; largest squared speed.
  subroutine move_rigid(sim, tool, n, x, v, fastest)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: tool, n
    real(rp), intent(inout) :: x(nlane, 3), v(nlane, 3)
    real(rp), intent(inout) :: fastest         !! running maximum [m2/s2]
    integer :: p

    do p = 1, n
      x(p, :) = sim%tool(tool)%carry(x(p, :))
      v(p, :) = sim%tool(tool)%surface_velocity(x(p, :))
      fastest = max(fastest, sum(v(p, :)**2))
    end do
  end subroutine move_rigid

  !> Velocities of the particles of rigid bodies at t = 0.
  subroutine start_rigid(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b, p, tool

    do b = 1, sim%particles%nblk
      tool = sim%scene%body(sim%particles%body(b))%tool
      if (tool == 0) cycle
      do p = 1, sim%particles%count(b)
        associate (x => sim%particles%ps(p, f_pos:f_pos + 2, b))
          sim%particles%ps(p, f_vel:f_vel + 2, b) = sim%tool(tool)%surface_velocity(x)
        end associate
      end do
    end do
  end subroutine start_rigid

end module time_rigid
