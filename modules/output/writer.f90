! SPDX-License-Identifier: MIT
!> Output of a run and its times: frames, histories, probes, tracers, checkpoints.
module output_writer
  use base_errors, only: error_t
  use base_kinds, only: i8, rp, sp
  use base_timers, only: phase_timer_t, wall_time
  use comm_world, only: world_t
  use contact_backing, only: backing_t
  use contact_tool, only: tool_t
  use exchange_ranks, only: exchange_t
  use io_frames, only: write_frame, write_series
  use io_histories, only: table_t
  use io_row, only: row_t
  use mapping_nodes, only: nodes_t
  use mapping_probes, only: probes_t, share_probes
  use output_audit, only: history_t
  use output_checkpoint, only: save_checkpoint
  use output_diagnostics, only: is_finite
  use output_error_norms, only: error_headings, error_row, has_fields
  use output_faces, only: faces_json, log_faces
  use output_history, only: history_headings, history_row
  use output_microstructure, only: frame_outputs, pack_outputs
  use output_progress, only: progress_t
  use output_tool_surfaces, only: list_tools, put_tools
  use output_tracers, only: tracer_headings, tracer_rows
  use output_warnings, only: warnings_t
  use particles_store, only: particles_t
  use particles_tracers, only: tracers_t
  use physics_flow_law, only: law_output_t
  use sleep_sleepers, only: sleepers_t
  use state_blocks, only: blocks_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  implicit none (type, external)
  private

  public :: writer_t, next_time, put_frame

  !> Open files, and the state of the output.
  type :: writer_t
    type(table_t) :: history, probes, tracers, errors
    integer(i8) :: saved_step = -1      !! step of the last checkpoint
    type(progress_t) :: progress
    type(warnings_t), private :: warnings
  contains
    procedure :: init
    procedure :: write_due
    procedure, nopass :: row_or_frame_is_due
    procedure :: add_frame
    procedure :: row
    procedure, private :: write_tracer_rows
    procedure :: write_summary
    procedure :: sync
    procedure :: close => close_files
  end type writer_t

