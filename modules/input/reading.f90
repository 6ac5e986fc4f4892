! SPDX-License-Identifier: MIT
!> Reading of the input of a run: namelist groups and `--set` overrides, checked against the table
!> of keys.
module input_reading
  use base_text, only: str
  use input_assignments, only: assignment_t
  use input_diagnostics, only: excerpt
  use input_key_table, only: find, key_row_t, key_table_t, known
  use input_library, only: take_from_library
  use input_scan, only: read_file, scan_text
  use input_syntax, only: quoted, split_override, split_words
  use input_values, only: input_t
  use input_wording, only: can_name_results, check_value, unknown_group, unknown_key
  implicit none (type, external)
  private

  public :: read_input, read_input_text

contains

  !> Read and check an input file, on any rank; nothing is printed.
  subroutine read_input(table, file, overrides, input, point)
    type(key_table_t), intent(in) :: table   !! table of keys
    character(*), intent(in) :: file
    !> GROUP.KEY=VALUE, GROUP(2).KEY=.., GROUP(name).KEY=...
    character(*), intent(in) :: overrides(:)
    type(input_t), intent(out) :: input
    logical, intent(in), optional :: point   !! the input of `--material`
    character(:), allocatable :: text, problem

    call read_file(file, text, problem)
    if (problem == '') then
      call read_input_text(table, file, text, overrides, input, point)
    else
      input%file = file
      input%table = table
      allocate (input%diagnostics)
      call scan_text(file, '', input%written, input%diagnostics)
      call input%diagnostics%add(file, 0, problem)
    end if
  end subroutine read_input

  !> Check an input text, such as that of a checkpoint.
  subroutine read_input_text(table, file, text, overrides, input, point, resumed)
    type(key_table_t), intent(in) :: table
    character(*), intent(in) :: file      !! name in messages; its stem is the default RUN NAME
    character(*), intent(in) :: text, overrides(:)
    type(input_t), intent(out) :: input
    logical, intent(in), optional :: point
    logical, intent(in), optional :: resumed   !! the text of a checkpoint may have unused keys
    character(:), allocatable :: stem
    integer :: k

    input%file = file
    input%table = table
    allocate (input%diagnostics)
    if (present(point)) then
      input%table%groups%is_required = input%table%groups%name == 'MATERIAL' &
                                       .or. input%table%groups%name == 'PATH'
    end if
    stem = file(index(file, '/', back=.true.) + 1:)
    if (index(stem, '.', back=.true.) > 1) stem = stem(:index(stem, '.', back=.true.) - 1)
    input%table%keys(input%table%find_key(input%table%find_group('RUN'), 'NAME'))%default = stem
    call input%diagnostics%store_overrides(overrides)
    call scan_text(file, text, input%written, input%diagnostics)
    do k = 1, size(overrides)
      call apply_override(input, overrides(k), k)
    end do
    if (.not. input%given('RUN', 1, 'NAME') .and. .not. can_name_results(stem)) then
      call input%diagnostics%add(file, 0, 'the name of this file cannot be that of the '// &
                                 'results: give &RUN NAME')
    end if
    call check_groups(input)
    call check_assignments(input)
    call take_from_library(input, present(resumed))
    call check_presence(input, present(resumed))
    call check_names(input)
  end subroutine read_input_text

  !> Apply the `k`-th override.
  subroutine apply_override(input, set, k)
    type(input_t), intent(inout) :: input
    character(*), intent(in) :: set
    integer, intent(in) :: k
    type(assignment_t) :: new
    character(:), allocatable :: group, which, value
    integer :: g, i, row
    logical :: ok

    call split_override(trim(set), group, which, new%key, new%index, value, ok)
    row = 0
    g = merge(input%table%find_group(group), 0, ok)
    if (g > 0) row = input%table%find_key(g, new%key)
    if (.not. ok) then
      call input%diagnostics%add(input%file, -k, 'expected GROUP.KEY=VALUE')
    else if (g == 0) then
      call input%diagnostics%add(input%file, -k, unknown_group(input%table, group))
    else if (row == 0) then
      call input%diagnostics%add(input%file, -k, unknown_key(input%table, g, new%key))
    end if
    if (row == 0) return

    if (any(input%table%keys(row)%kind == [character(8) :: 'text', 'choice']) .and. &
        scan(value(1:1), '''"') == 0) value = quoted(value)
    new%line = -k
    if (input%count(group) == 0 .and. .not. input%table%groups(g)%repeats) then
      call input%written%add_group(group, -k)
    end if
    ok = .false.
    do i = 1, input%count(group)
      if (.not. applies_to(input, group, i, which)) cycle
      ok = .true.
      new%group = input%written%find(group, i)
      call input%written%replace(new, value)
    end do
    if (.not. ok) call input%diagnostics%add(input%file, -k, 'the input has no such &'//group)
  end subroutine apply_override

  !> True if an override of `GROUP`, `GROUP(2)` or `GROUP(name)` applies to the `i`-th group.
  logical function applies_to(input, group, i, which)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(*), intent(in) :: which     !! number, NAME, or empty for all

    applies_to = which == '' .or. which == str(i)
    if (applies_to .or. input%table%find_key(input%table%find_group(group), 'NAME') == 0) return
    applies_to = input%text(group, i, 'NAME') == which
  end function applies_to

  !> Report unknown, duplicate and missing groups.
  subroutine check_groups(input)
    type(input_t), intent(in) :: input
    integer :: g, i, first

    do i = 1, size(input%written%groups)
      associate (group => input%written%groups(i))
        g = input%table%find_group(group%name)
        first = input%written%find(group%name, 1)
        if (g == 0) then
          call input%diagnostics%add(input%file, group%line, unknown_group(input%table, group%name))
        else if (first < i .and. .not. input%table%groups(g)%repeats) then
          call input%diagnostics%add(input%file, group%line, '&'//trim(group%name)// &
                                     ' may be given only once (first on line '// &
                                     str(input%written%groups(first)%line)//')')
        end if
      end associate
    end do
    do g = 1, size(input%table%groups)
      if (input%table%groups(g)%is_required .and. input%count(input%table%groups(g)%name) == 0) then
        call input%diagnostics%add(input%file, 0, 'there is no &'// &
                                   trim(input%table%groups(g)%name)//' (required)')
      end if
    end do
  end subroutine check_groups

  !> Report unknown and duplicate keys, and invalid values.
  subroutine check_assignments(input)
    type(input_t), intent(inout) :: input
    character(:), allocatable :: label, message, value
    integer :: g, i, row, earlier

    do i = 1, size(input%written%assignments)
      associate (one => input%written%assignments(i))
        g = input%table%find_group(input%written%groups(one%group)%name)
        if (g == 0 .or. one%key == '') cycle
        row = input%table%find_key(g, one%key)
        if (row == 0) then
          call input%diagnostics%add(input%file, one%line, unknown_key(input%table, g, one%key))
          cycle
        end if
        label = '&'//trim(input%table%groups(g)%name)//' '//trim(one%key)
        earlier = duplicate_of(input%written%assignments, input%written%groups(one%group)%first, i)
        if (earlier > 0) call input%diagnostics%add(input%file, one%line, label// &
          ' is given twice (first on line '//str(input%written%assignments(earlier)%line)//')')
        if (one%is_broken) cycle
        value = input%written%value(i)
        message = check_value(input%table%keys(row), one%index, value)
        one%is_broken = message /= ''
        if (one%index > 0) label = label//'('//str(one%index)//')'
        if (one%is_broken) call input%diagnostics%add(input%file, one%line, label//' = '// &
          excerpt(value)//': '//message)
      end associate
    end do
  end subroutine check_assignments

  !> Index of an assignment before the `i`-th, from `first` of its group on, that sets the same
  !> value; 0 if there is none.
  pure integer function duplicate_of(list, first, i)
    type(assignment_t), intent(in) :: list(:)
    integer, intent(in) :: first, i

    if (list(i)%line > 0) then
      do duplicate_of = first, i - 1
        if (list(duplicate_of)%key == list(i)%key .and. (list(duplicate_of)%index == list(i)%index &
            .or. list(duplicate_of)%index*list(i)%index == 0)) return
      end do
    end if
    duplicate_of = 0
  end function duplicate_of

  !> Report missing and unused keys, and incomplete vectors.
  subroutine check_presence(input, is_resumed)
    type(input_t), intent(in) :: input
    logical, intent(in) :: is_resumed
    character(:), allocatable :: group, need
    integer :: g, i, k

    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      do i = 1, input%count(group)
        if (input%written%groups(input%written%find(group, i))%is_broken) cycle
        do k = input%table%groups(g)%first, input%table%groups(g)%last
          associate (row => input%table%keys(k))
            if (input%given(group, i, row%name)) then
              if (is_partial(input, group, i, row)) then
                call input%report(group, i, row%name, 'not all of its '//str(row%n)// &
                                  ' values are given')
              end if
              if (.not. is_resumed) call check_effect(input, group, i, row)
            else if (row%is_required) then
              if (input%holds(group, i, row%condition)) then
                need = 'required'
                if (row%condition /= '') need = need//' if '//trim(row%condition)
                call input%report(group, i, '', 'has no '//trim(row%name)//' ('//need//')')
              end if
            end if
          end associate
        end do
      end do
    end do
  end subroutine check_presence

  !> Report names that two groups have, and texts that must be the NAME of another group (`&BODY` in
  !> the column of allowed values) and are not.
  subroutine check_names(input)
    type(input_t), intent(in) :: input
    character(:), allocatable :: group, other
    character(128), allocatable :: names(:), own(:)
    integer :: g, g_other, i, k

    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      do k = input%table%groups(g)%first, input%table%groups(g)%last
        associate (key => input%table%keys(k))
          other = trim(key%allowed(2:))
          if (key%name == 'NAME' .and. input%table%groups(g)%repeats) other = group
          if (other /= group .and. key%allowed(1:1) /= '&') cycle
          names = names_of(input, other, 'NAME')
          g_other = input%table%find_group(other)
          if (size(names) == 0 .and. input%table%groups(g_other)%is_required) cycle
          own = names_of(input, group, trim(key%name))
        end associate
        do i = 1, size(own)
          if (own(i) == '') cycle                  ! reported already, or not required
          if (other == group) then
            if (find(own(:i - 1), own(i)) > 0) call input%report(group, i, 'NAME', &
              'is the name of another &'//group)
          else if (find(names, own(i)) == 0) then
            call input%report(group, i, trim(input%table%keys(k)%name), 'there is no &'//other// &
                              ' of this name; '//known(names))
          end if
        end do
      end do
    end do
  end subroutine check_names

  !> Values of a text key of all groups of a kind.
  function names_of(input, group, key) result(names)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group, key
    character(128), allocatable :: names(:)
    integer :: i

    allocate (names(input%count(group)))
    do i = 1, size(names)
      names(i) = input%text(group, i, key)
    end do
  end function names_of

  !> Report a key without effect; warn if only an override makes it so.
  subroutine check_effect(input, group, i, row)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    type(key_row_t), intent(in) :: row
    character(48), allocatable :: w(:)
    character(:), allocatable :: choice

    if (input%holds(group, i, row%condition)) return
    call split_words(row%condition, w)
    choice = input%text(group, i, w(1))
    if (choice == '') return                       ! reported already
    call input%report(group, i, row%name, 'has no effect with '//trim(w(1))//' = '//choice// &
                      ', only with '//trim(row%condition), is_warning=input%line(group, i, &
                      w(1)) < 0 .and. input%line(group, i, row%name) > 0)
  end subroutine check_effect

  !> True if values of a key without default are missing.
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

end module input_reading
