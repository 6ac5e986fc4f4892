! SPDX-License-Identifier: MIT
!> Tool shapes of revolution about the last axis, with a polygonal profile. An extension reads its
!> keys and sets the profile.
module tools_shape_revolved
  use base_kinds, only: pi, rp
  use tools_shape, only: no_edge, shape_t
  implicit none (type, external)
  private

  public :: profile_t, revolved_t

  integer, parameter, public :: max_corners = 8

  !> Profile of a body of revolution in the (r, z) half plane, from axis to axis with the body on
  !> the right-hand side; corners in m.
  type :: profile_t
    integer :: n = 0
    real(rp) :: r(max_corners) = 0.0_rp, z(max_corners) = 0.0_rp
  contains
    procedure :: corner
  end type profile_t

  type, abstract, extends(shape_t) :: revolved_t
    type(profile_t) :: profile
  contains
    procedure :: distance, distances, bounds, sweep, outline, surface
  end type revolved_t

  !> Sharpness of a corner that is no edge; lengths over it are finite.
  real(rp), parameter :: no_corner = 1.0e-200_rp

contains

  !> Append a corner to the profile [m].
  pure subroutine corner(self, r, z)
    class(profile_t), intent(inout) :: self
    real(rp), intent(in) :: r, z

    self%n = self%n + 1
    self%r(self%n) = r
    self%z(self%n) = z
  end subroutine corner

  !> Signed distance of `x`, its gradient, and the distance along the surface to the nearest convex
  !> edge, negative beyond it.
  pure subroutine distance(self, x, d, normal, edge_distance)
    class(revolved_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), edge_distance
    real(rp) :: r, z, ar, az, br, bz, er, ez, t, length, d2, best, nearest, nr, nz
    logical :: inside
    integer :: i, side

    r = sqrt(x(1)**2 + x(2)**2)
    z = x(3)
    best = huge(best)
    side = 1
    nearest = 0.0_rp
    inside = .false.
    do i = 1, self%profile%n - 1
      ar = self%profile%r(i); az = self%profile%z(i)
      br = self%profile%r(i + 1) - ar; bz = self%profile%z(i + 1) - az
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
    ar = self%profile%r(side); az = self%profile%z(side)
    br = self%profile%r(side + 1) - ar; bz = self%profile%z(side + 1) - az
    length = sqrt(br*br + bz*bz)
    edge_distance = min(no_edge, nearest*length/sharpness(self%profile, side), &
                        (1.0_rp - nearest)*length/sharpness(self%profile, side + 1))
    d = merge(-sqrt(best), sqrt(best), inside)
    if (nearest > 0.0_rp .and. nearest < 1.0_rp .or. best <= 0.0_rp) then
      nr = -bz/length                     ! outward normal of the side
      nz = br/length
    else                                  ! normal from the corner to the point
      er = r - ar - nearest*br
      ez = z - az - nearest*bz
      nr = er/d
      nz = ez/d
      edge_distance = -overhang(self%profile, side + nint(nearest), er, ez)
    end if
    if (r > 0.0_rp) then
      normal = [nr*x(1)/r, nr*x(2)/r, nz]
    else
      normal = [nr, 0.0_rp, nz]
    end if
  end subroutine distance

  !> Signed distances of `n` points.
  pure subroutine distances(self, n, x, cutoff, d)
    class(revolved_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff
    real(rp), intent(out) :: d(n)
    real(rp) :: r(n)

    r = sqrt(x(:, 1)**2 + x(:, 2)**2)
    call distances_at(self%profile, n, r, x(:, 3), d)
  end subroutine distances

  !> Signed distances of `n` points (r, z) from a profile.
  pure subroutine distances_at(profile, n, r, z, distance)
    type(profile_t), intent(in) :: profile
    integer, intent(in) :: n
    real(rp), intent(in) :: r(n), z(n)
    real(rp), intent(out) :: distance(n)
    real(rp) :: ar, az, br, bz, slope, t, side(n)
    integer :: i, p

    distance = huge(1.0_rp)                     ! squared distance, until the end
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
  end subroutine distances_at

  !> Distance by which a point at (er, ez) from corner `i` lies beyond the ends of both adjacent
  !> sides; -no_edge at a corner that is not convex [m].
  pure real(rp) function overhang(profile, i, er, ez)
    type(profile_t), intent(in) :: profile
    integer, intent(in) :: i
    real(rp), intent(in) :: er, ez
    real(rp) :: a(2), b(2)

    overhang = -no_edge
    if (.not. sharpness(profile, i) > no_corner) return
    a = [profile%r(i) - profile%r(i - 1), profile%z(i) - profile%z(i - 1)]
    b = [profile%r(i) - profile%r(i + 1), profile%z(i) - profile%z(i + 1)]
    overhang = max(0.0_rp, min(dot_product(a, [er, ez])/norm2(a), &
                               dot_product(b, [er, ez])/norm2(b)))
  end function overhang

  !> Sharpness of a corner: 1 - cos of the turning angle of the profile, at most 1; `no_corner` on
  !> the axis and at concave corners.
  pure real(rp) function sharpness(profile, i)
    type(profile_t), intent(in) :: profile
    integer, intent(in) :: i
    real(rp) :: ar, az, br, bz

    sharpness = no_corner
    if (i == 1 .or. i == profile%n) return
    ar = profile%r(i) - profile%r(i - 1)
    az = profile%z(i) - profile%z(i - 1)
    br = profile%r(i + 1) - profile%r(i)
    bz = profile%z(i + 1) - profile%z(i)
    if (ar*bz - az*br >= 0.0_rp) return         ! concave: the body is on the right
    sharpness = max(no_corner, min(1.0_rp, &
      1.0_rp - (ar*br + az*bz)/sqrt((ar*ar + az*az)*(br*br + bz*bz))))
  end function sharpness

  !> Box around the two ends and the widest corner.
  pure subroutine bounds(self, axes, middle, half)
    class(revolved_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)

    associate (r => self%profile%r(1:self%profile%n), z => self%profile%z(1:self%profile%n), &
               axis => axes(:, 3))
      middle = 0.5_rp*(maxval(z) + minval(z))*axis
      half = 0.5_rp*(maxval(z) - minval(z))*abs(axis) &
             + maxval(r)*sqrt(max(0.0_rp, 1.0_rp - axis**2))
    end associate
  end subroutine bounds

  !> Zero, as rotation about the axis does not move the surface.
  pure real(rp) function sweep(self, before, after)
    class(revolved_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)

    sweep = 0.0_rp
  end function sweep

  !> Rings of points on each side of the profile.
  subroutine outline(self, x)
    class(revolved_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, parameter :: turns = 24, parts = 6
    real(rp) :: a, s
    integer :: c, i, j, p

    allocate (x(3, turns*parts*(self%profile%n - 1)))
    p = 0
    do i = 1, self%profile%n - 1
      do j = 1, parts
        s = real(j, rp)/parts
        do c = 1, turns
          p = p + 1
          a = 2.0_rp*pi*c/turns
          associate (r => (1.0_rp - s)*self%profile%r(i) + s*self%profile%r(i + 1), &
                     z => (1.0_rp - s)*self%profile%z(i) + s*self%profile%z(i + 1))
            x(:, p) = [r*cos(a), r*sin(a), z]
          end associate
        end do
      end do
    end do
  end subroutine outline

  !> Two rings of points on each side of the profile, with triangles between them.
  subroutine surface(self, x, corner)
    class(revolved_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, allocatable, intent(out) :: corner(:, :)
    integer, parameter :: turns = 72
    real(rp) :: a
    integer :: c, i, m, p

    allocate (x(3, 2*turns*(self%profile%n - 1)), corner(3, 2*turns*(self%profile%n - 1)))
    m = 0
    do i = 1, self%profile%n - 1
      do c = 1, turns
        a = 2.0_rp*pi*c/turns
        p = 2*turns*(i - 1) + c
        associate (r => self%profile%r(i:i + 1), z => self%profile%z(i:i + 1))
          x(:, p) = [r(1)*cos(a), r(1)*sin(a), z(1)]
          x(:, p + turns) = [r(2)*cos(a), r(2)*sin(a), z(2)]
          associate (next => p - c + modulo(c, turns) + 1)
            if (r(1) > 0.0_rp) call add([p, p + turns, next])
            if (r(2) > 0.0_rp) call add([next, p + turns, next + turns])
          end associate
        end associate
      end do
    end do
    corner = corner(:, :m)
  contains
    subroutine add(three)
      integer, intent(in) :: three(3)

      m = m + 1
      corner(:, m) = three
    end subroutine add
  end subroutine surface

end module tools_shape_revolved
