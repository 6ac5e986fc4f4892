! SPDX-License-Identifier: MIT
!> Quantities packed into one array, so that one message reduces all of them over the ranks. The
!> same calls of `pass`, in the same order, pack the quantities and, after `rewind`, unpack them.
module base_packed
  use base_kinds, only: rp
  implicit none (type, external)
  private

  type, public :: packed_t
    real(rp), allocatable :: value(:)
    integer, private :: n = 0                    !! values unpacked so far
    logical, private :: is_packed = .false.
  contains
    procedure :: pass, pass_one, rewind => rewind_packed
  end type packed_t

contains

  !> Append `x(1:n)`, or set it to the next `n` values.
  subroutine pass(self, n, x)
    class(packed_t), intent(inout) :: self
    integer, intent(in) :: n
    real(rp), intent(inout) :: x(n)

    if (.not. allocated(self%value)) allocate (self%value(0))
    if (self%is_packed) then
      x = self%value(self%n + 1:self%n + n)
      self%n = self%n + n
    else
      self%value = [self%value, x]
    end if
  end subroutine pass

  !> Pass a single value.
  subroutine pass_one(self, x)
    class(packed_t), intent(inout) :: self
    real(rp), intent(inout) :: x
    real(rp) :: value(1)

    value = x
    call self%pass(1, value)
    x = value(1)
  end subroutine pass_one

  !> All quantities are packed (or unpacked); the next call of `pass` unpacks the first.
  subroutine rewind_packed(self)
    class(packed_t), intent(inout) :: self

    self%is_packed = .true.
    self%n = 0
  end subroutine rewind_packed

end module base_packed
