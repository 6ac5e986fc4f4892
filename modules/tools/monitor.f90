! SPDX-License-Identifier: MIT
!> Load of a tool, which may end phases early or stop the tool.
module tools_monitor
  use base_kinds, only: rp
  use tools_motion, only: motion_t, phase_t
  implicit none (type, external)
  private

  public :: halt, monitor_t

  !> Number of reals of the state without the phase durations.
  integer, parameter, public :: n_monitor = 8

  type :: monitor_t
    logical :: is_on = .false.
    real(rp) :: max_force = huge(1.0_rp), max_torque = huge(1.0_rp)  !! limits [N], [N m]
    !> Action at a limit: 1 the run ends, 2 the feed stops, 3 feed and spin stop.
    integer :: at_limit = 1
    ! State:
    !> Exponential moving averages of force [N] and torque [N m] (Brown 1963).
    real(rp) :: load_ema(2) = 0.0_rp
    real(rp) :: load_ema2(2) = 0.0_rp          !! exponential moving averages of load_ema
    real(rp) :: last_angular_impulse = 0.0_rp  !! angular impulse before this step [N m s]
    integer :: phase = 1                       !! current phase of the schedule
    logical :: ended_early = .false.           !! the current phase ended before its duration
    real(rp) :: halt_time = -1.0_rp  !! time at which the tool was stopped [s]; -1: not stopped
    real(rp) :: spin = 0.0_rp                  !! spin after the stop [rad/s]
  contains
    procedure :: update_load, load, state => monitor_state, set_state => set_monitor
  end type monitor_t

contains

  !> Add the current load, force [N] and torque [N m], to the moving averages with the weight
  !> `part`, the step over the averaging time.
  pure subroutine update_load(self, now, part)
    class(monitor_t), intent(inout) :: self
    real(rp), intent(in) :: now(2), part

    self%load_ema = self%load_ema + part*(now - self%load_ema)
    self%load_ema2 = self%load_ema2 + part*(self%load_ema - self%load_ema2)
  end subroutine update_load

  !> Estimate of the current force [N] and torque [N m]: a moving average lags behind a growing
  !> load, and the average of it lags twice, so that their difference removes the lag (double
  !> exponential smoothing, R. G. Brown 1963).
  pure function load(self)
    class(monitor_t), intent(in) :: self
    real(rp) :: load(2)

    load = 2.0_rp*self%load_ema - self%load_ema2
  end function load

  !> State for a checkpoint, with the durations of the phases. A stopped tool has one phase more or
  !> fewer than the `n` phases of the input.
  pure function monitor_state(self, motion, n) result(state)
    class(monitor_t), intent(in) :: self
    type(motion_t), intent(in) :: motion
    integer, intent(in) :: n
    real(rp) :: state(n_monitor + n)
    integer :: last

    last = min(n, size(motion%phase))
    state = 0.0_rp
    state(:n_monitor) = [self%load_ema, self%load_ema2, real(self%phase, rp), &
                       merge(1.0_rp, 0.0_rp, self%ended_early), self%halt_time, self%spin]
    state(n_monitor + 1:n_monitor + last) = motion%phase(:last)%duration
  end function monitor_state

  !> Set the state from a checkpoint, and the durations of the phases that have begun in the
  !> schedule of the input, which may have more or fewer phases than that of the checkpoint.
  pure subroutine set_monitor(self, state, motion)
    class(monitor_t), intent(inout) :: self
    real(rp), intent(in) :: state(:)
    type(motion_t), intent(inout) :: motion
    integer :: last

    self%load_ema = state(1:2)
    self%load_ema2 = state(3:4)
    self%phase = nint(state(5))
    self%ended_early = state(6) > 0.0_rp
    self%halt_time = state(7)
    self%spin = state(8)
    last = min(self%phase, size(motion%phase), size(state) - n_monitor)
    if (.not. self%ended_early) last = min(last, self%phase - 1)
    motion%phase(:last)%duration = state(n_monitor + 1:n_monitor + last)
    if (self%halt_time >= 0.0_rp) call halt(motion, self%halt_time, self%spin)
  end subroutine set_monitor

  !> Stop the tool at time `t` for the rest of the run, with the remaining `spin`.
  pure subroutine halt(motion, t, spin)
    type(motion_t), intent(inout) :: motion
    real(rp), intent(in) :: t, spin             !! time [s], spin [rad/s]
    type(phase_t), allocatable :: phase(:)
    integer :: i

    i = min(motion%phase_at(t), size(motion%phase))
    call motion%end_phase(i, t)
    allocate (phase(i + 1))                     ! no constructor, as gfortran 12 frees paths twice
    phase(:i) = motion%phase(:i)
    phase(i + 1)%spin = spin
    call move_alloc(phase, motion%phase)
  end subroutine halt

end module tools_monitor
