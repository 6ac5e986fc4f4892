! SPDX-License-Identifier: MIT
!> Checkpoints of a simulation.
module output_checkpoint
  use base_errors, only: error_t
  use base_kinds, only: rp
  use comm_world, only: world_t
  use contact_backing, only: backing_t
  use contact_tool, only: tool_t
  use exchange_ranks, only: exchange_t
  use io_checkpoint, only: notes_t, write_checkpoint
  use mapping_probes, only: probes_t, share_probes
  use output_audit, only: history_t
  use particles_store, only: particles_t
  use particles_tracers, only: tracers_t
  use sleep_sleepers, only: sleepers_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_scene, only: output_t, scene_t
  use state_step, only: step_t
  implicit none (type, external)
  private

  public :: save_checkpoint, checkpoint_path, broken_path, make_notes

  integer, parameter, public :: n_clock = 28   !! numbers in every checkpoint, whatever the scene

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
  !> file is kept in memory only (h5_file). The run is not changed.
  subroutine save_checkpoint(world, scene, clock, step, tool, backing, probes, tracers, particles, &
                             sleepers, exchange, budget, history, error, path)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    type(probes_t), intent(inout) :: probes
    type(tracers_t), intent(in) :: tracers
    type(particles_t), intent(in) :: particles
    type(sleepers_t), intent(in) :: sleepers
    type(exchange_t), intent(in) :: exchange
    type(budget_t), intent(in) :: budget
    type(history_t), intent(in) :: history
    type(error_t), intent(inout) :: error
    character(*), intent(in), optional :: path
    type(notes_t) :: notes
    character(:), allocatable :: file
    real(rp), allocatable :: global(:), local(:)
    real(rp) :: last(2)
    integer :: k

    call share_probes(world, probes)
    last = [step%last%stiffness, step%last%speed2]
    call world%max(last)
    associate (c => clock)
      global = [real(c%step, rp), c%time, c%dt, c%displacement, real(c%sorted_at, rp), &
                c%heat_time, &
                c%max_speed, c%stiffness, history%kinetic0, history%elastic0, history%audit_scale, &
                history%row_time, real(probes%n, rp), real(size(history%frame_times), rp), &
                last, real(c%refused, rp), clock%mass_scaling, c%inertial_peak, &
                c%heat_step, real(history%rows, rp), real(sleepers%motion%box%lo, rp), &
                real(sleepers%motion%box%hi, rp), sleepers%motion%time]
    end associate
    if (probes%n > 0) global = [global, reshape(probes%x, [3*probes%n]), probes%temperature]
    global = [global, history%frame_times]
    global = [global, reshape(history%row_impulse, [size(history%row_impulse)])]
    global = [global, reshape(history%row_sums, [size(history%row_sums)])]
    do k = 1, size(tool)
      if (tool(k)%drive%is_free) global = [global, tool(k)%drive%state()]
      global = [global, tool(k)%monitor%state(tool(k)%motion, tool(k)%n_phases)]
      global = [global, tool(k)%heat%state()]
    end do
    do k = 1, size(backing)
      global = [global, backing(k)%state()]
    end do
    if (tracers%n > 0) global = [global, real(tracers%rows, rp), tracers%row_time, &
                                 real(tracers%id, rp)]
    local = [budget%sums, real(budget%failed_returns, rp), budget%warnings, &
             reshape(budget%impulse, [size(budget%impulse)])]
    do k = 1, size(tool)
      local = [local, tool(k)%sums]
    end do
    if (allocated(sleepers%motion%sums)) then
      local = [local, reshape(sleepers%motion%sums, [size(sleepers%motion%sums)])]
    end if
    call make_notes(scene%output, clock%time, notes)
    notes%layout = scene%layout%places()
    file = checkpoint_path(scene)
    if (present(path)) file = path
    call write_checkpoint(world, file, particles, exchange%boxes, global, local, notes, error)
  end subroutine save_checkpoint

end module output_checkpoint
