! SPDX-License-Identifier: MIT
!> Sleeping: material that is still stops its mechanics but keeps conducting. The grid is divided
!> into cubes of a few cells. A cube is awake near a tool; where its particles together move, or one
!> of them flows, or sleepers have changed their temperature; and next to such a cube, by a face or an
!> edge. What particles have of their own, not shared with their neighbours, is noise that no node feels
!> and wakes nobody.
!> Sleepers that share nodes with awake particles are the rim (time_rim).
module time_sleep
  use base_kinds, only: i8, nlane, rp
  use comm_world, only: world_t
  use grid_geometry, only: box_t, dilate, grid_t, nearest_node, nearest_nodes
  use particles_store, only: asleep, awake, f_mass, f_pos, f_rate, f_temp, f_vel, rests, rim, set_rest, &
                             tag_rest
  use time_stability, only: wave_speed
  use time_state, only: mirrors_t, simulation_t
  implicit none (type, external)
  private

  public :: update_sleep, count_awake, swap_lists

  ! What the particles of a cube say.
  integer, parameter :: a_calls = 1, &    !! how many call
                        a_mass = 2, &     !! of the awake ones [kg]
                        a_momentum = 3    !! of these [kg m/s], 3
  integer, parameter :: n_asked = 5

  integer, parameter :: edge = 2          !! of a cube [cells]
  integer, parameter :: patience = 200    !! steps from one falling asleep to the next
  real(rp), parameter :: few = 0.05_rp    !! sleepers that call, over the awake, for whom it is not worth a sort

