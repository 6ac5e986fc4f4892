! SPDX-License-Identifier: MIT
!> Johnson & Cook (1983): (A + B alpha^n)(1 + C ln(rate/rate0))(1 - theta^m); the rate factor
!> continues below rate0 down to 1/2, the stress is zero from the melting temperature on. Optionally
!> hardening ends at a strain: B alpha^n was fitted to strains up to 1, and stirred metal reaches
!> 100.
module physics_law_johnson_cook
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: johnson_cook_t, softening_law_t

  !> A law with the rate and temperature factors (1 + C ln(rate/rate0)) (1 - theta^m).
  type, abstract, extends(flow_law_t) :: softening_law_t
    real(rp) :: c = 0.0_rp, m = 1.0_rp                    !! C and m [-]
    real(rp) :: rate0 = 1.0_rp                            !! rate0, reference rate [1/s]
    !> Temperatures of theta = 0 and theta = 1 [K].
    real(rp) :: t_room = 298.0_rp, t_melt = huge(1.0_rp)
  contains
    procedure, non_overridable :: read_softening
    procedure, nopass :: has_own_melting
    procedure :: prepare
  end type softening_law_t

  type, extends(softening_law_t) :: johnson_cook_t
    real(rp) :: a = 0.0_rp, b = 0.0_rp, n = 1.0_rp        !! A [Pa], B [Pa], n [-]
    real(rp) :: max_strain = huge(1.0_rp)                 !! strain at which hardening ends
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, stress
  end type johnson_cook_t

  real(rp), parameter :: min_strain = 1.0e-9_rp
  character(*), parameter :: with_law = ' if LAW = johnson-cook or hot-working'

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('JC_A', 'real', 1, 'Pa', 'required'//with_law, '(0,inf)', &
               'initial yield stress at T_ROOM and JC_RATE0')
    call t%key('JC_B', 'real', 1, 'Pa', 'required'//with_law, '[0,inf)', &
               'hardening modulus')
    call t%key('JC_N', 'real', 1, '', 'required'//with_law, '[0,inf)', &
               'hardening exponent')
    call t%key('JC_C', 'real', 1, '', 'required'//with_law, '[0,inf)', &
               'sensitivity to the strain rate')
    call t%key('JC_M', 'real', 1, '', 'required'//with_law, '(0,inf)', &
               'exponent of thermal softening')
    call t%key('JC_RATE0', 'real', 1, '1/s', '1'//with_law, '(0,inf)', &
               'reference strain rate')
    call t%key('JC_STRAIN_LIMIT', 'real', 1, '', '0'//with_law, '[0,inf)', &
               'plastic strain above which the metal does not harden further; 0: no limit')
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(johnson_cook_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear

    self%a = input%real('MATERIAL', i, 'JC_A')
    self%b = input%real('MATERIAL', i, 'JC_B')
    self%n = input%real('MATERIAL', i, 'JC_N')
    self%c = input%real('MATERIAL', i, 'JC_C')
    self%m = input%real('MATERIAL', i, 'JC_M')
    self%rate0 = input%real('MATERIAL', i, 'JC_RATE0')
    self%max_strain = input%real('MATERIAL', i, 'JC_STRAIN_LIMIT')
    if (self%max_strain <= 0.0_rp) self%max_strain = huge(1.0_rp)
    call self%read_softening(input, i)
  end subroutine read_keys

  !> Read the temperatures of the `i`-th &MATERIAL between which strength decreases to 0 [K].
  subroutine read_softening(self, input, i)
    class(softening_law_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    self%t_room = input%real('MATERIAL', i, 'T_ROOM')
    self%t_melt = input%real('MATERIAL', i, 'T_MELT')
    if (self%t_melt > 0.0_rp .and. self%t_melt <= self%t_room) then
      call input%report('MATERIAL', i, 'T_MELT', 'must be above T_ROOM')
    end if
  end subroutine read_softening

  !> True, as strength decreases from T_ROOM to 0 at T_MELT.
  pure logical function has_own_melting()
    has_own_melting = .true.
  end function has_own_melting

  !> Store the temperature factor 1 - theta^m in work(:, 1).
  subroutine prepare(self, temp, state, work)
    class(softening_law_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    call softening(self%m, self%t_room, self%t_melt, temp, work(:, 1))
  end subroutine prepare

  !> Factor 1 - theta^m, with theta rising from 0 at `t_room` to 1 at `t_melt` [K].
  pure subroutine softening(m, t_room, t_melt, temp, factor)
    real(rp), intent(in) :: m, t_room, t_melt, temp(nlane)
    real(rp), intent(out) :: factor(nlane)
    real(rp) :: scale
    integer :: p

    scale = 1.0_rp/(t_melt - t_room)
    !$omp simd
    do p = 1, nlane
      factor(p) = 1.0_rp - exp(m*log(min(1.0_rp, max(1.0e-30_rp, (temp(p) - t_room)*scale))))
    end do
  end subroutine softening

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(johnson_cook_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    call evaluate(self%a, self%b, self%n, self%c, log(self%rate0), self%max_strain, work(:, 1), &
                  alpha, x, log_rate, sigma, slope)
  end subroutine stress

  pure subroutine evaluate(a, b, n, c, log_rate0, max_strain, soft, alpha, x, log_rate, sigma, &
                           slope)
    real(rp), intent(in) :: a, b, n, c, log_rate0, max_strain
    real(rp), intent(in) :: soft(nlane), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: e, hard, factor, hardening_ratio, rate_factor
    integer :: p

    !$omp simd private(e, hard, factor, hardening_ratio, rate_factor)
    do p = 1, nlane
      e = min(alpha(p) + x(p) + min_strain, max_strain)
      hardening_ratio = merge(x(p)/e, 0.0_rp, e < max_strain)
      hard = b*exp(n*log(e))
      rate_factor = 1.0_rp + c*(log_rate(p) - log_rate0)
      factor = max(0.5_rp, rate_factor)
      sigma(p) = (a + hard)*factor*soft(p)
      slope(p) = (n*hard*hardening_ratio*factor + (a + hard) &
                  *merge(c, 0.0_rp, rate_factor > 0.5_rp))*soft(p)
    end do
  end subroutine evaluate

end module physics_law_johnson_cook
