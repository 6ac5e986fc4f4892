! SPDX-License-Identifier: MIT
!> Walls, clamps, symmetry planes and tools in a step.
module step_boundary
  use base_kinds, only: rp
  use boundary_clamps, only: hold_walls
  use boundary_symmetry, only: r_velocity, restore
  use comm_world, only: world_t
  use exchange_speculation, only: may_speculate
  use sleep_held_layer, only: hold_layer
  use step_simulation, only: simulation_t
  implicit none (type, external)
  private

  public :: apply_boundary, mirror_nodes, move_tools

contains

  !> Collective. Velocities of the nodes as walls, clamps and sleepers allow; with
  !> several groups of bodies symmetry planes and tools wait until these have met. `stands`: as far
  !> as this rank sees, the step does.
  subroutine apply_boundary(world, sim, dt, g, stands)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    logical, intent(in) :: stands

    call hold_walls(world, sim%scene, sim%clock, sim%nodes, sim%boundary, sim%books, 1.0_rp, g)
    call hold_layer(sim%scene, sim%clock, sim%nodes, sim%sleepers, sim%books, g(:, :, 1))
    if (sim%nodes%n_groups > 1) return
    call mirror_nodes(sim, g)
    call move_tools(sim, dt)
    sim%exchange%speculative%is_possible = stands .and. may_speculate(world, sim%scene, &
      sim%clock, sim%tool, sim%nodes)
  end subroutine apply_boundary

  !> Velocities of the nodes behind symmetry planes.
  subroutine mirror_nodes(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    integer :: k

    do k = 1, sim%nodes%n_groups
      call restore(sim%scene, sim%nodes, sim%boundary, r_velocity, g(:, :, k))
    end do
  end subroutine mirror_nodes

  !> Bring the tools to where they are at the end of the step.
  subroutine move_tools(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    integer :: k

    do k = 1, size(sim%tool)
      call sim%tool(k)%move_to(sim%clock%time + dt)
    end do
  end subroutine move_tools

end module step_boundary
