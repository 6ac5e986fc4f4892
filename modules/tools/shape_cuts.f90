! SPDX-License-Identifier: MIT
!> Surface mesh of a shoulder with thread and flats on the pin or a scroll in the face. It is built
!> from meridians, polylines in half planes at angles about the axis from the top to the tip; facets
!> between meridians follow the grooves.
module tools_shape_cuts
  use base_errors, only: fatal
  use base_kinds, only: pi, rp
  use base_sort, only: order_of
  use tools_mesh, only: surface_mesh_t, new_mesh
  use tools_mesh_facets, only: facets_t, defect_t, join_corners, list_defects, match_edges
  use tools_shape_grooves, only: grooves_t
  implicit none (type, external)
  private

  public :: cut_pin_shape_t, make_mesh

  !> Meridians; chords deviate by at most 0.05 % of the radius.
  integer, parameter :: n_meridians = 96
  integer, parameter :: n_sections = 4         !! sections of a meridian: wall, face, ledge, pin

  !> Sizes of the shoulder, the pin and the cuts.
  type :: cut_pin_shape_t
    real(rp) :: radius = 0.0_rp   !! radius of the shoulder [m]
    real(rp) :: height = 0.0_rp   !! height of the top of the tool [m]
    real(rp) :: slope = 0.0_rp  !! slope of the face, rising towards the axis
    real(rp) :: pin_radius = 0.0_rp, tip_radius = 0.0_rp, pin_length = 0.0_rp   !! [m]; 0: no pin
    type(grooves_t) :: thread, scroll
    integer :: n_flats = 0
    real(rp) :: flat_depth = 0.0_rp                     !! depth of the flats [m]
  end type cut_pin_shape_t

  !> Points (r, z) of one section of a meridian, from the top, with decreasing keys that identify
  !> corresponding corners of all meridians.
  type :: polyline_t
    integer :: n = 0
    real(rp), allocatable :: r(:), z(:), key(:)
  contains
    procedure :: add
  end type polyline_t

  !> A meridian.
  type :: meridian_t
    real(rp) :: c = 1.0_rp, s = 0.0_rp          !! cosine and sine of its angle
    type(polyline_t) :: part(n_sections)
  end type meridian_t

