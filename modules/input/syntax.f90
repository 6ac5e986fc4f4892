! SPDX-License-Identifier: MIT
!> Parsing of names and values of an input: words, numbers, quoted texts, lists, overrides.
module input_syntax
  use base_kinds, only: rp
  use base_text, only: lower, upper
  implicit none (type, external)
  private

  public :: items_t
  public :: is_name, is_within, quoted, split_override, split_values, split_words, take_key
  public :: to_integer, to_logical, to_real, to_text

  integer, parameter, public :: name_len = 32
  character(*), parameter, public :: letters = &
    'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'

  !> The items of one value text: item k is text(first(k):last(k)), written repeat(k) times.
  type :: items_t
    integer, allocatable :: first(:), last(:), repeat(:)
    character(48) :: problem = ''
  end type items_t

contains

  !> Split a text into words at blanks.
  pure subroutine split_words(text, r)
    character(*), intent(in) :: text
    character(48), allocatable, intent(out) :: r(:)
    integer :: first, last

    allocate (r(0))
    first = 1
    do while (first <= len_trim(text))
      last = index(text(first:)//' ', ' ') + first - 2
      if (last >= first) r = [character(48) :: r, text(first:last)]
      first = last + 2
    end do
  end subroutine split_words

  !> True if `x` lies in an interval such as `(0,0.5]`.
  pure logical function is_within(x, interval)
    real(rp), intent(in) :: x
    character(*), intent(in) :: interval
    real(rp) :: bound
    integer :: comma, last
    logical :: ok

    is_within = .true.
    comma = index(interval, ',')
    if (comma == 0) return
    last = len_trim(interval)
    call to_real(interval(2:comma - 1), bound, ok)
    if (ok) is_within = x > bound .or. (interval(1:1) == '[' .and. x >= bound)
    call to_real(interval(comma + 1:last - 1), bound, ok)
    if (ok .and. is_within) is_within = x < bound .or. (interval(last:last) == ']' .and. x <= bound)
  end function is_within

  !> Real number as namelists accept it (1, 1., .5, 1.d5, -1e-3), below 1e307; nothing else.
  pure subroutine to_real(item, x, ok)
    character(*), intent(in) :: item
    real(rp), intent(out) :: x
    logical, intent(out) :: ok
    character(len(item)) :: buffer
    integer :: exponent, i, n_after, n_before, status

    x = 0.0_rp
    ok = .false.
    buffer = item
    i = 1
    call skip_sign(item, i)
    call skip_digits(item, i, n_before)
    n_after = 0
    if (i <= len(item)) then
      if (item(i:i) == '.') then
        i = i + 1
        call skip_digits(item, i, n_after)
      end if
    end if
    if (n_before + n_after == 0) return
    exponent = 0
    if (i <= len(item)) then
      if (scan(item(i:i), 'eEdDqQ') == 0) return
      buffer(i:i) = 'e'
      call to_integer(item(i + 1:), exponent, ok)
      if (.not. ok) return
      exponent = max(-10000, min(exponent, 10000))
    end if
    ok = exponent <= 308 .and. exponent + n_before <= 308   ! larger numbers would trap as overflow
    if (.not. ok .or. exponent - n_after < -307 - 17) return
    read (buffer, *, iostat=status) x
    ok = status == 0
  end subroutine to_real

  !> Integer number with an optional sign.
  pure subroutine to_integer(item, i, ok)
    character(*), intent(in) :: item
    integer, intent(out) :: i
    logical, intent(out) :: ok
    integer :: last, n, status

    i = 0
    last = 1
    call skip_sign(item, last)
    call skip_digits(item, last, n)
    ok = n > 0 .and. last > len(item)
    if (.not. ok) return
    read (item, *, iostat=status) i
    ok = status == 0
  end subroutine to_integer

  pure subroutine skip_sign(item, i)
    character(*), intent(in) :: item
    integer, intent(inout) :: i

    if (i > len(item)) return
    if (item(i:i) == '+' .or. item(i:i) == '-') i = i + 1
  end subroutine skip_sign

  pure subroutine skip_digits(item, i, n)
    character(*), intent(in) :: item
    integer, intent(inout) :: i
    integer, intent(out) :: n      !! number of digits

    n = verify(item(i:)//'.', '0123456789') - 1
    i = i + n
  end subroutine skip_digits

  !> `.true.`, `true`, `.t.`, `t` and their opposites, in any case.
  pure subroutine to_logical(item, flag, ok)
    character(*), intent(in) :: item
    logical, intent(out) :: flag, ok
    character(8), parameter :: yes(4) = [character(8) :: '.true.', 'true', '.t.', 't']
    character(8), parameter :: no(4) = [character(8) :: '.false.', 'false', '.f.', 'f']

    flag = any(yes == lower(item))
    ok = flag .or. any(no == lower(item))
  end subroutine to_logical

  !> Text within quotes; a doubled quote stands for one.
  pure subroutine to_text(item, text, ok)
    character(*), intent(in) :: item
    character(:), allocatable, intent(out) :: text
    logical, intent(out) :: ok
    character :: quote
    integer :: i, n

    text = ''
    ok = len(item) >= 2
    if (.not. ok) return
    quote = item(1:1)
    ok = (quote == "'" .or. quote == '"') .and. item(len(item):) == quote
    text = item
    n = 0
    i = 2
    do while (ok .and. i < len(item))
      n = n + 1
      text(n:n) = item(i:i)
      if (item(i:i) == quote) then
        i = i + 1
        ok = i < len(item) .and. item(i:i) == quote
      end if
      i = i + 1
    end do
    text = trim(text(:n))
  end subroutine to_text

  !> Split a value text at commas and blanks, with repeat counts (`3*0.0`).
  pure subroutine split_values(text, items)
    character(*), intent(in) :: text
    type(items_t), intent(out) :: items
    integer :: i, first, n, times, star
    logical :: after_comma
    character :: quote

    allocate (items%first(len(text)/2 + 1), items%last(len(text)/2 + 1), &
              items%repeat(len(text)/2 + 1))
    n = 0
    after_comma = .true.
    i = 1
    do while (i <= len(text))
      if (text(i:i) == ' ' .or. text(i:i) == ',') then
        if (text(i:i) == ',' .and. after_comma) items%problem = 'there is nothing before a comma'
        if (text(i:i) == ',') after_comma = .true.
        i = i + 1
        cycle
      end if
      first = i
      quote = ' '
      do while (i <= len(text))
        if (quote == ' ' .and. (text(i:i) == ' ' .or. text(i:i) == ',')) exit
        if (quote == ' ') then
          if (text(i:i) == "'" .or. text(i:i) == '"') quote = text(i:i)
        else if (text(i:i) == quote) then
          quote = ' '
        end if
        i = i + 1
      end do
      times = 1
      star = verify(text(first:i - 1), '0123456789')
      if (star > 1) then
        if (text(first + star - 1:first + star - 1) == '*') then
          times = whole_number(text(first:first + star - 2))
          first = first + star
          if (times < 1 .or. first > i - 1) items%problem = 'not a repeat count and a value'
        end if
      end if
      n = n + 1
      items%first(n) = first
      items%last(n) = i - 1
      items%repeat(n) = times
      after_comma = .false.
    end do
    items%first = items%first(:n)
    items%last = items%last(:n)
    items%repeat = items%repeat(:n)
  end subroutine split_values

  !> Value of up to six digits with blanks around; -1 for anything else and for 0.
  pure integer function whole_number(text)
    character(*), intent(in) :: text
    character(:), allocatable :: digits

    whole_number = -1
    digits = trim(adjustl(text))
    if (len(digits) < 1 .or. len(digits) > 6 .or. verify(digits, '0123456789') > 0) return
    read (digits, *) whole_number
    if (whole_number == 0) whole_number = -1
  end function whole_number

  !> The key `NAME` or `NAME(index)` at the end of `text(first:)`.
  pure subroutine take_key(text, first, key_first, key_last, number)
    character(*), intent(in) :: text
    integer, intent(in) :: first
    integer, intent(out) :: key_first, key_last   !! the name; empty if there is none
    integer, intent(out) :: number                !! 0: no index, -1: not a whole number above 0
    integer :: opened, last

    number = 0
    last = max(first - 1, len_trim(text))
    if (last >= first) then
      opened = index(text(first:last), '(', back=.true.) + first - 1
      if (text(last:last) == ')' .and. opened >= first) then
        number = whole_number(text(opened + 1:last - 1))
        last = max(first - 1, len_trim(text(:opened - 1)))
      end if
    end if
    key_last = last
    key_first = last + 1
    do while (key_first > first)
      if (.not. is_name(text(key_first - 1:key_first - 1))) exit
      key_first = key_first - 1
    end do
  end subroutine take_key

  !> Take `GROUP.KEY=VALUE` apart; GROUP may be GROUP(which), KEY may be KEY(number).
  pure subroutine split_override(text, group, which, key, number, value, ok)
    character(*), intent(in) :: text
    character(:), allocatable, intent(out) :: group, which
    character(name_len), intent(out) :: key
    integer, intent(out) :: number
    character(:), allocatable, intent(out) :: value
    logical, intent(out) :: ok
    integer :: dot, equals, key_first, key_last, opened

    opened = index(text, '(')
    dot = index(text, '.')
    if (opened == 0 .or. opened > dot) opened = dot
    if (opened < dot) dot = index(text, ').') + 1
    equals = dot + index(text(dot + 1:), '=')
    call take_key(text(:equals - 1), dot + 1, key_first, key_last, number)
    group = upper(text(:opened - 1))
    which = text(opened + 1:dot - 2)
    key = upper(text(key_first:key_last))
    value = trim(adjustl(text(equals + 1:)))
    ok = dot > 1 .and. equals > dot .and. is_name(group) .and. number >= 0 .and. value /= '' &
      .and. key_first == dot + 1 .and. key_last >= key_first
  end subroutine split_override

  !> True if all characters may stand in a name.
  pure logical function is_name(text)
    character(*), intent(in) :: text

    is_name = len(text) > 0 .and. verify(text, letters//'0123456789_') == 0
  end function is_name

  !> `text` in quotes.
  pure function quoted(text) result(r)
    character(*), intent(in) :: text
    character(:), allocatable :: r
    integer :: i, n

    allocate (character(2*len(text) + 2) :: r)
    n = 1
    r(1:1) = "'"
    do i = 1, len(text)
      n = n + 1
      r(n:n) = text(i:i)
      if (text(i:i) /= "'") cycle
      n = n + 1
      r(n:n) = "'"
    end do
    r = r(:n)//"'"
  end function quoted

end module input_syntax
