! SPDX-License-Identifier: MIT
!> The sweeps over all blocks of particles that a time step is made of.
!> Each sweep hands one block at a time, as an explicit-shape array, to a procedure of its own.
module time_sweeps
  use base_kinds, only: nlane, rp
  use base_system, only: prefetch_block
  use contact_tool, only: contact_block, measure_gaps, slip_rate, tool_is_near
  use particles_store, only: f_bbar, f_flow, f_force, f_heat, f_jac, f_mass, f_plastic, f_pos, &
                             f_rate, f_tau, f_temp, f_vel
  use physics_stress, only: flow_strength, stress_block, stress_sums_t
  use time_audit, only: e_body, e_plastic, e_stress
  use time_blocks, only: advance_particles, body_work, force_records, momentum_records, &
                         unpack_velocity
  use time_state, only: scheme_usavg, simulation_t
  use time_volume, only: add_volume, clear_volume, take_volume
  use time_weights, only: weights_of
  use transfer_kernels, only: g2p_block, p2g_block
  implicit none (type, external)
  private

  public :: momentum_and_force_to_grid, momentum_to_grid, grid_to_particles
  public :: update_stress, accelerate_and_map_again, report_t

  !> What a step tells the driver: maxima over this rank's particles.
  type :: report_t
    real(rp) :: stiffness = 0.0_rp    !! squared wave speed [m2/s2]
    real(rp) :: speed2 = 0.0_rp       !! squared grid velocity at a particle [m2/s2]
  end type report_t

