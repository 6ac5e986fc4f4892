! SPDX-License-Identifier: MIT
!> Partition of the grid and sums over the nodes that ranks share.
program test_grid
  use base_kinds, only: i8, rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use grid_geometry, only: box_t, grid_t, halo, make_grid, make_patch, nearest_node, patch_t
  use grid_halo, only: halo_t
  use grid_partition, only: bisect, imbalance, owner_of
  use grid_samples, only: contribution, expect_cover, fill, random_loads
  implicit none (type, external)

  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .true.)
  call test_geometry()
  call test_balance('uniform', [64, 48, 40], [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp])
  call test_balance('corner', [70, 60, 50], [0.4_rp, 0.1_rp, 0.2_rp], [0.9_rp, 0.7_rp, 0.6_rp])
  call test_balance('plate', [104, 44, 20], [0.02_rp, 0.05_rp, 0.1_rp], [0.98_rp, 0.95_rp, 0.7_rp])
  call test_even_division()
  call test_few_nodes()
  call test_halo([9, 6, 5])
  call test_halo([40, 7, 12])
  call test_gather()
  call end_tests()

contains

  !> Each rank gives as many columns as its number: rank 0 none.
  subroutine test_gather()
    integer :: i, r
    real(rp) :: own(2, world%rank)
    real(rp), allocatable :: all_columns(:, :)

    own(1, :) = real(world%rank, rp)
    own(2, :) = [(real(i, rp), i=1, world%rank)]
    allocate (all_columns, source=world%gather(own))
    call expect('columns of all ranks, in their order', &
                all(nint(all_columns(1, :)) == [((r, i=1, r), r=0, world%size - 1)]) .and. &
                all(nint(all_columns(2, :)) == [((i, i=1, r), r=0, world%size - 1)]))
  end subroutine test_gather

  subroutine test_geometry()
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(box_t) :: a, b, c

    grid = make_grid(0.1_rp, [0.0_rp, 1.0_rp, 2.0_rp], [1.0_rp, 1.25_rp, 2.3_rp])
    call expect('nodes that cover a box', all(grid%n == [11, 4, 4]))
    a = box_t([0, 0, 0], [3, 4, 5])
    b = box_t([2, 3, 4], [9, 9, 9])
    c = a%meet(b)
    call expect('common nodes', &
                all(c%lo == [2, 3, 4]) .and. all(c%hi == [3, 4, 5]) .and. c%count() == 8)
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
    patch = make_patch(grid, a, box_t([0, -2, 1], [1, 9, 3]))
    call expect('one layer above the room of the particles, and no more than without it', &
                all(patch%all%lo == a%lo - halo) .and. all(patch%all%hi == [2, 6, 4]))
    patch = make_patch(grid, a, box_t([-9, -9, -9], [-7, -7, -7]))
    call expect('a rank without particles stores a layer', all(patch%all%hi == a%lo - halo) &
                .and. patch%nn == 1)
    call expect('nearest node', all(nearest_node(grid, [0.149_rp, 1.151_rp, 2.0_rp]) == [1, 2, 0]))
  end subroutine test_geometry

  !> Load of every rank, from all ranks' parts.
  subroutine particle_costs(boxes, nodes, weight, load)
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
  end subroutine particle_costs

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
    call expect_cover(world, name, grid, boxes)
    call particle_costs(boxes, nodes, weight, load)
    call expect(name//': balanced within 15 %', imbalance(load) <= 1.15_rp)
    call expect_close(name//': of one rank that has all', imbalance([0.0_rp, 3.0_rp, 0.0_rp]), &
                      3.0_rp, rtol=1.0e-12_rp)
  end subroutine test_balance

  !> Planes in pairs of loads 5 and 1 along x: every rank gets one pair.
  subroutine test_even_division()
    type(grid_t) :: grid
    type(box_t) :: boxes(0:world%size - 1)
    integer :: nodes(3, 2*world%size), r
    real(rp) :: weight(2*world%size)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [2.0_rp*world%size - 1.0_rp, 1.0_rp, 1.0_rp])
    nodes = 0
    nodes(1, :) = [(r, r=0, 2*world%size - 1)]
    weight = 0.0_rp
    if (world%is_root()) weight = [(merge(5.0_rp, 1.0_rp, mod(r, 2) == 0), r=0, 2*world%size - 1)]
    call bisect(world, grid, nodes, weight, boxes)
    call expect('every rank gets a pair of planes', all([(boxes(r)%lo(1) == 2*r .and. &
                                                          boxes(r)%hi(1) == 2*r + 1, &
                                                          r=0, world%size - 1)]))
  end subroutine test_even_division

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
    call expect_cover(world, 'three loaded nodes', grid, boxes)
    call bisect(world, grid, none, no_weight, boxes)
    call expect_cover(world, 'no load', grid, boxes)
    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [2.0_rp, 0.0_rp, 0.0_rp])
    nodes = reshape([0, 0, 0, 1, 0, 0, 2, 0, 0], [3, 3])
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover(world, 'three nodes', grid, boxes)
    nodes = reshape([0, 0, 0, 7, 0, 0, -1, 0, 0], [3, 3])
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover(world, 'loads outside the grid do not count', grid, boxes)
    call expect('nodes outside belong to nobody', &
                owner_of(boxes, [3, 0, 0]) == -1 .and. owner_of(boxes, [-1, 0, 0]) == -1)
  end subroutine test_few_nodes

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
    call expect('nothing is kept of ranks that share no node', &
                size(exchange%neighbour) == exchange%n)
    call expect_sums(exchange, patch, boxes, active, 8)
    call expect_sums(exchange, patch, boxes, active, 2)
    call expect_sums(exchange, patch, boxes, active, 12)
    call expect_sums(exchange, patch, boxes, active, 8)
    call expect_overlap(exchange, patch)
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
    call fill(world%rank, patch, width, g)
    call exchange%sum(width, patch%nn, g)
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

  !> Two arrays in one message, while nodes that no other rank stores are still added to: the sums
  !> of each alone, to the bit.
  subroutine expect_overlap(exchange, patch)
    type(halo_t), intent(inout) :: exchange
    type(patch_t), intent(in) :: patch
    real(rp), allocatable :: g(:, :), more(:, :), g_alone(:, :), more_alone(:, :)
    logical, allocatable :: is_shared(:)
    integer(i8) :: messages
    integer :: q

    allocate (g(8, patch%nn), more(3, patch%nn))
    call fill(world%rank, patch, 8, g)
    call fill(world%rank, patch, 3, more)
    g_alone = g
    more_alone = more
    call exchange%sum(8, patch%nn, g_alone)
    call exchange%sum(3, patch%nn, more_alone)
    allocate (is_shared(patch%nn), source=.false.)
    is_shared(exchange%shared) = .true.
    messages = exchange%messages
    call exchange%post(8, patch%nn, g, more)
    do q = 1, patch%nn
      if (.not. is_shared(q)) g(:, q) = g(:, q) + 1.0_rp
      call exchange%progress_messages()
    end do
    call exchange%finish(8, patch%nn, g, more)
    do q = 1, patch%nn
      if (.not. is_shared(q)) g_alone(:, q) = g_alone(:, q) + 1.0_rp
    end do
    call expect('one message to each neighbour', exchange%messages - messages == exchange%n)
    call expect('overlapped sums of records, to the bit', all(g == g_alone))
    call expect('overlapped sums of what goes with them, to the bit', all(more == more_alone))
  end subroutine expect_overlap

end program test_grid
