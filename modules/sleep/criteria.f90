! SPDX-License-Identifier: MIT
!> Sleep criteria. Material whose stress does not change stops its mechanics but keeps conducting
!> heat. The grid is divided into cubes of a few cells. The criterion is stress, relative to
!> SLEEP_STRESS times the largest mean stress of a cube: a cube wakes if awake material loads its
!> held nodes by a larger stress, and falls asleep only if its stress would change by less while it
!> sleeps (sleep_stress). Cubes near a tool, cubes whose sleepers have changed their temperature,
!> and their neighbours by a face or an edge are awake, too. The nodes do not resolve differences
!> between neighbouring particles, which therefore wake no cube. Sleepers that share nodes with
!> awake particles form the held layer (sleep_held_layer).
module sleep_criteria
  use base_kinds, only: i8, nlane, rp
  use base_world, only: world_t
  use grid_geometry, only: box_t, grid_t, nearest_node, nearest_nodes
  use grid_neighbours, only: dilate
  use particles_store, only: asleep, awake, f_mass, f_pos, f_rate, f_tau, f_temp, f_vel, held, &
                             particles_t, rests, set_rest, tag_rest
  use sleep_cubes, only: cube_at, cube_middle, cube_size, edge, longest_cube, start_tracking
  use sleep_stress, only: c_wake_requests, c_mass, c_stress, find_active_cubes, n_cube_sums, &
                          n_particle_sums
  use state_budget, only: budget_t, e_sleep
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_sleepers, only: motion_t, sleepers_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: update_sleep, count_awake

  !> Steps between checks for material that falls asleep.
  integer, parameter :: sleep_check_interval = 200
  !> Sleepers to be woken, over awake particles, below which waking is deferred.
  real(rp), parameter :: max_deferred_fraction = 0.05_rp

