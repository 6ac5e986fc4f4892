! SPDX-License-Identifier: MIT
!> Output of a heat-only run and its times: frames, history, probes, progress, summary.
module heat_alone_files
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, rp, sp
  use base_log, only: log_line
  use base_system, only: peak_memory
  use base_text, only: str
  use base_timers, only: cpu_seconds, wall_time
  use heat_alone_state, only: heat_run_t, read_probes, sample_cells, save_heat
  use heat_linear, only: by_cg, euler, method_names, rkl2, solver_names
  use heat_rates, only: b_film, b_source, n_heats
  use io_frames, only: frame_name, write_heat_frame, write_series
  use io_histories, only: row_t, table_t
  use output_guards, only: melting_json, melting_t
  use output_progress, only: progress_t, run_json
  use output_writer, only: next_time
  use state_scene, only: output_t, scene_t
  implicit none (type, external)
  private

  public :: heat_writer_t

  character(*), parameter :: nl = new_line('a')

  !> Open files, and the state of the output.
  type :: heat_writer_t
    type(table_t) :: history, probes
    character(32), allocatable :: probe(:)    !! names of the probes
    type(progress_t) :: progress
    !> Times of the next row, frame and checkpoint [s].
    real(rp) :: next_row = 0.0_rp, next_frame = 0.0_rp, next_checkpoint = 0.0_rp
    real(rp) :: secured = 0.0_rp              !! wall-clock time of the last checkpoint [s]
    integer(i8) :: saved_step = -1            !! step of the last checkpoint
    type(melting_t), private :: melting
  contains
    procedure :: init, write_due, next_event, write_summary, sync
    procedure :: close => close_files
  end type heat_writer_t

