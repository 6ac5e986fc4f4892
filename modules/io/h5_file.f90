! SPDX-License-Identifier: MIT
!> Parallel HDF5 files: create, open, flush, close, groups.
!>
!> All procedures are collective. A file keeps its first error, after which calls have no effect, so
!> that a sequence of calls needs one test at its end; `close` returns it.
!>
!> Kinds of data in HDF5 files, data types, dataspaces and texts.
!>
!> Only the modules `h5_...` call HDF5. A negative status is a failure. Types in memory and in the
!> file are equal, as a conversion in HDF5 would break collective transfers.
module io_h5_file
  use, intrinsic :: iso_c_binding, only: c_int, c_null_char
  use, intrinsic :: iso_fortran_env, only: int64
  use base_disk, only: file_bytes, link_file, sync_file
  use base_errors, only: error_t
  use base_files, only: reason_of
  use base_kinds, only: i8
  use base_system, only: remove_file, rename_file
  use base_world, only: agree, world_t
  use hdf5, only: h5_integer_kind, h5eset_auto_f, h5f_acc_rdonly_f, h5f_acc_trunc_f, &
                  h5f_close_strong_f, h5f_scope_global_f, h5fclose_f, h5fcreate_f, &
                  h5fd_mpio_collective_f, h5fflush_f, h5fopen_f, h5gclose_f, h5gcreate_f, &
                  h5kind_to_type, h5open_f, h5p_dataset_xfer_f, h5p_file_access_f, &
                  h5p_file_create_f, h5pclose_f, h5pcreate_f, h5pset_dxpl_mpio_f, &
                  h5pset_fapl_mpio_f, h5pset_fclose_degree_f, h5pset_userblock_f, h5s_scalar_f, &
                  h5screate_f, h5screate_simple_f, h5t_c_s1, h5t_native_double, &
                  h5t_native_integer, h5t_native_real, h5t_std_u8le, h5t_str_nullpad_f, h5tcopy_f, &
                  h5tset_size_f, h5tset_strpad_f, hid_t, hsize_t, size_t
  use io_h5_seal, only: previous_of, seal, seal_bytes
  use mpi_f08, only: mpi_info_null
  implicit none (type, external)
  private

  public :: from_bytes, h5file_t, make_space, make_type, to_bytes

  !> An open file. A new file is named path.tmp until `close`.
  type :: h5file_t
    type(world_t) :: world
    type(error_t) :: error                 !! first error, the same on all ranks
    integer(hid_t) :: id = -1_hid_t         !! identifier of the file
    integer(hid_t) :: transfer = -1_hid_t   !! identifier of its transfer properties
    logical :: is_new = .false.            !! the file is to be written, not read
    logical :: packed = .false.            !! compress larger arrays
    integer(i8) :: bytes = 0               !! size of an existing file
    logical, private :: sealed = .false.   !! the file has a seal, and the previous file is kept
    character(:), allocatable, private :: path
  contains
    procedure :: create, open => open_old, flush => flush_file, close => close_file, group, verify
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

  ! Kinds of data in files, and bytes of each.
  integer, parameter, public :: kind_f64 = 1, kind_f32 = 2, kind_i64 = 3, kind_i32 = 4, &
                                kind_u8 = 5, kind_text = 6
  integer, parameter, public :: bytes_of(6) = [8, 4, 8, 4, 1, 1]

