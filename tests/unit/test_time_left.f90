! SPDX-License-Identifier: MIT
!> Time that is left: within 20 % after a tenth of the run and from then on, for runs that start
!> slowly, become slower or faster, and with noise; samples stay few.
program test_time_left
  use base_kinds, only: rp
  use base_text, only: str
  use check, only: begin_tests, end_tests, expect, expect_close
  use output_progress, only: time_left_t
  implicit none (type, external)

  real(rp), parameter :: wall = 3000.0_rp       !! of a run [s]
  integer, parameter :: steps = 2000

  call begin_tests()
  call random_init(.true., .false.)
  call test_run('steady', 0.0_rp, 0.0_rp, 0.0_rp)
  call test_run('after a start of 3 % of the time', 0.03_rp, 0.0_rp, 0.0_rp)
  call test_run('slower and slower, by a third', 0.0_rp, -0.33_rp, 0.0_rp)
  call test_run('faster and faster, by a third', 0.0_rp, 0.33_rp, 0.0_rp)
  call test_run('with steps of random length', 0.01_rp, 0.0_rp, 1.0_rp)
  call test_recent()
  call end_tests()

contains

  !> A run that stands still for a part `idle` of its time, then goes on at a rate that changes by
  !> the part `trend` until the end, in steps that differ by the part `noise`.
  subroutine test_run(name, idle, trend, noise)
    character(*), intent(in) :: name
    real(rp), intent(in) :: idle, trend, noise
    type(time_left_t) :: left
    real(rp) :: at(steps), share(steps), u, worst
    integer :: k

    do k = 1, steps
      call random_number(u)
      at(k) = (k + noise*(u - 0.5_rp))/steps
      share(k) = max(0.0_rp, at(k) - idle)/(1.0_rp - idle)
      share(k) = share(k)*(1.0_rp + 0.5_rp*trend*share(k))/(1.0_rp + 0.5_rp*trend)
    end do
    worst = 0.0_rp
    call left%init(10.0_rp, .false.)
    do k = 1, steps
      call left%add_sample(wall*at(k), share(k))
      if (share(k) < 0.1_rp .or. at(k) > 0.99_rp) cycle
      worst = max(worst, abs(left%seconds(wall*at(k), share(k))/(wall*(1.0_rp - at(k))) - 1.0_rp))
    end do
    call expect(name//': within 20 % from a tenth on ('//str(100.0_rp*worst)//' %)', worst < 0.2_rp)
  end subroutine test_run

  !> What was long ago does not count: half as fast in the second half of the time so far, to a
  !> gap between samples.
  subroutine test_recent()
    type(time_left_t) :: left
    integer :: k

    call left%init(10.0_rp, .false.)
    do k = 1, 100
      call left%add_sample(real(k, rp), min(k, 50)*2.0e-3_rp + max(k - 50, 0)*1.0e-3_rp)
    end do
    call expect_close('as fast as lately', left%seconds(100.0_rp, 0.15_rp), 850.0_rp, &
                      rtol=0.05_rp)
  end subroutine test_recent

end program test_time_left
