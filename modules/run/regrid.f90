! SPDX-License-Identifier: MIT
!> Periodic reorganisation: balance the ranks, migrate and sort particles, list the nodes in use.
module run_regrid
  use base_kinds, only: i8, nlane, rp
  use base_world, only: world_t
  use boundary_clamp_list, only: list_clamps, list_nodes_in_front
  use boundary_symmetry, only: list_mirrors, narrow_mirrors
  use grid_geometry, only: box_t, halo, storage_nodes
  use grid_neighbours, only: dilate
  use particles_migrate, only: redistribute, wrap_positions
  use particles_sort, only: keep_none
  use particles_store, only: awake, f_pos, held, particles_t
  use run_balance, only: predict_imbalance, reach_of, rebalance, store_nodes
  use run_mass_scaling, only: adapt_mass
  use run_order, only: list_to_grid_order, mark_border
  use sleep_criteria, only: count_awake, update_sleep
  use sleep_held_layer, only: find_far_force
  use state_clock, only: clock_t
  use state_nodes, only: append, clear_nodes, forget_light, nodes_t
  use state_parts, only: simulation_t
  use state_probes, only: assign_probes, share_probes
  use state_scene, only: scene_t
  use state_sleepers, only: sleepers_t
  use step_schedule, only: list_to_particles_order
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: may_leave_cell, regrid, update_lists, sort_particles

  real(rp), parameter :: rounding = 1.0_rp + 1.0e-9_rp

