! SPDX-License-Identifier: MIT
!> Radial return of a batch: solves q = 3 Gbar x + sigma(alpha + x, x/dt, T, state advanced by x)
!> for the plastic strain increment x by Newton's method in ln x with bracketing (the slope of sigma
!> is infinite at x = 0, where plain Newton fails).
module physics_return_map
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: flow_law_t, default_min_rate, n_work
  implicit none (type, external)
  private

  public :: default_min_rate, return_map

  real(rp), parameter :: tolerance = 1.0e-6_rp  !! residual over q before the last correction
  integer, parameter :: max_iterations = 60, quick_iterations = 4

contains

  !> Return map: `x` is the plastic increment (0 where elastic), `sigma` the flow stress (at the
  !> smallest rate where elastic), `failed` the number of particles without convergence. `rate`
  !> brings the rate of the last step as the first guess. If all particles flowed in the last step,
  !> they are first assumed to flow again, which is confirmed by increments above the smallest one
  !> after a few iterations. The residual of the result is below 1e-10 q: 1e-6 q, then one more
  !> correction to second order.
  subroutine return_map(law, n, dt, temp, alpha, rate, q, g3, state, x, sigma, any_plastic, failed)
    class(flow_law_t), intent(in) :: law
    integer, intent(in) :: n                                !! particles in the block
    real(rp), intent(in) :: dt                              !! time step [s]
    real(rp), intent(in) :: temp(nlane), alpha(nlane), rate(nlane)
    real(rp), intent(in) :: q(nlane), g3(nlane)             !! trial stress, 3 Gbar [Pa]
    real(rp), intent(inout) :: state(nlane, law%n_state)    !! internal variables, advanced by x
    real(rp), intent(out) :: x(nlane), sigma(nlane)
    logical, intent(out) :: any_plastic
    integer, intent(inout) :: failed
    real(rp), dimension(nlane) :: log_rate, slope, plastic, step, yield
    real(rp) :: work(nlane, n_work)
    logical :: all_plastic
    integer :: n_failed

    call law%prepare(temp, state, work)
    all_plastic = .not. any_below(n, rate, law%min_rate)
    if (all_plastic) then
      yield = 0.0_rp
      call solve(quick_iterations, law, n, dt, work, alpha, rate, q, g3, yield, x, log_rate, &
                 sigma, slope, plastic, step, n_failed)
      all_plastic = n_failed == 0 .and. .not. any_below(n, x, 2.0_rp*law%min_rate*dt)
      any_plastic = all_plastic
    end if
    if (.not. all_plastic) then
      x = law%min_rate*dt
      log_rate = log(law%min_rate)
      call law%stress(work, alpha, x, log_rate, yield, slope)
      any_plastic = any_below(n, yield - q, 0.0_rp)
      if (.not. any_plastic) then
        x = 0.0_rp
        sigma = yield
        return
      end if
      call solve(max_iterations, law, n, dt, work, alpha, rate, q, g3, yield, x, log_rate, sigma, &
                 slope, plastic, step, n_failed)
      failed = failed + n_failed
    end if
    x = plastic*x*(1.0_rp + step*(1.0_rp + 0.5_rp*step))
    sigma = merge(sigma + step*slope, yield, plastic > 0.0_rp)
    if (law%n_state > 0) call law%advance(work, x, log_rate, state)
  end subroutine return_map

  !> True if one of the first `n` values is less than `bound`.
  pure logical function any_below(n, value, bound)
    integer, intent(in) :: n
    real(rp), intent(in) :: value(nlane), bound
    integer :: p

    any_below = .false.
    !$omp simd reduction(.or.: any_below)
    do p = 1, n
      any_below = any_below .or. value(p) < bound
    end do
  end function any_below

  !> Increments `x` of lanes above `yield` and their flow stress, before the last correction `step`
  !> of ln x; `n_failed` counts lanes without convergence.
  subroutine solve(n_iterations, law, n, dt, work, alpha, rate, q, g3, yield, x, log_rate, &
                   sigma, slope, plastic, step, n_failed)
    integer, intent(in) :: n_iterations                !! largest number of iterations
    class(flow_law_t), intent(in) :: law
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, work(nlane, n_work)
    real(rp), dimension(nlane), intent(in) :: alpha, rate, q, g3, yield
    real(rp), dimension(nlane), intent(out) :: x, log_rate, sigma, slope, plastic, step
    integer, intent(out) :: n_failed
    real(rp), dimension(nlane) :: y, low, high, residual
    real(rp) :: log_dt, worst
    integer :: iteration, p

    log_dt = log(dt)
    n_failed = 0
    call start(law%min_rate, dt, q, g3, yield, rate, plastic, low, high, x, y)
    do iteration = 1, n_iterations
      log_rate = y - log_dt
      call law%stress(work, alpha, x, log_rate, sigma, slope)
      call improve(q, g3, x, sigma, slope, plastic, low, high, y, step, residual, worst)
      if (worst <= tolerance) return
      x = exp(y)
    end do
    do p = 1, n
      if (residual(p) > tolerance .and. high(p) - low(p) > 1.0e-9_rp) n_failed = n_failed + 1
    end do
  end subroutine solve

  !> Bracket in ln x (its upper end is that of the whole block) and first guess `x`, `y` = ln x,
  !> from the rate of the last step, or by a radial return at the smallest rate.
  pure subroutine start(min_rate, dt, q, g3, sigma, rate, plastic, low, high, x, y)
    real(rp), intent(in) :: min_rate, dt
    real(rp), dimension(nlane), intent(in) :: q, g3, sigma, rate
    real(rp), dimension(nlane), intent(out) :: plastic, low, high, x, y
    real(rp) :: min_log, max_log, guess, max_x
    integer :: p

    max_log = 0.0_rp
    !$omp simd reduction(max: max_log)
    do p = 1, nlane
      max_log = max(max_log, q(p)/g3(p))
    end do
    min_log = log(min_rate*dt)
    max_log = max(log(max_log), min_log + 1.0_rp)
    max_x = exp(max_log)
    !$omp simd private(guess)
    do p = 1, nlane
      plastic(p) = merge(1.0_rp, 0.0_rp, q(p) > sigma(p))
      guess = max(q(p) - sigma(p), 1.0e-6_rp*q(p) + 1.0e-30_rp)/g3(p)
      guess = merge(rate(p)*dt, guess, rate(p) > min_rate)
      x(p) = max(min_rate*dt, min(max_x, guess))
      y(p) = max(min_log, min(max_log, log(x(p))))
      low(p) = min_log
      high(p) = max_log
    end do
  end subroutine start

  !> One bracketed Newton step of every unconverged lane; for converged ones, `step` is the last
  !> small correction of ln x.
  pure subroutine improve(q, g3, x, sigma, slope, plastic, low, high, y, step, residual, worst)
    real(rp), dimension(nlane), intent(in) :: q, g3, x, sigma, slope, plastic
    real(rp), dimension(nlane), intent(inout) :: low, high, y
    real(rp), intent(out) :: step(nlane), residual(nlane), worst
    real(rp) :: r, newton, next
    integer :: p

    worst = 0.0_rp
    !$omp simd private(r, newton, next) reduction(max: worst)
    do p = 1, nlane
      r = q(p) - g3(p)*x(p) - sigma(p)
      residual(p) = plastic(p)*abs(r)/max(q(p), 1.0e-30_rp)
      worst = max(worst, residual(p))
      low(p) = merge(y(p), low(p), r > 0.0_rp)
      high(p) = merge(high(p), y(p), r > 0.0_rp)
      newton = r/(g3(p)*x(p) + slope(p))
      next = y(p) + newton
      next = merge(next, 0.5_rp*(low(p) + high(p)), next > low(p) .and. next < high(p))
      step(p) = merge(newton, 0.0_rp, residual(p) <= tolerance .and. plastic(p) > 0.0_rp)
      y(p) = merge(next, y(p), residual(p) > tolerance)
    end do
  end subroutine improve

end module physics_return_map
