! SPDX-License-Identifier: MIT
!> Estimate of the remaining wall-clock time from the recent speed, and when to show progress.
module output_time_left
  use base_kinds, only: rp
  use base_log, only: show_progress, window_width
  use base_timers, only: wall_time
  implicit none (type, external)
  private

  public :: time_left_t

  integer, parameter :: max_samples = 64      !! number of samples kept
  real(rp), parameter :: spacing = 0.5_rp     !! initial interval of samples [s]
  real(rp), parameter :: redraw_interval = 1.0_rp  !! interval of the line in a terminal window [s]

  type :: time_left_t
    real(rp) :: interval = 0.0_rp             !! between two lines in a log file [s]
    logical :: is_asked = .false.             !! the interval is given in the input, and constant
    real(rp), private :: at(max_samples) = 0.0_rp  !! wall-clock times of samples since start [s]
    real(rp), private :: share(max_samples) = 0.0_rp  !! completed share of the run at the samples
    integer, private :: n = 0
    real(rp), private :: gap = spacing        !! interval of samples [s]
    real(rp), private :: began = 0.0_rp       !! wall-clock time of the start [s]
    real(rp), private :: last_shown = 0.0_rp  !! wall-clock time of the last line [s]
  contains
    procedure :: init, add_sample, seconds, is_due, show
  end type time_left_t

contains

  !> Start the clock of the run or of its resumed part.
  subroutine init(self, interval, is_asked)
    class(time_left_t), intent(out) :: self
    real(rp), intent(in) :: interval          !! between two lines in a log file [s]
    logical, intent(in) :: is_asked

    self%interval = interval
    self%is_asked = is_asked
    self%began = wall_time()
    self%last_shown = self%began
    call self%add_sample(0.0_rp, 0.0_rp)
  end subroutine init

  !> Add a sample. When the list is full, every other sample is dropped and the interval doubled.
  pure subroutine add_sample(self, at, share)
    class(time_left_t), intent(inout) :: self
    real(rp), intent(in) :: at, share         !! time since start [s], completed share [-]

    if (self%n > 0) then
      if (at - self%at(self%n) < self%gap) return
    end if
    if (self%n == max_samples) then
      self%n = max_samples/2
      self%at(:self%n) = self%at(1::2)
      self%share(:self%n) = self%share(1::2)
      self%gap = 2.0_rp*self%gap
    end if
    self%n = self%n + 1
    self%at(self%n) = at
    self%share(self%n) = share
  end subroutine add_sample

  !> Remaining wall-clock time [s] at the mean speed in the later half of the time so far, so that a
  !> slow start has no effect.
  pure real(rp) function seconds(self, at, share)
    class(time_left_t), intent(in) :: self
    real(rp), intent(in) :: at, share         !! time since start [s], completed share [-]
    integer :: k

    k = max(1, count(self%at(:self%n) <= 0.5_rp*at))
    seconds = (1.0_rp - share)*(at - self%at(k))/max(share - self%share(k), 1.0e-12_rp)
  end function seconds

  !> True if a progress line is due. In a log file lines are `interval` apart, or a twentieth of the
  !> time so far if that is longer and the input does not give the interval.
  logical function is_due(self, share, at, width)
    class(time_left_t), intent(inout) :: self
    real(rp), intent(in) :: share            !! completed share of the run
    real(rp), intent(out) :: at               !! wall-clock time since the start [s]
    integer, intent(out) :: width  !! width of the terminal window [characters]; 0: no window
    real(rp) :: gap, now

    now = wall_time()
    at = now - self%began
    call self%add_sample(at, share)
    width = 0
    gap = self%interval
    is_due = now - self%last_shown >= min(gap, redraw_interval)
    if (.not. is_due) return
    width = window_width()
    if (width > 0) return
    if (.not. self%is_asked) gap = max(gap, 0.05_rp*at)
    is_due = now - self%last_shown >= gap
  end function is_due

  !> Show a progress line.
  subroutine show(self, text, width)
    class(time_left_t), intent(inout) :: self
    character(*), intent(in) :: text
    integer, intent(in) :: width

    self%last_shown = wall_time()
    call show_progress(text, width)
  end subroutine show

end module output_time_left
