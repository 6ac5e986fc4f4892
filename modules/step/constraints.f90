! SPDX-License-Identifier: MIT
!> Constraints on the nodal velocities in a step: walls, clamps, held nodes of sleeping material,
!> symmetry planes, tools and contact between bodies.
module step_constraints
  use base_kinds, only: rp
  use boundary_clamps, only: hold_walls
  use boundary_symmetry, only: restore_velocities
  use contact_body_pairs, only: resolve_body_contact
  use contact_tool_impulses, only: apply_impulses, find_contact, find_impulses
  use sleep_held_layer, only: hold_layer
  use state_budget, only: e_wall
  use state_clock, only: outcome_t
  use state_parts, only: simulation_t
  use state_tool_lists, only: n_masses
  use step_schedule, only: can_speculate, sum_with_overlap
  implicit none (type, external)
  private

  public :: apply_boundary, resolve_contact

contains

  !> Collective. Apply walls, clamps and the held layer to the nodal velocities. With several groups
  !> of bodies, symmetry planes and tools follow after the contact between the bodies.
  !> `locally_accepted`: this rank has no reason to refuse the step.
  subroutine apply_boundary(sim, dt, g, locally_accepted)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    logical, intent(in) :: locally_accepted

    call hold_walls(sim%scene, sim%clock, sim%nodes, 1.0_rp, g, sim%budget%impulse, &
                    sim%budget%sums(e_wall))
    if (sim%scene%method%sleep%is_on) then
      call hold_layer(sim%scene, sim%clock, sim%nodes, sim%sleepers, sim%budget, g(:, :, 1))
    end if
    if (sim%nodes%n_groups > 1) return
    call restore_velocities(sim%scene, sim%nodes, g)
    call sim%tool%move_to(sim%clock%time + dt)
    sim%exchange%speculative%is_possible = locally_accepted .and. can_speculate(sim)
  end subroutine apply_boundary

  !> Collective. Resolve contact between bodies, then between particles and tools: correct the nodal
  !> velocities `g`, add to the sums of the tools and give the friction heat to the particles.
  !> Meanwhile, blocks far from all tools may be updated from the grid.
  subroutine resolve_contact(sim, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                                !! time step [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)  !! velocity records
    type(outcome_t), intent(inout) :: outcome
    integer :: group, k

    if (sim%nodes%n_groups > 1) then
      call resolve_body_contact(sim%scene, sim%clock, sim%tool, sim%particles, &
                                sim%nodes, sim%pairs, sim%budget, dt, g)
      call restore_velocities(sim%scene, sim%nodes, g)
      call sim%tool%move_to(sim%clock%time + dt)
    end if
    sim%tool%max_face_temperature = 0.0_rp
    do k = 1, size(sim%tool)
      if (.not. sim%clock%now%is_near(k)) cycle
      do group = 1, sim%nodes%n_groups
        if (sim%scene%is_rigid_group(group)) cycle
        call resolve_tool_contact(sim, k, group, dt, g(:, :, group), outcome)
      end do
    end do
  end subroutine resolve_contact

  !> Resolve contact between one group of bodies and one tool.
  subroutine resolve_tool_contact(sim, k, group, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome

    call find_contact(sim%scene, sim%clock, sim%tool, sim%particles, sim%nodes, sim%contact, k, &
                      group, dt, g)
    call sum_with_overlap(sim, dt, g, outcome, n_masses, sim%contact%mass)
    call find_impulses(sim%scene, sim%clock, sim%nodes, sim%contact, sim%tool(k), dt, g)
    call sum_with_overlap(sim, dt, g, outcome, sim%contact%width, sim%contact%values)
    call apply_impulses(sim%scene, sim%clock, sim%particles, sim%nodes, sim%contact, sim%budget, &
                        sim%tool(k), dt, g)
  end subroutine resolve_tool_contact

end module step_constraints
