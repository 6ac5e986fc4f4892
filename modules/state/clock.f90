! SPDX-License-Identifier: MIT
!> Time and what decides the next step.
module state_clock
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: clock_t

  !> Equal on all ranks, stored in checkpoints.
  type :: clock_t
    integer(i8) :: step = 0
    real(rp) :: time = 0.0_rp
    real(rp) :: dt = 0.0_rp
    integer(i8) :: sorted_at = -1        !! step of the last listing of particles
    real(rp) :: displacement = 0.0_rp    !! of the fastest particle since then [m]
    real(rp) :: heat_time = 0.0_rp       !! time of the last conduction step
    real(rp) :: heat_step = 0.0_rp       !! next implicit one [s]; 0: none was made yet
    real(rp) :: next_frame = 0.0_rp, next_history = 0.0_rp, next_checkpoint = 0.0_rp
    real(rp) :: max_speed = 0.0_rp       !! of the last step [m/s]
    integer(i8) :: refused = 0           !! steps that had to be made shorter
    real(rp) :: stiffness = 0.0_rp       !! largest squared wave speed, unscaled [m2/s2]
    real(rp) :: mass_scaling = 1.0_rp    !! on inertia only
    logical :: is_stopped = .false.      !! a tool has met a limit at which the run ends
    real(rp) :: inertial_peak = 0.0_rp   !! recent largest rho v^2 over flow stress
  end type clock_t

end module state_clock
