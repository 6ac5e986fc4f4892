! SPDX-License-Identifier: MIT
!> Tables of values over time as CSV text, written by rank 0 and continued after a restart.
module io_histories
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_system, only: rename_file
  use comm_world, only: world_t
  use io_agree, only: agree
  implicit none (type, external)
  private

  public :: table_t

  real(rp), parameter :: time_slack = 1.0e-12_rp   !! relative; times have 13 digits in the file

  !> An open table. Ranks other than 0 may make the same calls; they write nothing.
  type :: table_t
    private
    type(world_t) :: world
    integer :: unit = 0
    integer :: n = 0                      !! columns
    integer :: status = 0                 !! of the first row that could not be written
    logical :: is_open = .false.
    character(:), allocatable :: path
  contains
    procedure :: open => open_table
    procedure :: row
    procedure :: close => close_table
  end type table_t

contains

  !> Start a table, or continue the one that is there after the rows up to `resume_time`.
  subroutine open_table(self, world, path, title, columns, resume_time, error)
    class(table_t), intent(out) :: self
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    character(*), intent(in) :: title        !! first line, after '# '; none if blank
    character(*), intent(in) :: columns(:)   !! names with units, as time[s]; the first is the time
    real(rp), intent(in) :: resume_time      !! below zero: a fresh table
    type(error_t), intent(inout) :: error
    character(:), allocatable :: text
    integer :: status

    if (error%is_set()) return
    self%world = world
    self%path = trim(path)
    self%n = size(columns)
    if (world%is_root()) then
      text = header(columns)
      if (resume_time >= 0.0_rp) call keep_rows(self, columns, resume_time, text, error)
      if (len_trim(title) > 0) text = '# '//trim(title)//new_line('a')//text
      if (.not. error%is_set()) call replace_file(self%path, text, error)
      if (.not. error%is_set()) then
        open (newunit=self%unit, file=self%path, action='write', status='old', &
              position='append', iostat=status)
        self%is_open = status == 0
        if (.not. self%is_open) call error%raise(self%path//' cannot be opened')
      end if
    end if
    call agree(world, error)
    if (error%is_set() .and. self%is_open) close (self%unit)
    if (error%is_set()) self%is_open = .false.
  end subroutine open_table

  !> The line of column names.
  function header(columns) result(text)
    character(*), intent(in) :: columns(:)
    character(:), allocatable :: text
    integer :: k

    text = trim(columns(1))
    do k = 2, size(columns)
      text = text//','//trim(columns(k))
    end do
    text = text//new_line('a')
  end function header

  !> Header and rows up to `resume_time` of the old table; its last line may be incomplete.
  subroutine keep_rows(self, columns, resume_time, text, error)
    type(table_t), intent(in) :: self
    character(*), intent(in) :: columns(:)
    real(rp), intent(in) :: resume_time
    character(:), allocatable, intent(inout) :: text
    type(error_t), intent(inout) :: error
    character(:), allocatable :: old, kept
    integer :: first, last, length, used
    logical :: has_header

    call read_file(self%path, old)
    if (len(old) == 0) return
    allocate (character(len(old)) :: kept)
    used = 0
    has_header = .false.
    first = 1
    do
      length = index(old(first:), new_line('a'))
      if (length == 0) exit
      last = first + length - 1
      if (old(first:first) == '#') then
        continue
      else if (.not. has_header) then
        has_header = .true.
        if (old(first:last) /= text) then
          call error%raise(self%path//' has other columns; move it away or restart with the same')
          return
        end if
      else if (is_row_until(old(first:last - 1), size(columns), resume_time)) then
        kept(used + 1:used + length) = old(first:last)
        used = used + length
      end if
      first = last + 1
      if (first > len(old)) exit
    end do
    text = text//kept(:used)
  end subroutine keep_rows

  !> True if the line is a full row whose first value is not later than `time`.
  logical function is_row_until(line, n, time)
    character(*), intent(in) :: line
    integer, intent(in) :: n
    real(rp), intent(in) :: time
    real(rp) :: value
    integer :: status, comma, k

    is_row_until = .false.
    if (count([(line(k:k) == ',', k=1, len(line))]) /= n - 1) return
    comma = index(line//',', ',')
    if (len_trim(line(:comma - 1)) == 0) return
    read (line(:comma - 1), *, iostat=status) value
    if (status == 0) is_row_until = value <= time*(1.0_rp + time_slack)
  end function is_row_until

  !> The whole file; empty if there is none.
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

  !> Put `text` in place of a file in one go.
  subroutine replace_file(path, text, error)
    character(*), intent(in) :: path, text
    type(error_t), intent(inout) :: error
    integer :: unit, status
    logical :: ok

    open (newunit=unit, file=path//'.tmp', access='stream', form='unformatted', action='write', &
          status='replace', iostat=status)
    ok = status == 0
    if (ok) then
      write (unit, iostat=status) text
      ok = status == 0
      close (unit, iostat=status)
      ok = ok .and. status == 0
    end if
    if (ok) call rename_file(path//'.tmp', path, ok)
    if (.not. ok) call error%raise(path//' cannot be written')
  end subroutine replace_file

  !> Append a row. A failure is kept for `close`: rows are frequent, an agreement of ranks is not.
  subroutine row(self, values)
    class(table_t), intent(inout) :: self
    real(rp), intent(in) :: values(:)
    character(25*size(values)) :: line
    integer :: status

    if (.not. self%is_open) return
    write (line, '(es19.12, *(:, ",", es17.9))') values
    write (self%unit, '(a)', iostat=status) compact(line)
    if (self%status == 0) self%status = status
    flush (self%unit, iostat=status)
    if (self%status == 0) self%status = status
  end subroutine row

  !> A row without its blanks, and with an E also before exponents of three digits, where Fortran drops it.
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

  !> Close; says on all ranks if a row was lost.
  subroutine close_table(self, error)
    class(table_t), intent(inout) :: self
    type(error_t), intent(inout) :: error
    integer :: status

    if (.not. allocated(self%path)) return
    if (self%is_open) then
      close (self%unit, iostat=status)
      if (self%status == 0) self%status = status
    end if
    if (self%status /= 0) call error%raise(self%path//' could not be written completely')
    call agree(self%world, error)
    self%is_open = .false.
    deallocate (self%path)
  end subroutine close_table

end module io_histories
