! SPDX-License-Identifier: MIT
!> Groups of an input and their assignments, as written (input_scan) and overridden, with look-ups.
module input_assignments
  use base_text, only: str
  use input_key_table, only: key_table_t
  use input_syntax, only: items_t, name_len, split_values
  implicit none (type, external)
  private

  public :: assignment_t, group_t, scan_t

  character, parameter :: newline = achar(10)

  !> A group, `&NAME ... /`.
  type :: group_t
    character(name_len) :: name = ''   !! upper case
    integer :: line = 0  !! line where the group opens; -k: opened by the k-th override
    logical :: is_broken = .false.     !! the group could not be read to its end
    integer :: first = 1, last = 0     !! range of its assignments, without overrides
  end type group_t

  !> An assignment, `KEY(index) = value`.
  type :: assignment_t
    integer :: group = 0               !! index of its group in the file
    character(name_len) :: key = ''    !! upper case; blank: replaced by an override
    integer :: index = 0               !! 0: no index was written
    integer :: first = 1, last = 0     !! the value is `text(first:last)` of the scan
    integer :: line = 0                !! line of the key; -k: the key is from the k-th override
    logical :: is_broken = .false.     !! the assignment is invalid and has a diagnostic
  end type assignment_t

  !> Indices of the groups of one name, at(:n).
  type :: places_t
    character(name_len) :: name = ''
    integer, allocatable :: at(:)
    integer :: n = 0
  end type places_t

  !> A scanned input file.
  type :: scan_t
    character(:), allocatable :: text              !! the file without comments
    type(group_t), allocatable :: groups(:)
    type(assignment_t), allocatable :: assignments(:)
    integer :: n_groups = 0   !! groups in the file; those of overrides follow
    integer :: n_read = 0     !! assignments in the file, likewise
    type(places_t), allocatable, private :: places(:)
  contains
    procedure :: find_places, count => count_groups, add_group, find, last_of, value, replace
    procedure :: gather, text_of_groups
  end type scan_t

