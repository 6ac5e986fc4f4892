! SPDX-License-Identifier: MIT
!> Contact with a rigid tool: its pose, its forces on points, and the books it keeps.
program test_contact
  use base_kinds, only: nlane, pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_motion, only: phase_t
  use contact_shapes, only: shoulder_profile
  use contact_tool, only: contact_block, kind_plane, kind_revolved, kind_sphere, measure_gaps, &
                          s_creep, s_force, s_friction, s_normal, s_press, s_slide, s_to_plate, &
                          s_torque, s_work, slip_rate, tool_is_near, tool_t
  implicit none (type, external)

  !> What `contact_block` works on.
  type :: points_t
    real(rp) :: x(nlane, 3), v(nlane, 3), dv(nlane, 3), mass(nlane), flow(nlane)
    real(rp) :: force(nlane, 3), heat(nlane)
  end type points_t

  real(rp), parameter :: dt = 1.0e-6_rp, reach = 0.25e-3_rp, area = 0.25e-6_rp, inertia = 100.0_rp
  real(rp), parameter :: unit(3, 3) = reshape([1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp, &
                                               0.0_rp, 0.0_rp, 1.0_rp], [3, 3])

  call begin_tests()
  call random_init(.true., .false.)
  call test_pose()
  call test_stop_at_gap_zero()
  call test_penetration()
  call test_friction_cone()
  call test_books()
  call test_torque_sign()
  call test_nearest_tool()
  call test_near()
  call end_tests()

