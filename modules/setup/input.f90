! SPDX-License-Identifier: MIT
!> The input of a run: namelist groups and `--set` overrides, checked against the table of keys.
module setup_input
  use base_errors, only: fatal
  use base_kinds, only: rp
  use base_text, only: lower, str
  use setup_complaints, only: check_value, complaints_t, excerpt, unknown_group, unknown_key
  use setup_key_rows, only: key_table
  use setup_keys, only: default_item
  use setup_keys_table, only: key_row_t, key_table_t, quoted, split_override, split_words, &
    to_integer, to_logical, to_real, to_text
  use setup_scan, only: assignment_t, group_t, read_file, scan_t, scan_text
  implicit none (type, external)
  private

  public :: input_t, read_input, read_input_text

  !> A checked input. Look-ups name a group, which of its instances (from 1), and a key.
  type :: input_t
    character(:), allocatable :: file                  !! name of the input file
    type(scan_t), private :: written
    type(key_table_t), private :: table
  contains
    procedure :: count => count_groups
    procedure :: given => is_given
    procedure :: real => one_real
    procedure :: reals => some_reals
    procedure :: list => all_reals
    procedure :: integers => some_integers
    procedure :: integer => one_integer
    procedure :: logical => one_logical
    procedure :: text => one_text
    procedure :: line => line_of
    procedure :: complain
    procedure :: text_of_file
    procedure :: echo
    procedure, private :: item
    procedure, private :: row_number
  end type input_t

