! SPDX-License-Identifier: MIT
!> Checks of tables in an input.
module input_tables
  use base_kinds, only: rp
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: check_rising, rises

contains

  !> Report a table whose points do not increase.
  subroutine check_rising(input, group, i, key, points, diagnostics, which)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i                          !! index of the group
    character(*), intent(in) :: key
    real(rp), intent(in) :: points(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(*), intent(in), optional :: which       !! name of the points; default: all values

    if (rises(points)) return
    if (present(which)) then
      call input%report(diagnostics, group, i, key, 'must have rising '//which)
    else
      call input%report(diagnostics, group, i, key, 'must rise from value to value')
    end if
  end subroutine check_rising

  !> True if each value exceeds the previous one.
  pure logical function rises(points)
    real(rp), intent(in) :: points(:)

    rises = .true.
    if (size(points) > 1) rises = all(points(2:) > points(:size(points) - 1))
  end function rises

end module input_tables
