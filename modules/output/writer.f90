! SPDX-License-Identifier: MIT
!> What a run writes while it goes on: frames, histories, probes, checkpoints, progress.
module output_writer
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, rp, sp
  use base_log, only: say
  use base_system, only: peak_memory
  use base_text, only: str
  use base_timers, only: cpu_seconds, n_phases, phase_name, phase_timer_t, wall_time
  use comm_world, only: world_t
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
  use output_history, only: history_headings, history_row
  use output_melting, only: melting_t
  use output_microstructure, only: n_micro_outputs, pack_outputs, warning_message
  use output_numerical_fracture, only: stretched_apart
  use particles_store, only: particles_t
  use physics_flow_law, only: law_output, law_unit, n_validity_warnings
  use state_blocks, only: blocks_t
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  implicit none (type, external)
  private

  public :: writer_t, next_time, percent, span

  character(*), parameter :: nl = new_line('a')

  !> Open files and the clockwork of output.
  type :: writer_t
    type(table_t) :: history, probes, errors
    real(rp) :: started = 0.0_rp        !! wall-clock time at the start [s]
    real(rp) :: cpu_started = 0.0_rp    !! processor time of this rank then [s]
    real(rp) :: spoke = 0.0_rp          !! wall-clock time of the last progress line
    integer(i8) :: first_step = 0
    integer(i8) :: saved_step = -1      !! of the last checkpoint
    real(rp) :: first_time = 0.0_rp
    integer(i8) :: particles = 0        !! on all ranks
    integer(i8) :: reported_refused = 0     !! refused steps when last spoken of
    real(rp) :: inertial = 0.0_rp            !! largest inertial stress over flow stress so far
    logical :: warned = .false., warned_returns = .false., warned_fracture = .false.
    logical :: warned_validity(n_validity_warnings) = .false.
    type(melting_t) :: melting
  contains
    procedure :: init
    procedure :: due
    procedure :: frame
    procedure :: row
    procedure :: report_refused
    procedure :: report_warnings
    procedure :: warn_inertia
    procedure :: progress
    procedure :: summary
    procedure :: sync
    procedure :: close => close_files
  end type writer_t

