! SPDX-License-Identifier: MIT
!> Conditions that prescribe nodal velocities, by the groups of the input.
module conditions_list
  use conditions_clamp, only: clamp_t
  use keys_names, only: find
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_clamp_keys, append_clamp, clamp_groups, held_t, make_clamp

  integer, parameter :: max_kinds = 16

  !> A condition of any kind.
  type :: held_t
    class(clamp_t), allocatable :: clamp
  end type held_t

  type :: kinds_t
    integer :: n = 0
    character(16) :: group(max_kinds) = ''
    type(held_t) :: one(max_kinds)
  contains
    procedure :: add
  end type kinds_t

contains

  !> List all kinds by their groups. A new one is a line here.
  subroutine list_kinds(kinds)
    type(kinds_t), intent(out) :: kinds

    call kinds%add('CLAMP', clamp_t())
  end subroutine list_kinds

  subroutine add(self, group, clamp)
    class(kinds_t), intent(inout) :: self
    character(*), intent(in) :: group
    class(clamp_t), intent(in) :: clamp

    self%n = self%n + 1
    self%group(self%n) = group
    allocate (self%one(self%n)%clamp, source=clamp)
  end subroutine add

  !> Groups of all kinds.
  function clamp_groups() result(groups)
    character(16), allocatable :: groups(:)
    type(kinds_t) :: kinds

    call list_kinds(kinds)
    groups = kinds%group(:kinds%n)
  end function clamp_groups

  !> Add the groups of all kinds to the table.
  subroutine add_clamp_keys(t)
    type(key_table_t), intent(inout) :: t
    type(kinds_t) :: kinds
    integer :: k

    call list_kinds(kinds)
    do k = 1, kinds%n
      call kinds%one(k)%clamp%add_keys(t)
    end do
  end subroutine add_clamp_keys

  !> Make a condition of this group, with its keys not yet read; unallocated if the group is
  !> unknown.
  subroutine make_clamp(group, clamp)
    character(*), intent(in) :: group
    class(clamp_t), allocatable, intent(out) :: clamp
    type(kinds_t) :: kinds
    integer :: k

    call list_kinds(kinds)
    k = find(kinds%group, group)
    if (k > 0) call move_alloc(kinds%one(k)%clamp, clamp)
  end subroutine make_clamp

  !> Append a condition to a list.
  subroutine append_clamp(list, clamp)
    type(held_t), allocatable, intent(inout) :: list(:)
    class(clamp_t), intent(in) :: clamp
    type(held_t), allocatable :: longer(:)
    integer :: k

    allocate (longer(size(list) + 1))
    do k = 1, size(list)
      call move_alloc(list(k)%clamp, longer(k)%clamp)
    end do
    allocate (longer(size(longer))%clamp, source=clamp)
    call move_alloc(longer, list)
  end subroutine append_clamp

end module conditions_list
