! SPDX-License-Identifier: MIT
!> What contact with a tool costs: momentum, torque, work and heat in the budget, beside clamps and
!> symmetry planes.
program test_tool_loads
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use node_samples, only: all_of, balance_of, balance_t, gather_nodes, step_once
  use particles_store, only: f_heat, f_mass, f_vel
  use state_budget, only: e_wall
  use state_parts, only: free_simulation, simulation_t
  use step_drives, only: drive_tools, store_impulses
  use step_samples, only: add_clamp, add_plane_of_symmetry, fill, h, settle, shake
  use tool_samples, only: settle_plate, start_plate, touch, touch_dt
  use tools_motion, only: drive_t, phase_t
  use tools_sums, only: s_force, s_friction, s_metal_slip, s_normal_impulse, s_normal_loss, &
                        s_to_plate, s_tool_slip, s_torque, s_work
  use tools_tool, only: rigid_t
  implicit none (type, external)

  real(rp), parameter :: dt = touch_dt, far = 1.0e9_rp
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_balances()
  call test_work_lost()
  call test_walls_and_tool()
  call test_drives()
  call end_tests()

contains

  !> Every shape, elastic and not, half of them with a clamp under the tool: momentum, angular
  !> momentum about the tool's axis, energy and heat.
  subroutine test_balances()
    type(simulation_t) :: sim
    type(balance_t) :: before, after
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :), sums(:)
    real(rp) :: heat(1), taken(3), work, centre(3), impulse(3)
    integer :: b, i

    do i = 1, 8
      call start_plate(sim, 1 + (i - 1)/2, merge(0.0_rp, merge(3.0e8_rp, 1.0e5_rp, i < 7), i < 5))
      if (mod(i, 2) == 0) call add_clamp(sim, [-far, -far, -far], [2.0_rp, far, far], &
                                         [.true., i > 4, .true.], [1.0_rp, -2.0_rp, 3.0_rp])
      sim%scene%material(1)%plastic_heat = merge(1.0_rp, 0.4_rp, i < 7)
      if (i > 6) sim%tool(1)%friction_coefficient = 50.0_rp
      call settle_plate(world, sim)
      centre = 0.5_rp*(sim%tool(1)%position + sim%tool(1)%start)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g1)
      before = balance_of(world, sim, centre, sim%nodes%g)
      call touch(world, sim, 40.0_rp)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g2)
      after = balance_of(world, sim, centre, sim%nodes%g)
      sums = all_of(world, sim%tool(1)%sums)
      impulse = after%momentum - before%momentum
      taken = 0.0_rp
      if (size(sim%budget%impulse) > 0) taken = all_of(world, sim%budget%impulse(:, 1))
      call expect('tools touch, clamps bear some of it', sums(s_normal_impulse) > 0.0_rp &
                  .and. (norm2(taken) > 0.01_rp*sums(s_normal_impulse) .eqv. mod(i, 2) == 0))
      call expect_close('momentum of nodes, tool and clamp', &
                        norm2(impulse + sums(s_force:s_force + 2) - taken), 0.0_rp, &
                        atol=1.0e-12_rp*sums(s_normal_impulse))
      if (mod(i, 2) == 1) then
        call expect_close('torque against the spin', sums(s_torque), &
                          dot_product(before%moment - after%moment, sim%tool(1)%axes(:, 3)), &
                          atol=1.0e-12_rp*h*sums(s_normal_impulse))
      end if
      work = sum(spread(g1(8, :, :, :), 1, 3)*(g2(1:3, :, :, :) - g1(1:3, :, :, :)) &
                 *(g2(1:3, :, :, :) - 0.5_rp*g2(5:7, :, :, :)))
      sums = [sums, all_of(world, sim%budget%sums)]
      call expect_close('work of the tool', sums(s_work) - sums(s_friction) - sums(s_normal_loss) &
                        + sums(size(sim%tool(1)%sums) + e_wall), work, &
                        atol=1.0e-12_rp*(abs(work) + abs(sums(s_work))))
      call expect('nothing else is booked', &
                  count(abs(sim%budget%sums) > 0.0_rp) <= merge(1, 0, mod(i, 2) == 0))
      call expect('changes of velocity follow', maxval(abs(g2(1:3, :, :, :) - g2(5:7, :, :, :) &
                  - g1(1:3, :, :, :) + g1(5:7, :, :, :))) <= 1.0e-12_rp)
      heat = 0.0_rp
      do b = 1, sim%particles%nblk
        heat = heat + sum(sim%particles%ps(:, f_heat, b))
      end do
      heat = all_of(world, heat)
      call expect_close('heat into the plate', heat(1), sums(s_to_plate), rtol=1.0e-11_rp)
      if (i < 7) then
        call expect_close('all that is shared', heat(1), 0.7_rp*sums(s_friction), &
                          atol=1.0e-12_rp*abs(sums(s_work)))
      else
        call expect('of what the metal shears, its plastic heat', &
                    heat(1) < 0.699_rp*sums(s_friction) .and. heat(1) > 0.279_rp*sums(s_friction))
      end if
      call free_simulation(sim)
    end do
  end subroutine test_balances

  !> A plane that slides and spins: what every node lost, from its velocities alone.
  subroutine test_work_lost()
    type(simulation_t) :: sim
    type(rigid_t) :: rigid
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :), sums(:)
    real(rp) :: got(5), j(3), n(3), push, slip(3), surface(3), mean(3), x(3)
    integer :: i, k, l

    call start_plate(sim, 1, 0.0_rp)
    call settle_plate(world, sim)
    n = [0.0_rp, 0.6_rp, -0.8_rp]
    rigid = sim%tool(1)%mean_motion(0.0_rp, dt)
    call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g1)
    call touch(world, sim, 40.0_rp)
    call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g2)
    sums = all_of(world, sim%tool(1)%sums)
    got = 0.0_rp
    do l = 0, ubound(g1, 4)
      do k = 0, ubound(g1, 3)
        do i = 0, ubound(g1, 2)
          x = sim%scene%grid%lower + h*[i, k, l]
          j = g1(8, i, k, l)*(g2(1:3, i, k, l) - g1(1:3, i, k, l))
          mean = g2(1:3, i, k, l) - 0.5_rp*g2(5:7, i, k, l)
          surface = rigid%velocity_at(x)
          slip = mean - surface
          push = dot_product(j, n)
          got = got + [push*norm2(mean - dot_product(mean, n)*n), &
                       push*norm2(surface - dot_product(surface, n)*n), push, &
                       -dot_product(j - push*n, slip), -push*dot_product(n, slip)]
        end do
      end do
    end do
    call expect_close('creep', sums(s_metal_slip), got(1), rtol=1.0e-11_rp)
    call expect_close('slide', sums(s_tool_slip), got(2), rtol=1.0e-11_rp)
    call expect_close('press', sums(s_normal_impulse), got(3), rtol=1.0e-11_rp)
    call expect_close('friction heat', sums(s_friction), got(4), rtol=1.0e-11_rp)
    call expect_close('loss across the surface', sums(s_normal_loss), got(5), rtol=1.0e-11_rp)
    call expect('friction heats', sums(s_friction) > 0.0_rp)
    call free_simulation(sim)
  end subroutine test_work_lost

  !> Whole steps in a corner of three symmetry planes, or at a wall that sticks, with a clamp and a
  !> tool: the momentum of the particles is what tool, walls and clamp gave.
  subroutine test_walls_and_tool()
    type(simulation_t) :: sim
    real(rp) :: given(3), p0(3), p1(3), least
    integer :: c, i, step
    logical :: sticks

    do i = 1, 6
      sticks = i > 4
      call start_plate(sim, merge(i - 4, i, sticks), merge(3.0e8_rp, 0.0_rp, mod(i, 2) == 1))
      call add_plane_of_symmetry(sim, 2, 4, .false., odd=[sticks, .true., sticks])
      call add_plane_of_symmetry(sim, 3, 0, .true.)
      if (.not. sticks) call add_plane_of_symmetry(sim, 1, 0, .true.)
      call add_clamp(sim, [3.1_rp, -far, -far], [far, far, far], [.true., .true., .false.], &
                     [1.0_rp, 2.0_rp, 3.0_rp])
      call fill(world, sim, 1, [-0.1_rp, 1.1_rp, 0.0_rp], [3.9_rp, 4.1_rp, 2.0_rp], 2)
      call shake(sim, 20.0_rp, 0.3_rp)
      call settle(world, sim)
      p0 = momentum(sim)
      do step = 1, 3
        call step_once(world, sim, 5.0e-8_rp)
      end do
      p1 = momentum(sim)
      given = -all_of(world, sim%tool(1)%sums(s_force:s_force + 2))
      least = norm2(given)
      do c = 1, size(sim%scene%condition)
        given = given + all_of(world, sim%budget%impulse(:, c))
        least = min(least, norm2(all_of(world, sim%budget%impulse(:, c))))
      end do
      call expect('tool, walls and clamp all give some', least > 1.0e-3_rp*norm2(p1 - p0))
      call expect_close('momentum given', norm2(p1 - p0 - given), 0.0_rp, &
                        atol=1.0e-11_rp*norm2(p1 - p0))
      call free_simulation(sim)
    end do
  end subroutine test_walls_and_tool

  function momentum(sim) result(p)
    type(simulation_t), intent(in) :: sim
    real(rp) :: p(3)
    integer :: a, b

    p = 0.0_rp
    do b = 1, sim%particles%nblk
      do a = 1, 3
        p(a) = p(a) + sum(sim%particles%ps(:, f_mass, b)*sim%particles%ps(:, f_vel + a - 1, b))
      end do
    end do
    call world%sum(p)
  end function momentum

  !> Three machines under what all ranks' particles gave their tools in a step, force along the axis
  !> and torque: each moves as it would alone, and its monitor keeps both.
  subroutine test_drives()
    type(simulation_t) :: sim
    type(drive_t) :: alone(3)
    real(rp) :: axis(3), load(4)
    real(rp), parameter :: step = 1.0e-6_rp
    integer :: k

    call start_plate(sim, 1, 0.0_rp)
    sim%world = world
    sim%tool = [sim%tool(1), sim%tool(1), sim%tool(1)]
    sim%clock%stiffness = huge(1.0_rp)           ! the load of late is that of the step
    do k = 1, 3
      call random_number(axis)
      associate (tool => sim%tool(k))
        tool%motion%phase = [phase_t()]
        tool%drive = drive_t(is_free=.true., axis=axis/norm2(axis), mass=0.2_rp*k, &
                             stiffness=1.0e6_rp, damping=100.0_rp)
        tool%monitor%is_on = .true.
        call random_number(tool%sums)
        alone(k) = tool%drive
      end associate
    end do
    call store_impulses(sim%tool)
    do k = 1, 3
      call random_number(load)
      load = step*1.0e3_rp*(k + load)
      associate (tool => sim%tool(k))
        tool%sums(s_force:s_force + 2) = tool%sums(s_force:s_force + 2) + load(1:3)
        tool%sums(s_torque) = tool%sums(s_torque) + load(4)
        load = all_of(world, load)
        call alone(k)%integrate(step, dot_product(load(1:3), tool%drive%axis)/step, .false., &
                                0.0_rp, sim%clock%mass_scaling)
        tool%monitor%load_ema = [dot_product(load(1:3), tool%drive%axis), load(4)]/step
      end associate
    end do
    associate (loads => [(sim%tool(k)%monitor%load_ema, k=1, 3)])
      do k = 1, 3
        sim%tool(k)%monitor%load_ema = 0.0_rp
      end do
      call drive_tools(sim, step)
      call expect_close('loads of the tools', &
                        maxval(abs([(sim%tool(k)%monitor%load_ema, k=1, 3)]/loads - 1.0_rp)), &
                        0.0_rp, atol=1.0e-9_rp)
    end associate
    call expect_close('rates of their machines', maxval(abs(sim%tool%drive%rate/alone%rate &
                      - 1.0_rp)), 0.0_rp, atol=1.0e-9_rp)
    call free_simulation(sim)
  end subroutine test_drives

end program test_tool_loads
