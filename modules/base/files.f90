! SPDX-License-Identifier: MIT
!> Text files written without a buffer: a full disk is known by the row that it loses.
module base_files
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long_long, c_null_char
  use base_errors, only: error_t
  use base_system, only: remove_file, rename_file
  implicit none (type, external)
  private

  public :: text_file_t, write_whole, reason_of

  !> A file that text is appended to. `code` is errno of the first call that failed, or 0.
  type :: text_file_t
    integer :: code = 0
    integer(c_int), private :: fd = -1
  contains
    procedure :: create
    procedure :: append
    procedure :: put
    procedure :: sync
    procedure :: close => close_file
  end type text_file_t

  interface
    integer(c_int) function c_open(path, fresh) bind(c, name='stirpoint_text_open')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: fresh
    end function c_open

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

  !> A new file, in place of one that is there.
  subroutine create(self, path)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: path

    call start(self, path, 1_c_int)
  end subroutine create

  !> Go on with a file.
  subroutine append(self, path)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: path

    call start(self, path, 0_c_int)
  end subroutine append

  subroutine start(self, path, fresh)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    integer(c_int), intent(in) :: fresh

    self%code = 0
    self%fd = c_open(trim(path)//c_null_char, fresh)
    if (self%fd < 0) self%code = -self%fd
  end subroutine start

  !> Append `text`; nothing more is written after a failure.
  subroutine put(self, text)
    class(text_file_t), intent(inout) :: self
    character(*), intent(in) :: text

    if (self%code == 0) self%code = c_put(self%fd, text, len(text, c_long_long))
  end subroutine put

  !> Bring all of it to the disk.
  subroutine sync(self)
    class(text_file_t), intent(inout) :: self

    if (self%code == 0 .and. self%fd >= 0) self%code = c_sync(self%fd)
  end subroutine sync

  !> Close it, also after a failure; one that is not open is fine.
  subroutine close_file(self)
    class(text_file_t), intent(inout) :: self
    integer :: code

    if (self%fd < 0) return
    code = c_close(self%fd)
    if (self%code == 0) self%code = code
    self%fd = -1
  end subroutine close_file

  !> Put `text` in place of the file `path` in one go; an error leaves the old one.
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

  !> Text of an errno.
  function reason_of(code) result(text)
    integer, intent(in) :: code
    character(:), allocatable :: text
    character(80) :: words

    call c_reason(int(code, c_int), words, len(words, c_int))
    text = trim(words)
  end function reason_of

end module base_files
