! SPDX-License-Identifier: MIT
!> Linear systems by PETSc, through a shared library (modules/petsc/solver.F90) that is loaded when
!> a scene needs it. Options of PETSc are read from the environment variable PETSC_OPTIONS.
module heat_petsc
  use, intrinsic :: iso_c_binding, only: c_double, c_f_procpointer, c_funloc, c_funptr, c_int, &
                                         c_null_ptr, c_ptr
  use base_errors, only: fatal
  use base_kinds, only: rp
  use base_system, only: open_library, symbol_of
  use base_text, only: str
  use base_version, only: petsc_library
  use base_world, only: world_t
  use heat_rates, only: heat_t
  implicit none (type, external)
  private

  public :: end_petsc, operator_t, petsc_t, petsc_trouble, solve_by_petsc

  !> Change of the step by which the preconditioner is rebuilt.
  real(rp), parameter :: reuse_factor = 1.5_rp

  !> A linear operator, defined by its product with a vector.
  type, abstract :: operator_t
  contains
    procedure(multiply), deferred :: multiply
  end type operator_t

  abstract interface
    !> Collective. Product y = A x on the rows of this rank.
    subroutine multiply(self, x, y)
      import :: operator_t, rp
      implicit none (type, external)
      class(operator_t), intent(inout) :: self
      real(rp), intent(in) :: x(:)
      real(rp), intent(out) :: y(:)
    end subroutine multiply
  end interface

  !> Systems (diagonal + a G) x = b of the cells in the solid.
  type :: petsc_t
    type(c_ptr), private :: matrix = c_null_ptr
    integer, allocatable, private :: row(:)   !! cells in the solid
    real(rp), private :: built_for = 0.0_rp   !! implicit step of the preconditioner [s]; 0: none
    !> Diagonal with which the preconditioner was built [J/K].
    real(rp), allocatable, private :: built_from(:)
  contains
    procedure :: start, solve, pack_restart_data, unpack_restart_data
  end type petsc_t

  abstract interface
    function assemble_t(comm, n, start, column, value) bind(c) result(handle)
      import :: c_double, c_int, c_ptr
      implicit none (type, external)
      integer(c_int), value :: comm, n
      integer(c_int), intent(in) :: start(n + 1), column(*)
      real(c_double), intent(in) :: value(*)
      type(c_ptr) :: handle
    end function assemble_t

    integer(c_int) function solve_matrix_t(handle, n, is_new, diagonal, a, b, relative, x, &
                                           iterations) bind(c)
      import :: c_double, c_int, c_ptr
      implicit none (type, external)
      type(c_ptr), value :: handle
      integer(c_int), value :: n, is_new
      real(c_double), value :: a, relative
      real(c_double), intent(in) :: diagonal(n), b(n)
      real(c_double), intent(out) :: x(n)
      integer(c_int), intent(out) :: iterations
    end function solve_matrix_t

    integer(c_int) function solve_shell_t(comm, n, action, diagonal, b, relative, absolute, x, &
                                          iterations) bind(c)
      import :: c_double, c_funptr, c_int
      implicit none (type, external)
      integer(c_int), value :: comm, n
      type(c_funptr), value :: action
      real(c_double), intent(in) :: diagonal(n), b(n)
      real(c_double), value :: relative, absolute
      real(c_double), intent(out) :: x(n)
      integer(c_int), intent(out) :: iterations
    end function solve_shell_t

    subroutine end_t() bind(c)
      implicit none (type, external)
    end subroutine end_t
  end interface

  logical :: is_open = .false.
  procedure(assemble_t), pointer :: assemble => null()
  procedure(solve_matrix_t), pointer :: solve_matrix => null()
  procedure(solve_shell_t), pointer :: solve_shell => null()
  procedure(end_t), pointer :: end_library => null()
  class(operator_t), pointer :: shell_operator => null()  !! operator of the solve in progress

