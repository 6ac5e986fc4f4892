! SPDX-License-Identifier: MIT
!> Overlap of computation and communication: blocks that no tool reaches may be updated from the
!> grid while an exchange is under way, before all ranks have accepted the step or before contact
!> sums have arrived. These blocks are the first in any case (exchange_speculation), so that the
!> order of summation in the budget does not depend on timing.
module step_schedule
  use base_kinds, only: rp
  use base_timers, only: ph_nodes, ph_to_particles
  use comm_world, only: world_t
  use exchange_acceptance, only: finish_acceptance
  use exchange_speculation, only: save_block, roll_back
  use simulation_parts, only: simulation_t
  use state_run, only: outcome_t
  use update_sweeps, only: blocks_to_particles
  implicit none (type, external)
  private

  public :: accept_step, sum_with_overlap

contains

  !> Collective. Complete the acceptance of the step. If it is refused, `dt` is reduced and
  !> everything done since `save_state` is undone.
  subroutine accept_step(sim, dt, g, outcome, is_refused)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt                 !! time step [s]
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome
    logical, intent(out) :: is_refused

    if (sim%exchange%speculative%is_possible) then
      call sim%timer%lap(ph_nodes)
      do while (.not. sim%exchange%acceptance%is_done())
        if (.not. save_block(sim%particles, sim%blocks, sim%exchange)) exit
        call advance_next(sim, dt, g(:, :, 1), outcome)
      end do
      call sim%timer%lap(ph_to_particles)
    end if
    call finish_acceptance(sim%scene, sim%clock, sim%step, sim%exchange, dt, is_refused)
    if (is_refused .or. sim%step%is_broken) then
      call roll_back(sim%particles, sim%blocks, sim%exchange, sim%budget, outcome)
    end if
  end subroutine accept_step

  !> Collective. Sum `values` of the nodes in contact with a tool over the ranks.
  subroutine sum_with_overlap(world, sim, dt, g, outcome, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%contact%n_nodes)

    associate (contact => sim%contact)
      call sim%nodes%halo%post_entries(world, .false., sim%nodes%patch%nn, contact%entry_of, &
                                       contact%n_nodes, contact%node, width, values)
    end associate
    if (sim%exchange%speculative%is_possible) then
      call sim%timer%lap(ph_nodes)
      do while (sim%exchange%speculative%n_done < sim%blocks%n_far)
        if (sim%nodes%halo%entries_have_arrived()) exit
        call advance_next(sim, dt, g, outcome)
      end do
      call sim%timer%lap(ph_to_particles)
    end if
    call sim%nodes%halo%finish_entries(world, .false., sim%contact%n_nodes, width, values)
  end subroutine sum_with_overlap

  !> Update the next block from the grid, in a scene with one group of bodies and USL.
  subroutine advance_next(sim, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome

    associate (next => sim%exchange%speculative%n_done)
      next = next + 1
      call blocks_to_particles(sim%scene, sim%clock, sim%step, sim%tool, sim%particles, &
                               sim%blocks, sim%nodes, sim%budget, next, next, dt, g, g, dt, outcome)
    end associate
  end subroutine advance_next

end module step_schedule
