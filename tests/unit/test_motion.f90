! SPDX-License-Identifier: MIT
!> The schedule of a tool against the sum of small steps.
program test_motion
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_motion, only: motion_t, phase_t, watch_t
  implicit none (type, external)

  call begin_tests()
  call test_schedule()
  call test_after_the_end()
  call test_rest()
  call test_growing_load()
  call end_tests()

contains

  !> Velocity (3) and spin of a schedule at time t, phase after phase.
  pure function rate_at(phase, t) result(now)
    type(phase_t), intent(in) :: phase(:)
    real(rp), intent(in) :: t
    real(rp) :: now(4), target(4), s, rest
    integer :: i

    now = 0.0_rp
    rest = t
    do i = 1, size(phase)
      target = [phase(i)%velocity, phase(i)%spin]
      s = rest
      if (phase(i)%duration > 0.0_rp) s = min(rest, phase(i)%duration)
      if (s < phase(i)%ramp) then
        now = now + (target - now)*s/phase(i)%ramp
      else
        now = target
      end if
      if (phase(i)%duration <= 0.0_rp .or. rest <= phase(i)%duration) return
      rest = rest - phase(i)%duration
    end do
  end function rate_at

  !> Ramps, a phase shorter than its ramp, and a last one without end, against summing small steps.
  subroutine test_schedule()
    type(motion_t) :: motion
    real(rp), parameter :: small = 1.0e-3_rp
    real(rp) :: shift(3), velocity(3), angle, spin, way(4), before(4), now(4), t, off_way, off_rate
    integer :: i

    motion%phase = [ &
      phase_t(duration=1.0_rp, velocity=[0.0_rp, 0.0_rp, -1.0_rp], ramp=0.25_rp), &
      phase_t(duration=2.0_rp, velocity=[2.0_rp, 1.0_rp, 0.0_rp], spin=100.0_rp, ramp=0.5_rp), &
      phase_t(duration=0.5_rp, velocity=[0.0_rp, -3.0_rp, 0.0_rp], spin=-20.0_rp, ramp=1.0_rp), &
      phase_t(duration=0.25_rp, velocity=[0.0_rp, 1.0_rp, 1.0_rp], spin=5.0_rp, ramp=0.25_rp), &
      phase_t(velocity=[1.0_rp, 1.0_rp, 1.0_rp], spin=50.0_rp, ramp=0.125_rp)]
    way = 0.0_rp
    before = rate_at(motion%phase, 0.0_rp)
    off_way = 0.0_rp
    off_rate = 0.0_rp
    do i = 1, 5000
      t = i*small
      now = rate_at(motion%phase, t)
      way = way + 0.5_rp*small*(before + now)
      before = now
      call motion%at(t, shift, velocity, angle, spin)
      off_way = max(off_way, maxval(abs([shift, angle] - way)))
      off_rate = max(off_rate, maxval(abs([velocity, spin] - now)))
    end do
    call expect_close('motion: way and angle', off_way, 0.0_rp, atol=1.0e-9_rp)
    call expect_close('motion: velocity and spin', off_rate, 0.0_rp, atol=1.0e-9_rp)
    call expect('motion: something turned', angle > 200.0_rp)

    motion%phase = [phase_t(velocity=[2.0_rp, 0.0_rp, 0.0_rp], spin=3.0_rp)]
    call motion%at(0.0_rp, shift, velocity, angle, spin)
    call expect('motion: starts at once without a ramp', velocity(1) == 2.0_rp &
                .and. spin == 3.0_rp .and. all(shift == 0.0_rp) .and. angle == 0.0_rp)
  end subroutine test_schedule

  !> Beyond the last phase the velocity must be that of the pose, whatever it is.
  subroutine test_after_the_end()
    type(motion_t) :: motion
    real(rp) :: shift(3), velocity(3), angle, spin, shift2(3), velocity2(3), angle2, spin2

    motion%phase = [phase_t(duration=1.0_rp, velocity=[2.0_rp, 0.0_rp, 0.0_rp], spin=3.0_rp)]
    call motion%at(2.0_rp, shift, velocity, angle, spin)
    call motion%at(2.5_rp, shift2, velocity2, angle2, spin2)
    call expect_close('after the last phase: velocity', velocity(1), &
                      (shift2(1) - shift(1))/0.5_rp, atol=1.0e-12_rp)
    call expect_close('after the last phase: spin', spin, (angle2 - angle)/0.5_rp, atol=1.0e-12_rp)
  end subroutine test_after_the_end

  subroutine test_rest()
    type(motion_t) :: motion
    real(rp) :: shift(3), velocity(3), angle, spin

    call motion%at(3.0_rp, shift, velocity, angle, spin)
    call expect('a tool without phases rests', all([shift, velocity, angle, spin] == 0.0_rp))
  end subroutine test_rest

  !> A load that grows at one rate is felt as it is, and a constant one, too.
  subroutine test_growing_load()
    type(watch_t) :: watch
    real(rp) :: load(2)
    integer :: i

    do i = 1, 2000
      call watch%feel([3.0_rp*i, 7.0_rp], 0.05_rp)
    end do
    load = watch%load()
    call expect_close('a load that grows', load(1), 6000.0_rp, rtol=1.0e-12_rp)
    call expect_close('a constant one', load(2), 7.0_rp, rtol=1.0e-12_rp)
    call expect('its mean lags', watch%felt(1) < 5950.0_rp)
  end subroutine test_growing_load

end program test_motion
