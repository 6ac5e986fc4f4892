! SPDX-License-Identifier: MIT
!> Restart from a checkpoint, with checks that a run of this scene can have written the boxes of the
!> ranks and the particles.
module run_restart
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use base_world, only: world_t
  use grid_geometry, only: box_t, grid_t, halo, nearest_node
  use io_checkpoint, only: read_checkpoint
  use io_plausible, only: is_between, max_magnitude, min_positive, numbers_t, speed_of_light
  use output_checkpoint, only: pass_numbers, pass_sums
  use particles_migrate, only: find_outside
  use particles_store, only: asleep, awake, f_bbar, f_flow, f_jac, f_mass, f_plastic, f_pos, &
                             f_rate, f_temp, f_vel, max_volume_ratio, particles_t, set_rest, &
                             tag_id, tag_rest, tracer_bit
  use run_balance, only: find_reach, make_first_partition, store_nodes
  use run_debris, only: remove_debris
  use run_regrid, only: sort_particles, update_lists
  use sleep_cubes, only: start_tracking
  use state_clock, only: outcome_t
  use state_nodes, only: place_light
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use state_sleepers, only: motion_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: resume


contains

  !> Fill a simulation, whose scene is set up, with the state of a checkpoint.
  subroutine resume(sim, path, error)
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    type(box_t), allocatable :: boxes(:)
    character(:), allocatable :: message, wrong
    type(numbers_t) :: of_run, of_rank
    type(box_t) :: cubes
    real(rp) :: last(3), time
    logical :: same_ranks
    integer :: plain

    call read_checkpoint(sim%world, path, sim%particles, boxes, of_run, of_rank, same_ranks, &
                         error)
    if (error%is_set()) return
    associate (layout => sim%scene%layout)   ! the field of sleeping may change
      plain = layout%n - merge(1, 0, layout%rest > 0)
      if (all(sim%particles%nf /= [plain, plain + 1])) call error%raise(path// &
        ': /particles/state: '//str(sim%particles%nf)//' fields, not '//str(plain))
    end associate
    call pass_numbers(sim, last, of_run)
    call of_run%finish()
    if (of_run%error%is_set()) call error%raise(path//': '//of_run%error%message)
    if (error%is_set()) return
    sim%clock%now%last = outcome_t(last(1), last(2))
    sim%particles%warming = last(3)
    call sim%particles%change_fields(sim%scene%layout%n)
    associate (motion => sim%sleepers%motion)
      cubes = motion%box
      time = motion%time
      if (cubes%count() > 0) call start_tracking(motion, cubes)
      motion%time = time
      call pass_sums(sim%world, sim%tool, sim%sleepers, sim%budget, of_rank)
      call of_rank%finish()
      if (.not. sim%scene%method%sleep%is_on .or. cubes%count() == 0) motion = motion_t()
    end associate
    if (of_rank%error%is_set()) then
      wrong = of_rank%error%message
    else if (.not. same_ranks) then
      wrong = check_particles(sim%scene, sim%particles, box_t([0, 0, 0], sim%scene%grid%n - 1))
    else if (check_boxes(sim%scene%grid, boxes)) then
      wrong = check_particles(sim%scene, sim%particles, boxes(sim%world%rank))
    else
      wrong = '/ranks/boxes: they are no partition of the grid'
    end if
    call sim%world%share_message(wrong, message)
    if (message /= '') call error%raise(path//': '//message)
    if (error%is_set()) return
    call check_outside(sim, path, same_ranks, error)
    if (error%is_set()) return
    call resume_drives(sim%world, sim%tool)
    call sim%tool%move_to(sim%clock%time)
    if (.not. sim%scene%method%sleep%is_on) call wake_all(sim%world, sim%particles, same_ranks)
    if (same_ranks) then
      call move_alloc(boxes, sim%exchange%boxes)
      call find_reach(sim%world, sim%scene, sim%particles, sim%nodes)
      call store_nodes(sim%world, sim%scene, sim%nodes, sim%exchange)
      call update_lists(sim, .false., .false.)
    else
      call make_first_partition(sim)
      call sort_particles(sim, .true.)
    end if
    call place_light(sim%world%rank, same_ranks, sim%nodes)
  end subroutine resume

  !> Collective. Add the averages of the ranks of the reaction on the free tools. A rigid machine
  !> that does not press bears it; the tool may have become free at this restart.
  subroutine resume_drives(world, tools)
    type(world_t), intent(in) :: world
    type(tool_t), intent(inout) :: tools(:)
    real(rp) :: reaction(size(tools))
    integer :: k

    reaction = tools%drive%reaction_ema
    call world%sum(reaction)
    do k = 1, size(tools)
      associate (drive => tools(k)%drive)
        if (.not. drive%is_free) cycle
        drive%reaction_ema = reaction(k)
        if (drive%is_force_controlled .or. drive%stiffness > 0.0_rp) cycle
        drive%force = reaction(k)
      end associate
    end do
  end subroutine resume_drives

  !> Collective. Raise an error if particles are outside the grid, unless they are debris: debris is
  !> removed at the next sort, or here if the number of ranks has changed.
  subroutine check_outside(sim, path, same_ranks, error)
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    logical, intent(in) :: same_ranks
    type(error_t), intent(inout) :: error
    character(:), allocatable :: outside, reason

    call sim%world%share_message(find_outside(sim%scene%grid, sim%particles%nblk, sim%particles), &
                                 outside)
    if (outside == '' .or. (same_ranks .and. sim%scene%method%debris > 0.0_rp)) return
    if (remove_debris(sim, reason)) return
    call error%raise(path//': '//outside//'; '//reason)
  end subroutine check_outside

  !> Collective, in a run without sleeping. Wake all particles; they are no longer `in_order` if
  !> some slept.
  subroutine wake_all(world, particles, in_order)
    type(world_t), intent(in) :: world
    type(particles_t), intent(inout) :: particles
    logical, intent(inout) :: in_order
    logical :: were_awake

    associate (tag => particles%tag(:, :particles%nblk))
      were_awake = world%all_true(all(tag_rest(tag) == awake))
      in_order = in_order .and. were_awake
      tag = set_rest(tag, awake)
    end associate
  end subroutine wake_all

  !> Whether the boxes of the ranks divide the grid.
  pure logical function check_boxes(grid, boxes) result(is_good)
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: boxes(:)
    type(box_t) :: both
    integer(i8) :: nodes
    integer :: i, k

    is_good = .true.
    nodes = 0
    do k = 1, size(boxes)
      if (boxes(k)%is_empty()) cycle
      is_good = is_good .and. all(boxes(k)%lo >= 0 .and. boxes(k)%hi < grid%n)
      if (.not. is_good) return
      nodes = nodes + product(int(boxes(k)%hi - boxes(k)%lo + 1, i8))
      do i = 1, k - 1
        both = boxes(i)%meet(boxes(k))
        is_good = is_good .and. both%is_empty()
      end do
    end do
    is_good = is_good .and. nodes == product(int(grid%n, i8))
  end function check_boxes

  !> Error message for the particles of this rank; '' if they are valid. Their nearest nodes must be
  !> in `box` or next to it, and unused lanes must be neutral (particles_sort).
  function check_particles(scene, particles, box) result(text)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(box_t), intent(in) :: box
    character(:), allocatable :: text
    real(rp) :: low(particles%nf), high(particles%nf)
    integer(i8), parameter :: tags = ishft(1_i8, tracer_bit + 1)
    type(box_t) :: reach
    integer :: b, f, p
    logical :: fits(nlane)

    call ranges(scene, low, high)
    reach = box%grown(1)
    text = ''
    do b = 1, particles%nblk
      associate (ps => particles%ps(:, :, b), tag => particles%tag(:, b), n => particles%count(b), &
                 body => particles%body(b))
        if (n < 0 .or. n > nlane) then
          text = '/particles/count: a block of '//str(n)//' particles'
        else if (body < 1 .or. body > size(scene%body)) then
          text = '/particles/body: body '//str(body)//' of '//str(size(scene%body))
        else if (any(tag(:n) < 0 .or. tag(:n) >= tags) .or. any(tag_rest(tag(:n)) > asleep)) then
          text = '/particles/tag: a tag that no particle can have'
        end if
        if (text /= '') return
        do f = 1, size(low)
          fits = is_between(ps(:, f), low(f), high(f))
          if (f == f_mass) fits(n + 1:) = is_between(ps(n + 1:, f), 0.0_rp, 0.0_rp)
          if (all(fits)) cycle
          p = findloc(fits, .false., 1)
          text = '/particles/state: particle '//str(tag_id(tag(p)))//' has a '// &
            scene%layout%name_of(f)//' of '//str(ps(p, f))//', not from '//str(low(f))//' to '// &
            str(high(f))
          if (p > n) text = '/particles/state: there is a particle behind the '//str(n)// &
                            ' of its block'
          return
        end do
        do p = 1, n
          if (reach%has(nearest_node(scene%grid, ps(p, f_pos:f_pos + 2)))) cycle
          text = '/particles/state: particle '//str(tag_id(tag(p)))//' is outside the box of '// &
                 'nodes of its rank'
          return
        end do
      end associate
    end do
  end function check_particles

  !> Ranges of the fields of particles. Particles that leave the grid are removed before they are
  !> outside the patch of a rank.
  pure subroutine ranges(scene, low, high)
    type(scene_t), intent(in) :: scene
    real(rp), intent(out) :: low(:), high(:)

    low = -max_magnitude
    high = max_magnitude
    associate (grid => scene%grid)
      low(f_pos:f_pos + 2) = grid%lower - halo*grid%h
      high(f_pos:f_pos + 2) = grid%upper() + halo*grid%h
    end associate
    low([f_mass, f_temp]) = min_positive
    low([f_plastic, f_rate, f_flow]) = 0.0_rp
    low(f_jac) = 1.0_rp/max_volume_ratio
    high(f_jac) = max_volume_ratio
    low(f_vel:f_vel + 2) = -speed_of_light
    high(f_vel:f_vel + 2) = speed_of_light
    low(f_bbar:f_bbar + 5) = -max_volume_ratio
    low(f_bbar:f_bbar + 2) = 1.0_rp/max_volume_ratio
    high(f_bbar:f_bbar + 5) = max_volume_ratio
  end subroutine ranges

end module run_restart
