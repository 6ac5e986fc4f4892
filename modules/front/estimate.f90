! SPDX-License-Identifier: MIT
!> Estimate of the cost of a run, measured with steps of the scene itself from its start and with
!> the tools at later positions of their motion, so that contact and sleep are included.
module front_estimate
  use base_kinds, only: i8, rp
  use base_text, only: str
  use base_timers, only: cpu_seconds
  use comm_world, only: world_t
  use front_estimate_output, only: heat_output_seconds, output_seconds
  use heat_alone_loop, only: next_switch
  use heat_alone_state, only: heat_run_t
  use output_writer, only: next_time
  use run_loop, only: advance, ended_well
  use run_regrid, only: regrid
  use state_scene, only: scene_t
  use step_simulation, only: simulation_t
  implicit none (type, external)
  private

  public :: cost_t, estimate_run, estimate_heat

  !> Estimated cost of a run.
  type :: cost_t
    real(rp) :: seconds = 0.0_rp          !! processor time of all ranks for the whole run [s]
    real(rp) :: output = 0.0_rp           !! part of it for output [s]
    real(rp) :: steps = 0.0_rp            !! steps of the run
    real(rp) :: awake = 1.0_rp            !! mean share of awake particles
    integer :: measured = 0               !! steps made for the estimate
    logical :: is_bound = .false.         !! more may fall asleep later on: an upper bound
  contains
    procedure :: run_time
  end type cost_t

  !> Steps of a heat-only run: end times, and processor time of all ranks until then.
  type :: heat_cost_t
    real(rp), allocatable :: time(:), seconds(:)   !! [s]
    logical :: is_complete = .false.               !! to the end of the run
  end type heat_cost_t

  !> An interval of the run.
  type :: interval_t
    real(rp) :: from = 0.0_rp, to = 0.0_rp
  end type interval_t

  integer, parameter :: settling_steps(2) = [320, 150]  !! steps until material sleeps: at the
                                                 !! start, after a tool was moved
  integer, parameter :: measured_steps = 100  !! measured steps, a sort interval
  integer, parameter :: min_steps = 20    !! least number of measured steps
  real(rp), parameter :: time_limit = 4.0_rp  !! processor time of a rank per interval, above
                                             !! which the measurement ends [s]
  real(rp), parameter :: heat_time = 1.0_rp  !! measured processor time of heat-only runs [s]
  real(rp), parameter :: min_share = 0.04_rp  !! least interval over the run
  real(rp), parameter :: max_settling = 0.1_rp    !! largest share of the steps for settling

