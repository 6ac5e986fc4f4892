! SPDX-License-Identifier: MIT
!> The two-phase law against its equations in other variables and another integrator, the return of
!> random states (how many: first argument, default 64,000), alarms, and annealing against exact
!> solutions.
program test_two_phase
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_annealing, only: arrhenius_t
  use physics_flow_law, only: max_warnings, n_work
  use physics_law_two_phase, only: n_two_phase, n_two_phase_annealing, two_phase_t
  use physics_return_map, only: default_min_rate, return_map
  implicit none (type, external)

  real(rp), parameter :: shear = 46.268656716e9_rp, burgers = 2.56e-10_rp, m = 3.06_rp
  real(rp), parameter :: beta = 0.0018_rp, k0 = 4.6_rp, size_k = 10.0_rp, gas = 8.314462618_rp
  integer, parameter :: n_outputs = 6
  type(two_phase_t) :: law

  law = two_phase_t(n_state=n_two_phase, shear=shear, burgers=burgers, walls=1.0e13_rp, &
                    interior=1.0e12_rp, size=size_k, beta=beta, k0=k0, a=3.0e4_rp, b=1.49e4_rp, &
                    calibrated=[298.0_rp, 1123.0_rp])
  law%alpha_star%fit = [600.0_rp, 885.6_rp, -0.3_rp]
  law%alpha_star%from = 298.0_rp
  law%alpha_star%to = 1100.0_rp
  law%alpha_star%below = 0.216_rp
  law%alpha_star%above = 0.002_rp

  call begin_tests()
  call random_init(.true., .false.)
  call test_alpha_star()
  call test_equations()
  call test_random_returns()
  call test_unloading()
  call test_validity_warnings()
  call test_recovery()
  call test_growth()
  call test_recrystallisation()
  call end_tests()

