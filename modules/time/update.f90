! SPDX-License-Identifier: MIT
!> What a step does with one block of particles once its velocity gradient is known: mean volume,
!> outer work, stress.
module time_update
  use base_kinds, only: nlane, rp
  use particles_store, only: f_bbar, f_flow, f_jac, f_mass, f_plastic, f_pos, f_rate, f_tau, f_temp
  use physics_flow_law, only: n_alarms
  use physics_stress, only: stress_block, stress_sums_t
  use time_audit, only: e_body, e_plastic, e_stress
  use time_blocks, only: body_work
  use time_state, only: simulation_t
  use time_volume, only: take_volume
  implicit none (type, external)
  private

  public :: report_t, restore_volume, outer_acceleration, outer_work, constitutive

  !> What a step tells the driver: maxima over this rank's particles.
  type :: report_t
    real(rp) :: stiffness = 0.0_rp    !! squared wave speed [m2/s2]
    real(rp) :: speed2 = 0.0_rp       !! squared grid velocity at a particle [m2/s2]
  end type report_t

contains

  !> F-bar: the mean volume ratio around each particle's node, and the stress of it, with which the
  !> work of the coming strain begins; the energy it takes is booked.
  subroutine restore_volume(sim, body, n, first, nf, ps)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, first(nlane), nf
    real(rp), intent(inout) :: ps(nlane, nf)
    real(rp) :: before(nlane), energy

    if (.not. sim%scene%method%fbar) return
    before = ps(:, f_jac)
    call take_volume(n, first, sim%patch%stride, body, size(sim%volume, 1), sim%patch%nn, &
                     sim%volume, ps(1, f_jac))
    associate (material => sim%scene%material(sim%scene%body(body)%material))
      call material%change_volume(n, ps(1, f_mass), ps(1, f_temp), ps(1, f_bbar), before, &
                                  ps(1, f_jac), ps(1, f_tau), energy)
    end associate
    sim%sums(e_stress) = sim%sums(e_stress) + energy
  end subroutine restore_volume

  !> Acceleration of a body in this step: gravity and its loads; none of a rigid body.
  pure function outer_acceleration(sim, body) result(a)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body
    real(rp) :: a(3), share
    integer :: i

    a = 0.0_rp
    if (sim%scene%body(body)%tool > 0) return
    a = sim%scene%method%gravity
    do i = 1, size(sim%scene%body(body)%load)
      associate (load => sim%scene%body(body)%load(i))
        share = 1.0_rp
        if (sim%force_time < load%ramp) share = sim%force_time/load%ramp
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

  !> Stress after `dt`. The law reads the particle's own temperature: that of the nodes, a mean over
  !> neighbours of other strain, was off by 8 % of the rise at single particles of a squeezed cube.
  subroutine constitutive(sim, body, n, dt, l, nf, ps, report)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, l(nlane, 9)
    real(rp), intent(inout) :: ps(nlane, nf)
    type(report_t), intent(inout) :: report
    type(stress_sums_t) :: sums
    real(rp) :: temp(nlane)

    temp = ps(:, f_temp)
    call stress_block(sim%scene%material(sim%scene%body(body)%material), n, dt, l, temp, &
                      ps(1, f_mass), ps(1, f_bbar), ps(1, f_jac), ps(1, f_plastic), ps(1, f_temp), &
                      ps(1, f_tau), ps(1, f_rate), ps(1, f_flow), sim%scene%layout%n_law, &
                      ps(1, sim%scene%layout%law), sums)
    sim%sums(e_plastic) = sim%sums(e_plastic) + sums%plastic_work
    sim%sums(e_stress) = sim%sums(e_stress) + sums%stress_work
    sim%failed_returns = sim%failed_returns + sums%failed
    report%stiffness = max(report%stiffness, sums%stiffness)
    if (any(sums%alarms > 0)) call note_alarms(sim, sums, nf, ps)
  end subroutine constitutive

  !> Count what left the validity of a flow law, and keep where that was first.
  subroutine note_alarms(sim, sums, nf, ps)
    type(simulation_t), intent(inout) :: sim
    type(stress_sums_t), intent(in) :: sums
    integer, intent(in) :: nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: k

    do k = 1, n_alarms
      if (sums%alarms(k) == 0) cycle
      if (sim%alarms(k) <= 0.0_rp) sim%alarm_place(:, k) = &
        [sim%clock%time, ps(sums%lane(k), f_temp), ps(sums%lane(k), f_pos:f_pos + 2)]
      sim%alarms(k) = sim%alarms(k) + sums%alarms(k)
    end do
  end subroutine note_alarms

end module time_update
