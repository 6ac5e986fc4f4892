! SPDX-License-Identifier: MIT
!> Points on a surface of facets, and triangles for visualization.
module tools_mesh_drawing
  use base_kinds, only: rp
  use base_sort, only: order_of
  use tools_mesh_facets, only: facets_t
  implicit none (type, external)
  private

  public :: list_outline_points, triangulate_surface

contains

  !> Points spread over a surface, about `parts` along its longest side: corners of facets, and
  !> lattices on large facets; if too many, a subset that includes the extremes along the axes.
  subroutine list_outline_points(facets, x)
    type(facets_t), intent(in) :: facets
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, parameter :: parts = 24, max_points = 2000
    real(rp) :: a(3), b(3), c(3), spacing
    integer :: i, j, k, m, n, p, pass

    spacing = maxval(maxval(facets%x, 2) - minval(facets%x, 2))/parts
    do pass = 1, 2                              ! count, then list
      p = size(facets%x, 2)
      if (pass == 2) x(:, :p) = facets%x
      do i = 1, size(facets%corner, 2)
        a = facets%x(:, facets%corner(1, i))
        b = facets%x(:, facets%corner(2, i)) - a
        c = facets%x(:, facets%corner(3, i)) - a
        n = ceiling(max(norm2(b), norm2(c), norm2(b - c))/spacing)
        do j = 0, n
          do k = 0, n - j
            m = n - j - k
            if (max(j, k, m) == n) cycle       ! a corner
            p = p + 1
            if (pass == 2) x(:, p) = a + real(j, rp)/n*b + real(k, rp)/n*c
          end do
        end do
      end do
      if (pass == 1) allocate (x(3, p))
    end do
    if (p <= max_points) return
    x = x(:, [[(i, i=1, p, p/max_points + 1)], minloc(x, 2), maxloc(x, 2)])
  end subroutine list_outline_points

  !> Triangles for visualization; points on sharp edges are duplicated for each side.
  subroutine triangulate_surface(facets, patch, x, corner)
    type(facets_t), intent(in) :: facets
    integer, intent(in) :: patch(:)                  !! patch of each facet, bounded by sharp edges
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, allocatable, intent(out) :: corner(:, :)
    real(rp), allocatable :: key(:, :)
    integer, allocatable :: order(:)
    integer :: i, n

    allocate (key(2, size(facets%corner)), order(size(facets%corner)))
    key(1, :) = real([facets%corner], rp)
    key(2, :) = real([spread(patch, 1, 3)], rp)
    order = order_of(key)
    allocate (corner(3, size(order)/3), x(3, size(order)))
    n = 0
    do i = 1, size(order)
      if (i == 1) then
        n = 1
      else if (any(abs(key(:, order(i)) - key(:, order(i - 1))) > 0.0_rp)) then
        n = n + 1
      end if
      x(:, n) = facets%x(:, nint(key(1, order(i))))
      corner(modulo(order(i) - 1, 3) + 1, (order(i) + 2)/3) = n
    end do
    x = x(:, :n)
  end subroutine triangulate_surface

end module tools_mesh_drawing
