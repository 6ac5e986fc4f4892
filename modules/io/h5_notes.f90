! SPDX-License-Identifier: MIT
!> Typed arrays of any rank, texts and attributes of parallel HDF5 files.
module io_h5_notes
  use, intrinsic :: iso_c_binding, only: c_loc, c_null_char, c_ptr
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_kinds, only: i8, rp, sp
  use base_text, only: str
  use io_h5_calls, only: attribute_shape, close_dataset, get_attribute, make_attribute, &
                         make_dataset, move_columns, open_dataset, text_length
  use io_h5_file, only: h5file_t
  use io_h5_types, only: handle_t, kind_f32, kind_f64, kind_i32, kind_i64, kind_text, kind_u8
  use mpi_f08, only: mpi_bcast, mpi_integer8
  implicit none (type, external)
  private

  public :: has_attribute, read_array, read_attribute, read_text, write_array, write_attribute, &
            write_text

  !> write_attribute(file, place, name, value, error): attribute of the object at `place` ('/' is
  !> the file); a number, numbers, a text or texts, the same on all ranks.
  interface write_attribute
    module procedure write_reals, write_integers, write_word, write_words
  end interface write_attribute

  !> read_attribute(file, place, name, value, error): numbers of known shape, or a text.
  interface read_attribute
    module procedure read_reals, read_integers, read_word
  end interface read_attribute

  !> write_array(file, name, a, error): write the columns of all ranks.
  interface write_array
    module procedure write_f64, write_f32, write_i64, write_i32, write_u8
  end interface write_array

  !> read_array(file, name, first, a, error): read columns from `first` (from 0).
  interface read_array
    module procedure read_f64, read_f32, read_i64, read_i32, read_u8
  end interface read_array

