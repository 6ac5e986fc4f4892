! SPDX-License-Identifier: MIT
!> What the tests of files share: sample particles, files to spoil, checks of error messages.
module io_samples
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp
  use base_system, only: remove_file
  use base_world, only: world_t
  use check, only: expect
  use particles_store, only: f_temp, make_tag, n_fields, particles_t
  implicit none (type, external)
  private

  public :: discard, contents, put, make_particles, expect_error, expect_no_error

  real(rp), parameter, public :: landmark = 123456.789_rp   !! a temperature to look for in a file
  character(*), parameter, public :: &
    sample_input = '&TIME T_END=1.0 /'//new_line('a')//'! last line'

contains

  !> Remove a file of the test.
  subroutine discard(world, path)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path

    call world%barrier()
    if (world%is_root()) call remove_file(path)
    call world%barrier()
  end subroutine discard

  !> A file as text.
  function contents(world, path) result(text)
    type(world_t), intent(in) :: world
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
  subroutine put(world, path, text)
    type(world_t), intent(in) :: world
    character(*), intent(in) :: path, text
    integer :: unit

    if (world%is_root()) then
      open (newunit=unit, file=path, access='stream', action='write', status='replace')
      write (unit) text
      close (unit)
    end if
    call world%barrier()
  end subroutine put

  !> Blocks of two bodies, some not full; rank 1 (if any) has none.
  subroutine make_particles(world, p)
    type(world_t), intent(in) :: world
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

end module io_samples