contains

  !> A flat shoulder with a pin, tilted, spinning and travelling.
  type(tool_t) function stirring_tool() result(tool)
    real(rp), parameter :: tilt = 3.0_rp*pi/180.0_rp

    tool%kind = kind_revolved
    tool%profile = shoulder_profile(0.010_rp, 0.020_rp, 0.1_rp, 0.003_rp, 0.002_rp, 0.004_rp)
    tool%radius = 0.030_rp
    tool%start = [0.01_rp, 0.02_rp, 0.012_rp]
    tool%frame = reshape([cos(tilt), 0.0_rp, sin(tilt), 0.0_rp, 1.0_rp, 0.0_rp, &
                          -sin(tilt), 0.0_rp, cos(tilt)], [3, 3])
    tool%friction = 0.4_rp
    tool%heat_share = 0.8_rp
    allocate (tool%motion%phase(1))
    tool%motion%phase(1) = phase_t(velocity=[1.8e-3_rp, 0.0_rp, -0.1_rp], spin=100.0_rp, &
                                   ramp=0.02_rp)
  end function stirring_tool

  !> Plane z = 0 below the material, moving up and sliding.
  type(tool_t) function plane_tool(velocity, spin) result(tool)
    real(rp), intent(in) :: velocity(3), spin

    tool%kind = kind_plane
    tool%frame = unit
    tool%friction = 0.3_rp
    allocate (tool%motion%phase(1))
    tool%motion%phase(1) = phase_t(velocity=velocity, spin=spin)
    call tool%move_to(0.0_rp)
  end function plane_tool

  !> The surface velocity is that of a point fixed in the tool's axes; clockwise from above.
  subroutine test_pose()
    type(tool_t) :: tool
    real(rp), parameter :: y(3) = [0.006_rp, -0.003_rp, 0.002_rp], small = 1.0e-6_rp
    real(rp) :: before(3), after(3), v(3), d, n(3), d2, unused(3)

    tool = stirring_tool()
    call tool%move_to(0.03_rp - small)
    before = tool%position + matmul(tool%axes, y)
    call tool%move_to(0.03_rp + small)
    after = tool%position + matmul(tool%axes, y)
    call tool%move_to(0.03_rp)
    v = tool%surface_velocity(tool%position + matmul(tool%axes, y))
    call expect_close('surface velocity', norm2(v - (after - before)/(2.0_rp*small)), 0.0_rp, &
                      atol=1.0e-7_rp)
    call expect_close('axes stay orthonormal', &
                      norm2(matmul(transpose(tool%axes), tool%axes) - unit), 0.0_rp, &
                     atol=1.0e-13_rp)
    v = tool%surface_velocity(tool%position + 0.01_rp*tool%frame(:, 1)) - tool%velocity
    call expect('clockwise from above: the +x side moves to -y', v(2) < -0.9_rp)
    call tool%distance(tool%position + matmul(tool%axes, y), d, n)
    call tool%distance(tool%position + matmul(tool%axes, y) + small*n, d2, unused)
    call expect_close('distance grows along its gradient', (d2 - d)/small, 1.0_rp, rtol=1.0e-6_rp)
  end subroutine test_pose

  !> Random points above z = 0, at rest or moving, without force.
  subroutine random_points(points, gap, speed)
    type(points_t), intent(out) :: points
    real(rp), intent(in) :: gap, speed   !! least and largest gap is -/+ gap
    real(rp) :: u(nlane)

    call random_number(points%x)
    points%x = 0.02_rp*(points%x - 0.5_rp)
    call random_number(u)
    points%x(:, 3) = reach + gap*(2.0_rp*u - 1.0_rp)
    call random_number(points%v)
    points%v = speed*(2.0_rp*points%v - 1.0_rp)
    points%dv = 0.0_rp
    call random_number(u)
    points%mass = 1.0e-6_rp*(1.0_rp + u)
    points%flow = 0.0_rp
    points%force = 0.0_rp
    points%heat = 0.0_rp
  end subroutine random_points

  subroutine touch(tools, points)
    type(tool_t), intent(inout) :: tools(:)
    type(points_t), intent(inout) :: points
    real(rp) :: d(nlane), normal(nlane, 3)
    integer :: touched(nlane)

    call measure_gaps(tools, nlane, 1.0e3_rp, points%x, touched, d, normal)
    call contact_block(tools, nlane, dt, inertia, spread(2.0_rp*reach, 1, 3), touched, d, normal, &
                       points%x, points%v, points%dv, points%mass, points%flow, points%force, &
                       points%heat)
  end subroutine touch

  !> Free points: one step with the contact force alone.
  subroutine move(points)
    type(points_t), intent(inout) :: points
    integer :: a

    do a = 1, 3
      points%dv(:, a) = dt*points%force(:, a)/(inertia*points%mass)
    end do
    points%v = points%v + points%dv
    points%x = points%x + dt*points%v
  end subroutine move

  !> Points that would pass the surface stop on it, even if it moves; the others feel nothing.
  subroutine test_stop_at_gap_zero()
    type(points_t) :: points, start
    type(tool_t) :: tools(1)
    real(rp) :: gap(nlane), next(nlane)
    logical :: stops(nlane)

    tools(1) = plane_tool([0.3_rp, 0.0_rp, 0.5_rp], 0.0_rp)
    call random_points(points, 1.5e-6_rp, 1.0_rp)
    points%x(:, 3) = reach + abs(points%x(:, 3) - reach)
    start = points
    gap = points%x(:, 3) - reach
    stops = gap + dt*(points%v(:, 3) - 0.5_rp) < 0.0_rp
    call touch(tools, points)
    call expect('points stop and pass', count(stops) > 5 .and. count(stops) < nlane - 5)
    call expect('a point that does not arrive feels nothing', &
                all(pack(norm2(points%force, 2), .not. stops) == 0.0_rp))
    call move(points)
    call tools(1)%move_to(dt)
    next = points%x(:, 3) - reach - tools(1)%position(3)
    call expect_close('points stop at gap zero', maxval(abs(pack(next, stops)))/1.0e-6_rp, 0.0_rp, &
                      atol=1.0e-9_rp)
    call expect('the others are where they would be', &
                all(pack(points%x(:, 3) - start%x(:, 3) - dt*start%v(:, 3), .not. stops) == 0.0_rp &
                    .or. pack(abs(points%v(:, 3) - start%v(:, 3)), .not. stops) == 0.0_rp))
    call expect('no point inside', all(next > -1.0e-14_rp))
  end subroutine test_stop_at_gap_zero

  !> A penetration at rest is taken back in part, and never pulled deeper.
  subroutine test_penetration()
    type(points_t) :: points
    type(tool_t) :: tools(1)
    real(rp) :: gap(nlane), next(nlane)

    tools(1) = plane_tool([0.0_rp, 0.0_rp, 0.0_rp], 0.0_rp)
    call random_points(points, 1.0e-6_rp, 0.0_rp)
    points%x(:, 3) = reach - abs(points%x(:, 3) - reach)
    gap = points%x(:, 3) - reach
    call touch(tools, points)
    call expect('penetration pushes out', all(points%force(:, 3) > 0.0_rp))
    call move(points)
    next = points%x(:, 3) - reach
    call expect('penetration is taken back, not thrown out', all(next > gap .and. next <= 0.0_rp))
  end subroutine test_penetration

  !> Coulomb's cone, the shear limit, no tension, and friction against the slip that never turns it.
  subroutine test_friction_cone()
    type(points_t) :: points
    type(tool_t) :: tools(1)
    real(rp) :: d, n(3), slip(3), fn, ft(3), tangent(3), limit, u(nlane), gap(nlane)
    integer :: batch, p, n_touched, n_limited, n_stuck
    logical :: no_tension, in_cone, in_limit, against, not_turned

    tools(1) = stirring_tool()
    call tools(1)%move_to(0.05_rp)
    no_tension = .true.
    in_cone = .true.
    in_limit = .true.
    against = .true.
    not_turned = .true.
    n_touched = 0
    n_limited = 0
    n_stuck = 0
    do batch = 1, 100
      call random_points(points, 1.0e-6_rp, 0.2_rp)
      gap = points%x(:, 3) - reach
      do p = 1, nlane                      ! near the tool's face, some of them moving with it
        points%x(p, 3) = -2.0_rp*reach
        points%x(p, :) = tools(1)%position + matmul(tools(1)%axes, points%x(p, :))
        call tools(1)%distance(points%x(p, :), d, n)
        points%x(p, :) = points%x(p, :) + (reach + gap(p) - d)*n
        if (mod(p, 2) == 0) points%v(p, :) = 1.0e-2_rp*points%v(p, :) &
                                             + tools(1)%surface_velocity(points%x(p, :))
      end do
      call random_number(u)
      points%flow = merge(1.0e8_rp*u, 0.0_rp, u > 0.2_rp)
      call touch(tools, points)
      do p = 1, nlane
        call tools(1)%distance(points%x(p, :), d, n)
        fn = dot_product(points%force(p, :), n)
        ft = points%force(p, :) - fn*n
        no_tension = no_tension .and. fn >= -1.0e-12_rp*norm2(points%force(p, :))
        if (norm2(points%force(p, :)) <= 0.0_rp) cycle
        n_touched = n_touched + 1
        slip = points%v(p, :) - tools(1)%surface_velocity(points%x(p, :))
        tangent = slip - dot_product(slip, n)*n
        in_cone = in_cone .and. norm2(ft) <= 0.4_rp*fn*(1.0_rp + 1.0e-10_rp)
        limit = points%flow(p)*area/sqrt(3.0_rp)
        if (limit > 0.0_rp) in_limit = in_limit .and. norm2(ft) <= limit*(1.0_rp + 1.0e-10_rp)
        if (limit > 0.0_rp .and. limit < 0.4_rp*fn) n_limited = n_limited + 1
        against = against .and. norm2(ft/max(norm2(ft), tiny(1.0_rp)) + tangent/norm2(tangent)) &
                                < 1.0e-6_rp
        not_turned = not_turned .and. dt*norm2(ft) &
                     <= inertia*points%mass(p)*norm2(tangent)*(1.0_rp + 1.0e-10_rp)
        if (limit <= 0.0_rp) limit = 0.4_rp*fn
        if (norm2(ft) < 0.99_rp*min(0.4_rp*fn, limit)) n_stuck = n_stuck + 1
      end do
    end do
    call expect('friction: points touch, slide at the limit, stick', &
                n_touched > 1000 .and. n_limited > 50 .and. n_stuck > 50)
    call expect('friction: no tension', no_tension)
    call expect('friction: in the cone', in_cone)
    call expect('friction: below the shear strength', in_limit)
    call expect('friction: against the slip', against)
    call expect('friction: the slip is not turned round', not_turned)
  end subroutine test_friction_cone

  !> Free points: what the tool works is what the points gain and what becomes heat.
  subroutine test_books()
    type(points_t) :: points, before
    type(tool_t) :: tools(1)
    real(rp) :: lost, gained, impulse(3), mean(3), rigid(3), arm(3), moment, press, scale
    integer :: p

    tools(1) = plane_tool([0.3_rp, -0.2_rp, 0.4_rp], 50.0_rp)
    tools(1)%heat_share = 0.8_rp
    call random_points(points, 1.0e-6_rp, 1.0_rp)
    call touch(tools, points)
    call expect('no force, no books', all(tools(1)%sums == 0.0_rp))
    before = points
    call move(points)
    call touch(tools, points)
    lost = 0.0_rp
    gained = 0.0_rp
    impulse = 0.0_rp
    moment = 0.0_rp
    press = 0.0_rp
    do p = 1, nlane
      mean = 0.5_rp*(before%v(p, :) + points%v(p, :))
      arm = points%x(p, :) - tools(1)%position
      rigid = [0.3_rp, -0.2_rp, 0.4_rp] + 50.0_rp*[arm(2), -arm(1), 0.0_rp]
      lost = lost - dt*dot_product(before%force(p, :), mean - rigid)
      gained = gained + 0.5_rp*inertia*points%mass(p)*(sum(points%v(p, :)**2) &
                                                       - sum(before%v(p, :)**2))
      impulse = impulse - dt*before%force(p, :)
      moment = moment - dt*(arm(1)*before%force(p, 2) - arm(2)*before%force(p, 1))
      press = press + dt*before%force(p, 3)
    end do
    associate (s => tools(1)%sums)
      scale = abs(s(s_work)) + abs(gained)
      call expect_close('friction heat and normal loss', s(s_friction) + s(s_normal), lost, &
                        rtol=1.0e-12_rp)
      call expect_close('work = gain + losses', s(s_work), gained + lost, atol=1.0e-12_rp*scale)
      call expect_close('impulse', norm2(s(s_force:s_force + 2) - impulse)/norm2(impulse), 0.0_rp, &
                        atol=1.0e-13_rp)
      call expect_close('torque', s(s_torque), moment, rtol=1.0e-12_rp)
      call expect_close('work = force, way, torque, angle', s(s_work), &
                        50.0_rp*s(s_torque) - dot_product(impulse, [0.3_rp, -0.2_rp, 0.4_rp]), &
                        atol=1.0e-12_rp*scale)
      call expect_close('normal impulse', s(s_press), press, rtol=1.0e-12_rp)
      call expect('friction makes heat', s(s_friction) > 0.0_rp)
      call expect('creep and slide are positive', s(s_creep) > 0.0_rp .and. s(s_slide) > 0.0_rp)
      call expect_close('heat into the plate', s(s_to_plate), 0.8_rp*s(s_friction))
      call expect_close('heat waiting at the points', sum(points%heat), s(s_to_plate), &
                        rtol=1.0e-12_rp)
      call expect('no point cools by friction', all(points%heat >= -1.0e-15_rp*scale))
    end associate
  end subroutine test_books

  !> A tool that spins clockwise over resting material feels a positive torque.
  subroutine test_torque_sign()
    type(points_t) :: points
    type(tool_t) :: tools(1)

    tools(1) = stirring_tool()
    call tools(1)%move_to(0.05_rp)
    call random_points(points, 0.0_rp, 0.0_rp)
    points%x(:, 3) = 0.5e-3_rp
    points%x = spread(tools(1)%position, 1, nlane) + matmul(points%x, transpose(tools(1)%axes))
    points%flow = 0.0_rp
    call touch(tools, points)
    call expect('points in the face are pushed', count(norm2(points%force, 2) > 0.0_rp) > 20)
    call move(points)
    call touch(tools, points)
    call expect('torque against a clockwise spin', tools(1)%sums(s_torque) > 0.0_rp)
    call expect('the spin works', tools(1)%sums(s_work) > 0.0_rp)
    call expect('the material pushes the tool up', tools(1)%sums(s_force + 2) > 0.0_rp)
  end subroutine test_torque_sign

  !> Of two tools the nearer one acts.
  subroutine test_nearest_tool()
    type(points_t) :: points
    type(tool_t) :: tools(2)
    real(rp) :: d(nlane), normal(nlane, 3), rate(nlane)
    integer :: p, touched(nlane)

    tools(1) = plane_tool([0.0_rp, 0.0_rp, 0.0_rp], 0.0_rp)
    tools(2) = tools(1)
    tools(2)%kind = kind_sphere
    tools(2)%radius = 1.0_rp
    tools(2)%start = [0.0_rp, 0.0_rp, 3.0_rp]
    call tools(2)%move_to(0.0_rp)
    call random_points(points, 1.0e-6_rp, 0.1_rp)
    points%v(:, 3) = -1.0_rp
    do p = 2, nlane, 2                      ! even points below the sphere, rising
      points%x(p, :) = [0.0_rp, 0.0_rp, 2.0_rp - reach]
      points%v(p, 3) = 1.0_rp
    end do
    call measure_gaps(tools, nlane, 1.0e3_rp, points%x, touched, d, normal)
    call expect('the nearest tool', all(touched(1::2) == 1) .and. all(touched(2::2) == 2))
    call expect_close('its distance', maxval(abs(d(2::2) - reach)), 0.0_rp, atol=1.0e-12_rp)
    call expect('its direction', all(normal(1::2, 3) > 0.999_rp) &
                .and. all(normal(2::2, 3) < -0.999_rp))
    call slip_rate(tools, nlane, 2.0_rp*reach, touched, points%x, points%v, rate)
    call expect_close('rate of a sticking layer', rate(2), &
                      norm2(points%v(2, :))/(sqrt(3.0_rp)*0.5e-3_rp))
    call touch(tools, points)
    call expect('the plane pushes up', all(points%force(1::2, 3) >= 0.0_rp) &
                .and. any(points%force(1::2, 3) > 0.0_rp))
    call expect('the sphere pushes down', all(points%force(2::2, 3) < 0.0_rp))
    call move(points)
    call touch(tools, points)
    call expect('each tool keeps its own books', tools(1)%sums(s_force + 2) < 0.0_rp &
                .and. tools(2)%sums(s_force + 2) > 0.0_rp)
  end subroutine test_nearest_tool

  subroutine test_near()
    type(tool_t) :: tools(1)

    tools(1) = stirring_tool()
    call tools(1)%move_to(0.0_rp)
    call expect('a ball that reaches the tool', &
                tool_is_near(tools, tools(1)%position - [0.0_rp, 0.0_rp, 6.0e-3_rp], 2.1e-3_rp))
    call expect('a ball that does not', .not. &
                tool_is_near(tools, tools(1)%position - [0.0_rp, 0.0_rp, 6.0e-3_rp], 1.9e-3_rp))
  end subroutine test_near

end program test_contact
