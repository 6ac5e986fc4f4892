! SPDX-License-Identifier: MIT
!> Estimate of the cost of a run in a few seconds, measured with steps of the scene itself: from its
!> start and, with tools, at later positions of their motion, so that contact is included, and
!> sleep where it begins within these steps. Elsewhere the cost has two bounds: all particles stay
!> awake, or those alone that are near a tool.
module front_estimate
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use base_timers, only: cpu_seconds
  use base_world, only: world_t
  use heat_alone_loop, only: next_switch
  use heat_alone_state, only: heat_run_t
  use output_writer, only: next_time
  use particles_store, only: f_pos
  use run_balance, only: cost_by_rest
  use run_loop, only: advance, ended_well
  use run_regrid, only: regrid
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: cost_t, estimate_run, estimate_heat, range_of

  !> Estimated cost of a run, without its output.
  type :: cost_t
    !> Least and largest processor time of all ranks for the whole run [s].
    real(rp) :: least = 0.0_rp, seconds = 0.0_rp
    real(rp) :: steps = 0.0_rp            !! steps of the run
    !> Steps with the largest and the least mass scaling of its range, over `steps`.
    real(rp) :: more_steps(2) = 1.0_rp
    !> Mean share of awake particles, at least and at most.
    real(rp) :: least_awake = 1.0_rp, awake = 1.0_rp
    integer :: measured = 0               !! steps made for the estimate
  contains
    procedure :: run_time
  end type cost_t

  integer, parameter :: n_positions = 6   !! positions of the tools, in equal parts of the run
  !> Steps until material sleeps, at the start and after a tool was moved.
  integer, parameter :: settling_steps(2) = [320, 150]
  integer, parameter :: measured_steps = 100  !! measured steps, a sort interval
  integer, parameter :: min_steps = 6     !! least number of measured steps
  !> Processor time of a rank for a position of the tool after which the measurement ends [s].
  real(rp), parameter :: time_limit = 0.4_rp
  real(rp), parameter :: heat_time = 1.0_rp  !! measured processor time of heat-only runs [s]
  real(rp), parameter :: max_settling = 0.1_rp    !! largest share of the steps for settling

