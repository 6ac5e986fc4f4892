! SPDX-License-Identifier: MIT
!> Unbuffered text files, so that a full disk is detected with the first lost row.
module base_files
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long_long, c_null_char
  use base_errors, only: error_t
  use base_system, only: remove_file, rename_file
  use base_text, only: str
  implicit none (type, external)
  private

  public :: free_name, text_file_t, write_whole, reason_of

  !> Text file to append to. `code` is errno of the first failed call, or 0.
  type :: text_file_t
    integer :: code = 0
    !> The file was created anew after it was moved, deleted or replaced.
    logical :: was_restored = .false.
    integer(c_int), private :: fd = -1
    character(:), allocatable, private :: path
  contains
    procedure :: create, append, put, sync, close => close_file
  end type text_file_t

  interface
    integer(c_int) function c_open(path, is_new) bind(c, name='stirpoint_text_open')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: is_new
    end function c_open

    integer(c_int) function c_is_removed(fd, path) bind(c, name='stirpoint_text_is_removed')
      import :: c_char, c_int
      implicit none (type, external)
      integer(c_int), value :: fd
      character(kind=c_char), intent(in) :: path(*)
    end function c_is_removed

    integer(c_int) function c_copy(fd, path) bind(c, name='stirpoint_text_copy')
      import :: c_char, c_int
      implicit none (type, external)
      integer(c_int), value :: fd
      character(kind=c_char), intent(in) :: path(*)
    end function c_copy

    integer(c_int) function c_put(fd, text, n) bind(c, name='stirpoint_text_put')
      import :: c_char, c_int, c_long_long
      implicit none (type, external)
      integer(c_int), value :: fd
      character(kind=c_char), intent(in) :: text(*)
      integer(c_long_long), value :: n
    end function c_put

    integer(c_int) function c_sync(fd) bind(c, name='stirpoint_text_sync')
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: fd
    end function c_sync

    integer(c_int) function c_close(fd) bind(c, name='stirpoint_text_close')
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: fd
    end function c_close

    subroutine c_reason(code, text, n) bind(c, name='stirpoint_reason')
      import :: c_char, c_int
      implicit none (type, external)
      integer(c_int), value :: code, n
      character(kind=c_char), intent(inout) :: text(*)
    end subroutine c_reason
  end interface

contains

  !> Create a file, replacing an existing one.
  subroutine create(self, path)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: path

    call open_file(self, path, 1_c_int)
  end subroutine create

  !> Open a file to append to.
  subroutine append(self, path)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: path

    call open_file(self, path, 0_c_int)
  end subroutine append

  !> Open a new file, or an existing one to append to.
  subroutine open_file(self, path, is_new)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    integer(c_int), intent(in) :: is_new

    self%code = 0
    self%path = trim(path)
    self%fd = c_open(self%path//c_null_char, is_new)
    if (self%fd < 0) self%code = -self%fd
  end subroutine open_file

  !> Append `text`; nothing is written after a failure.
  subroutine put(self, text)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: text

    call restore(self)
    if (self%code == 0) self%code = c_put(self%fd, text, len(text, c_long_long))
  end subroutine put

  !> Flush the file to disk.
  subroutine sync(self)
    class(text_file_t), intent(inout) :: self

    call restore(self)
    if (self%code == 0 .and. self%fd >= 0) self%code = c_sync(self%fd)
  end subroutine sync

  !> If the file was moved, deleted or replaced since it was opened, copy its content to a new file
  !> at its path, and continue with that. Another file at the path is renamed (free_name).
  subroutine restore(self)
    class(text_file_t), intent(inout) :: self
    integer(c_int) :: fd
    logical :: ok

    if (self%code /= 0 .or. self%fd < 0) return
    if (c_is_removed(self%fd, self%path//c_null_char) == 0) return
    self%was_restored = .true.
    call rename_file(self%path, free_name(self%path), ok)   ! fails if there is none
    fd = c_copy(self%fd, self%path//c_null_char)
    if (fd < 0) self%code = -fd
    if (fd < 0) return
    self%code = c_close(self%fd)
    self%fd = fd
  end subroutine restore

  !> The first of the names path.1, path.2, ... that does not exist.
  function free_name(path) result(free)
    character(*), intent(in) :: path
    character(:), allocatable :: free
    logical :: exists
    integer :: k

    k = 0
    exists = .true.
    do while (exists)
      k = k + 1
      free = path//'.'//str(k)
      inquire (file=free, exist=exists)
    end do
  end function free_name

  !> Close the file, if it is open, also after a failure.
  subroutine close_file(self)
    class(text_file_t), intent(inout) :: self
    integer :: code

    if (self%fd < 0) return
    code = c_close(self%fd)
    if (self%code == 0) self%code = code
    self%fd = -1
  end subroutine close_file

  !> Replace the file `path` by `text` atomically; after an error the old file remains.
  subroutine write_whole(path, text, error)
    character(*), intent(in) :: path, text
    type(error_t), intent(inout) :: error
    type(text_file_t) :: file
    logical :: ok

    if (error%is_set()) return
    call file%create(path//'.tmp')
    call file%put(text)
    call file%sync()
    call file%close()
    if (file%code /= 0) then
      call remove_file(path//'.tmp')
      call error%raise(path//' cannot be written: '//reason_of(file%code))
      return
    end if
    call rename_file(path//'.tmp', path, ok)
    if (.not. ok) call error%raise(path//' cannot be replaced by '//path//'.tmp')
  end subroutine write_whole

  !> Message of an errno.
  function reason_of(code) result(text)
    integer, intent(in) :: code
    character(:), allocatable :: text
    character(80) :: words

    call c_reason(int(code, c_int), words, len(words, c_int))
    text = trim(words)
  end function reason_of

end module base_files