contains

  !> Text on the time of the run on a number of ranks.
  pure function run_time(self, ranks) result(text)
    class(cost_t), intent(in) :: self
    integer, intent(in) :: ranks
    character(:), allocatable :: text

    text = str(self%seconds)//' s of processor time '
    if (self%is_bound) text = text//'at most (less, as more of the metal falls asleep) '
    text = text//'= '//str(self%seconds/ranks/3600.0_rp)//' h on '// &
           str(ranks)//' free core(s), measured in '//str(self%measured)//' steps; '// &
           str(self%output)//' s of it for output, without the disk'
  end function run_time

  !> Collective. Estimate the cost of a run; the simulation cannot be used afterwards.
  subroutine estimate_run(world, sim, dt, cost)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                     !! first time step [s]
    type(cost_t), intent(out) :: cost
    type(interval_t), allocatable :: interval(:)
    real(rp) :: awake, per_step, start
    integer :: i, n
    logical :: ok

    sim%tool%monitor%is_on = .false.               ! phases last for their full duration
    cost%steps = sim%scene%end_time/dt
    if (sim%scene%max_steps > 0) cost%steps = min(cost%steps, real(sim%scene%max_steps, rp))
    cost%awake = 0.0_rp
    cost%is_bound = sim%scene%method%sleep%is_on
    call divide_run(sim, dt*cost%steps, interval)
    do i = 1, size(interval)
      n = measured_steps
      if (sim%scene%method%sleep%is_on) n = measured_steps + settling_steps(min(i, 2))
      n = max(measured_steps, min(n, int(cost%steps*max_settling)))
      n = max(1, int(min(real(n, rp), cost%steps)))
      call measure_interval(world, sim, interval(i), n, cost%measured, per_step, awake, start, ok)
      if (i == 1) cost%seconds = max(0.0_rp, start)   ! steps before material sleeps
      associate (share => (interval(i)%to - interval(i)%from)/max(dt*cost%steps, tiny(1.0_rp)))
        cost%seconds = cost%seconds + share*cost%steps*per_step
        cost%awake = cost%awake + share*awake
      end associate
      if (.not. ok) exit
    end do
    cost%output = output_seconds(world, sim, dt*cost%steps, cost%steps)
    cost%seconds = cost%seconds + cost%output
  end subroutine estimate_run

  !> Divide the run into intervals at the phases of the tools that are long enough to be measured.
  subroutine divide_run(sim, end, interval)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: end                    !! end of the run [s]
    type(interval_t), allocatable, intent(out) :: interval(:)
    integer, parameter :: max_intervals = 6
    real(rp), allocatable :: cut(:)
    real(rp) :: next, t
    integer :: i, k

    allocate (cut(1), source=0.0_rp)
    t = 0.0_rp
    do while (size(cut) < max_intervals)
      next = end
      do k = 1, size(sim%tool)
        if (.not. allocated(sim%tool(k)%motion%phase)) cycle
        t = 0.0_rp
        do i = 1, size(sim%tool(k)%motion%phase)
          if (sim%tool(k)%motion%phase(i)%duration <= 0.0_rp) exit
          t = t + sim%tool(k)%motion%phase(i)%duration
          if (t > cut(size(cut)) + min_share*end) next = min(next, t)
        end do
      end do
      if (next >= end*(1.0_rp - min_share)) exit
      cut = [cut, next]
    end do
    cut = [cut, end]
    interval = [(interval_t(cut(i), cut(i + 1)), i=1, size(cut) - 1)]
    if (size(sim%tool) > 0 .and. size(interval) <= 3) interval = halves(interval)
  end subroutine divide_run

  !> Halve each interval.
  pure function halves(interval) result(finer)
    type(interval_t), intent(in) :: interval(:)
    type(interval_t) :: finer(2*size(interval))
    integer :: i

    do i = 1, size(interval)
      associate (s => interval(i))
        finer(2*i - 1) = interval_t(s%from, 0.5_rp*(s%from + s%to))
        finer(2*i) = interval_t(0.5_rp*(s%from + s%to), s%to)
      end associate
    end do
  end function halves

  !> Collective. Move the tools to the middle of an interval and make steps; measure the last ones.
  subroutine measure_interval(world, sim, interval, n, measured, per_step, awake, start, ok)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    type(interval_t), intent(in) :: interval
    integer, intent(in) :: n                       !! steps
    integer, intent(inout) :: measured
    real(rp), intent(out) :: per_step              !! processor time of all ranks per step [s]
    real(rp), intent(out) :: awake                 !! share of awake particles
    real(rp), intent(out) :: start                 !! additional time of the steps before [s]
    logical, intent(out) :: ok
    character(:), allocatable :: message
    real(rp) :: begun, spent(4), started
    integer(i8) :: before
    integer :: first, i, k, status

    if (size(sim%tool) > 0) then
      sim%clock%time = 0.5_rp*(interval%from + interval%to)
      sim%clock%heat_time = sim%clock%time
      do k = 1, size(sim%tool)
        call sim%tool(k)%move_to(sim%clock%time)
        call sim%tool(k)%move_to(sim%clock%time)   ! displacement of a step: zero
      end do
      call regrid(world, sim)
    end if
    message = ''
    status = ended_well
    first = max(0, n - measured_steps)
    started = cpu_seconds()
    begun = started
    before = sim%blocks%n_awake_particle_steps
    do i = 1, n
      if (i == first + 1) then
        begun = cpu_seconds()
        before = sim%blocks%n_awake_particle_steps
      end if
      call advance(world, sim, status, message)
      if (status /= ended_well .or. sim%clock%time >= sim%scene%end_time*(1.0_rp - 1.0e-12_rp)) exit
      spent(1) = cpu_seconds() - started
      call world%max(spent(:1))
      if (i > first .and. i >= min_steps .and. spent(1) > time_limit) exit
      if (i < first .and. spent(1) > 0.8_rp*time_limit) first = i   ! start to measure
    end do
    i = min(i, n)
    if (i <= first) first = 0                      ! the run ended before
    ok = status == ended_well
    spent = [cpu_seconds() - begun, real(sim%blocks%n_awake_particle_steps - before, rp), &
             real(sim%particles%total(), rp), begun - started]
    call world%sum(spent)
    measured = measured + i
    per_step = spent(1)/max(1, i - first)
    awake = spent(2)/max(1.0_rp, spent(3)*(i - first))
    start = spent(4) - first*per_step
  end subroutine measure_interval

  !> Collective. Estimate the cost of a heat-only run, whose state cannot be used afterwards. A run
  !> with `coarse` cells gives the change of steps and cost with time, the first steps of the run
  !> itself the cost of a step.
  subroutine estimate_heat(world, scene, names, run, coarse, cost)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: names(:)           !! names of the probes
    type(heat_run_t), intent(inout) :: run, coarse
    type(cost_t), intent(out) :: cost
    type(heat_cost_t) :: all, first
    real(rp) :: rest
    integer :: half, k, last, n

    call advance_heat(world, scene, heat_time, run, first)
    n = size(first%time)
    cost%measured = n
    cost%seconds = first%seconds(n)
    cost%steps = real(n, rp)
    if (.not. (first%is_complete .or. run%integrator%is_stuck)) then
      call advance_heat(world, scene, huge(1.0_rp), coarse, all)
      last = size(all%time)
      half = max(1, count(all%time <= first%time(max(1, n/2))))
      k = min(last, max(half + 1, count(all%time <= first%time(n))))
      rest = 0.0_rp                                ! few coarse steps: no further cost
      if (k > half) rest = (all%seconds(last) - all%seconds(k))/max(all%seconds(k) &
          - all%seconds(half), tiny(1.0_rp))
      cost%seconds = cost%seconds + rest*(first%seconds(n) - first%seconds(max(1, n/2)))
      cost%steps = cost%steps + real(last - k, rp)
    end if
    cost%output = heat_output_seconds(world, scene, names, run, cost%steps)
    cost%seconds = cost%seconds + cost%output
  end subroutine estimate_heat

  !> Collective. Advance to the end of the run or to a limit of processor time.
  subroutine advance_heat(world, scene, max_intervals, run, cost)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: max_intervals          !! [s]
    type(heat_run_t), intent(inout) :: run
    type(heat_cost_t), intent(out) :: cost
    real(rp) :: begun, spent(1)

    allocate (cost%time(0), cost%seconds(0))
    begun = cpu_seconds()
    do while (.not. cost%is_complete)
      call run%integrator%advance(run%heat, run%time, min(scene%end_time, next_switch(run), &
        next_time(scene%output%history_interval, run%time), &
        next_time(scene%output%frame_interval, run%time)))
      spent = cpu_seconds() - begun
      call world%sum(spent)
      cost%time = [cost%time, run%time]
      cost%seconds = [cost%seconds, spent]
      cost%is_complete = run%time >= scene%end_time*(1.0_rp - 1.0e-12_rp) &
                      .or. (scene%max_steps > 0 .and. size(cost%time) >= scene%max_steps)
      if (run%integrator%is_stuck .or. (spent(1) > max_intervals &
                                        .and. size(cost%time) >= min_steps)) exit
    end do
  end subroutine advance_heat

end module front_estimate
