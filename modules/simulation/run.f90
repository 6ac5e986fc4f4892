! SPDX-License-Identifier: MIT
!> State of a run on this rank: clock, current step, roles of the particle blocks, accumulated
!> sums, data shared with the other ranks, material at rest.
module simulation_run
  use base_kinds, only: i8, rp
  use base_world, only: reduction_t
  use grid_geometry, only: box_t
  implicit none (type, external)
  private

  public :: budget_t, clock_t, exchange_t, motion_t, outcome_t, sleepers_t, step_t

  !> Maxima over the particles of this rank at the end of a step, which the acceptance of the next
  !> step uses.
  type :: outcome_t
    real(rp) :: stiffness = 0.0_rp       !! largest squared wave speed [m2/s2]
    real(rp) :: speed2 = 0.0_rp          !! largest squared grid velocity at a particle [m2/s2]
  end type outcome_t

  !> The current step and its results.
  type :: step_t
    integer :: scheme = 1               !! when this step updates the stress (`scheme_usl`)
    real(rp) :: attempted_dt = 0.0_rp   !! time step before any refusal [s]
    real(rp) :: force_time = 0.0_rp     !! time at which external forces are evaluated [s]
    real(rp) :: pic = 0.0_rp            !! PIC fraction of this step
    type(outcome_t) :: last             !! maxima of the last step
    integer :: fastest_node = 0         !! fastest node of this rank
    real(rp) :: fastest_speed = 0.0_rp  !! speed of the fastest node [m/s]
    logical :: lost_row = .false.       !! a history row could not be written, on rank 0
    real(rp) :: secured = 0.0_rp        !! wall-clock time of the last checkpoint [s]
    ! Set by the acceptance of the step, equal on all ranks:
    logical, allocatable :: is_near(:)       !! tools that particles of any rank may touch
    logical :: is_broken = .false.           !! no step is possible from this state
    character(:), allocatable :: reason      !! cause, if the state does not show it
    logical :: is_unsolved = .false.         !! an implicit conduction step did not converge
    integer :: signal = 0                    !! signal that arrived on any rank; 0: none
    logical :: output_is_lost = .false.      !! a row of the output could not be written
    logical :: safety_is_due = .false.       !! a checkpoint against a crash is due
    integer :: worst_returns = 0             !! largest number of failed return mappings of any rank
  end type step_t

  !> Simulated time and the quantities that determine the next step: equal on all ranks, stored in
  !> checkpoints; `now` is neither.
  type :: clock_t
    type(step_t) :: now                  !! the current step on this rank
    integer(i8) :: step = 0
    real(rp) :: time = 0.0_rp, dt = 0.0_rp
    integer(i8) :: sorted_at = -1        !! step of the last sort
    real(rp) :: displacement = 0.0_rp    !! largest particle displacement since the last sort [m]
    real(rp) :: heat_time = 0.0_rp       !! time of the last conduction step [s]
    real(rp) :: heat_step = 0.0_rp       !! next conduction step [s]; 0: none yet
    !> Largest rise of a particle by waiting heat before the last step [K].
    real(rp) :: warming = 0.0_rp
    real(rp) :: next_frame = 0.0_rp, next_history = 0.0_rp, next_checkpoint = 0.0_rp
    real(rp) :: max_speed = 0.0_rp  !! largest grid velocity at a particle in the last step [m/s]
    integer(i8) :: refused = 0          !! steps that were repeated with a smaller dt
    real(rp) :: stiffness = 0.0_rp      !! largest squared wave speed without mass scaling [m2/s2]
    real(rp) :: mass_scaling = 1.0_rp   !! factor on inertia
    integer :: fragments = 0            !! 1 if there are fragments of a cell or less
    logical :: scales_light = .true.    !! SELECTIVE_SCALING acts in this step
    logical :: is_stopped = .false.     !! a tool limit has ended the run
    real(rp) :: inertial_peak = 0.0_rp  !! decaying maximum of rho v^2 over flow stress [-]
  end type clock_t

  !> Reach of the particles of a block until the next sort: a cell of motion and half a cell of
  !> support.
  real(rp), parameter, public :: skin = 1.5_rp   !! [cells]

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
    real(rp), allocatable :: hooks(:)             !! sums of the hooks (simulation_parts)
    integer :: failed_returns = 0                 !! return mappings that did not converge
    !> Particle-steps outside the validity range of a flow law, by warning.
    real(rp), allocatable :: warnings(:)
    !> Time [s], temperature [K] and position [m] of the first occurrence, (5, warnings).
    real(rp), allocatable :: warning_place(:, :)
  end type budget_t

  !> Load imbalance of the steps of this run: the most loaded rank over the mean.
  type :: balance_t
    real(rp) :: now = 1.0_rp                  !! imbalance until the next sort
    real(rp) :: worst = 1.0_rp                !! largest value over the steps
    real(rp) :: sum = 0.0_rp                  !! sum over the steps
    integer :: cuts = 0                       !! partitions of the grid, including the first one
    real(rp) :: waited = 0.0_rp  !! time that this rank waited for the reductions of the steps [s]
  end type balance_t

  !> Blocks updated before all ranks have accepted the step, and the state restored after a refusal
  !> (step_schedule).
  type :: speculation_t
    logical :: is_possible = .false.         !! speculation is possible in this step
    integer :: n_done = 0  !! blocks already updated, in the order of particles%order
    real(rp), allocatable :: saved(:, :, :)  !! particles of these blocks before the update
    type(budget_t) :: budget                 !! budget before the step
  end type speculation_t

  !> Data that the ranks share in a step.
  type :: exchange_t
    type(box_t), allocatable :: boxes(:)     !! (0:size-1) nodes of each rank
    type(balance_t) :: balance
    type(reduction_t) :: acceptance          !! reduction of the acceptance
    type(speculation_t) :: speculative
  end type exchange_t

  ! Indices of the sums of a cube over steps (sleep_cubes).
  integer, parameter, public :: m_mass = 1, &      !! mass times time [kg s]
                                m_momentum = 2, &  !! momentum times time [kg m], 3
                                m_impulse = 5      !! impulse on held nodes [N s], 3 components
  integer, parameter, public :: n_motion = 7

  !> Sleepers that share nodes with awake particles (sleep_held_layer).
  type :: layer_t
    logical :: is_stale = .true.            !! contributions must be gathered again
    integer, allocatable :: node(:)         !! nodes to which this rank's sleepers contribute
    real(rp), allocatable :: record(:, :)   !! (8, nodes) mass, zero momentum, force, heat
    real(rp), allocatable :: volume(:, :)   !! (2 bodies, nodes)
    integer, allocatable :: held(:)         !! nodes to which sleepers of any rank contribute
    real(rp), allocatable :: mass(:)  !! mass of the sleepers at the held nodes, of all ranks [kg]
    logical, allocatable :: is_own(:)       !! held nodes owned by this rank
    !> Impulse that holds the nodes in this step [N s], (3, held).
    real(rp), allocatable :: impulse(:, :)
  end type layer_t

  !> Motion of the nodes of each cube since the last sleep check (sleep_cubes).
  type :: motion_t
    type(box_t) :: box                       !! box of cubes
    real(rp) :: time = 0.0_rp                !! time since the last check [s]
    real(rp), allocatable :: sums(:, :)      !! (n_motion, cubes) of this rank
  end type motion_t

  !> Material at rest: data that are constant while the same particles sleep in the same blocks.
  type :: sleepers_t
    type(layer_t) :: layer
    type(motion_t) :: motion
    !> Largest coordinates and largest negative ones of the held layer, and of all sleepers [m].
    real(rp), dimension(6) :: extent_layer = -huge(1.0_rp), extent_any = -huge(1.0_rp)
    !> Nodes (z, y, x) in reach of the held layer, and of all sleepers.
    logical, allocatable :: near_layer(:, :, :), near_any(:, :, :)
    type(box_t) :: cubes                      !! box of cubes at the last check, indexed from 0
    integer, allocatable :: rest(:, :, :)     !! rest state of the particles of each cube
    !> Force on the sleepers beyond the held layer [N], (3, conditions).
    real(rp), allocatable :: far_force(:, :)
  end type sleepers_t

end module simulation_run
