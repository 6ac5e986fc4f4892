! SPDX-License-Identifier: MIT
!> Thermal properties that a scene needs of its materials: none has a default.
module setup_properties
  use base_kinds, only: rp
  use setup_complaints, only: complaints_t
  use setup_input, only: input_t
  implicit none (type, external)
  private

  public :: check_properties, need_property

  character(*), parameter :: group = 'MATERIAL'

contains

  !> Complaints about properties of materials that the scene needs and does not give, with the reason, and
  !> about those that nothing heeds.
  subroutine check_properties(input, complaints)
    type(input_t), intent(in) :: input
    type(complaints_t), intent(inout) :: complaints
    character(:), allocatable :: heated, law
    logical :: alone, conducts
    integer :: i

    conducts = input%count('HEAT') > 0
    alone = .not. input%logical('METHOD', 1, 'MECHANICS')
    do i = 1, input%count(group)
      law = input%text(group, i, 'LAW')
      heated = ''
      if (law /= 'elastic' .and. .not. alone .and. input%real(group, i, 'PLASTIC_HEAT') > 0.0_rp) &
        heated = 'plastic work heats it (PLASTIC_HEAT)'
      if (conducts) heated = 'the scene conducts heat (&HEAT)'
      if (heated /= '' .and. .not. (alone .and. input%given(group, i, 'SPECIFIC_HEAT_TABLE'))) &
        call need_property(input, i, 'SPECIFIC_HEAT', heated, complaints)
      if (conducts .and. .not. (alone .and. input%given(group, i, 'CONDUCTIVITY_TABLE'))) &
        call need_property(input, i, 'CONDUCTIVITY', heated, complaints)
      if (law == 'johnson-cook' .and. .not. alone) then
        call need_property(input, i, 'T_MELT', "LAW = 'johnson-cook' softens towards it", complaints)
      else if (law /= 'elastic' .and. .not. alone .and. heated /= '') then
        call need_property(input, i, 'T_MELT', heated//', and molten it has no strength', complaints)
      else if (input%count('SOURCE') > 0) then
        call need_property(input, i, 'T_MELT', 'a &SOURCE may melt it', complaints)
      end if
      if (input%given(group, i, 'T_ROOM') .and. law /= 'johnson-cook' &
          .and. abs(input%real(group, i, 'EXPANSION')) <= 0.0_rp) call input%complain(complaints, &
        group, i, 'T_ROOM', "has no effect: LAW is not 'johnson-cook', and EXPANSION is 0")
    end do
  end subroutine check_properties

  !> Complaint if &MATERIAL `i` does not give `key`, which it needs because of `reason`.
  subroutine need_property(input, i, key, reason, complaints)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key, reason
    type(complaints_t), intent(inout) :: complaints
    logical :: is_given

    is_given = input%given(group, i, key)
    if (is_given) return
    call input%complain(complaints, group, i, '', "'"//input%text(group, i, 'NAME')//"' has no "//key// &
                        ', which it needs: '//reason)
  end subroutine need_property

end module setup_properties
