! SPDX-License-Identifier: MIT
!> The schedule of a tool against the sum of small steps, its path against a circle.
program test_motion
  use base_kinds, only: pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use tools_monitor, only: monitor_t
  use tools_motion, only: motion_t, path_t, phase_t
  use tools_paths, only: new_path
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)

  call begin_tests()
  call test_schedule()
  call test_after_the_end()
  call test_rest()
  call test_growing_load()
  call test_circle()
  call test_corner()
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
    type(monitor_t) :: monitor
    real(rp) :: load(2)
    integer :: i

    do i = 1, 2000
      call monitor%update_load([3.0_rp*i, 7.0_rp], 0.05_rp)
    end do
    load = monitor%load()
    call expect_close('a load that grows', load(1), 6000.0_rp, rtol=1.0e-12_rp)
    call expect_close('a constant one', load(2), 7.0_rp, rtol=1.0e-12_rp)
    call expect('its mean lags', monitor%load_ema(1) < 5950.0_rp)
  end subroutine test_growing_load

  !> Three quarters of a circle at one speed, from +y on, behind a plunge: the mean over a ramp T of
  !> a circle is one of radius R sin(w T/2)/(w T/2), T/2 later. The tilt leans against the tangent,
  !> and velocities are those of the pose.
  subroutine test_circle()
    integer, parameter :: n = 541
    real(rp), parameter :: radius = 0.02_rp, w = 0.25_rp, ramp = 0.4_rp, plunge = 2.0_rp, &
                           lean = 3.0_rp*pi/180.0_rp, small = 1.0e-5_rp
    real(rp) :: a(n), mean, off, turned, middle, t, x(3), before(3), after(3), y(3)
    type(tool_t) :: tool
    type(rigid_t) :: rigid
    integer :: k

    a = 1.5_rp*pi*[(k, k=0, n - 1)]/(n - 1)
    tool%start = [1.0_rp, 2.0_rp, 3.0_rp]
    tool%frame = reshape([cos(lean), 0.0_rp, sin(lean), 0.0_rp, 1.0_rp, 0.0_rp, &
                          -sin(lean), 0.0_rp, cos(lean)], [3, 3])
    tool%motion%phase = [phase_t(duration=plunge, velocity=[0.0_rp, 0.0_rp, -1.0e-3_rp], &
                                 spin=30.0_rp), &
      phase_t(duration=a(n)/w + ramp, ramp=ramp, spin=30.0_rp, &
              path=new_path(a/w, reshape([radius*cos(a), radius*sin(a), 0.0_rp*a], [3, n], &
                                         order=[2, 1]), [(k, k=1, n)], .true.)), &
                             phase_t(spin=30.0_rp)]
    call tool%move_to(0.0_rp)
    call expect_close('circle: before it the tilt is that of its beginning', &
                      norm2(tool%axes(:, 3) - [0.0_rp, -sin(lean), cos(lean)]), 0.0_rp, &
                      atol=1.0e-3_rp)
    mean = sin(0.5_rp*w*ramp)/(0.5_rp*w*ramp)
    off = 0.0_rp
    turned = 0.0_rp
    do k = 1, 100
      t = ramp + 0.01_rp*k*(a(n)/w - 2.0_rp*ramp)
      middle = w*(t - 0.5_rp*ramp)
      call tool%move_to(plunge + t)
      x = tool%start + [radius*(mean*cos(middle) - 1.0_rp), radius*mean*sin(middle), &
                        -1.0e-3_rp*plunge + 0.5e-3_rp*(-ramp)]
      off = max(off, norm2(tool%position - x))
      turned = max(turned, norm2(tool%axes(:, 3) &
                                 - [sin(lean)*sin(middle), -sin(lean)*cos(middle), cos(lean)]))
    end do
    call expect_close('circle: place', off, 0.0_rp, atol=radius*(a(2)**2/8.0_rp + 1.0e-12_rp))
    call expect_close('circle: tilt', turned, 0.0_rp, &
                      atol=1.001_rp*sin(lean)*a(2)**2/(8.0_rp*w*ramp))
    call expect_close('circle: sense of the tilt', tool%tilt(), lean, atol=1.0e-12_rp)
    y = [0.006_rp, -0.003_rp, 0.002_rp]
    t = plunge + 3.0_rp
    call tool%move_to(t - small)
    before = tool%position + matmul(tool%axes, y)
    call tool%move_to(t + small)
    after = tool%position + matmul(tool%axes, y)
    rigid = tool%mean_motion(t - small, 2.0_rp*small)
    call expect_close('circle: mean motion', norm2(rigid%velocity_at(0.5_rp*(before + after)) &
                                                   - (after - before)/(2.0_rp*small)), 0.0_rp, &
                      atol=1.0e-8_rp)
    call tool%move_to(t)
    call expect_close('circle: velocity of the surface', &
                      norm2(tool%surface_velocity(tool%position + matmul(tool%axes, y)) &
                            - (after - before)/(2.0_rp*small)), 0.0_rp, atol=1.0e-7_rp)
    call expect_close('circle: what turns the tilt', tool%omega(3) + 30.0_rp*tool%axes(3, 3), w, &
                      rtol=a(2)/(w*ramp))
    call tool%move_to(plunge + a(n)/w + ramp + 1.0_rp)
    call expect_close('circle: its end', &
                      norm2(tool%position - tool%start - [-radius, -radius, -2.2e-3_rp]), 0.0_rp, &
                      atol=1.0e-12_rp)
    call expect('circle: rest behind it', all(abs(tool%velocity) <= 0.0_rp))
  end subroutine test_circle

  !> A corner with a rest in it: as two phases with the same ramp and one without motion between.
  subroutine test_corner()
    type(motion_t) :: one, other
    type(path_t) :: path
    real(rp) :: a(4), b(4), v(3), u(3), spin, off, t
    integer :: k

    path = new_path([5.0_rp, 6.0_rp, 7.5_rp, 9.5_rp], &
                    reshape([1.0_rp, 1.0_rp, 1.0_rp, 3.0_rp, 1.0_rp, 1.0_rp, &
                             3.0_rp, 1.0_rp, 1.0_rp, 3.0_rp, 3.0_rp, 0.0_rp], [3, 4]), &
                    [1, 2, 3, 4], .false.)
    off = 0.0_rp
    do k = 0, 1
      one%phase = [phase_t(duration=1.0_rp, velocity=[0.0_rp, 0.0_rp, 1.0_rp], spin=2.0_rp), &
                   phase_t(duration=4.5_rp, path=path, ramp=0.5_rp*k, spin=3.0_rp)]
      other%phase = [one%phase(1), &
        phase_t(duration=1.0_rp, velocity=[2.0_rp, 0.0_rp, 0.0_rp], ramp=0.5_rp*k, spin=3.0_rp), &
        phase_t(duration=1.5_rp, ramp=0.5_rp*k, spin=3.0_rp), &
        phase_t(duration=2.0_rp, velocity=[0.0_rp, 1.0_rp, -0.5_rp], ramp=0.5_rp*k, spin=3.0_rp)]
      t = 0.0_rp
      do while (t < 5.5_rp)
        call one%at(t, a(1:3), v, a(4), spin)
        call other%at(t, b(1:3), u, b(4), spin)
        off = max(off, maxval(abs(a - b)), maxval(abs(v - u)))
        t = t + 0.01171875_rp
      end do
    end do
    call expect_close('corner', off, 0.0_rp, atol=1.0e-12_rp)
  end subroutine test_corner

end program test_motion
