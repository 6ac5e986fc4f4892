! SPDX-License-Identifier: MIT
!> Work while waiting: blocks that no tool reaches in a step may come back from the grid while this rank
!> waits for others, for the limit of the step (time_limit) and for sums of contact. Which blocks these
!> are is decided by a sort and kept in the tags: they are the first to come back in any case, so that
!> the books are added up in the same order whoever waits. What was done before the limit is known can
!> be taken back.
module time_ahead
  use base_kinds, only: nlane, rp
  use base_timers, only: ph_nodes, ph_to_particles
  use comm_world, only: world_t
  use particles_store, only: far_bit, set_bit
  use time_filter, only: filter_is_due
  use time_limit, only: finish_limit
  use time_scene, only: scheme_usl
  use time_state, only: simulation_t
  use time_sweeps, only: blocks_to_particles
  use time_update, only: report_t
  implicit none (type, external)
  private

  public :: list_order, note_books, may_go_ahead, settle_step, share_meanwhile

  real(rp), parameter :: least_room = 1.5_rp   !! way of tool and particles together until a sort [cells]
  !> From a tool beyond it: particles may touch up to half a cell and half a spacing away, and change nodes
  !> that particles three cells off on each axis read.
  real(rp), parameter :: beyond = least_room + 0.6_rp + 3.0_rp*sqrt(3.0_rp)   !! [cells]
  integer, parameter :: most_kept = 256        !! blocks that can be taken back

contains

  !> The order in which awake blocks come back from the grid: those far from all tools first.
  subroutine list_order(sim, is_sorted_anew)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_sorted_anew
    logical :: is_far(sim%n_awake)
    real(rp) :: room
    integer :: b

    do b = 1, sim%n_awake
      room = beyond*sim%scene%grid%h + 0.5_rp*norm2(sim%scene%body(sim%particles%body(b))%spacing)
      associate (tag => sim%particles%tag(1, b))
        if (is_sorted_anew) tag = set_bit(tag, far_bit, all(sim%clearance(:, b) > room))
        is_far(b) = btest(tag, far_bit)
      end associate
    end do
    sim%ahead%n_far = count(is_far)
    sim%ahead%order = [pack([(b, b=1, sim%n_awake)], is_far), pack([(b, b=1, sim%n_awake)], .not. is_far)]
    sim%ahead%done = 0
  end subroutine list_order

  !> What a step that is too long gives back.
  subroutine note_books(sim)
    type(simulation_t), intent(inout) :: sim

    sim%ahead%done = 0
    sim%ahead%is_possible = .false.
    sim%ahead%sums = sim%sums
    sim%ahead%impulse = sim%impulse
    sim%ahead%failed_returns = sim%failed_returns
    sim%ahead%alarms = sim%alarms
    sim%ahead%alarm_place = sim%alarm_place
  end subroutine note_books

  !> Whether far blocks may go ahead in a step that seems to stand, whose tools are at their new places: nothing but tools,
  !> and not through a periodic side, changes nodes any more.
  logical function may_go_ahead(world, sim) result(may)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    integer :: b, k

    may = world%size > 1 .and. sim%scene%method%scheme == scheme_usl .and. sim%n_groups == 1 &
          .and. .not. filter_is_due(sim) .and. (size(sim%tool) == 0 .or. all(sim%patch%period == 0))
    do b = 1, size(sim%scene%body)
      may = may .and. .not. allocated(sim%scene%body(b)%traction)
    end do
    do k = 1, size(sim%tool)
      may = may .and. sim%clock%travel + sim%tool(k)%way() <= least_room*sim%scene%grid%h
    end do
  end function may_go_ahead

  !> Collective. Learn whether the step stands as it is; if not, `dt` comes back smaller, and with all that
  !> was done since `note_books` taken back.
  subroutine settle_step(sim, dt, g, report, is_refused)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: dt
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)
    type(report_t), intent(inout) :: report
    logical, intent(out) :: is_refused

    if (sim%ahead%is_possible) then
      call sim%timer%lap(ph_nodes)
      if (.not. allocated(sim%ahead%kept)) allocate (sim%ahead%kept(nlane, sim%particles%nf, most_kept))
      do while (sim%ahead%done < min(sim%ahead%n_far, most_kept))
        if (sim%limit%is_done()) exit
        sim%ahead%kept(:, :, sim%ahead%done + 1) = sim%particles%ps(:, :, sim%ahead%order(sim%ahead%done + 1))
        call go_ahead(sim, dt, g(:, :, 1), report)
      end do
      call sim%timer%lap(ph_to_particles)
    end if
    call finish_limit(sim, dt, is_refused)
    if (is_refused .or. sim%is_broken) call take_back(sim, report)
  end subroutine settle_step

  !> Collective. Sums over the ranks of `values` kept for `n` nodes.
  subroutine share_meanwhile(world, sim, dt, g, report, first, n, node, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    type(report_t), intent(inout) :: report
    integer, intent(in) :: first(sim%patch%nn), n, node(n), width
    real(rp), intent(inout) :: values(width, n)

    call sim%halo%post_entries(world, .false., sim%patch%nn, first, n, node, width, values)
    if (sim%ahead%is_possible) then
      call sim%timer%lap(ph_nodes)
      do while (sim%ahead%done < sim%ahead%n_far)
        if (sim%halo%poke_entries()) exit
        call go_ahead(sim, dt, g, report)
      end do
      call sim%timer%lap(ph_to_particles)
    end if
    call sim%halo%finish_entries(world, .false., n, width, values)
  end subroutine share_meanwhile

  !> The next block.
  subroutine go_ahead(sim, dt, g, report)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)   !! of the only group
    type(report_t), intent(inout) :: report

    call blocks_to_particles(sim, sim%ahead%done + 1, sim%ahead%done + 1, dt, g, g, dt, report)
    sim%ahead%done = sim%ahead%done + 1
  end subroutine go_ahead

  subroutine take_back(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(report_t), intent(inout) :: report
    integer :: i

    if (sim%ahead%done > 0) report = report_t()   ! USL: nothing was in it before
    do i = 1, sim%ahead%done
      sim%particles%ps(:, :, sim%ahead%order(i)) = sim%ahead%kept(:, :, i)
    end do
    sim%ahead%done = 0
    sim%sums = sim%ahead%sums
    sim%impulse = sim%ahead%impulse
    sim%failed_returns = sim%ahead%failed_returns
    sim%alarms = sim%ahead%alarms
    sim%alarm_place = sim%ahead%alarm_place
  end subroutine take_back

end module time_ahead
