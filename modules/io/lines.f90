! SPDX-License-Identifier: MIT
!> Lines of a table with many rows, put together in one text: faster than write statements.
module io_lines
  use base_kinds, only: i8, rp
  use io_histories, only: compact
  implicit none (type, external)
  private

  public :: lines_t

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

end module io_lines
