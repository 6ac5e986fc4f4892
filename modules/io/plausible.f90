! SPDX-License-Identifier: MIT
!> Ranges of the numbers in a checkpoint. Its seal shows that the file is unchanged since it was
!> sealed, but not that a run has written it: each number is checked before it is used.
module io_plausible
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use base_errors, only: error_t
  use base_kinds, only: rp
  use base_text, only: str
  implicit none (type, external)
  private

  public :: is_between, numbers_t

  real(rp), parameter, public :: most = 1.0e30_rp    !! bound of any quantity, in SI units
  real(rp), parameter, public :: least = 1.0e-30_rp  !! bound of positive quantities
  real(rp), parameter, public :: speed_of_light = 3.0e8_rp   !! bound of velocities [m/s]
  real(rp), parameter, public :: counts = 2.0_rp**53   !! bound of counts: reals are exact up to it

  !> Numbers of a data set, which are checked one after the other.
  type :: numbers_t
    character(:), allocatable :: place       !! file and data set
    real(rp), allocatable :: value(:)
    integer :: n = 0                         !! numbers expected so far
    type(error_t) :: error
  contains
    procedure :: expect
    procedure :: expect_sink
    procedure :: finish
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
    range = [-most, most]
    if (present(low)) range(1) = low
    if (present(high)) range(2) = high
    do k = self%n - n + 1, self%n
      if (is_between(self%value(k), range(1), range(2))) cycle
      call self%error%raise(self%place//': number '//str(k)//', '//what//', is '// &
                            str(self%value(k))//', not from '//str(range(1))//' to '//str(range(2)))
      return
    end do
  end subroutine expect

  !> Check the next `n` numbers, the state of a heat sink (contact_heat_sink).
  subroutine expect_sink(self, n)
    class(numbers_t), intent(inout) :: self
    integer, intent(in) :: n

    if (n == 0) return
    call self%expect(1, 'the temperature of the face of a tool or backing [K]', least)
    call self%expect(2, 'the heat of a tool or backing [J]')
    call self%expect(n - 3, 'the temperature of a tool or backing [K]', least)
  end subroutine expect_sink

  !> Check that there are as many numbers as expected; errors of a range mean nothing otherwise.
  subroutine finish(self)
    class(numbers_t), intent(inout) :: self

    if (self%n /= size(self%value)) self%error%message = self%place//': '// &
      str(size(self%value))//' numbers, not '//str(self%n)//': the checkpoint belongs to '// &
      'another scene (tools, walls, clamps, probes or tracers differ)'
  end subroutine finish

  !> Whether a number is from `low` to `high`; false for NaN.
  elemental logical function is_between(x, low, high)
    real(rp), intent(in) :: x, low, high

    is_between = ieee_is_finite(x)
    if (is_between) is_between = x >= low .and. x <= high
  end function is_between

end module io_plausible
