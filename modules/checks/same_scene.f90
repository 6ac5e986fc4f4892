! SPDX-License-Identifier: MIT
!> Does a checkpoint belong to the scene that is to go on from it? Every key is compared, defaults
!> included, but for those that a restart may change (groups_table).
module checks_same_scene
  use base_kinds, only: rp
  use base_text, only: lower, str
  use contact_motion, only: motion_t
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_files, only: sums_of_files
  use input_values, only: input_t
  use keys_table, only: key_row_t
  use keys_written, only: items_t, split_values, to_logical, to_real, to_text
  use setup_tools, only: motion_of
  implicit none (type, external)
  private

  public :: compare_files, compare_scenes

  real(rp), parameter :: slack = 1.0e-12_rp   !! relative, of times and ways

contains

  !> Complain of all that the `new` scene cannot have after `time` [s] of the `old` one.
  subroutine compare_scenes(old, new, time, diagnostics)
    type(input_t), intent(in) :: old, new
    real(rp), intent(in) :: time
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

  !> Complain of files that the scene names and whose content is another than in the checkpoint,
  !> which has these `sums` (input_files).
  subroutine compare_files(sums, new, diagnostics)
    character(*), intent(in) :: sums
    type(input_t), intent(in) :: new
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
      if (status == 0) call new%report(diagnostics, trim(group), i, 'FILE', 'a restart cannot '// &
        'change it: the content of the file is not that with which the run began')
    end do
  end subroutine compare_files

  !> All groups of one name.
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
                        'was added: the scene of the checkpoint has not'//trim(so_many(n(1))))
      end if
    end do
    do i = n(2) + 1, n(1)
      if (new%table%groups(g)%repeats .or. group == 'HEAT') then
        call new%report(diagnostics, group, i, '', &
                        'is missing: the scene of the checkpoint has'//trim(so_many(n(1))))
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

  !> ` 2 of them`, or nothing for none and one.
  pure function so_many(n) result(text)
    integer, intent(in) :: n
    character(24) :: text

    text = ''
    if (n > 1) text = ' '//str(n)//' of them'
  end function so_many

  !> When a source ends [s].
  real(rp) function end_of(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    end_of = input%real('SOURCE', i, 'END')
    if (end_of <= 0.0_rp) end_of = huge(1.0_rp)
  end function end_of

  !> The values of one key.
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

  pure function shown(values) result(text)
    character(*), intent(in) :: values
    character(:), allocatable :: text

    text = excerpt(values)
    if (text == '') text = 'nothing'
  end function shown

  !> True if two items mean the same, as 1e-3 and 0.001 do.
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

  !> Tools must have moved as they did until `time`; after it they may move in any way.
  subroutine compare_motions(old, new, time, diagnostics)
    type(input_t), intent(in) :: old, new
    real(rp), intent(in) :: time
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: name
    real(rp) :: when
    integer :: i

    do i = 1, old%count('MOTION')
      name = old%text('MOTION', i, 'TOOL')
      when = parting(motion_of(old, name), motion_of(new, name), time)
      if (has_loose_ends(motion_of(old, name)) .or. has_loose_ends(motion_of(new, name))) then
        if (when < huge(1.0_rp)) call new%report(diagnostics, 'MOTION', max(1, first_of(new, &
          name)), '', 'of '//name//': a restart cannot change phases where some end at a load '// &
          'or temperature: it is not known from the input which have begun')
        cycle
      end if
      if (when > time) cycle
      call new%report(diagnostics, 'MOTION', max(1, first_of(new, name)), '', 'of '//name// &
                      ': a restart at t = '//str(time)// &
                      ' s cannot change what was before; at t = '//str(when)//' s it is '// &
                      path(motion_of(new, name), when)//' instead of '// &
                      path(motion_of(old, name), when))
    end do
    do i = 1, new%count('MOTION')
      name = new%text('MOTION', i, 'TOOL')
      if (first_of(old, name) > 0) cycle
      when = parting(motion_t(), motion_of(new, name), time)
      if (when <= time) call new%report(diagnostics, 'MOTION', i, '', 'of '//name// &
                                        ': until the checkpoint at t = '//str(time)// &
                                        ' s it did not move')
    end do
  end subroutine compare_motions

  !> Number of the first motion of a tool, 0 if it has none.
  integer function first_of(input, name)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: name

    do first_of = 1, input%count('MOTION')
      if (input%text('MOTION', first_of, 'TOOL') == name) return
    end do
    first_of = 0
  end function first_of

  !> A time until `time` at which two motions are in different places; later than `time` if there is
  !> none. Between the ends of phases and ramps the path is a parabola: three points decide.
  real(rp) function parting(one, other, time)
    type(motion_t), intent(in) :: one, other
    real(rp), intent(in) :: time
    real(rp), allocatable :: knots(:)
    real(rp) :: from, to
    integer :: k

    allocate (knots, source=[knots_of(one), knots_of(other), time])
    if (.not. (has_loose_ends(one) .or. has_loose_ends(other))) knots = pack(knots, knots <= time)
    parting = 0.0_rp
    if (.not. same_ends(one, other)) return
    to = 0.0_rp
    do
      from = to
      if (.not. any(knots > from)) exit
      to = minval(knots, mask=knots > from)
      do k = 1, 2
        parting = from + 0.5_rp*real(k, rp)*(to - from)
        if (differ(one, other, parting)) return
      end do
    end do
    parting = huge(1.0_rp)
  end function parting

  !> Whether a phase may end before its time: then none may change, since those may have come
  !> already that by the input follow later.
  pure logical function has_loose_ends(motion)
    type(motion_t), intent(in) :: motion

    has_loose_ends = .false.
    if (allocated(motion%phase)) has_loose_ends = any(motion%phase%ends_early())
  end function has_loose_ends

  !> Whether two motions have the same phases, or none that ends before its time.
  pure logical function same_ends(one, other)
    type(motion_t), intent(in) :: one, other

    same_ends = .not. (has_loose_ends(one) .or. has_loose_ends(other))
    if (same_ends) return
    if (.not. (allocated(one%phase) .and. allocated(other%phase))) return
    if (size(one%phase) /= size(other%phase)) return
    same_ends = .not. any(parts(one%phase%until_force, other%phase%until_force) .or. &
                          parts(one%phase%until_torque, other%phase%until_torque) .or. &
                          parts(one%phase%until_temperature, other%phase%until_temperature) .or. &
                          one%phase%until_probe /= other%phase%until_probe)
  end function same_ends

  elemental logical function parts(a, b)
    real(rp), intent(in) :: a, b

    parts = abs(a - b) > slack*abs(a)
  end function parts

  !> When phases and ramps end [s].
  pure function knots_of(motion) result(knots)
    type(motion_t), intent(in) :: motion
    real(rp), allocatable :: knots(:)
    real(rp) :: from
    integer :: k

    allocate (knots(0))
    if (.not. allocated(motion%phase)) return
    from = 0.0_rp
    do k = 1, size(motion%phase)
      knots = [knots, from + motion%phase(k)%ramp, from + motion%phase(k)%duration, &
               from + motion%phase(k)%forces(1, :motion%phase(k)%n_forces)]
      if (motion%phase(k)%duration <= 0.0_rp) exit
      from = from + motion%phase(k)%duration
    end do
  end function knots_of

  !> True if the ways [m, rad] of two motions until `t` differ by more than rounding.
  pure logical function differ(one, other, t)
    type(motion_t), intent(in) :: one, other
    real(rp), intent(in) :: t
    real(rp) :: a(4), b(4), force(2), v(3), spin
    logical :: presses(2)

    call one%at(t, a(1:3), v, a(4), spin)
    call other%at(t, b(1:3), v, b(4), spin)
    call one%pressing(t, 0.0_rp, presses(1), force(1))
    call other%pressing(t, 0.0_rp, presses(2), force(2))
    differ = presses(1) .neqv. presses(2)
    differ = differ .or. abs(force(1) - force(2)) > slack*maxval(abs(force))
    differ = differ .or. any(abs(a - b) > slack*(1.0_rp + 1000.0_rp*maxval(abs([a, b]))))
  end function differ

  !> Where a motion has led to.
  function path(motion, t) result(text)
    type(motion_t), intent(in) :: motion
    real(rp), intent(in) :: t
    character(:), allocatable :: text
    real(rp) :: shift(3), v(3), angle, spin

    call motion%at(t, shift, v, angle, spin)
    text = '('//str(shift(1))//', '//str(shift(2))//', '//str(shift(3))//') m and '//str(angle)// &
           ' rad away from its start'
  end function path

end module checks_same_scene