contains

  !> Open the tables; a resumed run appends to the existing ones.
  subroutine init(self, scene, names, run, is_resumed, error)
    class(heat_writer_t), intent(inout) :: self
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: names(:)      !! names of the probes
    type(heat_run_t), intent(inout) :: run
    logical, intent(in) :: is_resumed
    type(error_t), intent(inout) :: error
    character(:), allocatable :: stem
    type(row_t) :: columns, probes
    integer(i8) :: rows

    call self%progress%init(scene%output, run%time, run%integrator%steps)
    self%secured = self%progress%started
    rows = merge(run%rows, -1_i8, is_resumed)
    stem = scene%output%directory//'/'//scene%output%name
    allocate (self%probe, source=names)
    call make_heat_row(run, names, columns, probes)
    call self%history%open(run%heat%world, stem//'_history.csv', scene%title, columns%headings(), &
                           rows, run%row_time, error)
    if (size(names) > 0) then
      call self%probes%open(run%heat%world, stem//'_probes.csv', scene%title, probes%headings(), &
                            rows, run%row_time, error)
    end if
    if (.not. is_resumed) return
    call write_series(run%heat%world, scene%output%directory, scene%output%name, run%frame_times, &
                      error)
    self%saved_step = run%integrator%steps
    call set_times(self, scene%output, run%time)
  end subroutine init

  !> Set the times of the next outputs.
  subroutine set_times(self, output, time)
    class(heat_writer_t), intent(inout) :: self
    type(output_t), intent(in) :: output
    real(rp), intent(in) :: time

    self%next_row = next_time(output%history_interval, time)
    self%next_frame = next_time(output%frame_interval, time)
    self%next_checkpoint = next_time(output%checkpoint_interval, time)
  end subroutine set_times

  !> Time at which a step must end for output [s]. Checkpoints do not limit the steps, so that they
  !> do not change the results.
  pure real(rp) function next_event(self)
    class(heat_writer_t), intent(in) :: self

    next_event = min(self%next_row, self%next_frame)
  end function next_event

  !> Write the output due at the current time, rows before a checkpoint, which stores their number.
  !> At the end of a run write a checkpoint, then a row and a frame, which a restart drops if they
  !> were not due.
  subroutine write_due(self, scene, run, last, is_safety_due, error)
    class(heat_writer_t), intent(inout) :: self
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    logical, intent(in) :: last, is_safety_due
    type(error_t), intent(inout) :: error
    real(rp) :: now
    logical :: is_due

    now = run%time*(1.0_rp + 1.0e-12_rp)
    if (now >= self%next_row .and. run%row_time < run%time) call write_row(self, scene, run)
    if (now >= self%next_frame) call add_frame(scene, run, error)
    is_due = (last .or. is_safety_due .or. now >= self%next_checkpoint) .and. &
             self%saved_step < run%integrator%steps
    if (is_due) then
      self%saved_step = run%integrator%steps
      call self%sync()
      if (run%heat%world%all_true(.not. run%lost_row)) call save_heat(scene, run, error)
      self%secured = wall_time()
    end if
    call set_times(self, scene%output, run%time)
    if (.not. last) return
    if (run%row_time < run%time) call write_row(self, scene, run)
    call add_frame(scene, run, error)
  end subroutine write_due

  !> Write a row of the history and of the probes.
  subroutine write_row(self, scene, run)
    class(heat_writer_t), intent(inout) :: self
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    type(row_t) :: columns, probes

    call make_heat_row(run, self%probe, columns, probes)
    call self%history%write_row(columns%values())
    if (size(self%probe) > 0) call self%probes%write_row(probes%values())
    if (any(scene%material%t_melt < huge(1.0_rp))) then
      call self%melting%update(run%heat%world, scene, sample_cells(scene, run), run%time, &
                               run%molten)
    end if
    run%row_time = run%time
    run%row_heats = run%integrator%heats
    run%rows = run%rows + 1
    run%lost_row = self%history%is_lost() .or. self%probes%is_lost()
  end subroutine write_row

  !> Collective. Values of a row of the history and of the probes.
  subroutine make_heat_row(run, names, columns, probes)
    type(heat_run_t), intent(in) :: run
    character(*), intent(in) :: names(:)      !! names of the probes
    type(row_t), intent(out) :: columns, probes
    real(rp) :: sums(3), largest(1), error, in, out, power(n_heats)
    real(rp), allocatable :: t(:), read(:)
    integer :: n

    n = run%heat%size()
    allocate (t(n), read(size(names)))
    associate (heat => run%heat, capacity => run%heat%mesh%capacity)
      call heat%temperatures(heat%theta, t)
      sums = [heat%content(heat%theta, 0.0_rp), sum(capacity*t), sum(capacity)]
      largest = maxval([0.0_rp, pack(t, capacity > 0.0_rp)])
    end associate
    call run%heat%world%sum(sums)
    call run%heat%world%max(largest)
    in = run%integrator%heats(b_source)
    out = run%integrator%heats(b_film)
    error = sums(1) - run%content0 - in + out
    error = 100.0_rp*error/max(abs(in) + abs(out), 1.0e-6_rp*abs(run%content0), tiny(1.0_rp))
    power = 0.0_rp
    if (run%time > run%row_time) then
      power = (run%integrator%heats - run%row_heats)/(run%time - run%row_time)
    end if
    call columns%add('time', 's', run%time)
    call columns%add('step', '', real(run%integrator%steps, rp))
    call columns%add('dt', 's', run%integrator%last)
    call columns%add('heat_content', 'J', sums(1))
    call columns%add('source_heat', 'J', in)
    call columns%add('film_loss', 'J', out)
    call columns%add('balance_error', '%', error)
    call columns%add('temperature_max', 'K', largest(1))
    call columns%add('temperature_mean', 'K', sums(2)/sums(3))
    call columns%add('source_power', 'W', power(b_source))
    call columns%add('film_power', 'W', power(b_film))
    call read_probes(run%heat%world, run, read)
    call probes%add('time', 's', run%time)
    do n = 1, size(names)
      call probes%add(names(n), 'K', read(n))
    end do
  end subroutine make_heat_row

  !> Collective. Write a frame with the cells of the solid as points, and update the index file.
  subroutine add_frame(scene, run, error)
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    type(error_t), intent(inout) :: error
    integer, allocatable :: cells(:)
    real(sp), allocatable :: x(:, :), t(:)
    integer :: c

    if (size(run%frame_times) > 0) then
      if (run%frame_times(size(run%frame_times)) >= run%time) return   ! written already
    end if
    associate (output => scene%output, mesh => run%heat%mesh, heat => run%heat)
      cells = pack([(c, c=1, heat%size())], mesh%capacity > 0.0_rp)
      allocate (x(3, size(cells)), t(size(cells)))
      do c = 1, size(cells)
        x(:, c) = real(mesh%centre(cells(c)), sp)
        t(c) = real(heat%property%temperature_at(heat%theta(cells(c))), sp)
      end do
      call write_heat_frame(run%heat%world, output%directory//'/'// &
                            frame_name(output%name, size(run%frame_times)), run%time, &
                            int(run%integrator%steps), scene%grid%h, scene%body%name, x, t, &
                            mesh%body(cells), output%input_text, error)
      if (error%is_set()) return
      run%frame_times = [run%frame_times, run%time]
      call write_series(run%heat%world, output%directory, output%name, run%frame_times, error)
    end associate
  end subroutine add_frame

  !> Collective. Log the cost of the run and write NAME_summary.json.
  subroutine write_summary(self, scene, run, error)
    class(heat_writer_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(in) :: run
    type(error_t), intent(inout) :: error
    real(rp) :: cost(2), wall
    character(:), allocatable :: solver

    wall = max(wall_time() - self%progress%started, 1.0e-9_rp)
    cost = [cpu_seconds() - self%progress%cpu_started, peak_memory()]
    call run%heat%world%sum(cost)
    if (.not. run%heat%world%is_root()) return
    solver = 'none'
    if (run%integrator%method /= rkl2 .and. run%integrator%method /= euler) then
      solver = trim(solver_names(max(by_cg, run%integrator%implicit%solver)))
    end if
    associate (steps => run%integrator%steps - self%progress%first_step, &
               linear => run%integrator%implicit%linear)
      call write_whole(scene%output%directory//'/'//scene%output%name//'_summary.json', '{'//nl// &
                       run_json(run%heat%world%size, steps, wall, cost(1), cost(2))//nl// &
                       melting_json(run%molten)//nl//'  "cells": '//str(run%cells)//','//nl// &
                       '  "refused_steps": '//str(run%integrator%refused)//','//nl// &
                       '  "evaluations": '//str(run%heat%evaluations)//','//nl// &
                       '  "integrator": "'//trim(method_names(run%integrator%method))//'",'//nl// &
                       '  "solver": "'//solver//'",'//nl//'  "linear_solves": '// &
                       str(linear%solves)//','//nl//'  "linear_iterations": '// &
                       str(linear%iterations)//nl//'}'//nl, error)
    end associate
    if (.not. scene%output%is_quiet) then
      call log_line(str(run%integrator%steps - self%progress%first_step)//' steps ('// &
                    trim(method_names(run%integrator%method))//', '//str(run%heat%evaluations)// &
                    ' evaluations) of '//str(run%cells)//' cells in '//str(wall)//' s on '// &
                    str(run%heat%world%size)//' rank(s)')
    end if
  end subroutine write_summary

  !> Flush the rows to disk, before a checkpoint that stores their number.
  subroutine sync(self)
    class(heat_writer_t), intent(inout) :: self

    call self%history%sync()
    call self%probes%sync()
  end subroutine sync

  subroutine close_files(self, error)
    class(heat_writer_t), intent(inout) :: self
    type(error_t), intent(inout) :: error

    call self%history%close(error)
    call self%probes%close(error)
  end subroutine close_files

end module heat_alone_files
