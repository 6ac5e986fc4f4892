! SPDX-License-Identifier: MIT
!> Output of a run and its times: frames, surfaces of the tools, histories, probes, tracers,
!> checkpoints.
module output_writer
  use base_errors, only: error_t
  use base_kinds, only: i8, rp, sp
  use base_timers, only: wall_time
  use base_world, only: world_t
  use io_frames, only: frame_name, write_frame, write_series, write_tool_frame
  use io_histories, only: compact, lines_t, row_t, table_t
  use output_checkpoint, only: save_checkpoint
  use output_diagnostics, only: is_finite
  use output_error_norms, only: error_headings, has_fields, make_error_row
  use output_guards, only: melting_json
  use output_history, only: faces_json, history_headings, log_faces, make_history_row
  use output_microstructure, only: frame_outputs, pack_outputs
  use output_progress, only: progress_t
  use output_warnings, only: log_inertial_stress, warnings_t
  use particles_tracers, only: n_seen
  use physics_flow_law, only: law_output_t
  use state_clock, only: clock_t
  use state_parts, only: history_t, simulation_t
  use state_probes, only: probes_t, share_probes
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: next_time, row_or_frame_is_due, writer_t

  !> Open files, and the state of the output.
  type :: writer_t
    type(table_t) :: history, probes, tracers, errors
    integer(i8) :: saved_step = -1      !! step of the last checkpoint
    type(progress_t) :: progress
    type(warnings_t), private :: warnings
  contains
    procedure :: init, write_due
    procedure :: add_frame, write_row
    procedure, private :: write_tracer_rows
    procedure :: write_summary, sync, close => close_files
  end type writer_t

  character(24), parameter, public :: tracer_headings(10) = [character(24) :: 'time[s]', 'group', &
    'tracer', 'id', 'body', 'x[m]', 'y[m]', 'z[m]', 'temperature[K]', 'plastic_strain[1]']

  character(*), parameter :: ending = '_tools'   !! suffix of the name of the series of tool frames

