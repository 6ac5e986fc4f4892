! SPDX-License-Identifier: MIT
!> Lattices of particles: straight rows, rings around the axis of a cylinder, or shells of rings
!> around the centre of a sphere, with the outermost points half a spacing below the surface.
module setup_lattice
  use base_kinds, only: rp
  use grid_grading, only: grading_t
  use setup_solids, only: extent_of, reference, solid_sphere, solid_t
  use state_scene, only: body_t, scene_t
  implicit none (type, external)
  private

  public :: lattice_t, lattice_of, lattice_corner

  integer, parameter :: straight = 0, rings = 1, shells = 2

  !> Lattice with spacing [m], first point [m] and numbers of points along the axes. For round
  !> lattices the numbers are those of rings or shells (from the outermost, inside `radius` [m]), of
  !> points on the largest one, and of points along the axis.
  type :: lattice_t
    integer :: kind = straight
    real(rp) :: spacing(3) = 0.0_rp, origin(3) = 0.0_rp
    integer :: n(3) = 0, axis = 3
    real(rp) :: centre(3) = 0.0_rp, radius = 0.0_rp
    !> Grading of the axes. Along a graded axis rows are `layer` apart, from `bottom` on, in grid
    !> coordinates [cells].
    type(grading_t) :: grading(3)
    real(rp) :: layer(3) = 0.0_rp, bottom(3) = 0.0_rp
  contains
    procedure :: edges, is_straight, on_ring, pitch, point, share
  end type lattice_t

  real(rp), parameter :: half_turn = acos(-1.0_rp), turn = 2.0_rp*half_turn

