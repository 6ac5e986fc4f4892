! SPDX-License-Identifier: MIT
!> Energies, impulses and counts that a rank accumulates since t = 0. Tools keep their own sums.
module state_budget
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: budget_t

  ! Indices of energies [J].
  integer, parameter, public :: &
    e_plastic = 1, &       !! plastic work
    e_body = 2, &          !! work of gravity, body loads and tractions
    e_wall = 3, &          !! work of walls and prescribed velocities
    e_stress = 4, &        !! work of the stresses on the material, and of volume averaging
    e_film = 5, &          !! heat lost through films on faces
    e_wall_heat = 6, &     !! heat given by walls
    e_source = 7, &        !! heat of the sources
    e_friction = 8, &      !! friction heat between deformable bodies
    e_contact = 9, &       !! energy lost in normal contact between deformable bodies
    e_scaling = 10, &      !! kinetic energy given by changes of the mass scaling
    e_conduction = 11, &   !! heat added by rounding in conduction steps
    e_sleep = 12, &        !! kinetic energy removed from sleepers, and work of holding their nodes
    e_normal_loss = 13, &  !! losses, without gains, of node pairs in normal contact of two
                           !! deformable bodies
    ! Energies and mass of removed debris:
    d_kinetic = 14, d_elastic = 15, d_heat = 16, &
    d_mass = 17         !! [kg]
  integer, parameter, public :: &
    e_tool = 18         !! heat that tools take from the bodies
  integer, parameter, public :: n_sums = 18

  !> Accumulated sums; one assignment restores them after a refused step (exchange_speculation).
  type :: budget_t
    real(rp) :: sums(n_sums) = 0.0_rp             !! energies by the indices above [J]
    real(rp), allocatable :: impulse(:, :)        !! (3, conditions) impulse of walls and clamps on
                                                  !! this rank's particles [N s]
    integer :: failed_returns = 0                 !! return mappings that did not converge
    real(rp), allocatable :: warnings(:)          !! particle-steps outside the validity range of a
                                                  !! flow law, by warning
    real(rp), allocatable :: warning_place(:, :)  !! (5, warnings) time [s], temperature [K] and
                                                  !! position [m] of the first occurrence
  end type budget_t

end module state_budget
