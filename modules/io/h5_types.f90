! SPDX-License-Identifier: MIT
!> Types of HDF5: kinds of data, handles of files and datasets, data types and dataspaces.
!>
!> Only this module and io_h5_calls call HDF5. Procedures set `worst` below zero on failure. Types
!> in memory and in the file are equal, as a conversion in HDF5 would break collective transfers.
module io_h5_types
  use, intrinsic :: iso_fortran_env, only: int64
  use base_kinds, only: i8
  use hdf5, only: h5_integer_kind, h5kind_to_type, h5s_scalar_f, h5screate_f, h5screate_simple_f, &
                  h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5t_c_s1, &
                  h5t_native_double, h5t_native_integer, h5t_native_real, h5t_std_u8le, &
                  h5t_str_nullpad_f, h5tcopy_f, h5tset_size_f, h5tset_strpad_f, hid_t, hsize_t, &
                  size_t
  implicit none (type, external)
  private

  public :: handle_t, make_space, make_type, space_shape

  ! Kinds of data in files.
  integer, parameter, public :: kind_f64 = 1, kind_f32 = 2, kind_i64 = 3, kind_i32 = 4, &
                                kind_u8 = 5, kind_text = 6
  integer, parameter, public :: bytes_of(5) = [8, 4, 8, 4, 1]

  !> An open file or dataset.
  type :: handle_t
    integer(hid_t) :: id = -1_hid_t
    integer(hid_t) :: extra = -1_hid_t   !! transfer properties of a file, type of a dataset
    integer :: bytes = 1                 !! size of an element of a dataset [bytes]
    logical :: packed = .false.          !! a new dataset is compressed
    logical :: is_new = .false.          !! to be written, not read
  end type handle_t

contains

  !> Own copy of the HDF5 type of `kind`; `length` is that of texts.
  subroutine make_type(kind, length, id, worst)
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length
    integer(hid_t), intent(out) :: id
    integer, intent(inout) :: worst
    integer(hid_t) :: predefined
    integer :: ierr

    select case (kind)
    case (kind_f64); predefined = h5t_native_double
    case (kind_f32); predefined = h5t_native_real
    case (kind_i64); predefined = h5kind_to_type(int64, h5_integer_kind)
    case (kind_i32); predefined = h5t_native_integer
    case (kind_u8); predefined = h5t_std_u8le
    case default; predefined = h5t_c_s1
    end select
    call h5tcopy_f(predefined, id, ierr)
    worst = min(worst, ierr)
    if (kind /= kind_text) return
    call h5tset_size_f(id, int(max(1_i8, length), size_t), ierr)
    worst = min(worst, ierr)
    call h5tset_strpad_f(id, h5t_str_nullpad_f, ierr)
    worst = min(worst, ierr)
  end subroutine make_type

  !> Dataspace of shape `dims`; no dimensions make a scalar.
  subroutine make_space(dims, id, worst)
    integer(hsize_t), intent(in) :: dims(:)
    integer(hid_t), intent(out) :: id
    integer, intent(inout) :: worst
    integer :: ierr

    if (size(dims) == 0) then
      call h5screate_f(h5s_scalar_f, id, ierr)
    else
      call h5screate_simple_f(size(dims), dims, id, ierr)
    end if
    worst = min(worst, ierr)
  end subroutine make_space

  !> Shape of a dataspace; `dims` has no entries for a scalar.
  subroutine space_shape(space, dims, worst)
    integer(hid_t), intent(in) :: space
    integer(hsize_t), allocatable, intent(out) :: dims(:)
    integer, intent(inout) :: worst
    integer(hsize_t), allocatable :: most(:)
    integer :: n, ierr

    call h5sget_simple_extent_ndims_f(space, n, ierr)
    worst = min(worst, ierr)
    if (ierr < 0) n = 0
    allocate (dims(n), most(n), source=0_hsize_t)
    if (n == 0) return
    call h5sget_simple_extent_dims_f(space, dims, most, ierr)
    worst = min(worst, ierr)
  end subroutine space_shape

end module io_h5_types
