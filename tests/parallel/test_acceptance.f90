! SPDX-License-Identifier: MIT
!> Which steps stand, and that one that is refused leaves nothing behind.
program test_acceptance
  use, intrinsic :: ieee_arithmetic, only: ieee_invalid, ieee_quiet_nan, ieee_set_flag, &
                                           ieee_set_halting_mode, ieee_value
  use base_kinds, only: rp
  use base_timers, only: wall_time
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use node_samples, only: all_of, map_particles, set_velocity
  use particles_store, only: f_pos, f_vel
  use state_budget, only: budget_t
  use state_clock, only: clock_t, outcome_t
  use state_nodes, only: update_nodes
  use state_parts, only: free_simulation, simulation_t
  use step_acceptance, only: finish_acceptance, post_acceptance
  use step_advance, only: take_step
  use step_constraints, only: apply_boundary
  use step_samples, only: add_clamp, add_plane_of_symmetry, add_tool, fill, h, make_flow, &
                          plane_tool, rho, settle, shake, start_scene
  use step_schedule, only: blocks_to_particles, save_block, save_state
  use step_schedule, only: accept_step
  use step_to_grid, only: particles_to_grid
  implicit none (type, external)

  real(rp), parameter :: dt = 1.0e-6_rp, at_rest(3, 3) = 0.0_rp, far = 1.0e9_rp
  real(rp), parameter :: way(3) = [0.48_rp, -0.6_rp, 0.64_rp]   ! of length 1
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_half_a_cell()
  call test_who_counts()
  call test_broken()
  call test_messages()
  call test_same_as_smaller()
  call test_rollback()
  call end_tests()

