! SPDX-License-Identifier: MIT
!> Triangles that close a body, seen from outside counterclockwise: their common corners, what lies
!> across each of their edges, and what is wrong with them.
module tool_meshes_facets
  use base_kinds, only: rp
  use base_sort, only: order_of
  implicit none (type, external)
  private

  public :: cross, facets_t, flaw_t, join_corners, list_flaws, match_edges

  ! What is wrong with an edge.
  integer, parameter, public :: is_open = 1, is_turned = 2, is_crowded = 3

  type :: facets_t
    real(rp), allocatable :: x(:, :)          !! (3, points) [m]
    integer, allocatable :: corner(:, :)      !! (3, facets)
    integer, allocatable :: across(:, :)      !! (3, facets) 3 (facet - 1) + edge that has the same
                                              !! ends as the edge from a corner to the next; 0: none
  end type facets_t

  !> An edge of a facet that does not close.
  type :: flaw_t
    integer :: facet = 0, kind = 0
    real(rp) :: from(3) = 0.0_rp, to(3) = 0.0_rp
  end type flaw_t

contains

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Facets that have their own corners, y(3, 3 facets): corners in one place become one. Facets of
  !> which two corners are one are left out; `kept` are the others.
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

  !> Find what lies across each edge.
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

  !> Edges with nothing across them, one for each pair of ends: those of one facet, those of two
  !> that face opposite sides, those of more than two.
  subroutine list_flaws(facets, flaw)
    type(facets_t), intent(in) :: facets
    type(flaw_t), allocatable, intent(out) :: flaw(:)
    real(rp), allocatable :: key(:, :)
    integer, allocatable :: edge(:), order(:)
    integer :: first, i, n, n_flaws

    edge = pack([(i, i=1, size(facets%across))], [facets%across] == 0)
    n = size(edge)
    allocate (key(2, n), order(n), flaw(n))
    n_flaws = 0
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
        n_flaws = n_flaws + 1
        flaw(n_flaws) = flaw_t((e + 2)/3, min(i - first + 1, is_crowded), &
                               facets%x(:, minval(ends_of(facets, e))), &
                               facets%x(:, maxval(ends_of(facets, e))))
      end associate
      first = i + 1
    end do
    flaw = flaw(:n_flaws)
  end subroutine list_flaws

end module tool_meshes_facets
