! SPDX-License-Identifier: MIT
!> Interface of flow laws: flow stress of a batch of particles and its derivative, and the keys of
!> &MATERIAL; a law with internal variables also advances them. A law defines its own microstructure
!> outputs and warnings. A new law is a type in a file `law_NAME.f90` of this folder and a
!> name in `physics_laws`; its stress includes the factor of `strength_factor`, or vanishes at
!> melting by itself.
module physics_flow_law
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: flow_law_t, law_output_t, softening_from

  integer, parameter, public :: n_work = 9  !! reals that a law may precompute per particle
  integer, parameter, public :: max_warnings = 8              !! kinds of warnings of a law
  integer, parameter, public :: max_points = 64               !! points of a table in one variable
  !> Smallest plastic strain rate, at which yield is tested [1/s].
  real(rp), parameter, public :: default_min_rate = 1.0e-6_rp

  !> A quantity of the particle state that a law outputs.
  type :: law_output_t
    character(24) :: name = ''
    character(8) :: unit = ''
    logical :: in_frames = .true.
    logical :: has_mean = .false.     !! history column: mean over the stirred particles
    logical :: has_minimum = .false.  !! history column: minimum of all particles above 0
  end type law_output_t

  type, abstract :: flow_law_t
    integer :: n_state = 0        !! internal variables per particle
    logical :: anneals = .false.  !! the state changes with time, not only with strain
    !> Temperatures between which `strength_factor` decreases from 1 to 0 [K].
    real(rp) :: softens_at = huge(1.0_rp), melts_at = huge(1.0_rp)
    !> Smallest plastic strain rate, at which yield is tested [1/s].
    real(rp) :: min_rate = default_min_rate
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys
    procedure, non_overridable :: read_melting
    procedure, nopass :: has_own_melting, annealing_keys
    procedure :: outputs
    procedure, nopass :: list_warnings
    procedure(prepare_interface), deferred :: prepare
    procedure(stress_interface), deferred :: stress
    procedure, non_overridable :: strength_factor
    procedure :: advance, inspect, anneal, start, describe
  end type flow_law_t

  abstract interface
    !> Precompute quantities that depend on temperature and state only, once per step.
    subroutine prepare_interface(self, temp, state, work)
      import :: flow_law_t, nlane, n_work, rp
      implicit none (type, external)
      class(flow_law_t), intent(in) :: self
      real(rp), intent(in) :: temp(nlane)             !! temperature [K]
      real(rp), intent(in) :: state(nlane, self%n_state)
      real(rp), intent(out) :: work(nlane, n_work)
    end subroutine prepare_interface

    !> Flow stress at plastic strain alpha + x and rate x/dt, with the state advanced by x, and its
    !> derivative by ln x.
    subroutine stress_interface(self, work, alpha, x, log_rate, sigma, slope)
      import :: flow_law_t, nlane, n_work, rp
      implicit none (type, external)
      class(flow_law_t), intent(in) :: self
      real(rp), intent(in) :: work(nlane, n_work)
      real(rp), intent(in) :: alpha(nlane)            !! plastic strain at the start of the step
      real(rp), intent(in) :: x(nlane)                !! plastic strain increment
      real(rp), intent(in) :: log_rate(nlane)         !! ln(x/dt) [ln 1/s]
      real(rp), intent(out) :: sigma(nlane)           !! flow stress [Pa]
      real(rp), intent(out) :: slope(nlane)           !! d sigma / d ln x [Pa]
    end subroutine stress_interface
  end interface

