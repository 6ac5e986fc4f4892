! SPDX-License-Identifier: MIT
!> Contact of two bodies: what meets closes its gap, nothing pulls, friction is limited, and
!> momentum, angular momentum and energy go where the budget says.
program test_body_contact
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_body_normals, only: overlap_weight
  use node_samples, only: all_of, balance_of, balance_t, gather_nodes, map_particles, &
                          set_velocity, shake_nodes
  use particles_store, only: f_heat
  use state_budget, only: e_contact, e_friction
  use state_clock, only: outcome_t
  use state_parts, only: free_simulation, simulation_t
  use step_constraints, only: apply_boundary, resolve_contact
  use step_samples, only: add_contact, add_tool, fill, h, particle_tool, settle, shake, start_scene
  use tools_pair, only: law_coulomb, law_frictionless, law_stick, normal_gradient, &
                        normal_regression, pair_law_t
  use tools_sums, only: s_force, s_friction, s_normal_impulse, s_normal_loss, s_torque, s_work
  implicit none (type, external)

  real(rp), parameter :: dt = 1.0e-6_rp, at_rest(3, 3) = 0.0_rp
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_plates()
  call test_blocks()
  call test_rigid_body()
  call test_overlap_weight()
  call end_tests()

contains

  !> Two plates without ends across `axis`, the first one below, or above if `turned`.
  subroutine prepare_plates(sim, axis, turned, gap, kind, friction)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: axis, kind
    logical, intent(in) :: turned
    real(rp), intent(in) :: gap, friction        !! [cells]
    real(rp) :: low(3), up(3), u(1)
    integer :: a, cells(3)

    cells = 3
    cells(axis) = 4
    call start_scene(sim, cells, 3, 2, [(a /= axis, a=1, 3)])
    sim%scene%tool_of = [0, 0]
    sim%scene%body(2)%group = 2
    call add_contact(sim, [1, 2], normal_gradient, kind, friction)
    call random_number(u)
    low = 0.0_rp
    up = 3.0_rp
    low(axis) = u(1) - 0.5_rp
    up(axis) = low(axis) + 2.0_rp
    call fill(world, sim, merge(2, 1, turned), low, up, 2)
    low(axis) = up(axis) + gap
    up(axis) = low(axis) + 2.0_rp
    call fill(world, sim, merge(1, 2, turned), low, up, 2)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
  end subroutine prepare_plates

  !> Plates that move evenly: normals, gaps; the gap closes just within the step; plates that
  !> overlap by more than a tenth of a cell part as fast as they met, if contact took energy
  !> before; along the surface as the law says.
  subroutine test_plates()
    type(simulation_t) :: sim
    type(outcome_t) :: outcome
    real(rp) :: friction, gap, n(3), some(1), u(7), v(3, 2)
    real(rp), allocatable :: before(:, :, :)
    integer :: i, kind

    do i = 1, 12
      call random_number(u)
      kind = merge(law_coulomb, law_stick, i < 9)
      if (i == 8) kind = law_frictionless
      friction = merge(0.1_rp, 50.0_rp, i < 5)
      gap = 0.1_rp*(u(7) - 0.3_rp)
      if (i == 3 .or. i == 9) gap = -0.1_rp - 0.02_rp*u(7)
      call prepare_plates(sim, 1 + mod(i, 3), mod(i, 2) == 0, gap, kind, friction)
      n = 0.0_rp
      n(1 + mod(i, 3)) = merge(-1.0_rp, 1.0_rp, mod(i, 2) == 0)
      v = 100.0_rp*(reshape(u(1:6), [3, 2]) - 0.5_rp)
      v(:, 1) = v(:, 1) + (120.0_rp + max(0.0_rp, gap)*h/dt)*n
      if (i == 7 .or. i == 12) v(:, 1) = v(:, 1) - 400.0_rp*n   ! they part
      call set_velocity(sim%nodes, v(:, 1), at_rest, sim%nodes%g(:, :, 1))
      call set_velocity(sim%nodes, v(:, 2), at_rest, sim%nodes%g(:, :, 2))
      if (i == 3 .and. world%rank == 0) sim%budget%sums(e_contact) = 1.0_rp   ! can be given back
      before = sim%nodes%g
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call resolve_contact(sim, dt, sim%nodes%g, outcome)
      call expect('normals out of the first body', &
                  maxval(norm2(sim%pairs%normal - spread(n, 2, sim%pairs%n), 1)) < 1.0e-10_rp)
      ! an overlap is not believed where a node sees little of a body
      call expect('gaps', all(abs(sim%pairs%gap - gap*h) < 1.0e-10_rp*h &
                              .or. (gap < 0.0_rp .and. abs(sim%pairs%gap) <= 0.0_rp)))
      some = count(abs(sim%pairs%gap - gap*h) < 1.0e-10_rp*h)
      some = all_of(world, some)
      call expect('some of them are known', some(1) >= 9.0_rp)
      call check_plates(sim, before, v, n, i == 3)
      call free_simulation(sim)
    end do
  end subroutine test_plates

  !> Velocity between the bodies behind a contact with `gap` [m].
  pure function apart_of(law, v, n, gap, opens) result(apart)
    type(pair_law_t), intent(in) :: law
    real(rp), intent(in) :: v(3, 2), n(3), gap
    logical, intent(in) :: opens                 !! overlaps are taken back
    real(rp) :: apart(3), slip(3), closing, wanted

    apart = v(:, 2) - v(:, 1)
    closing = -dot_product(apart, n)
    slip = apart + closing*n
    wanted = -max(0.0_rp, gap)/dt
    if (opens) wanted = closing                ! overlaps are deep enough
    if (law%kind == law_stick .and. gap <= 0.05_rp*h) then
      apart = 0.0_rp                           ! nor may they part
    else if (wanted + closing > 0.0_rp) then
      if (law%kind == law_stick) slip = 0.0_rp
      if (law%kind == law_coulomb) slip = slip*max(0.0_rp, 1.0_rp - law%friction_coefficient &
                                                   *(wanted + closing)/norm2(slip))
      apart = wanted*n + slip
    end if
  end function apart_of

  !> Nodes with both bodies have the velocity between them that the law says, and no other momentum.
  subroutine check_plates(sim, before, v, n, opens)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: before(:, :, :), v(3, 2), n(3)
    logical, intent(in) :: opens
    real(rp) :: off(3)
    integer :: e, k

    off = 0.0_rp
    do e = 1, sim%pairs%n
      associate (q => sim%pairs%node(e))
        associate (g => sim%nodes%g(:, q, :), m => before(8, q, :))
          off(1) = max(off(1), norm2(g(1:3, 2) - g(1:3, 1) &
                                     - apart_of(sim%scene%contact(1)%law, v, n, &
                                                sim%pairs%gap(e), opens)))
          off(2) = max(off(2), norm2(matmul(g(1:3, :) - before(1:3, q, :), m))/sum(m))
          do k = 1, 2
            off(3) = max(off(3), norm2(g(5:7, k) - before(5:7, q, k) &
                                       - g(1:3, k) + before(1:3, q, k)))
          end do
        end associate
      end associate
    end do
    call expect_close('velocities where plates meet', off(1), 0.0_rp, atol=1.0e-9_rp)
    call expect_close('equal and opposite impulses', off(2), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('changes of velocity follow', off(3), 0.0_rp, atol=1.0e-11_rp)
  end subroutine check_plates

  !> Two blocks whose corners overlap, with random nodes.
  subroutine prepare_blocks(sim, kind, normal, friction, is_rigid)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: kind, normal
    real(rp), intent(in) :: friction
    logical, intent(in) :: is_rigid
    integer :: k

    call start_scene(sim, [5, 4, 4], 3, 2)
    sim%scene%method%conducts = .true.
    sim%scene%body(2)%group = 2
    sim%scene%tool_of = [0, 0]
    call add_contact(sim, [1, 2], normal, kind, friction)
    if (is_rigid) then
      sim%scene%body(2)%tool = 1
      sim%scene%tool_of = [0, 1]
      call add_tool(sim, particle_tool(), h*[3.0_rp, 1.0_rp, 2.0_rp], &
                    [-20.0_rp, 5.0_rp, -40.0_rp], 3.0e3_rp)
    end if
    call fill(world, sim, 1, [0.0_rp, 0.2_rp, 0.1_rp], [3.0_rp, 3.2_rp, 2.1_rp], 2)
    call fill(world, sim, 2, [1.2_rp, 1.1_rp, 2.08_rp], [4.2_rp, 4.1_rp, 4.08_rp], 2)
    call shake(sim, 0.0_rp, 0.3_rp)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    do k = 1, 2
      call shake_nodes(sim%nodes, 40.0_rp, 3.0_rp, k, sim%nodes%g(:, :, k))
    end do
    call apply_boundary(sim, dt, sim%nodes%g, .false.)
  end subroutine prepare_blocks

  !> Momentum, angular momentum, energy and heat; friction at most its coefficient times what
  !> presses, and nothing pulls.
  subroutine test_blocks()
    type(simulation_t) :: sim
    type(balance_t) :: one(2), two(2)
    type(outcome_t) :: outcome
    real(rp), allocatable :: before(:, :, :)
    real(rp) :: friction, impulse(3), most, push, pull
    integer :: e, i, k

    do i = 2, 5
      friction = 0.2_rp*i
      call prepare_blocks(sim, merge(law_coulomb, law_stick, i < 5), &
                          merge(normal_regression, normal_gradient, mod(i, 2) == 0), friction, &
                          .false.)
      before = sim%nodes%g
      do k = 1, 2
        one(k) = balance_of(world, sim, h*[1.0_rp, 3.0_rp, 2.0_rp], sim%nodes%g(:, :, k))
      end do
      call resolve_contact(sim, dt, sim%nodes%g, outcome)
      do k = 1, 2
        two(k) = balance_of(world, sim, h*[1.0_rp, 3.0_rp, 2.0_rp], sim%nodes%g(:, :, k))
      end do
      impulse = two(1)%momentum - one(1)%momentum
      call expect('the upper body presses down', impulse(3) < 0.0_rp)
      call expect_close('momentum is kept', norm2(impulse + two(2)%momentum - one(2)%momentum), &
                        0.0_rp, atol=1.0e-12_rp*norm2(impulse))
      call expect_close('angular momentum is kept', &
                        norm2(two(1)%moment - one(1)%moment + two(2)%moment - one(2)%moment), &
                        0.0_rp, atol=1.0e-12_rp*h*norm2(impulse))
      most = 0.0_rp
      pull = 0.0_rp
      do e = 1, sim%pairs%n
        associate (q => sim%pairs%node(e), n => sim%pairs%normal(:, e))
          impulse = before(8, q, 1)*(sim%nodes%g(1:3, q, 1) - before(1:3, q, 1))
          push = -dot_product(impulse, n)
          pull = max(pull, -push)
          most = max(most, norm2(impulse + push*n) - friction*push)
        end associate
      end do
      if (i < 5) call expect('friction is limited', most < 1.0e-18_rp)
      if (i < 5) call expect('nothing pulls', pull <= 0.0_rp)
      call check_energy(sim, before)
      call free_simulation(sim)
    end do
  end subroutine test_blocks

  !> What the impulses take from both bodies is booked; the friction goes into particles.
  subroutine check_energy(sim, before)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: before(:, :, :)
    real(rp) :: heat(1)
    real(rp), allocatable :: sums(:)
    integer :: b

    heat = 0.0_rp
    do b = 1, sim%particles%nblk
      heat = heat + sum(sim%particles%ps(:, f_heat, b))
    end do
    heat = all_of(world, heat)
    sums = all_of(world, sim%budget%sums)
    call expect('friction takes energy', sums(e_friction) > 0.0_rp)
    call expect_close('energy lost', sums(e_friction) + sums(e_contact), &
                      -work_on(sim, before, 1) - work_on(sim, before, 2), rtol=1.0e-11_rp)
    call expect_close('heat of the particles', heat(1), sums(e_friction), rtol=1.0e-11_rp)
  end subroutine check_energy

  !> Work of the impulses on group `k`.
  real(rp) function work_on(sim, before, k) result(work)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: before(:, :, :)
    integer, intent(in) :: k
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :)

    call gather_nodes(world, sim, before(:, :, k), g1)
    call gather_nodes(world, sim, sim%nodes%g(:, :, k), g2)
    work = sum(spread(g1(8, :, :, :), 1, 3)*(g2(1:3, :, :, :) - g1(1:3, :, :, :)) &
               *(g2(1:3, :, :, :) - 0.5_rp*g2(5:7, :, :, :)))
  end function work_on

  !> A rigid body that moves and spins: force, torque and work of its tool.
  subroutine test_rigid_body()
    type(simulation_t) :: sim
    type(balance_t) :: one, two
    type(outcome_t) :: outcome
    real(rp), allocatable :: before(:, :, :), sums(:)
    real(rp) :: axis(3)
    integer :: i

    do i = 2, 3
      call prepare_blocks(sim, law_coulomb, merge(normal_regression, normal_gradient, i > 2), &
                          0.3_rp*i, .true.)
      before = sim%nodes%g
      axis = sim%tool(1)%position
      one = balance_of(world, sim, axis, sim%nodes%g(:, :, 1))
      call resolve_contact(sim, dt, sim%nodes%g, outcome)
      two = balance_of(world, sim, axis, sim%nodes%g(:, :, 1))
      sums = all_of(world, sim%tool(1)%sums)
      call expect('it presses', sums(s_normal_impulse) > 0.0_rp)
      call expect_close('force on the tool', &
                        norm2(two%momentum - one%momentum + sums(s_force:s_force + 2)), 0.0_rp, &
                        atol=1.0e-12_rp*sums(s_normal_impulse))
      call expect_close('torque against the spin', sums(s_torque), one%moment(3) - two%moment(3), &
                        atol=1.0e-12_rp*h*sums(s_normal_impulse))
      call expect_close('work of the tool', sums(s_work) - sums(s_friction) - sums(s_normal_loss), &
                        work_on(sim, before, 1), rtol=1.0e-11_rp)
      call free_simulation(sim)
    end do
  end subroutine test_rigid_body

  !> Normals between bodies that are apart count fully; where they overlap by 0.02 cells they count
  !> a quarter, by more still less, and below one cell no less.
  subroutine test_overlap_weight()
    real(rp) :: overlap(2), w(2)
    integer :: k

    call expect_close('apart', overlap_weight(0.3_rp), 1.0_rp)
    call expect_close('together', overlap_weight(0.0_rp), 1.0_rp)
    call expect_close('overlap', overlap_weight(-0.02_rp), 0.25_rp)
    call expect_close('deep overlap', overlap_weight(-3.0_rp), 1.0_rp/2501.0_rp**2)
    do k = 1, 50
      call random_number(overlap)
      w = [overlap_weight(-overlap(1)), overlap_weight(-overlap(1)*(1.0_rp + overlap(2)))]
      call expect('less by deeper overlaps', w(2) > 0.0_rp .and. w(1) < 1.0_rp &
                  .and. (w(2) < w(1) .or. overlap(1)*(1.0_rp + overlap(2)) > 1.0_rp))
    end do
  end subroutine test_overlap_weight

end program test_body_contact
