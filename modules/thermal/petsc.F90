! SPDX-License-Identifier: MIT
!> The linear systems of an implicit step by PETSc: conjugate gradients with algebraic multigrid (ML
!> where PETSc has it, else GAMG; options of PETSc in the environment variable PETSC_OPTIONS).
module thermal_petsc
#include <petsc/finclude/petscksp.h>
  use petscksp
  use base_kinds, only: rp
  use comm_world, only: world_t
  use thermal_rates, only: heat_t
  implicit none (type, external)
  private

  public :: petsc_t, has_petsc, start_petsc, end_petsc

  logical, parameter :: has_petsc = .true.
  real(rp), parameter :: keep = 1.5_rp   !! the preconditioner lasts while steps change less than so

  type :: petsc_t
    Mat, private :: conductance            !! G, over all cells in the solid
    Mat, private :: system                 !! diagonal + a G
    KSP, private :: ksp
    Vec, private :: b, x, d
    integer, allocatable, private :: row(:)   !! cells in the solid
    real(rp), private :: built_for = 0.0_rp
  contains
    procedure :: start
    procedure :: solve
    procedure :: forget
  end type petsc_t

contains

  !> Assemble the conductances from the rates of all cells.
  subroutine start(self, heat, rate)
    class(petsc_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: rate(:, :)            !! (6, cells) [1/s]
    real(rp), allocatable :: number(:)
    PetscErrorCode :: ierr
    PetscInt :: n_own, first, column(7), n, c, i
    PetscScalar :: value(7)
    PC :: pc
    integer :: step(6)

    call start_petsc(heat%world)
    associate (mesh => heat%mesh)
      self%row = pack([(i, i=1, size(mesh%capacity))], mesh%capacity > 0.0_rp)
      n_own = size(self%row)
      call MatCreateAIJ(PETSC_COMM_WORLD, n_own, n_own, PETSC_DETERMINE, PETSC_DETERMINE, 7, &
                        PETSC_NULL_INTEGER, 3, PETSC_NULL_INTEGER, self%conductance, ierr)
      call MatGetOwnershipRange(self%conductance, first, PETSC_NULL_INTEGER, ierr)
      allocate (number(1 - mesh%np:mesh%np*(mesh%nx + 1)), source=-1.0_rp)
      number(self%row) = [(real(first + i - 1, rp), i=1, n_own)]
      call mesh%swap(heat%world, number)
      step = [-mesh%np, mesh%np, -mesh%n(3), mesh%n(3), -1, 1]
      do i = 1, n_own
        c = self%row(i)
        n = 1
        column(1) = first + i - 1
        value(1) = sum(rate(:, c))*mesh%capacity(c)
        call add_neighbours()
        call MatSetValues(self%conductance, 1, column(1:1), n, column, value, INSERT_VALUES, ierr)
      end do
    end associate
    call MatAssemblyBegin(self%conductance, MAT_FINAL_ASSEMBLY, ierr)
    call MatAssemblyEnd(self%conductance, MAT_FINAL_ASSEMBLY, ierr)
    call MatDuplicate(self%conductance, MAT_COPY_VALUES, self%system, ierr)
    call MatSetOption(self%system, MAT_SPD, PETSC_TRUE, ierr)
    call VecCreateMPI(PETSC_COMM_WORLD, n_own, PETSC_DETERMINE, self%x, ierr)
    call VecDuplicate(self%x, self%b, ierr)
    call VecDuplicate(self%x, self%d, ierr)
    call KSPCreate(PETSC_COMM_WORLD, self%ksp, ierr)
    call KSPSetOperators(self%ksp, self%system, self%system, ierr)
    call KSPSetType(self%ksp, KSPCG, ierr)
    call KSPSetNormType(self%ksp, KSP_NORM_UNPRECONDITIONED, ierr)
    call KSPGetPC(self%ksp, pc, ierr)
#if defined(PETSC_HAVE_ML)
    call PCSetType(pc, PCML, ierr)
#else
    call PCSetType(pc, PCGAMG, ierr)
#endif
    call KSPSetFromOptions(self%ksp, ierr)
  contains
    subroutine add_neighbours()
      integer :: k

      do k = 1, 6
        if (rate(k, c) <= 0.0_rp) cycle
        n = n + 1
        column(n) = nint(number(c + step(k)))
        value(n) = -rate(k, c)*heat%mesh%capacity(c)
      end do
    end subroutine add_neighbours
  end subroutine start

  !> Collective: (diagonal + a G) x = b.
  subroutine solve(self, diagonal, a, b, relative, x, iterations)
    class(petsc_t), intent(inout) :: self
    real(rp), intent(in) :: diagonal(:), a, b(:), relative
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations
    PetscErrorCode :: ierr
    PetscScalar, pointer :: v(:)

    call MatCopy(self%conductance, self%system, SAME_NONZERO_PATTERN, ierr)
    call MatScale(self%system, a, ierr)
    call VecGetArrayF90(self%d, v, ierr)
    v = diagonal(self%row)
    call VecRestoreArrayF90(self%d, v, ierr)
    call MatDiagonalSet(self%system, self%d, ADD_VALUES, ierr)
    if (a > keep*self%built_for .or. keep*a < self%built_for) then
      self%built_for = a
      call KSPSetReusePreconditioner(self%ksp, PETSC_FALSE, ierr)
    else
      call KSPSetReusePreconditioner(self%ksp, PETSC_TRUE, ierr)
    end if
    call KSPSetTolerances(self%ksp, relative, PETSC_DEFAULT_REAL, PETSC_DEFAULT_REAL, &
                          PETSC_DEFAULT_INTEGER, ierr)
    call VecGetArrayF90(self%b, v, ierr)
    v = b(self%row)
    call VecRestoreArrayF90(self%b, v, ierr)
    call KSPSolve(self%ksp, self%b, self%x, ierr)
    call KSPGetIterationNumber(self%ksp, iterations, ierr)
    x = 0.0_rp
    call VecGetArrayF90(self%x, v, ierr)
    x(self%row) = v
    call VecRestoreArrayF90(self%x, v, ierr)
  end subroutine solve

  !> Build the preconditioner anew in the next solve.
  subroutine forget(self)
    class(petsc_t), intent(inout) :: self

    self%built_for = 0.0_rp
  end subroutine forget

  !> Collective: start PETSc if need be.
  subroutine start_petsc(world)
    type(world_t), intent(in) :: world
    PetscErrorCode :: ierr
    PetscBool :: is_there

    call PetscInitialized(is_there, ierr)
    if (is_there) return
    PETSC_COMM_WORLD = world%comm%mpi_val
    call PetscInitialize(PETSC_NULL_CHARACTER, ierr)
  end subroutine start_petsc

  !> Before MPI ends.
  subroutine end_petsc()
    PetscErrorCode :: ierr
    PetscBool :: is_there

    call PetscInitialized(is_there, ierr)
    if (is_there) call PetscFinalize(ierr)
  end subroutine end_petsc

end module thermal_petsc
