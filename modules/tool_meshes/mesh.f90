! SPDX-License-Identifier: MIT
!> A closed surface of triangles: exact distances by a tree of boxes. The nearest point lies on a
!> facet, an edge or a corner, whose normal says whether a place is inside: of an edge the mean of
!> its two facets', of a corner that of its facets by their angles (Baerentzen & Aanaes 2005).
module tool_meshes_mesh
  use base_kinds, only: pi, rp
  use tool_meshes_boxes, only: boxes_t, build_boxes, descent_t
  use tool_meshes_facets, only: cross, facets_t, match_edges
  use tool_meshes_ridges, only: find_ridges, no_edge, ridges_t
  implicit none (type, external)
  private

  public :: mesh_t, new_mesh

  real(rp), parameter :: slack = 1.0_rp + 1.0e-9_rp    !! of bounds, for rounding
  integer, parameter :: on_face = 0   !! else 1 to 3: on an edge, 4 to 6: on a corner

  type :: mesh_t
    type(facets_t) :: facets                       !! in the order of the tree
    type(boxes_t) :: tree
    type(ridges_t) :: ridges                       !! edges that stand out
    real(rp), allocatable :: place(:, :, :)        !! (3, 4, facets) first corner, ways to the
                                                   !! others [m], normal
    real(rp), allocatable :: edge_normal(:, :, :)  !! (3, 3, facets)
    real(rp), allocatable :: normal(:, :)          !! (3, points)
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! [m]
    real(rp) :: radius = 0.0_rp                    !! about the last axis [m]
    real(rp) :: approach = 0.0_rp                  !! at which its surface comes nearer when it
                                                   !! turns about that axis, at most [m/rad]
    real(rp) :: volume = 0.0_rp                    !! [m3]
    real(rp) :: step = 0.0_rp                      !! edge of the cells of a grid around it [m]
    real(rp), allocatable :: known(:, :, :)        !! distances of their middles [m]
  contains
    procedure :: distance
    procedure :: distances
    procedure :: bounds
    procedure :: sweep
    procedure, private :: bracket
    procedure, private :: nearest
    procedure, private :: side_of
  end type mesh_t

