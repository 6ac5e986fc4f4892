! SPDX-License-Identifier: MIT
!> Recursive bisection of the grid's nodes into one box a rank, by weight
!> (Berger & Bokhari 1987, IEEE Trans. Comput. C-36:570).
module grid_partition
  use base_kinds, only: rp
  use base_world, only: world_t
  use grid_geometry, only: box_t, grid_t
  implicit none (type, external)
  private

  public :: bisect, owner_of, imbalance

  !> Weight of the relative length of the cut axis against the imbalance: exchange costs a few
  !> percent of a step, and half the length means twice the shared nodes.
  real(rp), parameter :: length_weight = 0.05_rp

contains

  !> Cut the grid into `boxes(0:size-1)`. `weight(n)` is this rank's load at `nodes(:,n)`. All ranks
  !> get the same boxes; with more ranks than the load can be divided into, some boxes are empty or
  !> without load.
  subroutine bisect(world, grid, nodes, weight, boxes)
    type(world_t), intent(in) :: world
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: nodes(:, :)       !! (3, n) nodes with load on this rank
    real(rp), intent(in) :: weight(:)        !! load at each node
    type(box_t), intent(out) :: boxes(0:world%size - 1)
    type(box_t) :: whole
    integer :: i

    whole%lo = 0
    whole%hi = grid%n - 1
    call cut(world, nodes, weight, pack([(i, i=1, size(weight))], &
                                        [(whole%has(nodes(:, i)), i=1, size(weight))]), &
             whole, 0, world%size - 1, boxes)
  end subroutine bisect

  !> Divide `box` among ranks `first..last`: cut across its loaded length in proportion to the
  !> number of ranks.
  recursive subroutine cut(world, nodes, weight, inside, box, first, last, boxes)
    type(world_t), intent(in) :: world
    integer, intent(in) :: nodes(:, :)
    real(rp), intent(in) :: weight(:)
    integer, intent(in) :: inside(:)         !! indices of this rank's loads in the box
    type(box_t), intent(in) :: box
    integer, intent(in) :: first, last
    type(box_t), intent(inout) :: boxes(0:)
    type(box_t) :: lower_half, upper_half
    integer :: axis, place, middle

    if (first == last) then
      boxes(first) = box
      return
    end if
    middle = (first + last)/2
    call find_best_cut(world, nodes, weight, inside, box, &
                       real(middle - first + 1, rp)/real(last - first + 1, rp), axis, place)
    lower_half = box
    upper_half = box
    lower_half%hi(axis) = place
    upper_half%lo(axis) = place + 1
    call cut(world, nodes, weight, pack(inside, nodes(axis, inside) <= place), &
             lower_half, first, middle, boxes)
    call cut(world, nodes, weight, pack(inside, nodes(axis, inside) > place), &
             upper_half, middle + 1, last, boxes)
  end subroutine cut

  !> Axis and last node of the lower part of the best cut: across the longest loaded axis, since
  !> that shares the fewest nodes, unless a shorter one can be divided that much more evenly.
  subroutine find_best_cut(world, nodes, weight, inside, box, share, axis, place)
    type(world_t), intent(in) :: world
    integer, intent(in) :: nodes(:, :)
    real(rp), intent(in) :: weight(:)
    integer, intent(in) :: inside(:)
    type(box_t), intent(in) :: box
    real(rp), intent(in) :: share            !! desired load fraction of the lower part
    integer, intent(out) :: axis, place
    real(rp), allocatable :: profile(:)
    integer :: start(4), a, i, lower(3), n(3), span(3)
    real(rp) :: excess(3)

    n = max(0, box%hi - box%lo + 1)
    start = [0, n(1), n(1) + n(2), sum(n)]
    allocate (profile(max(1, sum(n))), source=0.0_rp)
    do i = 1, size(inside)
      do a = 1, 3
        associate (at => profile(start(a) + nodes(a, inside(i)) - box%lo(a) + 1))
          at = at + weight(inside(i))
        end associate
      end do
    end do
    call world%sum(profile)
    do a = 1, 3
      span(a) = loaded_span(profile(start(a) + 1:start(a + 1)))
      call divide(profile(start(a) + 1:start(a + 1)), share, lower(a), excess(a))
    end do
    if (maxval(span) == 0) then
      axis = maxloc(n, 1)
    else
      axis = minloc(excess - length_weight*real(span, rp)/maxval(span), 1)
    end if
    place = box%lo(axis) + lower(axis) - 1
  end subroutine find_best_cut

  !> Number of node planes of the lower part with the load fraction nearest to `share`, and the
  !> larger relative excess load of both parts.
  pure subroutine divide(profile, share, lower, excess)
    real(rp), intent(in) :: profile(:)       !! load of each plane of nodes
    real(rp), intent(in) :: share
    integer, intent(out) :: lower
    real(rp), intent(out) :: excess
    real(rp) :: below, total
    integer :: i

    total = sum(profile)
    below = 0.0_rp
    lower = nint(share*size(profile))
    excess = 0.0_rp
    if (total <= 0.0_rp) return
    do i = 1, size(profile)
      if (below + 0.5_rp*profile(i) > share*total) exit
      below = below + profile(i)
    end do
    lower = min(i, size(profile)) - 1
    below = sum(profile(:lower))
    excess = max(below/share, (total - below)/(1.0_rp - share))/total - 1.0_rp
  end subroutine divide

  !> Number of entries from the first to the last loaded one.
  pure integer function loaded_span(profile)
    real(rp), intent(in) :: profile(:)
    integer :: a, b

    loaded_span = 0
    do a = 1, size(profile)
      if (profile(a) > 0.0_rp) exit
    end do
    if (a > size(profile)) return
    do b = size(profile), a, -1
      if (profile(b) > 0.0_rp) exit
    end do
    loaded_span = b - a + 1
  end function loaded_span

  !> Rank that owns node `ijk`, or -1 outside the grid.
  pure integer function owner_of(boxes, ijk)
    type(box_t), intent(in) :: boxes(0:)
    integer, intent(in) :: ijk(3)
    integer :: r

    owner_of = -1
    do r = 0, size(boxes) - 1
      if (boxes(r)%has(ijk)) then
        owner_of = r
        return
      end if
    end do
  end function owner_of

  !> Largest load of a rank over the mean.
  pure real(rp) function imbalance(load)
    real(rp), intent(in) :: load(:)          !! load of every rank

    imbalance = maxval(load)*size(load)/max(sum(load), tiny(1.0_rp))
  end function imbalance

end module grid_partition
