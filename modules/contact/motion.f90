! SPDX-License-Identifier: MIT
!> Motion of a rigid tool. Its schedule is phases of constant velocity or a path, and constant spin,
!> joined by linear ramps: a closed function of time, of which a checkpoint keeps nothing.
!>
!> Along its axis a machine holds it in its place, gives under load as a spring does, or presses
!> with a force (drive_t). The tool then has an equation of motion along its axis,
!> M dv/dt = R - F - c v, with the reaction R of the bodies, and its place beside the schedule is a
!> state. M is scaled as the mass of the bodies is (&TIME MASS_SCALING), and c with its root.
module contact_motion
  use base_kinds, only: pi, rp
  implicit none (type, external)
  private

  public :: drive_t, motion_t, path_t, phase_t, most_forces, n_drive, wrapped

  integer, parameter :: most_forces = 32        !! in a table of force over time
  integer, parameter :: n_drive = 8             !! reals of its state

  !> Polyline with constant velocity on each segment. With a ramp, position and direction are means
  !> over the ramp time before: the velocity changes linearly at a point, and corners are rounded.
  type :: path_t
    logical :: leads_tilt = .false.          !! the tilt follows the direction of travel
    real(rp), allocatable :: time(:)         !! since the start of the phase, from 0 [s]
    real(rp), allocatable :: place(:, :)     !! (3, points) relative to the first point [m]
    real(rp), allocatable :: heading(:)      !! azimuth of the segment after each point, from +x to
                                             !! +y, continuous by whole turns [rad]
    integer, allocatable :: line(:)          !! line of each point in its file
  contains
    procedure :: along
    procedure :: place_at
  end type path_t

  type :: phase_t
    real(rp) :: duration = 0.0_rp      !! [s]; 0: to the end of the run
    real(rp) :: velocity(3) = 0.0_rp   !! [m/s]
    type(path_t) :: path               !! instead of it, if it has points
    real(rp) :: spin = 0.0_rp          !! [rad/s], clockwise seen from above is positive
    real(rp) :: ramp = 0.0_rp          !! time to change from the phase before [s]
    logical :: presses = .false.       !! with a force along the axis of the tool
    real(rp) :: force = 0.0_rp         !! into the plate [N]
    integer :: n_forces = 0            !! instead of it: forces over the time in the phase
    real(rp) :: forces(2, most_forces) = 0.0_rp       !! [s], [N]
    ! What ends the phase before its duration is over; huge: nothing.
    real(rp) :: until_force = huge(1.0_rp)        !! into the plate [N]
    real(rp) :: until_torque = huge(1.0_rp)       !! [N m]
    real(rp) :: until_temperature = huge(1.0_rp)  !! [K]
    integer :: until_probe = 0                    !! its number; 0: of the hottest metal
  contains
    procedure :: ends_early
  end type phase_t

  type :: motion_t
    type(phase_t), allocatable :: phase(:)
  contains
    procedure :: at
    procedure :: face
    procedure :: phase_at
    procedure :: pressing
    procedure :: end_phase
    procedure :: halt
  end type motion_t

  type :: drive_t
    logical :: is_free = .false.                !! the tool has an equation of motion
    real(rp) :: axis(3) = 0.0_rp                !! out of the plate, unit vector
    real(rp) :: mass = 0.0_rp                   !! what moves along the axis [kg]
    real(rp) :: stiffness = 0.0_rp              !! between the slide and the tool; 0: rigid [N/m]
    real(rp) :: damping = 0.0_rp                !! [N s/m]
    ! State: where the tool is beside its schedule, out of the plate.
    real(rp) :: shift = 0.0_rp, rate = 0.0_rp   !! [m], [m/s]
    real(rp) :: neutral = 0.0_rp                !! shift at which the spring bears nothing [m]
    real(rp) :: time = 0.0_rp                   !! to which these belong [s]
    real(rp) :: felt = 0.0_rp                   !! reaction, mean of late [N]
    real(rp) :: force = 0.0_rp                  !! with which the machine presses [N]
    logical :: presses = .false.                !! by a force, in the step before
    integer :: phase = 0                        !! of the schedule, and the force when it began [N]
    real(rp) :: begin = 0.0_rp
    real(rp) :: noted(3) = 0.0_rp               !! impulse on the tool before this step [N s]
  contains
    procedure :: offset
    procedure :: enter_phase
    procedure :: follow
    procedure :: state
    procedure :: set_state
  end type drive_t

