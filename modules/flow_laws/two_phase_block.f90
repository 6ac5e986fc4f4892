! SPDX-License-Identifier: MIT
!> The equations of the two-phase law (flow_laws_two_phase) for the lanes of a block.
module flow_laws_two_phase_block
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: n_work
  implicit none (type, external)
  private

  public :: evaluate, integrate, prepare_block

  ! Internal variables: sqrt(rho_w), rho_c, f.
  integer, parameter, public :: s_wall = 1, s_cell = 2, s_fraction = 3, n_own = 3

  ! Columns of `work`.
  integer, parameter, public :: &
    w_rate = 1, &    !! 1/m = T/A
    w_recovery = 2, &  !! 1/n = T/B
    w_source = 3, &  !! alpha*/(sqrt(3) b) [1/m]
    w_state = 4, &   !! the internal variables, n_own
    w_root = 7, &    !! (1 - f)^(-1/3)
    w_mean = 8, &    !! f sqrt(rho_w) + (1-f) sqrt(rho_c) [1/m]
    w_left = 9       !! the factor of melting

  real(rp), parameter, public :: least_density = 1.0_rp        !! [1/m2]
  real(rp), parameter :: longest_substep = 5.0e-3_rp   !! plastic strain
  real(rp), parameter :: most_strain = 0.5_rp
  real(rp), parameter :: most_exponent = 80.0_rp       !! of k/k0, far from overflow
  real(rp), parameter :: fast = 1.0_rp                 !! k dgamma of a substep at most
  real(rp), parameter :: memory = 60.0_rp         !! k gamma after which densities are new: exp(-30)
  real(rp), parameter :: no_strain = 1.0e-11_rp        !! changes no density by 1e-5 of itself
  real(rp), parameter :: third = 1.0_rp/3.0_rp

