! SPDX-License-Identifier: MIT
!> Lines of a run on standard output, written at once and without a buffer: a line that is lost is
!> known.
module base_log
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long_long
  use, intrinsic :: iso_fortran_env, only: error_unit
  use base_files, only: reason_of
  implicit none (type, external)
  private

  public :: say, log_is_lost

  logical :: is_lost = .false.     !! a line could not be written
  logical :: is_read = .true.      !! the reader is there

  interface
    !> 0, errno, or -1 if the reader has gone (files.c).
    integer(c_int) function c_say(text, n) bind(c, name='stirpoint_say')
      import :: c_char, c_int, c_long_long
      implicit none (type, external)
      character(kind=c_char), intent(in) :: text(*)
      integer(c_long_long), value :: n
    end function c_say
  end interface

contains

  !> A line on standard output. The first that cannot be written is reported on standard error; a
  !> reader that has gone away (`| head`) is not, and gets nothing more.
  subroutine say(text)
    character(*), intent(in) :: text
    integer :: code

    if (.not. is_read) return
    code = c_say(text//new_line('a'), len(text, c_long_long) + 1)
    is_read = code >= 0
    if (code <= 0 .or. is_lost) return
    is_lost = .true.
    write (error_unit, '(2a)') 'stirpoint: standard output cannot be written: ', &
      reason_of(code)//'; the program goes on and will end with exit status 4'
  end subroutine say

  !> True if this process could not write a line.
  logical function log_is_lost()
    log_is_lost = is_lost
  end function log_is_lost

end module base_log