contains

  !> Particles to grid: mass, momentum, force, temperature.
  subroutine momentum_and_force_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    integer :: b

    call clear_volume(sim)
    do b = 1, sim%particles%nblk
      call fetch_next(sim, b)
      call force_to_grid(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                         sim%particles%ps(:, :, b), sim%rec, g)
    end do
  end subroutine momentum_and_force_to_grid

  subroutine force_to_grid(sim, body, n, nf, ps, rec, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    call force_records(sim%scene%method%mass_scaling, &
                       1.0_rp/sim%scene%material(sim%scene%body(body)%material)%rho, &
                       outer_acceleration(sim, body), ps(1, f_mass), ps(1, f_vel), ps(1, f_tau), &
                       ps(1, f_force), ps(1, f_temp), rec)
    if (sim%scene%method%fbar) call add_volume(n, first, sim%patch%stride, ps(1, f_mass), &
      ps(1, f_jac), body, size(sim%volume, 1), sim%patch%nn, sim%volume)
    call p2g_block(n, w, first, rec, sim%patch%stride, sim%patch%nn, g)
  end subroutine force_to_grid

  !> Particles to grid: mass, momentum, temperature.
  subroutine momentum_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    integer :: b

    call clear_volume(sim)
    do b = 1, sim%particles%nblk
      call map_momentum(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                        sim%particles%ps(:, :, b), sim%rec, g)
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
    call p2g_block(n, w, first, rec, sim%patch%stride, sim%patch%nn, g)
  end subroutine map_momentum

  !> Grid to particles: move them with `moved`, then contact, then stress over `dt_stress` with the
  !> gradient of `field` (the same grid in USL).
  subroutine grid_to_particles(sim, dt, moved, field, dt_stress, report)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: moved(8, sim%patch%nn), field(8, sim%patch%nn)
    type(report_t), intent(inout) :: report
    integer :: b

    do b = 1, sim%particles%nblk
      call fetch_next(sim, b)
      call advance_block(sim, b, sim%particles%count(b), dt, moved, field, dt_stress, &
                         sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, report)
    end do
  end subroutine grid_to_particles

  subroutine advance_block(sim, b, n, dt, moved, field, dt_stress, nf, ps, rec, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b, n, nf
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in) :: moved(8, sim%patch%nn), field(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(report_t), intent(inout) :: report
    integer :: first(nlane)
    real(rp), dimension(nlane, 3) :: v, dv, v2, dv2
    real(rp) :: w(nlane, 18), l(nlane, 9), temp(nlane)

    call weights_of(sim, sim%particles%body(b), nf, ps, w, first)
    call g2p_block(n, w, first, sim%patch%stride, sim%patch%nn, moved, rec)
    call unpack_velocity(n, rec, v, dv, l, temp)
    if (sim%scene%method%scheme == scheme_usavg) then   ! velocities are new already: move only
      dv2 = 0.0_rp
      call advance_particles(n, dt, 0.0_rp, v, dv2, ps(1, f_pos), ps(1, f_vel), report%speed2)
      call g2p_block(n, w, first, sim%patch%stride, sim%patch%nn, field, rec)
      call unpack_velocity(n, rec, v2, dv2, l, temp)
    else
      call advance_particles(n, dt, sim%scene%method%pic, v, dv, ps(1, f_pos), ps(1, f_vel), &
                             report%speed2)
    end if
    call restore_volume(sim, sim%particles%body(b), n, first, ps(1, f_mass), ps(1, f_jac))
    call outer_work(sim, sim%particles%body(b), n, dt, v, dv, ps(1, f_mass))
    call touch(sim, b, n, dt, v, dv, nf, ps)
    call constitutive(sim, sim%particles%body(b), n, dt_stress, l, temp, nf, ps, report)
  end subroutine advance_block

  !> Half a step of stress from the velocity field `g`, at unchanged places.
  subroutine update_stress(sim, dt, g, report)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g(8, sim%patch%nn)
    type(report_t), intent(inout) :: report
    integer :: b

    do b = 1, sim%particles%nblk
      call strain_block(sim, sim%particles%body(b), sim%particles%count(b), dt, g, &
                        sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, report)
    end do
  end subroutine update_stress

  subroutine strain_block(sim, body, n, dt, g, nf, ps, rec, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    type(report_t), intent(inout) :: report
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9), temp(nlane)

    call weights_of(sim, body, nf, ps, w, first)
    call g2p_block(n, w, first, sim%patch%stride, sim%patch%nn, g, rec)
    call unpack_velocity(n, rec, v, dv, l, temp)
    call restore_volume(sim, body, n, first, ps(1, f_mass), ps(1, f_jac))
    call constitutive(sim, body, n, dt, l, temp, nf, ps, report)
  end subroutine strain_block

  !> USAVG: new particle velocities from `moved`, mapped again to `again`; places are kept.
  subroutine accelerate_and_map_again(sim, moved, again)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: moved(8, sim%patch%nn)
    real(rp), intent(inout) :: again(8, sim%patch%nn)
    integer :: b

    do b = 1, sim%particles%nblk
      call accelerate_block(sim, sim%particles%body(b), sim%particles%count(b), moved, &
                            sim%particles%nf, sim%particles%ps(:, :, b), sim%rec)
    end do
    call momentum_to_grid(sim, again)
  end subroutine accelerate_and_map_again

  subroutine accelerate_block(sim, body, n, moved, nf, ps, rec)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: moved(8, sim%patch%nn)
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), v(nlane, 3), dv(nlane, 3), l(nlane, 9), temp(nlane), fastest

    fastest = 0.0_rp
    call weights_of(sim, body, nf, ps, w, first)
    call g2p_block(n, w, first, sim%patch%stride, sim%patch%nn, moved, rec)
    call unpack_velocity(n, rec, v, dv, l, temp)
    call advance_particles(n, 0.0_rp, sim%scene%method%pic, v, dv, ps(1, f_pos), ps(1, f_vel), &
                           fastest)
  end subroutine accelerate_block

  !> F-bar: the mean volume ratio around each particle's node; the energy it takes is booked.
  subroutine restore_volume(sim, body, n, first, mass, jac)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, first(nlane)
    real(rp), intent(in) :: mass(nlane)
    real(rp), intent(inout) :: jac(nlane)
    real(rp) :: energy

    if (.not. sim%scene%method%fbar) return
    associate (material => sim%scene%material(sim%scene%body(body)%material))
      call take_volume(n, first, sim%patch%stride, body, size(sim%volume, 1), sim%patch%nn, &
                       sim%volume, material%k, material%rho, mass, jac, energy)
    end associate
    sim%sums(e_stress) = sim%sums(e_stress) + energy
  end subroutine restore_volume

  !> Have the next block's memory on its way.
  subroutine fetch_next(sim, b)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b

    if (b < sim%particles%nblk) then
      call prefetch_block(sim%particles%ps(:, :, b + 1), 8*nlane*sim%particles%nf)
    end if
  end subroutine fetch_next

  !> Acceleration of a body now: gravity and its loads.
  pure function outer_acceleration(sim, body) result(a)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body
    real(rp) :: a(3), share
    integer :: i

    a = sim%scene%method%gravity
    do i = 1, size(sim%scene%body(body)%load)
      associate (load => sim%scene%body(body)%load(i))
        share = 1.0_rp
        if (sim%clock%time < load%ramp) share = sim%clock%time/load%ramp
        a = a + share*load%acceleration
      end associate
    end do
  end function outer_acceleration

  subroutine outer_work(sim, body, n, dt, v, dv, mass)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n
    real(rp), intent(in) :: dt, v(nlane, 3), dv(nlane, 3), mass(nlane)
    real(rp) :: a(3)

    a = outer_acceleration(sim, body)
    if (all(abs(a) <= 0.0_rp)) return
    sim%sums(e_body) = sim%sums(e_body) + body_work(n, dt, a, mass, v, dv)
  end subroutine outer_work

  !> Contact with the tools, only for blocks near one.
  subroutine touch(sim, b, n, dt, v, dv, nf, ps)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b, n, nf
    real(rp), intent(in) :: dt, v(nlane, 3), dv(nlane, 3)
    real(rp), intent(inout) :: ps(nlane, nf)
    real(rp) :: d(nlane), normal(nlane, 3), rate(nlane), strength(nlane)
    integer :: touched(nlane)

    if (size(sim%tool) == 0) return
    if (.not. tool_is_near(sim%tool, sim%ball(1:3, b), sim%ball(4, b))) return
    call measure_gaps(sim%tool, n, sim%scene%grid%h, ps(1, f_pos), touched, d, normal)
    if (minval(d(1:n)) > sim%scene%grid%h) return      ! nothing can touch within a step
    associate (body => sim%scene%body(sim%particles%body(b)))
      call slip_rate(sim%tool, n, body%mean_spacing(), touched, ps(1, f_pos), v, rate)
      call flow_strength(sim%scene%material(body%material), ps(1, f_plastic), ps(1, f_temp), rate, &
                         strength)
    end associate
    call contact_block(sim%tool, n, dt, sim%scene%method%mass_scaling, &
                       sim%scene%body(sim%particles%body(b))%spacing, touched, d, normal, ps(1, f_pos), v, dv, ps(1, f_mass), strength, &
                       ps(1, f_force), ps(1, f_heat))
  end subroutine touch

  subroutine constitutive(sim, body, n, dt, l, temp, nf, ps, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, l(nlane, 9), temp(nlane)
    real(rp), intent(inout) :: ps(nlane, nf)
    type(report_t), intent(inout) :: report
    type(stress_sums_t) :: sums

    call stress_block(sim%scene%material(sim%scene%body(body)%material), n, dt, l, temp, &
                      ps(1, f_mass), ps(1, f_bbar), ps(1, f_jac), ps(1, f_plastic), ps(1, f_temp), &
                      ps(1, f_tau), ps(1, f_rate), ps(1, f_flow), sums)
    sim%sums(e_plastic) = sim%sums(e_plastic) + sums%plastic_work
    sim%sums(e_stress) = sim%sums(e_stress) + sums%stress_work
    sim%failed_returns = sim%failed_returns + sums%failed
    report%stiffness = max(report%stiffness, sums%stiffness)
  end subroutine constitutive

end module time_sweeps
