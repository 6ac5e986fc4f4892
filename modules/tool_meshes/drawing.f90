! SPDX-License-Identifier: MIT
!> What others see of a surface of facets: points on it, and triangles for pictures.
module tool_meshes_drawing
  use base_kinds, only: rp
  use base_sort, only: order_of
  use tool_meshes_facets, only: facets_t
  implicit none (type, external)
  private

  public :: outline_of, surface_of

contains

  !> Points spread over a surface, some `parts` along its longest side: corners of facets, and
  !> lattices on large ones; of many, one in so many and the outermost along the axes.
  subroutine outline_of(facets, x)
    type(facets_t), intent(in) :: facets
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, parameter :: parts = 24, enough = 2000
    real(rp) :: a(3), b(3), c(3), spacing
    integer :: i, j, k, m, n, p, round

    spacing = maxval(maxval(facets%x, 2) - minval(facets%x, 2))/parts
    do round = 1, 2                             ! count, then list
      p = size(facets%x, 2)
      if (round == 2) x(:, :p) = facets%x
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
            if (round == 2) x(:, p) = a + real(j, rp)/n*b + real(k, rp)/n*c
          end do
        end do
      end do
      if (round == 1) allocate (x(3, p))
    end do
    if (p <= enough) return
    x = x(:, [[(i, i=1, p, p/enough + 1)], minloc(x, 2), maxloc(x, 2)])
  end subroutine outline_of

  !> Facets for pictures; points on edges that show are there once a side.
  subroutine surface_of(facets, patch, x, corner)
    type(facets_t), intent(in) :: facets
    integer, intent(in) :: patch(:)                  !! of each facet, which edges that show divide
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
  end subroutine surface_of

end module tool_meshes_drawing