contains

  !> Open the histories; a resumed run goes on in those it has.
  subroutine init(self, world, scene, clock, step, tool, probes, particles, history, is_resumed, &
                  error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(probes_t), intent(in) :: probes
    type(particles_t), intent(in) :: particles
    type(history_t), intent(inout) :: history
    logical, intent(in) :: is_resumed
    type(error_t), intent(inout) :: error
    character(:), allocatable :: stem
    type(row_t) :: row
    integer(i8) :: rows

    self%started = wall_time()
    self%cpu_started = cpu_seconds()
    self%spoke = self%started
    step%secured = self%started
    self%first_step = clock%step
    self%first_time = clock%time
    self%particles = particles%total()
    call world%sum(self%particles)
    rows = merge(history%rows, -1_i8, is_resumed)
    stem = scene%output%directory//'/'//scene%output%name
    call self%history%open(world, stem//'_history.csv', scene%title, &
                           history_headings(scene, clock, tool, history), rows, &
                           history%row_time, error)
    if (probes%n > 0) then
      row = probe_row(clock, probes)
      call self%probes%open(world, stem//'_probes.csv', scene%title, row%headings(), rows, &
                            history%row_time, error)
    end if
    if (has_fields(scene)) call self%errors%open(world, stem//'_errors.csv', scene%title, &
                                                 error_headings(scene, clock), rows, &
                                                 history%row_time, error)
    associate (output => scene%output)
      if (is_resumed) then
        call write_series(world, output%directory, output%name, history%frame_times, error)
        self%saved_step = clock%step
        clock%next_frame = next_time(output%frame_interval, clock%time)
        clock%next_history = next_time(output%history_interval, clock%time)
        clock%next_checkpoint = next_time(output%checkpoint_interval, clock%time)
      else
        allocate (history%frame_times(0))
      end if
    end associate
  end subroutine init

  !> A row of the probes: temperatures first, then places.
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

  !> Write what is due at the present time, rows before a checkpoint, which counts them. What is
  !> `last` leaves a checkpoint too, and behind it a row and a frame, which a restart drops if they
  !> were not due.
  subroutine due(self, world, scene, clock, step, tool, probes, particles, exchange, books, &
                 history, last, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(in) :: particles
    type(exchange_t), intent(in) :: exchange
    type(books_t), intent(in) :: books
    type(history_t), intent(inout) :: history
    logical, intent(in) :: last
    type(error_t), intent(inout) :: error
    real(rp) :: now
    logical :: wanted

    now = clock%time*(1.0_rp + 1.0e-12_rp)
    associate (output => scene%output)
      if (now >= clock%next_history) then
        call self%row(world, scene, clock, step, tool, probes, particles, books, history)
        clock%next_history = next_time(output%history_interval, clock%time)
      end if
      if (now >= clock%next_frame) then
        call self%frame(world, scene, clock, particles, history, error)
        clock%next_frame = next_time(output%frame_interval, clock%time)
      end if
      wanted = output%checkpoint_interval > 0.0_rp .and. now >= clock%next_checkpoint
      wanted = (wanted .or. last .or. step%safety_is_due) .and. self%saved_step < clock%step
      if (wanted .and. .not. step%is_broken) then
        self%saved_step = clock%step
        clock%next_checkpoint = next_time(output%checkpoint_interval, clock%time)
        call self%sync()
        if (.not. world%all_true(is_finite(particles))) then
          step%is_broken = .true.
        else if (world%all_true(.not. step%lost_row)) then
          call save_checkpoint(world, scene, clock, step, tool, probes, particles, exchange, &
                               books, history, error)
        end if
        step%secured = wall_time()
      end if
    end associate
    if (.not. last) return
    call self%row(world, scene, clock, step, tool, probes, particles, books, history)
    call self%frame(world, scene, clock, particles, history, error)
  end subroutine due

  !> First multiple of the interval behind `time`; never, without an interval.
  pure real(rp) function next_time(interval, time)
    real(rp), intent(in) :: interval, time

    next_time = huge(1.0_rp)
    if (interval > 0.0_rp) then
      next_time = interval*(aint(time*(1.0_rp + 1.0e-12_rp)/interval) + 1.0_rp)
    end if
  end function next_time

  subroutine frame(self, world, scene, clock, particles, history, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(history_t), intent(inout) :: history
    type(error_t), intent(inout) :: error
    character(6) :: number
    real(sp), allocatable :: outputs(:, :)
    integer :: k

    if (size(history%frame_times) > 0) then
      if (history%frame_times(size(history%frame_times)) >= clock%time) return   ! has it already
    end if
    write (number, '(i6.6)') size(history%frame_times)
    k = n_micro_outputs(scene)
    call pack_outputs(scene, particles, outputs)
    associate (output => scene%output)
      call write_frame(world, output%directory//'/'//output%name//'_'//number//'.hdf', &
                       clock%time, int(clock%step), scene%grid%h, &
                       scene%body%mean_spacing(), scene%body%name, particles, &
                       law_output(:k), law_unit(:k), outputs, output%input_text, error)
      if (error%is_set()) return
      history%frame_times = [history%frame_times, clock%time]
      call write_series(world, output%directory, output%name, history%frame_times, error)
    end associate
  end subroutine frame

  subroutine row(self, world, scene, clock, step, tool, probes, particles, books, history)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(in) :: particles
    type(books_t), intent(in) :: books
    type(history_t), intent(inout) :: history
    type(row_t) :: columns
    real(rp) :: apart

    if (history%row_time >= clock%time .and. history%rows > 0) return   ! has it already
    call history_row(world, scene, clock, step, tool, particles, books, history, columns)
    call self%report_refused(world, clock)
    call self%report_warnings(world, scene, clock, books)
    call self%melting%watch_particles(world, scene, clock, particles)
    call self%history%row(columns%values())
    call self%warn_inertia(world, scene, clock, columns)
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
    step%lost_row = self%history%is_lost() .or. self%probes%is_lost() .or. self%errors%is_lost()
    if (step%worst_returns > 0 .and. .not. self%warned_returns) then
      self%warned_returns = .true.
      if (world%is_root()) call say('warning: at t = '//str(clock%time)// &
        ' s the return mapping of '//str(step%worst_returns)//' particle-steps had not converged')
    end if
    if (.not. self%warned_fracture) then
      apart = stretched_apart(world, scene, particles)
      self%warned_fracture = apart > 0.9_rp
      if (self%warned_fracture .and. world%is_root()) call say( &
        'warning: at t = '//str(clock%time)//' s neighbouring particles are stretched to '// &
        str(apart)//' of the distance up to which nodes join them: numerical fracture '// &
        '(try cpgimp, or more particles per cell)')
    end if
  end subroutine row

  !> Warn once if the inertial stress of a constant mass scaling is not small.
  subroutine warn_inertia(self, world, scene, clock, columns)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(row_t), intent(in) :: columns           !! of the history
    real(rp) :: percent_of_flow

    percent_of_flow = columns%value('inertial_stress_over_flow')
    self%inertial = max(self%inertial, 0.01_rp*percent_of_flow)
    if (0.01_rp*percent_of_flow <= scene%method%inertial_fraction) return
    if (clock%mass_scaling <= 1.0_rp .or. scene%method%adapts_mass .or. self%warned) return
    self%warned = .true.
    if (world%is_root()) call say('warning: at t = '//str(clock%time)// &
      ' s the inertial stress of mass scaling, chi rho v^2, is '//str(percent_of_flow)// &
      ' % of the flow stress somewhere (KE/IE '//str(columns%value('kinetic_over_internal'))// &
      ' %): try a MASS_SCALING of '//str(allowed_scaling(self, scene, clock)))
  end subroutine warn_inertia

  !> Mass scaling whose inertial stress would have been just small enough so far: it is proportional
  !> to it, since the tool gives the speeds.
  pure real(rp) function allowed_scaling(self, scene, clock)
    class(writer_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    allowed_scaling = max(1.0_rp, clock%mass_scaling*scene%method%inertial_fraction &
                                  /max(self%inertial, tiny(1.0_rp)))
  end function allowed_scaling

  !> Say that steps were refused, at most once between two rows of the history.
  subroutine report_refused(self, world, clock)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock

    if (clock%refused <= self%reported_refused) return
    self%reported_refused = clock%refused
    if (world%is_root()) call say('note: until t = '//str(clock%time)// &
      ' s '//str(clock%refused)//' step(s) would have moved a node by more than half a '// &
      'cell and were made shorter; the last one is '//str(clock%dt)//' s')
  end subroutine report_refused

  !> Say once of each kind that particles left the validity of a flow law, and where.
  subroutine report_warnings(self, world, scene, clock, books)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(books_t), intent(in) :: books
    character(:), allocatable :: message
    integer :: k

    if (n_micro_outputs(scene) == 0) return
    do k = 1, n_validity_warnings
      if (self%warned_validity(k)) cycle
      call warning_message(world, clock, books, k, message)
      self%warned_validity(k) = message /= ''
      if (world%is_root() .and. message /= '') call say(message)
    end do
  end subroutine report_warnings

  !> A line with percent, time, speed and time left, every PROGRESS_INTERVAL seconds.
  subroutine progress(self, world, scene, clock)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp) :: now, speed, left, share, done

    if (.not. world%is_root() .or. scene%output%is_quiet) return
    now = wall_time()
    if (now - self%spoke < scene%output%progress_interval) return
    self%spoke = now
    speed = real(self%particles, rp)*real(clock%step - self%first_step, rp)/(now - self%started)
    share = (clock%time - self%first_time) &
            /max(scene%end_time - self%first_time, tiny(1.0_rp))
    done = clock%time/max(scene%end_time, tiny(1.0_rp))
    if (scene%max_steps > 0) then
      share = max(share, real(clock%step - self%first_step, rp) &
                         /max(1.0_rp, real(scene%max_steps - self%first_step, rp)))
      done = max(done, real(clock%step, rp)/real(scene%max_steps, rp))
    end if
    left = (now - self%started)*(1.0_rp/max(share, 1.0e-12_rp) - 1.0_rp)
    call say(percent(done)//' %  step '//str(clock%step)//'  t = '//str(clock%time)//' s  dt = '// &
             str(clock%dt)//' s  '// &
      str(speed*1.0e-6_rp)//' M particle-steps/s  left '//span(left))
  end subroutine progress

  !> Speed, memory, the shares of the phases and of waiting for other ranks in them (mean over
  !> ranks): a line, and NAME_summary.json.
  subroutine summary(self, world, scene, clock, blocks, nodes, exchange, timer, error)
    class(writer_t), intent(in) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(in) :: nodes
    type(exchange_t), intent(in) :: exchange
    type(phase_timer_t), intent(in) :: timer
    type(error_t), intent(inout) :: error
    real(rp) :: all(n_phases + 6), wall, steps, share(n_phases + 1)
    character(:), allocatable :: text
    integer :: k

    wall = max(wall_time() - self%started, 1.0e-9_rp)
    all = [timer%seconds, cpu_seconds() - self%cpu_started, peak_memory(), &
           real(blocks%awake_steps, rp), real(nodes%halo%messages + nodes%resting_halo%messages, &
                                              rp), &
           real(nodes%halo%bytes + nodes%resting_halo%bytes, rp), &
           exchange%balance%waited + nodes%halo%waited + nodes%resting_halo%waited]
    call world%sum(all)
    if (.not. world%is_root()) return
    share = 100.0_rp*all([(k, k=1, n_phases), n_phases + 6])/max(sum(all(1:n_phases)), tiny(1.0_rp))
    steps = real(self%particles, rp)*real(clock%step - self%first_step, rp)
    text = '{'//nl//'  "particles": '//str(self%particles)//','//nl// &
      '  "steps": '//str(clock%step - self%first_step)//','//nl// &
      '  "ranks": '//str(world%size)//','//nl//'  "wall_seconds": '//str(wall)//','//nl// &
      '  "cpu_seconds": '//str(all(n_phases + 1))//','//nl// &
      '  "particle_steps_per_wall_second": '//str(steps/wall)//','//nl// &
      '  "particle_steps_per_cpu_second": '//str(steps/max(all(n_phases + 1), 1.0e-9_rp))//','// &
      nl// &
      self%melting%json()//nl//'  "awake_share": '//str(all(n_phases + 3)/max(steps, 1.0_rp))// &
      ','//nl// &
      '  "imbalance_mean": '// &
      str(exchange%balance%sum/max(1.0_rp, real(clock%step - self%first_step, rp)))//','//nl// &
      '  "imbalance_worst": '//str(exchange%balance%worst)//','//nl// &
      '  "partitions": '//str(exchange%balance%cuts)//','//nl// &
      '  "messages": '//str(nint(all(n_phases + 4), i8))//','//nl// &
      '  "bytes_sent": '//str(nint(all(n_phases + 5), i8))//','//nl// &
      '  "peak_memory_bytes": '//str(nint(all(n_phases + 2), i8))//','//nl// &
      '  "waiting_percent": '//str(share(n_phases + 1))//','//nl//'  "phase_percent": {'
    do k = 1, n_phases
      text = text//nl//'    "'//trim(phase_name(k))//'": '//str(share(k))// &
             trim(merge(' ', ',', k == n_phases))
    end do
    call write_whole(scene%output%directory//'/'//scene%output%name//'_summary.json', &
                     text//nl//'  }'//nl//'}'//nl, error)
    if (.not. scene%output%is_quiet) call say( &
      str(clock%step - self%first_step)//' steps of '//str(self%particles)//' particles in '// &
      span(wall)//': '//str(steps/wall*1.0e-6_rp)//' M particle-steps/s on '// &
      str(world%size)//' rank(s)')
    if (scene%output%is_quiet .or. .not. (scene%method%adapts_mass .or. clock%mass_scaling &
                                          > 1.0_rp)) return
    if (self%inertial <= 0.0_rp) then
      call say('no metal with strength was seen to flow: nothing to judge the mass scaling by')
    else if (scene%method%adapts_mass) then
      call say('inertial stress up to '//str(100.0_rp*self%inertial)// &
        ' % of the flow stress, mass scaling '//str(clock%mass_scaling)//' in the end')
    else
      call say('inertial stress up to '//str(100.0_rp*self%inertial)// &
               ' % of the flow stress: MASS_SCALING = '// str(allowed_scaling(self, &
               scene, clock))//' would make that '// &
               str(100.0_rp*scene%method%inertial_fraction)//' %')
    end if
  end subroutine summary

  !> A share in percent, six characters wide.
  pure function percent(share) result(text)
    real(rp), intent(in) :: share
    character(6) :: text

    write (text, '(f6.1)') 100.0_rp*share
  end function percent

  !> Seconds as a person says them.
  function span(seconds) result(text)
    real(rp), intent(in) :: seconds
    character(:), allocatable :: text
    integer :: s

    s = nint(min(seconds, 1.0e9_rp))
    if (s < 120) then
      text = str(s)//' s'
    else if (s < 7200) then
      text = str(s/60)//' min'
    else
      text = str(s/3600)//' h '//str(mod(s, 3600)/60)//' min'
    end if
  end function span

  !> Bring the rows to the disk: a checkpoint counts on them.
  subroutine sync(self)
    class(writer_t), intent(inout) :: self

    call self%history%sync()
    call self%probes%sync()
    call self%errors%sync()
  end subroutine sync

  subroutine close_files(self, error)
    class(writer_t), intent(inout) :: self
    type(error_t), intent(inout) :: error

    call self%history%close(error)
    call self%probes%close(error)
    call self%errors%close(error)
  end subroutine close_files

end module output_writer
