! SPDX-License-Identifier: MIT
!> Contact in a step: bodies with one another, then particles with tools.
module step_contact
  use base_kinds, only: rp
  use body_contact_pairs, only: resolve_body_contact
  use comm_world, only: world_t
  use state_step, only: outcome_t
  use step_boundary, only: mirror_nodes, move_tools
  use step_schedule, only: sum_meanwhile
  use step_simulation, only: simulation_t
  use tool_contact_impulses, only: apply_impulses, find_contact, find_impulses
  use tool_contact_lists, only: n_values
  implicit none (type, external)
  private

  public :: resolve_contact

contains

  !> Collective. Change the velocities of the nodes `g` to what contact leaves of them, keep the
  !> books of the tools and give friction heat to the particles. Blocks far from all tools may come
  !> back from the grid meanwhile.
  subroutine resolve_contact(world, sim, dt, g, outcome)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)   !! velocity records
    type(outcome_t), intent(inout) :: outcome
    integer :: group, k

    if (sim%nodes%n_groups > 1) then
      call resolve_body_contact(world, sim%scene, sim%clock, sim%tool, sim%particles, sim%blocks, &
                                sim%nodes, sim%boundary, &
                        sim%pairs, sim%books, dt, g)
      call mirror_nodes(sim, g)
      call move_tools(sim, dt)
    end if
    do k = 1, size(sim%tool)
      if (.not. sim%step%is_near(k)) cycle
      do group = 1, sim%nodes%n_groups
        if (sim%scene%is_rigid_group(group)) cycle
        call resolve_tool_contact(world, sim, k, group, dt, g(:, :, group), outcome)
      end do
    end do
  end subroutine resolve_contact

  !> One group of bodies and one tool.
  subroutine resolve_tool_contact(world, sim, k, group, dt, g, outcome)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome

    call find_contact(sim%scene, sim%clock, sim%particles, sim%blocks, sim%nodes, sim%boundary, &
                      sim%contact, &
                      sim%tool(k), k, group, dt, g)
    call sum_entries(world, sim, dt, g, outcome, 2, sim%contact%mass)
    call find_impulses(sim%scene, sim%clock, sim%nodes, sim%boundary, sim%contact, g)
    call sum_entries(world, sim, dt, g, outcome, n_values, sim%contact%values)
    call apply_impulses(sim%scene, sim%clock, sim%particles, sim%nodes, sim%boundary, &
                        sim%contact, sim%books, &
                        sim%tool(k), dt, g)
  end subroutine resolve_tool_contact

  !> Sum over the ranks what the listed nodes hold.
  subroutine sum_entries(world, sim, dt, g, outcome, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%contact%n_nodes)

    call sum_meanwhile(world, sim, dt, g, outcome, sim%contact%entry_of, sim%contact%n_nodes, &
                       sim%contact%node, &
                         width, values)
  end subroutine sum_entries

end module step_contact
