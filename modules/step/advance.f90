! SPDX-License-Identifier: MIT
!> One time step. USL: stress last (Bardenhagen 2002). MUSL: from velocities mapped again after the
!> momentum update (Sulsky 1995). USAVG: half before the update, half after it (Nairn 2003; thesis
!> eqs. 3.69-3.81, figure 3.3).
module step_advance
  use base_kinds, only: rp
  use base_timers, only: ph_nodes, ph_to_particles
  use body_contact_pairs, only: join_bodies
  use boundary_clamps, only: hold_walls
  use boundary_symmetry, only: book_impulse, restore_velocities
  use comm_world, only: world_t
  use exchange_acceptance, only: post_acceptance
  use exchange_speculation, only: note_state
  use mapping_fbar, only: clear_volume, sum_volume
  use mapping_nodes, only: clear_nodes, update_nodes
  use mapping_probes, only: move_probes
  use sleep_held_force, only: book_sleepers
  use sleep_held_layer, only: freeze_layer
  use sleep_motion, only: track_motion
  use state_books, only: books_t
  use state_scene, only: scheme_usavg, scheme_usl, transfer_apic
  use state_step, only: outcome_t
  use step_constraints, only: apply_boundary, resolve_contact
  use step_filter, only: filter_velocity
  use step_schedule, only: accept_step
  use step_simulation, only: simulation_t
  use step_to_grid, only: particles_to_grid, sum_nodes
  use update_sweeps, only: accelerate, grid_to_particles, momentum_to_grid, update_stress
  implicit none (type, external)
  private

  public :: take_step

contains

  !> Advance all particles by `dt`, or by less if a node would move too far; if `sim%step%is_broken`
  !> comes back, nothing was advanced. `moved` are the nodes that move, `field` those whose
  !> velocities strain the material.
  subroutine take_step(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt               !! [s]
    real(rp), pointer, contiguous :: moved(:, :, :), field(:, :, :)
    type(outcome_t) :: outcome
    real(rp) :: early                           ! part of the stress update that comes first
    logical :: is_refused, stands

    call begin_step(sim, dt, early)
    field => sim%nodes%g
    moved => sim%nodes%g
    if (sim%scene%method%scheme /= scheme_usl) moved => sim%nodes%g2
    if (early > 0.0_rp) call strain_before(world, sim, dt, early, field, outcome)
    if (sim%scene%method%sleep%is_on) then
      call freeze_layer(world, sim%scene, sim%clock, sim%step, sim%particles, sim%blocks, &
                        sim%nodes, sim%boundary, sim%sleepers)
    end if
    call note_state(sim%exchange, sim%books)
    do
      call particles_to_grid(world, sim, moved)
      call update_nodes(sim%scene, sim%clock, sim%nodes, dt, moved)
      call post_acceptance(world, sim%scene, sim%clock, sim%step, sim%tool, sim%blocks, sim%nodes, &
                           sim%boundary, sim%exchange, sim%books, dt, moved, stands)
      call apply_boundary(world, sim, dt, moved, stands)
      call accept_step(sim, dt, moved, outcome, is_refused)
      if (sim%step%is_broken) return
      if (.not. is_refused) exit
    end do
    call resolve_contact(world, sim, dt, moved, outcome)
    if (sim%scene%method%sleep%is_on) then
      call book_sleepers(sim%sleepers, sim%books, dt)
      call track_motion(sim%nodes, sim%sleepers, dt, moved(:, :, 1))
    end if
    call book_impulse(sim%scene, sim%nodes, sim%boundary, sim%books, dt, moved)
    if (sim%scene%method%scheme /= scheme_usl) then
      call accelerate(sim%scene, sim%step, sim%particles, sim%nodes, moved)
      call map_again(world, sim, dt, field)
    else if (sim%scene%method%filters_in(sim%clock%step)) then
      call filter_velocity(world, sim, moved, sim%nodes%g2, sim%nodes%increment)
    end if
    call sim%timer%lap(ph_nodes)
    call grid_to_particles(sim%scene, sim%clock, sim%step, sim%tool, sim%particles, sim%blocks, &
                           sim%nodes, &
                           sim%exchange, sim%books, dt, moved, field, (1.0_rp - early)*dt, outcome)
    call sim%timer%lap(ph_to_particles)
    sim%step%last = outcome
    if (sim%probes%n > 0) then
      call move_probes(dt, sim%nodes%patch, sim%nodes%n_groups, field, sim%probes, &
                       sim%sleepers%layer%held)   ! absent where it is not allocated
    end if
  end subroutine take_step

  !> What holds for the whole step.
  subroutine begin_step(sim, dt, early)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp), intent(out) :: early

    associate (method => sim%scene%method, step => sim%step)
      early = merge(0.5_rp, 0.0_rp, method%scheme == scheme_usavg)
      step%asked_dt = dt
      step%force_time = sim%clock%time + early*dt
      step%pic = method%pic
      if (method%transfer == transfer_apic .or. method%filters_in(sim%clock%step)) step%pic = 1.0_rp
      sim%pairs%is_known = .false.
    end associate
  end subroutine begin_step

  !> USAVG: the part `early` of the stress update, from the velocities before the momentum update.
  subroutine strain_before(world, sim, dt, early, g, outcome)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, early
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome

    call map_again(world, sim, dt, g)
    call update_stress(sim%scene, sim%clock, sim%particles, sim%nodes, sim%books, early*dt, g, &
                       outcome)
  end subroutine strain_before

  !> Velocities of the nodes from the momentum of the particles alone, walls held. Bodies in contact
  !> keep theirs: the strain is then that of the velocities with which the internal forces do their
  !> work.
  subroutine map_again(world, sim, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! of the step that they belong to [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(books_t) :: before

    call clear_nodes(sim%nodes, g)
    call clear_volume(sim%scene, sim%nodes)
    call momentum_to_grid(sim%scene, sim%clock, sim%particles, sim%nodes, g)
    call sum_nodes(world, sim, g)
    call sum_volume(world, sim%scene, sim%nodes)
    before = sim%books                     ! interpolation does no work and gives no impulse
    call update_nodes(sim%scene, sim%clock, sim%nodes, 0.0_rp, g)
    call hold_walls(world, sim%scene, sim%clock, sim%nodes, sim%boundary, sim%books, 1.0_rp, g)
    if (sim%nodes%n_groups > 1) then
      call join_bodies(world, sim%scene, sim%clock, sim%tool, sim%particles, sim%blocks, &
                       sim%nodes, sim%boundary, sim%pairs, dt, g)
    end if
    call restore_velocities(sim%scene, sim%nodes, sim%boundary, g)
    sim%books = before
  end subroutine map_again

end module step_advance
