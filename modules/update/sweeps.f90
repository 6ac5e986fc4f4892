! SPDX-License-Identifier: MIT
!> The sweeps over all blocks of particles that a time step is made of.
!> Each sweep hands one block at a time, as an explicit-shape array, to a procedure of its own.
module update_sweeps
  use base_kinds, only: nlane, rp
  use contact_tool, only: tool_t
  use exchange_ranks, only: exchange_t
  use mapping_apic, only: affine_to_grid, carry_gradient
  use mapping_blocks, only: advance_particles, force_records, gather_velocity, momentum_records, &
                            stretch_domains, weights_of
  use mapping_fbar, only: add_volume
  use mapping_nodes, only: nodes_t
  use mapping_rigid, only: move_rigid
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel, n_to_grid, particles_t
  use state_blocks, only: blocks_t
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_usavg, scheme_usl
  use state_step, only: step_t, outcome_t
  use transfer_scatter, only: p2g_block
  use update_constitutive, only: constitutive, outer_acceleration, outer_work, restore_volume
  use update_prescribed, only: add_prescribed_force, prescribed_work
  use update_tractions, only: book_tractions
  implicit none (type, external)
  private

  public :: momentum_to_grid, grid_to_particles
  public :: blocks_to_particles, force_to_grid, update_stress, accelerate, blocks_to_grid

