! SPDX-License-Identifier: MIT
!> Tables of an input: numeric columns of CSV files with a header line, where lines that begin with
!> # are ignored, and checks of their points.
module input_tables
  use base_kinds, only: rp
  use base_text, only: str
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_syntax, only: to_real
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: check_rising, read_columns, rises

  integer, parameter :: line_length = 4096, max_diagnostics = 20
  real(rp), parameter :: max_value = 1.0e9_rp   !! above any time, temperature or strain

contains

  !> Report a table whose points do not increase.
  subroutine check_rising(input, group, i, key, points, which)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i                          !! index of the group
    character(*), intent(in) :: key
    real(rp), intent(in) :: points(:)
    character(*), intent(in), optional :: which       !! name of the points; default: all values

    if (rises(points)) return
    if (present(which)) then
      call input%report(group, i, key, 'must have rising '//which)
    else
      call input%report(group, i, key, 'must rise from value to value')
    end if
  end subroutine check_rising

  !> True if each value exceeds the previous one.
  pure logical function rises(points)
    real(rp), intent(in) :: points(:)

    rises = .true.
    if (size(points) > 1) rises = all(points(2:) > points(:size(points) - 1))
  end function rises

  !> Read the columns with the given names; report values that are not finite numbers,
  !> and omit their rows.
  subroutine read_columns(path, names, values, lines, found, opened, diagnostics)
    character(*), intent(in) :: path, names(:)
    real(rp), allocatable, intent(out) :: values(:, :)   !! (row, name)
    integer, allocatable, intent(out) :: lines(:)        !! line number of each row
    logical, intent(out) :: found(:)                     !! names that the header has
    logical, intent(out) :: opened                       !! the file can be read
    type(diagnostics_t), intent(inout) :: diagnostics
    character(line_length) :: line
    integer :: before, columns, place(size(names)), n, number, status, unit, wrong
    logical :: has_header

    found = .false.
    wrong = 0
    allocate (values(64, size(names)), lines(64))
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    opened = status == 0
    if (.not. opened) return
    n = 0
    number = 0
    has_header = .false.
    do while (wrong < max_diagnostics)
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      number = number + 1
      call clean(line, number)
      if (line == '' .or. line(1:1) == '#') cycle
      if (line(line_length:) /= '') call report('is longer than '//str(line_length)//' characters')
      if (.not. has_header) then
        has_header = .true.
        call find_columns(line, names, place)
        found = place > 0
        columns = items(line)
        cycle
      end if
      call grow(n + 1, values, lines)
      n = n + 1
      lines(n) = number
      before = wrong
      call read_row()
      if (wrong > before) n = n - 1
    end do
    close (unit)
    values = values(:n, :)
    lines = lines(:n)
  contains
    !> Read the values of the current line.
    subroutine read_row()
      character(:), allocatable :: item
      integer :: k
      logical :: ok

      values(n, :) = 0.0_rp
      if (items(line) /= columns) then
        call report('has '//str(items(line))//' values, the table '//str(columns)//' columns')
        return
      end if
      do k = 1, size(names)
        if (.not. found(k)) cycle
        item = item_of(line, place(k))
        call to_real(item, values(n, k), ok)
        ok = ok .and. abs(values(n, k)) < max_value
        if (.not. ok) then
          call report("'"//excerpt(item)//"' is no number for "//trim(names(k))//' (below 1e9)')
        end if
      end do
    end subroutine read_row

    !> Report an error of the current line.
    subroutine report(message)
      character(*), intent(in) :: message

      wrong = wrong + 1
      if (wrong <= max_diagnostics) call diagnostics%add(path, number, message)
    end subroutine report
  end subroutine read_columns

  !> Remove the byte order mark of the first line; replace tabs and carriage returns by blanks.
  pure subroutine clean(line, number)
    character(*), intent(inout) :: line
    integer, intent(in) :: number
    character(3), parameter :: mark = char(239)//char(187)//char(191)
    integer :: i

    if (number == 1 .and. line(1:3) == mark) line = line(4:)
    do i = 1, len_trim(line)
      if (line(i:i) == achar(9) .or. line(i:i) == achar(13)) line(i:i) = ' '
    end do
  end subroutine clean

  !> Double the arrays if they have fewer than `n` rows.
  pure subroutine grow(n, values, lines)
    integer, intent(in) :: n
    real(rp), allocatable, intent(inout) :: values(:, :)
    integer, allocatable, intent(inout) :: lines(:)
    real(rp), allocatable :: longer(:, :)

    if (n <= size(lines)) return
    allocate (longer(2*n, size(values, 2)))
    longer(:n - 1, :) = values
    call move_alloc(longer, values)
    lines = [lines, lines, 0, 0]
  end subroutine grow

  !> Index of the column of each name; 0 if there is none.
  pure subroutine find_columns(line, names, place)
    character(*), intent(in) :: line, names(:)
    integer, intent(out) :: place(size(names))
    character(:), allocatable :: item
    integer :: i, unit

    place = 0
    do i = items(line), 1, -1
      item = item_of(line, i)
      unit = index(item, '[')
      if (unit > 1) item = trim(item(:unit - 1))//item(unit:)   ! `x [m]` as `x[m]`
      where (names == item) place = i
    end do
  end subroutine find_columns

  !> Number of items of a line.
  pure integer function items(line)
    character(*), intent(in) :: line
    integer :: k

    items = 1 + count([(line(k:k) == ',', k=1, len_trim(line))])
  end function items

  !> The `k`-th item of a line; '' if there is none.
  pure function item_of(line, k) result(item)
    character(*), intent(in) :: line
    integer, intent(in) :: k
    character(:), allocatable :: item
    integer :: first, i, width

    first = 1
    do i = 1, k
      width = index(line(first:), ',') - 1
      if (width < 0) width = len(line) - first + 1
      item = trim(adjustl(line(first:first + width - 1)))
      first = min(first + width + 1, len(line) + 1)
    end do
  end function item_of

end module input_tables
