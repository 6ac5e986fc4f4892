! SPDX-License-Identifier: MIT
!> The time loop: step, conduct heat, sort, write output, and stop with a checkpoint.
module run_loop
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_system, only: note_step
  use base_text, only: str
  use base_timers, only: ph_conduction, ph_exchange, ph_output, ph_sorting, wall_time
  use heat_conduction, only: conduct, conduction_is_due, conduction_step
  use mpm_blocks, only: start_rigid
  use mpm_prescribed, only: stagger_velocities
  use mpm_stability, only: domain_factor, stable_step
  use output_checkpoint, only: broken_path, checkpoint_path, save_checkpoint
  use output_diagnostics, only: is_finite, describe_failure
  use output_totals, only: energies, energies_t
  use output_writer, only: row_or_frame_is_due, writer_t
  use particles_migrate, only: find_outside
  use particles_store, only: f_vel
  use run_debris, only: remove_debris
  use run_mass_scaling, only: limit_mass
  use run_regrid, only: may_leave_cell, regrid
  use state_clock, only: clock_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use step_advance, only: take_step
  use step_drives, only: drive_tools, store_impulses
  use step_grid_motion, only: find_motion
  use step_room, only: keep_room
  implicit none (type, external)
  private

  public :: run, begin, advance

  ! Reasons for the end of a run: the exit status of the program.
  integer, parameter, public :: ended_well = 0, ended_broken = 3, ended_by_signal = 75, ended_io = 4

