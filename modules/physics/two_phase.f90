! SPDX-License-Identifier: MIT
!> Two-phase dislocation law (Estrin et al. 1998; thesis eqs. 6.1-6.15): cells of density rho_c
!> within walls of density rho_w and volume fraction f, in shear rates gdot = M x/dt:
!>   sigma = sigma_0 + M alpha G b (gdot/gdot_0)^(T/A) [f sqrt(rho_w) + (1-f) sqrt(rho_c)]
!> (times the factor that falls to 0 at melting),
!> grain size d = K/sqrt(f rho_w + (1-f) rho_c). Internal variables: u = sqrt(rho_w), rho_c, f, and
!> what recrystallisation needs (physics_annealing).
module physics_two_phase
  use base_kinds, only: nlane, rp
  use physics_annealing, only: anneal_block, annealing_t, deformed_density, n_annealing
  use physics_flow_law, only: flow_law_t, n_validity_warnings, n_outputs, n_work
  implicit none (type, external)
  private

  public :: two_phase_t, alpha_star_t

  !> alpha*(T): linear between points, constant outside; or a/(T + b) + c between two temperatures
  !> and constants outside.
  type :: alpha_star_t
    real(rp), allocatable :: t(:), value(:)        !! points, at least one: a table [K], [-]
    real(rp) :: fit(3) = [0.0_rp, 1.0_rp, 0.0_rp]  !! a [K], b [K], c
    real(rp) :: from = 0.0_rp, to = huge(1.0_rp)   !! where the fit holds [K]
    real(rp) :: below = 0.0_rp, above = 0.0_rp     !! values outside
  contains
    procedure :: evaluate => evaluate_alpha_star
  end type alpha_star_t

  type, extends(flow_law_t) :: two_phase_t
    real(rp) :: sigma0 = 0.0_rp         !! [Pa]
    real(rp) :: taylor = 3.06_rp        !! M
    real(rp) :: alpha = 0.25_rp
    real(rp) :: shear = 0.0_rp          !! G [Pa]
    real(rp) :: burgers = 0.0_rp        !! b [m]
    real(rp) :: beta = 0.0_rp           !! beta*
    real(rp) :: k0 = 0.0_rp
    real(rp) :: a = 1.0_rp, b = 1.0_rp  !! A, B [K]
    real(rp) :: rate0 = 1.0e3_rp        !! gdot_0 [1/s]
    real(rp) :: size = 1.0_rp           !! K
    real(rp) :: f0 = 0.25_rp, f_end = 0.06_rp, gamma = 3.2_rp   !! of eq. 6.11
    real(rp) :: walls = 0.0_rp, interior = 0.0_rp   !! initial rho_w, rho_c [1/m2]
    real(rp) :: calibrated(2) = [0.0_rp, huge(1.0_rp)]   !! temperatures [K]
    type(alpha_star_t) :: alpha_star
    type(annealing_t) :: annealing
  contains
    procedure :: prepare
    procedure :: stress
    procedure :: advance
    procedure :: inspect
    procedure :: anneal
    procedure :: start
    procedure :: describe
    procedure, private :: coefficients
  end type two_phase_t

  integer, parameter :: s_wall = 1, s_cell = 2, s_fraction = 3, n_own = 3
  integer, parameter, public :: n_two_phase = n_own, n_two_phase_annealing = n_own + n_annealing

  ! Columns of `work`.
  integer, parameter :: w_rate = 1, &    !! 1/m = T/A
                        w_recovery = 2, &  !! 1/n = T/B
                        w_source = 3, &  !! alpha*/(sqrt(3) b) [1/m]
                        w_state = 4, &   !! the internal variables, n_own
                        w_root = 7, &    !! (1 - f)^(-1/3)
                        w_mean = 8, &    !! f sqrt(rho_w) + (1-f) sqrt(rho_c) [1/m]
                        w_left = 9       !! the factor of melting

  real(rp), parameter :: longest_substep = 5.0e-3_rp   !! plastic strain
  real(rp), parameter :: most_strain = 0.5_rp
  real(rp), parameter :: most_exponent = 80.0_rp       !! of k/k0, far from overflow
  real(rp), parameter :: fast = 1.0_rp                 !! k dgamma of a substep at most
  real(rp), parameter :: memory = 60.0_rp         !! k gamma after which densities are new: exp(-30)
  real(rp), parameter :: no_strain = 1.0e-11_rp        !! changes no density by 1e-5 of itself
  real(rp), parameter :: least_density = 1.0_rp        !! [1/m2]
  real(rp), parameter :: margin = 0.5_rp               !! of the calibrated temperatures [K]
  real(rp), parameter :: third = 1.0_rp/3.0_rp

