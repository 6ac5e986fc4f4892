! SPDX-License-Identifier: MIT
!> Sweeps over all blocks of particles in a time step. Each sweep passes one block at a time to a
!> procedure of its own.
module mpm_sweeps
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: advance_particles, affine_to_grid, force_records, gather_gradient, &
                        gather_lanes, gather_slopes, gather_velocity, momentum_records, &
                        stretch_domains, values_to_grid, weights_of
  use mpm_constitutive, only: average_volume, crush_voids, external_acceleration, &
                              record_external_work, update_block_stress
  use mpm_fbar, only: add_volume
  use mpm_prescribed, only: add_prescribed_force, record_prescribed_work
  use particles_block, only: block_t, view_block
  use particles_store, only: f_flow, f_mass, f_pos, f_rate, f_tau, f_temp, f_vel, n_to_grid, &
                             particles_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t, outcome_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t, scheme_usavg, scheme_usl
  use transfer_scatter, only: p2g_block
  implicit none (type, external)
  private

  public :: advance_block, blocks_to_grid, force_to_grid, momentum_to_grid, update_stress

contains

  !> Map mass, momentum, force and temperature of the awake blocks `first` to `last` of
  !> `particles%turn` to the grid.
  subroutine blocks_to_grid(scene, clock, particles, nodes, first, last, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: first, last
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: b, i, last_read
    type(block_t) :: block

    last_read = n_to_grid
    if (scene%method%fbar) last_read = f_flow
    associate (layout => scene%layout)
      if (layout%half > 0) last_read = layout%half + 2
      if (layout%affine > 0) last_read = layout%affine + 8
    end associate
    do i = first, last
      b = particles%turn(i)
      call particles%fetch(b + 1, last_read, n_to_grid, f_rate - 1)   ! usually the next block
      call view_block(particles, b, block)
      call force_to_grid(scene, clock, nodes, block, g(:, :, scene%body(block%body)%group))
    end do
  end subroutine blocks_to_grid

  !> Map mass, momentum, force and temperature of one block to the grid `g`.
  subroutine force_to_grid(scene, clock, nodes, block, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, nodes%patch%nn)

    call weights_of(scene, nodes, block)
    associate (ps => block%ps, body => scene%body(block%body))
      call force_records(clock%mass_scaling, 1.0_rp/scene%material(body%material)%rho, &
                         external_acceleration(scene, clock, block%body), ps(1, f_mass), &
                         ps(1, f_vel), ps(1, f_tau), ps(1, f_temp), nodes%rec)
      if (body%is_forced()) then
        call add_prescribed_force(scene, clock, block, nodes%rec)
      end if
    end associate
    if (clock%now%scheme == scheme_usl) call map_volume(scene, clock, nodes, block)
    if (scene%layout%affine > 0) then
      call affine_to_grid(nodes, block, scene%layout%affine, g)
    else
      call p2g_block(block%n, block%w, block%first, nodes%rec, nodes%patch%stride, &
                     nodes%patch%nn, g)
    end if
  end subroutine force_to_grid

  !> Map mass and momentum to the grid `g`; with `g_motion`, after the particles have taken their
  !> new velocities from it.
  subroutine momentum_to_grid(scene, clock, particles, nodes, g, g_motion)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(in), optional :: g_motion(8, nodes%patch%nn, nodes%n_groups)
    type(block_t) :: block
    integer :: b

    do b = 1, particles%nblk
      call particles%fetch(b + 1, particles%nf, f_vel + 2, f_rate - 1)
      call view_block(particles, b, block)
      associate (k => scene%body(block%body)%group)
        if (present(g_motion)) then
          call map_momentum(scene, clock, nodes, block, g(:, :, k), g_motion(:, :, k))
        else
          call map_momentum(scene, clock, nodes, block, g(:, :, k))
        end if
      end associate
    end do
  end subroutine momentum_to_grid

  !> Map mass and momentum of one block; with `g_motion`, take the new velocities from it first.
  subroutine map_momentum(scene, clock, nodes, block, g, g_motion)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), intent(in), optional :: g_motion(8, nodes%patch%nn)
    real(rp) :: u(nlane, 7)   ! velocity, temperature, velocity change

    if (present(g_motion) .and. .not. scene%body(block%body)%is_rigid()) then
      call gather_lanes(scene, nodes, 1, 7, g_motion, block, u)
      call gather_gradient(scene, nodes, g_motion, block)
      associate (n => block%n, v => block%ps(:, f_vel:f_vel + 2))
        v(:n, :) = (1.0_rp - clock%now%pic)*(v(:n, :) + u(:n, 5:7)) + clock%now%pic*u(:n, 1:3)
      end associate
    else
      call weights_of(scene, nodes, block)
    end if
    call momentum_records(clock%mass_scaling, block%ps(:, f_mass), &
                          block%ps(:, f_vel:f_vel + 2), nodes%rec)
    call map_volume(scene, clock, nodes, block)
    if (scene%layout%affine > 0) then
      nodes%rec(5:8, :, :) = 0.0_rp
      call affine_to_grid(nodes, block, scene%layout%affine, g)
    else
      call values_to_grid(nodes, block, g)
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

  !> Update a block of a deformable body from the grid.
  subroutine advance_block(scene, clock, nodes, budget, block, dt, g_motion, g_strain, dt_stress, &
                           outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: g_motion(8, nodes%patch%nn), g_strain(8, nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    real(rp) :: v(nlane, 3), dv(nlane, 3), l(nlane, 9)

    associate (body => scene%body(block%body), ps => block%ps, half => scene%layout%half)
      if (clock%now%scheme /= scheme_usl) then
        call move_block(scene, clock, nodes, block, dt, g_motion, g_strain, v, dv, l, &
                        outcome%speed2)
      else
        call weights_of(scene, nodes, block)
        call gather_velocity(nodes, block, g_motion, v, dv, l)
        call gather_gradient(scene, nodes, g_motion, block)
        call advance_particles(block%n, dt, clock%now%pic, v, dv, ps(1, f_pos), ps(1, f_vel), &
                               outcome%speed2)
      end if
      if (half > 0) call stretch_domains(dt_stress, l, ps(1, half))
      call average_volume(scene, clock, nodes, budget, block)
      call crush_voids(scene, budget, dt_stress, block)
      call record_external_work(scene, clock, budget, block, dt, v, dv)
      if (body%is_forced()) call record_prescribed_work(scene, clock, budget, block, dt, v, dv)
      call update_block_stress(scene, clock, budget, block, dt_stress, l, outcome)
    end associate
  end subroutine advance_block

  !> MUSL, USAVG: move particles, whose velocities were updated before, with `g_motion`; return the
  !> velocity `v` and its change `dv` at the particles, and the velocity gradient `l` of `g_strain`.
  subroutine move_block(scene, clock, nodes, block, dt, g_motion, g_strain, v, dv, l, speed2)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g_motion(8, nodes%patch%nn), g_strain(8, nodes%patch%nn)
    real(rp), intent(out) :: v(nlane, 3), dv(nlane, 3), l(nlane, 9)
    real(rp), intent(inout) :: speed2
    real(rp) :: u(nlane, 7)

    call gather_lanes(scene, nodes, 1, 7, g_motion, block, u)
    u(block%n + 1:, :) = 0.0_rp
    v = u(:, 1:3)
    dv = u(:, 5:7)
    u(:, 5:7) = 0.0_rp
    if (clock%now%scheme == scheme_usavg) u(:, 1:3) = v - 0.5_rp*dv
    call advance_particles(block%n, dt, 0.0_rp, u, u(1, 5), block%ps(:, f_pos:f_pos + 2), &
                           block%ps(:, f_vel:f_vel + 2), speed2)
    call gather_slopes(nodes, block, g_strain, l)
    l(block%n + 1:, :) = 0.0_rp
  end subroutine move_block

  !> Update the stress over `dt` with the velocity field `g`, at unchanged positions.
  subroutine update_stress(scene, clock, particles, nodes, budget, dt, g, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn, nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome
    type(block_t) :: block
    integer :: b

    do b = 1, particles%nblk
      call particles%fetch(b + 1, particles%nf)
      call view_block(particles, b, block)
      call strain_block(scene, clock, nodes, budget, block, dt, &
                        g(:, :, scene%body(block%body)%group), outcome)
    end do
  end subroutine update_stress

  subroutine strain_block(scene, clock, nodes, budget, block, dt, g, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    real(rp) :: l(nlane, 9)

    if (scene%body(block%body)%is_rigid()) return
    call weights_of(scene, nodes, block)
    call gather_slopes(nodes, block, g, l)
    l(block%n + 1:, :) = 0.0_rp
    associate (half => scene%layout%half)
      if (half > 0) call stretch_domains(dt, l, block%ps(:, half:half + 2))
    end associate
    call average_volume(scene, clock, nodes, budget, block)
    call update_block_stress(scene, clock, budget, block, dt, l, outcome)
  end subroutine strain_block

end module mpm_sweeps
