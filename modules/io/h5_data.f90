! SPDX-License-Identifier: MIT
!> Arrays of any type and rank, and texts, in parallel HDF5 files.
!>
!> An array is distributed along its last dimension: the file has the columns of rank 0, then those
!> of rank 1, and so on; a rank may have none.
module io_h5_data
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: int8
  use base_kinds, only: i8, rp, sp
  use hdf5, only: h5d_fill_time_never_f, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dget_type_f, &
                  h5dopen_f, h5dread_f, h5dwrite_f, h5p_dataset_create_f, h5p_default_f, &
                  h5pclose_f, h5pcreate_f, h5pset_chunk_f, h5pset_deflate_f, h5pset_fill_time_f, &
                  h5pset_shuffle_f, h5s_select_set_f, h5sclose_f, h5sget_simple_extent_dims_f, &
                  h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, h5sselect_none_f, &
                  h5tclose_f, h5tget_size_f, hid_t, hsize_t, size_t
  use io_h5_file, only: bytes_of, from_bytes, h5file_t, kind_f32, kind_f64, kind_i32, kind_i64, &
                        kind_text, kind_u8, make_space, make_type, to_bytes
  use mpi_f08, only: mpi_allreduce, mpi_bcast, mpi_exscan, mpi_in_place, mpi_integer8, mpi_max, &
                     mpi_sum
  implicit none (type, external)
  private

  public :: extent, read_array, read_text, write_array, write_text

  integer(i8), parameter :: packed_from = 4096_i8        !! smaller arrays are not compressed
  integer(i8), parameter :: chunk_values = 131072_i8     !! values per compressed chunk
  integer, parameter :: deflate_level = 1                !! higher levels are slow with little gain
  integer(i8), parameter :: round_bytes = 536870912_i8   !! per round, as MPI counts are 32-bit

  !> An open dataset.
  type :: dataset_t
    integer(hid_t) :: id = -1_hid_t, type = -1_hid_t
    integer :: bytes = 1                 !! size of an element [bytes]
    logical :: packed = .false.          !! compress a new dataset
    integer(i8), allocatable :: dims(:)  !! shape of an existing dataset; no entries for a scalar
  end type dataset_t

  !> write_array(file, name, a): write the columns of all ranks.
  interface write_array
    module procedure write_f64, write_f32, write_i64, write_i32, write_u8
  end interface write_array

  !> read_array(file, name, first, a): read columns from `first` (from 0).
  interface read_array
    module procedure read_f64, read_f32, read_i64, read_i32, read_u8
  end interface read_array