contains

  !> Particles to grid: mass, momentum, force, temperature of the awake blocks `first` to `last`, in
  !> turn.
  subroutine blocks_to_grid(scene, clock, step, particles, blocks, nodes, first, last, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: first, last
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: b, given, i

    given = n_to_grid
    if (max(scene%layout%half, scene%layout%affine) > 0) given = particles%nf
    do i = first, last
      b = blocks%turn(i)
      call particles%fetch(b + 1, given)   ! mostly the next one
      call force_to_grid(scene, clock, step, nodes, particles%body(b), particles%count(b), &
                         particles%nf, particles%ps(:, :, b), nodes%rec, &
                         g(:, :, group_of(scene, particles, b)))
    end do
  end subroutine blocks_to_grid

  !> The same of one block of particles.
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
                       outer_acceleration(scene, step, body), ps(1, f_mass), ps(1, f_vel), &
                       ps(1, f_tau), ps(1, f_temp), rec)
    if (scene%body(body)%is_forced()) call add_prescribed_force(scene, step, body, nf, ps, rec)
    call map_volume(scene, clock, nodes, body, n, w, first, nf, ps)
    call to_grid(scene, nodes, n, nf, ps, w, first, rec, g)
  end subroutine force_to_grid

  !> Particles to grid: mass, momentum, temperature.
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
    call to_grid(scene, nodes, n, nf, ps, w, first, rec, g)
  end subroutine map_momentum

  !> What the mean volume ratios of cells are made of.
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

  !> Add the records of a block to the nodes, with the gradients that the particles carry (APIC).
  subroutine to_grid(scene, nodes, n, nf, ps, w, first, rec, g)
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
  end subroutine to_grid

  !> Grid to particles: move them with `moved`, then stress over `dt_stress` with the
  !> gradient of `field` (the same grid in USL).
  subroutine grid_to_particles(scene, clock, step, tool, particles, blocks, nodes, exchange, &
                               books, dt, moved, field, dt_stress, report)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(exchange_t), intent(in) :: exchange
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, nodes%patch%nn, nodes%n_groups) :: moved, field
    type(outcome_t), intent(inout) :: report

    if (scene%has_tractions()) then
      call book_tractions(scene, step, particles, nodes, books, dt, moved)
    end if
    call blocks_to_particles(scene, clock, step, tool, particles, blocks, nodes, books, &
                             exchange%speculative%done + 1, blocks%n_awake, dt, moved, field, &
                             dt_stress, report)
  end subroutine grid_to_particles

  !> The same for the blocks `first` to `last` of `sim%blocks%order`.
  subroutine blocks_to_particles(scene, clock, step, tool, particles, blocks, nodes, books, first, &
                                 last, dt, moved, field, dt_stress, report)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(books_t), intent(inout) :: books
    integer, intent(in) :: first, last
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, nodes%patch%nn, nodes%n_groups) :: moved, field
    type(outcome_t), intent(inout) :: report
    integer :: b, i, k

    do i = first, last
      b = blocks%order(i)
      call particles%fetch(blocks%order(min(i + 1, blocks%n_awake)), particles%nf)
      k = group_of(scene, particles, b)
      call advance_block(scene, clock, step, tool, particles, nodes, books, b, particles%count(b), &
                         dt, moved(:, :, k), field(:, :, k), dt_stress, particles%nf, &
                         particles%ps(:, :, b), nodes%rec, report)
    end do
  end subroutine blocks_to_particles

  subroutine advance_block(scene, clock, step, tool, particles, nodes, books, b, n, dt, moved, &
                           field, dt_stress, nf, ps, rec, report)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(books_t), intent(inout) :: books
    integer, intent(in) :: b, n, nf
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: moved(8, nodes%patch%nn), field(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(outcome_t), intent(inout) :: report
    integer :: first(nlane)
    real(rp), dimension(nlane, 3) :: v, dv, v2, dv2
    real(rp) :: w(nlane, 18), l(nlane, 9)

    if (scene%body(particles%body(b))%is_rigid()) then
      call move_rigid(tool, scene%body(particles%body(b))%tool, n, ps(1, f_pos), ps(1, f_vel), &
                      report%speed2)
      return
    end if
    call weights_of(scene, nodes, particles%body(b), nf, ps, w, first)
    call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, moved, rec, v, dv, l)
    if (scene%method%scheme /= scheme_usl) then   ! velocities are new already: move only
      v2 = v
      if (scene%method%scheme == scheme_usavg) v2 = v - 0.5_rp*dv
      dv2 = 0.0_rp
      call advance_particles(n, dt, 0.0_rp, v2, dv2, ps(1, f_pos), ps(1, f_vel), report%speed2)
      call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, field, rec, v2, dv2, l)
    else
      call carry(scene, nodes, n, nf, ps, w, first, moved, rec)
      call advance_particles(n, dt, step%pic, v, dv, ps(1, f_pos), ps(1, f_vel), report%speed2)
    end if
    if (scene%layout%half > 0) call stretch_domains(dt_stress, l, ps(1, scene%layout%half))
    call restore_volume(scene, clock, nodes, books, particles%body(b), n, w, first, nf, ps)
    call outer_work(scene, step, books, particles%body(b), n, dt, v, dv, ps(1, f_mass))
    if (scene%body(particles%body(b))%is_forced()) then
      call prescribed_work(scene, step, books, particles%body(b), n, dt, v, dv, nf, ps)
    end if
    call constitutive(scene, clock, books, particles%body(b), n, dt_stress, l, nf, ps, report)
  end subroutine advance_block

  !> The velocity gradient that particles of an affine transfer carry to the next step.
  subroutine carry(scene, nodes, n, nf, ps, w, first, g, rec)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, nf, first(nlane)
    real(rp), intent(in) :: w(nlane, 18), g(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)

    if (scene%layout%affine == 0) return
    call carry_gradient(nodes, n, ps(1, f_pos), w, first, g, rec, ps(1, scene%layout%affine))
  end subroutine carry

  !> Half a step of stress from the velocity field `g`, at unchanged places.
  subroutine update_stress(scene, clock, particles, nodes, books, dt, g, report)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(outcome_t), intent(inout) :: report
    integer :: b

    do b = 1, particles%nblk
      call strain_block(scene, clock, nodes, books, particles%body(b), particles%count(b), dt, &
                        g(:, :, group_of(scene, particles, b)), particles%nf, &
                        particles%ps(:, :, b), nodes%rec, report)
    end do
  end subroutine update_stress

  subroutine strain_block(scene, clock, nodes, books, body, n, dt, g, nf, ps, rec, report)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(books_t), intent(inout) :: books
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(outcome_t), intent(inout) :: report
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9)

    if (scene%body(body)%is_rigid()) return
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, g, rec, v, dv, l)
    if (scene%layout%half > 0) call stretch_domains(dt, l, ps(1, scene%layout%half))
    call restore_volume(scene, clock, nodes, books, body, n, w, first, nf, ps)
    call constitutive(scene, clock, books, body, n, dt, l, nf, ps, report)
  end subroutine strain_block

  !> MUSL, USAVG: new particle velocities from `moved`; places are kept.
  subroutine accelerate(scene, step, particles, nodes, moved)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: moved(8, nodes%patch%nn, nodes%n_groups)
    integer :: b

    do b = 1, particles%nblk
      call accelerate_block(scene, step, nodes, particles%body(b), particles%count(b), &
                            moved(:, :, group_of(scene, particles, b)), particles%nf, &
                            particles%ps(:, :, b), nodes%rec)
    end do
  end subroutine accelerate

  subroutine accelerate_block(scene, step, nodes, body, n, moved, nf, ps, rec)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: moved(8, nodes%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9), fastest

    if (scene%body(body)%is_rigid()) return
    fastest = 0.0_rp
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call gather_velocity(n, w, first, nodes%patch%stride, nodes%patch%nn, moved, rec, v, dv, l)
    call carry(scene, nodes, n, nf, ps, w, first, moved, rec)
    call advance_particles(n, 0.0_rp, step%pic, v, dv, ps(1, f_pos), ps(1, f_vel), fastest)
  end subroutine accelerate_block

  !> Group of the bodies that block `b` shares its velocity field with.
  pure integer function group_of(scene, particles, b)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b

    group_of = scene%body(particles%body(b))%group
  end function group_of

end module update_sweeps
