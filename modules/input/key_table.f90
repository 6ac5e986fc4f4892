! SPDX-License-Identifier: MIT
!> Table of input keys: its groups and rows, adding to it, and look-ups of keys and of the names by
!> which groups refer to one another.
module input_key_table
  use base_errors, only: fatal
  use base_text, only: joined, str
  use input_syntax, only: split_words
  implicit none (type, external)
  private

  public :: find, group_row_t, key_row_t, key_table_t, known

  !> One group of the input.
  type :: group_row_t
    character(16) :: name = ''
    logical :: repeats = .false., is_required = .false.
    integer :: first = 1, last = 0      !! range of its rows in the list of keys
    character(240) :: about = ''        !! description for the reference page
  end type group_row_t

  !> One key of a group.
  type :: key_row_t
    character(24) :: name = ''
    character(8) :: kind = ''           !! real, integer, logical, text or choice
    integer :: n = 1                    !! number of values; -n: up to n
    character(12) :: unit = ''
    logical :: is_required = .false.    !! the key must be given where its condition holds
    logical :: may_change = .false.     !! a restart may change the value
    character(256) :: default = ''      !! default value, as text
    character(480) :: condition = ''    !! 'KEY = a or b' under which it applies; '': always
    !> Interval, names of a choice, characters of a text, "name" or "file name".
    character(480) :: allowed = ''
    character(240) :: about = ''        !! description for the reference page
  end type key_row_t

  !> The table; the keys of a group are contiguous. Rows behind those of the last group are spare:
  !> the array grows by doubling, as a copy for each row would take longer than the rest of a start.
  type :: key_table_t
    type(group_row_t), allocatable :: groups(:)
    type(key_row_t), allocatable :: keys(:)
  contains
    procedure :: group => add_group, key => add_key, may_change => allow_change
    procedure :: append, find_group, find_key, n_keys
  end type key_table_t

