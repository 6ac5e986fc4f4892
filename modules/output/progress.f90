! SPDX-License-Identifier: MIT
!> Progress and speed of a run: progress lines, and the summary at its end.
module output_progress
  use base_errors, only: error_t
  use base_files, only: write_whole
  use base_kinds, only: i8, rp
  use base_log, only: say
  use base_system, only: peak_memory
  use base_text, only: str
  use base_timers, only: cpu_seconds, n_phases, now, phase_name, wall_time
  use base_version, only: commit, release
  use output_time_left, only: time_left_t
  use simulation_parts, only: simulation_t
  implicit none (type, external)
  private

  public :: progress_t, percent, span

  character(*), parameter :: nl = new_line('a')

  !> State at the start of this part of a run.
  type :: progress_t
    real(rp) :: started = 0.0_rp        !! wall-clock time at the start [s]
    real(rp), private :: cpu_started = 0.0_rp   !! processor time of this rank at the start [s]
    type(time_left_t), private :: left
    integer(i8), private :: first_step = 0
    real(rp), private :: first_time = 0.0_rp    !! [s]
    integer(i8), private :: particles = 0       !! on all ranks
  contains
    procedure :: init, show_line, write_summary
  end type progress_t

contains

  !> Collective. Start the clocks of the run or of its resumed part.
  subroutine init(self, sim)
    class(progress_t), intent(out) :: self
    type(simulation_t), intent(in) :: sim

    self%started = wall_time()
    self%cpu_started = cpu_seconds()
    call self%left%init(sim%scene%output%progress_interval, sim%scene%output%progress_is_asked)
    self%first_step = sim%clock%step
    self%first_time = sim%clock%time
    self%particles = sim%particles%total()
    call sim%world%sum(self%particles)
  end subroutine init

  !> Show a progress line with percent, remaining time, simulated time and speed, if it is due.
  subroutine show_line(self, sim)
    class(progress_t), intent(inout) :: self
    type(simulation_t), intent(in) :: sim
    real(rp) :: at, speed, share, done
    integer :: width

    if (.not. sim%world%is_root() .or. sim%scene%output%is_quiet) return
    share = (sim%clock%time - self%first_time)/max(sim%scene%end_time - self%first_time, &
                                                    tiny(1.0_rp))
    done = sim%clock%time/max(sim%scene%end_time, tiny(1.0_rp))
    if (sim%scene%max_steps > 0) then
      share = max(share, real(sim%clock%step - self%first_step, rp)/max(1.0_rp, &
                  real(sim%scene%max_steps - self%first_step, rp)))
      done = max(done, real(sim%clock%step, rp)/real(sim%scene%max_steps, rp))
    end if
    if (.not. self%left%is_due(share, at, width)) return
    speed = real(self%particles, rp)*real(sim%clock%step - self%first_step, rp)/max(at, 1.0e-9_rp)
    call self%left%show(percent(done)//' %  left '//span(self%left%seconds(at, share))// &
                        '  t = '//str(sim%clock%time)//' s  step '//str(sim%clock%step)// &
                        '  dt = '//str(sim%clock%dt)//' s  '//str(speed*1.0e-6_rp)// &
                        ' M particle-steps/s', width)
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
                     json(self, sim, wall, steps, all, others), error)
    if (.not. sim%scene%output%is_quiet) then
      call say(str(sim%clock%step - self%first_step)//' steps of '//str(self%particles)// &
               ' particles in '//span(wall)//': '//str(steps/wall*1.0e-6_rp)// &
               ' M particle-steps/s on '//str(sim%world%size)//' rank(s)')
    end if
  end subroutine write_summary

  !> Text of NAME_summary.json.
  function json(self, sim, wall, steps, all, others) result(text)
    type(progress_t), intent(in) :: self
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: wall                  !! [s]
    real(rp), intent(in) :: steps                 !! particle-steps
    real(rp), intent(in) :: all(n_phases + 6)     !! sums over ranks, as in `write_summary`
    character(*), intent(in) :: others
    character(:), allocatable :: text
    real(rp) :: share(n_phases + 1)
    integer :: k

    share = 100.0_rp*all([(k, k=1, n_phases), n_phases + 6])/max(sum(all(1:n_phases)), tiny(1.0_rp))
    text = '{'//nl//'  "version": "'//release//'",'//nl//'  "commit": "'//commit()//'",'//nl// &
      '  "finished": "'//now()//'",'//nl//'  "particles": '//str(self%particles)//','//nl// &
      '  "steps": '//str(sim%clock%step - self%first_step)//','//nl//'  "ranks": '// &
      str(sim%world%size)//','//nl//'  "wall_seconds": '//str(wall)//','//nl// &
      '  "cpu_seconds": '//str(all(n_phases + 1))//','//nl// &
      '  "particle_steps_per_wall_second": '//str(steps/wall)//','//nl// &
      '  "particle_steps_per_cpu_second": '//str(steps/max(all(n_phases + 1), 1.0e-9_rp))//','// &
      nl//others//nl//'  "awake_share": '//str(all(n_phases + 3)/max(steps, 1.0_rp))//','//nl// &
      '  "imbalance_mean": '//str(sim%exchange%balance%sum &
                                  /max(1.0_rp, real(sim%clock%step - self%first_step, rp)))// &
      ','//nl//'  "imbalance_worst": '//str(sim%exchange%balance%worst)//','//nl// &
      '  "partitions": '//str(sim%exchange%balance%cuts)//','//nl//'  "messages": '// &
      str(nint(all(n_phases + 4), i8))//','//nl//'  "bytes_sent": '// &
      str(nint(all(n_phases + 5), i8))//','//nl//'  "peak_memory_bytes": '// &
      str(nint(all(n_phases + 2), i8))//','//nl//'  "waiting_percent": '// &
      str(share(n_phases + 1))//','//nl//'  "phase_percent": {'
    do k = 1, n_phases
      text = text//nl//'    "'//trim(phase_name(k))//'": '//str(share(k))// &
             trim(merge(' ', ',', k == n_phases))
    end do
    text = text//nl//'  }'//nl//'}'//nl
  end function json

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

end module output_progress
