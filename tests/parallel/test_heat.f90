! SPDX-License-Identifier: MIT
!> Conduction: heat is conserved, decays at the exact rate, and what films lose is booked.
program test_heat
  use base_kinds, only: pi, rp
  use base_world, only: start_world
  use check, only: begin_tests, end_tests, expect, expect_close
  use heat_conduction, only: conduction_step
  use heat_samples, only: build, conduct_for, content, h, noise, world
  use particles_store, only: f_heat, f_pos, f_temp, tag_id
  use run_regrid, only: regrid
  use state_budget, only: e_conduction, e_film
  use state_parts, only: free_simulation, simulation_t
  implicit none (type, external)

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_insulated()
  call test_waiting_heat()
  call test_decay()
  call test_adaptive()
  call test_film()
  call test_film_size()
  call end_tests()

contains

  !> Random temperatures, 200 steps.
  subroutine test_insulated()
    type(simulation_t) :: sim
    real(rp) :: before, dt
    integer :: b, p, step

    call build(sim, [8, 5, 6], [0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp])
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        sim%particles%ps(p, f_temp, b) = 300.0_rp + 700.0_rp*noise(tag_id(sim%particles%tag(p, b)))
      end do
    end do
    dt = conduction_step(sim%scene, sim%clock)
    call expect_close('conduction step', dt, 0.15_rp*h*h*8960.0_rp*386.0_rp/391.0_rp)
    before = content(sim)
    do step = 1, 200
      call conduct_for(sim, dt)
      if (mod(step, 50) == 0) call regrid(sim)
    end do
    call expect_close('an insulated block keeps its heat', content(sim), before, rtol=1.0e-12_rp)
    call expect('no film, no loss', sim%budget%sums(e_film) == 0.0_rp)
    call free_simulation(sim)
  end subroutine test_insulated

  !> Heat that waits at particles is taken up once.
  subroutine test_waiting_heat()
    type(simulation_t) :: sim
    real(rp) :: given(1)
    integer :: b, p, step
    logical :: spent

    call build(sim, [6, 4, 4], [0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp])
    given = 0.0_rp
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        if (noise(tag_id(sim%particles%tag(p, b))) > 0.1_rp) cycle
        sim%particles%ps(p, f_heat, b) = 1.0e-2_rp
        given = given + 1.0e-2_rp
      end do
    end do
    call world%sum(given)
    do step = 1, 5
      call conduct_for(sim, conduction_step(sim%scene, sim%clock))
    end do
    spent = .true.
    do b = 1, sim%particles%nblk
      spent = spent .and. all(sim%particles%ps(:, f_heat, b) == 0.0_rp)
    end do
    call expect('waiting heat is spent', spent)
    call expect_close('waiting heat is taken up once', content(sim), given(1), rtol=1.0e-10_rp)
    call free_simulation(sim)
  end subroutine test_waiting_heat

  !> Implicit steps that follow their error: the half wave of `test_decay` over two time constants,
  !> more steps and less error with a smaller tolerance, longer steps when little is left;
  !> conduction makes no heat.
  subroutine test_adaptive()
    real(rp) :: error(2)
    integer :: steps(2)

    call decay_by_tolerance(1.0_rp, steps(1), error(1))
    call decay_by_tolerance(0.01_rp, steps(2), error(2))
    if (world%is_root()) print *, 'adaptive: steps, errors', steps, error
    call expect('a smaller tolerance takes more steps', steps(2) > 3*steps(1))
    call expect('and is nearer', error(2) < 0.5_rp*error(1))
    call expect('the sum of the errors of all steps bounds that at the end', &
                all(error <= steps*[1.0_rp, 0.01_rp]))
  end subroutine test_adaptive

  subroutine decay_by_tolerance(tolerance, steps, error)
    real(rp), intent(in) :: tolerance               !! [K]
    integer, intent(out) :: steps
    real(rp), intent(out) :: error                  !! of the amplitude [K]
    type(simulation_t) :: sim
    real(rp), parameter :: length = 16.0_rp*h, kappa = 391.0_rp/(8960.0_rp*386.0_rp)
    real(rp), parameter :: end = 2.0_rp/(kappa*(pi/length)**2)
    real(rp) :: before, dt, shortest, t, made(1)
    integer :: b, p

    call build(sim, [16, 4, 4], [0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp])
    sim%scene%method%implicit_heat = .true.
    sim%scene%method%heat_tolerance = tolerance
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        sim%particles%ps(p, f_temp, b) = 300.0_rp &
                                         + 100.0_rp*cos(pi*sim%particles%ps(p, f_pos, b)/length)
      end do
    end do
    before = content(sim, length)
    t = 0.0_rp
    steps = 0
    shortest = end
    do while (t < end*(1.0_rp - 1.0e-9_rp))
      dt = min(conduction_step(sim%scene, sim%clock), end - t)
      call conduct_for(sim, dt)
      if (t + dt < end*(1.0_rp - 1.0e-9_rp)) shortest = min(shortest, dt)
      t = t + dt
      steps = steps + 1
    end do
    error = 100.0_rp*abs(content(sim, length)/before - exp(-2.0_rp))
    made = sim%budget%sums(e_conduction)
    call world%sum(made)
    call expect('conduction makes no heat', abs(made(1)) <= 1.0e-11_rp*before)
    call expect('steps become longer', sim%clock%heat_step > 1.3_rp*shortest)
    call free_simulation(sim)
  end subroutine decay_by_tolerance

  !> A half wave over 16 cells decays by exp(-kappa (pi/L)^2 t).
  subroutine test_decay()
    type(simulation_t) :: sim
    real(rp), parameter :: length = 16.0_rp*h, kappa = 391.0_rp/(8960.0_rp*386.0_rp)
    real(rp) :: amplitude, dt, rate
    integer :: b, p, step, steps

    call build(sim, [16, 3, 3], [0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp])
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        associate (ps => sim%particles%ps(p, :, b))
          ps(f_temp) = 300.0_rp + 50.0_rp*cos(pi*ps(f_pos)/length)
        end associate
      end do
    end do
    dt = conduction_step(sim%scene, sim%clock)
    steps = ceiling(1.0_rp/(kappa*(pi/length)**2*dt))
    amplitude = content(sim, length)
    do step = 1, steps
      call conduct_for(sim, dt)
    end do
    rate = log(amplitude/content(sim, length))/(steps*dt)
    call expect_close('a cosine decays at the exact rate', rate, kappa*(pi/length)**2, rtol=0.01_rp)
    call free_simulation(sim)
  end subroutine test_decay

  !> The book of film losses is the heat that is gone.
  subroutine test_film()
    type(simulation_t) :: sim
    real(rp) :: before, lost(1)
    integer :: b, p, step

    call build(sim, [8, 5, 4], [15.0_rp, 30.0_rp, 0.0_rp, 2.0e5_rp, 700.0_rp, 15.0_rp])
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        sim%particles%ps(p, f_temp, b) = 500.0_rp + 200.0_rp*noise(tag_id(sim%particles%tag(p, b)))
      end do
    end do
    before = content(sim)
    do step = 1, 100
      call conduct_for(sim, conduction_step(sim%scene, sim%clock))
    end do
    lost = sim%budget%sums(e_film)
    call world%sum(lost)
    call expect('the films take much', lost(1) > 0.2_rp*before)
    call expect_close('film losses are booked', lost(1), before - content(sim), rtol=1.0e-10_rp)
    call free_simulation(sim)
  end subroutine test_film

  !> A thin plate cools like a lump, by exp(-h S t/(rho c V)), with S one face.
  subroutine test_film_size()
    type(simulation_t) :: sim
    real(rp), parameter :: film = 2000.0_rp
    real(rp) :: before, dt, t
    integer :: b, step

    call build(sim, [10, 6, 3], [0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, film, 0.0_rp])
    sim%scene%body(1)%film%ambient = 300.0_rp
    do b = 1, sim%particles%nblk
      sim%particles%ps(:, f_temp, b) = 400.0_rp
    end do
    before = content(sim)
    dt = conduction_step(sim%scene, sim%clock)
    t = 0.0_rp
    do step = 1, 400
      call conduct_for(sim, dt)
      t = t + dt
    end do
    call expect_close('a thin plate cools like a lump', content(sim)/before, &
                      exp(-film*t/(8960.0_rp*386.0_rp*3.0_rp*h)), rtol=0.01_rp)
    call free_simulation(sim)
  end subroutine test_film_size

end program test_heat