contains

  !> Balance the load, migrate and sort particles as far as necessary, and list the nodes in use. Do
  !> nothing if the only reason is to wake sleepers, and their waking can be deferred.
  subroutine regrid(sim)
    type(simulation_t), intent(inout) :: sim
    logical :: can_wait, sleepers_changed

    call update_sleep(sim%world, sim%scene, sim%clock, sim%tool, sim%particles, sim%sleepers, &
                      sim%budget, sleepers_changed, can_wait)
    if (can_wait .and. .not. may_leave_cell(sim%scene, sim%clock)) then
      sim%clock%sorted_at = sim%clock%step
      call adapt_mass(sim)
      return
    end if
    call sort_particles(sim, sleepers_changed)
    call forget_contact(sim%scene, sim%tool, sim%particles)
    call forget_light(sim%nodes)
    sim%clock%displacement = 0.0_rp
    sim%clock%sorted_at = sim%clock%step
    call adapt_mass(sim)
  end subroutine regrid

  !> Collective. Balance the load if necessary, migrate and sort the particles, and list the nodes
  !> in use. This changes neither the physics nor the schedule of later sorts, so that a restart may
  !> call it.
  subroutine sort_particles(sim, sleepers_changed)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: sleepers_changed      !! sleepers differ from those at the last sort
    integer :: n_moving                      ! blocks whose particles may change rank
    integer :: cuts, keep
    logical :: is_new, sleepers_stay

    is_new = sim%particles%n_awake < 0
    call share_probes(sim%world, sim%probes)
    call wrap_positions(sim%scene%grid, sim%particles)
    n_moving = merge(sim%particles%nblk, sim%particles%n_awake, is_new)
    cuts = sim%exchange%balance%cuts
    call rebalance(sim, n_moving)
    if (sim%world%size > 1 .and. sim%nodes%n_groups > 1) call sim%pairs%gather_kept(sim%world)
    keep = kept_rest(sim%scene, sim%clock, sim%particles, sim%nodes)
    if (is_new) keep = keep_none
    call redistribute(sim%world, sim%scene%grid, sim%nodes%patch, sim%exchange%boxes, &
                      size(sim%scene%body), n_moving, keep, sleepers_changed, sim%particles, &
                      sleepers_stay)
    if (is_new .or. sim%exchange%balance%cuts > cuts) call sim%particles%fit()
    call update_lists(sim, .true., sleepers_stay)
  end subroutine sort_particles

  !> True if a particle may be more than a cell from its position at the last sort after two more
  !> steps at the current speed.
  pure logical function may_leave_cell(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    may_leave_cell = clock%displacement + 2.0_rp*clock%dt*clock%max_speed > minval(scene%grid%h)
  end function may_leave_cell

  !> Rest state from which particles keep their slots (their order only affects speed). Awake
  !> particles are reordered when particles with the same nodes are scattered, sleepers after many
  !> sorts.
  pure integer function kept_rest(scene, clock, particles, nodes) result(keep)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    integer, parameter :: sorts_per_full_sort = 100      ! sorts (SORT_INTERVAL) between two that
                                                         ! reorder all particles

    keep = awake
    if (is_disordered(scene, particles, nodes)) keep = held
    associate (interval => sorts_per_full_sort*scene%method%sort_interval)
      if (clock%step/interval > max(0_i8, clock%sorted_at)/interval) keep = keep_none
    end associate
  end function kept_rest

  !> True if the awake particles of this rank form more than `max_run_ratio` times as many runs of
  !> the same nearest node as there are such nodes.
  pure logical function is_disordered(scene, particles, nodes)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    real(rp), parameter :: max_run_ratio = 1.2_rp
    logical :: is_there(nodes%patch%nn), is_own(nlane)
    integer :: b, last, node(nlane), p, runs

    is_there = .false.
    last = 0
    runs = 0
    do b = 1, particles%n_awake
      call storage_nodes(scene%grid, nodes%patch, nlane, particles%ps(:, f_pos:f_pos + 2, b), &
                         node, is_own)
      do p = 1, particles%count(b)
        if (node(p) == last .or. .not. is_own(p)) cycle
        last = node(p)
        runs = runs + 1
        is_there(last) = .true.
      end do
    end do
    is_disordered = runs > max_run_ratio*count(is_there)
  end function is_disordered

  !> List everything that depends on the particle positions: shared nodes, nodes in use, wall nodes,
  !> block bounds, tool clearances.
  subroutine update_lists(sim, is_sorted_anew, sleepers_stay)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_sorted_anew    !! false in a resumed run
    logical, intent(in) :: sleepers_stay     !! the sleepers and their blocks are unchanged
    logical, allocatable :: near(:, :, :)    !! nodes in reach of awake particles
    type(box_t) :: active(2)
    logical :: patch_is_too_small, has_sleep

    has_sleep = sim%scene%method%sleep%is_on
    call count_awake(sim%particles, sim%sleepers)
    if (.not. sleepers_stay) then
      call store_sleeper_extent(sim%scene, sim%particles, sim%nodes, sim%sleepers)
    end if
    active = boxes_in_use(sim%world, sim%scene, sim%particles, sim%sleepers)
    patch_is_too_small = any(active(1)%hi > sim%nodes%reach%hi)
    if (patch_is_too_small) then
      sim%nodes%reach%hi = max(sim%nodes%reach%hi, active(1)%hi)
      call store_nodes(sim%world, sim%scene, sim%nodes, sim%exchange)
      call store_sleeper_extent(sim%scene, sim%particles, sim%nodes, sim%sleepers)
    end if
    call sim%nodes%halo%init(sim%world, sim%nodes%patch, sim%exchange%boxes, active(2))
    if (has_sleep) call sim%nodes%resting_halo%init(sim%world, sim%nodes%patch, &
                                                    sim%exchange%boxes, active(1))
    call mark_reach(sim%scene, sim%particles, sim%nodes, 1, sim%particles%n_awake, near)
    call list_runs(sim%nodes, near .or. sim%sleepers%near_any, has_sleep, .false.)
    call list_mirrors(sim%scene, sim%nodes)
    call list_clamps(sim%scene, sim%clock, sim%nodes)
    call find_far_force(sim%scene, sim%clock, sim%particles, sim%nodes, sim%sleepers, &
                        sleepers_stay .and. .not. patch_is_too_small)
    call mark_border(sim%scene, sim%particles, sim%nodes, is_sorted_anew)
    call list_to_grid_order(sim%particles)
    if (sim%nodes%n_groups > 1 .or. size(sim%hook) > 0) call enclose_blocks(sim%particles)
    call measure_clearances(sim%scene, sim%tool, sim%particles)
    call list_to_particles_order(sim%scene, sim%particles, sim%exchange, is_sorted_anew)
    if (.not. is_sorted_anew) call predict_imbalance(sim, 0)
    if (has_sleep) then  ! steps use the nodes of awake particles and of the held layer only
      call clear_nodes(sim%nodes, sim%nodes%g)
      if (allocated(sim%nodes%resting_range)) deallocate (sim%nodes%resting_range)
      call move_alloc(sim%nodes%range, sim%nodes%resting_range)
      sim%nodes%n_resting_ranges = sim%nodes%n_ranges
      call list_runs(sim%nodes, near .or. sim%sleepers%near_layer, .false., &
                     sim%particles%n_mapped < sim%particles%nblk)
      call narrow_mirrors(sim%nodes)
    end if
    call list_nodes_in_front(sim%scene, sim%nodes)
    call assign_probes(sim%scene%grid, sim%nodes%patch, sim%probes)
  end subroutine update_lists

  !> Store the nodes and the extent of the sleepers.
  subroutine store_sleeper_extent(scene, particles, nodes, sleepers)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    integer :: last

    last = particles%nblk
    call mark_reach(scene, particles, nodes, particles%n_awake + 1, particles%n_mapped, &
                    sleepers%near_layer)
    call mark_reach(scene, particles, nodes, particles%n_mapped + 1, last, sleepers%near_any)
    sleepers%near_any = sleepers%near_any .or. sleepers%near_layer
    sleepers%extent_layer = particles%extent(particles%n_awake + 1, particles%n_mapped)
    sleepers%extent_any = particles%extent(particles%n_awake + 1, last)
  end subroutine store_sleeper_extent

  !> Mark the nodes, as (z, y, x), that particles of blocks `low` to `high` can reach before the
  !> next sort.
  subroutine mark_reach(scene, particles, nodes, low, high, near)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: low, high
    logical, allocatable, intent(out) :: near(:, :, :)
    integer :: b, n(3)

    n = 0
    if (nodes%patch%nn > 0) n = nodes%patch%all%hi - nodes%patch%all%lo + 1
    allocate (near(n(3), n(2), n(1)), source=.false.)
    if (high < low) return
    do b = low, high
      call mark_block(scene, nodes, particles%count(b), particles%ps(:, f_pos:f_pos + 2, b), &
                      size(near), near)
    end do
    call dilate(near, halo)
  end subroutine mark_reach

  !> Mark the nodes nearest to the `n` particles of a block.
  pure subroutine mark_block(scene, nodes, n, x, nn, near)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, nn
    real(rp), intent(in) :: x(nlane, 3)
    logical, intent(inout) :: near(nn)
    integer :: node(nlane)
    logical :: is_own(nlane)

    call storage_nodes(scene%grid, nodes%patch, nlane, x, node, is_own)
    near(node(:n)) = .true.
  end subroutine mark_block

  !> Boxes of the nodes that particles of any rank can reach before the next sort: (1) all
  !> particles, (2) those that take part in steps.
  function boxes_in_use(world, scene, particles, sleepers) result(boxes)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(sleepers_t), intent(in) :: sleepers
    type(box_t) :: boxes(2)
    real(rp) :: extent(6, 2), flat(12)
    integer :: i

    extent = spread(particles%extent(1, particles%n_awake), 2, 2)
    extent(:, 1) = max(extent(:, 1), sleepers%extent_any)
    extent(:, 2) = max(extent(:, 2), sleepers%extent_layer)
    flat = reshape(extent, [12])
    call world%max(flat)
    extent = reshape(flat, [6, 2])
    do i = 1, 2
      boxes(i) = reach_of(scene%grid, extent(:, i))
    end do
  end function boxes_in_use

  !> List runs of consecutive nodes in use: those marked in `near` (z, y, x), shared ones, and
  !> (`with_partners`) their mirror nodes at walls. A run is entirely owned by this rank or entirely
  !> by another.
  subroutine list_runs(nodes, near, with_sleepers, with_partners)
    type(nodes_t), intent(inout) :: nodes
    logical, intent(in) :: near(:, :, :), with_sleepers, with_partners
    logical, allocatable :: used(:, :, :)
    integer, allocatable :: list(:, :)
    integer :: i, j, k, n(3), start, owned
    logical :: row_owned

    n = shape(near)
    n = n([3, 2, 1])
    allocate (used, source=near)
    if (with_sleepers) then
      call nodes%resting_halo%mark_used(size(used), used)
    else
      call nodes%halo%mark_used(size(used), used)
    end if
    if (with_partners) then
      call mark_partners(nodes%boundary%mirrors%n_pairs, nodes%boundary%mirrors%pair, size(used), &
                         used)
    end if
    allocate (list(3, 64))
    nodes%n_ranges = 0
    do i = 1, n(1)
      do j = 1, n(2)
        row_owned = all([i, j] - 1 + nodes%patch%all%lo(1:2) >= nodes%patch%own%lo(1:2)) &
          .and. all([i, j] - 1 + nodes%patch%all%lo(1:2) <= nodes%patch%own%hi(1:2))
        k = 1
        do while (k <= n(3))
          if (.not. used(k, j, i)) then
            k = k + 1
            cycle
          end if
          start = k
          owned = ownership(k)
          do while (k <= n(3))
            if (.not. used(k, j, i)) exit
            if (ownership(k) /= owned) exit
            k = k + 1
          end do
          call append(list, nodes%n_ranges, [start, k - 1, 0] &
                      + [1, 1, 0]*(n(3)*(j - 1 + n(2)*(i - 1))) + [0, 0, owned])
        end do
      end do
    end do
    call move_alloc(list, nodes%range)
  contains
    pure integer function ownership(k)
      integer, intent(in) :: k

      ownership = merge(1, 0, row_owned .and. k - 1 &
                        + nodes%patch%all%lo(3) >= nodes%patch%own%lo(3) .and. k - 1 &
                        + nodes%patch%all%lo(3) <= nodes%patch%own%hi(3))
    end function ownership
  end subroutine list_runs

  !> Mark mirror nodes at walls together: values left in one of them by a step must be cleared
  !> before the next.
  pure subroutine mark_partners(n, pair, nn, used)
    integer, intent(in) :: n, pair(:, :), nn
    logical, intent(inout) :: used(nn)
    integer :: i

    do i = 1, n
      if (any(used(pair(1:2, i)))) used(pair(1:2, i)) = .true.
    end do
  end subroutine mark_partners

  !> Find the bounding ball of each block.
  subroutine enclose_blocks(particles)
    type(particles_t), intent(inout) :: particles
    real(rp) :: low(3), high(3)
    integer :: a, b, n

    if (allocated(particles%ball)) deallocate (particles%ball)
    allocate (particles%ball(4, particles%nblk))
    do b = 1, particles%nblk
      n = particles%count(b)
      do a = 1, 3
        low(a) = minval(particles%ps(1:n, f_pos + a - 1, b))
        high(a) = maxval(particles%ps(1:n, f_pos + a - 1, b))
      end do
      particles%ball(1:3, b) = 0.5_rp*(low + high)
      particles%ball(4, b) = 0.5_rp*norm2(high - low)
    end do
  end subroutine enclose_blocks

  !> Measure the distances of the awake blocks from the tools.
  subroutine measure_clearances(scene, tools, particles)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(inout) :: tools(:)
    type(particles_t), intent(inout) :: particles
    real(rp) :: cutoff, d(nlane)
    integer :: b, k

    if (allocated(particles%clearance)) deallocate (particles%clearance)
    allocate (particles%clearance(size(tools), particles%n_awake))
    do k = 1, size(tools)
      call tools(k)%store_reference_pose()
    end do
    do b = 1, particles%n_awake
      associate (n => particles%count(b), ps => particles%ps(:, :, b), &
                 body => scene%body(particles%body(b)))
        do k = 1, size(tools)
          ! exact distances are needed only for the nearest particle and for those that may touch
          call tools(k)%clearances(n, ps(:, f_pos:f_pos + 2), huge(1.0_rp), d, is_bound=.true.)
          cutoff = tools(k)%clearance(ps(minloc(d(:n), 1), f_pos:f_pos + 2))
          cutoff = rounding*min(0.5_rp*huge(1.0_rp), max(cutoff, body%longest_diagonal()))
          call tools(k)%clearances(n, ps(:, f_pos:f_pos + 2), cutoff, d)
          particles%clearance(k, b) = minval(d(:n))
        end do
      end associate
    end do
  end subroutine measure_clearances

  !> After a sort that is due: particles that have left all tools lose their contact history. A
  !> restart on other ranks, which sorts at any step, must not change it.
  subroutine forget_contact(scene, tools, particles)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(inout) :: particles
    real(rp) :: d(nlane), least(nlane)
    integer :: b, k

    if (scene%layout%coulomb_reserve == 0) return
    do b = 1, particles%n_awake
      associate (n => particles%count(b), ps => particles%ps(:, :, b), &
                 far => scene%body(particles%body(b))%longest_diagonal())
        least = huge(1.0_rp)
        do k = 1, size(tools)
          if (particles%clearance(k, b) > far) cycle
          call tools(k)%clearances(n, ps(:, f_pos:f_pos + 2), rounding*far, d)
          least(:n) = min(least(:n), d(:n))
        end do
        associate (reserve => scene%layout%coulomb_reserve, force => scene%layout%tool_force)
          do k = 1, n
            if (least(k) > far) ps(k, [reserve, force, force + 1, force + 2]) = 0.0_rp
          end do
        end associate
      end associate
    end do
  end subroutine forget_contact

end module run_regrid
