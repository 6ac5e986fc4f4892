! SPDX-License-Identifier: MIT
!> Marks of nodes in a box.
module grid_marks
  implicit none (type, external)
  private

  public :: dilate

contains

  !> Mark all up to `reach` away from a marked one along each axis.
  pure subroutine dilate(used, reach)
    logical, intent(inout), contiguous :: used(:, :, :)
    integer, intent(in) :: reach
    integer :: n(3)

    n = shape(used)
    call dilate_axis(1, n(1), n(2)*n(3), reach, used)
    call dilate_axis(n(1), n(2), n(3), reach, used)
    call dilate_axis(n(1)*n(2), n(3), 1, reach, used)
  end subroutine dilate

  !> The same along an axis of `n` places, each of `width` values, in `many` arrays; by integers,
  !> whose `or` the compiler does many at a time.
  pure subroutine dilate_axis(width, n, many, reach, used)
    integer, intent(in) :: width, n, many, reach
    logical, intent(inout) :: used(width*n, many)
    integer, dimension(width*n) :: marked, old
    integer :: i, away, rest, s

    do i = 1, many
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
