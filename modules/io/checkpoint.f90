! SPDX-License-Identifier: MIT
!> Checkpoints with the particle blocks as in memory, so that a restart is exact.
!>
!> With the same number of ranks every rank reads its own blocks, padding included; with another
!> number the blocks are distributed evenly and the caller must redistribute the particles. The file
!> has a seal, a checksum of its content (io_h5_seal).
!>
!> Checkpoints of heat-only runs: the field in the order of the cells, for any number of ranks.
module io_checkpoint
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use base_world, only: agree, world_t
  use grid_geometry, only: box_t
  use io_h5_attributes, only: has_attribute, read_attribute, write_attribute
  use io_h5_data, only: extent, read_array, read_text, write_array, write_text
  use io_h5_file, only: h5file_t
  use io_h5_seal, only: check_seal, previous_of
  use io_plausible, only: is_between, max_magnitude, numbers_t
  use particles_store, only: particles_t
  implicit none (type, external)
  private

  public :: read_checkpoint, read_checkpoint_notes, read_heat_checkpoint, write_checkpoint, &
            write_heat_checkpoint

  !> Metadata of a checkpoint. The texts of rank 0 are written; all ranks read them.
  type, public :: notes_t
    character(:), allocatable :: input   !! input with overrides
    character(:), allocatable :: scene   !! input with all defaults, for comparison
    character(:), allocatable :: run     !! identifier of the run
    real(rp) :: time = 0.0_rp            !! time of the state [s]
    character(:), allocatable :: files   !! checksums of files named in the input; '' if none
    character(:), allocatable :: folder  !! folder to which their paths are relative
    character(:), allocatable :: layout  !! positions of the particle fields; '' if none
  end type notes_t

