! SPDX-License-Identifier: MIT
!> Acceptance of a step, before any particle has changed: the single reduction of a step, and a
!> smaller step where a node would move too far. Ranks may continue working until the result arrives
!> (step_schedule).
module step_acceptance
  use base_kinds, only: rp
  use base_system, only: stop_signal
  use base_timers, only: wall_time
  use particles_store, only: particles_t
  use state_clock, only: clock_t, skin
  use state_exchange, only: exchange_t
  use state_nodes, only: full_mass
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: finish_acceptance, post_acceptance

  !> Squared wave speed of an invalid state [m2/s2].
  real(rp), parameter :: max_wave_speed2 = 1.0e30_rp
  real(rp), parameter :: max_cells = 0.5_rp  !! largest displacement of a node in a step [cells]
  !> Smallest step to attempt, over the first step size.
  real(rp), parameter :: min_dt_fraction = 1.0e-4_rp
  !> Mass of a node, over that of a full cell, above which its velocity counts: particles hardly
  !> depend on the velocity of lighter nodes.
  real(rp), parameter :: material_fraction = 1.0e-2_rp

contains

  !> Collective. Begin the reduction of what all ranks need about the last and this step.
  !> `locally_accepted`: this rank has no reason to refuse the step.
  subroutine post_acceptance(sim, dt, g, locally_accepted)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                                          !! time step [s]
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)   !! nodal records
    logical, intent(out) :: locally_accepted
    real(rp) :: own(2), unsecured               ! time without a checkpoint [s]; negative if no
                                                ! checkpoints are requested

    own = [sim%clock%now%last%stiffness, sim%clock%now%last%speed2]
    own = merge(own, huge(1.0_rp), own <= huge(1.0_rp))   ! MPI maxima may lose a NaN
    own(2) = max(own(2), fastest_node(sim, g))
    locally_accepted = is_sound(own) &
      .and. dt*sqrt(own(2)) <= max_node_displacement(sim%scene, sim%clock)
    unsecured = -1.0_rp
    if (sim%scene%output%safety_interval > 0.0_rp) unsecured = wall_time() - sim%clock%now%secured
    call sim%exchange%acceptance%start(sim%world, &
                                       [own, real(stop_signal(), rp), &
                                        real(sim%budget%failed_returns, rp), unsecured, &
                                        merge(1.0_rp, 0.0_rp, sim%clock%now%lost_row), &
                                        sim%particles%warming, &
                                        near_tools(sim%scene, sim%tool, sim%particles)])
  end subroutine post_acceptance

  !> Collective. Refuse the step if a node moves farther than half a cell, or a particle might have
  !> moved more than a cell since the last sort; it is to be repeated with the smaller `dt`.
  !> `clock%now%is_broken`: no step is small enough, or the state has NaN.
  subroutine finish_acceptance(scene, clock, exchange, dt, is_refused)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(exchange_t), intent(inout) :: exchange
    real(rp), intent(inout) :: dt               !! time step [s]
    logical, intent(out) :: is_refused

    exchange%balance%waited = exchange%balance%waited - wall_time()
    call exchange%acceptance%finish()
    exchange%balance%waited = exchange%balance%waited + wall_time()
    associate (most => exchange%acceptance%value)
      clock%stiffness = most(1)
      clock%max_speed = sqrt(most(2))
      clock%now%signal = nint(most(3))
      clock%now%worst_returns = nint(most(4))
      clock%now%output_is_lost = most(6) > 0.0_rp
      clock%warming = most(7)
      clock%now%is_near = most(8:) > 0.0_rp
      clock%now%safety_is_due = most(5) >= scene%output%safety_interval
      clock%now%is_broken = .not. is_sound(most(1:2))
    end associate
    is_refused = .not. clock%now%is_broken &
                 .and. dt*clock%max_speed > max_node_displacement(scene, clock)
    if (.not. is_refused) return
    dt = 0.5_rp*max_node_displacement(scene, clock)/clock%max_speed
    clock%now%is_broken = dt < min_dt_fraction*clock%now%attempted_dt
    clock%now%last%speed2 = 0.0_rp  ! `dt` was computed with the particle speeds
  end subroutine finish_acceptance

  !> True if squared wave speed and squared speed are valid; false for NaN.
  pure logical function is_sound(squares)
    real(rp), intent(in) :: squares(2)          !! squared wave speed and squared speed [m2/s2]

    is_sound = all(squares < max_wave_speed2)
  end function is_sound

  !> Largest allowed displacement of a node in this step [m].
  pure real(rp) function max_node_displacement(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    max_node_displacement = min(max_cells*minval(scene%grid%h), minval(scene%grid%h) &
                                - clock%displacement)
  end function max_node_displacement

  !> 1 for each tool that a particle of this rank may touch, else 0.
  pure function near_tools(scene, tools, particles) result(near)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    real(rp) :: near(size(tools))
    integer :: k

    near = 0.0_rp
    do k = 1, size(tools)
      if (any(particles%clearance(k, :) <= skin*scene%grid%longest() &
              + tools(k)%displacement())) then
        near(k) = 1.0_rp
      end if
    end do
  end function near_tools

  !> Largest squared speed of the nodes that carry material [m2/s2]; the fastest node is stored.
  real(rp) function fastest_node(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    real(rp) :: least, s
    integer :: i, k, r

    fastest_node = 0.0_rp
    least = material_fraction*full_mass(sim%scene, sim%clock)
    do k = 1, sim%nodes%n_groups
      do r = 1, sim%nodes%n_ranges
        do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
          if (g(8, i, k) < least .or. sim%nodes%boundary%is_held(i)) cycle
          s = g(1, i, k)**2 + g(2, i, k)**2 + g(3, i, k)**2
          if (s <= fastest_node) cycle           ! continues for NaN
          fastest_node = merge(s, huge(1.0_rp), s <= huge(1.0_rp))
          sim%clock%now%fastest_node = i
          sim%clock%now%fastest_speed = sqrt(fastest_node)
        end do
      end do
    end do
  end function fastest_node

end module step_acceptance
