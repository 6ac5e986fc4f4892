! SPDX-License-Identifier: MIT
!> Output frames: the particles at one time as a VTKHDF 1.0 UnstructuredGrid (ParaView, VTK, h5py).
!>
!> Every rank writes a piece with vertices. The group /stirpoint and the attributes of the file are
!> not part of VTKHDF. NAME.hdf.series lists the frames with their times for ParaView.
module io_frames
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, nlane, rp, sp
  use base_system, only: remove_file
  use comm_world, only: agree, world_t
  use grid_geometry, only: mean_edge
  use io_field_data, only: note, note_unit, note_units, write_notes
  use io_h5_file, only: h5file_t
  use io_h5_notes, only: write_array, write_attribute, write_text
  use particles_store, only: f_flow, f_jac, f_plastic, f_pos, f_rate, f_tau, f_temp, &
                             particles_t, tag_id
  implicit none (type, external)
  private

  public :: write_frame, write_heat_frame, write_series, frame_name

  character(*), parameter :: point_data = '/VTKHDF/PointData/', nl = new_line('a')
  integer(int8), parameter :: vertex = 1_int8   !! VTK_VERTEX

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
                         origin, particles, extra_names, extra_units, extra, input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in) :: time             !! [s]
    integer, intent(in) :: step
    real(rp), intent(in) :: cell(3)          !! edges of the grid's cells [m]
    real(rp), intent(in), contiguous :: spacing(:)       !! particle spacing of each body [m]
    character(*), intent(in) :: names(:)     !! names of the bodies
    integer, intent(in) :: made_of(:)        !! material of each body
    character(*), intent(in) :: material(:)  !! names of the materials
    integer, intent(in) :: origin            !! field of the initial position; 0: none
    type(particles_t), intent(in) :: particles
    character(*), intent(in) :: extra_names(:), extra_units(:)
    real(sp), intent(in), contiguous :: extra(:, :)      !! further scalars of each particle
    character(*), intent(in) :: input_text   !! input; that of rank 0 is written
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    real(sp), allocatable :: x(:, :)
    integer :: k

    call begin_frame(file, world, path, time, step, cell, spacing, names, input_text, error)
    allocate (x(3, particles%total()))
    call pack_vector(particles, f_pos, x)
    call write_vertices(file, x, error)
    call write_point_data(file, particles, made_of, error)
    if (origin > 0) then
      call pack_vector(particles, origin, x)
      call write_array(file, point_data//'initial_position', x, error)
      call write_attribute(file, point_data//'initial_position', 'units', 'm', error)
    end if
    do k = 1, size(extra_names)
      call write_scalar(file, trim(extra_names(k)), trim(extra_units(k)), extra(:, k), error)
    end do
    call write_attribute(file, '/', 'material_names', material(made_of), error)
    call write_notes(file, time, step, 'body', names, error)
    do k = 1, size(names)
      call note(file, 'material of '//trim(names(k))//': '//trim(material(made_of(k))), &
                made_of(k), error)
    end do
    call note_units(file, extra_names, extra_units, error)
    call file%close(error)
  end subroutine write_frame

  !> Collective. Write a frame of a heat-only run: the centres of the cells.
  subroutine write_heat_frame(world, path, time, step, cell, names, x, temperature, body, &
                              input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in) :: time             !! [s]
    integer, intent(in) :: step
    real(rp), intent(in) :: cell(3)          !! [m]
    character(*), intent(in) :: names(:)     !! names of the bodies
    real(sp), intent(in), contiguous :: x(:, :), temperature(:)   !! (3, n) [m]; (n) [K]
    integer, intent(in), contiguous :: body(:)
    character(*), intent(in) :: input_text   !! input; that of rank 0 is written
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer :: b

    call begin_frame(file, world, path, time, step, cell, [(mean_edge(cell), b=1, size(names))], &
                     names, input_text, error)
    call write_vertices(file, x, error)
    call file%group('/VTKHDF/PointData', error)
    call write_scalar(file, 'temperature', 'K', temperature, error)
    call write_integers(file, 'body', body, error)
    call write_notes(file, time, step, 'body', names, error)
    call note_unit(file, 'temperature', 'K', error)
    call file%close(error)
  end subroutine write_heat_frame

  !> Create a file with the common attributes of frames.
  subroutine begin_frame(file, world, path, time, step, cell, spacing, names, input_text, error)
    type(h5file_t), intent(out) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path, names(:), input_text
    real(rp), intent(in) :: time, cell(3)
    integer, intent(in) :: step
    real(rp), intent(in), contiguous :: spacing(:)
    type(error_t), intent(inout) :: error

    call file%create(world, path, .true., error)
    call write_attribute(file, '/', 'time', time, error)
    call write_attribute(file, '/', 'step', step, error)
    if (all(abs(cell - cell(1)) <= 0.0_rp)) then
      call write_attribute(file, '/', 'cell', cell(1), error)
    else
      call write_attribute(file, '/', 'cell', cell, error)
    end if
    call write_attribute(file, '/', 'spacing', spacing, error)
    call write_attribute(file, '/', 'body_names', names, error)
    call file%group('/stirpoint', error)
    call write_text(file, '/stirpoint/input', input_text, error)
  end subroutine begin_frame

  !> Write positions, and a vertex cell for each.
  subroutine write_vertices(file, x, error)
    type(h5file_t), intent(in) :: file
    real(sp), intent(in), contiguous :: x(:, :)   !! (3, n) [m]
    type(error_t), intent(inout) :: error
    integer(i8), allocatable :: numbers(:)
    integer(int8), allocatable :: types(:)
    integer :: i, n

    n = size(x, 2)
    allocate (types(n), numbers(n + 1))
    types = vertex
    numbers = [(int(i, i8), i=0, n)]
    call file%group('/VTKHDF', error)
    call write_attribute(file, '/VTKHDF', 'Version', [1, 0], error)
    call write_attribute(file, '/VTKHDF', 'Type', 'UnstructuredGrid', error)
    call write_array(file, '/VTKHDF/NumberOfPoints', numbers(n + 1:), error)
    call write_array(file, '/VTKHDF/NumberOfCells', numbers(n + 1:), error)
    call write_array(file, '/VTKHDF/NumberOfConnectivityIds', numbers(n + 1:), error)
    call write_array(file, '/VTKHDF/Points', x, error)
    call write_array(file, '/VTKHDF/Types', types, error)
    call write_array(file, '/VTKHDF/Connectivity', numbers(:n), error)
    call write_array(file, '/VTKHDF/Offsets', numbers, error)
    call write_attribute(file, '/VTKHDF/Points', 'units', 'm', error)
  end subroutine write_vertices

  !> Write the fields of the particles: the Cauchy stress with its pressure -tr(tau)/(3 J) and von
  !> Mises stress sqrt(3/2) |dev tau|/J, and the grid velocities where they are known.
  subroutine write_point_data(file, particles, made_of, error)
    type(h5file_t), intent(in) :: file
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: made_of(:)        !! material of each body
    type(error_t), intent(inout) :: error
    character(14), parameter :: name(6) = [character(14) :: 'temperature', 'plastic_strain', &
      'strain_rate', 'flow_stress', 'pressure', 'von_mises']
    character(3), parameter :: unit(6) = [character(3) :: 'K', '1', '1/s', 'Pa', 'Pa', 'Pa']
    real(sp), allocatable :: scalar(:, :), stress(:, :), velocity(:, :)
    integer, allocatable :: body(:)
    integer(i8), allocatable :: id(:)
    real(rp) :: mean, t(6), v(nlane, 3)
    integer :: b, i, k, n

    n = particles%total()
    allocate (scalar(n, 6), stress(6, n), velocity(3, n), body(n), id(n))
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
          scalar(n, :) = real([ps(f_temp), ps(f_plastic), ps(f_rate), ps(f_flow), -mean/ps(f_jac), &
            sqrt(1.5_rp*(sum(t(1:3)**2) + 2.0_rp*sum(t(4:6)**2)))/ps(f_jac)], sp)
        end associate
        velocity(:, n) = real(v(i, :), sp)
        body(n) = particles%body(b)
        id(n) = tag_id(particles%tag(i, b))
      end do
    end do
    call file%group('/VTKHDF/PointData', error)
    do k = 1, size(name)
      call write_scalar(file, trim(name(k)), trim(unit(k)), scalar(:, k), error)
    end do
    call write_array(file, point_data//'stress', stress, error)
    call write_attribute(file, point_data//'stress', 'units', 'Pa', error)
    call write_array(file, point_data//'velocity', velocity, error)
    call write_attribute(file, point_data//'velocity', 'units', 'm/s', error)
    call write_integers(file, 'body', body, error)
    call write_array(file, point_data//'id', id, error)
    call write_attribute(file, point_data//'id', 'units', '1', error)
    call write_integers(file, 'material', made_of(body), error)
  end subroutine write_point_data

  !> Write a field of integers.
  subroutine write_integers(file, name, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(in), contiguous :: a(:)
    type(error_t), intent(inout) :: error

    call write_array(file, point_data//name, a, error)
    call write_attribute(file, point_data//name, 'units', '1', error)
  end subroutine write_integers

  !> Write a scalar field.
  subroutine write_scalar(file, name, units, a, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name, units
    real(sp), intent(in), contiguous :: a(:)
    type(error_t), intent(inout) :: error

    call write_array(file, point_data//name, a, error)
    call write_attribute(file, point_data//name, 'units', units, error)
  end subroutine write_scalar

  !> Pack three fields as a vector.
  subroutine pack_vector(particles, field, v)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: field
    real(sp), intent(out) :: v(:, :)
    integer :: b, k, m, n

    n = 0
    do b = 1, particles%nblk
      m = particles%count(b)
      do k = 1, 3
        v(k, n + 1:n + m) = real(particles%ps(1:m, field + k - 1, b), sp)
      end do
      n = n + m
    end do
  end subroutine pack_vector

  !> Write directory/name.hdf.series with the existing frames directory/name_000000.hdf, ..., if
  !> any.
  subroutine write_series(world, directory, name, times, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: directory, name
    real(rp), intent(in) :: times(:)   !! times of all frames from number 0, also
                                       !! of those in other folders [s]
    type(error_t), intent(inout) :: error
    character(:), allocatable :: path, text
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
        call add(nl//'    {"name": "'//frame_name(name, k - 1)//'", "time": '// &
                 digits_of(times(k))//'}')
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

  !> Text of a time with enough digits to distinguish all doubles.
  function digits_of(time) result(text)
    real(rp), intent(in) :: time
    character(:), allocatable :: text
    character(24) :: digits

    write (digits, '(es23.15e3)') time
    text = trim(adjustl(digits))
  end function digits_of

end module io_frames
