! SPDX-License-Identifier: MIT
!> The radial return of random states against plain scalar code: own flow law, own root finder.
program test_return
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_return_map, only: default_min_rate, return_map
  implicit none (type, external)

  real(rp), parameter :: shear = 46.27e9_rp   !! modulus [Pa]
  type(johnson_cook_t) :: law
  real(rp) :: none(nlane, 0)                  !! the law has no internal variables

  law = johnson_cook_t(a=90.0e6_rp, b=292.0e6_rp, n=0.31_rp, c=0.025_rp, m=1.09_rp, &
                       t_melt=1356.0_rp)

  call begin_tests()
  call random_init(.true., .false.)
  call test_random_states()
  call test_gap_above_yield()
  call test_flowed_everywhere()
  call end_tests()

contains

  !> Johnson-Cook with the parameters of copper, in plain words; 1e-9 is the law's least strain.
  pure real(rp) function flow_stress(strain, rate, temp)
    real(rp), intent(in) :: strain, rate, temp
    real(rp) :: theta

    theta = max(0.0_rp, min(1.0_rp, (temp - 298.0_rp)/(1356.0_rp - 298.0_rp)))
    flow_stress = (90.0e6_rp + 292.0e6_rp*(strain + 1.0e-9_rp)**0.31_rp) &
                  *max(0.5_rp, 1.0_rp + 0.025_rp*log(rate))*(1.0_rp - theta**1.09_rp)
  end function flow_stress

  !> Root of q = g3 x + sigma by halving an interval of ln x.
  pure real(rp) function root(q, g3, dt, alpha, temp)
    real(rp), intent(in) :: q, g3, dt, alpha, temp
    real(rp) :: low, high, middle
    integer :: i

    high = log(q/g3)
    low = log(default_min_rate*dt)
    do i = 1, 80
      middle = 0.5_rp*(low + high)
      if (g3*exp(middle) + flow_stress(alpha + exp(middle), exp(middle)/dt, temp) > q) then
        high = middle
      else
        low = middle
      end if
    end do
    root = exp(0.5_rp*(low + high))
  end function root

  !> Random state: a third on a given plastic rate, a third at a given excess, a third below yield.
  subroutine random_state(dt, temp, alpha, guess, g3, q)
    real(rp), intent(out) :: dt
    real(rp), dimension(nlane), intent(out) :: temp, alpha, guess, g3, q
    real(rp) :: u(6), x, yield
    integer :: p

    call random_number(u(1))
    dt = 10.0_rp**(-9.0_rp + 5.0_rp*u(1))
    do p = 1, nlane
      call random_number(u)
      temp(p) = 290.0_rp + 1066.0_rp*u(1)
      alpha(p) = 40.0_rp*max(0.0_rp, u(2) - 0.05_rp)**4
      guess(p) = 0.0_rp
      if (u(3) > 0.3_rp) guess(p) = 10.0_rp**(-6.0_rp + 9.0_rp*u(3))
      g3(p) = 3.0_rp*shear*(1.0_rp + 0.1_rp*u(4))
      yield = flow_stress(alpha(p) + default_min_rate*dt, default_min_rate, temp(p))
      select case (mod(p, 3))
      case (0)
        x = dt*10.0_rp**(-5.99_rp + 8.99_rp*u(5))
        q(p) = g3(p)*x + flow_stress(alpha(p) + x, x/dt, temp(p))
      case (1)
        q(p) = yield*(1.0_rp + 10.0_rp**(-5.0_rp + 8.0_rp*u(5))) + g3(p)*default_min_rate*dt
      case default
        q(p) = yield*0.999_rp*u(5)
      end select
    end do
  end subroutine random_state

  !> 128,000 states: no failure, and the root that plain halving finds.
  subroutine test_random_states()
    integer, parameter :: batches = 2000
    real(rp), dimension(nlane) :: temp, alpha, guess, g3, q, x, sigma
    real(rp) :: dt, worst_residual, worst_root, worst_sigma, want
    integer :: batch, failed, p, n_wrong_side, n_plastic
    logical :: any_plastic

    failed = 0
    n_wrong_side = 0
    n_plastic = 0
    worst_residual = 0.0_rp
    worst_root = 0.0_rp
    worst_sigma = 0.0_rp
    do batch = 1, batches
      call random_state(dt, temp, alpha, guess, g3, q)
      call return_map(law, nlane, dt, temp, alpha, guess, q, g3, none, x, sigma, any_plastic, &
                      failed)
      do p = 1, nlane
        if (mod(p, 3) == 2) then
          if (abs(x(p)) > 0.0_rp) n_wrong_side = n_wrong_side + 1
          cycle
        end if
        n_plastic = n_plastic + 1
        if (.not. x(p) > 0.0_rp) then
          n_wrong_side = n_wrong_side + 1
          cycle
        end if
        want = flow_stress(alpha(p) + x(p), x(p)/dt, temp(p))
        worst_sigma = max(worst_sigma, abs(sigma(p) - want)/q(p))
        worst_residual = max(worst_residual, abs(q(p) - g3(p)*x(p) - want)/q(p))
        want = root(q(p), g3(p), dt, alpha(p), temp(p))
        worst_root = max(worst_root, abs(x(p) - want)/want)
      end do
    end do
    call expect('many plastic states', n_plastic > 80000)
    call expect('no return fails', failed == 0)
    call expect('plastic above yield and only there', n_wrong_side == 0)
    call expect_close('flow stress of the return', worst_sigma, 0.0_rp, atol=1.0e-9_rp)
    call expect_close('residual of the return', worst_residual, 0.0_rp, atol=1.0e-9_rp)
    call expect_close('root of the return', worst_root, 0.0_rp, atol=1.0e-6_rp)
  end subroutine test_random_states

  !> A trial stress so close above yield that the rate would be below the least one: the error is
  !> at most the stress of an increment at the least rate.
  subroutine test_gap_above_yield()
    real(rp), dimension(nlane) :: temp, alpha, guess, g3, q, x, sigma
    real(rp) :: dt, gap
    integer :: failed, p
    logical :: any_plastic

    failed = 0
    dt = 1.0e-4_rp
    temp = 600.0_rp
    alpha = 0.5_rp
    guess = 0.0_rp
    g3 = 3.0_rp*shear
    gap = 3.0_rp*shear*default_min_rate*dt
    do p = 1, nlane
      q(p) = flow_stress(0.5_rp + default_min_rate*dt, default_min_rate, 600.0_rp) + gap &
        *p/(nlane + 1)
    end do
    call return_map(law, nlane, dt, temp, alpha, guess, q, g3, none, x, sigma, any_plastic, failed)
    call expect('gap above yield: no failure', failed == 0)
    call expect('gap above yield: residual', maxval(abs(q - g3*x - sigma)) <= gap*1.001_rp)
  end subroutine test_gap_above_yield

  !> Blocks that flowed everywhere in the last step, and now everywhere, here and there, or nowhere.
  subroutine test_flowed_everywhere()
    real(rp), dimension(nlane) :: temp, alpha, guess, g3, q, x, sigma, rate
    real(rp) :: dt, want, worst, yield
    integer :: case, failed, n_wrong_side, p
    logical :: any_plastic, flows(nlane)

    failed = 0
    n_wrong_side = 0
    worst = 0.0_rp
    dt = 1.0e-6_rp
    do case = 1, 3
      call random_state(want, temp, alpha, guess, g3, q)
      temp = min(temp, 1000.0_rp)
      do p = 1, nlane
        flows(p) = case == 1 .or. case == 2 .and. mod(p, 5) > 0
        rate(p) = 10.0_rp**(mod(p, 9) - 2)
        x(p) = 1.3_rp*rate(p)*dt
        q(p) = g3(p)*x(p) + flow_stress(alpha(p) + x(p), 1.3_rp*rate(p), temp(p))
        yield = flow_stress(alpha(p) + default_min_rate*dt, default_min_rate, temp(p))
        if (.not. flows(p)) q(p) = 0.99_rp*yield
      end do
      call return_map(law, nlane, dt, temp, alpha, rate, q, g3, none, x, sigma, any_plastic, failed)
      n_wrong_side = n_wrong_side + count(flows .neqv. x > 0.0_rp)
      if (any_plastic .neqv. any(flows)) n_wrong_side = n_wrong_side + 1
      do p = 1, nlane
        want = flow_stress(alpha(p) + default_min_rate*dt, default_min_rate, temp(p))
        if (flows(p)) then
          want = q(p) - g3(p)*x(p)
          worst = max(worst, abs(x(p)/(1.3_rp*rate(p)*dt) - 1.0_rp))
        end if
        worst = max(worst, abs(sigma(p)/want - 1.0_rp))
      end do
    end do
    call expect('flowed before: no failure', failed == 0)
    call expect('flowed before: plastic above yield and only there', n_wrong_side == 0)
    call expect_close('flowed before: increment and flow stress', worst, 0.0_rp, atol=1.0e-6_rp)
  end subroutine test_flowed_everywhere

end program test_return
