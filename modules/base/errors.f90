! SPDX-License-Identifier: MIT
!> Error values of set-up and I/O, and the abort on programming errors.
module base_errors
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)
  private

  public :: error_t, fatal, set_abort_hook

  !> Error message; not allocated on success.
  type :: error_t
    character(:), allocatable :: message
  contains
    procedure :: raise, is_set
  end type error_t

  abstract interface
    subroutine abort_interface()
      implicit none (type, external)
    end subroutine abort_interface
  end interface

  procedure(abort_interface), pointer :: abort_hook => null()

contains

  !> Set the message, unless an earlier one is set.
  subroutine raise(self, message)
    class(error_t), intent(inout) :: self
    character(*), intent(in) :: message

    if (.not. allocated(self%message)) self%message = message
  end subroutine raise

  !> True if an error was recorded.
  pure logical function is_set(self)
    class(error_t), intent(in) :: self

    is_set = allocated(self%message)
  end function is_set

  !> Set the procedure that `fatal` calls after printing (MPI_Abort in parallel runs).
  subroutine set_abort_hook(hook)
    procedure(abort_interface) :: hook

    abort_hook => hook
  end subroutine set_abort_hook

  !> Abort all ranks, on a programming error or a lost file system.
  subroutine fatal(message)
    character(*), intent(in) :: message

    write (error_unit, '(2a)') 'stirpoint: fatal: ', message
    flush (error_unit)
    if (associated(abort_hook)) call abort_hook()
    error stop 1, quiet=.true.
  end subroutine fatal

end module base_errors
