! SPDX-License-Identifier: MIT
!> One time step. USL: stress last (Bardenhagen 2002). MUSL: from velocities mapped again after the
!> momentum update (Sulsky 1995). USAVG: half before the update, half after it (Nairn 2003; thesis
!> eqs. 3.69-3.81, figure 3.3).
module time_step
  use base_kinds, only: rp
  use base_timers, only: ph_exchange, ph_nodes, ph_to_grid, ph_to_particles
  use comm_world, only: world_t
  use time_ahead, only: may_go_ahead, note_books, settle_step
  use time_clamps, only: hold_walls
  use time_contacts, only: join_bodies, touch_bodies
  use time_filter, only: filter_is_due, filter_velocity
  use time_limit, only: post_limit
  use time_mirrors, only: book_impulse, fold, r_momentum, r_velocity, unfold
  use time_nodes, only: clear_nodes, update_nodes
  use time_overlap, only: map_and_sum
  use time_probes, only: move_probes
  use time_rim, only: damp_rim, freeze_rim
  use time_scene, only: scheme_musl, scheme_usavg, scheme_usl, transfer_apic
  use time_state, only: simulation_t
  use time_sweeps, only: accelerate_and_map_again, grid_to_particles, momentum_and_force_to_grid, &
                         momentum_to_grid, update_stress
  use time_tool_contact, only: touch_tools
  use time_update, only: report_t
  use time_volume, only: share_volume
  implicit none (type, external)
  private

  public :: take_step

