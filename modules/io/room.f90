! SPDX-License-Identifier: MIT
!> Is there room on the disk? Asked before HDF5 finds out: its ranks may then wait for ever.
module io_room
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char
  use base_kinds, only: i8
  use base_system, only: remove_file
  implicit none (type, external)
  private

  public :: is_room

  integer(i8), parameter :: page = 65536_i8

  interface
    integer(c_int) function c_creat(path, mode) bind(c, name='creat')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_creat

    !> Linux: reserves disk blocks, or fails at once where the file system cannot.
    integer(c_int) function c_fallocate(fd, mode, offset, length) bind(c, name='fallocate')
      import :: c_int, c_int64_t
      implicit none (type, external)
      integer(c_int), value :: fd, mode
      integer(c_int64_t), value :: offset, length
    end function c_fallocate

    integer(c_int) function c_close(fd) bind(c, name='close')
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: fd
    end function c_close
  end interface

contains

  !> True if a file of `bytes` would fit beside `path`; it is tried, and removed again. On a file
  !> system without reservation only a megabyte is tried.
  logical function is_room(path, bytes)
    character(*), intent(in) :: path
    integer(i8), intent(in) :: bytes
    integer(c_int), parameter :: mode = int(o'644', c_int)
    integer(c_int) :: fd, status

    fd = c_creat(path//'.room'//c_null_char, mode)
    is_room = fd >= 0
    if (.not. is_room) return
    is_room = c_fallocate(fd, 0_c_int, 0_c_int64_t, max(page, bytes)) == 0
    if (.not. is_room) then
      if (c_fallocate(fd, 0_c_int, 0_c_int64_t, page) /= 0) is_room = can_write(path//'.room')
    end if
    status = c_close(fd)
    if (status /= 0) is_room = .false.
    call remove_file(path//'.room')
  end function is_room

  !> Write a megabyte.
  logical function can_write(path)
    character(*), intent(in) :: path
    character(page) :: line
    integer :: unit, status, ignored, i

    line = ' '
    open (newunit=unit, file=path, access='stream', action='write', status='replace', &
          iostat=status)
    can_write = status == 0
    if (.not. can_write) return
    do i = 1, 16
      if (status == 0) write (unit, iostat=status) line
      if (status == 0) flush (unit, iostat=status)
    end do
    can_write = status == 0
    close (unit, iostat=ignored)
  end function can_write

end module io_room
