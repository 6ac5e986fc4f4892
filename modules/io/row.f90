! SPDX-License-Identifier: MIT
!> One row of a table, filled by columns with name, unit and value.
module io_row
  use base_errors, only: fatal
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: row_t

  integer, parameter :: max_name = 64          !! length of column names

  type :: row_column_t
    character(max_name) :: name = ''
    character(8) :: unit = ''
    real(rp) :: value = 0.0_rp
  end type row_column_t

  type :: row_t
    private
    integer :: n = 0
    type(row_column_t), allocatable :: column(:)  !! the first n are used
  contains
    procedure :: add
    procedure :: headings
    procedure :: values
    procedure :: value
  end type row_t

contains

  !> Append a column.
  pure subroutine add(self, name, unit, value)
    class(row_t), intent(inout) :: self
    character(*), intent(in) :: name, unit     !! unit: '' if none
    real(rp), intent(in) :: value
    type(row_column_t), allocatable :: longer(:)

    if (.not. allocated(self%column)) allocate (self%column(64))
    if (self%n == size(self%column)) then
      allocate (longer(2*self%n))
      longer(:self%n) = self%column
      call move_alloc(longer, self%column)
    end if
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

    if (self%n > 0) values = self%column(:self%n)%value
  end function values

  !> Value of the first column with this name, which must exist.
  real(rp) function value(self, name)
    class(row_t), intent(in) :: self
    character(*), intent(in) :: name
    integer :: k

    value = 0.0_rp
    do k = 1, self%n
      if (self%column(k)%name /= name) cycle
      value = self%column(k)%value
      return
    end do
    call fatal('a row has no column '//name)
  end function value

end module io_row
