! SPDX-License-Identifier: MIT
!> The FFTW library that this program was built with.
module base_optional_fftw
  use, intrinsic :: iso_c_binding, only: c_char
  implicit none (type, external)
  private

  public :: fftw_text

  character(kind=c_char), bind(c, name='fftw_version') :: fftw_version(32)

contains

  !> Its version.
  function fftw_text() result(text)
    character(:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(fftw_version)
      if (iachar(fftw_version(i)) == 0) exit
      text = text//fftw_version(i)
    end do
  end function fftw_text

end module base_optional_fftw
