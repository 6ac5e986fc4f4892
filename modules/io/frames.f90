! SPDX-License-Identifier: MIT
!> Output frames: the particles, or the surfaces of the tools, at one time.
!>
!> The group /stirpoint and the attributes of the file are not part of VTKHDF. NAME.hdf.series lists
!> the frames with their times for ParaView.
!>
!> Files of VTKHDF 1.0 UnstructuredGrid (ParaView, VTK, h5py); every rank writes a piece.
!>
!> Metadata that ParaView shows are field data of one number with the text as its name, as readers
!> of VTK do not accept texts of fixed length and parallel HDF5 writes no others.
module io_frames
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, nlane, rp, sp
  use base_system, only: remove_file
  use base_text, only: str
  use base_world, only: agree, world_t
  use grid_geometry, only: mean_edge
  use io_h5_attributes, only: write_attribute
  use io_h5_data, only: write_array, write_text
  use io_h5_file, only: h5file_t
  use particles_store, only: f_jac, f_pos, f_tau, field_t, particles_t, tag_id
  implicit none (type, external)
  private

  public :: frame_name, write_frame, write_heat_frame, write_series, write_tool_frame

  character(*), parameter :: nl = new_line('a')

  integer, parameter :: vtk_vertex = 1, vtk_triangle = 5
  character(*), parameter :: point_data = '/VTKHDF/PointData/'
  character(*), parameter :: field_data = '/VTKHDF/FieldData'

