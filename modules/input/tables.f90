! SPDX-License-Identifier: MIT
!> What tables of an input have in common.
module input_tables
  use base_kinds, only: rp
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: check_rising, rises

contains

  !> Complain if the points of a table do not rise.
  subroutine check_rising(input, group, i, key, points, diagnostics, which)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i                          !! number of the group
    character(*), intent(in) :: key
    real(rp), intent(in) :: points(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(*), intent(in), optional :: which       !! of its values; not given: all

    if (rises(points)) return
    if (present(which)) then
      call input%report(diagnostics, group, i, key, 'must have rising '//which)
    else
      call input%report(diagnostics, group, i, key, 'must rise from value to value')
    end if
  end subroutine check_rising

  !> Whether each value is above the one before.
  pure logical function rises(points)
    real(rp), intent(in) :: points(:)

    rises = .true.
    if (size(points) > 1) rises = all(points(2:) > points(:size(points) - 1))
  end function rises

end module input_tables
