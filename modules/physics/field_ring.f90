! SPDX-License-Identifier: MIT
!> Expanding ring about an axis along z (Wallstedt & Guilkey 2008), Poisson's ratio 0: radial
!> displacement T Q(R), T = A sin(w t), Q = c3 R^3 + c2 R^2 + c1 R with Q' = 0, and thus no
!> traction, at both radii, and Q = 1 at the outer one.
module physics_field_ring
  use base_kinds, only: nlane, rp
  use physics_field, only: field_t
  implicit none (type, external)
  private

  public :: ring_t

  type, extends(field_t) :: ring_t
    real(rp) :: centre(2) = 0.0_rp          !! [m]
    real(rp) :: c(3) = 0.0_rp               !! coefficients c1 [-], c2 [1/m], c3 [1/m2]
    real(rp) :: amplitude = 0.0_rp          !! A, amplitude of the radial displacement [m]
    real(rp) :: rate = 0.0_rp               !! w, angular frequency [rad/s]
    real(rp) :: mu = 0.0_rp                 !! shear modulus over density [m2/s2]
  contains
    procedure :: set_radii, motion, force
  end type ring_t

contains

  !> Set the polynomial for inner and outer radius [m], whose ratio must not be 3.
  pure subroutine set_radii(self, radii)
    class(ring_t), intent(inout) :: self
    real(rp), intent(in) :: radii(2)
    real(rp) :: d

    d = radii(2)**2*(radii(2) - 3.0_rp*radii(1))
    self%c = [-6.0_rp*radii(1)*radii(2), 3.0_rp*(radii(1) + radii(2)), -2.0_rp]/d
  end subroutine set_radii

  !> Position, velocity and deformation gradient at time `t` (physics_field).
  pure subroutine motion(self, t, x0, x, v, f)
    class(ring_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: x(nlane, 3), v(nlane, 3), f(nlane, 9)
    real(rp), dimension(nlane) :: px, py, r, share, curvature
    real(rp) :: displacement, speed

    px = x0(:, 1) - self%centre(1)
    py = x0(:, 2) - self%centre(2)
    r = hypot(px, py)
    displacement = self%amplitude*sin(self%rate*t)
    speed = self%amplitude*self%rate*cos(self%rate*t)
    share = self%c(1) + r*(self%c(2) + r*self%c(3))              ! Q/R
    x(:, 1) = x0(:, 1) + displacement*share*px
    x(:, 2) = x0(:, 2) + displacement*share*py
    x(:, 3) = x0(:, 3)
    v(:, 1) = speed*share*px
    v(:, 2) = speed*share*py
    v(:, 3) = 0.0_rp
    curvature = displacement*(self%c(2) + 2.0_rp*r*self%c(3))/max(r, tiny(1.0_rp))  ! T (Q/R)'/R
    f = 0.0_rp
    f(:, 1) = 1.0_rp + displacement*share + curvature*px*px
    f(:, 2) = curvature*px*py
    f(:, 4) = curvature*px*py
    f(:, 5) = 1.0_rp + displacement*share + curvature*py*py
    f(:, 9) = 1.0_rp
  end subroutine motion

  !> Radial body force T'' Q - mu/rho [(1 + 1/l_r^2) T Q'' + (l_r - 1/l_r - l_t + 1/l_t)/R] with the
  !> stretches l_r = 1 + T Q', l_t = 1 + T Q/R, from P = mu (F - F^-T).
  pure subroutine force(self, t, x0, b)
    class(ring_t), intent(in) :: self
    real(rp), intent(in) :: t, x0(nlane, 3)
    real(rp), intent(out) :: b(nlane, 3)
    real(rp), dimension(nlane) :: px, py, r, share, radial, around, second, over_r
    real(rp) :: displacement

    px = x0(:, 1) - self%centre(1)
    py = x0(:, 2) - self%centre(2)
    r = max(hypot(px, py), tiny(1.0_rp))
    displacement = self%amplitude*sin(self%rate*t)
    share = self%c(1) + r*(self%c(2) + r*self%c(3))
    around = 1.0_rp + displacement*share
    radial = around + displacement*r*(self%c(2) + 2.0_rp*r*self%c(3))
    second = displacement*(2.0_rp*self%c(2) + 6.0_rp*r*self%c(3))
    over_r = -self%rate**2*displacement*share &
             - self%mu*((1.0_rp + 1.0_rp/radial**2)*second &
                        + (radial - 1.0_rp/radial - around + 1.0_rp/around)/r)/r
    b(:, 1) = over_r*px
    b(:, 2) = over_r*py
    b(:, 3) = 0.0_rp
  end subroutine force

end module physics_field_ring