contains

  !> Text on the time of the run on a number of ranks.
  pure function run_time(self, ranks) result(text)
    class(cost_t), intent(in) :: self
    integer, intent(in) :: ranks
    character(:), allocatable :: text

    associate (s => [self%least, self%seconds]*self%more_steps)
      text = range_of(s(1), s(2))//' s of processor time = '// &
             range_of(s(1)/ranks/3600.0_rp, s(2)/ranks/3600.0_rp)//' h on '//str(ranks)// &
             ' free core(s), without output; measured in '//str(self%measured)//' steps'
    end associate
  end function run_time

  !> Text of a range of numbers; of one number where they are the same.
  pure function range_of(least, most) result(text)
    real(rp), intent(in) :: least, most
    character(:), allocatable :: text

    text = str(most)
    if (least < most) text = str(least)//' to '//text
  end function range_of

  !> Collective. Estimate the cost of a run; the simulation cannot be used afterwards.
  subroutine estimate_run(sim, dt, cost)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                     !! first time step [s]
    type(cost_t), intent(out) :: cost
    real(rp), parameter :: asleep_cost = cost_by_rest(2)   !! over that of an awake particle
    real(rp) :: awake, near, per_step, start
    integer :: i, n, parts
    logical :: ok

    sim%tool%monitor%is_on = .false.               ! phases last for their full duration
    sim%clock%next_history = huge(1.0_rp)          ! a row that is due conducts heat
    sim%clock%next_frame = huge(1.0_rp)
    cost%steps = sim%scene%end_time/dt
    if (sim%scene%max_steps > 0) cost%steps = min(cost%steps, real(sim%scene%max_steps, rp))
    if (sim%scene%method%adapts_mass) cost%more_steps = &
      sqrt(sim%clock%mass_scaling/sim%scene%method%scaling_range([2, 1]))
    cost%awake = 0.0_rp
    cost%least_awake = 0.0_rp
    parts = merge(n_positions, 1, size(sim%tool) > 0)
    do i = 1, parts
      n = measured_steps
      if (sim%scene%method%sleep%is_on) n = measured_steps + settling_steps(min(i, 2))
      n = max(measured_steps, min(n, int(cost%steps*max_settling)))
      n = max(1, int(min(real(n, rp), cost%steps)))
      call measure_steps(sim, dt*cost%steps*(i - 0.5_rp)/parts, n, cost%measured, per_step, &
                         awake, start, ok)
      if (i == 1) cost%seconds = max(0.0_rp, start)   ! steps before material sleeps
      if (i == 1) cost%least = cost%seconds
      cost%seconds = cost%seconds + cost%steps*per_step/parts
      cost%awake = cost%awake + awake/parts
      near = awake
      if (sim%scene%method%sleep%is_on) near = min(awake, share_near_tools(sim))
      cost%least = cost%least + cost%steps*per_step/parts*(near + asleep_cost*(1.0_rp - near))/ &
                   (awake + asleep_cost*(1.0_rp - awake))
      cost%least_awake = cost%least_awake + near/parts
      if (.not. ok) exit
    end do
  end subroutine estimate_run

  !> Collective. Move the tools to their positions at `time`, make steps, and measure the last ones.
  subroutine measure_steps(sim, time, n, measured, per_step, awake, start, ok)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: time                   !! time of the tool positions [s]
    integer, intent(in) :: n                       !! number of steps
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
      sim%clock%time = time
      sim%clock%heat_time = sim%clock%time
      do k = 1, size(sim%tool)
        call sim%tool(k)%move_to(sim%clock%time)
        call sim%tool(k)%move_to(sim%clock%time)   ! displacement of a step: zero
      end do
      call regrid(sim)
    end if
    message = ''
    status = ended_well
    first = max(0, n - measured_steps)
    started = cpu_seconds()
    begun = started
    before = sim%particles%n_awake_particle_steps
    do i = 1, n
      if (i == first + 1) then
        begun = cpu_seconds()
        before = sim%particles%n_awake_particle_steps
      end if
      call advance(sim, status, message)
      if (status /= ended_well .or. sim%clock%time >= sim%scene%end_time*(1.0_rp - 1.0e-12_rp)) exit
      spent(1) = cpu_seconds() - started
      call sim%world%max(spent(:1))
      if (i > first .and. i >= min_steps .and. spent(1) > time_limit) exit
      if (i < first .and. spent(1) > 0.8_rp*time_limit) first = i   ! start of the measurement
    end do
    i = min(i, n)
    if (i <= first) first = 0                      ! the run ended before the measurement
    ok = status == ended_well
    spent = [cpu_seconds() - begun, real(sim%particles%n_awake_particle_steps - before, rp), &
             real(sim%particles%total(), rp), begun - started]
    call sim%world%sum(spent)
    measured = measured + i
    per_step = spent(1)/max(1, i - first)
    awake = spent(2)/max(1.0_rp, spent(3)*(i - first))
    start = spent(4) - first*per_step
  end subroutine measure_steps

  !> Collective. Share of the particles within twice the distance to a tool in which none sleeps.
  real(rp) function share_near_tools(sim) result(share)
    type(simulation_t), intent(in) :: sim
    real(rp) :: d(nlane), nearest(nlane), reach, total(2)
    integer :: b, k, n

    reach = 2.0_rp*sim%scene%method%sleep%distance
    total = [0.0_rp, real(sim%particles%total(), rp)]
    do b = 1, sim%particles%nblk
      n = sim%particles%count(b)
      nearest = huge(1.0_rp)
      do k = 1, size(sim%tool)
        call sim%tool(k)%clearances(n, sim%particles%ps(:, f_pos:f_pos + 2, b), &
                                    reach, d(:n))
        nearest(:n) = min(nearest(:n), d(:n))
      end do
      total(1) = total(1) + count(nearest(:n) < reach)
    end do
    call sim%world%sum(total)
    share = total(1)/max(1.0_rp, total(2))
  end function share_near_tools

  !> Collective. Estimate the cost of a heat-only run, whose state cannot be used afterwards. The
  !> remaining steps are assumed to be as long and as expensive as the last half of the measured
  !> ones.
  subroutine estimate_heat(world, scene, run, cost)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    type(cost_t), intent(out) :: cost
    real(rp), allocatable :: time(:), seconds(:)   ! time and cost at the ends of the steps [s]
    real(rp) :: begun, rest, spent(1)
    integer :: half, n
    logical :: is_complete

    allocate (time(0), seconds(0))
    begun = cpu_seconds()
    do
      call run%integrator%advance(run%heat, run%time, min(scene%end_time, next_switch(run), &
        next_time(scene%output%history_interval, run%time), &
        next_time(scene%output%frame_interval, run%time)))
      spent = cpu_seconds() - begun
      call world%sum(spent)
      time = [time, run%time]
      seconds = [seconds, spent]
      n = size(time)
      is_complete = scene%is_over(run%time, int(n, i8))
      if (is_complete .or. run%integrator%is_stuck) exit
      if (spent(1) > heat_time .and. n >= min_steps) exit
    end do
    cost%measured = n
    cost%seconds = seconds(n)
    cost%steps = real(n, rp)
    if (.not. (is_complete .or. run%integrator%is_stuck)) then
      half = n/2
      rest = (scene%end_time - time(n))/(time(n) - time(half))
      cost%seconds = cost%seconds + rest*(seconds(n) - seconds(half))
      cost%steps = cost%steps + rest*(n - half)
    end if
    cost%least = cost%seconds
  end subroutine estimate_heat

end module front_estimate
