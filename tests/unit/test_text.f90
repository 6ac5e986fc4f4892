! SPDX-License-Identifier: MIT
!> Text helpers: case, numbers as text, likeness of words; the error value; sorting.
program test_text
  use, intrinsic :: ieee_arithmetic, only: ieee_invalid, ieee_quiet_nan, ieee_set_flag, &
                                           ieee_set_halting_mode, ieee_value
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_sort, only: order_of
  use base_text, only: edit_distance, lower, str, upper
  use check, only: begin_tests, end_tests, expect, expect_close, expect_equal
  implicit none (type, external)

  call begin_tests()
  call test_case()
  call test_numbers()
  call test_numbers_read_back()
  call test_distance()
  call test_error()
  call test_order()
  call end_tests()

contains

  !> Columns rise by their rows in turn, and equal ones keep their order, for any number of them.
  subroutine test_order()
    real(rp) :: key(2, 41), step
    integer :: i, n, order(41)
    logical :: rises

    call random_init(.true., .false.)
    rises = .true.
    do n = 0, size(key, 2)
      call random_number(key)
      key = real(int(4.0_rp*key), rp)               ! with many equal ones
      order(:n) = order_of(key(:, :n))
      do i = 2, n
        associate (a => order(i - 1), b => order(i))
          step = 5.0_rp*(key(1, b) - key(1, a)) + key(2, b) - key(2, a)
          rises = rises .and. (step > 0.0_rp .or. abs(step) <= 0.0_rp .and. b > a)
        end associate
      end do
      rises = rises .and. sum(order(:n)) == n*(n + 1)/2
    end do
    call expect('columns in their order', rises)
    order(:4) = order_of(reshape([3.0_rp, -1.0_rp, 2.0_rp, -1.0_rp], [1, 4]))
    call expect('numbers in their order', all(order(:4) == [2, 4, 3, 1]))
  end subroutine test_order

  subroutine test_case()
    call expect_equal('upper', upper('abz XYZ_09 {'), 'ABZ XYZ_09 {')
    call expect_equal('lower', lower('ABZ xyz_09 ['), 'abz xyz_09 [')
    call expect_equal('empty', upper('')//lower(''), '')
  end subroutine test_case

  subroutine test_numbers()
    call expect_equal('integer', str(-17), '-17')
    call expect_equal('long integer', str(9007199254740993_i8), '9007199254740993')
    call expect_equal('zero', str(0.0_rp), '0')
    call expect_equal('whole', str(298.0_rp), '298')
    call expect_equal('fraction', str(0.5_rp), '0.5')
    call expect_equal('negative fraction', str(-0.25_rp), '-0.25')
    call expect_equal('six digits', str(3.14159265_rp), '3.14159')
    call expect_equal('small', str(0.0005_rp), '5e-4')
    call expect_equal('large', str(1.24e11_rp), '1.24e11')
    call expect_equal('negative large', str(-2.5e7_rp), '-2.5e7')
    call expect_equal('trailing zeros of an integer stay', str(1200.0_rp), '1200')
    call expect_equal('ten', str(10.0_rp), '10')
    call expect_equal('hundred thousand', str(100000.0_rp), '100000')
    call expect_equal('round up to a power of ten', str(9.999999_rp), '10')
    call expect_equal('round up below the switch', str(999999.9_rp), '1000000')
    call ieee_set_halting_mode(ieee_invalid, .false.)   ! a debug build traps
    call expect('not a number', index(upper(str(ieee_value(1.0_rp, ieee_quiet_nan))), 'NAN') == 1)
    call ieee_set_flag(ieee_invalid, .false.)
  end subroutine test_numbers

  !> The text of a number is the number to six digits, over the whole range.
  subroutine test_numbers_read_back()
    real(rp) :: u(2), x, y, worst
    character(:), allocatable :: text
    integer :: i

    worst = 0.0_rp
    call random_init(.true., .false.)
    do i = 1, 20000
      call random_number(u)
      x = sign(10.0_rp**(40.0_rp*u(1) - 20.0_rp), u(2) - 0.5_rp)
      text = str(x)
      read (text, *) y
      worst = max(worst, abs(y - x)/abs(x))
    end do
    call expect('six digits everywhere', worst <= 5.1e-6_rp)
  end subroutine test_numbers_read_back

  subroutine test_distance()
    call expect('same word', edit_distance('velocity', 'velocity') == 0)
    call expect('empty words', edit_distance('', '') == 0 .and. edit_distance('abc', '') == 3)
    call expect('kitten, sitting', edit_distance('kitten', 'sitting') == 3)
    call expect('one exchange', edit_distance('DENSITY', 'DENSITI') == 1)
    call expect('symmetric', edit_distance('saturday', 'sunday') == 3 &
                .and. edit_distance('sunday', 'saturday') == 3)
  end subroutine test_distance

  subroutine test_error()
    type(error_t) :: error

    call expect('no error at first', .not. error%is_set())
    call error%raise('first')
    call error%raise('second')
    call expect('an error is set', error%is_set())
    call expect_equal('the first message stays', error%message, 'first')
  end subroutine test_error

end program test_text
