! SPDX-License-Identifier: MIT
!> One time step. USL: stress last, one constitutive pass (Bardenhagen 2002). USAVG: two passes of
!> half a step around the momentum update (Nairn 2003; thesis eqs. 3.69-3.81, figure 3.3).
module time_step
  use base_kinds, only: rp
  use base_timers, only: ph_exchange, ph_nodes, ph_to_grid, ph_to_particles
  use comm_world, only: world_t
  use time_nodes, only: clear_nodes, hold_walls, update_nodes
  use time_probes, only: move_probes
  use time_state, only: scheme_usavg, simulation_t
  use time_sweeps, only: accelerate_and_map_again, grid_to_particles, momentum_and_force_to_grid, &
                         momentum_to_grid, report_t, update_stress
  use time_volume, only: share_volume
  implicit none (type, external)
  private

  public :: take_step, report_t

contains

  !> Advance all particles by `dt`.
  subroutine take_step(world, sim, dt, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    type(report_t), intent(out) :: report

    if (sim%scene%method%scheme == scheme_usavg) then
      call step_usavg(world, sim, dt, report)
    else
      call step_usl(world, sim, dt, report)
    end if
    call move_probes(dt, sim%patch, sim%g, sim%probes)
  end subroutine take_step

  !> Update stress last.
  subroutine step_usl(world, sim, dt, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    type(report_t), intent(inout) :: report

    call clear_nodes(sim, sim%g)
    call momentum_and_force_to_grid(sim, sim%g)
    call sim%timer%lap(ph_to_grid)
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g)
    call share_volume(world, sim)
    call sim%timer%lap(ph_exchange)
    call update_nodes(sim, dt, sim%g)
    call hold_walls(sim, sim%g)
    call move_tools(sim, dt)
    call sim%timer%lap(ph_nodes)
    call grid_to_particles(sim, dt, sim%g, sim%g, dt, report)
    call sim%timer%lap(ph_to_particles)
  end subroutine step_usl

  !> Update stress averaged: half a step of stress before and after the momentum update.
  subroutine step_usavg(world, sim, dt, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    type(report_t), intent(inout) :: report

    call clear_nodes(sim, sim%g)
    call momentum_to_grid(sim, sim%g)
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g)
    call share_volume(world, sim)
    call velocity_field(sim, sim%g)
    call update_stress(sim, 0.5_rp*dt, sim%g, report)
    call clear_nodes(sim, sim%g2)
    call momentum_and_force_to_grid(sim, sim%g2)
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g2)
    call update_nodes(sim, dt, sim%g2)
    call hold_walls(sim, sim%g2)
    call clear_nodes(sim, sim%g)
    call accelerate_and_map_again(sim, sim%g2, sim%g)
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g)
    call share_volume(world, sim)
    call velocity_field(sim, sim%g)
    call move_tools(sim, dt)
    call grid_to_particles(sim, dt, sim%g2, sim%g, 0.5_rp*dt, report)
    call sim%timer%lap(ph_to_particles)
  end subroutine step_usavg

  subroutine move_tools(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    integer :: k

    do k = 1, size(sim%tool)
      call sim%tool(k)%move_to(sim%clock%time + dt)
    end do
  end subroutine move_tools

  !> Velocities of the nodes from their momentum alone, walls held.
  subroutine velocity_field(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    real(rp) :: books(size(sim%sums))

    books = sim%sums                       ! no work is done by interpolation
    call update_nodes(sim, 0.0_rp, g)
    call hold_walls(sim, g)
    sim%sums = books
  end subroutine velocity_field

end module time_step
