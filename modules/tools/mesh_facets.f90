! SPDX-License-Identifier: MIT
!> Closed surface of triangles, counterclockwise seen from outside: common corners, neighbours
!> across edges, and defects.
module tools_mesh_facets
  use base_kinds, only: rp
  use base_sort, only: order_of
  implicit none (type, external)
  private

  public :: cross, facets_t, defect_t, join_corners, list_defects, match_edges, max_approach, &
            project

  !> Region of a facet; 1 to 3: on an edge, 4 to 6: on a corner.
  integer, parameter, public :: on_face = 0

  ! Defects of an edge: no neighbour, neighbour of opposite orientation, several neighbours.
  integer, parameter, public :: is_open = 1, is_flipped = 2, is_shared = 3

  !> Corners and connectivity.
  type :: facets_t
    real(rp), allocatable :: x(:, :)          !! (3, points) positions [m]
    integer, allocatable :: corner(:, :)      !! (3, facets) points of each facet
    !> Edge of the neighbour across each edge, as 3 (facet - 1) + edge; 0: none, (3, facets).
    integer, allocatable :: across(:, :)
  end type facets_t

  !> A defective edge of a facet.
  type :: defect_t
    integer :: facet = 0, kind = 0
    real(rp) :: from(3) = 0.0_rp, to(3) = 0.0_rp   !! ends of the edge [m]
  end type defect_t

