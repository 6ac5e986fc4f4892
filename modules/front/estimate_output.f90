! SPDX-License-Identifier: MIT
!> Cost of the output of a run, from one row of each table, one frame and one checkpoint, with the
!> files in memory (h5_file); disk time is not included.
module front_estimate_output
  use base_errors, only: error_t
  use base_kinds, only: rp
  use base_timers, only: cpu_seconds
  use comm_world, only: world_t
  use heat_alone_checkpoint, only: save_heat
  use heat_alone_files, only: make_heat_row, put_heat_frame
  use heat_alone_melting, only: sample_cells
  use heat_alone_state, only: heat_run_t
  use io_row, only: row_t
  use output_checkpoint, only: save_checkpoint
  use output_error_norms, only: error_row, has_fields
  use output_history, only: history_row
  use output_melting, only: melt_sample_t
  use output_tracers, only: tracer_rows
  use output_writer, only: put_frame
  use state_scene, only: output_t, scene_t
  use step_simulation, only: simulation_t
  implicit none (type, external)
  private

  public :: heat_output_seconds, output_seconds

contains

  !> Collective. Processor time of all ranks for the output of a run [s]; the simulation cannot be
  !> used afterwards.
  real(rp) function output_seconds(world, sim, end, steps) result(seconds)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: end                    !! end of the run [s]
    real(rp), intent(in) :: steps                  !! number of steps of the run
    type(error_t) :: error
    type(row_t) :: columns
    character(:), allocatable :: text
    real(rp) :: spent(5)
    integer :: n

    if (.not. allocated(sim%history%frame_times)) allocate (sim%history%frame_times(0))
    spent(1) = cpu_seconds()
    call history_row(world, sim%scene, sim%clock, sim%step, sim%tool, sim%backing, &
                     sim%particles, sim%budget, sim%history, columns)
    if (has_fields(sim%scene)) then
      call error_row(world, sim%scene, sim%clock, sim%particles, columns)
    end if
    spent(2) = cpu_seconds()
    call put_frame(world, sim%scene, sim%clock, sim%particles, '', error)
    spent(3) = cpu_seconds()
    call save_checkpoint(world, sim%scene, sim%clock, sim%step, sim%tool, sim%backing, sim%probes, &
                         sim%tracers, sim%particles, sim%sleepers, sim%exchange, sim%budget, &
                         sim%history, error, '')
    spent(4) = cpu_seconds()
    if (sim%tracers%n > 0) then
      call tracer_rows(world, sim%scene, sim%particles, sim%tracers, sim%clock%time, &
                       spread(.true., 1, size(sim%tracers%interval)), text, n)
    end if
    spent(5) = cpu_seconds()
    call world%sum(spent)
    seconds = total_of(sim%scene%output, end, steps, spent(2:4) - spent(1:3))
    if (sim%tracers%n == 0) return
    do n = 1, size(sim%tracers%interval)
      seconds = seconds + (2.0_rp + outputs_between(sim%tracers%interval(n), end, steps)) &
                *(spent(5) - spent(4))*count(sim%tracers%group == n)/sim%tracers%n
    end do
  end function output_seconds

  !> Collective. Processor time of all ranks for the output of a heat-only run [s].
  real(rp) function heat_output_seconds(world, scene, names, run, steps) result(seconds)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: names(:)           !! names of the probes
    type(heat_run_t), intent(inout) :: run
    real(rp), intent(in) :: steps
    type(error_t) :: error
    type(row_t) :: columns, probes
    type(melt_sample_t) :: seen
    real(rp) :: spent(4)

    spent(1) = cpu_seconds()
    call make_heat_row(world, run, names, columns, probes)
    seen = sample_cells(scene, run)
    spent(2) = cpu_seconds()
    call put_heat_frame(world, scene, run, '', error)
    spent(3) = cpu_seconds()
    call save_heat(world, scene, run, error, '')
    spent(4) = cpu_seconds()
    call world%sum(spent)
    seconds = total_of(scene%output, scene%end_time, steps, spent(2:4) - spent(1:3))
  end function heat_output_seconds

  !> Time for all rows, frames and checkpoints of a run with the times `each` of one [s], including
  !> those at the start and the end.
  pure real(rp) function total_of(output, end, steps, each)
    type(output_t), intent(in) :: output
    real(rp), intent(in) :: end, steps, each(3)

    total_of = each(1)*(2.0_rp + outputs_between(output%history_interval, end, steps)) &
             + each(2)*(2.0_rp + outputs_between(output%frame_interval, end, steps)) &
             + each(3)*(1.0_rp + outputs_between(output%checkpoint_interval, end, steps))
  end function total_of

  !> Number of outputs between start and end, at most one per step.
  pure real(rp) function outputs_between(interval, end, steps)
    real(rp), intent(in) :: interval, end, steps   !! [s], [s], [-]

    outputs_between = 0.0_rp
    if (interval <= 0.0_rp) return
    outputs_between = max(0.0_rp, min(steps - 1.0_rp, aint(end/interval*(1.0_rp - 1.0e-9_rp))))
  end function outputs_between

end module front_estimate_output
