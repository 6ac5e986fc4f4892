! SPDX-License-Identifier: MIT
!> The current step and its results.
module state_step
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: outcome_t, step_t

  !> Maxima over the particles of this rank at the end of a step, used by the acceptance of the
  !> next.
  type :: outcome_t
    real(rp) :: stiffness = 0.0_rp       !! largest squared wave speed [m2/s2]
    real(rp) :: speed2 = 0.0_rp          !! largest squared grid velocity at a particle [m2/s2]
  end type outcome_t

  type :: step_t
    real(rp) :: asked_dt = 0.0_rp       !! step before any refusal [s]
    real(rp) :: force_time = 0.0_rp     !! time at which external forces are evaluated [s]
    real(rp) :: pic = 0.0_rp            !! PIC fraction of this step
    type(outcome_t) :: last             !! maxima of the last step
    integer :: fastest_node = 0         !! fastest node of this rank
    real(rp) :: fastest_speed = 0.0_rp  !! its speed [m/s]
    logical :: lost_row = .false.       !! a history row could not be written, on rank 0
    real(rp) :: secured = 0.0_rp        !! wall-clock time of the last checkpoint [s]
    ! Set by the acceptance of the step, equal on all ranks:
    logical, allocatable :: is_near(:)       !! tools that particles of any rank may touch
    logical :: is_broken = .false.           !! no step is possible from this state
    character(:), allocatable :: reason      !! explanation if the state itself does not show it
    logical :: is_unsolved = .false.         !! an implicit conduction step did not converge
    integer :: signal = 0                    !! signal that arrived on any rank; 0: none
    logical :: output_is_lost = .false.      !! a row could not be written
    logical :: safety_is_due = .false.       !! a checkpoint against a crash is due
    integer :: worst_returns = 0             !! largest number of failed return mappings of any rank
  end type step_t

end module state_step
