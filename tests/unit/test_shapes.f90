! SPDX-License-Identifier: MIT
!> Signed distances of the tool's shapes against dense sampling of their outlines.
program test_shapes
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_shapes, only: box_distance, profile_t, revolved_distance, revolved_distances, &
                            shoulder_profile
  implicit none (type, external)

  !> What a revolved tool is made of [m]; see `shoulder_profile`.
  type :: made_t
    real(rp) :: radius = 0.0_rp, height = 0.0_rp, concavity = 0.0_rp
    real(rp) :: pin_radius = 0.0_rp, tip_radius = 0.0_rp, pin_length = 0.0_rp
  end type made_t

  real(rp), parameter :: deg = 0.017453292519943295_rp
  integer, parameter :: samples = 20000   !! on each side of an outline

  call begin_tests()
  call random_init(.true., .false.)
  call test_revolved('flat', made_t(0.010_rp, 0.020_rp))
  call test_revolved('concave', made_t(0.010_rp, 0.020_rp, concavity=7.0_rp*deg))
  call test_revolved('flat with pin', made_t(0.010_rp, 0.020_rp, pin_radius=0.003_rp, &
                                             tip_radius=0.003_rp, pin_length=0.005_rp))
  call test_revolved('concave with tapered pin', &
                     made_t(0.010_rp, 0.015_rp, concavity=10.0_rp*deg, pin_radius=0.004_rp, &
                            tip_radius=0.002_rp, pin_length=0.006_rp))
  call test_revolved('flat with cone', made_t(0.010_rp, 0.020_rp, pin_radius=0.004_rp, &
                                              pin_length=0.005_rp))
  call test_many_at_once()
  call test_known_points()
  call test_box()
  call end_tests()

