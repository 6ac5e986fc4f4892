! SPDX-License-Identifier: MIT
!> Generalised vortex (Kamojjala, Brannon, Sadeghirad & Guilkey 2015): circles of an annulus
!> oscillate by the angle alpha = A sin(w t) h(R) about an axis along z, h = (1 - s^2)^2, s = (R -
!> Rm)/d; the body outside the annulus is at rest.
module physics_field_vortex
  use base_kinds, only: nlane, rp
  use physics_field, only: field_t
  implicit none (type, external)
  private

  public :: vortex_t

  type, extends(field_t) :: vortex_t
    real(rp) :: centre(2) = 0.0_rp          !! centre of the annulus [m]
    real(rp) :: radii(2) = [1.0_rp, 2.0_rp]  !! inner and outer radius [m]
    real(rp) :: amplitude = 0.0_rp          !! A, amplitude of the angle [rad]
    real(rp) :: rate = 0.0_rp               !! w, angular frequency [rad/s]
    real(rp) :: mu = 0.0_rp                 !! shear modulus over density [m2/s2]
  contains
    procedure :: motion, force
    procedure, private :: profile
  end type vortex_t

contains

  !> Radius R, h and its first two derivatives.
  elemental subroutine profile(self, x, y, r, h, h1, h2)
    class(vortex_t), intent(in) :: self
    real(rp), intent(in) :: x, y            !! position from the axis [m]
    real(rp), intent(out) :: r, h, h1, h2   !! R [m], h [-], h' [1/m], h'' [1/m2]
    real(rp) :: d, s

    d = 0.5_rp*(self%radii(2) - self%radii(1))
    r = max(hypot(x, y), 1.0e-9_rp*d)       ! the axis itself is at rest
    s = (r - 0.5_rp*sum(self%radii))/d
    h = 0.0_rp
    h1 = 0.0_rp
    h2 = 0.0_rp
    if (abs(s) >= 1.0_rp) return
    h = (1.0_rp - s*s)**2
    h1 = -4.0_rp*s*(1.0_rp - s*s)/d
    h2 = (12.0_rp*s*s - 4.0_rp)/d**2
  end subroutine profile

  !> Position, velocity and deformation gradient at time `t` (physics_field).
  pure subroutine motion(self, t, x0, x, v, f)
    class(vortex_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: x(nlane, 3), v(nlane, 3), f(nlane, 9)
    real(rp), dimension(nlane) :: px, py, r, h, h1, h2, c, s, slope
    real(rp) :: displacement, speed

    px = x0(:, 1) - self%centre(1)
    py = x0(:, 2) - self%centre(2)
    call self%profile(px, py, r, h, h1, h2)
    displacement = self%amplitude*sin(self%rate*t)
    speed = self%amplitude*self%rate*cos(self%rate*t)
    c = cos(displacement*h)
    s = sin(displacement*h)
    f = 0.0_rp
    f(:, 9) = 1.0_rp
    x(:, 1) = c*px - s*py
    x(:, 2) = s*px + c*py
    v(:, 1) = -speed*h*x(:, 2)
    v(:, 2) = speed*h*x(:, 1)
    v(:, 3) = 0.0_rp
    slope = displacement*h1/r               ! grad alpha = slope (px, py)
    f(:, 1) = c - x(:, 2)*slope*px
    f(:, 2) = -s - x(:, 2)*slope*py
    f(:, 4) = s + x(:, 1)*slope*px
    f(:, 5) = c + x(:, 1)*slope*py
    x(:, 1) = x(:, 1) + self%centre(1)
    x(:, 2) = x(:, 2) + self%centre(2)
    x(:, 3) = x0(:, 3)
  end subroutine motion

  !> Body force along the current radius, -R alpha_t^2 + mu/rho R alpha_R^2, and along the circle, R
  !> alpha_tt - mu/rho (3 alpha_R + R alpha_RR), from P = mu (F - F^-T) (J = 1).
  pure subroutine force(self, t, x0, b)
    class(vortex_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: b(nlane, 3)
    real(rp), dimension(nlane) :: px, py, r, h, h1, h2, br, bt, c, s
    real(rp) :: displacement, speed

    px = x0(:, 1) - self%centre(1)
    py = x0(:, 2) - self%centre(2)
    call self%profile(px, py, r, h, h1, h2)
    displacement = self%amplitude*sin(self%rate*t)
    speed = self%amplitude*self%rate*cos(self%rate*t)
    br = r*(self%mu*(displacement*h1)**2 - (speed*h)**2)
    bt = -displacement*(self%rate**2*r*h + self%mu*(3.0_rp*h1 + r*h2))
    c = (cos(displacement*h)*px - sin(displacement*h)*py)/r
    s = (sin(displacement*h)*px + cos(displacement*h)*py)/r
    b(:, 1) = c*br - s*bt
    b(:, 2) = s*br + c*bt
    b(:, 3) = 0.0_rp
  end subroutine force

end module physics_field_vortex
