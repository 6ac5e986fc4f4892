! SPDX-License-Identifier: MIT
!> Results folder, which belongs to one run at a time and holds the results of one run.
!>
!> NAME_run.txt identifies the run and is locked while it is in progress; the kernel releases the
!> lock when the process ends. Results of another run are moved to previous_1, previous_2, ...
!> before anything is written.
module io_folder
  use base_disk, only: file_bytes, has_no_locks, host_name, list_directory, lock_file, locked, &
                       locked_elsewhere, name_length, process_number, random_number64, read_head
  use base_errors, only: error_t
  use base_files, only: reason_of, text_file_t
  use base_kinds, only: rp
  use base_system, only: make_directory, remove_file, rename_file
  use base_text, only: str
  use base_timers, only: now
  use base_world, only: agree, world_t
  use io_h5_seal, only: previous_of, seal_bytes
  implicit none (type, external)
  private

  public :: lock_folder, clear_folder

  !> Longest wait for the lock of a run that is ending [s].
  real(rp), parameter :: lock_timeout = 5.0_rp
  character(*), parameter :: nl = new_line('a'), run_file = '_run.txt'
  character(*), parameter :: endings(13) = [character(24) :: '_history.csv', '_probes.csv', &
    '_errors.csv', '_tracers.csv', '.hdf.series', '_tools.hdf.series', '_checkpoint.h5', &
    '_checkpoint_previous.h5', '_broken.h5', '_broken_previous.h5', '_summary.json', &
    '_input.nml', '.log']
  character(*), parameter :: unfinished(3) = [character(5) :: '.tmp', '.room', '']

