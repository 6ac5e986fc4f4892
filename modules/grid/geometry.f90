! SPDX-License-Identifier: MIT
!> Background grid: cells with an edge for each axis, nodes numbered from 0, and a rank's patch of
!> it.
!>
!> A node owns the cell centred on it. A rank owns a box of nodes; its particles are those whose
!> nearest node lies in the box. The patch adds `halo` layers around it: a stencil reaches one node
!> further, and a particle may be up to one cell outside its box until the next migration.
!>
!> Along a periodic axis of n cells there are n nodes; node i + k n is an image of node i. Only the
!> nodes 0 to n-1 are owned, but a patch may store several images of one node.
!>
!> Along a graded axis cells are spans of different widths (grid_grading), and `h` is the smallest.
module grid_geometry
  use base_kinds, only: rp
  use base_text, only: str
  use grid_box, only: box_t
  use grid_grading, only: grading_t
  implicit none (type, external)
  private

  public :: grid_t, patch_t, grade, make_grid, make_patch, nearest_node, nearest_nodes, &
    storage_nodes, wrap, box_t, length_along, mean_edge, section_across

  integer, parameter, public :: halo = 2

  !> The whole grid.
  type :: grid_t
    real(rp) :: h(3) = 1.0_rp       !! edges of a cell [m]
    real(rp) :: lower(3) = 0.0_rp   !! position of node (0,0,0) [m]
    integer :: n(3) = 0             !! nodes along each axis
    integer :: period(3) = 0        !! nodes to the next image; 0: not periodic
    type(grading_t) :: grading(3)   !! grading of each axis
  contains
    procedure :: cells, edges_at => grid_edges_at, is_graded => grid_is_graded, longest
    procedure :: longest_edges, nearest_image, edges, is_cubic, upper
  end type grid_t

  !> A rank's part: owned box, box with halo, and storage of node (i,j,k) (k fastest).
  type :: patch_t
    type(box_t) :: own, all
    integer :: stride(3) = [1, 1, 1]
    integer :: nn = 0               !! number of stored nodes with halo
    real(rp) :: origin(3) = 0.0_rp  !! position of the first stored node [m]
    real(rp) :: h(3) = 1.0_rp       !! edges of a cell [m]
    integer :: period(3) = 0        !! nodes to the next image; 0: not periodic
    type(grading_t) :: grading(3)   !! grading of each axis
  contains
    procedure :: edges_at => patch_edges_at, is_graded => patch_is_graded, indices, linear_place
    procedure :: node, position, share_of
  end type patch_t

  !> Make a grid of cubes, or of cells with three different edges.
  interface make_grid
    module procedure make_grid_of_cubes
    module procedure make_grid_of_cells
  end interface make_grid

