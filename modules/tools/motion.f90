! SPDX-License-Identifier: MIT
!> Motion of a rigid tool. Its schedule is a sequence of phases of constant velocity or along a
!> path, with constant spin, joined by linear ramps: a closed-form function of time, which needs no
!> state.
!>
!> Along its axis the tool is held in place, supported by an elastic machine, or pressed with a
!> force (drive_t). It then has the equation of motion M dv/dt = R - F - c v along the axis, with
!> the reaction R of the bodies, and its offset from the schedule is a state. M is scaled as the
!> mass of the bodies is (&TIME MASS_SCALING), and c with its square root.
module tools_motion
  use base_kinds, only: pi, rp
  implicit none (type, external)
  private

  public :: drive_t, motion_t, path_t, phase_t, max_forces, n_drive, wrapped

  integer, parameter :: max_forces = 32  !! points of a table of force over time
  integer, parameter :: n_drive = 7      !! reals of the state of a drive

  !> Polyline with constant velocity on each segment. With a ramp, position and direction are means
  !> over the ramp time before: the velocity changes linearly at a point, and corners are rounded.
  type :: path_t
    logical :: leads_tilt = .false.          !! the tilt follows the direction of travel
    real(rp), allocatable :: time(:)         !! time since the start of the phase, from 0 [s]
    real(rp), allocatable :: place(:, :)     !! (3, points) position relative to the first point [m]
    !> Azimuth of the segment after each point, from +x to +y, continuous by whole turns [rad].
    real(rp), allocatable :: heading(:)
    integer, allocatable :: line(:)          !! line of each point in its file
  contains
    procedure :: along, place_at, points_until
  end type path_t

  type :: phase_t
    real(rp) :: duration = 0.0_rp               !! duration [s]; 0: until the end of the run
    real(rp) :: velocity(3) = 0.0_rp            !! [m/s]
    type(path_t) :: path                        !! path that replaces the velocity, if it has points
    real(rp) :: spin = 0.0_rp                   !! [rad/s], positive is clockwise seen from above
    real(rp) :: ramp = 0.0_rp                   !! ramp time from the phase before [s]
    logical :: is_force_controlled = .false.    !! pressed with a force along the tool axis
    real(rp) :: feed = huge(1.0_rp)  !! largest speed into the plate under force control [m/s]
    real(rp) :: force = 0.0_rp                  !! force into the plate [N]
    !> Points of a table of force over the time since the start of the phase; 0: constant.
    integer :: n_forces = 0
    real(rp) :: forces(2, max_forces) = 0.0_rp  !! time since the start of the phase [s], force [N]
    ! Conditions that end the phase before its duration; huge: none.
    real(rp) :: until_force = huge(1.0_rp)        !! force into the plate [N]
    real(rp) :: until_torque = huge(1.0_rp)       !! torque [N m]
    real(rp) :: until_temperature = huge(1.0_rp)  !! temperature [K]
    integer :: until_probe = 0                    !! probe of the temperature; 0: hottest metal
  contains
    procedure :: ends_early
  end type phase_t

  type :: motion_t
    type(phase_t), allocatable :: phase(:)
  contains
    procedure :: at, face, phase_at, force_control_at, end_phase
  end type motion_t

  type :: drive_t
    logical :: is_free = .false.    !! the tool has an equation of motion along its axis
    real(rp) :: axis(3) = 0.0_rp    !! unit vector out of the plate
    real(rp) :: mass = 0.0_rp       !! mass that moves along the axis [kg]
    real(rp) :: stiffness = 0.0_rp  !! machine stiffness between slide and tool [N/m]; 0: rigid
    real(rp) :: damping = 0.0_rp    !! [N s/m]
    real(rp) :: feed = huge(1.0_rp)  !! largest speed into the plate under force control [m/s]
    ! State: offset of the tool from its schedule, out of the plate.
    real(rp) :: shift = 0.0_rp, rate = 0.0_rp  !! offset [m] and its rate [m/s]
    real(rp) :: neutral = 0.0_rp               !! offset at which the machine spring is unloaded [m]
    real(rp) :: time = 0.0_rp                  !! time of offset and rate [s]
    real(rp) :: reaction_ema = 0.0_rp          !! moving average of the reaction, see `follow` [N]
    real(rp) :: force = 0.0_rp                 !! force of the machine [N]
    logical :: is_force_controlled = .false.   !! force control in the last step
    integer :: phase = 0                       !! current phase of the schedule
    real(rp) :: phase_start_force = 0.0_rp     !! force at the start of the phase [N]
    real(rp) :: last_impulse(3) = 0.0_rp       !! impulse on the tool before this step [N s]
  contains
    procedure :: offset, enter_phase, integrate, follow, state, set_state
  end type drive_t

