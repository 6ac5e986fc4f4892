! SPDX-License-Identifier: MIT
!> List of flow laws, named by LAW of a &MATERIAL.
module flow_laws_list
  use flow_laws_hot_working, only: hot_working_t
  use flow_laws_johnson_cook, only: johnson_cook_t
  use flow_laws_norton, only: norton_t
  use flow_laws_sellars_tegart, only: sellars_tegart_t
  use flow_laws_table, only: flow_table_t
  use flow_laws_two_phase, only: two_phase_t
  use flow_laws_voce, only: voce_t
  use flow_laws_zerilli_armstrong, only: zerilli_armstrong_t
  use keys_names, only: find
  use keys_table, only: key_table_t
  use physics_flow_law, only: flow_law_t
  implicit none (type, external)
  private

  public :: add_law_keys, law_names, make_law

  integer, parameter :: max_laws = 32

  !> A named law without its constants.
  type :: named_law_t
    character(24) :: name = ''
    class(flow_law_t), allocatable :: law
  end type named_law_t

  type :: laws_t
    integer :: n = 0
    type(named_law_t) :: one(max_laws)
  contains
    procedure :: add
  end type laws_t

contains

  !> List all laws. A new one is a line here.
  subroutine list_laws(laws)
    type(laws_t), intent(out) :: laws

    call laws%add('johnson-cook', johnson_cook_t())
    call laws%add('voce', voce_t())
    call laws%add('norton', norton_t())
    call laws%add('two-phase', two_phase_t())
    call laws%add('zerilli-armstrong', zerilli_armstrong_t())
    call laws%add('sellars-tegart', sellars_tegart_t())
    call laws%add('hot-working', hot_working_t())
    call laws%add('table', flow_table_t())
  end subroutine list_laws

  subroutine add(self, name, law)
    class(laws_t), intent(inout) :: self
    character(*), intent(in) :: name
    class(flow_law_t), intent(in) :: law

    self%n = self%n + 1
    self%one(self%n)%name = name
    allocate (self%one(self%n)%law, source=law)
  end subroutine add

  !> Names of all laws.
  function law_names() result(names)
    character(24), allocatable :: names(:)
    type(laws_t) :: laws

    call list_laws(laws)
    names = laws%one(:laws%n)%name
  end function law_names

  !> Add LAW and the keys of all laws to &MATERIAL.
  subroutine add_law_keys(t)
    type(key_table_t), intent(inout) :: t
    type(laws_t) :: laws
    character(:), allocatable :: names
    integer :: k

    call list_laws(laws)
    names = 'elastic'
    do k = 1, laws%n
      names = names//' '//trim(laws%one(k)%name)
    end do
    call t%key('LAW', 'choice', 1, '', 'elastic', names, 'material law')
    do k = 1, laws%n
      call laws%one(k)%law%add_keys(t)
    end do
  end subroutine add_law_keys

  !> Make a law of this name, without its constants; unallocated if there is none, as for 'elastic'.
  subroutine make_law(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), allocatable, intent(out) :: law
    type(laws_t) :: laws
    integer :: k

    call list_laws(laws)
    k = find(laws%one%name, name)
    if (k > 0) call move_alloc(laws%one(k)%law, law)
  end subroutine make_law

end module flow_laws_list
