! SPDX-License-Identifier: MIT
!> Partition of the grid and sums over the nodes that ranks share.
program test_grid
  use base_kinds, only: i8, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use comm_world, only: start_world, world_t
  use grid_geometry, only: box_t, grid_t, halo, make_grid, make_patch, nearest_node, &
    patch_t, wrap
  use grid_halo, only: halo_t
  use grid_partition, only: bisect, imbalance, owner_of
  implicit none (type, external)

  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .true.)
  call test_geometry()
  call test_balance('uniform', [64, 48, 40], [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp])
  call test_balance('corner', [70, 60, 50], [0.4_rp, 0.1_rp, 0.2_rp], [0.9_rp, 0.7_rp, 0.6_rp])
  call test_balance('plate', [104, 44, 20], [0.02_rp, 0.05_rp, 0.1_rp], [0.98_rp, 0.95_rp, 0.7_rp])
  call test_few_nodes()
  call test_halo([9, 6, 5])
  call test_halo([40, 7, 12])
  call test_wrap()
  call test_images([5, 4, 3], [.true., .true., .true.])
  call test_images([12, 9, 1], [.false., .false., .true.])
  call test_images([1, 6, 2], [.true., .false., .true.])
  call test_images([9, 1, 3], [.true., .true., .false.])
  call test_images([2, 1, 1], [.true., .true., .true.])
  call test_images([1, 1, 1], [.true., .true., .true.])
  call end_tests()

