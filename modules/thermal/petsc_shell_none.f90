! SPDX-License-Identifier: MIT
!> Stands in for `petsc_shell.F90` in a build without PETSc; the set-up lets no scene choose it.
module thermal_petsc_shell
  use base_errors, only: fatal
  use base_kinds, only: rp
  use comm_world, only: world_t
  use thermal_operator, only: operator_t
  implicit none (type, external)
  private

  public :: solve_by_petsc

contains

  subroutine solve_by_petsc(world, operator, diagonal, b, relative, absolute, x, &
                            iterations)
    type(world_t), intent(in) :: world
    class(operator_t), intent(inout), target :: operator
    real(rp), intent(in), target :: diagonal(:)
    real(rp), intent(in) :: b(:), relative, absolute
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations

    call fatal('this program was built without PETSc')
    x = b
    iterations = 0
  end subroutine solve_by_petsc

end module thermal_petsc_shell
