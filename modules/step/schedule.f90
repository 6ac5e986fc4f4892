! SPDX-License-Identifier: MIT
!> Overlap of computation and communication: blocks that no tool reaches may be updated from the
!> grid while an exchange is under way, before all ranks have accepted the step (step_acceptance) or
!> before contact sums have arrived. A sort decides which blocks these are and stores it in the
!> tags; they are the first to be updated in any case, so that the order of summation in the budget
!> does not depend on timing. Updates made before the step is accepted can be undone.
module step_schedule
  use base_kinds, only: nlane, rp
  use base_timers, only: ph_nodes, ph_to_particles
  use mpm_blocks, only: move_rigid
  use mpm_sweeps, only: advance_block
  use mpm_tractions, only: record_traction_work
  use particles_block, only: block_t, view_block
  use particles_store, only: f_pos, f_vel, far_bit, particles_t, set_bit
  use state_budget, only: budget_t
  use state_clock, only: outcome_t
  use state_exchange, only: exchange_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t, scheme_usl
  use step_acceptance, only: finish_acceptance
  implicit none (type, external)
  private

  public :: accept_step, blocks_to_particles, can_speculate, grid_to_particles, &
            list_to_particles_order, save_block, save_state, sum_with_overlap

  !> Largest displacement of tools and particles until a sort [cells].
  real(rp), parameter :: max_displacement = 1.5_rp
  !> Clearance beyond which contact has no influence [cells]: particles are in contact up to half a
  !> cell and a spacing away, and change nodes that particles three cells off on each axis read.
  real(rp), parameter :: far_distance = max_displacement + 0.6_rp + 3.0_rp*sqrt(3.0_rp)  !! [cells]
  integer, parameter :: max_saved = 256                       !! blocks that can be restored