contains

  !> The mesh of facets that close; their corners are joined.
  subroutine new_mesh(facets, mesh)
    type(facets_t), intent(in) :: facets
    type(mesh_t), intent(out) :: mesh
    integer, allocatable :: order(:)
    integer :: i

    mesh%facets%x = facets%x
    associate (x => facets%x, c => facets%corner)
      call build_boxes(min(x(:, c(1, :)), x(:, c(2, :)), x(:, c(3, :))), &
                       max(x(:, c(1, :)), x(:, c(2, :)), x(:, c(3, :))), mesh%tree, order)
      mesh%facets%corner = c(:, order)
    end associate
    call match_edges(mesh%facets)
    associate (x => mesh%facets%x, c => mesh%facets%corner)
      allocate (mesh%place(3, 4, size(c, 2)))
      do i = 1, size(c, 2)
        mesh%place(:, 1, i) = x(:, c(1, i))
        mesh%place(:, 2, i) = x(:, c(2, i)) - x(:, c(1, i))
        mesh%place(:, 3, i) = x(:, c(3, i)) - x(:, c(1, i))
        mesh%place(:, 4, i) = cross(mesh%place(:, 2, i), mesh%place(:, 3, i))
        mesh%volume = mesh%volume + dot_product(x(:, c(1, i)), mesh%place(:, 4, i))/6.0_rp
        mesh%place(:, 4, i) = mesh%place(:, 4, i)/norm2(mesh%place(:, 4, i))
      end do
      mesh%lower = minval(x, 2)
      mesh%upper = maxval(x, 2)
      mesh%radius = sqrt(maxval(x(1, :)**2 + x(2, :)**2))
    end associate
    call find_normals(mesh)
    mesh%approach = fastest_approach(mesh)
    call find_ridges(mesh%facets, mesh%place(:, 4, :), mesh%ridges)
    call fill_grid(mesh)
  end subroutine new_mesh

  !> Distances on a grid, by which most places are known to be far.
  subroutine fill_grid(mesh)
    type(mesh_t), intent(inout) :: mesh
    integer, parameter :: parts = 32               ! along the longest side
    real(rp), allocatable :: x(:, :)
    integer :: i, j, k, n(3)

    mesh%step = maxval(mesh%upper - mesh%lower)/parts
    n = max(1, ceiling((mesh%upper - mesh%lower)/mesh%step))
    allocate (mesh%known(n(1), n(2), n(3)), x(n(1), 3))
    x(:, 1) = mesh%lower(1) + mesh%step*[(i - 0.5_rp, i=1, n(1))]
    do k = 1, n(3)
      x(:, 3) = mesh%lower(3) + mesh%step*(k - 0.5_rp)
      do j = 1, n(2)
        x(:, 2) = mesh%lower(2) + mesh%step*(j - 0.5_rp)
        call exact_distances(mesh, n(1), x, mesh%known(:, j, k))
      end do
    end do
  end subroutine fill_grid

  !> Normals of edges and points.
  subroutine find_normals(mesh)
    type(mesh_t), intent(inout) :: mesh
    real(rp) :: a(3), b(3)
    integer :: i, k, p

    allocate (mesh%normal(3, size(mesh%facets%x, 2)), source=0.0_rp)
    allocate (mesh%edge_normal(3, 3, size(mesh%facets%corner, 2)))
    associate (x => mesh%facets%x, c => mesh%facets%corner, n => mesh%place(:, 4, :))
      do i = 1, size(c, 2)
        do k = 1, 3
          a = n(:, i) + n(:, (mesh%facets%across(k, i) + 2)/3)
          mesh%edge_normal(:, k, i) = a/max(tiny(1.0_rp), norm2(a))
          p = c(k, i)
          a = x(:, c(modulo(k, 3) + 1, i)) - x(:, p)
          b = x(:, c(modulo(k + 1, 3) + 1, i)) - x(:, p)
          mesh%normal(:, p) = mesh%normal(:, p) &
                              + atan2(norm2(cross(a, b)), dot_product(a, b))*n(:, i)
        end do
      end do
    end associate
    do p = 1, size(mesh%normal, 2)
      mesh%normal(:, p) = mesh%normal(:, p)/max(tiny(1.0_rp), norm2(mesh%normal(:, p)))
    end do
  end subroutine find_normals

  !> How fast, at most, the surface comes nearer to anything when it turns about the last axis: the
  !> velocity of its nearest point along the way there. Along a facet it is linear; ways from edges
  !> and corners lie between the normals n of their facets, and no combination of those with length
  !> 1 goes faster than the fastest of them over the least of n . m, m any direction.
  pure real(rp) function fastest_approach(mesh) result(most)
    type(mesh_t), intent(in) :: mesh
    real(rp) :: fastest(size(mesh%facets%x, 2)), least(size(mesh%facets%x, 2)), v(3)
    integer :: i, k, p

    fastest = 0.0_rp
    least = 1.0_rp
    do i = 1, size(mesh%facets%corner, 2)
      do k = 1, 3
        p = mesh%facets%corner(k, i)
        v = [-mesh%facets%x(2, p), mesh%facets%x(1, p), 0.0_rp]
        fastest(p) = max(fastest(p), abs(dot_product(v, mesh%place(:, 4, i))))
        least(p) = min(least(p), dot_product(mesh%normal(:, p), mesh%place(:, 4, i)))
      end do
    end do
    most = 0.0_rp
    do p = 1, size(fastest)
      v = [mesh%facets%x(:2, p), 0.0_rp]
      if (least(p)*norm2(v) > fastest(p)) then
        most = max(most, fastest(p)/least(p))
      else
        most = max(most, norm2(v))
      end if
    end do
  end function fastest_approach

  !> Signed distance of `x`, its gradient, and the room along the surface to the nearest edge that
  !> stands out, below 0 beyond it.
  pure subroutine distance(self, x, d, normal, room)
    class(mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), room
    real(rp) :: at(3), least, limit, way(3)
    integer :: corner, facet, region

    call self%bracket(x, least, limit)
    call self%nearest(x, limit**2, facet, region, at)
    call self%side_of(x, facet, region, at, d, normal)
    way = x - at
    if (region == on_face) then
      normal = self%place(:, 4, facet)
    else if (abs(d) > 1.0e-12_rp*self%radius) then   ! else the way is rounding
      normal = way/d
    end if
    corner = 0
    if (region > 3) corner = self%facets%corner(region - 3, facet)
    if (d > 0.0_rp .and. region /= on_face) then
      room = -self%ridges%beyond(region, facet, corner, way)
      if (room > -no_edge .and. room < no_edge) return
    end if
    room = self%ridges%room(facet, at)
  end subroutine distance

  !> Distances of `n` places; of those beyond `most` any number beyond it will do.
  pure subroutine distances(self, n, x, most, d)
    class(mesh_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), most
    real(rp), intent(out) :: d(n)
    real(rp) :: at(3), least, limit, normal(3)
    integer :: facet, p, region

    do p = 1, n
      call self%bracket(x(p, :), least, limit)
      d(p) = least
      if (least > most) cycle
      call self%nearest(x(p, :), limit**2, facet, region, at)
      call self%side_of(x(p, :), facet, region, at, d(p), normal)
    end do
  end subroutine distances

  !> The least that a distance may be, and the most that it is in either direction, by the grid.
  pure subroutine bracket(self, x, least, limit)
    class(mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: least, limit
    real(rp) :: inside(3), way
    integer :: i(3)

    inside = min(max(x, self%lower), self%upper)
    i = min(int((inside - self%lower)/self%step) + 1, shape(self%known))
    way = norm2(x - (self%lower + self%step*(i - 0.5_rp)))
    associate (d => self%known(i(1), i(2), i(3)))
      least = d - way
      limit = slack*(abs(d) + way + 1.0e-9_rp*self%radius)
    end associate
    if (any(abs(x - inside) > 0.0_rp)) least = max(least, norm2(x - inside))
  end subroutine bracket

  !> Distances of `n` places; those in a row are near to each other.
  pure subroutine exact_distances(self, n, x, d)
    type(mesh_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3)
    real(rp), intent(out) :: d(n)
    real(rp) :: at(3), limit, normal(3)
    integer :: facet, p, region

    limit = huge(1.0_rp)
    do p = 1, n
      call self%nearest(x(p, :), limit, facet, region, at)
      call self%side_of(x(p, :), facet, region, at, d(p), normal)
      if (p < n) limit = (slack*(abs(d(p)) + norm2(x(p + 1, :) - x(p, :)) &
                                 + 1.0e-9_rp*self%radius))**2
    end do
  end subroutine exact_distances

  !> Signed distance of `x`, whose nearest point is `at`, and the normal there.
  pure subroutine side_of(self, x, facet, region, at, d, normal)
    class(mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), at(3)
    integer, intent(in) :: facet, region
    real(rp), intent(out) :: d, normal(3)

    select case (region)
    case (on_face)
      normal = self%place(:, 4, facet)
      d = dot_product(x - self%place(:, 1, facet), normal)
      return
    case (1:3)
      normal = self%edge_normal(:, region, facet)
    case default
      normal = self%normal(:, self%facets%corner(region - 3, facet))
    end select
    d = sign(norm2(x - at), dot_product(x - at, normal))
  end subroutine side_of

  !> The facet nearest to `x`, the place `at` of it that is, and where on the facet that lies. No
  !> farther than `most` [m2], which there must be.
  pure subroutine nearest(self, x, most, facet, region, at)
    class(mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), most
    integer, intent(out) :: facet, region
    real(rp), intent(out) :: at(3)
    type(descent_t) :: descent
    real(rp) :: best, d2, y(3)
    integer :: first, i, k, last

    best = most
    facet = 1
    region = on_face
    at = x
    call descent%begin()
    do
      call descent%next_leaf(self%tree, x, best, first, last)
      if (last < first) exit
      do i = first, last
        if (dot_product(x - self%place(:, 1, i), self%place(:, 4, i))**2 >= best) cycle
        call project(self%place(:, :, i), x, k, d2, y)
        if (d2 >= best) cycle
        best = d2
        facet = i
        region = k
        at = y
      end do
    end do
  end subroutine nearest

  !> The place of a facet that is nearest to `x`, where on the facet it lies, and the square of the
  !> distance (C. Ericson, Real-Time Collision Detection, 5.1.5).
  pure subroutine project(place, x, region, d2, at)
    real(rp), intent(in) :: place(3, 4), x(3)
    integer, intent(out) :: region
    real(rp), intent(out) :: d2, at(3)
    real(rp) :: a(2), b(2), c(2), u, v, w, way(3)

    way = x - place(:, 1)
    a = [dot_product(place(:, 2), way), dot_product(place(:, 3), way)]
    associate (bb => dot_product(place(:, 2), place(:, 2)), &
               bc => dot_product(place(:, 2), place(:, 3)), &
               cc => dot_product(place(:, 3), place(:, 3)))
      b = a - [bb, bc]
      c = a - [bc, cc]
    end associate
    u = b(1)*c(2) - c(1)*b(2)
    v = c(1)*a(2) - a(1)*c(2)
    w = a(1)*b(2) - b(1)*a(2)
    if (all(a <= 0.0_rp)) then
      region = 4
      at = place(:, 1)
    else if (b(1) >= 0.0_rp .and. b(2) <= b(1)) then
      region = 5
      at = place(:, 1) + place(:, 2)
    else if (c(2) >= 0.0_rp .and. c(1) <= c(2)) then
      region = 6
      at = place(:, 1) + place(:, 3)
    else if (w <= 0.0_rp .and. a(1) >= 0.0_rp .and. b(1) <= 0.0_rp) then
      region = 1
      at = place(:, 1) + a(1)/(a(1) - b(1))*place(:, 2)
    else if (v <= 0.0_rp .and. a(2) >= 0.0_rp .and. c(2) <= 0.0_rp) then
      region = 3
      at = place(:, 1) + a(2)/(a(2) - c(2))*place(:, 3)
    else if (u <= 0.0_rp .and. b(2) >= b(1) .and. c(1) >= c(2)) then
      region = 2
      u = (b(2) - b(1))/((b(2) - b(1)) + (c(1) - c(2)))
      at = place(:, 1) + (1.0_rp - u)*place(:, 2) + u*place(:, 3)
    else
      region = on_face
      d2 = dot_product(way, place(:, 4))
      at = x - d2*place(:, 4)
      d2 = d2**2
      return
    end if
    d2 = sum((x - at)**2)
  end subroutine project

  !> A box around it when its axes are `axes`: that around its box, cut to that around the cylinder
  !> that encloses it.
  pure subroutine bounds(self, axes, middle, half)
    class(mesh_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)
    real(rp), dimension(3) :: centre, lower, upper, way

    centre = matmul(axes, 0.5_rp*(self%lower + self%upper))
    way = matmul(abs(axes), 0.5_rp*(self%upper - self%lower))
    lower = centre - way
    upper = centre + way
    associate (axis => axes(:, 3))
      centre = 0.5_rp*(self%upper(3) + self%lower(3))*axis
      way = 0.5_rp*(self%upper(3) - self%lower(3))*abs(axis) &
            + self%radius*sqrt(max(0.0_rp, 1.0_rp - axis**2))
    end associate
    lower = max(lower, centre - way)
    upper = min(upper, centre + way)
    middle = 0.5_rp*(lower + upper)
    half = 0.5_rp*(upper - lower)
  end subroutine bounds

  !> How far, at most, its surface comes nearer to anything while it turns about its last axis.
  pure real(rp) function sweep(self, before, after)
    class(mesh_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)   !! its axes
    real(rp) :: chord

    chord = min(1.0_rp, 0.5_rp*norm2(after(:, 1) - before(:, 1)))
    sweep = self%approach*2.0_rp*asin(chord)
    if (chord >= 1.0_rp) sweep = self%approach*pi
  end function sweep

end module tool_meshes_mesh
