! SPDX-License-Identifier: MIT
!> Calls of HDF5 for attributes, with identifiers and addresses (h5_types).
module h5_attributes
  use, intrinsic :: iso_c_binding, only: c_ptr
  use base_kinds, only: i8
  use h5_types, only: handle_t, make_space, make_type
  use hdf5, only: h5aclose_f, h5acreate_by_name_f, h5aexists_by_name_f, h5aget_space_f, &
                  h5aget_type_f, h5aopen_by_name_f, h5aread_f, h5awrite_f, h5sclose_f, &
                  h5sget_simple_extent_npoints_f, h5tclose_f, h5tget_size_f, hid_t, hsize_t, &
                  size_t
  implicit none (type, external)
  private

  public :: make_attribute, get_attribute, attribute_shape

contains

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

end module h5_attributes
