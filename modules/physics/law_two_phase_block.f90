! SPDX-License-Identifier: MIT
!> The equations of the two-phase law (physics_law_two_phase) for the lanes of a block.
!>
!> Coefficient alpha*(T) of the two-phase law: fraction of the wall dislocations that act as sources
!> in cells.
module physics_law_two_phase_block
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use input_key_table, only: key_table_t
  use input_tables, only: check_rising
  use input_values, only: input_t
  use physics_flow_law, only: max_points, n_work
  implicit none (type, external)
  private

  public :: alpha_star_t, evaluate, integrate, prepare_block

  ! Internal variables sqrt(rho_w), rho_c, f.
  integer, parameter, public :: s_wall = 1, s_cell = 2, s_fraction = 3, n_own = 3

  ! Columns of `work`.
  integer, parameter, public :: &
    w_rate = 1, &         !! 1/m = T/A
    w_recovery = 2, &     !! 1/n = T/B
    w_source = 3, &       !! alpha*/(sqrt(3) b) [1/m]
    w_state = 4, &        !! internal variables, n_own
    w_root = 7, &         !! (1 - f)^(-1/3)
    w_mean = 8, &         !! f sqrt(rho_w) + (1-f) sqrt(rho_c) [1/m]
    w_melting = 9         !! melting factor

  real(rp), parameter, public :: min_density = 1.0_rp    !! smallest density [1/m2]
  real(rp), parameter :: max_substep = 5.0e-3_rp         !! largest substep of plastic strain
  !> Plastic increment above which the state changes no further [-].
  real(rp), parameter :: max_strain = 0.5_rp
  real(rp), parameter :: max_exponent = 80.0_rp  !! largest exponent of k/k0, far from overflow
  real(rp), parameter :: max_decay = 1.0_rp              !! largest k dgamma of a substep
  !> k gamma from which on the initial densities have decayed by exp(-30).
  real(rp), parameter :: decay_strain = 60.0_rp
  !> Strain that changes no density by 1e-5 of its value.
  real(rp), parameter :: negligible_strain = 1.0e-11_rp
  real(rp), parameter :: third = 1.0_rp/3.0_rp

  !> alpha*(T): linear between points, constant outside; or a/(T + b) + c between two temperatures
  !> and constants outside.
  type :: alpha_star_t
    real(rp), allocatable :: t(:), value(:)        !! points, at least one: a table [K], [-]
    real(rp) :: fit(3) = [0.0_rp, 1.0_rp, 0.0_rp]  !! a [K], b [K], c
    real(rp) :: from = 0.0_rp, to = huge(1.0_rp)   !! range of the fit [K]
    real(rp) :: below = 0.0_rp, above = 0.0_rp     !! values below and above that range
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, evaluate => evaluate_alpha
  end type alpha_star_t

