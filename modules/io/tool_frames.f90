! SPDX-License-Identifier: MIT
!> Output frames of the tools: their surfaces at one time as triangles of a VTKHDF 1.0
!> UnstructuredGrid, in a separate series.
module io_tool_frames
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_kinds, only: i8, rp, sp
  use comm_world, only: world_t
  use io_field_data, only: note_unit, write_notes
  use io_h5_file, only: h5file_t
  use io_h5_notes, only: write_array, write_attribute
  implicit none (type, external)
  private

  public :: write_tool_frame

  character(*), parameter :: point_data = '/VTKHDF/PointData/'
  integer(int8), parameter :: triangle = 5_int8   !! VTK_TRIANGLE

contains

  !> Collective. Write a frame; only the arrays of rank 0 are used.
  subroutine write_tool_frame(world, path, time, step, names, x, velocity, azimuth, tool, corner, &
                              error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in) :: time                            !! [s]
    integer, intent(in) :: step
    character(*), intent(in) :: names(:)                    !! names of the tools
    real(sp), intent(in), contiguous :: x(:, :)             !! (3, n) positions [m]
    real(sp), intent(in), contiguous :: velocity(:, :)      !! (3, n) [m/s]
    real(sp), intent(in), contiguous :: azimuth(:)          !! (n) in the tool's axes [rad]
    integer, intent(in), contiguous :: tool(:)              !! (n) index of the tool
    integer, intent(in), contiguous :: corner(:, :)         !! (3, m) points of each triangle
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer(i8) :: n, m, k
    integer :: points, cells

    points = 0
    cells = 0
    if (world%is_root()) then
      points = size(x, 2)
      cells = size(corner, 2)
    end if
    n = points
    m = cells
    call file%create(world, path, .true., error)
    call write_attribute(file, '/', 'time', time, error)
    call write_attribute(file, '/', 'step', step, error)
    call write_attribute(file, '/', 'tool_names', names, error)
    call file%group('/VTKHDF', error)
    call write_attribute(file, '/VTKHDF', 'Version', [1, 0], error)
    call write_attribute(file, '/VTKHDF', 'Type', 'UnstructuredGrid', error)
    call write_array(file, '/VTKHDF/NumberOfPoints', [n], error)
    call write_array(file, '/VTKHDF/NumberOfCells', [m], error)
    call write_array(file, '/VTKHDF/NumberOfConnectivityIds', [3*m], error)
    call write_array(file, '/VTKHDF/Points', x(:, :points), error)
    call write_attribute(file, '/VTKHDF/Points', 'units', 'm', error)
    call write_array(file, '/VTKHDF/Types', [(triangle, k=1, m)], error)
    call write_array(file, '/VTKHDF/Connectivity', &
                     reshape(int(corner(:, :cells) - 1, i8), [3*cells]), error)
    call write_array(file, '/VTKHDF/Offsets', [(3*k, k=0, m)], error)
    call file%group('/VTKHDF/PointData', error)
    call write_array(file, point_data//'velocity', velocity(:, :points), error)
    call write_attribute(file, point_data//'velocity', 'units', 'm/s', error)
    call write_array(file, point_data//'azimuth', azimuth(:points), error)
    call write_attribute(file, point_data//'azimuth', 'units', 'rad', error)
    call write_array(file, point_data//'tool', tool(:points), error)
    call write_attribute(file, point_data//'tool', 'units', '1', error)
    call write_notes(file, time, step, 'tool', names, error)
    call note_unit(file, 'Points', 'm', error)
    call note_unit(file, 'velocity', 'm/s', error)
    call note_unit(file, 'azimuth', 'rad', error)
    call file%close(error)
  end subroutine write_tool_frame

end module io_tool_frames
