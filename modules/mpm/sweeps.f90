! SPDX-License-Identifier: MIT
!> Sweeps over all blocks of particles in a time step. Each sweep passes one block at a time, as an
!> explicit-shape array, to a procedure of its own.
module mpm_sweeps
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: advance_particles, affine_to_grid, force_records, gather_gradient, &
                        gather_lanes, gather_slopes, gather_velocity, momentum_records, &
                        move_rigid, stretch_domains, weights_of
  use mpm_constitutive, only: average_volume, crush_voids, external_acceleration, &
                              record_external_work, update_block_stress
  use mpm_fbar, only: add_volume
  use mpm_prescribed, only: add_prescribed_force, record_prescribed_work
  use mpm_tractions, only: record_traction_work
  use particles_store, only: f_flow, f_mass, f_pos, f_rate, f_tau, f_temp, f_vel, n_to_grid, &
                             particles_t
  use simulation_nodes, only: nodes_t
  use simulation_parts, only: simulation_t
  use simulation_run, only: clock_t, outcome_t
  use simulation_scene, only: scene_t, scheme_usavg, scheme_usl
  use transfer_scatter, only: p2g_block, p2g_values_block
  implicit none (type, external)
  private

  public :: momentum_to_grid, grid_to_particles
  public :: blocks_to_particles, force_to_grid, update_stress, blocks_to_grid

