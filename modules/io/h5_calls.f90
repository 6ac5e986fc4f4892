! SPDX-License-Identifier: MIT
!> Calls of HDF5 for files, groups, datasets and attributes, with identifiers and addresses
!> (io_h5_types).
module io_h5_calls
  use, intrinsic :: iso_c_binding, only: c_ptr
  use base_kinds, only: i8
  use hdf5, only: h5aclose_f, h5acreate_by_name_f, h5aexists_by_name_f, h5aget_space_f, &
                  h5aget_type_f, h5aopen_by_name_f, h5aread_f, h5awrite_f, h5d_fill_time_never_f, &
                  h5dclose_f, h5dcreate_f, h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f, &
                  h5dwrite_f, h5eset_auto_f, h5f_acc_rdonly_f, h5f_acc_trunc_f, &
                  h5f_close_strong_f, h5f_scope_global_f, h5fclose_f, h5fcreate_f, &
                  h5fd_mpio_collective_f, h5fflush_f, h5fopen_f, h5gclose_f, h5gcreate_f, &
                  h5open_f, h5p_dataset_create_f, h5p_dataset_xfer_f, h5p_default_f, &
                  h5p_file_access_f, h5p_file_create_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, &
                  h5pset_deflate_f, h5pset_dxpl_mpio_f, h5pset_fapl_mpio_f, &
                  h5pset_fclose_degree_f, h5pset_fill_time_f, h5pset_shuffle_f, &
                  h5pset_userblock_f, h5s_select_set_f, h5sclose_f, &
                  h5sget_simple_extent_npoints_f, h5sselect_hyperslab_f, h5sselect_none_f, &
                  h5tclose_f, h5tget_size_f, hid_t, hsize_t, size_t
  use io_h5_types, only: bytes_of, handle_t, kind_text, make_space, make_type, space_shape
  use mpi_f08, only: mpi_comm, mpi_info_null
  implicit none (type, external)
  private

  public :: open_parallel, flush_parallel, close_parallel, make_group
  public :: attribute_shape, get_attribute, make_attribute
  public :: make_dataset, open_dataset, close_dataset, dataset_shape, text_length, move_columns

  integer(i8), parameter :: chunk_values = 131072_i8   !! values per compressed chunk
  integer, parameter :: deflate_level = 1              !! higher levels are slow with little gain

