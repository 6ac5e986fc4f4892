! SPDX-License-Identifier: MIT
!> Checkpoints: exact on as many ranks, complete on others, and an error when damaged.
program test_checkpoint
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_text, only: str
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect
  use grid_geometry, only: box_t
  use io_checkpoint, only: notes_t, read_checkpoint, read_checkpoint_notes, write_checkpoint
  use io_h5_file, only: h5file_t
  use io_plausible, only: numbers_t
  use io_samples, only: contents, discard, expect_error, expect_no_error, landmark, &
                        make_particles, put, sample_input
  use mpi_f08, only: mpi_comm_free, mpi_comm_rank, mpi_comm_size, mpi_comm_split
  use particles_store, only: f_plastic, f_temp, particles_t
  implicit none (type, external)

  type(world_t) :: world
  character(:), allocatable :: base

  call start_world(world)
  call begin_tests()
  base = 'test_checkpoint_'//str(world%size)//'_'
  call test_same_ranks()
  call test_empty()
  call test_other_ranks()
  call test_damage()
  call test_names()
  deallocate (base)
  call end_tests()

contains

  !> Write particles, boxes and numbers that differ from rank to rank.
  subroutine save(path, p, error)
    character(*), intent(in) :: path
    type(particles_t), intent(in) :: p
    type(error_t), intent(inout) :: error
    type(box_t) :: boxes(0:world%size - 1)
    type(notes_t) :: notes
    integer :: r

    notes%input = sample_input
    notes%scene = 'all of it'
    notes%run = 'run 1'
    notes%layout = '25 0 26'
    notes%time = 0.25_rp
    do r = 0, world%size - 1
      boxes(r)%lo = [r, 0, -1]
      boxes(r)%hi = [r, 9, 10*r]
    end do
    call write_checkpoint(world, path, p, boxes, &
                          numbers_t(value=[1.5_rp, real(world%rank, rp), 0.1_rp]), &
                          numbers_t(value=[1.0_rp, real(world%rank, rp)]), notes, error)
  end subroutine save

  !> A restart on as many ranks gets every bit back.
  subroutine test_same_ranks()
    type(particles_t) :: p, q
    type(box_t), allocatable :: boxes(:)
    type(numbers_t) :: global, local
    type(notes_t) :: notes
    type(error_t) :: error
    logical :: same, equal

    call make_particles(world, p)
    call save(base//'same.h5', p, error)
    call expect_no_error('checkpoint is written', error)
    call read_checkpoint(world, base//'same.h5', q, boxes, global, local, same, error)
    call expect_no_error('checkpoint is read', error)
    call expect('same ranks', same .and. allocated(boxes))
    if (allocated(boxes)) call expect('boxes', lbound(boxes, 1) == 0 .and. &
                                      all(boxes(world%rank)%hi == [world%rank, 9, 10*world%rank]))
    call expect('global numbers', all(global%value == [1.5_rp, 0.0_rp, 0.1_rp]))
    call expect('local numbers', all(local%value == [1.0_rp, real(world%rank, rp)]))
    equal = q%nblk == p%nblk .and. q%nf == p%nf
    if (equal .and. p%nblk > 0) then
      equal = all(transfer(p%ps(:, :, :p%nblk), [0_i8]) == transfer(q%ps(:, :, :p%nblk), [0_i8])) &
              .and. all(p%tag(:, :p%nblk) == q%tag(:, :p%nblk)) &
              .and. all(p%count(:p%nblk) == q%count(:p%nblk)) &
              .and. all(p%body(:p%nblk) == q%body(:p%nblk))
    end if
    call expect('bitwise the same particles', equal)
    call read_checkpoint_notes(world, base//'same.h5', notes, error)
    call expect('notes of a checkpoint', notes%input == sample_input .and. notes%time == 0.25_rp &
                .and. notes%scene == 'all of it' .and. notes%run == 'run 1' &
                .and. notes%layout == '25 0 26')
    call discard(world, base//'same.h5')
    call p%free()
    call q%free()
  end subroutine test_same_ranks

  subroutine test_empty()
    type(particles_t) :: p, q
    type(box_t), allocatable :: boxes(:)
    type(numbers_t) :: global, local
    type(error_t) :: error
    logical :: same

    call save(base//'empty.h5', p, error)
    call read_checkpoint(world, base//'empty.h5', q, boxes, global, local, same, error)
    call expect_no_error('checkpoint without particles', error)
    call expect('no particles came', q%total() == 0)
    call discard(world, base//'empty.h5')
    call q%free()
  end subroutine test_empty

  !> Written by all ranks, read by every rank for itself and (but for the last) by one rank fewer.
  subroutine test_other_ranks()
    type(particles_t) :: p
    type(error_t) :: error
    real(rp) :: want(4)

    call make_particles(world, p)
    call save(base//'other.h5', p, error)
    want = totals(p)
    call world%sum(want)
    call expect_subset(world%rank, want)
    call expect_subset(merge(0, 1, world%rank < max(1, world%size - 1)), want)
    call expect_no_error('checkpoint for others is written', error)
    call discard(world, base//'other.h5')
    call p%free()
  end subroutine test_other_ranks

  !> Ranks of one colour read the checkpoint; the sums over them must be those over all.
  subroutine expect_subset(colour, want)
    integer, intent(in) :: colour
    real(rp), intent(in) :: want(4)
    type(world_t) :: part
    type(particles_t) :: q
    type(box_t), allocatable :: boxes(:)
    type(numbers_t) :: global, local
    type(error_t) :: error
    logical :: same
    real(rp) :: got(4)

    call mpi_comm_split(world%comm, colour, world%rank, part%comm)
    call mpi_comm_rank(part%comm, part%rank)
    call mpi_comm_size(part%comm, part%size)
    call read_checkpoint(part, base//'other.h5', q, boxes, global, local, same, error)
    call expect_no_error('checkpoint is read by fewer', error)
    call expect('other ranks', &
                (same .eqv. part%size == world%size) .and. (same .eqv. allocated(boxes)))
    got = totals(q)
    call part%sum(got)
    call part%sum(local%value)
    call expect('particles on other ranks', all(abs(got - want) <= 1.0e-12_rp*want))
    call expect('sum of local numbers', &
                all(nint(local%value) == [world%size, world%size*(world%size - 1)/2]))
    call expect('global numbers on other ranks', all(global%value == [1.5_rp, 0.0_rp, 0.1_rp]))
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
    call put(world, path, 'This is no HDF5 file.')
    call expect_bad(path, 'not a checkpoint of Stirpoint')
    call file%create(world, path, .false., error)
    call file%close(error)
    call expect_bad(path, 'not a checkpoint of Stirpoint')
    call put(world, path, 'Stirpoint checkpoint, version 99'//new_line('a')//repeat(' ', 600))
    call expect_bad(path, 'version 99')
    call file%create(world, path, .false., error, sealed=.true.)
    call file%close(error)
    call expect_bad(path, 'lanes')

    call make_particles(world, p)
    call save(path, p, error)
    call expect_no_error('checkpoint to be damaged', error)
    good = contents(world, path)
    call put(world, path, good(:len(good) - 100))
    call expect_bad(path, 'cut short')
    call put(world, path, good(:len(good)/3))
    call expect_bad(path, 'cut short')
    at = index(good, transfer(landmark, '01234567'))
    call expect('landmark is found', at > 0)
    good(at:at) = achar(ieor(iachar(good(at:at)), 1))
    call put(world, path, good)
    call expect_bad(path, 'damaged')
    call discard(world, path)
    call p%free()
  end subroutine test_damage

  subroutine expect_bad(path, word)
    character(*), intent(in) :: path, word
    type(particles_t) :: q
    type(box_t), allocatable :: boxes(:)
    type(numbers_t) :: global, local
    type(error_t) :: error
    logical :: same

    call read_checkpoint(world, path, q, boxes, global, local, same, error)
    call expect_error('checkpoint that '//word, error, word)
    call expect('no particles', q%nblk == 0)
    call q%free()
  end subroutine expect_bad

  !> Numbers of a file with other names, or another number of them, are refused; the message has the
  !> first name that differs.
  subroutine test_names()
    character(1), parameter :: nl = new_line('a')

    call compare('2 a speed'//nl//'1 a time'//nl, '')
    call compare('2 a speed'//nl//'1 a force'//nl, '1 a force instead of 1 a time')
    call compare('1 a speed'//nl//'2 a time'//nl, '1 a speed instead of 2 a speed')
    call compare('2 a speed'//nl, 'nothing instead of 1 a time')
    call compare('2 a speed'//nl//'1 a time'//nl//'1 a force'//nl, '1 a force instead of nothing')
  end subroutine test_names

  !> Read two speeds and a time from numbers with the names `stored`.
  subroutine compare(stored, message)
    character(*), intent(in) :: stored, message
    type(numbers_t) :: numbers
    real(rp) :: speed(2), time

    numbers = numbers_t(value=[1.0_rp, 2.0_rp, 3.0_rp])
    numbers%place = '/global'
    numbers%stored = stored
    call numbers%pass(2, speed, 'a speed')
    call numbers%pass_one(time, 'a time')
    call numbers%finish()
    if (message == '') then
      call expect_no_error('numbers with their names', numbers%error)
      call expect('named numbers', all([speed, time] == [1.0_rp, 2.0_rp, 3.0_rp]))
    else
      call expect_error('numbers with other names', numbers%error, message)
    end if
  end subroutine compare

end program test_checkpoint
