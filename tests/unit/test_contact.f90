! SPDX-License-Identifier: MIT
!> Contact with a rigid tool: its pose and shape, its impulses on free points, its sums.
program test_contact
  use base_kinds, only: nlane, pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use tools_law, only: find_closing_velocity, friction_law_t
  use tools_motion, only: phase_t
  use tools_shape_box, only: box_shape_t
  use tools_shape_plane, only: plane_t
  use tools_shape_shoulder, only: new_shoulder
  use tools_sums, only: s_force, s_friction, s_metal_slip, s_normal_impulse, s_normal_loss, &
                        s_tool_slip, s_torque, s_work
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)

  !> Free points, and what contact gave them in the last step.
  type :: points_t
    real(rp) :: x(nlane, 3), v(nlane, 3), mass(nlane), flow(nlane)
    real(rp) :: push(nlane, 3), hold(nlane, 3)
  end type points_t

  real(rp), parameter :: dt = 1.0e-6_rp, reach = 0.25e-3_rp, area = 0.25e-6_rp
  real(rp), parameter :: unit(3, 3) = reshape([1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp, &
                                               0.0_rp, 0.0_rp, 1.0_rp], [3, 3])

  call begin_tests()
  call random_init(.true., .false.)
  call test_pose()
  call test_stop_at_gap_zero()
  call test_penetration()
  call test_friction_cone()
  call test_budget()
  call test_torque_sign()
  call test_way()
  call test_edges()
  call test_bounds()
  call test_no_shape()
  call end_tests()

