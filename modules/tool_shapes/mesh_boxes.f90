! SPDX-License-Identifier: MIT
!> Bounding volume hierarchy of axis-aligned boxes, for searches of nearest and overlapping objects.
module tool_shapes_mesh_boxes
  use base_kinds, only: rp
  use base_sort, only: order_of
  implicit none (type, external)
  private

  public :: boxes_t, build_boxes, descent_t

  integer, parameter :: max_levels = 64    !! depth of a balanced tree

  !> Tree of boxes with root 1. A leaf has the objects first, ..., first + count - 1 of the sorted
  !> list; an inner node has count 0 and the children `first` and first + 1.
  type :: boxes_t
    integer :: n = 0
    integer, allocatable :: first(:), count(:)
    real(rp), allocatable :: lower(:, :), upper(:, :)   !! (3, n) [m]
  end type boxes_t

  !> Traversal of a tree: stack of nodes to visit, the nearest on top.
  type :: descent_t
    integer, private :: top, node(max_levels)
    real(rp), private :: far2(max_levels)               !! squared distances of the nodes [m2]
  contains
    procedure :: begin
    procedure :: next_leaf
    procedure :: next_overlap
  end type descent_t

contains

  !> Build the tree of objects with the given boxes, and their order in it.
  subroutine build_boxes(lower, upper, tree, order)
    real(rp), intent(in) :: lower(:, :), upper(:, :)     !! (3, n) corners of the boxes [m]
    type(boxes_t), intent(out) :: tree
    integer, allocatable, intent(out) :: order(:)
    integer, parameter :: max_in_leaf = 4      ! objects in a leaf, less 1
    integer :: axis, first, half, i, last, node
    integer, allocatable :: ends(:)

    allocate (order, source=[(i, i=1, size(lower, 2))])
    associate (max_nodes => max(1, 2*size(order)))
      allocate (tree%first(max_nodes), tree%count(max_nodes), tree%lower(3, max_nodes), &
                tree%upper(3, max_nodes))
      allocate (ends(max_nodes))
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
      if (last - first < max_in_leaf) cycle
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

  !> Squared distance of `x` from a box, 0 inside [m2].
  pure real(rp) function distance2(lower, upper, x)
    real(rp), intent(in) :: lower(3), upper(3), x(3)

    distance2 = max(0.0_rp, lower(1) - x(1), x(1) - upper(1))**2 &
           + max(0.0_rp, lower(2) - x(2), x(2) - upper(2))**2 &
           + max(0.0_rp, lower(3) - x(3), x(3) - upper(3))**2
  end function distance2

  !> Start a traversal at the root.
  pure subroutine begin(self)
    class(descent_t), intent(inout) :: self

    self%top = 1
    self%node(1) = 1
    self%far2(1) = 0.0_rp
  end subroutine begin

  !> Objects first to last of the next leaf whose box is nearer to `x` than `best`, which may
  !> decrease between calls; last < first at the end.
  pure subroutine next_leaf(self, tree, x, best, first, last)
    class(descent_t), intent(inout) :: self
    type(boxes_t), intent(in) :: tree
    real(rp), intent(in) :: x(3)                     !! point [m]
    real(rp), intent(in) :: best                     !! squared distance found so far [m2]
    integer, intent(out) :: first, last
    real(rp) :: gap(2)
    integer :: child, k, node

    do while (self%top > 0)
      node = self%node(self%top)
      self%top = self%top - 1
      if (self%far2(self%top + 1) >= best) cycle
      first = tree%first(node)
      last = first + tree%count(node) - 1
      if (last >= first) return
      child = first
      gap = [distance2(tree%lower(:, child), tree%upper(:, child), x), &
             distance2(tree%lower(:, child + 1), tree%upper(:, child + 1), x)]
      k = merge(0, 1, gap(1) > gap(2))           ! the nearer child on top
      self%node(self%top + 1:self%top + 2) = child + [k, 1 - k]
      self%far2(self%top + 1:self%top + 2) = gap([k + 1, 2 - k])
      self%top = self%top + 2
    end do
    first = 1
    last = 0
  end subroutine next_leaf

  !> Objects first to last of the next leaf whose box overlaps a given box; last < first at the end.
  pure subroutine next_overlap(self, tree, lower, upper, first, last)
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
  end subroutine next_overlap

end module tool_shapes_mesh_boxes
