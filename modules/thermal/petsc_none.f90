! SPDX-License-Identifier: MIT
!> Stands in for `petsc.F90` in a build without PETSc; the set-up does not let a scene choose it.
module thermal_petsc
  use base_errors, only: fatal
  use base_kinds, only: rp
  use thermal_rates, only: heat_t
  implicit none (type, external)
  private

  public :: petsc_t, has_petsc, end_petsc

  logical, parameter :: has_petsc = .false.

  type :: petsc_t
  contains
    procedure :: start
    procedure :: solve
    procedure :: forget
  end type petsc_t

contains

  subroutine start(self, heat, rate)
    class(petsc_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: rate(:, :)

    call fatal('this program was built without PETSc')
  end subroutine start

  subroutine solve(self, diagonal, a, b, relative, x, iterations)
    class(petsc_t), intent(inout) :: self
    real(rp), intent(in) :: diagonal(:), a, b(:), relative
    real(rp), intent(out) :: x(:)
    integer, intent(out) :: iterations

    x = b
    iterations = 0
  end subroutine solve

  subroutine forget(self)
    class(petsc_t), intent(inout) :: self
  end subroutine forget

  subroutine end_petsc()
  end subroutine end_petsc

end module thermal_petsc
