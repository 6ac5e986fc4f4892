! SPDX-License-Identifier: MIT
!> Displacement along the axes, u_i = A_i sin(k_i X_i + P_i) sin(w_i t + Q_i): a manufactured
!> solution with body force (Wallstedt & Guilkey 2008), or small-amplitude standing elastic waves
!> without one.
module physics_field_waves
  use base_kinds, only: nlane, rp
  use physics_field, only: field_t
  implicit none (type, external)
  private

  public :: waves_t

  type, extends(field_t) :: waves_t
    real(rp) :: amplitude(3) = 0.0_rp   !! A, amplitude; 0: no displacement along the axis [m]
    real(rp) :: number(3) = 1.0_rp      !! k, wave number [rad/m]
    real(rp) :: shift(3) = 0.0_rp       !! P, phase in space [rad]
    real(rp) :: rate(3) = 0.0_rp        !! w, angular frequency [rad/s]
    real(rp) :: phase(3) = 0.0_rp       !! Q, phase in time [rad]
    real(rp) :: mu = 0.0_rp             !! shear modulus over density [m2/s2]
    real(rp) :: lambda = 0.0_rp         !! Lame's first constant over density [m2/s2]
  contains
    procedure :: motion, force
  end type waves_t

contains

  !> Position, velocity and deformation gradient at time `t` (physics_field).
  pure subroutine motion(self, t, x0, x, v, f)
    class(waves_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: x(nlane, 3), v(nlane, 3), f(nlane, 9)
    real(rp) :: angle(nlane), displacement, speed
    integer :: a

    f = 0.0_rp
    do a = 1, 3
      angle = self%number(a)*x0(:, a) + self%shift(a)
      displacement = self%amplitude(a)*sin(self%rate(a)*t + self%phase(a))
      speed = self%amplitude(a)*self%rate(a)*cos(self%rate(a)*t + self%phase(a))
      x(:, a) = x0(:, a) + displacement*sin(angle)
      v(:, a) = speed*sin(angle)
      f(:, 4*a - 3) = 1.0_rp + displacement*self%number(a)*cos(angle)
    end do
  end subroutine motion

  !> Body force b_i = -w^2 u_i + k^2 u_i (mu + (mu + lambda (1 - ln J))/F_ii^2)/rho, from P = mu (F
  !> - F^-T) + lambda ln J F^-T.
  pure subroutine force(self, t, x0, b)
    class(waves_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: b(nlane, 3)
    real(rp) :: x(nlane, 3), v(nlane, 3), f(nlane, 9), c(nlane)
    integer :: a

    call self%motion(t, x0, x, v, f)
    c = self%mu + self%lambda*(1.0_rp - log(f(:, 1)*f(:, 5)*f(:, 9)))
    do a = 1, 3
      b(:, a) = (x(:, a) - x0(:, a))*(self%number(a)**2*(self%mu + c/f(:, 4*a - 3)**2) &
                                      - self%rate(a)**2)
    end do
  end subroutine force

end module physics_field_waves
