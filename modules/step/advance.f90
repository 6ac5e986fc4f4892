! SPDX-License-Identifier: MIT
!> One time step. USL: stress last (Bardenhagen 2002). MUSL: from velocities mapped again after the
!> momentum update (Sulsky 1995). USAVG: half before the update, half after it (Nairn 2003; thesis
!> eqs. 3.69-3.81, figure 3.3).
module step_advance
  use base_kinds, only: rp
  use base_timers, only: ph_nodes, ph_to_particles
  use boundary_clamps, only: hold_walls, release_near_tools
  use boundary_symmetry, only: record_impulse, restore_velocities
  use contact_body_kept, only: keep_entries
  use contact_body_pairs, only: join_bodies
  use mpm_fbar, only: clear_volume, sum_volume
  use mpm_sweeps, only: momentum_to_grid, update_stress
  use sleep_cubes, only: track_motion
  use sleep_held_layer, only: freeze_layer, record_sleeper_impulse
  use state_clock, only: outcome_t
  use state_nodes, only: clear_nodes, keep_light, recall_light, update_nodes
  use state_parts, only: simulation_t
  use state_probes, only: move_probes
  use state_scene, only: scheme_usavg, scheme_usl, transfer_apic
  use step_acceptance, only: post_acceptance
  use step_constraints, only: apply_boundary, resolve_contact
  use step_filter, only: filter_velocity
  use step_schedule, only: accept_step, grid_to_particles, save_state
  use step_to_grid, only: particles_to_grid, sum_nodes
  implicit none (type, external)
  private

  public :: take_step

