! SPDX-License-Identifier: MIT
!> Stirpoint: friction stir processing with the Material Point Method.
program stirpoint
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, rp
  use base_log, only: close_log, log_is_lost, log_line, open_log, write_log
  use base_system, only: leave_signals, note_step, stop_signal, watch_signals
  use base_text, only: str
  use base_version, only: version_text
  use base_world, only: agree, end_world, mpi_text, start_world, world_t
  use front_command_line, only: command_t, read_command
  use front_help, only: print_help, print_keys_of, print_library, print_template
  use front_material_driver, only: drive_material
  use front_prepare, only: place_particles, read_scene
  use front_report, only: report_heat_scene, report_scene, warn_of_overlap
  use heat_alone_loop, only: begin_heat, run_heat
  use heat_alone_state, only: heat_run_t
  use heat_petsc, only: end_petsc
  use input_resolved, only: resolved_text
  use input_values, only: input_t
  use io_folder, only: clear_folder, lock_folder
  use run_loop, only: ended_by_signal, ended_io, ended_well, run
  use setup_heat_scene, only: build_heat_scene
  use setup_sinks, only: log_heat_shares
  use setup_volumes, only: volumes_t
  use state_parts, only: free_simulation, simulation_t
  use state_scene, only: output_t
  implicit none (type, external)

  integer, parameter :: bad_input = 2
  type(world_t) :: world
  type(command_t) :: command
  logical :: ok
  integer :: status

  call watch_signals()
  call start_world(world)
  call read_command(command)
  if (command%action /= 'run') call leave_signals()
  status = ended_well
  if (command%problem /= '') then
    if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', command%problem
    status = bad_input
  else
    select case (command%action)
    case ('help', 'keys', 'materials', 'new', 'pairs')
      ok = .true.
      if (world%is_root()) call print_information(ok)
      if (.not. world%all_true(ok)) status = bad_input
    case ('version')
      if (world%is_root()) write (output_unit, '(a)') version_text(mpi_text())
    case ('material')
      call drive_material(world, command, ended_io, status)
    case default
      call simulate(status)
    end select
  end if
  call close_log()
  flush (output_unit)
  if (.not. world%all_true(.not. log_is_lost()) .and. status == ended_well) status = ended_io
  call end_petsc()
  call world%barrier()
  call end_world()
  if (status /= 0) stop status, quiet=.true.