contains

  !> Load PETSc; message why this is not possible, or ''.
  function petsc_trouble() result(text)
    character(:), allocatable :: text

    text = ''
    if (is_open) return
    if (petsc_library == '') then
      text = 'this program was built without PETSc (Debian: libpetsc-real-dev; '// &
             '-DSTIRPOINT_PETSC=ON)'
      return
    end if
    call open_library(petsc_library, text)
    if (text /= '') then
      text = 'PETSc cannot be loaded: '//text
      return
    end if
    call c_f_procpointer(symbol_of('stirpoint_petsc_assemble'), assemble)
    call c_f_procpointer(symbol_of('stirpoint_petsc_solve'), solve_matrix)
    call c_f_procpointer(symbol_of('stirpoint_petsc_solve_shell'), solve_shell)
    call c_f_procpointer(symbol_of('stirpoint_petsc_end'), end_library)
    is_open = .true.
  end function petsc_trouble

  !> Collective. Assemble the conductance matrix from the rates of all cells.
  subroutine start(self, heat, rate)
    class(petsc_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: rate(:, :)            !! (6, cells) rates to the neighbours [1/s]
    real(rp), allocatable :: number(:)
    integer :: rows(0:heat%world%size - 1), step(6), first, i, k, n
    integer, allocatable :: begin(:), column(:)
    real(rp), allocatable :: value(:)

    call require_petsc()
    associate (mesh => heat%mesh)
      self%row = pack([(i, i=1, size(mesh%capacity))], mesh%capacity > 0.0_rp)
      rows = 0
      rows(heat%world%rank) = size(self%row)
      call heat%world%sum(rows)
      first = sum(rows(:heat%world%rank - 1))
      allocate (number(1 - mesh%np:mesh%np*(mesh%nx + 1)), source=-1.0_rp)
      number(self%row) = [(real(first + i - 1, rp), i=1, size(self%row))]
      call mesh%swap(heat%world, number)
      step = [-mesh%np, mesh%np, -mesh%n(3), mesh%n(3), -1, 1]
      allocate (begin(size(self%row) + 1), column(7*size(self%row)), value(7*size(self%row)))
      n = 0
      do i = 1, size(self%row)
        associate (c => self%row(i))
          begin(i) = n
          call add(first + i - 1, sum(rate(:, c))*mesh%capacity(c))
          do k = 1, 6
            if (rate(k, c) > 0.0_rp) call add(nint(number(c + step(k))), &
                                              -rate(k, c)*mesh%capacity(c))
          end do
        end associate
      end do
      begin(size(begin)) = n
    end associate
    self%matrix = assemble(heat%world%comm%mpi_val, size(self%row), begin, column, value)
  contains
    !> Add an entry of the matrix.
    subroutine add(column_index, entry)
      integer, intent(in) :: column_index
      real(rp), intent(in) :: entry

      n = n + 1
      column(n) = column_index
      value(n) = entry
    end subroutine add
  end subroutine start

  !> Collective. Solve (diagonal + a G) x = b.
  subroutine solve(self, diagonal, a, b, relative, x, iterations)
    class(petsc_t), intent(inout) :: self
    real(rp), intent(in) :: diagonal(:), a, b(:), relative
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations
    real(rp), allocatable :: solution(:)
    logical :: is_new

    is_new = a > reuse_factor*self%built_for .or. reuse_factor*a < self%built_for
    if (is_new) self%built_for = a
    if (is_new) self%built_from = diagonal
    allocate (solution(size(self%row)))
    call check_convergence(solve_matrix(self%matrix, size(self%row), merge(1, 0, is_new), &
                                        diagonal(self%row), a, b(self%row), relative, solution, &
                                          iterations))
    x = 0.0_rp
    x(self%row) = solution
  end subroutine solve

  !> Data of the preconditioner for a restart; zero if there is none.
  subroutine pack_restart_data(self, diagonal, a)
    class(petsc_t), intent(in) :: self
    real(rp), intent(out) :: diagonal(:), a

    diagonal = 0.0_rp
    a = self%built_for
    if (allocated(self%built_from)) diagonal = self%built_from
  end subroutine pack_restart_data

  !> Collective. Rebuild the preconditioner from the data of `pack_restart_data`.
  subroutine unpack_restart_data(self, diagonal, a)
    class(petsc_t), intent(inout) :: self
    real(rp), intent(in) :: diagonal(:), a
    real(rp) :: x(size(diagonal))
    integer :: iterations

    if (a > 0.0_rp) call self%solve(diagonal, a, diagonal, 0.1_rp, x, iterations)
  end subroutine unpack_restart_data

  !> Collective. Solve A x = b for a symmetric operator until the residual norm, with weight
  !> 1/diagonal that is also the preconditioner, is `relative` times that of b, or `absolute`.
  subroutine solve_by_petsc(world, operator, diagonal, b, relative, absolute, x, iterations)
    type(world_t), intent(in) :: world
    class(operator_t), intent(inout), target :: operator
    real(rp), intent(in) :: diagonal(:), b(:), relative, absolute
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations

    call require_petsc()
    shell_operator => operator
    call check_convergence(solve_shell(world%comm%mpi_val, size(b), c_funloc(multiply_shell), &
                                       diagonal, b, relative, absolute, x, iterations))
  end subroutine solve_by_petsc

  !> Callback of PETSc in `solve_by_petsc`: product with the operator.
  subroutine multiply_shell(n, x, y) bind(c)
    integer(c_int), value :: n
    real(c_double), intent(in) :: x(n)
    real(c_double), intent(out) :: y(n)

    call shell_operator%multiply(x, y)
  end subroutine multiply_shell

  !> Finalize PETSc; before MPI ends.
  subroutine end_petsc()
    if (is_open) call end_library()
  end subroutine end_petsc

  !> Abort if PETSc cannot be loaded.
  subroutine require_petsc()
    character(:), allocatable :: problem

    problem = petsc_trouble()
    if (problem /= '') call fatal(problem)
  end subroutine require_petsc

  !> Abort if a solve has not converged.
  subroutine check_convergence(reason)
    integer(c_int), intent(in) :: reason

    if (reason < 0) then
      call fatal('PETSc did not solve for the conduction step (KSPConvergedReason '// &
                 str(int(reason))//'): shorten &HEAT STEP')
    end if
  end subroutine check_convergence

end module heat_petsc