contains

  !> Read and check a file; every rank may do so, nothing is printed.
  subroutine read_input(file, sets, input, complaints, point)
    character(*), intent(in) :: file
    character(*), intent(in) :: sets(:)   !! GROUP.KEY=VALUE, GROUP(2).KEY=.., GROUP(name).KEY=..
    type(input_t), intent(out) :: input
    type(complaints_t), intent(inout) :: complaints
    logical, intent(in), optional :: point   !! true: only of a material point, not of a run
    character(:), allocatable :: text, problem

    call read_file(file, text, problem)
    if (problem == '') then
      call read_input_text(file, text, sets, input, complaints, point)
    else
      input%file = file
      input%table = key_table()
      call scan_text(file, '', input%written, complaints)
      call complaints%add(file, 0, problem)
    end if
  end subroutine read_input

  !> The same for a text at hand, such as the input kept in a checkpoint.
  subroutine read_input_text(file, text, sets, input, complaints, point)
    character(*), intent(in) :: file      !! name for the messages; its stem is the default RUN NAME
    character(*), intent(in) :: text, sets(:)
    type(input_t), intent(out) :: input
    type(complaints_t), intent(inout) :: complaints
    logical, intent(in), optional :: point
    character(:), allocatable :: stem
    integer :: k

    input%file = file
    input%table = key_table()
    if (present(point)) then
      input%table%groups%is_required = input%table%groups%name == 'MATERIAL' &
                                       .or. input%table%groups%name == 'PATH'
    end if
    stem = file(index(file, '/', back=.true.) + 1:)
    if (index(stem, '.', back=.true.) > 1) stem = stem(:index(stem, '.', back=.true.) - 1)
    input%table%keys(input%table%find_key(input%table%find_group('RUN'), 'NAME'))%default = stem
    call complaints%note_overrides(sets)
    call scan_text(file, text, input%written, complaints)
    do k = 1, size(sets)
      call apply_override(input, sets(k), k, complaints)
    end do
    call check_groups(input, complaints)
    call check_assignments(input, complaints)
    call check_presence(input, complaints)
  end subroutine read_input_text

  !> Put the `k`-th override in the place of what the file says.
  subroutine apply_override(input, set, k, complaints)
    type(input_t), intent(inout) :: input
    character(*), intent(in) :: set
    integer, intent(in) :: k
    type(complaints_t), intent(inout) :: complaints
    type(assignment_t) :: new
    character(:), allocatable :: group, which, value
    integer :: g, i, row
    logical :: ok

    call split_override(trim(set), group, which, new%key, new%index, value, ok)
    row = 0
    g = merge(input%table%find_group(group), 0, ok)
    if (g > 0) row = input%table%find_key(g, new%key)
    if (.not. ok) then
      call complaints%add(input%file, -k, 'expected GROUP.KEY=VALUE')
    else if (g == 0) then
      call complaints%add(input%file, -k, unknown_group(input%table, group))
    else if (row == 0) then
      call complaints%add(input%file, -k, unknown_key(input%table, g, new%key))
    end if
    if (row == 0) return

    if (any(input%table%keys(row)%kind == [character(8) :: 'text', 'choice']) .and. &
        scan(value(1:1), '''"') == 0) value = quoted(value)
    new%line = -k
    if (input%count(group) == 0 .and. .not. input%table%groups(g)%repeats) input%written%groups = &
      [input%written%groups, group_t(group, -k)]
    ok = .false.
    do i = 1, input%count(group)
      if (.not. is_meant(input, group, i, which)) cycle
      ok = .true.
      new%group = input%written%find(group, i)
      call input%written%replace(new, value)
    end do
    if (.not. ok) call complaints%add(input%file, -k, 'the input has no such &'//group)
  end subroutine apply_override

  !> True if an override of `GROUP`, `GROUP(2)` or `GROUP(name)` means the `i`-th group.
  logical function is_meant(input, group, i, which)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(*), intent(in) :: which     !! number, NAME, or empty for all

    is_meant = which == '' .or. which == str(i)
    if (is_meant .or. input%table%find_key(input%table%find_group(group), 'NAME') == 0) return
    is_meant = input%text(group, i, 'NAME') == which
  end function is_meant

  !> Unknown groups, groups given twice, missing groups.
  subroutine check_groups(input, complaints)
    type(input_t), intent(in) :: input
    type(complaints_t), intent(inout) :: complaints
    integer :: g, i, first

    do i = 1, size(input%written%groups)
      associate (group => input%written%groups(i))
        g = input%table%find_group(group%name)
        first = input%written%find(group%name, 1)
        if (g == 0) then
          call complaints%add(input%file, group%line, unknown_group(input%table, group%name))
        else if (first < i .and. .not. input%table%groups(g)%repeats) then
          call complaints%add(input%file, group%line, '&'//trim(group%name)// &
            ' may be given only once (first on line '//str(input%written%groups(first)%line)//')')
        end if
      end associate
    end do
    do g = 1, size(input%table%groups)
      if (input%table%groups(g)%is_required .and. &
          input%count(input%table%groups(g)%name) == 0) call complaints%add(input%file, 0, &
        'there is no &'//trim(input%table%groups(g)%name)//' (required)')
    end do
  end subroutine check_groups

  !> Unknown keys, keys given twice, bad values.
  subroutine check_assignments(input, complaints)
    type(input_t), intent(inout) :: input
    type(complaints_t), intent(inout) :: complaints
    character(:), allocatable :: label, message, value
    integer :: g, i, row, twin

    do i = 1, size(input%written%assignments)
      associate (one => input%written%assignments(i), before => input%written%assignments(:i - 1))
        g = input%table%find_group(input%written%groups(one%group)%name)
        if (g == 0 .or. one%key == '') cycle
        row = input%table%find_key(g, one%key)
        if (row == 0) then
          call complaints%add(input%file, one%line, unknown_key(input%table, g, one%key))
          cycle
        end if
        label = '&'//trim(input%table%groups(g)%name)//' '//trim(one%key)
        twin = findloc(before%group == one%group .and. before%key == one%key .and. one%line > 0 &
                 .and. (before%index == one%index .or. before%index*one%index == 0), .true., dim=1)
        if (twin > 0) call complaints%add(input%file, one%line, label// &
          ' is given twice (first on line '//str(before(twin)%line)//')')
        if (one%is_broken) cycle
        value = input%written%value(i)
        message = check_value(input%table%keys(row), one%index, value)
        one%is_broken = message /= ''
        if (one%index > 0) label = label//'('//str(one%index)//')'
        if (one%is_broken) call complaints%add(input%file, one%line, &
          label//' = '//excerpt(value)//': '//message)
      end associate
    end do
  end subroutine check_assignments

  !> Keys that are missing, and vectors of which only some components are written.
  subroutine check_presence(input, complaints)
    type(input_t), intent(in) :: input
    type(complaints_t), intent(inout) :: complaints
    character(48), allocatable :: w(:)
    character(:), allocatable :: group
    integer :: g, i, k

    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      do i = 1, input%count(group)
        if (input%written%groups(input%written%find(group, i))%is_broken) cycle
        do k = input%table%groups(g)%first, input%table%groups(g)%last
          associate (row => input%table%keys(k))
            call split_words(row%requirement, w)   ! required [if KEY = one or other]
            if (input%given(group, i, row%name)) then
              if (is_partial(input, group, i, row)) call input%complain(complaints, group, i, &
                row%name, 'not all of its '//str(row%n)//' values are given')
            else if (size(w) > 0) then
              if (size(w) > 4) then
                if (.not. any(w(5:) == input%text(group, i, w(3)))) cycle
              end if
              call input%complain(complaints, group, i, '', &
                                  'has no '//trim(row%name)//' ('//trim(row%requirement)//')')
            end if
          end associate
        end do
      end do
    end do
  end subroutine check_presence

  !> True if a key of several values was written without some that have no default.
  logical function is_partial(input, group, i, row)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    type(key_row_t), intent(in) :: row
    integer :: a, k

    is_partial = .false.
    a = input%written%last_of(input%written%find(group, i), row%name)
    if (input%written%assignments(a)%is_broken) return
    do k = 1, merge(row%n, 0, row%n > 1)
      if (input%item(group, i, row%name, row%kind, k) == '') is_partial = .true.
    end do
  end function is_partial

  !> File `&GROUP KEY = value: message`, or `&GROUP message` if the key is empty, where it belongs.
  subroutine complain(self, complaints, group, i, key, message)
    class(input_t), intent(in) :: self
    type(complaints_t), intent(inout) :: complaints
    character(*), intent(in) :: group, key, message
    integer, intent(in) :: i
    character(:), allocatable :: label
    integer :: a

    label = '&'//trim(group)//' '//trim(key)
    a = self%written%last_of(self%written%find(group, i), key)
    if (a > 0) then
      if (self%written%assignments(a)%is_broken) return   ! has its complaint
      label = label//' = '//excerpt(self%written%value(a))
    end if
    if (key /= '') label = label//': '
    call complaints%add(self%file, self%line(group, i, key), label//message)
  end subroutine complain

  !> Line of the key, or else of the group; 0 if neither was written, -k: the k-th override.
  pure integer function line_of(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(*), intent(in), optional :: key
    integer :: g, a

    line_of = 0
    g = self%written%find(group, i)
    if (g > 0) line_of = self%written%groups(g)%line
    if (.not. present(key)) return
    a = self%written%last_of(g, key)
    if (a > 0) line_of = self%written%assignments(a)%line
  end function line_of

  !> Number of groups of this name.
  pure integer function count_groups(self, group)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group

    count_groups = count(self%written%groups%name == group)
  end function count_groups

  !> True if the key was written in the file or set by an override.
  logical function is_given(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i

    is_given = self%row_number(group, i, key, 'real integer logical text choice') > 0 &
      .and. self%written%last_of(self%written%find(group, i), key) > 0
  end function is_given

  !> Row of a key in the table; asking for what cannot be there is a programming error.
  integer function row_number(self, group, i, key, kind)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    character(*), intent(in) :: kind       !! types that the caller expects
    integer :: g

    row_number = 0
    g = self%table%find_group(group)
    if (g > 0) row_number = self%table%find_key(g, key)
    if (row_number == 0) call fatal('look-up of &'//group//' '//key// &
      ', which the table of keys does not have')
    if (index(kind, trim(self%table%keys(row_number)%kind)) == 0) call fatal('look-up of &'// &
      group//' '//key//' with the wrong type')
    if (i < 1 .or. (i > self%count(group) .and. (i > 1 .or. self%table%groups(g)%repeats))) then
      call fatal('look-up of &'//group//' number '//str(i)//', which the input does not have')
    end if
  end function row_number

  !> The `k`-th value as text: what was written, else the default, else empty.
  function item(self, group, i, key, kind, k) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key, kind
    integer, intent(in) :: i, k
    character(:), allocatable :: r
    integer, allocatable :: first(:), last(:)
    integer :: a

    associate (row => self%table%keys(self%row_number(group, i, key, kind)))
      allocate (first(max(k, abs(row%n))), last(max(k, abs(row%n))))
      call self%written%gather(self%written%find(group, i), key, first, last)
      a = self%written%last_of(self%written%find(group, i), key)
      r = ''
      if (first(k) > 0) then
        r = self%written%text(first(k):last(k))
      else if (a > 0) then
        if (self%written%assignments(a)%is_broken) return
      end if
      if (r == '') r = default_item(row, k)
      if (row%kind == 'choice') r = lower(r)
    end associate
  end function item

  !> The first `n` values of a key of real numbers, in its unit.
  function some_reals(self, group, i, key, n) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i, n
    real(rp) :: r(n)
    logical :: ok
    integer :: k

    do k = 1, n
      call to_real(self%item(group, i, key, 'real', k), r(k), ok)
    end do
  end function some_reals

  !> All values of a key of real numbers, as many as were written; those of the default if none.
  function all_reals(self, group, i, key) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    real(rp), allocatable :: r(:)
    integer :: n

    do n = 1, abs(self%table%keys(self%row_number(group, i, key, 'real'))%n)
      if (self%item(group, i, key, 'real', n) == '') exit
    end do
    r = self%reals(group, i, key, n - 1)
  end function all_reals

  real(rp) function one_real(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    logical :: ok

    call to_real(self%item(group, i, key, 'real', 1), one_real, ok)
  end function one_real

  integer function one_integer(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    logical :: ok

    call to_integer(self%item(group, i, key, 'integer', 1), one_integer, ok)
  end function one_integer

  !> The first `n` values of a key of whole numbers; 0 for those that neither file nor default has.
  function some_integers(self, group, i, key, n) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i, n
    integer :: r(n), k
    character(:), allocatable :: text
    logical :: ok

    r = 0
    do k = 1, n
      text = self%item(group, i, key, 'integer', k)
      if (text /= '') call to_integer(text, r(k), ok)
    end do
  end function some_integers

  logical function one_logical(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    logical :: ok

    call to_logical(self%item(group, i, key, 'logical', 1), one_logical, ok)
  end function one_logical

  !> A text, or a choice in small letters; without trailing blanks.
  function one_text(self, group, i, key) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    character(:), allocatable :: r
    logical :: ok

    call to_text(self%item(group, i, key, 'text or choice', 1), r, ok)
  end function one_text

  !> The input with overrides applied, as namelist text: for outputs and checkpoints.
  function text_of_file(self) result(r)
    class(input_t), intent(in) :: self
    character(:), allocatable :: r

    r = self%written%text_of_groups(self%table)
  end function text_of_file

  !> Write this text.
  subroutine echo(self, unit)
    class(input_t), intent(in) :: self
    integer, intent(in) :: unit

    write (unit, '(a)') self%text_of_file()
  end subroutine echo

end module setup_input
