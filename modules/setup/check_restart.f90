! SPDX-License-Identifier: MIT
!> Comparison of the scene of a restart with that of its checkpoint: all keys, defaults included,
!> except those that a restart may change (setup_keys).
module setup_check_restart
  use base_kinds, only: rp
  use base_text, only: lower, str
  use input_diagnostics, only: excerpt
  use input_key_table, only: find, key_row_t
  use input_resolved, only: sums_of_files
  use input_syntax, only: items_t, split_values, to_logical, to_real, to_text
  use input_values, only: input_t
  use setup_motions, only: read_motion
  use tools_motion, only: motion_t
  implicit none (type, external)
  private

  public :: compare_files, compare_scenes

  real(rp), parameter :: slack = 1.0e-12_rp   !! relative tolerance of times and path lengths

contains

  !> Report all keys of the `new` scene that differ from the `old` one and must not.
  subroutine compare_scenes(old, new, time)
    type(input_t), intent(in) :: old, new
    real(rp), intent(in) :: time             !! time of the checkpoint [s]
    integer :: g

    associate (table => new%table)
      do g = 1, size(table%groups)
        if (table%groups(g)%name == 'MOTION') cycle
        if (all(table%keys(table%groups(g)%first:table%groups(g)%last)%may_change)) cycle
        call compare_groups(old, new, g, time)
      end do
    end associate
    call compare_motions(old, new, time)
    if (new%real('TIME', 1, 'END') < time*(1.0_rp - slack)) then
      call new%report('TIME', 1, 'END', 'lies before the '//str(time)//' s of the checkpoint')
    end if
  end subroutine compare_scenes

  !> Report files named by the scene whose content, by the checksums in the checkpoint at `time`
  !> (input_resolved), differs from that at the start of the run. Paths that start later may differ.
  subroutine compare_files(sums, new, time)
    character(*), intent(in) :: sums
    type(input_t), intent(in) :: new
    real(rp), intent(in) :: time
    character(:), allocatable :: line, name, rest
    character(24) :: group
    real(rp) :: begin, end
    integer :: i, status

    rest = sums_of_files(new)
    do while (rest /= '')
      line = rest(:index(rest, new_line('a')))
      rest = rest(len(line) + 1:)
      if (index(new_line('a')//sums, new_line('a')//line) > 0) cycle
      read (line, *, iostat=status) group, i
      if (status == 0 .and. group == 'MOTION') then
        name = new%text('MOTION', i, 'TOOL')
        call find_times(new, name, findloc(phases_of(new, name), i, dim=1), begin, end)
        if (begin >= time .and. .not. may_end_early(new, name)) cycle
      end if
      if (status == 0) call new%report(trim(group), i, 'FILE', 'a restart cannot change it: '// &
                                       'the content of the file is not that with which the run '// &
                                       'began')
    end do
  end subroutine compare_files

  !> Compare all groups of one name.
  subroutine compare_groups(old, new, g, time)
    type(input_t), intent(in) :: old, new
    integer, intent(in) :: g
    real(rp), intent(in) :: time
    character(:), allocatable :: before, group
    integer :: i, k, n(2)

    group = trim(new%table%groups(g)%name)
    n = [old%count(group), new%count(group)]
    if (new%table%groups(g)%repeats .or. group == 'HEAT') then
      before = ': the scene of the checkpoint has '//str(n(1))//' of them'
      do i = n(1) + 1, n(2)
        call new%report(group, i, '', 'was added'//before)
      end do
      do i = n(2) + 1, n(1)
        call new%report(group, i, '', 'is missing'//before)
      end do
    end if
    if (.not. new%table%groups(g)%repeats) n = 1   ! an absent group has its defaults
    do i = 1, minval(n)
      do k = new%table%groups(g)%first, new%table%groups(g)%last
        associate (row => new%table%keys(k))
          if (row%may_change) cycle
          if (group == 'SOURCE' .and. row%name == 'END') then
            if (min(end_of(old, i), end_of(new, i)) >= time*(1.0_rp - slack)) cycle
          end if
          call compare_values(new, group, i, row, old%values(group, i, trim(row%name)))
        end associate
      end do
    end do
  end subroutine compare_groups

  !> End time of a heat source [s].
  real(rp) function end_of(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    end_of = input%real('SOURCE', i, 'END')
    if (end_of <= 0.0_rp) end_of = huge(1.0_rp)
  end function end_of

  !> Compare the values of one key with its values in the checkpoint, `was`.
  subroutine compare_values(new, group, i, row, was)
    type(input_t), intent(in) :: new
    character(*), intent(in) :: group, was
    integer, intent(in) :: i
    type(key_row_t), intent(in) :: row
    type(items_t) :: a, b
    character(:), allocatable :: is
    integer :: k

    is = new%values(group, i, trim(row%name))
    k = first_difference(row%kind, was, is)
    if (k == 0) return
    call split_values(was, a)
    call split_values(is, b)
    if (size(a%first) > 3 .and. size(a%first) == size(b%first)) then
      call new%report(group, i, trim(row%name), 'a restart cannot change its value '//str(k)// &
                      ' from '//was(a%first(k):a%last(k))//' to '//is(b%first(k):b%last(k)))
    else
      call new%report(group, i, trim(row%name), 'a restart cannot change it from '//shown(was)// &
                      ' to '//shown(is))
    end if
  end subroutine compare_values

  !> Index of the first value in which two lists differ, or which only one has; 0 if there is none.
  integer function first_difference(kind, was, is) result(k)
    character(*), intent(in) :: kind, was, is
    type(items_t) :: a, b

    call split_values(was, a)
    call split_values(is, b)
    do k = 1, max(size(a%first), size(b%first))
      if (k > min(size(a%first), size(b%first))) return
      if (.not. is_same(kind, was(a%first(k):a%last(k)), is(b%first(k):b%last(k)))) return
    end do
    k = 0
  end function first_difference

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

  !> Compare the motions of all tools.
  subroutine compare_motions(old, new, time)
    type(input_t), intent(in) :: old, new
    real(rp), intent(in) :: time
    character(64) :: names(old%count('MOTION') + new%count('MOTION'))
    integer :: i, n

    n = old%count('MOTION')
    do i = 1, size(names)
      if (i <= n) names(i) = old%text('MOTION', i, 'TOOL')
      if (i > n) names(i) = new%text('MOTION', i - n, 'TOOL')
      if (find(names(:i - 1), names(i)) > 0) cycle
      call compare_motion(old, new, trim(names(i)), time)
    end do
  end subroutine compare_motions

  !> Report changes of the phases of a tool that have begun by the time of the checkpoint. If phases
  !> end at a load or temperature, it is not known which have begun. A current phase may end at
  !> another time.
  subroutine compare_motion(old, new, name, time)
    type(input_t), intent(in) :: old, new
    character(*), intent(in) :: name
    real(rp), intent(in) :: time
    character(:), allocatable :: changed, hint, key
    integer, allocatable :: was(:), is(:)    ! indices of its &MOTION groups
    real(rp) :: begin(2), end(2)
    logical :: ends_early
    integer :: i, k, row

    allocate (was, source=phases_of(old, name))
    allocate (is, source=phases_of(new, name))
    ends_early = may_end_early(old, name) .or. may_end_early(new, name)
    do k = 1, max(size(was), size(is))
      begin = huge(1.0_rp)
      end = -huge(1.0_rp)
      if (k <= size(was)) call find_times(old, name, k, begin(1), end(1))
      if (k <= size(is)) call find_times(new, name, k, begin(2), end(2))
      if (minval(begin) >= time*(1.0_rp - slack) .and. .not. ends_early) cycle
      changed = ''
      if (k > min(size(was), size(is))) then
        changed = ' a phase'
      else
        associate (group => new%table%groups(new%table%find_group('MOTION')))
          do row = group%first, group%last
            key = trim(new%table%keys(row)%name)
            if (key == 'DURATION' .and. minval(end) > time .and. .not. ends_early) cycle
            if (first_difference(new%table%keys(row)%kind, old%values('MOTION', was(k), key), &
                                 new%values('MOTION', is(k), key)) > 0) changed = changed//' '//key
          end do
        end associate
      end if
      if (changed == '') cycle
      hint = ''
      if (minval(begin) < time .and. minval(end) > time) hint = '; end this phase by its '// &
        'DURATION and add a &MOTION of the same TOOL after it'
      i = 1
      if (size(is) > 0) i = is(min(k, size(is)))
      if (ends_early) then
        call new%report('MOTION', i, '', 'of '//name//': a restart cannot change phases where '// &
                        'some end at a load or temperature:'//changed)
      else
        call new%report('MOTION', i, '', 'of '//name//': a restart at t = '//str(time)// &
                        ' s cannot change what was before:'//changed//hint)
      end if
    end do
  end subroutine compare_motion

  !> Indices of the &MOTION groups of a tool.
  function phases_of(input, name) result(phases)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name
    integer, allocatable :: phases(:)
    integer :: i, n

    n = input%count('MOTION')
    phases = pack([(i, i=1, n)], [(input%text('MOTION', i, 'TOOL') == name, i=1, n)])
  end function phases_of

  !> True if a phase may end before its duration.
  logical function may_end_early(input, name)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name
    type(motion_t) :: motion

    call read_motion(input, name, motion)
    may_end_early = any(motion%phase%ends_early())
  end function may_end_early

  !> Times at which phase `k` of a tool begins and ends [s]. The first path that leads the tilt
  !> counts from the start of the run, as the tool has the tilt of the path in the phases before.
  subroutine find_times(input, name, k, begin, end)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name
    integer, intent(in) :: k
    real(rp), intent(out) :: begin, end
    type(motion_t) :: motion

    call read_motion(input, name, motion)
    associate (phase => motion%phase)
      begin = sum(phase(:k - 1)%duration)
      end = begin + phase(k)%duration
      if (phase(k)%duration <= 0.0_rp) end = huge(1.0_rp)
      if (phase(k)%path%leads_tilt .and. .not. any(phase(:k - 1)%path%leads_tilt)) begin = 0.0_rp
    end associate
  end subroutine find_times

end module setup_check_restart