contains

  !> Displacement [m] since t = 0, velocity [m/s], turned angle [rad] and spin [rad/s] at time `t`.
  !> The tool starts with the first phase's velocity unless that phase has a ramp, and rests after
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

  !> Azimuth that the tilt follows at time `t`, and its rate; before the first path its initial one.
  pure subroutine face(self, t, direction, rate)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t                   !! [s]
    real(rp), intent(out) :: direction, rate    !! [rad], [rad/s]
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
    real(rp), intent(in) :: ramp, s, before         !! [s], [rad]
    real(rp), intent(out) :: way(4), rate(4)
    real(rp) :: from(3), heading, next, to(3), u
    integer :: k

    k = max(1, count(self%time <= s))
    way = [self%place_at(s), self%heading(k)]
    k = min(k, size(self%time) - 1)
    rate(1:3) = (self%place(:, k + 1) - self%place(:, k))/(self%time(k + 1) - self%time(k))
    rate(4) = 0.0_rp
    if (ramp <= 0.0_rp) return
    u = s - ramp
    k = count(self%time <= u)
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
    real(rp), intent(in) :: s                       !! [s]
    real(rp) :: x(3)
    integer :: k

    k = count(self%time <= s)
    x = self%place(:, max(1, k))
    if (k == 0 .or. k == size(self%time)) return
    x = x + (s - self%time(k))/(self%time(k + 1) - self%time(k))*(self%place(:, k + 1) - x)
  end function place_at

  !> Whether something else than time may end a phase.
  elemental logical function ends_early(self)
    class(phase_t), intent(in) :: self

    ends_early = min(self%until_force, self%until_torque, self%until_temperature) < huge(1.0_rp)
  end function ends_early

  !> End the `i`-th phase at time `t`, after it began.
  pure subroutine end_phase(self, i, t)
    class(motion_t), intent(inout) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: t                   !! [s]

    self%phase(i)%duration = t - sum(self%phase(:i - 1)%duration)
  end subroutine end_phase

  !> Stop the tool at time `t` for the rest of the run, turning on with `spin`.
  pure subroutine halt(self, t, spin)
    class(motion_t), intent(inout) :: self
    real(rp), intent(in) :: t, spin             !! [s], [rad/s]
    type(phase_t), allocatable :: phase(:)
    integer :: i

    i = min(self%phase_at(t), size(self%phase))
    call self%end_phase(i, t)
    allocate (phase(i + 1))                     ! no constructor: gfortran 12 frees paths twice
    phase(:i) = self%phase(:i)
    phase(i + 1)%spin = spin
    call move_alloc(phase, self%phase)
  end subroutine halt

  !> Number of the phase at time `t`; behind the last one if all have ended.
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

  !> Whether the tool presses with a force at time `t`, and that force [N]; over the ramp of a phase
  !> it goes from `before`, the force when the phase began, to its own.
  pure subroutine pressing(self, t, before, presses, force)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t, before
    logical, intent(out) :: presses
    real(rp), intent(out) :: force
    real(rp) :: from
    integer :: i

    presses = .false.
    force = 0.0_rp
    i = self%phase_at(t)
    if (.not. allocated(self%phase)) return
    if (i > size(self%phase)) return
    associate (phase => self%phase(i))
      presses = phase%presses
      force = phase%force
      from = sum(self%phase(:i - 1)%duration)
      if (phase%n_forces > 0) then
        force = table_force(phase%n_forces, phase%forces, t - from)
      else if (t < from + phase%ramp) then
        force = before + (phase%force - before)*(t - from)/phase%ramp
      end if
    end associate
  end subroutine pressing

  !> Force at a time of a table [N]; linear between its times, constant outside.
  pure real(rp) function table_force(n, table, t) result(force)
    integer, intent(in) :: n
    real(rp), intent(in) :: table(2, most_forces), t    !! [s, N], [s]
    integer :: k

    force = table(2, 1)
    do k = 2, n
      if (t < table(1, k - 1)) exit
      force = table(2, k)
      if (t < table(1, k)) force = table(2, k - 1) + (table(2, k) - table(2, k - 1)) &
                                   *(t - table(1, k - 1))/(table(1, k) - table(1, k - 1))
    end do
  end function table_force

  !> Add the displacement in `s` seconds that start with `before` and ramp to `target`.
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

  !> Shift beside the schedule at time `t` of this step [m].
  elemental real(rp) function offset(self, t)
    class(drive_t), intent(in) :: self
    real(rp), intent(in) :: t                   !! [s]

    offset = self%shift + self%rate*(t - self%time)
  end function offset

  !> Note the force with which the `phase`-th phase of the schedule begins.
  pure subroutine enter_phase(self, phase)
    class(drive_t), intent(inout) :: self
    integer, intent(in) :: phase

    if (phase == self%phase) return
    self%phase = phase
    self%begin = self%force
  end subroutine enter_phase

  !> The end of a step of `dt` in which the bodies pushed with `reaction`: new shift and rate. With
  !> `presses` the machine presses with `force`, else it holds its place.
  pure subroutine follow(self, dt, reaction, presses, force, mass_scaling)
    class(drive_t), intent(inout) :: self
    real(rp), intent(in) :: dt, reaction        !! [s], out of the plate [N]
    logical, intent(in) :: presses
    real(rp), intent(in) :: force               !! into the plate [N]
    real(rp), intent(in) :: mass_scaling
    real(rp) :: inertia, resistance, pull

    if (.not. self%is_free) return
    inertia = self%mass*mass_scaling
    resistance = self%damping*sqrt(mass_scaling)
    self%shift = self%offset(self%time + dt)
    self%time = self%time + dt
    self%felt = self%felt + (reaction - self%felt)*min(1.0_rp, dt*resistance/inertia)
    if (presses) then
      self%rate = (self%rate + dt/inertia*(reaction - force))/(1.0_rp + dt*resistance/inertia)
      self%force = force
    else if (self%stiffness > 0.0_rp) then
      ! What has pressed with a force goes on as a spring under that force.
      if (self%presses) self%neutral = self%shift - self%force/self%stiffness
      pull = self%stiffness*(self%shift - self%neutral)
      self%rate = (self%rate + dt/inertia*(reaction - pull)) &
                  /(1.0_rp + dt*resistance/inertia + dt**2*self%stiffness/inertia)
      self%force = self%stiffness*(self%offset(self%time + dt) - self%neutral)
    else
      self%rate = 0.0_rp
      self%force = self%felt
    end if
    self%presses = presses
  end subroutine follow

  !> Its state, for a checkpoint; `time` is that of the run.
  pure function state(self)
    class(drive_t), intent(in) :: self
    real(rp) :: state(n_drive)

    state = [self%shift, self%rate, self%neutral, self%felt, self%force, &
             merge(1.0_rp, 0.0_rp, self%presses), real(self%phase, rp), self%begin]
  end function state

  !> The state of a checkpoint at `time`.
  pure subroutine set_state(self, state, time)
    class(drive_t), intent(inout) :: self
    real(rp), intent(in) :: state(n_drive), time

    self%shift = state(1)
    self%rate = state(2)
    self%neutral = state(3)
    self%felt = state(4)
    self%force = state(5)
    self%presses = state(6) > 0.0_rp
    self%phase = nint(state(7))
    self%begin = state(8)
    self%time = time
  end subroutine set_state

end module contact_motion
