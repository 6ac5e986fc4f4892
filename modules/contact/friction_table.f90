! SPDX-License-Identifier: MIT
!> Coefficient of friction that depends on the state of the contact: a table over temperature,
!> pressure or sliding speed, linear between its points and constant outside.
module contact_friction_table
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: friction_table_t

  integer, parameter, public :: of_nothing = 0, of_temperature = 1, of_pressure = 2, of_slip = 3

  type :: friction_table_t
    integer :: of = of_nothing
    real(rp), allocatable :: at(:)     !! rising [K], [Pa] or [m/s]
    real(rp), allocatable :: mu(:)
  contains
    procedure :: coefficients
  end type friction_table_t

contains

  !> Coefficients of the first `n` particles of a block.
  pure subroutine coefficients(self, n, temp, pressure, slip, mu)
    class(friction_table_t), intent(in) :: self      !! of something
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane)              !! [K]
    real(rp), intent(in) :: pressure(nlane)          !! [Pa]
    real(rp), intent(in) :: slip(nlane)              !! speed of sliding [m/s]
    real(rp), intent(out) :: mu(nlane)

    select case (self%of)
    case (of_temperature)
      call look_up(self%at, self%mu, n, temp, mu)
    case (of_pressure)
      call look_up(self%at, self%mu, n, pressure, mu)
    case default
      call look_up(self%at, self%mu, n, slip, mu)
    end select
  end subroutine coefficients

  pure subroutine look_up(at, mu, n, value, found)
    real(rp), intent(in) :: at(:), mu(:), value(nlane)
    integer, intent(in) :: n
    real(rp), intent(out) :: found(nlane)
    real(rp) :: share
    integer :: k, p

    found = mu(1)
    do k = 1, size(at) - 1
      do p = 1, n
        if (value(p) <= at(k)) cycle
        share = min(1.0_rp, (value(p) - at(k))/(at(k + 1) - at(k)))
        found(p) = mu(k) + (mu(k + 1) - mu(k))*share
      end do
    end do
  end subroutine look_up

end module contact_friction_table
