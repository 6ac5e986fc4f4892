! SPDX-License-Identifier: MIT
!> Sweeps over all blocks of particles in a time step. Each sweep passes one block at a time to a
!> procedure of its own.
module mpm_sweeps
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: advance_particles, affine_to_grid, force_records, gather_gradient, &
                        gather_lanes, gather_slopes, gather_velocity, momentum_records, &
                        move_rigid, stretch_domains, values_to_grid, weights_of
  use mpm_constitutive, only: average_volume, crush_voids, external_acceleration, &
                              record_external_work, update_block_stress
  use mpm_fbar, only: add_volume
  use mpm_prescribed, only: add_prescribed_force, record_prescribed_work
  use mpm_tractions, only: record_traction_work
  use particles_block, only: block_t, view_block
  use particles_store, only: f_flow, f_mass, f_pos, f_rate, f_tau, f_temp, f_vel, n_to_grid
  use simulation_nodes, only: nodes_t
  use simulation_parts, only: simulation_t
  use simulation_run, only: clock_t, outcome_t
  use simulation_scene, only: scene_t, scheme_usavg, scheme_usl
  use transfer_scatter, only: p2g_block
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
    type(block_t) :: block

    last_read = n_to_grid
    if (sim%scene%method%fbar) last_read = f_flow
    associate (layout => sim%scene%layout)
      if (layout%half > 0) last_read = layout%half + 2
      if (layout%affine > 0) last_read = layout%affine + 8
    end associate
    do i = first, last
      b = sim%particles%turn(i)
      call sim%particles%fetch(b + 1, last_read, n_to_grid, f_rate - 1)   ! usually the next block
      call view_block(sim%particles, b, block)
      call force_to_grid(sim, block, g(:, :, sim%scene%body(block%body)%group))
    end do
  end subroutine blocks_to_grid

  !> Map mass, momentum, force and temperature of one block to the grid `g`.
  subroutine force_to_grid(sim, block, g)
    type(simulation_t), intent(inout) :: sim
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)

    call weights_of(sim%scene, sim%nodes, block)
    associate (ps => block%ps, body => sim%scene%body(block%body))
      call force_records(sim%clock%mass_scaling, 1.0_rp/sim%scene%material(body%material)%rho, &
                         external_acceleration(sim%scene, sim%clock, block%body), ps(1, f_mass), &
                         ps(1, f_vel), ps(1, f_tau), ps(1, f_temp), sim%nodes%rec)
      if (body%is_forced()) then
        call add_prescribed_force(sim%scene, sim%clock, block, sim%nodes%rec)
      end if
    end associate
    if (sim%clock%now%scheme == scheme_usl) call map_volume(sim%scene, sim%clock, sim%nodes, block)
    if (sim%scene%layout%affine > 0) then
      call affine_to_grid(sim%nodes, block, sim%scene%layout%affine, g)
    else
      call p2g_block(block%n, block%w, block%first, sim%nodes%rec, sim%nodes%patch%stride, &
                     sim%nodes%patch%nn, g)
    end if
  end subroutine force_to_grid

  !> Map mass and momentum to the grid `g`; with `g_motion`, after the particles have taken their
  !> new velocities from it.
  subroutine momentum_to_grid(sim, g, g_motion)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    real(rp), intent(in), optional :: g_motion(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(block_t) :: block
    integer :: b

    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, sim%particles%nf, f_vel + 2, f_rate - 1)
      call view_block(sim%particles, b, block)
      associate (k => sim%scene%body(block%body)%group)
        if (present(g_motion)) then
          call map_momentum(sim, block, g(:, :, k), g_motion(:, :, k))
        else
          call map_momentum(sim, block, g(:, :, k))
        end if
      end associate
    end do
  end subroutine momentum_to_grid

  !> Map mass and momentum of one block; with `g_motion`, take the new velocities from it first.
  subroutine map_momentum(sim, block, g, g_motion)
    type(simulation_t), intent(inout) :: sim
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    real(rp), intent(in), optional :: g_motion(8, sim%nodes%patch%nn)
    real(rp) :: u(nlane, 7)   ! velocity, temperature, velocity change

    if (present(g_motion) .and. .not. sim%scene%body(block%body)%is_rigid()) then
      call gather_lanes(sim%scene, sim%nodes, 1, 7, g_motion, block, u)
      call gather_gradient(sim%scene, sim%nodes, g_motion, block)
      associate (n => block%n, v => block%ps(:, f_vel:f_vel + 2))
        v(:n, :) = (1.0_rp - sim%clock%now%pic)*(v(:n, :) + u(:n, 5:7)) &
          + sim%clock%now%pic*u(:n, 1:3)
      end associate
    else
      call weights_of(sim%scene, sim%nodes, block)
    end if
    call momentum_records(sim%clock%mass_scaling, block%ps(:, f_mass), &
                          block%ps(:, f_vel:f_vel + 2), sim%nodes%rec)
    call map_volume(sim%scene, sim%clock, sim%nodes, block)
    if (sim%scene%layout%affine > 0) then
      sim%nodes%rec(5:8, :, :) = 0.0_rp
      call affine_to_grid(sim%nodes, block, sim%scene%layout%affine, g)
    else
      call values_to_grid(sim%nodes, block, g)
    end if
  end subroutine map_momentum

  !> Add the sums for F-bar averaging.
  subroutine map_volume(scene, clock, nodes, block)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    type(block_t), intent(in) :: block

    if (.not. scene%method%fbar) return
    associate (body => scene%body(block%body))
      call add_volume(body%averaging, scene%material(body%material)%k, clock%dt, block, &
                      nodes%patch%stride, size(nodes%volume, 1), nodes%patch%nn, nodes%volume)
    end associate
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
    type(block_t) :: block
    integer :: i, k

    do i = first, last
      call sim%particles%fetch(sim%particles%order(min(i + 1, sim%particles%n_awake)), &
                               sim%particles%nf)
      call view_block(sim%particles, sim%particles%order(i), block)
      k = sim%scene%body(block%body)%group
      call advance_block(sim, block, dt, g_motion(:, :, k), g_strain(:, :, k), dt_stress, outcome)
    end do
  end subroutine blocks_to_particles

  subroutine advance_block(sim, block, dt, g_motion, g_strain, dt_stress, outcome)
    type(simulation_t), intent(inout) :: sim
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: g_motion(8, sim%nodes%patch%nn), g_strain(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    real(rp) :: v(nlane, 3), dv(nlane, 3), l(nlane, 9)

    associate (body => sim%scene%body(block%body), ps => block%ps, half => sim%scene%layout%half)
      if (body%is_rigid()) then
        call move_rigid(sim%tool, body%tool, block%n, ps(1, f_pos), ps(1, f_vel), outcome%speed2)
        return
      end if
      if (sim%clock%now%scheme /= scheme_usl) then
        call move_block(sim, block, dt, g_motion, g_strain, v, dv, l, outcome%speed2)
      else
        call weights_of(sim%scene, sim%nodes, block)
        call gather_velocity(sim%nodes, block, g_motion, v, dv, l)
        call gather_gradient(sim%scene, sim%nodes, g_motion, block)
        call advance_particles(block%n, dt, sim%clock%now%pic, v, dv, ps(1, f_pos), ps(1, f_vel), &
                               outcome%speed2)
      end if
      if (half > 0) call stretch_domains(dt_stress, l, ps(1, half))
      call average_volume(sim, block)
      call crush_voids(sim%scene, sim%budget, dt_stress, block)
      call record_external_work(sim%scene, sim%clock, sim%budget, block, dt, v, dv)
      if (body%is_forced()) call &
        record_prescribed_work(sim%scene, sim%clock, sim%budget, block, dt, v, dv)
      call update_block_stress(sim, block, dt_stress, l, outcome)
    end associate
  end subroutine advance_block

  !> MUSL, USAVG: move particles, whose velocities were updated before, with `g_motion`; return the
  !> velocity `v` and its change `dv` at the particles, and the velocity gradient `l` of `g_strain`.
  subroutine move_block(sim, block, dt, g_motion, g_strain, v, dv, l, speed2)
    type(simulation_t), intent(inout) :: sim
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g_motion(8, sim%nodes%patch%nn), g_strain(8, sim%nodes%patch%nn)
    real(rp), intent(out) :: v(nlane, 3), dv(nlane, 3), l(nlane, 9)
    real(rp), intent(inout) :: speed2
    real(rp) :: u(nlane, 7)

    call gather_lanes(sim%scene, sim%nodes, 1, 7, g_motion, block, u)
    u(block%n + 1:, :) = 0.0_rp
    v = u(:, 1:3)
    dv = u(:, 5:7)
    u(:, 5:7) = 0.0_rp
    if (sim%clock%now%scheme == scheme_usavg) u(:, 1:3) = v - 0.5_rp*dv
    call advance_particles(block%n, dt, 0.0_rp, u, u(1, 5), block%ps(:, f_pos:f_pos + 2), &
                           block%ps(:, f_vel:f_vel + 2), speed2)
    call gather_slopes(sim%nodes, block, g_strain, l)
    l(block%n + 1:, :) = 0.0_rp
  end subroutine move_block

  !> Update the stress over `dt` with the velocity field `g`, at unchanged positions.
  subroutine update_stress(sim, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome
    type(block_t) :: block
    integer :: b

    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, sim%particles%nf)
      call view_block(sim%particles, b, block)
      call strain_block(sim, block, dt, g(:, :, sim%scene%body(block%body)%group), outcome)
    end do
  end subroutine update_stress

  subroutine strain_block(sim, block, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    real(rp) :: l(nlane, 9)

    if (sim%scene%body(block%body)%is_rigid()) return
    call weights_of(sim%scene, sim%nodes, block)
    call gather_slopes(sim%nodes, block, g, l)
    l(block%n + 1:, :) = 0.0_rp
    associate (half => sim%scene%layout%half)
      if (half > 0) call stretch_domains(dt, l, block%ps(:, half:half + 2))
    end associate
    call average_volume(sim, block)
    call update_block_stress(sim, block, dt, l, outcome)
  end subroutine strain_block

end module mpm_sweeps
