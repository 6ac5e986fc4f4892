! SPDX-License-Identifier: MIT
!> Norton's (1929) power law of creep, without a yield stress: K rate^N with the rate of equivalent
!> plastic strain in 1/s.
module physics_law_norton
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: norton_t

  type, extends(flow_law_t) :: norton_t
    real(rp) :: k = 0.0_rp   !! K, flow stress at a rate of 1/s [Pa]
    real(rp) :: n = 1.0_rp   !! N, exponent of the rate [-]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, prepare, stress
  end type norton_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('NORTON_K', 'real', 1, 'Pa', 'required if LAW = norton', '(0,inf)', &
               'flow stress at a strain rate of 1/s: NORTON_K rate^NORTON_N')
    call t%key('NORTON_N', 'real', 1, '', 'required if LAW = norton', '(0,1]', &
               'exponent of the strain rate')
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(norton_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear

    self%k = input%real('MATERIAL', i, 'NORTON_K')
    self%n = input%real('MATERIAL', i, 'NORTON_N')
    call self%read_melting(input, i, 0.0_rp)
  end subroutine read_keys

  !> Store the melting factor in work(:,1); nothing else depends on temperature.
  subroutine prepare(self, temp, state, work)
    class(norton_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    call self%strength_factor(temp, work(:, 1))
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(norton_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    call evaluate(self%k, self%n, work(:, 1), log_rate, sigma, slope)
  end subroutine stress

  pure subroutine evaluate(k, n, melting_factor, log_rate, sigma, slope)
    real(rp), intent(in) :: k, n, melting_factor(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      sigma(p) = melting_factor(p)*k*exp(n*log_rate(p))
      slope(p) = n*sigma(p)
    end do
  end subroutine evaluate

end module physics_law_norton