contains

  !> Lattice that covers all added solids of a body.
  pure type(lattice_t) function lattice_of(scene, body, solids) result(lattice)
    type(scene_t), intent(in) :: scene
    type(body_t), intent(in) :: body
    type(solid_t), intent(in) :: solids(:)
    real(rp) :: low(3), high(3), corner(3)
    integer :: a, first(3)

    call extent_of(solids, low, high)
    lattice%spacing = body%spacing
    if (any(high < low)) return
    corner = lattice_corner(scene, body, solids)
    first = floor((low - corner)/lattice%spacing + 1.0e-6_rp)
    lattice%origin = corner + lattice%spacing*(real(first, rp) + 0.5_rp)
    lattice%n = ceiling((high - lattice%origin)/lattice%spacing) + 1
    do a = 1, 3
      if (.not. scene%grid%grading(a)%is_graded) cycle
      call grade_rows(scene, body, a, corner(a), low(a), high(a), lattice)
    end do
    if (.not. body%is_round) return
    associate (solid => solids(findloc(solids%adds, .true., 1)))
      lattice%kind = merge(shells, rings, solid%kind == solid_sphere)
      if (lattice%kind == rings) lattice%axis = solid%axis
      lattice%centre = solid%centre
      lattice%radius = solid%radius
      lattice%n(1) = int(solid%radius/lattice%pitch() + 1.0e-6_rp)
      lattice%n(2) = lattice%on_ring(0)
      lattice%n(3) = merge(1, lattice%n(lattice%axis), lattice%kind == shells)
    end associate
  end function lattice_of

  !> Set the rows along the graded axis `a`. With a lattice of its own a body has the number
  !> of rows from its lower to its upper end that is nearest to PARTICLES_PER_CELL.
  pure subroutine grade_rows(scene, body, a, corner, low, high, lattice)
    type(scene_t), intent(in) :: scene
    type(body_t), intent(in) :: body
    integer, intent(in) :: a
    real(rp), intent(in) :: corner, low, high  !! corner of lattice, ends of the body [m]
    type(lattice_t), intent(inout) :: lattice
    real(rp) :: layers

    lattice%grading(a) = scene%grid%grading(a)
    associate (grading => lattice%grading(a), layer => lattice%layer(a), &
               bottom => lattice%bottom(a), rows => lattice%n(a))
      layer = body%spacing(a)/scene%grid%h(a)
      if (body%own_lattice) then
        layers = (grading%place(high) - grading%place(low))/layer
        rows = max(1, nint(layers))
        layer = layer*layers/rows
        bottom = grading%place(low) + 0.5_rp*layer
        return
      end if
      bottom = grading%place(corner)
      bottom = bottom + layer*(0.5_rp + floor((grading%place(low) - bottom)/layer + 1.0e-6_rp))
      rows = ceiling((grading%place(high) - bottom)/layer) + 1
    end associate
  end subroutine grade_rows

  !> Particle edges at point (i, j, k) of a straight lattice [m].
  pure function edges(self, i, j, k) result(h)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i, j, k
    real(rp) :: h(3), ends(2)
    integer :: a, ijk(3)

    h = self%spacing
    ijk = [i, j, k]
    do a = 1, 3
      if (.not. self%grading(a)%is_graded) cycle
      ends = self%bottom(a) + self%layer(a)*(ijk(a) + [-0.5_rp, 0.5_rp])
      h(a) = self%grading(a)%position(ends(2)) - self%grading(a)%position(ends(1))
    end do
  end function edges

  !> Anchor of a body's lattice: a corner between points [m].
  pure function lattice_corner(scene, body, solids) result(corner)
    type(scene_t), intent(in) :: scene
    type(body_t), intent(in) :: body
    type(solid_t), intent(in) :: solids(:)
    real(rp) :: corner(3)

    corner = scene%grid%lower
    if (body%own_lattice) corner = reference(solids(findloc(solids%adds, .true., 1)))
  end function lattice_corner

  !> True for straight rows.
  pure logical function is_straight(self)
    class(lattice_t), intent(in) :: self

    is_straight = self%kind == straight
  end function is_straight

  !> Number of points on ring or shell `i` (from 0), or in a row.
  pure integer function on_ring(self, i)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i
    integer :: k

    select case (self%kind)
    case (rings)
      on_ring = max(1, nint(turn*ring_radius(self, i)/self%pitch()))
    case (shells)
      on_ring = sum([(on_band(self, i, k), k=0, n_bands(self, i) - 1)])
    case default
      on_ring = self%n(2)
    end select
  end function on_ring

  !> Distance of rings or shells, and of points on them [m].
  pure real(rp) function pitch(self)
    class(lattice_t), intent(in) :: self

    pitch = minval(self%spacing)
    if (self%kind == rings) pitch = minval(self%spacing, [1, 2, 3] /= self%axis)
  end function pitch

  !> Radius of ring or shell `i` [m].
  pure real(rp) function ring_radius(self, i)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i

    ring_radius = self%radius - (i + 0.5_rp)*self%pitch()
  end function ring_radius

  !> Number of latitude bands of a shell.
  pure integer function n_bands(self, i)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i

    n_bands = max(1, nint(half_turn*ring_radius(self, i)/self%pitch()))
  end function n_bands

  !> Number of points on band `k` (from 0): a multiple of four, symmetric about planes through the
  !> axes.
  pure integer function on_band(self, i, k)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i, k

    on_band = 4*max(1, nint(0.25_rp*turn*ring_radius(self, i)*sin(polar(self, i, k + 0.5_rp)) &
                            /self%pitch()))
  end function on_band

  !> Polar angle of the middle (`k` + 1/2) or the edges of a band [rad].
  pure real(rp) function polar(self, i, k)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: k

    polar = half_turn*k/n_bands(self, i)
  end function polar

  !> Band of point `j` of a shell, and the index in the band.
  pure subroutine find_band(self, i, j, band, at)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i, j
    integer, intent(out) :: band, at

    band = 0
    at = j
    do while (at >= on_band(self, i, band))
      at = at - on_band(self, i, band)
      band = band + 1
    end do
  end subroutine find_band

  !> Position of a point with indices from 0 [m].
  pure function point(self, i, j, k) result(x)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i, j, k
    real(rp) :: x(3), phi, r, theta
    integer :: a, at, b, band, ijk(3)

    ijk = [i, j, k]
    x = self%origin + self%spacing*ijk
    do a = 1, 3
      if (self%grading(a)%is_graded) x(a) = self%grading(a)%position(self%bottom(a) &
                                                                     + self%layer(a)*ijk(a))
    end do
    if (self%kind == straight) return
    a = mod(self%axis, 3) + 1
    b = mod(a, 3) + 1
    r = ring_radius(self, i)
    if (self%kind == rings) then
      phi = turn*(j + 0.5_rp)/self%on_ring(i)
      x(self%axis) = self%origin(self%axis) + self%spacing(self%axis)*k
    else
      call find_band(self, i, j, band, at)
      theta = polar(self, i, band + 0.5_rp)
      phi = turn*(at + 0.5_rp)/on_band(self, i, band)
      x(self%axis) = self%centre(self%axis) + r*cos(theta)
      r = r*sin(theta)
    end if
    x(a) = self%centre(a) + r*cos(phi)
    x(b) = self%centre(b) + r*sin(phi)
  end function point

  !> Volume of a point over the product of the spacings; the points of a shell have its total
  !> volume.
  pure real(rp) function share(self, i, j, k)
    class(lattice_t), intent(in) :: self
    integer, intent(in) :: i, j, k
    real(rp) :: r, s
    integer :: at, band

    share = 1.0_rp
    if (any(self%grading%is_graded)) share = product(self%edges(i, j, k))/product(self%spacing)
    if (self%kind == straight) return
    s = self%pitch()
    r = ring_radius(self, i)
    if (self%kind == rings) then
      share = turn*r/(s*self%on_ring(i))*(s*s*self%spacing(self%axis)/product(self%spacing))
    else
      call find_band(self, i, j, band, at)
      share = turn*(r**2 + s**2/12.0_rp)*s/product(self%spacing)/on_band(self, i, band) &
              *(cos(polar(self, i, real(band, rp))) - cos(polar(self, i, band + 1.0_rp)))
    end if
  end function share

end module setup_lattice
