! SPDX-License-Identifier: MIT
!> What leaves the grid is debris if it is little, slow and a number; then it goes, and is booked.
program test_debris
  use, intrinsic :: ieee_arithmetic, only: ieee_invalid, ieee_quiet_nan, ieee_set_flag, &
                                           ieee_set_halting_mode, ieee_value
  use base_kinds, only: nlane, rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use mpm_stability, only: wave_speed
  use particles_store, only: f_mass, f_pos, f_temp, f_vel
  use run_debris, only: remove_debris
  use run_regrid, only: regrid
  use state_budget, only: d_elastic, d_heat, d_kinetic, d_mass
  use state_parts, only: free_simulation, simulation_t
  use step_samples, only: c_p, fill, h, settle, start_scene
  implicit none (type, external)

  integer, parameter :: n_all = 512
  type(world_t) :: world
  character(:), allocatable :: reason

  call start_world(world)
  call begin_tests()
  call test_gone()
  call expect('more than is allowed stays', .not. goes(0.5_rp/n_all, 1.0e6_rp*h, 0.1_rp))
  call expect('it says how to let it go', index(reason, 'METHOD.DEBRIS') > 0)
  call expect('nothing is allowed', .not. goes(0.0_rp, 1.0e6_rp*h, 0.1_rp))
  call expect('it says so as well', index(reason, 'METHOD.DEBRIS') > 0)
  call expect('what is faster than waves stays', .not. goes(0.1_rp, 1.0e6_rp*h, 1.1_rp))
  call expect('no option helps it', index(reason, 'the run ends') > 0)
  call test_no_number()
  call end_tests()

contains

  !> A block of which the first particle of rank 0 is put to `place` along x [m] with a velocity of
  !> `speed` times that of waves.
  subroutine prepare(sim, allowed, place, speed)
    type(simulation_t), intent(out) :: sim
    real(rp), intent(in) :: allowed, place, speed

    call start_scene(sim, [4, 4, 4], 3, 1)
    call fill(world, sim, 1, [0.0_rp, 0.0_rp, 0.0_rp], [4.0_rp, 4.0_rp, 4.0_rp], 2)
    sim%scene%method%debris = allowed
    sim%clock%mass_scaling = 100.0_rp
    call settle(world, sim)
    if (world%rank > 0) return
    sim%particles%ps(1, f_pos, 1) = place
    sim%particles%ps(1, f_vel, 1) = speed*wave_speed(sim%clock)
  end subroutine prepare

  logical function goes(allowed, place, speed)
    real(rp), intent(in) :: allowed, place, speed
    type(simulation_t) :: sim

    call prepare(sim, allowed, place, speed)
    goes = remove_debris(sim, reason)
    call expect('only the debris is removed', particles_of(sim) == merge(n_all - 1, n_all, goes))
    call free_simulation(sim)
  end function goes

  !> A run that breaks down has particles that are no numbers.
  subroutine test_no_number()
    logical :: is_placed, is_moving
    real(rp) :: nan

    call ieee_set_halting_mode(ieee_invalid, .false.)   ! a debug build traps
    nan = ieee_value(1.0_rp, ieee_quiet_nan)
    is_placed = .not. goes(0.1_rp, nan, 0.1_rp)
    is_moving = .not. goes(0.1_rp, 1.0e6_rp*h, nan)
    call ieee_set_flag(ieee_invalid, .false.)
    call expect('no place is no debris', is_placed)
    call expect('no speed is no debris', is_moving)
  end subroutine test_no_number

  !> Particles of all ranks.
  integer function particles_of(sim)
    type(simulation_t), intent(in) :: sim
    integer :: n(1)

    n = sim%particles%total()
    call world%sum(n)
    particles_of = n(1)
  end function particles_of

  !> One particle goes, with its mass, its kinetic energy with mass scaling and its heat; the others
  !> stay as they were, and can be sorted.
  subroutine test_gone()
    type(simulation_t) :: sim
    real(rp) :: gone(4), temperature, mass
    logical :: is_removed

    call prepare(sim, 2.0_rp/n_all, -1.0e6_rp*h, 0.1_rp)
    mass = sim%particles%ps(1, f_mass, 1)
    temperature = sim%particles%ps(1, f_temp, 1)
    is_removed = remove_debris(sim, reason)
    call expect('debris goes', is_removed)
    gone = sim%budget%sums([d_mass, d_kinetic, d_elastic, d_heat])
    call world%sum(gone)
    call expect_close('its mass', gone(1), mass)
    call expect_close('its kinetic energy', gone(2), &
                      0.5_rp*100.0_rp*mass*(0.1_rp*wave_speed(sim%clock))**2, rtol=1.0e-12_rp)
    call expect_close('no elastic energy', gone(3), 0.0_rp, atol=1.0e-12_rp*gone(2))
    call expect_close('its heat', gone(4), mass*c_p*temperature, rtol=1.0e-12_rp)
    call regrid(sim)
    call expect('the others stay', particles_of(sim) == n_all - 1)
    call expect('on the grid', &
                all(abs(sim%particles%ps(:nlane, f_pos, :sim%particles%nblk)) < 1.0_rp))
    call free_simulation(sim)
  end subroutine test_gone

end program test_debris