contains

  subroutine test_geometry()
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(box_t) :: a, b, c

    grid = make_grid(0.1_rp, [0.0_rp, 1.0_rp, 2.0_rp], [1.0_rp, 1.25_rp, 2.3_rp])
    call expect('nodes that cover a box', all(grid%n == [11, 4, 4]))
    a = box_t([0, 0, 0], [3, 4, 5])
    b = box_t([2, 3, 4], [9, 9, 9])
    c = a%meet(b)
    call expect('common nodes', all(c%lo == [2, 3, 4]) .and. all(c%hi == [3, 4, 5]) &
                .and. c%count() == 8)
    b = box_t([4, 0, 0], [5, 1, 1])
    c = a%meet(b)
    call expect('no common nodes', c%is_empty() .and. c%count() == 0)
    c = box_t()
    b = c%grown(2)
    call expect('an empty box stays empty', b%is_empty())
    patch = make_patch(grid, a)
    call expect('storage of a patch', patch%node(a%lo - halo) == 1 &
                .and. patch%node(a%hi + halo) == patch%nn .and. patch%stride(3) == 1 &
                .and. patch%nn == (4 + 2*halo)*(5 + 2*halo)*(6 + 2*halo))
    call expect_close('origin of a patch', patch%origin(2), 1.0_rp - 0.1_rp*halo)
    call expect('nearest node', all(nearest_node(grid, [0.149_rp, 1.151_rp, 2.0_rp]) == [1, 2, 0]))
  end subroutine test_geometry

  !> Every node of the grid lies in exactly one box, and all ranks have the same boxes.
  subroutine expect_cover(name, grid, boxes)
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
    call expect(name//': all ranks agree', all(reshape(mine, [size(mine)]) == first))
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

  !> Load of every rank, from all ranks' parts.
  subroutine loads_of(boxes, nodes, weight, load)
    type(box_t), intent(in) :: boxes(0:)
    integer, intent(in) :: nodes(:, :)
    real(rp), intent(in) :: weight(:)
    real(rp), intent(out) :: load(0:world%size - 1)
    integer :: i, r

    load = 0.0_rp
    do i = 1, size(weight)
      r = owner_of(boxes, nodes(:, i))
      load(r) = load(r) + weight(i)
    end do
    call world%sum(load)
  end subroutine loads_of

  subroutine test_balance(name, n, from, to)
    character(*), intent(in) :: name
    integer, intent(in) :: n(3)
    real(rp), intent(in) :: from(3), to(3)
    type(grid_t) :: grid
    type(box_t) :: boxes(0:world%size - 1)
    real(rp) :: load(0:world%size - 1)
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], real(n - 1, rp))
    call random_loads(grid, from, to, 20000/world%size, nodes, weight)
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover(name, grid, boxes)
    call loads_of(boxes, nodes, weight, load)
    call expect(name//': balanced within 15 %', imbalance(world, load(world%rank)) <= 1.15_rp)
    call expect_close(name//': imbalance', imbalance(world, load(world%rank)), &
                      maxval(load)*world%size/sum(load), rtol=1.0e-12_rp)
  end subroutine test_balance

  !> Fewer loaded nodes than ranks, no load at all, fewer nodes than ranks.
  subroutine test_few_nodes()
    type(grid_t) :: grid
    type(box_t) :: boxes(0:world%size - 1)
    integer :: nodes(3, 3), none(3, 0)
    real(rp) :: weight(3), no_weight(0)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [19.0_rp, 9.0_rp, 9.0_rp])
    nodes = reshape([3, 4, 5, 3, 4, 6, 12, 1, 1], [3, 3])
    weight = [1.0_rp, 2.0_rp, 1.5_rp]
    if (world%rank > 0) weight = 0.0_rp
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover('three loaded nodes', grid, boxes)
    call bisect(world, grid, none, no_weight, boxes)
    call expect_cover('no load', grid, boxes)
    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [2.0_rp, 0.0_rp, 0.0_rp])
    nodes = reshape([0, 0, 0, 1, 0, 0, 2, 0, 0], [3, 3])
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover('three nodes', grid, boxes)
    call expect('nodes outside belong to nobody', owner_of(boxes, [3, 0, 0]) == -1 &
                .and. owner_of(boxes, [-1, 0, 0]) == -1)
  end subroutine test_few_nodes

  !> What rank r contributes to lane f of node ijk: of either sign and many sizes. It ends with a
  !> division, since the compiler would fuse a product and the sum.
  pure real(rp) function contribution(r, f, ijk)
    integer, intent(in) :: r, f, ijk(3)
    real(rp), parameter :: size_of(0:4) = [7.0_rp, 3.0e5_rp, 1.1e-3_rp, 130.0_rp, 9.7e9_rp]

    contribution = real(modulo(7919*ijk(1) + 104729*ijk(2) + 15485*ijk(3) + 6113*f + 3571*r, 2003) &
                        - 1001, rp)/size_of(modulo(sum(ijk) + f + 3*r, 5))
  end function contribution

  !> This rank's contributions to all nodes of its patch.
  subroutine fill(patch, width, g)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: width
    real(rp), intent(out) :: g(width, patch%nn)
    integer :: f, i, j, k

    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          do f = 1, width
            g(f, patch%node([i, j, k])) = contribution(world%rank, f, [i, j, k])
          end do
        end do
      end do
    end do
  end subroutine fill

  !> Sums of records of several widths over one exchange, wider and narrower in turn.
  subroutine test_halo(n)
    integer, intent(in) :: n(3)
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(halo_t) :: exchange
    type(box_t) :: boxes(0:world%size - 1), active
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], real(n - 1, rp))
    call random_loads(grid, [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp], 200, nodes, weight)
    call bisect(world, grid, nodes, weight, boxes)
    patch = make_patch(grid, boxes(world%rank))
    active = box_t([-1, 0, 1], n - [2, 1, 0])
    call exchange%init(world, patch, boxes, active)
    call expect_sums(exchange, patch, boxes, active, 8)
    call expect_sums(exchange, patch, boxes, active, 2)
    call expect_sums(exchange, patch, boxes, active, 12)
    call expect_sums(exchange, patch, boxes, active, 8)
    call expect('one rank sends nothing', world%size > 1 .or. exchange%messages == 0_i8)
  end subroutine test_halo

  !> Shared nodes hold the sum in the order of the ranks, to the bit; the others are left alone.
  subroutine expect_sums(exchange, patch, boxes, active, width)
    type(halo_t), intent(inout) :: exchange
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:), active
    integer, intent(in) :: width
    type(box_t) :: other
    real(rp), allocatable :: g(:, :)
    real(rp) :: want(width)
    integer :: f, i, j, k, r
    logical :: equal, untouched

    allocate (g(width, patch%nn))
    call fill(patch, width, g)
    call exchange%sum(world, width, patch%nn, g)
    equal = .true.
    untouched = .true.
    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          want = 0.0_rp
          do r = 0, world%size - 1
            other = boxes(r)%grown(halo)
            if (.not. other%has([i, j, k])) cycle
            if (.not. active%has([i, j, k]) .and. r /= world%rank) cycle
            want = want + [(contribution(r, f, [i, j, k]), f=1, width)]
          end do
          if (active%has([i, j, k])) then
            equal = equal .and. all(g(:, patch%node([i, j, k])) == want)
          else
            untouched = untouched .and. all(g(:, patch%node([i, j, k])) == want)
          end if
        end do
      end do
    end do
    call expect('shared nodes hold the sum, to the bit', equal)
    call expect('nodes not in use are left alone', untouched)
  end subroutine expect_sums

  !> A place moves by whole periods, to where its nearest node is one of 0 to n-1, also beside the
  !> edges, where the sum is rounded.
  subroutine test_wrap()
    type(grid_t) :: grid
    real(rp) :: x(3), y(3), u(3), turns
    logical :: within, whole, kept
    integer :: i, ijk(3)

    grid = make_grid(0.1_rp, [0.3_rp, -7.0_rp, 1.0_rp], [1.0_rp, -6.9_rp, 1.25_rp], &
                     [.true., .true., .false.])
    call expect('nodes of a periodic grid', all(grid%n == [7, 1, 4]) &
                .and. all(grid%period == [7, 1, 0]) .and. all(grid%cells() == [7, 1, 3]))
    call expect_close('upper corner of a periodic grid', maxval(abs(grid%upper() &
                      - [1.0_rp, -6.9_rp, 1.3_rp])), 0.0_rp, atol=1.0e-14_rp)
    within = .true.
    whole = .true.
    kept = .true.
    do i = -2000, 2000
      call random_number(u)
      x = grid%lower + 5.0_rp*(u - 0.5_rp)
      if (mod(i, 2) == 0) then                    ! within a few roundings of an edge
        x(1) = grid%lower(1) + 0.1_rp*(real(7*mod(i/2, 5), rp) - 0.5_rp) + i*1.0e-18_rp
        x(2) = grid%lower(2) + 0.1_rp*(real(mod(i/2, 9), rp) - 0.5_rp) + i*1.0e-18_rp
      end if
      y = x
      call wrap(grid, y)
      ijk = nearest_node(grid, y)
      within = within .and. all(ijk(1:2) >= 0 .and. ijk(1:2) < grid%n(1:2))
      turns = (x(1) - y(1))/0.7_rp
      whole = whole .and. abs(turns - anint(turns)) < 1.0e-8_rp
      turns = (x(2) - y(2))/0.1_rp
      whole = whole .and. abs(turns - anint(turns)) < 1.0e-8_rp
      kept = kept .and. abs(x(3) - y(3)) <= 0.0_rp
    end do
    call expect('wrapped places lie in the box', within)
    call expect('places are wrapped by whole periods', whole)
    call expect('axes that are not periodic are left alone', kept)
  end subroutine test_wrap

  !> Whether two nodes are images of one.
  pure logical function are_images(grid, ijk, other)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: ijk(3), other(3)

    are_images = all(modulo(ijk - other, max(1, grid%period)) == 0) &
                 .and. all(grid%period > 0 .or. ijk == other)
  end function are_images

  !> Contributions of rank `r` through all images of node `ijk`, added from the first to the last.
  pure function images_sum(grid, all, r, width, ijk) result(total)
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: all             !! of the patch of r
    integer, intent(in) :: r, width, ijk(3)
    real(rp) :: total(width)
    integer :: f, i, j, k

    total = 0.0_rp
    do i = all%lo(1), all%hi(1)
      do j = all%lo(2), all%hi(2)
        do k = all%lo(3), all%hi(3)
          if (.not. are_images(grid, ijk, [i, j, k])) cycle
          total = total + [(contribution(r, f, [i, j, k]), f=1, width)]
        end do
      end do
    end do
  end function images_sum

  !> Periodic grid of `cells`: every copy of a node in use holds, to the bit, the sum over all its
  !> images on all ranks; images that are not in use are left alone.
  subroutine test_images(cells, is_periodic)
    integer, intent(in) :: cells(3)
    logical, intent(in) :: is_periodic(3)
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(halo_t) :: exchange
    type(box_t) :: boxes(0:world%size - 1), active
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)
    logical, allocatable :: used(:)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], real(cells, rp), is_periodic)
    call random_loads(grid, [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp], 200, nodes, weight)
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover('periodic', grid, boxes)
    patch = make_patch(grid, boxes(world%rank))
    active = box_t([0, 0, 0], grid%n - 1)
    call exchange%init(world, patch, boxes, active)
    allocate (used(patch%nn), source=.true.)
    call exchange%mark_used(patch%nn, used)
    call expect_image_sums(exchange, grid, patch, boxes, active, used, 8)
    call expect_image_sums(exchange, grid, patch, boxes, active, used, 12)
    used = .false.
    if (patch%nn > 0) used(patch%node(patch%own%lo)) = .true.
    call exchange%mark_used(patch%nn, used)
    call expect_image_sums(exchange, grid, patch, boxes, active, used, 3)
    call expect('one rank sends nothing', world%size > 1 .or. exchange%messages == 0_i8)
  end subroutine test_images

  subroutine expect_image_sums(exchange, grid, patch, boxes, active, used, width)
    type(halo_t), intent(inout) :: exchange
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:), active
    logical, intent(in) :: used(:)
    integer, intent(in) :: width
    real(rp), allocatable :: g(:, :)
    real(rp) :: want(width)
    integer :: f, i, j, k, r
    logical :: equal, untouched, closed, is_active

    allocate (g(width, patch%nn))
    call fill(patch, width, g)
    call exchange%sum(world, width, patch%nn, g)
    equal = .true.
    untouched = .true.
    closed = .true.
    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          associate (q => patch%node([i, j, k]))
            is_active = all(grid%period > 0 .or. ([i, j, k] >= active%lo .and. [i, j, k] <= active%hi))
            want = [(contribution(world%rank, f, [i, j, k]), f=1, width)]
            if (.not. (used(q) .and. is_active)) then
              untouched = untouched .and. all(g(:, q) == want)
              cycle
            end if
            closed = closed .and. images_are_used(grid, patch, used, [i, j, k])
            want = 0.0_rp
            do r = 0, world%size - 1
              if (boxes(r)%is_empty()) cycle
              want = want + images_sum(grid, boxes(r)%grown(halo), r, width, [i, j, k])
            end do
            equal = equal .and. all(g(:, q) == want)
          end associate
        end do
      end do
    end do
    call expect('all images hold the sum over all images, to the bit', equal)
    call expect('images not in use are left alone', untouched)
    call expect('all images of a node in use are in use', closed)
  end subroutine expect_image_sums

  pure logical function images_are_used(grid, patch, used, ijk) result(ok)
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    logical, intent(in) :: used(:)
    integer, intent(in) :: ijk(3)
    integer :: i, j, k

    ok = .true.
    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          if (are_images(grid, ijk, [i, j, k])) ok = ok .and. used(patch%node([i, j, k]))
        end do
      end do
    end do
  end function images_are_used

end program test_grid
