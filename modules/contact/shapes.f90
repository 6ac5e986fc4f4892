! SPDX-License-Identifier: MIT
!> Signed distances of the rigid shapes in their own frame: negative inside, gradient of length 1.
module contact_shapes
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: profile_t, shoulder_profile, revolved_distance, revolved_distances, box_distance

  integer, parameter, public :: most_corners = 8

  !> Outline of a body of revolution in the (r, z) half plane, from the axis round to the axis
  !> again, with the body on the right-hand side.
  type :: profile_t
    integer :: n = 0
    real(rp) :: r(most_corners) = 0.0_rp
    real(rp) :: z(most_corners) = 0.0_rp
  end type profile_t

contains

  !> Shoulder disc of `radius` whose face is flat or a cone rising to the axis by `concavity`
  !> [rad], with an optional pin: radius at the face, radius at the tip, length. The face's rim is
  !> at z = 0, the tool's body goes up to `height`. All lengths in m.
  pure type(profile_t) function shoulder_profile(radius, height, concavity, pin_radius, &
                                                 tip_radius, pin_length)
    real(rp), intent(in) :: radius, height, concavity, pin_radius, tip_radius, pin_length
    type(profile_t) :: outline

    call corner(outline, 0.0_rp, height)
    call corner(outline, radius, height)
    call corner(outline, radius, 0.0_rp)
    if (pin_radius > 0.0_rp .and. pin_length > 0.0_rp) then
      call corner(outline, pin_radius, (radius - pin_radius)*tan(concavity))
      call corner(outline, tip_radius, -pin_length)
      call corner(outline, 0.0_rp, -pin_length)
    else
      call corner(outline, 0.0_rp, radius*tan(concavity))
    end if
    shoulder_profile = outline
  end function shoulder_profile

  pure subroutine corner(outline, r, z)
    type(profile_t), intent(inout) :: outline
    real(rp), intent(in) :: r, z

    outline%n = outline%n + 1
    outline%r(outline%n) = r
    outline%z(outline%n) = z
  end subroutine corner

  !> Distance of `x` from the body of revolution about the local z axis, its gradient, and the room
  !> along the surface to the nearest edge that stands out.
  pure subroutine revolved_distance(profile, x, distance, normal, room)
    type(profile_t), intent(in) :: profile
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: distance, normal(3), room
    real(rp) :: r, z, ar, az, br, bz, er, ez, t, length, d2, best, nearest, nr, nz
    logical :: inside
    integer :: i, side

    r = sqrt(x(1)**2 + x(2)**2)
    z = x(3)
    best = huge(best)
    side = 1
    nearest = 0.0_rp
    inside = .false.
    do i = 1, profile%n - 1
      ar = profile%r(i); az = profile%z(i)
      br = profile%r(i + 1) - ar; bz = profile%z(i + 1) - az
      if (br*br + bz*bz <= 0.0_rp) cycle
      ! a ray along +r crosses the outline an odd number of times from inside
      if ((az > z) .neqv. (az + bz > z)) then
        if (r < ar + (z - az)/bz*br) inside = .not. inside
      end if
      t = min(1.0_rp, max(0.0_rp, ((r - ar)*br + (z - az)*bz)/(br*br + bz*bz)))
      d2 = (r - ar - t*br)**2 + (z - az - t*bz)**2
      if (d2 >= best) cycle
      best = d2
      side = i
      nearest = t
    end do
    ar = profile%r(side); az = profile%z(side)
    br = profile%r(side + 1) - ar; bz = profile%z(side + 1) - az
    length = sqrt(br*br + bz*bz)
    room = min(nearest*length/sharpness(profile, side), &
               (1.0_rp - nearest)*length/sharpness(profile, side + 1))
    distance = merge(-sqrt(best), sqrt(best), inside)
    if (nearest > 0.0_rp .and. nearest < 1.0_rp .or. best <= 0.0_rp) then
      nr = -bz/length                     ! outward normal of the side: the body is on its right
      nz = br/length
    else                                  ! from the corner to the point
      er = r - ar - nearest*br
      ez = z - az - nearest*bz
      nr = er/distance
      nz = ez/distance
    end if
    if (r > 0.0_rp) then
      normal = [nr*x(1)/r, nr*x(2)/r, nz]
    else
      normal = [nr, 0.0_rp, nz]
    end if
  end subroutine revolved_distance

  !> Distances of `n` places at (r, z) from the body of revolution.
  pure subroutine revolved_distances(profile, n, r, z, distance)
    type(profile_t), intent(in) :: profile
    integer, intent(in) :: n
    real(rp), intent(in) :: r(n), z(n)
    real(rp), intent(out) :: distance(n)
    real(rp) :: ar, az, br, bz, slope, t, side(n)
    integer :: i, p

    distance = huge(1.0_rp)                     ! squared, until the end
    side = 1.0_rp
    do i = 1, profile%n - 1
      ar = profile%r(i); az = profile%z(i)
      br = profile%r(i + 1) - ar; bz = profile%z(i + 1) - az
      if (br*br + bz*bz <= 0.0_rp) cycle
      slope = 0.0_rp
      if (abs(bz) > 0.0_rp) slope = br/bz
      !$omp simd private(t)
      do p = 1, n
        t = min(1.0_rp, max(0.0_rp, ((r(p) - ar)*br + (z(p) - az)*bz)/(br*br + bz*bz)))
        distance(p) = min(distance(p), (r(p) - ar - t*br)**2 + (z(p) - az - t*bz)**2)
        side(p) = merge(-side(p), side(p), ((az > z(p)) .neqv. (az + bz > z(p))) &
                                           .and. r(p) < ar + (z(p) - az)*slope)
      end do
    end do
    distance = side*sqrt(distance)
  end subroutine revolved_distances

  !> How much a corner stands out: 1 - cos of the angle by which the outline turns, at most 1; tiny
  !> on the axis and where it turns inwards.
  pure real(rp) function sharpness(profile, i)
    type(profile_t), intent(in) :: profile
    integer, intent(in) :: i
    real(rp) :: ar, az, br, bz

    sharpness = tiny(1.0_rp)
    if (i == 1 .or. i == profile%n) return
    ar = profile%r(i) - profile%r(i - 1)
    az = profile%z(i) - profile%z(i - 1)
    br = profile%r(i + 1) - profile%r(i)
    bz = profile%z(i + 1) - profile%z(i)
    if (ar*bz - az*br >= 0.0_rp) return         ! the body is on the right
    sharpness = max(tiny(1.0_rp), min(1.0_rp, &
      1.0_rp - (ar*br + az*bz)/sqrt((ar*ar + az*az)*(br*br + bz*bz))))
  end function sharpness

  !> Distance of `x` from a box of half edges `half` centred at the origin, its gradient, and the
  !> room along the surface to the nearest edge.
  pure subroutine box_distance(half, x, distance, normal, room)
    real(rp), intent(in) :: half(3), x(3)
    real(rp), intent(out) :: distance, normal(3), room
    real(rp) :: q(3), outside(3)
    integer :: a

    q = abs(x) - half
    normal = 0.0_rp
    if (any(q > 0.0_rp)) then
      outside = max(q, 0.0_rp)
      distance = norm2(outside)
      normal = sign(outside/distance, x)
    else
      a = maxloc(q, 1)
      distance = q(a)
      normal(a) = sign(1.0_rp, x(a))
    end if
    a = maxloc(q, 1)
    q(a) = -huge(1.0_rp)
    room = max(0.0_rp, -maxval(q))
  end subroutine box_distance

end module contact_shapes
