! SPDX-License-Identifier: MIT
!> Version of the FFTW library in use.
module base_optional_fftw
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_ptr
  implicit none (type, external)
  private

  public :: fftw_text

  interface
    !> Version text of FFTW (optional_fftw.c), as Fortran cannot access variables of a C library.
    type(c_ptr) function get_version() bind(c, name='stirpoint_fftw_version')
      import :: c_ptr
      implicit none (type, external)
    end function get_version
  end interface

contains

  !> Version of FFTW.
  function fftw_text() result(text)
    character(:), allocatable :: text
    character(kind=c_char), pointer :: name(:)
    integer :: i

    call c_f_pointer(get_version(), name, [64])
    text = ''
    do i = 1, size(name)
      if (iachar(name(i)) == 0) exit
      text = text//name(i)
    end do
    if (index(text, 'fftw-') == 1) text = text(6:)
  end function fftw_text

end module base_optional_fftw
