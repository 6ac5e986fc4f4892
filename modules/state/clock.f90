! SPDX-License-Identifier: MIT
!> Simulated time and the quantities that determine the next step.
module state_clock
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: clock_t

  !> Values equal on all ranks and stored in checkpoints.
  type :: clock_t
    integer(i8) :: step = 0
    real(rp) :: time = 0.0_rp
    real(rp) :: dt = 0.0_rp
    integer(i8) :: sorted_at = -1        !! step of the last sort
    real(rp) :: displacement = 0.0_rp    !! largest particle displacement since the last sort [m]
    real(rp) :: heat_time = 0.0_rp       !! time of the last conduction step [s]
    real(rp) :: heat_step = 0.0_rp       !! next implicit conduction step [s]; 0: none yet
    real(rp) :: next_frame = 0.0_rp, next_history = 0.0_rp, next_checkpoint = 0.0_rp
    real(rp) :: max_speed = 0.0_rp      !! largest grid velocity at a particle in the last step
                                        !! [m/s]
    integer(i8) :: refused = 0          !! steps that were repeated with a smaller dt
    real(rp) :: stiffness = 0.0_rp      !! largest squared wave speed without mass scaling [m2/s2]
    real(rp) :: mass_scaling = 1.0_rp   !! factor on inertia
    logical :: is_stopped = .false.     !! a tool limit has ended the run
    real(rp) :: inertial_peak = 0.0_rp  !! decaying maximum of rho v^2 over flow stress [-]
  end type clock_t

end module state_clock
