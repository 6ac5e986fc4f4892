! SPDX-License-Identifier: MIT
!> The check in the middle of a step, before any particle has changed: the one reduction of a step,
!> and a smaller step where a node would move too far. Ranks may work while it is on its way (time_ahead).
module time_limit
  use base_kinds, only: rp
  use base_system, only: stop_signal
  use base_timers, only: wall_time
  use comm_world, only: world_t
  use time_nodes, only: full_mass
  use time_state, only: roam, simulation_t
  implicit none (type, external)
  private

  public :: finish_limit, post_limit

  real(rp), parameter :: too_stiff = 1.0e30_rp    !! squared wave speed of a lost state [m2/s2]
  real(rp), parameter :: way = 0.5_rp             !! a node may move in a step [cells]
  real(rp), parameter :: smallest = 1.0e-4_rp     !! part of a refused step that is still tried
  !> Part of a full cell's mass from which a node carries material: the velocity of a node with
  !> less says nothing, since it is hardly felt by any particle.
  real(rp), parameter :: material_share = 1.0e-2_rp

contains

  !> Collective. Begin to share what all ranks must know about the last and this step; whether it stands as
  !> far as this rank can see.
  subroutine post_limit(world, sim, dt, g, stands)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%patch%nn, sim%n_groups)   !! [s]
    logical, intent(out) :: stands
    real(rp) :: own(2)

    own = [sim%last%stiffness, max(sim%last%speed2, fastest_node(sim, g))]
    stands = is_sound(own) .and. dt*sqrt(own(2)) <= longest_way(sim)
    call sim%limit%start(world, [own, real(stop_signal(), rp), real(sim%failed_returns, rp), &
                                 since_checkpoint(sim), merge(1.0_rp, 0.0_rp, sim%lost_row), &
                                 near_tools(sim)])
  end subroutine post_limit

  !> Collective. If a node moves farther than half a cell, or a particle might have moved more than a cell
  !> since the last sort, the step is refused and is to be tried again with the smaller `dt`.
  !> `sim%is_broken` says that no step is small enough, or that the state is not a number.
  subroutine finish_limit(sim, dt, is_refused)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt               !! [s]
    logical, intent(out) :: is_refused

    sim%balance%waited = sim%balance%waited - wall_time()
    call sim%limit%finish()
    sim%balance%waited = sim%balance%waited + wall_time()
    associate (most => sim%limit%value)
      sim%clock%stiffness = most(1)
      sim%clock%max_speed = sqrt(most(2))
      sim%signal = nint(most(3))
      sim%worst_returns = nint(most(4))
      sim%output_is_lost = most(6) > 0.0_rp
      sim%is_near = most(7:) > 0.0_rp
      sim%safety_is_due = most(5) >= sim%scene%output%safety_interval
      sim%is_broken = .not. is_sound(most(1:2))
    end associate
    is_refused = .not. sim%is_broken .and. dt*sim%clock%max_speed > longest_way(sim)
    if (.not. is_refused) return
    dt = 0.5_rp*longest_way(sim)/sim%clock%max_speed
    sim%is_broken = dt < smallest*sim%asked_dt
    sim%last%speed2 = 0.0_rp                    ! the particles' own speed has had its say
  end subroutine finish_limit

  !> Whether squared wave speed and squared speed are those of a state to go on from; false for NaN.
  pure logical function is_sound(squares)
    real(rp), intent(in) :: squares(2)          !! [m2/s2]

    is_sound = all(squares < too_stiff)
  end function is_sound

  !> What a node may move in this step [m].
  pure real(rp) function longest_way(sim)
    type(simulation_t), intent(in) :: sim

    longest_way = min(way*sim%scene%grid%h, sim%scene%grid%h - sim%clock%travel)
  end function longest_way

  !> 1 for each tool that a particle of this rank may touch, else 0.
  pure function near_tools(sim) result(near)
    type(simulation_t), intent(in) :: sim
    real(rp) :: near(size(sim%tool))
    integer :: k

    near = 0.0_rp
    do k = 1, size(sim%tool)
      if (any(sim%clearance(k, :) <= roam*sim%scene%grid%h + sim%tool(k)%way())) near(k) = 1.0_rp
    end do
  end function near_tools

  !> Wall-clock seconds since the last checkpoint; negative if none is wanted.
  real(rp) function since_checkpoint(sim)
    type(simulation_t), intent(in) :: sim

    since_checkpoint = -1.0_rp
    if (sim%scene%output%safety_interval > 0.0_rp) since_checkpoint = wall_time() - sim%secured
  end function since_checkpoint

  !> Largest squared speed of the nodes that carry material, and where [m2/s2].
  real(rp) function fastest_node(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp) :: least, s
    integer :: i, k, r

    fastest_node = 0.0_rp
    least = material_share*full_mass(sim%scene)
    do k = 1, sim%n_groups
      do r = 1, sim%n_runs
        do i = sim%run(1, r), sim%run(2, r)
          if (g(8, i, k) < least .or. sim%is_held(i)) cycle
          s = g(1, i, k)**2 + g(2, i, k)**2 + g(3, i, k)**2
          if (s <= fastest_node) cycle           ! goes on for NaN
          fastest_node = merge(s, huge(1.0_rp), s <= huge(1.0_rp))
          sim%fastest_node = i
          sim%fastest_speed = sqrt(fastest_node)
        end do
      end do
    end do
  end function fastest_node

end module time_limit
