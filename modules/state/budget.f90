! SPDX-License-Identifier: MIT
!> Sums over the steps of a run on this rank: energies, impulses, counts and warnings.
module state_budget
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: budget_t

  type :: sum_t
    character(16) :: name    !! in checkpoints and, if it is a column, in the history
    character(2) :: unit
  end type sum_t

  !> Sums over the steps of a run; history and checkpoint take names and units from here.
  type(sum_t), parameter, public :: sum_of(*) = [ &
    sum_t('plastic_work', 'J'), &       ! plastic work
    sum_t('body_work', 'J'), &          ! work of gravity, body loads and tractions
    sum_t('wall_work', 'J'), &          ! work of walls and prescribed velocities
    sum_t('stress_work', 'J'), &        ! work of the stresses and of volume averaging
    sum_t('film_loss', 'J'), &          ! heat lost through films on faces
    sum_t('wall_heat', 'J'), &          ! heat that walls give to the bodies
    sum_t('source_heat', 'J'), &        ! heat of the heat sources
    sum_t('body_friction', 'J'), &      ! friction heat between deformable bodies
    sum_t('body_contact', 'J'), &       ! energy lost in normal contact between deformable bodies
    sum_t('scaling_work', 'J'), &       ! kinetic energy given by changes of the mass scaling
    sum_t('conduction_gain', 'J'), &    ! heat added by rounding in conduction steps
    sum_t('sleep_loss', 'J'), &         ! kinetic energy taken from sleepers and held nodes
    sum_t('body_normal_loss', 'J'), &   ! the losses of body_contact without its gains
    sum_t('debris_kinetic', 'J'), &     ! kinetic energy of removed debris
    sum_t('debris_elastic', 'J'), &     ! elastic energy of removed debris
    sum_t('debris_heat', 'J'), &        ! heat content of removed debris
    sum_t('debris_mass', 'kg'), &       ! mass of removed debris
    sum_t('tool_gain', 'J')]            ! heat that tools take from the bodies
  integer, parameter, public :: n_sums = size(sum_of)

  ! Their indices.
  integer, parameter, public :: &
    e_plastic = findloc(sum_of%name, 'plastic_work', 1), &
    e_body = findloc(sum_of%name, 'body_work', 1), &
    e_wall = findloc(sum_of%name, 'wall_work', 1), &
    e_stress = findloc(sum_of%name, 'stress_work', 1), &
    e_film = findloc(sum_of%name, 'film_loss', 1), &
    e_wall_heat = findloc(sum_of%name, 'wall_heat', 1), &
    e_source = findloc(sum_of%name, 'source_heat', 1), &
    e_friction = findloc(sum_of%name, 'body_friction', 1), &
    e_contact = findloc(sum_of%name, 'body_contact', 1), &
    e_scaling = findloc(sum_of%name, 'scaling_work', 1), &
    e_conduction = findloc(sum_of%name, 'conduction_gain', 1), &
    e_sleep = findloc(sum_of%name, 'sleep_loss', 1), &
    e_normal_loss = findloc(sum_of%name, 'body_normal_loss', 1), &
    d_kinetic = findloc(sum_of%name, 'debris_kinetic', 1), &
    d_elastic = findloc(sum_of%name, 'debris_elastic', 1), &
    d_heat = findloc(sum_of%name, 'debris_heat', 1), &
    d_mass = findloc(sum_of%name, 'debris_mass', 1), &
    e_tool = findloc(sum_of%name, 'tool_gain', 1)

  !> Energies, impulses and counts that a rank accumulates since t = 0; tools keep their own sums.
  !> One assignment restores them after a refused step (step_schedule).
  type :: budget_t
    real(rp) :: sums(n_sums) = 0.0_rp             !! of `sum_of`
    !> Impulse of walls and clamps on this rank's particles [N s], (3, conditions).
    real(rp), allocatable :: impulse(:, :)
    real(rp), allocatable :: hooks(:)             !! sums of the hooks (state_parts)
    integer :: failed_returns = 0                 !! return mappings that did not converge
    !> Particle-steps outside the validity range of a flow law, by warning.
    real(rp), allocatable :: warnings(:)
    !> Time [s], temperature [K] and position [m] of the first occurrence, (5, warnings).
    real(rp), allocatable :: warning_place(:, :)
  end type budget_t

end module state_budget
