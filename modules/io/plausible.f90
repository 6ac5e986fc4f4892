! SPDX-License-Identifier: MIT
!> Numbers of a checkpoint and their ranges. The seal shows that the file is unchanged since it was
!> sealed, but not that a run has written it: each number is checked before it is used. The same
!> procedure passes the numbers in their order for writing and for reading.
module io_plausible
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_text, only: str
  implicit none (type, external)
  private

  public :: is_between, numbers_t

  real(rp), parameter, public :: max_magnitude = 1.0e30_rp  !! bound of any quantity, in SI units
  real(rp), parameter, public :: min_positive = 1.0e-30_rp  !! bound of positive quantities
  real(rp), parameter, public :: speed_of_light = 3.0e8_rp   !! bound of velocities [m/s]
  !> Bound of counts, up to which reals are exact.
  real(rp), parameter, public :: counts = 2.0_rp**53

  !> Numbers of a data set, which are written or read and checked one after the other. The data set
  !> has their names, a line for each with how many they are.
  type :: numbers_t
    character(:), allocatable :: place       !! file and data set
    real(rp), allocatable :: value(:)
    logical :: is_read = .true.              !! numbers are read, otherwise written
    integer :: n = 0                         !! numbers expected so far
    character(:), allocatable :: stored      !! names in the file; not allocated: not to compare
    character(:), allocatable, private :: buffer   !! names so far, and room for more
    integer, private :: used = 0             !! characters of `buffer`
    type(error_t) :: error
  contains
    procedure :: expect, pass
    procedure, private :: pass_real, pass_integer, pass_long
    generic :: pass_one => pass_real, pass_integer, pass_long
    procedure :: pass_sink, has_set, finish, names
    procedure, private :: add_name
  end type numbers_t

contains

  !> Check that the next `n` numbers, `what`, are from `low` (default -most) to `high` (most).
  subroutine expect(self, n, what, low, high)
    class(numbers_t), intent(inout) :: self
    integer, intent(in) :: n
    character(*), intent(in) :: what
    real(rp), intent(in), optional :: low, high
    real(rp) :: range(2)
    integer :: k

    self%n = self%n + n
    if (self%n > size(self%value)) return
    range = [-max_magnitude, max_magnitude]
    if (present(low)) range(1) = low
    if (present(high)) range(2) = high
    do k = self%n - n + 1, self%n
      if (is_between(self%value(k), range(1), range(2))) cycle
      call self%error%raise(self%place//': number '//str(k)//', '//what//', is '// &
                            str(self%value(k))//', not from '//str(range(1))//' to '//str(range(2)))
      return
    end do
  end subroutine expect

  !> Append `x(1:n)`, or set it to the next `n` numbers if these are from `low` to `high`.
  subroutine pass(self, n, x, what, low, high)
    class(numbers_t), intent(inout) :: self
    integer, intent(in) :: n
    real(rp), intent(inout) :: x(n)
    character(*), intent(in) :: what
    real(rp), intent(in), optional :: low, high

    call self%add_name(n, what)
    if (.not. self%is_read) then
      self%value = [self%value, x]
    else
      call self%expect(n, what, low, high)
      if (self%has_set()) x = self%value(self%n - n + 1:self%n)
    end if
  end subroutine pass

  !> Append a line with the number and the name of numbers.
  subroutine add_name(self, n, what)
    class(numbers_t), intent(inout) :: self
    integer, intent(in) :: n
    character(*), intent(in) :: what
    character(:), allocatable :: line

    line = str(n)//' '//what//new_line('a')
    if (.not. allocated(self%buffer)) self%buffer = ''
    if (self%used + len(line) > len(self%buffer)) then
      self%buffer = self%buffer//repeat(' ', len(self%buffer) + len(line))
    end if
    self%buffer(self%used + 1:self%used + len(line)) = line
    self%used = self%used + len(line)
  end subroutine add_name

  !> Names of the numbers passed so far, a line for each with how many they are.
  pure function names(self)
    class(numbers_t), intent(in) :: self
    character(:), allocatable :: names

    names = ''
    if (allocated(self%buffer)) names = self%buffer(:self%used)
  end function names

  !> Pass a single number with its range.
  subroutine pass_real(self, x, what, low, high)
    class(numbers_t), intent(inout) :: self
    real(rp), intent(inout) :: x
    character(*), intent(in) :: what
    real(rp), intent(in), optional :: low, high
    real(rp) :: value(1)

    value = x
    call self%pass(1, value, what, low, high)
    x = value(1)
  end subroutine pass_real

  !> Pass an integer as a number with its range.
  subroutine pass_integer(self, x, what, low, high)
    class(numbers_t), intent(inout) :: self
    integer, intent(inout) :: x
    character(*), intent(in) :: what
    real(rp), intent(in) :: low, high
    real(rp) :: value

    value = real(x, rp)
    call self%pass_real(value, what, low, high)
    x = nint(value)
  end subroutine pass_integer

  !> Pass a count as a number with its range.
  subroutine pass_long(self, x, what, low, high)
    class(numbers_t), intent(inout) :: self
    integer(i8), intent(inout) :: x
    character(*), intent(in) :: what
    real(rp), intent(in) :: low, high
    real(rp) :: value

    value = real(x, rp)
    call self%pass_real(value, what, low, high)
    x = nint(value, i8)
  end subroutine pass_long

  !> Pass the state of a heat sink (tools_heat_sink); no numbers if there is none.
  subroutine pass_sink(self, state)
    class(numbers_t), intent(inout) :: self
    real(rp), intent(inout) :: state(:)

    if (size(state) == 0) return
    call self%pass_real(state(1), 'the temperature of the face of a tool or backing [K]', &
                        min_positive)
    call self%pass(2, state(2:3), 'the heat of a tool or backing [J]')
    call self%pass(size(state) - 3, state(4:), 'the temperature of a tool or backing [K]', &
                   min_positive)
  end subroutine pass_sink

  !> True if the numbers passed so far were read and are valid.
  pure logical function has_set(self)
    class(numbers_t), intent(in) :: self

    has_set = self%is_read .and. .not. self%error%is_set() .and. self%n <= size(self%value)
  end function has_set

  !> Check that the file has the numbers that were expected; otherwise errors of a range mean
  !> nothing.
  subroutine finish(self)
    class(numbers_t), intent(inout) :: self
    character(:), allocatable :: expected, found
    integer :: k

    expected = self%names()
    found = expected
    if (allocated(self%stored)) found = self%stored
    if (found == expected) then
      if (self%n /= size(self%value)) self%error%message = self%place//': '// &
        str(size(self%value))//' numbers, not '//str(self%n)
      return
    end if
    k = 1      ! first line that differs
    do while (first_line(found(k:)) == first_line(expected(k:)))
      k = k + len(first_line(expected(k:))) + 1
    end do
    self%error%message = self%place//': '//first_line(found(k:))//' instead of '// &
      first_line(expected(k:))//': the checkpoint belongs to another '// &
      'scene (tools, walls, clamps, probes or tracers differ)'
  end subroutine finish

  !> Text up to the end of its first line; 'nothing' if it is empty.
  pure function first_line(text) result(line)
    character(*), intent(in) :: text
    character(:), allocatable :: line

    line = 'nothing'
    if (text /= '') line = text(:index(text//new_line('a'), new_line('a')) - 1)
  end function first_line

  !> Whether a number is from `low` to `high`; false for NaN.
  elemental logical function is_between(x, low, high)
    real(rp), intent(in) :: x, low, high

    is_between = ieee_is_finite(x)
    if (is_between) is_between = x >= low .and. x <= high
  end function is_between

end module io_plausible
