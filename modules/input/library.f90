! SPDX-License-Identifier: MIT
!> Materials from a library, a file of &MATERIAL groups with a &REFERENCE for each value. Keys that
!> a &MATERIAL with FROM does not give are taken from the entry before the input is checked.
module input_library
  use base_system, only: data_file
  use base_text, only: lower
  use input_assignments, only: assignment_t
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_key_table, only: key_row_t, key_table_t
  use input_scan, only: read_file, scan_text
  use input_syntax, only: split_words
  use input_values, only: input_t, taken_t
  use input_wording, only: check_value
  implicit none (type, external)
  private

  public :: library_table, read_library, source_lines, take_from_library

  character(*), parameter :: group = 'MATERIAL'
  character(*), parameter :: library_file = 'materials.nml'   !! library of the program

  !> Pairs of keys that exclude each other.
  character(20), parameter :: alternatives(2, 4) = reshape([character(20) :: &
    'SPECIFIC_HEAT', 'SPECIFIC_HEAT_TABLE', 'CONDUCTIVITY', 'CONDUCTIVITY_TABLE', &
    'YIELD_TABLE', 'YIELD_LOGISTIC', 'TP_STAR', 'TP_STAR_FIT'], [2, 4])

contains

  !> Table of keys of a library: that of inputs, and &REFERENCE.
  function library_table(table) result(t)
    type(key_table_t), intent(in) :: table
    type(key_table_t) :: t

    t = table
    t%groups%is_required = t%groups%name == group
    call t%group('REFERENCE', 'repeat', 'Where values of a &MATERIAL of this library come from.')
    call t%key('MATERIAL', 'text', 1, '', 'required', '', 'NAME of the &MATERIAL')
    call t%key('KEYS', 'text', 1, '', 'required', '', 'names of its keys')
    call t%key('TEXT', 'text', 1, '', 'required', '', 'the source')
    call t%key('SEEN', 'logical', 1, '', 'F', '', 'whether the values were compared with it')
  end function library_table

  !> Read and scan a library; values are checked when they are taken.
  subroutine read_library(table, file, library, diagnostics, problem)
    type(key_table_t), intent(in) :: table
    character(*), intent(in) :: file      !! '': library of the program
    type(input_t), intent(out) :: library
    type(diagnostics_t), intent(inout), target :: diagnostics
    character(:), allocatable, intent(out) :: problem   !! '' on success
    character(:), allocatable :: text

    library%table = library_table(table)
    library%diagnostics => diagnostics
    library%file = file
    problem = ''
    if (file == '') call data_file(library_file, library%file, problem)
    if (problem == '') call read_file(library%file, text, problem)
    if (problem /= '') text = ''
    call scan_text(library%file, text, library%written, diagnostics)
  end subroutine read_library

  !> Complete each &MATERIAL that names an entry; the input of a checkpoint has the values already.
  subroutine take_from_library(input, is_resumed)
    type(input_t), intent(inout) :: input
    logical, intent(in) :: is_resumed
    type(input_t) :: library
    character(:), allocatable :: entry, file, problem
    integer :: i, m

    allocate (input%taken(0))
    do i = 1, input%count(group)
      if (.not. input%given(group, i, 'FROM')) then
        if (input%given(group, i, 'LIBRARY')) call input%report(group, i, 'LIBRARY', &
          'has no effect without FROM, which names an entry of it')
        cycle
      end if
      if (is_resumed) then
        if (input%line(group, i, 'FROM') < 0) call input%report(group, i, 'FROM', &
          'a restart cannot change materials')
        cycle
      end if
      file = input%text(group, i, 'LIBRARY')
      if (file /= '') then
        if (index(file, '/') /= 1) file = input%file(:index(input%file, '/', back=.true.))//file
      end if
      call read_library(input%table, file, library, input%diagnostics, problem)
      input%written%groups(input%written%find(group, i))%is_broken = .true.   ! until found
      if (problem /= '') then
        call input%report(group, i, 'FROM', 'the library of materials '//library%file//' '//problem)
        cycle
      end if
      entry = input%text(group, i, 'FROM')
      if (lower(entry) == 'library') entry = input%text(group, i, 'NAME')
      m = entry_of(library, entry)
      if (m == 0) then
        call input%report(group, i, 'FROM', "the library has no '"//entry//"'; it has "// &
                          entries_of(library))
      else
        input%written%groups(input%written%find(group, i))%is_broken = .false.
        call take_entry(input, i, library, m)
      end if
    end do
  end subroutine take_from_library

  !> Index of the entry of this name; 0 if there is none.
  integer function entry_of(library, name)
    type(input_t), intent(in) :: library
    character(*), intent(in) :: name

    do entry_of = 1, library%count(group)
      if (lower(library%text(group, entry_of, 'NAME')) == lower(name)) return
    end do
    entry_of = 0
  end function entry_of

  !> Text with the names of all entries.
  function entries_of(library) result(text)
    type(input_t), intent(in) :: library
    character(:), allocatable :: text
    integer :: m

    text = ''
    do m = 1, library%count(group)
      if (m > 1) text = text//', '
      text = text//library%text(group, m, 'NAME')
    end do
  end function entries_of

  !> Add the missing keys of the `i`-th &MATERIAL from entry `m`, as if written on the line of FROM.
  subroutine take_entry(input, i, library, m)
    type(input_t), intent(inout) :: input
    integer, intent(in) :: i, m
    type(input_t), intent(in) :: library
    type(assignment_t) :: new
    character(:), allocatable :: message, source, value
    character(24), allocatable :: own(:)
    integer :: k, r

    new%group = input%written%find(group, i)
    new%line = input%line(group, i, 'FROM')
    associate (rows => input%table%groups(input%table%find_group(group)))
      own = pack(input%table%keys(rows%first:rows%last)%name, &
                 [(input%given(group, i, trim(input%table%keys(k)%name)), k=rows%first, rows%last)])
      do k = rows%first, rows%last
        associate (row => input%table%keys(k))
          if (any(row%name == [character(24) :: own, 'NAME', 'FROM', 'LIBRARY'])) cycle
          if (.not. library%given(group, m, trim(row%name))) cycle
          if (.not. is_needed(input, i, library, m, row, own)) cycle
          value = library%values(group, m, trim(row%name))
          message = check_value(row, 0, value)
          if (message /= '') then
            call library%report(group, m, trim(row%name), message)
            cycle
          end if
          new%key = row%name
          call input%written%replace(new, value)
          r = reference_number(library, m, row%name)
          source = 'no source is named'
          if (r > 0) source = library%text('REFERENCE', r, 'TEXT')
          input%taken = [input%taken, taken_t(i, row%name, source)]
        end associate
      end do
    end associate
  end subroutine take_entry

  !> True if the `i`-th &MATERIAL needs a key of entry `m`: its law uses the key, and none of its
  !> `own` keys excludes it. Tables of thermal properties are taken in heat-only runs with one
  !> material, and with mechanics if they have been compared with their source.
  logical function is_needed(input, i, library, m, row, own)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(input_t), intent(in) :: library
    integer, intent(in) :: m
    type(key_row_t), intent(in) :: row
    character(*), intent(in) :: own(:)
    logical :: takes_table, is_heat_only
    integer :: a, r

    is_needed = input%holds(group, i, row%condition)
    is_heat_only = .not. input%logical('METHOD', 1, 'MECHANICS')
    if (row%name(:6) == 'YIELD_') is_needed = is_needed .and. is_heat_only
    do a = 1, 2
      if (all(row%name /= alternatives(:, a))) cycle
      r = reference_number(library, m, alternatives(2, a))
      takes_table = .false.
      if (r > 0) takes_table = library%logical('REFERENCE', r, 'SEEN')
      if (is_heat_only) takes_table = input%count(group) == 1 .and. library%given(group, m, &
        alternatives(2, a))
      is_needed = is_needed .and. (takes_table .eqv. row%name == alternatives(2, a))
    end do
    do a = 1, size(alternatives, 2)
      if (row%name == alternatives(1, a)) is_needed = is_needed &
          .and. .not. any(own == alternatives(2, a))
      if (row%name == alternatives(2, a)) is_needed = is_needed &
          .and. .not. any(own == alternatives(1, a))
    end do
  end function is_needed

  !> Index of the reference of a key of entry `m`; 0 if there is none.
  integer function reference_number(library, m, key) result(r)
    type(input_t), intent(in) :: library
    integer, intent(in) :: m
    character(*), intent(in) :: key
    character(48), allocatable :: keys(:)

    do r = 1, library%count('REFERENCE')
      if (library%text('REFERENCE', r, 'MATERIAL') /= library%text(group, m, 'NAME')) cycle
      call split_words(library%text('REFERENCE', r, 'KEYS'), keys)
      if (any(keys == key)) return
    end do
    r = 0
  end function reference_number

  !> Lines, each after a `margin`, with the values that the `i`-th &MATERIAL took from a library and
  !> their sources, in the words of --materials or brief; '' if it took none.
  function source_lines(input, i, margin, is_brief) result(text)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: margin
    logical, intent(in) :: is_brief
    character(:), allocatable :: text
    type(taken_t), allocatable :: values(:)
    integer :: first, k

    text = ''
    if (.not. allocated(input%taken)) return
    values = pack(input%taken, input%taken%instance == i)
    do first = 1, size(values)
      if (any(values(:first - 1)%source == values(first)%source)) cycle
      text = text//margin
      do k = first, size(values)
        if (values(k)%source /= values(first)%source) cycle
        if (k > first) text = text//', '
        text = text//trim(values(k)%key)//' = ' &
               //excerpt(input%values(group, i, trim(values(k)%key)))
      end do
      if (is_brief) then
        text = text//': '//brief_source(trim(values(first)%source))//new_line('a')
      else
        text = text//': '//trim(values(first)%source)//new_line('a')
      end if
    end do
  end function source_lines

  !> A source with a letter in place of the note on how it was read: [s] seen, [m] from memory, [t]
  !> taken over with a model.
  pure function brief_source(source) result(text)
    character(*), intent(in) :: source
    character(:), allocatable :: text
    character(7), parameter :: notes(3) = ['[seen  ', '[not se', '[taken ']
    integer :: k, n

    text = source
    do k = 1, size(notes)
      n = index(source, trim(notes(k)))
      if (n > 0) text = source(:n)//'smt'(k:k)//']'
    end do
  end function brief_source

end module input_library
