! SPDX-License-Identifier: MIT
!> Interface of `heat_petsc` to PETSc with plain arrays. It is a shared library that is
!> loaded when a scene needs PETSc, so that other runs do not load PETSc and its 50 dependencies.
module petsc_solver
#include <petsc/finclude/petscksp.h>
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_f_procpointer, c_funptr, c_int, &
                                         c_loc, c_ptr
  use petscksp
  implicit none (type, external)
  private

  public :: assemble, solve_matrix, solve_shell, end_petsc, multiply_t

  integer, parameter :: rp = c_double

  !> Systems (diagonal + a G) x = b.
  type :: matrix_t
    Mat :: conductance                   !! G, over all cells in the solid
    Mat :: system                        !! diagonal + a G
    KSP :: ksp
    Vec :: b, x, d
  end type matrix_t

  abstract interface
    !> Collective. Product y = A x on the rows of this rank.
    subroutine multiply_t(n, x, y) bind(c)
      import :: c_double, c_int
      implicit none (type, external)
      integer(c_int), value :: n
      real(c_double), intent(in) :: x(n)
      real(c_double), intent(out) :: y(n)
    end subroutine multiply_t
  end interface

  ! PETSc passes only the matrix to callbacks: operator and diagonal of the solve in progress.
  procedure(multiply_t), pointer :: multiply => null()
  real(rp), pointer :: shell_diagonal(:) => null()

contains

  !> Collective. Assemble G, of which this rank has `n` rows with the entries `start(i)+1` to
  !> `start(i+1)` of `column` (from 0, over all ranks) and `value`. The solver is conjugate
  !> gradients with algebraic multigrid (ML where PETSc has it, else GAMG).
  function assemble(comm, n, start, column, value) result(handle) &
      bind(c, name='stirpoint_petsc_assemble')
    integer(c_int), value :: comm, n
    integer(c_int), intent(in) :: start(n + 1), column(*)
    real(c_double), intent(in) :: value(*)
    type(c_ptr) :: handle
    type(matrix_t), pointer :: m
    PetscErrorCode :: ierr

    call start_petsc(comm)
    allocate (m)
    handle = c_loc(m)
    call MatCreateMPIAIJWithArrays(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, &
                                   start, column, value, m%conductance, ierr)
    call MatDuplicate(m%conductance, MAT_COPY_VALUES, m%system, ierr)
    call MatSetOption(m%system, MAT_SPD, PETSC_TRUE, ierr)
    call VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DETERMINE, m%x, ierr)
    call VecDuplicate(m%x, m%b, ierr)
    call VecDuplicate(m%x, m%d, ierr)
    call make_solver(m)
  end function assemble

  !> Create a solver; its preconditioner is built in the first solve.
  subroutine make_solver(m)
    type(matrix_t), intent(inout) :: m
    PetscErrorCode :: ierr
    PC :: pc

    call KSPCreate(PETSC_COMM_WORLD, m%ksp, ierr)
    call KSPSetOperators(m%ksp, m%system, m%system, ierr)
    call KSPSetType(m%ksp, KSPCG, ierr)
    call KSPSetNormType(m%ksp, KSP_NORM_UNPRECONDITIONED, ierr)
    call KSPGetPC(m%ksp, pc, ierr)
#if defined(PETSC_HAVE_ML)
    call PCSetType(pc, PCML, ierr)
#else
    call PCSetType(pc, PCGAMG, ierr)
