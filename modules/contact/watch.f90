! SPDX-License-Identifier: MIT
!> Load of a tool, which may end phases early or stop the tool.
module contact_watch
  use base_kinds, only: rp
  use contact_motion, only: motion_t
  implicit none (type, external)
  private

  public :: watch_t

  integer, parameter :: n_watch = 8             !! reals of its state beside durations of phases

  type :: watch_t
    logical :: is_on = .false.
    real(rp) :: most_force = huge(1.0_rp), most_torque = huge(1.0_rp)   !! limits [N], [N m]
    integer :: at_limit = 1                     !! with 1 the run ends, 2 the feed stops, 3 all
    ! State.
    real(rp) :: felt(2) = 0.0_rp                !! force [N] and torque [N m], means of late
    real(rp) :: felt_before(2) = 0.0_rp         !! means of these, twice as late
    real(rp) :: noted = 0.0_rp                  !! angular impulse before this step [N m s]
    integer :: phase = 1                        !! of the schedule
    logical :: has_ended = .false.              !! that phase, before its time
    real(rp) :: halted = -1.0_rp                !! when the tool was stopped; -1: it was not [s]
    real(rp) :: spin = 0.0_rp                   !! with which it then turns on [rad/s]
  contains
    procedure :: feel
    procedure :: load
    procedure :: state => watch_state
    procedure :: set_state => set_watch
    procedure :: size_of_state
  end type watch_t

contains

  !> Take a load of now, force [N] and torque [N m], into the means; `part` is that of the step in
  !> the time of a mean.
  pure subroutine feel(self, now, part)
    class(watch_t), intent(inout) :: self
    real(rp), intent(in) :: now(2), part

    self%felt = self%felt + part*(now - self%felt)
    self%felt_before = self%felt_before + part*(self%felt - self%felt_before)
  end subroutine feel

  !> Force [N] and torque [N m] of now. A mean of late lags behind a load that grows, the mean of it
  !> by the same again: what they differ by takes the lag away (double exponential smoothing, R. G.
  !> Brown 1963).
  pure function load(self)
    class(watch_t), intent(in) :: self
    real(rp) :: load(2)

    load = 2.0_rp*self%felt - self%felt_before
  end function load

  !> Reals of the state of a tool that is watched, with a schedule of `n` phases in the input.
  elemental integer function size_of_state(self, n)
    class(watch_t), intent(in) :: self
    integer, intent(in) :: n

    size_of_state = merge(n_watch + n, 0, self%is_on)
  end function size_of_state

  !> Its state, for a checkpoint, with that of the schedule: how long phases lasted. A stopped tool
  !> has one phase more or less than the input has, `n`.
  pure function watch_state(self, motion, n) result(state)
    class(watch_t), intent(in) :: self
    type(motion_t), intent(in) :: motion
    integer, intent(in) :: n
    real(rp) :: state(self%size_of_state(n))
    integer :: last

    if (.not. self%is_on) return
    last = min(n, size(motion%phase))
    state = 0.0_rp
    state(:n_watch) = [self%felt, self%felt_before, real(self%phase, rp), &
                       merge(1.0_rp, 0.0_rp, self%has_ended), self%halted, self%spin]
    state(n_watch + 1:n_watch + last) = motion%phase(:last)%duration
  end function watch_state

  !> The state of a checkpoint, into a schedule as the input has it: phases that have begun lasted
  !> as long as they did.
  pure subroutine set_watch(self, state, motion)
    class(watch_t), intent(inout) :: self
    real(rp), intent(in) :: state(:)
    type(motion_t), intent(inout) :: motion
    integer :: last

    self%felt = state(1:2)
    self%felt_before = state(3:4)
    self%phase = nint(state(5))
    self%has_ended = state(6) > 0.0_rp
    self%halted = state(7)
    self%spin = state(8)
    last = min(self%phase, size(motion%phase))
    if (.not. self%has_ended) last = min(last, self%phase - 1)
    motion%phase(:last)%duration = state(n_watch + 1:n_watch + last)
    if (self%halted >= 0.0_rp) call motion%halt(self%halted, self%spin)
  end subroutine set_watch

end module contact_watch
