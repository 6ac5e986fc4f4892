! SPDX-License-Identifier: MIT
!> Adaptive mass scaling: at sorts the factor chi is set such that the inertial stress chi rho v^2
!> stays a given fraction of the flow stress, and the inertial part of the loads of the tools
!> (state_inertia) a fraction as large. Between sorts, during which a tool may turn by a
!> revolution, the factor falls where the inertial stress rises. Velocities are kept; the change of
!> kinetic energy is recorded.
module run_mass_scaling
  use base_kinds, only: i8, nlane, rp
  use mpm_blocks, only: kinetic_energy
  use output_totals, only: energies, energies_t, inertial_stress_ratio
  use particles_store, only: f_flow, f_mass, f_vel
  use state_budget, only: e_scaling
  use state_parts, only: simulation_t
  use step_grid_motion, only: find_motion
  use tools_sums, only: s_force, s_work
  implicit none (type, external)
  private

  public :: adapt_mass, limit_mass

  !> Decay of the recorded largest ratio from sort to sort.
  real(rp), parameter :: peak_decay = 0.95_rp
  !> Largest growth of the factor at a sort, and smallest that is worth it.
  real(rp), parameter :: max_growth = 1.25_rp
  real(rp), parameter :: min_remaining = 0.1_rp    !! smallest fraction of the factor kept at a sort
  !> Target over the allowed ratio, which rises by up to a quarter before the next sort (measured in
  !> welds and in a stirred plate).
  real(rp), parameter :: target_fraction = 0.75_rp
  integer(i8), parameter :: interval = 10   !! steps between two looks at the inertial stress

contains

  !> Collective, at a sort, after the nodes in use have been listed: adapt the mass scaling.
  subroutine adapt_mass(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: part, wanted

    if (.not. sim%scene%method%adapts_mass) return
    part = inertial_part(sim)
    if (sim%clock%step == 0) return
    associate (m => sim%scene%method, peak => sim%clock%inertial_peak)
      peak = max(largest_ratio(sim), peak_decay*peak)
      if (max(peak, part) <= 0.0_rp) return    ! nothing has moved so far
      wanted = target_fraction*m%inertial_fraction/max(peak, part)
      wanted = max(m%scaling_range(1), min(m%scaling_range(2), wanted))
      if (wanted >= max_growth*sim%clock%mass_scaling .or. wanted >= m%scaling_range(2)) then
        wanted = min(wanted, max_growth*sim%clock%mass_scaling)
      else if (wanted < sim%clock%mass_scaling) then
        wanted = max(wanted, min_remaining*sim%clock%mass_scaling)
      else
        return
      end if
      call set_factor(sim, wanted)
    end associate
  end subroutine adapt_mass

  !> Collective, between two steps: every so many, reduce the mass scaling where the inertial stress
  !> has risen since the last sort.
  subroutine limit_mass(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: wanted

    if (.not. sim%scene%method%adapts_mass) return
    if (modulo(sim%clock%step, interval) /= 0_i8) return
    associate (m => sim%scene%method, peak => sim%clock%inertial_peak)
      peak = max(largest_ratio(sim), peak)
      if (peak <= 0.0_rp) return
      wanted = max(m%scaling_range(1), target_fraction*m%inertial_fraction/peak, &
                   min_remaining*sim%clock%mass_scaling)
      if (wanted < sim%clock%mass_scaling) call set_factor(sim, wanted)
    end associate
  end subroutine limit_mass

  !> Collective. Inertial part of the loads of the tools since the last sort, without mass scaling.
  real(rp) function inertial_part(sim) result(part)
    type(simulation_t), intent(inout) :: sim
    type(energies_t) :: now
    real(rp) :: all(5 + 3*size(sim%tool))
    integer :: k

    now = energies(sim%scene, sim%clock, sim%particles, sim%nodes)
    all = [now%motion, sum(sim%tool%sums(s_work)), &
           (sim%tool(k)%sums(s_force:s_force + 2), k=1, size(sim%tool))]
    call sim%world%sum(all)
    associate (inertia => sim%history%sort_inertia)
      call inertia%advance(1.0_rp, [sim%clock%time, all(:5)], &
                           reshape(all(6:), [3, size(sim%tool)]))
      part = inertia%part(inertia%of_inertia)
    end associate
  end function inertial_part

  !> Collective. Largest rho v^2 over flow stress of the particles, whether they flow or not [-].
  real(rp) function largest_ratio(sim) result(ratio)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: all(1)
    integer :: b

    call find_motion(sim)
    all = 0.0_rp
    do b = 1, sim%particles%nblk
      associate (ps => sim%particles%ps(:, :, b), body => sim%scene%body(sim%particles%body(b)))
        if (body%is_rigid()) cycle
        all = max(all, inertial_stress_ratio(sim%particles%count(b), &
                                             sim%scene%material(body%material), 1.0_rp, &
                                             sim%particles%velocity(b), ps(:, f_flow), &
                                             spread(.true., 1, nlane)))
      end associate
    end do
    if (allocated(sim%particles%motion)) deallocate (sim%particles%motion)
    call sim%world%max(all)
    ratio = all(1)
  end function largest_ratio

  !> Set the factor and record the change of kinetic energy.
  subroutine set_factor(sim, factor)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: factor
    real(rp) :: energy
    integer :: b

    energy = 0.0_rp
    do b = 1, sim%particles%nblk
      if (sim%scene%body(sim%particles%body(b))%is_rigid()) cycle
      energy = energy + kinetic_energy(sim%particles%ps(:, f_mass, b), &
                                       sim%particles%ps(:, f_vel:f_vel + 2, b))
    end do
    sim%budget%sums(e_scaling) = sim%budget%sums(e_scaling) + (factor - sim%clock%mass_scaling) &
      *energy
    sim%clock%mass_scaling = factor
    sim%sleepers%layer%is_stale = .true.   ! it has the scaled mass of the sleepers
  end subroutine set_factor

end module run_mass_scaling
