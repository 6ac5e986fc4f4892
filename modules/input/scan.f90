! SPDX-License-Identifier: MIT
!> Scanner of Fortran namelist groups (Fortran 2018, 13.11) with line numbers.
module input_scan
  use base_kinds, only: i8
  use base_text, only: str, upper
  use input_assignments, only: assignment_t, group_t, scan_t
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_syntax, only: is_name, letters, take_key
  implicit none (type, external)
  private

  public :: read_file, scan_text

  character, parameter :: newline = achar(10)

  !> UTF-8 byte order mark that some editors write.
  character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

  !> Classes of characters of the file, set in the first pass.
  character, parameter :: plain = '.', quoted = 'q', unclosed = 'u', skipped = ' '

  !> Limits far beyond any real input, as the time of later checks grows quadratically.
  integer, parameter :: max_groups = 5000, max_in_group = 10000, max_bytes = 32*1024**2

  !> The file between the first and the second pass.
  type :: scan_buffer_t
    character(:), allocatable :: file
    character(:), allocatable :: clean   !! text with blanks for comments, tabs and line ends
    character(:), allocatable :: mask    !! class of each character
    integer, allocatable :: line(:)      !! line number of each character
  end type scan_buffer_t

contains

  !> Read a text file.
  subroutine read_file(file, text, problem)
    character(*), intent(in) :: file
    character(:), allocatable, intent(out) :: text
    character(:), allocatable, intent(out) :: problem   !! '' on success
    integer(i8) :: length
    integer :: unit, status
    character(200) :: reason

    problem = ''
    text = ''
    open (newunit=unit, file=file, access='stream', form='unformatted', status='old', &
          action='read', iostat=status, iomsg=reason)
    if (status == 0) then
      inquire (unit=unit, size=length)
      if (length > max_bytes) then
        problem = 'has '//str(length)//' bytes; an input has at most '//str(max_bytes)
      else
        deallocate (text)
        allocate (character(max(length, 0_i8)) :: text)
        read (unit, iostat=status, iomsg=reason) text
        if (length <= 0) call read_pipe(unit, text, problem)
      end if
      close (unit)
    end if
    if (status /= 0) problem = 'cannot be read: '//trim(reason)
    call convert_line_ends(text)
  end subroutine read_file

  !> Read a file without a size, such as a pipe or a terminal, to its end.
  subroutine read_pipe(unit, text, problem)
    integer, intent(in) :: unit
    character(:), allocatable, intent(inout) :: text, problem
    character(:), allocatable :: longer
    integer :: n, status

    text = repeat(' ', 4096)
    n = 0
    do
      if (n == len(text)) then
        allocate (character(2*n) :: longer)   ! doubled, not to copy the text for each part of it
        longer(:n) = text
        call move_alloc(longer, text)
      end if
      read (unit, iostat=status) text(n + 1:n + 1)
      if (status /= 0) exit
      n = n + 1
      if (n > max_bytes) problem = 'has more than '//str(max_bytes)//' bytes'
      if (n > max_bytes) exit
    end do
    text = text(:n)
  end subroutine read_pipe

  !> Replace carriage returns that are not followed by a newline, as old editors write them, by
  !> newlines.
  pure subroutine convert_line_ends(text)
    character(:), allocatable, intent(inout) :: text
    integer :: i

    do i = 1, len(text)
      if (text(i:i) /= achar(13)) cycle
      if (i < len(text)) then
        if (text(i + 1:i + 1) == newline) cycle
      end if
      text(i:i) = newline
    end do
  end subroutine convert_line_ends

  !> Scan the groups and assignments of a text.
  subroutine scan_text(file, text, scanned, diagnostics)
    character(*), intent(in) :: file, text
    type(scan_t), intent(out) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    type(scan_buffer_t) :: buffer
    integer :: i, last

    i = merge(3, 0, index(text, byte_order_mark) == 1)
    call mark_text(file, repeat(' ', i)//text(i + 1:)//newline, buffer, diagnostics)
    allocate (scanned%groups(64), scanned%assignments(256))
    i = 1
    do while (i <= len(buffer%clean))
      if (buffer%clean(i:i) == ' ') then
        i = i + 1
      else if (opens_group(buffer%clean, i)) then
        if (scanned%n_groups == max_groups) then
          call diagnostics%add(file, buffer%line(i), 'more than '//str(max_groups)//' groups')
          exit
        end if
        call scan_group(buffer, i, scanned, diagnostics)
      else
        last = i
        do while (buffer%line(last + 1) == buffer%line(i))
          if (opens_group(buffer%clean, last + 1)) exit
          last = last + 1
        end do
        call diagnostics%add(file, buffer%line(i), 'text outside a group: "'// &
                             excerpt(buffer%clean(i:last))// &
                             '" (a group is &NAME KEY = value, ... /)')
        i = last + 1
      end if
    end do
    scanned%text = buffer%clean
    scanned%groups = scanned%groups(:scanned%n_groups)
    scanned%assignments = scanned%assignments(:scanned%n_read)
    call scanned%find_places()
  end subroutine scan_text

  !> First pass: blank out comments, mark quotes, number the lines.
  subroutine mark_text(file, text, buffer, diagnostics)
    character(*), intent(in) :: file, text
    type(scan_buffer_t), intent(out) :: buffer
    type(diagnostics_t), intent(inout) :: diagnostics
    character :: c, quote
    logical :: in_comment, in_group
    integer :: i, n, opened

    buffer%file = file
    buffer%clean = text
    buffer%mask = repeat(skipped, len(text))
    allocate (buffer%line(len(text) + 1), source=0)
    n = 1
    opened = 1
    quote = ' '
    in_comment = .false.
    in_group = .false.
    do i = 1, len(text)
      c = text(i:i)
      buffer%line(i) = n
      if (c == newline) then
        if (quote /= ' ') then
          call diagnostics%add(file, n, 'text in quotes is not closed on this line: '// &
                               excerpt(text(opened:i - 1)))
          buffer%mask(opened:i - 1) = unclosed
        end if
        buffer%clean(i:i) = ' '
        quote = ' '
        in_comment = .false.
        n = n + 1
      else if (in_comment .or. iachar(c) < 32) then
        buffer%clean(i:i) = ' '
      else if (quote /= ' ') then
        buffer%mask(i:i) = quoted
        if (c == quote) quote = ' '
      else if (c == '!') then
        in_comment = .true.
        buffer%clean(i:i) = ' '
      else if (in_group) then
        buffer%mask(i:i) = plain
        in_group = c /= '/'
        if (c == "'" .or. c == '"') then
          buffer%mask(i:i) = quoted
          quote = c
          if (buffer%mask(i - 1:i - 1) /= quoted) opened = i   ! otherwise a doubled quote
        end if
      else
        buffer%mask(i:i) = plain
        in_group = opens_group(buffer%clean, i)
      end if
    end do
  end subroutine mark_text

  !> True if a group opens at character `i`: & before a letter, not within a word.
  pure logical function opens_group(text, i)
    character(*), intent(in) :: text
    integer, intent(in) :: i

    opens_group = .false.
    if (i >= len(text)) return
    if (text(i:i) /= '&' .or. verify(text(i + 1:i + 1), letters) > 0) return
    opens_group = .true.
    if (i > 1) opens_group = scan(text(i - 1:i - 1), ' /,') > 0
  end function opens_group

  !> Scan the group that opens at character `i`; on return `i` is the character after it.
  subroutine scan_group(buffer, i, scanned, diagnostics)
    type(scan_buffer_t), intent(in) :: buffer
    integer, intent(inout) :: i
    type(scan_t), intent(inout) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    type(group_t) :: group
    integer :: first, last
    logical :: is_closed

    first = i + 1
    do while (is_name(buffer%clean(first:first)))
      first = first + 1
    end do
    group = group_t(upper(buffer%clean(i + 1:first - 1)), buffer%line(i))
    is_closed = .false.
    last = first
    do while (last <= len(buffer%clean))
      if (buffer%mask(last:last) == plain) then
        is_closed = buffer%clean(last:last) == '/'
        if (is_closed .or. opens_group(buffer%clean, last)) exit
      end if
      last = last + 1
    end do
    last = last - 1
    group%is_broken = .not. is_closed .or. index(buffer%mask(first:last), unclosed) > 0
    if (.not. is_closed .and. index(buffer%mask(first:last), unclosed) == 0) then
      call diagnostics%add(buffer%file, group%line, '&'//trim(group%name)//' is not closed with /')
    end if
    group%first = scanned%n_read + 1
    scanned%n_groups = scanned%n_groups + 1
    if (scanned%n_groups > size(scanned%groups)) scanned%groups = [scanned%groups, scanned%groups]
    scanned%groups(scanned%n_groups) = group
    call scan_body(buffer, first, last, scanned, diagnostics)
    scanned%groups(scanned%n_groups)%last = scanned%n_read
    i = last + merge(2, 1, is_closed)
  end subroutine scan_group

  !> Scan the assignments in characters `first` to `last`.
  subroutine scan_body(buffer, first, last, scanned, diagnostics)
    type(scan_buffer_t), intent(in) :: buffer
    integer, intent(in) :: first, last
    type(scan_t), intent(inout) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    type(assignment_t) :: current, next
    integer :: i, key_first, key_last
    logical :: has_key

    has_key = .false.
    current%group = scanned%n_groups
    current%line = buffer%line(first)
    current%first = first
    do i = first, last
      if (buffer%clean(i:i) /= '=' .or. buffer%mask(i:i) /= plain) cycle
      if (scanned%n_read - scanned%groups(scanned%n_groups)%first + 1 == max_in_group) then
        call diagnostics%add(buffer%file, buffer%line(i), &
                             'more than '//str(max_in_group)//' values in one group')
        return
      end if
      call take_key(buffer%clean(:i - 1), current%first, key_first, key_last, next%index)
      current%last = key_first - 1
      call finish_assignment(buffer, current, has_key, scanned, diagnostics)
      has_key = key_last >= key_first
      next%key = upper(buffer%clean(key_first:key_last))
      next%line = buffer%line(merge(key_first, i, has_key))
      if (.not. has_key) then
        call diagnostics%add(buffer%file, next%line, 'there is no key before the =')
      else if (next%index < 0) then
        call diagnostics%add(buffer%file, next%line, &
                             trim(next%key)//'(...): the index must be a whole number above 0')
      end if
      next%group = current%group
      next%is_broken = .not. has_key .or. next%index < 0
      next%first = i + 1
      current = next
    end do
    current%last = last
    call finish_assignment(buffer, current, has_key, scanned, diagnostics)
  end subroutine scan_body

  !> Store an assignment whose value ends at `current%last`.
  subroutine finish_assignment(buffer, current, has_key, scanned, diagnostics)
    type(scan_buffer_t), intent(in) :: buffer
    type(assignment_t), intent(inout) :: current
    logical, intent(in) :: has_key
    type(scan_t), intent(inout) :: scanned
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i

    do while (current%first <= current%last)
      if (buffer%clean(current%first:current%first) /= ' ') exit
      current%first = current%first + 1
    end do
    current%last = len_trim(buffer%clean(:current%last))
    if (current%last >= current%first) then
      if (buffer%clean(current%last:current%last) == ',') then
        current%last = len_trim(buffer%clean(:current%last - 1))
      end if
    end if
    if (has_key) then
      if (current%last < current%first) then
        call diagnostics%add(buffer%file, current%line, trim(current%key)//' has no value')
        current%is_broken = .true.
      else if (index(buffer%mask(current%first:current%last), unclosed) > 0) then
        current%is_broken = .true.
      end if
      scanned%n_read = scanned%n_read + 1
      if (scanned%n_read > size(scanned%assignments)) then
        scanned%assignments = [scanned%assignments, scanned%assignments]
      end if
      scanned%assignments(scanned%n_read) = current
    else if (current%last >= current%first .and. .not. current%is_broken) then
      i = current%first
      call diagnostics%add(buffer%file, buffer%line(i), &
                           'a value without a key: "'//excerpt(buffer%clean(i:current%last))//'"')
    end if
  end subroutine finish_assignment

end module input_scan