contains

  !> Add the keys of the law to &MATERIAL.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
  end subroutine add_keys

  !> Read the constants of the `i`-th &MATERIAL.
  subroutine read_keys(self, input, i, shear)
    class(flow_law_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear                     !! shear modulus of the material [Pa]
  end subroutine read_keys

  !> Set the melting range of a law without melting of its own: the strength decreases to 0 over the
  !> last twentieth of T_MELT, if given, but not below `calibrated`, the highest temperature of the
  !> calibration of the law.
  subroutine read_melting(self, input, i, calibrated)
    class(flow_law_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: calibrated  !! highest temperature of the calibration [K]; 0: none
    logical :: is_given

    is_given = input%given('MATERIAL', i, 'T_MELT')
    if (.not. is_given) return
    self%melts_at = input%real('MATERIAL', i, 'T_MELT')
    self%softens_at = softening_from(self%melts_at, calibrated)
  end subroutine read_melting

  !> True if the formula of the law itself decreases from T_ROOM to 0 at T_MELT.
  pure logical function has_own_melting()
    has_own_melting = .false.
  end function has_own_melting

  !> Names of the keys of the annealing of the law, as text.
  pure function annealing_keys() result(names)
    character(:), allocatable :: names

    names = 'LAW'
  end function annealing_keys

  !> List of the outputs of the law.
  function outputs(self) result(list)
    class(flow_law_t), intent(in) :: self
    type(law_output_t), allocatable :: list(:)

    allocate (list(0))
  end function outputs

  !> Texts of the warnings of the law, to follow the word `particles`: at most `max_warnings`.
  pure subroutine list_warnings(texts)
    character(48), allocatable, intent(out) :: texts(:)

    allocate (texts(0))
  end subroutine list_warnings

  !> Factor of the strength near melting: 1 up to `softens_at`, 0 from `melts_at` on.
  pure subroutine strength_factor(self, temp, factor)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane)               !! temperatures [K]
    real(rp), intent(out) :: factor(nlane)
    real(rp) :: melts_at, scale
    integer :: p

    factor = 1.0_rp
    if (self%melts_at >= huge(1.0_rp)) return
    melts_at = self%melts_at
    scale = 1.0_rp/(melts_at - self%softens_at)
    !$omp simd
    do p = 1, nlane
      factor(p) = max(0.0_rp, min(1.0_rp, (melts_at - temp(p))*scale))
    end do
  end subroutine strength_factor

  !> Advance the internal variables by the plastic increment `x` at the rate exp(log_rate); x = 0
  !> leaves them unchanged.
  subroutine advance(self, work, x, log_rate, state)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work)       !! set by `prepare` before the increment
    real(rp), intent(in) :: x(nlane), log_rate(nlane)
    real(rp), intent(inout) :: state(nlane, self%n_state)
  end subroutine advance

  !> Count the plastic ones of `n` particles outside the validity range of the law, in the order of
  !> `list_warnings`; `lane` is the first of each kind.
  subroutine inspect(self, n, temp, rate, state, counts, lane)
    class(flow_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane), rate(nlane)  !! temperature [K], plastic strain rate [1/s]
    real(rp), intent(in) :: state(nlane, self%n_state)
    integer, intent(inout) :: counts(max_warnings), lane(max_warnings)
  end subroutine inspect

  !> Static changes of the state over `dt` at a temperature (recovery, recrystallisation, growth).
  subroutine anneal(self, dt, temp, rate, state)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: dt                        !! time step [s]
    real(rp), intent(in) :: temp(nlane), rate(nlane)  !! temperature [K], plastic strain rate [1/s]
    real(rp), intent(inout) :: state(nlane, self%n_state)
  end subroutine anneal

  !> Internal variables of undeformed material.
  pure subroutine start(self, state)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(out) :: state(self%n_state)

    state = 0.0_rp
  end subroutine start

  !> Values of the `n` outputs of a block.
  pure subroutine describe(self, state, n, values)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: state(nlane, self%n_state)
    integer, intent(in) :: n
    real(rp), intent(out) :: values(nlane, n)

    values = 0.0_rp
  end subroutine describe

  !> Temperature above which strength decreases to 0 at `t_melt` [K]: the last twentieth of it, but
  !> not below the highest temperature `calibrated` of the law.
  pure real(rp) function softening_from(t_melt, calibrated)
    real(rp), intent(in) :: t_melt, calibrated

    softening_from = max(0.95_rp*t_melt, min(calibrated, 0.999_rp*t_melt))
  end function softening_from

end module physics_flow_law
