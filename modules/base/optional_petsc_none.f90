! SPDX-License-Identifier: MIT
!> Stands in for `optional_petsc.f90` in a build without PETSc.
module base_optional_petsc
  implicit none (type, external)
  private

  public :: petsc_text

contains

  function petsc_text() result(text)
    character(:), allocatable :: text

    text = 'not built in'
  end function petsc_text

end module base_optional_petsc
