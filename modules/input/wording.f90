! SPDX-License-Identifier: MIT
!> Messages on invalid values, keys and groups of an input, and on what is allowed.
module input_wording
  use base_kinds, only: i8, rp
  use base_text, only: edit_distance, joined, lower, str
  use input_diagnostics, only: has_controls
  use input_key_table, only: key_row_t, key_table_t
  use input_syntax, only: is_within, items_t, letters, split_values, split_words, to_integer, &
                          to_logical, to_real, to_text
  implicit none (type, external)
  private

  public :: can_name_results, check_value, describe_allowed, suggestion, unknown_group, unknown_key

  integer, parameter :: max_name = 32, max_file_name = 128, max_text = 4000
  character(*), parameter :: forbidden_in_names = ',;/\"'''
  !> Limits of numbers by their unit, beyond any real scene.
  character(8), parameter :: measured(14) = [character(8) :: 'm', 'm/s', 'K', 'kg/m3', 's', &
    'm/s2', 'rad/s', 'J/mol', '1/min', 'Pa', 'N', 'W', '1/s', 'W/(m2 K)']
  real(rp), parameter :: least(14) = [1.0e-12_rp, 1.0e-30_rp, 1.0e-6_rp, 1.0e-6_rp, &
                                      spread(1.0e-30_rp, 1, 10)]
  real(rp), parameter :: most(14) = [1.0e4_rp, 1.0e5_rp, 1.0e5_rp, 1.0e6_rp, &
    spread(1.0e9_rp, 1, 4), 1.0e7_rp, spread(1.0e15_rp, 1, 5)]

  character(*), parameter :: forbidden_first = '=+-@'  !! spreadsheets would read a formula

