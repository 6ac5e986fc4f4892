! SPDX-License-Identifier: MIT
!> The checked input of a run, with look-ups.
module input_values
  use base_errors, only: fatal
  use base_kinds, only: rp
  use base_text, only: lower, str
  use input_assignments, only: scan_t
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_key_table, only: key_table_t
  use input_keys, only: default_item
  use input_syntax, only: split_words, to_integer, to_logical, to_real, to_text
  implicit none (type, external)
  private

  public :: input_t, taken_t

  !> A value taken from a library.
  type :: taken_t
    character(8) :: group = ''         !! that takes it
    integer :: instance = 0            !! index of the group among those of this name
    character(24) :: key = ''
    character(1000) :: source = ''
  end type taken_t

  !> A checked input. Look-ups take a group name, the index of the group among those of this name
  !> (from 1), and a key.
  type :: input_t
    character(:), allocatable :: file                  !! name of the input file
    type(scan_t) :: written                            !! scanned groups (set by input_reading)
    type(key_table_t) :: table
    type(taken_t), allocatable :: taken(:)             !! values from libraries (input_library)
    !> Folder of the files that the input names, if not that of the input.
    character(:), allocatable :: folder
    type(diagnostics_t), pointer :: diagnostics => null()   !! errors and warnings
  contains
    procedure :: count => count_groups, has_required_groups, has_metals, is_short, &
      given => is_given, holds
    procedure :: real => one_real, reals => some_reals, list => all_reals, integers => some_integers
    procedure :: integer => one_integer, logical => one_logical, text => one_text, line => line_of
    procedure :: report, warn, switches_on, text_of_file, item, set_default, values
    procedure, private :: row_number
  end type input_t

