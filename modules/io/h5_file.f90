! SPDX-License-Identifier: MIT
!> Parallel HDF5 files: open, close, groups, and arrays distributed over the ranks.
!>
!> All procedures are collective. An array is distributed along its last dimension: the file has the
!> columns of rank 0, then those of rank 1, and so on; a rank may have none. With `error` set calls
!> have no effect, except `close`, so that a sequence of calls needs one test at its end. Typed
!> arrays, texts and attributes are in io_h5_notes.
module io_h5_file
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int, c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: int8
  use base_disk, only: file_bytes, keep_file, sync_file
  use base_errors, only: error_t
  use base_files, only: reason_of
  use base_kinds, only: i8, rp
  use base_system, only: remove_file, rename_file
  use comm_world, only: agree, world_t
  use io_h5_calls, only: close_dataset, close_parallel, dataset_shape, flush_parallel, &
                         make_dataset, make_group, move_columns, open_dataset, open_parallel
  use io_h5_seal, only: previous_of, seal, seal_bytes
  use io_h5_types, only: handle_t, kind_u8
  use mpi_f08, only: mpi_allreduce, mpi_exscan, mpi_in_place, mpi_integer8, mpi_max, mpi_sum
  implicit none (type, external)
  private

  public :: h5file_t

  integer(i8), parameter :: packed_from = 4096_i8        !! smaller arrays are not compressed
  integer(i8), parameter :: round_bytes = 536870912_i8   !! per round, as MPI counts are 32-bit

  !> An open file. A new file is named path.tmp until `close`.
  type :: h5file_t
    type(world_t) :: world
    type(handle_t) :: handle
    logical, private :: packed = .false.   !! compress larger arrays
    logical, private :: sealed = .false.   !! seal it, and keep the previous file
    integer(i8), private :: bytes = 0      !! size of an existing file
    character(:), allocatable, private :: path
  contains
    procedure :: create, open => open_old, flush => flush_file, close => close_file, group, extent
    procedure :: put_columns, get_columns, verify
  end type h5file_t

  interface
    !> Reset the record of failed writes (modules/io/h5_writes.c).
    subroutine begin_writes() bind(c, name='stirpoint_begin_writes')
      implicit none (type, external)
    end subroutine begin_writes

    !> errno of the first failed write of this rank; -1 if unknown; 0 if none failed.
    integer(c_int) function lost_write() bind(c, name='stirpoint_lost_write')
      import :: c_int
      implicit none (type, external)
    end function lost_write
  end interface

