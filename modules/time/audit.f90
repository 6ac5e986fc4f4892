! SPDX-License-Identifier: MIT
!> Names of the energy books that a rank keeps since t = 0 [J]; tools keep their own.
module time_audit
  implicit none (type, external)
  private

  integer, parameter, public :: &
    e_plastic = 1, &    !! plastic work
    e_body = 2, &       !! work of gravity and body loads
    e_wall = 3, &       !! work of walls and prescribed velocities
    e_stress = 4, &     !! work of the stresses on the material, and of the averaging of volume
    e_film = 5, &       !! heat lost through the faces
    e_friction = 6, &   !! friction heat between deformable bodies
    e_contact = 7       !! energy lost in normal contact between deformable bodies
  integer, parameter, public :: n_sums = 7

end module time_audit