contains

  !> Text `did you mean X?` if a name differs from `word` in at most two letters; otherwise empty.
  pure function suggestion(word, names) result(r)
    character(*), intent(in) :: word, names(:)
    character(:), allocatable :: r
    integer :: best, distance, k

    r = ''
    best = min(3, len_trim(word))
    if (len_trim(word) > max_name) return
    do k = 1, size(names)
      distance = edit_distance(trim(word), trim(names(k)))
      if (distance >= best) cycle
      best = distance
      r = 'did you mean '//trim(names(k))//'?'
    end do
  end function suggestion

  !> Expected value of a key, as `3 real numbers [m]`.
  pure function expected(row) result(r)
    type(key_row_t), intent(in) :: row
    character(:), allocatable :: r, one, many

    select case (row%kind)
    case ('real')
      one = 'a real number'
      many = ' real numbers'
    case ('integer')
      one = 'an integer'
      many = ' integers'
    case ('logical')
      one = '.true. or .false.'
      many = ' of .true. or .false.'
    case default
      one = 'a text in quotes'
      many = ' texts in quotes'
    end select
    r = one
    if (row%n > 1) r = str(row%n)//many
    if (row%n < 0) r = 'up to '//str(-row%n)//many
    if (row%unit /= '') r = r//' ['//trim(row%unit)//']'
  end function expected

  !> Allowed values of a key, as `> 0 and <= 1` or `box, sphere`.
  pure function describe_allowed(row) result(r)
    type(key_row_t), intent(in) :: row
    character(:), allocatable :: r
    character(48), allocatable :: list(:)
    character(:), allocatable :: low, high
    integer :: comma

    r = ''
    select case (row%kind)
    case ('choice')
      call split_words(row%allowed, list)
      r = joined(list, ', ')
    case ('text')
      select case (row%allowed)
      case ('', '&BODY', '&MATERIAL', '&PROBE')   ! NAME of such a group: `about` says so
      case ('name')
        r = 'at most '//str(max_name)//' characters, none of '//forbidden_in_names// &
            ', not beginning with one of '//forbidden_first
      case ('file name')
        r = 'at most '//str(max_file_name)//' letters, digits, - _ and ., not beginning with '// &
            '. or -, not ending in _tools'
      case default
        r = 'only the characters '//trim(row%allowed)
      end select
    case ('real', 'integer')
      if (row%allowed == '') return
      comma = index(row%allowed, ',')
      low = row%allowed(2:comma - 1)
      high = row%allowed(comma + 1:len_trim(row%allowed) - 1)
      if (low /= '-inf') r = trim(merge('>= ', '>  ', row%allowed(1:1) == '['))//' '//low
      if (low /= '-inf' .and. high /= 'inf') r = r//' and '
      if (high /= 'inf') then
        r = r//trim(merge('<= ', '<  ', index(row%allowed, ']') > 0))//' '//high
      end if
    case default   ! no restriction of logical values
    end select
  end function describe_allowed

  !> Error of the value of a key; empty if it is valid.
  pure function check_value(row, first, text) result(r)
    type(key_row_t), intent(in) :: row
    integer, intent(in) :: first         !! written index of the first value; 0 if none
    character(*), intent(in) :: text
    character(:), allocatable :: r
    type(items_t) :: items
    integer :: k
    integer(i8) :: n

    call split_values(text, items)
    r = trim(items%problem)
    if (r /= '') return
    n = sum(int(items%repeat, i8))
    if (first > 0 .and. n + first - 1 > abs(row%n)) then
      r = 'the key has only '//str(abs(row%n))//trim(merge(' value ', ' values', abs(row%n) == 1))
    else if (n > abs(row%n) .or. (first == 0 .and. n < row%n)) then
      r = 'expected '//expected(row)//', found '//str(n)
      if (row%n == 1 .and. row%kind == 'real') r = r//' values (a decimal comma is not possible)'
    end if
    do k = 1, size(items%first)
      if (r == '') r = check_item(row, text(items%first(k):items%last(k)))
    end do
  end function check_value

  !> Error of one item of the value of a key; empty if it is valid.
  pure function check_item(row, item) result(r)
    type(key_row_t), intent(in) :: row
    character(*), intent(in) :: item
    character(:), allocatable :: r, text
    integer :: i
    real(rp) :: x
    logical :: flag, ok

    r = ''
    ok = .true.
    select case (row%kind)
    case ('real')
      call to_real(item, x, ok)
      if (ok) ok = abs(x) <= huge(x)   ! the range is checked for finite numbers only
    case ('integer')
      call to_integer(item, i, ok)
      x = real(i, rp)
    case ('logical')
      call to_logical(item, flag, ok)
    case default
      call to_text(item, text, ok)
      if (ok) r = check_text(row, text)
      if (.not. ok .and. verify(item(1:1), '''"') > 0) then
        r = 'text must be in quotes'
        return
      end if
    end select
    if (.not. ok) then
      r = 'expected '//expected(row)
    else if (row%kind == 'real' .or. row%kind == 'integer') then
      if (.not. is_within(x, row%allowed)) then
        r = 'must be '//describe_allowed(row)
        if (row%unit /= '') r = r//' ['//trim(row%unit)//']'
      else if (row%kind == 'real') then
        r = check_size(row, x)
        if (r == '') r = check_kelvin(row, x)
      end if
    end if
  end function check_item

  !> Error of a text or a choice; empty if it is valid.
  pure function check_text(row, text) result(r)
    type(key_row_t), intent(in) :: row
    character(*), intent(in) :: text
    character(:), allocatable :: r
    character(48), allocatable :: list(:)
    character(:), allocatable :: near

    r = ''
    if (row%kind == 'choice') then
      call split_words(row%allowed, list)
      if (any(list == lower(text))) return
      r = 'must be one of '//describe_allowed(row)
      near = suggestion(lower(text), list)
      if (near /= '') r = r//'; '//near
    else if (text == '' .and. row%is_required .and. row%condition == '') then
      r = 'must not be empty'
    else if (has_controls(text)) then
      r = 'has a character that cannot be printed'
    else if (row%allowed == 'name') then
      if (len(text) > max_name .or. scan(text, forbidden_in_names) > 0 &
          .or. scan(text, forbidden_first) == 1) r = 'must be '//describe_allowed(row)
    else if (row%allowed == 'file name') then
      if (.not. is_file_name(text)) r = 'must be '//describe_allowed(row)
    else if (len(text) > max_text) then
      r = 'has '//str(len(text))//' characters; at most '//str(max_text)//' are possible'
    else if (scan(row%allowed, '&') == 0 .and. row%allowed /= '' &
             .and. verify(text, trim(row%allowed)) > 0) then
      r = describe_allowed(row)//' may be used'
    end if
  end function check_text

  !> True if a text is a valid stem of file names.
  pure logical function is_file_name(text)
    character(*), intent(in) :: text

    is_file_name = len(text) > 0 .and. len(text) <= max_file_name
    if (is_file_name) is_file_name = verify(text, letters//'0123456789._-') == 0 &
        .and. scan(text(1:1), '.-') == 0 .and. .not. is_of_tools(text)
  end function is_file_name

  !> True if a run of this name would write the frames of the tools of another run.
  pure logical function is_of_tools(name)
    character(*), intent(in) :: name

    is_of_tools = index(name//'|', '_tools|') > 0
  end function is_of_tools

  !> True if the stem of an input file is a valid name of results, in files and columns of tables.
  pure logical function can_name_results(stem)
    character(*), intent(in) :: stem

    can_name_results = len(stem) > 0 .and. len(stem) <= max_file_name &
      .and. .not. has_controls(stem) &
                       .and. scan(stem, forbidden_in_names) == 0 .and. index(stem, '.') /= 1 &
                       .and. .not. is_of_tools(stem)
  end function can_name_results

  !> Error of a temperature that would be a common one in degrees Celsius: nothing is stirred below
  !> the boiling point of nitrogen, 77.4 K. Below 1 K it stands for 0 in scenes that are linear in
  !> the temperature.
  pure function check_kelvin(row, x) result(r)
    type(key_row_t), intent(in) :: row
    real(rp), intent(in) :: x
    character(:), allocatable :: r
    real(rp), parameter :: coldest = 77.0_rp, zero = 1.0_rp

    r = ''
    if (row%unit == 'K' .and. index(row%allowed, '(0') == 1 .and. x >= zero .and. x < coldest) then
      r = 'is colder than boiling nitrogen, '//str(coldest)//' K: temperatures are in kelvin, '// &
          str(x)//' C is '//str(x + 273.15_rp)//' K'
    end if
  end function check_kelvin

  !> Error of a number beyond any real scene, for keys without limits; empty if it is valid.
  pure function check_size(row, x) result(r)
    type(key_row_t), intent(in) :: row
    real(rp), intent(in) :: x
    character(:), allocatable :: r
    real(rp) :: lower_limit, upper_limit
    integer :: k

    r = ''
    k = findloc(measured, row%unit, dim=1)
    lower_limit = 1.0e-30_rp
    upper_limit = 1.0e30_rp
    if (k > 0) lower_limit = least(k)
    if (k > 0) upper_limit = most(k)
    if (abs(x) > upper_limit) then
      r = 'is implausible: at most '//str(upper_limit)
    else if (row%allowed(1:2) == '(0' .and. x < lower_limit) then
      r = 'is implausible: at least '//str(lower_limit)
    end if
    if (r /= '' .and. row%unit /= '') r = r//' ['//trim(row%unit)//']'
  end function check_size

  !> Message on an unknown group.
  pure function unknown_group(table, name) result(r)
    type(key_table_t), intent(in) :: table
    character(*), intent(in) :: name
    character(:), allocatable :: r

    r = 'unknown group &'//trim(name)//hint(name, (table%groups%name))
  end function unknown_group

  !> Message on a key that the group does not have.
  pure function unknown_key(table, g, name) result(r)
    type(key_table_t), intent(in) :: table
    integer, intent(in) :: g              !! index of the group
    character(*), intent(in) :: name
    character(:), allocatable :: r

    r = '&'//trim(table%groups(g)%name)//' has no key '//trim(name)// &
      hint(name, (table%keys(table%groups(g)%first:table%groups(g)%last)%name))
  end function unknown_key

  !> Hint at a similar known name, or a list of all.
  pure function hint(name, known) result(r)
    character(*), intent(in) :: name, known(:)
    character(:), allocatable :: r

    r = '; '//suggestion(name, known)
    if (r == '; ') r = '; known are '//joined(known, ' ')
  end function hint

end module input_wording
