! SPDX-License-Identifier: MIT
!> Johnson & Cook (1983): (A + B alpha^n)(1 + C ln(rate/rate0))(1 - theta^m); the rate factor goes
!> on below rate0 and is held at 1/2, the stress is zero from the melting temperature on.
module physics_johnson_cook
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: johnson_cook_t

  type, extends(flow_law_t) :: johnson_cook_t
    real(rp) :: a = 0.0_rp, b = 0.0_rp, n = 1.0_rp   !! [Pa], [Pa], [-]
    real(rp) :: c = 0.0_rp, m = 1.0_rp               !! [-], [-]
    real(rp) :: rate0 = 1.0_rp                       !! [1/s]
    real(rp) :: t_room = 298.0_rp, t_melt = huge(1.0_rp)   !! [K]
  contains
    procedure :: prepare
    procedure :: stress
  end type johnson_cook_t

  real(rp), parameter :: least_strain = 1.0e-9_rp

contains

  !> work(:,1) = 1 - theta^m.
  subroutine prepare(self, temp, state, work)
    class(johnson_cook_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    call softening(self%m, self%t_room, 1.0_rp/(self%t_melt - self%t_room), temp, work(:, 1))
  end subroutine prepare

  pure subroutine softening(m, t_room, scale, temp, factor)
    real(rp), intent(in) :: m, t_room, scale, temp(nlane)
    real(rp), intent(out) :: factor(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      factor(p) = 1.0_rp - exp(m*log(min(1.0_rp, max(1.0e-30_rp, (temp(p) - t_room)*scale))))
    end do
  end subroutine softening

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(johnson_cook_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    call evaluate(self%a, self%b, self%n, self%c, log(self%rate0), work(:, 1), alpha, x, log_rate, &
                  sigma, slope)
  end subroutine stress

  pure subroutine evaluate(a, b, n, c, log_rate0, soft, alpha, x, log_rate, sigma, slope)
    real(rp), intent(in) :: a, b, n, c, log_rate0
    real(rp), intent(in) :: soft(nlane), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: e, hard, factor, rated
    integer :: p

    !$omp simd private(e, hard, factor, rated)
    do p = 1, nlane
      e = alpha(p) + x(p) + least_strain
      hard = b*exp(n*log(e))
      rated = 1.0_rp + c*(log_rate(p) - log_rate0)
      factor = max(0.5_rp, rated)
      sigma(p) = (a + hard)*factor*soft(p)
      slope(p) = (n*hard*x(p)/e*factor + (a + hard)*merge(c, 0.0_rp, rated > 0.5_rp))*soft(p)
    end do
  end subroutine evaluate

end module physics_johnson_cook
