! SPDX-License-Identifier: MIT
!> Comparison of the scene of a restart with that of its checkpoint: all keys, defaults included,
!> except those that a restart may change (groups_table).
module checks_same_scene
  use base_kinds, only: rp
  use base_text, only: lower, str
  use contact_motion, only: motion_t, wrapped
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_files, only: sums_of_files
  use input_values, only: input_t
  use keys_table, only: key_row_t
  use keys_written, only: items_t, split_values, to_logical, to_real, to_text
  use setup_motions, only: read_motion
  implicit none (type, external)
  private

  public :: compare_files, compare_scenes

  real(rp), parameter :: slack = 1.0e-12_rp   !! relative tolerance of times and path lengths

contains

  !> Report all keys of the `new` scene that differ from the `old` one and must not.
  subroutine compare_scenes(old, new, time, diagnostics)
    type(input_t), intent(in) :: old, new
    real(rp), intent(in) :: time             !! time of the checkpoint [s]
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: g

    associate (table => new%table)
      do g = 1, size(table%groups)
        if (table%groups(g)%name == 'MOTION') cycle
        if (all(table%keys(table%groups(g)%first:table%groups(g)%last)%may_change)) cycle
        call compare_groups(old, new, g, time, diagnostics)
      end do
    end associate
    call compare_motions(old, new, time, diagnostics)
    if (new%real('TIME', 1, 'END') < time*(1.0_rp - slack)) then
      call new%report(diagnostics, 'TIME', 1, 'END', 'lies before the '//str(time)// &
                      ' s of the checkpoint')
    end if
  end subroutine compare_scenes

  !> Report files named by the scene whose content differs from that at the start of the run, by
  !> their checksums in the checkpoint at `time` (input_files), except for paths that start later.
  subroutine compare_files(sums, new, time, diagnostics)
    character(*), intent(in) :: sums
    type(input_t), intent(in) :: new
    real(rp), intent(in) :: time
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: line, rest
    character(24) :: group
    integer :: i, status

    rest = sums_of_files(new)
    do while (rest /= '')
      line = rest(:index(rest, new_line('a')))
      rest = rest(len(line) + 1:)
      if (index(new_line('a')//sums, new_line('a')//line) > 0) cycle
      read (line, *, iostat=status) group, i
      if (status == 0 .and. group == 'MOTION') then
        if (begin_of(new, i) >= time) cycle
      end if
      if (status == 0) call new%report(diagnostics, trim(group), i, 'FILE', 'a restart cannot '// &
        'change it: the content of the file is not that with which the run began')
    end do
  end subroutine compare_files

  !> Compare all groups of one name.
  subroutine compare_groups(old, new, g, time, diagnostics)
    type(input_t), intent(in) :: old, new
    integer, intent(in) :: g
    real(rp), intent(in) :: time
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: group
    integer :: i, k, n(2)

    group = trim(new%table%groups(g)%name)
    n = [old%count(group), new%count(group)]
    do i = n(1) + 1, n(2)
      if (new%table%groups(g)%repeats .or. group == 'HEAT') then
        call new%report(diagnostics, group, i, '', &
                        'was added: the scene of the checkpoint has not'//trim(number_text(n(1))))
      end if
    end do
    do i = n(2) + 1, n(1)
      if (new%table%groups(g)%repeats .or. group == 'HEAT') then
        call new%report(diagnostics, group, i, '', &
                        'is missing: the scene of the checkpoint has'//trim(number_text(n(1))))
      end if
    end do
    if (.not. new%table%groups(g)%repeats) n = 1   ! without it there are its defaults
    do i = 1, minval(n)
      do k = new%table%groups(g)%first, new%table%groups(g)%last
        associate (row => new%table%keys(k))
          if (row%may_change) cycle
          if (group == 'SOURCE' .and. row%name == 'END') then
            if (min(end_of(old, i), end_of(new, i)) >= time*(1.0_rp - slack)) cycle
          end if
          call compare_values(new, group, i, row, old%values(group, i, trim(row%name)), &
                              new%values(group, i, trim(row%name)), diagnostics)
        end associate
      end do
    end do
  end subroutine compare_groups

  !> Text ` 2 of them`; '' for 0 and 1.
  pure function number_text(n) result(text)
    integer, intent(in) :: n
    character(24) :: text

    text = ''
    if (n > 1) text = ' '//str(n)//' of them'
  end function number_text

  !> End time of a heat source [s].
  real(rp) function end_of(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    end_of = input%real('SOURCE', i, 'END')
    if (end_of <= 0.0_rp) end_of = huge(1.0_rp)
  end function end_of

  !> Compare the values of one key.
  subroutine compare_values(new, group, i, row, was, is, diagnostics)
    type(input_t), intent(in) :: new
    character(*), intent(in) :: group
    integer, intent(in) :: i
    type(key_row_t), intent(in) :: row
    character(*), intent(in) :: was, is
    type(diagnostics_t), intent(inout) :: diagnostics
    type(items_t) :: a, b
    integer :: k

    if (was == is) return
    call split_values(was, a)
    call split_values(is, b)
    do k = 1, max(size(a%first), size(b%first))
      if (k > min(size(a%first), size(b%first))) exit
      if (.not. is_same(row%kind, was(a%first(k):a%last(k)), is(b%first(k):b%last(k)))) exit
    end do
    if (k > max(size(a%first), size(b%first))) return
    if (size(a%first) > 3 .and. size(a%first) == size(b%first)) then
      call new%report(diagnostics, group, i, trim(row%name), &
                      'a restart cannot change its value '//str(k)//' from '// &
                      was(a%first(k):a%last(k))//' to '//is(b%first(k):b%last(k)))
    else
      call new%report(diagnostics, group, i, trim(row%name), &
                      'a restart cannot change it from '//shown(was)//' to '//shown(is))
    end if
  end subroutine compare_values

  !> Values of a key for a message.
  pure function shown(values) result(text)
    character(*), intent(in) :: values
    character(:), allocatable :: text

    text = excerpt(values)
    if (text == '') text = 'nothing'
  end function shown

  !> True if two items have the same value, as 1e-3 and 0.001.
  logical function is_same(kind, one, other)
    character(*), intent(in) :: kind, one, other
    character(:), allocatable :: s, t
    real(rp) :: x, y
    logical :: ok(2), p, q

    is_same = one == other
    select case (kind)
    case ('real', 'integer')
      call to_real(one, x, ok(1))
      call to_real(other, y, ok(2))
      if (all(ok)) is_same = abs(x - y) <= 0.0_rp
    case ('logical')
      call to_logical(one, p, ok(1))
      call to_logical(other, q, ok(2))
      if (all(ok)) is_same = p .eqv. q
    case default
      call to_text(one, s, ok(1))
      call to_text(other, t, ok(2))
      if (all(ok)) is_same = s == t .or. (kind == 'choice' .and. lower(s) == lower(t))
    end select
  end function is_same

  !> Report motions that differ before the time of the checkpoint; later they may differ.
  subroutine compare_motions(old, new, time, diagnostics)
    type(input_t), intent(in) :: old, new
    real(rp), intent(in) :: time
    type(diagnostics_t), intent(inout) :: diagnostics
    type(motion_t) :: one, other
    character(:), allocatable :: name
    real(rp) :: t
    integer :: i

    do i = 1, old%count('MOTION')
      name = old%text('MOTION', i, 'TOOL')
      one = motion_of(old, name)
      other = motion_of(new, name)
      t = time_of_difference(one, other, time)
      if (may_end_early(one) .or. may_end_early(other)) then
        if (t < huge(1.0_rp)) call new%report(diagnostics, 'MOTION', max(1, first_of(new, &
          name)), '', 'of '//name//': a restart cannot change phases where some end at a load '// &
          'or temperature: it is not known from the input which have begun')
        cycle
      end if
      if (t > time) cycle
      call new%report(diagnostics, 'MOTION', max(1, first_of(new, name)), '', 'of '//name// &
                      ': a restart at t = '//str(time)// &
                      ' s cannot change what was before; at t = '//str(t)//' s it is '// &
                      position_text(other, t)//' instead of '//position_text(one, t))
    end do
    do i = 1, new%count('MOTION')
      name = new%text('MOTION', i, 'TOOL')
      if (first_of(old, name) > 0) cycle
      t = time_of_difference(motion_t(), motion_of(new, name), time)
      if (t <= time) call new%report(diagnostics, 'MOTION', i, '', 'of '//name// &
                                     ': until the checkpoint at t = '//str(time)// &
                                     ' s it did not move')
    end do
  end subroutine compare_motions

  !> Motion of the tool `name`; errors are reported where the scene is built.
  type(motion_t) function motion_of(input, name) result(motion)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name
    type(diagnostics_t) :: unused

    call read_motion(input, name, motion, unused)
  end function motion_of

  !> Start time of the `i`-th &MOTION [s]; 0 if it depends on a load, or if the tilt of the phases
  !> before follows its path.
  real(rp) function begin_of(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(motion_t) :: motion
    integer :: k

    motion = motion_of(input, input%text('MOTION', i, 'TOOL'))
    k = count([(input%text('MOTION', k, 'TOOL') == input%text('MOTION', i, 'TOOL'), k=1, i - 1)])
    begin_of = sum(motion%phase(:k)%duration)
    if (motion%phase(k + 1)%path%leads_tilt .and. .not. any(motion%phase(:k)%path%leads_tilt) &
        .or. may_end_early(motion)) begin_of = 0.0_rp
  end function begin_of

  !> Index of the first &MOTION of a tool; 0 if it has none.
  integer function first_of(input, name)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name

    do first_of = 1, input%count('MOTION')
      if (input%text('MOTION', first_of, 'TOOL') == name) return
    end do
    first_of = 0
  end function first_of

  !> First sampled time at which the positions of two motions differ; huge if they do not until
  !> `time`. Between breakpoints the path is a parabola, so that three points suffice.
  real(rp) function time_of_difference(one, other, time)
    type(motion_t), intent(in) :: one, other
    real(rp), intent(in) :: time
    real(rp), allocatable :: breakpoints(:)
    real(rp) :: from, to
    integer :: k

    allocate (breakpoints, source=[breakpoints_of(one), breakpoints_of(other), time])
    if (.not. (may_end_early(one) .or. may_end_early(other))) breakpoints = pack(breakpoints, &
      breakpoints <= time)
    time_of_difference = 0.0_rp
    if (.not. same_ends(one, other)) return
    to = 0.0_rp
    do
      from = to
      if (.not. any(breakpoints > from)) exit
      to = minval(breakpoints, mask=breakpoints > from)
      do k = 1, 2
        time_of_difference = from + 0.5_rp*real(k, rp)*(to - from)
        if (differ(one, other, time_of_difference)) return
      end do
    end do
    time_of_difference = huge(1.0_rp)
  end function time_of_difference

  !> True if a phase may end before its duration: then no phase may change, since later ones may
  !> have begun already.
  pure logical function may_end_early(motion)
    type(motion_t), intent(in) :: motion

    may_end_early = .false.
    if (allocated(motion%phase)) may_end_early = any(motion%phase%ends_early())
  end function may_end_early

  !> True if two motions have the same end conditions, or none.
  pure logical function same_ends(one, other)
    type(motion_t), intent(in) :: one, other

    same_ends = .not. (may_end_early(one) .or. may_end_early(other))
    if (same_ends) return
    if (.not. (allocated(one%phase) .and. allocated(other%phase))) return
    if (size(one%phase) /= size(other%phase)) return
    same_ends = .not. any(differs(one%phase%until_force, other%phase%until_force) .or. &
                          differs(one%phase%until_torque, other%phase%until_torque) .or. &
                          differs(one%phase%until_temperature, other%phase%until_temperature) .or. &
                          one%phase%until_probe /= other%phase%until_probe)
  end function same_ends

  !> True if two limits differ by more than rounding.
  elemental logical function differs(a, b)
    real(rp), intent(in) :: a, b

    differs = abs(a - b) > slack*abs(a)
  end function differs

  !> Times at which phases, ramps and pieces of force tables end [s].
  pure function breakpoints_of(motion) result(breakpoints)
    type(motion_t), intent(in) :: motion
    real(rp), allocatable :: breakpoints(:)
    real(rp) :: from
    integer :: k

    allocate (breakpoints(0))
    if (.not. allocated(motion%phase)) return
    from = 0.0_rp
    do k = 1, size(motion%phase)
      breakpoints = [breakpoints, from + motion%phase(k)%ramp, from + motion%phase(k)%duration, &
                     from + motion%phase(k)%forces(1, :motion%phase(k)%n_forces)]
      if (motion%phase(k)%duration <= 0.0_rp) exit
      from = from + motion%phase(k)%duration
    end do
  end function breakpoints_of

  !> True if positions, angles or forces of two motions differ at time `t` by more than rounding.
  pure logical function differ(one, other, t)
    type(motion_t), intent(in) :: one, other
    real(rp), intent(in) :: t
    real(rp) :: a(4), b(4), direction(2), force(2), v(3), spin
    logical :: presses(2)

    call one%at(t, a(1:3), v, a(4), spin)
    call other%at(t, b(1:3), v, b(4), spin)
    call one%face(t, direction(1), spin)
    call other%face(t, direction(2), spin)
    call one%force_control_at(t, 0.0_rp, presses(1), force(1))
    call other%force_control_at(t, 0.0_rp, presses(2), force(2))
    differ = (presses(1) .neqv. presses(2)) &
             .or. abs(wrapped(direction(2) - direction(1))) > slack*1000.0_rp
    differ = differ .or. abs(force(1) - force(2)) > slack*maxval(abs(force))
    differ = differ .or. any(abs(a - b) > slack*(1.0_rp + 1000.0_rp*maxval(abs([a, b]))))
  end function differ

  !> Text on the displacement and the angle of a motion at time `t`.
  function position_text(motion, t) result(text)
    type(motion_t), intent(in) :: motion
    real(rp), intent(in) :: t
    character(:), allocatable :: text
    real(rp) :: shift(3), v(3), angle, spin

    call motion%at(t, shift, v, angle, spin)
    text = '('//str(shift(1))//', '//str(shift(2))//', '//str(shift(3))//') m and '//str(angle)// &
           ' rad away from its start'
  end function position_text

end module checks_same_scene
