! SPDX-License-Identifier: MIT
!> A symmetry plane: a wall on a row of nodes with no material behind it (boundary_symmetry).
module conditions_symmetry
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: symmetry_t

  type :: symmetry_t
    integer :: place = 0                  !! index among the conditions of the scene
    integer :: axis = 1                   !! axis normal to the plane
    integer :: row = 0                    !! row of grid nodes on the plane, from 0
    logical :: faces_up = .true.          !! the bodies are above the plane
    logical :: odd(3) = .false.           !! components of the velocity that change sign
    real(rp) :: temperature = 0.0_rp      !! temperature of the plane [K]; 0: insulated
  end type symmetry_t

end module conditions_symmetry
