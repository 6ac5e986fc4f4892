! SPDX-License-Identifier: MIT
!> Checkpoints: the particle blocks as they lie in memory, so that a restart is exact.
!>
!> With as many ranks as before every rank gets back its own blocks, padding included; with another
!> number the blocks are dealt out evenly and the caller has to distribute the particles anew.
module io_checkpoint
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use comm_world, only: world_t
  use grid_geometry, only: box_t
  use io_agree, only: agree
  use io_hdf5, only: h5file_t
  use io_hdf5_arrays, only: read_array, write_array
  use io_hdf5_notes, only: has_attribute, read_attribute, read_text, write_attribute, write_text
  use particles_store, only: particles_t
  implicit none (type, external)
  private

  public :: write_checkpoint, read_checkpoint, read_checkpoint_input, mark_format, check_format

  character(*), parameter :: format_name = 'stirpoint checkpoint'
  integer, parameter :: format_version = 4

contains

  !> Write everything that a restart needs.
  subroutine write_checkpoint(world, path, particles, boxes, global, local, input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(particles_t), intent(in) :: particles
    type(box_t), intent(in) :: boxes(0:)           !! of all ranks
    real(rp), intent(in), contiguous :: global(:)   !! state of the run; rank 0's is kept
    real(rp), intent(in), contiguous :: local(:)    !! of this rank, as many numbers on every rank
    character(*), intent(in) :: input_text          !! of rank 0
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer, allocatable :: ends(:, :)
    integer :: mine, r

    ! What rank 0 writes for all is an array of which the other ranks have no columns.
    mine = merge(1, 0, world%is_root())
    allocate (ends(6, world%size*mine))
    do r = 1, size(ends, 2)
      ends(:, r) = [boxes(r - 1)%lo, boxes(r - 1)%hi]
    end do

    call file%create(world, path, .false., error)
    call mark_format(file, error)
    call write_attribute(file, '/', 'ranks', world%size, error)
    call write_attribute(file, '/', 'fields', particles%nf, error)
    call write_text(file, '/input', input_text, error)
    call write_array(file, '/global', global(:mine*size(global)), error)
    call file%group('/ranks', error)
    call write_array(file, '/ranks/blocks', [particles%nblk], error)
    call write_array(file, '/ranks/boxes', ends, error)
    call write_array(file, '/ranks/local', reshape(local, [size(local), 1]), error)
    call write_blocks(file, particles, error)
    call file%flush(error)
    call file%close(error)
  end subroutine write_checkpoint

  !> What tells a checkpoint of this program from other files.
  subroutine mark_format(file, error)
    type(h5file_t), intent(in) :: file
    type(error_t), intent(inout) :: error

    call write_attribute(file, '/', 'format', format_name, error)
    call write_attribute(file, '/', 'version', format_version, error)
    call write_attribute(file, '/', 'lanes', nlane, error)
  end subroutine mark_format

  !> The blocks of all ranks, one after the other.
  subroutine write_blocks(file, particles, error)
    type(h5file_t), intent(in) :: file
    type(particles_t), intent(in) :: particles
    type(error_t), intent(inout) :: error
    real(rp), pointer, contiguous :: state(:, :)
    integer(i8) :: none(nlane, 0)
    integer :: n

    n = particles%nblk
    call file%group('/particles', error)
    call view_state(particles, n, state)
    call write_array(file, '/particles/state', state, error)
    call write_array(file, '/particles/checksum', checksums(particles), error)
    if (n > 0) then
      call write_array(file, '/particles/tag', particles%tag(:, :n), error)
      call write_array(file, '/particles/count', particles%count(:n), error)
      call write_array(file, '/particles/body', particles%body(:n), error)
    else   ! the arrays of a rank that never had particles may not exist
      call write_array(file, '/particles/tag', none, error)
      call write_array(file, '/particles/count', [integer ::], error)
      call write_array(file, '/particles/body', [integer ::], error)
      deallocate (state)
    end if
  end subroutine write_blocks

  !> The first `n` blocks as columns; the caller deallocates `state` if n = 0.
  subroutine view_state(particles, n, state)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: n
    real(rp), pointer, contiguous, intent(out) :: state(:, :)

    if (n > 0) then
      call c_f_pointer(c_loc(particles%ps), state, [nlane*particles%nf, n])
    else
      allocate (state(nlane*particles%nf, 0))
    end if
  end subroutine view_state

  !> For each block a number that changes with any bit of its state, tags, count or body.
  pure function checksums(particles) result(sums)
    type(particles_t), intent(in) :: particles
    integer(i8) :: sums(particles%nblk), s
    integer :: b, f, i

    do b = 1, particles%nblk
      s = ior(ishft(int(particles%body(b), i8), 32), int(particles%count(b), i8))
      do i = 1, nlane
        s = ieor(ishftc(s, 1), particles%tag(i, b))
      end do
      do f = 1, particles%nf
        do i = 1, nlane
          s = ieor(ishftc(s, 1), transfer(particles%ps(i, f, b), s))
        end do
      end do
      sums(b) = s
    end do
  end function checksums

  !> Read a checkpoint. `boxes` is allocated only if the number of ranks is that of the writer;
  !> if not, `local` of all ranks is summed on rank 0 and zero elsewhere.
  subroutine read_checkpoint(world, path, particles, boxes, global, local, same_ranks, &
                             input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(particles_t), intent(inout) :: particles
    type(box_t), allocatable, intent(out) :: boxes(:)   !! (0:ranks-1)
    real(rp), allocatable, intent(out) :: global(:), local(:)
    logical, intent(out) :: same_ranks
    character(:), allocatable, intent(out) :: input_text
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer(i8), allocatable :: dims(:)
    integer(i8) :: first
    integer :: nf, ranks, mine

    same_ranks = .false.
    call file%open(world, path, error)
    call check_format(file, path, error)
    nf = 0
    ranks = 0
    call read_attribute(file, '/', 'ranks', ranks, error)
    call read_attribute(file, '/', 'fields', nf, error)
    call read_text(file, '/input', input_text, error)
    call file%extent('/global', dims, error)
    allocate (global(product(dims)), source=0.0_rp)
    call read_array(file, '/global', 0_i8, global, error)
    if (.not. error%is_set()) same_ranks = ranks == world%size
    if (same_ranks) call read_boxes(file, world, boxes, error)
    call read_local(file, world, same_ranks, local, error)
    call share_blocks(file, world, path, nf, ranks, first, mine, error)
    call read_blocks(file, path, nf, first, mine, particles, error)
    call file%close(error)
  end subroutine read_checkpoint

  !> Only the input of a checkpoint.
  subroutine read_checkpoint_input(world, path, input_text, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: input_text
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file

    call file%open(world, path, error)
    call check_format(file, path, error)
    call read_text(file, '/input', input_text, error)
    call file%close(error)
  end subroutine read_checkpoint_input

  !> A checkpoint of this program, of this version and of this block length?
  subroutine check_format(file, path, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    character(:), allocatable :: name
    integer :: version, lanes

    if (error%is_set()) return
    name = ''
    if (has_attribute(file, '/', 'format')) call read_attribute(file, '/', 'format', name, error)
    if (name /= format_name) call error%raise(trim(path)//' is not a checkpoint of Stirpoint')
    call agree(file%world, error)
    version = 0
    lanes = 0
    call read_attribute(file, '/', 'version', version, error)
    if (.not. error%is_set() .and. version /= format_version) then
      call error%raise(trim(path)//' is a checkpoint of version '//str(version)// &
                       '; this program reads version '//str(format_version))
    end if
    call read_attribute(file, '/', 'lanes', lanes, error)
    if (.not. error%is_set() .and. lanes /= nlane) then
      call error%raise(trim(path)//' has blocks of '//str(lanes)// &
                       ' particles; this program was built for '//str(nlane))
    end if
    call agree(file%world, error)
  end subroutine check_format

  subroutine read_boxes(file, world, boxes, error)
    type(h5file_t), intent(in) :: file
    type(world_t), intent(in) :: world
    type(box_t), allocatable, intent(out) :: boxes(:)
    type(error_t), intent(inout) :: error
    integer :: ends(6, 0:world%size - 1), r

    ends = 0
    call read_array(file, '/ranks/boxes', 0_i8, ends, error)
    if (error%is_set()) return
    allocate (boxes(0:world%size - 1))
    do r = 0, world%size - 1
      boxes(r)%lo = ends(1:3, r)
      boxes(r)%hi = ends(4:6, r)
    end do
  end subroutine read_boxes

  subroutine read_local(file, world, same_ranks, local, error)
    type(h5file_t), intent(in) :: file
    type(world_t), intent(in) :: world
    logical, intent(in) :: same_ranks
    real(rp), allocatable, intent(out) :: local(:)
    type(error_t), intent(inout) :: error
    integer(i8), allocatable :: dims(:)
    real(rp), allocatable :: columns(:, :)
    integer(i8) :: first, n

    call file%extent('/ranks/local', dims, error)
    if (.not. error%is_set() .and. size(dims) /= 2) call error%raise('ranks/local is damaged')
    if (error%is_set()) dims = [0_i8, 0_i8]
    first = 0
    n = 0
    if (same_ranks) then
      first = world%rank
      n = min(1_i8, dims(2))
    else if (world%is_root()) then
      n = dims(2)
    end if
    allocate (columns(dims(1), n), source=0.0_rp)
    call read_array(file, '/ranks/local', first, columns, error)
    local = sum(columns, dim=2)
  end subroutine read_local

  !> Which blocks this rank reads: `mine` of them from number `first` (from 0).
  subroutine share_blocks(file, world, path, nf, ranks, first, mine, error)
    type(h5file_t), intent(in) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    integer, intent(in) :: nf, ranks
    integer(i8), intent(out) :: first
    integer, intent(out) :: mine
    type(error_t), intent(inout) :: error
    integer, allocatable :: blocks(:)
    integer(i8), allocatable :: dims(:)
    integer(i8) :: total

    first = 0
    mine = 0
    if (error%is_set()) return
    allocate (blocks(0:max(1, ranks) - 1), source=0)
    call read_array(file, '/ranks/blocks', 0_i8, blocks, error)
    call file%extent('/particles/state', dims, error)
    if (error%is_set()) return
    total = sum(int(blocks, i8))
    if (nf < 1 .or. any(blocks < 0) .or. any(dims /= [int(nf*nlane, i8), total])) then
      call error%raise(trim(path)//' is damaged: the numbers of blocks do not match')
    else if (ranks == world%size) then
      first = sum(int(blocks(:world%rank - 1), i8))
      mine = blocks(world%rank)
    else
      first = world%rank*total/world%size
      mine = int((world%rank + 1)*total/world%size - first)
    end if
    call agree(world, error)
  end subroutine share_blocks

  subroutine read_blocks(file, path, nf, first, n, particles, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: nf, n
    integer(i8), intent(in) :: first
    type(particles_t), intent(inout) :: particles
    type(error_t), intent(inout) :: error
    real(rp), pointer, contiguous :: state(:, :)
    integer(i8) :: sums(n)

    if (error%is_set()) return
    call particles%init(nf)
    call particles%reserve(n)
    particles%nblk = n
    sums = 0
    call view_state(particles, n, state)
    call read_array(file, '/particles/state', first, state, error)
    call read_array(file, '/particles/checksum', first, sums, error)
    call read_array(file, '/particles/tag', first, particles%tag(:, :n), error)
    call read_array(file, '/particles/count', first, particles%count(:n), error)
    call read_array(file, '/particles/body', first, particles%body(:n), error)
    if (.not. error%is_set()) then
      if (any(checksums(particles) /= sums)) call error%raise(trim(path)//' is damaged')
      call agree(file%world, error)
    end if
    if (n == 0) deallocate (state)
    if (error%is_set()) call particles%init(nf)
  end subroutine read_blocks

end module io_checkpoint
