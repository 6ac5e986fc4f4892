! SPDX-License-Identifier: MIT
!> Reader of STL files, text or binary, with checks: syntax, finite numbers, closed surface, facets
!> without intersections.
module tools_mesh_stl_file
  use, intrinsic :: iso_fortran_env, only: int32, real32
  use base_kinds, only: rp
  use base_text, only: lower, str
  use input_diagnostics, only: diagnostics_t, excerpt
  use input_syntax, only: split_words, to_real
  use tools_mesh_crossings, only: find_crossings
  use tools_mesh_facets, only: cross, facets_t, defect_t, is_open, is_flipped, join_corners, &
                               list_defects, match_edges
  implicit none (type, external)
  private

  public :: read_stl

  integer, parameter :: head = 80, record = 50    !! bytes of header and facet in a binary file
  integer, parameter :: max_reports = 20

  !> Content of an STL file.
  type :: stl_t
    character(:), allocatable :: path
    logical :: is_binary = .false.
    integer :: n = 0
    real(rp), allocatable :: y(:, :)        !! (3, 3 facets) corners, in the unit of the file
    integer, allocatable :: line(:)         !! line of each facet; in a binary file its number
    integer :: n_reports = 0
  contains
    procedure :: add, report
  end type stl_t

contains

  !> Read the facets of a file in its own unit, with merged corners and matched edges; valid if no
  !> errors are reported.
  subroutine read_stl(path, facets, opened, diagnostics)
    character(*), intent(in) :: path
    type(facets_t), intent(out) :: facets
    logical, intent(out) :: opened          !! the file can be read
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: bytes
    type(stl_t) :: stl

    stl%path = path
    call read_bytes(path, bytes, opened)
    if (.not. opened) return
    allocate (stl%y(3, 3072), stl%line(1024))
    if (is_binary(bytes)) then
      call read_records(bytes, stl, diagnostics)
    else if (lower(bytes(:min(5, len(bytes)))) == 'solid') then
      call read_lines(bytes, stl, diagnostics)
    else
      call diagnostics%add(path, 0, "is no STL file: it neither begins with 'solid' nor has "// &
                           'the 84 + 50 n bytes of n binary facets')
      return
    end if
    if (stl%n_reports == 0) call check(stl, facets, diagnostics)
    if (stl%n_reports > max_reports) call diagnostics%add(path, 0, 'and '// &
      str(stl%n_reports - max_reports)//' more')
  end subroutine read_stl

  !> Read all bytes of a file.
  subroutine read_bytes(path, bytes, opened)
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: bytes
    logical, intent(out) :: opened
    integer :: n, status, unit

    opened = .false.
    open (newunit=unit, file=path, access='stream', form='unformatted', action='read', &
          status='old', iostat=status)
    if (status /= 0) return
    inquire (unit=unit, size=n)
    if (n >= 0) then
      allocate (character(n) :: bytes)
      if (n > 0) read (unit, iostat=status) bytes
      opened = status == 0
    end if
    close (unit)
  end subroutine read_bytes

  !> True if the length of the file matches the number of facets after the header.
  pure logical function is_binary(bytes)
    character(*), intent(in) :: bytes

    is_binary = .false.
    if (len(bytes) < head + 4) return
    if (integer_at(bytes, head + 1) < 0) return
    is_binary = modulo(len(bytes) - head - 4, record) == 0 &
                .and. (len(bytes) - head - 4)/record == integer_at(bytes, head + 1)
  end function is_binary

  !> Little-endian integer of four bytes.
  pure integer(int32) function integer_at(bytes, i)
    character(*), intent(in) :: bytes
    integer, intent(in) :: i
    integer :: k

    integer_at = 0_int32
    do k = 3, 0, -1
      integer_at = ior(ishft(integer_at, 8), int(ichar(bytes(i + k:i + k)), int32))
    end do
  end function integer_at

  !> Read the facets of a binary file.
  subroutine read_records(bytes, stl, diagnostics)
    character(*), intent(in) :: bytes
    type(stl_t), intent(inout) :: stl
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: x(3, 4)
    integer :: a, i, k

    stl%is_binary = .true.
    do i = 1, integer_at(bytes, head + 1)
      do k = 1, 4                                ! the normal, then the corners
        do a = 1, 3
          x(a, k) = real(transfer(integer_at(bytes, head + 5 + record*(i - 1) &
                                             + 12*(k - 1) + 4*(a - 1)), 1.0_real32), rp)
        end do
      end do
      call stl%add(x(:, 2:), i)
      if (.not. all(abs(x(:, 2:)) <= huge(1.0_real32))) then
        call stl%report(i, 'has a corner that is no finite number', diagnostics)
      end if
    end do
  end subroutine read_records

  !> Read the facets of a text file.
  subroutine read_lines(bytes, stl, diagnostics)
    character(*), intent(in) :: bytes
    type(stl_t), intent(inout) :: stl
    type(diagnostics_t), intent(inout) :: diagnostics
    character(48), allocatable :: word(:)
    character(:), allocatable :: expected, row
    real(rp) :: x(3, 3)
    integer :: corners, facet, first, last, number
    logical :: ok

    first = 1
    number = 0
    facet = 0
    corners = 0
    expected = 'solid'
    do while (first <= len(bytes) .and. stl%n_reports <= max_reports)
      last = index(bytes(first:), new_line('a')) + first - 2
      if (last < first - 1) last = len(bytes)
      row = lower(cleaned(bytes(first:last)))
      first = last + 2
      number = number + 1
      if (row == '') cycle
      call split_words(row, word)
      ok = is_expected(word, expected)
      if (ok .and. word(1) == 'vertex') then
        corners = corners + 1
        call read_vertex(word, x(:, corners), ok)
      end if
      if (.not. ok) then
        call stl%report(number, what_is_missing(expected)//", and not '"// &
                        excerpt(trim(row))//"'", diagnostics)
        exit                                     ! the state is unknown from here on
      end if
      select case (word(1))
      case ('facet')
        facet = number
        corners = 0
      case ('endfacet')
        call stl%add(x, facet)
      case default
        continue
      end select
      expected = next_words(trim(word(1)), corners)
    end do
    if (stl%n_reports == 0 .and. index(expected, 'solid ') /= 1) then
      call stl%report(number, 'the file ends where '//what_is_missing(expected), diagnostics)
    end if
  end subroutine read_lines

  !> Words that may begin the line after a line that begins with `word`.
  pure function next_words(word, corners) result(expected)
    character(*), intent(in) :: word
    integer, intent(in) :: corners
    character(:), allocatable :: expected

    select case (word)
    case ('solid', 'endfacet')
      expected = 'facet endsolid'
    case ('facet')
      expected = 'outer'
    case ('outer')
      expected = 'vertex'
    case ('vertex')
      expected = 'vertex'
      if (corners == 3) expected = 'endloop'
    case ('endloop')
      expected = 'endfacet'
    case default
      expected = 'solid (or the end)'
    end select
  end function next_words

  !> Message on an expected line.
  pure function what_is_missing(expected) result(text)
    character(*), intent(in) :: expected
    character(:), allocatable :: text

    select case (expected)
    case ('facet endsolid')
      text = "'facet normal' or 'endsolid' must stand here"
    case ('outer')
      text = "'outer loop' must stand here"
    case ('vertex')
      text = "'vertex' and three numbers must stand here"
    case ('solid (or the end)')
      text = "'solid' must stand here"
    case default
      text = "'"//expected//"' must stand here"
    end select
  end function what_is_missing

  !> True if a line begins with an expected word.
  pure logical function is_expected(word, expected)
    character(48), intent(in) :: word(:)
    character(*), intent(in) :: expected

    is_expected = index(' '//expected//' ', ' '//trim(word(1))//' ') > 0
    if (word(1) == 'outer') is_expected = is_expected .and. size(word) == 2
    if (word(1) == 'vertex') is_expected = is_expected .and. size(word) == 4
  end function is_expected

  !> Read a corner.
  pure subroutine read_vertex(word, x, ok)
    character(48), intent(in) :: word(:)
    real(rp), intent(out) :: x(3)
    logical, intent(out) :: ok
    integer :: a
    logical :: is_number

    ok = .true.
    do a = 1, 3
      call to_real(trim(word(a + 1)), x(a), is_number)
      ok = ok .and. is_number
    end do
  end subroutine read_vertex

  !> A line with blanks for control characters.
  pure function cleaned(line) result(row)
    character(*), intent(in) :: line
    character(len(line)) :: row
    integer :: i

    row = line
    do i = 1, len(line)
      if (ichar(line(i:i)) < 32) row(i:i) = ' '
    end do
  end function cleaned

  !> Add a facet.
  subroutine add(self, x, line)
    class(stl_t), intent(inout) :: self
    real(rp), intent(in) :: x(3, 3)
    integer, intent(in) :: line
    real(rp), allocatable :: y(:, :)
    integer, allocatable :: lines(:)

    if (self%n == size(self%line)) then
      allocate (y(3, 6*self%n), lines(2*self%n))
      y(:, :3*self%n) = self%y
      lines(:self%n) = self%line
      call move_alloc(y, self%y)
      call move_alloc(lines, self%line)
    end if
    self%n = self%n + 1
    self%y(:, 3*self%n - 2:3*self%n) = x
    self%line(self%n) = line
  end subroutine add

  !> Report an error of a facet; after a limit errors are only counted.
  subroutine report(self, line, message, diagnostics)
    class(stl_t), intent(inout) :: self
    integer, intent(in) :: line             !! line, or number of the facet
    character(*), intent(in) :: message
    type(diagnostics_t), intent(inout) :: diagnostics

    self%n_reports = self%n_reports + 1
    if (self%n_reports > max_reports) return
    if (self%is_binary) then
      call diagnostics%add(self%path, 0, 'facet '//str(line)//' '//message)
    else
      call diagnostics%add(self%path, line, message)
    end if
  end subroutine report

  !> Merge corners and match edges; report a surface that is not closed, degenerate facets, inward
  !> facing or intersecting ones.
  subroutine check(stl, facets, diagnostics)
    type(stl_t), intent(inout) :: stl
    type(facets_t), intent(out) :: facets
    type(diagnostics_t), intent(inout) :: diagnostics
    type(defect_t), allocatable :: defect(:)
    integer, allocatable :: crossed(:), kept(:)
    real(rp) :: volume
    integer :: i

    if (stl%n == 0) then
      call stl%report(1, 'there are no facets', diagnostics)
      return
    end if
    call join_corners(stl%y(:, :3*stl%n), facets, kept)
    call match_edges(facets)
    call list_defects(facets, defect)
    do i = 1, size(defect)
      call stl%report(stl%line(kept(defect(i)%facet)), text_of(defect(i)), diagnostics)
    end do
    volume = 0.0_rp
    do i = 1, size(kept)
      associate (a => facets%x(:, facets%corner(1, i)), b => facets%x(:, facets%corner(2, i)), &
                 c => facets%x(:, facets%corner(3, i)))
        if (norm2(cross(b - a, c - a)) <= 0.0_rp) call stl%report(stl%line(kept(i)), &
          'the facet has no area: its corners lie on a line', diagnostics)
        volume = volume + dot_product(a, cross(b, c))
      end associate
    end do
    if (stl%n_reports > 0) return
    if (volume <= 0.0_rp) call stl%report(stl%line(1), 'all facets face inwards: their '// &
      'corners must be counterclockwise seen from outside', diagnostics)
    call find_crossings(facets, crossed)
    do i = 1, size(kept)
      if (crossed(i) > 0) call stl%report(stl%line(kept(i)), 'the facet goes through that of '// &
        trim(merge('number', 'line  ', stl%is_binary))//' '//str(stl%line(kept(crossed(i))))// &
        ': the surface must not intersect itself', diagnostics)
    end do
  end subroutine check

  !> Message on a defective edge.
  function text_of(defect) result(text)
    type(defect_t), intent(in) :: defect
    character(:), allocatable :: text

    text = 'the edge from ('//point_text(defect%from)//') to ('//point_text(defect%to)//') '
    select case (defect%kind)
    case (is_open)
      text = text//'has no other facet: the surface is not closed'
    case (is_flipped)
      text = text//'has two facets that face opposite sides'
    case default
      text = text//'has more than two facets'
    end select
  end function text_of

  !> Text of the coordinates of a point.
  function point_text(x) result(text)
    real(rp), intent(in) :: x(3)
    character(:), allocatable :: text

    text = str(x(1))//', '//str(x(2))//', '//str(x(3))
  end function point_text

end module tools_mesh_stl_file