contains

  !> The columns of `work` but the last.
  pure subroutine prepare_block(per_a, per_b, source, temp, star, state, work)
    real(rp), intent(in) :: per_a, per_b, source
    real(rp), intent(in) :: temp(nlane), star(nlane), state(nlane, n_own)
    real(rp), intent(out) :: work(nlane, n_work)
    real(rp) :: z
    integer :: p

    !$omp simd private(z)
    do p = 1, nlane
      work(p, w_rate) = per_a*temp(p)
      work(p, w_recovery) = per_b*temp(p)
      work(p, w_source) = source*star(p)
      work(p, w_state) = state(p, s_wall)
      work(p, w_state + 1) = state(p, s_cell)
      work(p, w_state + 2) = state(p, s_fraction)
      z = 1.0_rp - state(p, s_fraction)
      work(p, w_root) = exp(-third*log(z))
      work(p, w_mean) = state(p, s_fraction)*state(p, s_wall) + z*sqrt(state(p, s_cell))
    end do
  end subroutine prepare_block

  !> Eqs. 6.5, 6.6, 6.11 over the shear M x by the classical Runge-Kutta method, in substeps of
  !> equal length and a last shorter one: the state is continuous in x and does not depend on other
  !> lanes.
  !> With u = sqrt(rho_w) the equations stay smooth; k dgamma <= 0.4, so nothing is stiff, but at
  !> very low rates of hot metal: see `shorten`. A plastic increment above `most_strain` (a step
  !> that has gone wrong) changes the state as that would.
  pure subroutine integrate(c, k0, taylor, f_end, gamma, work, x, log_rate, state)
    real(rp), intent(in) :: c(4), k0, taylor, f_end, gamma
    real(rp), intent(in) :: work(nlane, n_work), x(nlane), log_rate(nlane)
    real(rp), intent(inout) :: state(nlane, n_own)   !! out only
    real(rp), dimension(nlane) :: k, u, cells, f, y, longest, span
    real(rp) :: h, half, decay, fm, fe, ym, ye, u1, u2, u3, u4, c1, c2, c3, c4, most, most_k
    integer :: n, p, step

    most = 0.0_rp
    most_k = 0.0_rp
    !$omp simd reduction(max: most, most_k)
    do p = 1, nlane
      most = max(most, x(p))
      k(p) = k0*exp(min(most_exponent, -work(p, w_recovery)*(log_rate(p) + c(4))))
      most_k = max(most_k, k(p))
      longest(p) = longest_substep
      span(p) = x(p)
      u(p) = work(p, w_state)
      cells(p) = work(p, w_state + 1)
      f(p) = work(p, w_state + 2)
      y(p) = work(p, w_root)
    end do
    n = 0
    if (most > no_strain) n = ceiling(min(most, most_strain)/longest_substep)
    if (most_k*taylor*longest_substep > fast) call shorten(k, taylor, f_end, gamma, longest, span, &
                                                           f, y, n)
    do step = 0, n - 1
      !$omp simd private(h, half, decay, fm, fe, ym, ye, u1, u2, u3, u4, c1, c2, c3, c4)
      do p = 1, nlane
        h = taylor*max(0.0_rp, min(longest(p), span(p) - step*longest(p)))
        half = 0.5_rp*h
        decay = half/gamma                       ! becomes 1 - exp(-decay), decay < 0.01
        decay = decay*(1.0_rp - decay*(0.5_rp - decay*(1.0_rp/6.0_rp - decay*(1.0_rp/24.0_rp))))
        fm = f(p) - (f(p) - f_end)*decay
        fe = fm - (fm - f_end)*decay
        ym = inverse_root(1.0_rp - fm, y(p))
        ye = inverse_root(1.0_rp - fe, ym)
        call slope_of(c, k(p), work(p, w_source), u(p), cells(p), f(p), y(p), u1, c1)
        call slope_of(c, k(p), work(p, w_source), u(p) + half*u1, cells(p) + half*c1, fm, ym, &
                      u2, c2)
        call slope_of(c, k(p), work(p, w_source), u(p) + half*u2, cells(p) + half*c2, fm, ym, &
                      u3, c3)
        call slope_of(c, k(p), work(p, w_source), u(p) + h*u3, cells(p) + h*c3, fe, ye, u4, c4)
        u(p) = u(p) + h*(1.0_rp/6.0_rp)*(u1 + 2.0_rp*(u2 + u3) + u4)
        cells(p) = max(least_density, cells(p) + h*(1.0_rp/6.0_rp)*(c1 + 2.0_rp*(c2 + c3) + c4))
        f(p) = fe
        y(p) = ye
      end do
    end do
    state(:, s_wall) = u
    state(:, s_cell) = cells
    state(:, s_fraction) = f
  contains
    !> du and d rho_c by the shear; y = (1 - f)^(-1/3).
    pure subroutine slope_of(c, k, source, u, cells, f, y, du, dc)
      real(rp), intent(in) :: c(4), k, source
      real(rp), intent(in) :: u, cells, f, y
      real(rp), intent(out) :: du, dc
      real(rp) :: crossed                       ! c1 sqrt(total density): 6 beta*/(b d)

      crossed = c(1)*sqrt(f*u*u + (1.0_rp - f)*max(0.0_rp, cells))
      du = (1.0_rp - f)*(0.5_rp*crossed*y + c(2)*u)/(f*u) - 0.5_rp*k*u
      dc = source*u - crossed*y - k*cells
    end subroutine slope_of

    !> x^(-1/3) from a near value by a step of Newton's method, without a division.
    pure real(rp) function inverse_root(x, near)
      real(rp), intent(in) :: x, near

      inverse_root = near*(4.0_rp - x*near*near*near)*third
    end function inverse_root
  end subroutine integrate

  !> Where recovery is fast beside a substep, substeps are shorter; densities forget what was
  !> `memory`/k ago, so that before that only the fraction of the walls needs to be followed, which
  !> is exact.
  pure subroutine shorten(k, taylor, f_end, gamma, longest, span, f, y, n)
    real(rp), intent(in) :: k(nlane), taylor, f_end, gamma
    real(rp), intent(inout) :: longest(nlane), span(nlane), f(nlane), y(nlane)
    integer, intent(inout) :: n
    real(rp) :: before
    integer :: p

    do p = 1, nlane
      if (k(p)*taylor*longest_substep <= fast .or. span(p) <= 0.0_rp) cycle
      longest(p) = fast/(k(p)*taylor)
      span(p) = min(span(p), most_strain)
      before = span(p) - memory*longest(p)
      if (before > 0.0_rp) then
        span(p) = memory*longest(p)
        f(p) = f_end + (f(p) - f_end)*exp(-before*taylor/gamma)
        y(p) = (1.0_rp - f(p))**(-third)
      end if
      n = max(n, ceiling(span(p)/longest(p)))
    end do
  end subroutine shorten

  !> Stress of the advanced state, and its slope by ln x: the exponent of the rate, and what the
  !> increment has changed in the state.
  pure subroutine evaluate(sigma0, c, work, log_rate, state, sigma, slope)
    real(rp), intent(in) :: sigma0, c(4)
    real(rp), intent(in) :: work(nlane, n_work), log_rate(nlane), state(nlane, n_own)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: mean, factor
    integer :: p

    !$omp simd private(mean, factor)
    do p = 1, nlane
      mean = state(p, s_fraction)*state(p, s_wall) &
             + (1.0_rp - state(p, s_fraction))*sqrt(state(p, s_cell))
      factor = c(3)*exp(work(p, w_rate)*(log_rate(p) + c(4)))
      sigma(p) = work(p, w_left)*(sigma0 + factor*mean)
      slope(p) = work(p, w_left)*factor*(work(p, w_rate)*mean + mean - work(p, w_mean))
    end do
  end subroutine evaluate

end module flow_laws_two_phase_block
