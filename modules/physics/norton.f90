! SPDX-License-Identifier: MIT
!> Norton's (1929) power law of creep, without a yield stress: K rate^N with the rate of equivalent
!> plastic strain in 1/s.
module physics_norton
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: norton_t

  type, extends(flow_law_t) :: norton_t
    real(rp) :: k = 0.0_rp   !! flow stress at a rate of 1/s [Pa]
    real(rp) :: n = 1.0_rp   !! exponent of the rate
  contains
    procedure :: prepare
    procedure :: stress
  end type norton_t

contains

  !> work(:,1): the factor of melting; nothing else depends on temperature.
  subroutine prepare(self, temp, state, work)
    class(norton_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    call self%strength_left(temp, work(:, 1))
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(norton_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    call evaluate(self%k, self%n, work(:, 1), log_rate, sigma, slope)
  end subroutine stress

  pure subroutine evaluate(k, n, left, log_rate, sigma, slope)
    real(rp), intent(in) :: k, n, left(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      sigma(p) = left(p)*k*exp(n*log_rate(p))
      slope(p) = n*sigma(p)
    end do
  end subroutine evaluate

end module physics_norton
