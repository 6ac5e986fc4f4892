! SPDX-License-Identifier: MIT
!> The step that is being taken, and what it found.
module state_step
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: outcome_t, step_t

  !> Extremes of the particles of this rank at the end of a step, for the middle of the next.
  type :: outcome_t
    real(rp) :: stiffness = 0.0_rp       !! largest squared wave speed [m2/s2]
    real(rp) :: speed2 = 0.0_rp          !! largest squared grid velocity at a particle [m2/s2]
  end type outcome_t

  type :: step_t
    real(rp) :: asked_dt = 0.0_rp            !! before it was found too large [s]
    real(rp) :: force_time = 0.0_rp          !! to which its outer forces belong [s]
    real(rp) :: pic = 0.0_rp                 !! part of the grid velocity taken in it
    type(outcome_t) :: last                  !! of the step before
    integer :: fastest_node = 0              !! of this rank
    real(rp) :: fastest_speed = 0.0_rp       !! of that node [m/s]
    logical :: lost_row = .false.        !! of the history, which could not be written, on rank 0
    real(rp) :: secured = 0.0_rp             !! wall-clock time of the last checkpoint [s]
    ! set by the check in the middle of a step, equal on all ranks
    logical, allocatable :: is_near(:)       !! tools that particles of any rank may touch
    logical :: is_broken = .false.           !! no step is possible from here
    character(:), allocatable :: reason      !! for that, if the state itself does not show it
    logical :: is_unsolved = .false.         !! a conduction step was not solved for
    integer :: signal = 0                    !! that arrived on any rank
    logical :: output_is_lost = .false.      !! a row could not be written
    logical :: safety_is_due = .false.       !! time for a checkpoint against a breakdown
    integer :: worst_returns = 0             !! most returns of any rank that did not converge
  end type step_t

end module state_step
