! SPDX-License-Identifier: MIT
!> Abstract linear operator, defined by its product with a vector.
module heat_solvers_operator
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: operator_t

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

end module heat_solvers_operator
