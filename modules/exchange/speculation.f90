! SPDX-License-Identifier: MIT
!> Speculation. Blocks that no tool reaches in a step may come back from the grid while this rank
!> waits for others, for the acceptance of the step (exchange_acceptance) and for sums of contact.
!> Which blocks these are is decided by a sort and kept in the tags: they are the first to come back
!> in any case, so that the order of sums in the books does not depend on waiting. What was done
!> before the step is accepted can be taken back.
module exchange_speculation
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_tool, only: tool_t
  use exchange_ranks, only: exchange_t
  use mapping_nodes, only: nodes_t
  use particles_store, only: far_bit, particles_t, set_bit
  use state_blocks, only: blocks_t
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_usl
  use state_step, only: outcome_t
  implicit none (type, external)
  private

  public :: list_order, note_state, may_speculate, keep_block, roll_back

  real(rp), parameter :: most_displacement = 1.5_rp   !! of tool and particles until a sort [cells]
  !> Clearance from a tool: particles are in contact up to half a cell and a spacing away, and
  !> change nodes that particles three cells off on each axis read.
  real(rp), parameter :: beyond = most_displacement + 0.6_rp + 3.0_rp*sqrt(3.0_rp)   !! [cells]
  integer, parameter :: most_kept = 256        !! blocks that can be taken back

contains

  !> The order in which awake blocks come back from the grid: those far from all tools first.
  subroutine list_order(scene, particles, blocks, exchange, is_sorted_anew)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(inout) :: blocks
    type(exchange_t), intent(inout) :: exchange
    logical, intent(in) :: is_sorted_anew
    logical :: is_far(blocks%n_awake)
    real(rp) :: least
    integer :: b

    do b = 1, blocks%n_awake
      least = beyond*scene%grid%longest() + scene%body(particles%body(b))%longest_diagonal()
      associate (tag => particles%tag(1, b))
        if (is_sorted_anew) tag = set_bit(tag, far_bit, all(blocks%clearance(:, b) > least))
        is_far(b) = btest(tag, far_bit)
      end associate
    end do
    blocks%n_far = count(is_far)
    blocks%order = [pack([(b, b=1, blocks%n_awake)], is_far), &
                    pack([(b, b=1, blocks%n_awake)], .not. is_far)]
    exchange%speculative%done = 0
  end subroutine list_order

  !> What a step that is refused gives back: the books, and the particles that `keep_block` keeps.
  subroutine note_state(exchange, books)
    type(exchange_t), intent(inout) :: exchange
    type(books_t), intent(in) :: books

    exchange%speculative%done = 0
    exchange%speculative%is_possible = .false.
    exchange%speculative%books = books
  end subroutine note_state

  !> Whether far blocks may be done speculatively in a step that stands on this rank, with the tools
  !> at their new places: nothing but tools, and not through a periodic side, changes nodes any
  !> more.
  logical function may_speculate(world, scene, clock, tool, nodes) result(may)
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
            <= most_displacement*minval(scene%grid%h)
    end do
  end function may_speculate

  !> Keep the particles of the next block, before it comes back in a step that may yet be refused;
  !> false if there is none, or no storage left.
  logical function keep_block(particles, blocks, exchange) result(is_kept)
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(exchange_t), intent(inout) :: exchange

    associate (s => exchange%speculative)
      if (.not. allocated(s%kept)) allocate (s%kept(nlane, particles%nf, most_kept))
      is_kept = s%done < min(blocks%n_far, most_kept)
      if (is_kept) s%kept(:, :, s%done + 1) = particles%ps(:, :, blocks%order(s%done + 1))
    end associate
  end function keep_block

  !> Undo what was done since `note_state`.
  subroutine roll_back(particles, blocks, exchange, books, outcome)
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(exchange_t), intent(inout) :: exchange
    type(books_t), intent(inout) :: books
    type(outcome_t), intent(inout) :: outcome
    integer :: i

    associate (s => exchange%speculative)
      if (s%done > 0) outcome = outcome_t()      ! USL: nothing was in it before
      do i = 1, s%done
        particles%ps(:, :, blocks%order(i)) = s%kept(:, :, i)
      end do
      s%done = 0
      books = s%books
    end associate
  end subroutine roll_back

end module exchange_speculation
