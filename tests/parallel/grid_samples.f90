! SPDX-License-Identifier: MIT
!> Loads and node records for the tests of the grid.
module grid_samples
  use base_kinds, only: rp
  use base_world, only: world_t
  use check, only: expect
  use grid_geometry, only: box_t, grid_t, patch_t
  implicit none (type, external)
  private

  public :: contribution, expect_cover, fill, random_loads

contains

  !> Every node of the grid lies in exactly one box, and all ranks have the same boxes.
  subroutine expect_cover(world, name, grid, boxes)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: name
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: boxes(0:)
    type(box_t) :: whole, common
    real(rp) :: mine(6, 0:size(boxes) - 1), first(6*size(boxes))
    integer :: r, s, total
    logical :: apart, within

    total = 0
    apart = .true.
    within = .true.
    whole = box_t([0, 0, 0], grid%n - 1)
    do r = 0, size(boxes) - 1
      total = total + boxes(r)%count()
      common = boxes(r)%meet(whole)
      within = within .and. common%count() == boxes(r)%count()
      do s = 0, r - 1
        common = boxes(r)%meet(boxes(s))
        apart = apart .and. common%is_empty()
      end do
    end do
    call expect(name//': boxes cover the grid', total == product(grid%n) .and. within)
    call expect(name//': boxes do not overlap', apart)
    do r = 0, size(boxes) - 1
      mine(:, r) = real([boxes(r)%lo, boxes(r)%hi], rp)
    end do
    first = reshape(mine, [size(mine)])
    call world%broadcast(first)
    call expect(name//': all ranks agree', all(reshape(mine, [size(mine)]) &
                                               == first))
  end subroutine expect_cover

  !> Random loads, each rank with others, between the fractions `from` and `to` of the grid.
  subroutine random_loads(grid, from, to, n, nodes, weight)
    type(grid_t), intent(in) :: grid
    real(rp), intent(in) :: from(3), to(3)
    integer, intent(in) :: n
    integer, allocatable, intent(out) :: nodes(:, :)
    real(rp), allocatable, intent(out) :: weight(:)
    real(rp) :: u(3)
    integer :: i

    allocate (nodes(3, n), weight(n))
    do i = 1, n
      call random_number(u)
      nodes(:, i) = min(grid%n - 1, floor((from + u*(to - from))*grid%n))
    end do
    call random_number(weight)
  end subroutine random_loads

  !> What rank r contributes to lane f of node ijk: of either sign and many sizes. It ends with a
  !> division, since the compiler would fuse a product and the sum.
  pure real(rp) function contribution(r, f, ijk)
    integer, intent(in) :: r, f, ijk(3)
    real(rp), parameter :: size_of(0:4) = [7.0_rp, 3.0e5_rp, 1.1e-3_rp, 130.0_rp, 9.7e9_rp]

    contribution = real(modulo(7919*ijk(1) + 104729*ijk(2) + 15485*ijk(3) + 6113*f + 3571*r, 2003) &
                        - 1001, rp)/size_of(modulo(sum(ijk) + f + 3*r, 5))
  end function contribution

  !> Contributions of a rank to all nodes of its patch.
  subroutine fill(rank, patch, width, g)
    integer, intent(in) :: rank, width
    type(patch_t), intent(in) :: patch
    real(rp), intent(out) :: g(width, patch%nn)
    integer :: f, i, j, k

    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          do f = 1, width
            g(f, patch%node([i, j, k])) = contribution(rank, f, [i, j, k])
          end do
        end do
      end do
    end do
  end subroutine fill

end module grid_samples
