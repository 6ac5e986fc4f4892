! SPDX-License-Identifier: MIT
!> What presses a tool along its axis: a machine that holds its place, one that gives under load as
!> a spring does, or one that presses with a force. The tool then has an equation of motion along
!> its axis, M dv/dt = R - F - c v, with the reaction R of the bodies, and its place is a state.
!>
!> M is scaled as the mass of the bodies is (&TIME MASS_SCALING), and c with its root.
module contact_drive
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: drive_t, n_drive

  integer, parameter :: n_drive = 8             !! reals of its state

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

end module contact_drive
