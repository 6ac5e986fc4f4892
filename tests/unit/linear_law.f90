! SPDX-License-Identifier: MIT
!> A flow law that is linear in temperature and in the logarithm of the rate, for tests.
module linear_law
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: linear_t

  !> sigma = base + slope ln(rate) - fall (T - room): with it the closed form is exact.
  type, extends(flow_law_t) :: linear_t
    real(rp) :: base = 0.0_rp, slope = 0.0_rp, fall = 0.0_rp   !! [Pa], [Pa], [Pa/K]
    real(rp) :: room = 300.0_rp                                !! [K]
  contains
    procedure :: prepare
    procedure :: stress
  end type linear_t

contains

  !> work(:,1) = temperature.
  subroutine prepare(self, temp, state, work)
    class(linear_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    work = 0.0_rp
    work(:, 1) = temp
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(linear_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    sigma = self%base + self%slope*log_rate - self%fall*(work(:, 1) - self%room)
    slope = self%slope
  end subroutine stress

end module linear_law
