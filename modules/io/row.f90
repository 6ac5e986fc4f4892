! SPDX-License-Identifier: MIT
!> One row of a table, filled column by column: what adds a value also names it.
module io_row
  use base_errors, only: fatal
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: row_t

  integer, parameter :: wide = 64              !! characters of a column's name

  type :: column_t
    character(wide) :: name = ''
    character(8) :: unit = ''
    real(rp) :: value = 0.0_rp
  end type column_t

  type :: row_t
    private
    integer :: n = 0
    type(column_t), allocatable :: column(:)   !! the first n
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
    character(*), intent(in) :: name, unit     !! unit: '' without one
    real(rp), intent(in) :: value
    type(column_t), allocatable :: longer(:)

    if (.not. allocated(self%column)) allocate (self%column(64))
    if (self%n == size(self%column)) then
      allocate (longer(2*self%n))
      longer(:self%n) = self%column
      call move_alloc(longer, self%column)
    end if
    self%n = self%n + 1
    self%column(self%n) = column_t(name, unit, value)
  end subroutine add

  !> Names of the columns with their units, as time[s].
  pure function headings(self) result(names)
    class(row_t), intent(in) :: self
    character(wide + 10) :: names(self%n)
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

  !> Value of the first column with this name, which must be there.
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