contains

  !> Exact: distances of many places are those of each, to rounding.
  subroutine test_many_at_once()
    integer, parameter :: n = 1000
    type(profile_t) :: profile
    real(rp) :: r(n), z(n), many(n), one(n), normal(3), room
    integer :: p

    profile = shoulder_profile(0.010_rp, 0.015_rp, 10.0_rp*deg, 0.004_rp, 0.002_rp, 0.006_rp)
    call random_number(r)
    call random_number(z)
    r = 0.015_rp*r
    z = 0.03_rp*z - 0.01_rp
    call revolved_distances(profile, n, r, z, many)
    do p = 1, n
      call revolved_distance(profile, [r(p), 0.0_rp, z(p)], one(p), normal, room)
    end do
    call expect('some inside, some outside', any(one < 0.0_rp) .and. any(one > 0.0_rp))
    call expect('many distances at once', all(abs(many - one) < 1.0e-15_rp))
  end subroutine test_many_at_once

  pure type(profile_t) function outline_of(made)
    type(made_t), intent(in) :: made

    outline_of = shoulder_profile(made%radius, made%height, made%concavity, made%pin_radius, &
                                  made%tip_radius, made%pin_length)
  end function outline_of

  !> Corners (r, z) from the axis round to the axis, written down independently of the profile.
  subroutine corners_of(made, corner, n)
    type(made_t), intent(in) :: made
    real(rp), intent(out) :: corner(2, 6)
    integer, intent(out) :: n

    corner = 0.0_rp
    corner(:, 1) = [0.0_rp, made%height]
    corner(:, 2) = [made%radius, made%height]
    corner(:, 3) = [made%radius, 0.0_rp]
    n = 4
    corner(:, 4) = [0.0_rp, face_of(made, 0.0_rp)]
    if (made%pin_radius > 0.0_rp) then
      corner(:, 4) = [made%pin_radius, face_of(made, made%pin_radius)]
      corner(:, 5) = [made%tip_radius, -made%pin_length]
      corner(:, 6) = [0.0_rp, -made%pin_length]
      n = 6
    end if
  end subroutine corners_of

  !> Height of the shoulder's face at radius r.
  pure real(rp) function face_of(made, r)
    type(made_t), intent(in) :: made
    real(rp), intent(in) :: r

    face_of = (made%radius - r)*tan(made%concavity)
  end function face_of

  !> Is (r, z) in the shoulder or in the pin?
  pure logical function is_in_tool(made, r, z)
    type(made_t), intent(in) :: made
    real(rp), intent(in) :: r, z
    real(rp) :: top, part

    is_in_tool = r <= made%radius .and. z <= made%height .and. z >= face_of(made, r)
    if (made%pin_radius <= 0.0_rp) return
    top = face_of(made, made%pin_radius)
    if (z >= -made%pin_length .and. z <= top) then
      part = (z + made%pin_length)/(top + made%pin_length)
      is_in_tool = is_in_tool .or. r <= made%tip_radius + part*(made%pin_radius - made%tip_radius)
    end if
  end function is_in_tool

  !> Distance of (r, z) from sampled points of the outline.
  real(rp) function sampled_distance(made, r, z)
    type(made_t), intent(in) :: made
    real(rp), intent(in) :: r, z
    real(rp) :: corner(2, 6), side(2), best, part
    integer :: i, n, s

    call corners_of(made, corner, n)
    best = huge(best)
    do i = 1, n - 1
      side = corner(:, i + 1) - corner(:, i)
      do s = 0, samples
        part = real(s, rp)/samples
        best = min(best, (r - corner(1, i) - part*side(1))**2 &
                   + (z - corner(2, i) - part*side(2))**2)
      end do
    end do
    sampled_distance = sqrt(best)
  end function sampled_distance

  !> Distance, sign, gradient and its length at random points around the tool.
  subroutine test_revolved(name, made)
    character(*), intent(in) :: name
    type(made_t), intent(in) :: made
    type(profile_t) :: outline
    real(rp), parameter :: step = 1.0e-8_rp
    real(rp) :: x(3), y(3), normal(3), far(3), d, d1, d2, gradient(3), r, room, want
    real(rp) :: off, off_length, off_gradient, jump
    integer :: a, i, n_inside, n_kinks
    logical :: signs_agree

    outline = outline_of(made)
    off = 0.0_rp
    off_length = 0.0_rp
    off_gradient = 0.0_rp
    n_inside = 0
    n_kinks = 0
    signs_agree = .true.
    do i = 1, 400
      call random_number(x)
      x = [-0.012_rp, -0.012_rp, -0.010_rp] + x*[0.024_rp, 0.024_rp, 0.030_rp]
      r = norm2(x(1:2))
      call revolved_distance(outline, x, d, normal, room)
      want = sampled_distance(made, r, x(3))
      off = max(off, abs(abs(d) - want))
      if (is_in_tool(made, r, x(3))) n_inside = n_inside + 1
      signs_agree = signs_agree .and. (is_in_tool(made, r, x(3)) .eqv. d < 0.0_rp)
      off_length = max(off_length, abs(norm2(normal) - 1.0_rp))
      jump = 0.0_rp
      do a = 1, 3
        y = x
        y(a) = x(a) + step
        call revolved_distance(outline, y, d1, far, room)
        jump = max(jump, norm2(far - normal))
        y(a) = x(a) - step
        call revolved_distance(outline, y, d2, far, room)
        jump = max(jump, norm2(far - normal))
        gradient(a) = (d1 - d2)/(2.0_rp*step)
      end do
      if (jump > 1.0e-3_rp) then         ! two sides are equally near: no gradient there
        n_kinks = n_kinks + 1
      else
        off_gradient = max(off_gradient, norm2(gradient - normal))
      end if
    end do
    call expect(name//': points inside', n_inside > 60)
    call expect_close(name//': distance', off, 0.0_rp, atol=2.0e-8_rp)
    call expect(name//': sign', signs_agree)
    call expect_close(name//': length of the gradient', off_length, 0.0_rp, atol=1.0e-12_rp)
    call expect_close(name//': gradient', off_gradient, 0.0_rp, atol=1.0e-6_rp)
    call expect(name//': few kinks', n_kinks < 3)
  end subroutine test_revolved

  !> Places that random points miss: on the axis, on the faces, below the rim.
  subroutine test_known_points()
    type(profile_t) :: flat, pin
    real(rp) :: d, normal(3), room

    flat = outline_of(made_t(0.010_rp, 0.020_rp))
    pin = outline_of(made_t(0.010_rp, 0.020_rp, pin_radius=0.003_rp, tip_radius=0.003_rp, &
                            pin_length=0.005_rp))
    call revolved_distance(flat, [0.0_rp, 0.0_rp, -1.0e-3_rp], d, normal, room)
    call expect_close('below the axis', d, 1.0e-3_rp)
    call expect('below the axis, gradient', all(normal == [0.0_rp, 0.0_rp, -1.0_rp]))
    call revolved_distance(flat, [0.0_rp, 0.0_rp, 2.0e-3_rp], d, normal, room)
    call expect_close('on the axis inside', d, -2.0e-3_rp)
    call revolved_distance(flat, [5.0e-3_rp, 0.0_rp, 0.0_rp], d, normal, room)
    call expect_close('on the face', d, 0.0_rp, atol=1.0e-18_rp)
    call expect_close('on the face, gradient', normal(3), -1.0_rp)
    call revolved_distance(flat, [0.013_rp, 0.0_rp, -0.004_rp], d, normal, room)
    call expect_close('off the rim', d, 0.005_rp)
    call expect_close('off the rim, gradient', norm2(normal - [0.6_rp, 0.0_rp, -0.8_rp]), 0.0_rp, &
                      atol=1.0e-12_rp)
    call revolved_distance(pin, [0.0_rp, 3.5e-3_rp, -2.0e-3_rp], d, normal, room)
    call expect_close('beside the pin', d, 0.5e-3_rp)
    call expect_close('beside the pin, gradient', normal(2), 1.0_rp)
    call revolved_distance(pin, [0.0_rp, 0.0_rp, -4.0e-3_rp], d, normal, room)
    call expect_close('in the pin, near its tip', d, -1.0e-3_rp)
    call expect_close('in the pin, gradient', normal(3), -1.0_rp)
  end subroutine test_known_points

  !> Box: distance to the sampled closest point, sign and gradient.
  subroutine test_box()
    real(rp), parameter :: half(3) = [0.3_rp, 0.5_rp, 0.2_rp], step = 1.0e-7_rp
    real(rp) :: x(3), y(3), d, d1, d2, want, normal(3), unused(3), gradient(3), room
    real(rp) :: off, off_gradient
    integer :: a, i, n_inside

    off = 0.0_rp
    off_gradient = 0.0_rp
    n_inside = 0
    do i = 1, 2000
      call random_number(x)
      x = 1.6_rp*(x - 0.5_rp)
      call box_distance(half, x, d, normal, room)
      want = norm2(x - max(-half, min(half, x)))
      if (all(abs(x) < half)) then
        n_inside = n_inside + 1
        want = -min(half(1) - abs(x(1)), half(2) - abs(x(2)), half(3) - abs(x(3)))
      end if
      off = max(off, abs(d - want))
      do a = 1, 3
        y = x
        y(a) = x(a) + step
        call box_distance(half, y, d1, unused, room)
        y(a) = x(a) - step
        call box_distance(half, y, d2, unused, room)
        gradient(a) = (d1 - d2)/(2.0_rp*step)
      end do
      if (d < 0.0_rp .and. maxval(abs(gradient)) < 1.0_rp - 1.0e-6_rp) cycle   ! two faces are near
      off_gradient = max(off_gradient, norm2(gradient - normal))
    end do
    call expect('box: points inside', n_inside > 50)
    call expect_close('box: distance', off, 0.0_rp, atol=1.0e-14_rp)
    call expect_close('box: gradient', off_gradient, 0.0_rp, atol=1.0e-5_rp)
  end subroutine test_box

end program test_shapes