contains

  !> Make the mesh of a shoulder with cuts.
  subroutine make_mesh(shape, mesh)
    type(cut_pin_shape_t), intent(in) :: shape
    type(surface_mesh_t), intent(out) :: mesh
    type(meridian_t), allocatable :: meridian(:)
    real(rp), allocatable :: angle(:), y(:, :)
    type(facets_t) :: facets
    type(defect_t), allocatable :: defect(:)
    integer, allocatable :: kept(:)
    integer :: i, n

    allocate (angle, source=angles(shape))
    allocate (meridian(size(angle)))
    do i = 1, size(angle)
      call draw_meridian(shape, angle(i), meridian(i))
    end do
    n = 0
    allocate (y(3, 1024))
    do i = 1, size(angle)
      call add_strip(shape, meridian(i), meridian(modulo(i, size(angle)) + 1), i == size(angle), &
                     n, y)
    end do
    call join_corners(y(:, :n), facets, kept)
    call match_edges(facets)
    call list_defects(facets, defect)
    if (size(defect) > 0) call fatal('the facets of a shoulder with cuts do not close')
    call new_mesh(facets, mesh)
  end subroutine make_mesh

  !> Angles of the meridians [rad]: equidistant ones and those of the edges of flats on a
  !> cylindrical pin, which replace equidistant ones close to them.
  function angles(shape) result(angle)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp), allocatable :: angle(:), edge(:)
    real(rp), parameter :: step = 2.0_rp*pi/n_meridians
    real(rp) :: half, pitch
    integer :: i

    angle = [(step*i, i=0, n_meridians - 1)]
    if (shape%n_flats == 0) return
    pitch = 2.0_rp*pi/shape%n_flats
    half = acos(1.0_rp - shape%flat_depth/shape%pin_radius)
    edge = [(i*pitch + min(half, 0.5_rp*pitch), i=0, shape%n_flats - 1)]
    if (half < 0.5_rp*pitch) edge = [edge, modulo(-edge, 2.0_rp*pi)]
    do i = 1, size(edge)
      angle = pack(angle, abs(modulo(angle - edge(i) + pi, 2.0_rp*pi) - pi) > 0.3_rp*step)
    end do
    angle = [angle, edge]
    angle = angle(order_of(reshape(angle, [1, size(angle)])))
  end function angles

  !> Make all sections of a meridian.
  subroutine draw_meridian(shape, phi, meridian)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp), intent(in) :: phi
    type(meridian_t), intent(out) :: meridian
    real(rp) :: inner, root, z

    meridian%c = cos(phi)
    meridian%s = sin(phi)
    call draw_face(shape, phi, inner_radius(shape, phi), meridian%part(2))
    associate (wall => meridian%part(1), face => meridian%part(2), ledge => meridian%part(3), &
               pin => meridian%part(4))
      call wall%add(shape%radius, shape%height, 1.0_rp)
      call wall%add(shape%radius, face%z(1), 0.0_rp)
      inner = face%r(face%n)
      root = face%z(face%n)
      call ledge%add(inner, root, 1.0_rp)
      if (shape%pin_radius > 0.0_rp) then
        call draw_pin(shape, phi, root, pin)
        call ledge%add(pin%r(1), root, 0.0_rp)
      else
        z = shape%slope*(shape%radius - inner)
        call ledge%add(inner, z, 0.0_rp)
        call pin%add(inner, z, 1.0_rp)
        call pin%add(inner, z, 0.0_rp)
      end if
    end associate
  end subroutine draw_meridian

  !> Inner radius of the face [m]: at the pin, or without a pin where the scroll would be steeper
  !> than 45 degrees.
  pure real(rp) function inner_radius(shape, phi)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp), intent(in) :: phi

    if (shape%pin_radius > 0.0_rp) then
      inner_radius = flattened(shape, phi, shape%pin_radius, shape%pin_radius)
    else
      inner_radius = min(0.5_rp*shape%radius, abs(shape%scroll%rise)*shape%scroll%pitch/(2.0_rp*pi))
    end if
  end function inner_radius

  !> Make the face from its rim to the radius `inner` [m].
  subroutine draw_face(shape, phi, inner, line)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp), intent(in) :: phi, inner
    type(polyline_t), intent(inout) :: line
    real(rp), allocatable :: w(:), part(:), key(:)
    integer :: i

    call cross_grooves(shape%scroll, phi, shape%radius, inner, 2, w, part, key)
    do i = 1, size(w)
      call line%add(w(i), shape%slope*(shape%radius - w(i)) + shape%scroll%depth*part(i), key(i))
    end do
  end subroutine draw_face

  !> Make the pin from height `root` [m] to its tip.
  subroutine draw_pin(shape, phi, root, line)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp), intent(in) :: phi, root
    type(polyline_t), intent(inout) :: line
    real(rp), allocatable :: w(:), part(:), key(:)
    real(rp) :: face, radius
    integer :: i, rows

    face = shape%slope*(shape%radius - shape%pin_radius)
    rows = 2                                     ! edges of flats on a cone need more rows
    if (abs(shape%pin_radius - shape%tip_radius) > 0.0_rp) rows = 2 + n_meridians/4
    call cross_grooves(shape%thread, phi, root, -shape%pin_length, rows, w, part, key)
    do i = 1, size(w)
      radius = shape%pin_radius
      if (w(i) < face) radius = shape%tip_radius + (shape%pin_radius - shape%tip_radius) &
                                *(w(i) + shape%pin_length)/(face + shape%pin_length)
      call line%add(flattened(shape, phi, radius, radius - shape%thread%depth*part(i)), &
                    w(i), key(i))
    end do
  end subroutine draw_pin

  !> Radius at an angle of a pin with flats [m]; `cut` where there is no flat.
  pure real(rp) function flattened(shape, phi, radius, cut)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp), intent(in) :: phi, radius, cut
    real(rp) :: beside, step

    flattened = cut
    if (shape%n_flats == 0) return
    step = 2.0_rp*pi/shape%n_flats
    beside = modulo(phi + 0.5_rp*step, step) - 0.5_rp*step
    if (radius - shape%flat_depth < cut*cos(beside)) then
      flattened = (radius - shape%flat_depth)/cos(beside)
    end if
  end function flattened

  !> Coordinates w from `first` down to `last` at the corners of grooves and the ends, without
  !> corners very close to an end; without grooves `rows` equidistant coordinates.
  subroutine cross_grooves(grooves, phi, first, last, rows, w, part, key)
    type(grooves_t), intent(in) :: grooves
    real(rp), intent(in) :: phi, first, last
    integer, intent(in) :: rows
    real(rp), allocatable, intent(out) :: w(:), part(:), key(:)
    real(rp) :: ends(2), near
    integer :: i, k

    if (grooves%depth <= 0.0_rp) then
      key = [(real(rows - i, rp)/(rows - 1), i=1, rows)]
      w = last + key*(first - last)
      w(1) = first
      allocate (part(rows), source=0.0_rp)
      return
    end if
    ends = [grooves%key_of(first, phi), grooves%key_of(last, phi)]
    w = [first]
    part = [grooves%part_at(ends(1))]
    key = [ends(1)]
    near = 1.0e-3_rp*grooves%pitch
    do k = floor(ends(1)), ceiling(ends(2)), -1
      associate (at => grooves%coordinate_of(k, phi))
        if (at > first - near .or. at < last + near) cycle
        w = [w, at]
        part = [part, grooves%part_of(k)]
        key = [key, real(k, rp)]
      end associate
    end do
    w = [w, last]
    part = [part, grooves%part_at(ends(2))]
    key = [key, ends(2)]
  end subroutine cross_grooves

  !> Append a point.
  subroutine add(self, r, z, key)
    class(polyline_t), intent(inout) :: self
    real(rp), intent(in) :: r, z, key

    if (self%n == 0) allocate (self%r(0), self%z(0), self%key(0))
    self%r = [self%r, r]
    self%z = [self%z, z]
    self%key = [self%key, key]
    self%n = self%n + 1
  end subroutine add

  !> Add the facets between a meridian and the next; the first follows the last with keys shifted by
  !> one turn.
  subroutine add_strip(shape, left, right, is_last, n, y)
    type(cut_pin_shape_t), intent(in) :: shape
    type(meridian_t), intent(in) :: left, right
    logical, intent(in) :: is_last
    integer, intent(inout) :: n                  !! number of corners so far
    real(rp), allocatable, intent(inout) :: y(:, :)
    real(rp) :: shift(n_sections)
    integer :: i, j, k

    shift = 0.0_rp
    if (is_last .and. shape%scroll%depth > 0.0_rp) shift(2) = shape%scroll%rise*shape%scroll%n
    if (is_last .and. shape%thread%depth > 0.0_rp) shift(4) = shape%thread%rise*shape%thread%n
    call add_facet(on_axis(shape%height), point(left, 1, 1), point(right, 1, 1), n, y)
    do k = 1, n_sections
      i = 1
      j = 1
      associate (a => left%part(k), b => right%part(k))
        do while (i < a%n .or. j < b%n)
          if (advances_left(a, b, i, j, shift(k))) then
            call add_facet(point(left, k, i), point(left, k, i + 1), point(right, k, j), n, y)
            i = i + 1
          else
            call add_facet(point(left, k, i), point(right, k, j + 1), point(right, k, j), n, y)
            j = j + 1
          end if
        end do
      end associate
    end do
    associate (a => left%part(n_sections))
      call add_facet(point(left, n_sections, a%n), tip(shape), &
                     point(right, n_sections, right%part(n_sections)%n), n, y)
    end associate
  end subroutine add_strip

  !> True if the next facet advances along the left meridian, whose next corner comes first.
  pure logical function advances_left(a, b, i, j, shift)
    type(polyline_t), intent(in) :: a, b
    integer, intent(in) :: i, j
    real(rp), intent(in) :: shift

    advances_left = j == b%n
    if (i == a%n .or. j == b%n) return
    advances_left = a%key(i + 1) >= b%key(j + 1) + shift
  end function advances_left

  !> Point of a section of a meridian [m].
  pure function point(meridian, part, i) result(x)
    type(meridian_t), intent(in) :: meridian
    integer, intent(in) :: part, i
    real(rp) :: x(3)

    associate (line => meridian%part(part))
      x = [line%r(i)*meridian%c, line%r(i)*meridian%s, line%z(i)]
    end associate
  end function point

  !> Point on the axis [m].
  pure function on_axis(z) result(x)
    real(rp), intent(in) :: z
    real(rp) :: x(3)

    x = [0.0_rp, 0.0_rp, z]
  end function on_axis

  !> Lowest point on the axis: the tip of the pin, or the centre of the face [m].
  pure function tip(shape) result(x)
    type(cut_pin_shape_t), intent(in) :: shape
    real(rp) :: x(3)

    x = on_axis(shape%slope*shape%radius)
    if (shape%pin_radius > 0.0_rp) x = on_axis(-shape%pin_length)
  end function tip

  !> Append a facet.
  subroutine add_facet(a, b, c, n, y)
    real(rp), intent(in) :: a(3), b(3), c(3)
    integer, intent(inout) :: n
    real(rp), allocatable, intent(inout) :: y(:, :)
    real(rp), allocatable :: longer(:, :)

    if (n + 3 > size(y, 2)) then
      allocate (longer(3, 2*size(y, 2)))
      longer(:, :n) = y(:, :n)
      call move_alloc(longer, y)
    end if
    y(:, n + 1) = a
    y(:, n + 2) = b
    y(:, n + 3) = c
    n = n + 3
  end subroutine add_facet

end module tools_shape_cuts
