! SPDX-License-Identifier: MIT
!> Progress and speed of a run: progress lines with the remaining wall-clock time, estimated from
!> the recent speed, and the summary at its end.
module output_progress
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, rp
  use base_log, only: log_line, show_progress, window_width
  use base_system, only: peak_memory
  use base_text, only: str
  use base_timers, only: cpu_seconds, n_phases, now, phase_name, wall_time
  use base_version, only: commit, release
  use base_world, only: world_t
  use state_clock, only: clock_t
  use state_exchange, only: exchange_t
  use state_parts, only: simulation_t
  use state_scene, only: output_t, scene_t
  implicit none (type, external)
  private

  public :: progress_t, run_json, time_left_t

  character(*), parameter :: nl = new_line('a')

  integer, parameter :: max_samples = 64      !! number of samples kept
  real(rp), parameter :: spacing = 0.5_rp     !! initial interval of samples [s]
  !> Shortest time between two drawings of the line in a terminal window [s].
  real(rp), parameter :: redraw_interval = 1.0_rp

  !> Samples of the completed share of a run, and the state of the progress line.
  type :: time_left_t
    real(rp) :: interval = 0.0_rp             !! interval of lines in a log file [s]
    logical :: is_given = .false.             !! the interval is given in the input, and constant
    real(rp), private :: at(max_samples) = 0.0_rp  !! wall-clock times of samples since start [s]
    real(rp), private :: share(max_samples) = 0.0_rp  !! completed share of the run at the samples
    integer, private :: n = 0
    real(rp), private :: gap = spacing        !! interval of samples [s]
    real(rp), private :: began = 0.0_rp       !! wall-clock time of the start [s]
    real(rp), private :: last_shown = 0.0_rp  !! wall-clock time of the last line [s]
  contains
    procedure :: init => start_samples, add_sample, seconds, is_due, show
  end type time_left_t

  !> State at the start of this part of a run.
  type :: progress_t
    real(rp) :: started = 0.0_rp        !! wall-clock time at the start [s]
    real(rp) :: cpu_started = 0.0_rp    !! processor time of this rank at the start [s]
    integer(i8) :: first_step = 0
    integer(i8) :: particles = 0        !! particles of all ranks; 0 in a heat-only run
    real(rp), private :: first_time = 0.0_rp    !! simulated time at the start [s]
    type(time_left_t), private :: left
  contains
    procedure :: init, show_line, write_summary
  end type progress_t

