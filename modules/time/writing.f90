! SPDX-License-Identifier: MIT
!> What a run writes while it goes on: frames, histories, probes, checkpoints, progress.
module time_writing
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, rp, sp
  use base_log, only: say
  use base_system, only: peak_memory
  use base_text, only: str
  use base_timers, only: cpu_seconds, n_phases, phase_name, wall_time
  use comm_world, only: world_t
  use io_frames, only: write_frame, write_series
  use io_histories, only: table_t
  use time_culprit, only: is_finite
  use physics_flow_law, only: law_output, law_unit, n_alarms
  use time_deviation, only: deviation_columns, deviation_row, has_fields
  use time_fracture, only: stretched_apart
  use time_melting, only: melting_t
  use time_microstructure, only: alarm_message, n_micro_outputs, pack_outputs
  use time_probes, only: share_probes
  use time_records, only: history_columns, history_row
  use time_resume, only: save_checkpoint
  use time_state, only: simulation_t
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
    integer(i8) :: told_refused = 0     !! refused steps when last spoken of
    real(rp) :: inertial = 0.0_rp            !! largest inertial stress over flow stress so far
    logical :: warned = .false., warned_returns = .false., warned_fracture = .false.
    logical :: warned_alarm(n_alarms) = .false.
    type(melting_t) :: melting
  contains
    procedure :: init
    procedure :: due
    procedure :: frame
    procedure :: row
    procedure :: tell_refused
    procedure :: tell_alarms
    procedure :: progress
    procedure :: summary
    procedure :: sync
    procedure :: close => close_files
  end type writer_t

