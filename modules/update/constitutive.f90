! SPDX-License-Identifier: MIT
!> What a step does with one block of particles once its velocity gradient is known: mean volume,
!> outer work, stress.
module update_constitutive
  use base_kinds, only: nlane, rp
  use mapping_blocks, only: body_work
  use mapping_fbar, only: take_volume
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_bbar, f_flow, f_jac, f_mass, f_plastic, f_pos, f_rate, f_tau, f_temp
  use physics_flow_law, only: most_warnings
  use physics_stress, only: stress_block, stress_sums_t
  use state_books, only: books_t, e_body, e_plastic, e_stress
  use state_clock, only: clock_t
  use state_scene, only: average_never, scene_t
  use state_step, only: step_t, outcome_t
  implicit none (type, external)
  private

  public :: restore_volume, outer_acceleration, outer_work, constitutive

contains

  !> F-bar. Volume ratios nearer to the mean of each particle's cell, and the stress of it, with
  !> which the work of the coming strain begins; the energy it takes is booked.
  subroutine restore_volume(scene, clock, nodes, books, body, n, w, first, nf, ps)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(books_t), intent(inout) :: books
    integer, intent(in) :: body, n, first(nlane), nf
    real(rp), intent(in) :: w(nlane, 18)             !! weights
    real(rp), intent(inout) :: ps(nlane, nf)
    real(rp) :: before(nlane), energy

    if (scene%body(body)%averaging == average_never) return
    before = ps(:, f_jac)
    associate (material => scene%material(scene%body(body)%material))
      call take_volume(scene%body(body)%averaging, material%k, clock%dt, body, n, w, first, &
                       nodes%patch%stride, size(nodes%volume, 1), nodes%patch%nn, nodes%volume, &
                       nf, ps)
      call material%change_volume(n, ps(1, f_mass), ps(1, f_temp), ps(1, f_bbar), before, &
                                  ps(1, f_jac), ps(1, f_tau), energy)
    end associate
    books%sums(e_stress) = books%sums(e_stress) + energy
  end subroutine restore_volume

  !> Acceleration of a body in this step: gravity and its loads; none of a rigid body.
  pure function outer_acceleration(scene, step, body) result(a)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    integer, intent(in) :: body
    real(rp) :: a(3), ramped
    integer :: i

    a = 0.0_rp
    if (scene%body(body)%is_rigid()) return
    a = scene%method%gravity
    do i = 1, size(scene%body(body)%load)
      associate (load => scene%body(body)%load(i))
        ramped = 1.0_rp
        if (step%force_time < load%ramp) ramped = step%force_time/load%ramp
        a = a + ramped*load%acceleration
      end associate
    end do
  end function outer_acceleration

  subroutine outer_work(scene, step, books, body, n, dt, v, dv, mass)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(books_t), intent(inout) :: books
    integer, intent(in) :: body, n
    real(rp), intent(in) :: dt, v(nlane, 3), dv(nlane, 3), mass(nlane)
    real(rp) :: a(3)

    a = outer_acceleration(scene, step, body)
    if (all(abs(a) <= 0.0_rp)) return
    books%sums(e_body) = books%sums(e_body) + body_work(n, dt, a, mass, v, dv)
  end subroutine outer_work

  !> Stress after `dt`. The law reads the particle's own temperature: that of the nodes, a mean over
  !> neighbours of other strain, was off by 8 % of the rise at single particles of a squeezed cube.
  subroutine constitutive(scene, clock, books, body, n, dt, l, nf, ps, report)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(books_t), intent(inout) :: books
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: dt, l(nlane, 9)
    real(rp), intent(inout) :: ps(nlane, nf)
    type(outcome_t), intent(inout) :: report
    type(stress_sums_t) :: sums
    real(rp) :: temp(nlane)

    temp = ps(:, f_temp)
    call stress_block(scene%material(scene%body(body)%material), n, dt, l, temp, &
                      ps(1, f_mass), ps(1, f_bbar), ps(1, f_jac), ps(1, f_plastic), ps(1, f_temp), &
                      ps(1, f_tau), ps(1, f_rate), ps(1, f_flow), scene%layout%n_law, &
                      ps(1, scene%layout%law), sums)
    books%sums(e_plastic) = books%sums(e_plastic) + sums%plastic_work
    books%sums(e_stress) = books%sums(e_stress) + sums%stress_work
    books%failed_returns = books%failed_returns + sums%failed
    report%stiffness = max(report%stiffness, sums%stiffness)
    if (any(sums%warnings > 0)) call count_warnings(scene, clock, books, body, sums, nf, ps)
  end subroutine constitutive

  !> Count what left the validity of a flow law, and keep where that was first.
  subroutine count_warnings(scene, clock, books, body, sums, nf, ps)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(books_t), intent(inout) :: books
    integer, intent(in) :: body, nf
    type(stress_sums_t), intent(in) :: sums
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: k, place

    do k = 1, most_warnings
      if (sums%warnings(k) == 0) cycle
      place = scene%material(scene%body(body)%material)%warning(k)
      if (books%warnings(place) <= 0.0_rp) books%warning_place(:, place) = &
        [clock%time, ps(sums%lane(k), f_temp), ps(sums%lane(k), f_pos:f_pos + 2)]
      books%warnings(place) = books%warnings(place) + sums%warnings(k)
    end do
  end subroutine count_warnings

end module update_constitutive
