! SPDX-License-Identifier: MIT
!> Exact signed distances from a closed triangulated surface with a tree of boxes. The nearest point
!> lies on a facet, an edge or a corner, whose normal determines the sign: for an edge the mean of
!> both facet normals, for a corner the angle-weighted mean (Baerentzen & Aanaes 2005).
module tools_mesh
  use base_kinds, only: pi, rp
  use tools_mesh_boxes, only: boxes_t, build_boxes, descent_t
  use tools_mesh_facets, only: cross, facets_t, match_edges, max_approach
  use tools_mesh_ridges, only: find_ridges, no_edge, ridges_t
  implicit none (type, external)
  private

  public :: surface_mesh_t, new_mesh

  real(rp), parameter :: slack = 1.0_rp + 1.0e-9_rp    !! factor on bounds, for rounding
  integer, parameter :: on_face = 0   !! region; 1 to 3: on an edge, 4 to 6: on a corner

  !> Mesh with its search structures.
  type :: surface_mesh_t
    type(facets_t) :: facets                       !! in the order of the tree
    type(boxes_t) :: tree
    type(ridges_t) :: ridges                       !! sharp convex edges
    real(rp), allocatable :: geometry(:, :, :)     !! (3, 4, facets) first corner, edge vectors to
                                                   !! the others [m], normal
    real(rp), allocatable :: edge_normal(:, :, :)  !! (3, 3, facets) of each edge
    real(rp), allocatable :: normal(:, :)          !! (3, points) of each corner
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! bounding box [m]
    real(rp) :: radius = 0.0_rp                    !! largest distance from the last axis [m]
    real(rp) :: approach = 0.0_rp                  !! largest approach of the surface per angle of
                                                   !! rotation about that axis [m/rad]
    real(rp) :: volume = 0.0_rp                    !! [m3]
    real(rp) :: step = 0.0_rp                      !! edge of the cells of a distance grid [m]
    real(rp), allocatable :: grid_distance(:, :, :)  !! distances of the cell centres [m]
  contains
    procedure :: distance
    procedure :: distances
    procedure :: lower_bounds
    procedure :: near_distance
    procedure :: bounds
    procedure :: sweep
    procedure, private :: bracket
    procedure, private :: nearest
    procedure, private :: nearest_within
    procedure, private :: gradient_at
    procedure, private :: side_of
  end type surface_mesh_t