contains

  !> Displacement [m] since t = 0, velocity [m/s], angle turned [rad] and spin [rad/s] at time `t`.
  !> The tool starts with the velocity of the first phase unless that has a ramp, and rests after
  !> the last phase if that has a duration.
  pure subroutine at(self, t, shift, velocity, angle, spin)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t
    real(rp), intent(out) :: shift(3), velocity(3), angle, spin
    real(rp) :: now(4), before(4), way(4), from, length, s, on(4), rate(4)
    integer :: i

    now = 0.0_rp
    way = 0.0_rp
    from = 0.0_rp
    if (allocated(self%phase)) then
      do i = 1, size(self%phase)
        associate (phase => self%phase(i))
          before = now
          length = merge(phase%duration, huge(1.0_rp), phase%duration > 0.0_rp)
          s = min(t - from, length)
          if (s < 0.0_rp) exit
          call advance(before, [phase%velocity, phase%spin], phase%ramp, s, way, now)
          if (allocated(phase%path%time)) then
            call phase%path%along(phase%ramp, s, 0.0_rp, on, rate)
            way(1:3) = way(1:3) + on(1:3)
            now(1:3) = now(1:3) + rate(1:3)
          end if
          from = from + length
        end associate
        if (t < from) exit
      end do
      if (t > from) now = 0.0_rp
    end if
    shift = way(1:3)
    velocity = now(1:3)
    angle = way(4)
    spin = now(4)
  end subroutine at

  !> Azimuth that the tilt follows at time `t`, and its rate; before the first path the initial
  !> azimuth of that path.
  pure subroutine face(self, t, direction, rate)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t                   !! time [s]
    real(rp), intent(out) :: direction, rate    !! azimuth [rad], its rate [rad/s]
    real(rp) :: from, rates(4), way(4)
    logical :: is_first
    integer :: i

    direction = 0.0_rp
    rate = 0.0_rp
    from = 0.0_rp
    is_first = .true.
    if (.not. allocated(self%phase)) return
    do i = 1, size(self%phase)
      if (t < from .and. .not. is_first) return
      associate (phase => self%phase(i))
        if (phase%path%leads_tilt) then
          if (is_first) direction = phase%path%heading(1)
          is_first = .false.
          call phase%path%along(phase%ramp, max(0.0_rp, min(t - from, phase%duration)), &
                                 direction, way, rates)
          direction = way(4)
          rate = merge(rates(4), 0.0_rp, t >= from .and. t < from + phase%duration)
        end if
        from = from + phase%duration
      end associate
    end do
  end subroutine face

  !> Angle reduced to the range from -pi to pi.
  elemental real(rp) function wrapped(angle)
    real(rp), intent(in) :: angle                   !! [rad]

    wrapped = angle - 2.0_rp*pi*anint(angle/(2.0_rp*pi))
  end function wrapped

  !> Displacement [m] and azimuth [rad] `s` seconds after the start of the phase, which begins at
  !> rest with the azimuth `before`, and their rates.
  pure subroutine along(self, ramp, s, before, way, rate)
    class(path_t), intent(in) :: self
    real(rp), intent(in) :: ramp     !! ramp time [s]
    real(rp), intent(in) :: s        !! time since the start [s]
    real(rp), intent(in) :: before   !! azimuth before the phase [rad]
    real(rp), intent(out) :: way(4), rate(4)
    real(rp) :: from(3), heading, next, to(3), u
    integer :: k

    k = max(1, self%points_until(s))
    way = [self%place_at(s), self%heading(k)]
    k = min(k, size(self%time) - 1)
    rate(1:3) = (self%place(:, k + 1) - self%place(:, k))/(self%time(k + 1) - self%time(k))
    rate(4) = 0.0_rp
    if (ramp <= 0.0_rp) return
    u = s - ramp
    k = self%points_until(u)
    from = self%place_at(u)
    heading = self%heading(1) + wrapped(before - self%heading(1))
    if (k > 0) heading = self%heading(k)
    rate = (way - [from, heading])/ramp
    way = 0.0_rp
    do while (u < s)
      next = s
      if (k < size(self%time)) next = min(s, self%time(k + 1))
      to = self%place_at(next)
      way = way + (next - u)/ramp*[0.5_rp*(from + to), heading]
      u = next
      from = to
      k = min(k + 1, size(self%time))
      heading = self%heading(k)
    end do
  end subroutine along

  !> Position on the polyline after `s` seconds [m].
  pure function place_at(self, s) result(x)
    class(path_t), intent(in) :: self
    real(rp), intent(in) :: s                       !! time since the start of the phase [s]
    real(rp) :: x(3)
    integer :: k

    k = self%points_until(s)
    x = self%place(:, max(1, k))
    if (k == 0 .or. k == size(self%time)) return
    x = x + (s - self%time(k))/(self%time(k + 1) - self%time(k))*(self%place(:, k + 1) - x)
  end function place_at

  !> Number of points that the path has reached after `s` seconds, by bisection.
  pure integer function points_until(self, s) result(low)
    class(path_t), intent(in) :: self
    real(rp), intent(in) :: s                       !! time since the start of the phase [s]
    integer :: high, middle

    low = 0
    high = size(self%time) + 1
    do while (high - low > 1)
      middle = (low + high)/2
      if (self%time(middle) <= s) low = middle
      if (self%time(middle) > s) high = middle
    end do
  end function points_until

  !> True if a condition other than time may end the phase.
  elemental logical function ends_early(self)
    class(phase_t), intent(in) :: self

    ends_early = min(self%until_force, self%until_torque, self%until_temperature) < huge(1.0_rp)
  end function ends_early

  !> End the `i`-th phase at time `t`, after its start.
  pure subroutine end_phase(self, i, t)
    class(motion_t), intent(inout) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: t                   !! time [s]

    self%phase(i)%duration = t - sum(self%phase(:i - 1)%duration)
  end subroutine end_phase

  !> Index of the phase at time `t`; after the end of all phases, their number plus 1.
  pure integer function phase_at(self, t)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t
    real(rp) :: from

    from = 0.0_rp
    phase_at = 1
    if (.not. allocated(self%phase)) return
    do phase_at = 1, size(self%phase)
      associate (length => self%phase(phase_at)%duration)
        if (length <= 0.0_rp .or. t < from + length) return
        from = from + length
      end associate
    end do
  end function phase_at

  !> Whether the tool is force-controlled at time `t`, and the force [N]. Over the ramp of a phase
  !> the force changes from `before`, the force at the start of the phase, to the force of the
  !> phase.
  pure subroutine force_control_at(self, t, before, is_force_controlled, force)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t, before
    logical, intent(out) :: is_force_controlled
    real(rp), intent(out) :: force
    real(rp) :: from
    integer :: i

    is_force_controlled = .false.
    force = 0.0_rp
    i = self%phase_at(t)
    if (.not. allocated(self%phase)) return
    if (i > size(self%phase)) return
    associate (phase => self%phase(i))
      is_force_controlled = phase%is_force_controlled
      force = phase%force
      from = sum(self%phase(:i - 1)%duration)
      if (phase%n_forces > 0) then
        force = table_force(phase%n_forces, phase%forces, t - from)
      else if (t < from + phase%ramp) then
        force = before + (phase%force - before)*(t - from)/phase%ramp
      end if
    end associate
  end subroutine force_control_at

  !> Force from a table [N]; linear between its times, constant outside.
  pure real(rp) function table_force(n, table, t) result(force)
    integer, intent(in) :: n
    real(rp), intent(in) :: table(2, max_forces), t    !! table of time [s] and force [N], time [s]
    integer :: k

    force = table(2, 1)
    do k = 2, n
      if (t < table(1, k - 1)) exit
      force = table(2, k)
      if (t < table(1, k)) force = table(2, k - 1) + (table(2, k) - table(2, k - 1)) &
                                   *(t - table(1, k - 1))/(table(1, k) - table(1, k - 1))
    end do
  end function table_force

  !> Add to `way` its change during `s` seconds, in which its rate changes from `before` to `target`
  !> over the time `ramp` and is then constant; `now` is the rate at the end.
  pure subroutine advance(before, target, ramp, s, way, now)
    real(rp), intent(in) :: before(4), target(4), ramp, s
    real(rp), intent(inout) :: way(4)
    real(rp), intent(out) :: now(4)

    if (ramp > 0.0_rp .and. s < ramp) then
      now = before + (target - before)*(s/ramp)
      way = way + s*0.5_rp*(before + now)
    else
      now = target
      way = way + ramp*0.5_rp*(before + target) + (s - ramp)*target
    end if
  end subroutine advance

  !> Offset from the schedule at time `t` in the current step [m].
  elemental real(rp) function offset(self, t)
    class(drive_t), intent(in) :: self
    real(rp), intent(in) :: t                   !! time [s]

    offset = self%shift + self%rate*(t - self%time)
  end function offset

  !> Store the force at the start of the `phase`-th phase of the schedule.
  pure subroutine enter_phase(self, phase)
    class(drive_t), intent(inout) :: self
    integer, intent(in) :: phase

    if (phase /= self%phase) self%phase_start_force = self%force
    self%phase = phase
  end subroutine enter_phase

  !> Integrate offset and rate over a step of `dt` with the `reaction` of the bodies. With
  !> `is_force_controlled` the machine presses with `force`, otherwise it holds its position.
  pure subroutine integrate(self, dt, reaction, is_force_controlled, force, mass_scaling)
    class(drive_t), intent(inout) :: self
    real(rp), intent(in) :: dt, reaction        !! time step [s], reaction out of the plate [N]
    logical, intent(in) :: is_force_controlled
    real(rp), intent(in) :: force               !! force into the plate [N]
    real(rp), intent(in) :: mass_scaling
    real(rp) :: inertia, resistance, pull

    inertia = self%mass*mass_scaling
    resistance = self%damping*sqrt(mass_scaling)
    self%shift = self%offset(self%time + dt)
    self%time = self%time + dt
    call self%follow(dt, reaction, mass_scaling)
    if (is_force_controlled) then
      self%rate = (self%rate + dt/inertia*(reaction - force))/(1.0_rp + dt*resistance/inertia)
      self%rate = max(self%rate, -self%feed)
      self%force = force
    else if (self%stiffness > 0.0_rp) then
      ! after force control the machine spring continues from the force of the last step
      if (self%is_force_controlled) self%neutral = self%shift - self%force/self%stiffness
      pull = self%stiffness*(self%shift - self%neutral)
      self%rate = (self%rate + dt/inertia*(reaction - pull)) &
                  /(1.0_rp + dt*resistance/inertia + dt**2*self%stiffness/inertia)
      self%force = self%stiffness*(self%offset(self%time + dt) - self%neutral)
    else
      self%rate = 0.0_rp
      self%force = self%reaction_ema
    end if
    self%is_force_controlled = is_force_controlled
  end subroutine integrate

  !> Add the `reaction` [N] of a step of `dt` to its exponential moving average; if the tool is not
  !> free, that on this rank: averages of ranks add up to the force with which FORCE may begin.
  pure subroutine follow(self, dt, reaction, mass_scaling)
    class(drive_t), intent(inout) :: self
    real(rp), intent(in) :: dt, reaction, mass_scaling

    self%reaction_ema = self%reaction_ema + (reaction - self%reaction_ema) &
      *min(1.0_rp, dt*(self%damping*sqrt(mass_scaling))/max(self%mass*mass_scaling, tiny(dt)))
  end subroutine follow

  !> State for a checkpoint at `time` of the run.
  pure function state(self)
    class(drive_t), intent(in) :: self
    real(rp) :: state(n_drive)

    state = [self%shift, self%rate, self%neutral, self%force, &
             merge(1.0_rp, 0.0_rp, self%is_force_controlled), real(self%phase, rp), &
               self%phase_start_force]
  end function state

  !> Set the state from a checkpoint at `time`.
  pure subroutine set_state(self, state, time)
    class(drive_t), intent(inout) :: self
    real(rp), intent(in) :: state(n_drive), time

    self%shift = state(1)
    self%rate = state(2)
    self%neutral = state(3)
    self%force = state(4)
    self%is_force_controlled = state(5) > 0.0_rp
    self%phase = nint(state(6))
    self%phase_start_force = state(7)
    self%time = time
  end subroutine set_state

end module tools_motion
