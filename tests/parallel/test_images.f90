! SPDX-License-Identifier: MIT
!> Periodic axes: places are wrapped, and nodes are summed over their images.
program test_images
  use base_kinds, only: i8, rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use grid_geometry, only: box_t, grid_t, halo, make_grid, make_patch, nearest_node, patch_t, wrap
  use grid_halo, only: halo_t
  use grid_partition, only: bisect
  use grid_samples, only: contribution, expect_cover, fill, random_loads
  implicit none (type, external)

  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .true.)
  call test_wrap()
  call test_sums([5, 4, 3], [.true., .true., .true.])
  call test_sums([12, 9, 1], [.false., .false., .true.])
  call test_sums([1, 6, 2], [.true., .false., .true.])
  call test_sums([9, 1, 3], [.true., .true., .false.])
  call test_sums([2, 1, 1], [.true., .true., .true.])
  call test_sums([1, 1, 1], [.true., .true., .true.])
  call end_tests()

contains

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
    call expect_close('upper corner of a periodic grid', &
                      maxval(abs(grid%upper() - [1.0_rp, -6.9_rp, 1.3_rp])), 0.0_rp, &
                      atol=1.0e-14_rp)
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
  subroutine test_sums(cells, is_periodic)
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
    call expect_cover(world, 'periodic', grid, boxes)
    patch = make_patch(grid, boxes(world%rank))
    active = box_t([0, 0, 0], grid%n - 1)
    call exchange%init(world, patch, boxes, active)
    allocate (used(patch%nn), source=.true.)
    call exchange%mark_used(patch%nn, used)
    call expect_image_sums(exchange, grid, patch, boxes, active, used, 8)
    call expect_image_sums(exchange, grid, patch, boxes, active, used, 12)
    used = .false.
    if (patch%nn > 0) used(patch%node(patch%own%hi)) = .true.
    call exchange%mark_used(patch%nn, used)
    call expect('a node in use stays in use', patch%nn == 0 .or. used_at(patch, used))
    call expect_image_sums(exchange, grid, patch, boxes, active, used, 3)
    call expect('one rank sends nothing', world%size > 1 .or. exchange%messages == 0_i8)
  end subroutine test_sums

  !> Whether the last owned node is marked; false for no node.
  pure logical function used_at(patch, used)
    type(patch_t), intent(in) :: patch
    logical, intent(in) :: used(:)

    used_at = .false.
    if (patch%nn > 0) used_at = used(patch%node(patch%own%hi))
  end function used_at

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
    call fill(world%rank, patch, width, g)
    call exchange%sum(width, patch%nn, g)
    equal = .true.
    untouched = .true.
    closed = .true.
    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          associate (q => patch%node([i, j, k]))
            is_active = all(grid%period > 0 .or. &
                            ([i, j, k] >= active%lo .and. [i, j, k] <= active%hi))
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

end program test_images
