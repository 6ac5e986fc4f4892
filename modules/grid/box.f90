! SPDX-License-Identifier: MIT
!> Boxes of grid nodes.
module grid_box
  implicit none (type, external)
  private

  !> An inclusive box of nodes; empty if any hi < lo.
  type, public :: box_t
    integer :: lo(3) = 0, hi(3) = -1
  contains
    procedure :: is_empty, grown, meet, count => box_count, has
  end type box_t

contains

  !> True if the box has no nodes.
  pure logical function is_empty(self)
    class(box_t), intent(in) :: self

    is_empty = any(self%hi < self%lo)
  end function is_empty

  !> The box with `layers` more nodes on every side; an empty box stays empty.
  pure type(box_t) function grown(self, layers)
    class(box_t), intent(in) :: self
    integer, intent(in) :: layers

    grown = box_t()
    if (self%is_empty()) return
    grown%lo = self%lo - layers
    grown%hi = self%hi + layers
  end function grown

  !> Nodes that lie in both boxes.
  pure type(box_t) function meet(self, other)
    class(box_t), intent(in) :: self
    type(box_t), intent(in) :: other

    meet%lo = max(self%lo, other%lo)
    meet%hi = min(self%hi, other%hi)
  end function meet

  !> Number of nodes in a box.
  pure integer function box_count(self)
    class(box_t), intent(in) :: self

    box_count = 0
    if (.not. self%is_empty()) box_count = product(self%hi - self%lo + 1)
  end function box_count

  !> True if node `ijk` is in the box.
  pure logical function has(self, ijk)
    class(box_t), intent(in) :: self
    integer, intent(in) :: ijk(3)

    has = all(ijk >= self%lo) .and. all(ijk <= self%hi)
  end function has

end module grid_box
