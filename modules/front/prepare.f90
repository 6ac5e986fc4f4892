! SPDX-License-Identifier: MIT
!> Preparation of a simulation from an input file or a checkpoint.
module front_prepare
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_world, only: world_t
  use front_command_line, only: command_t
  use front_help, only: log_sources
  use input_reading, only: read_input, read_input_text
  use input_resolved, only: folder_of_files, scene_text, sums_of_files
  use input_values, only: input_t
  use io_checkpoint, only: notes_t, read_checkpoint_notes
  use mpm_prescribed, only: start_fields
  use particles_migrate, only: find_outside
  use run_balance, only: make_first_partition
  use run_loop, only: begin
  use run_regrid, only: regrid
  use run_restart, only: resume
  use setup_check_process, only: check_process
  use setup_check_restart, only: compare_files, compare_scenes
  use setup_check_sense, only: check_necking, check_sense
  use setup_check_sheets, only: check_sheets
  use setup_fields, only: add_noise
  use setup_filling, only: count_particles, fill_bodies, load_bodies, stretch_bodies, &
                           update_probe_temperatures
  use setup_keys, only: key_table
  use setup_scene, only: build_scene
  use setup_volumes, only: check_memory, check_volumes, measure_volumes, volumes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: read_scene, place_particles

contains

  !> Collective. Read and check the input; print all errors.
  subroutine read_scene(world, command, sim, input, counts, volumes, is_good)
    type(world_t), intent(in) :: world
    type(command_t), intent(in) :: command
    type(simulation_t), intent(inout) :: sim
    type(input_t), intent(out) :: input
    integer(i8), allocatable, intent(out) :: counts(:)   !! particles of each body
    type(volumes_t), allocatable, intent(out) :: volumes(:)   !! volumes of each body
    logical, intent(out) :: is_good                      !! no errors
    type(notes_t) :: notes
    type(input_t) :: old
    real(rp), allocatable :: shares(:)
    logical :: is_read

    sim%world = world
    call read_texts(world, command, input, old, notes, is_read)
    if (is_read) then
      if (input%has_required_groups() .and. input%has_metals() .and. &
          (input%diagnostics%count() == 0 .or. input%is_short())) then
        call build_scene(input, sim%scene, sim%tool, sim%backing, sim%hook, sim%probes, sim%tracers)
        sim%clock%mass_scaling = sim%scene%method%mass_scaling
      end if
    end if
    if (input%diagnostics%count() == 0 .and. command%restart /= '') then
      call compare_with_checkpoint(command, input, old, notes, sim%scene)
    end if
    if (input%diagnostics%count() == 0) call check_memory(world, input, sim%scene)
    if (input%diagnostics%count() == 0) then
      call check_scene(world, input, sim%scene, sim%tool, counts, shares, volumes)
    end if
    is_good = input%diagnostics%count() == 0
    if (.not. is_good) then
      if (world%is_root()) call input%diagnostics%print()
      call world%barrier()
      return
    end if
    if (world%is_root() .and. command%restart == '' .and. command%action /= 'where') then
      call log_sources(input)
      call input%diagnostics%print(warnings=.true.)
    end if
    if (sim%scene%method%has_mechanics) then
      call stretch_bodies(input, sim%scene)
      call load_bodies(input, shares, sim%scene)
      call update_probe_temperatures(input, sim%scene, sim%probes)
    end if
    sim%scene%output%input_text = input%text_of_file()
    sim%scene%output%scene_text = scene_text(input)
    sim%scene%output%files = sums_of_files(input)
    sim%scene%output%folder = folder_of_files(input)
    sim%scene%output%run = notes%run
    sim%scene%output%is_quiet = command%is_quiet
    sim%scene%output%directory = sim%scene%output%name//'.out'
    if (command%input == '') sim%scene%output%directory = folder_of(command%restart)
    if (command%directory /= '') sim%scene%output%directory = command%directory
  end subroutine read_scene

  !> Collective. Read the texts of the input and of the checkpoint. `is_read`: the metadata of the
  !> checkpoint could be read.
  subroutine read_texts(world, command, input, old, notes, is_read)
    type(world_t), intent(in) :: world
    type(command_t), intent(in) :: command
    type(input_t), intent(out) :: input   !! input of the run
    type(input_t), intent(out) :: old     !! scene of the checkpoint
    type(notes_t), intent(out) :: notes
    logical, intent(out) :: is_read
    type(error_t) :: error
    character(1) :: no_sets(0)

    if (command%restart /= '') call read_checkpoint_notes(world, command%restart, notes, error)
    is_read = .not. error%is_set()
    if (.not. is_read) then
      allocate (input%diagnostics)
      call input%diagnostics%add('stirpoint', 0, error%message)
      return
    end if
    if (command%restart /= '') call read_input_text(key_table(), command%restart, notes%scene, &
                                                    no_sets, old, resumed=.true.)
    if (command%input /= '') then
      call read_input(key_table(), command%input, command%overrides, input)
    else
      call read_input_text(key_table(), command%restart//', input', notes%input, &
                           command%overrides, input, resumed=.true.)
      call input%set_default('RUN', 'NAME', old%text('RUN', 1, 'NAME'))
      if (allocated(notes%folder)) input%folder = notes%folder
    end if
  end subroutine read_texts

  !> Report differences from the checkpoint that a restart may not have: keys, content of files,
  !> layout of the particles.
  subroutine compare_with_checkpoint(command, input, old, notes, scene)
    type(command_t), intent(in) :: command
    type(input_t), intent(in) :: input
    type(input_t), intent(inout) :: old
    type(notes_t), intent(in) :: notes
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: error

    error = ''
    if (old%diagnostics%count() > 0) error = old%diagnostics%text(1)
    old%folder = folder_of_files(input)          ! compare_files compares the content of the files
    call compare_scenes(old, input, notes%time)
    call compare_files(notes%files, input, notes%time)
    if (error /= '') then
      call input%diagnostics%add(command%restart, 0, 'its scene is that of another version of '// &
                                 'the program: '//error)
    else if (input%diagnostics%count() == 0 .and. scene%method%has_mechanics &
             .and. notes%layout /= scene%layout%places()) then
      call input%diagnostics%add(command%restart, 0, 'its particles are those of another '// &
                                 'version of the program, which must continue it')
    end if
  end subroutine compare_with_checkpoint

  !> Collective. Check the plausibility of the scene, and with mechanics the motion of the tools and
  !> the particles: their numbers and volumes for each body.
  subroutine check_scene(world, input, scene, tools, counts, shares, volumes)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    integer(i8), allocatable, intent(out) :: counts(:)
    !> Volume of each body over that of a particle (load_bodies).
    real(rp), allocatable, intent(out) :: shares(:)
    type(volumes_t), allocatable, intent(out) :: volumes(:)
    integer :: b

    call check_sense(input, scene, tools)
    if (.not. scene%method%has_mechanics) return
    call check_necking(input, scene)
    call check_sheets(input, scene, tools)
    call check_process(input, scene, tools)
    allocate (counts(size(scene%body)), shares(size(scene%body)))
    call count_particles(world, input, scene, counts, shares)
    do b = 1, size(counts)
      if (counts(b) == 0) call input%report('BODY', b, 'NAME', &
        'holds no particle: its shapes are smaller than the particle spacing or cancel out')
    end do
    call measure_volumes(world, input, scene, volumes)
    if (all(counts > 0)) call check_volumes(input, volumes)
  end subroutine check_scene

  !> Folder of the checkpoint, the default results folder of a resumed run without an input file.
  pure function folder_of(checkpoint) result(folder)
    character(*), intent(in) :: checkpoint
    character(:), allocatable :: folder
    integer :: slash

    slash = index(checkpoint, '/', back=.true.)
    folder = '.'
    if (slash > 0) folder = checkpoint(:max(1, slash - 1))
  end function folder_of

  !> Collective. Set up particles, partition and sums, or read them from the checkpoint.
  subroutine place_particles(world, command, input, sim, error)
    type(world_t), intent(in) :: world
    type(command_t), intent(in) :: command
    type(input_t), intent(in) :: input
    type(simulation_t), intent(inout) :: sim
    type(error_t), intent(inout) :: error
    character(:), allocatable :: outside

    call sim%prepare_scratch()
    if (command%restart /= '') then
      call resume(sim, command%restart, error)
      return
    end if
    call fill_bodies(world, input, sim%scene, sim%particles)
    call add_noise(input, sim%scene, sim%particles)
    call start_fields(sim%scene, sim%particles)
    call world%share_message(find_outside(sim%scene%grid, sim%particles%nblk, sim%particles), &
                             outside)
    if (outside /= '') call error%raise(outside//' (at the start)')
    if (error%is_set()) return
    call make_first_partition(sim)
    call regrid(sim)
    call begin(sim)
    call sim%tracers%choose(world, sim%scene%grid, sim%particles)
  end subroutine place_particles

end module front_prepare
