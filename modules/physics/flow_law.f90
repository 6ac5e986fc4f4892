! SPDX-License-Identifier: MIT
!> What a flow law must offer: the flow stress of a batch of particles and its slope; a law with
!> internal variables also advances and describes them.
!> A new law is a type in a file of its own and one line in `materials_flow_laws`; its stress
!> carries the factor of `strength_left`, or falls to zero at melting by itself.
module physics_flow_law
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: flow_law_t

  integer, parameter, public :: n_work = 9   !! reals a law may prepare per particle
  real(rp), parameter, public :: least_rate = 1.0e-6_rp   !! of plastic strain in the yield test of
                                                          !! runs [1/s]

  ! What a law with internal variables warns of, counted by `inspect`.
  integer, parameter, public :: n_validity_warnings = 3
  character(48), parameter, public :: warning_text(n_validity_warnings) = [character(48) :: &
    'deformed faster than TP_RATE0', &
    'would have had a negative dislocation density', &
    'flowed at a temperature outside TP_CALIBRATED']

  ! What a law with internal variables says of the microstructure.
  integer, parameter, public :: n_outputs = 6
  character(24), parameter, public :: law_output(n_outputs) = [character(24) :: &
    'grain_size', 'dislocation_density', 'wall_density', 'interior_density', 'wall_fraction', &
    'recrystallised']
  character(8), parameter, public :: law_unit(n_outputs) = [character(8) :: &
    'm', '1/m2', '1/m2', '1/m2', '1', '1']

  type, abstract :: flow_law_t
    integer :: n_state = 0        !! internal variables of a particle
    logical :: anneals = .false.  !! the state changes with time, not only with strain
    real(rp) :: softens_at = huge(1.0_rp), melts_at = huge(1.0_rp)   !! `strength_left` falls
                                                                     !! between [K]
    real(rp) :: slowest = least_rate   !! rate in the yield test; flow is faster [1/s]
  contains
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

  !> Add to `validity_warnings` the plastic ones of `n` particles that left the law's validity, by
  !> kind; `lane` is the first of each kind.
  subroutine inspect(self, n, temp, rate, state, validity_warnings, lane)
    class(flow_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane), rate(nlane)  !! [K], [1/s]
    real(rp), intent(in) :: state(nlane, self%n_state)
    integer, intent(inout) :: validity_warnings(n_validity_warnings), lane(n_validity_warnings)
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

  !> The outputs named above, of a block.
  pure subroutine describe(self, state, values)
    class(flow_law_t), intent(in) :: self
    real(rp), intent(in) :: state(nlane, self%n_state)
    real(rp), intent(out) :: values(nlane, n_outputs)

    values = 0.0_rp
  end subroutine describe

end module physics_flow_law