contains

  !> Collective. Make the folder and lock it while the program runs.
  subroutine lock_folder(world, directory, name, note, is_locked, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: directory, name
    character(:), allocatable, intent(out) :: note   !! message for the user; '' if none
    logical, intent(out) :: is_locked  !! the error is that another run has locked the folder
    type(error_t), intent(inout) :: error
    character(:), allocatable :: path
    integer :: status
    logical :: ok

    note = ''
    status = locked
    if (world%is_root()) then
      path = directory//'/'//name//run_file
      call make_directory(directory, ok)
      if (.not. ok) call error%raise('cannot make directory '//directory)
      if (ok) status = lock_file(path, lock_timeout)
      if (status == locked_elsewhere) then
        call error%raise(directory//' is in use by another run: process '// &
                         line_of(path, 'process')//' (see '//path//')')
      else if (status == has_no_locks) then
        note = 'warning: no locks in '//directory//': make sure that no other run writes there'
      else if (status /= locked) then
        call error%raise(path//' cannot be written: '//reason_of(-status))
      end if
    end if
    call agree(world, error)
    is_locked = .not. world%all_true(status /= locked_elsewhere)
  end subroutine lock_folder

  !> Collective. Prepare a locked folder for the results of `run`. Results of another run are moved
  !> to a folder previous_N, or deleted if `overwrites`. For a run resumed in its own folder frames
  !> from number `frames` (from 0) are deleted, and later checkpoints are moved; a run resumed
  !> elsewhere gets a new identifier.
  subroutine clear_folder(world, directory, name, run, restart, frames, overwrites, note, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: directory, name
    character(:), allocatable, intent(inout) :: run
    character(*), intent(in) :: restart               !! checkpoint of a resumed run; '' if none
    integer, intent(in) :: frames
    logical, intent(in) :: overwrites
    character(:), allocatable, intent(out) :: note
    type(error_t), intent(inout) :: error
    character(name_length), allocatable :: all(:), mine(:)
    character(:), allocatable :: place
    character(16) :: digits
    logical :: goes_on
    integer :: frames_there, k

    place = directory//'/'
    note = ''
    goes_on = world%is_root() .and. restart /= ''
    if (goes_on) goes_on = line_of(place//name//run_file, 'run') == run
    if (world%all_true(.not. goes_on)) then           ! give the run a new identifier
      digits = ''
      if (world%is_root()) write (digits, '(z16.16)') random_number64()
      call world%share_message(trim(digits), run)
    end if
    if (world%is_root()) then
      all = list_directory(directory)
      if (goes_on) then
        mine = pack(all, [(any_frame(trim(all(k)), name) >= frames, k=1, size(all))])
        frames_there = count([(number_of_frame(trim(mine(k)), name) >= 0, k=1, size(mine))])
        if (size(mine) > 0) note = 'note: '//str(frames_there)// &
          ' frame(s) later than the checkpoint deleted'
        call delete(place, mine)
        mine = later_checkpoints(place//name//'_checkpoint.h5', restart)
        if (size(mine) > 0) call move_to_previous(directory, name, mine, note, error)
      else
        mine = pack(all, [(is_result(trim(all(k)), name), k=1, size(all))])
        if (size(mine) > 0 .and. overwrites) then
          note = 'note: results of an earlier run in '//directory//' deleted'
          call delete(place, mine)
        else if (size(mine) > 0) then
          if (any(all == 'report')) mine = [character(name_length) :: mine, 'report']
          call move_to_previous(directory, name, mine, note, error)
        end if
      end if
      if (.not. error%is_set()) then
        call write_text(place//name//run_file, 'run '//run//nl//'process '// &
                        str(int(process_number()))//' on '//host_name()//' since '//now()//nl// &
                        job(), error)
      end if
    end if
    call agree(world, error)
  end subroutine clear_folder

  !> Checkpoints that may be later than that of a resumed run: those written after it if it is one
  !> of the two kept, otherwise both.
  function later_checkpoints(newest, restart) result(files)
    character(*), intent(in) :: newest, restart
    character(name_length), allocatable :: files(:)
    character(:), allocatable :: path
    character(seal_bytes) :: head, wanted
    integer :: k
    logical :: ok

    allocate (files(0))
    call read_head(restart, wanted, ok)
    path = newest
    do k = 1, 2
      call read_head(path, head, ok)
      if (ok .and. head == wanted) return
      if (file_bytes(path) >= 0) files = [character(name_length) :: files, &
                                          path(index(path, '/', back=.true.) + 1:)]
      path = previous_of(newest)
    end do
  end function later_checkpoints

  !> Move files into the first folder previous_N that does not exist.
  subroutine move_to_previous(directory, name, files, note, error)
    character(*), intent(in) :: directory, name, files(:)
    character(:), allocatable, intent(inout) :: note
    type(error_t), intent(inout) :: error
    character(:), allocatable :: place
    integer :: k
    logical :: ok

    k = 1
    do
      place = directory//'/previous_'//str(k)
      inquire (file=place//'/.', exist=ok)
      if (.not. ok) exit
      k = k + 1
    end do
    call make_directory(place, ok)
    if (ok) call write_text(place//'/'//name//run_file, 'run '// &
                            line_of(directory//'/'//name//run_file, 'run')//nl//'process '// &
                            line_of(directory//'/'//name//run_file, 'process')//nl, error)
    do k = 1, size(files)
      if (ok) call rename_file(directory//'/'//trim(files(k)), place//'/'//trim(files(k)), ok)
    end do
    if (.not. ok) call error%raise('the results in '//directory//' cannot be moved to '//place)
    if (note /= '') note = note//nl
    note = note//'note: '//str(size(files))//' file(s) of an earlier run moved to '//place
  end subroutine move_to_previous

  !> Delete files in a folder.
  subroutine delete(place, files)
    character(*), intent(in) :: place, files(:)
    integer :: k

    do k = 1, size(files)
      call remove_file(place//trim(files(k)))
    end do
  end subroutine delete

  !> True if a file is a result of a run `name`.
  pure logical function is_result(file, name)
    character(*), intent(in) :: file, name
    character(:), allocatable :: rest
    integer :: k

    is_result = any_frame(file, name) >= 0
    if (index(file, name) /= 1) return
    do k = 1, size(unfinished)
      if (len(file) < len(name) + len_trim(unfinished(k))) cycle
      if (file(len(file) - len_trim(unfinished(k)) + 1:) /= unfinished(k)) cycle
      rest = file(len(name) + 1:len(file) - len_trim(unfinished(k)))
      is_result = is_result .or. any(endings == rest)
    end do
  end function is_result

  !> Number of a frame of `name` or of its tools; -1 if the file is no frame.
  pure integer function any_frame(file, name)
    character(*), intent(in) :: file, name

    any_frame = max(number_of_frame(file, name), number_of_frame(file, name//'_tools'))
  end function any_frame

  !> Number of a frame of `name`, complete or not; -1 if the file is no frame.
  pure integer function number_of_frame(file, name)
    character(*), intent(in) :: file, name
    character(9), parameter :: ending(3) = [character(9) :: '.hdf', '.hdf.tmp', '.hdf.room']
    integer :: digits, status

    number_of_frame = -1
    if (index(file, name//'_') /= 1) return
    digits = verify(file(len(name) + 2:)//' ', '0123456789') - 1
    if (digits < 6 .or. digits > 9) return
    if (all(file(len(name) + 2 + digits:) /= ending)) return
    read (file(len(name) + 2:len(name) + 1 + digits), *, iostat=status) number_of_frame
    if (status /= 0) number_of_frame = -1
  end function number_of_frame

  !> Text after a word at the beginning of a line of a file; '' if none.
  function line_of(path, word) result(rest)
    character(*), intent(in) :: path, word
    character(:), allocatable :: rest
    character(name_length) :: line
    integer :: unit, status

    rest = ''
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (index(line, word//' ') /= 1) cycle
      rest = trim(line(len(word) + 2:))
      exit
    end do
    close (unit, iostat=status)
  end function line_of

  !> Replace the content of a file in place, as it may be locked.
  subroutine write_text(path, text, error)
    character(*), intent(in) :: path, text
    type(error_t), intent(inout) :: error
    type(text_file_t) :: file

    call file%create(path)
    call file%put(text)
    call file%sync()
    call file%close()
    if (file%code /= 0) call error%raise(path//' cannot be written: '//reason_of(file%code))
  end subroutine write_text

  !> Text on the Slurm job of this process; '' if none.
  function job() result(text)
    character(:), allocatable :: text
    character(64) :: number
    integer :: status

    text = ''
    call get_environment_variable('SLURM_JOB_ID', number, status=status)
    if (status == 0 .and. number /= '') text = 'job '//trim(number)//nl
  end function job

end module io_folder
