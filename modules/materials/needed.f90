! SPDX-License-Identifier: MIT
!> Check of the thermal properties that a scene needs of its materials, as none has a default.
module materials_needed
  use base_kinds, only: rp
  use flow_laws_list, only: make_law
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t
  implicit none (type, external)
  private

  public :: check_properties, require_property

  character(*), parameter :: group = 'MATERIAL'

contains

  !> Report missing properties of materials with the reason for which they are needed, and
  !> properties without effect.
  subroutine check_properties(input, diagnostics)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: heated, law
    class(flow_law_t), allocatable :: flow
    logical :: is_heat_only, conducts, has_table, is_heated, has_own_melting
    integer :: i

    conducts = input%count('HEAT') > 0
    is_heat_only = .not. input%logical('METHOD', 1, 'MECHANICS')
    do i = 1, input%count(group)
      law = input%text(group, i, 'LAW')
      call make_law(law, flow)
      has_own_melting = .false.
      if (allocated(flow)) has_own_melting = flow%has_own_melting()
      heated = ''
      is_heated = input%real(group, i, 'PLASTIC_HEAT') > 0.0_rp
      if (law /= 'elastic' .and. .not. is_heat_only .and. is_heated) then
        heated = 'plastic work heats it (PLASTIC_HEAT)'
      end if
      if (conducts) heated = 'the scene conducts heat (&HEAT)'
      has_table = input%given(group, i, 'SPECIFIC_HEAT_TABLE')
      if (heated /= '' .and. .not. has_table) then
        call require_property(input, i, 'SPECIFIC_HEAT', heated, diagnostics)
      end if
      has_table = input%given(group, i, 'CONDUCTIVITY_TABLE')
      if (conducts .and. .not. has_table) then
        call require_property(input, i, 'CONDUCTIVITY', heated, diagnostics)
      end if
      if (has_own_melting .and. .not. is_heat_only) then
        call require_property(input, i, 'T_MELT', "LAW = '"//law//"' softens towards it", &
                              diagnostics)
      else if (law /= 'elastic' .and. .not. is_heat_only .and. heated /= '') then
        call require_property(input, i, 'T_MELT', heated//', and molten it has no strength', &
                              diagnostics)
      else if (input%count('SOURCE') > 0) then
        call require_property(input, i, 'T_MELT', 'a &SOURCE may melt it', diagnostics)
      end if
      if (input%given(group, i, 'T_ROOM') .and. .not. has_own_melting &
          .and. abs(input%real(group, i, 'EXPANSION')) <= 0.0_rp) call input%report(diagnostics, &
        group, i, 'T_ROOM', "has no effect: LAW = '"//law//"' does not heed it, EXPANSION is 0")
    end do
  end subroutine check_properties

  !> Report if &MATERIAL `i` does not give `key`, which is needed for `reason`.
  subroutine require_property(input, i, key, reason, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key, reason
    type(diagnostics_t), intent(inout) :: diagnostics
    logical :: is_given

    is_given = input%given(group, i, key)
    if (is_given .or. input%written%groups(input%written%find(group, i))%is_broken) return
    call input%report(diagnostics, group, i, '', "'"//input%text(group, i, 'NAME')//"' has no "// &
                      key//', which it needs: '//reason)
  end subroutine require_property

end module materials_needed
