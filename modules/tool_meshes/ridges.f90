! SPDX-License-Identifier: MIT
!> Edges of a mesh that stand out, as the rim of a punch does, and how far it is to them. A surface
!> that turns by less than `feature_angle` at an edge is smooth there: the facets of a cylinder have
!> no rims between them.
module tool_meshes_ridges
  use base_kinds, only: pi, rp
  use tool_meshes_boxes, only: boxes_t, build_boxes, descent_t
  use tool_meshes_facets, only: cross, facets_t
  implicit none (type, external)
  private

  public :: find_ridges, ridges_t

  real(rp), parameter, public :: no_edge = 1.0e100_rp   !! room where there is none: far, and may be
                                                        !! divided by the edge of a cell [m]

  real(rp), parameter :: feature_angle = 30.0_rp*pi/180.0_rp   !! as meshes of surfaces take it: a
                                                               !! cylinder of 12 facets is smooth

  type :: ridges_t
    integer :: n = 0
    type(boxes_t) :: tree
    integer, allocatable :: patch(:)          !! of each facet, which edges that show divide
    integer, allocatable :: of_edge(:, :)     !! (3, facets) number, 0: none stands out there
    integer, allocatable :: begin(:), of_point(:)   !! of point p from begin(p) to begin(p + 1) - 1
    integer, allocatable :: beside(:, :)      !! (2, n) patches
    real(rp), allocatable :: place(:, :, :)   !! (3, 2, n) begin, and way to the end [m]
    real(rp), allocatable :: out(:, :, :)     !! (3, 2, n) in either facet, out of it
    real(rp), allocatable :: sharpness(:)     !! 1 - cos of the angle, at most 1
  contains
    procedure :: beyond
    procedure :: room
  end type ridges_t

contains

  !> The ridges of facets with these normals (3, facets).
  subroutine find_ridges(facets, normal, ridges)
    type(facets_t), intent(in) :: facets
    real(rp), intent(in) :: normal(:, :)
    type(ridges_t), intent(out) :: ridges
    integer, allocatable :: edge(:), order(:)
    real(rp) :: along(3), c
    integer :: i, k, n, other

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
          call join(ridges%patch, i, other)
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
    allocate (ridges%beside(2, n), ridges%place(3, 2, n), ridges%out(3, 2, n), ridges%sharpness(n))
    allocate (order(n))
    do i = 1, n
      call set_ridge(facets, normal, edge(i), ridges, i)
    end do
    if (n > 0) call build_boxes(min(ridges%place(:, 1, :), sum(ridges%place, 2)), &
                                max(ridges%place(:, 1, :), sum(ridges%place, 2)), &
                                ridges%tree, order)
    do i = 1, n
      call set_ridge(facets, normal, edge(order(i)), ridges, i)
    end do
    call list_at_points(facets, edge(order), ridges)
  end subroutine find_ridges

  !> Put an edge in place `i`.
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
      ridges%place(:, 1, i) = from
    end associate
    ridges%place(:, 2, i) = along
    ridges%beside(:, i) = ridges%patch([facet, other])
    ridges%sharpness(i) = min(1.0_rp, 1.0_rp - dot_product(normal(:, facet), normal(:, other)))
    along = along/norm2(along)
    ridges%out(:, 1, i) = cross(along, normal(:, facet))
    ridges%out(:, 2, i) = -cross(along, normal(:, other))
  end subroutine set_ridge

  !> The ridges that end in each point; `edge` of the facets is the i-th.
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

  !> Let two facets be of one patch.
  pure subroutine join(patch, a, b)
    integer, intent(inout) :: patch(:)
    integer, intent(in) :: a, b
    integer :: root

    root = min(root_of(patch, a), root_of(patch, b))
    call lead_to(patch, a, root)
    call lead_to(patch, b, root)
  end subroutine join

  !> Let all on the way from `i` to its root name another root.
  pure subroutine lead_to(patch, i, root)
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
  end subroutine lead_to

  pure integer function root_of(patch, i) result(root)
    integer, intent(in) :: patch(:), i

    root = i
    do while (patch(root) /= root)
      root = patch(root)
    end do
  end function root_of

  !> How far a place is beyond the end of the facet that it is less far from being beside: one whose
  !> nearest point is on an edge or a corner, the `way` from there [m]. `no_edge` if nothing stands
  !> out.
  pure real(rp) function beyond(self, region, facet, corner, way)
    class(ridges_t), intent(in) :: self
    integer, intent(in) :: region          !! 1 to 3: edge of the facet, more: corner
    integer, intent(in) :: facet, corner
    real(rp), intent(in) :: way(3)
    integer :: i

    beyond = -no_edge
    if (region <= 3) then
      if (self%of_edge(region, facet) > 0) beyond = past(self%out(:, :, &
                                                         self%of_edge(region, facet)), way)
    else
      do i = self%begin(corner), self%begin(corner + 1) - 1
        beyond = max(beyond, past(self%out(:, :, self%of_point(i)), way))
      end do
    end if
    if (beyond <= -no_edge) beyond = no_edge
  end function beyond

  pure real(rp) function past(out, way)
    real(rp), intent(in) :: out(3, 2), way(3)

    past = max(0.0_rp, min(dot_product(out(:, 1), way), dot_product(out(:, 2), way)))
  end function past

  !> Room from the place `at` of a facet to the nearest ridge of its patch, that of sharpness 1.
  pure real(rp) function room(self, facet, at)
    class(ridges_t), intent(in) :: self
    integer, intent(in) :: facet
    real(rp), intent(in) :: at(3)
    type(descent_t) :: descent
    real(rp) :: length
    integer :: first, i, last, patch

    room = no_edge
    if (self%n == 0) return
    patch = self%patch(facet)
    call descent%begin()
    do
      call descent%next_leaf(self%tree, at, room**2, first, last)
      if (last < first) exit
      do i = first, last
        if (all(self%beside(:, i) /= patch)) cycle
        associate (from => self%place(:, 1, i), way => self%place(:, 2, i))
          length = max(0.0_rp, min(1.0_rp, dot_product(at - from, way)/dot_product(way, way)))
          room = min(room, norm2(at - from - length*way)/self%sharpness(i))
        end associate
      end do
    end do
  end function room

end module tool_meshes_ridges
