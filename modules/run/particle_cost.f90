! SPDX-License-Identifier: MIT
!> What particles cost in a step, for the balance of ranks: by what they do, not by the clock, so
!> that the same run is always divided alike.
module run_particle_cost
  use base_kinds, only: nlane, rp
  use particles_store, only: awake, f_pos, f_rate, rests
  use step_simulation, only: simulation_t
  implicit none (type, external)
  private

  public :: particle_costs

  ! Measured (docs/speed.md, Ranks); that of an awake elastic particle far from tools is 1 (0.06
  ! us). In the stirring plate of benchmarks/speed work at nodes takes 16.2 % of a step of 2.84 ms,
  ! and 1.1 % of it without a tool, for the 314 particles at the face: 1.37 us each, 22 awake ones.
  ! Two ranks then wait 1 % of a step; with 9, 14 and 32 for each 9, 7 and 6 %.
  real(rp), parameter :: cost(0:2) = [1.0_rp, 0.04_rp, 0.035_rp]   !! by rest
  real(rp), parameter :: flow_cost = 0.15_rp     !! more, where one of the block flows
  real(rp), parameter :: contact_cost = 22.0_rp    !! more, at a tool
  real(rp), parameter :: at_tool = 0.75_rp       !! centres of those in contact [spacings]

contains

  !> Cost of each particle of block `b`, 0 behind the last.
  pure function particle_costs(sim, b) result(load)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b
    real(rp) :: d(nlane), load(nlane)
    logical :: is_awake(nlane)
    integer :: k, n, rest(nlane)

    n = sim%particles%count(b)
    rest = rests(nlane, sim%particles%tag(:, b))
    load = cost(rest)
    load(n + 1:) = 0.0_rp
    is_awake = rest == awake
    is_awake(n + 1:) = .false.
    if (.not. any(is_awake)) return
    associate (ps => sim%particles%ps(:, :, b), &
               reach => at_tool*sim%scene%body(sim%particles%body(b))%mean_spacing())
      if (any(is_awake .and. ps(:, f_rate) > 0.0_rp)) then
        where (is_awake) load = load + flow_cost
      end if
      do k = 1, size(sim%tool)
        if (is_far(sim, k, b, reach)) cycle
        call sim%tool(k)%clearances(n, ps(:, f_pos:f_pos + 2), reach, d)
        where (is_awake(:n) .and. d(:n) < reach) load(:n) = load(:n) + contact_cost
      end do
    end associate
  end function particle_costs

  !> Whether block `b` is known to be farther from tool `k` than `reach`.
  pure logical function is_far(sim, k, b, reach)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: k, b
    real(rp), intent(in) :: reach

    is_far = .false.
    if (.not. allocated(sim%blocks%clearance)) return
    if (b > size(sim%blocks%clearance, 2)) return
    is_far = sim%blocks%clearance(k, b) > reach + sim%clock%displacement &
      + sim%tool(k)%displacement()
  end function is_far

end module run_particle_cost