contains

  !> Print output that needs no input file.
  subroutine print_information(ok)
    logical, intent(out) :: ok

    select case (command%action)
    case ('help')
      call print_help()
    case ('keys')
      call print_keys_of(command%topic, ok)
    case ('new')
      call print_template(command%topic, ok)
    case ('pairs')
      call print_library('PAIR', ok)
    case default
      call print_library('MATERIAL', ok)
    end select
  end subroutine print_information

  !> Check or run the scene.
  subroutine simulate(status)
    integer, intent(inout) :: status
    type(simulation_t) :: sim
    type(input_t) :: input
    type(error_t) :: error
    integer(i8), allocatable :: counts(:)
    type(volumes_t), allocatable :: volumes(:)
    character(:), allocatable :: message
    logical :: ok

    call read_scene(world, command, sim, input, counts, volumes, ok)
    if (.not. ok) then
      status = bad_input
      return
    end if
    if (command%action == 'where') then
      if (world%is_root()) write (output_unit, '(3a)') sim%scene%output%directory, '/', &
        sim%scene%output%name
      return
    end if
    if (is_stopped(status)) return
    if (.not. sim%scene%method%has_mechanics) then
      call simulate_heat(sim, input, status)
      return
    end if
    call place_particles(world, command, input, sim, error)
    if (error%is_set()) then
      status = bad_input
      if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', error%message
      call free_simulation(sim)
      return
    end if
    if (command%restart == '') then
      call warn_of_overlap(world, input, command%overrides, sim%scene, sim%tool, sim%particles)
    end if
    if (command%action == 'check') then
      call report_scene(world, input, sim, counts, volumes, command%topic == '')
    else if (.not. is_stopped(status)) then
      call note_step(sim%clock%step)
      call open_results(input, sim%scene%output, sim%history%frame_times, status)
      if (world%is_root() .and. .not. command%is_quiet) call log_heat_shares(sim%scene, sim%tool)
      if (status == ended_well) call run(sim, command%restart /= '', status, message)
      call report_end(sim, status, message)
    end if
    call free_simulation(sim)
  end subroutine simulate

  !> Check or run a heat-only scene.
  subroutine simulate_heat(sim, input, status)
    type(simulation_t), intent(inout) :: sim
    type(input_t), intent(in) :: input
    integer, intent(inout) :: status
    type(heat_run_t) :: heat
    type(error_t) :: error
    character(:), allocatable :: message

    call build_heat_scene(world, input, sim%scene, heat)
    call begin_heat(sim%probes, heat, command%restart, error)
    if (error%is_set()) then
      status = bad_input
      if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', error%message
    else if (command%action == 'check') then
      call report_heat_scene(world, sim%scene, heat, command%topic == '')
    else if (.not. is_stopped(status)) then
      call note_step(0_i8)
      call open_results(input, sim%scene%output, heat%frame_times, status)
      if (status == ended_well) call run_heat(sim%scene, sim%probes, heat, command%restart /= '', &
                                              status, message)
      call report_end(sim, status, message)
    end if
  end subroutine simulate_heat

  !> Reserve the results folder, move files of other runs aside, open the log and save the input.
  subroutine open_results(input, output, frame_times, status)
    type(input_t), intent(in) :: input
    type(output_t), intent(inout) :: output
    real(rp), allocatable, intent(in) :: frame_times(:)   !! times of frames of this run so far [s]
    integer, intent(inout) :: status
    type(error_t) :: error
    character(:), allocatable :: note
    logical :: is_locked
    integer :: frames

    frames = 0
    if (allocated(frame_times)) frames = size(frame_times)
    call lock_folder(world, output%directory, output%name, note, is_locked, error)
    if (world%is_root() .and. note /= '') call log_line(note)
    if (.not. error%is_set()) then
      call clear_folder(world, output%directory, output%name, output%run, command%restart, frames, &
                        command%overwrites, note, error)
      if (world%is_root() .and. note /= '') call log_line(note)
    end if
    if (world%is_root() .and. .not. error%is_set()) then
      call open_log(output%directory//'/'//output%name//'.log', appends=command%restart /= '')
      call write_whole(output%directory//'/'//output%name//'_input.nml', resolved_text(input), &
                       error)
    end if
    call agree(world, error)
    if (error%is_set()) then
      status = merge(bad_input, ended_io, is_locked)
      if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', error%message
    end if
  end subroutine open_results

  !> Collective. True if a signal arrived before the run began.
  logical function is_stopped(status)
    integer, intent(inout) :: status
    real(rp) :: number(1)

    number = real(stop_signal(), rp)
    call world%max(number)
    is_stopped = number(1) > 0.0_rp
    if (.not. is_stopped) return
    status = ended_by_signal
    if (world%is_root()) write (error_unit, '(a)') 'stirpoint: signal '//str(nint(number(1)))// &
      ' stopped the run before it began: nothing was written'
  end function is_stopped

  !> Report why the run ended, or where its results are; `message` is not allocated if it never
  !> began.
  subroutine report_end(sim, status, message)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: status
    character(:), allocatable, intent(in) :: message

    if (.not. world%is_root() .or. .not. allocated(message)) return
    if (status /= ended_well) then
      call write_log('stirpoint: '//message)
      call close_log()
      write (error_unit, '(2a)') 'stirpoint: ', message
    else
      call log_line('results in '//sim%scene%output%directory)
    end if
  end subroutine report_end

end program stirpoint
