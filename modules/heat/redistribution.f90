! SPDX-License-Identifier: MIT
!> Redistribution of a box of complex numbers (pairs of cells in z, y, x) between two partitions:
!> planes normal to x as in the mesh, and columns along x with own rows of y.
module heat_redistribution
  use base_kinds, only: rp
  use base_world, only: world_t
  use mpi_f08, only: mpi_allgather, mpi_alltoallv, mpi_double_complex, mpi_integer
  implicit none (type, external)
  private

  public :: redistribution_t

  !> Partitions and buffers.
  type :: redistribution_t
    integer :: pairs = 0                             !! complex numbers per row of cells in z
    integer :: j0 = 0, nj = 0                        !! offset and number of own rows of y
    integer, private :: nx = 0, ny = 0, own_nx = 0   !! size of the box; number of own planes
    integer, allocatable, private :: send(:), receive(:), j_of(:), nj_of(:)
    complex(rp), allocatable, private :: packed(:)
  contains
    procedure :: init, to_columns, to_planes
  end type redistribution_t

contains

  !> Collective. Set the partitions of a box of `n` cells (x, y, z) with `own_nx` planes on this
  !> rank.
  subroutine init(self, world, n, own_nx)
    class(redistribution_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    integer, intent(in) :: n(3), own_nx
    integer :: nx_of(0:world%size - 1), r

    self%nx = n(1)
    self%ny = n(2)
    self%own_nx = own_nx
    self%pairs = (n(3) + 1)/2
    allocate (self%j_of(0:world%size - 1), self%nj_of(0:world%size - 1))
    do r = 0, world%size - 1
      self%j_of(r) = (n(2)*r)/world%size
      self%nj_of(r) = (n(2)*(r + 1))/world%size - self%j_of(r)
    end do
    self%j0 = self%j_of(world%rank)
    self%nj = self%nj_of(world%rank)
    call mpi_allgather(own_nx, 1, mpi_integer, nx_of, 1, mpi_integer, world%comm)
    self%send = self%pairs*self%nj_of*own_nx
    self%receive = self%pairs*self%nj*nx_of
    if (world%size > 1) allocate (self%packed(self%pairs*n(2)*own_nx))
  end subroutine init

  !> Collective. Redistribute planes (z, y, own x) to columns (z, own y, x), on more than one rank.
  subroutine to_columns(self, world, planes, columns)
    class(redistribution_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    complex(rp), intent(in) :: planes(:)
    complex(rp), allocatable, intent(out) :: columns(:)
    integer :: at, i, m, o, r

    at = 0
    do r = 0, world%size - 1
      m = self%pairs*self%nj_of(r)
      do i = 1, self%own_nx
        o = (i - 1)*self%pairs*self%ny + self%pairs*self%j_of(r)
        self%packed(at + 1:at + m) = planes(o + 1:o + m)
        at = at + m
      end do
    end do
    allocate (columns(self%pairs*self%nj*self%nx))
    call mpi_alltoallv(self%packed, self%send, offsets(self%send), mpi_double_complex, &
                       columns, self%receive, offsets(self%receive), mpi_double_complex, world%comm)
  end subroutine to_columns

  !> Collective. Redistribute columns to planes.
  subroutine to_planes(self, world, columns, planes)
    class(redistribution_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    complex(rp), intent(in) :: columns(:)
    complex(rp), intent(inout) :: planes(:)
    integer :: at, i, m, o, r

    call mpi_alltoallv(columns, self%receive, offsets(self%receive), mpi_double_complex, &
                       self%packed, self%send, offsets(self%send), mpi_double_complex, world%comm)
    at = 0
    do r = 0, world%size - 1
      m = self%pairs*self%nj_of(r)
      do i = 1, self%own_nx
        o = (i - 1)*self%pairs*self%ny + self%pairs*self%j_of(r)
        planes(o + 1:o + m) = self%packed(at + 1:at + m)
        at = at + m
      end do
    end do
  end subroutine to_planes

  !> Offset of each rank's part, from 0.
  pure function offsets(counts)
    integer, intent(in) :: counts(:)
    integer :: offsets(size(counts)), r

    offsets = [(sum(counts(:r - 1)), r=1, size(counts))]
  end function offsets

end module heat_redistribution
