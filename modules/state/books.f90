! SPDX-License-Identifier: MIT
!> What a rank books since t = 0; tools keep their own books.
module state_books
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: books_t

  ! Energies [J].
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
    e_conduction = 11, &  !! heat that conduction steps have made: rounding
    e_sleep = 12, &     !! kinetic energy of what falls asleep, and what holding sleepers takes
    e_pressed = 13, &   !! loss of nodes in normal contact of two that deform, no gains
    ! of what has left the grid:
    d_kinetic = 14, d_elastic = 15, d_heat = 16, &
    d_mass = 17         !! [kg]
  integer, parameter, public :: &
    e_tool = 18         !! heat that tools take from the bodies
  integer, parameter, public :: n_sums = 18

  !> All that a step adds to: what is refused is given back by one assignment
  !> (exchange_speculation).
  type :: books_t
    real(rp) :: sums(n_sums) = 0.0_rp        !! energies, by the names above [J]
    real(rp), allocatable :: impulse(:, :)   !! (3, conditions) on this rank's particles [N s]
    integer :: failed_returns = 0            !! particle-steps whose return mapping did not converge
    real(rp), allocatable :: warnings(:)     !! particle-steps outside the validity of a flow law
    real(rp), allocatable :: warning_place(:, :)   !! (5, warnings) time, temperature and place of
                                                   !! the first
  end type books_t

end module state_books
