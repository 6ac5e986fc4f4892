! SPDX-License-Identifier: MIT
!> Scanner of Fortran namelist groups (Fortran 2018, 13.11) that keeps line numbers.
module input_scan
  use base_kinds, only: i8
  use base_text, only: str, upper
  use input_assignments, only: assignment_t, group_t, scan_t
  use input_diagnostics, only: diagnostics_t, excerpt
  use keys_written, only: is_name, letters, take_key
  implicit none (type, external)
  private

  public :: read_file, scan_text

  character, parameter :: newline = achar(10)

  !> The bytes that some editors put before a text.
  character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

  !> What a character of the file is, decided in the first pass.
  character, parameter :: plain = '.', quoted = 'q', unclosed = 'u', skipped = ' '

  !> More are no real input; what follows takes time that grows with their square.
  integer, parameter :: most_groups = 5000, most_in_group = 10000, most_bytes = 32*1024**2

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
        if (length <= 0) call read_pipe(unit, text, problem)
      end if
      close (unit)
    end if
    if (status /= 0) problem = 'cannot be read: '//trim(reason)
    call end_lines(text)
  end subroutine read_file

  !> What comes from a file without a size, a pipe or a terminal, up to its end.
  subroutine read_pipe(unit, text, problem)
    integer, intent(in) :: unit
    character(:), allocatable, intent(inout) :: text
    character(:), allocatable, intent(inout) :: problem
    character(4096) :: part
    integer :: n, status

    n = 0
    do
      n = n + 1
      read (unit, iostat=status) part(n:n)
      if (status /= 0) n = n - 1
      if (status /= 0 .or. n == len(part)) then
        text = text//part(:n)
        n = 0
      end if
      if (status /= 0) exit
      if (len(text) > most_bytes) then
        problem = 'has more than '//str(most_bytes)//' bytes'
        exit
      end if
    end do
  end subroutine read_pipe

  !> Make newlines of carriage returns that end lines by themselves, as old editors write them.
  pure subroutine end_lines(text)
    character(:), allocatable, intent(inout) :: text
    integer :: i

    do i = 1, len(text)
      if (text(i:i) /= achar(13)) cycle
      if (i < len(text)) then
        if (text(i + 1:i + 1) == newline) cycle
      end if
      text(i:i) = newline
    end do
  end subroutine end_lines

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
                             excerpt(source%clean(i:last))// &
                             '" (a group is &NAME KEY = value, ... /)')
        i = last + 1
      end if
    end do
    scanned%text = source%clean
    scanned%groups = scanned%groups(:scanned%n_groups)
    scanned%assignments = scanned%assignments(:scanned%n_read)
    call scanned%find_places()
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
        call diagnostics%add(source%file, source%line(i), &
                             'more than '//str(most_in_group)//' values in one group')
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
      call diagnostics%add(source%file, source%line(i), &
                           'a value without a key: "'//excerpt(source%clean(i:current%last))//'"')
    end if
  end subroutine finish_assignment

end module input_scan