contains

  !> A flat shoulder with a pin, tilted, spinning and travelling.
  type(tool_t) function stirring_tool() result(tool)
    real(rp), parameter :: tilt = 3.0_rp*pi/180.0_rp

    allocate (tool%shape, source=new_shoulder(0.010_rp, 0.020_rp, 0.1_rp, 0.003_rp, 0.002_rp, &
                                              0.004_rp))
    tool%start = [0.01_rp, 0.02_rp, 0.012_rp]
    tool%frame = reshape([cos(tilt), 0.0_rp, sin(tilt), 0.0_rp, 1.0_rp, 0.0_rp, &
                          -sin(tilt), 0.0_rp, cos(tilt)], [3, 3])
    tool%friction_coefficient = 0.4_rp
    tool%fixed_heat_share = 0.8_rp
    allocate (tool%motion%phase(1))
    tool%motion%phase(1) = phase_t(velocity=[1.8e-3_rp, 0.0_rp, -0.1_rp], spin=100.0_rp, &
                                   ramp=0.02_rp)
  end function stirring_tool

  !> Plane z = 0 below the material, moving up and sliding.
  type(tool_t) function plane_tool(velocity, spin) result(tool)
    real(rp), intent(in) :: velocity(3), spin

    allocate (plane_t :: tool%shape)
    tool%frame = unit
    tool%friction_coefficient = 0.3_rp
    allocate (tool%motion%phase(1))
    tool%motion%phase(1) = phase_t(velocity=velocity, spin=spin)
    call tool%move_to(0.0_rp)
  end function plane_tool

  !> The surface velocity is that of a point fixed in the tool's axes; clockwise from above.
  subroutine test_pose()
    type(tool_t) :: tool
    real(rp), parameter :: y(3) = [0.006_rp, -0.003_rp, 0.002_rp], small = 1.0e-6_rp
    real(rp) :: before(3), after(3), v(3), d, n(3), d2, unused(3), room
    type(rigid_t) :: rigid

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
    call tool%distance(tool%position + matmul(tool%axes, y), d, n, room)
    call tool%distance(tool%position + matmul(tool%axes, y) + small*n, d2, unused, room)
    call expect_close('distance grows along its gradient', (d2 - d)/small, 1.0_rp, rtol=1.0e-6_rp)
    rigid = tool%mean_motion(0.03_rp - small, 2.0_rp*small)
    v = rigid%velocity_at(0.5_rp*(before + after))
    call expect_close('mean motion', norm2(v - (after - before)/(2.0_rp*small)), 0.0_rp, &
                      atol=1.0e-7_rp)
  end subroutine test_pose

  !> Random points above z = 0, at rest or moving.
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
    call random_number(u)
    points%mass = 1.0e-4_rp*(1.0_rp + u)
    points%flow = 0.0_rp
  end subroutine random_points

  !> A step of free points from time `t`: each loses what contact takes.
  subroutine step(tool, t, points)
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: t
    type(points_t), intent(inout) :: points
    type(rigid_t) :: rigid
    type(friction_law_t) :: law
    real(rp) :: closing, gap, m, normal(3), room, shear, slip(3), v(3), x(3)
    integer :: p

    rigid = tool%mean_motion(t, dt)
    call tool%move_to(t + dt)
    points%push = 0.0_rp
    points%hold = 0.0_rp
    do p = 1, nlane
      x = points%x(p, :)
      v = points%v(p, :)
      m = points%mass(p)
      call tool%distance(x + dt*v, gap, normal, room)
      call find_closing_velocity(dt, dt, 0.0_rp, 100.0_rp*dt, 0.0_rp, gap - reach, normal, &
                                 v - rigid%velocity_at(x), closing, slip)
      if (gap < reach .and. closing > 0.0_rp) then
        shear = huge(1.0_rp)
        if (points%flow(p) > 0.0_rp) shear = dt*points%flow(p)*area/sqrt(3.0_rp)
        points%push(p, :) = m*closing*normal
        points%hold(p, :) = -law%friction(m*slip, tool%friction_coefficient*m*closing, shear, &
                                          shear)*m*slip
        points%v(p, :) = v + (points%push(p, :) + points%hold(p, :))/m
        call tool%record_impulse(rigid, x, normal, points%push(p, :), points%hold(p, :), &
                               0.5_rp*(v + points%v(p, :)))
      end if
      points%x(p, :) = x + dt*points%v(p, :)
    end do
  end subroutine step

  !> Points that would pass the surface stop on it, even if it moves; the others feel nothing.
  subroutine test_stop_at_gap_zero()
    type(points_t) :: points, start
    type(tool_t) :: tool
    real(rp) :: next(nlane)
    logical :: stops(nlane)

    tool = plane_tool([0.3_rp, 0.0_rp, 0.5_rp], 0.0_rp)
    call random_points(points, 1.5e-6_rp, 1.0_rp)
    points%x(:, 3) = reach + abs(points%x(:, 3) - reach)
    start = points
    stops = points%x(:, 3) - reach + dt*(points%v(:, 3) - 0.5_rp) < 0.0_rp
    call step(tool, 0.0_rp, points)
    call expect('points stop and pass', count(stops) > 5 .and. count(stops) < nlane - 5)
    next = points%x(:, 3) - reach - tool%position(3)
    call expect_close('points stop at gap zero', maxval(abs(pack(next, stops)))/1.0e-6_rp, 0.0_rp, &
                      atol=1.0e-9_rp)
    call expect('a point that does not arrive feels nothing', &
                all(pack(norm2(points%v - start%v, 2), .not. stops) == 0.0_rp))
    call expect('no point inside', all(next > -1.0e-14_rp))
  end subroutine test_stop_at_gap_zero

  !> A penetration is taken back within a step, but within a regular one if this is short, and never
  !> pulled deeper.
  subroutine test_penetration()
    real(rp), parameter :: up(3) = [0.0_rp, 0.0_rp, 1.0_rp], rest(3) = 0.0_rp
    real(rp) :: closing, slip(3)

    call find_closing_velocity(dt, dt, 0.0_rp, 100.0_rp*dt, 0.0_rp, -3.0e-6_rp, up, &
                               -2.0e-6_rp/dt*up, &
                               closing, slip)
    call expect_close('taken back in a step', closing*dt, 3.0e-6_rp)
    call find_closing_velocity(0.01_rp*dt, dt, 0.0_rp, dt, 0.0_rp, -1.02e-6_rp, up, &
                               -2.0e-6_rp/dt*up, &
                               closing, slip)
    call expect_close('no kick in a short step', (closing - 2.0e-6_rp/dt)*dt, &
                      1.0e-6_rp + 0.99e-6_rp)
    call find_closing_velocity(dt, dt, 0.0_rp, 100.0_rp*dt, 0.0_rp, -1.0e-6_rp, up, rest, closing, &
                               slip)
    call expect_close('no kick at rest', closing*100.0_rp*dt, 1.0e-6_rp)
    call find_closing_velocity(dt, dt, 0.0_rp, 100.0_rp*dt, 0.5e-6_rp/dt, -1.0e-6_rp, up, rest, &
                               closing, slip)
    call expect_close('its pace at rest', closing*dt, 0.505e-6_rp)
    call find_closing_velocity(dt, dt, 0.0_rp, 100.0_rp*dt, 0.0_rp, -12.0e-6_rp, up, &
                               -2.0e-6_rp/dt*up, &
                               closing, slip)
    call expect_close('as fast as it comes', closing*dt, 4.08e-6_rp)
    call find_closing_velocity(0.01_rp*dt, dt, 0.0_rp, 100.0_rp*dt, 0.0_rp, &
                               0.5e-6_rp - 0.01e-6_rp*100.0_rp, up, -100.0_rp*up, closing, slip)
    call expect_close('a gap is closed in a short step', (100.0_rp - closing)*0.01_rp*dt, 0.5e-6_rp)
    call find_closing_velocity(dt, 100.0_rp*dt, 0.0_rp, 100.0_rp*dt, 0.0_rp, -0.5e-6_rp, up, &
                               2.0_rp*up, &
                               closing, slip)
    call expect('no pull on a point that comes out', closing < 0.0_rp)
    call expect_close('slip along the surface', norm2(slip), 0.0_rp)
    call find_closing_velocity(dt, dt, 2.0e-6_rp, 100.0_rp*dt, 0.0_rp, 3.0e-6_rp - 10.0_rp*dt, up, &
                               -10.0_rp*up, closing, slip)
    call expect_close('slow through the soft zone', (10.0_rp - closing)*dt, 1.02e-6_rp)
    call find_closing_velocity(dt, dt, 2.0e-6_rp, 100.0_rp*dt, 0.0_rp, 1.0e-6_rp - 0.005e-6_rp, &
                               up, &
                               -0.005e-6_rp/dt*up, closing, slip)
    call expect('slower than that is free', closing < 0.0_rp)
  end subroutine test_penetration

  !> Coulomb's cone, the shear limit, no tension, and friction against the slip that never turns it.
  subroutine test_friction_cone()
    type(points_t) :: points, start
    type(tool_t) :: tool
    real(rp) :: d, fn, n(3), room, slip(3), u(nlane)
    integer :: batch, p, n_limited, n_stuck, n_touched
    logical :: no_tension, in_cone, in_limit, against, not_turned
    type(rigid_t) :: rigid

    tool = stirring_tool()
    rigid = tool%mean_motion(0.05_rp, dt)
    no_tension = .true.
    in_cone = .true.
    in_limit = .true.
    against = .true.
    not_turned = .true.
    n_touched = 0
    n_limited = 0
    n_stuck = 0
    do batch = 1, 100
      call tool%move_to(0.05_rp + dt)
      call random_points(points, 1.0e-6_rp, 0.2_rp)
      do p = 1, nlane                      ! near the tool's face, some of them moving with it
        points%x(p, 3) = -2.0_rp*reach
        points%x(p, :) = tool%position + matmul(tool%axes, points%x(p, :))
        call tool%distance(points%x(p, :), d, n, room)
        points%x(p, :) = points%x(p, :) + (reach - d)*n
        if (mod(p, 2) == 0) points%v(p, :) = [1.0e-2_rp, 1.0e-2_rp, 1.0_rp]*points%v(p, :) &
                                             + tool%surface_velocity(points%x(p, :))
      end do
      call random_number(u)
      points%flow = merge(1.0e8_rp*u, 0.0_rp, u > 0.2_rp)
      start = points
      call step(tool, 0.05_rp, points)
      do p = 1, nlane
        fn = norm2(points%push(p, :))
        if (fn <= 0.0_rp) cycle
        n_touched = n_touched + 1
        call tool%distance(start%x(p, :) + dt*start%v(p, :), d, n, room)
        slip = start%v(p, :) - rigid%velocity_at(start%x(p, :))
        slip = slip - dot_product(slip, n)*n
        associate (ft => points%hold(p, :))
          no_tension = no_tension .and. dot_product(points%push(p, :), n) > 0.0_rp
          in_cone = in_cone .and. norm2(ft) <= 0.4_rp*fn*(1.0_rp + 1.0e-10_rp)
          if (points%flow(p) > 0.0_rp) then
            u(p) = dt*points%flow(p)*area/sqrt(3.0_rp)
            in_limit = in_limit .and. norm2(ft) <= u(p)*(1.0_rp + 1.0e-10_rp)
            if (u(p) < 0.4_rp*fn) n_limited = n_limited + 1
          end if
          against = against .and. norm2(ft/norm2(ft) + slip/norm2(slip)) < 1.0e-6_rp
          not_turned = not_turned .and. norm2(ft) <= points%mass(p)*norm2(slip)*(1.0_rp &
            + 1.0e-10_rp)
          if (norm2(ft) > points%mass(p)*norm2(slip)*(1.0_rp - 1.0e-10_rp)) n_stuck = n_stuck + 1
        end associate
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
  subroutine test_budget()
    type(points_t) :: points, before
    type(tool_t) :: tool
    real(rp) :: gained, impulse(3), lost, mean(3), moment, rigid(3), scale
    integer :: p

    tool = plane_tool([0.3_rp, -0.2_rp, 0.4_rp], 50.0_rp)
    tool%fixed_heat_share = 0.8_rp
    call random_points(points, 1.0e-6_rp, 1.0_rp)
    before = points
    call step(tool, 0.0_rp, points)
    lost = 0.0_rp
    gained = 0.0_rp
    impulse = 0.0_rp
    moment = 0.0_rp
    do p = 1, nlane
      associate (j => points%push(p, :) + points%hold(p, :), x => before%x(p, :))
        mean = 0.5_rp*(before%v(p, :) + points%v(p, :))
        rigid = [0.3_rp, -0.2_rp, 0.4_rp] &
                + 50.0_rp*[x(2) + 0.1_rp*dt, -x(1) + 0.15_rp*dt, 0.0_rp]
        lost = lost - dot_product(j, mean - rigid)
        gained = gained + 0.5_rp*points%mass(p)*(sum(points%v(p, :)**2) - sum(before%v(p, :)**2))
        impulse = impulse - j
        moment = moment - ((x(1) - 0.15_rp*dt)*j(2) - (x(2) + 0.1_rp*dt)*j(1))
      end associate
    end do
    associate (s => tool%sums)
      scale = abs(s(s_work)) + abs(gained)
      call expect_close('friction heat and normal loss', s(s_friction) + s(s_normal_loss), lost, &
                        rtol=1.0e-12_rp)
      call expect_close('work = gain + losses', s(s_work), gained + lost, atol=1.0e-12_rp*scale)
      call expect_close('impulse', norm2(s(s_force:s_force + 2) - impulse)/norm2(impulse), 0.0_rp, &
                        atol=1.0e-13_rp)
      call expect_close('torque', s(s_torque), moment, rtol=1.0e-12_rp)
      call expect_close('work = force, way, torque, angle', s(s_work), &
                        50.0_rp*s(s_torque) - dot_product(impulse, [0.3_rp, -0.2_rp, 0.4_rp]), &
                        atol=1.0e-12_rp*scale)
      call expect_close('normal impulse', s(s_normal_impulse), sum(norm2(points%push, 2)), &
                        rtol=1.0e-12_rp)
      call expect('friction makes heat', s(s_friction) > 0.0_rp)
      call expect('creep and slide are positive', s(s_metal_slip) > 0.0_rp &
                  .and. s(s_tool_slip) > 0.0_rp)
    end associate
  end subroutine test_budget

  !> A tool that spins clockwise over resting material feels a positive torque.
  subroutine test_torque_sign()
    type(points_t) :: points
    type(tool_t) :: tool

    tool = stirring_tool()
    call tool%move_to(0.05_rp)
    call random_points(points, 0.0_rp, 0.0_rp)
    points%x(:, 3) = 0.5e-3_rp
    points%x = spread(tool%position, 1, nlane) + matmul(points%x, transpose(tool%axes))
    call step(tool, 0.05_rp, points)
    call expect('points in the face are pushed', count(norm2(points%push, 2) > 0.0_rp) > 20)
    call expect('torque against a clockwise spin', tool%sums(s_torque) > 0.0_rp)
    call expect('the spin works', tool%sums(s_work) > 0.0_rp)
    call expect('the material pushes the tool up', tool%sums(s_force + 2) > 0.0_rp)
  end subroutine test_torque_sign

  !> No distance shrinks by more than the way of the tool's surface; spin alone brings only a box
  !> nearer.
  subroutine test_way()
    type(tool_t) :: tool
    type(points_t) :: points
    real(rp) :: before(nlane), after(nlane), way

    tool = stirring_tool()
    call tool%move_to(0.05_rp)
    call tool%store_reference_pose()
    call expect_close('no way at first', tool%displacement(), 0.0_rp, atol=0.0_rp)
    call random_points(points, 0.02_rp, 0.0_rp)
    call tool%clearances(nlane, points%x, huge(1.0_rp), before)
    call tool%move_to(0.06_rp)
    call tool%clearances(nlane, points%x, huge(1.0_rp), after)
    call expect_close('way of a plunge', tool%displacement(), 0.01_rp*norm2([1.8e-3_rp, 0.1_rp]), &
                      rtol=1.0e-9_rp)
    call expect('a plunge brings nothing nearer than by the way', &
                all(before - after <= tool%displacement()*(1.0_rp + 1.0e-9_rp)))

    deallocate (tool%shape)
    allocate (tool%shape, source=box_shape_t(half=[0.008_rp, 0.002_rp, 0.004_rp]))
    tool%motion%phase(1)%velocity = 0.0_rp
    call tool%move_to(0.05_rp)
    call tool%store_reference_pose()
    call tool%clearances(nlane, points%x, huge(1.0_rp), before)
    call tool%move_to(0.055_rp)
    call tool%clearances(nlane, points%x, huge(1.0_rp), after)
    way = tool%displacement()
    call expect('a box that spins comes nearer, by no more than its way', &
                any(after < before - 1.0e-6_rp) .and. all(before - after &
                <= way*(1.0_rp + 1.0e-9_rp)))
  end subroutine test_way

  !> Room along the surface to the edges that stand out; none matters on the axis, between face and
  !> pin, or where the outline hardly turns.
  subroutine test_edges()
    type(tool_t) :: tool
    real(rp) :: d, n(3), room

    allocate (tool%shape, source=new_shoulder(0.010_rp, 0.020_rp, 0.0_rp, 0.003_rp, 0.003_rp, &
                                              0.004_rp))
    tool%frame = unit
    allocate (tool%motion%phase(0))
    call tool%move_to(0.0_rp)
    call tool%distance([0.008_rp, 0.0_rp, -0.0005_rp], d, n, room)
    call expect_close('room to the rim of the face', room, 0.002_rp, rtol=1.0e-12_rp)
    call tool%distance([0.0102_rp, 0.0_rp, -0.0005_rp], d, n, room)
    call expect_close('beyond the rim', room, -0.0002_rp, rtol=1.0e-9_rp)
    call tool%distance([0.0_rp, 0.0035_rp, -0.0005_rp], d, n, room)
    call expect_close('no edge at the root of the pin', room, 0.0065_rp, rtol=1.0e-12_rp)
    call tool%distance([0.0035_rp, 0.0_rp, -0.003_rp], d, n, room)
    call expect_close('room to the tip of the pin', room, 0.001_rp, rtol=1.0e-12_rp)
    call tool%distance([0.0002_rp, 0.0_rp, -0.0045_rp], d, n, room)
    call expect_close('the axis is no edge', room, 0.0028_rp, rtol=1.0e-12_rp)
    deallocate (tool%shape)
    allocate (tool%shape, source=box_shape_t(half=[0.01_rp, 0.02_rp, 0.03_rp]))
    call tool%distance([0.007_rp, -0.016_rp, 0.031_rp], d, n, room)
    call expect_close('room on the face of a box', room, 0.003_rp, rtol=1.0e-12_rp)
    call tool%distance([0.011_rp, 0.0_rp, 0.031_rp], d, n, room)
    call expect_close('so far beyond its edge', room, -0.001_rp, rtol=1.0e-12_rp)
    deallocate (tool%shape)
    allocate (plane_t :: tool%shape)
    call tool%distance([0.0_rp, 0.0_rp, 0.0_rp], d, n, room)
    call expect('a plane has no edge', room > 1.0e30_rp)
  end subroutine test_edges

  !> Bounds of a tilted tool go along with it; its surface lies in them and nearly touches them.
  subroutine test_bounds()
    type(tool_t) :: tool
    real(rp) :: lower(3), upper(3)
    real(rp), allocatable :: x(:, :)
    integer :: p

    tool = stirring_tool()
    call tool%move_to(0.05_rp)
    call tool%bounds(lower, upper)
    call tool%shape%outline(x)
    do p = 1, size(x, 2)
      x(:, p) = tool%position + matmul(tool%axes, x(:, p))
    end do
    call expect('inside the bounds', all(minval(x, 2) >= lower - 1.0e-12_rp) &
                                     .and. all(maxval(x, 2) <= upper + 1.0e-12_rp))
    call expect('close bounds', &
                all(minval(x, 2) - lower < 2.0e-3_rp) .and. all(upper - maxval(x, 2) < 2.0e-3_rp))
  end subroutine test_bounds

  !> A rigid body of particles has no shape: nothing is near it, and it has no ends.
  subroutine test_no_shape()
    type(tool_t) :: tool
    real(rp) :: d(nlane), lower(3), n(3), room, upper(3), x(nlane, 3)

    tool%frame = unit
    allocate (tool%motion%phase(0))
    call tool%move_to(0.0_rp)
    call tool%store_reference_pose()
    x = 0.0_rp
    call expect('no shape', .not. tool%has_shape())
    call tool%distance([0.0_rp, 0.0_rp, 0.0_rp], d(1), n, room)
    call expect('a tool without a shape is far', d(1) > 1.0e30_rp)
    call tool%clearances(nlane, x, huge(1.0_rp), d)
    call expect('from many places', all(d > 1.0e30_rp))
    call tool%bounds(lower, upper)
    call expect('and has no ends', all(lower < -1.0e30_rp) .and. all(upper > 1.0e30_rp))
    call expect_close('nor a radius', tool%stirring_radius(), 0.0_rp)
    call expect_close('nor a sweep', tool%displacement(), 0.0_rp)
  end subroutine test_no_shape

end program test_contact
