! SPDX-License-Identifier: MIT
!> Constitutive update of one block once its velocity gradient is known: volume averaging, external
!> work, stress; and static annealing, the change of internal variables with time and temperature.
module mpm_constitutive
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: body_work
  use mpm_fbar, only: relax_volume
  use mpm_stability, only: domain_factor
  use particles_block, only: block_t
  use particles_store, only: f_bbar, f_flow, f_jac, f_mass, f_plastic, f_pos, f_rate, f_tau, &
                             f_temp, particles_t
  use physics_flow_law, only: flow_law_t, max_warnings
  use physics_stress, only: advance_stress, stress_sums_t
  use state_budget, only: budget_t, e_body, e_plastic, e_stress
  use state_clock, only: clock_t, outcome_t
  use state_nodes, only: nodes_t
  use state_scene, only: average_never, scene_t
  implicit none (type, external)
  private

  public :: anneal_particles, average_volume, crush_voids, external_acceleration, &
            record_external_work, update_block_stress

contains

  !> F-bar averaging. Relax the volume ratios towards the mean of each particle's cell and update
  !> the stress from them, before the stress does the work of the next strain; record the energy of
  !> the change.
  subroutine average_volume(scene, clock, nodes, budget, block)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(inout) :: block
    real(rp) :: before(nlane), energy(nlane)

    associate (averaging => scene%body(block%body)%averaging, ps => block%ps, &
               material => scene%material(scene%body(block%body)%material))
      if (averaging == average_never) return
      before = ps(:, f_jac)
      call relax_volume(averaging, material%k, clock%dt, nodes%patch%stride, &
                        size(nodes%volume, 1), nodes%patch%nn, nodes%volume, block)
      call material%change_volume(block%n, ps(1, f_mass), ps(1, f_temp), ps(1, f_bbar), before, &
                                  ps(1, f_jac), ps(1, f_tau), energy)
    end associate
    budget%sums(e_stress) = budget%sums(e_stress) + sum(energy(:block%n))
  end subroutine average_volume

  !> Voids that the grid does not resolve. Metal around a sphere that is the part `void` of its room
  !> carries at most the pressure 2/3 Y ln(1/void) with the flow stress Y, as it then flows into the
  !> sphere (Carroll & Holt 1972, J. Appl. Phys. 43:1626). Metal of the porosity f that flows at the
  !> equivalent rate r under the pressure p is compacted at the rate 3/2 f sinh(3p/2Y) r (Gurson
  !> 1977, J. Eng. Mater. Technol. 99:2), which takes the pressure: tanh(3p/4Y) falls exponentially
  !> with the strain. The volume ratio grows to that of the pressure, whose work is plastic work.
  subroutine crush_voids(scene, budget, dt, block)
    type(scene_t), intent(in) :: scene
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt
    type(block_t), intent(inout) :: block
    real(rp) :: before(nlane), decay, energy(nlane), now, p, work(nlane)   !! work: [J]
    integer :: i

    associate (void => scene%layout%void, porosity => scene%layout%porosity, n => block%n, &
               ps => block%ps)
      if (void == 0) return
      if (all(ps(:n, void) <= 0.0_rp .and. ps(:n, porosity) <= 0.0_rp)) return
      before = ps(:, f_jac)
      work = 0.0_rp
      associate (material => scene%material(scene%body(block%body)%material))
        do i = 1, n
          p = -sum(ps(i, f_tau:f_tau + 2))/3.0_rp
          if (p <= 0.0_rp .or. ps(i, f_flow) <= 0.0_rp) cycle
          now = p
          if (ps(i, void) > 0.0_rp) now = min(now, -2.0_rp/3.0_rp*ps(i, f_flow)*log(ps(i, void)))
          if (ps(i, porosity)*ps(i, f_rate) > 0.0_rp) then
            decay = exp(-2.25_rp*ps(i, porosity)*material%k/ps(i, f_flow)*ps(i, f_rate)*dt)
            decay = min(decay, 1.0_rp - epsilon(decay))      ! atanh is infinite at 1
            now = 4.0_rp/3.0_rp*ps(i, f_flow)*atanh(decay*tanh(0.75_rp*now/ps(i, f_flow)))
          end if
          if (now >= p) cycle
          ps(i, f_jac) = before(i)*(1.0_rp + (p - now)/material%k)
          work(i) = ps(i, f_mass)/material%rho*now*(ps(i, f_jac) - before(i))
        end do
        if (all(abs(ps(:n, f_jac) - before(:n)) <= 0.0_rp)) return
        call material%change_volume(n, ps(1, f_mass), ps(1, f_temp), ps(1, f_bbar), before, &
                                    ps(1, f_jac), ps(1, f_tau), energy)
        ps(:n, f_temp) = ps(:n, f_temp) + material%temperature_rise( &
          ps(:n, f_temp), material%plastic_heat*work(:n)/(ps(:n, f_mass)*material%c_p))
      end associate
    end associate
    associate (n => block%n)
      budget%sums(e_plastic) = budget%sums(e_plastic) + sum(work(:n))
      budget%sums(e_stress) = budget%sums(e_stress) + sum(work(:n)) + sum(energy(:n))
    end associate
  end subroutine crush_voids

  !> Acceleration of a body by gravity and loads in this step [m/s2]; zero for a rigid body.
  pure function external_acceleration(scene, clock, body) result(a)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    integer, intent(in) :: body
    real(rp) :: a(3), ramped
    integer :: i

    a = 0.0_rp
    if (scene%body(body)%is_rigid()) return
    a = scene%method%gravity
    do i = 1, size(scene%body(body)%load)
      associate (load => scene%body(body)%load(i))
        ramped = 1.0_rp
        if (clock%now%force_time < load%ramp) ramped = clock%now%force_time/load%ramp
        a = a + ramped*load%acceleration
      end associate
    end do
  end function external_acceleration

  !> Record the work of gravity and loads.
  subroutine record_external_work(scene, clock, budget, block, dt, v, dv)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: dt, v(nlane, 3), dv(nlane, 3)
    real(rp) :: a(3)

    a = external_acceleration(scene, clock, block%body)
    if (all(abs(a) <= 0.0_rp)) return
    budget%sums(e_body) = budget%sums(e_body) + body_work(block%n, dt, a, block%ps(:, f_mass), &
                                                      v, dv)
  end subroutine record_external_work

  !> Update the stress over `dt`. The flow law uses the particle's own temperature: the nodal
  !> temperature, a mean over neighbours of different strain, was off by 8 % of the rise at single
  !> particles of a squeezed cube.
  subroutine update_block_stress(scene, clock, budget, block, dt, l, outcome)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(inout) :: block
    real(rp), intent(in) :: dt, l(nlane, 9)
    type(outcome_t), intent(inout) :: outcome
    type(stress_sums_t) :: sums
    real(rp) :: temp(nlane)
    real(rp), allocatable :: factor(:)   !! factors on squared wave speeds, with cpGIMP only

    associate (half => scene%layout%half, ps => block%ps, &
               material => scene%material(scene%body(block%body)%material))
      temp = ps(:, f_temp)
      if (half > 0) allocate (factor, source=domain_factor(scene%grid%h, ps(:, half:half + 2)))
      call advance_stress(material, block%n, dt, l, temp, ps(1, f_mass), ps(1, f_bbar), &
                          ps(1, f_jac), ps(1, f_plastic), ps(1, f_temp), ps(1, f_tau), &
                          ps(1, f_rate), ps(1, f_flow), scene%layout%n_law, &
                          ps(1, scene%layout%law), sums, factor)
    end associate
    budget%sums(e_plastic) = budget%sums(e_plastic) + sums%plastic_work
    budget%sums(e_stress) = budget%sums(e_stress) + sums%stress_work
    budget%failed_returns = budget%failed_returns + sums%failed
    outcome%stiffness = max(outcome%stiffness, sums%stiffness)
    if (any(sums%warnings > 0)) call count_warnings(scene, clock, budget, block, sums)
  end subroutine update_block_stress

  !> Count particles outside the validity range of a flow law, and store the first occurrence.
  subroutine count_warnings(scene, clock, budget, block, sums)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(in) :: block
    type(stress_sums_t), intent(in) :: sums
    integer :: k, place

    do k = 1, max_warnings
      if (sums%warnings(k) == 0) cycle
      place = scene%material(scene%body(block%body)%material)%warning(k)
      if (budget%warnings(place) <= 0.0_rp) then
        budget%warning_place(:, place) = [clock%time, block%ps(sums%lane(k), f_temp), &
                                          block%ps(sums%lane(k), f_pos:f_pos + 2)]
      end if
      budget%warnings(place) = budget%warnings(place) + sums%warnings(k)
    end do
  end subroutine count_warnings

  !> Apply recovery, coarsening and recrystallisation over `dt` [s] at the particles' temperatures.
  subroutine anneal_particles(scene, particles, dt)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    real(rp), intent(in) :: dt
    integer :: b

    if (.not. any(scene%material%anneals())) return
    do b = 1, particles%nblk
      associate (material => scene%material(scene%body(particles%body(b))%material))
        if (.not. allocated(material%flow)) cycle
        call anneal_one(material%flow, dt, scene%layout%law, particles%nf, particles%ps(:, :, b))
      end associate
    end do
  end subroutine anneal_particles

  subroutine anneal_one(law, dt, place, nf, ps)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: dt
    integer, intent(in) :: place, nf
    real(rp), intent(inout) :: ps(nlane, nf)

    call law%anneal(dt, ps(1, f_temp), ps(1, f_rate), ps(1, place))
  end subroutine anneal_one

end module mpm_constitutive
