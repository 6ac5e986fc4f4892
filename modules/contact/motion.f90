! SPDX-License-Identifier: MIT
!> Schedule of a rigid tool: phases of constant velocity and spin, joined by linear ramps.
!> The pose is a closed function of time, so that a restart needs no state.
module contact_motion
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: phase_t, motion_t

  type :: phase_t
    real(rp) :: duration = 0.0_rp      !! [s]; 0: to the end of the run
    real(rp) :: velocity(3) = 0.0_rp   !! [m/s]
    real(rp) :: spin = 0.0_rp          !! [rad/s], clockwise seen from above is positive
    real(rp) :: ramp = 0.0_rp          !! time to change from the phase before [s]
    logical :: presses = .false.       !! with a force along the axis of the tool
    real(rp) :: force = 0.0_rp         !! into the plate [N]
  end type phase_t

  type :: motion_t
    type(phase_t), allocatable :: phase(:)
  contains
    procedure :: at
    procedure :: phase_at
    procedure :: pressing
  end type motion_t

contains

  !> Displacement [m] since t = 0, velocity [m/s], turned angle [rad] and spin [rad/s] at time `t`.
  !> The tool starts with the first phase's velocity unless that phase has a ramp, and rests after
  !> the last phase if that has a duration.
  pure subroutine at(self, t, shift, velocity, angle, spin)
    class(motion_t), intent(in) :: self
    real(rp), intent(in) :: t
    real(rp), intent(out) :: shift(3), velocity(3), angle, spin
    real(rp) :: now(4), before(4), way(4), from, length, s
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
      if (t < from + phase%ramp) force = before + (phase%force - before)*(t - from)/phase%ramp
    end associate
  end subroutine pressing

  !> Add the displacement in `s` seconds that start with `before` and ramp to `target`.
  pure subroutine advance(before, target, ramp, s, way, now)
    real(rp), intent(in) :: before(4), target(4), ramp, s
    real(rp), intent(inout) :: way(4)
    real(rp), intent(out) :: now(4)
    real(rp) :: part

    if (ramp > 0.0_rp .and. s < ramp) then
      part = s/ramp
      now = before + (target - before)*part
      way = way + s*0.5_rp*(before + now)
    else
      now = target
      way = way + ramp*0.5_rp*(before + target) + (s - ramp)*target
    end if
  end subroutine advance

end module contact_motion