contains

  !> File name of frame `k` (from 0) of the series `name`.
  function frame_name(name, k) result(file)
    character(*), intent(in) :: name
    integer, intent(in) :: k
    character(:), allocatable :: file
    character(12) :: digits

    write (digits, '(i0)') k
    if (k < 1000000) write (digits, '(i6.6)') k
    file = trim(name)//'_'//trim(digits)//'.hdf'
  end function frame_name

  !> Collective. Write a frame of particles.
  subroutine write_frame(world, path, time, step, cell, spacing, names, made_of, material, &
                         fields, particles, extra_names, extra_units, extra, input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in) :: time             !! [s]
    integer, intent(in) :: step
    real(rp), intent(in) :: cell(3)          !! edges of the grid's cells [m]
    real(rp), intent(in), contiguous :: spacing(:)       !! particle spacing of each body [m]
    character(*), intent(in) :: names(:)     !! names of the bodies
    integer, intent(in) :: made_of(:)        !! material of each body
    character(*), intent(in) :: material(:)  !! names of the materials
    type(field_t), intent(in) :: fields(:)   !! fields of the particles to write
    type(particles_t), intent(in) :: particles
    character(*), intent(in) :: extra_names(:), extra_units(:)
    real(sp), intent(in), contiguous :: extra(:, :)      !! further scalars of each particle
    character(*), intent(in) :: input_text   !! input; that of rank 0 is written
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    character(:), allocatable :: name
    integer :: i, k

    call begin_frame(file, world, path, time, step, cell, spacing, names, &
                     vector_of(particles, f_pos), input_text, error)
    call write_metadata(file, 'unit of Points: m', 1)
    call write_point_data(file, particles, made_of)
    do k = 1, size(fields)
      name = trim(fields(k)%name)
      do i = 1, len(name)
        if (name(i:i) == ' ') name(i:i) = '_'
      end do
      if (fields(k)%n == 3) then
        call write_array(file, point_data//name, vector_of(particles, fields(k)%first))
        call describe(file, name, trim(fields(k)%unit))
      else
        call write_scalar(file, name, trim(fields(k)%unit), field_of(particles, fields(k)%first))
      end if
    end do
    do k = 1, size(extra_names)
      call write_scalar(file, trim(extra_names(k)), trim(extra_units(k)), extra(:, k))
      if (extra_units(k) == '1') call write_metadata(file, 'unit of '//trim(extra_names(k))// &
                                                     ': 1', 1)
    end do
    call write_attribute(file, '/', 'material_names', material(made_of))
    do k = 1, size(names)
      call write_metadata(file, 'material of '//trim(names(k))//': '//trim(material(made_of(k))), &
                          made_of(k))
    end do
    call file%close(error)
  end subroutine write_frame

  !> Collective. Write a frame of a heat-only run: the centres of the cells.
  subroutine write_heat_frame(world, path, time, step, cell, names, x, temperature, body, &
                              input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in) :: time             !! [s]
    integer, intent(in) :: step
    real(rp), intent(in) :: cell(3)          !! edges of a cell [m]
    character(*), intent(in) :: names(:)     !! names of the bodies
    real(sp), intent(in), contiguous :: x(:, :), temperature(:)   !! (3, n) [m]; (n) [K]
    integer, intent(in), contiguous :: body(:)
    character(*), intent(in) :: input_text   !! input; that of rank 0 is written
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file

    call begin_frame(file, world, path, time, step, cell, spread(mean_edge(cell), 1, size(names)), &
                     names, x, input_text, error)
    call write_scalar(file, 'temperature', 'K', temperature)
    call write_integers(file, 'body', body)
    call file%close(error)
  end subroutine write_heat_frame

  !> Create a file with points, a vertex for each, and the common attributes of frames.
  subroutine begin_frame(file, world, path, time, step, cell, spacing, names, x, input_text, error)
    type(h5file_t), intent(out) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path, names(:), input_text
    real(rp), intent(in) :: time, cell(3)
    integer, intent(in) :: step
    real(rp), intent(in), contiguous :: spacing(:)
    real(sp), intent(in), contiguous :: x(:, :)   !! (3, n) positions [m]
    type(error_t), intent(in) :: error
    integer :: i

    call begin_grid(file, world, path, time, step, 'body', names, x, vtk_vertex, &
                    reshape([(int(i, i8), i=0, size(x, 2) - 1)], [1, size(x, 2)]), error)
    if (all(abs(cell - cell(1)) <= 0.0_rp)) then
      call write_attribute(file, '/', 'cell', cell(1))
    else
      call write_attribute(file, '/', 'cell', cell)
    end if
    call write_attribute(file, '/', 'spacing', spacing)
    call file%group('/stirpoint')
    call write_text(file, '/stirpoint/input', input_text)
  end subroutine begin_frame

  !> Collective. Write a frame of the tools, their surfaces as triangles, in a series of its own.
  !> Only the arrays of rank 0 are used.
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
    integer :: cells, points

    points = merge(size(x, 2), 0, world%is_root())
    cells = merge(size(corner, 2), 0, world%is_root())
    call begin_grid(file, world, path, time, step, 'tool', names, x(:, :points), vtk_triangle, &
                    int(corner(:, :cells) - 1, i8), error)
    call write_metadata(file, 'unit of Points: m', 1)
    call write_array(file, point_data//'velocity', velocity(:, :points))
    call describe(file, 'velocity', 'm/s')
    call write_scalar(file, 'azimuth', 'rad', azimuth(:points))
    call write_integers(file, 'tool', tool(:points))
    call file%close(error)
  end subroutine write_tool_frame

  !> Write what follows from the fields of the particles: the Cauchy stress with its pressure
  !> -tr(tau)/(3 J) and von Mises stress sqrt(3/2) |dev tau|/J, the grid velocities where they are
  !> known, and the identity.
  subroutine write_point_data(file, particles, made_of)
    type(h5file_t), intent(inout) :: file
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: made_of(:)        !! material of each body
    real(sp), allocatable :: mises(:), pressure(:), stress(:, :), velocity(:, :)
    integer, allocatable :: body(:)
    integer(i8), allocatable :: id(:)
    real(rp) :: mean, t(6), v(nlane, 3)
    integer :: b, i, n

    n = particles%total()
    allocate (mises(n), pressure(n), stress(6, n), velocity(3, n), body(n), id(n))
    n = 0
    do b = 1, particles%nblk
      v = particles%velocity(b)
      do i = 1, particles%count(b)
        n = n + 1
        associate (ps => particles%ps(i, :, b))
          t = ps(f_tau:f_tau + 5)
          stress(:, n) = real(t/ps(f_jac), sp)
          mean = sum(t(1:3))/3.0_rp
          t(1:3) = t(1:3) - mean
          pressure(n) = real(-mean/ps(f_jac), sp)
          mises(n) = real(sqrt(1.5_rp*(sum(t(1:3)**2) + 2.0_rp*sum(t(4:6)**2)))/ps(f_jac), sp)
        end associate
        velocity(:, n) = real(v(i, :), sp)
        body(n) = particles%body(b)
        id(n) = tag_id(particles%tag(i, b))
      end do
    end do
    call write_scalar(file, 'pressure', 'Pa', pressure)
    call write_scalar(file, 'von_mises', 'Pa', mises)
    call write_array(file, point_data//'stress', stress)
    call describe(file, 'stress', 'Pa')
    call write_array(file, point_data//'velocity', velocity)
    call describe(file, 'velocity', 'm/s')
    call write_integers(file, 'body', body)
    call write_array(file, point_data//'id', id)
    call describe(file, 'id', '1')
    call write_integers(file, 'material', made_of(body))
  end subroutine write_point_data

  !> Write a field of integers.
  subroutine write_integers(file, name, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in), contiguous :: a(:)

    call write_array(file, point_data//name, a)
    call describe(file, name, '1')
  end subroutine write_integers

  !> Write a scalar field.
  subroutine write_scalar(file, name, units, a)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: name, units
    real(sp), intent(in), contiguous :: a(:)

    call write_array(file, point_data//name, a)
    call describe(file, name, units)
  end subroutine write_scalar

  !> A field of all particles.
  pure function field_of(particles, field) result(v)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: field
    real(sp), allocatable :: v(:)
    integer :: b, m, n

    allocate (v(particles%total()))
    n = 0
    do b = 1, particles%nblk
      m = particles%count(b)
      v(n + 1:n + m) = real(particles%ps(1:m, field, b), sp)
      n = n + m
    end do
  end function field_of

  !> A vector of all particles, of three fields from `field` on.
  pure function vector_of(particles, field) result(v)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: field
    real(sp), allocatable :: v(:, :)
    integer :: k

    allocate (v(3, particles%total()))
    do k = 1, 3
      v(k, :) = field_of(particles, field + k - 1)
    end do
  end function vector_of

  !> Write directory/name.hdf.series with the existing frames directory/name_000000.hdf, ..., if
  !> any.
  subroutine write_series(world, directory, name, times, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: directory, name
    !> Times of all frames from number 0, also of frames in other folders [s].
    real(rp), intent(in) :: times(:)
    type(error_t), intent(inout) :: error
    character(:), allocatable :: path, text
    character(24) :: digits
    integer :: k, used
    logical :: is_there

    if (error%is_set()) return
    if (world%is_root()) then
      path = trim(directory)//'/'//trim(name)//'.hdf.series'
      allocate (character(size(times)*(len_trim(name) + 80) + 80) :: text)
      used = 0
      do k = 1, size(times)
        inquire (file=trim(directory)//'/'//frame_name(name, k - 1), exist=is_there)
        if (.not. is_there) cycle
        if (used > 0) call add(',')
        write (digits, '(es23.15e3)') times(k)     ! enough digits to distinguish all doubles
        call add(nl//'    {"name": "'//frame_name(name, k - 1)//'", "time": '// &
                 trim(adjustl(digits))//'}')
      end do
      if (used == 0) then
        call remove_file(path)
      else
        call write_whole(path, '{'//nl//'  "file-series-version": "1.0",'//nl//'  "files": ['// &
                         text(:used)//nl//'  ]'//nl//'}'//nl, error)
      end if
    end if
    call agree(world, error)
  contains
    subroutine add(more)
      character(*), intent(in) :: more

      text(used + 1:used + len(more)) = more
      used = used + len(more)
    end subroutine add
  end subroutine write_series

  !> Create a file with points and cells of one type, the time, the step, and the names of bodies or
  !> tools (`kind`), numbered as in the point data.
  subroutine begin_grid(file, world, path, time, step, kind, names, x, cell, corner, error)
    type(h5file_t), intent(out) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path, kind, names(:)
    real(rp), intent(in) :: time                        !! [s]
    integer, intent(in) :: step, cell                   !! step; type of the cells in VTK
    real(sp), intent(in), contiguous :: x(:, :)         !! (3, n) positions [m]
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
    call write_metadata(file, 'step', step)
    do k = 1, size(names)
      call write_metadata(file, kind//' '//str(k)//': '//trim(names(k)), int(k))
    end do
  end subroutine begin_grid

  !> Write the unit of a point field; ParaView shows those that are not 1.
  subroutine describe(file, field, unit)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: field, unit

    call write_attribute(file, point_data//field, 'units', unit)
    if (unit /= '1') call write_metadata(file, 'unit of '//field//': '//unit, 1)
  end subroutine describe

  !> Write a number as field data whose name is the metadata text `name`. As slashes separate groups
  !> in HDF5, ` per ` replaces them.
  subroutine write_metadata(file, name, value)
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
  end subroutine write_metadata

  !> Array with a number on rank 0, empty on the others.
  pure function of_root(file, value) result(values)
    type(h5file_t), intent(in) :: file
    real(rp), intent(in) :: value
    real(rp) :: values(merge(1, 0, file%world%is_root()))

    values = value
  end function of_root

end module io_frames
