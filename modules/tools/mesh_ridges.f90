! SPDX-License-Identifier: MIT
!> Sharp convex edges of a mesh, such as the rim of a punch, and distances to them. Edges with an
!> angle below `feature_angle` are smooth, such as those between the facets of a cylinder.
module tools_mesh_ridges
  use base_kinds, only: pi, rp
  use tools_mesh_boxes, only: boxes_t, build_boxes, descent_t
  use tools_mesh_facets, only: cross, facets_t
  implicit none (type, external)
  private

  public :: find_ridges, ridges_t

  !> Distance without an edge; may be divided by a cell edge [m].
  real(rp), parameter, public :: no_edge = 1.0e100_rp

  real(rp), parameter :: feature_angle = 30.0_rp*pi/180.0_rp   !! a cylinder of 12 facets is smooth

  !> Ridges and their adjacency.
  type :: ridges_t
    integer :: n = 0
    type(boxes_t) :: tree
    integer, allocatable :: patch(:)          !! patch of each facet, bounded by sharp edges
    integer, allocatable :: of_edge(:, :)     !! (3, facets) ridge of each edge; 0: none
    integer, allocatable :: begin(:), of_point(:)   !! ridges of point p: begin(p) to begin(p+1)-1
    integer, allocatable :: beside(:, :)      !! (2, n) adjacent patches
    real(rp), allocatable :: segment(:, :, :)  !! (3, 2, n) start, and vector to the end [m]
    real(rp), allocatable :: out(:, :, :)     !! (3, 2, n) outward direction in both facets
    real(rp), allocatable :: sharpness(:)     !! 1 - cos of the edge angle, at most 1
  contains
    procedure :: overhang, edge_distance
  end type ridges_t

