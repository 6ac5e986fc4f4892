! SPDX-License-Identifier: MIT
!> Plausibility checks of conduction: sources without heat, conduction without conductivity.
module heat_setup_sense
  use base_kinds, only: rp
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: check_heat_sense

contains

  !> Report sources without heat; warn of scenes in which temperatures cannot change.
  subroutine check_heat_sense(input, diagnostics)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: conductivity
    integer :: i

    do i = 1, input%count('SOURCE')
      if (input%text('SOURCE', i, 'KIND') == 'stir') then
        call check_stir(input, i, diagnostics)
      else if (abs(input%real('SOURCE', i, 'POWER')) <= 0.0_rp) then
        call input%report(diagnostics, 'SOURCE', i, 'POWER', 'the source gives no heat')
      end if
    end do
    if (input%count('HEAT') == 0) return
    conductivity = 0.0_rp
    do i = 1, input%count('MATERIAL')
      conductivity = max(conductivity, input%real('MATERIAL', i, 'CONDUCTIVITY'))
      if (input%given('MATERIAL', i, 'CONDUCTIVITY_TABLE')) conductivity = max(conductivity, 1.0_rp)
    end do
    if (conductivity <= 0.0_rp .and. .not. input%logical('METHOD', 1, 'MECHANICS')) then
      call input%report(diagnostics, 'MATERIAL', 1, 'CONDUCTIVITY', &
                        'must be above 0 with MECHANICS = F')
    else if (conductivity <= 0.0_rp) then
      call input%warn(diagnostics, 'MATERIAL', 1, 'CONDUCTIVITY', &
                      'there is a &HEAT group, and no material conducts')
    end if
    if (.not. input%logical('METHOD', 1, 'MECHANICS')) call check_uniform(input, diagnostics)
  end subroutine check_heat_sense

  !> Check that a stirring source rotates, and that a sliding one has pressure and friction.
  subroutine check_stir(input, i, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: contact

    contact = input%text('SOURCE', i, 'CONTACT')
    if (abs(input%real('SOURCE', i, 'SPIN_RPM')) <= 0.0_rp) then
      call input%report(diagnostics, 'SOURCE', i, 'SPIN_RPM', &
                        'the source does not turn (0 is the default): it gives no heat')
    end if
    if (input%given('SOURCE', i, 'SHARE') .and. input%real('SOURCE', i, 'SHARE') <= 0.0_rp) then
      call input%report(diagnostics, 'SOURCE', i, 'SHARE', 'none of the heat enters the body')
    end if
    if (contact == 'sticking') return
    if (contact == 'mixed' .and. input%real('SOURCE', i, 'SLIP') <= 0.0_rp) return
    if (input%real('SOURCE', i, 'PRESSURE') <= 0.0_rp) then
      call input%report(diagnostics, 'SOURCE', i, 'PRESSURE', &
                        "is 0 (the default): CONTACT = '"//contact//"' gives no heat by sliding")
    end if
    if (input%real('SOURCE', i, 'FRICTION') <= 0.0_rp) then
      call input%report(diagnostics, 'SOURCE', i, 'FRICTION', &
                        "is 0 (the default): CONTACT = '"//contact//"' gives no heat by sliding")
    end if
  end subroutine check_stir

  !> True if the `i`-th &SURFACE transfers any heat.
  logical function can_lose(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    can_lose = input%real('SURFACE', i, 'EMISSIVITY') > 0.0_rp
    if (input%text('SURFACE', i, 'TABLE_OF') == 'none') then
      can_lose = can_lose .or. input%real('SURFACE', i, 'COEFFICIENT') > 0.0_rp &
                 .or. input%real('SURFACE', i, 'PRESSURE_FACTOR') > 0.0_rp
    else
      can_lose = .true.
    end if
  end function can_lose

  !> Warn if no temperature can change in a heat-only scene: no source, and one temperature of all
  !> bodies and surroundings.
  subroutine check_uniform(input, diagnostics)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: first, t
    logical :: is_uniform
    integer :: i

    if (input%count('SOURCE') + input%count('FIELD') > 0) return
    first = input%real('BODY', 1, 'TEMPERATURE')
    is_uniform = .true.
    do i = 1, input%count('BODY')
      is_uniform = is_uniform .and. abs(input%real('BODY', i, 'TEMPERATURE') - first) <= 0.0_rp
    end do
    do i = 1, input%count('SURFACE')
      t = input%real('HEAT', 1, 'AMBIENT')
      if (input%given('SURFACE', i, 'AMBIENT')) t = input%real('SURFACE', i, 'AMBIENT')
      is_uniform = is_uniform .and. (abs(t - first) <= 0.0_rp &
                                     .or. .not. can_lose(input, i))
    end do
    if (is_uniform) call input%warn(diagnostics, 'HEAT', 1, '', &
      'has nothing to do: there is no &SOURCE, and all bodies and surroundings have one '// &
      'temperature')
  end subroutine check_uniform

end module heat_setup_sense