contains

  !> Write the text of rank 0 as one string.
  subroutine write_text(file, name, text)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name, text
    character(1), allocatable, target :: bytes(:)
    type(dataset_t) :: dataset
    integer(i8) :: length, scalar(0)

    if (file%error%is_set()) return
    length = len(text)
    call mpi_bcast(length, 1, mpi_integer8, 0, file%world%comm)
    allocate (bytes, source=to_bytes(text))
    call make_dataset(file, name, kind_text, length, scalar, dataset)
    call move_data(file, name, dataset, 0_i8, scalar, c_loc(bytes))
    call close_dataset(dataset)
  end subroutine write_text

  !> Read a text on all ranks.
  subroutine read_text(file, name, text)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    character(:), allocatable, intent(out) :: text
    character(1), allocatable, target :: bytes(:)
    type(dataset_t) :: dataset
    integer(i8) :: scalar(0)
    integer(size_t) :: length
    integer :: status

    text = ''
    if (file%error%is_set()) return
    call open_dataset(file, name, kind_text, dataset, status)
    call file%verify(status, 'has no text '//name)
    if (.not. file%error%is_set()) then
      call h5tget_size_f(dataset%type, length, status)
      if (status < 0) length = 0
      allocate (bytes(max(1_size_t, length)))
      call move_data(file, name, dataset, 0_i8, scalar, c_loc(bytes))
      if (.not. file%error%is_set()) text = from_bytes(bytes)
    end if
    call close_dataset(dataset)
  end subroutine read_text

  !> Shape of an array of the file; an existing file with more values than bytes is an error.
  subroutine extent(file, name, dims)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), allocatable, intent(out) :: dims(:)
    type(dataset_t) :: dataset
    integer :: status
    logical :: fits

    allocate (dims(0))
    if (file%error%is_set()) return
    call open_dataset(file, name, kind_u8, dataset, status)
    fits = all(dataset%dims >= 0) .and. product(real(dataset%dims, rp)) <= real(file%bytes, rp)
    call file%verify(merge(status, -1, fits), 'has no array '//name//', or is damaged')
    if (.not. file%error%is_set()) dims = dataset%dims
    call close_dataset(dataset)
  end subroutine extent

  !> Write the columns of all ranks, with the local shape `dims` and the address `data`.
  subroutine put_columns(file, name, kind, dims, data)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: dims(:)
    type(c_ptr), intent(in) :: data
    type(dataset_t) :: dataset
    integer(i8) :: mine(size(dims)), whole(size(dims)), first
    integer :: r

    if (file%error%is_set()) return
    r = size(dims)
    mine = max(0_i8, dims)   ! gfortran has negative extents of empty arrays of assumed rank
    whole = mine
    call mpi_allreduce(mpi_in_place, whole(r), 1, mpi_integer8, mpi_sum, file%world%comm)
    first = 0
    call mpi_exscan(mine(r), first, 1, mpi_integer8, mpi_sum, file%world%comm)
    if (file%world%is_root()) first = 0
    call make_dataset(file, name, kind, 0_i8, whole, dataset)
    call move_data(file, name, dataset, first, mine, data)
    call close_dataset(dataset)
  end subroutine put_columns

  !> Read columns from `first` into memory of shape `dims`.
  subroutine get_columns(file, name, kind, first, dims, data)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: first, dims(:)
    type(c_ptr), intent(in) :: data
    type(dataset_t) :: dataset
    integer(i8) :: mine(size(dims))
    integer :: r, status
    logical :: fits

    if (file%error%is_set()) return
    r = size(dims)
    mine = max(0_i8, dims)   ! gfortran has negative extents of empty arrays of assumed rank
    call open_dataset(file, name, kind, dataset, status)
    fits = size(dataset%dims) == r
    if (fits) fits = all(dataset%dims(:r - 1) == mine(:r - 1)) .and. first >= 0 &
                     .and. first + mine(r) <= dataset%dims(r)
    call file%verify(merge(status, -1, fits), 'has no array '//name//' of the shape expected')
    call move_data(file, name, dataset, first, mine, data)
    call close_dataset(dataset)
  end subroutine get_columns

  !> Create a dataset; `length` is that of texts.
  subroutine make_dataset(file, name, kind, length, dims, dataset)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length, dims(:)
    type(dataset_t), intent(out) :: dataset
    integer(hid_t) :: space, layout
    integer(hsize_t) :: chunk(size(dims))
    integer :: r, status(10)

    status = 0
    dataset%bytes = bytes_of(kind)
    dataset%packed = file%packed .and. product(dims) >= packed_from
    call make_type(kind, length, dataset%type, status(1))
    call make_space(dims, space, status(2))
    call h5pcreate_f(h5p_dataset_create_f, layout, status(3))
    call h5pset_fill_time_f(layout, h5d_fill_time_never_f, status(4))
    if (dataset%packed) then   ! compressed chunks of whole columns
      r = size(dims)
      chunk = dims
      chunk(r) = min(dims(r), max(1_i8, chunk_values/product(dims(:r - 1))))
      call h5pset_chunk_f(layout, r, chunk, status(5))
      call h5pset_shuffle_f(layout, status(6))
      call h5pset_deflate_f(layout, deflate_level, status(7))
    end if
    if (all(status >= 0)) then
      call h5dcreate_f(file%id, name, dataset%type, space, dataset%id, status(8), dcpl_id=layout)
      if (status(8) < 0) dataset%id = -1_hid_t
    end if
    call h5pclose_f(layout, status(9))
    call h5sclose_f(space, status(10))
    call file%verify(minval(status), 'cannot be written: '//name)
  end subroutine make_dataset

  !> Open a dataset for reading as `kind`; texts with their stored length.
  subroutine open_dataset(file, name, kind, dataset, worst)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    type(dataset_t), intent(out) :: dataset
    integer, intent(out) :: worst
    integer(hsize_t), allocatable :: dims(:), most(:)
    integer(hid_t) :: space
    integer :: n, status(6)

    status = 0
    dataset%bytes = bytes_of(kind)
    call h5dopen_f(file%id, name, dataset%id, status(1))
    if (status(1) < 0) then
      dataset%id = -1_hid_t
      allocate (dataset%dims(0))
      worst = -1
      return
    end if
    if (kind == kind_text) then
      call h5dget_type_f(dataset%id, dataset%type, status(2))
    else
      call make_type(kind, 0_i8, dataset%type, status(2))
    end if
    call h5dget_space_f(dataset%id, space, status(3))
    call h5sget_simple_extent_ndims_f(space, n, status(4))
    if (status(4) < 0) n = 0
    allocate (dims(n), most(n), source=0_hsize_t)
    if (n > 0) call h5sget_simple_extent_dims_f(space, dims, most, status(5))
    dataset%dims = int(dims, i8)
    call h5sclose_f(space, status(6))
    worst = minval(status)
  end subroutine open_dataset

  subroutine close_dataset(dataset)
    type(dataset_t), intent(in) :: dataset
    integer :: status

    if (dataset%id >= 0) call h5dclose_f(dataset%id, status)
    if (dataset%type >= 0) call h5tclose_f(dataset%type, status)
  end subroutine close_dataset

  !> Move columns from `first`, in as many rounds as the rank with the most columns needs, or a
  !> scalar.
  subroutine move_data(file, name, dataset, first, dims, data)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    type(dataset_t), intent(in) :: dataset
    integer(i8), intent(in) :: first, dims(:)
    type(c_ptr), intent(in) :: data
    integer(int8), pointer, contiguous :: memory(:)
    integer(int8), target :: nothing(8)
    integer(i8) :: width, n, step, most_columns, done, m
    type(c_ptr) :: here
    integer :: r, worst

    if (file%error%is_set()) return
    worst = 0
    r = size(dims)
    if (r == 0) then
      call move_columns(file, dataset, 0_i8, dims, data, worst)
    else
      n = dims(r)
      width = dataset%bytes*product(dims(:r - 1))
      call c_f_pointer(data, memory, [n*width])
      step = max(1_i8, round_bytes/max(1_i8, width))
      most_columns = n
      call mpi_allreduce(mpi_in_place, most_columns, 1, mpi_integer8, mpi_max, file%world%comm)
      do done = 0, most_columns - 1, step
        m = max(0_i8, min(step, n - done))
        here = c_loc(nothing)
        if (m*width > 0) here = c_loc(memory(done*width + 1))
        call move_columns(file, dataset, first + done, [dims(:r - 1), m], here, worst)
      end do
    end if
    call file%verify(worst, trim(merge('cannot be written: ', 'cannot be read:    ', &
                                       file%is_new))//' '//name)
  end subroutine move_data

  !> Write or read columns from `first` of shape `dims`; a rank without columns selects nothing. A
  !> scalar is written by rank 0. Compressed data are written collectively, as HDF5 requires; other
  !> data independently, as their pieces are contiguous.
  subroutine move_columns(file, dataset, first, dims, data, worst)
    type(h5file_t), intent(in) :: file
    type(dataset_t), intent(in) :: dataset
    integer(i8), intent(in) :: first, dims(:)
    type(c_ptr), intent(in) :: data
    integer, intent(inout) :: worst
    type(c_ptr) :: address   ! HDF5 needs a variable
    integer(hid_t) :: space, memory, how
    integer(hsize_t) :: start(size(dims)), count(size(dims))
    integer :: r, status(7)

    status = 0
    r = size(dims)
    count = max(1_hsize_t, int(dims, hsize_t))
    start = 0
    if (r > 0) start(r) = first
    call make_space(int(count, i8), memory, status(1))
    call h5dget_space_f(dataset%id, space, status(2))
    if (product(dims) == 0 .or. (r == 0 .and. file%is_new .and. .not. file%world%is_root())) then
      call h5sselect_none_f(memory, status(3))
      call h5sselect_none_f(space, status(4))
    else if (r > 0) then
      call h5sselect_hyperslab_f(space, h5s_select_set_f, start, count, status(3))
    end if
    address = data
    how = h5p_default_f
    if (dataset%packed) how = file%transfer
    if (file%is_new) then
      call h5dwrite_f(dataset%id, dataset%type, address, status(5), memory, space, how)
    else
      call h5dread_f(dataset%id, dataset%type, address, status(5), memory, space, how)
    end if
    call h5sclose_f(memory, status(6))
    call h5sclose_f(space, status(7))
    worst = min(worst, minval(status))
  end subroutine move_columns

  subroutine write_f64(file, name, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    real(rp), intent(in), target, contiguous :: a(..)

    call put_columns(file, name, kind_f64, shape(a, i8), c_loc(a))
  end subroutine write_f64

  subroutine write_f32(file, name, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    real(sp), intent(in), target, contiguous :: a(..)

    call put_columns(file, name, kind_f32, shape(a, i8), c_loc(a))
  end subroutine write_f32

  subroutine write_i64(file, name, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in), target, contiguous :: a(..)

    call put_columns(file, name, kind_i64, shape(a, i8), c_loc(a))
  end subroutine write_i64

  subroutine write_i32(file, name, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in), target, contiguous :: a(..)

    call put_columns(file, name, kind_i32, shape(a, i8), c_loc(a))
  end subroutine write_i32

  subroutine write_u8(file, name, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(int8), intent(in), target, contiguous :: a(..)

    call put_columns(file, name, kind_u8, shape(a, i8), c_loc(a))
  end subroutine write_u8

  subroutine read_f64(file, name, first, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    real(rp), intent(inout), target, contiguous :: a(..)

    call get_columns(file, name, kind_f64, first, shape(a, i8), c_loc(a))
  end subroutine read_f64

  subroutine read_f32(file, name, first, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    real(sp), intent(inout), target, contiguous :: a(..)

    call get_columns(file, name, kind_f32, first, shape(a, i8), c_loc(a))
  end subroutine read_f32

  subroutine read_i64(file, name, first, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    integer(i8), intent(inout), target, contiguous :: a(..)

    call get_columns(file, name, kind_i64, first, shape(a, i8), c_loc(a))
  end subroutine read_i64

  subroutine read_i32(file, name, first, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    integer, intent(inout), target, contiguous :: a(..)

    call get_columns(file, name, kind_i32, first, shape(a, i8), c_loc(a))
  end subroutine read_i32

  subroutine read_u8(file, name, first, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    integer(int8), intent(inout), target, contiguous :: a(..)

    call get_columns(file, name, kind_u8, first, shape(a, i8), c_loc(a))
  end subroutine read_u8

end module io_h5_data
