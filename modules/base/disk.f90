! SPDX-License-Identifier: MIT
!> File operations of the operating system (modules/base/disk.c): locks, syncs, lists, checksums.
module base_disk
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_int64_t, c_null_char
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: file_sum, sum_words, sync_file, link_file, lock_file, list_directory, random_number64
  public :: process_number, host_name, full_path, file_bytes, read_head, write_head
  public :: locked, locked_elsewhere, has_no_locks

  integer, parameter, public :: name_length = 255   !! maximum length of a file name
  integer(c_int), parameter :: locked = 0, locked_elsewhere = 1, has_no_locks = 2

  interface
    !> Checksum of words after `seed`; a change of any word changes the sum.
    pure integer(c_int64_t) function sum_words(seed, words, n) bind(c, name='stirpoint_sum_words')
      import :: c_int64_t
      implicit none (type, external)
      integer(c_int64_t), value :: seed, n
      integer(c_int64_t), intent(in) :: words(*)
    end function sum_words

    integer(c_int) function c_sum_file(path, first, count, total) bind(c, name='stirpoint_sum_file')
      import :: c_char, c_int, c_int64_t
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int64_t), value :: first, count
      integer(c_int64_t), intent(out) :: total
    end function c_sum_file

    integer(c_int) function c_sync(path) bind(c, name='stirpoint_sync')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
    end function c_sync

    integer(c_int) function c_link(path, kept) bind(c, name='stirpoint_link_file')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*), kept(*)
    end function c_link

    integer(c_int) function c_lock(path, seconds) bind(c, name='stirpoint_lock')
      import :: c_char, c_double, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      real(c_double), value :: seconds
    end function c_lock

    integer(c_int64_t) function c_list(path, names, size) bind(c, name='stirpoint_list')
      import :: c_char, c_int64_t
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      character(kind=c_char), intent(inout) :: names(*)
      integer(c_int64_t), value :: size
    end function c_list

    !> Random number that no other call returns.
    integer(c_int64_t) function random_number64() bind(c, name='stirpoint_random')
      import :: c_int64_t
      implicit none (type, external)
    end function random_number64

    !> Process identifier.
    integer(c_int) function process_number() bind(c, name='stirpoint_process')
      import :: c_int
      implicit none (type, external)
    end function process_number

    subroutine c_full_path(path, full, size) bind(c, name='stirpoint_full_path')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      character(kind=c_char), intent(inout) :: full(*)
      integer(c_int), value :: size
    end subroutine c_full_path

    subroutine c_host(name, size) bind(c, name='stirpoint_host')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(inout) :: name(*)
      integer(c_int), value :: size
    end subroutine c_host
  end interface

contains

  !> Checksum of `count` bytes of a file from byte `first` (from 0); `ok` if they could be read.
  subroutine file_sum(path, first, count, total, ok)
    character(*), intent(in) :: path
    integer(i8), intent(in) :: first, count
    integer(i8), intent(out) :: total
    logical, intent(out) :: ok

    ok = c_sum_file(trim(path)//c_null_char, first, count, total) == 0
  end subroutine file_sum

  !> Flush a file or a directory to disk.
  logical function sync_file(path)
    character(*), intent(in) :: path

    sync_file = c_sync(trim(path)//c_null_char) == 0
  end function sync_file

  !> Give a file a second name; a file of that name is replaced. True also if there is no file
  !> `path`.
  logical function link_file(path, kept)
    character(*), intent(in) :: path, kept

    link_file = c_link(trim(path)//c_null_char, trim(kept)//c_null_char) == 0
  end function link_file

  !> Lock a file, which is created if needed, until this process ends. Returns locked,
  !> locked_elsewhere (after `seconds`), has_no_locks (of the file system), or a negative value if
  !> it cannot be created.
  integer function lock_file(path, seconds)
    character(*), intent(in) :: path
    real(rp), intent(in) :: seconds

    lock_file = c_lock(trim(path)//c_null_char, seconds)
  end function lock_file

  !> File names in a directory; none if it cannot be read.
  function list_directory(path) result(names)
    character(*), intent(in) :: path
    character(name_length), allocatable :: names(:)
    character(:), allocatable :: text
    integer(i8) :: length
    integer :: first, last

    text = ''
    do   ! repeated until the list fits, as files may be added meanwhile
      length = c_list(trim(path)//c_null_char, text, int(len(text), i8))
      if (length <= len(text)) exit
      text = repeat(' ', int(length) + 256)
    end do
    allocate (names(0))
    first = 1
    do while (first <= length)
      last = first + index(text(first:), new_line('a')) - 2
      names = [character(name_length) :: names, text(first:last)]
      first = last + 2
    end do
  end function list_directory

  !> Name of this computer.
  function host_name() result(name)
    character(:), allocatable :: name
    character(256) :: buffer

    buffer = ''
    call c_host(buffer, len(buffer, c_int))
    name = buffer(:index(buffer, c_null_char) - 1)
  end function host_name

  !> Absolute path of an existing file or directory; '' if unknown.
  function full_path(path) result(full)
    character(*), intent(in) :: path
    character(:), allocatable :: full
    character(4096) :: buffer

    buffer = ''
    call c_full_path(trim(path)//c_null_char, buffer, len(buffer, c_int))
    full = buffer(:index(buffer, c_null_char) - 1)
  end function full_path

  !> Size of a file [bytes]; -1 if there is none.
  integer(i8) function file_bytes(path)
    character(*), intent(in) :: path
    logical :: exists

    inquire (file=path, exist=exists, size=file_bytes)
    if (.not. exists) file_bytes = -1
  end function file_bytes

  !> Read the first characters of a file, as many as `head` has; blanks if the file is shorter.
  subroutine read_head(path, head, ok)
    character(*), intent(in) :: path
    character(*), intent(out) :: head
    logical, intent(out) :: ok
    integer :: unit, status

    head = ''
    open (newunit=unit, file=path, access='stream', form='unformatted', action='read', &
          status='old', iostat=status)
    ok = status == 0
    if (.not. ok) return
    read (unit, iostat=status) head
    ok = status == 0
    if (.not. ok) head = ''
    close (unit, iostat=status)
  end subroutine read_head

  !> Replace the first characters of a file.
  subroutine write_head(path, head, ok)
    character(*), intent(in) :: path, head
    logical, intent(out) :: ok
    integer :: unit, status

    open (newunit=unit, file=path, access='stream', form='unformatted', action='readwrite', &
          status='old', iostat=status)
    ok = status == 0
    if (.not. ok) return
    write (unit, pos=1, iostat=status) head
    ok = status == 0
    close (unit, iostat=status)
    ok = ok .and. status == 0
  end subroutine write_head

end module base_disk
