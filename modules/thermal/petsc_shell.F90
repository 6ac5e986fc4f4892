! SPDX-License-Identifier: MIT
!> Linear systems of an operator without a matrix by PETSc: conjugate gradients with a diagonal
!> (other methods of PETSc by options in the environment variable PETSC_OPTIONS).
module thermal_petsc_shell
#include <petsc/finclude/petscksp.h>
  use petscksp
  use base_errors, only: fatal
  use base_kinds, only: rp
  use base_text, only: str
  use comm_world, only: world_t
  use thermal_operator, only: operator_t
  use thermal_petsc, only: start_petsc
  implicit none (type, external)
  private

  public :: solve_by_petsc

  ! PETSc calls back with a matrix alone: what it stands for during one solve.
  class(operator_t), pointer :: acting => null()
  real(rp), pointer :: its_diagonal(:) => null()

contains

  !> Collective: x of A x = b for a symmetric A, until the residual, weighted by the reciprocal
  !> `diagonal` that also preconditions, is `relative` of that of b, or `absolute`.
  subroutine solve_by_petsc(world, operator, diagonal, b, relative, absolute, x, &
                            iterations)
    type(world_t), intent(in) :: world
    class(operator_t), intent(inout), target :: operator
    real(rp), intent(in), target :: diagonal(:)
    real(rp), intent(in) :: b(:), relative, absolute
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations
    external :: MatCreateShell, MatShellSetOperation
    KSPConvergedReason :: reason
    PetscErrorCode :: ierr
    PetscScalar, pointer :: v(:)
    PetscInt :: n
    Mat :: a
    Vec :: right, left
    KSP :: ksp
    PC :: pc

    call start_petsc(world)
    acting => operator
    its_diagonal => diagonal
    n = size(b)
    call MatCreateShell(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, &
                        PETSC_NULL_INTEGER, a, ierr)
    call MatShellSetOperation(a, MATOP_MULT, multiply_shell, ierr)
    call MatShellSetOperation(a, MATOP_GET_DIAGONAL, diagonal_of_shell, ierr)
    call VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DETERMINE, right, ierr)
    call VecDuplicate(right, left, ierr)
    call VecGetArrayF90(right, v, ierr)
    v = b
    call VecRestoreArrayF90(right, v, ierr)
    call KSPCreate(PETSC_COMM_WORLD, ksp, ierr)
    call KSPSetOperators(ksp, a, a, ierr)
    call KSPSetType(ksp, KSPCG, ierr)
    call KSPSetNormType(ksp, KSP_NORM_NATURAL, ierr)
    call KSPGetPC(ksp, pc, ierr)
    call PCSetType(pc, PCJACOBI, ierr)
    call KSPSetTolerances(ksp, relative, absolute, PETSC_DEFAULT_REAL, &
                          PETSC_DEFAULT_INTEGER, ierr)
    call KSPSetFromOptions(ksp, ierr)
    call KSPSolve(ksp, right, left, ierr)
    call KSPGetConvergedReason(ksp, reason, ierr)
    if (reason < 0) call fatal('PETSc did not solve for the conduction step (KSPConvergedReason '&
                               //str(int(reason))//'): shorten &HEAT STEP')
    call KSPGetIterationNumber(ksp, iterations, ierr)
    call VecGetArrayF90(left, v, ierr)
    x = v
    call VecRestoreArrayF90(left, v, ierr)
    call KSPDestroy(ksp, ierr)
    call MatDestroy(a, ierr)
    call VecDestroy(right, ierr)
    call VecDestroy(left, ierr)
  end subroutine solve_by_petsc

  subroutine multiply_shell(a, x, y, ierr)
    Mat :: a
    Vec :: x, y
    PetscErrorCode :: ierr
    PetscScalar, pointer :: from(:), to(:)

    call VecGetArrayReadF90(x, from, ierr)
    call VecGetArrayF90(y, to, ierr)
    call acting%multiply(from, to)
    call VecRestoreArrayF90(y, to, ierr)
    call VecRestoreArrayReadF90(x, from, ierr)
  end subroutine multiply_shell

  subroutine diagonal_of_shell(a, d, ierr)
    Mat :: a
    Vec :: d
    PetscErrorCode :: ierr
    PetscScalar, pointer :: v(:)

    call VecGetArrayF90(d, v, ierr)
    v = its_diagonal
    call VecRestoreArrayF90(d, v, ierr)
  end subroutine diagonal_of_shell

end module thermal_petsc_shell
