! SPDX-License-Identifier: MIT
!> Two-phase dislocation law (Estrin et al. 1998; thesis eqs. 6.1-6.15): cells of density rho_c
!> within walls of density rho_w and volume fraction f, in shear rates gdot = M x/dt:
!>   sigma = sigma_0 + M alpha G b (gdot/gdot_0)^(T/A) [f sqrt(rho_w) + (1-f) sqrt(rho_c)]
!> (times the factor that falls to 0 at melting),
!> grain size d = K/sqrt(f rho_w + (1-f) rho_c). Internal variables are u = sqrt(rho_w), rho_c, f,
!> and those of recrystallisation (physics_annealing).
module physics_law_two_phase
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use physics_annealing, only: anneal_block, annealing_t, deformed_density, n_annealing
  use physics_flow_law, only: flow_law_t, law_output_t, max_warnings, n_work
  use physics_law_two_phase_block, only: alpha_star_t, evaluate, integrate, min_density, n_own, &
                                         prepare_block, s_cell, s_fraction, s_wall, w_melting
  implicit none (type, external)
  private

  public :: two_phase_t

  type, extends(flow_law_t) :: two_phase_t
    real(rp) :: sigma0 = 0.0_rp         !! sigma_0 [Pa]
    real(rp) :: taylor = 3.06_rp        !! M, Taylor factor [-]
    real(rp) :: alpha = 0.25_rp
    real(rp) :: shear = 0.0_rp          !! G, shear modulus [Pa]
    real(rp) :: burgers = 0.0_rp        !! b, Burgers vector [m]
    !> beta*, fraction of the dislocations of cells that move into walls [-].
    real(rp) :: beta = 0.0_rp
    real(rp) :: k0 = 0.0_rp
    real(rp) :: a = 1.0_rp, b = 1.0_rp  !! A, B of the rate exponents T/A, T/B [K]
    real(rp) :: rate0 = 1.0e3_rp                              !! gdot_0, reference shear rate [1/s]
    real(rp) :: size = 1.0_rp                                 !! K of the grain size [-]
    !> f_0, f_end and gamma of eq. 6.11 [-].
    real(rp) :: f0 = 0.25_rp, f_end = 0.06_rp, gamma = 3.2_rp
    real(rp) :: walls = 0.0_rp, interior = 0.0_rp             !! initial rho_w, rho_c [1/m2]
    real(rp) :: calibrated(2) = [0.0_rp, huge(1.0_rp)]  !! calibration range of temperatures [K]
    type(alpha_star_t) :: alpha_star
    type(annealing_t) :: annealing
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys
    procedure, nopass :: annealing_keys
    procedure :: outputs
    procedure, nopass :: list_warnings
    procedure :: prepare, stress, advance, inspect, anneal, start, describe
    procedure, private :: coefficients
  end type two_phase_t

  integer, parameter, public :: n_two_phase = n_own, n_two_phase_annealing = n_own + n_annealing

  real(rp), parameter :: margin = 0.5_rp               !! tolerance of the calibration range [K]

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
    type(alpha_star_t) :: star
    type(annealing_t) :: annealing

    call t%key('TP_SIGMA0', 'real', 1, 'Pa', '0 if LAW = two-phase', '[0,inf)', &
               'flow stress without dislocations, sigma_0')
    call t%key('TP_ALPHA', 'real', 1, '', '0.25 if LAW = two-phase', '(0,inf)', &
               'alpha of M alpha G b sqrt(rho); G is the shear modulus of the elastic constants')
    call t%key('TP_BURGERS', 'real', 1, 'm', 'required if LAW = two-phase', '(0,inf)', &
               'Burgers vector, b')
    call t%key('TP_TAYLOR', 'real', 1, '', '3.06 if LAW = two-phase', '(0,inf)', 'Taylor factor, M')
    call t%key('TP_WALLS', 'real', 1, '1/m2', 'required if LAW = two-phase', '(0,inf)', &
               'initial dislocation density in the walls of the subgrains')
    call t%key('TP_INTERIOR', 'real', 1, '1/m2', 'required if LAW = two-phase', '(0,inf)', &
               'initial dislocation density inside the subgrains')
    call t%key('TP_F0', 'real', 1, '', '0.25 if LAW = two-phase', '(0,1)', &
               'initial volume fraction of the cell walls')
    call t%key('TP_F_END', 'real', 1, '', '0.06 if LAW = two-phase', '(0,1)', &
               'volume fraction of the cell walls at large strain')
    call t%key('TP_GAMMA', 'real', 1, '', '3.2 if LAW = two-phase', '(0,inf)', &
               'shear strain in which the difference of the wall fraction to TP_F_END falls '// &
               'by the factor e')
    call t%key('TP_SIZE', 'real', 1, '', 'required if LAW = two-phase', '(0,inf)', &
               'K of the grain size K/sqrt(rho), rho: dislocation density')
    call t%key('TP_BETA', 'real', 1, '', 'required if LAW = two-phase', '[0,inf)', &
               'beta*, coefficient of the storage of dislocations from the interior in the walls')
    call t%key('TP_K0', 'real', 1, '', 'required if LAW = two-phase', '[0,inf)', &
               'coefficient k_0 of dynamic recovery')
    call t%key('TP_A', 'real', 1, 'K', '30000 if LAW = two-phase', '(0,inf)', &
               'A of the exponent 1/m of the shear rate in the flow stress, with m = A/T')
    call t%key('TP_B', 'real', 1, 'K', '14900 if LAW = two-phase', '(0,inf)', &
               'B of the exponent -1/n of the shear rate in dynamic recovery, with n = B/T')
    call t%key('TP_RATE0', 'real', 1, '1/s', '1000 if LAW = two-phase', '(0,inf)', &
               'reference shear rate; shear rates should stay below it')
    call star%add_keys(t)
    call t%key('TP_CALIBRATED', 'real', 2, 'K', '0 1e5 if LAW = two-phase', '[0,inf)', &
      'temperatures between which the law was calibrated; plastic flow outside them is '// &
      'counted and reported')
    call annealing%add_keys(t)
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(two_phase_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear
    real(rp) :: calibrated

    self%sigma0 = input%real('MATERIAL', i, 'TP_SIGMA0')
    self%taylor = input%real('MATERIAL', i, 'TP_TAYLOR')
    self%alpha = input%real('MATERIAL', i, 'TP_ALPHA')
    self%shear = shear
    self%burgers = input%real('MATERIAL', i, 'TP_BURGERS')
    self%beta = input%real('MATERIAL', i, 'TP_BETA')
    self%k0 = input%real('MATERIAL', i, 'TP_K0')
    self%a = input%real('MATERIAL', i, 'TP_A')
    self%b = input%real('MATERIAL', i, 'TP_B')
    self%rate0 = input%real('MATERIAL', i, 'TP_RATE0')
    self%size = input%real('MATERIAL', i, 'TP_SIZE')
    self%f0 = input%real('MATERIAL', i, 'TP_F0')
    self%f_end = input%real('MATERIAL', i, 'TP_F_END')
    self%gamma = input%real('MATERIAL', i, 'TP_GAMMA')
    self%walls = input%real('MATERIAL', i, 'TP_WALLS')
    self%interior = input%real('MATERIAL', i, 'TP_INTERIOR')
    self%calibrated = input%reals('MATERIAL', i, 'TP_CALIBRATED', 2)
    call self%alpha_star%read_keys(input, i)
    call self%annealing%read_keys(input, i)
    self%anneals = self%annealing%is_active()
    self%n_state = merge(n_two_phase_annealing, n_two_phase, self%anneals)
    calibrated = 0.0_rp
    if (input%given('MATERIAL', i, 'TP_CALIBRATED')) calibrated = self%calibrated(2)
    call self%read_melting(input, i, calibrated)
  end subroutine read_keys

  pure function annealing_keys() result(names)
    character(:), allocatable :: names

    names = 'RECOVERY, GROWTH and RECRYSTALLISATION'
  end function annealing_keys

  function outputs(self) result(list)
    class(two_phase_t), intent(in) :: self
    type(law_output_t), allocatable :: list(:)

    allocate (list(6))
    list(1) = law_output_t('grain_size', 'm', has_mean=.true., has_minimum=.true.)
    list(2) = law_output_t('dislocation_density', '1/m2', has_mean=.true.)
    list(3) = law_output_t('wall_density', '1/m2')
    list(4) = law_output_t('interior_density', '1/m2')
    list(5) = law_output_t('wall_fraction', '1', has_mean=.true.)
    list(6) = law_output_t('recrystallised', '1', has_mean=.true., in_frames=self%anneals)
  end function outputs

  pure subroutine list_warnings(texts)
    character(48), allocatable, intent(out) :: texts(:)

    texts = [character(48) :: 'deformed faster than TP_RATE0', &
             'would have had a negative dislocation density', &
             'flowed at a temperature outside TP_CALIBRATED']
  end subroutine list_warnings

  !> Store the rate exponents, the source term of cells, and the state with its root and mean in
  !> `work`.
  subroutine prepare(self, temp, state, work)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)
    real(rp) :: star(nlane)

    call self%alpha_star%evaluate(temp, star)
    call prepare_block(1.0_rp/self%a, 1.0_rp/self%b, 1.0_rp/(sqrt(3.0_rp)*self%burgers), temp, &
                       star, state, work)
    call self%strength_factor(temp, work(:, w_melting))
  end subroutine prepare

  !> Coefficients 6 beta*/(b K), sqrt(3) beta*/(2 b), M alpha G b, ln(M/gdot_0).
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
    call integrate(c, self%k0, self%taylor, self%f_end, self%gamma, work, x, log_rate, state)
    call evaluate(self%sigma0, c, work, log_rate, state, sigma, slope)
  end subroutine stress

  subroutine advance(self, work, x, log_rate, state)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), x(nlane), log_rate(nlane)
    real(rp), intent(inout) :: state(nlane, self%n_state)

    call integrate(self%coefficients(), self%k0, self%taylor, self%f_end, self%gamma, work, x, &
                   log_rate, state)
  end subroutine advance

  subroutine inspect(self, n, temp, rate, state, counts, lane)
    class(two_phase_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane), rate(nlane), state(nlane, self%n_state)
    integer, intent(inout) :: counts(max_warnings), lane(max_warnings)
    integer, parameter :: kinds = 3              ! number of warnings
    real(rp) :: limit
    logical :: is_outside(nlane, kinds)
    integer :: k

    limit = self%rate0/self%taylor
    is_outside(:, 1) = rate > limit
    is_outside(:, 2) = state(:, s_cell) <= min_density
    is_outside(:, 3) = rate > 0.0_rp .and. (temp < self%calibrated(1) - margin &
                                            .or. temp > self%calibrated(2) + margin)
    if (.not. any(is_outside(:n, :))) return
    do k = 1, kinds
      if (lane(k) == 0) lane(k) = findloc(is_outside(:n, k), .true., dim=1)
      counts(k) = counts(k) + count(is_outside(:n, k))
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

  !> Outputs; the grain size is the volume mean of the recrystallised and the deformed part.
  pure subroutine describe(self, state, n, values)
    class(two_phase_t), intent(in) :: self
    real(rp), intent(in) :: state(nlane, self%n_state)
    integer, intent(in) :: n
    real(rp), intent(out) :: values(nlane, n)
    real(rp) :: density(nlane)

    values = 0.0_rp
    density = state(:, s_fraction)*state(:, s_wall)**2 &
              + (1.0_rp - state(:, s_fraction))*state(:, s_cell)
    values(:, 1) = self%size/sqrt(max(density, min_density))
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

end module physics_law_two_phase
