! SPDX-License-Identifier: MIT
!> What a flow law must offer: the flow stress of a batch of particles and its slope, and the keys
!> of &MATERIAL that describe it; a law with internal variables also advances them. A law says what
!> it writes of the microstructure and what it warns of, by its own names.
!> A new law is a type in a file of `flow_laws` and one line in `flow_laws_list`; its stress carries
!> the factor of `strength_left`, or falls to zero at melting by itself.
module physics_flow_law
  use base_kinds, only: nlane, rp
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: flow_law_t, law_output_t, softening_from

  integer, parameter, public :: n_work = 9   !! reals a law may prepare per particle
  integer, parameter, public :: most_warnings = 8   !! kinds of warnings of a law
  integer, parameter, public :: most_points = 64    !! of a table in one variable
  real(rp), parameter, public :: least_rate = 1.0e-6_rp   !! of plastic strain in the yield test of
                                                          !! runs [1/s]

  !> A quantity that a law writes of the state of each particle.
  type :: law_output_t
    character(24) :: name = ''
    character(8) :: unit = ''
    logical :: in_frames = .true.
    logical :: has_mean = .false.    !! in the history: over what is stirred
    logical :: has_least = .false.   !! in the history: of all particles above 0
  end type law_output_t

  type, abstract :: flow_law_t
    integer :: n_state = 0        !! internal variables of a particle
    logical :: anneals = .false.  !! the state changes with time, not only with strain
    real(rp) :: softens_at = huge(1.0_rp), melts_at = huge(1.0_rp)   !! `strength_left` falls
                                                                     !! between [K]
    real(rp) :: slowest = least_rate   !! rate in the yield test; flow is faster [1/s]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys
    procedure, non_overridable :: read_melting
    procedure, nopass :: knows_melting
    procedure, nopass :: annealing_keys
    procedure :: outputs
    procedure, nopass :: list_warnings
    procedure(prepare_interface), deferred :: prepare
    procedure(stress_interface), deferred :: stress
    procedure, non_overridable :: strength_left
    procedure :: advance
    procedure :: inspect
    procedure :: anneal
    procedure :: start
    procedure :: describe
  end type flow_law_t

  abstract interface
    !> What depends on temperature and state alone, once a step.
    subroutine prepare_interface(self, temp, state, work)
      import :: flow_law_t, nlane, n_work, rp
      implicit none (type, external)
      class(flow_law_t), intent(in) :: self
      real(rp), intent(in) :: temp(nlane)             !! temperature [K]
      real(rp), intent(in) :: state(nlane, self%n_state)
      real(rp), intent(out) :: work(nlane, n_work)
    end subroutine prepare_interface

    !> Flow stress at plastic strain alpha + x and rate x/dt, the state advanced by x, and its
    !> derivative by ln x.
    subroutine stress_interface(self, work, alpha, x, log_rate, sigma, slope)
      import :: flow_law_t, nlane, n_work, rp
      implicit none (type, external)
      class(flow_law_t), intent(in) :: self
      real(rp), intent(in) :: work(nlane, n_work)
      real(rp), intent(in) :: alpha(nlane)            !! plastic strain at the step's start
      real(rp), intent(in) :: x(nlane)                !! its increment
      real(rp), intent(in) :: log_rate(nlane)         !! ln(x/dt) [ln 1/s]
      real(rp), intent(out) :: sigma(nlane)           !! [Pa]
      real(rp), intent(out) :: slope(nlane)           !! d sigma / d ln x [Pa]
    end subroutine stress_interface
  end interface

contains

  !> Add the rows of its keys to &MATERIAL.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
  end subroutine add_keys

  !> Read the constants of the `i`-th &MATERIAL.
  subroutine read_keys(self, input, i, shear, diagnostics)
    class(flow_law_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear                     !! modulus of the material [Pa]
    type(diagnostics_t), intent(inout) :: diagnostics
  end subroutine read_keys

  !> The strength of a law without melting falls to 0 over the last twentieth of T_MELT, if
  !> that is given, but not below the highest temperature that the law is `calibrated` for.
  subroutine read_melting(self, input, i, calibrated)
    class(flow_law_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: calibrated                !! 0: for none [K]
    logical :: is_given

    is_given = input%given('MATERIAL', i, 'T_MELT')
    if (.not. is_given) return
    self%melts_at = input%real('MATERIAL', i, 'T_MELT')
    self%softens_at = softening_from(self%melts_at, calibrated)
  end subroutine read_melting

  !> True if its own formula falls from T_ROOM to nothing at T_MELT.
  pure logical function knows_melting()
    knows_melting = .false.
  end function knows_melting

  !> The keys by which it anneals, in words.
  pure function annealing_keys() result(names)
    character(:), allocatable :: names

    names = 'LAW'
  end function annealing_keys

  !> What it writes.
  function outputs(self) result(list)
    class(flow_law_t), intent(in) :: self
    type(law_output_t), allocatable :: list(:)

    allocate (list(0))
  end function outputs

  !> What it warns of, behind 'particles': at most `most_warnings`.
  pure subroutine list_warnings(texts)
    character(48), allocatable, intent(out) :: texts(:)

    allocate (texts(0))
  end subroutine list_warnings

  !> Part of the strength that nearness to melting leaves: 1 up to `softens_at`, 0 from `melts_at`
  !> on.
  pure subroutine strength_left(self, temp, factor)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane)               !! [K]
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
  end subroutine strength_left

  !> Internal variables after the plastic increment `x` at rate exp(log_rate); x = 0 keeps them.
  subroutine advance(self, work, x, log_rate, state)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work)       !! of `prepare` before the increment
    real(rp), intent(in) :: x(nlane), log_rate(nlane)
    real(rp), intent(inout) :: state(nlane, self%n_state)
  end subroutine advance

  !> Add to `counts` the plastic ones of `n` particles that left the law's validity, in the order of
  !> `list_warnings`; `lane` is the first of each kind.
  subroutine inspect(self, n, temp, rate, state, counts, lane)
    class(flow_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane), rate(nlane)  !! [K], [1/s]
    real(rp), intent(in) :: state(nlane, self%n_state)
    integer, intent(inout) :: counts(most_warnings), lane(most_warnings)
  end subroutine inspect

  !> What `dt` at a temperature does to the state by itself (recovery, recrystallisation, growth).
  subroutine anneal(self, dt, temp, rate, state)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: dt                        !! [s]
    real(rp), intent(in) :: temp(nlane), rate(nlane)  !! [K], [1/s]
    real(rp), intent(inout) :: state(nlane, self%n_state)
  end subroutine anneal

  !> Internal variables of undeformed material.
  pure subroutine start(self, state)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(out) :: state(self%n_state)

    state = 0.0_rp
  end subroutine start

  !> The `n` outputs of a block.
  pure subroutine describe(self, state, n, values)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: state(nlane, self%n_state)
    integer, intent(in) :: n
    real(rp), intent(out) :: values(nlane, n)

    values = 0.0_rp
  end subroutine describe

  !> Temperature from which strength falls to 0 at `t_melt`: the last twentieth, but not where the
  !> law is `calibrated` [K].
  pure real(rp) function softening_from(t_melt, calibrated)
    real(rp), intent(in) :: t_melt, calibrated

    softening_from = max(0.95_rp*t_melt, min(calibrated, 0.999_rp*t_melt))
  end function softening_from

end module physics_flow_law
