! SPDX-License-Identifier: MIT
!> Simulated time, the current step and what determines the next one.
module state_clock
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: clock_t, outcome_t, step_t

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

end module state_clock
