! SPDX-License-Identifier: MIT
!> What a run will cost, measured on the scene itself: steps from its start, and with the tools
!> where their phases will have taken them, so that contact and sleep are counted as they will be.
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

  type :: cost_t
    real(rp) :: seconds = 0.0_rp          !! processor time of all ranks for the whole run [s]
    real(rp) :: output = 0.0_rp           !! of this for what is written [s]
    real(rp) :: steps = 0.0_rp            !! of the run
    real(rp) :: awake = 1.0_rp            !! share of the particles, mean over the steps
    integer :: looked = 0                 !! steps made to find out
    logical :: is_bound = .false.         !! more may fall asleep later on: an upper bound
  contains
    procedure :: run_time
  end type cost_t

  !> Steps of heat alone: their ends, and the processor time of all ranks until then.
  type :: heat_cost_t
    real(rp), allocatable :: time(:), seconds(:)   !! [s]
    logical :: is_whole = .false.                  !! to the end of the run
  end type heat_cost_t

  !> A stretch of the run, and a time in it to look at.
  type :: stretch_t
    real(rp) :: from = 0.0_rp, to = 0.0_rp
  end type stretch_t

  integer, parameter :: settle(2) = [320, 150]   !! steps until what may sleep does: at first, after
                                                 !! a tool was moved
  integer, parameter :: watch = 100       !! steps that are measured: a round of sorts
  integer, parameter :: fewest = 20       !! of the measured
  real(rp), parameter :: patience = 4.0_rp   !! processor time of a rank for a stretch, above which
                                             !! it is cut short [s]
  real(rp), parameter :: enough = 1.0_rp     !! processor time of heat alone that is measured [s]
  real(rp), parameter :: least = 0.04_rp  !! part of the run that is worth a look
  real(rp), parameter :: part = 0.1_rp    !! of the run that is worth the wait for sleep

