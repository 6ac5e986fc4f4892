! SPDX-License-Identifier: MIT
!> What an exchange between two ranks costs here, as JSON: latency and bandwidth of messages there
!> and back, a reduction of six reals, and the sums of shared nodes as a step makes them. Each
!> figure is the best of many short batches, since other programs only ever add time.
!> benchmarks/scaling --calibrate runs it.
program network
  use base_kinds, only: rp
  use base_text, only: str
  use base_timers, only: wall_time
  use base_world, only: end_world, start_world, world_t
  use grid_geometry, only: box_t, grid_t, make_grid, make_patch, patch_t
  use grid_halo, only: halo_t
  use mpi_f08, only: mpi_double_precision, mpi_recv, mpi_send, mpi_status_ignore
  implicit none (type, external)

  integer, parameter :: batches = 600, large = 32768, record = 8
  type(world_t) :: world
  real(rp) :: latency, per_message, reduction, sum_small, sum_large, bytes_small, bytes_large

  call start_world(world)
  if (world%size == 2) then
    latency = there_and_back(1, 50)
    per_message = there_and_back(large, 1)
    reduction = reductions(50)
    call shared_sums(8, 5, sum_small, bytes_small)
    call shared_sums(32, 1, sum_large, bytes_large)
    if (world%is_root()) print '(a)', '{"latency_s": '//str(latency)// &
      ', "bandwidth_bytes_per_s": '//str(8.0_rp*(large - 1)/(per_message - latency))// &
      ', "reduction_s": '//str(reduction)// &
      ', "sum_s": '//str(sum_small)//', "sum_bytes": '//str(bytes_small)// &
      ', "large_sum_s": '//str(sum_large)//', "large_sum_bytes": '//str(bytes_large)//'}'
  else if (world%is_root()) then
    print '(a)', 'network: needs two ranks'
  end if
  call end_world()

contains

  !> Seconds of a message of `n` reals one way.
  real(rp) function there_and_back(n, turns) result(best)
    integer, intent(in) :: n, turns
    real(rp) :: buffer(n), t
    integer :: b, i, other

    buffer = 1.0_rp
    other = 1 - world%rank
    best = huge(1.0_rp)
    do b = 1, batches
      call world%barrier()
      t = wall_time()
      do i = 1, turns
        if (world%rank == 0) call mpi_send(buffer, n, mpi_double_precision, other, 1, world%comm)
        call mpi_recv(buffer, n, mpi_double_precision, other, 1, world%comm, mpi_status_ignore)
        if (world%rank == 1) call mpi_send(buffer, n, mpi_double_precision, other, 1, world%comm)
      end do
      best = min(best, (wall_time() - t)/(2*turns))
    end do
  end function there_and_back

  !> Seconds of a reduction as in every step.
  real(rp) function reductions(turns) result(best)
    integer, intent(in) :: turns
    real(rp) :: values(6), t
    integer :: b, i

    best = huge(1.0_rp)
    do b = 1, batches
      call world%barrier()
      t = wall_time()
      do i = 1, turns
        values = real(i, rp)
        call world%max(values)
      end do
      best = min(best, (wall_time() - t)/turns)
    end do
  end function reductions

  !> Seconds of the sum of the nodes that two halves of a cube of `n` nodes share, and what a rank
  !> sends.
  subroutine shared_sums(n, turns, best, bytes)
    integer, intent(in) :: n, turns
    real(rp), intent(out) :: best, bytes
    type(grid_t) :: grid
    type(box_t) :: boxes(0:1)
    type(patch_t) :: patch
    type(halo_t) :: halo
    real(rp), allocatable :: g(:, :)
    real(rp) :: t
    integer :: b, i

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp]*(n - 1))
    boxes(0) = box_t([0, 0, 0], [n/2 - 1, n - 1, n - 1])
    boxes(1) = box_t([n/2, 0, 0], [n - 1, n - 1, n - 1])
    patch = make_patch(grid, boxes(world%rank))
    call halo%init(world, patch, boxes, box_t([0, 0, 0], [n - 1, n - 1, n - 1]))
    allocate (g(record, patch%nn))
    best = huge(1.0_rp)
    do b = 1, batches
      g = 1.0_rp
      call world%barrier()
      t = wall_time()
      do i = 1, turns
        call halo%sum(record, patch%nn, g)
      end do
      best = min(best, (wall_time() - t)/turns)
    end do
    bytes = real(halo%bytes, rp)/(batches*turns)
  end subroutine shared_sums

end program network
