! SPDX-License-Identifier: MIT
!> Files: arrays and notes in HDF5, frames, checkpoints (also damaged ones), history tables.
program test_io
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int8
  use mpi_f08, only: mpi_comm_free, mpi_comm_rank, mpi_comm_size, mpi_comm_split
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp, sp
  use base_system, only: remove_file
  use base_text, only: str
  use check, only: begin_tests, end_tests, expect, expect_close
  use comm_world, only: start_world, world_t
  use grid_geometry, only: box_t
  use io_checkpoint, only: read_checkpoint, read_checkpoint_input, write_checkpoint
  use io_frames, only: frame_name, write_frame, write_series
  use io_hdf5, only: h5file_t
  use io_hdf5_arrays, only: read_array, write_array
  use io_hdf5_notes, only: has_attribute, read_attribute, read_text, write_attribute, write_text
  use io_histories, only: table_t
  use particles_store, only: f_jac, f_plastic, f_pos, f_tau, f_temp, make_tag, n_fields, &
                             particles_t, tag_id
  implicit none (type, external)

  real(rp), parameter :: landmark = 123456.789_rp   ! a temperature that is found in the file again
  character(*), parameter :: input_text = '&TIME T_END=1.0 /'//new_line('a')//'! last line'
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
  call test_checkpoint()
  call test_other_ranks()
  call test_damage()
  call test_histories()
  call end_tests()