contains

  !> The time of the run on so many ranks, in words.
  pure function run_time(self, ranks) result(text)
    class(cost_t), intent(in) :: self
    integer, intent(in) :: ranks
    character(:), allocatable :: text

    text = str(self%seconds)//' s of processor time '
    if (self%is_bound) text = text//'at most (less, as more of the metal falls asleep) '
    text = text//'= '//str(self%seconds/ranks/3600.0_rp)//' h on '// &
           str(ranks)//' free core(s), measured in '//str(self%looked)//' steps; '// &
           str(self%output)//' s of it for output, without the disk'
  end function run_time

  !> Collective; the simulation is of no use afterwards. `dt`: the first step [s].
  subroutine estimate_run(world, sim, dt, cost)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    type(cost_t), intent(out) :: cost
    type(stretch_t), allocatable :: stretch(:)
    real(rp) :: awake, per_step, start
    integer :: i, n
    logical :: ok

    sim%tool%watch%is_on = .false.               ! phases take as long as they can
    cost%steps = sim%scene%end_time/dt
    if (sim%scene%max_steps > 0) cost%steps = min(cost%steps, real(sim%scene%max_steps, rp))
    cost%awake = 0.0_rp
    cost%is_bound = sim%scene%method%sleep%is_on
    call divide(sim, dt*cost%steps, stretch)
    do i = 1, size(stretch)
      n = watch
      if (sim%scene%method%sleep%is_on) n = watch + settle(min(i, 2))
      n = max(watch, min(n, int(cost%steps*part)))
      n = max(1, int(min(real(n, rp), cost%steps)))
      call look(world, sim, stretch(i), n, cost%looked, per_step, awake, start, ok)
      if (i == 1) cost%seconds = max(0.0_rp, start)   ! before anything sleeps
      associate (share => (stretch(i)%to - stretch(i)%from)/max(dt*cost%steps, tiny(1.0_rp)))
        cost%seconds = cost%seconds + share*cost%steps*per_step
        cost%awake = cost%awake + share*awake
      end associate
      if (.not. ok) exit
    end do
    cost%output = output_seconds(world, sim, dt*cost%steps, cost%steps)
    cost%seconds = cost%seconds + cost%output
  end subroutine estimate_run

  !> The phases of the tools, as far as they are worth a look: where any of them changes what it
  !> does. Without tools the whole run is one.
  subroutine divide(sim, end, stretch)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: end                    !! [s]
    type(stretch_t), allocatable, intent(out) :: stretch(:)
    integer, parameter :: most = 6
    real(rp), allocatable :: cut(:)
    real(rp) :: next, t
    integer :: i, k

    allocate (cut(1), source=0.0_rp)
    t = 0.0_rp
    do while (size(cut) < most)
      next = end
      do k = 1, size(sim%tool)
        if (.not. allocated(sim%tool(k)%motion%phase)) cycle
        t = 0.0_rp
        do i = 1, size(sim%tool(k)%motion%phase)
          if (sim%tool(k)%motion%phase(i)%duration <= 0.0_rp) exit
          t = t + sim%tool(k)%motion%phase(i)%duration
          if (t > cut(size(cut)) + least*end) next = min(next, t)
        end do
      end do
      if (next >= end*(1.0_rp - least)) exit
      cut = [cut, next]
    end do
    cut = [cut, end]
    stretch = [(stretch_t(cut(i), cut(i + 1)), i=1, size(cut) - 1)]
    if (size(sim%tool) > 0 .and. size(stretch) <= 3) stretch = halves(stretch)
  end subroutine divide

  !> Each stretch in two.
  pure function halves(stretch) result(finer)
    type(stretch_t), intent(in) :: stretch(:)
    type(stretch_t) :: finer(2*size(stretch))
    integer :: i

    do i = 1, size(stretch)
      associate (s => stretch(i))
        finer(2*i - 1) = stretch_t(s%from, 0.5_rp*(s%from + s%to))
        finer(2*i) = stretch_t(0.5_rp*(s%from + s%to), s%to)
      end associate
    end do
  end function halves

  !> Collective. Move the tools to the middle of a stretch and step on; processor time of all ranks
  !> a step and the share of awake particles, over the last steps.
  subroutine look(world, sim, stretch, n, looked, per_step, awake, start, ok)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    type(stretch_t), intent(in) :: stretch
    integer, intent(in) :: n                       !! steps
    integer, intent(inout) :: looked
    real(rp), intent(out) :: per_step, awake       !! [s], [-]
    real(rp), intent(out) :: start                 !! what the steps before took beyond that [s]
    logical, intent(out) :: ok
    character(:), allocatable :: message
    real(rp) :: begun, spent(4), started
    integer(i8) :: before
    integer :: first, i, k, status

    if (size(sim%tool) > 0) then
      sim%clock%time = 0.5_rp*(stretch%from + stretch%to)
      sim%clock%heat_time = sim%clock%time
      do k = 1, size(sim%tool)
        call sim%tool(k)%move_to(sim%clock%time)
        call sim%tool(k)%move_to(sim%clock%time)   ! no displacement since the last one
      end do
      call regrid(world, sim)
    end if
    message = ''
    status = ended_well
    first = max(0, n - watch)
    started = cpu_seconds()
    begun = started
    before = sim%blocks%awake_steps
    do i = 1, n
      if (i == first + 1) then
        begun = cpu_seconds()
        before = sim%blocks%awake_steps
      end if
      call advance(world, sim, status, message)
      if (status /= ended_well .or. sim%clock%time >= sim%scene%end_time*(1.0_rp - 1.0e-12_rp)) exit
      spent(1) = cpu_seconds() - started
      call world%max(spent(:1))
      if (i > first .and. i >= fewest .and. spent(1) > patience) exit
      if (i < first .and. spent(1) > 0.8_rp*patience) first = i     ! measure from here on
    end do
    i = min(i, n)
    if (i <= first) first = 0                      ! the end came before
    ok = status == ended_well
    spent = [cpu_seconds() - begun, real(sim%blocks%awake_steps - before, rp), &
             real(sim%particles%total(), rp), begun - started]
    call world%sum(spent)
    looked = looked + i
    per_step = spent(1)/max(1, i - first)
    awake = spent(2)/max(1.0_rp, spent(3)*(i - first))
    start = spent(4) - first*per_step
  end subroutine look

  !> Collective. The same of heat alone; its state is of no use afterwards. The scene is computed
  !> through in `coarse` cells, for how the steps and their cost change with time, and from
  !> the start in its own, for what they cost.
  subroutine estimate_heat(world, scene, names, run, coarse, cost)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: names(:)           !! of the probes
    type(heat_run_t), intent(inout) :: run, coarse
    type(cost_t), intent(out) :: cost
    type(heat_cost_t) :: all, first
    real(rp) :: rest
    integer :: half, k, last, n

    call advance_heat(world, scene, enough, run, first)
    n = size(first%time)
    cost%looked = n
    cost%seconds = first%seconds(n)
    cost%steps = real(n, rp)
    if (.not. (first%is_whole .or. run%integrator%is_stuck)) then
      call advance_heat(world, scene, huge(1.0_rp), coarse, all)
      last = size(all%time)
      half = max(1, count(all%time <= first%time(max(1, n/2))))
      k = min(last, max(half + 1, count(all%time <= first%time(n))))
      rest = 0.0_rp                                ! coarse steps are few: what was computed is all
      if (k > half) rest = (all%seconds(last) - all%seconds(k))/max(all%seconds(k) &
          - all%seconds(half), tiny(1.0_rp))
      cost%seconds = cost%seconds + rest*(first%seconds(n) - first%seconds(max(1, n/2)))
      cost%steps = cost%steps + real(last - k, rp)
    end if
    cost%output = heat_output_seconds(world, scene, names, run, cost%steps)
    cost%seconds = cost%seconds + cost%output
  end subroutine estimate_heat

  !> Collective. Advance until the end of the run, or until `most` seconds of processor time of all
  !> ranks are spent.
  subroutine advance_heat(world, scene, most, run, cost)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: most                   !! [s]
    type(heat_run_t), intent(inout) :: run
    type(heat_cost_t), intent(out) :: cost
    real(rp) :: begun, spent(1)

    allocate (cost%time(0), cost%seconds(0))
    begun = cpu_seconds()
    do while (.not. cost%is_whole)
      call run%integrator%advance(run%heat, run%time, min(scene%end_time, next_switch(run), &
        next_time(scene%output%history_interval, run%time), &
        next_time(scene%output%frame_interval, run%time)))
      spent = cpu_seconds() - begun
      call world%sum(spent)
      cost%time = [cost%time, run%time]
      cost%seconds = [cost%seconds, spent]
      cost%is_whole = run%time >= scene%end_time*(1.0_rp - 1.0e-12_rp) &
                      .or. (scene%max_steps > 0 .and. size(cost%time) >= scene%max_steps)
      if (run%integrator%is_stuck .or. (spent(1) > most .and. size(cost%time) >= fewest)) exit
    end do
  end subroutine advance_heat

end module front_estimate
