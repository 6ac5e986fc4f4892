! SPDX-License-Identifier: MIT
!> List of flow laws, named by LAW of a &MATERIAL.
module physics_laws
  use base_errors, only: fatal
  use base_text, only: joined
  use input_key_table, only: key_table_t
  use physics_flow_law, only: flow_law_t
  use physics_law_hot_working, only: hot_working_t
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_law_norton, only: norton_t
  use physics_law_sellars_tegart, only: sellars_tegart_t
  use physics_law_table, only: flow_table_t
  use physics_law_two_phase, only: two_phase_t
  use physics_law_voce, only: voce_t
  use physics_law_zerilli_armstrong, only: zerilli_armstrong_t
  implicit none (type, external)
  private

  public :: add_law_keys, law_names, make_law

  !> Names of all laws. A new one has its name here and its type in `make_law`.
  character(32), parameter :: law_names(8) = [character(32) :: 'johnson-cook', 'voce', 'norton', &
    'two-phase', 'zerilli-armstrong', 'sellars-tegart', 'hot-working', 'table']

contains

  !> Make a law of this name, without its constants; unallocated if there is none, as for 'elastic'.
  subroutine make_law(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), allocatable, intent(out) :: law

    select case (name)
    case ('johnson-cook'); allocate (johnson_cook_t :: law)
    case ('voce'); allocate (voce_t :: law)
    case ('norton'); allocate (norton_t :: law)
    case ('two-phase'); allocate (two_phase_t :: law)
    case ('zerilli-armstrong'); allocate (zerilli_armstrong_t :: law)
    case ('sellars-tegart'); allocate (sellars_tegart_t :: law)
    case ('hot-working'); allocate (hot_working_t :: law)
    case ('table'); allocate (flow_table_t :: law)
    case default
    end select
  end subroutine make_law

  !> Add LAW and the keys of all laws to &MATERIAL.
  subroutine add_law_keys(t)
    type(key_table_t), intent(inout) :: t
    class(flow_law_t), allocatable :: law
    integer :: k

    call t%key('LAW', 'choice', 1, '', 'elastic', 'elastic '//joined(law_names, ' '), &
               'material law')
    do k = 1, size(law_names)
      call make_law(trim(law_names(k)), law)
      if (.not. allocated(law)) call fatal('no flow law of the list is '//law_names(k))
      call law%add_keys(t)
    end do
  end subroutine add_law_keys

end module physics_laws