contains

  !> Write the text of rank 0 as one string.
  subroutine write_text(file, name, text, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name, text
    type(error_t), intent(inout) :: error
    character(1), allocatable, target :: bytes(:)
    type(handle_t) :: dataset
    integer(i8) :: length, scalar(0)
    integer :: worst

    if (error%is_set()) return
    length = len(text)
    call mpi_bcast(length, 1, mpi_integer8, 0, file%world%comm)
    bytes = to_bytes(text)
    worst = 0
    call make_dataset(file%handle, name, kind_text, length, scalar, .false., dataset, worst)
    call file%verify(worst, 'cannot be written: '//name, error)
    if (.not. error%is_set()) then
      call move_columns(file%handle, dataset, 0_i8, scalar, file%world%is_root(), c_loc(bytes), &
                        worst)
      call file%verify(worst, 'cannot be written: '//name, error)
    end if
    call close_dataset(dataset)
  end subroutine write_text

  !> Read a text on all ranks.
  subroutine read_text(file, name, text, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    character(:), allocatable, intent(out) :: text
    type(error_t), intent(inout) :: error
    character(1), allocatable, target :: bytes(:)
    type(handle_t) :: dataset
    integer(i8) :: scalar(0)
    integer :: worst

    text = ''
    if (error%is_set()) return
    worst = 0
    call open_dataset(file%handle, name, kind_text, dataset, worst)
    call file%verify(worst, 'has no text '//name, error)
    if (.not. error%is_set()) then
      allocate (bytes(max(1_i8, text_length(dataset))))
      call move_columns(file%handle, dataset, 0_i8, scalar, .true., c_loc(bytes), worst)
      call file%verify(worst, 'cannot be read: '//name, error)
      if (.not. error%is_set()) text = from_bytes(bytes)
    end if
    call close_dataset(dataset)
  end subroutine read_text

  subroutine write_reals(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    real(rp), intent(in), target, contiguous :: value(..)
    type(error_t), intent(inout) :: error

    call put_attribute(file, place, name, kind_f64, 0, shape(value, i8), c_loc(value), error)
  end subroutine write_reals

  subroutine write_integers(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(in), target, contiguous :: value(..)
    type(error_t), intent(inout) :: error

    call put_attribute(file, place, name, kind_i32, 0, shape(value, i8), c_loc(value), error)
  end subroutine write_integers

  subroutine write_word(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name, value
    type(error_t), intent(inout) :: error
    character(1), allocatable, target :: bytes(:)
    integer(i8) :: scalar(0)

    allocate (bytes, source=to_bytes(value))
    call put_attribute(file, place, name, kind_text, len(value), scalar, c_loc(bytes), error)
  end subroutine write_word

  subroutine write_words(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name, value(:)
    type(error_t), intent(inout) :: error
    character(1), allocatable, target :: bytes(:)
    integer :: k, length

    length = max(1, maxval([0, len_trim(value)]))
    allocate (bytes(length*size(value)), source=c_null_char)
    do k = 1, size(value)
      associate (n => len_trim(value(k)), first => length*(k - 1))
        if (n > 0) bytes(first + 1:first + n) = to_bytes(value(k)(:n))
      end associate
    end do
    call put_attribute(file, place, name, kind_text, length, shape(value, i8), c_loc(bytes), error)
  end subroutine write_words

  subroutine put_attribute(file, place, name, kind, length, dims, data, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind, length
    integer(i8), intent(in) :: dims(:)
    type(c_ptr), intent(in) :: data
    type(error_t), intent(inout) :: error
    integer :: worst

    if (error%is_set()) return
    worst = 0
    call make_attribute(file%handle, place, name, kind, int(length, i8), dims, data, worst)
    call file%verify(worst, 'cannot be written: '//name, error)
  end subroutine put_attribute

  !> True if the object at `place` has an attribute `name`; false after an error too.
  logical function has_attribute(file, place, name)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer(i8) :: n, bytes
    integer :: worst

    worst = 0
    call attribute_shape(file%handle, place, name, n, bytes, worst)
    has_attribute = file%world%all_true(worst >= 0 .and. n >= 0)
  end function has_attribute

  subroutine read_reals(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    real(rp), intent(inout), target, contiguous :: value(..)
    type(error_t), intent(inout) :: error

    call fetch(file, place, name, kind_f64, size(value, kind=i8), c_loc(value), error)
  end subroutine read_reals

  subroutine read_integers(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(inout), target, contiguous :: value(..)
    type(error_t), intent(inout) :: error

    call fetch(file, place, name, kind_i32, size(value, kind=i8), c_loc(value), error)
  end subroutine read_integers

  !> Read an attribute that must have `n` numbers.
  subroutine fetch(file, place, name, kind, n, data, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: n
    type(c_ptr), intent(in) :: data
    type(error_t), intent(inout) :: error
    integer(i8) :: found, bytes
    integer :: worst

    if (error%is_set()) return
    worst = 0
    call attribute_shape(file%handle, place, name, found, bytes, worst)
    if (found /= n) worst = -1
    if (worst >= 0) call get_attribute(file%handle, place, name, kind, 0_i8, data, worst)
    call file%verify(worst, 'has no attribute '//name//' of '//str(n)//' numbers', error)
  end subroutine fetch

  subroutine read_word(file, place, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    character(:), allocatable, intent(out) :: value
    type(error_t), intent(inout) :: error
    character(1), allocatable, target :: bytes(:)
    integer(i8) :: found, length
    integer :: worst

    value = ''
    if (error%is_set()) return
    worst = 0
    call attribute_shape(file%handle, place, name, found, length, worst)
    if (found /= 1) worst = -1
    allocate (bytes(max(1_i8, length)))
    if (worst >= 0) call get_attribute(file%handle, place, name, kind_text, length, c_loc(bytes), &
                                       worst)
    if (worst >= 0) value = from_bytes(bytes)
    call file%verify(worst, 'has no text attribute '//name, error)
  end subroutine read_word

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

end module io_h5_notes
