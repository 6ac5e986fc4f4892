! SPDX-License-Identifier: MIT
!> Exact signed distances from a closed triangulated surface with a tree of boxes. The nearest point
!> lies on a facet, an edge or a corner, whose normal determines the sign: for an edge the mean of
!> both facet normals, for a corner the angle-weighted mean (Baerentzen & Aanaes 2005).
module tools_mesh
  use base_kinds, only: pi, rp
  use tools_mesh_boxes, only: boxes_t, build_boxes, descent_t
  use tools_mesh_facets, only: cross, facets_t, match_edges, max_approach, on_face, project
  use tools_mesh_ridges, only: find_ridges, no_edge, ridges_t
  implicit none (type, external)
  private

  public :: surface_mesh_t, new_mesh

  real(rp), parameter :: slack = 1.0_rp + 1.0e-9_rp    !! factor on bounds, for rounding
  !> Factor on the squared distance below which a plane is nearer, since facets of one plane differ
  !> by rounding.
  real(rp), parameter :: flat = 1.0_rp - 1.0e-13_rp

  !> Mesh with its search structures.
  type :: surface_mesh_t
    type(facets_t) :: facets                       !! facets in the order of the tree
    type(boxes_t) :: tree
    type(ridges_t) :: ridges                       !! sharp convex edges
    !> First corner and edge vectors to the others [m], normal, (3, 4, facets).
    real(rp), allocatable :: geometry(:, :, :)
    real(rp), allocatable :: edge_normal(:, :, :)  !! (3, 3, facets) of each edge
    real(rp), allocatable :: normal(:, :)          !! (3, points) normal of each corner
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! bounding box [m]
    real(rp) :: radius = 0.0_rp                    !! largest distance from the last axis [m]
    !> Largest approach of the surface per angle of rotation about that axis [m/rad].
    real(rp) :: approach = 0.0_rp
    real(rp) :: volume = 0.0_rp                    !! volume of the solid [m3]
    real(rp) :: step = 0.0_rp                      !! edge of the cells of a grid of distances [m]
    integer :: grid(3) = 0                         !! cells of the grid of distances along the axes
    real(rp), allocatable :: grid_distance(:)      !! distances of the cell centres, x fastest [m]
    integer, allocatable :: grid_facet(:)          !! nearest facet of each cell centre
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

  !> Compute distances on a grid, which bound the distances of other points, and nearest facets,
  !> from which their searches begin.
  subroutine fill_grid(mesh)
    type(surface_mesh_t), intent(inout) :: mesh
    integer, parameter :: parts = 32               ! number of cells along the longest side
    real(rp), allocatable :: x(:, :)
    integer :: c, i, j, k, n(3)

    mesh%step = maxval(mesh%upper - mesh%lower)/parts
    n = max(1, ceiling((mesh%upper - mesh%lower)/mesh%step))
    mesh%grid = n
    allocate (mesh%grid_distance(product(n)), mesh%grid_facet(product(n)), x(n(1), 3))
    x(:, 1) = mesh%lower(1) + mesh%step*[(i - 0.5_rp, i=1, n(1))]
    do k = 1, n(3)
      x(:, 3) = mesh%lower(3) + mesh%step*(k - 0.5_rp)
      do j = 1, n(2)
        x(:, 2) = mesh%lower(2) + mesh%step*(j - 0.5_rp)
        c = n(1)*(j - 1 + n(2)*(k - 1)) + 1
        call exact_distances(mesh, n(1), x, mesh%grid_distance(c), mesh%grid_facet(c))
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

    call self%bracket(x, lower_bound, limit, facet)
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
    real(rp) :: apart(n), outside(n)
    integer :: c(n), p

    call cells_of(n, x, self%lower, self%upper, self%step, self%grid, c, apart, outside)
    do p = 1, n
      d(p) = self%grid_distance(c(p)) - apart(p)
      if (outside(p) > 0.0_rp) d(p) = max(d(p), outside(p))
    end do
  end subroutine lower_bounds

  !> Cells of the grid nearest to `n` points, distances from their centres and from the bounding
  !> box.
  pure subroutine cells_of(n, x, lower, upper, step, grid, c, apart, outside)
    integer, intent(in) :: n, grid(3)
    real(rp), intent(in) :: x(n, 3)              !! positions [m]
    real(rp), intent(in) :: lower(3), upper(3)   !! corners [m]
    real(rp), intent(in) :: step                 !! cell edge [m]
    integer, intent(out) :: c(n)
    real(rp), intent(out) :: apart(n)     !! distances from the cell centres [m]
    real(rp), intent(out) :: outside(n)   !! distances from the bounding box [m]
    real(rp) :: inside
    integer :: a, i, p

    c = 1
    apart = 0.0_rp
    outside = 0.0_rp
    do a = 1, 3
      !$omp simd private(i, inside)
      do p = 1, n
        inside = min(max(x(p, a), lower(a)), upper(a))
        i = min(int((inside - lower(a))/step), grid(a) - 1)
        c(p) = c(p) + i*product(grid(:a - 1))
        apart(p) = apart(p) + (x(p, a) - (lower(a) + step*(i + 0.5_rp)))**2
        outside(p) = outside(p) + (x(p, a) - inside)**2
      end do
    end do
    apart = sqrt(apart)
    outside = sqrt(outside)
  end subroutine cells_of

  !> Signed distance, gradient and distance to the edge as in `distance`. Beyond `bound` any value
  !> above it may be returned; beyond `edge_bound` only the sign of the distance to the edge is
  !> certain.
  pure subroutine near_distance(self, x, bound, edge_bound, d, normal, edge_distance)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), bound, edge_bound
    real(rp), intent(out) :: d, normal(3), edge_distance
    real(rp) :: at(3)
    integer :: facet, region

    normal = 0.0_rp
    edge_distance = no_edge
    call self%nearest_within(x, bound, facet, region, at, d)
    if (facet > 0) call self%gradient_at(x, facet, region, at, &
                                         max(edge_bound, 1.0e-12_rp*self%radius), d, normal, &
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

    call self%bracket(x, d, limit, facet)
    if (d > bound) then
      facet = 0
      return
    end if
    if (d > -bound) limit = slack*min(limit, bound)   ! points beyond the limit are outside
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
    ! closer to the surface the direction is rounding
    if (region /= on_face .and. abs(d) > 1.0e-12_rp*self%radius) normal = offset/d
    corner = self%facets%corner(max(1, region - 3), facet)
    if (d > 0.0_rp .and. region /= on_face) then
      edge_distance = -self%ridges%overhang(region, facet, corner, offset)
      if (edge_distance > -no_edge .and. edge_distance < no_edge) return
    end if
    edge_distance = self%ridges%edge_distance(facet, at, edge_bound)
  end subroutine gradient_at

  !> Lower bound of the signed distance and upper bound of its magnitude, and a near facet, from the
  !> grid.
  pure subroutine bracket(self, x, lower_bound, limit, facet)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: lower_bound, limit
    integer, intent(out) :: facet
    real(rp) :: apart(1), outside(1)
    integer :: c(1)

    call cells_of(1, x, self%lower, self%upper, self%step, self%grid, c, apart, outside)
    associate (d => self%grid_distance(c(1)))
      lower_bound = d - apart(1)
      limit = slack*(abs(d) + apart(1) + 1.0e-9_rp*self%radius)
    end associate
    facet = self%grid_facet(c(1))
    if (outside(1) > 0.0_rp) lower_bound = max(lower_bound, outside(1))
  end subroutine bracket

  !> Signed distances and nearest facets of `n` points, each close to the one before.
  pure subroutine exact_distances(self, n, x, d, facet)
    type(surface_mesh_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3)
    real(rp), intent(out) :: d(n)
    integer, intent(out) :: facet(n)
    real(rp) :: at(3), normal(3)
    integer :: near, p, region

    near = 1
    do p = 1, n
      call self%nearest(x(p, :), huge(1.0_rp), near, region, at)
      call self%side_of(x(p, :), near, region, at, d(p), normal)
      facet(p) = near
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
  !> point and the region of this point. The search begins with the facet given.
  pure subroutine nearest(self, x, bound, facet, region, at)
    class(surface_mesh_t), intent(in) :: self
    real(rp), intent(in) :: x(3), bound
    integer, intent(inout) :: facet
    integer, intent(out) :: region
    real(rp), intent(out) :: at(3)
    type(descent_t) :: descent
    real(rp) :: best, d2, y(3)
    integer :: first, i, k, last

    call descent%begin(self%tree%leaf(facet))
    call project(self%geometry(:, :, facet), x, region, best, at)
    if (best >= bound) then
      best = bound
      facet = 0
    end if
    do
      call descent%next_leaf(self%tree, x, best, first, last)
      if (last < first) exit
      do i = first, last
        if (dot_product(x - self%geometry(:, 1, i), self%geometry(:, 4, i))**2 >= flat*best) cycle
        call project(self%geometry(:, :, i), x, k, d2, y)
        if (d2 >= best) cycle
        best = d2
        facet = i
        region = k
        at = y
      end do
    end do
  end subroutine nearest

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