contains

  !> Length of a cell with the edges `h` along a direction [m]: that of the ellipsoid with these
  !> axes, which for cubes is their edge.
  pure real(rp) function length_along(h, direction) result(length)
    real(rp), intent(in) :: h(3)            !! cell edges [m]
    real(rp), intent(in) :: direction(3)    !! unit vector

    length = h(1)
    if (any(abs(h - h(1)) > 0.0_rp)) length = norm2(h*direction)
  end function length_along

  !> Edge of the cube with the volume of a cell with the edges `h` [m].
  pure real(rp) function mean_edge(h)
    real(rp), intent(in) :: h(3)            !! cell edges [m]

    mean_edge = h(1)
    if (any(abs(h - h(1)) > 0.0_rp)) mean_edge = product(h)**(1.0_rp/3.0_rp)
  end function mean_edge

  !> Cross-section of a cell normal to a direction [m2]: its volume over its length in that
  !> direction.
  pure real(rp) function section_across(h, direction) result(section)
    real(rp), intent(in) :: h(3)            !! cell edges [m]
    real(rp), intent(in) :: direction(3)    !! unit vector

    section = h(1)**2
    if (any(abs(h - h(1)) > 0.0_rp)) section = product(h)/norm2(h*direction)
  end function section_across

  !> Grid of cells with the edges `h` that covers the box from `lower` to `upper`; along periodic
  !> axes the box must be whole cells.
  pure type(grid_t) function make_grid_of_cells(h, lower, upper, is_periodic) result(grid)
    real(rp), intent(in) :: h(3), lower(3), upper(3)   !! cell edges, lower corner, upper corner [m]
    logical, intent(in), optional :: is_periodic(3)

    grid%h = h
    grid%lower = lower
    grid%n = ceiling((upper - lower)/h - 1.0e-9_rp) + 1
    if (.not. present(is_periodic)) return
    where (is_periodic)
      grid%n = nint((upper - lower)/h)
      grid%period = grid%n
    end where
  end function make_grid_of_cells

  !> Grid of cubes of edge `h` that covers the box from `lower` to `upper`.
  pure type(grid_t) function make_grid_of_cubes(h, lower, upper, is_periodic) result(grid)
    real(rp), intent(in) :: h, lower(3), upper(3)   !! cell edges, lower corner, upper corner [m]
    logical, intent(in), optional :: is_periodic(3)

    grid = make_grid_of_cells([h, h, h], lower, upper, is_periodic)
  end function make_grid_of_cubes

  !> Edges of the cell at `x` [m].
  pure function grid_edges_at(self, x) result(h)
    class(grid_t), intent(in) :: self
    real(rp), intent(in) :: x(3)    !! position [m]
    real(rp) :: h(3)

    h = cell_edges(self%grading, self%h, x)
  end function grid_edges_at

  !> Edges of the cell at `x`, which are `h` on uniform axes [m].
  pure function cell_edges(grading, h, x) result(edges)
    type(grading_t), intent(in) :: grading(3)
    real(rp), intent(in) :: h(3), x(3)      !! smallest edges, position [m]
    real(rp) :: edges(3)
    integer :: a

    edges = h
    do a = 1, 3
      if (grading(a)%is_graded) edges(a) = grading(a)%span(5, grading(a)%span_of(x(a)))
    end do
  end function cell_edges

  !> True if any axis is graded.
  pure logical function grid_is_graded(self)
    class(grid_t), intent(in) :: self

    grid_is_graded = any(self%grading%is_graded)
  end function grid_is_graded

  !> Longest edge of any cell [m].
  pure real(rp) function longest(self)
    class(grid_t), intent(in) :: self

    longest = maxval(self%longest_edges())
  end function longest

  !> Longest edges of the cells along the axes [m].
  pure function longest_edges(self) result(h)
    class(grid_t), intent(in) :: self
    real(rp) :: h(3)
    integer :: a

    h = self%h
    do a = 1, 3
      if (self%grading(a)%is_graded) h(a) = self%grading(a)%longest()
    end do
  end function longest_edges

  !> Replace the non-periodic axis `a` by the spans of `grading`, with `n` nodes.
  pure subroutine grade(grid, a, grading, n)
    type(grid_t), intent(inout) :: grid
    type(grading_t), intent(in) :: grading
    integer, intent(in) :: a, n

    grid%grading(a) = grading
    grid%n(a) = n
    grid%h(a) = minval(grading%span(5, :))
  end subroutine grade

  !> Difference of positions to the nearest image: less whole periods of the grid [m].
  pure function nearest_image(self, d) result(r)
    class(grid_t), intent(in) :: self
    real(rp), intent(in) :: d(3)            !! difference of two positions [m]
    real(rp) :: r(3), length(3)

    length = self%h*self%period
    r = d
    where (length > 0.0_rp) r = d - length*anint(d/max(length, tiny(1.0_rp)))
  end function nearest_image

  !> Cells along each axis.
  pure function cells(self)
    class(grid_t), intent(in) :: self
    integer :: cells(3)

    cells = merge(self%n, self%n - 1, self%period > 0)
  end function cells

  !> True if the edges of the cells are equal.
  pure logical function is_cubic(self)
    class(grid_t), intent(in) :: self

    is_cubic = all(abs(self%h - self%h(1)) <= 0.0_rp)
  end function is_cubic

  !> Text of the edges of a cell in mm: one edge for cubes, otherwise three.
  pure function edges(self) result(text)
    class(grid_t), intent(in) :: self
    character(:), allocatable :: text
    integer :: a

    text = str(1.0e3_rp*self%h(1))
    if (.not. self%is_cubic()) text = text//' x '//str(1.0e3_rp*self%h(2))//' x ' &
        //str(1.0e3_rp*self%h(3))
    do a = 1, 3
      if (self%grading(a)%is_graded) text = text//' to '//str(1.0e3_rp*self%grading(a)%longest()) &
        //' along '//'xyz'(a:a)
    end do
  end function edges

  !> Upper corner of the box [m].
  pure function upper(self)
    class(grid_t), intent(in) :: self
    real(rp) :: upper(3)
    integer :: a

    upper = self%lower + self%h*real(self%cells(), rp)
    do a = 1, 3
      if (self%grading(a)%is_graded) upper(a) = self%grading(a)%middle(self%n(a) - 1)
    end do
  end function upper

  !> Make the patch of the owned box `own`. Nodes more than one layer above `reach`, the box of all
  !> nodes that particles can reach, are not stored; each node within reach then has its neighbours.
  !> The first node does not depend on `reach`, since weights are measured from there.
  pure type(patch_t) function make_patch(grid, own, reach)
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: own
    type(box_t), intent(in), optional :: reach
    integer :: n(3)

    make_patch%own = own
    make_patch%all = own%grown(halo)
    if (present(reach)) then
      associate (all => make_patch%all)
        where (grid%period == 0) all%hi = min(all%hi, max(reach%hi + 1, all%lo))
      end associate
    end if
    make_patch%h = grid%h
    make_patch%period = grid%period
    n = 0
    if (.not. own%is_empty()) n = make_patch%all%hi - make_patch%all%lo + 1
    make_patch%stride = [n(2)*n(3), n(3), 1]
    make_patch%nn = product(n)
    make_patch%origin = grid%lower + grid%h*real(make_patch%all%lo, rp)
    make_patch%grading = grid%grading
  end function make_patch

  !> Storage index (from 1) of node `ijk`.
  pure integer function node(self, ijk)
    class(patch_t), intent(in) :: self
    integer, intent(in) :: ijk(3)

    node = 1 + sum((ijk - self%all%lo)*self%stride)
  end function node

  !> Position of the node with storage index `q` [m].
  pure function position(self, q) result(x)
    class(patch_t), intent(in) :: self
    integer, intent(in) :: q
    real(rp) :: x(3)
    integer :: a, ijk(3)

    ijk = indices(self, q)
    x = self%origin + self%h*real(ijk - self%all%lo, rp)
    do a = 1, 3
      if (self%grading(a)%is_graded) x(a) = self%grading(a)%middle(ijk(a))
    end do
  end function position

  !> Centre `x` and edges `h` of the part of the room that belongs to the node with storage index
  !> `q`: first moment and integral of its shape function along each axis [m].
  pure subroutine share_of(self, q, x, h)
    class(patch_t), intent(in) :: self
    integer, intent(in) :: q
    real(rp), intent(out) :: x(3), h(3)
    integer :: a, ijk(3)

    x = self%position(q)
    h = self%h
    ijk = self%indices(q)
    do a = 1, 3
      if (.not. self%grading(a)%is_graded) cycle
      x(a) = self%grading(a)%centre(ijk(a))
      h(a) = self%grading(a)%share(ijk(a))
    end do
  end subroutine share_of

  !> Indices of the node with storage index `q`.
  pure function indices(self, q) result(ijk)
    class(patch_t), intent(in) :: self
    integer, intent(in) :: q
    integer :: ijk(3)

    ijk(1) = (q - 1)/self%stride(1)
    ijk(2) = (q - 1 - ijk(1)*self%stride(1))/self%stride(2)
    ijk(3) = q - 1 - ijk(1)*self%stride(1) - ijk(2)*self%stride(2)
    ijk = ijk + self%all%lo
  end function indices

  !> Edges of the cell at `x` [m].
  pure function patch_edges_at(self, x) result(h)
    class(patch_t), intent(in) :: self
    real(rp), intent(in) :: x(3)    !! position [m]
    real(rp) :: h(3)

    h = cell_edges(self%grading, self%h, x)
  end function patch_edges_at

  !> True if any axis is graded.
  pure logical function patch_is_graded(self)
    class(patch_t), intent(in) :: self

    patch_is_graded = any(self%grading%is_graded)
  end function patch_is_graded

  !> Position of `x` from the first stored node in cells, linear between nodes.
  pure function linear_place(self, x) result(s)
    class(patch_t), intent(in) :: self
    real(rp), intent(in) :: x(3)    !! position [m]
    real(rp) :: s(3)
    integer :: a

    s = (x - self%origin)/self%h
    do a = 1, 3
      if (self%grading(a)%is_graded) s(a) = self%grading(a)%linear_place(x(a)) - self%all%lo(a)
    end do
  end function linear_place

  !> Grid node nearest to `x`, by the same rounding as the kernels use.
  pure function nearest_node(grid, x) result(ijk)
    type(grid_t), intent(in) :: grid
    real(rp), intent(in) :: x(3)
    integer :: a, ijk(3)

    ijk = floor((x - grid%lower)/grid%h + 0.5_rp)
    do a = 1, 3
      if (grid%grading(a)%is_graded) ijk(a) = grid%grading(a)%span_of(x(a))
    end do
  end function nearest_node

  !> Nodes nearest to `n` positions, in a vectorised loop.
  pure subroutine nearest_nodes(grid, n, x, ijk)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3)
    integer, intent(out) :: ijk(n, 3)
    integer :: a, p

    do a = 1, 3
      if (grid%grading(a)%is_graded) then
        ijk(:, a) = [(grid%grading(a)%span_of(x(p, a)), p=1, n)]
        cycle
      end if
      ijk(:, a) = floor((x(:, a) - grid%lower(a))/grid%h(a) + 0.5_rp)
    end do
  end subroutine nearest_nodes

  !> Storage indices of the nodes nearest to `n` positions near the patch, and whether this rank
  !> owns them.
  pure subroutine storage_nodes(grid, patch, n, x, node, is_own)
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3)
    integer, intent(out) :: node(n)
    logical, intent(out) :: is_own(n)
    integer :: a, ijk(n, 3)

    call nearest_nodes(grid, n, x, ijk)
    node = 1
    is_own = .true.
    do a = 1, 3
      node = node + (ijk(:, a) - patch%all%lo(a))*patch%stride(a)
      is_own = is_own .and. ijk(:, a) >= patch%own%lo(a) .and. ijk(:, a) <= patch%own%hi(a)
    end do
  end subroutine storage_nodes

  !> Move `x` by whole periods so that its nearest node is one of 0 to n-1. A result that rounding
  !> leaves beyond the edge is set 1e-9 cells inside.
  pure subroutine wrap(grid, x)
    type(grid_t), intent(in) :: grid
    real(rp), intent(inout) :: x(3)         !! position [m]
    real(rp), parameter :: inside = 0.5_rp - 1.0e-9_rp
    integer :: a, ijk(3)

    ijk = nearest_node(grid, x)
    if (all(grid%period == 0 .or. (ijk >= 0 .and. ijk < grid%n))) return
    do a = 1, 3
      if (grid%period(a) == 0) cycle
      x(a) = x(a) - grid%h(a)*real(ijk(a) - modulo(ijk(a), grid%period(a)), rp)
    end do
    ijk = nearest_node(grid, x)
    where (grid%period > 0 .and. ijk < 0) x = grid%lower - grid%h*inside
    where (grid%period > 0 .and. ijk >= grid%n) x = grid%upper() - grid%h*(1.0_rp - inside)
  end subroutine wrap

end module grid_geometry