#endif
    call KSPSetFromOptions(m%ksp, ierr)
  end subroutine make_solver

  !> Collective. Solve (diagonal + a G) x = b until the residual is `relative` times b, with a new
  !> preconditioner if `is_new` is not 0. Returns KSPConvergedReason.
  integer(c_int) function solve_matrix(handle, n, is_new, diagonal, a, b, relative, x, iterations) &
      bind(c, name='stirpoint_petsc_solve')
    type(c_ptr), value :: handle
    integer(c_int), value :: n, is_new
    real(c_double), value :: a, relative
    real(c_double), intent(in) :: diagonal(n), b(n)
    real(c_double), intent(out) :: x(n)
    integer(c_int), intent(out) :: iterations
    type(matrix_t), pointer :: m
    KSPConvergedReason :: reason
    PetscErrorCode :: ierr

    call c_f_pointer(handle, m)
    call MatCopy(m%conductance, m%system, SAME_NONZERO_PATTERN, ierr)
    call MatScale(m%system, a, ierr)
    call set_entries(diagonal, m%d)
    call MatDiagonalSet(m%system, m%d, ADD_VALUES, ierr)
    if (is_new /= 0) then                ! a new solver, independent of earlier ones
      call KSPDestroy(m%ksp, ierr)
      call make_solver(m)
    else
      call KSPSetReusePreconditioner(m%ksp, PETSC_TRUE, ierr)
    end if
    call KSPSetTolerances(m%ksp, relative, PETSC_DEFAULT_REAL, PETSC_DEFAULT_REAL, &
                          PETSC_DEFAULT_INTEGER, ierr)
    call set_entries(b, m%b)
    call KSPSolve(m%ksp, m%b, m%x, ierr)
    call get_entries(m%x, x)
    call KSPGetIterationNumber(m%ksp, iterations, ierr)
    call KSPGetConvergedReason(m%ksp, reason, ierr)
    solve_matrix = int(reason, c_int)
  end function solve_matrix

  !> Collective. Solve A x = b for a symmetric A with the product `action` until the residual norm,
  !> with weight 1/diagonal that is also the preconditioner, is `relative` times that of b, or
  !> `absolute`. Returns KSPConvergedReason.
  integer(c_int) function solve_shell(comm, n, action, diagonal, b, relative, absolute, x, &
                                      iterations) &
      bind(c, name='stirpoint_petsc_solve_shell')
    integer(c_int), value :: comm, n
    type(c_funptr), value :: action
    real(c_double), intent(in), target :: diagonal(n)
    real(c_double), intent(in) :: b(n)
    real(c_double), value :: relative, absolute
    real(c_double), intent(out) :: x(n)
    integer(c_int), intent(out) :: iterations
    external :: MatCreateShell, MatShellSetOperation
    KSPConvergedReason :: reason
    PetscErrorCode :: ierr
    Mat :: a
    Vec :: right, left
    KSP :: ksp
    PC :: pc

    call start_petsc(comm)
    call c_f_procpointer(action, multiply)
    shell_diagonal => diagonal
    call MatCreateShell(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, &
                        PETSC_NULL_INTEGER, a, ierr)
    call MatShellSetOperation(a, MATOP_MULT, multiply_shell, ierr)
    call MatShellSetOperation(a, MATOP_GET_DIAGONAL, diagonal_of_shell, ierr)
    call VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DETERMINE, right, ierr)
    call VecDuplicate(right, left, ierr)
    call set_entries(b, right)
    call KSPCreate(PETSC_COMM_WORLD, ksp, ierr)
    call KSPSetOperators(ksp, a, a, ierr)
    call KSPSetType(ksp, KSPCG, ierr)
    call KSPSetNormType(ksp, KSP_NORM_NATURAL, ierr)
    call KSPGetPC(ksp, pc, ierr)
    call PCSetType(pc, PCJACOBI, ierr)
    call KSPSetTolerances(ksp, relative, absolute, PETSC_DEFAULT_REAL, PETSC_DEFAULT_INTEGER, ierr)
    call KSPSetFromOptions(ksp, ierr)
    call KSPSolve(ksp, right, left, ierr)
    call get_entries(left, x)
    call KSPGetIterationNumber(ksp, iterations, ierr)
    call KSPGetConvergedReason(ksp, reason, ierr)
    solve_shell = int(reason, c_int)
    call KSPDestroy(ksp, ierr)
    call MatDestroy(a, ierr)
    call VecDestroy(right, ierr)
    call VecDestroy(left, ierr)
  end function solve_shell

  !> Callback: product of the operator with a vector.
  subroutine multiply_shell(a, x, y, ierr)
    Mat :: a
    Vec :: x, y
    PetscErrorCode :: ierr
    PetscScalar, pointer :: from(:), to(:)

    call VecGetArrayReadF90(x, from, ierr)
    call VecGetArrayF90(y, to, ierr)
    call multiply(size(from), from, to)
    call VecRestoreArrayF90(y, to, ierr)
    call VecRestoreArrayReadF90(x, from, ierr)
  end subroutine multiply_shell

  !> Callback: diagonal of the operator.
  subroutine diagonal_of_shell(a, d, ierr)
    Mat :: a
    Vec :: d
    PetscErrorCode :: ierr

    ierr = 0
    call set_entries(shell_diagonal, d)
  end subroutine diagonal_of_shell

  !> Copy this rank's entries into a vector.
  subroutine set_entries(values, v)
    real(rp), intent(in) :: values(:)
    Vec :: v
    PetscScalar, pointer :: entries(:)
    PetscErrorCode :: ierr

    call VecGetArrayF90(v, entries, ierr)
    entries = values
    call VecRestoreArrayF90(v, entries, ierr)
  end subroutine set_entries

  !> Copy this rank's entries out of a vector.
  subroutine get_entries(v, values)
    Vec :: v
    real(rp), intent(out) :: values(:)
    PetscScalar, pointer :: entries(:)
    PetscErrorCode :: ierr

    call VecGetArrayReadF90(v, entries, ierr)
    values = entries
    call VecRestoreArrayReadF90(v, entries, ierr)
  end subroutine get_entries

  !> Collective. Initialize PETSc once. Signal handling stays with the program; errors of PETSc
  !> abort all ranks with a message, so that `ierr` need not be checked.
  subroutine start_petsc(comm)
    integer(c_int), value :: comm
    PetscErrorCode :: ierr
    PetscBool :: is_initialized

    call PetscInitialized(is_initialized, ierr)
    if (is_initialized) return
    PETSC_COMM_WORLD = comm
    call PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-no_signal_handler', 'true', ierr)
    call PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-on_error_mpiabort', 'true', ierr)
    call PetscInitialize(PETSC_NULL_CHARACTER, ierr)
  end subroutine start_petsc

  !> Finalize PETSc; before MPI ends.
  subroutine end_petsc() bind(c, name='stirpoint_petsc_end')
    PetscErrorCode :: ierr
    PetscBool :: is_initialized

    call PetscInitialized(is_initialized, ierr)
    if (is_initialized) call PetscFinalize(ierr)
  end subroutine end_petsc

end module petsc_solver
