! SPDX-License-Identifier: MIT
!> Agreement on errors: an error of any rank becomes the error of all ranks.
module comm_agree
  use base_errors, only: error_t, fatal
  use base_kinds, only: rp
  use base_timers, only: wall_time
  use comm_world, only: world_t
  use mpi_f08, only: mpi_bcast, mpi_character, mpi_iallreduce, mpi_integer, mpi_min, mpi_request, &
                     mpi_status_ignore, mpi_test, mpi_wait
  implicit none (type, external)
  private

  public :: agree

  real(rp), parameter :: wait_limit = 60.0_rp  !! for the other ranks after an error [s]

contains

  !> Collective. If any rank has an error, the lowest such rank sends its message to ranks without
  !> one.
  !>
  !> A collective write may fail on some ranks and never return on others, as with a full disk. A
  !> rank with an error therefore waits for the others up to a limit, and then aborts the run.
  subroutine agree(world, error)
    type(world_t), intent(in) :: world
    type(error_t), intent(inout) :: error
    character(:), allocatable :: message
    type(mpi_request) :: request
    integer, asynchronous :: own_rank, first
    integer :: length

    own_rank = merge(world%rank, world%size, error%is_set())
    call mpi_iallreduce(own_rank, first, 1, mpi_integer, mpi_min, world%comm, request)
    if (error%is_set()) then
      call wait_for_others(request, error%message)
    else
      call mpi_wait(request, mpi_status_ignore)
    end if
    if (first == world%size) return

    length = 0
    if (world%rank == first) length = len(error%message)
    call mpi_bcast(length, 1, mpi_integer, first, world%comm)
    allocate (character(length) :: message)
    if (world%rank == first) message(:) = error%message
    call mpi_bcast(message, length, mpi_character, first, world%comm)
    call error%raise(message)
  end subroutine agree

  !> Wait for all ranks up to the limit, then abort.
  subroutine wait_for_others(request, message)
    type(mpi_request), intent(inout) :: request
    character(*), intent(in) :: message
    real(rp) :: start
    logical :: done

    start = wall_time()
    do
      call mpi_test(request, done, mpi_status_ignore)
      if (done) return
      if (wall_time() - start > wait_limit) call fatal(message//' (disk full?)')
    end do
  end subroutine wait_for_others

end module comm_agree
