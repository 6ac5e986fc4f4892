! SPDX-License-Identifier: MIT
!> State from which rows of the history are computed as differences and means.
module output_audit
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: history_t

  type :: history_t
    real(rp) :: kinetic0 = 0.0_rp, elastic0 = 0.0_rp   !! energies at t = 0 [J]
    real(rp) :: audit_scale = 0.0_rp         !! largest energy exchanged so far [J]
    real(rp), allocatable :: frame_times(:)  !! times of the frames written so far [s]
    real(rp) :: row_time = 0.0_rp            !! time of the last row [s]
    integer(i8) :: rows = 0                  !! rows written so far
    real(rp), allocatable :: row_sums(:, :)  !! sums of each tool at the last row, of all ranks
    real(rp), allocatable :: row_gained(:, :)  !! increase of these between the last two rows
    real(rp), allocatable :: row_impulse(:, :)   !! impulses of conditions at the last row [N s]
  end type history_t

end module output_audit
