! SPDX-License-Identifier: MIT
!> What the rows of the history are reckoned from.
module output_audit
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: history_t

  type :: history_t
    real(rp) :: kinetic0 = 0.0_rp, elastic0 = 0.0_rp   !! energies at t = 0 [J]
    real(rp) :: audit_scale = 0.0_rp         !! largest energy turned over so far [J]
    real(rp), allocatable :: frame_times(:)  !! of the frames written so far [s]
    real(rp) :: row_time = 0.0_rp            !! time of the last row [s]
    integer(i8) :: rows = 0                  !! so far
    real(rp), allocatable :: row_sums(:, :)  !! tools' books then, of all ranks
    real(rp), allocatable :: row_gained(:, :)  !! by these between the last two rows
    real(rp), allocatable :: row_impulse(:, :)   !! of walls and clamps then, of all ranks
  end type history_t

end module output_audit