contains

  !> Open the histories; a resumed run goes on in those it has.
  subroutine init(self, world, sim, is_resumed, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_resumed
    type(error_t), intent(inout) :: error
    character(:), allocatable :: stem
    integer(i8) :: rows

    self%started = wall_time()
    self%cpu_started = cpu_seconds()
    self%spoke = self%started
    sim%secured = self%started
    self%first_step = sim%clock%step
    self%first_time = sim%clock%time
    self%particles = sim%particles%total()
    call world%sum(self%particles)
    rows = merge(sim%rows, -1_i8, is_resumed)
    stem = sim%scene%output%directory//'/'//sim%scene%output%name
    call self%history%open(world, stem//'_history.csv', sim%scene%title, history_columns(sim), &
                           rows, sim%row_time, error)
    if (sim%probes%n > 0) call self%probes%open(world, stem//'_probes.csv', sim%scene%title, &
                                                probe_columns(sim), rows, sim%row_time, error)
    if (has_fields(sim)) call self%errors%open(world, stem//'_errors.csv', sim%scene%title, &
                                               deviation_columns(sim), rows, sim%row_time, error)
    associate (clock => sim%clock, output => sim%scene%output)
      if (is_resumed) then
        call write_series(world, output%directory, output%name, sim%frame_times, error)
        self%saved_step = clock%step
        clock%next_frame = next_time(output%frame_interval, clock%time)
        clock%next_history = next_time(output%history_interval, clock%time)
        clock%next_checkpoint = next_time(output%checkpoint_interval, clock%time)
      else
        allocate (sim%frame_times(0))
      end if
    end associate
  end subroutine init

  !> Temperatures first, then places.
  function probe_columns(sim) result(columns)
    type(simulation_t), intent(in) :: sim
    character(48), allocatable :: columns(:)
    integer :: c, n

    allocate (columns(1 + 4*sim%probes%n))
    columns(1) = 'time[s]'
    do n = 1, sim%probes%n
      c = 1 + sim%probes%n + 3*(n - 1)
      columns(1 + n) = trim(sim%probes%name(n))//'[K]'
      columns(c + 1) = trim(sim%probes%name(n))//'_x[m]'
      columns(c + 2) = trim(sim%probes%name(n))//'_y[m]'
      columns(c + 3) = trim(sim%probes%name(n))//'_z[m]'
    end do
  end function probe_columns

  !> Write what is due at the present time, rows before a checkpoint, which counts them. What is `last`
  !> leaves a checkpoint too, and behind it a row and a frame, which a restart drops if they were not due.
  subroutine due(self, world, sim, last, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: last
    type(error_t), intent(inout) :: error
    real(rp) :: now
    logical :: wanted

    now = sim%clock%time*(1.0_rp + 1.0e-12_rp)
    associate (clock => sim%clock, output => sim%scene%output)
      if (now >= clock%next_history) then
        call self%row(world, sim)
        clock%next_history = next_time(output%history_interval, clock%time)
      end if
      if (now >= clock%next_frame) then
        call self%frame(world, sim, error)
        clock%next_frame = next_time(output%frame_interval, clock%time)
      end if
      wanted = output%checkpoint_interval > 0.0_rp .and. now >= clock%next_checkpoint
      wanted = (wanted .or. last .or. sim%safety_is_due) .and. self%saved_step < clock%step
      if (wanted .and. .not. sim%is_broken) then
        self%saved_step = clock%step
        clock%next_checkpoint = next_time(output%checkpoint_interval, clock%time)
        call self%sync()
        if (.not. world%all_true(is_finite(sim))) then
          sim%is_broken = .true.
        else if (world%all_true(.not. sim%lost_row)) then
          call save_checkpoint(world, sim, error)
        end if
        sim%secured = wall_time()
      end if
    end associate
    if (.not. last) return
    call self%row(world, sim)
    call self%frame(world, sim, error)
  end subroutine due

  !> First multiple of the interval behind `time`; never, without an interval.
  pure real(rp) function next_time(interval, time)
    real(rp), intent(in) :: interval, time

    next_time = huge(1.0_rp)
    if (interval > 0.0_rp) &
      next_time = interval*(aint(time*(1.0_rp + 1.0e-12_rp)/interval) + 1.0_rp)
  end function next_time

  subroutine frame(self, world, sim, error)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    type(error_t), intent(inout) :: error
    character(6) :: number
    real(sp), allocatable :: outputs(:, :)
    integer :: k

    if (size(sim%frame_times) > 0) then
      if (sim%frame_times(size(sim%frame_times)) >= sim%clock%time) return   ! has it already
    end if
    write (number, '(i6.6)') size(sim%frame_times)
    k = n_micro_outputs(sim)
    call pack_outputs(sim, outputs)
    associate (output => sim%scene%output)
      call write_frame(world, output%directory//'/'//output%name//'_'//number//'.hdf', &
                       sim%clock%time, int(sim%clock%step), sim%scene%grid%h, &
                       sim%scene%body%mean_spacing(), sim%scene%body%name, sim%particles, &
                       law_output(:k), law_unit(:k), outputs, output%input_text, error)
      if (error%is_set()) return
      sim%frame_times = [sim%frame_times, sim%clock%time]
      call write_series(world, output%directory, output%name, sim%frame_times, error)
    end associate
  end subroutine frame

  subroutine row(self, world, sim)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), allocatable :: values(:), errors(:)
    real(rp) :: apart

    if (sim%row_time >= sim%clock%time .and. sim%rows > 0) return   ! has it already
    call history_row(world, sim, values)
    call self%tell_refused(world, sim)
    call self%tell_alarms(world, sim)
    call self%melting%watch_particles(world, sim)
    call self%history%row(values)
    if (sim%probes%n > 0) then
      call share_probes(world, sim%probes)
      call self%probes%row([sim%clock%time, sim%probes%temperature, &
                            reshape(sim%probes%x, [3*sim%probes%n])])
    end if
    if (has_fields(sim)) then
      call deviation_row(world, sim, errors)
      call self%errors%row(errors)
    end if
    sim%rows = sim%rows + 1
    sim%lost_row = self%history%is_lost() .or. self%probes%is_lost() .or. self%errors%is_lost()
    if (sim%worst_returns > 0 .and. .not. self%warned_returns) then
      self%warned_returns = .true.
      if (world%is_root()) call say('warning: at t = '//str(sim%clock%time)// &
        ' s the return mapping of '//str(sim%worst_returns)//' particle-steps had not converged')
    end if
    if (.not. self%warned_fracture) then
      apart = stretched_apart(world, sim)
      self%warned_fracture = apart > 0.9_rp
      if (self%warned_fracture .and. world%is_root()) call say( &
        'warning: at t = '//str(sim%clock%time)//' s neighbouring particles are stretched to '// &
        str(apart)//' of the distance up to which nodes join them: numerical fracture '// &
        '(try cpgimp, or more particles per cell)')
    end if
    self%inertial = max(self%inertial, 0.01_rp*values(19))
    if (0.01_rp*values(19) > sim%scene%method%inertial_fraction &
        .and. sim%scene%method%mass_scaling > 1.0_rp .and. .not. sim%scene%method%adapts_mass &
        .and. .not. self%warned) then
      self%warned = .true.
      if (world%is_root()) call say('warning: at t = '//str(sim%clock%time)// &
        ' s the inertial stress of mass scaling, chi rho v^2, is '//str(values(19))// &
        ' % of the flow stress somewhere (KE/IE '//str(values(18))// &
        ' %): try a MASS_SCALING of '//str(allowed_scaling(self, sim)))
    end if
  end subroutine row

  !> Mass scaling whose inertial stress would have been just small enough so far: it is proportional
  !> to it, since the tool gives the speeds.
  pure real(rp) function allowed_scaling(self, sim)
    class(writer_t), intent(in) :: self
    type(simulation_t), intent(in) :: sim

    allowed_scaling = max(1.0_rp, sim%scene%method%mass_scaling*sim%scene%method%inertial_fraction &
                                  /max(self%inertial, tiny(1.0_rp)))
  end function allowed_scaling

  !> Say that steps were refused, at most once between two rows of the history.
  subroutine tell_refused(self, world, sim)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim

    if (sim%clock%refused <= self%told_refused) return
    self%told_refused = sim%clock%refused
    if (world%is_root()) call say('note: until t = '//str(sim%clock%time)// &
      ' s '//str(sim%clock%refused)//' step(s) would have moved a node by more than half a '// &
      'cell and were made shorter; the last one is '//str(sim%clock%dt)//' s')
  end subroutine tell_refused

  !> Say once of each kind that particles left the validity of a flow law, and where.
  subroutine tell_alarms(self, world, sim)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: message
    integer :: k

    if (n_micro_outputs(sim) == 0) return
    do k = 1, n_alarms
      if (self%warned_alarm(k)) cycle
      call alarm_message(world, sim, k, message)
      self%warned_alarm(k) = message /= ''
      if (world%is_root() .and. message /= '') call say(message)
    end do
  end subroutine tell_alarms

  !> A line with percent, time, speed and time left, every PROGRESS_INTERVAL seconds.
  subroutine progress(self, world, sim)
    class(writer_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    real(rp) :: now, speed, left, share, done

    if (.not. world%is_root() .or. sim%scene%output%is_quiet) return
    now = wall_time()
    if (now - self%spoke < sim%scene%output%progress_interval) return
    self%spoke = now
    speed = real(self%particles, rp)*real(sim%clock%step - self%first_step, rp)/(now - self%started)
    share = (sim%clock%time - self%first_time) &
            /max(sim%scene%end_time - self%first_time, tiny(1.0_rp))
    done = sim%clock%time/max(sim%scene%end_time, tiny(1.0_rp))
    if (sim%scene%max_steps > 0) then
      share = max(share, real(sim%clock%step - self%first_step, rp) &
                         /max(1.0_rp, real(sim%scene%max_steps - self%first_step, rp)))
      done = max(done, real(sim%clock%step, rp)/real(sim%scene%max_steps, rp))
    end if
    left = (now - self%started)*(1.0_rp/max(share, 1.0e-12_rp) - 1.0_rp)
    call say(percent(done)//' %  step '//str(sim%clock%step)//'  t = '//str(sim%clock%time)//' s  dt = '//str(sim%clock%dt)//' s  '// &
      str(speed*1.0e-6_rp)//' M particle-steps/s  left '//span(left))
  end subroutine progress

  !> Speed, memory, the shares of the phases and of waiting for other ranks in them (mean over ranks): a line, and
  !> NAME_summary.json.
  subroutine summary(self, world, sim, error)
    class(writer_t), intent(in) :: self
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    type(error_t), intent(inout) :: error
    real(rp) :: all(n_phases + 6), wall, steps, share(n_phases + 1)
    character(:), allocatable :: text
    integer :: k

    wall = max(wall_time() - self%started, 1.0e-9_rp)
    all = [sim%timer%seconds, cpu_seconds() - self%cpu_started, peak_memory(), &
           real(sim%awake_steps, rp), real(sim%halo%messages + sim%resting_halo%messages, rp), &
           real(sim%halo%bytes + sim%resting_halo%bytes, rp), &
           sim%balance%waited + sim%halo%waited + sim%resting_halo%waited]
    call world%sum(all)
    if (.not. world%is_root()) return
    share = 100.0_rp*all([(k, k=1, n_phases), n_phases + 6])/max(sum(all(1:n_phases)), tiny(1.0_rp))
    steps = real(self%particles, rp)*real(sim%clock%step - self%first_step, rp)
    text = '{'//nl//'  "particles": '//str(self%particles)//','//nl// &
      '  "steps": '//str(sim%clock%step - self%first_step)//','//nl// &
      '  "ranks": '//str(world%size)//','//nl//'  "wall_seconds": '//str(wall)//','//nl// &
      '  "cpu_seconds": '//str(all(n_phases + 1))//','//nl// &
      '  "particle_steps_per_wall_second": '//str(steps/wall)//','//nl// &
      '  "particle_steps_per_cpu_second": '//str(steps/max(all(n_phases + 1), 1.0e-9_rp))//','//nl// &
      self%melting%json()//nl//'  "awake_share": '//str(all(n_phases + 3)/max(steps, 1.0_rp))//','//nl// &
      '  "imbalance_mean": '// &
      str(sim%balance%sum/max(1.0_rp, real(sim%clock%step - self%first_step, rp)))//','//nl// &
      '  "imbalance_worst": '//str(sim%balance%worst)//','//nl// &
      '  "partitions": '//str(sim%balance%cuts)//','//nl// &
      '  "messages": '//str(nint(all(n_phases + 4), i8))//','//nl// &
      '  "bytes_sent": '//str(nint(all(n_phases + 5), i8))//','//nl// &
      '  "peak_memory_bytes": '//str(nint(all(n_phases + 2), i8))//','//nl// &
      '  "waiting_percent": '//str(share(n_phases + 1))//','//nl//'  "phase_percent": {'
    do k = 1, n_phases
      text = text//nl//'    "'//trim(phase_name(k))//'": '//str(share(k))// &
             trim(merge(' ', ',', k == n_phases))
    end do
    call write_whole(sim%scene%output%directory//'/'//sim%scene%output%name//'_summary.json', &
                     text//nl//'  }'//nl//'}'//nl, error)
    if (.not. sim%scene%output%is_quiet) call say( &
      str(sim%clock%step - self%first_step)//' steps of '//str(self%particles)//' particles in '// &
      span(wall)//': '//str(steps/wall*1.0e-6_rp)//' M particle-steps/s on '// &
      str(world%size)//' rank(s)')
    if (sim%scene%output%is_quiet .or. .not. (sim%scene%method%adapts_mass .or. sim%scene%method%mass_scaling > 1.0_rp)) return
    if (self%inertial <= 0.0_rp) then
      call say('no metal with strength was seen to flow: nothing to judge the mass scaling by')
    else if (sim%scene%method%adapts_mass) then
      call say('inertial stress up to '//str(100.0_rp*self%inertial)// &
        ' % of the flow stress, mass scaling '//str(sim%scene%method%mass_scaling)//' in the end')
    else
      call say('inertial stress up to '//str(100.0_rp*self%inertial)//' % of the flow stress: MASS_SCALING = '// &
      str(allowed_scaling(self, sim))//' would make that '// &
      str(100.0_rp*sim%scene%method%inertial_fraction)//' %')
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

end module time_writing
