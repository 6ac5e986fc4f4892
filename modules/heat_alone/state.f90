! SPDX-License-Identifier: MIT
!> State of a heat-only run.
module heat_alone_state
  use base_kinds, only: i8, rp
  use heat_mesh_rates, only: heat_t, n_books
  use heat_solvers_integrator, only: integrator_t
  implicit none (type, external)
  private

  public :: heat_run_t

  type :: heat_run_t
    type(heat_t) :: heat
    type(integrator_t) :: integrator
    real(rp) :: time = 0.0_rp                !! simulated time [s]
    real(rp) :: content0 = 0.0_rp            !! heat content at t = 0 [J]
    real(rp) :: row_time = -1.0_rp           !! time of the last history row [s]
    real(rp) :: row_books(n_books) = 0.0_rp  !! heat of sources and films until then [J]
    integer(i8) :: rows = 0                  !! history rows written so far
    logical :: lost_row = .false.            !! a row could not be written, on rank 0
    real(rp), allocatable :: frame_times(:)  !! times of the frames written so far [s]
    integer(i8) :: cells = 0                 !! cells in the solid, of all ranks
    integer, allocatable :: probe_cell(:, :)       !! (27, probes) own cells; 0: on another rank
    real(rp), allocatable :: probe_weight(:, :)    !! (27, probes) interpolation weights
  end type heat_run_t

end module heat_alone_state
