! SPDX-License-Identifier: MIT
!> Tables of values over time as CSV files, written by rank 0 and continued after a restart. A row
!> of a table is filled by columns with name, unit and value.
module io_histories
  use base_errors, only: error_t, fatal
  use base_files, only: free_name, reason_of, text_file_t, write_whole
  use base_kinds, only: i8, rp
  use base_log, only: log_line
  use base_system, only: rename_file
  use base_text, only: joined, str
  use base_world, only: agree, world_t
  implicit none (type, external)
  private

  public :: compact, row_t, table_t, lines_t

  real(rp), parameter :: time_slack = 1.0e-12_rp   !! relative tolerance of times with 13 digits

  !> An open table. Calls of ranks other than 0 have no effect.
  type :: table_t
    private
    type(world_t) :: world
    type(text_file_t) :: file
    character(:), allocatable :: path
  contains
    procedure :: open => open_table, write_row, write_lines, is_lost, sync, close => close_table
  end type table_t

  integer, parameter :: max_name = 64          !! length of column names

  type :: row_column_t
    character(max_name) :: name = ''
    character(8) :: unit = ''
    real(rp) :: value = 0.0_rp
  end type row_column_t

  type :: row_t
    private
    type(row_column_t), allocatable :: column(:)
    integer :: n = 0                           !! columns in use
  contains
    procedure :: add, headings, values, value
  end type row_t

  type :: lines_t
    character(:), allocatable :: text    !! long enough for all lines
    integer :: used = 0                  !! characters in use
  contains
    generic :: add => add_text, add_integer, add_real
    procedure, private :: add_text
    procedure, private :: add_integer
    procedure, private :: add_real
  end type lines_t

