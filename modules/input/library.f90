! SPDX-License-Identifier: MIT
!> Libraries of materials and pairs of surfaces, files of &MATERIAL and &PAIR groups, the entries,
!> with a &REFERENCE for each value. Keys that a group with FROM does not give are taken from the
!> entry before the input is checked.
module input_library
  use base_kinds, only: rp
  use base_system, only: data_file
  use base_text, only: joined, lower, str
  use input_assignments, only: assignment_t
  use input_diagnostics, only: diagnostics_t
  use input_key_table, only: find, key_row_t, key_table_t
  use input_scan, only: read_file, scan_text
  use input_syntax, only: split_words
  use input_values, only: input_t, taken_t
  use input_wording, only: check_value, suggestion
  implicit none (type, external)
  private

  public :: add_pair_keys, library_table, range_of, read_library, reference_number
  public :: take_from_library, takers

  !> Groups that take values from an entry, and the kind of the entry.
  character(8), parameter :: takers(4) = [character(8) :: 'MATERIAL', 'TOOL', 'WALL', 'SURFACE']
  character(8), parameter :: entries(4) = [character(8) :: 'MATERIAL', 'PAIR', 'PAIR', 'PAIR']

  !> Groups and keys of which the keys of a &PAIR are copies.
  character(20), parameter :: pair_keys(2, 14) = reshape([character(20) :: &
    'TOOL', 'FRICTION_LAW', 'TOOL', 'FRICTION', 'TOOL', 'SHEAR_FACTOR', 'TOOL', 'STICK_FRACTION', &
    'TOOL', 'FRICTION_TABLE_OF', 'TOOL', 'FRICTION_AT', 'TOOL', 'FRICTION_MU', &
    'TOOL', 'CONTACT_CONDUCTANCE', 'SURFACE', 'COEFFICIENT', 'SURFACE', 'PRESSURE_FACTOR', &
    'SURFACE', 'PRESSURE_EXPONENT', 'SURFACE', 'TABLE_OF', 'SURFACE', 'TABLE_AT', &
    'SURFACE', 'TABLE_COEFFICIENT'], [2, 14])

  !> Pairs of keys that exclude each other.
  character(20), parameter :: alternatives(2, 8) = reshape([character(20) :: &
    'SPECIFIC_HEAT', 'SPECIFIC_HEAT_TABLE', 'CONDUCTIVITY', 'CONDUCTIVITY_TABLE', &
    'YIELD_TABLE', 'YIELD_LOGISTIC', 'TP_STAR', 'TP_STAR_FIT', &
    'FRICTION_LAW', 'FRICTION_TABLE_OF', 'FRICTION', 'FRICTION_TABLE_OF', &
    'SHEAR_FACTOR', 'FRICTION_TABLE_OF', 'STICK_FRACTION', 'FRICTION_TABLE_OF'], [2, 8])

