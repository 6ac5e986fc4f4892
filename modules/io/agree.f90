! SPDX-License-Identifier: MIT
!> One verdict for all ranks: an error of any rank becomes the error of every rank.
module io_agree
  use mpi_f08, only: mpi_allreduce, mpi_bcast, mpi_character, mpi_integer, mpi_min
  use base_errors, only: error_t
  use comm_world, only: world_t
  implicit none (type, external)
  private

  public :: agree

contains

  !> If a rank holds an error, give its message (of the lowest such rank) to those that hold none.
  subroutine agree(world, error)
    type(world_t), intent(in) :: world
    type(error_t), intent(inout) :: error
    character(:), allocatable :: message
    integer :: mine, first, length

    mine = merge(world%rank, world%size, error%is_set())
    call mpi_allreduce(mine, first, 1, mpi_integer, mpi_min, world%comm)
    if (first == world%size) return

    length = 0
    if (world%rank == first) length = len(error%message)
    call mpi_bcast(length, 1, mpi_integer, first, world%comm)
    allocate (character(length) :: message)
    if (world%rank == first) message(:) = error%message
    call mpi_bcast(message, length, mpi_character, first, world%comm)
    call error%raise(message)
  end subroutine agree

end module io_agree
