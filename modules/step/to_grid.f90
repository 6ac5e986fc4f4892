! SPDX-License-Identifier: MIT
!> Transfer from particles to grid, with reflection at symmetry planes and summation over the ranks.
!> Blocks that may reach shared nodes (the border) come first: their sums are sent while the other
!> blocks are processed.
module step_to_grid
  use base_kinds, only: rp
  use base_timers, only: ph_exchange, ph_to_grid
  use boundary_symmetry, only: shared_part, reflect, interior_part, r_momentum
  use mpm_fbar, only: clear_volume, sum_volume
  use mpm_sweeps, only: blocks_to_grid
  use mpm_tractions, only: tractions_to_grid
  use sleep_held_layer, only: add_layer
  use state_nodes, only: clear_nodes, nodes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t, scheme_usl
  implicit none (type, external)
  private

  public :: particles_to_grid, sum_nodes

  integer, parameter :: blocks_per_test = 32  !! blocks between two tests of pending messages

contains

  !> Collective. Compute mass, momentum, force and temperature of all nodes in use.
  subroutine particles_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)

    call clear_nodes(sim%nodes, g)
    if (sim%clock%now%scheme == scheme_usl) call clear_volume(sim%scene, sim%nodes)
    if (sim%nodes%n_groups == 1 .and. sim%clock%now%scheme == scheme_usl) then
      call map_and_sum(sim, g)
      return
    end if
    call blocks_to_grid(sim%scene, sim%clock, sim%particles, sim%nodes, 1, sim%particles%n_awake, g)
    call layer_and_tractions_to_grid(sim, g)
    call sim%timer%lap(ph_to_grid)
    call sum_nodes(sim%scene, sim%nodes, g)
    if (sim%clock%now%scheme == scheme_usl) call sum_volume(sim%scene, sim%nodes)
    call sim%timer%lap(ph_exchange)
  end subroutine particles_to_grid

  !> Compute the nodal records in a scene with one velocity field, overlapping computation and
  !> communication.
  subroutine map_and_sum(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    integer :: b

    associate (lost => sim%nodes%boundary%mirrors%lost, &
               own => sim%nodes%boundary%mirrors%mass_behind(:, 1))
      lost = 0.0_rp
      call blocks_to_grid(sim%scene, sim%clock, sim%particles, sim%nodes, 1, &
                          sim%particles%n_border, g)
      call layer_and_tractions_to_grid(sim, g)
      call reflect(sim%scene, sim%nodes, r_momentum, g(:, :, 1), lost, own, &
                   shared_part)
      call sim%timer%lap(ph_to_grid)
      call sim%nodes%halo%post(8, sim%nodes%patch%nn, g(:, :, 1), sim%nodes%volume)
      call sim%timer%lap(ph_exchange)
      do b = sim%particles%n_border + 1, sim%particles%n_awake, blocks_per_test
        call blocks_to_grid(sim%scene, sim%clock, sim%particles, sim%nodes, b, &
                            min(b + blocks_per_test - 1, sim%particles%n_awake), g)
        call sim%nodes%halo%progress_messages()
      end do
      call reflect(sim%scene, sim%nodes, r_momentum, g(:, :, 1), lost, own, &
                   interior_part)
      call sim%timer%lap(ph_to_grid)
      call sim%nodes%halo%finish(8, sim%nodes%patch%nn, g(:, :, 1), sim%nodes%volume)
      call sim%timer%lap(ph_exchange)
    end associate
  end subroutine map_and_sum

  !> Add the contributions of the held layer and of tractions.
  subroutine layer_and_tractions_to_grid(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)

    if (sim%scene%method%sleep%is_on) call add_layer(sim%nodes, sim%sleepers, g(:, :, 1))
    if (sim%scene%has_tractions()) then
      call tractions_to_grid(sim%scene, sim%clock, sim%particles, sim%nodes, g)
    end if
  end subroutine layer_and_tractions_to_grid

  !> Collective. Reflect the records at symmetry planes, sum those of shared nodes over the ranks.
  subroutine sum_nodes(scene, nodes, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: k

    nodes%boundary%mirrors%lost = 0.0_rp
    do k = 1, nodes%n_groups
      call reflect(scene, nodes, r_momentum, g(:, :, k), nodes%boundary%mirrors%lost, &
                   nodes%boundary%mirrors%mass_behind(:, k))
      call nodes%halo%sum(8, nodes%patch%nn, g(:, :, k))
    end do
  end subroutine sum_nodes

end module step_to_grid
