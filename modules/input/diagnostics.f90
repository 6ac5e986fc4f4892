! SPDX-License-Identifier: MIT
!> Errors and warnings of an input, collected to be reported together.
module input_diagnostics
  use, intrinsic :: iso_fortran_env, only: error_unit
  use base_log, only: log_line
  use base_text, only: str
  implicit none (type, external)
  private

  public :: diagnostics_t
  public :: excerpt, has_controls

  !> Maximum number of stored diagnostics; further errors are only counted.
  integer, parameter :: max_diagnostics = 500

  !> An error or a warning.
  type :: diagnostic_t
    character(:), allocatable :: file      !! file name, or the override as the user wrote it
    integer :: line = 0                    !! line in the file; 0: none
    character(:), allocatable :: message
    logical :: is_warning = .false.
  end type diagnostic_t

  !> List of diagnostics in the order of the lines, followed by those without a line. Errors and
  !> warnings are counted and printed separately.
  type :: diagnostics_t
    private
    type(diagnostic_t), allocatable :: list(:)
    integer :: n_more = 0                      !! number of errors not in the list
    character(:), allocatable :: overrides(:)  !! overrides; line -k refers to the k-th
  contains
    procedure :: store_overrides, add, add_first, count => count_diagnostics
    procedure :: text => text_of_diagnostic, print => print_diagnostics
  end type diagnostics_t

contains

  !> Store the `--set` overrides, to which a line -k of `add` refers.
  subroutine store_overrides(self, overrides)
    class(diagnostics_t), intent(inout) :: self
    character(*), intent(in) :: overrides(:)

    if (allocated(self%overrides)) deallocate (self%overrides)
    allocate (self%overrides, source=overrides)
  end subroutine store_overrides

  !> Add a diagnostic, unless the same message is listed for this line.
  subroutine add(self, file, line, message, is_warning)
    class(diagnostics_t), intent(inout) :: self
    character(*), intent(in) :: file
    integer, intent(in) :: line  !! line of the file; 0: none; -k: line of the k-th override
    character(*), intent(in) :: message
    logical, intent(in), optional :: is_warning   !! a warning, with which the run continues
    type(diagnostic_t) :: new
    type(diagnostic_t), allocatable :: longer(:)
    integer :: k

    new%file = trim(file)
    new%line = max(line, 0)
    new%message = trim(message)
    if (present(is_warning)) new%is_warning = is_warning
    if (line < 0 .and. allocated(self%overrides)) new%file = '--set '// &
        shortened(trim(self%overrides(-line)), 200)
    if (.not. allocated(self%list)) allocate (self%list(0))
    do k = 1, size(self%list)
      if (self%list(k)%line == new%line .and. self%list(k)%file == new%file &
          .and. self%list(k)%message == new%message) return
    end do
    if (size(self%list) == max_diagnostics) then
      if (.not. new%is_warning) self%n_more = self%n_more + 1
      return
    end if
    k = count(rank_of(self%list) <= rank_of(new))
    allocate (longer(size(self%list) + 1))
    longer(:k) = self%list(:k)
    longer(k + 1) = new
    longer(k + 2:) = self%list(k + 1:)
    call move_alloc(longer, self%list)
  end subroutine add

  !> Report the first point of a table where `is` holds, and the number of others.
  subroutine add_first(self, file, lines, is, message)
    class(diagnostics_t), intent(inout) :: self
    character(*), intent(in) :: file, message
    integer, intent(in) :: lines(:)       !! line number of each point
    logical, intent(in) :: is(:)
    character(:), allocatable :: more

    more = ''
    if (count(is) > 1) more = ', as in '//str(count(is) - 1)//' more rows'
    if (any(is)) call self%add(file, lines(findloc(is, .true., dim=1)), message//more)
  end subroutine add_first

  !> Sort key of a diagnostic.
  elemental integer function rank_of(diagnostic)
    type(diagnostic_t), intent(in) :: diagnostic

    rank_of = merge(diagnostic%line, huge(1), diagnostic%line > 0)
  end function rank_of

  !> Number of errors so far.
  pure integer function count_diagnostics(self)
    class(diagnostics_t), intent(in) :: self

    count_diagnostics = 0
    if (allocated(self%list)) count_diagnostics = count(.not. self%list%is_warning) + self%n_more
  end function count_diagnostics

  !> The `k`-th diagnostic in the order of the lines: `file:line: error: message`, or `warning:`.
  pure function text_of_diagnostic(self, k) result(r)
    class(diagnostics_t), intent(in) :: self
    integer, intent(in) :: k
    character(:), allocatable :: r

    r = trim(self%list(k)%file)
    if (self%list(k)%line > 0) r = r//':'//str(self%list(k)%line)
    r = r//trim(merge(': warning:', ': error:  ', self%list(k)%is_warning))//' '// &
      trim(self%list(k)%message)
  end function text_of_diagnostic

  !> Print all errors, one per line, to `unit` or standard error, or all warnings to standard
  !> output.
  subroutine print_diagnostics(self, unit, warnings)
    class(diagnostics_t), intent(in) :: self
    integer, intent(in), optional :: unit
    logical, intent(in), optional :: warnings
    logical :: prints_warnings
    integer :: k, output_unit

    output_unit = error_unit
    if (present(unit)) output_unit = unit
    prints_warnings = .false.
    if (present(warnings)) prints_warnings = warnings
    if (.not. allocated(self%list)) return
    do k = 1, size(self%list)
      if (self%list(k)%is_warning .neqv. prints_warnings) cycle
      if (prints_warnings) then
        call log_line(self%text(k))
      else
        write (output_unit, '(a)') self%text(k)
      end if
    end do
    if (self%n_more > 0 .and. .not. prints_warnings) write (output_unit, '(a)') &
      self%list(1)%file//': error: and '//str(self%n_more)//' more'
  end subroutine print_diagnostics

  !> Excerpt of a text for a message.
  pure function excerpt(text) result(r)
    character(*), intent(in) :: text
    character(:), allocatable :: r

    r = trim(text)
    if (len(r) > 0) then
      if (r(len(r):) == achar(13)) r = trim(r(:len(r) - 1))
    end if
    r = shortened(r, 60)
  end function excerpt

  !> Text truncated to `max_length` characters, with ? for control characters.
  pure function shortened(text, max_length) result(r)
    character(*), intent(in) :: text
    integer, intent(in) :: max_length
    character(:), allocatable :: r
    integer :: i

    r = text
    if (len(text) > max_length) r = text(:max_length - 3)//'...'
    do i = 1, len(r)
      if (has_controls(r(i:i))) r(i:i) = '?'
    end do
  end function shortened

  !> True if a text has control characters.
  pure logical function has_controls(text)
    character(*), intent(in) :: text
    integer :: i

    has_controls = .false.
    do i = 1, len(text)
      has_controls = has_controls .or. iachar(text(i:i)) < 32 .or. iachar(text(i:i)) == 127
    end do
  end function has_controls

end module input_diagnostics