contains

  !> Create (is_new) or open a file on all ranks of `comm`, without error messages of HDF5. A new
  !> file leaves `free` bytes at its beginning, 0 or a power of two from 512.
  subroutine open_parallel(comm, path, is_new, file, worst, free)
    type(mpi_comm), intent(in) :: comm
    character(*), intent(in) :: path
    logical, intent(in) :: is_new
    type(handle_t), intent(out) :: file
    integer, intent(inout) :: worst
    integer, intent(in), optional :: free
    integer(hid_t) :: access, layout
    integer :: ierr, status(8)

    file%is_new = is_new
    call h5open_f(ierr)
    worst = min(worst, ierr)
    if (worst < 0) return
    call h5eset_auto_f(0, status(1))
    call h5pcreate_f(h5p_dataset_xfer_f, file%extra, status(2))
    call h5pset_dxpl_mpio_f(file%extra, h5fd_mpio_collective_f, status(3))
    call h5pcreate_f(h5p_file_access_f, access, status(4))
    call h5pset_fapl_mpio_f(access, comm%mpi_val, mpi_info_null%mpi_val, status(5))
    call h5pset_fclose_degree_f(access, h5f_close_strong_f, status(6))
    call h5pcreate_f(h5p_file_create_f, layout, status(7))
    status(8) = 0
    if (present(free)) call h5pset_userblock_f(layout, int(free, hsize_t), status(8))
    worst = min(worst, minval(status))
    if (is_new) then
      call h5fcreate_f(path, h5f_acc_trunc_f, file%id, ierr, layout, access)
    else
      call h5fopen_f(path, h5f_acc_rdonly_f, file%id, ierr, access_prp=access)
    end if
    worst = min(worst, ierr)
    if (ierr < 0) file%id = -1_hid_t
    call h5pclose_f(layout, ierr)
    call h5pclose_f(access, ierr)
  end subroutine open_parallel

  !> Flush a file to disk.
  subroutine flush_parallel(file, worst)
    type(handle_t), intent(in) :: file
    integer, intent(inout) :: worst
    integer :: ierr

    call h5fflush_f(file%id, h5f_scope_global_f, ierr)
    worst = min(worst, ierr)
  end subroutine flush_parallel

  subroutine close_parallel(file, worst)
    type(handle_t), intent(inout) :: file
    integer, intent(inout) :: worst
    integer :: ierr

    if (file%id >= 0) then
      call h5fclose_f(file%id, ierr)
      worst = min(worst, ierr)
    end if
    if (file%extra >= 0) call h5pclose_f(file%extra, ierr)
    file = handle_t()
  end subroutine close_parallel

  subroutine make_group(file, name, worst)
    type(handle_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(inout) :: worst
    integer(hid_t) :: id
    integer :: ierr

    call h5gcreate_f(file%id, name, id, ierr)
    worst = min(worst, ierr)
    if (ierr >= 0) call h5gclose_f(id, ierr)
  end subroutine make_group

  !> Create a dataset; `length` is that of texts, `packed` compresses.
  subroutine make_dataset(file, name, kind, length, dims, packed, dataset, worst)
    type(handle_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length, dims(:)
    logical, intent(in) :: packed
    type(handle_t), intent(out) :: dataset
    integer, intent(inout) :: worst
    integer(hid_t) :: space, layout
    integer :: ierr

    dataset%is_new = .true.
    dataset%packed = packed
    if (kind /= kind_text) dataset%bytes = bytes_of(kind)
    call make_type(kind, length, dataset%extra, worst)
    call make_space(int(dims, hsize_t), space, worst)
    call h5pcreate_f(h5p_dataset_create_f, layout, ierr)
    worst = min(worst, ierr)
    call h5pset_fill_time_f(layout, h5d_fill_time_never_f, ierr)
    worst = min(worst, ierr)
    if (packed) call pack_chunks(layout, int(dims, hsize_t), worst)
    if (worst >= 0) then
      call h5dcreate_f(file%id, name, dataset%extra, space, dataset%id, ierr, dcpl_id=layout)
      worst = min(worst, ierr)
      if (ierr < 0) dataset%id = -1_hid_t
    end if
    call h5pclose_f(layout, ierr)
    call h5sclose_f(space, ierr)
  end subroutine make_dataset

  !> Set compressed chunks of whole columns.
  subroutine pack_chunks(layout, dims, worst)
    integer(hid_t), intent(in) :: layout
    integer(hsize_t), intent(in) :: dims(:)
    integer, intent(inout) :: worst
    integer(hsize_t) :: chunk(size(dims))
    integer :: status(3), r

    r = size(dims)
    chunk = dims
    chunk(r) = min(dims(r), max(1_i8, chunk_values/product(dims(:r - 1))))
    call h5pset_chunk_f(layout, r, chunk, status(1))
    call h5pset_shuffle_f(layout, status(2))
    call h5pset_deflate_f(layout, deflate_level, status(3))
    worst = min(worst, minval(status))
  end subroutine pack_chunks

  !> Open a dataset for reading as `kind`; texts with their stored length.
  subroutine open_dataset(file, name, kind, dataset, worst)
    type(handle_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    type(handle_t), intent(out) :: dataset
    integer, intent(inout) :: worst
    integer :: ierr

    if (kind /= kind_text) dataset%bytes = bytes_of(kind)
    call h5dopen_f(file%id, name, dataset%id, ierr)
    worst = min(worst, ierr)
    if (ierr < 0) then
      dataset%id = -1_hid_t
    else if (kind == kind_text) then
      call h5dget_type_f(dataset%id, dataset%extra, ierr)
      worst = min(worst, ierr)
    else
      call make_type(kind, 0_i8, dataset%extra, worst)
    end if
  end subroutine open_dataset

  subroutine close_dataset(dataset)
    type(handle_t), intent(inout) :: dataset
    integer :: ierr

    if (dataset%id >= 0) call h5dclose_f(dataset%id, ierr)
    if (dataset%extra >= 0) call h5tclose_f(dataset%extra, ierr)
    dataset = handle_t()
  end subroutine close_dataset

  subroutine dataset_shape(dataset, dims, worst)
    type(handle_t), intent(in) :: dataset
    integer(i8), allocatable, intent(out) :: dims(:)
    integer, intent(inout) :: worst
    integer(hsize_t), allocatable :: shape(:)
    integer(hid_t) :: space
    integer :: ierr

    call h5dget_space_f(dataset%id, space, ierr)
    worst = min(worst, ierr)
    call space_shape(space, shape, worst)
    dims = int(shape, i8)
    call h5sclose_f(space, ierr)
  end subroutine dataset_shape

  !> Length of a text dataset [characters].
  integer(i8) function text_length(dataset)
    type(handle_t), intent(in) :: dataset
    integer(size_t) :: n
    integer :: ierr

    call h5tget_size_f(dataset%extra, n, ierr)
    text_length = 0
    if (ierr >= 0) text_length = int(n, i8)
  end function text_length

  !> Write (new dataset) or read columns from `first` of shape `dims`; a rank without columns
  !> selects nothing. Without dimensions a scalar is moved, if `mine`. Compressed data are written
  !> collectively, as HDF5 requires; other data independently, as their pieces are contiguous.
  subroutine move_columns(file, dataset, first, dims, mine, data, worst)
    type(handle_t), intent(in) :: file, dataset
    integer(i8), intent(in) :: first, dims(:)
    logical, intent(in) :: mine
    type(c_ptr), intent(in) :: data
    integer, intent(inout) :: worst
    type(c_ptr) :: address   ! HDF5 needs a variable
    integer(hid_t) :: space, memory, how
    integer(hsize_t) :: start(size(dims)), count(size(dims))
    integer :: ierr

    count = max(1_hsize_t, int(dims, hsize_t))
    start = 0
    if (size(dims) > 0) start(size(dims)) = first
    call make_space(count, memory, worst)
    call h5dget_space_f(dataset%id, space, ierr)
    worst = min(worst, ierr)
    if (.not. mine .or. product(dims) == 0) then
      call h5sselect_none_f(memory, ierr)
      worst = min(worst, ierr)
      call h5sselect_none_f(space, ierr)
      worst = min(worst, ierr)
    else if (size(dims) > 0) then
      call h5sselect_hyperslab_f(space, h5s_select_set_f, start, count, ierr)
      worst = min(worst, ierr)
    end if
    address = data
    how = h5p_default_f
    if (dataset%packed) how = file%extra
    if (dataset%is_new) then
      call h5dwrite_f(dataset%id, dataset%extra, address, ierr, memory, space, how)
    else
      call h5dread_f(dataset%id, dataset%extra, address, ierr, memory, space, how)
    end if
    worst = min(worst, ierr)
    call h5sclose_f(memory, ierr)
    call h5sclose_f(space, ierr)
  end subroutine move_columns

  !> Write attribute `name` of the object at `place`, with the same data on all ranks.
  subroutine make_attribute(file, place, name, kind, length, dims, data, worst)
    type(handle_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length, dims(:)
    type(c_ptr), intent(in) :: data
    integer, intent(inout) :: worst
    integer(hid_t) :: type, space, id
    integer :: ierr

    call make_type(kind, length, type, worst)
    call make_space(int(dims, hsize_t), space, worst)
    call h5acreate_by_name_f(file%id, place, name, type, space, id, ierr)
    worst = min(worst, ierr)
    if (ierr >= 0) then
      call h5awrite_f(id, type, data, ierr)
      worst = min(worst, ierr)
      call h5aclose_f(id, ierr)
    end if
    call h5sclose_f(space, ierr)
    call h5tclose_f(type, ierr)
  end subroutine make_attribute

  !> Number of values of an attribute (-1 if there is none) and bytes of each.
  subroutine attribute_shape(file, place, name, n, bytes, worst)
    type(handle_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer(i8), intent(out) :: n, bytes
    integer, intent(inout) :: worst
    integer(hid_t) :: id, type, space
    integer(size_t) :: width
    integer(hsize_t) :: points
    logical :: exists
    integer :: ierr, status(4)

    n = -1
    bytes = 0
    call h5aexists_by_name_f(file%id, place, name, exists, ierr)
    worst = min(worst, ierr)
    if (ierr < 0 .or. .not. exists) return
    call h5aopen_by_name_f(file%id, place, name, id, ierr)
    worst = min(worst, ierr)
    if (ierr < 0) return
    call h5aget_space_f(id, space, status(1))
    call h5sget_simple_extent_npoints_f(space, points, status(2))
    call h5aget_type_f(id, type, status(3))
    call h5tget_size_f(type, width, status(4))
    worst = min(worst, minval(status))
    n = int(points, i8)
    bytes = int(width, i8)
    call h5tclose_f(type, ierr)
    call h5sclose_f(space, ierr)
    call h5aclose_f(id, ierr)
  end subroutine attribute_shape

  !> Read the values of an attribute as `kind` (texts with `length` bytes each).
  subroutine get_attribute(file, place, name, kind, length, data, worst)
    type(handle_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length
    type(c_ptr), intent(in) :: data
    integer, intent(inout) :: worst
    type(c_ptr) :: address
    integer(hid_t) :: id, type
    integer :: ierr

    address = data
    call h5aopen_by_name_f(file%id, place, name, id, ierr)
    worst = min(worst, ierr)
    if (ierr < 0) return
    call make_type(kind, length, type, worst)
    call h5aread_f(id, type, address, ierr)
    worst = min(worst, ierr)
    call h5tclose_f(type, ierr)
    call h5aclose_f(id, ierr)
  end subroutine get_attribute

end module io_h5_calls
