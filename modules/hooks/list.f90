! SPDX-License-Identifier: MIT
!> List of hooks (`hook_t` of state_parts), by the groups of the input that make them.
module hooks_list
  use base_text, only: lower, str
  use hooks_source, only: source_t
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use state_parts, only: held_hook_t, hook_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: add_hook_keys, read_hooks

  !> A group of the input, and the hook that it makes.
  type :: kind_t
    character(16) :: group
    class(hook_t), allocatable :: hook
  end type kind_t

contains

  !> All kinds of hooks. A new one is a line here.
  subroutine list_kinds(kind)
    type(kind_t), allocatable, intent(out) :: kind(:)

    allocate (kind(0))
    call add('SOURCE', source_t())
  contains
    subroutine add(group, hook)
      character(*), intent(in) :: group
      class(hook_t), intent(in) :: hook

      kind = [kind, kind_t(group, hook)]
    end subroutine add
  end subroutine list_kinds

  !> Add the groups of all kinds to the table.
  subroutine add_hook_keys(t)
    type(key_table_t), intent(inout) :: t
    type(kind_t), allocatable :: kind(:)
    integer :: k

    call list_kinds(kind)
    do k = 1, size(kind)
      call kind(k)%hook%add_keys(t)
    end do
  end subroutine add_hook_keys

  !> Make the hooks of all groups of the input, kind by kind.
  subroutine read_hooks(input, scene, hook)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(held_hook_t), allocatable, intent(out) :: hook(:)
    type(kind_t), allocatable :: kind(:)
    integer :: i, k, last, n

    call list_kinds(kind)
    allocate (hook(sum([(input%count(trim(kind(k)%group)), k=1, size(kind))])))
    last = 0
    n = 0
    do k = 1, size(kind)
      do i = 1, input%count(trim(kind(k)%group))
        n = n + 1
        if (kind(k)%group /= 'SOURCE' .and. .not. scene%method%has_mechanics) then
          call input%report(trim(kind(k)%group), i, '', 'has no effect with MECHANICS = F')
        end if
        allocate (hook(n)%it, source=kind(k)%hook)
        associate (new => hook(n)%it)
          allocate (new%column(0), new%unit(0), new%state(0))
          new%name = trim(lower(kind(k)%group))//str(i)
          new%last = last
          call new%read_keys(input, i, scene)
          last = last + size(new%column)
        end associate
      end do
    end do
  end subroutine read_hooks

end module hooks_list