contains

  !> Create a file, `packed` with compressed large arrays. A `sealed` file gets a checksum, is
  !> flushed to disk before it gets its name, and the previous file is kept (io_h5_seal).
  subroutine create(self, world, path, packed, error, sealed)
    class(h5file_t), intent(out) :: self
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    logical, intent(in) :: packed
    type(error_t), intent(in) :: error   !! if set, nothing is written
    logical, intent(in), optional :: sealed

    self%world = world
    self%error = error
    self%is_new = .true.
    self%packed = packed
    if (present(sealed)) self%sealed = sealed
    if (error%is_set()) return
    self%path = trim(path)
    if (world%is_root()) call remove_file(self%path//'.tmp')   ! the path may be a link
    call world%barrier()
    call open_parallel(self, self%path//'.tmp', 'cannot be created')
  end subroutine create

  !> Open an existing file for reading.
  subroutine open_old(self, world, path, error)
    class(h5file_t), intent(out) :: self
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(error_t), intent(in) :: error   !! if set, nothing is read
    logical :: exists

    self%world = world
    self%error = error
    if (error%is_set()) return
    self%path = trim(path)
    call begin_writes()
    exists = .true.
    if (world%is_root()) inquire (file=self%path, exist=exists)
    call self%verify(merge(0, -1, exists), 'does not exist')
    if (self%error%is_set()) return
    self%bytes = file_bytes(self%path)
    call open_parallel(self, self%path, 'is not an HDF5 file, or it is damaged or cut short')
  end subroutine open_old

  !> Create or open a file on all ranks, without error messages of HDF5. A sealed file has space for
  !> the seal at its beginning.
  subroutine open_parallel(self, path, problem)
    class(h5file_t), intent(inout) :: self
    character(*), intent(in) :: path, problem
    integer(hid_t) :: access, layout
    integer :: status(12)

    status = 0
    call begin_writes()
    call h5open_f(status(1))
    if (status(1) >= 0) then
      call h5eset_auto_f(0, status(2))
      call h5pcreate_f(h5p_dataset_xfer_f, self%transfer, status(3))
      call h5pset_dxpl_mpio_f(self%transfer, h5fd_mpio_collective_f, status(4))
      call h5pcreate_f(h5p_file_access_f, access, status(5))
      call h5pset_fapl_mpio_f(access, self%world%comm%mpi_val, mpi_info_null%mpi_val, status(6))
      call h5pset_fclose_degree_f(access, h5f_close_strong_f, status(7))
      call h5pcreate_f(h5p_file_create_f, layout, status(8))
      call h5pset_userblock_f(layout, int(merge(seal_bytes, 0, self%sealed), hsize_t), status(9))
      if (self%is_new) then
        call h5fcreate_f(path, h5f_acc_trunc_f, self%id, status(10), layout, access)
      else
        call h5fopen_f(path, h5f_acc_rdonly_f, self%id, status(10), access_prp=access)
      end if
      if (status(10) < 0) self%id = -1_hid_t
      call h5pclose_f(layout, status(11))
      call h5pclose_f(access, status(12))
    end if
    call self%verify(minval(status), problem)
  end subroutine open_parallel

  !> Flush the file to disk.
  subroutine flush_file(self)
    class(h5file_t), intent(inout) :: self
    integer :: status

    if (self%error%is_set()) return
    call h5fflush_f(self%id, h5f_scope_global_f, status)
    call self%verify(status, 'cannot be written')
  end subroutine flush_file

  !> Close the file, also after an error. A new file gets its name if it is complete, otherwise it
  !> is removed.
  subroutine close_file(self, error)
    class(h5file_t), intent(inout) :: self
    type(error_t), intent(inout) :: error
    integer :: status(2)

    if (allocated(self%path)) then
      status = 0
      if (self%id >= 0) call h5fclose_f(self%id, status(1))
      if (self%transfer >= 0) call h5pclose_f(self%transfer, status(2))
      call self%verify(minval(status), 'cannot be closed')
      if (self%is_new .and. self%sealed .and. .not. self%error%is_set()) then
        call seal(self%world, self%path//'.tmp', self%error)
      end if
      if (self%is_new) call give_name(self)
      deallocate (self%path)
    end if
    if (self%error%is_set()) call error%raise(self%error%message)
  end subroutine close_file

  !> Rename a complete new file to its name, otherwise remove it.
  subroutine give_name(self)
    type(h5file_t), intent(inout) :: self
    logical :: is_good, ok

    ok = .true.
    is_good = .not. self%error%is_set()
    if (self%world%is_root()) then
      if (is_good .and. self%sealed) then
        ok = sync_file(self%path//'.tmp')
        if (ok) ok = link_file(self%path, previous_of(self%path))
      end if
      if (is_good .and. ok) call rename_file(self%path//'.tmp', self%path, ok)
      if (.not. (is_good .and. ok)) call remove_file(self%path//'.tmp')
      if (ok .and. self%sealed) then
        ok = sync_file(self%path(:index(self%path, '/', back=.true.))//'.')
      end if
    end if
    call self%verify(merge(0, -1, ok), 'cannot be written')
  end subroutine give_name

  !> Set the error of all ranks if `status` is negative or a write failed on any rank.
  subroutine verify(self, status, problem)
    class(h5file_t), intent(inout) :: self
    integer, intent(in) :: status
    character(*), intent(in) :: problem
    integer :: lost

    lost = lost_write()
    if (lost > 0) call self%error%raise(self%path//' cannot be written: '//reason_of(lost))
    if (lost < 0) call self%error%raise(self%path//' cannot be written: MPI refuses it')
    if (status < 0) call self%error%raise(self%path//' '//problem)
    call agree(self%world, self%error)
  end subroutine verify

  !> Make a group; the groups above must exist.
  subroutine group(self, name)
    class(h5file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t) :: id
    integer :: status(2)

    if (self%error%is_set()) return
    status = 0
    call h5gcreate_f(self%id, name, id, status(1))
    if (status(1) >= 0) call h5gclose_f(id, status(2))
    call self%verify(minval(status), 'cannot be written: '//name)
  end subroutine group

  !> Own copy of the HDF5 type of `kind`; `length` is that of texts.
  subroutine make_type(kind, length, id, status)
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length
    integer(hid_t), intent(out) :: id
    integer, intent(out) :: status
    integer(hid_t) :: predefined
    integer :: more(2)

    select case (kind)
    case (kind_f64); predefined = h5t_native_double
    case (kind_f32); predefined = h5t_native_real
    case (kind_i64); predefined = h5kind_to_type(int64, h5_integer_kind)
    case (kind_i32); predefined = h5t_native_integer
    case (kind_u8); predefined = h5t_std_u8le
    case default; predefined = h5t_c_s1
    end select
    call h5tcopy_f(predefined, id, status)
    if (kind /= kind_text) return
    call h5tset_size_f(id, int(max(1_i8, length), size_t), more(1))
    call h5tset_strpad_f(id, h5t_str_nullpad_f, more(2))
    status = min(status, minval(more))
  end subroutine make_type

  !> Dataspace of shape `dims`; no dimensions make a scalar.
  subroutine make_space(dims, id, status)
    integer(i8), intent(in) :: dims(:)
    integer(hid_t), intent(out) :: id
    integer, intent(out) :: status

    if (size(dims) == 0) then
      call h5screate_f(h5s_scalar_f, id, status)
    else
      call h5screate_simple_f(size(dims), int(dims, hsize_t), id, status)
    end if
  end subroutine make_space

  !> Characters of a text; a null character for an empty one.
  pure function to_bytes(text) result(bytes)
    character(*), intent(in) :: text
    character(1) :: bytes(max(1, len(text)))
    integer :: i

    bytes = c_null_char
    do i = 1, len(text)
      bytes(i) = text(i:i)
    end do
  end function to_bytes

  !> Text before the first null character.
  pure function from_bytes(bytes) result(text)
    character(1), intent(in) :: bytes(:)
    character(:), allocatable :: text
    integer :: i, n

    n = findloc(bytes /= c_null_char, .true., dim=1, back=.true.)
    allocate (character(n) :: text)
    do i = 1, n
      text(i:i) = bytes(i)
    end do
  end function from_bytes

end module io_h5_file