contains

  !> Create a file, `packed` with compressed large arrays. A `sealed` file gets a checksum, is
  !> flushed to disk before it gets its name, and the previous file is kept (io_h5_seal).
  subroutine create(self, world, path, packed, error, sealed)
    class(h5file_t), intent(out) :: self
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    logical, intent(in) :: packed
    type(error_t), intent(inout) :: error
    logical, intent(in), optional :: sealed
    integer :: worst

    self%world = world
    self%packed = packed
    if (present(sealed)) self%sealed = sealed
    if (error%is_set()) return
    self%path = trim(path)
    worst = 0
    if (world%is_root()) call remove_file(self%path//'.tmp')   ! a link?
    call world%barrier()
    call begin_writes()
    call open_parallel(world%comm, self%path//'.tmp', .true., self%handle, worst, &
                       merge(seal_bytes, 0, self%sealed))
    call self%verify(worst, 'cannot be created', error)
  end subroutine create

  !> Open an existing file for reading.
  subroutine open_old(self, world, path, error)
    class(h5file_t), intent(out) :: self
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    integer :: worst
    logical :: exists

    self%world = world
    if (error%is_set()) return
    self%path = trim(path)
    call begin_writes()
    exists = .true.
    if (world%is_root()) inquire (file=self%path, exist=exists)
    call self%verify(merge(0, -1, exists), 'does not exist', error)
    if (error%is_set()) return
    self%bytes = file_bytes(self%path)
    worst = 0
    call open_parallel(world%comm, self%path, .false., self%handle, worst)
    call self%verify(worst, 'is not an HDF5 file, or it is damaged or cut short', error)
  end subroutine open_old

  !> Flush the file to disk.
  subroutine flush_file(self, error)
    class(h5file_t), intent(in) :: self
    type(error_t), intent(inout) :: error
    integer :: worst

    if (error%is_set()) return
    worst = 0
    call flush_parallel(self%handle, worst)
    call self%verify(worst, 'cannot be written', error)
  end subroutine flush_file

  !> Close the file, also after an error. A new file gets its name if it is complete, otherwise it
  !> is removed.
  subroutine close_file(self, error)
    class(h5file_t), intent(inout) :: self
    type(error_t), intent(inout) :: error
    integer :: worst
    logical :: is_new

    if (.not. allocated(self%path)) return
    is_new = self%handle%is_new
    worst = 0
    call close_parallel(self%handle, worst)
    call self%verify(worst, 'cannot be closed', error)
    if (is_new .and. self%sealed .and. .not. error%is_set()) then
      call seal(self%world, self%path//'.tmp', error)
    end if
    if (is_new) call give_name(self, error)
    deallocate (self%path)
  end subroutine close_file

  !> Rename a complete new file to its name, otherwise remove it.
  subroutine give_name(self, error)
    type(h5file_t), intent(in) :: self
    type(error_t), intent(inout) :: error
    logical :: ok
    integer :: slash

    ok = .true.
    if (self%world%is_root()) then
      if (.not. error%is_set() .and. self%sealed) then
        ok = sync_file(self%path//'.tmp')
        if (ok) ok = keep_file(self%path, previous_of(self%path))
      end if
      if (.not. error%is_set() .and. ok) call rename_file(self%path//'.tmp', self%path, ok)
      if (error%is_set() .or. .not. ok) call remove_file(self%path//'.tmp')
      slash = index(self%path, '/', back=.true.)
      if (ok .and. self%sealed) ok = sync_file(self%path(:slash)//'.')
    end if
    call self%verify(merge(0, -1, ok), 'cannot be written', error)
  end subroutine give_name

  !> Raise an error on all ranks if `status` is negative or a write failed on any rank.
  subroutine verify(self, status, problem, error)
    class(h5file_t), intent(in) :: self
    integer, intent(in) :: status
    character(*), intent(in) :: problem
    type(error_t), intent(inout) :: error

    integer :: lost

    lost = lost_write()
    if (lost > 0) call error%raise(self%path//' cannot be written: '//reason_of(lost))
    if (lost < 0) call error%raise(self%path//' cannot be written: MPI refuses it')
    if (status < 0) call error%raise(self%path//' '//problem)
    call agree(self%world, error)
  end subroutine verify

  !> Make a group; the groups above must exist.
  subroutine group(self, name, error)
    class(h5file_t), intent(in) :: self
    character(*), intent(in) :: name
    type(error_t), intent(inout) :: error
    integer :: worst

    if (error%is_set()) return
    worst = 0
    call make_group(self%handle, name, worst)
    call self%verify(worst, 'cannot be written: '//name, error)
  end subroutine group

  !> Shape of an array of the file; an existing file with more values than bytes is an error.
  subroutine extent(self, name, dims, error)
    class(h5file_t), intent(in) :: self
    character(*), intent(in) :: name
    integer(i8), allocatable, intent(out) :: dims(:)
    type(error_t), intent(inout) :: error
    type(handle_t) :: dataset
    integer :: worst

    allocate (dims(0))
    if (error%is_set()) return
    worst = 0
    call open_dataset(self%handle, name, kind_u8, dataset, worst)
    if (worst >= 0) call dataset_shape(dataset, dims, worst)
    if (any(dims < 0) .or. product(real(dims, rp)) > real(self%bytes, rp)) worst = -1
    call close_dataset(dataset)
    call self%verify(worst, 'has no array '//name//', or is damaged', error)
    if (error%is_set()) dims = dims(:0)
  end subroutine extent

  !> Write the columns of all ranks, with the local shape `dims` and the address `data`.
  subroutine put_columns(self, name, kind, dims, data, error)
    class(h5file_t), intent(in) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: dims(:)
    type(c_ptr), intent(in) :: data
    type(error_t), intent(inout) :: error
    type(handle_t) :: dataset
    integer(i8) :: whole(size(dims)), first
    integer :: worst, r
    logical :: packed

    if (error%is_set()) return
    r = size(dims)
    whole = dims
    call mpi_allreduce(mpi_in_place, whole(r), 1, mpi_integer8, mpi_sum, self%world%comm)
    first = 0
    call mpi_exscan(dims(r), first, 1, mpi_integer8, mpi_sum, self%world%comm)
    if (self%world%is_root()) first = 0
    packed = self%packed .and. product(whole) >= packed_from
    worst = 0
    call make_dataset(self%handle, name, kind, 0_i8, whole, packed, dataset, worst)
    call self%verify(worst, 'cannot be written: '//name, error)
    if (.not. error%is_set()) then
      call move_rounds(self, dataset, first, dims, data, worst)
      call self%verify(worst, 'cannot be written: '//name, error)
    end if
    call close_dataset(dataset)
  end subroutine put_columns

  !> Read columns from `first` into memory of shape `dims`.
  subroutine get_columns(self, name, kind, first, dims, data, error)
    class(h5file_t), intent(in) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: first, dims(:)
    type(c_ptr), intent(in) :: data
    type(error_t), intent(inout) :: error
    type(handle_t) :: dataset
    integer(i8), allocatable :: whole(:)
    integer :: worst, r

    if (error%is_set()) return
    worst = 0
    r = size(dims)
    call open_dataset(self%handle, name, kind, dataset, worst)
    if (worst >= 0) then
      call dataset_shape(dataset, whole, worst)
      if (size(whole) /= r) then
        worst = -1
      else if (any(whole(:r - 1) /= dims(:r - 1))) then
        worst = -1
      else if (first < 0 .or. first + dims(r) > whole(r)) then
        worst = -1
      end if
    end if
    call self%verify(worst, 'has no array '//name//' of the shape expected', error)
    if (.not. error%is_set()) then
      call move_rounds(self, dataset, first, dims, data, worst)
      call self%verify(worst, 'cannot be read: '//name, error)
    end if
    call close_dataset(dataset)
  end subroutine get_columns

  !> Move columns in as many rounds as the rank with the most columns needs.
  subroutine move_rounds(self, dataset, first, dims, data, worst)
    type(h5file_t), intent(in) :: self
    type(handle_t), intent(in) :: dataset
    integer(i8), intent(in) :: first, dims(:)
    type(c_ptr), intent(in) :: data
    integer, intent(inout) :: worst
    integer(int8), pointer, contiguous :: memory(:)
    integer(int8), target :: nothing(8)
    integer(i8) :: width, n, step, most_columns, done, m
    type(c_ptr) :: here
    integer :: r

    r = size(dims)
    n = dims(r)
    width = dataset%bytes*product(dims(:r - 1))
    call c_f_pointer(data, memory, [n*width])
    step = max(1_i8, round_bytes/max(1_i8, width))
    most_columns = n
    call mpi_allreduce(mpi_in_place, most_columns, 1, mpi_integer8, mpi_max, self%world%comm)
    do done = 0, most_columns - 1, step
      m = max(0_i8, min(step, n - done))
      here = c_loc(nothing)
      if (m*width > 0) here = c_loc(memory(done*width + 1))
      call move_columns(self%handle, dataset, first + done, [dims(:r - 1), m], .true., here, worst)
    end do
  end subroutine move_rounds

end module io_h5_file
