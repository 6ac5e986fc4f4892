! SPDX-License-Identifier: MIT
!> A plane of symmetry: a wall on a row of nodes with no material behind it (boundary_symmetry).
module conditions_symmetry
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: symmetry_t

  type :: symmetry_t
    integer :: place = 0                  !! among the conditions of the scene
    integer :: axis = 1                   !! normal
    integer :: row = 0                    !! of grid nodes on it, from 0
    logical :: faces_up = .true.          !! the bodies lie above it
    logical :: odd(3) = .false.           !! components of the velocity that it turns round
    real(rp) :: temperature = 0.0_rp      !! on it [K]; 0: insulated
  end type symmetry_t

end module conditions_symmetry