contains

  !> Open the histories; a resumed run appends to the existing ones.
  subroutine init(self, world, scene, clock, step, tool, backing, probes, tracers, particles, &
                  history, is_resumed, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    type(probes_t), intent(in) :: probes
    type(tracers_t), intent(inout) :: tracers
    type(particles_t), intent(in) :: particles
    type(history_t), intent(inout) :: history
    logical, intent(in) :: is_resumed
    type(error_t), intent(inout) :: error
    character(:), allocatable :: stem
    type(row_t) :: row
    integer(i8) :: rows

    call self%progress%init(world, scene, clock, particles)
    step%secured = self%progress%started
    rows = merge(history%rows, -1_i8, is_resumed)
    stem = scene%output%directory//'/'//scene%output%name
    call self%history%open(world, stem//'_history.csv', scene%title, &
                           history_headings(scene, clock, tool, backing, history), rows, &
                           history%row_time, error)
    if (probes%n > 0) then
      row = probe_row(clock, probes)
      call self%probes%open(world, stem//'_probes.csv', scene%title, row%headings(), rows, &
                            history%row_time, error)
    end if
    if (tracers%n > 0) then
      call self%tracers%open(world, stem//'_tracers.csv', scene%title, tracer_headings, &
                             merge(tracers%rows, -1_i8, is_resumed), maxval(tracers%row_time), &
                             error, may_follow=.true.)
    end if
    if (has_fields(scene)) then
      call self%errors%open(world, stem//'_errors.csv', scene%title, error_headings(scene, clock), &
                            rows, history%row_time, error)
    end if
    associate (output => scene%output)
      if (is_resumed) then
        call write_series(world, output%directory, output%name, history%frame_times, error)
        call list_tools(world, scene, history%frame_times, error)
        self%saved_step = clock%step
        clock%next_frame = next_time(output%frame_interval, clock%time)
        clock%next_history = next_time(output%history_interval, clock%time)
        clock%next_checkpoint = next_time(output%checkpoint_interval, clock%time)
        if (tracers%n > 0) tracers%next = next_time(tracers%interval, clock%time)
      else
        allocate (history%frame_times(0))
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
  subroutine write_due(self, world, scene, clock, step, tool, backing, probes, tracers, particles, &
                       sleepers, exchange, budget, history, last, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    type(probes_t), intent(inout) :: probes
    type(tracers_t), intent(inout) :: tracers
    type(particles_t), intent(in) :: particles
    type(sleepers_t), intent(in) :: sleepers
    type(exchange_t), intent(in) :: exchange
    type(budget_t), intent(in) :: budget
    type(history_t), intent(inout) :: history
    logical, intent(in) :: last              !! end of the run
    type(error_t), intent(inout) :: error
    real(rp) :: now
    logical :: is_due

    now = clock%time*(1.0_rp + 1.0e-12_rp)
    associate (output => scene%output)
      if (now >= clock%next_history) then
        call self%row(world, scene, clock, step, tool, backing, probes, particles, budget, history)
        clock%next_history = next_time(output%history_interval, clock%time)
      end if
      call self%write_tracer_rows(world, scene, clock, step, particles, tracers, .false.)
      if (now >= clock%next_frame) then
        call self%add_frame(world, scene, clock, tool, particles, history, error)
        clock%next_frame = next_time(output%frame_interval, clock%time)
      end if
      is_due = output%checkpoint_interval > 0.0_rp .and. now >= clock%next_checkpoint
      is_due = (is_due .or. last .or. step%safety_is_due) .and. self%saved_step < clock%step
      if (is_due .and. .not. step%is_broken) then
        self%saved_step = clock%step
        clock%next_checkpoint = next_time(output%checkpoint_interval, clock%time)
        call self%sync()
        if (.not. world%all_true(is_finite(particles))) then
          step%is_broken = .true.
        else if (world%all_true(.not. step%lost_row)) then
          call save_checkpoint(world, scene, clock, step, tool, backing, probes, tracers, &
                               particles, sleepers, exchange, budget, history, error)
        end if
        step%secured = wall_time()
      end if
    end associate
    if (.not. last) return
    call self%row(world, scene, clock, step, tool, backing, probes, particles, budget, history)
    call self%write_tracer_rows(world, scene, clock, step, particles, tracers, .true.)
    call self%add_frame(world, scene, clock, tool, particles, history, error)
  end subroutine write_due

  !> Write the tracer rows that are due, at the end of a run those of all groups.
  subroutine write_tracer_rows(self, world, scene, clock, step, particles, tracers, last)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(inout) :: step
    type(particles_t), intent(in) :: particles
    type(tracers_t), intent(inout) :: tracers
    logical, intent(in) :: last
    character(:), allocatable :: text
    integer :: n

    if (tracers%n == 0) return
    associate (is_due => (last .or. clock%time*(1.0_rp + 1.0e-12_rp) >= tracers%next) &
                         .and. tracers%row_time < clock%time)
      if (.not. any(is_due)) return
      call tracer_rows(world, scene, particles, tracers, clock%time, is_due, text, n)
      call self%tracers%lines(text)
      tracers%rows = tracers%rows + n
      where (is_due)
        tracers%row_time = clock%time
        tracers%next = next_time(tracers%interval, clock%time)
      end where
    end associate
    step%lost_row = step%lost_row .or. self%tracers%is_lost()
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
  subroutine add_frame(self, world, scene, clock, tool, particles, history, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(history_t), intent(inout) :: history
    type(error_t), intent(inout) :: error
    character(6) :: number

    if (size(history%frame_times) > 0) then
      if (history%frame_times(size(history%frame_times)) >= clock%time) return   ! written already
    end if
    write (number, '(i6.6)') size(history%frame_times)
    associate (output => scene%output)
      call put_frame(world, scene, clock, particles, &
                     output%directory//'/'//output%name//'_'//number//'.hdf', error)
      call put_tools(world, scene, clock, tool, size(history%frame_times), error)
      if (error%is_set()) return
      history%frame_times = [history%frame_times, clock%time]
      call write_series(world, output%directory, output%name, history%frame_times, error)
      call list_tools(world, scene, history%frame_times, error)
    end associate
  end subroutine add_frame

  !> Collective. Write a frame to `path`; with an empty path it is kept in memory only (h5_file).
  subroutine put_frame(world, scene, clock, particles, path, error)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    real(sp), allocatable :: outputs(:, :)
    type(law_output_t), allocatable :: list(:)

    allocate (list, source=frame_outputs(scene))
    call pack_outputs(scene, particles, outputs)
    call write_frame(world, path, clock%time, int(clock%step), scene%grid%h, &
                     scene%body%mean_spacing(), scene%body%name, scene%body%material, &
                     scene%material%name, scene%layout%origin, particles, list%name, list%unit, &
                     outputs, scene%output%input_text, error)
  end subroutine put_frame

  !> Collective. Write a row of the history, the probes and the errors; check for warnings.
  subroutine row(self, world, scene, clock, step, tool, backing, probes, particles, budget, history)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(in) :: particles
    type(budget_t), intent(in) :: budget
    type(history_t), intent(inout) :: history
    type(row_t) :: columns

    if (history%row_time >= clock%time .and. history%rows > 0) return   ! written already
    call history_row(world, scene, clock, step, tool, backing, particles, budget, history, columns)
    call self%warnings%check(world, scene, clock, step, tool, particles, budget, history, columns)
    call self%history%row(columns%values())
    if (probes%n > 0) then
      call share_probes(world, probes)
      columns = probe_row(clock, probes)
      call self%probes%row(columns%values())
    end if
    if (has_fields(scene)) then
      call error_row(world, scene, clock, particles, columns)
      call self%errors%row(columns%values())
    end if
    history%rows = history%rows + 1
    step%lost_row = self%history%is_lost() .or. self%probes%is_lost() .or. self%errors%is_lost() &
                    .or. self%tracers%is_lost()
  end subroutine row

  !> Collective. Write NAME_summary.json; log speed, mass scaling and the tool faces.
  subroutine write_summary(self, world, scene, clock, tool, history, blocks, nodes, exchange, &
                           timer, error)
    class(writer_t), intent(in) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(history_t), intent(in) :: history
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(in) :: nodes
    type(exchange_t), intent(in) :: exchange
    type(phase_timer_t), intent(in) :: timer
    type(error_t), intent(inout) :: error

    call self%progress%write_summary(world, scene, clock, blocks, nodes, exchange, timer, &
                                     self%warnings%melting%json()//faces_json(scene, tool, &
                                     history), error)
    if (world%is_root() .and. .not. scene%output%is_quiet) then
      call self%warnings%log_inertial_stress(scene, clock)
      call log_faces(scene, tool, history)
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

end module output_writer
