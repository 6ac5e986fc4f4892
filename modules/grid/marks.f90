! SPDX-License-Identifier: MIT
!> Marks of nodes in a box.
module grid_marks
  implicit none (type, external)
  private

  public :: dilate

contains

  !> Mark all nodes up to `reach` away from a marked one along each axis.
  pure subroutine dilate(used, reach)
    logical, intent(inout), contiguous :: used(:, :, :)
    integer, intent(in) :: reach
    integer :: n(3)

    n = shape(used)
    call dilate_axis(1, n(1), n(2)*n(3), reach, used)
    call dilate_axis(n(1), n(2), n(3), reach, used)
    call dilate_axis(n(1)*n(2), n(3), 1, reach, used)
  end subroutine dilate

  !> Do the same along an axis of `n` places, each of `width` values, in `n_arrays` arrays; with
  !> integers, whose `ior` is vectorised.
  pure subroutine dilate_axis(width, n, n_arrays, reach, used)
    integer, intent(in) :: width, n, n_arrays, reach
    logical, intent(inout) :: used(width*n, n_arrays)
    integer, dimension(width*n) :: marked, old
    integer :: i, away, rest, s

    do i = 1, n_arrays
      old = merge(1, 0, used(:, i))
      marked = old
      do s = 1, min(reach, n - 1)
        away = s*width
        rest = (n - s)*width
        marked(:rest) = ior(marked(:rest), old(away + 1:))
        marked(away + 1:) = ior(marked(away + 1:), old(:rest))
      end do
      used(:, i) = marked > 0
    end do
  end subroutine dilate_axis

end module grid_marks
