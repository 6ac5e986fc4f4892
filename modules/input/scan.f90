! SPDX-License-Identifier: MIT
!> Scanner of Fortran namelist groups (Fortran 2018, 13.11) that keeps line numbers.
module input_scan
  use base_kinds, only: i8
  use base_text, only: str, upper
  use input_diagnostics, only: diagnostics_t, excerpt
  use keys_table, only: is_name, items_t, key_table_t, letters, name_len, split_values, take_key
  implicit none (type, external)
  private

  public :: assignment_t, group_t, scan_t
  public :: read_file, scan_text

  character, parameter :: newline = achar(10)

  !> The bytes that some editors put before a text.
  character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

  !> What a character of the file is, decided in the first pass.
  character, parameter :: plain = '.', quoted = 'q', unclosed = 'u', skipped = ' '

  !> One `&NAME ... /`.
  type :: group_t
    character(name_len) :: name = ''   !! upper case
    integer :: line = 0                !! where it opens; -k: made by the k-th override
    logical :: is_broken = .false.     !! it could not be read to its end
    integer :: first = 1, last = 0     !! its assignments, but those of overrides
  end type group_t

  !> One `KEY(index) = value`.
  type :: assignment_t
    integer :: group = 0               !! number of the group in the file
    character(name_len) :: key = ''    !! upper case; blank: replaced by an override
    integer :: index = 0               !! 0: no index was written
    integer :: first = 1, last = 0     !! the value is text(first:last)
    integer :: line = 0                !! line of the key; -k: the k-th override
    logical :: is_broken = .false.     !! not to be used: a complaint was filed
  end type assignment_t

  !> Where the groups of one name are: at(:n).
  type :: places_t
    character(name_len) :: name = ''
    integer, allocatable :: at(:)
    integer :: n = 0
  end type places_t

  !> More are no input that somebody wrote; what follows takes time that grows with their square.
  integer, parameter :: most_groups = 5000, most_in_group = 10000, most_bytes = 32*1024**2

  !> A scanned file.
  type :: scan_t
    character(:), allocatable :: text              !! the file without comments
    type(group_t), allocatable :: groups(:)
    type(assignment_t), allocatable :: assignments(:)
    integer, private :: n_groups = 0, n_read = 0   !! of the file; overrides stand behind them
    type(places_t), allocatable, private :: places(:)
  contains
    procedure :: count => count_groups
    procedure :: add_group
    procedure :: find
    procedure :: last_of
    procedure :: value
    procedure :: replace
    procedure :: gather
    procedure :: text_of_groups
  end type scan_t

  !> The file between the two passes.
  type :: source_t
    character(:), allocatable :: file
    character(:), allocatable :: clean   !! blanks instead of comments, tabs and line ends
    character(:), allocatable :: mask    !! what each character is
    integer, allocatable :: line(:)
  end type source_t

