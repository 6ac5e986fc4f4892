! SPDX-License-Identifier: MIT
!> Attributes of parallel HDF5 files and of what they contain, the same on all ranks.
module io_h5_attributes
  use, intrinsic :: iso_c_binding, only: c_loc, c_null_char, c_ptr
  use base_kinds, only: i8, rp
  use base_text, only: str
  use hdf5, only: h5aclose_f, h5acreate_by_name_f, h5aexists_by_name_f, h5aget_space_f, &
                  h5aget_type_f, h5aopen_by_name_f, h5aread_f, h5awrite_f, h5sclose_f, &
                  h5sget_simple_extent_npoints_f, h5tclose_f, h5tget_size_f, hid_t, hsize_t, size_t
  use io_h5_file, only: from_bytes, h5file_t, kind_f64, kind_i32, kind_text, make_space, &
                        make_type, to_bytes
  implicit none (type, external)
  private

  public :: has_attribute, read_attribute, write_attribute

  !> write_attribute(file, place, name, value): attribute of the object at `place` ('/' is the
  !> file); a number, numbers, a text or texts.
  interface write_attribute
    module procedure write_reals, write_integers, write_word, write_words
  end interface write_attribute

  !> read_attribute(file, place, name, value): numbers of known shape, or a text.
  interface read_attribute
    module procedure read_reals, read_integers, read_word
  end interface read_attribute

contains

  subroutine write_reals(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    real(rp), intent(in), target, contiguous :: value(..)

    call put_attribute(file, place, name, kind_f64, 0, shape(value, i8), c_loc(value))
  end subroutine write_reals

  subroutine write_integers(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    integer, intent(in), target, contiguous :: value(..)

    call put_attribute(file, place, name, kind_i32, 0, shape(value, i8), c_loc(value))
  end subroutine write_integers

  subroutine write_word(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name, value
    character(1), allocatable, target :: bytes(:)
    integer(i8) :: scalar(0)

    allocate (bytes, source=to_bytes(value))
    call put_attribute(file, place, name, kind_text, len(value), scalar, c_loc(bytes))
  end subroutine write_word

  subroutine write_words(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name, value(:)
    character(1), allocatable, target :: bytes(:)
    integer :: k, length

    length = max(1, maxval([0, len_trim(value)]))
    allocate (bytes(length*size(value)), source=c_null_char)
    do k = 1, size(value)
      associate (n => len_trim(value(k)), first => length*(k - 1))
        if (n > 0) bytes(first + 1:first + n) = to_bytes(value(k)(:n))
      end associate
    end do
    call put_attribute(file, place, name, kind_text, length, shape(value, i8), c_loc(bytes))
  end subroutine write_words

  subroutine put_attribute(file, place, name, kind, length, dims, data)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind, length
    integer(i8), intent(in) :: dims(:)
    type(c_ptr), intent(in) :: data
    integer(hid_t) :: type, space, id
    integer :: status(7)

    if (file%error%is_set()) return
    status = 0
    call make_type(kind, int(length, i8), type, status(1))
    call make_space(dims, space, status(2))
    call h5acreate_by_name_f(file%id, place, name, type, space, id, status(3))
    if (status(3) >= 0) then
      call h5awrite_f(id, type, data, status(4))
      call h5aclose_f(id, status(5))
    end if
    call h5sclose_f(space, status(6))
    call h5tclose_f(type, status(7))
    call file%verify(minval(status), 'cannot be written: '//name)
  end subroutine put_attribute

  !> True if the object at `place` has an attribute `name`; false after an error.
  logical function has_attribute(file, place, name)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer(i8) :: n, bytes
    integer :: status

    has_attribute = .false.
    if (file%error%is_set()) return
    call attribute_shape(file, place, name, n, bytes, status)
    has_attribute = file%world%all_true(status >= 0 .and. n >= 0)
  end function has_attribute

  subroutine read_reals(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    real(rp), intent(inout), target, contiguous :: value(..)

    call read_numbers(file, place, name, kind_f64, size(value, kind=i8), c_loc(value))
  end subroutine read_reals

  subroutine read_integers(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    integer, intent(inout), target, contiguous :: value(..)

    call read_numbers(file, place, name, kind_i32, size(value, kind=i8), c_loc(value))
  end subroutine read_integers

  !> Read an attribute that must have `n` numbers.
  subroutine read_numbers(file, place, name, kind, n, data)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: n
    type(c_ptr), intent(in) :: data
    integer(i8) :: found, bytes
    integer :: status

    if (file%error%is_set()) return
    call attribute_shape(file, place, name, found, bytes, status)
    if (found /= n) status = -1
    if (status >= 0) call get_attribute(file, place, name, kind, 0_i8, data, status)
    call file%verify(status, 'has no attribute '//name//' of '//str(n)//' numbers')
  end subroutine read_numbers

  subroutine read_word(file, place, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: place, name
    character(:), allocatable, intent(out) :: value
    character(1), allocatable, target :: bytes(:)
    integer(i8) :: found, length
    integer :: status

    value = ''
    if (file%error%is_set()) return
    call attribute_shape(file, place, name, found, length, status)
    if (found /= 1) status = -1
    allocate (bytes(max(1_i8, length)))
    if (status >= 0) call get_attribute(file, place, name, kind_text, length, c_loc(bytes), status)
    if (status >= 0) value = from_bytes(bytes)
    call file%verify(status, 'has no text attribute '//name)
  end subroutine read_word

  !> Number of values of an attribute (-1 if there is none) and bytes of each.
  subroutine attribute_shape(file, place, name, n, bytes, worst)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer(i8), intent(out) :: n, bytes
    integer, intent(out) :: worst
    integer(hid_t) :: id, type, space
    integer(size_t) :: width
    integer(hsize_t) :: points
    logical :: exists
    integer :: status(7)

    n = -1
    bytes = 0
    call h5aexists_by_name_f(file%id, place, name, exists, worst)
    if (worst < 0 .or. .not. exists) return
    call h5aopen_by_name_f(file%id, place, name, id, worst)
    if (worst < 0) return
    call h5aget_space_f(id, space, status(1))
    call h5sget_simple_extent_npoints_f(space, points, status(2))
    call h5aget_type_f(id, type, status(3))
    call h5tget_size_f(type, width, status(4))
    n = int(points, i8)
    bytes = int(width, i8)
    call h5tclose_f(type, status(5))
    call h5sclose_f(space, status(6))
    call h5aclose_f(id, status(7))
    worst = minval(status)
  end subroutine attribute_shape

  !> Read the values of an attribute as `kind` (texts with `length` bytes each).
  subroutine get_attribute(file, place, name, kind, length, data, worst)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: place, name
    integer, intent(in) :: kind
    integer(i8), intent(in) :: length
    type(c_ptr), intent(in) :: data
    integer, intent(out) :: worst
    type(c_ptr) :: address   ! HDF5 needs a variable
    integer(hid_t) :: id, type
    integer :: status(4)

    address = data
    call h5aopen_by_name_f(file%id, place, name, id, worst)
    if (worst < 0) return
    call make_type(kind, length, type, status(1))
    call h5aread_f(id, type, address, status(2))
    call h5tclose_f(type, status(3))
    call h5aclose_f(id, status(4))
    worst = minval(status)
  end subroutine get_attribute

end module io_h5_attributes
