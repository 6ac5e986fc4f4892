! SPDX-License-Identifier: MIT
!> Errors and warnings on the motion of the tools, and the table of the motion that `--check`
!> prints.
module setup_check_process
  use base_kinds, only: pi, rp
  use base_log, only: log_line
  use base_text, only: str
  use input_values, only: input_t
  use setup_boundary, only: wall_of
  use setup_method, only: flow_stress_of
  use setup_process, only: survey_tool, tool_survey_t, undefined
  use setup_solids, only: read_all_solids, solids_t
  use state_conditions, only: wall_t
  use state_scene, only: scene_t
  use tools_shape, only: length_text
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: check_process, report_process

  real(rp), parameter :: mm = 1.0e3_rp

contains

  !> Report errors and warnings on tools and their motion. The scene must have no other errors.
  subroutine check_process(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(solids_t), allocatable :: solids(:)
    type(tool_survey_t) :: survey
    integer :: k, n

    call check_phases(input, tool)
    call read_all_solids(input, solids)
    do k = 1, size(tool)
      call survey_tool(input, scene, solids, k, tool(k), survey)
      if (k <= input%count('TOOL')) then
        n = input%diagnostics%count()
        associate (plate => survey%plate(:2, 2) - survey%plate(:2, 1))
          call tool(k)%shape%check_size(input, k, maxval(scene%grid%upper() - scene%grid%lower), &
                    scene%grid%h, maxval(plate), any(abs(tool(k)%motion%phase%spin) > 0.0_rp))
        end associate
        if (input%diagnostics%count() == n) then
          call check_tool_motion(input, scene, tool, k, survey)
          call check_mass_scaling(input, scene, tool(k), survey)
        end if
      else
        call check_rigid_motion(input, scene, k, survey)
      end if
    end do
  end subroutine check_process

  !> Report phases that are never reached, and ramps longer than their phase.
  subroutine check_phases(input, tool)
    type(input_t), intent(in) :: input
    type(tool_t), intent(in) :: tool(:)
    integer :: i, k, n
    logical :: is_last

    do k = 1, size(tool)
      is_last = .false.
      n = 0
      do i = 1, input%count('MOTION')
        if (input%text('MOTION', i, 'TOOL') /= tool(k)%name) cycle
        n = n + 1
        if (is_last) call input%report('MOTION', i, '', 'is never reached: a phase before it '// &
                                       'has no DURATION and lasts to the end of the run')
        associate (duration => tool(k)%motion%phase(n)%duration)
          if (duration > 0.0_rp .and. input%real('MOTION', i, 'RAMP') &
              > duration*(1.0_rp + 1.0e-9_rp)) then
            call input%warn('MOTION', i, 'RAMP', 'is longer than the DURATION of the phase')
          end if
          is_last = is_last .or. duration <= 0.0_rp
        end associate
      end do
    end do
  end subroutine check_phases

  !> Report errors in the survey of a tool. A tool outside the grid may be intended; ten grid sizes
  !> away its position is probably in another unit.
  subroutine check_tool_motion(input, scene, tool, k, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    integer, intent(in) :: k
    type(tool_survey_t), intent(in) :: survey
    real(rp) :: edges(3)                           ! edge lengths of the plate [m]
    integer :: i, phase

    edges = survey%plate(:, 2) - survey%plate(:, 1)
    if (.not. survey%is_in_grid) then
      associate (sides => scene%grid%upper() - scene%grid%lower)
        call input%report('TOOL', k, 'POSITION', &
                          'the tool is outside the grid throughout the run', &
                          is_warning=norm2(tool(k)%start - scene%grid%lower) < 10.0_rp*norm2(sides))
      end associate
      return
    end if
    if (survey%touch >= undefined .and. .not. bodies_move(input, scene) &
        .and. .not. any(survey%phase%name == 'press')) then
      call input%warn('TOOL', k, 'POSITION', 'the tool never touches a body until &TIME END = '// &
                      str(scene%end_time)//' s')
    end if
    call check_surroundings(input, scene, tool(k), k, survey)
    if (survey%touch < undefined) call check_shoulder(input, k, survey)
    if (survey%through < undefined .and. input%real('TOOL', k, 'BOBBIN_RADIUS') <= 0.0_rp) then
      phase = findloc(survey%phase%from <= survey%through, .true., dim=1, back=.true.)
      associate (text => 'the tool comes out below the bottom of the plate of '// &
                 length_text(edges(3))//' at t = '//str(survey%through)//' s', &
                 one => survey%phase(phase))
        if (survey%through <= 0.0_rp .or. one%motion == 0) then
          call input%report('TOOL', k, 'POSITION', text, .not. has_floor(input, scene, &
                            survey%plate(3, 1)))
        else
          call input%report('MOTION', one%motion, key_of(input, one%motion), text, &
                            .not. has_floor(input, scene, survey%plate(3, 1)))
        end if
      end associate
    end if
    call check_forces(input, scene, tool(k), survey)
    do i = 1, size(survey%phase)
      associate (one => survey%phase(i))
        if (one%motion == 0 .or. one%off_plate <= 0.0_rp) cycle
        if (one%off_plate <= maxval(0.5_rp*survey%upper(:2) - 0.5_rp*survey%lower(:2))) cycle
        call input%warn('MOTION', one%motion, key_of(input, one%motion), 'the tool travels '// &
                        length_text(one%path_length)//' and is off the plate of '// &
                        length_text(edges(1))//' x '//length_text(edges(2))//' from t = '// &
                        str(one%off_plate_from)//' s on')
      end associate
    end do
  end subroutine check_tool_motion

  !> Warn of forces that DAMPING carries: they move the tool by less than a tenth of a cell.
  subroutine check_forces(input, scene, tool, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    type(tool_survey_t), intent(in) :: survey
    real(rp) :: force, way
    integer :: i

    if (tool%drive%damping <= 0.0_rp) return
    do i = 1, size(survey%phase)
      associate (one => survey%phase(i))
        if (one%name /= 'press' .or. one%motion == 0) cycle
        if (.not. input%given('MOTION', one%motion, 'FORCE')) cycle
        force = input%real('MOTION', one%motion, 'FORCE')
        way = force*(one%to - one%from)/(tool%drive%damping*sqrt(scene%method%mass_scaling))
        if (force <= 0.0_rp .or. way >= 0.1_rp*minval(scene%grid%h)) cycle
        call input%warn('MOTION', one%motion, 'FORCE', 'moves the tool by '//length_text(way)// &
                        ' at most against its DAMPING: is it in kN?')
      end associate
    end do
  end subroutine check_forces

  !> Warn of metal that nothing holds against a rotating tool, of clamps of metal that the tool
  !> stirs, and of a plate up to the top of the grid, without room for flash.
  subroutine check_surroundings(input, scene, tool, k, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: k
    type(tool_survey_t), intent(in) :: survey
    type(wall_t) :: wall
    real(rp) :: top(3)
    integer :: i

    if (survey%touch >= undefined .or. all(abs(survey%phase%spin) <= 0.0_rp)) return
    if (size(scene%clamp) + size(scene%symmetry) + input%count('FIELD') == 0 &
        .and. .not. any(scene%body%is_rigid())) then
      call input%warn('TOOL', k, 'NAME', 'pushes and turns bodies that nothing holds: give a '// &
                      '&WALL under the plate and &CLAMP groups at its sides')
    end if
    if (survey%clamp > 0) call input%warn('CLAMP', survey%clamp, '', 'holds metal under '// &
                                          trim(tool%name)//', which cannot flow there')
    do i = 1, input%count('WALL')
      wall = wall_of(input, scene%grid, i)
      if (wall%axis == 3 .and. .not. wall%faces_up) return
    end do
    top = scene%grid%upper()
    if (top(3) - survey%plate(3, 2) < 0.5_rp*scene%grid%h(3) .and. survey%upper(3) > top(3)) then
      call input%warn('GRID', 1, 'UPPER', 'ends '//length_text(top(3) - survey%plate(3, 2))// &
                      ' above the plate: flash leaves the grid there; two cells of room keep it')
    end if
  end subroutine check_surroundings

  !> Report a mass scaling chi with which the inertia of the metal that a tool pushes aside with
  !> speed v, chi rho v^2, exceeds the flow stress of the metal as it starts (at a strain of 1), so
  !> that the force of the run is that of inertia. Warn if the rim of a tool moves by more than a
  !> cell in a step. An adaptive mass scaling is judged by its smallest factor.
  subroutine check_mass_scaling(input, scene, tool, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    type(tool_survey_t), intent(in) :: survey
    real(rp) :: admissible, factor, rim, speed, stress, waves
    character(:), allocatable :: key
    integer :: b

    key = 'MASS_SCALING'
    factor = scene%method%mass_scaling
    if (scene%method%scaling_range(2) > 0.0_rp) then
      key = 'MASS_SCALING_RANGE'
      factor = scene%method%scaling_range(1)
    end if
    if (factor <= 1.0_rp .or. .not. tool%has_shape()) return
    associate (phase => survey%phase)
      speed = maxval(phase%speed, mask=phase%depth > 0.0_rp .and. phase%depth < undefined &
                                       .and. phase%to > survey%touch .and. phase%name /= 'retract')
      rim = maxval(abs(phase%spin))*tool%stirring_radius()
    end associate
    admissible = 0.0_rp
    waves = huge(1.0_rp)
    do b = 1, size(scene%body)
      if (.not. scene%can_flow(scene%body(b)%group)) cycle
      associate (material => scene%material(scene%body(b)%material))
        stress = flow_stress_of(material, input%real('BODY', b, 'TEMPERATURE'), 1.0_rp)
        if (speed > 0.0_rp) admissible = max(admissible, stress/(material%rho*speed**2))
        waves = min(waves, material%wave_speed()/sqrt(factor))
      end associate
    end do
    if (admissible > 0.0_rp .and. factor > admissible) then
      call input%report('TIME', 1, key, 'gives the metal that '//trim(tool%name)// &
                        ' pushes aside at '//str(mm*speed)//' mm/s an inertial stress above '// &
                        'its flow stress: forces would be mostly inertial. At most '// &
                        str(admissible))
    else if (scene%method%cfl*rim > waves .and. scene%method%fixed_dt <= 0.0_rp) then
      call input%warn('TIME', 1, key, 'the rim of '//trim(tool%name)//' moves by '// &
                      str(scene%method%cfl*rim/waves)//' cells in a step: flow near it is '// &
                      'poorly resolved in time. At most '// &
                      str(factor*(waves/(scene%method%cfl*rim))**2)//' for one cell')
    end if
  end subroutine check_mass_scaling

  !> Key that determines the motion of a phase.
  function key_of(input, motion) result(key)
    type(input_t), intent(in) :: input
    integer, intent(in) :: motion                  !! index of its &MOTION
    character(:), allocatable :: key

    key = 'VELOCITY'
    if (input%text('MOTION', motion, 'FILE') /= '') key = 'FILE'
  end function key_of

  !> Warn of a plunged tool whose shoulder rim, at its lowest point, does not reach the plate by the
  !> end of the run. Phases with a force are not checked, as the depth is not known beforehand.
  subroutine check_shoulder(input, k, survey)
    type(input_t), intent(in) :: input
    integer, intent(in) :: k
    type(tool_survey_t), intent(in) :: survey
    real(rp) :: above, length, tilt, tip
    logical :: is_pinned

    is_pinned = input%given('TOOL', k, 'PIN_LENGTH')
    if (.not. is_pinned .or. any(survey%phase%name == 'press')) return
    if (.not. any(survey%phase%name == 'plunge')) return
    length = input%real('TOOL', k, 'PIN_LENGTH')
    tip = input%real('TOOL', k, 'PIN_TIP_RADIUS')
    if (tip <= 0.0_rp) tip = input%real('TOOL', k, 'PIN_RADIUS')
    tilt = input%real('TOOL', k, 'TILT_DEG')*pi/180.0_rp
    above = length*cos(tilt) + (tip - input%real('TOOL', k, 'RADIUS'))*abs(sin(tilt))
    above = above - maxval(survey%phase%depth, mask=survey%phase%depth < undefined)
    if (above <= 0.0_rp) return
    call input%warn('TOOL', k, 'PIN_LENGTH', 'the shoulder does not come down to the plate by '// &
                    'the end of the run: its rim stays '//length_text(above)//' above it')
  end subroutine check_shoulder

  !> Check the motion of a rigid body, whose particles must not leave the grid.
  subroutine check_rigid_motion(input, scene, k, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: k
    type(tool_survey_t), intent(in) :: survey
    real(rp) :: velocity(3)
    integer :: b, i, m

    b = findloc(scene%body%tool, k, dim=1)
    if (survey%touch >= undefined .and. .not. bodies_move(input, scene)) then
      call input%warn('BODY', b, 'NAME', 'the rigid body never touches another')
    end if
    if (any(abs(survey%phase%spin) > 0.0_rp) .and. survey%touch < undefined) then
      do i = 1, size(survey%phase)
        if (survey%phase(i)%motion == 0) cycle
        velocity = input%reals('MOTION', survey%phase(i)%motion, 'VELOCITY', 3)
        if (abs(velocity(3)) <= 0.0_rp .or. &
            .not. any([(scene%can_flow(scene%body(m)%group), m=1, size(scene%body))])) cycle
        call input%report('BODY', b, 'RIGID', 'a rigid body of particles that turns and is '// &
                          'pressed into metal that flows tears particles out of it, and force '// &
                          'and torque are about twice too large: take a &TOOL of its shape')
        exit
      end do
    end if
    do i = 1, size(survey%phase)
      associate (one => survey%phase(i))
        if (one%motion == 0 .or. one%side >= 0.0_rp .or. any(scene%grid%period > 0)) cycle
        call input%warn('MOTION', one%motion, key_of(input, one%motion), 'takes the rigid body '// &
                        length_text(-one%side)//' beyond a side of the grid or a wall')
      end associate
    end do
  end subroutine check_rigid_motion

  !> True if there is a wall under the plate.
  logical function has_floor(input, scene, bottom)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: bottom                 !! height of the plate bottom [m]
    type(wall_t) :: wall
    integer :: i

    has_floor = .false.
    do i = 1, input%count('WALL')
      wall = wall_of(input, scene%grid, i)
      if (wall%axis == 3 .and. wall%faces_up) has_floor = has_floor &
          .or. wall%position >= bottom - scene%grid%h(3)
    end do
  end function has_floor

  !> True if bodies may move towards a tool that does not reach them.
  logical function bodies_move(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: b

    bodies_move = any(abs(scene%method%gravity) > 0.0_rp) .or. &
                  input%count('LOAD') + input%count('TRACTION') + input%count('FIELD') > 0
    do b = 1, input%count('BODY')
      bodies_move = bodies_move .or. any(abs([input%reals('BODY', b, 'VELOCITY', 3), &
        input%reals('BODY', b, 'ANGULAR_VELOCITY', 3), &
        input%reals('BODY', b, 'VELOCITY_GRADIENT', 9)]) > 0.0_rp)
    end do
    do b = 1, size(scene%clamp)
      bodies_move = bodies_move .or. scene%clamp(b)%clamp%moves()
    end do
  end function bodies_move

  !> Print the table of the motion for `--check`.
  subroutine report_process(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(solids_t), allocatable :: solids(:)
    type(tool_survey_t) :: survey
    character(:), allocatable :: text
    character(120) :: row
    character(12) :: depth, bottom
    integer :: i, k

    if (size(tool) == 0) return
    call read_all_solids(input, solids)
    do k = 1, size(tool)
      call survey_tool(input, scene, solids, k, tool(k), survey)
      associate (lower => survey%plate(:, 1), upper => survey%plate(:, 2))
        if (k == 1) call log_line('plate        '//str(mm*(upper(1) - lower(1)))//' x '// &
          str(mm*(upper(2) - lower(2)))//' x '//str(mm*(upper(3) - lower(3)))// &
          ' mm, top at z = '//str(mm*upper(3))//' mm')
      end associate
      text = ', never touches the bodies where they are at t = 0'
      if (any(survey%phase%name == 'press')) text = ', comes down by its FORCE'
      if (survey%touch < undefined) text = ', touches at t = '//str(survey%touch)//' s'
      call log_line('tool         '//trim(tool(k)%name)//text)
      call log_line('phase            from[s]       to[s]     way[mm]'// &
                    ' speed[mm/s]   spin[rpm]   depth[mm]  bottom[mm]    edge[mm]    side[mm]')
      do i = 1, size(survey%phase)
        associate (p => survey%phase(i))
          depth = cell_mm(p%depth)
          bottom = cell_mm(p%bottom)
          if (p%bottom < 0.0_rp) then
            depth = '     through'
            bottom = '           -'
          end if
          write (row, '(a12,9a12)') '  '//p%name, cell(p%from), cell(p%to), &
            cell(mm*p%path_length), cell(mm*p%speed), &
            cell(p%spin*30.0_rp/pi), depth, bottom, cell_mm(p%edge), &
            cell_mm(p%side)
          call log_line(row)
        end associate
      end do
      if (any(tool(k)%motion%phase%ends_early())) then
        call log_line('             phases that end at a load or temperature (UNTIL_...) are '// &
                      'shown, and the run is estimated, as if they took their DURATION')
      end if
      if (any(survey%phase%name == 'press')) then
        call log_line('             while the tool sinks at 1 mm/s, its DAMPING carries '// &
                      str(tool(k)%drive%damping*sqrt(scene%method%mass_scaling)/mm)// &
                      ' N of the FORCE')
      end if
    end do
    call log_line('             depth: lowest point of the tool below the top of the plate '// &
                  '(less than 0: above); bottom: metal left below it; through: past it; '// &
                  'edge: its rim to the edge of the plate; side: to a wall or the side of the '// &
                  'grid; press: by a force, as if it did not sink')
  end subroutine report_process

  !> A number in a field of the table.
  function cell(x) result(text)
    real(rp), intent(in) :: x
    character(12) :: text

    if (abs(x) < 1.0e5_rp .and. (abs(x) >= 1.0e-2_rp .or. abs(x) <= 1.0e-9_rp)) then
      write (text, '(f12.3)') x
    else
      write (text, '(es12.3)') x
    end if
  end function cell

  !> A length in mm in a field of the table, `-` if it is undefined.
  function cell_mm(x) result(text)
    real(rp), intent(in) :: x
    character(12) :: text

    text = '           -'
    if (x < undefined) text = cell(mm*x)
  end function cell_mm

end module setup_check_process
