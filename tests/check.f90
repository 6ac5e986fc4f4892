! SPDX-License-Identifier: MIT
!> Test harness: named checks on all ranks of MPI_COMM_WORLD, one verdict, an exit code.
module check
  use, intrinsic :: iso_fortran_env, only: output_unit
  use base_kinds, only: rp
  use mpi_f08, only: MPI_COMM_WORLD, MPI_IN_PLACE, MPI_INTEGER, MPI_SUM, MPI_Allreduce, &
                     MPI_Comm_rank, MPI_Comm_size, MPI_Finalize, MPI_Init, MPI_Initialized
  implicit none (type, external)
  private

  public :: begin_tests, end_tests, expect, expect_close, expect_equal, this_rank

  integer :: n_passed = 0, n_failed = 0, rank = 0, n_ranks = 1

contains

  !> Start MPI, unless the test has done so.
  subroutine begin_tests()
    logical :: is_running

    call MPI_Initialized(is_running)
    if (.not. is_running) call MPI_Init()
    call MPI_Comm_rank(MPI_COMM_WORLD, rank)
    call MPI_Comm_size(MPI_COMM_WORLD, n_ranks)
  end subroutine begin_tests

  !> Collective: passes if `ok` holds on every rank; says how many ranks disagree.
  subroutine expect(name, ok)
    character(*), intent(in) :: name
    logical, intent(in) :: ok
    integer :: n_bad

    n_bad = merge(0, 1, ok)
    call MPI_Allreduce(MPI_IN_PLACE, n_bad, 1, MPI_INTEGER, MPI_SUM, MPI_COMM_WORLD)
    if (n_bad == 0) then
      n_passed = n_passed + 1
    else
      n_failed = n_failed + 1
      if (rank == 0) write (output_unit, '(3a,i0,a,i0,a)') 'FAILED: ', name, ' (on ', n_bad, &
        ' of ', n_ranks, ' ranks)'
    end if
  end subroutine expect

  !> Collective: |got - want| <= atol + rtol |want| on every rank; false for NaN.
  subroutine expect_close(name, got, want, rtol, atol)
    character(*), intent(in) :: name
    real(rp), intent(in) :: got, want
    real(rp), intent(in), optional :: rtol   !! 1e-12 if absent
    real(rp), intent(in), optional :: atol   !! 0 if absent
    real(rp) :: bound

    bound = 1.0e-12_rp*abs(want)
    if (present(rtol)) bound = rtol*abs(want)
    if (present(atol)) bound = bound + atol
    if (.not. abs(got - want) <= bound) write (output_unit, '(2a,i0,2(a,es23.16))') &
      name, ': rank ', rank, ' got ', got, ' wants ', want
    call expect(name, abs(got - want) <= bound)
  end subroutine expect_close

  !> Collective: two texts are the same on every rank.
  subroutine expect_equal(name, got, want)
    character(*), intent(in) :: name, got, want

    logical :: ok

    ok = got == want .and. len(got) == len(want)
    if (.not. ok) write (output_unit, '(2a,i0,5a)') name, ': rank ', rank, ' got "', got, &
      '" wants "', want, '"'
    call expect(name, ok)
  end subroutine expect_equal

  !> Rank of this process, for names of files.
  integer function this_rank()
    this_rank = rank
  end function this_rank

  !> Close with `N passed, N failed` and, if any failed, a non-zero exit code.
  subroutine end_tests()
    if (rank == 0) then
      write (output_unit, '(i0,a,i0,a)') n_passed, ' passed, ', n_failed, ' failed'
      flush (output_unit)
    end if
    call MPI_Finalize()
    if (n_failed > 0) stop 1, quiet=.true.
  end subroutine end_tests

end module check