contains

  !> Collective, before a sort: decide which particles sleep until the next sort. `has_changed`:
  !> sleepers of this rank have changed. `can_wait`: nothing was changed, as no particle may fall
  !> asleep now and only a small part would wake.
  subroutine update_sleep(world, scene, clock, tools, particles, sleepers, budget, has_changed, &
                          can_wait)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(inout) :: particles
    type(sleepers_t), intent(inout) :: sleepers
    type(budget_t), intent(inout) :: budget
    logical, intent(out) :: has_changed, can_wait
    logical :: may_sleep
    logical, allocatable :: is_awake(:, :, :), near(:, :, :)
    integer, allocatable :: rest(:, :, :)
    type(box_t) :: box
    integer :: b, last

    has_changed = .false.
    can_wait = .false.
    if (.not. scene%method%sleep%is_on) return
    may_sleep = clock%step/sleep_check_interval > max(0_i8, clock%sorted_at)/sleep_check_interval
    box = cubes_in_use(world, scene, particles, sleepers)
    call find_awake(world, scene, clock, tools, particles, sleepers%motion, may_sleep, box, &
                    is_awake)
    call start_tracking(sleepers%motion, box)
    if (particles%n_awake >= 0 .and. .not. may_sleep) then
      can_wait = can_defer_waking(world, scene, particles, box, is_awake)
      if (can_wait) return
    end if
    near = is_awake
    call dilate(near, 1)                         ! particles up to two cells apart share nodes
    rest = merge(awake, merge(held, asleep, near), is_awake)
    last = particles%nblk
    if (all(box%lo == sleepers%cubes%lo) .and. all(box%hi == sleepers%cubes%hi)) then
      if (all(rest == sleepers%rest)) last = particles%n_awake  ! the sleepers do not change
    end if
    do b = 1, last
      call update_rest(scene, clock, particles, budget, box, rest, b, has_changed)
    end do
    call move_alloc(rest, sleepers%rest)
    sleepers%cubes = box
  end subroutine update_sleep

  !> Collective. Box of the cubes that contain particles of any rank.
  type(box_t) function cubes_in_use(world, scene, particles, sleepers) result(box)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(sleepers_t), intent(in) :: sleepers
    real(rp) :: extent(6)

    extent = particles%extent(1, merge(particles%n_awake, particles%nblk, particles%n_awake >= 0))
    extent = max(extent, sleepers%extent_any)
    call world%max(extent)
    box%lo = nearest_node(scene%grid, -extent(4:6))/edge
    box%hi = nearest_node(scene%grid, extent(1:3))/edge
  end function cubes_in_use

  !> True if the sleepers in the cubes marked in `is_awake` are a small part of the awake particles.
  logical function can_defer_waking(world, scene, particles, box, is_awake)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(box_t), intent(in) :: box
    logical, intent(in) :: is_awake(box%count())     !! state of each cube
    integer :: b, c(nlane), counts(2)

    counts = [sum(particles%count(:particles%n_awake)), 0]
    do b = particles%n_awake + 1, particles%nblk
      c = cubes(scene%grid, box, particles%ps(:, f_pos:f_pos + 2, b))
      counts(2) = counts(2) + count(is_awake(c(:particles%count(b))))
    end do
    call world%sum(counts)
    can_defer_waking = counts(2) <= max_deferred_fraction*counts(1)
  end function can_defer_waking

  !> Set the rest state of the particles of block `b`. Sleepers do not flow: with the strain rate of
  !> their last step their averaging fraction would depend on the moment of the sum (mpm_fbar).
  subroutine update_rest(scene, clock, particles, budget, box, rest, b, has_changed)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(budget_t), intent(inout) :: budget
    type(box_t), intent(in) :: box
    integer, intent(in) :: rest(box%count()), b      !! rest state of each cube; block
    logical, intent(inout) :: has_changed
    integer :: c(nlane), p, old_rest(nlane)

    c = cubes(scene%grid, box, particles%ps(:, f_pos:f_pos + 2, b))
    old_rest = rests(nlane, particles%tag(:, b))
    associate (ps => particles%ps(:, :, b), tag => particles%tag(:, b))
      do p = 1, particles%count(b)
        if (rest(c(p)) == old_rest(p)) cycle
        has_changed = .true.
        if (old_rest(p) == awake) then
          budget%sums(e_sleep) = budget%sums(e_sleep) &
            + 0.5_rp*clock%mass_scaling*ps(p, f_mass)*sum(ps(p, f_vel:f_vel + 2)**2)
          ps(p, [f_vel, f_vel + 1, f_vel + 2, f_rate]) = 0.0_rp
          ps(p, scene%layout%rest) = ps(p, f_temp)
        end if
        tag(p) = set_rest(tag(p), rest(c(p)))
      end do
    end associate
  end subroutine update_rest

  !> Find the cubes that are awake, including those that were awake before, unless they may fall
  !> asleep now. `motion` holds the sums of nodal motion since the last check.
  subroutine find_awake(world, scene, clock, tools, particles, motion, may_sleep, box, is_awake)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    type(motion_t), intent(in) :: motion
    logical, intent(in) :: may_sleep
    type(box_t), intent(in) :: box
    logical, allocatable, intent(out) :: is_awake(:, :, :)
    real(rp), allocatable :: sums(:, :, :, :), flat(:)
    integer :: n(3)

    n = box%hi - box%lo + 1
    allocate (sums(n_cube_sums, n(1), n(2), n(3)), source=0.0_rp)
    call add_particle_sums(scene, particles, box, sums)
    call add_node_sums(motion, box, sums)
    flat = reshape(sums, [size(sums)])
    call world%sum(flat)
    sums = reshape(flat, shape(sums))
    allocate (is_awake(n(1), n(2), n(3)))
    call find_active_cubes(scene, clock, motion%time, box, n, sums, is_awake)
    call add_neighbours(is_awake)
    call mark_cubes_at_tools(scene, tools, box, is_awake)
    if (.not. may_sleep) is_awake = is_awake .or. sums(c_mass, :, :, :) > 0.0_rp
  end subroutine find_awake

  !> Add this rank's sums of nodal motion for the cubes still in use.
  pure subroutine add_node_sums(motion, box, sums)
    type(motion_t), intent(in) :: motion
    type(box_t), intent(in) :: box
    real(rp), intent(inout) :: sums(n_cube_sums, box%lo(1):box%hi(1), box%lo(2):box%hi(2), &
                                    box%lo(3):box%hi(3))
    integer :: c, i, j, k

    if (.not. allocated(motion%sums)) return
    c = 0
    do k = motion%box%lo(3), motion%box%hi(3)
      do j = motion%box%lo(2), motion%box%hi(2)
        do i = motion%box%lo(1), motion%box%hi(1)
          c = c + 1
          if (box%has([i, j, k])) sums(n_particle_sums + 1:, i, j, k) = motion%sums(:, c)
        end do
      end do
    end do
  end subroutine add_node_sums

  !> Add this rank's sums over particles for each cube.
  subroutine add_particle_sums(scene, particles, box, sums)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(box_t), intent(in) :: box
    real(rp), intent(inout) :: sums(n_cube_sums, box%count())
    integer :: b, c(nlane), p
    logical :: wants_wake(nlane), is_awake(nlane)

    associate (limits => scene%method%sleep, rest => scene%layout%rest)
      do b = 1, particles%nblk
        associate (ps => particles%ps(:, :, b))
          is_awake = rests(nlane, particles%tag(:, b)) == awake
          wants_wake = .not. is_awake .and. abs(ps(:, f_temp) - ps(:, rest)) > limits%heat
          if (.not. any(wants_wake .or. is_awake)) cycle
          c = cubes(scene%grid, box, ps(:, f_pos:f_pos + 2))
          do p = 1, particles%count(b)
            associate (at => sums(:, c(p)))
              if (wants_wake(p)) at(c_wake_requests) = at(c_wake_requests) + 1.0_rp
              if (.not. is_awake(p)) cycle
              at(c_mass) = at(c_mass) + ps(p, f_mass)
              at(c_stress:c_stress + 5) = at(c_stress:c_stress + 5) &
                + ps(p, f_mass)*ps(p, f_tau:f_tau + 5)
            end associate
          end do
        end associate
      end do
    end associate
  end subroutine add_particle_sums

  !> Mark the cubes near a tool. Sleepers must not share nodes with particles in contact: a held
  !> node supports contact without moving, contact treats it as free, and the metal gains energy.
  !> Particles in contact are within half a cell of the tool and reach nodes 1.5 cells from its
  !> surface, as sleepers do from their centres.
  subroutine mark_cubes_at_tools(scene, tools, box, is_active)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(box_t), intent(in) :: box
    logical, intent(inout) :: is_active(:, :, :)
    real(rp) :: lower(3), reach, upper(3)
    integer :: c(3), first(3), i, j, k, last(3), t

    do t = 1, size(tools)
      call tools(t)%bounds(lower, upper)
      reach = reach_of(longest_cube(scene%grid))
      lower = cube_at(scene%grid, lower - reach) - box%lo
      upper = cube_at(scene%grid, upper + reach) - box%lo + 2.0_rp
      first = int(min(max(lower, 1.0_rp), real(shape(is_active), rp)))
      last = int(max(min(upper, real(shape(is_active), rp)), 1.0_rp))
      do k = first(3), last(3)
        do j = first(2), last(2)
          do i = first(1), last(1)
            c = box%lo + [i, j, k] - 1
            reach = reach_of(maxval(cube_size(scene%grid, c)))
            is_active(i, j, k) = is_active(i, j, k) .or. &
              tools(t)%clearance(cube_middle(scene%grid, c)) < reach
          end do
        end do
      end do
    end do
  contains
    !> Distance from a tool within which a cube centre is awake [m].
    pure real(rp) function reach_of(size)
      real(rp), intent(in) :: size                          !! longest edge of the cube [m]
      real(rp), parameter :: half_diagonal = sqrt(0.75_rp)  !! half diagonal of a cube [cube edges]
      real(rp), parameter :: apart = 3.5_rp  !! distance beyond which no nodes are shared [cells]

      reach_of = max(scene%method%sleep%distance, apart*size/edge) + half_diagonal*size
    end function reach_of
  end subroutine mark_cubes_at_tools

  !> Mark the cubes that share a face or an edge with a marked one.
  pure subroutine add_neighbours(marked)
    logical, intent(inout) :: marked(:, :, :)
    logical, allocatable :: before(:, :, :), row(:, :, :)
    integer :: a, next

    allocate (before, source=marked)
    do a = 1, 3
      row = before .or. eoshift(before, 1, .false., a) .or. eoshift(before, -1, .false., a)
      next = mod(a, 3) + 1
      marked = marked .or. row .or. eoshift(row, 1, .false., next) &
        .or. eoshift(row, -1, .false., next)
    end do
  end subroutine add_neighbours

  !> Indices of the cubes of `box` that contain the positions of a block.
  pure function cubes(grid, box, x) result(c)
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: box
    real(rp), intent(in) :: x(nlane, 3)
    integer :: c(nlane), ijk(nlane, 3), n(3)

    n = box%hi - box%lo + 1
    call nearest_nodes(grid, nlane, x, ijk)
    ijk = ijk/edge
    c = 1 + (ijk(:, 1) - box%lo(1)) + n(1)*(ijk(:, 2) - box%lo(2) + n(2)*(ijk(:, 3) - box%lo(3)))
  end function cubes

  !> Count the awake blocks and those of the held layer after a sort; they come in this order.
  subroutine count_awake(particles, sleepers)
    type(particles_t), intent(inout) :: particles
    type(sleepers_t), intent(inout) :: sleepers
    integer :: b

    sleepers%layer%is_stale = .true.
    particles%n_awake = 0
    particles%n_mapped = 0
    do b = 1, particles%nblk
      if (tag_rest(particles%tag(1, b)) == awake) particles%n_awake = b
      if (tag_rest(particles%tag(1, b)) /= asleep) particles%n_mapped = b
    end do
  end subroutine count_awake

end module sleep_criteria