contains

  !> Eq. 6.14.
  elemental real(rp) function star(temp)
    real(rp), intent(in) :: temp

    if (temp < 298.0_rp) then
      star = 0.216_rp
    else if (temp <= 1100.0_rp) then
      star = 600.0_rp/(temp + 885.6_rp) - 0.3_rp
    else
      star = 0.002_rp
    end if
  end function star

  !> As printed, with its jumps; and as a table of its own points.
  subroutine test_alpha_star()
    real(rp) :: temp(nlane), value(nlane)
    type(two_phase_t) :: other
    integer :: p

    temp = [(200.0_rp + 18.0_rp*p, p=1, nlane)]
    temp(1:4) = [297.999_rp, 298.0_rp, 1100.0_rp, 1100.001_rp]
    call law%alpha_star%evaluate(temp, value)
    call expect_close('alpha* of the fit', maxval(abs(value - star(temp))), 0.0_rp, atol=1.0e-15_rp)
    other%alpha_star%t = [300.0_rp, 500.0_rp, 600.0_rp]
    other%alpha_star%value = [0.2_rp, 0.1_rp, 0.07_rp]
    temp(1:5) = [100.0_rp, 300.0_rp, 400.0_rp, 580.0_rp, 900.0_rp]
    call other%alpha_star%evaluate(temp, value)
    call expect_close('alpha* of a table', &
                      maxval(abs(value(1:5) - [0.2_rp, 0.2_rp, 0.15_rp, 0.076_rp, 0.07_rp])), &
                      0.0_rp, atol=1.0e-15_rp)
    other%alpha_star%t = [1.0_rp]
    other%alpha_star%value = [0.03_rp]
    call other%alpha_star%evaluate(temp, value)
    call expect_close('constant alpha*', maxval(abs(value - 0.03_rp)), 0.0_rp, atol=1.0e-15_rp)
  end subroutine test_alpha_star

  !> Eqs. 6.5, 6.6, 6.11 as printed, in rho_w and rho_c, at shear gamma since the beginning.
  pure function printed(rho, gamma, rate, temp) result(slope)
    real(rp), intent(in) :: rho(2), gamma, rate, temp
    real(rp) :: slope(2), f, d, k

    f = 0.06_rp + 0.19_rp*exp(-gamma/3.2_rp)
    d = size_k/sqrt(f*rho(1) + (1.0_rp - f)*rho(2))
    k = k0*(m*rate/1.0e3_rp)**(-temp/1.49e4_rp)
    slope(1) = 6.0_rp*beta*(1.0_rp - f)**(2.0_rp/3.0_rp)/(burgers*d*f) &
               + sqrt(3.0_rp)*beta*(1.0_rp - f)*sqrt(rho(1))/(f*burgers) - k*rho(1)
    slope(2) = star(temp)/sqrt(3.0_rp)*sqrt(rho(1))/burgers &
               - 6.0_rp*beta/(burgers*d*(1.0_rp - f)**(1.0_rp/3.0_rp)) - k*rho(2)
  end function printed

  !> Classical Runge-Kutta method in 1e-5 of strain.
  pure subroutine integrate(strain, rate, temp, rho)
    real(rp), intent(in) :: strain, rate, temp
    real(rp), intent(out) :: rho(2)
    real(rp) :: a(2), b(2), c(2), d(2), h, g
    integer :: i, n

    n = nint(strain/1.0e-5_rp)
    h = m*strain/n
    rho = [1.0e13_rp, 1.0e12_rp]
    do i = 1, n
      g = (i - 1)*h
      a = printed(rho, g, rate, temp)
      b = printed(rho + 0.5_rp*h*a, g + 0.5_rp*h, rate, temp)
      c = printed(rho + 0.5_rp*h*b, g + 0.5_rp*h, rate, temp)
      d = printed(rho + h*c, g + h, rate, temp)
      rho = rho + h/6.0_rp*(a + 2.0_rp*b + 2.0_rp*c + d)
    end do
  end subroutine integrate

  !> Large and small increments end where the equations do.
  subroutine test_equations()
    real(rp), parameter :: strain = 0.2_rp
    real(rp) :: temp(nlane), rate(nlane), state(nlane, n_two_phase), work(nlane, n_work)
    real(rp) :: log_rate(nlane), x(nlane), rho(2), values(nlane, n_outputs), worst, want
    integer :: i, p, steps

    do p = 1, nlane
      temp(p) = 280.0_rp + 17.0_rp*p
      rate(p) = 10.0_rp**(-4.0_rp + 0.1_rp*p)
    end do
    log_rate = log(rate)
    do steps = 1, 1001, 1000
      do p = 1, nlane
        call law%start(state(p, :))
      end do
      x = strain/steps
      do i = 1, steps
        call law%prepare(temp, state, work)
        call law%advance(work, x, log_rate, state)
      end do
      call law%describe(state, n_outputs, values)
      worst = 0.0_rp
      do p = 1, nlane, 3
        call integrate(strain, rate(p), temp(p), rho)
        want = values(p, 5)*rho(1) + (1.0_rp - values(p, 5))*rho(2)
        worst = max(worst, abs(values(p, 3)/rho(1) - 1.0_rp), abs(values(p, 4)/rho(2) - 1.0_rp), &
                    abs(values(p, 2)/want - 1.0_rp), abs(values(p, 1)*sqrt(want)/size_k - 1.0_rp))
      end do
      call expect_close('densities and grain size', worst, 0.0_rp, atol=3.0e-5_rp)
      call expect_close('fraction of the walls', values(1, 5), &
                        0.06_rp + 0.19_rp*exp(-m*strain/3.2_rp), rtol=1.0e-12_rp)
    end do
  end subroutine test_equations

  !> State after some strain at a temperature; time step and trial stress as in the test of the
  !> return of Johnson-Cook's law.
  subroutine random_state(dt, temp, guess, g3, q, state)
    real(rp), intent(out) :: dt
    real(rp), dimension(nlane), intent(out) :: temp, guess, g3, q
    real(rp), intent(out) :: state(nlane, n_two_phase)
    real(rp), dimension(nlane) :: strain, log_rate, sigma, slope, x
    real(rp) :: work(nlane, n_work), u(6)
    integer :: p

    call random_number(u(1))
    dt = 10.0_rp**(-9.0_rp + 5.0_rp*u(1))
    do p = 1, nlane
      call law%start(state(p, :))
      call random_number(u)
      temp(p) = 290.0_rp + 1066.0_rp*u(1)
      strain(p) = 0.3_rp*max(0.0_rp, u(2) - 0.05_rp)**4
      log_rate(p) = log(10.0_rp)*(-6.0_rp + 9.0_rp*u(3))
    end do
    call law%prepare(temp, state, work)
    call law%advance(work, strain, log_rate, state)
    do p = 1, nlane                                   ! up to strains of 40: between here and there
      call random_number(u(1:2))
      state(p, 1:2) = state(p, 1:2)*[30.0_rp, 30.0_rp**2]**u(1)
      state(p, 3) = 0.06_rp + (state(p, 3) - 0.06_rp)*exp(-40.0_rp*u(2))
      call random_number(u)
      temp(p) = 290.0_rp + 1066.0_rp*u(1)
      guess(p) = merge(10.0_rp**(-6.0_rp + 9.0_rp*u(3)), 0.0_rp, u(3) > 0.3_rp)
      g3(p) = 3.0_rp*shear*(1.0_rp + 0.1_rp*u(4))
      x(p) = dt*10.0_rp**(-5.99_rp + 8.99_rp*u(5))
      if (mod(p, 3) > 0) x(p) = dt*default_min_rate
    end do
    log_rate = log(x/dt)
    call law%prepare(temp, state, work)
    call law%stress(work, strain, x, log_rate, sigma, slope)
    do p = 1, nlane
      call random_number(u(1))
      q(p) = g3(p)*x(p) + sigma(p)
      if (mod(p, 3) == 1) q(p) = sigma(p)*(1.0_rp + 10.0_rp**(-5.0_rp + 7.0_rp*u(1))) + g3(p)*x(p)
      if (mod(p, 3) == 2) q(p) = 0.999_rp*u(1)*sigma(p)
    end do
  end subroutine random_state

  subroutine test_random_returns()
    real(rp), dimension(nlane) :: temp, alpha, guess, g3, q, x, sigma, want, slope, log_rate
    real(rp), dimension(nlane, n_two_phase) :: state, before, again
    real(rp) :: dt, work(nlane, n_work), worst_residual, worst_state, worst_sigma, worst_long
    integer :: batch, batches, failed, p, n_plastic, n_wrong_side
    character(16) :: argument
    logical :: any_plastic

    call get_command_argument(1, argument)
    batches = 1000
    if (argument /= '') read (argument, *) batches
    if (argument /= '') batches = (batches + nlane - 1)/nlane
    alpha = 0.0_rp
    failed = 0
    n_wrong_side = 0
    n_plastic = 0
    worst_residual = 0.0_rp
    worst_sigma = 0.0_rp
    worst_long = 0.0_rp
    worst_state = 0.0_rp
    do batch = 1, batches
      call random_state(dt, temp, guess, g3, q, state)
      before = state
      call return_map(law, nlane, dt, temp, alpha, guess, q, g3, state, x, sigma, any_plastic, &
                      failed)
      call law%prepare(temp, before, work)
      log_rate = log(max(x/dt, default_min_rate))
      call law%stress(work, alpha, x, log_rate, want, slope)
      again = before
      call law%advance(work, x, log_rate, again)
      do p = 1, nlane
        if (mod(p, 3) == 2) then
          if (x(p) > 0.0_rp .or. any(abs(state(p, :) - before(p, :)) > 0.0_rp)) then
            n_wrong_side = n_wrong_side + 1
          end if
          cycle
        end if
        n_plastic = n_plastic + 1
        if (.not. x(p) > 0.0_rp) n_wrong_side = n_wrong_side + 1
        worst_residual = max(worst_residual, abs(q(p) - g3(p)*x(p) - sigma(p))/q(p))
        if (x(p) < 5.0e-4_rp) then
          worst_sigma = max(worst_sigma, abs(sigma(p) - want(p))/q(p))
        else
          worst_long = max(worst_long, abs(sigma(p) - want(p))/q(p))
        end if
        worst_state = max(worst_state, maxval(abs(state(p, :)/again(p, :) - 1.0_rp)))
      end do
    end do
    call expect('many plastic states', n_plastic >= batches*42)
    call expect('no return fails', failed == 0)
    call expect('plastic above yield and only there', n_wrong_side == 0)
    call expect_close('residual of the return', worst_residual, 0.0_rp, atol=1.0e-9_rp)
    ! the last correction takes the change of the state for its slope
    call expect_close('flow stress of the return', worst_sigma, 0.0_rp, atol=1.0e-7_rp)
    call expect_close('flow stress after long increments', worst_long, 0.0_rp, atol=1.0e-6_rp)
    call expect_close('state of the return', worst_state, 0.0_rp, atol=1.0e-6_rp)
  end subroutine test_random_returns

  !> What does not flow keeps its state to the bit beside what does.
  subroutine test_unloading()
    real(rp), dimension(nlane) :: temp, alpha, guess, g3, q, x, sigma
    real(rp), dimension(nlane, n_two_phase) :: state, before
    integer :: failed, p
    logical :: any_plastic

    do p = 1, nlane
      call law%start(state(p, :))
    end do
    before = state
    failed = 0
    temp = 600.0_rp
    alpha = 0.0_rp
    guess = 0.0_rp
    g3 = 3.0_rp*shear
    q = 1.0e6_rp
    q(7) = 1.0e9_rp
    call return_map(law, nlane, 1.0e-6_rp, temp, alpha, guess, q, g3, state, x, sigma, &
                    any_plastic, failed)
    call expect('one lane flows', any_plastic .and. x(7) > 0.0_rp .and. count(x > 0.0_rp) == 1)
    call expect('its state advances', all(abs(state(7, :) - before(7, :)) > 0.0_rp))
    state(7, :) = before(7, :)
    call expect('the others keep theirs', all(abs(state - before) <= 0.0_rp))
  end subroutine test_unloading

  subroutine test_validity_warnings()
    real(rp) :: temp(nlane), rate(nlane), state(nlane, n_two_phase)
    integer :: counts(max_warnings), lane(max_warnings)

    temp = 500.0_rp
    rate = 1.0_rp
    state = 1.0e12_rp
    temp(3:5) = 297.0_rp
    temp(60) = 1200.0_rp
    rate(3) = 0.0_rp                   ! cold, but it does not flow
    rate(8) = 1.0e3_rp/m*1.001_rp
    state(11, 2) = 1.0_rp
    counts = 0
    lane = 0
    call law%inspect(32, temp, rate, state, counts, lane)
    call expect('alarms of each kind', all(counts(:4) == [1, 1, 2, 0]))
    call expect('the first of each kind', all(lane(:3) == [8, 11, 4]))
  end subroutine test_validity_warnings

  !> A law that anneals, in the state of a density in walls and interior.
  subroutine annealed(other, density, state)
    type(two_phase_t), intent(out) :: other
    real(rp), intent(in) :: density
    real(rp), intent(out) :: state(nlane, n_two_phase_annealing)

    other = law
    other%n_state = n_two_phase_annealing
    other%anneals = .true.
    state = 0.0_rp
    state(:, 1) = sqrt(density)
    state(:, 2) = density
    state(:, 3) = 0.1_rp
  end subroutine annealed

  !> d rho/dt = -C rho^n, exact whatever the steps, not below the initial densities.
  subroutine test_recovery()
    type(two_phase_t) :: other
    real(rp) :: state(nlane, n_two_phase_annealing), temp(nlane), rate(nlane), want, n, c
    integer :: i, k

    temp = 700.0_rp
    rate = 0.0_rp
    do k = 2, 3
      n = real(k, rp)
      call annealed(other, 1.0e15_rp, state)
      other%annealing%recovery = arrhenius_t(1.0e-3_rp*(1.0e15_rp)**(1.0_rp - n), 4.0e4_rp)
      other%annealing%recovery_exponent = n
      do i = 1, 7
        call other%anneal(1.0e5_rp, temp, rate, state)
      end do
      c = 1.0e-3_rp*exp(-4.0e4_rp/(gas*700.0_rp))
      want = 1.0e15_rp*(1.0_rp + (n - 1.0_rp)*c*7.0e5_rp)**(-1.0_rp/(n - 1.0_rp))
      call expect_close('recovery', state(5, 2), want, rtol=1.0e-10_rp)
      call expect_close('recovery of walls', state(5, 1)**2, want, rtol=1.0e-10_rp)
      call other%anneal(1.0e30_rp, temp, rate, state)
      call expect_close('recovered walls', state(5, 1)**2, 1.0e13_rp, rtol=1.0e-10_rp)
      call expect_close('recovered interior', state(5, 2), 1.0e12_rp, rtol=1.0e-10_rp)
    end do
  end subroutine test_recovery

  !> d^m - d0^m = C t.
  subroutine test_growth()
    type(two_phase_t) :: other
    real(rp) :: state(nlane, n_two_phase_annealing), temp(nlane), rate(nlane)
    real(rp) :: values(nlane, n_outputs), d0, want
    integer :: i

    temp = 800.0_rp
    rate = 0.0_rp
    call annealed(other, 1.0e15_rp, state)
    call other%describe(state, n_outputs, values)
    d0 = values(1, 1)
    other%annealing%growth = arrhenius_t(1.0e-12_rp, 1.0e5_rp)
    other%annealing%growth_exponent = 3.0_rp
    do i = 1, 5
      call other%anneal(0.1_rp, temp, rate, state)
    end do
    call other%describe(state, n_outputs, values)
    want = (d0**3 + 0.5_rp*1.0e-12_rp*exp(-1.0e5_rp/(gas*800.0_rp)))**(1.0_rp/3.0_rp)
    call expect('the grains have grown', want > 1.5_rp*d0)
    call expect_close('coarsening', values(1, 1), want, rtol=1.0e-10_rp)
  end subroutine test_growth

  !> Site-saturated Johnson-Mehl-Avrami growth at constant driving force; nothing below the
  !> threshold; the new grains have the initial densities and the size of the nuclei's distance.
  subroutine test_recrystallisation()
    type(two_phase_t) :: other
    real(rp) :: state(nlane, n_two_phase_annealing), temp(nlane), rate(nlane)
    real(rp) :: values(nlane, n_outputs), v, want, dt
    integer :: i

    temp = 700.0_rp
    rate = 0.0_rp
    call annealed(other, 1.0e15_rp, state)
    other%annealing%mobility = arrhenius_t(1.0e-4_rp, 1.2e5_rp)
    other%annealing%spacing = 2.0e-6_rp
    other%annealing%threshold = 1.1e15_rp
    dt = 1.0e-3_rp
    call other%anneal(dt, temp, rate, state)
    call expect('nothing below the threshold', all(abs(state(:, 4)) <= 0.0_rp))
    other%annealing%threshold = 1.0e14_rp
    v = 1.0e-4_rp*exp(-1.2e5_rp/(gas*700.0_rp))*0.5_rp*shear*burgers**2*1.0e15_rp
    dt = 0.5_rp*1.0e-6_rp/v/200.0_rp             ! fronts cross half a radius in 200 steps
    do i = 1, 200
      call other%anneal(dt, temp, rate, state)
    end do
    want = 1.0_rp - exp(-(0.1_rp + 0.5_rp)**3)   ! nuclei begin with a tenth of the radius
    call expect_close('recrystallised', state(3, 4), want, rtol=1.0e-6_rp)
    call expect_close('mean density', state(3, 2), &
                      1.0e15_rp + want*(1.0e12_rp - 1.0e15_rp), rtol=1.0e-6_rp)
    call expect_close('size of the new grains', state(3, 5), 1.2e-6_rp, rtol=1.0e-6_rp)
    call other%describe(state, n_outputs, values)
    call expect_close('mean grain size', values(3, 1), &
                      (1.0_rp - want)*size_k/sqrt(1.0e15_rp) + want*1.2e-6_rp, rtol=1.0e-6_rp)
    do i = 1, 1000
      call other%anneal(dt, temp, rate, state)
    end do
    call other%describe(state, n_outputs, values)
    call expect('all is new in the end', values(3, 6) > 0.998_rp)
    call expect_close('its grain size', values(3, 1), 2.0e-6_rp, rtol=2.0e-3_rp)
    rate = 10.0_rp
    other%annealing%strain = 0.5_rp
    call other%anneal(0.1_rp, temp, rate, state)
    call expect_close('deformation makes it old', state(3, 4), values(3, 6)*exp(-2.0_rp), &
                      rtol=1.0e-6_rp)
  end subroutine test_recrystallisation

end program test_two_phase
