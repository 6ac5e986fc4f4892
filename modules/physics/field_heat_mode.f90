! SPDX-License-Identifier: MIT
!> A decaying mode of conduction: T = T0 + A prod_i sin(k_i X_i + P_i) exp(-kappa k^2 t),
!> k^2 = sum_i k_i^2.
module physics_field_heat_mode
  use base_kinds, only: nlane, rp
  use physics_field, only: field_t
  implicit none (type, external)
  private

  public :: heat_mode_t

  type, extends(field_t) :: heat_mode_t
    real(rp) :: mean = 298.0_rp             !! T0 [K]
    real(rp) :: amplitude = 0.0_rp          !! A [K]
    logical :: takes_part(3) = .false.      !! axes in the product
    real(rp) :: number(3) = 1.0_rp          !! k_i [rad/m]
    real(rp) :: shift(3) = 0.0_rp           !! P_i [rad]
    real(rp) :: diffusivity = 0.0_rp        !! kappa [m2/s]
  contains
    procedure :: temperature
  end type heat_mode_t

contains

  !> Temperature at time `t` of points with undeformed positions `x0` (physics_field).
  pure subroutine temperature(self, t, x0, temp)
    class(heat_mode_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: temp(nlane)
    integer :: a

    temp = self%amplitude &
           *exp(-self%diffusivity*sum(self%number**2, mask=self%takes_part)*t)
    do a = 1, 3
      if (self%takes_part(a)) temp = temp*sin(self%number(a)*x0(:, a) + self%shift(a))
    end do
    temp = self%mean + temp
  end subroutine temperature

end module physics_field_heat_mode