contains

  !> Table of keys of a library: that of inputs, &PAIR and &REFERENCE.
  function library_table(table) result(t)
    type(key_table_t), intent(in) :: table
    type(key_table_t) :: t
    type(key_row_t) :: row
    integer :: k

    t = table
    t%groups%is_required = .false.
    call t%group('PAIR', 'repeat', 'Friction and heat between two surfaces.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the pair')
    do k = 1, size(pair_keys, 2)
      row = table%keys(table%find_key(table%find_group(pair_keys(1, k)), pair_keys(2, k)))
      row%condition = ''
      row%is_required = .false.
      call t%append(row)
    end do
    call t%group('REFERENCE', 'repeat', 'Where values of an entry of this library come from.')
    call t%key('MATERIAL', 'text', 1, '', '', '', 'NAME of the &MATERIAL')
    call t%key('PAIR', 'text', 1, '', '', '', 'NAME of the &PAIR')
    call t%key('KEYS', 'text', 1, '', 'required', '', 'names of its keys')
    call t%key('TEXT', 'text', 1, '', 'required', '', 'the source')
    call t%key('RANGE', 'real', 2, '', '', '', 'range in which the values are known')
    call t%key('SEEN', 'logical', 1, '', 'F', '', 'the values were compared with the source')
  end function library_table

  !> Add the keys of a group that takes its friction or film from a &PAIR.
  subroutine add_pair_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('FROM', 'text', 1, '', '', '', &
      'pair of surfaces of the library (stirpoint --pairs) for friction and heat transfer '// &
      'that are not given here')
    call t%key('LIBRARY', 'text', 1, '', '', '', &
      'file of the library, relative to the input file; not given: the library of the program')
  end subroutine add_pair_keys

  !> Read and scan a library; values are checked when they are taken.
  subroutine read_library(table, kind, file, library, diagnostics, problem)
    type(key_table_t), intent(in) :: table
    character(*), intent(in) :: kind      !! MATERIAL or PAIR: entries sought
    character(*), intent(in) :: file      !! '': library of the program
    type(input_t), intent(out) :: library
    type(diagnostics_t), intent(inout), target :: diagnostics
    character(:), allocatable, intent(out) :: problem   !! '' on success
    character(:), allocatable :: text

    library%table = library_table(table)
    library%diagnostics => diagnostics
    library%file = file
    problem = ''
    if (file == '') call data_file(lower(kind)//'s.nml', library%file, problem)
    if (problem == '') call read_file(library%file, text, problem)
    if (problem /= '') text = ''
    call scan_text(library%file, text, library%written, diagnostics)
  end subroutine read_library

  !> Complete each group that names an entry; the input of a checkpoint has the values already.
  subroutine take_from_library(input, is_resumed)
    type(input_t), intent(inout) :: input
    logical, intent(in) :: is_resumed
    integer :: g, i

    allocate (input%taken(0))
    do g = 1, size(takers)
      do i = 1, input%count(takers(g))
        call take_for(input, trim(takers(g)), i, trim(entries(g)), is_resumed)
      end do
    end do
  end subroutine take_from_library

  !> Complete the `i`-th group of this name if it names an entry.
  subroutine take_for(input, group, i, kind, is_resumed)
    type(input_t), intent(inout) :: input
    character(*), intent(in) :: group, kind
    integer, intent(in) :: i
    logical, intent(in) :: is_resumed
    type(input_t) :: library
    character(:), allocatable :: entry, file, near, problem
    character(32), allocatable :: names(:)
    integer :: m

    if (.not. input%given(group, i, 'FROM')) then
      if (input%given(group, i, 'LIBRARY')) call input%report(group, i, 'LIBRARY', &
        'has no effect without FROM, which names an entry of it')
      return
    end if
    if (is_resumed) then
      if (input%line(group, i, 'FROM') < 0) call input%report(group, i, 'FROM', &
        'a restart cannot change '//lower(kind)//'s')
      return
    end if
    file = input%text(group, i, 'LIBRARY')
    if (file /= '') then
      if (index(file, '/') /= 1) file = input%file(:index(input%file, '/', back=.true.))//file
    end if
    call read_library(input%table, kind, file, library, input%diagnostics, problem)
    input%written%groups(input%written%find(group, i))%is_broken = .true.   ! until found
    if (problem /= '') then
      call input%report(group, i, 'FROM', 'the library of '//lower(kind)//'s '//library%file// &
                        ' '//problem)
      return
    end if
    entry = input%text(group, i, 'FROM')
    if (kind == group .and. lower(entry) == 'library') entry = input%text(group, i, 'NAME')
    names = entry_names(library, kind)
    do m = 1, size(names)
      if (lower(trim(names(m))) == lower(entry)) exit
    end do
    if (m > size(names)) then
      near = suggestion(lower(entry), names)
      if (near == '') near = 'it has '//joined(names, ', ')
      call input%report(group, i, 'FROM', "the library has no '"//entry//"'; "//near)
    else if (.not. has_any_for(input, group, library, kind, m)) then
      call input%report(group, i, 'FROM', 'has no key of a &'//group)
    else
      input%written%groups(input%written%find(group, i))%is_broken = .false.
      call take_entry(input, group, i, library, kind, m)
    end if
  end subroutine take_for

  !> Names of all entries of a kind.
  function entry_names(library, kind) result(names)
    type(input_t), intent(in) :: library
    character(*), intent(in) :: kind
    character(32), allocatable :: names(:)
    integer :: m

    allocate (names(library%count(kind)))
    do m = 1, size(names)
      names(m) = library%text(kind, m, 'NAME')
    end do
  end function entry_names

  !> True if the entry gives a key that the group has.
  logical function has_any_for(input, group, library, kind, m)
    type(input_t), intent(in) :: input, library
    character(*), intent(in) :: group, kind
    integer, intent(in) :: m
    integer :: k

    has_any_for = .false.
    associate (rows => input%table%groups(input%table%find_group(group)))
      do k = rows%first, rows%last
        if (input%table%keys(k)%name == 'NAME') cycle
        has_any_for = has_any_for .or. gives(library, kind, m, trim(input%table%keys(k)%name))
      end do
    end associate
  end function has_any_for

  !> True if entry `m` may have a key, and gives it.
  logical function gives(library, kind, m, key)
    type(input_t), intent(in) :: library
    character(*), intent(in) :: kind, key
    integer, intent(in) :: m

    gives = library%table%find_key(library%table%find_group(kind), key) > 0
    if (gives) gives = library%given(kind, m, key)
  end function gives

  !> Add the missing keys of the `i`-th group from entry `m`, as if written on the line of FROM.
  subroutine take_entry(input, group, i, library, kind, m)
    type(input_t), intent(inout) :: input
    character(*), intent(in) :: group, kind
    integer, intent(in) :: i, m
    type(input_t), intent(in) :: library
    type(assignment_t) :: new
    character(:), allocatable :: message, value
    character(24), allocatable :: own(:)
    integer :: k

    new%group = input%written%find(group, i)
    new%line = input%line(group, i, 'FROM')
    associate (rows => input%table%groups(input%table%find_group(group)))
      own = pack(input%table%keys(rows%first:rows%last)%name, &
                 [(input%given(group, i, trim(input%table%keys(k)%name)), k=rows%first, rows%last)])
      do k = rows%first, rows%last
        associate (row => input%table%keys(k))
          if (any(row%name == [character(24) :: own, 'NAME', 'FROM', 'LIBRARY'])) then
            if (row%unit == 'K' .and. abs(row%n) == 1) call compare_temperatures(row%name)
            cycle
          end if
          if (.not. gives(library, kind, m, trim(row%name))) cycle
          if (.not. is_needed(input, group, i, library, kind, m, row, own)) cycle
          value = library%values(kind, m, trim(row%name))
          message = check_value(row, 0, value)
          if (message /= '') then
            call library%report(kind, m, trim(row%name), message)
            cycle
          end if
          new%key = row%name
          call input%written%replace(new, value)
          input%taken = [input%taken, taken_t(group, i, row%name, &
                                              source_of(library, kind, m, row%name))]
        end associate
      end do
    end associate
  contains
    !> Report a temperature that is within 15 K of the library's if it was meant in degrees Celsius.
    subroutine compare_temperatures(key)
      character(*), intent(in) :: key
      real(rp), parameter :: slack = 15.0_rp, zero = 273.15_rp
      real(rp) :: known

      if (.not. gives(library, kind, m, trim(key))) return
      known = library%real(kind, m, trim(key))
      if (abs(input%real(group, i, trim(key)) + zero - known) > slack) return
      call input%report(group, i, trim(key), 'is in degrees Celsius that of the library, '// &
                        str(known)//' K: temperatures are in kelvin')
    end subroutine compare_temperatures
  end subroutine take_entry

  !> Source of a key of entry `m`, behind the range of its values.
  function source_of(library, kind, m, key) result(text)
    type(input_t), intent(in) :: library
    character(*), intent(in) :: kind, key
    integer, intent(in) :: m
    character(:), allocatable :: text
    integer :: r

    text = 'no source is named'
    r = reference_number(library, kind, m, key)
    if (r == 0) return
    text = range_of(library, r)//library%text('REFERENCE', r, 'TEXT')
  end function source_of

  !> True if the `i`-th group needs a key of entry `m`: its law uses the key, and none of its `own`
  !> keys excludes it or would have no effect with it. Tables of thermal properties are taken in
  !> heat-only runs with one material, and with mechanics if they have been compared with their
  !> source.
  logical function is_needed(input, group, i, library, kind, m, row, own)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group, kind
    integer, intent(in) :: i
    type(input_t), intent(in) :: library
    integer, intent(in) :: m
    type(key_row_t), intent(in) :: row
    character(*), intent(in) :: own(:)
    logical :: takes_table, is_heat_only
    integer :: a, r

    is_needed = input%holds(group, i, row%condition)
    if (row%kind == 'choice' .and. .not. row%is_required) is_needed = is_needed .and. &
        .not. disables(input%table, group, row, library%text(kind, m, row%name), own)
    is_heat_only = .not. input%logical('METHOD', 1, 'MECHANICS')
    if (row%name(:6) == 'YIELD_') is_needed = is_needed .and. is_heat_only
    do a = 1, 2
      if (all(row%name /= alternatives(:, a)) .or. kind /= 'MATERIAL') cycle
      r = reference_number(library, kind, m, alternatives(2, a))
      takes_table = .false.
      if (r > 0) takes_table = library%logical('REFERENCE', r, 'SEEN')
      if (is_heat_only) takes_table = input%count(group) == 1 .and. library%given(kind, m, &
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

  !> True if one of the `own` keys of a group has no effect with this value of a choice.
  logical function disables(table, group, choice, value, own)
    type(key_table_t), intent(in) :: table
    character(*), intent(in) :: group, value, own(:)
    type(key_row_t), intent(in) :: choice
    character(48), allocatable :: w(:)
    integer :: k

    disables = .false.
    do k = 1, size(own)
      call split_words(table%keys(table%find_key(table%find_group(group), own(k)))%condition, w)
      if (size(w) == 0) cycle
      if (w(1) == choice%name) disables = disables .or. find(w(3:), value) == 0
    end do
  end function disables

  !> Index of the reference of a key of entry `m`; 0 if there is none.
  integer function reference_number(library, kind, m, key) result(r)
    type(input_t), intent(in) :: library
    character(*), intent(in) :: kind, key
    integer, intent(in) :: m
    character(48), allocatable :: keys(:)

    do r = 1, library%count('REFERENCE')
      if (library%text('REFERENCE', r, kind) /= library%text(kind, m, 'NAME')) cycle
      call split_words(library%text('REFERENCE', r, 'KEYS'), keys)
      if (any(keys == key)) return
    end do
    r = 0
  end function reference_number

  !> Words `known from A to B; ` of a reference with a RANGE, otherwise ''.
  function range_of(library, r) result(text)
    type(input_t), intent(in) :: library
    integer, intent(in) :: r
    character(:), allocatable :: text
    real(rp) :: range(2)

    text = ''
    if (.not. library%given('REFERENCE', r, 'RANGE')) return
    range = library%reals('REFERENCE', r, 'RANGE', 2)
    text = 'known from '//str(range(1))//' to '//str(range(2))//'; '
  end function range_of

end module input_library
