! SPDX-License-Identifier: MIT
!> A known motion or temperature of a body, for blocks of particles named by the places X where they
!> lie undeformed. A kind of field overrides what it gives.
module fields_field
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: field_t

  type, abstract :: field_t
    logical :: has_motion = .false.        !! `motion` is the exact one
    logical :: has_force = .false.         !! it needs the body force `force`
    logical :: has_temperature = .false.   !! `temperature` is the exact one
  contains
    procedure :: motion => rest
    procedure :: force => no_force
    procedure :: temperature => no_temperature
  end type field_t

contains

  !> Place, velocity and deformation gradient at time `t` of the points that started at `x0`.
  pure subroutine rest(self, t, x0, x, v, f)
    class(field_t), intent(in) :: self
    real(rp), intent(in) :: t               !! [s]
    real(rp), intent(in) :: x0(nlane, 3)    !! [m]
    real(rp), intent(out) :: x(nlane, 3)    !! [m]
    real(rp), intent(out) :: v(nlane, 3)    !! [m/s]
    real(rp), intent(out) :: f(nlane, 9)    !! dx/dx0 row by row

    x = x0
    v = 0.0_rp
    f = 0.0_rp
    f(:, 1) = 1.0_rp
    f(:, 5) = 1.0_rp
    f(:, 9) = 1.0_rp
  end subroutine rest

  !> Body force per mass that keeps up the motion.
  pure subroutine no_force(self, t, x0, b)
    class(field_t), intent(in) :: self
    real(rp), intent(in) :: t               !! [s]
    real(rp), intent(in) :: x0(nlane, 3)    !! [m]
    real(rp), intent(out) :: b(nlane, 3)    !! [m/s2]

    b = 0.0_rp
  end subroutine no_force

  !> Temperature at time `t` of the points that started at `x0`.
  pure subroutine no_temperature(self, t, x0, temp)
    class(field_t), intent(in) :: self
    real(rp), intent(in) :: t               !! [s]
    real(rp), intent(in) :: x0(nlane, 3)    !! [m]
    real(rp), intent(out) :: temp(nlane)    !! [K]

    temp = 0.0_rp
  end subroutine no_temperature

end module fields_field
