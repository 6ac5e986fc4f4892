! SPDX-License-Identifier: MIT
!> A plate under tools of all shapes, for the tests of contact with tools.
module tool_samples
  use base_kinds, only: rp
  use base_world, only: world_t
  use node_samples, only: map_particles, shake_nodes
  use state_clock, only: outcome_t
  use state_parts, only: simulation_t
  use step_constraints, only: apply_boundary, resolve_contact
  use step_samples, only: add_tool, box_tool, fill, h, make_flow, plane_tool, settle, shake, &
                          shoulder_tool, sphere_tool, start_scene
  implicit none (type, external)
  private

  public :: settle_plate, start_plate, touch

  real(rp), parameter, public :: touch_dt = 1.0e-6_rp    !! step of `touch` [s]
  real(rp), parameter, public :: middle(2) = [2.0_rp*h, 2.0_rp*h]   !! of the plate [m]

contains

  !> A plate of 4 x 4 x 2 cells under tool `i`, of random velocities.
  subroutine start_plate(sim, i, strength)
    type(simulation_t), intent(out) :: sim
    integer, intent(in) :: i
    real(rp), intent(in) :: strength             !! 0: elastic [Pa]
    real(rp) :: w(3)

    call random_number(w)
    w = 20.0_rp*(w - [0.5_rp, 0.5_rp, 1.0_rp])
    call start_scene(sim, [4, 4, 2], 3, 1)
    if (strength > 0.0_rp) call make_flow(sim, strength)
    select case (i)
    case (1)
      call add_tool(sim, plane_tool([0.0_rp, 0.6_rp, -0.8_rp]), [middle, 2.0_rp*h], w, 3.0e3_rp)
    case (2)
      call add_tool(sim, sphere_tool(2.0_rp*h), [middle, 3.9_rp*h], w, -3.0e3_rp)
    case (3)
      call add_tool(sim, box_tool(h*[1.4_rp, 1.16_rp, 1.0_rp], [0.28_rp, 0.0_rp, 0.96_rp]), &
                    [middle, 2.9_rp*h], w, 3.0e3_rp)
    case default
      call add_tool(sim, shoulder_tool(1.8_rp*h, [-0.1_rp, 0.0_rp, sqrt(0.99_rp)]), &
                    [middle, 2.0_rp*h], w, 4.0e3_rp)
    end select
    sim%tool(1)%friction_coefficient = 0.3_rp
    sim%tool(1)%fixed_heat_share = 0.7_rp
  end subroutine start_plate

  !> Particles of the plate; nodes with random velocities and changes of them, held by clamps.
  subroutine settle_plate(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim

    call fill(world, sim, 1, [0.0_rp, 0.1_rp, 0.0_rp], [4.0_rp, 4.1_rp, 2.0_rp], 2)
    call shake(sim, 0.0_rp, 0.3_rp)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call shake_nodes(sim%nodes, 10.0_rp, 3.0_rp, 1, sim%nodes%g(:, :, 1))
    call apply_boundary(sim, touch_dt, sim%nodes%g, .false.)
    sim%budget%impulse = 0.0_rp
    sim%budget%sums = 0.0_rp
  end subroutine settle_plate

  !> Collective. Contact in a step of `touch_dt` with all tools, which are at their new places;
  !> nodes are no faster than `speed`.
  subroutine touch(world, sim, speed)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: speed                !! [m/s]
    type(outcome_t) :: outcome

    sim%clock%dt = touch_dt
    sim%clock%max_speed = speed
    sim%clock%now%is_near = .true.
    call resolve_contact(sim, touch_dt, sim%nodes%g, outcome)
  end subroutine touch

end module tool_samples