contains

  !> alpha* at each temperature of a block.
  pure subroutine evaluate_alpha_star(self, temp, value)
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
  end subroutine evaluate_alpha_star

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

  !> Exponents, source of cells, and the state with its root and mean.
  subroutine prepare(self, temp, state, work)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)
    real(rp) :: star(nlane)

    call self%alpha_star%evaluate(temp, star)
    call prepare_block(1.0_rp/self%a, 1.0_rp/self%b, 1.0_rp/(sqrt(3.0_rp)*self%burgers), temp, &
                       star, state, work)
    call self%strength_left(temp, work(:, w_left))
  end subroutine prepare

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

  !> 6 beta*/(b K), sqrt(3) beta*/(2 b), M alpha G b, ln(M/gdot_0).
  pure function coefficients(self) result(c)
    class(two_phase_t), intent(in) :: self
    real(rp) :: c(4)

    c = [6.0_rp*self%beta/(self%burgers*self%size), &
         0.5_rp*sqrt(3.0_rp)*self%beta/self%burgers, &
         self%taylor*self%alpha*self%shear*self%burgers, &
         log(self%taylor/self%rate0)]
  end function coefficients

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: state(nlane, n_own), c(4)

    c = self%coefficients()
    call march(c, self%k0, self%taylor, self%f_end, self%gamma, work, x, log_rate, state)
    call evaluate(self%sigma0, c, work, log_rate, state, sigma, slope)
  end subroutine stress

  subroutine advance(self, work, x, log_rate, state)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), x(nlane), log_rate(nlane)
    real(rp), intent(inout) :: state(nlane, self%n_state)

    call march(self%coefficients(), self%k0, self%taylor, self%f_end, self%gamma, work, x, &
               log_rate, state)
  end subroutine advance

  !> Eqs. 6.5, 6.6, 6.11 over the shear M x by the classical Runge-Kutta method, in substeps of
  !> equal length and a last shorter one: the state is continuous in x and knows nothing of other
  !> lanes.
  !> With u = sqrt(rho_w) the equations stay smooth; k dgamma <= 0.4, so nothing is stiff, but at
  !> very low rates of hot metal: see `shorten`. A plastic increment above `most_strain` (a step
  !> that has gone wrong) changes the state as that would.
  pure subroutine march(c, k0, taylor, f_end, gamma, work, x, log_rate, state)
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
    if (most_k*taylor*longest_substep > fast) call shorten(k, taylor, f_end, gamma, longest, &
        span, f, y, n)
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
  end subroutine march

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

  subroutine inspect(self, n, temp, rate, state, validity_warnings, lane)
    class(two_phase_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane), rate(nlane), state(nlane, self%n_state)
    integer, intent(inout) :: validity_warnings(n_validity_warnings), lane(n_validity_warnings)
    real(rp) :: limit
    logical :: is_outside(nlane, n_validity_warnings)
    integer :: k

    limit = self%rate0/self%taylor
    is_outside(:, 1) = rate > limit
    is_outside(:, 2) = state(:, s_cell) <= least_density
    is_outside(:, 3) = rate > 0.0_rp .and. (temp < self%calibrated(1) - margin &
                                            .or. temp > self%calibrated(2) + margin)
    if (.not. any(is_outside(:n, :))) return
    do k = 1, n_validity_warnings
      if (lane(k) == 0) lane(k) = findloc(is_outside(:n, k), .true., dim=1)
      validity_warnings(k) = validity_warnings(k) + count(is_outside(:n, k))
    end do
  end subroutine inspect

  subroutine anneal(self, dt, temp, rate, state)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: dt, temp(nlane), rate(nlane)
    real(rp), intent(inout) :: state(nlane, self%n_state)

    if (.not. self%anneals) return
    call anneal_block(self%annealing, dt, 0.5_rp*self%shear*self%burgers**2, self%size, &
                      self%walls, self%interior, temp, rate, state(1, s_wall), &
                      state(1, s_cell), state(1, s_fraction), state(1, n_own + 1))
  end subroutine anneal

  pure subroutine start(self, state)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(out) :: state(self%n_state)

    state = 0.0_rp
    state(1:n_own) = [sqrt(self%walls), self%interior, self%f0]
  end subroutine start

  !> The grain size is the mean by volume of what is recrystallised and what is not.
  pure subroutine describe(self, state, values)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: state(nlane, self%n_state)
    real(rp), intent(out) :: values(nlane, n_outputs)
    real(rp) :: density(nlane)

    values = 0.0_rp
    density = state(:, s_fraction)*state(:, s_wall)**2 &
              + (1.0_rp - state(:, s_fraction))*state(:, s_cell)
    values(:, 1) = self%size/sqrt(max(density, least_density))
    values(:, 2) = density
    values(:, 3) = state(:, s_wall)**2
    values(:, 4) = state(:, s_cell)
    values(:, 5) = state(:, s_fraction)
    if (.not. self%anneals) return
    associate (x => state(:, n_own + 1))
      density = deformed_density(density, state(:, s_fraction)*self%walls &
                                          + (1.0_rp - state(:, s_fraction))*self%interior, x)
      values(:, 1) = (1.0_rp - x)*self%size/sqrt(density) + x*state(:, n_own + 2)
      values(:, 6) = x
    end associate
  end subroutine describe

end module physics_two_phase
