! SPDX-License-Identifier: MIT
!> Columns of numbers from a CSV file with a line of names; lines that begin with # do not count.
module setup_csv
  use base_errors, only: error_t
  use base_kinds, only: rp
  use base_text, only: str
  use setup_keys_table, only: to_real
  implicit none (type, external)
  private

  public :: read_columns

  integer, parameter :: line_length = 4096
  real(rp), parameter :: beyond = 1.0e9_rp    !! no time, temperature or strain
  character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

contains

  !> The column of each name that the file has, `values(:, k)`; `found(k)` is false if it has none.
  subroutine read_columns(path, names, values, found, error)
    character(*), intent(in) :: path, names(:)
    real(rp), allocatable, intent(out) :: values(:, :)
    logical, intent(out) :: found(:)
    type(error_t), intent(inout) :: error
    character(line_length) :: line
    integer :: place(size(names)), k, length, n, number, status, unit
    real(rp), allocatable :: longer(:, :)
    logical :: has_header

    found = .false.
    allocate (values(64, size(names)), source=0.0_rp)
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    if (status /= 0) then
      call error%raise(path//' cannot be read')
      return
    end if
    n = 0
    number = 0
    has_header = .false.
    do
      read (unit, '(a)', iostat=status, size=length, advance='no') line
      if (status == 0) then
        call error%raise(path//':'//str(number + 1)//': a line of more than '//str(line_length)//' characters')
        exit
      else if (.not. is_iostat_eor(status)) then
        exit
      end if
      number = number + 1
      if (number == 1 .and. index(line, byte_order_mark) == 1) line = line(4:)
      if (length > 0) call drop_return(line)
      if (line == '' .or. line(1:1) == '#') cycle
      if (.not. has_header) then
        has_header = .true.
        place = [(column_of(line, names(k)), k=1, size(names))]
        found = place > 0
        cycle
      end if
      n = n + 1
      if (n > size(values, 1)) then
        allocate (longer(2*n, size(names)), source=0.0_rp)
        longer(:n - 1, :) = values
        call move_alloc(longer, values)
      end if
      do k = 1, size(names)
        if (.not. found(k)) cycle
        call take_item(line, place(k), values(n, k), status)
        if (status /= 0) call error%raise(path//':'//str(number)//': no number for '// &
                                          trim(names(k))//' (below 1e9)')
      end do
      if (error%is_set()) exit
    end do
    close (unit)
    values = values(:n, :)
  end subroutine read_columns

  !> Lines of some systems end with a carriage return.
  pure subroutine drop_return(line)
    character(*), intent(inout) :: line
    integer :: last

    last = len_trim(line)
    if (last > 0) then
      if (line(last:last) == achar(13)) line(last:last) = ' '
    end if
  end subroutine drop_return

  !> Number of the column of this name, 0 if there is none.
  pure integer function column_of(line, name)
    character(*), intent(in) :: line, name
    integer :: first, last

    column_of = 0
    first = 1
    do while (first <= len_trim(line))
      last = first + index(line(first:)//',', ',') - 2
      column_of = column_of + 1
      if (adjustl(line(first:last)) == name) return
      first = last + 2
    end do
    column_of = 0
  end function column_of

  !> The `k`-th item of a line.
  subroutine take_item(line, k, value, status)
    character(*), intent(in) :: line
    integer, intent(in) :: k
    real(rp), intent(out) :: value
    integer, intent(out) :: status
    integer :: first, i, last
    logical :: is_number

    value = 0.0_rp
    first = 1
    do i = 2, k
      first = first + index(line(first:)//',', ',')
      if (first > len_trim(line)) exit
    end do
    last = first + index(line(min(first, len(line)):)//',', ',') - 2
    status = 1
    if (first > len_trim(line) .or. last < first) return
    call to_real(trim(adjustl(line(first:last))), value, is_number)
    if (is_number .and. abs(value) < beyond) status = 0
  end subroutine take_item

end module setup_csv
