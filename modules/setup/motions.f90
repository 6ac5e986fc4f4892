! SPDX-License-Identifier: MIT
!> Read the motion schedules of tools: the phases of &MOTION, and paths from files.
module setup_motions
  use base_kinds, only: pi, rp
  use base_text, only: str
  use input_resolved, only: file_path
  use input_tables, only: check_rising, read_columns
  use input_values, only: input_t
  use state_scene, only: scene_t
  use tools_motion, only: max_forces, motion_t, phase_t
  use tools_paths, only: new_path
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: check_paths, read_motion

  real(rp), parameter :: fastest = 0.1_rp      !! largest speed on a path [wave speeds of the metal]

contains

  !> Read the motion phases of the tool `name` in the order of the input file.
  subroutine read_motion(input, name, motion)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name
    type(motion_t), intent(out) :: motion
    integer :: i, k

    allocate (motion%phase(count([(input%text('MOTION', i, 'TOOL') == name, &
                                   i=1, input%count('MOTION'))])))
    k = 0
    do i = 1, input%count('MOTION')
      if (input%text('MOTION', i, 'TOOL') /= name) cycle
      k = k + 1
      motion%phase(k) = phase_of(input, i)
      call read_path(input, i, motion%phase(k))
      call check_phase(input, i, motion%phase(k))
    end do
  end subroutine read_motion

  !> Phase of the `i`-th &MOTION, without its path.
  type(phase_t) function phase_of(input, i) result(phase)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), allocatable :: forces(:)
    character(:), allocatable :: probe
    integer :: k

    phase%duration = input%real('MOTION', i, 'DURATION')
    phase%velocity = input%reals('MOTION', i, 'VELOCITY', 3)
    phase%spin = input%real('MOTION', i, 'SPIN_RPM')*2.0_rp*pi/60.0_rp
    phase%ramp = input%real('MOTION', i, 'RAMP')
    phase%is_force_controlled = input%given('MOTION', i, 'FORCE')
    if (phase%is_force_controlled) phase%force = input%real('MOTION', i, 'FORCE')
    forces = input%list('MOTION', i, 'FORCE_TABLE')
    phase%n_forces = size(forces)/2
    phase%forces(:, :phase%n_forces) = reshape(forces, [2, phase%n_forces])
    if (phase%n_forces > 0) phase%is_force_controlled = .true.
    phase%until_force = input%real('MOTION', i, 'UNTIL_FORCE', otherwise=huge(1.0_rp))
    phase%until_torque = input%real('MOTION', i, 'UNTIL_TORQUE', otherwise=huge(1.0_rp))
    phase%until_temperature = input%real('MOTION', i, 'UNTIL_TEMPERATURE', otherwise=huge(1.0_rp))
    probe = input%text('MOTION', i, 'UNTIL_PROBE')
    phase%until_probe = findloc([(input%text('PROBE', k, 'NAME') == probe, &
                                  k=1, input%count('PROBE'))], .true., dim=1)
  end function phase_of

  !> Read the path of the `i`-th &MOTION from its FILE, if given, and set the duration.
  subroutine read_path(input, i, phase)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(phase_t), intent(inout) :: phase
    character(*), parameter :: names(4) = ['time[s]', 'x[m]   ', 'y[m]   ', 'z[m]   ']
    character(:), allocatable :: file
    real(rp), allocatable :: rows(:, :)
    integer, allocatable :: lines(:)
    logical :: found(4), has_speed, leads_tilt, opened
    integer :: before, k, n

    file = file_path(input, 'MOTION', i)
    has_speed = input%given('MOTION', i, 'SPEED')
    leads_tilt = input%logical('MOTION', i, 'TILT_FOLLOWS')
    if (file == '') then
      if (has_speed) call input%report('MOTION', i, 'SPEED', 'needs a FILE')
      if (leads_tilt) call input%report('MOTION', i, 'TILT_FOLLOWS', 'needs a FILE')
      return
    end if
    before = input%diagnostics%count()
    if (any(abs(phase%velocity) > 0.0_rp)) call input%report('MOTION', i, 'VELOCITY', &
      'has no effect beside a FILE')
    if (leads_tilt .and. phase%ramp <= 0.0_rp) call input%report('MOTION', i, 'TILT_FOLLOWS', &
      'needs a RAMP: the time in which the tilt turns at a point')
    call read_columns(file, names, rows, lines, found, opened, input%diagnostics)
    n = size(rows, 1)
    if (.not. opened) then
      call input%report('MOTION', i, 'FILE', file//' cannot be read')
    else if (.not. all(found(2:3))) then
      call input%diagnostics%add(file, 0, 'needs columns x[m] and y[m], and may have z[m] and '// &
                                 'time[s], with commas between them')
    else if (n < 2) then
      if (input%diagnostics%count() == before) call input%diagnostics%add(file, 0, &
        'has fewer than two points')
    else if (found(1)) then
      if (has_speed) call input%report('MOTION', i, 'SPEED', 'has no effect: '//file// &
                                       ' has a column time[s]')
      call input%diagnostics%add_first(file, lines(2:), rows(2:, 1) <= rows(:n - 1, 1), &
                                       'time does not rise')
    else if (.not. has_speed) then
      call input%report('MOTION', i, 'FILE', 'has no column time[s]: the phase needs a SPEED')
    else
      do k = 2, n
        rows(k, 1) = rows(k - 1, 1) &
                     + norm2(rows(k, 2:) - rows(k - 1, 2:))/input%real('MOTION', i, 'SPEED')
      end do
      call input%diagnostics%add_first(file, lines(2:), rows(2:, 1) <= rows(:n - 1, 1), &
                                       'repeats the point before')
    end if
    if (input%diagnostics%count() > before) return
    phase%path = new_path(rows(:, 1), transpose(rows(:, 2:)), lines, leads_tilt)
    associate (length => phase%path%time(n) + phase%ramp)
      if (phase%duration > length*(1.0_rp + 1.0e-9_rp)) call input%report('MOTION', i, 'DURATION', &
        'is longer than path and RAMP take, '//str(length)//' s')
      if (phase%duration <= 0.0_rp) phase%duration = length
    end associate
  end subroutine read_path

  !> Report paths that leave the grid or exceed a fraction of the wave speed of the metal.
  subroutine check_paths(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    character(:), allocatable :: file
    real(rp), allocatable :: x(:, :)
    real(rp) :: angle, begin(3), now(3), spin, upper(3), waves
    integer :: b, i, k, n, phase

    upper = scene%grid%upper()
    waves = huge(1.0_rp)
    do b = 1, size(scene%body)
      if (input%diagnostics%count() > 0) exit            ! the material may have no wave speed
      if (scene%body(b)%material == 0 .or. scene%body(b)%is_rigid()) cycle
      waves = min(waves, scene%material(scene%body(b)%material)%wave_speed() &
                         /sqrt(scene%method%mass_scaling))
    end do
    do k = 1, size(tool)
      phase = 0
      do i = 1, input%count('MOTION')
        if (input%text('MOTION', i, 'TOOL') /= tool(k)%name) cycle
        phase = phase + 1
        if (.not. allocated(tool(k)%motion%phase(phase)%path%time)) cycle
        file = file_path(input, 'MOTION', i)
        call tool(k)%motion%at(sum(tool(k)%motion%phase(:phase - 1)%duration), begin, now, angle, &
                               spin)
        associate (path => tool(k)%motion%phase(phase)%path)
          n = size(path%time)
          x = path%place + spread(tool(k)%start + begin, 2, n)
          call input%diagnostics%add_first( &
            file, path%line, any((x < spread(scene%grid%lower, 2, n) .or. &
            x > spread([upper(:2), huge(1.0_rp)], 2, n)) .and. &
            spread(scene%grid%period <= 0, 2, n), 1), 'the path leaves the grid')
          x(:, 2:) = path%place(:, 2:) - path%place(:, :n - 1)
          call input%diagnostics%add_first( &
            file, path%line(2:), norm2(x(:, 2:), 1) > fastest*waves &
            *(path%time(2:) - path%time(:n - 1)), 'the segment to this point is faster than '// &
            str(fastest*waves)//' m/s, a tenth of the wave speed of the metal with its '// &
            'MASS_SCALING')
        end associate
      end do
    end do
  end subroutine check_paths

  !> Check the end conditions and the force table of the `i`-th &MOTION.
  subroutine check_phase(input, i, phase)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(phase_t), intent(in) :: phase
    integer :: n

    if (phase%ends_early() .and. phase%duration <= 0.0_rp &
        .and. input%text('MOTION', i, 'FILE') == '') then
      call input%report('MOTION', i, 'DURATION', 'must be given, the longest time of a phase '// &
                        'that ends at a load or temperature')
    end if
    if (input%text('MOTION', i, 'UNTIL_PROBE') /= '' &
        .and. phase%until_temperature >= huge(1.0_rp)) then
      call input%report('MOTION', i, 'UNTIL_PROBE', 'has no effect without UNTIL_TEMPERATURE')
    end if
    n = size(input%list('MOTION', i, 'FORCE_TABLE'))
    if (n == 0) return
    if (input%given('MOTION', i, 'FORCE')) call input%report('MOTION', i, 'FORCE_TABLE', &
      'takes the place of FORCE: give one of them')
    if (mod(n, 2) /= 0 .or. n > 2*max_forces) then
      call input%report('MOTION', i, 'FORCE_TABLE', 'must be pairs of time and force')
      return
    end if
    call check_rising(input, 'MOTION', i, 'FORCE_TABLE', phase%forces(1, :n/2), 'times')
  end subroutine check_phase

end module setup_motions
