! SPDX-License-Identifier: MIT
!> The law of contact of two bodies at a node.
program test_pair
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use tools_pair, only: compute_pair_impulse, compute_pair_loss, is_apart, is_sliding, is_stuck, &
                        law_coulomb, law_frictionless, law_stick, pair_law_t
  implicit none (type, external)

  real(rp), parameter :: dt = 1.0e-6_rp, slack = 5.0e-5_rp

  call begin_tests()
  call random_init(.true., .false.)
  call test_random_cases()
  call test_stop_at_gap_zero()
  call test_overlap()
  call test_stick()
  call test_rigid()
  call test_frictionless()
  call end_tests()

contains

  !> Any masses, velocities, gaps: momentum to 1e-12, Coulomb's cone, never tensile, the surfaces do
  !> not pass through one another, nothing is gained, and the loss is that of the kinetic energy.
  subroutine test_random_cases()
    type(pair_law_t) :: law
    real(rp) :: m(2), v(3, 2), after(3, 2), n(3), gap, impulse(3), friction, pressing, x(12), fn, ft
    real(rp) :: before_energy, after_energy
    integer :: i, k, state, touched
    logical :: ok(6)

    ok = .true.
    touched = 0
    do i = 1, 20000
      call random_number(x)
      m = 10.0_rp**(-6.0_rp*x(1:2))
      v = reshape(x(3:8) - 0.5_rp, [3, 2])
      n = x(9:11) - 0.5_rp
      n = n/norm2(n)
      gap = dt*0.5_rp*(x(12) - 0.2_rp)
      law = pair_law_t(law_coulomb, 0.3_rp)
      call compute_pair_impulse(law, dt, gap, slack, 0.0_rp, n, 1.0_rp/m, v, impulse, state)
      if (state == is_apart) then
        ok(1) = ok(1) .and. all(abs(impulse) <= 0.0_rp) &
                .and. gap + dt*dot_product(v(:, 2) - v(:, 1), n) >= min(0.0_rp, gap) - 1.0e-18_rp
        cycle
      end if
      touched = touched + 1
      do k = 1, 2
        after(:, k) = v(:, k) + (3 - 2*k)*impulse/m(k)
      end do
      ok(2) = ok(2) .and. norm2(matmul(after, m) - matmul(v, m)) <= 1.0e-12_rp*norm2(matmul(v, m))
      fn = -dot_product(impulse, n)
      ft = norm2(impulse + fn*n)
      ok(3) = ok(3) .and. fn >= 0.0_rp .and. ft <= 0.3_rp*fn*(1.0_rp + 1.0e-12_rp)
      ok(4) = ok(4) .and. abs(max(gap, 0.0_rp) + dt*dot_product(after(:, 2) - after(:, 1), n)) &
              <= 1.0e-12_rp*dt
      call compute_pair_loss(n, impulse, 0.5_rp*(v + after), friction, pressing)
      ok(5) = ok(5) .and. friction >= -1.0e-15_rp*m(1) .and. pressing >= -1.0e-15_rp*m(1)
      before_energy = 0.5_rp*(m(1)*sum(v(:, 1)**2) + m(2)*sum(v(:, 2)**2))
      after_energy = 0.5_rp*(m(1)*sum(after(:, 1)**2) + m(2)*sum(after(:, 2)**2))
      ok(6) = ok(6) .and. abs(before_energy - after_energy - friction - pressing) &
              <= 1.0e-12_rp*before_energy
    end do
    call expect('many cases touch', touched > 5000)
    call expect('no impulse where the gap stays open', ok(1))
    call expect('momentum', ok(2))
    call expect('friction cone, never tensile', ok(3))
    call expect('the gap closes and no further', ok(4))
    call expect('dissipation is not negative', ok(5))
    call expect('losses are the change of kinetic energy', ok(6))
  end subroutine test_random_cases

  !> Exact: two of 1 kg that close at 2 m/s over a gap of 0.5 um in 1 us keep 0.5 m/s.
  subroutine test_stop_at_gap_zero()
    real(rp) :: impulse(3), v(3, 2)
    integer :: state

    v = reshape([1.0_rp, 0.0_rp, 0.0_rp, -1.0_rp, 0.0_rp, 0.0_rp], [3, 2])
    call compute_pair_impulse(pair_law_t(law_coulomb, 0.3_rp), dt, 0.5e-6_rp, slack, 0.0_rp, &
                              [1.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp], v, impulse, state)
    call expect_close('impulse', impulse(1), -0.75_rp, rtol=1.0e-14_rp)
    call compute_pair_impulse(pair_law_t(law_coulomb, 0.3_rp), dt, 2.1e-6_rp, slack, 0.0_rp, &
                              [1.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp], v, impulse, state)
    call expect('wider than the way of a step', state == is_apart)
  end subroutine test_stop_at_gap_zero

  !> Exact: bodies that overlap stop; with a surplus they part, by its whole from an overlap of two
  !> slacks on, by half of it at one; at rest nothing pushes them, nor before they touch.
  subroutine test_overlap()
    real(rp), parameter :: surplus(5) = [0.0_rp, 0.1_rp, 0.1_rp, 0.1_rp, 0.1_rp]
    real(rp), parameter :: gap(5) = [-3.0_rp, -3.0_rp, -2.0_rp, -1.0_rp, 0.02_rp]   ! slacks
    real(rp), parameter :: wanted(5) = [1.0_rp, 1.1_rp, 1.1_rp, 1.05_rp, 0.5_rp]
    real(rp) :: impulse(3), v(3, 2)
    integer :: i, state

    v = 0.0_rp
    call compute_pair_impulse(pair_law_t(law_coulomb, 0.3_rp), dt, -slack, slack, 0.1_rp, &
                              [0.0_rp, 0.0_rp, 1.0_rp], [1.0_rp, 1.0_rp], v, impulse, state)
    call expect('at rest in any overlap', state == is_apart)
    v(3, 1) = 2.0_rp
    do i = 1, 5
      call compute_pair_impulse(pair_law_t(law_frictionless), dt, gap(i)*slack, slack, surplus(i), &
                                [0.0_rp, 0.0_rp, 1.0_rp], [1.0_rp, 1.0_rp], v, impulse, state)
      call expect_close('they stop, or part', impulse(3), -wanted(i), rtol=1.0e-12_rp)
    end do
  end subroutine test_overlap

  !> Exact: bodies that stick have one velocity after it, pulled or pushed, as far as they touch.
  subroutine test_stick()
    real(rp) :: impulse(3), v(3, 2)
    integer :: state

    v = reshape([0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 2.0_rp, 3.0_rp], [3, 2])
    call compute_pair_impulse(pair_law_t(law_stick), dt, 0.5_rp*slack, slack, 0.0_rp, &
                              [0.0_rp, 0.0_rp, 1.0_rp], [1.0_rp, 3.0_rp], v, impulse, state)
    call expect_close('impulse', norm2(impulse - 0.25_rp*v(:, 2)), 0.0_rp, atol=1.0e-15_rp)
    call expect('stuck', state == is_stuck)
    call compute_pair_impulse(pair_law_t(law_stick), dt, 1.1_rp*slack, slack, 0.0_rp, &
                              [0.0_rp, 0.0_rp, 1.0_rp], [1.0_rp, 3.0_rp], v, impulse, state)
    call expect('apart', state == is_apart)
  end subroutine test_stick

  !> Exact: at a rigid body all of the other's normal velocity is lost; sticking below the limit.
  subroutine test_rigid()
    real(rp) :: impulse(3), v(3, 2)
    integer :: state

    v = reshape([0.0_rp, 0.0_rp, 0.0_rp, 0.1_rp, 0.0_rp, -1.0_rp], [3, 2])
    call compute_pair_impulse(pair_law_t(law_coulomb, 0.2_rp), dt, 0.0_rp, slack, 0.0_rp, &
                              [0.0_rp, 0.0_rp, 1.0_rp], [0.0_rp, 0.5_rp], v, impulse, state)
    call expect_close('impulse', norm2(impulse - 2.0_rp*v(:, 2)), 0.0_rp, atol=1.0e-15_rp)
    call expect('sticks', state == is_stuck)
    v(1, 2) = 1.0_rp
    call compute_pair_impulse(pair_law_t(law_coulomb, 0.2_rp), dt, 0.0_rp, slack, 0.0_rp, &
                              [0.0_rp, 0.0_rp, 1.0_rp], [0.0_rp, 0.5_rp], v, impulse, state)
    call expect_close('friction', impulse(1), 0.4_rp, rtol=1.0e-14_rp)
    call expect('slides', state == is_sliding)
  end subroutine test_rigid

  subroutine test_frictionless()
    real(rp) :: impulse(3), v(3, 2)
    integer :: state

    v = reshape([0.0_rp, 0.0_rp, 0.0_rp, 0.1_rp, 0.0_rp, -1.0_rp], [3, 2])
    call compute_pair_impulse(pair_law_t(law_frictionless, 0.2_rp), dt, 0.0_rp, slack, 0.0_rp, &
                              [0.0_rp, 0.0_rp, 1.0_rp], [1.0_rp, 1.0_rp], v, impulse, state)
    call expect_close('impulse', norm2(impulse - [0.0_rp, 0.0_rp, -0.5_rp]), 0.0_rp, &
                      atol=1.0e-15_rp)
  end subroutine test_frictionless

end program test_pair