contains

  !> Open the histories; a resumed run appends to the existing ones.
  subroutine init(self, sim, is_resumed, error)
    class(writer_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_resumed
    type(error_t), intent(inout) :: error
    character(:), allocatable :: stem
    type(row_t) :: row
    integer(i8) :: rows

    call self%progress%init(sim%scene%output, sim%clock%time, sim%clock%step)
    self%progress%particles = sim%particles%total()
    call sim%world%sum(self%progress%particles)
    sim%clock%now%secured = self%progress%started
    rows = merge(sim%history%rows, -1_i8, is_resumed)
    stem = sim%scene%output%directory//'/'//sim%scene%output%name
    call self%history%open(sim%world, stem//'_history.csv', sim%scene%title, &
                           history_headings(sim), rows, sim%history%row_time, error)
    if (sim%probes%n > 0) then
      row = probe_row(sim%clock, sim%probes)
      call self%probes%open(sim%world, stem//'_probes.csv', sim%scene%title, row%headings(), &
                            rows, sim%history%row_time, error)
    end if
    if (sim%tracers%n > 0) then
      call self%tracers%open(sim%world, stem//'_tracers.csv', sim%scene%title, tracer_headings, &
                             merge(sim%tracers%rows, -1_i8, is_resumed), &
                             maxval(sim%tracers%row_time), error, may_follow=.true.)
    end if
    if (has_fields(sim%scene)) then
      call self%errors%open(sim%world, stem//'_errors.csv', sim%scene%title, &
                            error_headings(sim%scene, sim%clock), rows, sim%history%row_time, error)
    end if
    associate (output => sim%scene%output)
      if (is_resumed) then
        call list_frames(sim%world, sim%scene, sim%history, error)
        self%saved_step = sim%clock%step
        sim%clock%next_frame = next_time(output%frame_interval, sim%clock%time)
        sim%clock%next_history = next_time(output%history_interval, sim%clock%time)
        sim%clock%next_checkpoint = next_time(output%checkpoint_interval, sim%clock%time)
        if (sim%tracers%n > 0) sim%tracers%next = next_time(sim%tracers%interval, sim%clock%time)
      else
        allocate (sim%history%frame_times(0))
      end if
    end associate
  end subroutine init

  !> Row of the probes: temperatures, then positions.
  type(row_t) function probe_row(clock, probes) result(row)
    type(clock_t), intent(in) :: clock
    type(probes_t), intent(in) :: probes
    integer :: n

    call row%add('time', 's', clock%time)
    do n = 1, probes%n
      call row%add(probes%name(n), 'K', probes%temperature(n))
    end do
    do n = 1, probes%n
      call row%add(trim(probes%name(n))//'_x', 'm', probes%x(1, n))
      call row%add(trim(probes%name(n))//'_y', 'm', probes%x(2, n))
      call row%add(trim(probes%name(n))//'_z', 'm', probes%x(3, n))
    end do
  end function probe_row

  !> Write the output due at the current time, rows before a checkpoint, which stores their number.
  !> At the end of a run write a checkpoint, then a row and a frame, which a restart drops if they
  !> were not due.
  subroutine write_due(self, sim, last, error)
    class(writer_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: last              !! end of the run
    type(error_t), intent(inout) :: error
    real(rp) :: now
    logical :: is_due

    now = sim%clock%time*(1.0_rp + 1.0e-12_rp)
    associate (output => sim%scene%output)
      if (now >= sim%clock%next_history) then
        call self%write_row(sim)
        sim%clock%next_history = next_time(output%history_interval, sim%clock%time)
      end if
      call self%write_tracer_rows(sim, .false.)
      if (now >= sim%clock%next_frame) then
        call self%add_frame(sim, error)
        sim%clock%next_frame = next_time(output%frame_interval, sim%clock%time)
      end if
      is_due = output%checkpoint_interval > 0.0_rp .and. now >= sim%clock%next_checkpoint
      is_due = (is_due .or. last .or. sim%clock%now%safety_is_due) &
        .and. self%saved_step < sim%clock%step
      if (is_due .and. .not. sim%clock%now%is_broken) then
        self%saved_step = sim%clock%step
        sim%clock%next_checkpoint = next_time(output%checkpoint_interval, sim%clock%time)
        call self%sync()
        if (.not. sim%world%all_true(is_finite(sim%particles))) then
          sim%clock%now%is_broken = .true.
        else if (sim%world%all_true(.not. sim%clock%now%lost_row)) then
          call save_checkpoint(sim, error)
        end if
        sim%clock%now%secured = wall_time()
      end if
    end associate
    if (.not. last) return
    call self%write_row(sim)
    call self%write_tracer_rows(sim, .true.)
    call self%add_frame(sim, error)
  end subroutine write_due

  !> Write the tracer rows that are due, at the end of a run those of all groups.
  subroutine write_tracer_rows(self, sim, last)
    class(writer_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: last
    character(:), allocatable :: text
    integer :: n

    if (sim%tracers%n == 0) return
    associate (is_due => (last .or. sim%clock%time*(1.0_rp + 1.0e-12_rp) >= sim%tracers%next) &
               .and. sim%tracers%row_time < sim%clock%time)
      if (.not. any(is_due)) return
      call make_tracer_rows(sim, is_due, text, n)
      call self%tracers%write_lines(text)
      sim%tracers%rows = sim%tracers%rows + n
      where (is_due)
        sim%tracers%row_time = sim%clock%time
        sim%tracers%next = next_time(sim%tracers%interval, sim%clock%time)
      end where
    end associate
    sim%clock%now%lost_row = sim%clock%now%lost_row .or. self%tracers%is_lost()
  end subroutine write_tracer_rows

  !> True if `write_due` will write a row or a frame.
  pure logical function row_or_frame_is_due(clock, last)
    type(clock_t), intent(in) :: clock
    logical, intent(in) :: last

    row_or_frame_is_due = last .or. clock%time*(1.0_rp + 1.0e-12_rp) >= min(clock%next_history, &
                                                                            clock%next_frame)
  end function row_or_frame_is_due

  !> First multiple of the interval after `time` [s]; huge if the interval is 0.
  elemental real(rp) function next_time(interval, time)
    real(rp), intent(in) :: interval, time

    next_time = huge(1.0_rp)
    if (interval > 0.0_rp) then
      next_time = interval*(aint(time*(1.0_rp + 1.0e-12_rp)/interval) + 1.0_rp)
    end if
  end function next_time

  !> Collective. Write a frame of the particles and one of the tools, and update the index files.
  subroutine add_frame(self, sim, error)
    class(writer_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    type(error_t), intent(inout) :: error
    real(sp), allocatable :: outputs(:, :)
    type(law_output_t), allocatable :: list(:)

    associate (n => size(sim%history%frame_times))
      if (n > 0) then
        if (sim%history%frame_times(n) >= sim%clock%time) return   ! written already
      end if
      allocate (list, source=frame_outputs(sim%scene))
      call pack_outputs(sim%scene, sim%particles, outputs)
      associate (output => sim%scene%output, layout => sim%scene%layout, body => sim%scene%body)
        call write_frame(sim%world, output%directory//'/'//frame_name(output%name, n), &
                         sim%clock%time, int(sim%clock%step), sim%scene%grid%h, &
                         body%mean_spacing(), body%name, body%material, sim%scene%material%name, &
                         layout%shown(), sim%particles, list%name, list%unit, outputs, &
                         output%input_text, error)
      end associate
      call put_tools(sim%world, sim%scene, sim%clock, sim%tool, n, error)
    end associate
    if (error%is_set()) return
    sim%history%frame_times = [sim%history%frame_times, sim%clock%time]
    call list_frames(sim%world, sim%scene, sim%history, error)
  end subroutine add_frame

  !> Collective. Write the index files of the particle frames and of the tool frames, if any.
  subroutine list_frames(world, scene, history, error)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(history_t), intent(in) :: history
    type(error_t), intent(inout) :: error

    associate (output => scene%output, times => history%frame_times)
      call write_series(world, output%directory, output%name, times, error)
      call write_series(world, output%directory, output%name//ending, times, error)
    end associate
  end subroutine list_frames

  !> Collective. Write a row of the history, the probes and the errors; check for warnings.
  subroutine write_row(self, sim)
    class(writer_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    type(row_t) :: columns

    if (sim%history%row_time >= sim%clock%time .and. sim%history%rows > 0) return  ! written already
    call make_history_row(sim, columns)
    call self%warnings%check(sim, columns)
    call self%history%write_row(columns%values())
    if (sim%probes%n > 0) then
      call share_probes(sim%world, sim%probes)
      columns = probe_row(sim%clock, sim%probes)
      call self%probes%write_row(columns%values())
    end if
    if (has_fields(sim%scene)) then
      call make_error_row(sim, columns)
      call self%errors%write_row(columns%values())
    end if
    sim%history%rows = sim%history%rows + 1
    sim%clock%now%lost_row = self%history%is_lost() .or. self%probes%is_lost() &
      .or. self%errors%is_lost() .or. self%tracers%is_lost()
  end subroutine write_row

  !> Collective. Write NAME_summary.json; log speed, mass scaling and the tool faces.
  subroutine write_summary(self, sim, error)
    class(writer_t), intent(in) :: self
    type(simulation_t), intent(in) :: sim
    type(error_t), intent(inout) :: error

    call self%progress%write_summary(sim, melting_json(sim%history%molten)// &
                                     faces_json(sim%scene, sim%tool, sim%history), error)
    if (sim%world%is_root() .and. .not. sim%scene%output%is_quiet) then
      call log_inertial_stress(sim%scene, sim%clock, sim%history)
      call log_faces(sim%scene, sim%tool, sim%history)
    end if
  end subroutine write_summary

  !> Flush the rows to disk, before a checkpoint that stores their number.
  subroutine sync(self)
    class(writer_t), intent(inout) :: self

    call self%history%sync()
    call self%probes%sync()
    call self%tracers%sync()
    call self%errors%sync()
  end subroutine sync

  subroutine close_files(self, error)
    class(writer_t), intent(inout) :: self
    type(error_t), intent(inout) :: error

    call self%history%close(error)
    call self%probes%close(error)
    call self%tracers%close(error)
    call self%errors%close(error)
  end subroutine close_files

  !> Collective. Text of the rows of the groups that are due, and their number; a tracer whose
  !> particle has left the grid has no row. `id` is that of the particle in the frames.
  subroutine make_tracer_rows(sim, is_due, text, n)
    type(simulation_t), intent(in) :: sim
    logical, intent(in) :: is_due(:)              !! groups to write
    character(:), allocatable, intent(out) :: text
    integer, intent(out) :: n
    integer, parameter :: longest = 240           !! longest row [characters]
    real(rp), allocatable :: seen(:, :)
    type(lines_t) :: lines
    character(20) :: now
    integer :: i, k

    allocate (seen(n_seen, sim%tracers%n))
    call sim%tracers%collect(sim%world, sim%particles, seen)
    allocate (character(longest*sim%tracers%n) :: lines%text)
    write (now, '(es19.12)') sim%clock%time
    n = 0
    do i = 1, sim%tracers%n
      if (.not. is_due(sim%tracers%group(i)) .or. seen(n_seen, i) < 0.5_rp) cycle
      call lines%add(compact(now))
      call lines%add(','//trim(sim%tracers%name(sim%tracers%group(i)))//',')
      call lines%add(int(i, i8))
      call lines%add(',')
      call lines%add(sim%tracers%id(i))
      call lines%add(','//trim(sim%scene%body(nint(seen(6, i)))%name))
      do k = 1, 5
        call lines%add(',')
        call lines%add(seen(k, i))
      end do
      call lines%add(new_line('a'))
      n = n + 1
    end do
    text = lines%text(:lines%used)
  end subroutine make_tracer_rows

  !> Collective. Write frame `k` (from 0) of the tools, if any has a surface.
  subroutine put_tools(world, scene, clock, tools, k, error)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    integer, intent(in) :: k
    type(error_t), intent(inout) :: error
    type :: surface_t
      real(rp), allocatable :: x(:, :)       ! points relative to the tool [m]
      integer, allocatable :: corner(:, :)   ! points of each facet
    end type surface_t
    type(surface_t) :: surface(size(tools))
    real(rp) :: x(3)
    real(sp), allocatable :: place(:, :), velocity(:, :), azimuth(:)
    integer, allocatable :: corner(:, :), number(:)
    integer :: facets, i, n, p, points

    points = 0
    facets = 0
    do i = 1, size(surface)
      if (tools(i)%has_shape()) then
        call tools(i)%shape%surface(surface(i)%x, surface(i)%corner)
      else
        allocate (surface(i)%x(3, 0), surface(i)%corner(3, 0))
      end if
      points = points + size(surface(i)%x, 2)
      facets = facets + size(surface(i)%corner, 2)
    end do
    allocate (place(3, points), velocity(3, points), azimuth(points), number(points))
    allocate (corner(3, facets))
    facets = 0
    n = 0
    do i = 1, size(surface)
      associate (part => surface(i))
        corner(:, facets + 1:facets + size(part%corner, 2)) = part%corner + n
        facets = facets + size(part%corner, 2)
        do p = 1, size(part%x, 2)
          n = n + 1
          x = matmul(tools(i)%axes, part%x(:, p)) + tools(i)%position
          number(n) = i
          azimuth(n) = real(atan2(part%x(2, p), part%x(1, p)), sp)
          place(:, n) = real(x, sp)
          velocity(:, n) = real(tools(i)%surface_velocity(x), sp)
        end do
      end associate
    end do
    if (size(corner) == 0) return
    call write_tool_frame(world, scene%output%directory//'/'// &
                          frame_name(scene%output%name//ending, k), clock%time, int(clock%step), &
                          tools%name, place, velocity, azimuth, number, corner, error)
  end subroutine put_tools

end module output_writer
