! SPDX-License-Identifier: MIT
!> Speculation. Blocks that no tool reaches in a step may be updated while this rank waits for the
!> acceptance of the step (exchange_acceptance) or for contact sums. A sort decides which blocks
!> these are and stores it in the tags: they are the first to be updated in any case, so that the
!> order of summation in the budget does not depend on timing. Updates made before the step is
!> accepted can be undone.
module exchange_speculation
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_tool, only: tool_t
  use exchange_ranks, only: exchange_t
  use mapping_nodes, only: nodes_t
  use particles_store, only: far_bit, particles_t, set_bit
  use state_run, only: blocks_t, budget_t, clock_t, outcome_t
  use state_scene, only: scene_t, scheme_usl
  implicit none (type, external)
  private

  public :: list_to_particles_order, save_state, can_speculate, save_block, roll_back

  real(rp), parameter :: max_displacement = 1.5_rp   !! bound of tool and particle displacement
                                                     !! until a sort [cells]
  !> Clearance beyond which contact has no influence [cells]: particles are in contact up to half a
  !> cell and a spacing away, and change nodes that particles three cells off on each axis read.
  real(rp), parameter :: far_distance = max_displacement + 0.6_rp + 3.0_rp*sqrt(3.0_rp)  !! [cells]
  integer, parameter :: max_saved = 256                       !! blocks that can be restored

contains

  !> Order in which awake blocks are updated from the grid: those far from all tools first.
  subroutine list_to_particles_order(scene, particles, blocks, exchange, is_sorted_anew)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(inout) :: blocks
    type(exchange_t), intent(inout) :: exchange
    logical, intent(in) :: is_sorted_anew
    logical :: is_far(blocks%n_awake)
    real(rp) :: least
    integer :: b

    do b = 1, blocks%n_awake
      least = far_distance*scene%grid%longest() + scene%body(particles%body(b))%longest_diagonal()
      associate (tag => particles%tag(1, b))
        if (is_sorted_anew) tag = set_bit(tag, far_bit, all(blocks%clearance(:, b) > least))
        is_far(b) = btest(tag, far_bit)
      end associate
    end do
    blocks%n_far = count(is_far)
    blocks%order = [pack([(b, b=1, blocks%n_awake)], is_far), &
                    pack([(b, b=1, blocks%n_awake)], .not. is_far)]
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
  logical function can_speculate(world, scene, clock, tool, nodes) result(may)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(nodes_t), intent(in) :: nodes
    integer :: k

    may = world%size > 1 .and. scene%method%scheme == scheme_usl .and. nodes%n_groups == 1 &
          .and. .not. scene%method%filters_in(clock%step) &
          .and. (size(tool) == 0 .or. all(nodes%patch%period == 0)) &
          .and. .not. scene%has_tractions()
    do k = 1, size(tool)
      may = may .and. clock%displacement + tool(k)%displacement() &
            <= max_displacement*minval(scene%grid%h)
    end do
  end function can_speculate

  !> Save the particles of the next block before its update in a step that may be refused; false if
  !> there is none, or no storage left.
  logical function save_block(particles, blocks, exchange) result(is_saved)
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(exchange_t), intent(inout) :: exchange

    associate (s => exchange%speculative)
      if (.not. allocated(s%saved)) allocate (s%saved(nlane, particles%nf, max_saved))
      is_saved = s%n_done < min(blocks%n_far, max_saved)
      if (is_saved) s%saved(:, :, s%n_done + 1) = particles%ps(:, :, blocks%order(s%n_done + 1))
    end associate
  end function save_block

  !> Undo what was done since `save_state`.
  subroutine roll_back(particles, blocks, exchange, budget, outcome)
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(exchange_t), intent(inout) :: exchange
    type(budget_t), intent(inout) :: budget
    type(outcome_t), intent(inout) :: outcome
    integer :: i

    associate (s => exchange%speculative)
      if (s%n_done > 0) outcome = outcome_t()      ! USL: it was empty before
      do i = 1, s%n_done
        particles%ps(:, :, blocks%order(i)) = s%saved(:, :, i)
      end do
      s%n_done = 0
      budget = s%budget
    end associate
  end subroutine roll_back

end module exchange_speculation
