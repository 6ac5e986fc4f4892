! SPDX-License-Identifier: MIT
!> Arrays and notes in HDF5 files, frames, series of frames, history tables.
program test_io
  use, intrinsic :: iso_fortran_env, only: int8
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp, sp
  use base_system, only: make_directory
  use base_text, only: str
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use io_frames, only: frame_name, write_frame, write_series
  use io_h5_attributes, only: has_attribute, read_attribute, write_attribute
  use io_h5_data, only: extent, read_array, read_text, write_array, write_text
  use io_h5_file, only: h5file_t
  use io_histories, only: compact, lines_t, table_t
  use io_samples, only: contents, discard, expect_error, expect_no_error, make_particles, put, &
                        sample_input
  use particles_store, only: f_jac, f_pos, f_tau, layout_t, particles_t, tag_id
  implicit none (type, external)

  character(*), parameter :: newline = new_line('a')
  type(world_t) :: world
  character(:), allocatable :: base

  call start_world(world)
  call begin_tests()
  base = 'test_io_'//str(world%size)//'_'
  call test_arrays(packed=.false.)
  call test_arrays(packed=.true.)
  call test_notes()
  call test_frame()
  call test_series()
  call test_histories()
  call test_lines()
  deallocate (base)
  call end_tests()

contains

  !> Numbers of lines as the format has them: of all sizes, at limits, in the middle of two texts.
  subroutine test_lines()
    type(lines_t) :: lines
    real(rp), allocatable :: x(:), exponent(:)
    character(15) :: text
    integer :: i, wrong

    allocate (x(10000), exponent(10000))
    call random_number(x)
    call random_number(exponent)
    x = (2.0_rp*x - 1.0_rp)*10.0_rp**(80.0_rp*exponent - 40.0_rp)
    x(:2000) = (0.5_rp + [(i, i=1, 2000)])/2.0_rp**mod([(i, i=1, 2000)], 40)*1.0e4_rp
    x(2001:2060) = 10.0_rp**[(i - 30, i=1, 60)]
    x(2061:2120) = (1.0_rp - 5.0e-10_rp)*x(2001:2060)
    x(2121:2180) = nearest(x(2001:2060), -1.0_rp)
    x(2181:2185) = [0.0_rp, -0.0_rp, huge(1.0_rp), tiny(1.0_rp), -298.0_rp]
    allocate (character(20) :: lines%text)
    wrong = 0
    do i = 1, size(x)
      lines%used = 0
      call lines%add(x(i))
      write (text, '(es15.8)') x(i)
      if (lines%text(:lines%used) /= compact(text)) wrong = wrong + 1
    end do
    call expect('numbers as the format has them', wrong == 0)
    lines%used = 0
    call lines%add(0_i8)
    call lines%add(',')
    call lines%add(9007199254740993_i8)
    call expect('integers', lines%text(:lines%used) == '0,9007199254740993')
  end subroutine test_lines

  !> Arrays of every type; the last of several ranks has nothing.
  subroutine test_arrays(packed)
    logical, intent(in) :: packed
    type(h5file_t) :: file
    type(error_t) :: error
    real(rp), allocatable :: a(:, :), a2(:, :)
    real(sp), allocatable :: b(:, :), b2(:, :)
    integer(i8), allocatable :: c(:), c2(:), dims(:)
    integer, allocatable :: d(:), d2(:)
    integer(int8), allocatable :: e(:), e2(:)
    integer(i8) :: first, total
    integer :: i, n

    n = 3000 + 1000*world%rank
    if (world%size > 1 .and. world%rank == world%size - 1) n = 0
    first = 3000_i8*world%rank + 500_i8*world%rank*(world%rank - 1)
    total = n
    call world%sum(total)
    allocate (a(5, n), a2(5, n), b(3, n), b2(3, n), c(n), c2(n), d(n), d2(n), e(n), e2(n))
    call random_number(a)
    b = real(a(1:3, :), sp)
    c = [(huge(1_i8) - first - i, i=1, n)]
    d = [(-i, i=1, n)]
    e = int(mod(d, 100), int8)

    call file%create(world, base//'arrays.hdf', packed, error)
    call file%group('/deep')
    call write_array(file, 'a', a)
    call write_array(file, '/deep/b', b)
    call write_array(file, 'c', c)
    call write_array(file, 'd', d)
    call write_array(file, 'e', e)
    call file%close(error)
    call expect_no_error('arrays are written', error)

    call file%open(world, base//'arrays.hdf', error)
    call extent(file, 'a', dims)
    call expect('shape of an array', all(dims == [5_i8, total]))
    call read_array(file, 'a', first, a2)
    call read_array(file, '/deep/b', first, b2)
    call read_array(file, 'c', first, c2)
    call read_array(file, 'd', first, d2)
    call read_array(file, 'e', first, e2)
    call expect_no_error('arrays are read', file%error)
    call expect('real64', all(a == a2))
    call expect('real32', all(b == b2))
    call expect('int64', all(c == c2))
    call expect('int32', all(d == d2))
    call expect('int8', all(e == e2))
    call read_array(file, 'a', total, a2(:, 1:min(1, n)))
    call expect_error('reading past the end', file%error, 'shape')
    call read_array(file, 'none', 0_i8, a2)
    call expect_error('reading what is not there', file%error, 'none')
    call file%close(error)
    call discard(world, base//'arrays.hdf')
  end subroutine test_arrays

  subroutine test_notes()
    type(h5file_t) :: file
    type(error_t) :: error
    character(:), allocatable :: text
    real(rp) :: x, y(2)
    integer :: i

    call file%create(world, base//'notes.hdf', .false., error)
    call write_attribute(file, '/', 'x', 1.5_rp)
    call write_attribute(file, '/', 'y', [2.5_rp, 3.5_rp])
    call write_attribute(file, '/', 'i', 7)
    call write_attribute(file, '/', 'word', 'shoulder')
    call write_attribute(file, '/', 'words', ['plate  ', 'backing'])
    call write_text(file, 'long', repeat('0123456789', 20000))
    call write_text(file, 'empty', '')
    call write_text(file, 'of_root', merge('root ', 'other', world%is_root()))
    call file%close(error)
    call expect_no_error('notes are written', error)

    call file%open(world, base//'notes.hdf', error)
    call read_attribute(file, '/', 'x', x)
    call read_attribute(file, '/', 'y', y)
    call read_attribute(file, '/', 'i', i)
    call expect('numbers', x == 1.5_rp .and. all(y == [2.5_rp, 3.5_rp]) .and. i == 7)
    call read_attribute(file, '/', 'word', text)
    call expect('word', text == 'shoulder' .and. len(text) == 8)
    call read_text(file, 'long', text)
    call expect('long text', text == repeat('0123456789', 20000) .and. len(text) == 200000)
    call read_text(file, 'empty', text)
    call expect('empty text', len(text) == 0)
    call read_text(file, 'of_root', text)
    call expect('text of rank 0', text == 'root')
    call expect('has an attribute', has_attribute(file, '/', 'x'))
    call expect('has no attribute', .not. has_attribute(file, '/', 'z'))
    call expect_no_error('notes are read', file%error)
    call read_attribute(file, '/', 'y', x)
    call expect_error('wrong number of values', file%error, 'y')
    call file%close(error)
    call discard(world, base//'notes.hdf')

    call file%create(world, 'no_such_directory/notes.hdf', .false., error)
    call write_attribute(file, '/', 'x', 1.5_rp)
    call file%close(error)
    call expect_error('no directory', error, 'created')
  end subroutine test_notes

  subroutine test_frame()
    type(layout_t) :: layout
    type(particles_t) :: p
    type(h5file_t) :: file
    type(error_t) :: error
    real(sp), allocatable :: x(:, :), a(:), extra(:, :)
    integer(i8), allocatable :: id(:), offsets(:), dims(:)
    integer(i8) :: first, pieces(world%size)
    character(:), allocatable :: text
    real(rp) :: time
    integer :: n

    call make_particles(world, p)
    if (p%nblk > 0) then   ! tau = J (-3 I + shear 2): pressure 3, von Mises 2 sqrt(3)
      p%ps(:, f_jac, :) = 2.0_rp
      p%ps(:, f_tau:f_tau + 2, :) = -6.0_rp
      p%ps(:, f_tau + 3, :) = 4.0_rp
      p%ps(:, f_tau + 4:f_tau + 5, :) = 0.0_rp
    end if
    allocate (extra(p%total(), 2), source=1.0_sp)
    extra(:, 2) = 2.0_sp
    call write_frame(world, base//'frame.hdf', 0.25_rp, 12, [1, 1, 1]*5.0e-4_rp, &
                     [1.0e-4_rp, 2.0e-4_rp], &
                     ['plate  ', 'backing'], [1, 1], ['metal'], layout%shown(), p, &
                     ['one', 'two'], ['m', '1'], extra, sample_input, &
                     error)
    call expect_no_error('frame is written', error)

    n = p%total()
    allocate (x(3, n), a(n), id(n), offsets(n + 1))
    call file%open(world, base//'frame.hdf', error)
    call read_attribute(file, '/', 'time', time)
    call expect_close('time of a frame', time, 0.25_rp)
    call read_text(file, '/stirpoint/input', text)
    call expect('input in a frame', text == sample_input)
    call read_array(file, '/VTKHDF/NumberOfPoints', 0_i8, pieces)
    first = sum(pieces(:world%rank))
    call expect('points of a piece', pieces(world%rank + 1) == n)
    call extent(file, '/VTKHDF/Offsets', dims)
    call expect('offsets', dims(1) == sum(pieces) + world%size)
    call read_array(file, '/VTKHDF/Offsets', first + world%rank, offsets)
    call expect('offsets of a piece', offsets(1) == 0 .and. offsets(n + 1) == n)
    call read_array(file, '/VTKHDF/Points', first, x)
    call expect('positions', are_positions(p, x))
    call read_array(file, '/VTKHDF/PointData/pressure', first, a)
    call expect('pressure', all(abs(a - 3.0_sp) < 1.0e-5_sp))
    call read_array(file, '/VTKHDF/PointData/von_mises', first, a)
    call expect('von Mises stress', all(abs(a - sqrt(12.0_sp)) < 1.0e-5_sp))
    call read_array(file, '/VTKHDF/PointData/two', first, a)
    call expect('a further scalar', all(abs(a - 2.0_sp) <= 0.0_sp))
    call read_array(file, '/VTKHDF/PointData/id', first, id)
    if (n > 0) id(1:p%count(1)) = id(1:p%count(1)) - tag_id(p%tag(1:p%count(1), 1))
    call expect('identities', all(id(:min(n, nlane - 1)) == 0))
    call read_attribute(file, '/VTKHDF/PointData/temperature', 'units', text)
    call expect('units', text == 'K')
    call file%close(error)
    call expect_no_error('frame is read', error)
    call discard(world, base//'frame.hdf')
    call p%free()
  end subroutine test_frame

  !> True if `x` holds the positions of `p` in the order of the blocks.
  logical function are_positions(p, x)
    type(particles_t), intent(in) :: p
    real(sp), intent(in) :: x(:, :)
    integer :: b, i, n

    are_positions = size(x, 2) == p%total()
    n = 0
    do b = 1, p%nblk
      do i = 1, p%count(b)
        n = n + 1
        are_positions = are_positions .and. all(x(:, n) == real(p%ps(i, f_pos:f_pos + 2, b), sp))
      end do
    end do
  end function are_positions

  !> Frames that lie elsewhere are not listed.
  subroutine test_series()
    type(error_t) :: error
    character(:), allocatable :: text
    integer :: k
    logical :: is_there, ok

    call expect('name of a frame', frame_name('parts', 12) == 'parts_000012.hdf')
    call put_frame(0)
    call put_frame(1)
    call write_series(world, '.', base//'parts', [0.0_rp, 0.5_rp, 9.0_rp], error)
    call expect_no_error('series is written', error)
    text = contents(world, base//'parts.hdf.series')
    call expect('last frame of a series', &
                index(text, '"'//base//'parts_000001.hdf", "time": 5.000000000000000E-001}') > 0)
    call expect('frames that are not there', index(text, '_000002') == 0)
    call expect('commas of a series', count([(text(k:k) == ',', k=1, len(text))]) == 4)
    call discard(world, base//'parts_000000.hdf')
    call write_series(world, '.', base//'parts', [0.0_rp, 0.5_rp], error)
    text = contents(world, base//'parts.hdf.series')
    call expect('a series without its first frame', index(text, '_000000') == 0 &
                .and. index(text, '_000001') > 0 .and. count([(text(k:k) == ',', k=1, &
                len(text))]) == 2)
    if (world%is_root()) call make_directory(base//'parts.hdf.series.tmp', ok)
    call write_series(world, '.', base//'parts', [0.0_rp, 0.5_rp], error)
    call expect_error('a series that cannot be written', error, 'cannot be written')
    call discard(world, base//'parts_000001.hdf')
    call write_series(world, '.', base//'parts', [0.0_rp, 0.5_rp], error)
    call expect_no_error('no frames', error)
    inquire (file=base//'parts.hdf.series', exist=is_there)
    call expect('no series without frames', .not. is_there)
  end subroutine test_series

  !> A file that has the name of a frame.
  subroutine put_frame(k)
    integer, intent(in) :: k
    integer :: unit

    if (.not. world%is_root()) return
    open (newunit=unit, file=frame_name(base//'parts', k), action='write')
    write (unit, '(a)') 'a frame'
    close (unit)
  end subroutine put_frame

  !> A table goes on after the restart time; later rows and an unfinished one are dropped.
  subroutine test_histories()
    type(table_t) :: table
    type(error_t) :: error
    character(:), allocatable :: path, text
    character(9), parameter :: columns(2) = ['time[s]  ', 'torque[N]']
    real(rp) :: t
    integer :: k

    path = base//'table.csv'
    call table%open(world, path, 'a title', columns, -1_i8, 0.0_rp, error)
    do k = 1, 4
      t = real(k, rp)/3.0_rp
      call table%write_row([t, -1.0e-120_rp*k])
    end do
    call table%close(error)
    call expect_no_error('table is written', error)
    text = contents(world, path)
    call expect('fresh table', index(text, '# a title'//newline//'time[s],torque[N]'//newline// &
                                     '3.333333333333E-01,-1.') == 1)
    call put(world, path, text//'1.3')
    call table%open(world, path, 'a title', columns, 2_i8, 2.0_rp/3.0_rp, error)
    call table%write_row([9.0_rp, 1.0_rp])
    call table%close(error)
    call expect_no_error('table is continued', error)
    text = contents(world, path)
    call expect('continued table', index(text, '# a title') == 1 .and. index(text, &
      newline//'6.666666666667E-01,-2.000000000E-120'//newline// &
      '9.000000000000E+00,1.000000000E+00'//newline, back=.true.) > 30)
    call table%open(world, path, '', ['time[s] ', 'force[N]'], 3_i8, 1.0_rp, error)
    call table%close(error)
    call expect_no_error('a table of other columns is gone on with', error)
    call expect('and new', contents(world, path) == 'time[s],force[N]'//newline)
    call expect('the other is kept', contents(world, path//'.1') == text)
    call discard(world, path//'.1')
    call table%open(world, path, '', columns, -1_i8, 0.0_rp, error)
    call table%close(error)
    call expect('fresh over an old table', contents(world, path) == 'time[s],torque[N]'//newline)
    call put(world, path, 'time[s],torque[N]'//newline//'1,1'//newline//'2,1'//newline)
    call table%open(world, path, '', columns, 3_i8, 2.0_rp, error)
    call table%close(error)
    call expect_no_error('a table that lacks a row is gone on with', error)
    call expect('and kept aside', contents(world, path//'.1') == contents(world, path))
    call discard(world, path//'.1')
    call discard(world, path)
    call table%open(world, path, '', columns, 5_i8, 5.0_rp, error)
    call table%close(error)
    call expect_no_error('restart without the old table', error)
    call discard(world, path)
  end subroutine test_histories

end program test_io
