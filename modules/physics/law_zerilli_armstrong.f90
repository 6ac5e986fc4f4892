! SPDX-License-Identifier: MIT
!> Zerilli & Armstrong (1987), face- and body-centred metals in one:
!> sigma = C0 + (C1 + C2 sqrt(eps)) exp(-C3 T + C4 T ln rate) + C5 eps^n, rate in 1/s.
module physics_law_zerilli_armstrong
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: zerilli_armstrong_t

  type, extends(flow_law_t) :: zerilli_armstrong_t
    real(rp) :: c0 = 0.0_rp, c1 = 0.0_rp, c2 = 0.0_rp   !! C0, C1, C2 [Pa]
    real(rp) :: c3 = 0.0_rp, c4 = 0.0_rp                !! C3, C4 [1/K]
    real(rp) :: c5 = 0.0_rp, n = 0.5_rp                 !! C5 [Pa], n [-]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, prepare, stress
  end type zerilli_armstrong_t

  real(rp), parameter :: min_strain = 1.0e-9_rp

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('ZA_C0', 'real', 1, 'Pa', 'required if LAW = zerilli-armstrong', '[0,inf)', &
               'sigma = C0 + (C1 + C2 sqrt(eps)) exp(-C3 T + C4 T ln(rate)) + C5 eps^N')
    call t%key('ZA_C1', 'real', 1, 'Pa', '0 if LAW = zerilli-armstrong', '[0,inf)', &
               'stress C1 of the equation of ZA_C0: for body-centred metals')
    call t%key('ZA_C2', 'real', 1, 'Pa', '0 if LAW = zerilli-armstrong', '[0,inf)', &
               'stress C2 of the equation of ZA_C0: for face-centred metals')
    call t%key('ZA_C3', 'real', 1, '1/K', 'required if LAW = zerilli-armstrong', '[0,inf)', &
               'coefficient C3 of thermal softening')
    call t%key('ZA_C4', 'real', 1, '1/K', 'required if LAW = zerilli-armstrong', '[0,inf)', &
               'coefficient C4 of the sensitivity to the strain rate')
    call t%key('ZA_C5', 'real', 1, 'Pa', '0 if LAW = zerilli-armstrong', '[0,inf)', &
               'coefficient C5 of athermal hardening')
    call t%key('ZA_N', 'real', 1, '', '0.5 if LAW = zerilli-armstrong', '(0,1]', &
               'exponent N of athermal hardening')
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(zerilli_armstrong_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear

    self%c0 = input%real('MATERIAL', i, 'ZA_C0')
    self%c1 = input%real('MATERIAL', i, 'ZA_C1')
    self%c2 = input%real('MATERIAL', i, 'ZA_C2')
    self%c3 = input%real('MATERIAL', i, 'ZA_C3')
    self%c4 = input%real('MATERIAL', i, 'ZA_C4')
    self%c5 = input%real('MATERIAL', i, 'ZA_C5')
    self%n = input%real('MATERIAL', i, 'ZA_N')
    call self%read_melting(input, i, 0.0_rp)
  end subroutine read_keys

  !> Store work(:,1) = C4 T, work(:,2) = exp(-C3 T), and the melting factor in work(:,3).
  subroutine prepare(self, temp, state, work)
    class(zerilli_armstrong_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    work(:, 1) = self%c4*temp
    work(:, 2) = exp(-self%c3*temp)
    call self%strength_factor(temp, work(:, 3))
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(zerilli_armstrong_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    call evaluate([self%c0, self%c1, self%c2, self%c5], self%n, work, alpha, x, log_rate, sigma, &
                  slope)
  end subroutine stress

  pure subroutine evaluate(c, n, work, alpha, x, log_rate, sigma, slope)
    real(rp), intent(in) :: c(4), n, work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: e, root, hard, factor
    integer :: p

    !$omp simd private(e, root, hard, factor)
    do p = 1, nlane
      e = alpha(p) + x(p) + min_strain
      root = c(3)*sqrt(e)
      hard = c(4)*exp(n*log(e))
      factor = work(p, 2)*exp(work(p, 1)*log_rate(p))
      sigma(p) = work(p, 3)*(c(1) + (c(2) + root)*factor + hard)
      slope(p) = work(p, 3)*(x(p)/e*(0.5_rp*root*factor + n*hard) + (c(2) + root)*factor*work(p, 1))
    end do
  end subroutine evaluate

end module physics_law_zerilli_armstrong