contains

  !> Index the groups by their names.
  subroutine find_places(self)
    class(scan_t), intent(inout) :: self
    integer :: i, k

    if (allocated(self%places)) deallocate (self%places)
    allocate (self%places(0))
    do i = 1, size(self%groups)
      k = index_of_name(self, self%groups(i)%name)
      if (k == 0) then
        self%places = [self%places, places_t(name=self%groups(i)%name, at=[0, 0])]
        k = size(self%places)
      end if
      associate (p => self%places(k))
        p%n = p%n + 1
        if (p%n > size(p%at)) p%at = [p%at, p%at]
        p%at(p%n) = i
      end associate
    end do
  end subroutine find_places

  !> Index of a name in the list of places; 0 if no group has it.
  pure integer function index_of_name(self, name)
    class(scan_t), intent(in) :: self
    character(*), intent(in) :: name

    do index_of_name = size(self%places), 1, -1
      if (self%places(index_of_name)%name == name) exit
    end do
  end function index_of_name

  !> Append a group that the file does not have.
  subroutine add_group(self, name, line)
    class(scan_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: line             !! line where it opens; -k: opened by the k-th override

    self%groups = [self%groups, group_t(name, line)]
    call self%find_places()
  end subroutine add_group

  !> Number of groups called `name`.
  pure integer function count_groups(self, name)
    class(scan_t), intent(in) :: self
    character(*), intent(in) :: name
    integer :: k

    count_groups = 0
    k = index_of_name(self, name)
    if (k > 0) count_groups = self%places(k)%n
  end function count_groups

  !> Index of the `i`-th group called `name`; 0 if there is none.
  pure integer function find(self, name, i)
    class(scan_t), intent(in) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: i
    integer :: k

    find = 0
    k = index_of_name(self, name)
    if (k == 0 .or. i < 1) return
    if (i <= self%places(k)%n) find = self%places(k)%at(i)
  end function find

  !> Index of the effective assignment of a key; 0 if there is none.
  pure integer function last_of(self, group, key)
    class(scan_t), intent(in) :: self
    integer, intent(in) :: group            !! index of the group
    character(*), intent(in) :: key

    last_of = 0
    if (key == '' .or. group == 0) return
    do last_of = size(self%assignments), self%n_read + 1, -1
      if (self%assignments(last_of)%group == group .and. self%assignments(last_of)%key == key) then
        return
      end if
    end do
    do last_of = self%groups(group)%last, self%groups(group)%first, -1
      if (self%assignments(last_of)%key == key) return
    end do
    last_of = 0
  end function last_of

  !> Text of the value of assignment `i`.
  pure function value(self, i) result(r)
    class(scan_t), intent(in) :: self
    integer, intent(in) :: i
    character(:), allocatable :: r

    r = self%text(self%assignments(i)%first:self%assignments(i)%last)
  end function value

  !> Replace the assignments of a key in a group by `new`, whose value is appended to the text.
  subroutine replace(self, new, text)
    class(scan_t), intent(inout) :: self
    type(assignment_t), intent(inout) :: new
    character(*), intent(in) :: text

    new%first = len(self%text) + 1
    new%last = len(self%text) + len(text)
    self%text = self%text//text
    where (self%assignments%group == new%group .and. self%assignments%key == new%key &
           .and. new%index == 0) self%assignments%key = ''
    self%assignments = [self%assignments, new]
  end subroutine replace

  !> Positions of the values of a key: the k-th is text(first(k):last(k)); first(k) = 0 if not
  !> written.
  pure subroutine gather(self, group, key, first, last)
    class(scan_t), intent(in) :: self
    integer, intent(in) :: group            !! index of the group
    character(*), intent(in) :: key
    integer, intent(out) :: first(:), last(:)
    type(items_t) :: items
    integer :: i, j, k, n

    first = 0
    last = 0
    if (group == 0) return
    do n = self%groups(group)%first, self%groups(group)%last + size(self%assignments) - self%n_read
      i = n                                   ! the groups of the file, then of all overrides
      if (n > self%groups(group)%last) i = self%n_read + n - self%groups(group)%last
      associate (one => self%assignments(i))
        if (one%group /= group .or. one%key /= key .or. one%is_broken) cycle
        call split_values(self%text(one%first:one%last), items)
        k = max(1, one%index)
        do j = 1, size(items%first)
          first(k:min(size(first), k + items%repeat(j) - 1)) = one%first + items%first(j) - 1
          last(k:min(size(last), k + items%repeat(j) - 1)) = one%first + items%last(j) - 1
          k = min(size(first) + 1, k + items%repeat(j))
        end do
      end associate
    end do
  end subroutine gather

  !> All groups as namelist text, one key per line, with overrides; no newline at the end.
  pure function text_of_groups(self, table) result(r)
    class(scan_t), intent(in) :: self
    type(key_table_t), intent(in) :: table
    character(:), allocatable :: r, one
    integer, allocatable :: first(:), last(:)
    integer :: g, i, j, k, n
    logical :: is_whole

    r = ''
    do i = 1, size(self%groups)
      g = table%find_group(self%groups(i)%name)
      if (g == 0) cycle
      if (r /= '') r = r//newline
      one = '&'//trim(self%groups(i)%name)//newline
      do k = table%groups(g)%first, table%groups(g)%last
        allocate (first(abs(table%keys(k)%n)), last(abs(table%keys(k)%n)))
        call self%gather(i, table%keys(k)%name, first, last)
        n = findloc(first > 0, .true., dim=1, back=.true.)
        is_whole = all(first(:n) > 0) .and. n >= table%keys(k)%n
        do j = 1, n
          if (first(j) == 0) cycle
          if (j > 1 .and. is_whole) then
            one = one//', '
          else
            one = one//'  '//trim(table%keys(k)%name)
            if (.not. is_whole) one = one//'('//str(j)//')'
            one = one//' = '
          end if
          one = one//self%text(first(j):last(j))
          if (j == n .or. .not. is_whole) one = one//newline
        end do
        deallocate (first, last)
      end do
      r = r//one//'/'
    end do
  end function text_of_groups

end module input_assignments