contains

  !> Start the clocks of the run or of its resumed part.
  subroutine init(self, output, time, step)
    class(progress_t), intent(out) :: self
    type(output_t), intent(in) :: output
    real(rp), intent(in) :: time             !! simulated time [s]
    integer(i8), intent(in) :: step

    self%started = wall_time()
    self%cpu_started = cpu_seconds()
    call self%left%init(output%progress_interval, output%progress_is_given)
    self%first_step = step
    self%first_time = time
  end subroutine init

  !> Show a progress line with percent, remaining time, simulated time and speed, if it is due.
  subroutine show_line(self, world, scene, time, step, dt)
    class(progress_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: time, dt         !! simulated time, last step [s]
    integer(i8), intent(in) :: step
    character(:), allocatable :: speed
    real(rp) :: at, share, done
    integer :: width

    if (.not. world%is_root() .or. scene%output%is_quiet) return
    share = (time - self%first_time)/max(scene%end_time - self%first_time, tiny(1.0_rp))
    done = time/max(scene%end_time, tiny(1.0_rp))
    if (scene%max_steps > 0) then
      share = max(share, real(step - self%first_step, rp)/max(1.0_rp, &
                  real(scene%max_steps - self%first_step, rp)))
      done = max(done, real(step, rp)/real(scene%max_steps, rp))
    end if
    if (.not. self%left%is_due(share, at, width)) return
    speed = ''
    if (self%particles > 0) speed = '  '//str(1.0e-6_rp*real(self%particles, rp) &
      *real(step - self%first_step, rp)/max(at, 1.0e-9_rp))//' M particle-steps/s'
    call self%left%show(percent(done)//' %  left '//span(self%left%seconds(at, share))//'  t = '// &
                        str(time)//' s  step '//str(step)//'  dt = '//str(dt)//' s'//speed, width)
  end subroutine show_line

  !> Collective. Log the speed, and write NAME_summary.json with speed, memory, the time shares of
  !> the phases and of waiting for other ranks (mean over ranks).
  subroutine write_summary(self, sim, others, error)
    class(progress_t), intent(in) :: self
    type(simulation_t), intent(in) :: sim
    character(*), intent(in) :: others            !! further entries of the file
    type(error_t), intent(inout) :: error
    real(rp) :: all(n_phases + 6), wall, steps

    wall = max(wall_time() - self%started, 1.0e-9_rp)
    all = [sim%timer%seconds, cpu_seconds() - self%cpu_started, peak_memory(), &
           real(sim%particles%n_awake_particle_steps, rp), &
           real(sim%nodes%halo%messages + sim%nodes%resting_halo%messages, rp), &
           real(sim%nodes%halo%bytes + sim%nodes%resting_halo%bytes, rp), &
           sim%exchange%balance%waited + sim%nodes%halo%waited + sim%nodes%resting_halo%waited]
    call sim%world%sum(all)
    if (.not. sim%world%is_root()) return
    steps = real(self%particles, rp)*real(sim%clock%step - self%first_step, rp)
    call write_whole(sim%scene%output%directory//'/'//sim%scene%output%name//'_summary.json', &
                     json(self, sim%world, sim%clock, sim%exchange, wall, steps, all, others), &
                     error)
    if (.not. sim%scene%output%is_quiet) then
      call log_line(str(sim%clock%step - self%first_step)//' steps of '//str(self%particles)// &
                    ' particles in '//span(wall)//': '//str(steps/wall*1.0e-6_rp)// &
                    ' M particle-steps/s on '//str(sim%world%size)//' rank(s)')
    end if
  end subroutine write_summary

  !> Text of NAME_summary.json.
  function json(self, world, clock, exchange, wall, steps, all, others) result(text)
    type(progress_t), intent(in) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(exchange_t), intent(in) :: exchange
    real(rp), intent(in) :: wall                  !! wall-clock time of the run [s]
    real(rp), intent(in) :: steps                 !! particle-steps
    real(rp), intent(in) :: all(n_phases + 6)     !! sums over ranks, as in `write_summary`
    character(*), intent(in) :: others
    character(:), allocatable :: text
    real(rp) :: share(n_phases + 1)
    integer :: k

    share = 100.0_rp*all([(k, k=1, n_phases), n_phases + 6])/max(sum(all(1:n_phases)), tiny(1.0_rp))
    text = '{'//nl//run_json(world%size, clock%step - self%first_step, wall, all(n_phases + 1), &
                            all(n_phases + 2))//nl//'  "particles": '//str(self%particles)// &
      ','//nl//'  "particle_steps_per_wall_second": '//str(steps/wall)// &
      ','//nl//'  "particle_steps_per_cpu_second": '// &
      str(steps/max(all(n_phases + 1), 1.0e-9_rp))//','//nl//others//nl//'  "awake_share": '// &
      str(all(n_phases + 3)/max(steps, 1.0_rp))//','//nl//'  "imbalance_mean": '// &
      str(exchange%balance%sum/max(1.0_rp, real(clock%step - self%first_step, rp)))//','//nl// &
      '  "imbalance_worst": '//str(exchange%balance%worst)//','//nl//'  "partitions": '// &
      str(exchange%balance%cuts)//','//nl//'  "messages": '//str(nint(all(n_phases + 4), i8))// &
      ','//nl//'  "bytes_sent": '//str(nint(all(n_phases + 5), i8))//','//nl// &
      '  "waiting_percent": '//str(share(n_phases + 1))//','//nl//'  "phase_percent": {'
    do k = 1, n_phases
      text = text//nl//'    "'//trim(phase_name(k))//'": '//str(share(k))// &
             trim(merge(' ', ',', k == n_phases))
    end do
    text = text//nl//'  }'//nl//'}'//nl
  end function json

  !> Members of NAME_summary.json that every kind of run has, each with its comma.
  function run_json(ranks, steps, wall, cpu, memory) result(text)
    integer, intent(in) :: ranks
    integer(i8), intent(in) :: steps
    real(rp), intent(in) :: wall, cpu   !! wall-clock time, processor time of all ranks [s]
    real(rp), intent(in) :: memory      !! of all ranks [bytes]
    character(:), allocatable :: text

    text = '  "version": "'//release//'",'//nl//'  "commit": "'//commit()//'",'//nl// &
      '  "finished": "'//now()//'",'//nl//'  "ranks": '//str(ranks)//','//nl//'  "steps": '// &
      str(steps)//','//nl//'  "wall_seconds": '//str(wall)//','//nl//'  "cpu_seconds": '// &
      str(cpu)//','//nl//'  "peak_memory_bytes": '//str(nint(memory, i8))//','
  end function run_json

  !> Text of a share in percent, six characters wide.
  pure function percent(share) result(text)
    real(rp), intent(in) :: share
    character(6) :: text

    write (text, '(f6.1)') 100.0_rp*share
  end function percent

  !> Text of a duration in seconds, minutes or hours.
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

  !> Start the clock of the run or of its resumed part.
  subroutine start_samples(self, interval, is_given)
    class(time_left_t), intent(out) :: self
    real(rp), intent(in) :: interval          !! interval of lines in a log file [s]
    logical, intent(in) :: is_given

    self%interval = interval
    self%is_given = is_given
    self%began = wall_time()
    self%last_shown = self%began
    call self%add_sample(0.0_rp, 0.0_rp)
  end subroutine start_samples

  !> Add a sample. When the list is full, every other sample is dropped and the interval doubled.
  pure subroutine add_sample(self, at, share)
    class(time_left_t), intent(inout) :: self
    real(rp), intent(in) :: at, share         !! time since start [s], completed share [-]

    if (self%n > 0) then
      if (at - self%at(self%n) < self%gap) return
    end if
    if (self%n == max_samples) then
      self%n = max_samples/2
      self%at(:self%n) = self%at(1::2)
      self%share(:self%n) = self%share(1::2)
      self%gap = 2.0_rp*self%gap
    end if
    self%n = self%n + 1
    self%at(self%n) = at
    self%share(self%n) = share
  end subroutine add_sample

  !> Remaining wall-clock time [s] at the mean speed in the later half of the time so far, so that a
  !> slow start has no effect.
  pure real(rp) function seconds(self, at, share)
    class(time_left_t), intent(in) :: self
    real(rp), intent(in) :: at, share         !! time since start [s], completed share [-]
    integer :: k

    k = max(1, count(self%at(:self%n) <= 0.5_rp*at))
    seconds = (1.0_rp - share)*(at - self%at(k))/max(share - self%share(k), 1.0e-12_rp)
  end function seconds

  !> True if a progress line is due. In a log file lines are `interval` apart, or a twentieth of the
  !> time so far if that is longer and the input does not give the interval.
  logical function is_due(self, share, at, width)
    class(time_left_t), intent(inout) :: self
    real(rp), intent(in) :: share            !! completed share of the run
    real(rp), intent(out) :: at               !! wall-clock time since the start [s]
    integer, intent(out) :: width  !! width of the terminal window [characters]; 0: no window
    real(rp) :: gap, now

    now = wall_time()
    at = now - self%began
    call self%add_sample(at, share)
    width = 0
    gap = self%interval
    is_due = now - self%last_shown >= min(gap, redraw_interval)
    if (.not. is_due) return
    width = window_width()
    if (width > 0) return
    if (.not. self%is_given) gap = max(gap, 0.05_rp*at)
    is_due = now - self%last_shown >= gap
  end function is_due

  !> Show a progress line.
  subroutine show(self, text, width)
    class(time_left_t), intent(inout) :: self
    character(*), intent(in) :: text
    integer, intent(in) :: width

    self%last_shown = wall_time()
    call show_progress(text, width)
  end subroutine show

end module output_progress
