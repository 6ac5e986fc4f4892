! SPDX-License-Identifier: MIT
!> Saturating hardening, Voce (1948), with the rate and temperature factors of Johnson & Cook, and
!> optionally the decrease to a steady stress by dynamic recrystallisation above a critical strain
!> (kinetics of Laasraoui & Jonas 1991):
!>
!>   sigma = s(eps) (1 + C ln(rate/rate0)) (1 - theta^m),
!>   s = s_s - (s_s - s_0) exp(-eps/e_0) - (s_s - s_d)(1 - exp(-((eps - e_c)/e_d)^n)),
!>
!> theta increases from 0 at T_ROOM to 1 at T_MELT; the rate factor is at least one half.
module physics_law_voce
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use physics_flow_law, only: n_work
  use physics_law_johnson_cook, only: softening_law_t
  implicit none (type, external)
  private

  public :: voce_t

  type, extends(softening_law_t) :: voce_t
    real(rp) :: initial = 0.0_rp, saturation = 0.0_rp         !! s_0 and s_s [Pa]
    real(rp) :: strain = 1.0_rp                               !! e_0 [-]
    real(rp) :: steady = 0.0_rp  !! s_d [Pa]; s_s or more: no recrystallisation
    real(rp) :: critical = 0.0_rp, width = 1.0_rp, n = 2.0_rp  !! e_c, e_d and n [-]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, stress
  end type voce_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('VOCE_YIELD', 'real', 1, 'Pa', 'required if LAW = voce', '(0,inf)', &
               'initial yield stress at T_ROOM and VOCE_RATE0')
    call t%key('VOCE_SATURATION', 'real', 1, 'Pa', 'required if LAW = voce', '(0,inf)', &
               'stress at which hardening saturates')
    call t%key('VOCE_STRAIN', 'real', 1, '', 'required if LAW = voce', '(0,inf)', &
               'plastic strain in which the hardening rate falls by the factor e')
    call t%key('VOCE_C', 'real', 1, '', '0 if LAW = voce', '[0,inf)', &
               'sensitivity to the strain rate')
    call t%key('VOCE_M', 'real', 1, '', '1 if LAW = voce', '(0,inf)', &
               'exponent of thermal softening')
    call t%key('VOCE_RATE0', 'real', 1, '1/s', '1 if LAW = voce', '(0,inf)', &
               'reference strain rate')
    call t%key('DRX_STRESS', 'real', 1, 'Pa', '0 if LAW = voce', '[0,inf)', &
               'steady stress of dynamic recrystallisation, below VOCE_SATURATION; 0: none')
    call t%key('DRX_CRITICAL_STRAIN', 'real', 1, '', '0.5 if LAW = voce', '[0,inf)', &
               'strain at which recrystallisation begins')
    call t%key('DRX_STRAIN', 'real', 1, '', '1 if LAW = voce', '(0,inf)', &
               'strain after DRX_CRITICAL_STRAIN at which 63 % of the metal is recrystallised')
    call t%key('DRX_N', 'real', 1, '', '2 if LAW = voce', '[1,inf)', 'Avrami exponent')
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(voce_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear

    self%initial = input%real('MATERIAL', i, 'VOCE_YIELD')
    self%saturation = input%real('MATERIAL', i, 'VOCE_SATURATION')
    self%strain = input%real('MATERIAL', i, 'VOCE_STRAIN')
    self%c = input%real('MATERIAL', i, 'VOCE_C')
    self%m = input%real('MATERIAL', i, 'VOCE_M')
    self%rate0 = input%real('MATERIAL', i, 'VOCE_RATE0')
    self%steady = input%real('MATERIAL', i, 'DRX_STRESS')
    self%critical = input%real('MATERIAL', i, 'DRX_CRITICAL_STRAIN')
    self%width = input%real('MATERIAL', i, 'DRX_STRAIN')
    self%n = input%real('MATERIAL', i, 'DRX_N')
    call self%read_softening(input, i)
    if (self%saturation < self%initial) then
      call input%report('MATERIAL', i, 'VOCE_SATURATION', 'is below VOCE_YIELD')
    end if
    if (self%steady > self%saturation) then
      call input%report('MATERIAL', i, 'DRX_STRESS', 'is above VOCE_SATURATION')
    end if
    if (self%steady <= 0.0_rp) self%steady = self%saturation
  end subroutine read_keys

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(voce_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: e, factor, drx_drop, hardening, left, rate_factor, s
    integer :: p

    do p = 1, nlane
      e = alpha(p) + x(p)
      left = (self%saturation - self%initial)*exp(-e/self%strain)
      drx_drop = 0.0_rp
      hardening = left/self%strain
      if (e > self%critical .and. self%steady < self%saturation) then
        s = ((e - self%critical)/self%width)**self%n
        drx_drop = (self%saturation - self%steady)*(1.0_rp - exp(-s))
        hardening = hardening - (self%saturation - self%steady)*exp(-s)*self%n*s/(e - self%critical)
      end if
      rate_factor = 1.0_rp + self%c*(log_rate(p) - log(self%rate0))
      factor = max(0.5_rp, rate_factor)
      s = self%saturation - left - drx_drop
      sigma(p) = s*factor*work(p, 1)
      slope(p) = (hardening*x(p)*factor + s*merge(self%c, 0.0_rp, rate_factor > 0.5_rp))*work(p, 1)
    end do
  end subroutine stress

end module physics_law_voce
