! SPDX-License-Identifier: MIT
!> Checkpoints of a simulation, and going on from one.
module time_resume
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use comm_world, only: world_t
  use contact_tool, only: n_tool_sums
  use grid_geometry, only: box_t, make_patch
  use io_checkpoint, only: notes_t, read_checkpoint, write_checkpoint
  use particles_migrate, only: find_outside
  use particles_store, only: awake, particles_t, set_rest, tag_rest
  use physics_flow_law, only: n_alarms
  use time_audit, only: n_sums
  use time_probes, only: share_probes
  use time_balance, only: first_partition
  use time_regrid, only: regrid, relist
  use time_scene, only: output_t
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: save_checkpoint, resume, checkpoint_path, broken_path, note_run

  integer, parameter :: n_clock = 21
  character(*), parameter :: other_scene = &
    ': the checkpoint belongs to another scene (tools, walls, clamps or probes differ)'

contains

  !> Where a run keeps its latest checkpoint.
  pure function checkpoint_path(sim) result(path)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: path

    path = sim%scene%output%directory//'/'//sim%scene%output%name//'_checkpoint.h5'
  end function checkpoint_path

  !> Where a state goes from which no run can go on.
  pure function broken_path(sim) result(path)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: path

    path = sim%scene%output%directory//'/'//sim%scene%output%name//'_broken.h5'
  end function broken_path

  !> What a checkpoint of this time [s] knows of its run.
  pure subroutine note_run(output, time, notes)
    type(output_t), intent(in) :: output
    real(rp), intent(in) :: time
    type(notes_t), intent(out) :: notes

    notes%input = output%input_text
    notes%scene = output%scene_text
    notes%run = output%run
    notes%time = time
  end subroutine note_run

  !> Write the state between two steps, to `path` or the usual place. It changes nothing in the run.
  subroutine save_checkpoint(world, sim, error, path)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    type(error_t), intent(inout) :: error
    character(*), intent(in), optional :: path
    type(notes_t) :: notes
    character(:), allocatable :: file
    real(rp), allocatable :: global(:), local(:)
    real(rp) :: last(2)
    integer :: k

    call share_probes(world, sim%probes)
    last = [sim%last%stiffness, sim%last%speed2]
    call world%max(last)
    associate (c => sim%clock)
      global = [real(c%step, rp), c%time, c%dt, c%travel, real(c%sorted_at, rp), c%heat_time, &
                c%max_speed, c%stiffness, sim%kinetic0, sim%elastic0, sim%audit_scale, &
                sim%row_time, real(sim%probes%n, rp), real(size(sim%frame_times), rp), &
                last, real(c%refused, rp), sim%scene%method%mass_scaling, c%inertial_peak, &
                c%heat_step, real(sim%rows, rp)]
    end associate
    if (sim%probes%n > 0) global = [global, reshape(sim%probes%x, [3*sim%probes%n]), &
                                    sim%probes%temperature]
    global = [global, sim%frame_times]
    global = [global, reshape(sim%row_impulse, [size(sim%row_impulse)])]
    if (allocated(sim%row_sums)) global = [global, reshape(sim%row_sums, [size(sim%row_sums)])]
    local = [sim%sums, real(sim%failed_returns, rp), sim%alarms, &
             reshape(sim%impulse, [size(sim%impulse)])]
    do k = 1, size(sim%tool)
      local = [local, sim%tool(k)%sums]
    end do
    call note_run(sim%scene%output, sim%clock%time, notes)
    file = checkpoint_path(sim)
    if (present(path)) file = path
    call write_checkpoint(world, file, sim%particles, sim%boxes, global, local, &
                          notes, error)
  end subroutine save_checkpoint

  !> Fill a simulation, whose scene stands, with the state of a checkpoint.
  subroutine resume(world, sim, path, error)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    type(box_t), allocatable :: boxes(:)
    real(rp), allocatable :: global(:), local(:)
    character(:), allocatable :: outside
    logical :: fits, same_ranks
    integer :: k, n, plain

    call read_checkpoint(world, path, sim%particles, boxes, global, local, same_ranks, error)
    if (error%is_set()) return
    n = n_sums + 1 + n_alarms + size(sim%impulse)
    associate (layout => sim%scene%layout)   ! sleeping may change, and with it the last field
      plain = layout%n - merge(1, 0, layout%rest > 0)
      fits = sim%particles%nf == plain .or. sim%particles%nf == plain + 1
      if (fits) call sim%particles%change_fields(layout%n)
    end associate
    if (.not. fits .or. size(global) < n_clock .or. size(local) /= n + n_tool_sums*size(sim%tool)) then
      call error%raise(path//other_scene)
      return
    end if
    call unpack_global(sim, global, path, error)
    call world%share_message(find_outside(sim%scene%grid, sim%particles%nblk, &
                                          sim%particles), outside)
    if (outside /= '') call error%raise(path//': '//outside)
    if (error%is_set()) return
    sim%sums = local(1:n_sums)
    sim%failed_returns = nint(local(n_sums + 1))
    sim%alarms = local(n_sums + 2:n_sums + 1 + n_alarms)
    sim%impulse = reshape(local(n_sums + 2 + n_alarms:n), shape(sim%impulse))
    do k = 1, size(sim%tool)
      sim%tool(k)%sums = local(n + 1 + n_tool_sums*(k - 1):n + n_tool_sums*k)
      call sim%tool(k)%move_to(sim%clock%time)
    end do
    if (.not. sim%scene%method%sleep%is_on) call wake_all(world, sim%particles, same_ranks)
    if (same_ranks) then
      call move_alloc(boxes, sim%boxes)
      sim%patch = make_patch(sim%scene%grid, sim%boxes(world%rank))
      call sim%allocate_grid()
      call relist(world, sim, .false., .false.)
    else
      call first_partition(world, sim)
      call regrid(world, sim)
    end if
  end subroutine resume

  !> Collective, in a run without sleepers. The particles are `in_order` no longer if some slept.
  subroutine wake_all(world, particles, in_order)
    type(world_t), intent(in) :: world
    type(particles_t), intent(inout) :: particles
    logical, intent(inout) :: in_order

    associate (tag => particles%tag(:, :particles%nblk))
      in_order = in_order .and. world%all_true(all(tag_rest(tag) == awake))
      tag = set_rest(tag, awake)
    end associate
  end subroutine wake_all

  subroutine unpack_global(sim, global, path, error)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: global(:)
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    integer :: frames, last, n, rest

    associate (c => sim%clock)
      c%step = nint(global(1), i8)
      c%time = global(2)
      c%dt = global(3)
      c%travel = global(4)
      c%sorted_at = nint(global(5), i8)
      c%heat_time = global(6)
      c%max_speed = global(7)
      c%stiffness = global(8)
    end associate
    sim%kinetic0 = global(9)
    sim%elastic0 = global(10)
    sim%audit_scale = global(11)
    sim%row_time = global(12)
    sim%last%stiffness = global(15)
    sim%last%speed2 = global(16)
    sim%clock%refused = nint(global(17), i8)
    associate (m => sim%scene%method)
      if (m%adapts_mass) m%mass_scaling = max(m%scaling_range(1), min(m%scaling_range(2), global(18)))
    end associate
    sim%clock%inertial_peak = global(19)
    sim%clock%heat_step = global(20)
    sim%rows = nint(global(21), i8)
    n = nint(global(13))
    frames = nint(global(14))
    last = n_clock + 4*n + frames + size(sim%row_impulse)
    rest = size(global) - last
    if (n /= sim%probes%n .or. (rest /= 0 .and. rest /= n_tool_sums*size(sim%tool))) then
      call error%raise(path//other_scene)
      return
    end if
    sim%probes%x = reshape(global(n_clock + 1:n_clock + 3*n), [3, n])
    sim%probes%temperature = global(n_clock + 3*n + 1:n_clock + 4*n)
    sim%frame_times = global(n_clock + 4*n + 1:n_clock + 4*n + frames)
    sim%row_impulse = reshape(global(n_clock + 4*n + frames + 1:last), shape(sim%row_impulse))
    if (rest > 0) sim%row_sums = reshape(global(last + 1:), [n_tool_sums, size(sim%tool)])
  end subroutine unpack_global

end module time_resume
