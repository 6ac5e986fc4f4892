! SPDX-License-Identifier: MIT
!> Tractions on bodies and sources of heat from the input.
module setup_loads
  use base_kinds, only: rp
  use heat_sources, only: source_ball, source_disc, source_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use keys_names, only: find
  use state_scene, only: scene_t, traction_t
  implicit none (type, external)
  private

  public :: read_tractions, read_sources, tractions_have_boxes

contains

  !> True if any &TRACTION acts on part of a face only.
  logical function tractions_have_boxes(input)
    type(input_t), intent(in) :: input
    integer :: i

    tractions_have_boxes = any([(has_box(input, i), i=1, input%count('TRACTION'))])
  end function tractions_have_boxes

  logical function has_box(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    has_box = input%given('TRACTION', i, 'LOWER') .or. input%given('TRACTION', i, 'UPPER')
  end function has_box

  !> Read the tractions of each body, in the order of the input file.
  subroutine read_tractions(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    type(traction_t) :: traction
    integer :: body, i

    do i = 1, input%count('TRACTION')
      call read_traction(input, i, traction, diagnostics)
      body = find(scene%body%name, input%text('TRACTION', i, 'BODY'))
      if (body == 0) cycle
      associate (b => scene%body(body))
        if (.not. allocated(b%traction)) allocate (b%traction(0))
        b%traction = [b%traction, traction]
      end associate
    end do
  end subroutine read_tractions

  subroutine read_traction(input, i, traction, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(traction_t), intent(out) :: traction
    type(diagnostics_t), intent(inout) :: diagnostics
    character(4), parameter :: faces(6) = ['xmin', 'xmax', 'ymin', 'ymax', 'zmin', 'zmax']
    character(:), allocatable :: wanted
    real(rp) :: pressure, vector(3)
    integer :: axis, k

    pressure = input%real('TRACTION', i, 'PRESSURE')
    vector = input%reals('TRACTION', i, 'VECTOR', 3)
    wanted = input%text('TRACTION', i, 'FACE')
    do k = 1, 6
      if (wanted /= 'all' .and. wanted /= faces(k)) cycle
      axis = (k + 1)/2
      traction%stress(:, k) = vector
      traction%stress(axis, k) = vector(axis) + merge(pressure, -pressure, mod(k, 2) == 1)
    end do
    traction%ramp = input%real('TRACTION', i, 'RAMP')
    traction%has_box = has_box(input, i)
    if (input%given('TRACTION', i, 'LOWER')) traction%lower = input%reals('TRACTION', i, 'LOWER', 3)
    if (input%given('TRACTION', i, 'UPPER')) traction%upper = input%reals('TRACTION', i, 'UPPER', 3)
    if (all(abs([pressure, vector]) <= 0.0_rp)) then
      call input%report(diagnostics, 'TRACTION', i, '', 'needs a PRESSURE or a VECTOR')
    end if
    if (any(traction%upper < traction%lower)) then
      call input%report(diagnostics, 'TRACTION', i, 'UPPER', 'must not be below LOWER')
    end if
  end subroutine read_traction

  !> Read the moving heat sources.
  subroutine read_sources(input, scene, source, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(source_t), allocatable, intent(out) :: source(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i

    allocate (source(input%count('SOURCE')))
    do i = 1, size(source)
      associate (s => source(i))
        s%kind = merge(source_disc, source_ball, input%text('SOURCE', i, 'KIND') == 'disc')
        s%power = input%real('SOURCE', i, 'POWER')
        s%position = input%reals('SOURCE', i, 'POSITION', 3)
        s%velocity = input%reals('SOURCE', i, 'VELOCITY', 3)
        s%radius = input%real('SOURCE', i, 'RADIUS')
        s%begin = input%real('SOURCE', i, 'BEGIN')
        if (input%real('SOURCE', i, 'END') > 0.0_rp) s%end = input%real('SOURCE', i, 'END')
        if (s%end <= s%begin) call input%report(diagnostics, 'SOURCE', i, 'END', &
                                                'must be after BEGIN')
      end associate
      if (.not. scene%method%conducts) then
        call input%report(diagnostics, 'SOURCE', i, '', 'has no effect without a &HEAT group')
      else if (scene%method%has_mechanics .and. .not. any(scene%material%conducts())) then
        call input%report(diagnostics, 'SOURCE', i, '', &
                          'has no effect without a &MATERIAL with CONDUCTIVITY')
      end if
    end do
  end subroutine read_sources

end module setup_loads