contains

  !> Cross product.
  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Facets from separate corners y(3, 3 facets), with coinciding corners merged. Degenerate facets
  !> are left out; `kept` are the indices of the others.
  subroutine join_corners(y, facets, kept)
    real(rp), intent(in) :: y(:, :)
    type(facets_t), intent(out) :: facets
    integer, allocatable, intent(out) :: kept(:)
    integer, allocatable :: corner(:, :), order(:), point(:)
    integer :: i, n

    allocate (order(size(y, 2)), point(size(y, 2)))
    allocate (facets%x(3, size(y, 2)))
    order = order_of(y)
    n = 0
    do i = 1, size(order)
      if (i > 1) then
        if (all(abs(y(:, order(i)) - y(:, order(i - 1))) <= 0.0_rp)) then
          point(order(i)) = n
          cycle
        end if
      end if
      n = n + 1
      facets%x(:, n) = y(:, order(i))
      point(order(i)) = n
    end do
    facets%x = facets%x(:, :n)
    allocate (corner, source=reshape(point, [3, size(y, 2)/3]))
    kept = pack([(i, i=1, size(corner, 2))], corner(1, :) /= corner(2, :) .and. &
                corner(2, :) /= corner(3, :) .and. corner(3, :) /= corner(1, :))
    facets%corner = corner(:, kept)
  end subroutine join_corners

  !> Find the neighbour across each edge.
  subroutine match_edges(facets)
    type(facets_t), intent(inout) :: facets
    real(rp), allocatable :: key(:, :)
    integer, allocatable :: order(:)
    integer :: first, i, n

    n = 3*size(facets%corner, 2)
    allocate (key(2, n), order(n))
    do i = 1, n
      key(:, i) = real([minval(ends_of(facets, i)), maxval(ends_of(facets, i))], rp)
    end do
    order = order_of(key)
    if (allocated(facets%across)) deallocate (facets%across)
    allocate (facets%across(3, n/3), source=0)
    first = 1
    do i = 1, n
      if (i < n) then
        if (all(abs(key(:, order(i + 1)) - key(:, order(i))) <= 0.0_rp)) cycle
      end if
      if (i == first + 1) then
        if (all(ends_of(facets, order(i)) == cshift(ends_of(facets, order(first)), 1))) then
          call set_across(facets, order(i), order(first))
          call set_across(facets, order(first), order(i))
        end if
      end if
      first = i + 1
    end do
  end subroutine match_edges

  !> Set the neighbour of an edge.
  pure subroutine set_across(facets, edge, other)
    type(facets_t), intent(inout) :: facets
    integer, intent(in) :: edge, other

    facets%across(modulo(edge - 1, 3) + 1, (edge + 2)/3) = other
  end subroutine set_across

  !> The two points of an edge.
  pure function ends_of(facets, edge) result(ends)
    type(facets_t), intent(in) :: facets
    integer, intent(in) :: edge
    integer :: ends(2), i

    i = modulo(edge - 1, 3) + 1
    ends = facets%corner([i, modulo(i, 3) + 1], (edge + 2)/3)
  end function ends_of

  !> List the edges without a neighbour, one for each pair of ends: those of one facet, of two
  !> facets with opposite orientation, or of more than two.
  subroutine list_defects(facets, defect)
    type(facets_t), intent(in) :: facets
    type(defect_t), allocatable, intent(out) :: defect(:)
    real(rp), allocatable :: key(:, :)
    integer, allocatable :: edge(:), order(:)
    integer :: first, i, n, n_defects

    edge = pack([(i, i=1, size(facets%across))], [facets%across] == 0)
    n = size(edge)
    allocate (key(2, n), order(n), defect(n))
    n_defects = 0
    do i = 1, n
      key(:, i) = real([minval(ends_of(facets, edge(i))), maxval(ends_of(facets, edge(i)))], rp)
    end do
    order = order_of(key)
    first = 1
    do i = 1, n
      if (i < n) then
        if (all(abs(key(:, order(i + 1)) - key(:, order(i))) <= 0.0_rp)) cycle
      end if
      associate (e => edge(order(first)))
        n_defects = n_defects + 1
        defect(n_defects) = defect_t((e + 2)/3, min(i - first + 1, is_shared), &
                                     facets%x(:, minval(ends_of(facets, e))), &
                                     facets%x(:, maxval(ends_of(facets, e))))
      end associate
      first = i + 1
    end do
    defect = defect(:n_defects)
  end subroutine list_defects

  !> Upper bound of the approach of the surface to any point per angle of rotation about the last
  !> axis [m/rad], the velocity of the nearest point towards it. On a facet this is linear.
  !> Directions from edges and corners are combinations of the adjacent facet normals n; a
  !> combination of length 1 approaches at most as fast as the largest value of a facet over the
  !> least n . m, with the mean normal m.
  pure real(rp) function max_approach(facets, normal, point_normal) result(bound)
    type(facets_t), intent(in) :: facets
    real(rp), intent(in) :: normal(:, :), point_normal(:, :)   !! normals of facets and corners
    real(rp) :: max_speed(size(facets%x, 2)), lower_bound(size(facets%x, 2)), v(3)
    integer :: i, k, p

    max_speed = 0.0_rp
    lower_bound = 1.0_rp
    do i = 1, size(facets%corner, 2)
      do k = 1, 3
        p = facets%corner(k, i)
        v = [-facets%x(2, p), facets%x(1, p), 0.0_rp]
        max_speed(p) = max(max_speed(p), abs(dot_product(v, normal(:, i))))
        lower_bound(p) = min(lower_bound(p), dot_product(point_normal(:, p), normal(:, i)))
      end do
    end do
    bound = 0.0_rp
    do p = 1, size(max_speed)
      v = [facets%x(:2, p), 0.0_rp]
      if (lower_bound(p)*norm2(v) > max_speed(p)) then
        bound = max(bound, max_speed(p)/lower_bound(p))
      else
        bound = max(bound, norm2(v))
      end if
    end do
  end function max_approach

  !> Nearest point of a facet to `x`, its region and the squared distance (C. Ericson, Real-Time
  !> Collision Detection, 5.1.5).
  pure subroutine project(geometry, x, region, d2, at)
    real(rp), intent(in) :: geometry(3, 4), x(3)
    integer, intent(out) :: region
    real(rp), intent(out) :: d2, at(3)
    real(rp) :: a(2), b(2), c(2), u, v, w, offset(3)

    offset = x - geometry(:, 1)
    a = [dot_product(geometry(:, 2), offset), dot_product(geometry(:, 3), offset)]
    associate (bb => dot_product(geometry(:, 2), geometry(:, 2)), &
               bc => dot_product(geometry(:, 2), geometry(:, 3)), &
               cc => dot_product(geometry(:, 3), geometry(:, 3)))
      b = a - [bb, bc]
      c = a - [bc, cc]
    end associate
    u = b(1)*c(2) - c(1)*b(2)
    v = c(1)*a(2) - a(1)*c(2)
    w = a(1)*b(2) - b(1)*a(2)
    if (all(a <= 0.0_rp)) then
      region = 4
      at = geometry(:, 1)
    else if (b(1) >= 0.0_rp .and. b(2) <= b(1)) then
      region = 5
      at = geometry(:, 1) + geometry(:, 2)
    else if (c(2) >= 0.0_rp .and. c(1) <= c(2)) then
      region = 6
      at = geometry(:, 1) + geometry(:, 3)
    else if (w <= 0.0_rp .and. a(1) >= 0.0_rp .and. b(1) <= 0.0_rp) then
      region = 1
      at = geometry(:, 1) + a(1)/(a(1) - b(1))*geometry(:, 2)
    else if (v <= 0.0_rp .and. a(2) >= 0.0_rp .and. c(2) <= 0.0_rp) then
      region = 3
      at = geometry(:, 1) + a(2)/(a(2) - c(2))*geometry(:, 3)
    else if (u <= 0.0_rp .and. b(2) >= b(1) .and. c(1) >= c(2)) then
      region = 2
      u = (b(2) - b(1))/((b(2) - b(1)) + (c(1) - c(2)))
      at = geometry(:, 1) + (1.0_rp - u)*geometry(:, 2) + u*geometry(:, 3)
    else
      region = on_face
      d2 = dot_product(offset, geometry(:, 4))
      at = x - d2*geometry(:, 4)
      d2 = d2**2
      return
    end if
    d2 = sum((x - at)**2)
  end subroutine project

end module tools_mesh_facets
