! SPDX-License-Identifier: MIT
!> Bounding volume hierarchy of axis-aligned boxes, for searches of nearest and overlapping objects.
module tools_mesh_boxes
  use base_kinds, only: rp
  use base_sort, only: order_of
  implicit none (type, external)
  private

  public :: boxes_t, build_boxes, descent_t

  integer, parameter :: max_levels = 64    !! depth of a balanced tree

  !> A leaf has the objects first, ..., first + count - 1 of the sorted list; an inner node has
  !> count 0 and the children `first` and first + 1.
  type :: box_t
    integer :: first = 0, count = 0, parent = 0
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp    !! corners [m]
  end type box_t

  !> Tree of boxes with root 1; siblings are the nodes 2 k and 2 k + 1.
  type :: boxes_t
    integer :: n = 0
    type(box_t), allocatable :: box(:)
    integer, allocatable :: leaf(:)    !! leaf of each object
  end type boxes_t

  !> Traversal of a tree: stack of nodes to visit, the nearest on top, and the node whose objects
  !> have all been visited once it is empty.
  type :: descent_t
    integer, private :: top, done, node(max_levels)
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
    integer, parameter :: max_in_leaf = 8      ! objects in a leaf, less 1
    integer :: axis, first, half, i, last, node
    integer, allocatable :: ends(:)

    allocate (order, source=[(i, i=1, size(lower, 2))])
    allocate (tree%leaf(size(order)), source=1)
    associate (max_nodes => max(1, 2*size(order)))
      allocate (tree%box(max_nodes), ends(max_nodes))
    end associate
    tree%n = 1
    tree%box(1)%first = 1
    ends(1) = size(order)
    node = 0
    do while (node < tree%n)
      node = node + 1
      first = tree%box(node)%first
      last = ends(node)
      tree%box(node)%count = last - first + 1
      tree%box(node)%lower = minval(lower(:, order(first:last)), 2)
      tree%box(node)%upper = maxval(upper(:, order(first:last)), 2)
      tree%leaf(first:last) = node
      if (last - first < max_in_leaf) cycle
      axis = maxloc(tree%box(node)%upper - tree%box(node)%lower, 1)
      order(first:last) = order(first - 1 + order_of(lower(axis:axis, order(first:last)) &
                                                     + upper(axis:axis, order(first:last))))
      half = (first + last)/2
      tree%box(node)%count = 0
      tree%box(node)%first = tree%n + 1
      tree%box(tree%n + 1:tree%n + 2)%first = [first, half + 1]
      tree%box(tree%n + 1:tree%n + 2)%parent = node
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

  !> Start a traversal at the root, or at another node, from which it climbs to the root.
  pure subroutine begin(self, node)
    class(descent_t), intent(inout) :: self
    integer, intent(in), optional :: node

    self%top = 1
    self%node(1) = 1
    if (present(node)) self%node(1) = node
    self%done = self%node(1)
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
    integer :: farther, node

    do
      do while (self%top == 0 .and. self%done > 1)
        node = ieor(self%done, 1)              ! sibling of the node
        self%done = tree%box(node)%parent
        gap(1) = distance2(tree%box(node)%lower, tree%box(node)%upper, x)
        if (gap(1) >= best) cycle
        self%top = 1
        self%node(1) = node
        self%far2(1) = gap(1)
      end do
      if (self%top == 0) exit
      node = self%node(self%top)
      self%top = self%top - 1
      if (self%far2(self%top + 1) >= best) cycle
      do
        first = tree%box(node)%first
        last = first + tree%box(node)%count - 1
        if (last >= first) return
        gap(1) = distance2(tree%box(first)%lower, tree%box(first)%upper, x)
        gap(2) = distance2(tree%box(first + 1)%lower, tree%box(first + 1)%upper, x)
        farther = merge(0, 1, gap(1) > gap(2))
        if (max(gap(1), gap(2)) < best) then
          self%top = self%top + 1
          self%node(self%top) = first + farther
          self%far2(self%top) = max(gap(1), gap(2))
        end if
        if (min(gap(1), gap(2)) >= best) exit
        node = first + 1 - farther
      end do
    end do
    first = 1
    last = 0
  end subroutine next_leaf

  !> Objects first to last of the next leaf whose box overlaps a given box; last < first at the end.
  pure subroutine next_overlap(self, tree, lower, upper, first, last)
    class(descent_t), intent(inout) :: self
    type(boxes_t), intent(in) :: tree
    real(rp), intent(in) :: lower(3), upper(3)       !! corners of the given box [m]
    integer, intent(out) :: first, last
    integer :: node

    do while (self%top > 0)
      node = self%node(self%top)
      self%top = self%top - 1
      if (any(tree%box(node)%lower > upper .or. tree%box(node)%upper < lower)) cycle
      first = tree%box(node)%first
      last = first + tree%box(node)%count - 1
      if (last >= first) return
      self%node(self%top + 1:self%top + 2) = [first, first + 1]
      self%top = self%top + 2
    end do
    first = 1
    last = 0
  end subroutine next_overlap

end module tools_mesh_boxes
