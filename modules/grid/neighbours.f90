! SPDX-License-Identifier: MIT
!> Nodes that a patch shares with another rank, and periodic images among its nodes.
module grid_neighbours
  use base_kinds, only: rp
  use grid_geometry, only: box_t, patch_t
  implicit none (type, external)
  private

  public :: common_lines, dilate, line_t, list_images, list_nodes, neighbour_t

  !> Data exchanged with one other rank.
  type :: neighbour_t
    integer :: rank = -1
    integer :: count = 0                                 !! number of shared nodes in use
    integer, allocatable :: node(:)                      !! storage indices of the shared nodes
    real(rp), allocatable :: send(:), receive(:)         !! (width*count)
  end type neighbour_t

  !> Nodes along one axis.
  type :: line_t
    integer, allocatable :: i(:)
  end type line_t

contains

  !> First images in `patch`, along each axis, of the nodes that `other` stores as well. The order
  !> of the nodes is the same on both ranks.
  pure function common_lines(patch, other, active) result(line)
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: other, active
    type(line_t) :: line(3)
    type(box_t) :: shared
    integer :: a, i

    if (other%is_empty()) then
      do a = 1, 3
        allocate (line(a)%i(0))
      end do
      return
    end if
    shared = patch%all%meet(other)
    shared = shared%meet(active)
    do a = 1, 3
      associate (n => patch%period(a), lo => patch%all%lo(a))
        if (n == 0) then
          line(a)%i = [(i, i=shared%lo(a), shared%hi(a))]
        else
          line(a)%i = [(lo + modulo(i - lo, n), i=0, n - 1)]
          line(a)%i = pack(line(a)%i, line(a)%i <= patch%all%hi(a) .and. &
                           other%lo(a) + modulo(line(a)%i - other%lo(a), n) <= other%hi(a))
        end if
      end associate
    end do
  end function common_lines

  !> Pairs of storage indices: every image except the first of a node in the patch, and the first.
  pure subroutine list_images(patch, active, image)
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: active
    integer, allocatable, intent(out) :: image(:, :)
    type(line_t) :: line(3), first(3)
    integer, allocatable :: from(:), to(:)
    integer :: a, i

    allocate (image(2, 0))
    if (patch%nn == 0 .or. all(patch%period == 0)) return
    do a = 1, 3
      associate (n => patch%period(a), lo => patch%all%lo(a), hi => patch%all%hi(a))
        if (n == 0) then
          line(a)%i = [(i, i=max(lo, active%lo(a)), min(hi, active%hi(a)))]
          first(a)%i = line(a)%i
        else
          line(a)%i = [(i, i=lo, hi)]
          first(a)%i = lo + modulo(line(a)%i - lo, n)
        end if
      end associate
    end do
    allocate (from(product([(size(line(i)%i), i=1, 3)])))
    allocate (to(size(from)))
    call list_nodes(patch, line, from)
    call list_nodes(patch, first, to)
    image = transpose(reshape([pack(from, from /= to), pack(to, from /= to)], &
                              [count(from /= to), 2]))
  end subroutine list_images

  !> Storage indices of the nodes at the intersections of `line`.
  pure subroutine list_nodes(patch, line, list)
    type(patch_t), intent(in) :: patch
    type(line_t), intent(in) :: line(3)
    integer, intent(out) :: list(:)
    integer :: i, j, k, c

    c = 0
    do i = 1, size(line(1)%i)
      do j = 1, size(line(2)%i)
        do k = 1, size(line(3)%i)
          c = c + 1
          list(c) = patch%node([line(1)%i(i), line(2)%i(j), line(3)%i(k)])
        end do
      end do
    end do
  end subroutine list_nodes

  !> Mark all nodes up to `reach` away from a marked one along each axis.
  pure subroutine dilate(used, reach)
    logical, intent(inout), contiguous :: used(:, :, :)
    integer, intent(in) :: reach
    integer :: n(3)

    n = shape(used)
    call dilate_axis(1, n(1), n(2)*n(3), reach, used)
    call dilate_axis(n(1), n(2), n(3), reach, used)
    call dilate_axis(n(1)*n(2), n(3), 1, reach, used)
  end subroutine dilate

  !> Dilate along an axis of `n` places with `width` values each, in `n_arrays` arrays; as integers,
  !> whose `ior` is vectorised.
  pure subroutine dilate_axis(width, n, n_arrays, reach, used)
    integer, intent(in) :: width, n, n_arrays, reach
    logical, intent(inout) :: used(width*n, n_arrays)
    integer, dimension(width*n) :: marked, old
    integer :: i, away, rest, s

    do i = 1, n_arrays
      old = merge(1, 0, used(:, i))
      marked = old
      do s = 1, min(reach, n - 1)
        away = s*width
        rest = (n - s)*width
        marked(:rest) = ior(marked(:rest), old(away + 1:))
        marked(away + 1:) = ior(marked(away + 1:), old(:rest))
      end do
      used(:, i) = marked > 0
    end do
  end subroutine dilate_axis

end module grid_neighbours