contains

  !> The whole of a text file.
  subroutine read_file(file, text, problem)
    character(*), intent(in) :: file
    character(:), allocatable, intent(out) :: text
    character(:), allocatable, intent(out) :: problem   !! empty if all is well
    integer(i8) :: length
    integer :: unit, status
    character(200) :: reason

    problem = ''
    text = ''
    open (newunit=unit, file=file, access='stream', form='unformatted', status='old', &
          action='read', iostat=status, iomsg=reason)
    if (status == 0) then
      inquire (unit=unit, size=length)
      if (length > most_bytes) then
        problem = 'has '//str(length)//' bytes; an input has at most '//str(most_bytes)
      else
        deallocate (text)
        allocate (character(max(length, 0_i8)) :: text)
        read (unit, iostat=status, iomsg=reason) text
      end if
      close (unit)
    end if
    if (status /= 0) problem = 'cannot be read: '//trim(reason)
  end subroutine read_file

  !> Groups and assignments of `text`, in the order of the file.
  subroutine scan_text(file, text, scanned, diagnostics)
    character(*), intent(in) :: file, text
    type(scan_t), intent(out) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    type(source_t) :: source
    integer :: i, last

    i = merge(3, 0, index(text, byte_order_mark) == 1)
    call mark_text(file, repeat(' ', i)//text(i + 1:)//newline, source, diagnostics)
    allocate (scanned%groups(64), scanned%assignments(256))
    i = 1
    do while (i <= len(source%clean))
      if (source%clean(i:i) == ' ') then
        i = i + 1
      else if (opens_group(source%clean, i)) then
        if (scanned%n_groups == most_groups) then
          call diagnostics%add(file, source%line(i), 'more than '//str(most_groups)//' groups')
          exit
        end if
        call scan_group(source, i, scanned, diagnostics)
      else
        last = i
        do while (source%line(last + 1) == source%line(i))
          if (opens_group(source%clean, last + 1)) exit
          last = last + 1
        end do
        call diagnostics%add(file, source%line(i), 'text outside a group: "'// &
          excerpt(source%clean(i:last))//'" (a group is &NAME KEY = value, ... /)')
        i = last + 1
      end if
    end do
    scanned%text = source%clean
    scanned%groups = scanned%groups(:scanned%n_groups)
    scanned%assignments = scanned%assignments(:scanned%n_read)
    call find_places(scanned)
  end subroutine scan_text

  !> First pass: blank comments, mark quotes, number the lines.
  subroutine mark_text(file, text, source, diagnostics)
    character(*), intent(in) :: file, text
    type(source_t), intent(out) :: source
    type(diagnostics_t), intent(inout) :: diagnostics
    character :: c, quote
    logical :: in_comment, in_group
    integer :: i, n, opened

    source%file = file
    source%clean = text
    source%mask = repeat(skipped, len(text))
    allocate (source%line(len(text) + 1), source=0)
    n = 1
    opened = 1
    quote = ' '
    in_comment = .false.
    in_group = .false.
    do i = 1, len(text)
      c = text(i:i)
      source%line(i) = n
      if (c == newline) then
        if (quote /= ' ') then
          call diagnostics%add(file, n, 'text in quotes is not closed on this line: '// &
                              excerpt(text(opened:i - 1)))
          source%mask(opened:i - 1) = unclosed
        end if
        source%clean(i:i) = ' '
        quote = ' '
        in_comment = .false.
        n = n + 1
      else if (in_comment .or. iachar(c) < 32) then
        source%clean(i:i) = ' '
      else if (quote /= ' ') then
        source%mask(i:i) = quoted
        if (c == quote) quote = ' '
      else if (c == '!') then
        in_comment = .true.
        source%clean(i:i) = ' '
      else if (in_group) then
        source%mask(i:i) = plain
        in_group = c /= '/'
        if (c == "'" .or. c == '"') then
          source%mask(i:i) = quoted
          quote = c
          if (source%mask(i - 1:i - 1) /= quoted) opened = i   ! else a doubled quote
        end if
      else
        source%mask(i:i) = plain
        in_group = opens_group(source%clean, i)
      end if
    end do
  end subroutine mark_text

  !> True if a group opens at character `i`: an & before a letter, not within a word.
  pure logical function opens_group(text, i)
    character(*), intent(in) :: text
    integer, intent(in) :: i

    opens_group = .false.
    if (i >= len(text)) return
    if (text(i:i) /= '&' .or. verify(text(i + 1:i + 1), letters) > 0) return
    opens_group = .true.
    if (i > 1) opens_group = scan(text(i - 1:i - 1), ' /,') > 0
  end function opens_group

  !> Read the group that opens at `i`; on return `i` is behind it.
  subroutine scan_group(source, i, scanned, diagnostics)
    type(source_t), intent(in) :: source
    integer, intent(inout) :: i
    type(scan_t), intent(inout) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    type(group_t) :: group
    integer :: first, last
    logical :: is_closed

    first = i + 1
    do while (is_name(source%clean(first:first)))
      first = first + 1
    end do
    group = group_t(upper(source%clean(i + 1:first - 1)), source%line(i))
    is_closed = .false.
    last = first
    do while (last <= len(source%clean))
      if (source%mask(last:last) == plain) then
        is_closed = source%clean(last:last) == '/'
        if (is_closed .or. opens_group(source%clean, last)) exit
      end if
      last = last + 1
    end do
    last = last - 1
    group%is_broken = .not. is_closed .or. index(source%mask(first:last), unclosed) > 0
    if (.not. is_closed .and. index(source%mask(first:last), unclosed) == 0) then
      call diagnostics%add(source%file, group%line, '&'//trim(group%name)//' is not closed with /')
    end if
    group%first = scanned%n_read + 1
    scanned%n_groups = scanned%n_groups + 1
    if (scanned%n_groups > size(scanned%groups)) scanned%groups = [scanned%groups, scanned%groups]
    scanned%groups(scanned%n_groups) = group
    call scan_body(source, first, last, scanned, diagnostics)
    scanned%groups(scanned%n_groups)%last = scanned%n_read
    i = last + merge(2, 1, is_closed)
  end subroutine scan_group

  !> Read the assignments in characters `first` to `last`.
  subroutine scan_body(source, first, last, scanned, diagnostics)
    type(source_t), intent(in) :: source
    integer, intent(in) :: first, last
    type(scan_t), intent(inout) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    type(assignment_t) :: current, next
    integer :: i, key_first, key_last
    logical :: has_key

    has_key = .false.
    current%group = scanned%n_groups
    current%line = source%line(first)
    current%first = first
    do i = first, last
      if (source%clean(i:i) /= '=' .or. source%mask(i:i) /= plain) cycle
      if (scanned%n_read - scanned%groups(scanned%n_groups)%first + 1 == most_in_group) then
        call diagnostics%add(source%file, source%line(i), 'more than '//str(most_in_group)// &
                            ' values in one group')
        return
      end if
      call take_key(source%clean(:i - 1), current%first, key_first, key_last, next%index)
      current%last = key_first - 1
      call finish_assignment(source, current, has_key, scanned, diagnostics)
      has_key = key_last >= key_first
      next%key = upper(source%clean(key_first:key_last))
      next%line = source%line(merge(key_first, i, has_key))
      if (.not. has_key) then
        call diagnostics%add(source%file, next%line, 'there is no key before the =')
      else if (next%index < 0) then
        call diagnostics%add(source%file, next%line, &
          trim(next%key)//'(...): the index must be a whole number above 0')
      end if
      next%group = current%group
      next%is_broken = .not. has_key .or. next%index < 0
      next%first = i + 1
      current = next
    end do
    current%last = last
    call finish_assignment(source, current, has_key, scanned, diagnostics)
  end subroutine scan_body

  !> File the assignment whose value is now known to end at `current%last`.
  subroutine finish_assignment(source, current, has_key, scanned, diagnostics)
    type(source_t), intent(in) :: source
    type(assignment_t), intent(inout) :: current
    logical, intent(in) :: has_key
    type(scan_t), intent(inout) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i

    do while (current%first <= current%last)
      if (source%clean(current%first:current%first) /= ' ') exit
      current%first = current%first + 1
    end do
    current%last = len_trim(source%clean(:current%last))
    if (current%last >= current%first) then
      if (source%clean(current%last:current%last) == ',') then
        current%last = len_trim(source%clean(:current%last - 1))
      end if
    end if
    if (has_key) then
      if (current%last < current%first) then
        call diagnostics%add(source%file, current%line, trim(current%key)//' has no value')
        current%is_broken = .true.
      else if (index(source%mask(current%first:current%last), unclosed) > 0) then
        current%is_broken = .true.
      end if
      scanned%n_read = scanned%n_read + 1
      if (scanned%n_read > size(scanned%assignments)) then
        scanned%assignments = [scanned%assignments, scanned%assignments]
      end if
      scanned%assignments(scanned%n_read) = current
    else if (current%last >= current%first .and. .not. current%is_broken) then
      i = current%first
      call diagnostics%add(source%file, source%line(i), 'a value without a key: "'// &
                          excerpt(source%clean(i:current%last))//'"')
    end if
  end subroutine finish_assignment

  !> Sort the groups by their names.
  subroutine find_places(scanned)
    type(scan_t), intent(inout) :: scanned
    integer :: i, k

    if (allocated(scanned%places)) deallocate (scanned%places)
    allocate (scanned%places(0))
    do i = 1, size(scanned%groups)
      k = place_of(scanned, scanned%groups(i)%name)
      if (k == 0) then
        scanned%places = [scanned%places, places_t(name=scanned%groups(i)%name, at=[0, 0])]
        k = size(scanned%places)
      end if
      associate (p => scanned%places(k))
        p%n = p%n + 1
        if (p%n > size(p%at)) p%at = [p%at, p%at]
        p%at(p%n) = i
      end associate
    end do
  end subroutine find_places

  !> Number of a name in the list of places, 0 if no group has it.
  pure integer function place_of(scanned, name)
    class(scan_t), intent(in) :: scanned
    character(*), intent(in) :: name

    do place_of = size(scanned%places), 1, -1
      if (scanned%places(place_of)%name == name) exit
    end do
  end function place_of

  !> Add a group that the file does not have.
  subroutine add_group(self, name, line)
    class(scan_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: line             !! -k: made by the k-th override

    self%groups = [self%groups, group_t(name, line)]
    call find_places(self)
  end subroutine add_group

  !> Number of groups called `name`.
  pure integer function count_groups(self, name)
    class(scan_t), intent(in) :: self
    character(*), intent(in) :: name
    integer :: k

    count_groups = 0
    k = place_of(self, name)
    if (k > 0) count_groups = self%places(k)%n
  end function count_groups

  !> Number of the `i`-th group called `name`, 0 if there is none.
  pure integer function find(self, name, i)
    class(scan_t), intent(in) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: i
    integer :: k

    find = 0
    k = place_of(self, name)
    if (k == 0 .or. i < 1) return
    if (i <= self%places(k)%n) find = self%places(k)%at(i)
  end function find

  !> Number of the assignment of a key that counts, 0 if there is none.
  pure integer function last_of(self, group, key)
    class(scan_t), intent(in) :: self
    integer, intent(in) :: group            !! number of the group
    character(*), intent(in) :: key

    last_of = 0
    if (key == '' .or. group == 0) return
    do last_of = size(self%assignments), self%n_read + 1, -1
      if (self%assignments(last_of)%group == group .and. self%assignments(last_of)%key == key) then
        return
      end if
    end do
    do last_of = self%groups(group)%last, self%groups(group)%first, -1
      if (self%assignments(last_of)%key == key) return
    end do
    last_of = 0
  end function last_of

  !> The value text of assignment number `i`.
  pure function value(self, i) result(r)
    class(scan_t), intent(in) :: self
    integer, intent(in) :: i
    character(:), allocatable :: r

    r = self%text(self%assignments(i)%first:self%assignments(i)%last)
  end function value

  !> Let `new` stand for what its group has for the key; its value is appended to the text.
  subroutine replace(self, new, text)
    class(scan_t), intent(inout) :: self
    type(assignment_t), intent(inout) :: new
    character(*), intent(in) :: text

    new%first = len(self%text) + 1
    new%last = len(self%text) + len(text)
    self%text = self%text//text
    where (self%assignments%group == new%group .and. self%assignments%key == new%key &
           .and. new%index == 0) self%assignments%key = ''
    self%assignments = [self%assignments, new]
  end subroutine replace

  !> Where the values of a key stand: the k-th is text(first(k):last(k)), first(k) = 0 if unwritten.
  pure subroutine gather(self, group, key, first, last)
    class(scan_t), intent(in) :: self
    integer, intent(in) :: group            !! number of the group
    character(*), intent(in) :: key
    integer, intent(out) :: first(:), last(:)
    type(items_t) :: items
    integer :: i, j, k, n

    first = 0
    last = 0
    if (group == 0) return
    do n = self%groups(group)%first, self%groups(group)%last + size(self%assignments) - self%n_read
      i = n                                   ! those of the file, then all overrides
      if (n > self%groups(group)%last) i = self%n_read + n - self%groups(group)%last
      associate (one => self%assignments(i))
        if (one%group /= group .or. one%key /= key .or. one%is_broken) cycle
        call split_values(self%text(one%first:one%last), items)
        k = max(1, one%index)
        do j = 1, size(items%first)
          first(k:min(size(first), k + items%repeat(j) - 1)) = one%first + items%first(j) - 1
          last(k:min(size(last), k + items%repeat(j) - 1)) = one%first + items%last(j) - 1
          k = min(size(first) + 1, k + items%repeat(j))
        end do
      end associate
    end do
  end subroutine gather

  !> All groups as namelist text, one key a line, overrides in place; no newline at the end.
  pure function text_of_groups(self, table) result(r)
    class(scan_t), intent(in) :: self
    type(key_table_t), intent(in) :: table
    character(:), allocatable :: r
    character(:), allocatable :: one
    integer, allocatable :: first(:), last(:)
    integer :: g, i, j, k, n
    logical :: is_whole

    r = ''
    do i = 1, size(self%groups)
      g = table%find_group(self%groups(i)%name)
      if (g == 0) cycle
      if (r /= '') r = r//newline
      one = '&'//trim(self%groups(i)%name)//newline
      do k = table%groups(g)%first, table%groups(g)%last
        allocate (first(abs(table%keys(k)%n)), last(abs(table%keys(k)%n)))
        call self%gather(i, table%keys(k)%name, first, last)
        n = findloc(first > 0, .true., dim=1, back=.true.)
        is_whole = all(first(:n) > 0) .and. n >= table%keys(k)%n
        do j = 1, n
          if (first(j) == 0) cycle
          if (j > 1 .and. is_whole) then
            one = one//', '
          else
            one = one//'  '//trim(table%keys(k)%name)
            if (.not. is_whole) one = one//'('//str(j)//')'
            one = one//' = '
          end if
          one = one//self%text(first(j):last(j))
          if (j == n .or. .not. is_whole) one = one//newline
        end do
        deallocate (first, last)
      end do
      r = r//one//'/'
    end do
  end function text_of_groups

end module input_scan
