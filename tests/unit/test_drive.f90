! SPDX-License-Identifier: MIT
!> What presses a tool along its axis: equation of motion, phases, state.
program test_drive
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use tools_motion, only: drive_t, motion_t, n_drive, phase_t
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)

  call begin_tests()
  call test_spring()
  call test_force()
  call test_change_of_drive()
  call test_schedule()
  call test_state()
  call test_mean_motion()
  call end_tests()

contains

  !> A constant reaction R on a spring of critical damping: u = R/k (1 - (1 + w t) exp(-w t)) with
  !> w = sqrt(k/M); mass scaling s makes that slower by sqrt(s). To first order in the step.
  subroutine test_spring()
    real(rp), parameter :: k = 3.0e7_rp, mass = 0.2_rp, reaction = 900.0_rp
    type(drive_t) :: drive
    real(rp) :: scaling, w, dt, t, off, u
    integer :: i, j

    do j = 0, 2
      scaling = 100.0_rp**j
      w = sqrt(k/(mass*scaling))
      dt = 1.0e-3_rp/w
      drive = drive_t(is_free=.true., mass=mass, stiffness=k, damping=2.0_rp*sqrt(k*mass))
      off = 0.0_rp
      do i = 1, 8000
        call drive%integrate(dt, reaction, .false., 0.0_rp, scaling)
        t = i*dt
        u = reaction/k*(1.0_rp - (1.0_rp + w*t)*exp(-w*t))
        off = max(off, abs(drive%offset(t) - u)*k/reaction)
      end do
      call expect_close('oscillator with critical damping', off, 0.0_rp, atol=2.0e-3_rp)
      call expect_close('what the spring bears', drive%force, reaction, rtol=5.0e-3_rp)
    end do
  end subroutine test_spring

  !> Pressed with F against nothing it sinks with F/c in the end, and rests where R = F.
  subroutine test_force()
    real(rp), parameter :: damping = 2.0e3_rp, force = 500.0_rp, dt = 1.0e-5_rp
    type(drive_t) :: drive
    integer :: i

    drive = drive_t(is_free=.true., mass=0.1_rp, damping=damping)
    do i = 1, 100
      call drive%integrate(dt, 0.0_rp, .true., force, 1.0_rp)
    end do
    call expect_close('speed of sinking', drive%rate, -force/damping, rtol=1.0e-6_rp)
    call expect('it sinks', drive%shift < 0.0_rp)
    do i = 1, 100
      call drive%integrate(dt, force, .true., force, 1.0_rp)
    end do
    call expect_close('rest', drive%rate, 0.0_rp, atol=1.0e-6_rp*force/damping)
    call expect_close('reaction of late', drive%reaction_ema, force, rtol=1.0e-6_rp)
  end subroutine test_force

  !> From a force to a place: a rigid machine stops where it is, a spring goes on under that force.
  subroutine test_change_of_drive()
    real(rp), parameter :: force = 500.0_rp, dt = 1.0e-5_rp, stiffness(2) = [0.0_rp, 4.0e6_rp]
    type(drive_t) :: drive
    real(rp) :: depth
    integer :: i, j

    do j = 1, 2
      drive = drive_t(is_free=.true., mass=0.1_rp, damping=2.0e3_rp, stiffness=stiffness(j))
      do i = 1, 200                          ! sinks for a while, then rests
        call drive%integrate(dt, merge(force, 0.0_rp, i > 50), .true., force, 1.0_rp)
      end do
      depth = drive%shift
      do i = 1, 200
        call drive%integrate(dt, force, .false., 0.0_rp, 1.0_rp)
      end do
      call expect_close('it stays as deep', drive%shift, depth, rtol=1.0e-6_rp)
      call expect_close('and bears what it did', drive%force, force, rtol=1.0e-6_rp)
    end do
  end subroutine test_change_of_drive

  !> Phases, and ramps from the force that there was.
  subroutine test_schedule()
    type(motion_t) :: motion
    type(drive_t) :: drive
    real(rp) :: force
    logical :: presses

    motion%phase = [phase_t(duration=2.0_rp), phase_t(duration=3.0_rp, is_force_controlled=.true., &
                    force=80.0_rp, ramp=1.0_rp), phase_t(is_force_controlled=.true., force=20.0_rp)]
    drive%force = 40.0_rp
    call drive%enter_phase(motion%phase_at(1.0_rp))
    call motion%force_control_at(1.0_rp, drive%phase_start_force, presses, force)
    call expect('no force in the first phase', .not. presses)
    call drive%enter_phase(motion%phase_at(2.5_rp))
    drive%force = 60.0_rp                    ! as it grows
    call drive%enter_phase(motion%phase_at(2.5_rp))
    call motion%force_control_at(2.5_rp, drive%phase_start_force, presses, force)
    call expect('force in the second', presses)
    call expect_close('half of the ramp', force, 60.0_rp, rtol=1.0e-12_rp)
    call motion%force_control_at(4.0_rp, drive%phase_start_force, presses, force)
    call expect_close('after the ramp', force, 80.0_rp, rtol=1.0e-12_rp)
    call motion%force_control_at(9.0_rp, drive%phase_start_force, presses, force)
    call expect_close('the last one, without an end', force, 20.0_rp, rtol=1.0e-12_rp)
    motion%phase(3)%duration = 1.0_rp
    call motion%force_control_at(9.0_rp, drive%phase_start_force, presses, force)
    call expect('behind the last one', .not. presses .and. motion%phase_at(9.0_rp) == 4)
  end subroutine test_schedule

  !> What a checkpoint keeps is all that the next step needs.
  subroutine test_state()
    type(drive_t) :: drive, other

    drive = drive_t(is_free=.true., mass=0.1_rp, damping=2.0e3_rp, stiffness=4.0e6_rp)
    other = drive
    call drive%integrate(1.0e-5_rp, 3.0_rp, .true., 500.0_rp, 1.0_rp)
    call drive%enter_phase(2)
    call other%set_state(drive%state(), drive%time)
    other%reaction_ema = drive%reaction_ema   ! a sum of the ranks (output_checkpoint)
    call drive%integrate(1.0e-5_rp, 7.0_rp, .false., 0.0_rp, 1.0_rp)
    call other%integrate(1.0e-5_rp, 7.0_rp, .false., 0.0_rp, 1.0_rp)
    call expect('the same to the bit', all(abs(drive%state() - other%state()) <= 0.0_rp) &
                .and. size(drive%state()) == n_drive)
  end subroutine test_state

  !> The mean motion of a step of a tool that its machine also moves is the way between the places
  !> at both ends; its velocity is that of the schedule and of the machine.
  subroutine test_mean_motion()
    type(tool_t) :: tool
    type(rigid_t) :: rigid
    real(rp), parameter :: velocity(3) = [0.02_rp, -0.01_rp, -0.004_rp], t = 0.7_rp, dt = 0.1_rp, &
                           axis(3) = [0.36_rp, 0.48_rp, 0.8_rp]
    real(rp), dimension(3) :: before, after

    tool%start = [1.0_rp, 2.0_rp, 3.0_rp]
    tool%motion%phase = [phase_t(velocity=velocity)]
    tool%drive = drive_t(is_free=.true., axis=axis, shift=0.03_rp, rate=-0.05_rp, time=0.6_rp)
    call tool%move_to(t)
    before = tool%position
    call expect_close('velocity of a free tool', &
                      norm2(tool%velocity - velocity + 0.05_rp*axis), 0.0_rp, atol=1.0e-15_rp)
    call expect_close('its place', norm2(before - tool%start - t*velocity - 0.025_rp*axis), &
                      0.0_rp, atol=1.0e-14_rp)
    call tool%move_to(t + dt)
    after = tool%position
    rigid = tool%mean_motion(t, dt)
    call expect_close('mean velocity', norm2(rigid%velocity - (after - before)/dt), 0.0_rp, &
                      atol=1.0e-14_rp)
    call expect_close('mean place', norm2(rigid%centre - 0.5_rp*(before + after)), 0.0_rp, &
                      atol=1.0e-14_rp)
  end subroutine test_mean_motion

end program test_drive
