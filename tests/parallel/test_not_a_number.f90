! SPDX-License-Identifier: MIT
!> A field of one particle of any rank that is not a finite number, asleep or awake, is found and
!> named.
program test_not_a_number
  use, intrinsic :: ieee_arithmetic, only: ieee_invalid, ieee_positive_inf, ieee_quiet_nan, &
                                           ieee_set_flag, ieee_set_halting_mode, ieee_value
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect
  use output_diagnostics, only: describe_failure, is_finite
  use particles_store, only: asleep, set_rest
  use state_parts, only: free_simulation, simulation_t
  use step_samples, only: fill, settle, start_scene
  implicit none (type, external)

  type(world_t) :: world
  type(simulation_t) :: sim
  character(:), allocatable :: message
  real(rp) :: kept
  integer :: b, f

  call start_world(world)
  call begin_tests()
  call start_scene(sim, [4, 4, 4], 3, 1)
  call fill(world, sim, 1, [0.0_rp, 0.0_rp, 0.0_rp], [4.0_rp, 4.0_rp, 4.0_rp], 2)
  call settle(world, sim)
  call expect('a sound state', is_finite(sim%particles))
  call ieee_set_halting_mode(ieee_invalid, .false.)   ! a debug build traps
  b = sim%particles%nblk
  do f = 1, sim%particles%nf
    sim%particles%tag(:, b) = set_rest(sim%particles%tag(:, b), merge(asleep, 0, mod(f, 2) == 0))
    kept = sim%particles%ps(1, f, b)
    if (world%rank == world%size - 1) then
      sim%particles%ps(1, f, b) = ieee_value(kept, ieee_quiet_nan)
      if (mod(f, 3) == 0) sim%particles%ps(1, f, b) = ieee_value(kept, ieee_positive_inf)
    end if
    call expect('found by its rank alone', &
                is_finite(sim%particles) .neqv. world%rank == world%size - 1)
    call describe_failure(sim, message, '')
    call expect('named: '//sim%scene%layout%name_of(f), index(message, ' has a '// &
      sim%scene%layout%name_of(f)//' that is not a finite number: at (') > 0)
    sim%particles%ps(1, f, b) = kept
  end do
  call ieee_set_flag(ieee_invalid, .false.)
  associate (layout => sim%scene%layout)
    call layout%add(2, 'state of a new feature', layout%affine)
    call expect('a field has the name with which it is added', &
                layout%name_of(layout%n) == 'state of a new feature' &
                .and. layout%name_of(layout%n - 2) == 'flow stress' &
                .and. index(layout%places(), ' state of a new feature, ') > 0)
  end associate
  call free_simulation(sim)
  call end_tests()
end program test_not_a_number