contains

  !> Collective. Write a checkpoint.
  subroutine write_checkpoint(world, path, particles, boxes, global, local, notes, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(particles_t), intent(in) :: particles
    type(box_t), intent(in) :: boxes(0:)           !! boxes of all ranks
    type(numbers_t), intent(in) :: global   !! state of the run; the values of rank 0 are written
    type(numbers_t), intent(in) :: local    !! sums of this rank, of equal number on all ranks
    type(notes_t), intent(in) :: notes
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer, allocatable :: ends(:, :)
    integer :: mine, r

    ! Data of rank 0 only are arrays without columns on the other ranks.
    mine = merge(1, 0, world%is_root())
    allocate (ends(6, world%size*mine))
    do r = 1, size(ends, 2)
      ends(:, r) = [boxes(r - 1)%lo, boxes(r - 1)%hi]
    end do

    call file%create(world, path, .false., error, sealed=.true.)
    call write_notes(file, notes)
    call write_attribute(file, '/', 'lanes', nlane)
    call write_attribute(file, '/', 'ranks', world%size)
    call write_attribute(file, '/', 'fields', particles%nf)
    call write_attribute(file, '/', 'layout', notes%layout)
    call write_array(file, '/global', global%value(:mine*size(global%value)))
    call write_text(file, '/names', global%names())
    call file%group('/ranks')
    call write_array(file, '/ranks/blocks', [particles%nblk])
    call write_array(file, '/ranks/boxes', ends)
    call write_array(file, '/ranks/local', reshape(local%value, [size(local%value), 1]))
    call write_text(file, '/ranks/names', local%names())
    call write_blocks(file, particles)
    call file%flush()
    call file%close(error)
  end subroutine write_checkpoint

  !> Write the metadata.
  subroutine write_notes(file, notes)
    type(h5file_t), intent(inout) :: file
    type(notes_t), intent(in) :: notes

    call write_text(file, '/input', notes%input)
    call write_text(file, '/scene', notes%scene)
    call write_attribute(file, '/', 'run', notes%run)
    call write_attribute(file, '/', 'time', notes%time)
    if (.not. allocated(notes%files)) return
    if (notes%files == '') return
    call write_attribute(file, '/', 'files', notes%files)
    call write_attribute(file, '/', 'folder', notes%folder)
  end subroutine write_notes

  !> Write the blocks of all ranks, in the order of the ranks.
  subroutine write_blocks(file, particles)
    type(h5file_t), intent(inout) :: file
    type(particles_t), intent(in) :: particles
    real(rp), pointer, contiguous :: state(:, :)
    integer(i8) :: none(nlane, 0)
    integer :: n

    n = particles%nblk
    call file%group('/particles')
    call view_state(particles, n, state)
    call write_array(file, '/particles/state', state)
    if (n > 0) then
      call write_array(file, '/particles/tag', particles%tag(:, :n))
      call write_array(file, '/particles/count', particles%count(:n))
      call write_array(file, '/particles/body', particles%body(:n))
    else   ! arrays of a rank that never had particles may not exist
      call write_array(file, '/particles/tag', none)
      call write_array(file, '/particles/count', [integer ::])
      call write_array(file, '/particles/body', [integer ::])
      deallocate (state)
    end if
  end subroutine write_blocks

  !> View of the first `n` blocks as columns; the caller deallocates `state` if n = 0.
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

  !> Collective. Read a checkpoint. With another number of ranks `boxes` is not allocated, and
  !> `local` is the sum over all ranks on rank 0 and zero elsewhere.
  subroutine read_checkpoint(world, path, particles, boxes, global, local, same_ranks, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(particles_t), intent(inout) :: particles
    type(box_t), allocatable, intent(out) :: boxes(:)   !! (0:ranks-1)
    type(numbers_t), intent(out) :: global, local
    logical, intent(out) :: same_ranks
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer(i8) :: first
    integer :: nf, ranks, mine

    same_ranks = .false.
    call open_checkpoint(file, world, path, error)
    call check_lanes(file, path)
    nf = 0
    ranks = 0
    call read_attribute(file, '/', 'ranks', ranks)
    call read_attribute(file, '/', 'fields', nf)
    call read_global(file, global)
    call read_text(file, '/names', global%stored)
    if (.not. file%error%is_set()) same_ranks = ranks == world%size
    if (same_ranks) call read_boxes(file, world, boxes)
    call read_local(file, world, same_ranks, local%value)
    local%place = '/ranks/local'
    call read_text(file, '/ranks/names', local%stored)
    call split_blocks(file, world, path, nf, ranks, first, mine)
    call read_blocks(file, nf, first, mine, particles)
    call file%close(error)
  end subroutine read_checkpoint

  !> Collective. Read the metadata of a checkpoint.
  subroutine read_checkpoint_notes(world, path, notes, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(notes_t), intent(out) :: notes
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file

    call open_checkpoint(file, world, path, error)
    call read_text(file, '/input', notes%input)
    call read_text(file, '/scene', notes%scene)
    call read_attribute(file, '/', 'run', notes%run)
    call read_attribute(file, '/', 'time', notes%time)
    if (.not. is_between(notes%time, 0.0_rp, max_magnitude)) then
      call file%error%raise(trim(path)//': time is '//str(notes%time)//' s')
    end if
    notes%files = ''
    notes%layout = ''
    if (has_attribute(file, '/', 'layout')) call read_attribute(file, '/', 'layout', notes%layout)
    if (has_attribute(file, '/', 'files')) then
      call read_attribute(file, '/', 'files', notes%files)
      call read_attribute(file, '/', 'folder', notes%folder)
    end if
    call file%close(error)
  end subroutine read_checkpoint_notes

  !> Open a checkpoint with a valid seal; otherwise the message names the previous checkpoint if
  !> that is valid.
  subroutine open_checkpoint(file, world, path, error)
    type(h5file_t), intent(out) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    type(error_t) :: other

    if (.not. error%is_set()) then
      call check_seal(world, path, error)
      if (error%is_set()) call check_seal(world, previous_of(path), other)
      if (error%is_set() .and. .not. other%is_set()) error%message = error%message// &
        '; the checkpoint before it, '//previous_of(path)//', is intact'
    end if
    call file%open(world, path, error)
  end subroutine open_checkpoint

  !> Check that the block size is that of this program.
  subroutine check_lanes(file, path)
    type(h5file_t), intent(inout) :: file
    character(*), intent(in) :: path
    integer :: lanes

    lanes = 0
    call read_attribute(file, '/', 'lanes', lanes)
    if (lanes /= nlane) then
      call file%error%raise(trim(path)//' has blocks of '//str(lanes)// &
                       ' particles; this program was built for '//str(nlane))
    end if
  end subroutine check_lanes

  !> Read the numbers of the run.
  subroutine read_global(file, global)
    type(h5file_t), intent(inout) :: file
    type(numbers_t), intent(inout) :: global
    integer(i8), allocatable :: dims(:)

    call extent(file, '/global', dims)
    allocate (global%value(product(dims)), source=0.0_rp)
    call read_array(file, '/global', 0_i8, global%value)
    global%place = '/global'
  end subroutine read_global

  !> Read the boxes of all ranks.
  subroutine read_boxes(file, world, boxes)
    type(h5file_t), intent(inout) :: file
    type(world_t), intent(in) :: world
    type(box_t), allocatable, intent(out) :: boxes(:)
    integer :: ends(6, 0:world%size - 1), r

    ends = 0
    call read_array(file, '/ranks/boxes', 0_i8, ends)
    if (file%error%is_set()) return
    allocate (boxes(0:world%size - 1))
    do r = 0, world%size - 1
      boxes(r)%lo = ends(1:3, r)
      boxes(r)%hi = ends(4:6, r)
    end do
  end subroutine read_boxes

  !> Read the sums of this rank, or of all ranks.
  subroutine read_local(file, world, same_ranks, local)
    type(h5file_t), intent(inout) :: file
    type(world_t), intent(in) :: world
    logical, intent(in) :: same_ranks
    real(rp), allocatable, intent(out) :: local(:)
    integer(i8), allocatable :: dims(:)
    real(rp), allocatable :: columns(:, :)
    integer(i8) :: first, n

    call extent(file, '/ranks/local', dims)
    if (size(dims) /= 2) call file%error%raise('ranks/local is damaged')
    if (file%error%is_set()) dims = [0_i8, 0_i8]
    first = 0
    n = 0
    if (same_ranks) then
      first = world%rank
      n = min(1_i8, dims(2))
    else if (world%is_root()) then
      n = dims(2)
    end if
    allocate (columns(dims(1), n), source=0.0_rp)
    call read_array(file, '/ranks/local', first, columns)
    local = sum(columns, dim=2)
  end subroutine read_local

  !> Blocks that this rank reads: `mine` blocks from index `first` (from 0).
  subroutine split_blocks(file, world, path, nf, ranks, first, mine)
    type(h5file_t), intent(inout) :: file
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    integer, intent(in) :: nf, ranks
    integer(i8), intent(out) :: first
    integer, intent(out) :: mine
    integer, allocatable :: blocks(:)
    integer(i8), allocatable :: dims(:)
    integer(i8) :: total

    first = 0
    mine = 0
    if (file%error%is_set()) return
    call extent(file, '/ranks/blocks', dims)
    if (any(dims /= ranks)) then
      call file%error%raise(trim(path)//' is damaged: the numbers of ranks do not match')
    end if
    if (file%error%is_set()) return
    allocate (blocks(0:ranks - 1), source=0)
    call read_array(file, '/ranks/blocks', 0_i8, blocks)
    call extent(file, '/particles/state', dims)
    if (file%error%is_set()) return
    total = sum(int(blocks, i8))
    if (nf < 1 .or. any(blocks < 0) .or. any(dims /= [int(nf, i8)*nlane, total])) then
      call file%error%raise(trim(path)//' is damaged: the numbers of blocks do not match')
    else if (ranks == world%size) then
      first = sum(int(blocks(:world%rank - 1), i8))
      mine = blocks(world%rank)
    else
      first = world%rank*total/world%size
      mine = int((world%rank + 1)*total/world%size - first)
    end if
    call agree(world, file%error)
  end subroutine split_blocks

  !> Read the blocks of this rank.
  subroutine read_blocks(file, nf, first, n, particles)
    type(h5file_t), intent(inout) :: file
    integer, intent(in) :: nf, n
    integer(i8), intent(in) :: first
    type(particles_t), intent(inout) :: particles
    real(rp), pointer, contiguous :: state(:, :)

    if (file%error%is_set()) return
    call particles%init(nf)
    call particles%reserve(n)
    particles%nblk = n
    call view_state(particles, n, state)
    call read_array(file, '/particles/state', first, state)
    call read_array(file, '/particles/tag', first, particles%tag(:, :n))
    call read_array(file, '/particles/count', first, particles%count(:n))
    call read_array(file, '/particles/body', first, particles%body(:n))
    if (n == 0) deallocate (state)
    if (file%error%is_set()) call particles%init(nf)
  end subroutine read_blocks

  !> Collective. Write a checkpoint.
  subroutine write_heat_checkpoint(world, path, field, global, notes, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in), contiguous :: field(:, :)   !! (cells of a plane, own planes)
    type(numbers_t), intent(in) :: global  !! state of the run; the values of rank 0 are written
    type(notes_t), intent(in) :: notes
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer :: mine

    mine = merge(1, 0, world%is_root())
    call file%create(world, path, .false., error, sealed=.true.)
    call write_notes(file, notes)
    call write_array(file, '/global', global%value(:mine*size(global%value)))
    call write_text(file, '/names', global%names())
    call file%group('/heat')
    call write_array(file, '/heat/state', field)
    call file%flush()
    call file%close(error)
  end subroutine write_heat_checkpoint

  !> Collective. Read a checkpoint, with the planes from `first` (from 0).
  subroutine read_heat_checkpoint(world, path, first, field, global, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    integer, intent(in) :: first
    real(rp), intent(inout), contiguous :: field(:, :)
    type(numbers_t), intent(out) :: global
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file

    call open_checkpoint(file, world, path, error)
    call read_global(file, global)
    call read_array(file, '/heat/state', int(first, i8), field)
    call file%close(error)
  end subroutine read_heat_checkpoint

end module io_checkpoint