contains

  !> Fill the columns of `work` except the last.
  pure subroutine prepare_block(per_a, per_b, source, temp, star, state, work)
    real(rp), intent(in) :: per_a, per_b, source, temp(nlane), star(nlane), state(nlane, n_own)
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

  !> Integrate eqs. 6.5, 6.6, 6.11 over the shear M x by the classical Runge-Kutta method, in
  !> substeps of equal length and a last shorter one: the state is continuous in x and does not
  !> depend on other lanes. With u = sqrt(rho_w) the equations stay smooth; k dgamma <= 0.4, so that
  !> nothing is stiff except at very low rates of hot metal: see `shorten_substeps`. A plastic
  !> increment above `max_strain` (a failed step) changes the state as `max_strain` would.
  pure subroutine integrate(c, k0, taylor, f_end, gamma, work, x, log_rate, state)
    real(rp), intent(in) :: c(4), k0, taylor, f_end, gamma
    real(rp), intent(in) :: work(nlane, n_work), x(nlane), log_rate(nlane)
    real(rp), intent(inout) :: state(nlane, n_own)   !! output only
    real(rp), dimension(nlane) :: k, u, cells, f, y, substep, span
    real(rp) :: h, half, decay, fm, fe, ym, ye, u1, u2, u3, u4, c1, c2, c3, c4, max_x, max_k
    integer :: n, p, step

    max_x = 0.0_rp
    max_k = 0.0_rp
    !$omp simd reduction(max: max_x, max_k)
    do p = 1, nlane
      max_x = max(max_x, x(p))
      k(p) = k0*exp(min(max_exponent, -work(p, w_recovery)*(log_rate(p) + c(4))))
      max_k = max(max_k, k(p))
      substep(p) = max_substep
      span(p) = x(p)
      u(p) = work(p, w_state)
      cells(p) = work(p, w_state + 1)
      f(p) = work(p, w_state + 2)
      y(p) = work(p, w_root)
    end do
    n = 0
    if (max_x > negligible_strain) n = ceiling(min(max_x, max_strain)/max_substep)
    if (max_k*taylor*max_substep > max_decay) call shorten_substeps(k, taylor, f_end, gamma, &
                                                           substep, span, f, y, n)
    do step = 0, n - 1
      !$omp simd private(h, half, decay, fm, fe, ym, ye, u1, u2, u3, u4, c1, c2, c3, c4)
      do p = 1, nlane
        h = taylor*max(0.0_rp, min(substep(p), span(p) - step*substep(p)))
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
        cells(p) = max(min_density, cells(p) + h*(1.0_rp/6.0_rp)*(c1 + 2.0_rp*(c2 + c3) + c4))
        f(p) = fe
        y(p) = ye
      end do
    end do
    state(:, s_wall) = u
    state(:, s_cell) = cells
    state(:, s_fraction) = f
  contains
    !> Derivatives of u and rho_c by the shear; y = (1 - f)^(-1/3).
    pure subroutine slope_of(c, k, source, u, cells, f, y, du, dc)
      real(rp), intent(in) :: c(4), k, source, u, cells, f, y
      real(rp), intent(out) :: du, dc
      real(rp) :: crossed                       ! c1 sqrt(total density): 6 beta*/(b d)

      crossed = c(1)*sqrt(f*u*u + (1.0_rp - f)*max(0.0_rp, cells))
      du = (1.0_rp - f)*(0.5_rp*crossed*y + c(2)*u)/(f*u) - 0.5_rp*k*u
      dc = source*u - crossed*y - k*cells
    end subroutine slope_of

    !> Value of x^(-1/3) from a nearby one by a step of Newton's method, without a division.
    pure real(rp) function inverse_root(x, near)
      real(rp), intent(in) :: x, near

      inverse_root = near*(4.0_rp - x*near*near*near)*third
    end function inverse_root
  end subroutine integrate

  !> Shorten the substeps where recovery is fast; densities older than `decay_strain`/k have no
  !> influence, so that before that only the fraction of the walls is advanced, which is exact.
  pure subroutine shorten_substeps(k, taylor, f_end, gamma, substep, span, f, y, n)
    real(rp), intent(in) :: k(nlane), taylor, f_end, gamma
    real(rp), intent(inout) :: substep(nlane), span(nlane), f(nlane), y(nlane)
    integer, intent(inout) :: n
    real(rp) :: before
    integer :: p

    do p = 1, nlane
      if (k(p)*taylor*max_substep <= max_decay .or. span(p) <= 0.0_rp) cycle
      substep(p) = max_decay/(k(p)*taylor)
      span(p) = min(span(p), max_strain)
      before = span(p) - decay_strain*substep(p)
      if (before > 0.0_rp) then
        span(p) = decay_strain*substep(p)
        f(p) = f_end + (f(p) - f_end)*exp(-before*taylor/gamma)
        y(p) = (1.0_rp - f(p))**(-third)
      end if
      n = max(n, ceiling(span(p)/substep(p)))
    end do
  end subroutine shorten_substeps

  !> Stress of the advanced state and its derivative by ln x: by the exponent of the rate, and by
  !> the change of the state over the increment.
  pure subroutine evaluate(sigma0, c, work, log_rate, state, sigma, slope)
    real(rp), intent(in) :: sigma0, c(4), work(nlane, n_work), log_rate(nlane), state(nlane, n_own)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: mean, factor
    integer :: p

    !$omp simd private(mean, factor)
    do p = 1, nlane
      mean = state(p, s_fraction)*state(p, s_wall) &
             + (1.0_rp - state(p, s_fraction))*sqrt(state(p, s_cell))
      factor = c(3)*exp(work(p, w_rate)*(log_rate(p) + c(4)))
      sigma(p) = work(p, w_melting)*(sigma0 + factor*mean)
      slope(p) = work(p, w_melting)*factor*(work(p, w_rate)*mean + mean - work(p, w_mean))
    end do
  end subroutine evaluate

  !> Add its keys to &MATERIAL.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('TP_STAR', 'real', -max_points, '', 'if LAW = two-phase', '', &
      'alpha*, coefficient of the generation of dislocations, at the temperatures TP_STAR_T: '// &
      'linear between, constant outside; one value: constant')
    call t%key('TP_STAR_T', 'real', -max_points, 'K', 'if LAW = two-phase', '(0,inf)', &
               'rising temperatures of TP_STAR')
    call t%key('TP_STAR_FIT', 'real', 3, '', 'if LAW = two-phase', '', &
               'instead of TP_STAR: a [K], b [K], c of alpha* = a/(T + b) + c')
    call t%key('TP_STAR_RANGE', 'real', 2, 'K', 'if LAW = two-phase', '(0,inf)', &
               'temperatures between which TP_STAR_FIT holds')
    call t%key('TP_STAR_ENDS', 'real', 2, '', 'if LAW = two-phase', '', &
      'alpha* below and above TP_STAR_RANGE')
  end subroutine add_keys

  !> Read a table, a constant or a fit.
  subroutine read_keys(self, input, i)
    class(alpha_star_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    if (input%given('MATERIAL', i, 'TP_STAR_FIT') .eqv. input%given('MATERIAL', i, 'TP_STAR')) then
      call input%report('MATERIAL', i, 'TP_STAR', 'give alpha* either by TP_STAR or by TP_STAR_FIT')
    else if (input%given('MATERIAL', i, 'TP_STAR_FIT')) then
      if (size(input%list('MATERIAL', i, 'TP_STAR_RANGE')) &
          + size(input%list('MATERIAL', i, 'TP_STAR_ENDS')) < 4) then
        call input%report('MATERIAL', i, 'TP_STAR_FIT', 'needs TP_STAR_RANGE and TP_STAR_ENDS')
        return
      end if
      self%fit = input%reals('MATERIAL', i, 'TP_STAR_FIT', 3)
      associate (range => input%reals('MATERIAL', i, 'TP_STAR_RANGE', 2), &
                 ends => input%reals('MATERIAL', i, 'TP_STAR_ENDS', 2))
        self%from = range(1)
        self%to = range(2)
        self%below = ends(1)
        self%above = ends(2)
      end associate
      if (self%to < self%from) call input%report('MATERIAL', i, 'TP_STAR_RANGE', 'must rise')
      if (self%from + self%fit(2) <= 0.0_rp) then
        call input%report('MATERIAL', i, 'TP_STAR_FIT', 'has its pole within TP_STAR_RANGE')
      end if
    else
      self%value = input%list('MATERIAL', i, 'TP_STAR')
      self%t = [1.0_rp]
      if (size(self%value) > 1) self%t = input%list('MATERIAL', i, 'TP_STAR_T')
      call check_rising(input, 'MATERIAL', i, 'TP_STAR_T', self%t)
      if (size(self%t) /= size(self%value)) then
        call input%report('MATERIAL', i, 'TP_STAR', 'has '//str(size(self%value))// &
                          ' values, TP_STAR_T '//str(size(self%t)))
      end if
    end if
  end subroutine read_keys

  !> alpha* at each temperature of a block.
  pure subroutine evaluate_alpha(self, temp, value)
    class(alpha_star_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane)
    real(rp), intent(out) :: value(nlane)
    integer :: k, n, p

    if (.not. allocated(self%t)) then
      call fitted(self%fit, self%from, self%to, self%below, self%above, temp, value)
      return
    end if
    n = size(self%t)
    value = self%value(1)
    do k = 1, n - 1
      associate (t1 => self%t(k), v1 => self%value(k), v2 => self%value(k + 1), &
                 scale => 1.0_rp/(self%t(k + 1) - self%t(k)))
        !$omp simd
        do p = 1, nlane
          if (temp(p) > t1) value(p) = v1 + (v2 - v1)*min(1.0_rp, (temp(p) - t1)*scale)
        end do
      end associate
    end do
  end subroutine evaluate_alpha

  pure subroutine fitted(fit, from, to, below, above, temp, value)
    real(rp), intent(in) :: fit(3), from, to, below, above, temp(nlane)
    real(rp), intent(out) :: value(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      value(p) = fit(1)/(min(to, max(from, temp(p))) + fit(2)) + fit(3)
      value(p) = merge(below, merge(above, value(p), temp(p) > to), temp(p) < from)
    end do
  end subroutine fitted

end module physics_law_two_phase_block
