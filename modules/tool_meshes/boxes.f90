! SPDX-License-Identifier: MIT
!> A tree of boxes around things in space, by which the nearest of them is found; and the sorting
!> that it takes to build one.
module tool_meshes_boxes
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: boxes_t, build_boxes, gap2, order_of

  integer, parameter, public :: most_levels = 64   !! of a tree whose halves are even

  !> Node 1 is the root. Things of a node are those in places first, ..., first + count - 1 of the
  !> sorted things; a node of count 0 has two children, `first` and the one behind it.
  type :: boxes_t
    integer :: n = 0
    integer, allocatable :: first(:), count(:)
    real(rp), allocatable :: lower(:, :), upper(:, :)   !! (3, n) [m]
  end type boxes_t

contains

  !> The tree of things with these boxes, and their order in it.
  subroutine build_boxes(lower, upper, tree, order)
    real(rp), intent(in) :: lower(:, :), upper(:, :)     !! (3, any number) [m]
    type(boxes_t), intent(out) :: tree
    integer, allocatable, intent(out) :: order(:)
    integer, parameter :: few = 4              ! things that a leaf may have
    integer :: axis, first, half, i, last, node
    integer, allocatable :: ends(:)

    allocate (order, source=[(i, i=1, size(lower, 2))])
    associate (most => max(1, 2*size(order)))
      allocate (tree%first(most), tree%count(most), tree%lower(3, most), tree%upper(3, most))
      allocate (ends(most))
    end associate
    tree%n = 1
    tree%first(1) = 1
    ends(1) = size(order)
    node = 0
    do while (node < tree%n)
      node = node + 1
      first = tree%first(node)
      last = ends(node)
      tree%count(node) = last - first + 1
      tree%lower(:, node) = minval(lower(:, order(first:last)), 2)
      tree%upper(:, node) = maxval(upper(:, order(first:last)), 2)
      if (last - first < few) cycle
      axis = maxloc(tree%upper(:, node) - tree%lower(:, node), 1)
      order(first:last) = order(first - 1 + order_of(lower(axis:axis, order(first:last)) &
                                                     + upper(axis:axis, order(first:last))))
      half = (first + last)/2
      tree%count(node) = 0
      tree%first(node) = tree%n + 1
      tree%first(tree%n + 1:tree%n + 2) = [first, half + 1]
      ends(tree%n + 1:tree%n + 2) = [half, last]
      tree%n = tree%n + 2
    end do
  end subroutine build_boxes

  !> Square of the distance of `x` from a box, 0 inside [m2].
  pure real(rp) function gap2(lower, upper, x)
    real(rp), intent(in) :: lower(3), upper(3), x(3)

    gap2 = max(0.0_rp, lower(1) - x(1), x(1) - upper(1))**2 &
           + max(0.0_rp, lower(2) - x(2), x(2) - upper(2))**2 &
           + max(0.0_rp, lower(3) - x(3), x(3) - upper(3))**2
  end function gap2

  !> The order in which columns of `key` rise, by their first row, then by the second, and so on;
  !> equal ones stay as they are.
  pure function order_of(key) result(order)
    real(rp), intent(in) :: key(:, :)
    integer :: order(size(key, 2)), merged(size(key, 2))
    integer :: a, b, first, i, middle, n, last, width

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

  !> Whether `a` comes before `b`.
  pure logical function is_less(a, b)
    real(rp), intent(in) :: a(:), b(:)
    integer :: i

    is_less = .false.
    do i = 1, size(a)
      is_less = a(i) < b(i)
      if (is_less .or. a(i) > b(i)) return
    end do
  end function is_less

end module tool_meshes_boxes
