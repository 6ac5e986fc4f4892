! SPDX-License-Identifier: MIT
!> Boundary conditions of the nodes. A wall is a plane of symmetry if it stands on a row of nodes
!> and has no material behind it, else a clamp without ends.
module state_conditions
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: clamp_t, symmetry_t

  !> A plane of symmetry (boundary_symmetry).
  type :: symmetry_t
    integer :: place = 0                  !! among the conditions of the scene
    integer :: axis = 1                   !! normal
    integer :: row = 0                    !! of grid nodes on it, from 0
    logical :: faces_up = .true.          !! the bodies lie above it
    logical :: odd(3) = .false.           !! components of the velocity that it turns round
    real(rp) :: temperature = 0.0_rp      !! on it [K]; 0: insulated
  end type symmetry_t

  !> Nodes in a box move with a given velocity (boundary_clamps).
  type :: clamp_t
    integer :: place = 0                  !! among the conditions of the scene
    real(rp) :: lower(3) = -huge(1.0_rp)  !! [m]; huge: there is no face
    real(rp) :: upper(3) = huge(1.0_rp)
    logical :: held(3) = .true.           !! components of the velocity
    real(rp) :: velocity(3) = 0.0_rp      !! [m/s]
  end type clamp_t

end module state_conditions