contains

  !> Open a group; the keys added next belong to it.
  subroutine add_group(self, name, occurs, about)
    class(key_table_t), intent(inout) :: self
    character(*), intent(in) :: name
    character(*), intent(in) :: occurs   !! 'once' or 'repeat', optionally 'required'
    character(*), intent(in) :: about
    type(group_row_t) :: row

    if (.not. allocated(self%groups)) allocate (self%groups(0), self%keys(64))
    call check_length('&'//name, 'name', name, len(row%name))
    call check_length('&'//name, 'description', about, len(row%about))
    row%name = name
    row%repeats = index(occurs, 'repeat') > 0
    row%is_required = index(occurs, 'required') > 0
    row%first = self%n_keys() + 1
    row%last = self%n_keys()
    row%about = about
    self%groups = [self%groups, row]
  end subroutine add_group

  !> Add a key to the group opened last; an existing row with another condition is extended by the
  !> new one.
  subroutine add_key(self, name, kind, n, unit, default, allowed, about)
    class(key_table_t), intent(inout) :: self
    character(*), intent(in) :: name, kind
    integer, intent(in) :: n
    character(*), intent(in) :: unit
    !> Default or 'required', optionally followed by 'if KEY = a or b'.
    character(*), intent(in) :: default
    character(*), intent(in) :: allowed, about
    type(key_row_t) :: row
    character(:), allocatable :: condition
    integer :: cut, k

    call check_length(name, 'name', name, len(row%name))
    call check_length(name, 'type', kind, len(row%kind))
    call check_length(name, 'unit', unit, len(row%unit))
    call check_length(name, 'list of what is allowed', allowed, len(row%allowed))
    call check_length(name, 'description', about, len(row%about))
    cut = index(' '//default, ' if ')
    if (cut == 0) cut = len(default) + 1
    condition = default(min(cut + 3, len(default) + 1):)
    call check_length(name, 'default', default(:cut - 1), len(row%default))
    call check_length(name, 'condition', condition, len(row%condition))
    row = key_row_t(name, kind, n, unit, default(:cut - 1) == 'required', .false., &
                    default(:cut - 1), condition, allowed, about)
    if (row%is_required) row%default = ''
    k = self%find_key(size(self%groups), name)
    if (k > 0) then
      call share_key(self%keys(k), row)
      return
    end if
    call self%append(row)
  end subroutine add_key

  !> Add a row to the group opened last.
  subroutine append(self, row)
    class(key_table_t), intent(inout) :: self
    type(key_row_t), intent(in) :: row

    if (self%n_keys() == size(self%keys)) self%keys = [self%keys, self%keys]
    associate (last => self%groups(size(self%groups))%last)
      last = last + 1
      self%keys(last) = row
    end associate
  end subroutine append

  !> Number of keys of all groups.
  pure integer function n_keys(self)
    class(key_table_t), intent(in) :: self

    n_keys = 0
    if (size(self%groups) > 0) n_keys = self%groups(size(self%groups))%last
  end function n_keys

  !> Abort if the `text` of a row of the table is longer than what stores it.
  subroutine check_length(row, what, text, room)
    character(*), intent(in) :: row, what, text
    integer, intent(in) :: room

    if (len_trim(text) > room) call fatal('table of keys: the '//what//' of '//row//", '"// &
      trim(text)//"', has "//str(len_trim(text))//' characters of '//str(room))
  end subroutine check_length

  !> Extend the condition of `row` by that of `other`, an otherwise equal row.
  subroutine share_key(row, other)
    type(key_row_t), intent(inout) :: row
    type(key_row_t), intent(in) :: other
    character(:), allocatable :: both
    integer :: equals

    equals = index(row%condition, '=')
    both = trim(row%condition)//' or'//trim(other%condition(equals + 1:))
    call check_length(trim(row%name), 'condition', both, len(row%condition))
    if (equals == 0 .or. row%condition(:equals) /= other%condition(:equals) .or. &
        row%kind /= other%kind .or. row%n /= other%n .or. row%unit /= other%unit .or. &
        row%default /= other%default .or. (row%is_required .neqv. other%is_required) .or. &
        row%allowed /= other%allowed .or. row%about /= other%about) then
      call fatal('table of keys: '//trim(row%name)//' has two rows that differ, if '// &
                 trim(row%condition)//' and if '//trim(other%condition))
    end if
    row%condition = both
  end subroutine share_key

  !> Allow a restart to change keys of a group: those in `names`, or all with '*'.
  subroutine allow_change(self, group, names)
    class(key_table_t), intent(inout) :: self
    character(*), intent(in) :: group
    character(*), intent(in) :: names   !! separated by blanks
    character(48), allocatable :: list(:)
    integer :: g, k, row

    g = self%find_group(group)
    if (g == 0) call fatal('table of keys: there is no &'//group)
    if (names == '*') self%keys(self%groups(g)%first:self%groups(g)%last)%may_change = .true.
    if (names == '*') return
    call split_words(names, list)
    do k = 1, size(list)
      row = self%find_key(g, trim(list(k)))
      if (row == 0) call fatal('table of keys: &'//group//' has no '//trim(list(k)))
      self%keys(row)%may_change = .true.
    end do
  end subroutine allow_change

  !> Index of a group; 0 if there is none of this name.
  pure integer function find_group(self, name)
    class(key_table_t), intent(in) :: self
    character(*), intent(in) :: name

    do find_group = size(self%groups), 1, -1
      if (self%groups(find_group)%name == name) exit
    end do
  end function find_group

  !> Row of a key of group `group`; 0 if there is none of this name.
  pure integer function find_key(self, group, name)
    class(key_table_t), intent(in) :: self
    integer, intent(in) :: group
    character(*), intent(in) :: name
    integer :: k

    find_key = 0
    do k = self%groups(group)%first, self%groups(group)%last
      if (self%keys(k)%name == name) find_key = k
    end do
  end function find_key

  !> Index of `name` in a list; 0 if it is not there.
  pure integer function find(names, name)
    character(*), intent(in) :: names(:), name

    do find = 1, size(names)
      if (names(find) == name) return
    end do
    find = 0
  end function find

  !> Text with the known names, for a diagnostic.
  pure function known(names) result(text)
    character(*), intent(in) :: names(:)
    character(:), allocatable :: text

    text = 'known: '//joined(names, ' ')
    if (size(names) == 0) text = 'there is none'
  end function known

end module input_key_table
