! SPDX-License-Identifier: MIT
!> A tree of boxes around things in space, by which the nearest of them is found.
module tool_meshes_boxes
  use base_kinds, only: rp
  use base_sort, only: order_of
  implicit none (type, external)
  private

  public :: boxes_t, build_boxes, descent_t

  integer, parameter :: most_levels = 64   !! of a tree whose halves are even

  !> Node 1 is the root. Things of a node are those in places first, ..., first + count - 1 of the
  !> sorted things; a node of count 0 has two children, `first` and the one behind it.
  type :: boxes_t
    integer :: n = 0
    integer, allocatable :: first(:), count(:)
    real(rp), allocatable :: lower(:, :), upper(:, :)   !! (3, n) [m]
  end type boxes_t

  !> The way down a tree to the things near to a place: nodes to look at, the nearest last.
  type :: descent_t
    integer, private :: top, node(most_levels)
    real(rp), private :: far(most_levels)               !! squares of their distances [m2]
  contains
    procedure :: begin
    procedure :: next_leaf
    procedure :: next_meeting
  end type descent_t

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

  !> Begin at the root.
  pure subroutine begin(self)
    class(descent_t), intent(inout) :: self

    self%top = 1
    self%node(1) = 1
    self%far(1) = 0.0_rp
  end subroutine begin

  !> Places first to last of the things of the next leaf whose box is nearer to `x` than `best`,
  !> which may have become less since the leaf before; none are left if last < first.
  pure subroutine next_leaf(self, tree, x, best, first, last)
    class(descent_t), intent(inout) :: self
    type(boxes_t), intent(in) :: tree
    real(rp), intent(in) :: x(3), best               !! [m], square of a distance [m2]
    integer, intent(out) :: first, last
    real(rp) :: gap(2)
    integer :: child, k, node

    do while (self%top > 0)
      node = self%node(self%top)
      self%top = self%top - 1
      if (self%far(self%top + 1) >= best) cycle
      first = tree%first(node)
      last = first + tree%count(node) - 1
      if (last >= first) return
      child = first
      gap = [gap2(tree%lower(:, child), tree%upper(:, child), x), &
             gap2(tree%lower(:, child + 1), tree%upper(:, child + 1), x)]
      k = merge(0, 1, gap(1) > gap(2))           ! the nearer one last, so that it comes first
      self%node(self%top + 1:self%top + 2) = child + [k, 1 - k]
      self%far(self%top + 1:self%top + 2) = gap([k + 1, 2 - k])
      self%top = self%top + 2
    end do
    first = 1
    last = 0
  end subroutine next_leaf

  !> The same of the next leaf whose box meets another.
  pure subroutine next_meeting(self, tree, lower, upper, first, last)
    class(descent_t), intent(inout) :: self
    type(boxes_t), intent(in) :: tree
    real(rp), intent(in) :: lower(3), upper(3)       !! [m]
    integer, intent(out) :: first, last
    integer :: node

    do while (self%top > 0)
      node = self%node(self%top)
      self%top = self%top - 1
      if (any(tree%lower(:, node) > upper .or. tree%upper(:, node) < lower)) cycle
      first = tree%first(node)
      last = first + tree%count(node) - 1
      if (last >= first) return
      self%node(self%top + 1:self%top + 2) = [first, first + 1]
      self%top = self%top + 2
    end do
    first = 1
    last = 0
  end subroutine next_meeting

end module tool_meshes_boxes