contains

  !> Remove a file of the test.
  subroutine discard(path)
    character(*), intent(in) :: path

    call world%barrier()
    if (world%is_root()) call remove_file(path)
    call world%barrier()
  end subroutine discard

  !> Report an error that holds `word`, and forget it.
  subroutine expect_error(name, error, word)
    character(*), intent(in) :: name, word
    type(error_t), intent(inout) :: error
    logical :: ok

    ok = error%is_set()
    if (ok) ok = index(error%message, word) > 0
    if (error%is_set() .and. .not. ok) print '(2a)', name//': ', error%message
    call expect(name, ok)
    if (error%is_set()) deallocate (error%message)
  end subroutine expect_error

  subroutine expect_no_error(name, error)
    character(*), intent(in) :: name
    type(error_t), intent(inout) :: error

    if (error%is_set()) print '(2a)', name//': ', error%message
    call expect(name, .not. error%is_set())
    if (error%is_set()) deallocate (error%message)
  end subroutine expect_no_error

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
    call file%group('/deep', error)
    call write_array(file, 'a', a, error)
    call write_array(file, '/deep/b', b, error)
    call write_array(file, 'c', c, error)
    call write_array(file, 'd', d, error)
    call write_array(file, 'e', e, error)
    call file%close(error)
    call expect_no_error('arrays are written', error)

    call file%open(world, base//'arrays.hdf', error)
    call file%extent('a', dims, error)
    call expect('shape of an array', all(dims == [5_i8, total]))
    call read_array(file, 'a', first, a2, error)
    call read_array(file, '/deep/b', first, b2, error)
    call read_array(file, 'c', first, c2, error)
    call read_array(file, 'd', first, d2, error)
    call read_array(file, 'e', first, e2, error)
    call expect_no_error('arrays are read', error)
    call expect('real64', all(a == a2))
    call expect('real32', all(b == b2))
    call expect('int64', all(c == c2))
    call expect('int32', all(d == d2))
    call expect('int8', all(e == e2))
    call read_array(file, 'a', total, a2(:, 1:min(1, n)), error)
    call expect_error('reading past the end', error, 'shape')
    call read_array(file, 'none', 0_i8, a2, error)
    call expect_error('reading what is not there', error, 'none')
    call file%close(error)
    call discard(base//'arrays.hdf')
  end subroutine test_arrays

  subroutine test_notes()
    type(h5file_t) :: file
    type(error_t) :: error
    character(:), allocatable :: text
    real(rp) :: x, y(2)
    integer :: i

    call file%create(world, base//'notes.hdf', .false., error)
    call write_attribute(file, '/', 'x', 1.5_rp, error)
    call write_attribute(file, '/', 'y', [2.5_rp, 3.5_rp], error)
    call write_attribute(file, '/', 'i', 7, error)
    call write_attribute(file, '/', 'word', 'shoulder', error)
    call write_attribute(file, '/', 'words', ['plate  ', 'backing'], error)
    call write_text(file, 'long', repeat('0123456789', 20000), error)
    call write_text(file, 'empty', '', error)
    call write_text(file, 'of_root', merge('root ', 'other', world%is_root()), error)
    call file%close(error)
    call expect_no_error('notes are written', error)

    call file%open(world, base//'notes.hdf', error)
    call read_attribute(file, '/', 'x', x, error)
    call read_attribute(file, '/', 'y', y, error)
    call read_attribute(file, '/', 'i', i, error)
    call expect('numbers', x == 1.5_rp .and. all(y == [2.5_rp, 3.5_rp]) .and. i == 7)
    call read_attribute(file, '/', 'word', text, error)
    call expect('word', text == 'shoulder' .and. len(text) == 8)
    call read_text(file, 'long', text, error)
    call expect('long text', text == repeat('0123456789', 20000) .and. len(text) == 200000)
    call read_text(file, 'empty', text, error)
    call expect('empty text', len(text) == 0)
    call read_text(file, 'of_root', text, error)
    call expect('text of rank 0', text == 'root')
    call expect('has an attribute', has_attribute(file, '/', 'x'))
    call expect('has no attribute', .not. has_attribute(file, '/', 'z'))
    call expect_no_error('notes are read', error)
    call read_attribute(file, '/', 'y', x, error)
    call expect_error('wrong number of values', error, 'y')
    call file%close(error)
    call discard(base//'notes.hdf')

    call file%create(world, 'no_such_directory/notes.hdf', .false., error)
    call write_attribute(file, '/', 'x', 1.5_rp, error)
    call file%close(error)
    call expect_error('no directory', error, 'created')
  end subroutine test_notes

  !> Blocks of two bodies, some not full; rank 1 (if any) has none.
  subroutine make_particles(p)
    type(particles_t), intent(inout) :: p
    integer :: b, i

    call p%init(n_fields + 2)
    if (world%rank == 1) return
    call p%reserve(3 + world%rank)
    p%nblk = 3 + world%rank
    call random_number(p%ps(:, :, :p%nblk))
    do b = 1, p%nblk
      p%count(b) = nlane - b
      p%body(b) = 1 + mod(b, 2)
      p%ps(nlane, 1, b) = ieee_value(1.0_rp, ieee_quiet_nan)   ! of an unused lane
      do i = 1, nlane
        p%tag(i, b) = make_tag(1000_i8*b + i, mod(i, 64))
      end do
    end do
    p%tag(2, 1) = transfer(ieee_value(1.0_rp, ieee_quiet_nan), 1_i8)
    p%tag(3, 1) = -1_i8
    if (world%is_root()) p%ps(5, f_temp, 2) = landmark
  end subroutine make_particles

  subroutine test_frame()
    type(particles_t) :: p
    type(h5file_t) :: file
    type(error_t) :: error
    real(sp), allocatable :: x(:, :), a(:)
    integer(i8), allocatable :: id(:), offsets(:), dims(:)
    integer(i8) :: first, pieces(world%size)
    character(:), allocatable :: text
    real(rp) :: time
    integer :: n

    call make_particles(p)
    if (p%nblk > 0) then   ! tau = J (-3 I + shear 2): pressure 3, von Mises 2 sqrt(3)
      p%ps(:, f_jac, :) = 2.0_rp
      p%ps(:, f_tau:f_tau + 2, :) = -6.0_rp
      p%ps(:, f_tau + 3, :) = 4.0_rp
      p%ps(:, f_tau + 4:f_tau + 5, :) = 0.0_rp
    end if
    call write_frame(world, base//'frame.hdf', 0.25_rp, 12, 5.0e-4_rp, [1.0e-4_rp, 2.0e-4_rp], &
                     ['plate  ', 'backing'], p, input_text, error)
    call expect_no_error('frame is written', error)

    n = p%total()
    allocate (x(3, n), a(n), id(n), offsets(n + 1))
    call file%open(world, base//'frame.hdf', error)
    call read_attribute(file, '/', 'time', time, error)
    call expect_close('time of a frame', time, 0.25_rp)
    call read_text(file, '/stirpoint/input', text, error)
    call expect('input in a frame', text == input_text)
    call read_array(file, '/VTKHDF/NumberOfPoints', 0_i8, pieces, error)
    first = sum(pieces(:world%rank))
    call expect('points of a piece', pieces(world%rank + 1) == n)
    call file%extent('/VTKHDF/Offsets', dims, error)
    call expect('offsets', dims(1) == sum(pieces) + world%size)
    call read_array(file, '/VTKHDF/Offsets', first + world%rank, offsets, error)
    call expect('offsets of a piece', offsets(1) == 0 .and. offsets(n + 1) == n)
    call read_array(file, '/VTKHDF/Points', first, x, error)
    call expect('positions', are_positions(p, x))
    call read_array(file, '/VTKHDF/PointData/pressure', first, a, error)
    call expect('pressure', all(abs(a - 3.0_sp) < 1.0e-5_sp))
    call read_array(file, '/VTKHDF/PointData/von_mises', first, a, error)
    call expect('von Mises stress', all(abs(a - sqrt(12.0_sp)) < 1.0e-5_sp))
    call read_array(file, '/VTKHDF/PointData/id', first, id, error)
    if (n > 0) id(1:p%count(1)) = id(1:p%count(1)) - tag_id(p%tag(1:p%count(1), 1))
    call expect('identities', all(id(:min(n, nlane - 1)) == 0))
    call read_attribute(file, '/VTKHDF/PointData/temperature', 'units', text, error)
    call expect('units', text == 'K')
    call file%close(error)
    call expect_no_error('frame is read', error)
    call discard(base//'frame.hdf')
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

  subroutine test_series()
    type(error_t) :: error
    character(:), allocatable :: text

    call expect('name of a frame', frame_name('parts', 12) == 'parts_000012.hdf')
    call write_series(world, '.', base//'parts', 2, [0.0_rp, 0.5_rp, 9.0_rp], error)
    call expect_no_error('series is written', error)
    text = contents(base//'parts.hdf.series')
    call expect('last frame of a series', &
                index(text, '"'//base//'parts_000001.hdf", "time": 5.000000000000000E-001}') > 0)
    call expect('frames of a series', index(text, '_000002') == 0)
    call discard(base//'parts.hdf.series')
    call write_series(world, 'no_such_directory', 'parts', 1, [0.0_rp], error)
    call expect_error('no directory for a series', error, 'cannot be written')
  end subroutine test_series

  !> A file as text.
  function contents(path) result(text)
    character(*), intent(in) :: path
    character(:), allocatable :: text
    integer :: unit, length

    call world%barrier()
    inquire (file=path, size=length)
    allocate (character(max(0, length)) :: text)
    open (newunit=unit, file=path, access='stream', action='read')
    read (unit) text
    close (unit)
    call world%barrier()
  end function contents

  !> Rank 0 makes `text` the contents of a file.
  subroutine put(path, text)
    character(*), intent(in) :: path, text
    integer :: unit

    if (world%is_root()) then
      open (newunit=unit, file=path, access='stream', action='write', status='replace')
      write (unit) text
      close (unit)
    end if
    call world%barrier()
  end subroutine put

  !> Write particles, boxes and numbers that differ from rank to rank.
  subroutine save(path, p, error)
    character(*), intent(in) :: path
    type(particles_t), intent(in) :: p
    type(error_t), intent(inout) :: error
    type(box_t) :: boxes(0:world%size - 1)
    integer :: r

    do r = 0, world%size - 1
      boxes(r)%lo = [r, 0, -1]
      boxes(r)%hi = [r, 9, 10*r]
    end do
    call write_checkpoint(world, path, p, boxes, [1.5_rp, real(world%rank, rp), 0.1_rp], &
                          [1.0_rp, real(world%rank, rp)], input_text, error)
  end subroutine save

  !> A restart on as many ranks gets every bit back.
  subroutine test_checkpoint()
    type(particles_t) :: p, q
    type(box_t), allocatable :: boxes(:)
    real(rp), allocatable :: global(:), local(:)
    character(:), allocatable :: text
    type(error_t) :: error
    logical :: same, equal

    call make_particles(p)
    call save(base//'same.h5', p, error)
    call expect_no_error('checkpoint is written', error)
    call read_checkpoint(world, base//'same.h5', q, boxes, global, local, same, text, error)
    call expect_no_error('checkpoint is read', error)
    call expect('same ranks', same .and. allocated(boxes))
    if (allocated(boxes)) call expect('boxes', lbound(boxes, 1) == 0 .and. &
                                      all(boxes(world%rank)%hi == [world%rank, 9, 10*world%rank]))
    call expect('global numbers', all(global == [1.5_rp, 0.0_rp, 0.1_rp]))
    call expect('local numbers', all(local == [1.0_rp, real(world%rank, rp)]))
    call expect('input of a checkpoint', text == input_text)
    equal = q%nblk == p%nblk .and. q%nf == p%nf
    if (equal .and. p%nblk > 0) then
      equal = all(transfer(p%ps(:, :, :p%nblk), [0_i8]) == transfer(q%ps(:, :, :p%nblk), [0_i8])) &
              .and. all(p%tag(:, :p%nblk) == q%tag(:, :p%nblk)) &
              .and. all(p%count(:p%nblk) == q%count(:p%nblk)) &
              .and. all(p%body(:p%nblk) == q%body(:p%nblk))
    end if
    call expect('bitwise the same particles', equal)
    call read_checkpoint_input(world, base//'same.h5', text, error)
    call expect('only the input', text == input_text)
    call discard(base//'same.h5')
    call p%free()
    call q%free()
    call save(base//'empty.h5', p, error)
    call read_checkpoint(world, base//'empty.h5', q, boxes, global, local, same, text, error)
    call expect_no_error('checkpoint without particles', error)
    call discard(base//'empty.h5')
  end subroutine test_checkpoint

  !> Written by all ranks, read by every rank for itself and (but for the last) by one rank fewer.
  subroutine test_other_ranks()
    type(particles_t) :: p
    type(error_t) :: error
    real(rp) :: want(4)

    call make_particles(p)
    call save(base//'other.h5', p, error)
    want = totals(p)
    call world%sum(want)
    call expect_subset(world%rank, want)
    call expect_subset(merge(0, 1, world%rank < max(1, world%size - 1)), want)
    call expect_no_error('checkpoint for others is written', error)
    call discard(base//'other.h5')
    call p%free()
  end subroutine test_other_ranks

  !> Ranks of one colour read the checkpoint; the sums over them must be those over all.
  subroutine expect_subset(colour, want)
    integer, intent(in) :: colour
    real(rp), intent(in) :: want(4)
    type(world_t) :: part
    type(particles_t) :: q
    type(box_t), allocatable :: boxes(:)
    real(rp), allocatable :: global(:), local(:)
    character(:), allocatable :: text
    type(error_t) :: error
    logical :: same
    real(rp) :: got(4)

    call mpi_comm_split(world%comm, colour, world%rank, part%comm)
    call mpi_comm_rank(part%comm, part%rank)
    call mpi_comm_size(part%comm, part%size)
    call read_checkpoint(part, base//'other.h5', q, boxes, global, local, same, text, error)
    call expect_no_error('checkpoint is read by fewer', error)
    call expect('other ranks', (same .eqv. part%size == world%size) .and. (same .eqv. allocated(boxes)))
    got = totals(q)
    call part%sum(got)
    call part%sum(local)
    call expect('particles on other ranks', all(abs(got - want) <= 1.0e-12_rp*want))
    call expect('sum of local numbers', all(nint(local) == &
                                            [world%size, world%size*(world%size - 1)/2]))
    call expect('global numbers on other ranks', all(global == [1.5_rp, 0.0_rp, 0.1_rp]))
    call mpi_comm_free(part%comm)
    call q%free()
  end subroutine expect_subset

  !> Sums over the particles of a rank.
  function totals(p) result(s)
    type(particles_t), intent(in) :: p
    real(rp) :: s(4)
    integer :: b

    s = 0.0_rp
    do b = 1, p%nblk
      s = s + [real(p%count(b), rp), real(p%body(b), rp), &
               sum(p%ps(:p%count(b), f_temp, b)), sum(p%ps(:p%count(b), f_plastic, b))]
    end do
  end function totals

  !> Every damage is an error on all ranks, not a crash.
  subroutine test_damage()
    type(particles_t) :: p
    type(h5file_t) :: file
    type(error_t) :: error
    character(:), allocatable :: path, good
    integer :: at

    path = base//'bad.h5'
    call expect_bad(path, 'does not exist')
    call put(path, 'This is no HDF5 file.')
    call expect_bad(path, 'not an HDF5 file')
    call file%create(world, path, .false., error)
    call file%close(error)
    call expect_bad(path, 'not a checkpoint of Stirpoint')
    call file%create(world, path, .false., error)
    call write_attribute(file, '/', 'format', 'stirpoint checkpoint', error)
    call write_attribute(file, '/', 'version', 99, error)
    call file%close(error)
    call expect_bad(path, 'version 99')

    call make_particles(p)
    call save(path, p, error)
    call expect_no_error('checkpoint to be damaged', error)
    good = contents(path)
    call put(path, good(:len(good) - 100))
    call expect_bad(path, 'cut short')
    call put(path, good(:len(good)/3))
    call expect_bad(path, 'cut short')
    at = index(good, transfer(landmark, '01234567'))
    call expect('landmark is found', at > 0)
    good(at:at) = achar(ieor(iachar(good(at:at)), 1))
    call put(path, good)
    call expect_bad(path, 'damaged')
    call discard(path)
    call p%free()
  end subroutine test_damage

  subroutine expect_bad(path, word)
    character(*), intent(in) :: path, word
    type(particles_t) :: q
    type(box_t), allocatable :: boxes(:)
    real(rp), allocatable :: global(:), local(:)
    character(:), allocatable :: text
    type(error_t) :: error
    logical :: same

    call read_checkpoint(world, path, q, boxes, global, local, same, text, error)
    call expect_error('checkpoint that '//word, error, word)
    call expect('no particles', q%nblk == 0)
    call q%free()
  end subroutine expect_bad

  !> A table goes on after the restart time; later rows and an unfinished one are dropped.
  subroutine test_histories()
    type(table_t) :: table
    type(error_t) :: error
    character(:), allocatable :: path, text
    character(9), parameter :: columns(2) = ['time[s]  ', 'torque[N]']
    real(rp) :: t
    integer :: k

    path = base//'table.csv'
    call table%open(world, path, 'a title', columns, -1.0_rp, error)
    do k = 1, 4
      t = real(k, rp)/3.0_rp
      call table%row([t, -1.0e-120_rp*k])
    end do
    call table%close(error)
    call expect_no_error('table is written', error)
    text = contents(path)
    call expect('fresh table', index(text, '# a title'//newline//'time[s],torque[N]'//newline// &
                                     '3.333333333333E-01,-1.') == 1)
    call put(path, text//'1.3')
    call table%open(world, path, 'a title', columns, 2.0_rp/3.0_rp, error)
    call table%row([9.0_rp, 1.0_rp])
    call table%close(error)
    call expect_no_error('table is continued', error)
    text = contents(path)
    call expect('continued table', index(text, '# a title') == 1 .and. index(text, &
      newline//'6.666666666667E-01,-2.000000000000E-120'//newline// &
      '9.000000000000E+00,1.000000000E+00'//newline, back=.true.) > 30)
    call table%open(world, path, '', ['time[s] ', 'force[N]'], 1.0_rp, error)
    call expect_error('table of other columns', error, 'columns')
    call table%close(error)
    call table%open(world, path, '', columns, -1.0_rp, error)
    call table%close(error)
    call expect('fresh over an old table', contents(path) == 'time[s],torque[N]'//newline)
    call discard(path)
    call table%open(world, path, '', columns, 5.0_rp, error)
    call table%close(error)
    call expect_no_error('restart without the old table', error)
    call discard(path)
  end subroutine test_histories

end program test_io
