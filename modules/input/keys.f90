! SPDX-License-Identifier: MIT
!> Printing of the table of all groups and keys of the input file.
module input_keys
  use input_key_table, only: group_row_t, key_row_t, key_table_t
  use input_syntax, only: quoted, split_words
  use input_wording, only: describe_allowed
  implicit none (type, external)
  private

  public :: default_item, print_keys, print_keys_markdown

contains

  !> The `k`-th default value as written in an input; empty if there is none.
  pure function default_item(row, k) result(r)
    type(key_row_t), intent(in) :: row
    integer, intent(in) :: k
    character(:), allocatable :: r
    character(48), allocatable :: list(:)

    r = ''
    if (row%kind == 'text' .or. row%kind == 'choice') then
      r = quoted(trim(row%default))
    else
      call split_words(row%default, list)
      if (k <= size(list)) r = trim(list(k))
    end if
  end function default_item

  !> Print the table, or the part of one group, as text for `stirpoint --keys`.
  subroutine print_keys(t, unit, only)
    type(key_table_t), intent(in) :: t
    integer, intent(in) :: unit
    integer, intent(in) :: only           !! index of the group; 0: all
    character(:), allocatable :: about
    integer :: g, k

    do g = max(1, only), merge(only, size(t%groups), only > 0)
      write (unit, '(6a)') '&', trim(t%groups(g)%name), ' (', occurrence(t%groups(g)), ')  ', &
        trim(t%groups(g)%about)
      do k = t%groups(g)%first, t%groups(g)%last
        about = trim(t%keys(k)%about)
        if (t%keys(k)%condition /= '') about = about//'; '//trim(merge('required', 'only    ', &
          t%keys(k)%is_required))//' if '//trim(t%keys(k)%condition)
        about = trim(about)
        if (t%keys(k)%allowed /= '') about = about//' ('//describe_allowed(t%keys(k))//')'
        write (unit, '(2x,4a)') padded(trim(t%keys(k)%name), 19), &
          padded(trim(kind_of(t%keys(k), with_unit=.true.)), 19), &
          padded(default_of(t%keys(k), with_condition=.false.), 8), about
      end do
      write (unit, '()')
    end do
    if (only == 0) write (unit, '(a)') 'A restart may change '//changeable(t)//'.'
  end subroutine print_keys

  !> Text on the keys that a restart may change.
  function changeable(t) result(text)
    type(key_table_t), intent(in) :: t
    character(:), allocatable :: text
    integer :: g, k

    text = ''
    do g = 1, size(t%groups)
      associate (keys => t%keys(t%groups(g)%first:t%groups(g)%last))
        if (.not. any(keys%may_change)) cycle
        text = text//'&'//trim(t%groups(g)%name)
        if (.not. all(keys%may_change)) then
          do k = 1, size(keys)
            if (keys(k)%may_change) text = text//' '//trim(keys(k)%name)
          end do
        end if
        text = text//'; '
      end associate
    end do
    text = text//'&MOTION from the time of the checkpoint on; &SOURCE END if it is later than that'
  end function changeable

  !> Print the reference page docs/input.md, for `stirpoint --keys=markdown`.
  subroutine print_keys_markdown(t, unit)
    type(key_table_t), intent(in) :: t
    integer, intent(in) :: unit
    integer :: g, k

    call print_introduction(unit)
    write (unit, '(a)') &
      '- A restart may change these keys, all else is refused ([restart.md](restart.md)):', &
      '  '//changeable(t)//'.'
    do g = 1, size(t%groups)
      write (unit, '(/,2a,/)') '## &', trim(t%groups(g)%name)
      write (unit, '(4a,/)') trim(t%groups(g)%about), ' (', occurrence(t%groups(g)), ')'
      write (unit, '(a)') '| key | type | unit | default | allowed | meaning |'
      write (unit, '(a)') '|---|---|---|---|---|---|'
      do k = t%groups(g)%first, t%groups(g)%last
        write (unit, '(13a)') '| `', trim(t%keys(k)%name), '` | ', &
          trim(kind_of(t%keys(k), with_unit=.false.)), ' | ', trim(t%keys(k)%unit), ' | ', &
          default_of(t%keys(k), with_condition=.true.), ' | ', describe_allowed(t%keys(k)), ' | ', &
          trim(t%keys(k)%about), ' |'
      end do
    end do
  end subroutine print_keys_markdown

  !> Print the introduction to the format of input files.
  subroutine print_introduction(unit)
    integer, intent(in) :: unit
    character(*), parameter :: fence = repeat('`', 3)

    write (unit, '(a)') '# Input reference', '', &
      'Printed by `stirpoint --keys=markdown`; its source are the files modules/setup/keys*.f90.', &
      '', &
      'An input file is a list of Fortran namelist groups. Units are SI; a name says where not.', &
      '', fence, '! a comment', "&BODY NAME = 'plate', MATERIAL = 'copper',", &
      '      VELOCITY = 0.1, 0, 0 /', fence, '', &
      '- Values are divided by commas or blanks and may go over several lines;', &
      '  `3*0.0` is `0.0 0.0 0.0`; `KEY(2) = 1.5` gives the second value alone.', &
      '- Text stands in `''` or `"`; a doubled quote within is one quote.', &
      '- Groups, keys and choices may be in capitals or small letters; names are literal.', &
      '- Logical values are `.true.`, `true`, `T` or `.false.`, `false`, `F`.', &
      '- A value is replaced for one run by `--set GROUP.KEY=VALUE` (all groups of this name),', &
      '  `--set "GROUP(2).KEY=VALUE"` (the second) or `--set "GROUP(name).KEY=VALUE"` (the one', &
      '  with this `NAME`). Text needs no quotes there.', &
      '- Everything that is wrong is reported at once, with line numbers, before the run begins.'
  end subroutine print_introduction

  !> Text on the number of groups: `once`, `once, required`, `any number` or `at least one`.
  pure function occurrence(row) result(r)
    type(group_row_t), intent(in) :: row
    character(:), allocatable :: r

    if (row%repeats) then
      r = trim(merge('at least one', 'any number  ', row%is_required))
    else
      r = trim(merge('once, required', 'once          ', row%is_required))
    end if
  end function occurrence

  !> Type of a key, as `3 real [m/s]`.
  pure function kind_of(row, with_unit) result(r)
    type(key_row_t), intent(in) :: row
    logical, intent(in) :: with_unit
    character(32) :: r

    r = row%kind
    if (row%n > 1) write (r, '(i0,1x,a)') row%n, trim(row%kind)
    if (row%n < 0) write (r, '(a,i0,1x,a)') 'up to ', -row%n, trim(row%kind)
    if (with_unit .and. row%unit /= '') r = trim(r)//' ['//trim(row%unit)//']'
  end function kind_of

  !> Text padded to `width`, followed by at least two blanks.
  pure function padded(text, width) result(r)
    character(*), intent(in) :: text
    integer, intent(in) :: width
    character(:), allocatable :: r

    r = text//repeat(' ', max(2, width + 2 - len(text)))
  end function padded

  !> Default of a key, `required` or `-`; with the condition on which the key applies.
  pure function default_of(row, with_condition) result(r)
    type(key_row_t), intent(in) :: row
    logical, intent(in) :: with_condition
    character(:), allocatable :: r

    r = trim(row%default)
    if (row%is_required) r = 'required'
    if (row%is_required .and. row%condition /= '' .and. .not. with_condition) r = '-'   ! in `about`
    if (r == '') r = '-'
    if (with_condition .and. row%condition /= '') r = r//' if '//trim(row%condition)
  end function default_of

end module input_keys
