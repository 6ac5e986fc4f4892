! SPDX-License-Identifier: MIT
!> Checkpoints of a simulation.
module output_checkpoint
  use base_errors, only: error_t
  use base_kinds, only: rp
  use comm_world, only: world_t
  use io_checkpoint, only: notes_t, write_checkpoint
  use mapping_probes, only: share_probes
  use simulation_parts, only: simulation_t
  use state_scene, only: output_t, scene_t
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
    last = [sim%step%last%stiffness, sim%step%last%speed2]
    call world%max(last)
    associate (c => sim%clock)
      global = [real(c%step, rp), c%time, c%dt, c%displacement, real(c%sorted_at, rp), &
                c%heat_time, c%max_speed, c%stiffness, sim%history%kinetic0, &
                sim%history%elastic0, sim%history%audit_scale, sim%history%row_time, &
                real(sim%probes%n, rp), real(size(sim%history%frame_times), rp), last, &
                real(c%refused, rp), sim%clock%mass_scaling, c%inertial_peak, c%heat_step, &
                real(sim%history%rows, rp), real(sim%sleepers%motion%box%lo, rp), &
                real(sim%sleepers%motion%box%hi, rp), sim%sleepers%motion%time]
    end associate
    if (sim%probes%n > 0) global = [global, reshape(sim%probes%x, [3*sim%probes%n]), &
                                    sim%probes%temperature]
    global = [global, sim%history%frame_times]
    global = [global, reshape(sim%history%row_impulse, [size(sim%history%row_impulse)])]
    global = [global, reshape(sim%history%row_sums, [size(sim%history%row_sums)])]
    do k = 1, size(sim%tool)
      if (sim%tool(k)%drive%is_free) global = [global, sim%tool(k)%drive%state()]
      global = [global, sim%tool(k)%monitor%state(sim%tool(k)%motion, sim%tool(k)%n_phases)]
      global = [global, sim%tool(k)%heat%state()]
    end do
    do k = 1, size(sim%backing)
      global = [global, sim%backing(k)%state()]
    end do
    if (sim%tracers%n > 0) global = [global, real(sim%tracers%rows, rp), sim%tracers%row_time, &
                                     real(sim%tracers%id, rp)]
    local = [sim%budget%sums, real(sim%budget%failed_returns, rp), sim%budget%warnings, &
             reshape(sim%budget%impulse, [size(sim%budget%impulse)])]
    do k = 1, size(sim%tool)
      local = [local, sim%tool(k)%sums]
    end do
    if (allocated(sim%sleepers%motion%sums)) then
      local = [local, reshape(sim%sleepers%motion%sums, [size(sim%sleepers%motion%sums)])]
    end if
    call make_notes(sim%scene%output, sim%clock%time, notes)
    notes%layout = sim%scene%layout%places()
    file = checkpoint_path(sim%scene)
    if (present(path)) file = path
    call write_checkpoint(world, file, sim%particles, sim%exchange%boxes, global, local, notes, &
                          error)
  end subroutine save_checkpoint

end module output_checkpoint
