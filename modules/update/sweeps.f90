! SPDX-License-Identifier: MIT
!> Sweeps over all blocks of particles in a time step. Each sweep passes one block at a time, as an
!> explicit-shape array, to a procedure of its own.
module update_sweeps
  use base_kinds, only: nlane, rp
  use mapping_apic, only: affine_to_grid, gather_gradient
  use mapping_blocks, only: advance_particles, force_records, gather_velocity, momentum_records, &
                            stretch_domains, weights_of
  use mapping_fbar, only: add_volume
  use mapping_nodes, only: nodes_t
  use mapping_rigid, only: move_rigid
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel, n_to_grid, particles_t
  use state_run, only: budget_t, clock_t, exchange_t, outcome_t, step_t
  use state_scene, only: scene_t, scheme_usavg, scheme_usl
  use tools_tool, only: tool_t
  use transfer_scatter, only: p2g_block
  use update_constitutive, only: constitutive, external_acceleration, external_work, average_volume
  use update_prescribed, only: add_prescribed_force, prescribed_work
  use update_tractions, only: record_traction_work
  implicit none (type, external)
  private

  public :: momentum_to_grid, grid_to_particles
  public :: blocks_to_particles, force_to_grid, update_stress, accelerate, blocks_to_grid

contains

  !> Map mass, momentum, force and temperature of the awake blocks `first` to `last` of
  !> `particles%turn` to the grid.
  subroutine blocks_to_grid(scene, clock, step, particles, nodes, first, last, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: first, last
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: b, n_fields_read, i

    n_fields_read = n_to_grid
    if (max(scene%layout%half, scene%layout%affine) > 0) n_fields_read = particles%nf
    do i = first, last
      b = particles%turn(i)
      call particles%fetch(b + 1, n_fields_read)   ! usually the next block
      call force_to_grid(scene, clock, step, nodes, particles%body(b), particles%count(b), &
                         particles%nf, particles%ps(:, :, b), nodes%rec, &
                         g(:, :, group_of(scene, particles, b)))
    end do
  end subroutine blocks_to_grid

  !> Map one block of particles.
  subroutine force_to_grid(scene, clock, step, nodes, body, n, nf, ps, rec, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    call force_records(clock%mass_scaling, 1.0_rp/scene%material(scene%body(body)%material)%rho, &
                       external_acceleration(scene, step, body), ps(1, f_mass), ps(1, f_vel), &
                       ps(1, f_tau), ps(1, f_temp), rec)
    if (scene%body(body)%is_forced()) call add_prescribed_force(scene, step, body, nf, ps, rec)
    call map_volume(scene, clock, nodes, body, n, w, first, nf, ps)
    call add_records(scene, nodes, n, nf, ps, w, first, rec, g)
  end subroutine force_to_grid

  !> Map mass, momentum and temperature to the grid.
  subroutine momentum_to_grid(scene, clock, particles, nodes, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: b

    do b = 1, particles%nblk
      call map_momentum(scene, clock, nodes, particles%body(b), particles%count(b), particles%nf, &
                        particles%ps(:, :, b), nodes%rec, g(:, :, group_of(scene, particles, b)))
    end do
  end subroutine momentum_to_grid

  subroutine map_momentum(scene, clock, nodes, body, n, nf, ps, rec, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    call momentum_records(clock%mass_scaling, ps(1, f_mass), ps(1, f_vel), ps(1, f_temp), rec)
    call map_volume(scene, clock, nodes, body, n, w, first, nf, ps)
    call add_records(scene, nodes, n, nf, ps, w, first, rec, g)
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

  !> Add the records of a block to the nodes, with the velocity gradients of APIC particles.
  subroutine add_records(scene, nodes, n, nf, ps, w, first, rec, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, nf, first(nlane)
    real(rp), intent(in) :: ps(nlane, nf), w(nlane, 18)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nodes%patch%nn)

    if (scene%layout%affine > 0) then
      call affine_to_grid(nodes, n, ps(1, f_pos), ps(1, scene%layout%affine), w, first, rec, g)
    else
      call p2g_block(n, w, first, rec, nodes%patch%stride, nodes%patch%nn, g)
    end if
  end subroutine add_records

  !> Update the particles from the grid: move them with `g_motion`, then update the stress over
  !> `dt_stress` with the gradient of `g_strain` (the same grid in USL).
  subroutine grid_to_particles(scene, clock, step, tool, particles, nodes, exchange, &
                               budget, dt, g_motion, g_strain, dt_stress, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(exchange_t), intent(in) :: exchange
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, nodes%patch%nn, nodes%n_groups) :: g_motion, g_strain
    type(outcome_t), intent(inout) :: outcome

    if (scene%has_tractions()) then
      call record_traction_work(scene, step, particles, nodes, budget, dt, g_motion)
    end if
    call blocks_to_particles(scene, clock, step, tool, particles, nodes, budget, &
                             exchange%speculative%n_done + 1, particles%n_awake, dt, g_motion, &
                             g_strain, dt_stress, outcome)
  end subroutine grid_to_particles

  !> Update the blocks `first` to `last` of `particles%order`.
  subroutine blocks_to_particles(scene, clock, step, tool, particles, nodes, budget, &
                                 first, last, dt, g_motion, g_strain, dt_stress, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: first, last
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, nodes%patch%nn, nodes%n_groups) :: g_motion, g_strain
    type(outcome_t), intent(inout) :: outcome
    integer :: b, i, k

    do i = first, last
      b = particles%order(i)
      call particles%fetch(particles%order(min(i + 1, particles%n_awake)), particles%nf)
      k = group_of(scene, particles, b)
      call advance_block(scene, clock, step, tool, particles, nodes, budget, b, &
                         particles%count(b), dt, g_motion(:, :, k), g_strain(:, :, k), dt_stress, &
                         particles%nf, particles%ps(:, :, b), nodes%rec, outcome)
    end do
  end subroutine blocks_to_particles

  subroutine advance_block(scene, clock, step, tool, particles, nodes, budget, b, n, dt, g_motion, &
                           g_strain, dt_stress, nf, ps, rec, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: b, n, nf
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: g_motion(8, nodes%patch%nn), g_strain(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(outcome_t), intent(inout) :: outcome
    integer :: first(nlane)
    real(rp), dimension(nlane, 3) :: v, dv, v2, dv2
    real(rp) :: w(nlane, 18), l(nlane, 9)

    if (scene%body(particles%body(b))%is_rigid()) then
      call move_rigid(tool, scene%body(particles%body(b))%tool, n, ps(1, f_pos), ps(1, f_vel), &
                      outcome%speed2)
      return
    end if
    call weights_of(scene, nodes, particles%body(b), nf, ps, w, first)
    call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, g_motion, rec, v, dv, l)
    if (scene%method%scheme /= scheme_usl) then   ! velocities are new already: only move
      v2 = v
      if (scene%method%scheme == scheme_usavg) v2 = v - 0.5_rp*dv
      dv2 = 0.0_rp
      call advance_particles(n, dt, 0.0_rp, v2, dv2, ps(1, f_pos), ps(1, f_vel), outcome%speed2)
      call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, g_strain, rec, v2, &
                           dv2, l)
    else
      call store_affine(scene, nodes, n, nf, ps, w, first, g_motion, rec)
      call advance_particles(n, dt, step%pic, v, dv, ps(1, f_pos), ps(1, f_vel), outcome%speed2)
    end if
    if (scene%layout%half > 0) call stretch_domains(dt_stress, l, ps(1, scene%layout%half))
    call average_volume(scene, clock, nodes, budget, particles%body(b), n, w, first, nf, ps)
    call external_work(scene, step, budget, particles%body(b), n, dt, v, dv, ps(1, f_mass))
    if (scene%body(particles%body(b))%is_forced()) then
      call prescribed_work(scene, step, budget, particles%body(b), n, dt, v, dv, nf, ps)
    end if
    call constitutive(scene, clock, budget, particles%body(b), n, dt_stress, l, nf, ps, outcome)
  end subroutine advance_block

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
  subroutine update_stress(scene, clock, particles, nodes, budget, dt, g, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome
    integer :: b

    do b = 1, particles%nblk
      call strain_block(scene, clock, nodes, budget, particles%body(b), particles%count(b), dt, &
                        g(:, :, group_of(scene, particles, b)), particles%nf, &
                        particles%ps(:, :, b), nodes%rec, outcome)
    end do
  end subroutine update_stress

  subroutine strain_block(scene, clock, nodes, budget, body, n, dt, g, nf, ps, rec, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(outcome_t), intent(inout) :: outcome
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9)

    if (scene%body(body)%is_rigid()) return
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, g, rec, v, dv, l)
    if (scene%layout%half > 0) call stretch_domains(dt, l, ps(1, scene%layout%half))
    call average_volume(scene, clock, nodes, budget, body, n, w, first, nf, ps)
    call constitutive(scene, clock, budget, body, n, dt, l, nf, ps, outcome)
  end subroutine strain_block

  !> MUSL, USAVG: update the particle velocities from `g_motion` at unchanged positions.
  subroutine accelerate(scene, step, particles, nodes, g_motion)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: g_motion(8, nodes%patch%nn, nodes%n_groups)
    integer :: b

    do b = 1, particles%nblk
      call accelerate_block(scene, step, nodes, particles%body(b), particles%count(b), &
                            g_motion(:, :, group_of(scene, particles, b)), particles%nf, &
                            particles%ps(:, :, b), nodes%rec)
    end do
  end subroutine accelerate

  subroutine accelerate_block(scene, step, nodes, body, n, g_motion, nf, ps, rec)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: g_motion(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9), max_speed2

    if (scene%body(body)%is_rigid()) return
    max_speed2 = 0.0_rp
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, g_motion, rec, v, dv, l)
    call store_affine(scene, nodes, n, nf, ps, w, first, g_motion, rec)
    call advance_particles(n, 0.0_rp, step%pic, v, dv, ps(1, f_pos), ps(1, f_vel), max_speed2)
  end subroutine accelerate_block

  !> Velocity-field group of block `b`.
  pure integer function group_of(scene, particles, b)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b

    group_of = scene%body(particles%body(b))%group
  end function group_of

end module update_sweeps
