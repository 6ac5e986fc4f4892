! SPDX-License-Identifier: MIT
!> Radial return of a batch: solves q = 3 Gbar x + sigma(alpha + x, x/dt, T, state advanced by x)
!> for the increment x of plastic strain by Newton's method in ln x, kept inside a bracket (sigma
!> has an infinite slope by x at 0, where plain Newton fails).
module physics_return_map
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: flow_law_t, least_rate, n_work
  implicit none (type, external)
  private

  public :: least_rate, return_map

  real(rp), parameter :: tolerance = 1.0e-6_rp            !! residual/q before the last correction
  integer, parameter :: most_iterations = 60, few_iterations = 4

contains

  !> `x` is the plastic increment (0 where elastic), `sigma` the flow stress (at the least rate
  !> where elastic), `failed` the number of particles that did not converge. `rate` brings the last
  !> step's rate as the first guess. Where all flowed in the last step, they are first taken to do
  !> so still: increments above the least that come out after a few iterations prove it.
  !> The residual of the result is below 1e-10 q: 1e-6 q, then one more correction to second order.
  subroutine return_map(law, n, dt, temp, alpha, rate, q, g3, state, x, sigma, any_plastic, failed)
    class(flow_law_t), intent(in) :: law
    integer, intent(in) :: n                                !! particles in the block
    real(rp), intent(in) :: dt                              !! [s]
    real(rp), intent(in) :: temp(nlane), alpha(nlane), rate(nlane)
    real(rp), intent(in) :: q(nlane), g3(nlane)             !! trial stress, 3 Gbar [Pa]
    real(rp), intent(inout) :: state(nlane, law%n_state)    !! internal variables, advanced by x
    real(rp), intent(out) :: x(nlane), sigma(nlane)
    logical, intent(out) :: any_plastic
    integer, intent(inout) :: failed
    real(rp), dimension(nlane) :: log_rate, slope, plastic, step, yield
    real(rp) :: work(nlane, n_work)
    logical :: all_plastic
    integer :: missed

    call law%prepare(temp, state, work)
    all_plastic = .not. any_below(n, rate, law%slowest)
    if (all_plastic) then
      yield = 0.0_rp
      call solve(few_iterations, law, n, dt, work, alpha, rate, q, g3, yield, x, log_rate, sigma, &
                 slope, plastic, step, missed)
      all_plastic = missed == 0 .and. .not. any_below(n, x, 2.0_rp*law%slowest*dt)
      any_plastic = all_plastic
    end if
    if (.not. all_plastic) then
      x = law%slowest*dt
      log_rate = log(law%slowest)
      call law%stress(work, alpha, x, log_rate, yield, slope)
      any_plastic = any_below(n, yield - q, 0.0_rp)
      if (.not. any_plastic) then
        x = 0.0_rp
        sigma = yield
        return
      end if
      call solve(most_iterations, law, n, dt, work, alpha, rate, q, g3, yield, x, log_rate, sigma, &
                 slope, plastic, step, missed)
      failed = failed + missed
    end if
    x = plastic*x*(1.0_rp + step*(1.0_rp + 0.5_rp*step))
    sigma = merge(sigma + step*slope, yield, plastic > 0.0_rp)
    if (law%n_state > 0) call law%advance(work, x, log_rate, state)
  end subroutine return_map

  !> Whether one of the first `n` values is less than `least`.
  pure logical function any_below(n, value, least)
    integer, intent(in) :: n
    real(rp), intent(in) :: value(nlane), least
    integer :: p

    any_below = .false.
    !$omp simd reduction(.or.: any_below)
    do p = 1, n
      any_below = any_below .or. value(p) < least
    end do
  end function any_below

  !> Increments `x` of those above `yield`, and flow stress there, before the last correction by
  !> `step` of ln x; `missed` counts those that did not converge.
  subroutine solve(most, law, n, dt, work, alpha, rate, q, g3, yield, x, log_rate, sigma, slope, &
                   plastic, step, missed)
    integer, intent(in) :: most                !! iterations
    class(flow_law_t), intent(in) :: law
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, work(nlane, n_work)
    real(rp), dimension(nlane), intent(in) :: alpha, rate, q, g3, yield
    real(rp), dimension(nlane), intent(out) :: x, log_rate, sigma, slope, plastic, step
    integer, intent(out) :: missed
    real(rp), dimension(nlane) :: y, low, high, residual
    real(rp) :: log_dt, worst
    integer :: iteration, p

    log_dt = log(dt)
    missed = 0
    call start(law%slowest, dt, q, g3, yield, rate, plastic, low, high, x, y)
    do iteration = 1, most
      log_rate = y - log_dt
      call law%stress(work, alpha, x, log_rate, sigma, slope)
      call improve(q, g3, x, sigma, slope, plastic, low, high, y, step, residual, worst)
      if (worst <= tolerance) return
      x = exp(y)
    end do
    do p = 1, n
      if (residual(p) > tolerance .and. high(p) - low(p) > 1.0e-9_rp) missed = missed + 1
    end do
  end subroutine solve

  !> Bracket in ln x (its upper end is that of the whole block) and first guess `x`, `y` = ln x: the
  !> last rate, or a radial return at the least rate.
  pure subroutine start(slowest, dt, q, g3, sigma, rate, plastic, low, high, x, y)
    real(rp), intent(in) :: slowest, dt
    real(rp), dimension(nlane), intent(in) :: q, g3, sigma, rate
    real(rp), dimension(nlane), intent(out) :: plastic, low, high, x, y
    real(rp) :: least, most, guess, widest
    integer :: p

    most = 0.0_rp
    !$omp simd reduction(max: most)
    do p = 1, nlane
      most = max(most, q(p)/g3(p))
    end do
    least = log(slowest*dt)
    most = max(log(most), least + 1.0_rp)
    widest = exp(most)
    !$omp simd private(guess)
    do p = 1, nlane
      plastic(p) = merge(1.0_rp, 0.0_rp, q(p) > sigma(p))
      guess = max(q(p) - sigma(p), 1.0e-6_rp*q(p) + 1.0e-30_rp)/g3(p)
      guess = merge(rate(p)*dt, guess, rate(p) > slowest)
      x(p) = max(slowest*dt, min(widest, guess))
      y(p) = max(least, min(most, log(x(p))))
      low(p) = least
      high(p) = most
    end do
  end subroutine start

  !> One bracketed Newton step of every lane that has not converged; for those that have, `step`
  !> is the last, small correction of ln x.
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
