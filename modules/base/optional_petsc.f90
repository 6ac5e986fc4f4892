! SPDX-License-Identifier: MIT
!> The PETSc library that this program was built with.
module base_optional_petsc
  use, intrinsic :: iso_c_binding, only: c_int
  use base_text, only: str
  implicit none (type, external)
  private

  public :: petsc_text

  interface
    integer(c_int) function get_version(major, minor, subminor, release) &
        bind(c, name='PetscGetVersionNumber')
      import :: c_int
      implicit none (type, external)
      integer(c_int), intent(out) :: major, minor, subminor, release
    end function get_version
  end interface

contains

  !> Its version.
  function petsc_text() result(text)
    character(:), allocatable :: text
    integer(c_int) :: v(4)

    text = 'unknown'
    if (get_version(v(1), v(2), v(3), v(4)) == 0) text = str(v(1))//'.'//str(v(2))//'.'//str(v(3))
  end function petsc_text

end module base_optional_petsc