contains

  !> Advance all particles by `dt`, or by less if a node would move too far. If
  !> `sim%clock%now%is_broken` is true on return, nothing was advanced. `g_motion` holds the nodal
  !> velocities that move the particles, `g_strain` those whose gradient strains the material.
  subroutine take_step(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt               !! time step [s]
    real(rp), pointer, contiguous :: g_motion(:, :, :), g_strain(:, :, :)
    type(outcome_t) :: outcome
    real(rp) :: stress_fraction_before  ! fraction of the stress update before the momentum update
    integer :: k
    logical :: is_refused, locally_accepted

    call begin_step(sim, dt, stress_fraction_before)
    g_strain => sim%nodes%g
    g_motion => sim%nodes%g
    if (sim%clock%now%scheme /= scheme_usl) g_motion => sim%nodes%g2
    if (stress_fraction_before > 0.0_rp) call update_stress_before(sim, dt, &
      stress_fraction_before, g_strain, outcome)
    if (sim%scene%method%sleep%is_on) then
      call freeze_layer(sim%scene, sim%clock, sim%particles, sim%nodes, sim%sleepers)
    end if
    call save_state(sim%exchange, sim%budget)
    do
      call particles_to_grid(sim, g_motion)
      call update_nodes(sim%scene, sim%clock, sim%nodes, dt, g_motion)
      call recall_light(sim%scene, sim%clock, sim%nodes, g_motion)
      do k = 1, size(sim%hook)
        call sim%hook(k)%it%after_nodes(sim, dt, g_motion)
      end do
      call post_acceptance(sim, dt, g_motion, locally_accepted)
      call apply_boundary(sim, dt, g_motion, locally_accepted)
      call accept_step(sim, dt, g_motion, outcome, is_refused)
      if (sim%clock%now%is_broken) return
      if (.not. is_refused) exit
    end do
    call resolve_contact(sim, dt, g_motion, outcome)
    if (sim%scene%method%sleep%is_on) then
      call record_sleeper_impulse(sim%sleepers, sim%budget, dt)
      call track_motion(sim%nodes, sim%sleepers, dt, g_motion(:, :, 1))
    end if
    call keep_light(sim%scene, sim%clock, sim%nodes, g_motion)
    call record_impulse(sim%scene, sim%nodes, sim%budget, dt, g_motion)
    if (sim%clock%now%scheme /= scheme_usl) then
      call remap_velocities(sim, dt, g_strain, g_motion)
    else if (sim%scene%method%filters_in(sim%clock%step)) then
      call filter_velocity(sim, g_motion, sim%nodes%g2, sim%nodes%increment)
    end if
    if (sim%nodes%n_groups > 1) call keep_entries(sim%scene, sim%nodes, dt, g_motion, sim%pairs)
    call sim%timer%lap(ph_nodes)
    call grid_to_particles(sim, dt, g_motion, g_strain, (1.0_rp - stress_fraction_before)*dt, &
                           outcome)
    call sim%timer%lap(ph_to_particles)
    sim%clock%now%last = outcome
    if (sim%probes%n > 0) then
      call move_probes(dt, sim%nodes%patch, sim%nodes%n_groups, g_strain, g_motion, &
                       sim%probes, sim%sleepers%layer%held)   ! an unallocated list is absent
    end if
  end subroutine take_step

  !> Set the values of `sim%clock` that hold for the whole step. Steps in which a tool may touch
  !> metal are those of USL: velocities mapped again from the particles do not satisfy contact, and
  !> metal strained by them gains energy at a tool in any step, however short.
  subroutine begin_step(sim, dt, stress_fraction_before)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp), intent(out) :: stress_fraction_before
    logical :: is_far                           !! no tool may touch metal before the next sort

    associate (method => sim%scene%method, step => sim%clock%now)
      step%scheme = method%scheme
      if (step%scheme /= scheme_usl .and. size(sim%tool) > 0) then
        is_far = sim%world%all_true(sim%particles%n_far == sim%particles%n_awake)
        if (.not. is_far) step%scheme = scheme_usl
      end if
      stress_fraction_before = merge(0.5_rp, 0.0_rp, step%scheme == scheme_usavg)
      sim%pairs%averages_motion = step%scheme == scheme_usavg
      sim%clock%scales_light = step%scheme == scheme_usl
      step%attempted_dt = dt
      step%force_time = sim%clock%time + stress_fraction_before*dt
      step%pic = method%pic
      if (method%transfer == transfer_apic .or. method%filters_in(sim%clock%step)) step%pic = 1.0_rp
      sim%pairs%is_known = .false.
    end associate
    call release_near_tools(sim%scene, sim%clock%time, sim%nodes, sim%tool)
  end subroutine begin_step

  !> Update the stress by `stress_fraction_before` of the step with the velocities before the
  !> momentum update (USAVG).
  subroutine update_stress_before(sim, dt, stress_fraction_before, g, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, stress_fraction_before
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome

    call remap_velocities(sim, dt, g)
    call update_stress(sim%scene, sim%clock, sim%particles, sim%nodes, sim%budget, &
                       stress_fraction_before*dt, g, outcome)
  end subroutine update_stress_before

  !> Map the momentum of the particles alone to nodal velocities, with walls held; with `g_motion`,
  !> after the particles have taken their new velocities from it. Bodies in contact
  !> keep their own velocities: the strain then belongs to the velocities with which the internal
  !> forces do their work.
  subroutine remap_velocities(sim, dt, g, g_motion)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! time step of these velocities [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    real(rp), intent(in), optional :: g_motion(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    ! Interpolation does no work and exerts no impulse.
    real(rp) :: unused_impulse(3, size(sim%scene%condition)), unused_work

    call clear_nodes(sim%nodes, g)
    call clear_volume(sim%scene, sim%nodes)
    call momentum_to_grid(sim%scene, sim%clock, sim%particles, sim%nodes, g, g_motion)
    call sum_nodes(sim%scene, sim%nodes, g)
    call sum_volume(sim%scene, sim%nodes)
    call update_nodes(sim%scene, sim%clock, sim%nodes, 0.0_rp, g)
    unused_impulse = 0.0_rp
    unused_work = 0.0_rp
    call hold_walls(sim%scene, sim%clock, sim%nodes, 1.0_rp, g, unused_impulse, unused_work)
    if (sim%nodes%n_groups > 1) then
      call join_bodies(sim%scene, sim%clock, sim%tool, sim%particles, &
                       sim%nodes, sim%pairs, dt, g)
    end if
    call restore_velocities(sim%scene, sim%nodes, g)
  end subroutine remap_velocities

end module step_advance
