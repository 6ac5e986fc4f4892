! SPDX-License-Identifier: MIT
!> Typed arrays of any rank in parallel HDF5 files.
module io_h5_arrays
  use, intrinsic :: iso_c_binding, only: c_loc
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_kinds, only: i8, rp, sp
  use io_h5_file, only: h5file_t
  use io_h5_types, only: kind_f32, kind_f64, kind_i32, kind_i64, kind_u8
  implicit none (type, external)
  private

  public :: write_array, read_array

  !> write_array(file, name, a, error): write the columns of all ranks.
  interface write_array
    module procedure write_f64, write_f32, write_i64, write_i32, write_u8
  end interface write_array

  !> read_array(file, name, first, a, error): read columns from `first` (from 0).
  interface read_array
    module procedure read_f64, read_f32, read_i64, read_i32, read_u8
  end interface read_array

contains

  subroutine write_f64(file, name, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    real(rp), intent(in), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%put_columns(name, kind_f64, extents(shape(a, i8)), c_loc(a), error)
  end subroutine write_f64

  subroutine write_f32(file, name, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    real(sp), intent(in), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%put_columns(name, kind_f32, extents(shape(a, i8)), c_loc(a), error)
  end subroutine write_f32

  subroutine write_i64(file, name, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%put_columns(name, kind_i64, extents(shape(a, i8)), c_loc(a), error)
  end subroutine write_i64

  subroutine write_i32(file, name, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(in), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%put_columns(name, kind_i32, extents(shape(a, i8)), c_loc(a), error)
  end subroutine write_i32

  subroutine write_u8(file, name, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(int8), intent(in), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%put_columns(name, kind_u8, extents(shape(a, i8)), c_loc(a), error)
  end subroutine write_u8

  subroutine read_f64(file, name, first, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    real(rp), intent(inout), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%get_columns(name, kind_f64, first, extents(shape(a, i8)), c_loc(a), error)
  end subroutine read_f64

  subroutine read_f32(file, name, first, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    real(sp), intent(inout), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%get_columns(name, kind_f32, first, extents(shape(a, i8)), c_loc(a), error)
  end subroutine read_f32

  subroutine read_i64(file, name, first, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    integer(i8), intent(inout), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%get_columns(name, kind_i64, first, extents(shape(a, i8)), c_loc(a), error)
  end subroutine read_i64

  subroutine read_i32(file, name, first, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    integer, intent(inout), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%get_columns(name, kind_i32, first, extents(shape(a, i8)), c_loc(a), error)
  end subroutine read_i32

  subroutine read_u8(file, name, first, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer(i8), intent(in) :: first
    integer(int8), intent(inout), target, contiguous :: a(..)
    type(error_t), intent(inout) :: error

    call file%get_columns(name, kind_u8, first, extents(shape(a, i8)), c_loc(a), error)
  end subroutine read_u8

  !> Shape with negative extents set to 0, as gfortran reports for empty arrays of assumed rank.
  pure function extents(dims)
    integer(i8), intent(in) :: dims(:)
    integer(i8) :: extents(size(dims))

    extents = max(0_i8, dims)
  end function extents

end module io_h5_arrays
