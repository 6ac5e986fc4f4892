! SPDX-License-Identifier: MIT
!> Checkpoints of a simulation.
module output_checkpoint
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_world, only: world_t
  use io_checkpoint, only: notes_t, write_checkpoint
  use io_plausible, only: counts, min_positive, numbers_t, speed_of_light
  use particles_tracers, only: tracers_t
  use sleep_cubes, only: edge
  use state_budget, only: budget_t, n_sums, sum_of
  use state_clock, only: clock_t
  use state_inertia, only: inertia_t
  use state_node_pairs, only: n_kept
  use state_nodes, only: gather_light, n_light
  use state_parts, only: simulation_t
  use state_probes, only: share_probes
  use state_scene, only: output_t, scene_t
  use state_sleepers, only: sleepers_t
  use tools_heat_sink, only: backing_t
  use tools_monitor, only: n_monitor
  use tools_motion, only: drive_t
  use tools_sums, only: n_tool_sums, tool_sum_of
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: broken_path, checkpoint_path, make_notes, pass_numbers, pass_sums, save_checkpoint

contains

  !> File of the latest checkpoint of a run.
  pure function checkpoint_path(scene) result(path)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: path

    path = scene%output%directory//'/'//scene%output%name//'_checkpoint.h5'
  end function checkpoint_path

  !> File of a state from which a run cannot be continued.
  pure function broken_path(scene) result(path)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: path

    path = scene%output%directory//'/'//scene%output%name//'_broken.h5'
  end function broken_path

  !> Metadata of a checkpoint.
  pure subroutine make_notes(output, time, notes)
    type(output_t), intent(in) :: output
    real(rp), intent(in) :: time             !! simulated time [s]
    type(notes_t), intent(out) :: notes

    notes%input = output%input_text
    notes%scene = output%scene_text
    notes%run = output%run
    notes%time = time
    notes%files = output%files
    notes%folder = output%folder
  end subroutine make_notes

  !> Write the state between two steps to `path`, by default checkpoint_path; with an empty path the
  !> file is kept in memory only (io_h5_file). The run is not changed.
  subroutine save_checkpoint(sim, error, path)
    type(simulation_t), intent(inout) :: sim
    type(error_t), intent(inout) :: error
    character(*), intent(in), optional :: path
    type(notes_t) :: notes
    type(numbers_t) :: of_run, of_rank
    character(:), allocatable :: file
    real(rp) :: last(3)

    call share_probes(sim%world, sim%probes)
    last = [sim%clock%now%last%stiffness, sim%clock%now%last%speed2, sim%particles%warming]
    call sim%world%max(last)
    if (sim%nodes%n_groups > 1) call sim%pairs%gather_kept(sim%world)
    call gather_light(sim%world, sim%nodes)
    of_run%is_read = .false.
    allocate (of_run%value(0))
    of_rank = of_run
    call pass_numbers(sim, last, of_run)
    call pass_sums(sim%world, sim%tool, sim%sleepers, sim%budget, of_rank)
    call make_notes(sim%scene%output, sim%clock%time, notes)
    notes%layout = sim%scene%layout%places()
    file = checkpoint_path(sim%scene)
    if (present(path)) file = path
    call write_checkpoint(sim%world, file, sim%particles, sim%exchange%boxes, of_run, of_rank, &
                          notes, error)
  end subroutine save_checkpoint

  !> Write or read the numbers of the run; `last` are the maxima of all ranks in the last step.
  subroutine pass_numbers(sim, last, numbers)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: last(3)
    type(numbers_t), intent(inout) :: numbers
    real(rp) :: far, n_cubes(3), n_probes, scaling
    integer :: a, entries, frames, light, probes

    if (.not. allocated(sim%nodes%light_kept)) allocate (sim%nodes%light_kept(n_light, 0))
    light = size(sim%nodes%light_kept, 2)
    probes = sim%probes%n
    entries = size(sim%pairs%kept, 2)
    n_probes = real(probes, rp)
    frames = 0
    if (allocated(sim%history%frame_times)) frames = size(sim%history%frame_times)
    scaling = sim%clock%mass_scaling
    associate (c => sim%clock, h => sim%history, motion => sim%sleepers%motion, s => numbers)
      call s%pass_one(c%step, 'the step', 0.0_rp, counts)
      call s%pass_one(c%time, 'the time [s]', 0.0_rp)
      call s%pass_one(c%dt, 'the length of the last step [s]', 0.0_rp)
      call s%pass_one(c%displacement, 'the displacement since the last sort [m]', 0.0_rp)
      call s%pass_one(c%sorted_at, 'the step of the last sort', -1.0_rp, real(c%step, rp))
      call s%pass_one(c%heat_time, 'the time of the last conduction step [s]', 0.0_rp, c%time)
      call s%pass_one(c%max_speed, 'the largest velocity [m/s]', 0.0_rp, speed_of_light)
      call s%pass_one(c%stiffness, 'the squared wave speed [m2/s2]', min_positive, &
                      speed_of_light**2)
      call s%pass_one(h%kinetic0, 'the kinetic energy at t = 0 [J]', 0.0_rp)
      call s%pass_one(h%elastic0, 'the elastic energy at t = 0 [J]')
      call s%pass_one(h%audit_scale, 'the reference energy of the balance [J]', 0.0_rp)
      call s%pass_one(h%row_time, 'the time of the last row [s]', 0.0_rp, c%time)
      call s%pass_one(probes, 'the number of probes', n_probes, n_probes)
      call s%pass_one(frames, 'the number of frames', 0.0_rp, real(size(s%value), rp))
      call s%pass(2, last(:2), 'a squared speed of the last step [m2/s2]', 0.0_rp, &
        speed_of_light**2)
      call s%pass_one(last(3), 'the temperature rise by stored heat [K]', 0.0_rp)
      call s%pass_one(c%fragments, 'whether there are fragments', 0.0_rp, 1.0_rp)
      call s%pass_one(c%refused, 'the number of refused steps', 0.0_rp, counts)
      call s%pass_one(scaling, 'the mass scaling', min_positive)
      call s%pass_one(c%inertial_peak, 'the largest inertial stress over flow stress', 0.0_rp)
      call s%pass_one(c%heat_step, 'the next conduction step [s]', 0.0_rp)
      call s%pass_one(h%rows, 'the number of rows', 0.0_rp, counts)
      n_cubes = real(sim%scene%grid%n/edge + 1, rp)
      do a = 1, 3
        call s%pass_one(motion%box%lo(a), 'a bound of the cubes of nodes', -1.0_rp, n_cubes(a))
      end do
      do a = 1, 3
        call s%pass_one(motion%box%hi(a), 'a bound of the cubes of nodes', -1.0_rp, n_cubes(a))
      end do
      call s%pass_one(motion%time, 'the time since sleep was last decided [s]', 0.0_rp)
      call s%pass_one(entries, 'the number of nodes with a normal', 0.0_rp, &
                      product(real(sim%scene%grid%n, rp))*size(sim%scene%body)**2)
      call s%pass_one(light, 'the number of light nodes', 0.0_rp, real(size(s%value), rp))
      if (s%is_read) then
        associate (range => sim%scene%method%scaling_range)
          if (sim%scene%method%adapts_mass) c%mass_scaling = max(range(1), min(range(2), scaling))
        end associate
        if (.not. s%has_set()) then
          frames = 0
          entries = 0
          light = 0
        end if
        sim%nodes%light_kept = spread(spread(0.0_rp, 1, n_light), 2, light)
        sim%pairs%kept = spread(spread(0.0_rp, 1, n_kept), 2, entries)
        h%frame_times = spread(0.0_rp, 1, frames)
      end if
      far = maxval(abs(sim%scene%grid%lower)) + 1.0e9_rp*minval(sim%scene%grid%h)
      if (sim%probes%n > 0) then
        call s%pass(size(sim%probes%x), sim%probes%x, 'the position of a probe [m]', -far, far)
        call s%pass(sim%probes%n, sim%probes%temperature, 'the temperature of a probe [K]', &
                    min_positive)
      end if
      call s%pass(frames, h%frame_times, 'the time of a frame [s]', 0.0_rp, c%time)
      call s%pass(size(h%row_impulse), h%row_impulse, 'a sum at the last row')
      call s%pass(size(h%row_sums), h%row_sums, 'a sum at the last row')
      call s%pass(size(sim%nodes%light_kept), sim%nodes%light_kept, 'a light node', &
                  -speed_of_light, speed_of_light)
      call pass_inertia(h%row_inertia, s)
      call pass_inertia(h%sort_inertia, s)
      call s%pass_one(h%inertial_ratio, 'the largest inertial stress over flow stress', 0.0_rp)
      call s%pass_one(h%early_force, 'the largest force on metal not reached [N]', 0.0_rp)
      call s%pass(size(h%molten), h%molten, 'the largest molten share or excess', 0.0_rp)
      call s%pass(size(sim%pairs%kept), sim%pairs%kept, 'a normal between bodies')
    end associate
    call pass_tools(sim%clock, sim%tool, sim%backing, far, numbers)
    call pass_tracers(sim%clock, sim%tracers, numbers)
    do a = 1, size(sim%hook)
      associate (hook => sim%hook(a)%it)
        call numbers%pass(size(hook%state), hook%state, 'the state of '//hook%name)
      end associate
    end do
  end subroutine pass_numbers

  !> Write or read motion and loads at the last row or sort.
  subroutine pass_inertia(inertia, numbers)
    type(inertia_t), intent(inout) :: inertia
    type(numbers_t), intent(inout) :: numbers

    call numbers%pass(size(inertia%at), inertia%at, 'motion at the last row or sort')
    call numbers%pass(size(inertia%load), inertia%load, 'a largest load', 0.0_rp)
    call numbers%pass(size(inertia%largest), inertia%largest, 'a largest inertial load', 0.0_rp)
    call numbers%pass(size(inertia%impulse), inertia%impulse, 'an impulse at the last row or sort')
  end subroutine pass_inertia

  !> Write or read the states of tools and backings.
  subroutine pass_tools(clock, tools, backings, far, numbers)
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(inout) :: tools(:)
    type(backing_t), intent(inout) :: backings(:)
    real(rp), intent(in) :: far                  !! bound of coordinates [m]
    type(numbers_t), intent(inout) :: numbers
    real(rp), allocatable :: x(:)
    real(rp) :: phases
    integer :: i, k, n

    do k = 1, size(tools)
      associate (tool => tools(k), s => numbers)
        n = tool%n_phases
        call s%pass_one(n, 'the number of phases of a tool', 0.0_rp, real(size(s%value), rp))
        if (s%is_read .and. .not. s%has_set()) n = 0
        phases = real(n + 1, rp)
        x = tool%drive%state()
        call s%pass_one(x(1), 'the shift of a tool [m]', -far, far)
        call s%pass_one(x(2), 'the velocity of a tool [m/s]', -speed_of_light, speed_of_light)
        call s%pass_one(x(3), 'the neutral position of a tool [m]', -far, far)
        call s%pass_one(x(4), 'the force on a tool [N]')
        call s%pass_one(x(5), 'the flag of a tool that presses', 0.0_rp, 1.0_rp)
        call s%pass_one(x(6), 'the phase of a tool', 0.0_rp, phases)
        call s%pass_one(x(7), 'the force at the beginning of the phase of a tool [N]')
        if (s%has_set()) call tool%drive%set_state(x, clock%time)
        if (tool%monitor%is_on) then
          x = spread(0.0_rp, 1, n_monitor + n)
          if (.not. s%is_read) x = tool%monitor%state(tool%motion, n)
          call s%pass(4, x(1:4), 'the load of a tool')
          call s%pass_one(x(5), 'the phase of a tool', 1.0_rp, phases)
          call s%pass_one(x(6), 'the flag of an ended phase of a tool', 0.0_rp, 1.0_rp)
          call s%pass_one(x(7), 'the time at which a tool was stopped [s]', -1.0_rp, clock%time)
          call s%pass_one(x(8), 'the spin of a stopped tool [rad/s]')
          call s%pass(n, x(9:), 'the duration of a phase of a tool [s]', 0.0_rp)
          if (s%has_set()) call tool%monitor%set_state(x, tool%motion)
        end if
        x = tool%heat%state()
        call s%pass_sink(x)
        if (s%has_set()) call tool%heat%set_state(x)
      end associate
    end do
    do k = 1, size(backings)
      do i = 1, size(backings(k)%column)
        x = backings(k)%column(i)%state()
        call numbers%pass_sink(x)
        if (numbers%has_set()) call backings(k)%column(i)%set_state(x)
      end do
    end do
  end subroutine pass_tools

  !> Write or read the state of the tracers.
  subroutine pass_tracers(clock, tracers, numbers)
    type(clock_t), intent(in) :: clock
    type(tracers_t), intent(inout) :: tracers
    type(numbers_t), intent(inout) :: numbers
    real(rp) :: id(tracers%n)

    associate (t => tracers)
      if (t%n == 0) return
      id = real(t%id, rp)
      call numbers%pass_one(t%rows, 'the number of rows of the tracers', 0.0_rp, counts)
      call numbers%pass(size(t%row_time), t%row_time, 'the time of the last row of tracers [s]', &
                        -1.0_rp, clock%time)
      call numbers%pass(t%n, id, 'the number of a particle', 0.0_rp, counts)
      if (numbers%has_set()) call t%set_ids(nint(id, i8))
    end associate
  end subroutine pass_tracers

  !> Write or read the sums of this rank.
  subroutine pass_sums(world, tools, sleepers, budget, numbers)
    type(world_t), intent(in) :: world
    type(tool_t), intent(inout) :: tools(:)
    type(sleepers_t), intent(inout) :: sleepers
    type(budget_t), intent(inout) :: budget
    type(numbers_t), intent(inout) :: numbers
    integer :: i, k

    associate (b => budget)
      do k = 1, n_sums
        call numbers%pass_one(b%sums(k), trim(sum_of(k)%name)//' ['//trim(sum_of(k)%unit)//']')
      end do
      call numbers%pass_one(b%failed_returns, 'the number of failed returns', 0.0_rp, &
                            real(huge(1), rp))
      call numbers%pass(size(b%warnings), b%warnings, 'the number of warnings', 0.0_rp)
      call numbers%pass(size(b%impulse), b%impulse, 'the impulse of a wall or clamp [N s]')
      call numbers%pass(size(b%hooks), b%hooks, 'a sum of a hook')
      do k = 1, size(tools)
        do i = 1, n_tool_sums
          call numbers%pass_one(tools(k)%sums(i), trim(tool_sum_of(i)%name)//' of a tool ['// &
                                trim(tool_sum_of(i)%unit)//']')
        end do
        call pass_reaction(world, tools(k)%drive, numbers)
      end do
    end associate
    if (.not. allocated(sleepers%motion%sums)) return
    call numbers%pass(size(sleepers%motion%sums), sleepers%motion%sums, &
                      'the motion of a cube of nodes')
  end subroutine pass_sums

  !> Write or read the part of this rank of the mean reaction on a tool: rank 0 has all of that of a
  !> free one.
  subroutine pass_reaction(world, drive, numbers)
    type(world_t), intent(in) :: world
    type(drive_t), intent(inout) :: drive
    type(numbers_t), intent(inout) :: numbers
    real(rp) :: part

    part = drive%reaction_ema
    if (drive%is_free .and. .not. world%is_root()) part = 0.0_rp
    call numbers%pass_one(part, 'the reaction on a tool [N]')
    if (numbers%has_set()) drive%reaction_ema = part
  end subroutine pass_reaction

end module output_checkpoint