contains

  !> A plate whose nodes are at rest.
  subroutine prepare(sim)
    type(simulation_t), intent(inout) :: sim

    call start_scene(sim, [6, 2, 2], 3, 1)
    call add_clamp(sim, [-far, -far, -far], [0.0_rp, far, far], [.true., .false., .true.], &
                   [1.0_rp, 2.0_rp, 3.0_rp])
    call fill(world, sim, 1, [-1.0_rp, 0.0_rp, 0.0_rp], [6.0_rp, 2.0_rp, 2.0_rp], 2)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
  end subroutine prepare

  !> Collective. Whether a step of `taken` [s] is refused; it comes back as what is to be tried.
  logical function is_refused(sim, taken, stands) result(so)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: taken
    logical, intent(out), optional :: stands     !! as far as this rank can see
    logical :: may_stand

    call post_acceptance(sim, taken, sim%nodes%g, may_stand)
    call finish_acceptance(sim%scene, sim%clock, sim%exchange, taken, so)
    if (present(stands)) stands = may_stand
  end function is_refused

  !> A node may move half a cell, and less if particles have moved much since the last sort.
  subroutine test_half_a_cell()
    type(simulation_t) :: sim
    real(rp) :: most, taken, u(2)
    integer :: i
    logical :: stands

    call prepare(sim)
    do i = 1, 8
      call random_number(u)
      most = 0.5_rp*h
      sim%clock%displacement = 0.0_rp
      if (mod(i, 2) == 0) then
        most = 0.5_rp*u(1)*h
        sim%clock%displacement = h - most
      end if
      call set_velocity(sim%nodes, 0.99_rp*most/dt*way, at_rest, sim%nodes%g(:, :, 1))
      taken = dt
      sim%clock%now%attempted_dt = dt
      call expect('99 % of half a cell', .not. is_refused(sim, taken, stands))
      call expect('a rank can see that', stands)
      call expect_close('a step that stands', taken, dt)
      call expect_close('its speed', sim%clock%max_speed, 0.99_rp*most/dt)
      call set_velocity(sim%nodes, (1.01_rp + u(2))*most/dt*way, at_rest, sim%nodes%g(:, :, 1))
      call expect('more than half a cell', is_refused(sim, taken, stands))
      call expect('ranks can see that', .not. stands)
      call expect('it can be tried again', .not. sim%clock%now%is_broken)
      call expect_close('with half of the displacement that is allowed', &
                        taken*norm2((1.01_rp + u(2))*most/dt*way), 0.5_rp*most)
      call expect('which stands', .not. is_refused(sim, taken))
    end do
    call free_simulation(sim)
  end subroutine test_half_a_cell

  !> Nodes with a hundredth of a full cell's mass count by any component of their velocity, unless
  !> they are held; so do particles as the last step left them. One of any rank is enough.
  subroutine test_who_counts()
    type(simulation_t) :: sim
    real(rp), parameter :: fast = 0.6_rp*h/dt
    real(rp) :: taken
    integer :: k, node

    call prepare(sim)
    do k = 1, 7
      call set_velocity(sim%nodes, [0.0_rp, 0.0_rp, 0.0_rp], at_rest, sim%nodes%g(:, :, 1))
      sim%clock%now%last%speed2 = 0.0_rp
      node = node_at(sim, merge([-h, h, h], [4.0_rp*h, h, h], k == 5))
      if (node > 0) then
        if (k < 6) sim%nodes%g(1:3, node, 1) = merge(fast, 0.0_rp, [1, 2, 3] == min(k, 3))
        sim%nodes%g(8, node, 1) = merge(0.0099_rp, 0.0101_rp, k == 4)*rho*h**3
      end if
      if (k == 6 .and. world%rank == world%size - 1) sim%clock%now%last%speed2 = fast**2
      taken = dt
      sim%clock%now%attempted_dt = dt
      call expect('who counts', is_refused(sim, taken) .eqv. (k < 4 .or. k == 6))
      if (k == 6) call expect('the speed of particles is in the shorter step', &
                              sim%clock%now%last%speed2 <= 0.0_rp)
    end do
    call free_simulation(sim)
  end subroutine test_who_counts

  !> The node at `x` [m] if this rank uses it, else 0.
  integer function node_at(sim, x) result(node)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(3)
    integer :: i, r

    node = 0
    do r = 1, sim%nodes%n_ranges
      do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
        if (norm2(sim%nodes%patch%position(i) - x) < 0.1_rp*h) node = i
      end do
    end do
  end function node_at

  !> What is no number, and what is too stiff or too fast, on one rank is said on all.
  subroutine test_broken()
    type(simulation_t) :: sim
    real(rp) :: nan, taken
    integer :: k, node

    call prepare(sim)
    call ieee_set_halting_mode(ieee_invalid, .false.)   ! a debug build traps
    nan = ieee_value(1.0_rp, ieee_quiet_nan)
    do k = 1, 6
      call set_velocity(sim%nodes, [0.0_rp, 0.0_rp, 0.0_rp], at_rest, sim%nodes%g(:, :, 1))
      sim%clock%now%last = outcome_t()
      node = node_at(sim, [h, h, h])
      select case (k)
      case (2)
        if (node > 0) sim%nodes%g(2, node, 1) = nan
      case (3)
        if (world%rank == 0) sim%clock%now%last%stiffness = 2.0e30_rp
      case (4)
        if (world%rank == 0) sim%clock%now%last%speed2 = nan
      case (5)                               ! a step 1e-4 times as long would do
        if (node > 0) sim%nodes%g(1:3, node, 1) = 0.24_rp*h/(1.0e-4_rp*dt)*way
      case (6)
        if (node > 0) sim%nodes%g(1:3, node, 1) = 0.26_rp*h/(1.0e-4_rp*dt)*way
      case default                           ! sound
      end select
      taken = dt
      sim%clock%now%attempted_dt = dt
      call expect('what is refused', is_refused(sim, taken) .eqv. k >= 5)
      call expect('what is broken', sim%clock%now%is_broken .eqv. (k /= 1 .and. k /= 5))
    end do
    call ieee_set_flag(ieee_invalid, .false.)
    call free_simulation(sim)
  end subroutine test_broken

  !> What else all ranks hear.
  subroutine test_messages()
    type(simulation_t) :: sim
    real(rp) :: taken
    integer :: k, last

    last = world%size - 1
    call start_scene(sim, [6, 2, 2], 3, 1)
    call add_tool(sim, plane_tool([1.0_rp, 0.0_rp, 0.0_rp]), [-4.0_rp*h, h, h], &
                  [0.0_rp, 0.0_rp, 0.0_rp], 0.0_rp)
    call add_tool(sim, plane_tool([-1.0_rp, 0.0_rp, 0.0_rp]), [6.0_rp*h, h, h], &
                  [0.0_rp, 0.0_rp, 0.0_rp], 0.0_rp)
    call fill(world, sim, 1, [0.0_rp, 0.0_rp, 0.0_rp], [6.0_rp, 2.0_rp, 2.0_rp], 2)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    do k = 1, 2
      sim%clock%now%last%stiffness = k*(1.0e7_rp + world%rank)
      sim%budget%failed_returns = k*(7 + world%rank)
      sim%clock%now%lost_row = k == 2 .and. world%rank == 0
      sim%scene%output%safety_interval = merge(5.0_rp, 0.0_rp, k == 2)
      sim%clock%now%secured = wall_time() - merge(10.0_rp, 0.0_rp, world%rank == last)
      taken = dt
      call expect('it stands', .not. is_refused(sim, taken))
      call expect_close('stiffness', sim%clock%stiffness, k*(1.0e7_rp + last))
      call expect('returns that failed', sim%clock%now%worst_returns == k*(7 + last))
      call expect('a row that is lost', sim%clock%now%output_is_lost .eqv. k == 2)
      call expect('a checkpoint is due', sim%clock%now%safety_is_due .eqv. k == 2)
      call expect('the tool at the plate is near, the other is not', &
                  all(sim%clock%now%is_near .eqv. [.false., .true.]))
      call expect('no signal', sim%clock%now%signal == 0)
    end do
    call free_simulation(sim)
  end subroutine test_messages

  !> A plate that flows, in a corner, with velocities up to `speed` in its right end and a tenth of
  !> it elsewhere.
  subroutine prepare_plate(sim, speed)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: speed
    integer :: b, p

    call start_scene(sim, [12, 2, 2], 3, 1)
    call make_flow(sim, 1.0e7_rp)
    call add_plane_of_symmetry(sim, 3, 0, .true.)
    call add_clamp(sim, [-far, -far, -far], [0.7_rp, far, far], [.true., .false., .true.], &
                   [1.0_rp, 2.0_rp, 3.0_rp])
    call fill(world, sim, 1, [0.0_rp, 0.0_rp, 0.0_rp], [12.0_rp, 2.0_rp, 2.0_rp], 2)
    call shake(sim, speed, 0.2_rp)
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        associate (ps => sim%particles%ps(p, :, b))
          if (ps(f_pos) < 9.0_rp*h) ps(f_vel:f_vel + 2) = 0.1_rp*ps(f_vel:f_vel + 2)
        end associate
      end do
    end do
    call settle(world, sim)
  end subroutine prepare_plate

  !> A step that is refused and tried again is the step that is short enough at once, bit for bit.
  subroutine test_same_as_smaller()
    type(simulation_t) :: sim, other
    real(rp) :: short, taken
    integer :: i, step

    do i = 1, 2
      call prepare_plate(sim, 20.0_rp)
      call prepare_plate(other, 20.0_rp)
      do step = 1, 2                         ! budget is not empty then
        taken = 1.0e-7_rp
        call take_step(sim, taken)
        taken = 1.0e-7_rp
        call take_step(other, taken)
        sim%clock%dt = taken
        other%clock%dt = taken
      end do
      taken = merge(3.0e-5_rp, 1.0e-4_rp, i == 2)
      call take_step(sim, taken)
      call expect('a step that is too long gets shorter', taken < 3.0e-5_rp .and. taken > 1.0e-7_rp)
      call expect('and is taken', .not. sim%clock%now%is_broken)
      short = taken
      call take_step(other, short)
      call expect('the other one is taken as it is', same(short, taken))
      call expect_same(sim, other%particles%ps, other%budget)
      call free_simulation(sim)
      call free_simulation(other)
    end do
  end subroutine test_same_as_smaller

  elemental logical function same(a, b)
    real(rp), intent(in) :: a, b

    same = abs(a - b) <= 0.0_rp
  end function same

  !> Particles and budget of a simulation are those given, bit for bit.
  subroutine expect_same(sim, ps, budget)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: ps(:, :, :)
    type(budget_t), intent(in) :: budget
    integer :: n

    n = sim%particles%nblk
    call expect('particles', all(same(sim%particles%ps(:, :, :n), ps(:, :, :n))))
    call expect('energies', all(same(sim%budget%sums, budget%sums)))
    call expect('impulses', all(same(sim%budget%impulse, budget%impulse)))
    call expect('returns', sim%budget%failed_returns == budget%failed_returns)
    call expect('warnings', all(same(sim%budget%warnings, budget%warnings)))
  end subroutine expect_same

  !> A step of which only the last rank knows that it does not stand, while blocks come back from
  !> the grid: refused or broken it leaves particles, budget and clock.
  subroutine test_rollback()
    type(simulation_t) :: sim
    type(budget_t) :: budget
    type(clock_t) :: clock
    type(outcome_t) :: outcome
    real(rp), allocatable :: ps(:, :, :)
    real(rp) :: taken
    integer :: k
    logical :: is_refused, stands

    do k = 1, 3                              ! refused, broken, stands
      call prepare_plate(sim, 20.0_rp)
      taken = 1.0e-7_rp
      call take_step(sim, taken)
      call expect('budget is not empty', sum(all_of(world, abs(sim%budget%sums))) > 0.0_rp)
      ps = sim%particles%ps
      budget = sim%budget
      clock = sim%clock
      sim%clock%now%attempted_dt = dt
      taken = dt
      if (k == 3) taken = 1.0e-7_rp
      call save_state(sim%exchange, sim%budget)
      call particles_to_grid(sim, sim%nodes%g)
      call update_nodes(sim%scene, sim%clock, sim%nodes, taken, sim%nodes%g)
      if (world%rank == world%size - 1) then
        if (k == 1) sim%clock%now%last%speed2 = (0.7_rp*h/dt)**2
        if (k == 2) sim%clock%now%last%stiffness = 1.0e31_rp
      end if
      call post_acceptance(sim, taken, sim%nodes%g, stands)
      call apply_boundary(sim, taken, sim%nodes%g, stands)
      call expect('who sees it does not go on', &
                  sim%exchange%speculative%is_possible .eqv. (world%size > 1 .and. stands))
      call expect('who sees it', stands .eqv. (k == 3 .or. world%rank < world%size - 1))
      outcome = outcome_t()
      call work_ahead(sim, taken, outcome)
      call expect('particles have changed', .not. all(same(sim%particles%ps, ps)))
      call accept_step(sim, taken, sim%nodes%g, outcome, is_refused)
      call expect('it is refused', is_refused .eqv. k == 1)
      call expect('it is broken', sim%clock%now%is_broken .eqv. k == 2)
      if (k == 3) then
        call expect('blocks stay done', sim%exchange%speculative%n_done >= 2)
        call expect('with their outcome', outcome%stiffness > 0.0_rp)
        call expect('and particles', .not. all(same(sim%particles%ps, ps)))
      else
        call expect('no block is done', sim%exchange%speculative%n_done == 0)
        call expect_same(sim, ps, budget)
        call expect('no outcome', &
                    same(outcome%speed2, 0.0_rp) .and. same(outcome%stiffness, 0.0_rp))
      end if
      call expect('time stands still', same(sim%clock%time, clock%time) &
                  .and. sim%clock%step == clock%step &
                  .and. same(sim%clock%displacement, clock%displacement))
      call free_simulation(sim)
    end do
  end subroutine test_rollback

  !> Two blocks come back from the grid before the step is accepted, and add to the budget.
  subroutine work_ahead(sim, taken, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: taken
    type(outcome_t), intent(inout) :: outcome
    integer :: k

    do k = 1, 2
      call expect('there is another block', save_block(sim%particles, sim%exchange))
      sim%exchange%speculative%n_done = k
      call blocks_to_particles(sim, k, k, taken, sim%nodes%g, sim%nodes%g, taken, outcome)
    end do
    sim%budget%sums = sim%budget%sums + 1.0_rp
    sim%budget%impulse = sim%budget%impulse + 1.0_rp
    sim%budget%failed_returns = sim%budget%failed_returns + 1
  end subroutine work_ahead

end program test_acceptance
