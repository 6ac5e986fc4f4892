! SPDX-License-Identifier: MIT
!> How long a run will take, learned from how fast it was lately, and when to say so.
module output_time_left
  use base_kinds, only: rp
  use base_log, only: show_progress, window_width
  use base_timers, only: wall_time
  implicit none (type, external)
  private

  public :: time_left_t

  integer, parameter :: most = 64             !! samples that are kept
  real(rp), parameter :: spacing = 0.5_rp     !! between two samples at first [s]
  real(rp), parameter :: redrawn = 1.0_rp     !! how often a line in a window is [s]

  type :: time_left_t
    real(rp) :: interval = 0.0_rp             !! between two lines in a file [s]
    logical :: is_asked = .false.             !! the input gave it: it stays as it is
    real(rp), private :: at(most) = 0.0_rp    !! wall-clock times of the samples, from the start [s]
    real(rp), private :: share(most) = 0.0_rp   !! of the run that was done then
    integer, private :: n = 0
    real(rp), private :: gap = spacing        !! between two samples [s]
    real(rp), private :: began = 0.0_rp, said = 0.0_rp   !! [s]
  contains
    procedure :: init
    procedure :: note
    procedure :: seconds
    procedure :: is_due
    procedure :: show
  end type time_left_t

contains

  !> The run, or the part of it that is to be done, begins now.
  subroutine init(self, interval, is_asked)
    class(time_left_t), intent(out) :: self
    real(rp), intent(in) :: interval          !! [s]
    logical, intent(in) :: is_asked

    self%interval = interval
    self%is_asked = is_asked
    self%began = wall_time()
    self%said = self%began
    call self%note(0.0_rp, 0.0_rp)
  end subroutine init

  !> At wall-clock time `at` [s] since the start `share` of the run is done. Of samples that become
  !> too many every other one is dropped.
  pure subroutine note(self, at, share)
    class(time_left_t), intent(inout) :: self
    real(rp), intent(in) :: at, share

    if (self%n > 0) then
      if (at - self%at(self%n) < self%gap) return
    end if
    if (self%n == most) then
      self%n = most/2
      self%at(:self%n) = self%at(1::2)
      self%share(:self%n) = self%share(1::2)
      self%gap = 2.0_rp*self%gap
    end if
    self%n = self%n + 1
    self%at(self%n) = at
    self%share(self%n) = share
  end subroutine note

  !> Seconds that are left at `at` with `share` done: as fast as in the later half of the time so
  !> far, so that a slow start is forgotten.
  pure real(rp) function seconds(self, at, share)
    class(time_left_t), intent(in) :: self
    real(rp), intent(in) :: at, share         !! [s], [-]
    integer :: k

    k = max(1, count(self%at(:self%n) <= 0.5_rp*at))
    seconds = (1.0_rp - share)*(at - self%at(k))/max(share - self%share(k), 1.0e-12_rp)
  end function seconds

  !> Whether a line is due when `share` of the run is done, and after how many seconds that is. In a
  !> file lines come every `interval`, but for one that was asked for ever farther apart: by a
  !> twentieth of the time so far.
  logical function is_due(self, share, at, width)
    class(time_left_t), intent(inout) :: self
    real(rp), intent(in) :: share
    real(rp), intent(out) :: at               !! [s]
    integer, intent(out) :: width             !! of the window; 0: there is none
    real(rp) :: gap, now

    now = wall_time()
    at = now - self%began
    call self%note(at, share)
    width = 0
    gap = self%interval
    is_due = now - self%said >= min(gap, redrawn)
    if (.not. is_due) return
    width = window_width()
    if (width > 0) return
    if (.not. self%is_asked) gap = max(gap, 0.05_rp*at)
    is_due = now - self%said >= gap
  end function is_due

  !> Say it.
  subroutine show(self, text, width)
    class(time_left_t), intent(inout) :: self
    character(*), intent(in) :: text
    integer, intent(in) :: width

    self%said = wall_time()
    call show_progress(text, width)
  end subroutine show

end module output_time_left