contains

  !> Advance all particles by `dt`, or by less if a node would move too far; if `sim%is_broken`
  !> comes back, nothing was advanced.
  subroutine take_step(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt               !! [s]
    type(report_t) :: report

    sim%meeting%is_known = .false.
    sim%force_time = sim%clock%time
    if (sim%scene%method%scheme == scheme_usavg) sim%force_time = sim%clock%time + 0.5_rp*dt
    sim%pic = sim%scene%method%pic
    if (sim%scene%method%transfer == transfer_apic .or. filter_is_due(sim)) sim%pic = 1.0_rp
    select case (sim%scene%method%scheme)
    case (scheme_usl)
      call step_usl(world, sim, dt, report)
    case (scheme_musl)
      call step_twice(world, sim, 0.0_rp, dt, report)
    case default
      call step_twice(world, sim, 0.5_rp, dt, report)
    end select
    if (sim%is_broken) return
    sim%last%stiffness = report%stiffness
    sim%last%speed2 = report%speed2
    call move_probes(dt, sim%patch, sim%n_groups, sim%g, sim%probes)
  end subroutine take_step

  !> Update stress last.
  subroutine step_usl(world, sim, dt, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt
    type(report_t), intent(inout) :: report

    call freeze_rim(world, sim)
    call move_nodes(world, sim, dt, sim%g, report)
    if (sim%is_broken) return
    if (filter_is_due(sim)) call filter_velocity(world, sim, sim%g, sim%g2, sim%increment)
    call sim%timer%lap(ph_nodes)
    call grid_to_particles(sim, dt, sim%g, sim%g, dt, report)
    call sim%timer%lap(ph_to_particles)
  end subroutine step_usl

  !> The share `early` of the stress update before the momentum update, the rest after it, from the
  !> velocities mapped again.
  subroutine step_twice(world, sim, early, dt, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: early
    real(rp), intent(inout) :: dt
    type(report_t), intent(inout) :: report

    if (early > 0.0_rp) then
      call clear_nodes(sim, sim%g)
      call momentum_to_grid(sim, sim%g)
      call sum_nodes(world, sim, sim%g)
      call share_volume(world, sim)
      call velocity_field(world, sim, dt, sim%g)
      call update_stress(sim, early*dt, sim%g, report)
    end if
    call move_nodes(world, sim, dt, sim%g2, report)
    if (sim%is_broken) return
    call clear_nodes(sim, sim%g)
    call accelerate_and_map_again(sim, sim%g2, sim%g)
    call sum_nodes(world, sim, sim%g)
    call share_volume(world, sim)
    call velocity_field(world, sim, dt, sim%g)
    call grid_to_particles(sim, dt, sim%g2, sim%g, (1.0_rp - early)*dt, report)
    call sim%timer%lap(ph_to_particles)
  end subroutine step_twice

  !> New velocities of the nodes after `dt`, which may become smaller, as walls, clamps and contact allow.
  !> Blocks may have come back from the grid before this ends (time_ahead).
  subroutine move_nodes(world, sim, dt, g, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt, g(8, sim%patch%nn, sim%n_groups)
    type(report_t), intent(inout) :: report
    logical :: is_refused, stands

    sim%asked_dt = dt
    call note_books(sim)
    do
      call map_nodes(world, sim, g)
      call update_nodes(sim, dt, g)
      call post_limit(world, sim, dt, g, stands)
      call damp_rim(sim, g)
      call hold_walls(world, sim, g)
      if (sim%n_groups == 1) then              ! else bodies meet first
        call mirror_nodes(sim, g)
        call move_tools(sim, dt)
        sim%ahead%is_possible = stands .and. may_go_ahead(world, sim)
      end if
      call settle_step(sim, dt, g, report, is_refused)
      if (sim%is_broken) return
      if (.not. is_refused) exit
    end do
    if (sim%n_groups > 1) then
      call touch_bodies(world, sim, dt, g)
      call mirror_nodes(sim, g)
      call move_tools(sim, dt)
    end if
    call touch_tools(world, sim, dt, g, report)
    call book_impulse(sim, dt, g)
  end subroutine move_nodes

  !> Records of all nodes in use, summed over the ranks.
  subroutine map_nodes(world, sim, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)

    call clear_nodes(sim, g)
    if (sim%n_groups == 1 .and. sim%scene%method%scheme == scheme_usl) then
      call map_and_sum(world, sim, g)
      return
    end if
    call momentum_and_force_to_grid(sim, g)
    call sim%timer%lap(ph_to_grid)
    call sum_nodes(world, sim, g)
    if (sim%scene%method%scheme == scheme_usl) call share_volume(world, sim)
    call sim%timer%lap(ph_exchange)
  end subroutine map_nodes

  !> Fold the records at walls, sum those of shared nodes over the ranks.
  subroutine sum_nodes(world, sim, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: k

    sim%mirrors%lost = 0.0_rp
    do k = 1, sim%n_groups
      call fold(sim, r_momentum, g(:, :, k), sim%mirrors%lost, sim%mirrors%own(:, k))
      call sim%halo%sum(world, 8, sim%patch%nn, g(:, :, k))
    end do
  end subroutine sum_nodes

  !> Velocities of the nodes behind walls.
  subroutine mirror_nodes(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: k

    do k = 1, sim%n_groups
      call unfold(sim, r_velocity, g(:, :, k))
    end do
  end subroutine mirror_nodes

  subroutine move_tools(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    integer :: k

    do k = 1, size(sim%tool)
      call sim%tool(k)%move_to(sim%clock%time + dt)
    end do
  end subroutine move_tools

  !> Velocities of the nodes from their momentum alone, walls held. Bodies that touch keep theirs: the
  !> strain is then that of the velocities with which the internal forces do their work.
  subroutine velocity_field(world, sim, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! of the step that they belong to [s]
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp) :: books(size(sim%sums)), impulse(3, size(sim%scene%constraint))

    books = sim%sums                       ! interpolation does no work and gives no impulse
    impulse = sim%impulse
    call update_nodes(sim, 0.0_rp, g)
    call hold_walls(world, sim, g)
    if (sim%n_groups > 1) call join_bodies(world, sim, dt, g)
    call mirror_nodes(sim, g)
    sim%sums = books
    sim%impulse = impulse
  end subroutine velocity_field

end module time_step