contains

  !> Order in which awake blocks are updated from the grid: those far from all tools first.
  subroutine list_to_particles_order(scene, particles, exchange, is_sorted_anew)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(exchange_t), intent(inout) :: exchange
    logical, intent(in) :: is_sorted_anew
    logical :: is_far(particles%n_awake)
    real(rp) :: least
    integer :: b

    do b = 1, particles%n_awake
      least = far_distance*scene%grid%longest() + scene%body(particles%body(b))%longest_diagonal()
      associate (tag => particles%tag(1, b))
        if (is_sorted_anew) tag = set_bit(tag, far_bit, all(particles%clearance(:, b) > least))
        is_far(b) = btest(tag, far_bit)
      end associate
    end do
    particles%n_far = count(is_far)
    particles%order = [pack([(b, b=1, particles%n_awake)], is_far), &
                       pack([(b, b=1, particles%n_awake)], .not. is_far)]
    exchange%speculative%n_done = 0
  end subroutine list_to_particles_order

  !> Save the state to restore after a refusal: the budget; particles are saved by `save_block`.
  subroutine save_state(exchange, budget)
    type(exchange_t), intent(inout) :: exchange
    type(budget_t), intent(in) :: budget

    exchange%speculative%n_done = 0
    exchange%speculative%is_possible = .false.
    exchange%speculative%budget = budget
  end subroutine save_state

  !> True if far blocks may be updated before the acceptance, with the tools at their new positions:
  !> only tools may still change nodal velocities, and not through a periodic side.
  logical function can_speculate(sim) result(may)
    type(simulation_t), intent(in) :: sim
    integer :: k

    may = sim%world%size > 1 .and. sim%scene%method%scheme == scheme_usl &
      .and. sim%nodes%n_groups == 1 .and. .not. sim%scene%method%filters_in(sim%clock%step) &
      .and. (size(sim%tool) == 0 .or. all(sim%nodes%patch%period == 0)) &
      .and. .not. sim%scene%has_tractions()
    do k = 1, size(sim%tool)
      may = may .and. sim%clock%displacement + sim%tool(k)%displacement() &
            <= max_displacement*minval(sim%scene%grid%h)
    end do
  end function can_speculate

  !> Save the particles of the next block before its update in a step that may be refused; false if
  !> there is none, or no storage left.
  logical function save_block(particles, exchange) result(is_saved)
    type(particles_t), intent(in) :: particles
    type(exchange_t), intent(inout) :: exchange

    associate (s => exchange%speculative)
      if (.not. allocated(s%saved)) allocate (s%saved(nlane, particles%nf, max_saved))
      is_saved = s%n_done < min(particles%n_far, max_saved)
      if (is_saved) s%saved(:, :, s%n_done + 1) = particles%ps(:, :, particles%order(s%n_done + 1))
    end associate
  end function save_block

  !> Undo all updates since `save_state`.
  subroutine roll_back(particles, exchange, budget, outcome)
    type(particles_t), intent(inout) :: particles
    type(exchange_t), intent(inout) :: exchange
    type(budget_t), intent(inout) :: budget
    type(outcome_t), intent(inout) :: outcome
    integer :: i

    associate (s => exchange%speculative)
      if (s%n_done > 0) outcome = outcome_t()      ! USL: the maxima were empty before the updates
      do i = 1, s%n_done
        particles%ps(:, :, particles%order(i)) = s%saved(:, :, i)
      end do
      s%n_done = 0
      budget = s%budget
    end associate
  end subroutine roll_back

  !> Collective. Complete the acceptance of the step. If it is refused, `dt` is reduced and all
  !> updates since `save_state` are undone.
  subroutine accept_step(sim, dt, g, outcome, is_refused)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt                 !! time step [s]
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(outcome_t), intent(inout) :: outcome
    logical, intent(out) :: is_refused

    if (sim%exchange%speculative%is_possible) then
      call sim%timer%lap(ph_nodes)
      do while (.not. sim%exchange%acceptance%is_done())
        if (.not. save_block(sim%particles, sim%exchange)) exit
        call advance_next(sim, dt, g(:, :, 1), outcome)
      end do
      call sim%timer%lap(ph_to_particles)
    end if
    call finish_acceptance(sim%scene, sim%clock, sim%exchange, dt, is_refused)
    if (is_refused .or. sim%clock%now%is_broken) then
      call roll_back(sim%particles, sim%exchange, sim%budget, outcome)
    end if
  end subroutine accept_step

  !> Collective. Sum `values` of the nodes in contact with a tool over the ranks.
  subroutine sum_with_overlap(sim, dt, g, outcome, width, values)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%contact%n_nodes)

    associate (contact => sim%contact)
      call sim%nodes%halo%post_entries(.false., sim%nodes%patch%nn, contact%entry_of, &
                                       contact%n_nodes, contact%node, width, values)
    end associate
    if (sim%exchange%speculative%is_possible) then
      call sim%timer%lap(ph_nodes)
      do while (sim%exchange%speculative%n_done < sim%particles%n_far)
        if (sim%nodes%halo%entries_have_arrived()) exit
        call advance_next(sim, dt, g, outcome)
      end do
      call sim%timer%lap(ph_to_particles)
    end if
    call sim%nodes%halo%finish_entries(.false., sim%contact%n_nodes, width, values)
  end subroutine sum_with_overlap

  !> Update the next block from the grid, in a scene with one group of bodies and USL.
  subroutine advance_next(sim, dt, g, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn)
    type(outcome_t), intent(inout) :: outcome

    associate (next => sim%exchange%speculative%n_done)
      next = next + 1
      call blocks_to_particles(sim, next, next, dt, g, g, dt, outcome)
    end associate
  end subroutine advance_next

  !> Update the particles from the grid: move them with `g_motion`, then update the stress over
  !> `dt_stress` with the gradient of `g_strain` (the same grid in USL).
  subroutine grid_to_particles(sim, dt, g_motion, g_strain, dt_stress, outcome)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, sim%nodes%patch%nn, sim%nodes%n_groups) :: g_motion, g_strain
    type(outcome_t), intent(inout) :: outcome

    if (sim%scene%has_tractions()) then
      call record_traction_work(sim%scene, sim%clock, sim%particles, sim%nodes, sim%budget, dt, &
                                g_motion)
    end if
    call blocks_to_particles(sim, sim%exchange%speculative%n_done + 1, sim%particles%n_awake, dt, &
                             g_motion, g_strain, dt_stress, outcome)
  end subroutine grid_to_particles

  !> Update the blocks `first` to `last` of `particles%order`.
  subroutine blocks_to_particles(sim, first, last, dt, g_motion, g_strain, dt_stress, outcome)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: first, last
    real(rp), intent(in) :: dt, dt_stress
    real(rp), intent(in), dimension(8, sim%nodes%patch%nn, sim%nodes%n_groups) :: g_motion, g_strain
    type(outcome_t), intent(inout) :: outcome
    type(block_t) :: block
    integer :: i

    do i = first, last
      call sim%particles%fetch(sim%particles%order(min(i + 1, sim%particles%n_awake)), &
                               sim%particles%nf)
      call view_block(sim%particles, sim%particles%order(i), block)
      associate (body => sim%scene%body(block%body), ps => block%ps)
        if (body%is_rigid()) then
          call move_rigid(sim%tool, body%tool, block%n, ps(1, f_pos), ps(1, f_vel), outcome%speed2)
        else
          call advance_block(sim%scene, sim%clock, sim%nodes, sim%budget, block, dt, &
                             g_motion(:, :, body%group), g_strain(:, :, body%group), dt_stress, &
                             outcome)
        end if
      end associate
    end do
  end subroutine blocks_to_particles

end module step_schedule
