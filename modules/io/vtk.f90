! SPDX-License-Identifier: MIT
!> Files of VTKHDF 1.0 UnstructuredGrid (ParaView, VTK, h5py); every rank writes a piece.
!>
!> Metadata that ParaView shows are field data of one number with the text as its name, as readers
!> of VTK do not accept texts of fixed length and parallel HDF5 writes no others.
module io_vtk
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_kinds, only: i8, rp, sp
  use base_text, only: str
  use base_world, only: world_t
  use io_h5_attributes, only: write_attribute
  use io_h5_data, only: write_array
  use io_h5_file, only: h5file_t
  implicit none (type, external)
  private

  public :: begin_grid, describe, note

  integer, parameter, public :: vtk_vertex = 1, vtk_triangle = 5
  character(*), parameter, public :: point_data = '/VTKHDF/PointData/'
  character(*), parameter :: field_data = '/VTKHDF/FieldData'

contains

  !> Create a file with points and cells of one type, the time, the step, and the names of bodies or
  !> tools (`kind`), numbered as in the point data.
  subroutine begin_grid(file, world, path, time, step, kind, names, x, cell, corner, error)
    type(h5file_t), intent(out) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path, kind, names(:)
    real(rp), intent(in) :: time                        !! [s]
    integer, intent(in) :: step, cell                   !! cell: type of VTK
    real(sp), intent(in), contiguous :: x(:, :)         !! (3, n) [m]
    integer(i8), intent(in), contiguous :: corner(:, :)  !! (corners, m) points of a cell, from 0
    type(error_t), intent(in) :: error
    integer(i8) :: k, m

    m = size(corner, 2)
    call file%create(world, path, .true., error)
    call write_attribute(file, '/', 'time', time)
    call write_attribute(file, '/', 'step', step)
    call write_attribute(file, '/', kind//'_names', names)
    call file%group('/VTKHDF')
    call write_attribute(file, '/VTKHDF', 'Version', [1, 0])
    call write_attribute(file, '/VTKHDF', 'Type', 'UnstructuredGrid')
    call write_array(file, '/VTKHDF/NumberOfPoints', [size(x, 2, i8)])
    call write_array(file, '/VTKHDF/NumberOfCells', [m])
    call write_array(file, '/VTKHDF/NumberOfConnectivityIds', [size(corner, kind=i8)])
    call write_array(file, '/VTKHDF/Points', x)
    call write_array(file, '/VTKHDF/Types', spread(int(cell, int8), 1, int(m)))
    call write_array(file, '/VTKHDF/Connectivity', reshape(corner, [size(corner)]))
    call write_array(file, '/VTKHDF/Offsets', [(k*size(corner, 1), k=0, m)])
    call write_attribute(file, '/VTKHDF/Points', 'units', 'm')
    call file%group(point_data(:len(point_data) - 1))
    call file%group(field_data)
    call write_array(file, field_data//'/TimeValue', of_root(file, time))
    call note(file, 'step', step)
    do k = 1, size(names)
      call note(file, kind//' '//str(k)//': '//trim(names(k)), int(k))
    end do
  end subroutine begin_grid

  !> Write the unit of a point field; ParaView shows those that are not 1.
  subroutine describe(file, field, unit)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: field, unit

    call write_attribute(file, point_data//field, 'units', unit)
    if (unit /= '1') call note(file, 'unit of '//field//': '//unit, 1)
  end subroutine describe

  !> Write a number with its name. Slashes separate groups in HDF5.
  subroutine note(file, name, value)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: value
    character(:), allocatable :: path
    integer :: i

    path = field_data//'/'
    do i = 1, len_trim(name)
      if (name(i:i) == '/') path = path//' per '
      if (name(i:i) /= '/') path = path//name(i:i)
    end do
    call write_array(file, path, of_root(file, real(value, rp)))
  end subroutine note

  !> Array with a number on rank 0, empty on the others.
  pure function of_root(file, value) result(values)
    type(h5file_t), intent(in) :: file
    real(rp), intent(in) :: value
    real(rp) :: values(merge(1, 0, file%world%is_root()))

    values = value
  end function of_root

end module io_vtk
