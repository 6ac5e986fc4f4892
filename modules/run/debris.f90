! SPDX-License-Identifier: MIT
!> Debris, torn-off metal that leaves the grid. It is removed, and its mass and energies are
!> recorded in the budget, while it is a small fraction of the total mass (DEBRIS) and slower than
!> elastic waves. Faster particles or NaN mean that the run has become unstable.
module run_debris
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use mpm_blocks, only: kinetic_energy
  use mpm_stability, only: wave_speed
  use particles_migrate, only: is_outside
  use particles_store, only: f_bbar, f_heat, f_jac, f_mass, f_pos, f_temp, f_vel, particles_t
  use state_budget, only: d_elastic, d_heat, d_kinetic, d_mass
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: remove_debris

contains

  !> Collective. Remove the particles outside the grid and record them. If they do not qualify as
  !> debris, they stay, and `reason` is the cause. After a removal all particles must be sorted.
  logical function remove_debris(sim, reason) result(is_removed)
    type(simulation_t), intent(inout) :: sim
    character(:), allocatable, intent(out) :: reason
    real(rp) :: mass(2), share, sums(4)
    logical :: outside(nlane)
    integer :: b

    sums = 0.0_rp
    is_removed = .true.
    reason = 'its velocity is not finite or above the wave speed: the run ends'
    do b = 1, sim%particles%nblk
      outside = is_outside(sim%scene%grid, sim%particles, b)
      if (.not. any(outside)) cycle
      sums = sums + energies_of(sim%scene, sim%clock%mass_scaling, sim%particles, b, outside)
      associate (ps => sim%particles%ps(:, :, b))          ! comparisons with NaN are false
        is_removed = is_removed .and. &
                     all((norm2(ps(:, f_vel:f_vel + 2), 2) < wave_speed(sim%clock) .and. &
                          all(abs(ps(:, f_pos:f_pos + 2)) <= huge(1.0_rp), 2)) .or. .not. outside)
      end associate
    end do
    is_removed = sim%world%all_true(is_removed)
    if (.not. is_removed) return
    reason = ''
    mass = [sums(4) + sim%budget%sums(d_mass), sim%budget%sums(d_mass)]   ! removed, total [kg]
    do b = 1, sim%particles%nblk
      mass(2) = mass(2) + sum(sim%particles%ps(:sim%particles%count(b), f_mass, b))
    end do
    call sim%world%sum(mass)
    share = mass(1)/mass(2)
    is_removed = share <= sim%scene%method%debris
    if (.not. is_removed) reason = 'with it '//str(share)// &
      ' of all mass would have left, &METHOD DEBRIS allows '//str(sim%scene%method%debris)// &
      ': a restart with a larger --set METHOD.DEBRIS=... counts its mass and energy in '// &
      'the history, a larger &GRID keeps it'
    if (.not. is_removed) return
    sim%budget%sums(d_kinetic) = sim%budget%sums(d_kinetic) + sums(1)
    sim%budget%sums(d_elastic) = sim%budget%sums(d_elastic) + sums(2)
    sim%budget%sums(d_heat) = sim%budget%sums(d_heat) + sums(3)
    sim%budget%sums(d_mass) = sim%budget%sums(d_mass) + sums(4)
    do b = 1, sim%particles%nblk
      outside = is_outside(sim%scene%grid, sim%particles, b)
      if (any(outside)) call sim%particles%remove(b, outside)
    end do
    sim%particles%n_awake = -1
  end function remove_debris

  !> Kinetic energy with mass scaling, elastic energy, heat [J] and mass [kg] of the chosen
  !> particles of block `b`.
  function energies_of(scene, mass_scaling, particles, b, chosen) result(sums)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: mass_scaling
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b
    logical, intent(in) :: chosen(nlane)
    real(rp) :: mass(nlane), sums(4)

    associate (ps => particles%ps(:, :, b), &
               mat => scene%material(scene%body(particles%body(b))%material))
      mass = merge(ps(:, f_mass), 0.0_rp, chosen)
      sums = [mass_scaling*kinetic_energy(mass, ps(:, f_vel:f_vel + 2)), &
              mat%elastic_energy(particles%count(b), mass, ps(:, f_temp), ps(:, f_jac), &
                                 ps(:, f_bbar:f_bbar + 5)), &
              mat%heat_content(nlane, mass, ps(:, f_temp)) &
              + sum(merge(ps(:, f_heat), 0.0_rp, chosen)), &
              sum(mass)]
    end associate
  end function energies_of

end module run_debris
