! SPDX-License-Identifier: MIT
!> The sweeps over all blocks of particles that a time step is made of.
!> Each sweep hands one block at a time, as an explicit-shape array, to a procedure of its own.
module time_sweeps
  use base_kinds, only: nlane, rp
  use particles_store, only: f_jac, f_mass, f_pos, f_tau, f_temp, f_vel, n_to_grid
  use time_affine, only: affine_to_grid, carry_gradient
  use time_blocks, only: advance_particles, force_records, gather_velocity, momentum_records, &
                         stretch_domains
  use time_known, only: add_known_force, known_work
  use time_rigid, only: move_rigid
  use time_scene, only: scheme_usavg, scheme_usl
  use time_state, only: simulation_t
  use time_surface_loads, only: book_tractions, tractions_to_grid
  use time_update, only: constitutive, outer_acceleration, outer_work, report_t, restore_volume
  use time_volume, only: add_volume, clear_volume
  use time_weights, only: weights_of
  use transfer_scatter, only: p2g_block
  implicit none (type, external)
  private

  public :: momentum_and_force_to_grid, momentum_to_grid, grid_to_particles
  public :: blocks_to_particles, force_to_grid, update_stress, accelerate_and_map_again, blocks_to_grid, others_to_grid

contains

  !> Particles to grid: mass, momentum, force, temperature.
  subroutine momentum_and_force_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)

    call clear_volume(sim)
    call blocks_to_grid(sim, 1, sim%n_awake, g)
    call others_to_grid(sim, g)
  end subroutine momentum_and_force_to_grid

  !> The same for the blocks `first` to `last` of `sim%turn`.
  subroutine blocks_to_grid(sim, first, last, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: first, last
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: b, given, i

    given = n_to_grid
    if (max(sim%scene%layout%half, sim%scene%layout%affine) > 0) given = sim%particles%nf
    do i = first, last
      b = sim%turn(i)
      call sim%particles%fetch(b + 1, given)   ! mostly the next one
      call force_to_grid(sim, sim%scene%method%mass_scaling, sim%particles%body(b), &
                         sim%particles%count(b), sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, g(:, :, group_of(sim, b)))
    end do
  end subroutine blocks_to_grid

  !> What does not come from the stress of awake particles: the rim of sleepers, tractions.
  subroutine others_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)

    call add_rim(sim, g(:, :, 1))
    call tractions_to_grid(sim, g)
  end subroutine others_to_grid

  !> What the rim of sleeping material gives to its nodes (time_rim).
  subroutine add_rim(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    integer :: i, q

    if (.not. allocated(sim%rim%node)) return
    do i = 1, size(sim%rim%node)
      q = sim%rim%node(i)
      g(:, q) = g(:, q) + sim%rim%record(:, i)
      if (allocated(sim%volume)) sim%volume(:, q) = sim%volume(:, q) + sim%rim%volume(:, i)
    end do
  end subroutine add_rim

  subroutine force_to_grid(sim, inertia, body, n, nf, ps, rec, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: inertia             !! on mass
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    call force_records(inertia, 1.0_rp/sim%scene%material(sim%scene%body(body)%material)%rho, &
                       outer_acceleration(sim, body), ps(1, f_mass), ps(1, f_vel), ps(1, f_tau), &
                       ps(1, f_temp), rec)
    call add_known_force(sim, body, nf, ps, rec)
    if (sim%scene%method%fbar) call add_volume(n, first, sim%patch%stride, ps(1, f_mass), &
      ps(1, f_jac), body, size(sim%volume, 1), sim%patch%nn, sim%volume)
    call to_grid(sim, n, nf, ps, w, first, rec, g)
  end subroutine force_to_grid

  !> Particles to grid: mass, momentum, temperature.
  subroutine momentum_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: b

    call clear_volume(sim)
    do b = 1, sim%particles%nblk
      call map_momentum(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                        sim%particles%ps(:, :, b), sim%rec, g(:, :, group_of(sim, b)))
    end do
  end subroutine momentum_to_grid

  subroutine map_momentum(sim, body, n, nf, ps, rec, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    call momentum_records(sim%scene%method%mass_scaling, ps(1, f_mass), ps(1, f_vel), &
                          ps(1, f_temp), rec)
    if (sim%scene%method%fbar) call add_volume(n, first, sim%patch%stride, ps(1, f_mass), &
      ps(1, f_jac), body, size(sim%volume, 1), sim%patch%nn, sim%volume)
    call to_grid(sim, n, nf, ps, w, first, rec, g)
  end subroutine map_momentum

  !> Add the records of a block to the nodes, with the gradients that the particles carry (APIC).
  subroutine to_grid(sim, n, nf, ps, w, first, rec, g)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n, nf, first(nlane)
    real(rp), intent(in) :: ps(nlane, nf), w(nlane, 18)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%patch%nn)

    if (sim%scene%layout%affine > 0) then
      call affine_to_grid(sim, n, ps(1, f_pos), ps(1, sim%scene%layout%affine), w, first, rec, g)
    else
      call p2g_block(n, w, first, rec, sim%patch%stride, sim%patch%nn, g)
    end if
  end subroutine to_grid

  !> Grid to particles: move them with `moved`, then stress over `dt_stress` with the
  !> gradient of `field` (the same grid in USL).
  subroutine grid_to_particles(sim, dt, moved, field, dt_stress, report)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, sim%patch%nn, sim%n_groups) :: moved, field
    type(report_t), intent(inout) :: report

    call book_tractions(sim, dt, moved)
    call blocks_to_particles(sim, sim%ahead%done + 1, sim%n_awake, dt, moved, field, dt_stress, report)
  end subroutine grid_to_particles

  !> The same for the blocks `first` to `last` of `sim%ahead%order`.
  subroutine blocks_to_particles(sim, first, last, dt, moved, field, dt_stress, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: first, last
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, sim%patch%nn, sim%n_groups) :: moved, field
    type(report_t), intent(inout) :: report
    integer :: b, i, k

    do i = first, last
      b = sim%ahead%order(i)
      call sim%particles%fetch(sim%ahead%order(min(i + 1, sim%n_awake)), sim%particles%nf)
      k = group_of(sim, b)
      call advance_block(sim, b, sim%particles%count(b), dt, moved(:, :, k), field(:, :, k), &
                         dt_stress, sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, report)
    end do
  end subroutine blocks_to_particles

  subroutine advance_block(sim, b, n, dt, moved, field, dt_stress, nf, ps, rec, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b, n, nf
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: moved(8, sim%patch%nn), field(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(report_t), intent(inout) :: report
    integer :: first(nlane)
    real(rp), dimension(nlane, 3) :: v, dv, v2, dv2
    real(rp) :: w(nlane, 18), l(nlane, 9)

    if (sim%scene%body(sim%particles%body(b))%tool > 0) then
      call move_rigid(sim, sim%scene%body(sim%particles%body(b))%tool, n, ps(1, f_pos), &
                      ps(1, f_vel), report%speed2)
      return
    end if
    call weights_of(sim, sim%particles%body(b), nf, ps, w, first)
    call gather_velocity(n, w, first, sim%patch%stride, sim%patch%nn, moved, rec, v, dv, l)
    if (sim%scene%method%scheme /= scheme_usl) then   ! velocities are new already: move only
      v2 = v
      if (sim%scene%method%scheme == scheme_usavg) v2 = v - 0.5_rp*dv
      dv2 = 0.0_rp
      call advance_particles(n, dt, 0.0_rp, v2, dv2, ps(1, f_pos), ps(1, f_vel), report%speed2)
      call gather_velocity(n, w, first, sim%patch%stride, sim%patch%nn, field, rec, v2, dv2, l)
    else
      call carry(sim, n, nf, ps, w, first, moved, rec)
      call advance_particles(n, dt, sim%pic, v, dv, ps(1, f_pos), ps(1, f_vel), report%speed2)
    end if
    if (sim%scene%layout%half > 0) call stretch_domains(dt_stress, l, ps(1, sim%scene%layout%half))
    call restore_volume(sim, sim%particles%body(b), n, first, nf, ps)
    call outer_work(sim, sim%particles%body(b), n, dt, v, dv, ps(1, f_mass))
    call known_work(sim, sim%particles%body(b), n, dt, v, dv, nf, ps)
    call constitutive(sim, sim%particles%body(b), n, dt_stress, l, nf, ps, report)
  end subroutine advance_block

  !> The velocity gradient that particles of an affine transfer carry to the next step.
  subroutine carry(sim, n, nf, ps, w, first, g, rec)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n, nf, first(nlane)
    real(rp), intent(in) :: w(nlane, 18), g(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)

    if (sim%scene%layout%affine == 0) return
    call carry_gradient(sim, n, ps(1, f_pos), w, first, g, rec, ps(1, sim%scene%layout%affine))
  end subroutine carry

  !> Half a step of stress from the velocity field `g`, at unchanged places.
  subroutine update_stress(sim, dt, g, report)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)
    type(report_t), intent(inout) :: report
    integer :: b

    do b = 1, sim%particles%nblk
      call strain_block(sim, sim%particles%body(b), sim%particles%count(b), dt, &
                        g(:, :, group_of(sim, b)), sim%particles%nf, &
                        sim%particles%ps(:, :, b), sim%rec, report)
    end do
  end subroutine update_stress

  subroutine strain_block(sim, body, n, dt, g, nf, ps, rec, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(report_t), intent(inout) :: report
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9)

    if (sim%scene%body(body)%tool > 0) return
    call weights_of(sim, body, nf, ps, w, first)
    call gather_velocity(n, w, first, sim%patch%stride, sim%patch%nn, g, rec, v, dv, l)
    if (sim%scene%layout%half > 0) call stretch_domains(dt, l, ps(1, sim%scene%layout%half))
    call restore_volume(sim, body, n, first, nf, ps)
    call constitutive(sim, body, n, dt, l, nf, ps, report)
  end subroutine strain_block

  !> USAVG: new particle velocities from `moved`, mapped again to `again`; places are kept.
  subroutine accelerate_and_map_again(sim, moved, again)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: moved(8, sim%patch%nn, sim%n_groups)
    real(rp), intent(inout) :: again(8, sim%patch%nn, sim%n_groups)
    integer :: b

    do b = 1, sim%particles%nblk
      call accelerate_block(sim, sim%particles%body(b), sim%particles%count(b), &
                            moved(:, :, group_of(sim, b)), sim%particles%nf, &
                            sim%particles%ps(:, :, b), sim%rec)
    end do
    call momentum_to_grid(sim, again)
  end subroutine accelerate_and_map_again

  subroutine accelerate_block(sim, body, n, moved, nf, ps, rec)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: moved(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9), fastest

    if (sim%scene%body(body)%tool > 0) return
    fastest = 0.0_rp
    call weights_of(sim, body, nf, ps, w, first)
    call gather_velocity(n, w, first, sim%patch%stride, sim%patch%nn, moved, rec, v, dv, l)
    call carry(sim, n, nf, ps, w, first, moved, rec)
    call advance_particles(n, 0.0_rp, sim%pic, v, dv, ps(1, f_pos), ps(1, f_vel), fastest)
  end subroutine accelerate_block

  !> Group of the bodies that block `b` shares its velocity field with.
  pure integer function group_of(sim, b)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b

    group_of = sim%scene%body(sim%particles%body(b))%group
  end function group_of

end module time_sweeps
