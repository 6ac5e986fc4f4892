! SPDX-License-Identifier: MIT
!> Names of the energy books that a rank keeps since t = 0 [J]; tools keep their own.
module time_audit
  implicit none (type, external)
  private

  integer, parameter, public :: &
    e_plastic = 1, &    !! plastic work
    e_body = 2, &       !! work of gravity, body loads and tractions
    e_wall = 3, &       !! work of walls and prescribed velocities
    e_stress = 4, &     !! work of the stresses on the material, and of the averaging of volume
    e_film = 5, &       !! heat lost through the faces
    e_wall_heat = 6, &  !! heat given by walls
    e_source = 7, &     !! heat of the sources
    e_friction = 8, &   !! friction heat between deformable bodies
    e_contact = 9, &    !! energy lost in normal contact between deformable bodies
    e_scaling = 10, &    !! kinetic energy given by changes of the mass scaling
    e_conduction = 11   !! heat that conduction steps have made: rounding
  integer, parameter, public :: n_sums = 11

end module time_audit