contains

  !> Add the diagnostic `&GROUP KEY = value: message`, or `&GROUP message` if the key is empty; none
  !> of a missing key of a group that could not be read or completed.
  subroutine report(self, group, i, key, message, is_warning)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key, message
    integer, intent(in) :: i
    logical, intent(in), optional :: is_warning
    character(:), allocatable :: label
    integer :: a

    label = '&'//trim(group)//' '//trim(key)
    a = self%written%last_of(self%written%find(group, i), key)
    if (a > 0) then
      if (self%written%assignments(a)%is_broken) return   ! reported already
      label = label//' = '//excerpt(self%written%value(a))
    else if (key /= '' .and. self%written%find(group, i) > 0) then
      if (self%written%groups(self%written%find(group, i))%is_broken) return   ! may follow from it
    end if
    if (key /= '') label = label//': '
    call self%diagnostics%add(self%file, self%line(group, i, key), label//message, is_warning)
  end subroutine report

  !> Add a warning; the run continues.
  subroutine warn(self, group, i, key, message)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key, message
    integer, intent(in) :: i

    call self%report(group, i, key, message, is_warning=.true.)
  end subroutine warn

  !> True if an 'off auto on' key switches a method on. 'auto' does so if it is recommended. An
  !> obstacle ('' if none) switches the method off, and is reported with 'on'.
  logical function switches_on(self, group, key, obstacle, is_recommended)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key, obstacle
    logical, intent(in) :: is_recommended
    character(:), allocatable :: choice

    choice = self%text(group, 1, key)
    switches_on = choice == 'on' .or. choice == 'auto' .and. is_recommended
    if (obstacle == '') return
    switches_on = .false.
    if (choice == 'on') call self%report(group, 1, key, 'cannot be on with '//obstacle)
  end function switches_on

  !> Line of the key, otherwise of the group; 0 if neither was written; -k: k-th override.
  pure integer function line_of(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(*), intent(in), optional :: key
    integer :: g, a

    line_of = 0
    g = self%written%find(group, i)
    if (g > 0) line_of = self%written%groups(g)%line
    if (.not. present(key)) return
    a = self%written%last_of(g, key)
    if (a > 0) line_of = self%written%assignments(a)%line
  end function line_of

  !> Number of groups of this name.
  pure integer function count_groups(self, group)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group

    count_groups = self%written%count(group)
  end function count_groups

  !> True if all required groups are present.
  logical function has_required_groups(self)
    class(input_t), intent(in) :: self
    integer :: g

    has_required_groups = .true.
    do g = 1, size(self%table%groups)
      if (self%table%groups(g)%is_required) has_required_groups = has_required_groups &
          .and. self%count(self%table%groups(g)%name) > 0
    end do
  end function has_required_groups

  !> True if all &MATERIAL groups could be read and completed from their libraries: without one,
  !> most errors of a scene would be consequences.
  logical function has_metals(self)
    class(input_t), intent(in) :: self
    integer :: i

    has_metals = .true.
    do i = 1, self%count('MATERIAL')
      has_metals = has_metals .and. &
                   .not. self%written%groups(self%written%find('MATERIAL', i))%is_broken
    end do
  end function has_metals

  !> True if there are few enough groups to build the scene quickly and find further errors.
  pure logical function is_short(self)
    class(input_t), intent(in) :: self

    is_short = size(self%written%groups) <= 500
  end function is_short

  !> True if the key was written in the file or set by an override.
  logical function is_given(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i

    is_given = self%row_number(group, i, key, 'real integer logical text choice') > 0 &
      .and. self%written%last_of(self%written%find(group, i), key) > 0
  end function is_given

  !> True if a condition `KEY = one or other` holds in this group, or is empty.
  logical function holds(self, group, i, condition)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, condition
    integer, intent(in) :: i
    character(48), allocatable :: w(:)

    call split_words(condition, w)
    holds = size(w) == 0
    if (.not. holds) holds = any(w(3:) == self%text(group, i, w(1)))
  end function holds

  !> Row of a key in the table; a look-up of an unknown key or group is a programming error.
  integer function row_number(self, group, i, key, kind)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    character(*), intent(in) :: kind       !! allowed types
    integer :: g

    row_number = 0
    g = self%table%find_group(group)
    if (g > 0) row_number = self%table%find_key(g, key)
    if (row_number == 0) then
      call fatal('look-up of &'//group//' '//key//', which the table of keys does not have')
    end if
    if (index(kind, trim(self%table%keys(row_number)%kind)) == 0) then
      call fatal('look-up of &'//group//' '//key//' with the wrong type')
    end if
    if (i < 1 .or. (i > self%count(group) .and. (i > 1 .or. self%table%groups(g)%repeats))) then
      call fatal('look-up of &'//group//' number '//str(i)//', which the input does not have')
    end if
  end function row_number

  !> The `k`-th value as text: the written value, the default, or empty.
  function item(self, group, i, key, kind, k) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key, kind
    integer, intent(in) :: i, k
    character(:), allocatable :: r
    integer, allocatable :: first(:), last(:)
    integer :: a

    associate (row => self%table%keys(self%row_number(group, i, key, kind)))
      allocate (first(max(k, abs(row%n))), last(max(k, abs(row%n))))
      call self%written%gather(self%written%find(group, i), key, first, last)
      a = self%written%last_of(self%written%find(group, i), key)
      r = ''
      if (first(k) > 0) then
        r = self%written%text(first(k):last(k))
      else if (a > 0) then
        if (self%written%assignments(a)%is_broken) return
      end if
      if (r == '') r = default_item(row, k)
      if (row%kind == 'choice') r = lower(r)
    end associate
  end function item

  !> The first `n` values of a real key in its unit; 0 without a value and default.
  function some_reals(self, group, i, key, n) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i, n
    real(rp) :: r(n)
    real(rp), allocatable :: all(:)

    allocate (all, source=self%list(group, i, key))
    r = 0.0_rp
    r(:min(n, size(all))) = all(:min(n, size(all)))
  end function some_reals

  !> All values of a real key up to the first that is not written and has no default.
  function all_reals(self, group, i, key) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    real(rp), allocatable :: r(:)
    integer, allocatable :: first(:), last(:)
    character(:), allocatable :: text
    logical :: ok
    integer :: a, k, n

    associate (row => self%table%keys(self%row_number(group, i, key, 'real')))
      n = abs(row%n)
      allocate (first(n), last(n), r(n))
      call self%written%gather(self%written%find(group, i), key, first, last)
      a = self%written%last_of(self%written%find(group, i), key)
      if (a > 0) then
        if (self%written%assignments(a)%is_broken) a = -1
      end if
      do k = 1, n
        if (first(k) > 0) then
          text = self%written%text(first(k):last(k))
        else if (a >= 0) then
          text = default_item(row, k)
        else
          text = ''
        end if
        if (text == '') exit
        call to_real(text, r(k), ok)
      end do
    end associate
    r = r(:k - 1)
  end function all_reals

  !> Value of a real key in its unit; `otherwise` if it is not given.
  real(rp) function one_real(self, group, i, key, otherwise)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    real(rp), intent(in), optional :: otherwise
    logical :: ok

    if (present(otherwise)) then
      one_real = otherwise
      if (.not. self%given(group, i, key)) return
    end if
    call to_real(self%item(group, i, key, 'real', 1), one_real, ok)
  end function one_real

  !> Value of an integer key.
  integer function one_integer(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    logical :: ok

    call to_integer(self%item(group, i, key, 'integer', 1), one_integer, ok)
  end function one_integer

  !> The first `n` values of an integer key; 0 without a value and default.
  function some_integers(self, group, i, key, n) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i, n
    integer :: r(n), k
    character(:), allocatable :: text
    logical :: ok

    r = 0
    do k = 1, n
      text = self%item(group, i, key, 'integer', k)
      if (text /= '') call to_integer(text, r(k), ok)
    end do
  end function some_integers

  !> Value of a logical key.
  logical function one_logical(self, group, i, key)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    logical :: ok

    call to_logical(self%item(group, i, key, 'logical', 1), one_logical, ok)
  end function one_logical

  !> Value of a text key, or a choice in lower case, without trailing blanks.
  function one_text(self, group, i, key) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    character(:), allocatable :: r
    logical :: ok

    call to_text(self%item(group, i, key, 'text or choice', 1), r, ok)
  end function one_text

  !> The input with overrides as namelist text, for outputs and checkpoints.
  function text_of_file(self) result(r)
    class(input_t), intent(in) :: self
    character(:), allocatable :: r

    r = self%written%text_of_groups(self%table)
  end function text_of_file

  !> Set the default of a key.
  subroutine set_default(self, group, key, value)
    class(input_t), intent(inout) :: self
    character(*), intent(in) :: group, key, value

    self%table%keys(self%row_number(group, 1, key, &
                                    'real integer logical text choice'))%default = value
  end subroutine set_default

  !> All values of a key as text with commas: written values or defaults.
  function values(self, group, i, key) result(r)
    class(input_t), intent(in) :: self
    character(*), intent(in) :: group, key
    integer, intent(in) :: i
    character(:), allocatable :: r, one
    integer, allocatable :: first(:), last(:)
    integer :: k

    r = ''
    associate (row => self%table%keys(self%row_number(group, i, key, &
                                                      'real integer logical text choice')))
      allocate (first(abs(row%n)), last(abs(row%n)))
      call self%written%gather(self%written%find(group, i), key, first, last)
      do k = 1, size(first)
        one = default_item(row, k)
        if (first(k) > 0) one = self%written%text(first(k):last(k))
        if (one == '' .or. one == "''") exit
        if (k > 1) r = r//', '
        r = r//one
      end do
    end associate
  end function values

end module input_values
