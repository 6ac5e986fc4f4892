! SPDX-License-Identifier: MIT
!> Detection of intersecting facets. Unless two facets are coplanar, an edge of one passes through
!> the interior of the other.
module tools_mesh_crossings
  use base_kinds, only: rp
  use tools_mesh_boxes, only: boxes_t, build_boxes, descent_t
  use tools_mesh_facets, only: cross, facets_t
  implicit none (type, external)
  private

  public :: find_crossings

  !> Ten times the rounding of corners in single precision over the size of the surface.
  real(rp), parameter :: rounding = 1.0e-6_rp

contains

  !> For each facet, a facet that one of its edges passes through; 0 if none. Edges must be matched.
  subroutine find_crossings(facets, crossed)
    type(facets_t), intent(in) :: facets
    integer, allocatable, intent(out) :: crossed(:)
    type(boxes_t) :: tree
    type(descent_t) :: descent
    real(rp) :: min_distance
    integer, allocatable :: order(:)
    integer :: first, i, j, k, last, other, p, q

    allocate (crossed(size(facets%corner, 2)), source=0)
    if (size(crossed) == 0) return
    associate (x => facets%x, c => facets%corner)
      call build_boxes(min(x(:, c(1, :)), x(:, c(2, :)), x(:, c(3, :))), &
                       max(x(:, c(1, :)), x(:, c(2, :)), x(:, c(3, :))), tree, order)
      min_distance = rounding*maxval(tree%box(1)%upper - tree%box(1)%lower)
      do i = 1, size(crossed)
        do k = 1, 3
          if (facets%across(k, i) < 3*(i - 1) + k) cycle    ! tested with the other facet
          p = c(k, i)
          q = c(modulo(k, 3) + 1, i)
          call descent%begin()
          do
            call descent%next_overlap(tree, min(x(:, p), x(:, q)), max(x(:, p), x(:, q)), first, &
                                      last)
            if (last < first) exit
            do j = first, last
              other = order(j)
              if (any(c(:, other) == p .or. c(:, other) == q)) cycle
              if (passes(x(:, p), x(:, q), x(:, c(:, other)), min_distance)) crossed(i) = other
            end do
          end do
        end do
      end do
    end associate
  end subroutine find_crossings

  !> True if the segment from `p` to `q` passes through a triangle or an edge of it, with both ends
  !> farther than `min_distance` from its plane.
  pure logical function passes(p, q, corner, min_distance)
    real(rp), intent(in) :: p(3), q(3), corner(3, 3), min_distance
    real(rp) :: along(3), normal(3), from, side(3), to, direction(3)
    integer :: k

    normal = cross(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
    from = dot_product(normal, p - corner(:, 1))
    to = dot_product(normal, q - corner(:, 1))
    passes = from*to < 0.0_rp .and. min(abs(from), abs(to)) > min_distance*norm2(normal)
    if (.not. passes) return
    direction = sign(1.0_rp, to)*(q - p)
    do k = 1, 3
      along = corner(:, modulo(k, 3) + 1) - corner(:, k)
      side(k) = dot_product(direction, cross(along, p - corner(:, k))) &
                /(norm2(along)*norm2(direction))
    end do
    passes = all(side > -min_distance)
  end function passes

end module tools_mesh_crossings
