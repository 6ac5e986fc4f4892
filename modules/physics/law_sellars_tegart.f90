! SPDX-License-Identifier: MIT
!> Sellars & Tegart (1966), steady flow in hot working: sigma = asinh((Z/A)^(1/n))/alpha with
!> Z = rate exp(Q/(R T)) (Zener & Hollomon 1944).
module physics_law_sellars_tegart
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: sellars_tegart_t

  type, extends(flow_law_t) :: sellars_tegart_t
    !> alpha, inverse of the stress where the power law breaks down [1/Pa].
    real(rp) :: alpha = 1.0_rp
    real(rp) :: n = 1.0_rp
    real(rp) :: log_a = 0.0_rp         !! ln A, with A in 1/s
    real(rp) :: q = 0.0_rp             !! Q, activation energy [J/mol]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, prepare, stress
  end type sellars_tegart_t

  character(*), parameter :: required = 'required if LAW = sellars-tegart or hot-working'
  real(rp), parameter :: gas_constant = 8.314462618_rp   !! [J/(mol K)]

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('ST_ALPHA', 'real', 1, '1/Pa', required, '(0,inf)', &
               'sigma = asinh((Z/A)^(1/n))/alpha, Z = rate exp(Q/(R T))')
    call t%key('ST_N', 'real', 1, '', required, '[1,inf)', &
               'stress exponent n of the equation of ST_ALPHA')
    call t%key('ST_LN_A', 'real', 1, '', required, '', 'ln A, A in 1/s')
    call t%key('ST_Q', 'real', 1, 'J/mol', required, '[0,inf)', &
               'activation energy')
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(sellars_tegart_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear

    self%alpha = input%real('MATERIAL', i, 'ST_ALPHA')
    self%n = input%real('MATERIAL', i, 'ST_N')
    self%log_a = input%real('MATERIAL', i, 'ST_LN_A')
    self%q = input%real('MATERIAL', i, 'ST_Q')
    call self%read_melting(input, i, 0.0_rp)
  end subroutine read_keys

  !> Store work(:,1) = Q/(R T) - ln A and the melting factor in work(:,2).
  subroutine prepare(self, temp, state, work)
    class(sellars_tegart_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    work(:, 1) = self%q/(gas_constant*max(temp, 1.0_rp)) - self%log_a
    call self%strength_factor(temp, work(:, 2))
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(sellars_tegart_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    call evaluate(1.0_rp/self%alpha, 1.0_rp/self%n, work, log_rate, sigma, slope)
  end subroutine stress

  !> Evaluate asinh(w) = ln(w + sqrt(1 + w^2)), from ln w above 1e4 and as w below 1e-4, where the
  !> logarithm would overflow or lose digits.
  pure subroutine evaluate(scale, per_n, work, log_rate, sigma, slope)
    real(rp), intent(in) :: scale, per_n, work(nlane, n_work), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: log_w, w, root, value
    integer :: p

    !$omp simd private(log_w, w, root, value)
    do p = 1, nlane
      log_w = per_n*(log_rate(p) + work(p, 1))
      w = exp(min(log_w, 20.0_rp))
      root = sqrt(1.0_rp + w*w)
      value = merge(w, log(w + root), w < 1.0e-4_rp)
      value = merge(log_w + log(2.0_rp), value, w > 1.0e4_rp)
      sigma(p) = work(p, 2)*scale*value
      slope(p) = work(p, 2)*scale*per_n*w/root
    end do
  end subroutine evaluate

end module physics_law_sellars_tegart