contains

  !> Make the mesh of closed facets with merged corners.
  subroutine new_mesh(facets, mesh)
    type(facets_t), intent(in) :: facets
    type(surface_mesh_t), intent(out) :: mesh
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
      allocate (mesh%geometry(3, 4, size(c, 2)))
      do i = 1, size(c, 2)
        mesh%geometry(:, 1, i) = x(:, c(1, i))
        mesh%geometry(:, 2, i) = x(:, c(2, i)) - x(:, c(1, i))
        mesh%geometry(:, 3, i) = x(:, c(3, i)) - x(:, c(1, i))
        mesh%geometry(:, 4, i) = cross(mesh%geometry(:, 2, i), mesh%geometry(:, 3, i))
        mesh%volume = mesh%volume + dot_product(x(:, c(1, i)), mesh%geometry(:, 4, i))/6.0_rp
        mesh%geometry(:, 4, i) = mesh%geometry(:, 4, i)/norm2(mesh%geometry(:, 4, i))
      end do
      mesh%lower = minval(x, 2)
      mesh%upper = maxval(x, 2)
      mesh%radius = sqrt(maxval(x(1, :)**2 + x(2, :)**2))
    end associate
    call find_normals(mesh)
    mesh%approach = max_approach(mesh%facets, mesh%geometry(:, 4, :), mesh%normal)
    call find_ridges(mesh%facets, mesh%geometry(:, 4, :), mesh%ridges)
    call fill_grid(mesh)
  end subroutine new_mesh

  !> Compute distances on a grid, which bound the distances of other points.
  subroutine fill_grid(mesh)
    type(surface_mesh_t), intent(inout) :: mesh
    integer, parameter :: parts = 32               ! along the longest side
    real(rp), allocatable :: x(:, :)
    integer :: i, j, k, n(3)

    mesh%step = maxval(mesh%upper - mesh%lower)/parts
    n = max(1, ceiling((mesh%upper - mesh%lower)/mesh%step))
    allocate (mesh%grid_distance(n(1), n(2), n(3)), x(n(1), 3))
    x(:, 1) = mesh%lower(1) + mesh%step*[(i - 0.5_rp, i=1, n(1))]
    do k = 1, n(3)
      x(:, 3) = mesh%lower(3) + mesh%step*(k - 0.5_rp)
      do j = 1, n(2)
        x(:, 2) = mesh%lower(2) + mesh%step*(j - 0.5_rp)
        call exact_distances(mesh, n(1), x, mesh%grid_distance(:, j, k))
      end do
    end do
  end subroutine fill_grid

  !> Compute the normals of edges and corners.
  subroutine find_normals(mesh)
    type(surface_mesh_t), intent(inout) :: mesh
    real(rp) :: a(3), b(3)
    integer :: i, k, p

    allocate (mesh%normal(3, size(mesh%facets%x, 2)), source=0.0_rp)
    allocate (mesh%edge_normal(3, 3, size(mesh%facets%corner, 2)))
    associate (x => mesh%facets%x, c => mesh%facets%corner, n => mesh%geometry(:, 4, :))
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

  !> Signed distance of `x`, its gradient, and the distance along the surface to the nearest sharp
  !> edge, negative beyond it.
  pure subroutine distance(self, x, d, normal, edge_distance)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), edge_distance
    real(rp) :: at(3), lower_bound, limit
    integer :: facet, region

    call self%bracket(x, lower_bound, limit)
    call self%nearest(x, limit**2, facet, region, at)
    call self%gradient_at(x, facet, region, at, no_edge, d, normal, edge_distance)
  end subroutine distance

  !> Signed distances of `n` points; beyond `bound` any value above it may be returned.
  pure subroutine distances(self, n, x, bound, d)
    class(surface_mesh_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), bound
    real(rp), intent(out) :: d(n)
    real(rp) :: at(3), normal(3)
    integer :: facet, p, region

    do p = 1, n
      call self%nearest_within(x(p, :), bound, facet, region, at, d(p))
      if (facet > 0) call self%side_of(x(p, :), facet, region, at, d(p), normal)
    end do
  end subroutine distances

  !> Lower bounds of the signed distances of `n` points.
  pure subroutine lower_bounds(self, n, x, d)
    class(surface_mesh_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3)
    real(rp), intent(out) :: d(n)
    real(rp) :: limit
    integer :: p

    do p = 1, n
      call self%bracket(x(p, :), d(p), limit)
    end do
  end subroutine lower_bounds

  !> As `distance`, but beyond `bound` any value above it may be returned, and of the distance to
  !> the edge only the sign is certain.
  pure subroutine near_distance(self, x, bound, d, normal, edge_distance)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), bound
    real(rp), intent(out) :: d, normal(3), edge_distance
    real(rp) :: at(3)
    integer :: facet, region

    normal = 0.0_rp
    edge_distance = no_edge
    call self%nearest_within(x, bound, facet, region, at, d)
    if (facet > 0) call self%gradient_at(x, facet, region, at, 1.0e-12_rp*self%radius, d, normal, &
                                         edge_distance)
  end subroutine near_distance

  !> Nearest facet within the distance `bound`, which inside may be exceeded; 0 and a distance above
  !> it if there is none.
  pure subroutine nearest_within(self, x, bound, facet, region, at, d)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), bound
    integer, intent(out) :: facet, region
    real(rp), intent(out) :: at(3), d
    real(rp) :: limit

    facet = 0
    call self%bracket(x, d, limit)
    if (d > bound) return
    if (d > -bound) limit = slack*min(limit, bound)   ! farther points are outside
    call self%nearest(x, limit**2, facet, region, at)
    if (facet == 0) d = huge(1.0_rp)
  end subroutine nearest_within

  !> Signed distance of `x` from its nearest surface point `at`, its gradient, and the distance to
  !> the nearest sharp edge, at most `edge_bound`.
  pure subroutine gradient_at(self, x, facet, region, at, edge_bound, d, normal, edge_distance)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), at(3), edge_bound
    integer, intent(in) :: facet, region
    real(rp), intent(out) :: d, normal(3), edge_distance
    real(rp) :: offset(3)
    integer :: corner

    call self%side_of(x, facet, region, at, d, normal)
    offset = x - at
    ! Nearer to the surface, the direction is rounding.
    if (region /= on_face .and. abs(d) > 1.0e-12_rp*self%radius) normal = offset/d
    corner = self%facets%corner(max(1, region - 3), facet)
    if (d > 0.0_rp .and. region /= on_face) then
      edge_distance = -self%ridges%overhang(region, facet, corner, offset)
      if (edge_distance > -no_edge .and. edge_distance < no_edge) return
    end if
    edge_distance = self%ridges%edge_distance(facet, at, edge_bound)
  end subroutine gradient_at

  !> Lower bound of the signed distance and upper bound of its magnitude, from the grid.
  pure subroutine bracket(self, x, lower_bound, limit)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: lower_bound, limit
    real(rp) :: inside(3), offset
    integer :: i(3)

    inside = min(max(x, self%lower), self%upper)
    i = min(int((inside - self%lower)/self%step) + 1, shape(self%grid_distance))
    offset = norm2(x - (self%lower + self%step*(i - 0.5_rp)))
    associate (d => self%grid_distance(i(1), i(2), i(3)))
      lower_bound = d - offset
      limit = slack*(abs(d) + offset + 1.0e-9_rp*self%radius)
    end associate
    if (any(abs(x - inside) > 0.0_rp)) lower_bound = max(lower_bound, norm2(x - inside))
  end subroutine bracket

  !> Signed distances of `n` points, each close to the one before.
  pure subroutine exact_distances(self, n, x, d)
    type(surface_mesh_t), intent(in) :: self
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

  !> Signed distance of `x` from its nearest surface point `at`, and the normal there.
  pure subroutine side_of(self, x, facet, region, at, d, normal)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), at(3)
    integer, intent(in) :: facet, region
    real(rp), intent(out) :: d, normal(3)

    select case (region)
    case (on_face)
      normal = self%geometry(:, 4, facet)
      d = dot_product(x - self%geometry(:, 1, facet), normal)
      return
    case (1:3)
      normal = self%edge_normal(:, region, facet)
    case default
      normal = self%normal(:, self%facets%corner(region - 3, facet))
    end select
    d = sign(norm2(x - at), dot_product(x - at, normal))
  end subroutine side_of

  !> Facet nearest to `x` within the squared distance `bound` [m2], 0 if there is none, its nearest
  !> point and the region of this point.
  pure subroutine nearest(self, x, bound, facet, region, at)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), bound
    integer, intent(out) :: facet, region
    real(rp), intent(out) :: at(3)
    type(descent_t) :: descent
    real(rp) :: best, d2, y(3)
    integer :: first, i, k, last

    best = bound
    facet = 0
    region = on_face
    at = x
    call descent%begin()
    do
      call descent%next_leaf(self%tree, x, best, first, last)
      if (last < first) exit
      do i = first, last
        if (dot_product(x - self%geometry(:, 1, i), self%geometry(:, 4, i))**2 >= best) cycle
        call project(self%geometry(:, :, i), x, k, d2, y)
        if (d2 >= best) cycle
        best = d2
        facet = i
        region = k
        at = y
      end do
    end do
  end subroutine nearest

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

  !> Bounding box for the tool axes `axes`: intersection of the box around the rotated bounding box
  !> and that around the enclosing cylinder.
  pure subroutine bounds(self, axes, middle, half)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)
    real(rp), dimension(3) :: centre, lower, upper, offset

    centre = matmul(axes, 0.5_rp*(self%lower + self%upper))
    offset = matmul(abs(axes), 0.5_rp*(self%upper - self%lower))
    lower = centre - offset
    upper = centre + offset
    associate (axis => axes(:, 3))
      centre = 0.5_rp*(self%upper(3) + self%lower(3))*axis
      offset = 0.5_rp*(self%upper(3) - self%lower(3))*abs(axis) &
            + self%radius*sqrt(max(0.0_rp, 1.0_rp - axis**2))
    end associate
    lower = max(lower, centre - offset)
    upper = min(upper, centre + offset)
    middle = 0.5_rp*(lower + upper)
    half = 0.5_rp*(upper - lower)
  end subroutine bounds

  !> Upper bound of the approach of the surface to any point during a rotation about the last axis
  !> [m].
  pure real(rp) function sweep(self, before, after)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)   !! axes before and after
    real(rp) :: chord

    chord = min(1.0_rp, 0.5_rp*norm2(after(:, 1) - before(:, 1)))
    sweep = self%approach*2.0_rp*asin(chord)
    if (chord >= 1.0_rp) sweep = self%approach*pi
  end function sweep

end module tools_mesh
