! SPDX-License-Identifier: MIT
!> Kinds of data in HDF5 files, data types, dataspaces and texts.
!>
!> Only the modules `h5_...` call HDF5. A negative status is a failure. Types in memory and in the
!> file are equal, as a conversion in HDF5 would break collective transfers.
module io_h5_types
  use, intrinsic :: iso_c_binding, only: c_null_char
  use, intrinsic :: iso_fortran_env, only: int64
  use base_kinds, only: i8
  use hdf5, only: h5_integer_kind, h5kind_to_type, h5s_scalar_f, h5screate_f, h5screate_simple_f, &
                  h5t_c_s1, h5t_native_double, h5t_native_integer, h5t_native_real, h5t_std_u8le, &
                  h5t_str_nullpad_f, h5tcopy_f, h5tset_size_f, h5tset_strpad_f, hid_t, hsize_t, &
                  size_t
  implicit none (type, external)
  private

  public :: from_bytes, make_space, make_type, to_bytes

  ! Kinds of data in files, and bytes of each.
  integer, parameter, public :: kind_f64 = 1, kind_f32 = 2, kind_i64 = 3, kind_i32 = 4, &
                                kind_u8 = 5, kind_text = 6
  integer, parameter, public :: bytes_of(6) = [8, 4, 8, 4, 1, 1]

contains

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

end module io_h5_types
