! SPDX-License-Identifier: MIT
!> Stirpoint: friction stir processing with the Material Point Method.
program stirpoint
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use base_errors, only: error_t
  use base_kinds, only: i8
  use base_system, only: make_directory, watch_signals
  use base_version, only: version_text
  use comm_world, only: end_world, start_world, world_t
  use setup_command_line, only: command_t, print_help, read_command
  use setup_input, only: input_t
  use setup_material_driver, only: drive_material
  use setup_keys, only: print_keys, print_keys_markdown
  use setup_prepare, only: place_particles, read_scene
  use setup_report, only: report_scene, warn_of_overlap
  use time_loop, only: ended_io, ended_well, run
  use time_state, only: free_simulation, simulation_t
  implicit none (type, external)

  integer, parameter :: bad_input = 2
  type(world_t) :: world
  type(command_t) :: command
  integer :: status

  call start_world(world)
  call read_command(command)
  status = ended_well
  if (command%problem /= '') then
    if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', command%problem
    status = bad_input
  else
    select case (command%action)
    case ('help')
      if (world%is_root()) call print_help()
    case ('version')
      if (world%is_root()) write (output_unit, '(a)') version_text()
    case ('keys')
      if (world%is_root()) call print_keys(output_unit)
    case ('keys=markdown')
      if (world%is_root()) call print_keys_markdown(output_unit)
    case ('material')
      call drive_material(world, command, ended_io, status)
    case default
      call simulate(status)
    end select
  end if
  flush (output_unit)
  call world%barrier()
  call end_world()
  if (status /= 0) stop status, quiet=.true.

contains

  !> Check or run the scene.
  subroutine simulate(status)
    integer, intent(inout) :: status
    type(simulation_t) :: sim
    type(input_t) :: input
    type(error_t) :: error
    integer(i8), allocatable :: counts(:)
    character(:), allocatable :: message
    logical :: ok

    call read_scene(world, command, sim, input, counts, ok)
    if (.not. ok) then
      status = bad_input
      return
    end if
    call place_particles(world, command, input, sim, error)
    if (error%is_set()) then
      status = bad_input
      if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', error%message
      call free_simulation(sim)
      return
    end if
    if (command%restart == '') call warn_of_overlap(world, sim)
    if (command%action == 'check') then
      call report_scene(world, sim, counts)
    else
      call make_directory(sim%scene%output%directory, ok)
      if (.not. world%all_true(ok)) then
        status = ended_io
        if (world%is_root()) write (error_unit, '(2a)') &
          'stirpoint: error: cannot make directory ', sim%scene%output%directory
      else
        call watch_signals()
        call run(world, sim, command%restart /= '', status, message)
        if (world%is_root() .and. status /= ended_well) then
          write (error_unit, '(2a)') 'stirpoint: ', message
        end if
        if (world%is_root() .and. status == ended_well .and. .not. command%is_quiet) then
          write (output_unit, '(2a)') 'results in ', sim%scene%output%directory
        end if
      end if
    end if
    call free_simulation(sim)
  end subroutine simulate

end program stirpoint