contains

  !> Find the ridges of facets with the normals (3, facets).
  subroutine find_ridges(facets, normal, ridges)
    type(facets_t), intent(in) :: facets
    real(rp), intent(in) :: normal(:, :)
    type(ridges_t), intent(out) :: ridges
    integer, allocatable :: edge(:), order(:)
    real(rp) :: along(3), c
    integer :: i, k, n, other, root

    allocate (ridges%patch, source=[(i, i=1, size(normal, 2))])
    allocate (ridges%of_edge(3, size(normal, 2)), source=0)
    allocate (edge(size(facets%across)))
    n = 0
    do i = 1, size(normal, 2)
      do k = 1, 3
        other = (facets%across(k, i) + 2)/3
        if (other < i) cycle
        c = dot_product(normal(:, i), normal(:, other))
        along = facets%x(:, facets%corner(modulo(k, 3) + 1, i)) - facets%x(:, facets%corner(k, i))
        if (c >= cos(feature_angle)) then
          root = min(root_of(ridges%patch, i), root_of(ridges%patch, other))
          call set_root(ridges%patch, i, root)
          call set_root(ridges%patch, other, root)
        else if (dot_product(cross(normal(:, i), normal(:, other)), along) > 0.0_rp) then
          n = n + 1
          edge(n) = 3*(i - 1) + k
        end if
      end do
    end do
    do i = 1, size(ridges%patch)
      ridges%patch(i) = root_of(ridges%patch, i)
    end do
    ridges%n = n
    allocate (ridges%beside(2, n), ridges%segment(3, 2, n), ridges%out(3, 2, n), &
              ridges%sharpness(n))
    allocate (order(n))
    do i = 1, n
      call set_ridge(facets, normal, edge(i), ridges, i)
    end do
    if (n > 0) call build_boxes(min(ridges%segment(:, 1, :), sum(ridges%segment, 2)), &
                                max(ridges%segment(:, 1, :), sum(ridges%segment, 2)), &
                                ridges%tree, order)
    do i = 1, n
      call set_ridge(facets, normal, edge(order(i)), ridges, i)
    end do
    call list_at_points(facets, edge(order), ridges)
  end subroutine find_ridges

  !> Store an edge as ridge `i`.
  subroutine set_ridge(facets, normal, edge, ridges, i)
    type(facets_t), intent(in) :: facets
    real(rp), intent(in) :: normal(:, :)
    integer, intent(in) :: edge, i
    type(ridges_t), intent(inout) :: ridges
    real(rp) :: along(3)
    integer :: facet, k, other

    facet = (edge + 2)/3
    k = modulo(edge - 1, 3) + 1
    other = facets%across(k, facet)
    ridges%of_edge(k, facet) = i
    ridges%of_edge(modulo(other - 1, 3) + 1, (other + 2)/3) = i
    other = (other + 2)/3
    associate (from => facets%x(:, facets%corner(k, facet)))
      along = facets%x(:, facets%corner(modulo(k, 3) + 1, facet)) - from
      ridges%segment(:, 1, i) = from
    end associate
    ridges%segment(:, 2, i) = along
    ridges%beside(:, i) = ridges%patch([facet, other])
    ridges%sharpness(i) = min(1.0_rp, 1.0_rp - dot_product(normal(:, facet), normal(:, other)))
    along = along/norm2(along)
    ridges%out(:, 1, i) = cross(along, normal(:, facet))
    ridges%out(:, 2, i) = -cross(along, normal(:, other))
  end subroutine set_ridge

  !> List the ridges that end in each point; `edge` are the edges of the ridges.
  subroutine list_at_points(facets, edge, ridges)
    type(facets_t), intent(in) :: facets
    integer, intent(in) :: edge(:)
    type(ridges_t), intent(inout) :: ridges
    integer :: ends(2, size(edge)), i, k, n_points, p

    n_points = size(facets%x, 2)
    allocate (ridges%begin(n_points + 1), source=0)
    allocate (ridges%of_point(2*size(edge)))
    do i = 1, size(edge)
      k = modulo(edge(i) - 1, 3) + 1
      ends(:, i) = facets%corner([k, modulo(k, 3) + 1], (edge(i) + 2)/3)
      do k = 1, 2
        ridges%begin(ends(k, i)) = ridges%begin(ends(k, i)) + 1
      end do
    end do
    do p = 2, n_points
      ridges%begin(p) = ridges%begin(p) + ridges%begin(p - 1)
    end do
    ridges%begin(n_points + 1) = 2*size(edge)
    ridges%begin = ridges%begin + 1
    do i = size(edge), 1, -1
      do k = 2, 1, -1
        p = ends(k, i)
        ridges%begin(p) = ridges%begin(p) - 1
        ridges%of_point(ridges%begin(p)) = i
      end do
    end do
  end subroutine list_at_points

  !> Set the root of all entries on the path from `i`.
  pure subroutine set_root(patch, i, root)
    integer, intent(inout) :: patch(:)
    integer, intent(in) :: i, root
    integer :: k, next

    next = i
    do
      k = next
      next = patch(k)
      patch(k) = root
      if (next == k) exit
    end do
  end subroutine set_root

  !> Root of the patch of facet `i`.
  pure integer function root_of(patch, i) result(root)
    integer, intent(in) :: patch(:), i

    root = i
    do while (patch(root) /= root)
      root = patch(root)
    end do
  end function root_of

  !> Distance by which a point with the nearest surface point on an edge or a corner lies beyond the
  !> ends of the adjacent facets [m]; `no_edge` if there is no ridge.
  pure real(rp) function overhang(self, region, facet, corner, offset)
    class(ridges_t), intent(in) :: self
    integer, intent(in) :: region          !! 1 to 3: edge of the facet; above 3: corner
    integer, intent(in) :: facet, corner
    real(rp), intent(in) :: offset(3)
    integer :: i

    overhang = -no_edge
    if (region <= 3) then
      if (self%of_edge(region, facet) > 0) overhang = overhang_of(self%out(:, :, &
                                                                  self%of_edge(region, facet)), &
                                                                    offset)
    else
      do i = self%begin(corner), self%begin(corner + 1) - 1
        overhang = max(overhang, overhang_of(self%out(:, :, self%of_point(i)), offset))
      end do
    end if
    if (overhang <= -no_edge) overhang = no_edge
  end function overhang

  !> Overhang over a ridge with the given outward directions [m].
  pure real(rp) function overhang_of(out, offset)
    real(rp), intent(in) :: out(3, 2), offset(3)

    overhang_of = max(0.0_rp, min(dot_product(out(:, 1), offset), dot_product(out(:, 2), offset)))
  end function overhang_of

  !> Distance from the point `at` of a facet to the nearest ridge of its patch, over its sharpness,
  !> at most `bound` [m].
  pure real(rp) function edge_distance(self, facet, at, bound)
    class(ridges_t), intent(in) :: self
    integer, intent(in) :: facet
    real(rp), intent(in) :: at(3), bound
    type(descent_t) :: descent
    real(rp) :: length
    integer :: first, i, last, patch

    edge_distance = bound
    if (self%n == 0) return
    patch = self%patch(facet)
    call descent%begin()
    do
      call descent%next_leaf(self%tree, at, edge_distance**2, first, last)
      if (last < first) exit
      do i = first, last
        if (all(self%beside(:, i) /= patch)) cycle
        associate (from => self%segment(:, 1, i), offset => self%segment(:, 2, i))
          length = max(0.0_rp, min(1.0_rp, dot_product(at - from, offset)/dot_product(offset, &
                                                                                      offset)))
          edge_distance = min(edge_distance, norm2(at - from - length*offset)/self%sharpness(i))
        end associate
      end do
    end do
  end function edge_distance

end module tools_mesh_ridges
