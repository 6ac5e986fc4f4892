! SPDX-License-Identifier: MIT
!> Text functions: case, numbers as text, similarity of words.
module base_text
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: upper, lower, joined, str, edit_distance

  !> Shortest readable text of a number.
  interface str
    module procedure str_int, str_long, str_real
  end interface str

contains

  !> `s` in upper case.
  pure function upper(s) result(r)
    character(*), intent(in) :: s
    character(len(s)) :: r
    integer :: i

    r = s
    do i = 1, len(s)
      if (s(i:i) >= 'a' .and. s(i:i) <= 'z') r(i:i) = achar(iachar(s(i:i)) - 32)
    end do
  end function upper

  !> `s` in lower case.
  pure function lower(s) result(r)
    character(*), intent(in) :: s
    character(len(s)) :: r
    integer :: i

    r = s
    do i = 1, len(s)
      if (s(i:i) >= 'A' .and. s(i:i) <= 'Z') r(i:i) = achar(iachar(s(i:i)) + 32)
    end do
  end function lower

  !> Words with a separator between them.
  pure function joined(words, separator) result(r)
    character(*), intent(in) :: words(:), separator
    character(:), allocatable :: r
    integer :: k

    r = ''
    do k = 1, size(words)
      if (k > 1) r = r//separator
      r = r//trim(words(k))
    end do
  end function joined

  pure function str_int(i) result(r)
    integer, intent(in) :: i
    character(:), allocatable :: r

    r = str_long(int(i, i8))
  end function str_int

  pure function str_long(i) result(r)
    integer(i8), intent(in) :: i
    character(:), allocatable :: r
    character(24) :: buffer

    write (buffer, '(i0)') i
    r = trim(buffer)
  end function str_long

  !> Text of a number with six significant digits without trailing zeros: 0.0005 is 5e-4, 298 is
  !> 298.
  pure function str_real(x) result(r)
    real(rp), intent(in) :: x
    character(:), allocatable :: r
    character(32) :: buffer
    integer :: e, exponent, last

    if (.not. ieee_is_finite(x)) then
      write (buffer, '(es14.5e3)') x
      r = trim(adjustl(buffer))
    else if (x == 0.0_rp) then
      r = '0'
    else if (abs(x) >= 1.0e-3_rp .and. abs(x) < 1.0e6_rp) then
      write (buffer, '(f0.'//achar(48 + min(8, max(0, 5 - floor(log10(abs(x))))))//')') x
      r = trim(buffer)
      if (index(r, '.') > 0) r = r(:verify(r, '0', back=.true.))
      if (r(len(r):) == '.') r = r(:len(r) - 1)
      if (r(1:1) == '.') r = '0'//r
      if (r(1:1) == '-' .and. r(2:2) == '.') r = '-0'//r(2:)
    else
      write (buffer, '(es14.5e3)') x
      buffer = adjustl(buffer)
      e = index(buffer, 'E')
      last = verify(buffer(:e - 1), '0', back=.true.)
      if (buffer(last:last) == '.') last = last - 1
      read (buffer(e + 1:), *) exponent          ! without leading zeros
      r = buffer(:last)//'e'//str_int(exponent)
    end if
  end function str_real

  !> Levenshtein distance: number of insertions, deletions and substitutions that turn `a` into `b`.
  pure integer function edit_distance(a, b)
    character(*), intent(in) :: a, b
    integer :: d(0:len(a), 0:len(b)), i, j

    do i = 0, len(a)
      d(i, 0) = i
    end do
    do j = 0, len(b)
      d(0, j) = j
    end do
    do i = 1, len(a)
      do j = 1, len(b)
        d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, &
                      d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
      end do
    end do
    edit_distance = d(len(a), len(b))
  end function edit_distance

end module base_text