contains

  !> Collective, before a sort: who sleeps until the next one. `has_changed`: on this rank other
  !> particles than before. `can_wait`: nobody yet, since nobody may fall asleep now and only a few would wake.
  subroutine update_sleep(world, sim, has_changed, can_wait)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical, intent(out) :: has_changed, can_wait
    logical :: may_sleep
    logical, allocatable :: is_awake(:, :, :), near(:, :, :)
    integer, allocatable :: rest(:, :, :)
    type(box_t) :: box
    integer :: b, last

    has_changed = .false.
    can_wait = .false.
    if (.not. sim%scene%method%sleep%is_on) return
    may_sleep = sim%clock%step/patience > max(0_i8, sim%clock%sorted_at)/patience
    box = cubes_in_use(world, sim)
    call find_awake(world, sim, may_sleep, box, is_awake)
    if (sim%n_awake >= 0 .and. .not. may_sleep) then
      can_wait = few_wake(world, sim, box, is_awake)
      if (can_wait) return
    end if
    near = is_awake
    call dilate(near, 1)                         ! nodes of particles two cells apart are shared
    rest = merge(awake, merge(rim, asleep, near), is_awake)
    last = sim%particles%nblk
    if (all(box%lo == sim%sleepers%cubes%lo) .and. all(box%hi == sim%sleepers%cubes%hi)) then
      if (all(rest == sim%sleepers%rest)) last = sim%n_awake   ! sleepers do not move
    end if
    do b = 1, last
      call put_to_rest(sim, box, rest, b, has_changed)
    end do
    call move_alloc(rest, sim%sleepers%rest)
    sim%sleepers%cubes = box
  end subroutine update_sleep

  !> Collective: box of the cubes that any particle of any rank is in.
  type(box_t) function cubes_in_use(world, sim) result(box)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    real(rp) :: extent(6)

    extent = sim%particles%extent(1, merge(sim%n_awake, sim%particles%nblk, sim%n_awake >= 0))
    extent = max(extent, sim%sleepers%extent_any)
    call world%max(extent)
    box%lo = nearest_node(sim%scene%grid, -extent(4:6))/edge
    box%hi = nearest_node(sim%scene%grid, extent(1:3))/edge
  end function cubes_in_use

  !> Whether those that sleep in the cubes marked in `is_awake` are few against those that are awake.
  logical function few_wake(world, sim, box, is_awake)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    type(box_t), intent(in) :: box
    logical, intent(in) :: is_awake(box%count())     !! by cube
    integer :: b, c(nlane), counts(2)

    counts = [sum(sim%particles%count(:sim%n_awake)), 0]
    do b = sim%n_awake + 1, sim%particles%nblk
      c = cubes(sim%scene%grid, box, sim%particles%ps(:, f_pos:f_pos + 2, b))
      counts(2) = counts(2) + count(is_awake(c(:sim%particles%count(b))))
    end do
    call world%sum(counts)
    few_wake = counts(2) <= few*counts(1)
  end function few_wake

  !> Who sleeps in block `b`.
  subroutine put_to_rest(sim, box, rest, b, has_changed)
    type(simulation_t), intent(inout) :: sim
    type(box_t), intent(in) :: box
    integer, intent(in) :: rest(box%count()), b      !! rest by cube
    logical, intent(inout) :: has_changed
    integer :: c(nlane), p, was(nlane)

    c = cubes(sim%scene%grid, box, sim%particles%ps(:, f_pos:f_pos + 2, b))
    was = rests(nlane, sim%particles%tag(:, b))
    associate (ps => sim%particles%ps(:, :, b), tag => sim%particles%tag(:, b))
      do p = 1, sim%particles%count(b)
        if (rest(c(p)) == was(p)) cycle
        has_changed = .true.
        if (was(p) == awake) then
          ps(p, f_vel:f_vel + 2) = 0.0_rp
          ps(p, sim%scene%layout%rest) = ps(p, f_temp)
        end if
        tag(p) = set_rest(tag(p), rest(c(p)))
      end do
    end associate
  end subroutine put_to_rest

  !> The cubes that are awake: also those that were, unless they may fall asleep now.
  subroutine find_awake(world, sim, may_sleep, box, is_awake)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    logical, intent(in) :: may_sleep
    type(box_t), intent(in) :: box
    logical, allocatable, intent(out) :: is_awake(:, :, :)
    real(rp), allocatable :: asked(:, :, :, :), flat(:)
    integer :: n(3)

    n = box%hi - box%lo + 1
    allocate (asked(n_asked, n(1), n(2), n(3)), source=0.0_rp)
    call ask_particles(sim, box, asked)
    flat = reshape(asked, [size(asked)])
    call world%sum(flat)
    asked = reshape(flat, shape(asked))
    associate (fastest => sim%scene%method%sleep%strain*wave_speed(sim))
      is_awake = asked(a_calls, :, :, :) > 0.0_rp &
                 .or. norm2(asked(a_momentum:, :, :, :), 1) > fastest*asked(a_mass, :, :, :)
    end associate
    call add_neighbours(is_awake)
    call ask_tools(sim, box, is_awake)
    if (.not. may_sleep) is_awake = is_awake .or. asked(a_mass, :, :, :) > 0.0_rp
  end subroutine find_awake

  !> What this rank's particles say in each cube.
  subroutine ask_particles(sim, box, asked)
    type(simulation_t), intent(in) :: sim
    type(box_t), intent(in) :: box
    real(rp), intent(inout) :: asked(n_asked, box%count())
    integer :: b, c(nlane), p
    logical :: calls(nlane), is_awake(nlane)

    associate (limits => sim%scene%method%sleep, rest => sim%scene%layout%rest)
      do b = 1, sim%particles%nblk
        associate (ps => sim%particles%ps(:, :, b))
          is_awake = rests(nlane, sim%particles%tag(:, b)) == awake
          where (is_awake)
            calls = ps(:, f_rate) > limits%rate
          elsewhere
            calls = abs(ps(:, f_temp) - ps(:, rest)) > limits%heat
          end where
          if (.not. any(calls .or. is_awake)) cycle
          c = cubes(sim%scene%grid, box, ps(:, f_pos:f_pos + 2))
          do p = 1, sim%particles%count(b)
            associate (at => asked(:, c(p)))
              if (calls(p)) at(a_calls) = at(a_calls) + 1.0_rp
              if (.not. is_awake(p)) cycle
              at(a_mass) = at(a_mass) + ps(p, f_mass)
              at(a_momentum:) = at(a_momentum:) + ps(p, f_mass)*ps(p, f_vel:f_vel + 2)
            end associate
          end do
        end associate
      end do
    end associate
  end subroutine ask_particles

  !> Marks the cubes that a tool is near.
  subroutine ask_tools(sim, box, is_active)
    type(simulation_t), intent(in) :: sim
    type(box_t), intent(in) :: box
    logical, intent(inout) :: is_active(:, :, :)
    real(rp) :: lower(3), reach, size_of, upper(3), x(3)
    integer :: first(3), i, j, k, last(3), t

    size_of = edge*sim%scene%grid%h
    reach = sim%scene%method%sleep%distance + sqrt(0.75_rp)*size_of
    do t = 1, size(sim%tool)
      call sim%tool(t)%bounds(lower, upper)
      lower = (lower - reach - sim%scene%grid%lower)/size_of - box%lo
      upper = (upper + reach - sim%scene%grid%lower)/size_of - box%lo + 2.0_rp
      first = int(min(max(lower, 1.0_rp), real(shape(is_active), rp)))
      last = int(max(min(upper, real(shape(is_active), rp)), 1.0_rp))
      do k = first(3), last(3)
        do j = first(2), last(2)
          do i = first(1), last(1)
            x = sim%scene%grid%lower + sim%scene%grid%h*(edge*(box%lo + [i, j, k] - 0.5_rp) - 0.5_rp)
            if (sim%tool(t)%clearance(x) < reach) is_active(i, j, k) = .true.
          end do
        end do
      end do
    end do
  end subroutine ask_tools

  !> Mark the cubes that share a face or an edge with a marked one.
  pure subroutine add_neighbours(marked)
    logical, intent(inout) :: marked(:, :, :)
    logical, allocatable :: before(:, :, :), row(:, :, :)
    integer :: a, next

    before = marked
    do a = 1, 3
      row = before .or. eoshift(before, 1, .false., a) .or. eoshift(before, -1, .false., a)
      next = mod(a, 3) + 1
      marked = marked .or. row .or. eoshift(row, 1, .false., next) .or. eoshift(row, -1, .false., next)
    end do
  end subroutine add_neighbours

  !> Numbers of the cubes of `box` that the places of a block are in.
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

  !> After a sort: the awake blocks come first, then those of the rim.
  subroutine count_awake(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b

    sim%rim%is_stale = .true.
    sim%n_awake = 0
    sim%n_mapped = 0
    do b = 1, sim%particles%nblk
      if (tag_rest(sim%particles%tag(1, b)) == awake) sim%n_awake = b
      if (tag_rest(sim%particles%tag(1, b)) /= asleep) sim%n_mapped = b
    end do
  end subroutine count_awake

  !> Conduction works on the nodes of all particles, steps on those of awake particles and the rim;
  !> the other nodes must be 0 then.
  subroutine swap_lists(sim)
    type(simulation_t), intent(inout) :: sim
    type(mirrors_t) :: mirrors
    integer, allocatable :: list(:, :)
    integer :: n

    if (.not. sim%scene%method%sleep%is_on) return
    mirrors = sim%mirrors
    sim%mirrors = sim%resting_mirrors
    sim%resting_mirrors = mirrors
    n = sim%n_runs
    sim%n_runs = sim%n_resting
    sim%n_resting = n
    call move_alloc(sim%run, list)
    call move_alloc(sim%resting, sim%run)
    call move_alloc(list, sim%resting)
  end subroutine swap_lists

end module time_sleep
