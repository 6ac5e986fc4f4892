! SPDX-License-Identifier: MIT
!> Substitute for `optional_fftw.f90` in a build without FFTW.
module base_optional_fftw
  implicit none (type, external)
  private

  public :: fftw_text

contains

  function fftw_text() result(text)
    character(:), allocatable :: text

    text = 'not built in'
  end function fftw_text

end module base_optional_fftw