contains

  !> Map mass, momentum, force and temperature of the awake blocks `first` to `last` of
  !> `particles%turn` to the grid.
  subroutine blocks_to_grid(sim, first, last, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: first, last
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    integer :: b, i, last_read

    last_read = n_to_grid
    if (sim%scene%method%fbar) last_read = f_flow
    associate (layout => sim%scene%layout)
      if (layout%half > 0) last_read = layout%half + 2
      if (layout%affine > 0) last_read = layout%affine + 8
    end associate
    do i = first, last
      b = sim%particles%turn(i)
      call sim%particles%fetch(b + 1, last_read, n_to_grid, f_rate - 1)   ! usually the next block
      call force_to_grid(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                         sim%particles%ps(:, :, b), sim%nodes%rec, &
                         g(:, :, group_of(sim%scene, sim%particles, b)))
    end do
  end subroutine blocks_to_grid

  !> Map mass, momentum, force and temperature of one block to the grid `g`.
  subroutine force_to_grid(sim, body, n, nf, ps, rec, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
    call force_records(sim%clock%mass_scaling, &
                       1.0_rp/sim%scene%material(sim%scene%body(body)%material)%rho, &
                       external_acceleration(sim%scene, sim%step, body), ps(1, f_mass), &
                       ps(1, f_vel), ps(1, f_tau), ps(1, f_temp), rec)
    if (sim%scene%body(body)%is_forced()) then
      call add_prescribed_force(sim%scene, sim%step, body, nf, ps, rec)
    end if
    if (sim%step%scheme == scheme_usl) then
      call map_volume(sim%scene, sim%clock, sim%nodes, body, n, w, first, nf, ps)
    end if
    if (sim%scene%layout%affine > 0) then
      call affine_to_grid(sim%nodes, n, ps(1, f_pos), ps(1, sim%scene%layout%affine), w, first, &
                          rec, g)
    else
      call p2g_block(n, w, first, rec, sim%nodes%patch%stride, sim%nodes%patch%nn, g)
    end if
  end subroutine force_to_grid

  !> Map mass and momentum to the grid `g`; with `g_motion`, after the particles have taken their
  !> new velocities from it.
  subroutine momentum_to_grid(sim, g, g_motion)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    real(rp), intent(in), optional :: g_motion(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    integer :: b

    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, sim%particles%nf, f_vel + 2, f_rate - 1)
      if (present(g_motion)) then
        call map_momentum(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                          sim%particles%ps(:, :, b), sim%nodes%rec, &
                          g(:, :, group_of(sim%scene, sim%particles, b)), &
                          g_motion(:, :, group_of(sim%scene, sim%particles, b)))
      else
        call map_momentum(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                          sim%particles%ps(:, :, b), sim%nodes%rec, &
                          g(:, :, group_of(sim%scene, sim%particles, b)))
      end if
    end do
  end subroutine momentum_to_grid

  !> Map mass and momentum of one block; with `g_motion`, take the new velocities from it first.
  subroutine map_momentum(sim, body, n, nf, ps, rec, g, g_motion)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), g(8, sim%nodes%patch%nn)
    real(rp), intent(in), optional :: g_motion(8, sim%nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), u(nlane, 7)   ! velocity, temperature, velocity change

    if (present(g_motion) .and. .not. sim%scene%body(body)%is_rigid()) then
      call gather_lanes(sim%scene, sim%nodes, body, n, nf, ps, 1, 7, g_motion, rec, w, first, u)
      call store_affine(sim%scene, sim%nodes, n, nf, ps, w, first, g_motion, rec)
      ps(:n, f_vel:f_vel + 2) = (1.0_rp - sim%step%pic)*(ps(:n, f_vel:f_vel + 2) + u(:n, 5:7)) &
                                + sim%step%pic*u(:n, 1:3)
    else
      call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
    end if
    call momentum_records(sim%clock%mass_scaling, ps(1, f_mass), ps(1, f_vel), rec)
    call map_volume(sim%scene, sim%clock, sim%nodes, body, n, w, first, nf, ps)
    if (sim%scene%layout%affine > 0) then
      rec(5:8, :, :) = 0.0_rp
      call affine_to_grid(sim%nodes, n, ps(1, f_pos), ps(1, sim%scene%layout%affine), w, first, &
                          rec, g)
    else
      call p2g_values_block(n, w, first, rec, sim%nodes%patch%stride, sim%nodes%patch%nn, g)
    end if
  end subroutine map_momentum

  !> Add the sums for F-bar averaging.
  subroutine map_volume(scene, clock, nodes, body, n, w, first, nf, ps)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: body, n, first(nlane), nf
    real(rp), intent(in) :: w(nlane, 18), ps(nlane, nf)

    if (.not. scene%method%fbar) return
    call add_volume(scene%body(body)%averaging, scene%material(scene%body(body)%material)%k, &
                    clock%dt, body, n, w, first, nodes%patch%stride, nf, ps, &
                    size(nodes%volume, 1), nodes%patch%nn, nodes%volume)
  end subroutine map_volume

  !> Update the particles from the grid: move them with `g_motion`, then update the stress over
  !> `dt_stress` with the gradient of `g_strain` (the same grid in USL).
  subroutine grid_to_particles(sim, dt, g_motion, g_strain, dt_stress, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, sim%nodes%patch%nn, sim%nodes%n_groups) :: g_motion, g_strain
    type(outcome_t), intent(inout) :: outcome

    if (sim%scene%has_tractions()) then
      call record_traction_work(sim, dt, g_motion)
    end if
    call blocks_to_particles(sim, sim%exchange%speculative%n_done + 1, sim%particles%n_awake, dt, &
                             g_motion, g_strain, dt_stress, outcome)
  end subroutine grid_to_particles

  !> Update the blocks `first` to `last` of `particles%order`.
  subroutine blocks_to_particles(sim, first, last, dt, g_motion, g_strain, dt_stress, outcome)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: first, last
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, sim%nodes%patch%nn, sim%nodes%n_groups) :: g_motion, g_strain
    type(outcome_t), intent(inout) :: outcome
    integer :: b, i, k

    do i = first, last
      b = sim%particles%order(i)
      call sim%particles%fetch(sim%particles%order(min(i + 1, sim%particles%n_awake)), &
                               sim%particles%nf)
      k = group_of(sim%scene, sim%particles, b)
      call advance_block(sim, b, sim%particles%count(b), dt, g_motion(:, :, k), g_strain(:, :, k), &
                         dt_stress, sim%particles%ps(:, :, b), outcome)
    end do
  end subroutine blocks_to_particles

  subroutine advance_block(sim, b, n, dt, g_motion, g_strain, dt_stress, ps, outcome)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b, n
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: g_motion(8, sim%nodes%patch%nn), g_strain(8, sim%nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, sim%particles%nf)
    type(outcome_t), intent(inout) :: outcome
    integer :: first(nlane)
    real(rp), dimension(nlane, 3) :: v, dv
    real(rp) :: w(nlane, 18), l(nlane, 9)

    associate (body => sim%particles%body(b), nf => sim%particles%nf, rec => sim%nodes%rec)
      if (sim%scene%body(body)%is_rigid()) then
        call move_rigid(sim%tool, sim%scene%body(body)%tool, n, ps(1, f_pos), ps(1, f_vel), &
                        outcome%speed2)
        return
      end if
      if (sim%step%scheme /= scheme_usl) then
        call move_block(sim, body, n, dt, g_motion, g_strain, nf, ps, w, first, v, dv, l, &
                        outcome%speed2)
      else
        call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
        call gather_velocity(n, w, first, sim%nodes%patch%stride, sim%nodes%patch%nn, g_motion, &
                             rec, v, dv, l)
        call store_affine(sim%scene, sim%nodes, n, nf, ps, w, first, g_motion, rec)
        call advance_particles(n, dt, sim%step%pic, v, dv, ps(1, f_pos), ps(1, f_vel), &
                               outcome%speed2)
      end if
      if (sim%scene%layout%half > 0) call stretch_domains(dt_stress, l, &
                                                          ps(1, sim%scene%layout%half))
      call average_volume(sim, body, n, w, first, nf, ps)
      call crush_voids(sim%scene, sim%budget, dt_stress, body, n, nf, ps)
      call record_external_work(sim%scene, sim%step, sim%budget, body, n, dt, v, dv, ps(1, f_mass))
      if (sim%scene%body(body)%is_forced()) then
        call record_prescribed_work(sim, body, n, dt, v, dv, nf, ps)
      end if
      call update_block_stress(sim, body, n, dt_stress, l, nf, ps, outcome)
    end associate
  end subroutine advance_block

  !> MUSL, USAVG: move particles, whose velocities were updated before, with `g_motion`; return the
  !> velocity `v` and its change `dv` at the particles, and the velocity gradient `l` of `g_strain`.
  subroutine move_block(sim, body, n, dt, g_motion, g_strain, nf, ps, w, first, v, dv, l, speed2)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g_motion(8, sim%nodes%patch%nn), g_strain(8, sim%nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), speed2
    real(rp), intent(out) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9)
    integer, intent(out) :: first(nlane)
    real(rp) :: u(nlane, 7)

    call gather_lanes(sim%scene, sim%nodes, body, n, nf, ps, 1, 7, g_motion, sim%nodes%rec, w, &
                      first, u)
    u(n + 1:, :) = 0.0_rp
    v = u(:, 1:3)
    dv = u(:, 5:7)
    u(:, 5:7) = 0.0_rp
    if (sim%step%scheme == scheme_usavg) u(:, 1:3) = v - 0.5_rp*dv
    call advance_particles(n, dt, 0.0_rp, u, u(1, 5), ps(1, f_pos), ps(1, f_vel), speed2)
    call gather_slopes(n, w, first, sim%nodes%patch%stride, sim%nodes%patch%nn, g_strain, &
                       sim%nodes%rec, l)
    l(n + 1:, :) = 0.0_rp
  end subroutine move_block

  !> Store the velocity gradient that APIC particles carry to the next step.
  subroutine store_affine(scene, nodes, n, nf, ps, w, first, g, rec)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, nf, first(nlane)
    real(rp), intent(in) :: w(nlane, 18), g(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)

    if (scene%layout%affine == 0) return
    call gather_gradient(nodes, n, ps(1, f_pos), w, first, g, rec, ps(1, scene%layout%affine))
  end subroutine store_affine

  !> Update the stress over `dt` with the velocity field `g`, at unchanged positions.
  subroutine update_stress(sim, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome
    integer :: b

    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, sim%particles%nf)
      call strain_block(sim, sim%particles%body(b), sim%particles%count(b), dt, &
                        g(:, :, group_of(sim%scene, sim%particles, b)), sim%particles%nf, &
                        sim%particles%ps(:, :, b), sim%nodes%rec, outcome)
    end do
  end subroutine update_stress

  subroutine strain_block(sim, body, n, dt, g, nf, ps, rec, outcome)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(outcome_t), intent(inout) :: outcome
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), l(nlane, 9)

    if (sim%scene%body(body)%is_rigid()) return
    call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
    call gather_slopes(n, w, first, sim%nodes%patch%stride, sim%nodes%patch%nn, g, rec, l)
    l(n + 1:, :) = 0.0_rp
    if (sim%scene%layout%half > 0) call stretch_domains(dt, l, ps(1, sim%scene%layout%half))
    call average_volume(sim, body, n, w, first, nf, ps)
    call update_block_stress(sim, body, n, dt, l, nf, ps, outcome)
  end subroutine strain_block

  !> Velocity-field group of block `b`.
  pure integer function group_of(scene, particles, b)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b

    group_of = scene%body(particles%body(b))%group
  end function group_of

end module mpm_sweeps
