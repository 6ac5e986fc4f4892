! SPDX-License-Identifier: MIT
!> Seal of a checkpoint: lines in its first 512 bytes with its length and the checksum of the rest.
!> The seal is checked before anything else of the file is read.
module io_h5_seal
  use base_disk, only: file_bytes, file_sum, read_head, sum_words, write_head
  use base_errors, only: error_t
  use base_kinds, only: i8
  use base_text, only: str
  use base_world, only: agree, world_t
  use mpi_f08, only: mpi_allreduce, mpi_bcast, mpi_character, mpi_in_place, mpi_integer8, mpi_sum
  implicit none (type, external)
  private

  public :: check_seal, previous_of, seal

  integer, parameter, public :: seal_bytes = 512      !! the user block of the HDF5 file
  integer, parameter, public :: format_version = 10   !! version of checkpoints
  integer(i8), parameter :: piece = 4194304_i8        !! bytes per piece of the checksum
  character(*), parameter :: first_words = 'Stirpoint checkpoint, version '

contains

  !> Path of the previous checkpoint of `path`.
  pure function previous_of(path) result(previous)
    character(*), intent(in) :: path
    character(:), allocatable :: previous
    integer :: stem

    stem = len_trim(path)
    if (index(path, '.h5', back=.true.) == stem - 2) stem = stem - 3
    previous = path(:stem)//'_previous'//trim(path(stem + 1:))
  end function previous_of

  !> Collective. Write the seal of a complete file.
  subroutine seal(world, path, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    integer(i8) :: bytes, total
    logical :: ok

    call sum_of_file(world, path, bytes, total, error)
    if (error%is_set()) return
    ok = .true.
    if (world%is_root()) call write_head(path, text_of(bytes, total), ok)
    if (.not. ok) call error%raise(path//' cannot be written')
    call agree(world, error)
  end subroutine seal

  !> Collective. Raise an error unless a file is an undamaged checkpoint of this version.
  subroutine check_seal(world, path, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    character(seal_bytes) :: head
    character(:), allocatable :: line
    integer(i8) :: bytes, total, expected
    integer :: status
    logical :: ok

    if (error%is_set()) return
    head = ''
    if (world%is_root()) then
      if (file_bytes(path) < 0) then
        call error%raise(path//' does not exist')
      else
        call read_head(path, head, ok)
        line = head(:max(1, index(head, new_line('a'))) - 1)
        if (head(:len(first_words)) /= first_words) then
          call error%raise(path//' is not a checkpoint of Stirpoint (of version '// &
                           str(format_version)//'), or its beginning is damaged')
        else if (line /= first_words//str(format_version)) then
          call error%raise(path//' is a checkpoint of version '//line(len(first_words) + 1:)// &
                           '; this program reads version '//str(format_version))
        end if
      end if
    end if
    call agree(world, error)
    if (error%is_set()) return
    call mpi_bcast(head, seal_bytes, mpi_character, 0, world%comm)
    call sum_of_file(world, path, bytes, total, error)
    if (error%is_set() .or. head == text_of(bytes, total)) return
    line = head(index(head, 'bytes '):)
    read (line(6:index(line//new_line('a'), new_line('a')) - 1), *, iostat=status) expected
    if (status == 0 .and. expected > bytes) then
      call error%raise(path//' is damaged: it was cut short, from '//str(expected)//' to '// &
                       str(bytes)//' bytes')
    else
      call error%raise(path//' is damaged: its checksum does not match')
    end if
  end subroutine check_seal

  !> Text of the seal.
  pure function text_of(bytes, total) result(text)
    integer(i8), intent(in) :: bytes, total
    character(seal_bytes) :: text
    character(16) :: digits

    write (digits, '(z16.16)') total
    text = first_words//str(format_version)//new_line('a')//'bytes '//str(bytes)//new_line('a')// &
           'checksum '//digits//new_line('a')
  end function text_of

  !> Length of a file, and the checksum of the data after the seal; every rank reads a part.
  subroutine sum_of_file(world, path, bytes, total, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    integer(i8), intent(out) :: bytes, total
    type(error_t), intent(inout) :: error
    integer(i8), allocatable :: sums(:)
    integer(i8) :: first, k
    logical :: ok

    bytes = 0
    if (world%is_root()) bytes = file_bytes(path)
    call mpi_bcast(bytes, 1, mpi_integer8, 0, world%comm)
    allocate (sums(max(0_i8, (bytes - seal_bytes + piece - 1)/piece)), source=0_i8)
    do k = 1 + world%rank, size(sums, kind=i8), world%size
      first = seal_bytes + (k - 1)*piece
      call file_sum(path, first, min(piece, bytes - first), sums(k), ok)
      if (.not. ok) call error%raise(path//' cannot be read')
    end do
    call agree(world, error)
    call mpi_allreduce(mpi_in_place, sums, size(sums), mpi_integer8, mpi_sum, world%comm)
    total = sum_words(bytes, sums, size(sums, kind=i8))
  end subroutine sum_of_file

end module io_h5_seal