contains

  !> Initialise budget and clock of a fresh run, whose particles exist and are sorted.
  subroutine begin(sim)
    type(simulation_t), intent(inout) :: sim
    type(energies_t) :: now
    real(rp) :: energy(2), most(2)
    integer :: b, k, m

    call start_rigid(sim%scene, sim%tool, sim%particles)
    most = 0.0_rp
    do b = 1, sim%particles%nblk
      associate (ps => sim%particles%ps(1:sim%particles%count(b), :, b))
        most(2) = max(most(2), maxval(ps(:, f_vel)**2 + ps(:, f_vel + 1)**2 + ps(:, f_vel + 2)**2))
      end associate
    end do
    do m = 1, size(sim%scene%material)
      most(1) = max(most(1), sim%scene%material(m)%wave_speed()**2)
    end do
    do b = 1, size(sim%scene%body)
      most(1) = max(most(1), sim%scene%body(b)%start%wave2)
    end do
    if (sim%scene%layout%half > 0) most(1) = most(1) &
      *maxval([(domain_factor(sim%scene%grid%h, reshape(sim%scene%domain(b), [1, 3])), &
                b=1, size(sim%scene%body))])
    call sim%world%max(most)
    sim%clock%stiffness = most(1)
    sim%clock%max_speed = sqrt(most(2))
    sim%clock%now%last%stiffness = most(1)
    sim%clock%now%last%speed2 = most(2)
    call stagger_velocities(sim%scene, sim%clock, sim%particles, stable_step(sim%scene, sim%clock))
    now = energies(sim%scene, sim%clock, sim%particles, sim%nodes)
    energy = [now%kinetic, now%elastic]
    call sim%world%sum(energy)
    sim%history%kinetic0 = energy(1)
    sim%history%elastic0 = energy(2)
    do k = 1, size(sim%tool)
      call sim%tool(k)%move_to(0.0_rp)
    end do
  end subroutine begin

  !> Run to the end time, or until a signal or an instability stops the run.
  subroutine run(sim, is_resumed, status, message)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_resumed
    integer, intent(out) :: status
    character(:), allocatable, intent(out) :: message
    type(writer_t) :: writer
    type(error_t) :: error

    status = ended_well
    message = ''
    call writer%init(sim, is_resumed, error)
    if (.not. is_resumed) call writer%write_due(sim, .false., error)
    call sim%timer%start()
    do while (.not. is_finished(sim%scene, sim%clock) .and. .not. error%is_set())
      call note_step(sim%clock%step)
      call advance(sim, status, message)
      if (status == ended_broken) exit
      if (sim%clock%now%output_is_lost) exit
      call write_due(sim, writer, is_finished(sim%scene, sim%clock), status, message, error)
      if (status == ended_broken) exit
      call check_state(sim, status, message)
      call writer%progress%show_line(sim%world, sim%scene, sim%clock%time, sim%clock%step, &
                                     sim%clock%dt)
      call sim%timer%lap(ph_output)
      if (status /= ended_well) exit
    end do
    if (status == ended_well .and. .not. (sim%clock%now%output_is_lost .or. error%is_set())) then
      call write_due(sim, writer, .true., status, message, error)
      call check_state(sim, status, message)
    end if
    if (status /= ended_well .and. .not. sim%clock%now%output_is_lost) then
      call writer%sync()
      call save_last_state(sim, status == ended_by_signal, error, message)
    end if
    call writer%write_summary(sim, error)
    call writer%close(error)
    call note_step(-1_i8)
    if (error%is_set()) then
      status = ended_io
      message = error%message
    end if
  end subroutine run

  !> Stop the run if the last history row shows an unphysical energy gain or a state with NaN; a
  !> checkpoint refused for that reason has the same effect.
  subroutine check_state(sim, status, message)
    type(simulation_t), intent(in) :: sim
    integer, intent(inout) :: status
    character(:), allocatable, intent(inout) :: message

    if (.not. sim%clock%now%is_broken) return
    status = ended_broken
    if (allocated(sim%clock%now%reason)) then
      message = sim%clock%now%reason//' (step '//str(sim%clock%step)//', t = '// &
                str(sim%clock%time)//' s)'
      return
    end if
    call describe_failure(sim, message, 'more kinetic energy than was ever supplied')
  end subroutine check_state

  !> Save the state at a stop: a checkpoint to resume from. After an instability an earlier
  !> checkpoint is kept, and a state with NaN or without a solution goes to another file.
  subroutine save_last_state(sim, is_sound, error, message)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_sound
    type(error_t), intent(inout) :: error
    character(:), allocatable, intent(inout) :: message
    logical :: is_there, is_good

    inquire (file=checkpoint_path(sim%scene), exist=is_there)
    is_there = .not. sim%world%all_true(.not. is_there)
    is_good = sim%world%all_true(is_finite(sim%particles)) .and. .not. sim%clock%now%is_unsolved
    if (is_good .and. (is_sound .or. .not. is_there)) then
      call save_checkpoint(sim, error)
      message = message//'; checkpoint '//checkpoint_path(sim%scene)
      return
    end if
    call save_checkpoint(sim, error, broken_path(sim%scene))
    message = message//'; this state is in '//broken_path(sim%scene)
    if (is_there) message = message//', the last good checkpoint is '//checkpoint_path(sim%scene)
  end subroutine save_last_state

  pure logical function is_finished(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    is_finished = scene%is_over(clock%time, clock%step) .or. clock%is_stopped
  end function is_finished

  !> Collective. One pass of the time loop: sort if due, take a step, conduct heat if due.
  subroutine advance(sim, status, message)
    type(simulation_t), intent(inout) :: sim
    integer, intent(inout) :: status
    character(:), allocatable, intent(inout) :: message
    real(rp) :: dt
    integer :: k

    call sort_if_due(sim, status, message)
    if (status /= ended_well) return
    dt = next_step(sim%scene, sim%clock)
    call store_impulses(sim%tool)
    call take_step(sim, dt)
    if (sim%clock%now%is_broken) then
      status = ended_broken
      call describe_failure(sim, message, '')
      return
    end if
    call drive_tools(sim, dt)
    sim%clock%dt = dt
    sim%clock%time = sim%clock%time + dt
    sim%clock%step = sim%clock%step + 1
    sim%particles%n_awake_particle_steps = sim%particles%n_awake_particle_steps &
      + sum(sim%particles%count(:sim%particles%n_awake))
    sim%exchange%balance%sum = sim%exchange%balance%sum + sim%exchange%balance%now
    sim%exchange%balance%worst = max(sim%exchange%balance%worst, sim%exchange%balance%now)
    do k = 1, size(sim%hook)
      call sim%hook(k)%it%after_step(sim, dt)
    end do
    if (sim%scene%method%conducts) then
      if (conduction_is_due(sim%scene, sim%clock, dt) .or. &
          row_or_frame_is_due(sim%clock, sim%clock%time >= sim%scene%end_time)) then
        call conduct(sim, sim%clock%time - sim%clock%heat_time)
        if (sim%clock%now%is_unsolved) then
          status = ended_broken
          message = 'conduction: a step of '//str(sim%clock%time - sim%clock%heat_time)// &
            ' s did not converge: '// &
                    'shorten &HEAT STEP or EVERY (step '//str(sim%clock%step)//', t = '// &
                    str(sim%clock%time)//' s)'
        end if
        sim%clock%heat_time = sim%clock%time
        sim%sleepers%layer%is_stale = .true.
        call sim%timer%lap(ph_conduction)
      end if
    end if
    sim%clock%displacement = sim%clock%displacement + dt*sim%clock%max_speed
    call keep_room(sim)
    call limit_mass(sim)
    if (dt < sim%clock%now%attempted_dt) sim%clock%refused = sim%clock%refused + 1
    if (sim%clock%now%signal > 0 .and. status == ended_well) then
      status = ended_by_signal
      message = 'signal '//str(sim%clock%now%signal)//' stopped the run at step '// &
                str(sim%clock%step)//', t = '//str(sim%clock%time)//' s'
    end if
  end subroutine advance

  !> Next time step to attempt [s]. Unless &TIME DT prescribes the steps, the last ones divide the
  !> remaining time evenly: strain rates of a step much shorter than its predecessor are inaccurate.
  pure real(rp) function next_step(scene, clock) result(dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    !> Steps over which the remaining time is divided evenly.
    real(rp), parameter :: n_final_steps = 20.0_rp
    real(rp), parameter :: rounding = 1.0e-9_rp

    dt = stable_step(scene, clock)
    if (scene%method%conducts) dt = min(dt, conduction_step(scene, clock))
    associate (left => scene%end_time - clock%time)
      if (left < n_final_steps*dt .and. scene%method%fixed_dt <= 0.0_rp) then
        dt = left/max(1.0_rp, real(ceiling(left/dt*(1.0_rp - rounding)), rp))
      end if
      dt = min(dt, left)
    end associate
  end function next_step

  !> Collective, between two steps. Write the output that is due; `last`: also the output of the end
  !> of the run.
  subroutine write_due(sim, writer, last, status, message, error)
    type(simulation_t), intent(inout) :: sim
    type(writer_t), intent(inout) :: writer
    logical, intent(in) :: last
    integer, intent(inout) :: status
    character(:), allocatable, intent(inout) :: message
    type(error_t), intent(inout) :: error

    if (sim%scene%method%shows_motion .and. row_or_frame_is_due(sim%clock, last)) then
      call sort_if_due(sim, status, message)
      if (status == ended_broken) return
      call find_motion(sim)
    end if
    call writer%write_due(sim, last, error)
    if (allocated(sim%particles%motion)) deallocate (sim%particles%motion)
  end subroutine write_due

  !> Collective, between two steps. Sort at every SORT_INTERVAL steps, and before a particle can be
  !> a cell away from its place at the last sort; then the nodes in use are those the particles
  !> reach.
  subroutine sort_if_due(sim, status, message)
    type(simulation_t), intent(inout) :: sim
    integer, intent(inout) :: status
    character(:), allocatable, intent(inout) :: message

    if (sim%clock%step - sim%clock%sorted_at < sim%scene%method%sort_interval &
        .and. .not. may_leave_cell(sim%scene, sim%clock) &
        .and. .not. is_released(sim%scene, sim%clock)) return
    call check_inside(sim, status, message)
    if (status == ended_broken) return
    call regrid(sim)
    call sim%timer%lap(ph_sorting)
  end subroutine sort_if_due

  !> True if a clamp was released in the last step.
  pure logical function is_released(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    integer :: c

    is_released = .false.
    do c = 1, size(scene%clamp)
      associate (until => scene%clamp(c)%clamp%until)
        is_released = is_released .or. (clock%time >= until .and. clock%time - clock%dt < until)
      end associate
    end do
  end function is_released

  !> Stop the run on all ranks if a particle is outside the grid and not debris. Ranks wait here for
  !> the others, which is not counted as sorting.
  subroutine check_inside(sim, status, message)
    type(simulation_t), intent(inout) :: sim
    integer, intent(inout) :: status
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: local_message, reason
    logical :: all_inside

    local_message = find_outside(sim%scene%grid, sim%particles%n_awake, sim%particles)
    if (sim%particles%n_awake < 0) local_message = find_outside(sim%scene%grid, &
                                                                sim%particles%nblk, sim%particles)
    call sim%timer%lap(ph_sorting)
    sim%exchange%balance%waited = sim%exchange%balance%waited - wall_time()
    all_inside = sim%world%all_true(local_message == '')
    sim%exchange%balance%waited = sim%exchange%balance%waited + wall_time()
    call sim%timer%lap(ph_exchange)
    if (all_inside) return
    if (remove_debris(sim, reason)) return
    status = ended_broken
    call sim%world%share_message(local_message, message)
    message = message//' (step '//str(sim%clock%step)//', t = '//str(sim%clock%time)//' s); '// &
              reason
  end subroutine check_inside

end module run_loop
