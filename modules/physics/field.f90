! SPDX-License-Identifier: MIT
!> Known motion or temperature of a body at undeformed positions X, for blocks of particles. An
!> extension overrides the quantities that it gives.
module physics_field
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: field_t

  type, abstract :: field_t
    logical :: has_motion = .false.        !! `motion` is given
    logical :: has_force = .false.         !! the motion needs the body force `force`
    logical :: has_temperature = .false.   !! `temperature` is given
  contains
    procedure :: motion => rest, force => no_force, temperature => no_temperature
  end type field_t

contains

  !> Position, velocity and deformation gradient at time `t` of points with undeformed positions
  !> `x0`.
  pure subroutine rest(self, t, x0, x, v, f)
    class(field_t), intent(in) :: self
    real(rp), intent(in) :: t               !! time [s]
    real(rp), intent(in) :: x0(nlane, 3)    !! undeformed position [m]
    real(rp), intent(out) :: x(nlane, 3)    !! position [m]
    real(rp), intent(out) :: v(nlane, 3)    !! velocity [m/s]
    real(rp), intent(out) :: f(nlane, 9)    !! deformation gradient dx/dx0, row by row [-]

    x = x0
    v = 0.0_rp
    f = 0.0_rp
    f(:, 1) = 1.0_rp
    f(:, 5) = 1.0_rp
    f(:, 9) = 1.0_rp
  end subroutine rest

  !> Body force per mass of the motion.
  pure subroutine no_force(self, t, x0, b)
    class(field_t), intent(in) :: self
    real(rp), intent(in) :: t               !! time [s]
    real(rp), intent(in) :: x0(nlane, 3)    !! undeformed position [m]
    real(rp), intent(out) :: b(nlane, 3)    !! body force per mass [m/s2]

    b = 0.0_rp
  end subroutine no_force

  !> Temperature at time `t` of points with undeformed positions `x0`.
  pure subroutine no_temperature(self, t, x0, temp)
    class(field_t), intent(in) :: self
    real(rp), intent(in) :: t               !! time [s]
    real(rp), intent(in) :: x0(nlane, 3)    !! undeformed position [m]
    real(rp), intent(out) :: temp(nlane)    !! temperatures [K]

    temp = 0.0_rp
  end subroutine no_temperature

end module physics_field
