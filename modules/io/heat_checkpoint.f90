! SPDX-License-Identifier: MIT
!> Checkpoints of heat-only runs: the field in the order of the cells, for any number of ranks.
module io_heat_checkpoint
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use comm_world, only: world_t
  use io_checkpoint, only: notes_t, open_checkpoint, write_notes
  use io_h5_arrays, only: read_array, write_array
  use io_h5_file, only: h5file_t
  implicit none (type, external)
  private

  public :: write_heat_checkpoint, read_heat_checkpoint

contains

  !> Collective. Write a checkpoint.
  subroutine write_heat_checkpoint(world, path, field, global, notes, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    real(rp), intent(in), contiguous :: field(:, :)   !! (cells of a plane, own planes)
    real(rp), intent(in), contiguous :: global(:)     !! state of the run; that of rank 0 is written
    type(notes_t), intent(in) :: notes
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer :: mine

    mine = merge(1, 0, world%is_root())
    call file%create(world, path, .false., error, sealed=.true.)
    call write_notes(file, notes, error)
    call write_array(file, '/global', global(:mine*size(global)), error)
    call file%group('/heat', error)
    call write_array(file, '/heat/state', field, error)
    call file%flush(error)
    call file%close(error)
  end subroutine write_heat_checkpoint

  !> Collective. Read a checkpoint, with the planes from `first` (from 0).
  subroutine read_heat_checkpoint(world, path, first, field, global, error)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path
    integer, intent(in) :: first
    real(rp), intent(inout), contiguous :: field(:, :)
    real(rp), allocatable, intent(out) :: global(:)
    type(error_t), intent(inout) :: error
    type(h5file_t) :: file
    integer(i8), allocatable :: dims(:)

    call open_checkpoint(file, world, path, error)
    call file%extent('/global', dims, error)
    allocate (global(product(dims)), source=0.0_rp)
    call read_array(file, '/global', 0_i8, global, error)
    call read_array(file, '/heat/state', int(first, i8), field, error)
    call file%close(error)
  end subroutine read_heat_checkpoint

end module io_heat_checkpoint
