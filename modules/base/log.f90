! SPDX-License-Identifier: MIT
!> Log lines on standard output and in the log file, unbuffered, so that lost lines are detected. In
!> a terminal window the progress line is redrawn in place.
module base_log
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long_long
  use, intrinsic :: iso_fortran_env, only: error_unit
  use base_files, only: reason_of, text_file_t
  implicit none (type, external)
  private

  public :: close_log, log_is_lost, write_log, open_log, log_line, show_progress, window_width

  character, parameter :: nl = new_line('a')
  character(*), parameter :: clear_line = achar(13)//achar(27)//'[K'

  logical :: is_lost = .false.     !! a line could not be written
  logical :: is_read = .true.      !! standard output has a reader
  logical :: is_drawn = .false.    !! the window shows a progress line
  logical :: is_open = .false.     !! the log file is open
  type(text_file_t) :: file        !! log file
  character(:), allocatable :: early   !! lines written before the log file was opened

  interface
    !> Write text to standard output; 0, errno, or -1 if the reader of the pipe has gone (disk.c).
    integer(c_int) function c_say(text, n) bind(c, name='stirpoint_say')
      import :: c_char, c_int, c_long_long
      implicit none (type, external)
      character(kind=c_char), intent(in) :: text(*)
      integer(c_long_long), value :: n
    end function c_say

    !> Columns of the terminal window of standard output; 0 if it is none.
    integer(c_int) function window_width() bind(c, name='stirpoint_window')
      import :: c_int
      implicit none (type, external)
    end function window_width
  end interface

contains

  !> Write a line to standard output and the log. The first failure is reported on standard error,
  !> except for a closed pipe (`| head`), after which nothing more is written.
  subroutine log_line(text)
    character(*), intent(in) :: text

    call write_log(text)
    if (is_drawn) call put(clear_line)
    is_drawn = .false.
    call put(text//nl)
  end subroutine log_line

  !> Show a progress line: in a window of `width` columns in place, otherwise (0) as a log line.
  subroutine show_progress(text, width)
    character(*), intent(in) :: text
    integer, intent(in) :: width

    if (width == 0) then
      call log_line(text)
    else
      call put(clear_line//text(:min(len(text), width - 1)))
      is_drawn = .true.
    end if
  end subroutine show_progress

  !> Write to standard output.
  subroutine put(text)
    character(*), intent(in) :: text
    integer :: code

    if (.not. is_read) return
    code = c_say(text, len(text, c_long_long))
    is_read = code >= 0
    if (code <= 0 .or. is_lost) return
    is_lost = .true.
    write (error_unit, '(2a)') 'stirpoint: standard output cannot be written: ', &
      reason_of(code)//'; the program goes on and will end with exit status 4'
  end subroutine put

  !> Write a line to the log only.
  subroutine write_log(text)
    character(*), intent(in) :: text

    if (is_open) then
      call file%put(text//nl)
    else
      if (.not. allocated(early)) early = ''
      early = early//text//nl
    end if
  end subroutine write_log

  !> Open the log file, new or to append, and write the lines stored so far.
  subroutine open_log(path, appends)
    character(*), intent(in) :: path
    logical, intent(in) :: appends

    if (appends) then
      call file%append(path)
    else
      call file%create(path)
    end if
    if (allocated(early)) call file%put(early)
    is_open = .true.
  end subroutine open_log

  !> Close the log; report lost lines on standard error.
  subroutine close_log()
    if (is_drawn) call put(nl)
    is_drawn = .false.
    if (.not. is_open) return
    call file%close()
    if (file%code /= 0) write (error_unit, '(2a)') &
      'stirpoint: warning: the log is incomplete: ', reason_of(file%code)
    is_open = .false.
  end subroutine close_log

  !> True if this process could not write a line.
  logical function log_is_lost()
    log_is_lost = is_lost
  end function log_is_lost

end module base_log
