! SPDX-License-Identifier: MIT
!> Sorting.
module base_sort
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: order_of

contains

  !> Permutation that sorts the columns of `key` (rows, n) in ascending lexicographic order, by a
  !> stable merge sort.
  pure function order_of(key) result(order)
    real(rp), intent(in) :: key(:, :)
    integer :: order(size(key, 2)), merged(size(key, 2)), a, b, first, i, middle, n, last, width

    n = size(order)
    order = [(i, i=1, n)]
    width = 1
    do while (width < n)
      do first = 1, n, 2*width
        middle = min(first + width, n + 1)
        last = min(first + 2*width, n + 1)
        a = first
        b = middle
        do i = first, last - 1
          if (a < middle .and. b < last) then
            if (is_less(key(:, order(b)), key(:, order(a)))) then
              merged(i) = order(b)
              b = b + 1
            else
              merged(i) = order(a)
              a = a + 1
            end if
          else if (a < middle) then
            merged(i) = order(a)
            a = a + 1
          else
            merged(i) = order(b)
            b = b + 1
          end if
        end do
      end do
      order = merged
      width = 2*width
    end do
  end function order_of

  !> True if `a` precedes `b`.
  pure logical function is_less(a, b)
    real(rp), intent(in) :: a(:), b(:)
    integer :: i

    is_less = .false.
    do i = 1, size(a)
      is_less = a(i) < b(i)
      if (is_less .or. a(i) > b(i)) return
    end do
  end function is_less

end module base_sort