contains

  !> Start a table, or continue an existing one after the `rows` of the run, the last at
  !> `last_time`. A table with other rows is moved aside with a warning; further rows at `last_time`
  !> are removed if they `may_follow` the checkpoint.
  subroutine open_table(self, world, path, title, columns, rows, last_time, error, may_follow)
    class(table_t), intent(out) :: self
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    character(*), intent(in) :: title        !! first line, after '# '; none if blank
    character(*), intent(in) :: columns(:)   !! names with units, as time[s]; the first is the time
    integer(i8), intent(in) :: rows          !! rows of the run; negative: new table
    real(rp), intent(in) :: last_time        !! time of the last row [s]
    type(error_t), intent(inout) :: error
    logical, intent(in), optional :: may_follow
    character(:), allocatable :: text
    logical :: cuts_more

    if (error%is_set()) return
    cuts_more = .false.
    if (present(may_follow)) cuts_more = may_follow
    self%world = world
    self%path = trim(path)
    if (world%is_root()) then
      text = joined(columns, ',')//new_line('a')   ! the header
      if (rows >= 0) call keep_rows(self%path, columns, rows, last_time, cuts_more, text)
      if (len_trim(title) > 0) text = '# '//trim(title)//new_line('a')//text
      call write_whole(self%path, text, error)
      if (.not. error%is_set()) call self%file%append(self%path)
      if (self%file%code /= 0) call error%raise(reason(self))
    end if
    call agree(world, error)
    if (error%is_set()) call self%file%close()
  end subroutine open_table

  !> Copy header and rows up to `last_time` of the old table, whose last line may be incomplete.
  subroutine keep_rows(path, columns, rows, last_time, cuts_more, text)
    character(*), intent(in) :: path, columns(:)
    integer(i8), intent(in) :: rows
    real(rp), intent(in) :: last_time
    logical, intent(in) :: cuts_more         !! remove further rows at `last_time`
    character(:), allocatable, intent(inout) :: text
    character(:), allocatable :: old, kept
    integer(i8) :: found
    integer :: first, last, length, used
    logical :: has_header
    real(rp) :: slack, time                  ! time of a row [s]

    slack = time_slack*abs(last_time)
    call read_file(path, old)
    allocate (character(len(old)) :: kept)
    used = 0
    found = 0
    has_header = .false.
    first = 1
    do while (first <= len(old))
      length = index(old(first:), new_line('a'))
      if (length == 0) exit
      last = first + length - 1
      if (old(first:first) == '#') then
        continue
      else if (.not. has_header) then
        has_header = .true.
        found = -1
        if (old(first:last) /= text) exit
        found = 0
      else
        time = time_of(old(first:last - 1), size(columns))
        if (time <= last_time + slack .and. .not. (cuts_more .and. found >= rows &
                                                   .and. time >= last_time - slack)) then
          kept(used + 1:used + length) = old(first:last)
          used = used + length
          found = found + 1
        end if
      end if
      first = last + 1
    end do
    if (found /= rows) call set_aside(path, len(old) > 0, found, rows, last_time)
    text = text//kept(:used)
  end subroutine keep_rows

  !> Rename a table with other rows than those of this run, with a warning.
  subroutine set_aside(path, is_there, found, rows, last_time)
    character(*), intent(in) :: path
    logical, intent(in) :: is_there
    integer(i8), intent(in) :: found   !! rows in the table, -1 if it has other columns
    integer(i8), intent(in) :: rows    !! rows of the run
    real(rp), intent(in) :: last_time
    character(:), allocatable :: message, aside
    logical :: ok

    message = 'warning: '//path//' has other columns'
    if (found >= 0) message = 'warning: '//path//' holds '//str(found)//' of the '//str(rows)// &
                              ' rows that the run had written until t = '//str(last_time)//' s'
    if (.not. is_there) message = 'warning: '//path//' begins at t = '//str(last_time)// &
      ' s: it was not there, with the '//str(rows)//' rows that the run had written until then'
    if (is_there) then
      aside = free_name(path)
      call rename_file(path, aside, ok)
      if (ok) message = message//'; it is kept as '//aside
    end if
    call log_line(message)
  end subroutine set_aside

  !> First value of a line; huge if the line is not a complete row of `n` values.
  real(rp) function time_of(line, n) result(time)
    character(*), intent(in) :: line
    integer, intent(in) :: n
    real(rp) :: value
    integer :: status, comma, k

    time = huge(1.0_rp)
    if (count([(line(k:k) == ',', k=1, len(line))]) /= n - 1) return
    comma = index(line//',', ',')
    if (len_trim(line(:comma - 1)) == 0) return
    read (line(:comma - 1), *, iostat=status) value
    if (status == 0) time = value
  end function time_of

  !> Content of a file; empty if there is none.
  subroutine read_file(path, text)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: text
    integer :: unit, status
    integer(i8) :: length
    logical :: exists

    inquire (file=path, exist=exists, size=length)
    if (.not. exists) length = 0
    allocate (character(max(0_i8, length)) :: text)
    if (length <= 0) return
    open (newunit=unit, file=path, access='stream', form='unformatted', action='read', &
          status='old', iostat=status)
    if (status == 0) then
      read (unit, iostat=status) text
      close (unit)
    end if
    if (status /= 0) text = ''
  end subroutine read_file

  !> Append a row. A failure is reported by `is_lost` and `close`, to avoid communication for each
  !> row.
  subroutine write_row(self, values)
    class(table_t), intent(inout) :: self
    real(rp), intent(in) :: values(:)
    character(25*size(values)) :: line

    if (.not. self%world%is_root()) return
    write (line, '(es19.12, *(:, ",", es17.9))') values
    call self%write_lines(compact(line)//new_line('a'))
  end subroutine write_row

  !> Append rows given as text with line ends.
  subroutine write_lines(self, text)
    class(table_t), intent(inout) :: self
    character(*), intent(in) :: text

    if (.not. self%world%is_root() .or. len(text) == 0) return
    call self%file%put(text)
    call report_restored(self)
  end subroutine write_lines

  !> True on rank 0 if a row could not be written.
  pure logical function is_lost(self)
    class(table_t), intent(in) :: self

    is_lost = self%file%code /= 0
  end function is_lost

  !> Flush the rows to disk, before a checkpoint that stores their number.
  subroutine sync(self)
    class(table_t), intent(inout) :: self

    call self%file%sync()
    call report_restored(self)
  end subroutine sync

  !> Warn that the file was moved, deleted or replaced and has been written again.
  subroutine report_restored(self)
    class(table_t), intent(inout) :: self

    if (self%file%was_restored .and. .not. self%is_lost()) call log_line('warning: '//self%path// &
      ' was moved, deleted or replaced during the run; it is written again with all its rows')
    self%file%was_restored = .false.
  end subroutine report_restored

  !> A row without blanks, with an E also before exponents of three digits, where Fortran omits it.
  pure function compact(line) result(text)
    character(*), intent(in) :: line
    character(:), allocatable :: text
    character(2*len(line)) :: kept
    integer :: k, n

    n = 0
    do k = 1, len(line)
      if (line(k:k) == ' ') cycle
      if (k > 1 .and. scan(line(k:k), '+-') == 1) then
        if (scan(line(k - 1:k - 1), '0123456789') == 1) then
          n = n + 1
          kept(n:n) = 'E'
        end if
      end if
      n = n + 1
      kept(n:n) = line(k:k)
    end do
    text = kept(:n)
  end function compact

  !> Collective. Close the table; raise an error on all ranks if a row was lost.
  subroutine close_table(self, error)
    class(table_t), intent(inout) :: self
    type(error_t), intent(inout) :: error

    if (.not. allocated(self%path)) return
    call self%file%close()
    if (self%is_lost()) call error%raise(reason(self))
    call agree(self%world, error)
    deallocate (self%path)
  end subroutine close_table

  function reason(self) result(text)
    class(table_t), intent(in) :: self
    character(:), allocatable :: text

    text = self%path//' cannot be written: '//reason_of(self%file%code)
  end function reason

  !> Append a column.
  pure subroutine add(self, name, unit, value)
    class(row_t), intent(inout) :: self
    character(*), intent(in) :: name, unit     !! name; unit, '' if none
    real(rp), intent(in) :: value

    if (.not. allocated(self%column)) allocate (self%column(64))
    if (self%n == size(self%column)) self%column = [self%column, self%column]
    self%n = self%n + 1
    self%column(self%n) = row_column_t(name, unit, value)
  end subroutine add

  !> Names of the columns with their units, as time[s].
  pure function headings(self) result(names)
    class(row_t), intent(in) :: self
    character(max_name + 10) :: names(self%n)
    integer :: k

    do k = 1, self%n
      associate (column => self%column(k))
        names(k) = column%name
        if (column%unit /= '') names(k) = trim(column%name)//'['//trim(column%unit)//']'
      end associate
    end do
  end function headings

  !> Values of all columns, in their order.
  pure function values(self)
    class(row_t), intent(in) :: self
    real(rp) :: values(self%n)

    values = self%column(:self%n)%value
  end function values

  !> Value of the first column with this name, which must exist.
  real(rp) function value(self, name)
    class(row_t), intent(in) :: self
    character(*), intent(in) :: name
    integer :: k

    k = findloc(self%column(:self%n)%name, name, dim=1)
    if (k == 0) call fatal('a row has no column '//name)
    value = self%column(k)%value
  end function value

  pure subroutine add_text(self, text)
    class(lines_t), intent(inout) :: self
    character(*), intent(in) :: text

    self%text(self%used + 1:self%used + len(text)) = text
    self%used = self%used + len(text)
  end subroutine add_text

  !> Append a number without a sign.
  pure subroutine add_integer(self, number)
    class(lines_t), intent(inout) :: self
    integer(i8), intent(in) :: number
    character(20) :: digits
    integer :: k
    integer(i8) :: rest

    rest = number
    do k = len(digits), 1, -1
      digits(k:k) = achar(iachar('0') + int(mod(rest, 10_i8)))
      rest = rest/10
      if (rest == 0) exit
    end do
    call self%add_text(digits(k:))
  end subroutine add_integer

  !> Append a number as `compact` of the format es15.8 has it: nine digits. A number too near the
  !> middle between two of these, or very small, is left to the format.
  subroutine add_real(self, number)
    class(lines_t), intent(inout) :: self
    real(rp), intent(in) :: number
    integer :: i
    real(rp), parameter :: power(0:22) = [(10.0_rp**i, i=0, 22)]   ! exact
    real(rp), parameter :: doubt = 1.0e-5_rp
    character(15) :: text
    integer :: exponent, k
    integer(i8) :: digits
    real(rp) :: scaled

    exponent = -99
    if (abs(number) > 1.0e-13_rp .and. abs(number) < 1.0e30_rp) exponent = floor(log10(abs(number)))
    scaled = abs(number)*power(min(22, max(0, 8 - exponent)))/power(max(0, exponent - 8))
    digits = nint(scaled, i8)
    if (abs(number) <= 0.0_rp .and. sign(1.0_rp, number) > 0.0_rp) then
      call self%add_text('0.00000000E+00')
      return
    end if
    if (exponent == -99 .or. abs(abs(scaled - digits) - 0.5_rp) < doubt .or. digits < 10**8 &
        .or. digits >= 10**9) then
      write (text, '(es15.8)') number
      call self%add_text(compact(text))
      return
    end if
    text = merge('-', '+', number < 0.0_rp)//'d.dddddddd'//merge('E-', 'E+', exponent < 0)
    do k = 11, 4, -1
      text(k:k) = achar(iachar('0') + int(mod(digits, 10_i8)))
      digits = digits/10
    end do
    text(2:2) = achar(iachar('0') + int(digits))
    text(14:14) = achar(iachar('0') + abs(exponent)/10)
    text(15:15) = achar(iachar('0') + mod(abs(exponent), 10))
    call self%add_text(text(merge(1, 2, number < 0.0_rp):))
  end subroutine add_real

end module io_histories
