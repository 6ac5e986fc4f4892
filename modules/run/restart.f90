! SPDX-License-Identifier: MIT
!> Restart from a checkpoint.
module run_restart
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_text, only: str
  use comm_world, only: world_t
  use contact_motion, only: n_drive
  use contact_tool, only: n_tool_sums
  use grid_geometry, only: box_t
  use io_checkpoint, only: read_checkpoint
  use io_plausible, only: numbers_t
  use output_checkpoint, only: n_clock
  use particles_migrate, only: find_outside
  use particles_store, only: awake, particles_t, set_rest, tag_rest
  use run_balance, only: find_reach, first_partition, store_nodes
  use run_debris, only: remove_debris
  use run_regrid, only: relist, sort_particles
  use run_restart_check, only: check_boxes, check_global, check_local, check_particles
  use simulation_parts, only: simulation_t
  use sleep_motion, only: start_tracking
  use sleep_sleepers, only: n_motion
  use state_budget, only: n_sums
  implicit none (type, external)
  private

  public :: resume

contains

  !> Fill a simulation, whose scene is set up, with the state of a checkpoint.
  subroutine resume(world, sim, path, error)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    type(box_t), allocatable :: boxes(:)
    type(box_t) :: cubes
    real(rp), allocatable :: global(:), local(:)
    character(:), allocatable :: message, wrong
    type(numbers_t) :: of_run, of_rank
    logical :: same_ranks
    integer :: k, n, n_before, plain

    call read_checkpoint(world, path, sim%particles, boxes, of_run%value, of_rank%value, &
                         same_ranks, error)
    if (error%is_set()) return
    associate (layout => sim%scene%layout)   ! sleeping may change, and with it the last field
      plain = layout%n - merge(1, 0, layout%rest > 0)
      if (all(sim%particles%nf /= [plain, plain + 1])) call error%raise(path// &
        ': /particles/state: '//str(sim%particles%nf)//' fields, not '//str(plain))
    end associate
    of_run%place = '/global'
    call check_global(sim, of_run)
    if (of_run%error%is_set()) call error%raise(path//': '//of_run%error%message)
    if (error%is_set()) return
    call move_alloc(of_run%value, global)
    cubes = box_t(nint(global(22:24)), nint(global(25:27)))
    call sim%particles%change_fields(sim%scene%layout%n)
    of_rank%place = '/ranks/local'
    call check_local(sim, cubes%count(), of_rank)
    if (of_rank%error%is_set()) then
      wrong = of_rank%error%message
    else if (.not. same_ranks) then
      wrong = check_particles(sim, box_t([0, 0, 0], sim%scene%grid%n - 1))
    else if (check_boxes(sim%scene%grid, boxes)) then
      wrong = check_particles(sim, boxes(world%rank))
    else
      wrong = '/ranks/boxes: they do not divide the grid'
    end if
    call world%share_message(wrong, message)
    if (message /= '') call error%raise(path//': '//message)
    if (error%is_set()) return
    call move_alloc(of_rank%value, local)
    call unpack_global(sim, global)
    n_before = n_sums + 1 + size(sim%budget%warnings)
    n = n_before + size(sim%budget%impulse)
    sim%budget%sums = local(1:n_sums)
    sim%budget%failed_returns = nint(local(n_sums + 1))
    sim%budget%warnings = local(n_sums + 2:n_before)
    sim%budget%impulse = reshape(local(n_before + 1:n), shape(sim%budget%impulse))
    call check_outside(world, sim, path, same_ranks, error)
    if (error%is_set()) return
    do k = 1, size(sim%tool)
      sim%tool(k)%sums = local(n + 1 + n_tool_sums*(k - 1):n + n_tool_sums*k)
      call sim%tool(k)%move_to(sim%clock%time)
    end do
    if (sim%scene%method%sleep%is_on .and. cubes%count() > 0) then
      call start_tracking(sim%sleepers%motion, cubes)
      sim%sleepers%motion%time = global(28)
      sim%sleepers%motion%sums = reshape(local(n + n_tool_sums*size(sim%tool) + 1:), &
                                         [n_motion, cubes%count()])
    end if
    if (.not. sim%scene%method%sleep%is_on) call wake_all(world, sim%particles, same_ranks)
    if (same_ranks) then
      call move_alloc(boxes, sim%exchange%boxes)
      call find_reach(world, sim)
      call store_nodes(world, sim)
      call relist(world, sim, .false., .false.)
    else
      call first_partition(world, sim)
      call sort_particles(world, sim, .true.)
    end if
  end subroutine resume

  !> Collective. Raise an error if particles are outside the grid, unless they are debris: debris is
  !> removed at the next sort, or here if the number of ranks has changed.
  subroutine check_outside(world, sim, path, same_ranks, error)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    logical, intent(in) :: same_ranks
    type(error_t), intent(inout) :: error
    character(:), allocatable :: outside, reason

    call world%share_message(find_outside(sim%scene%grid, sim%particles%nblk, sim%particles), &
                             outside)
    if (outside == '' .or. (same_ranks .and. sim%scene%method%debris > 0.0_rp)) return
    if (remove_debris(world, sim, reason)) return
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

  !> The numbers of the run, after `check_global`.
  subroutine unpack_global(sim, global)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: global(:)
    integer :: frames, k, last, n, n_heat, sums

    associate (c => sim%clock)
      c%step = nint(global(1), i8)
      c%time = global(2)
      c%dt = global(3)
      c%displacement = global(4)
      c%sorted_at = nint(global(5), i8)
      c%heat_time = global(6)
      c%max_speed = global(7)
      c%stiffness = global(8)
    end associate
    sim%history%kinetic0 = global(9)
    sim%history%elastic0 = global(10)
    sim%history%audit_scale = global(11)
    sim%history%row_time = global(12)
    sim%step%last%stiffness = global(15)
    sim%step%last%speed2 = global(16)
    sim%clock%refused = nint(global(17), i8)
    associate (m => sim%scene%method)
      if (m%adapts_mass) sim%clock%mass_scaling = max(m%scaling_range(1), &
                                                      min(m%scaling_range(2), global(18)))
    end associate
    sim%clock%inertial_peak = global(19)
    sim%clock%heat_step = global(20)
    sim%history%rows = nint(global(21), i8)
    n = nint(global(13))
    frames = nint(global(14))
    last = n_clock + 4*n + frames + size(sim%history%row_impulse)
    sums = last + size(sim%history%row_sums)
    sim%probes%x = reshape(global(n_clock + 1:n_clock + 3*n), [3, n])
    sim%probes%temperature = global(n_clock + 3*n + 1:n_clock + 4*n)
    sim%history%frame_times = global(n_clock + 4*n + 1:n_clock + 4*n + frames)
    sim%history%row_impulse = reshape(global(n_clock + 4*n + frames + 1:last), &
                                      shape(sim%history%row_impulse))
    sim%history%row_sums = reshape(global(last + 1:sums), shape(sim%history%row_sums))
    do k = 1, size(sim%tool)
      if (sim%tool(k)%drive%is_free) then
        call sim%tool(k)%drive%set_state(global(sums + 1:sums + n_drive), sim%clock%time)
        sums = sums + n_drive
      end if
      if (sim%tool(k)%monitor%is_on) then
        n = sim%tool(k)%monitor%size_of_state(sim%tool(k)%n_phases)
        call sim%tool(k)%monitor%set_state(global(sums + 1:sums + n), sim%tool(k)%motion)
        sums = sums + n
      end if
      n_heat = size(sim%tool(k)%heat%state())
      call sim%tool(k)%heat%set_state(global(sums + 1:sums + n_heat))
      sums = sums + n_heat
    end do
    do k = 1, size(sim%backing)
      n_heat = size(sim%backing(k)%state())
      call sim%backing(k)%set_state(global(sums + 1:sums + n_heat))
      sums = sums + n_heat
    end do
    if (sim%tracers%n == 0) return
    associate (t => sim%tracers)
      t%rows = nint(global(sums + 1), i8)
      t%row_time = global(sums + 2:sums + 1 + size(t%row_time))
      call t%set_ids(nint(global(size(global) - t%n + 1:), i8))
    end associate
  end subroutine unpack_global

end module run_restart
