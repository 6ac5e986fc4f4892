! SPDX-License-Identifier: MIT
!> Cost model of particles for load balancing: by their state instead of measured time, so that the
!> same run is always partitioned alike.
module run_particle_cost
  use base_kinds, only: nlane, rp
  use particles_store, only: awake, f_pos, f_rate, rests
  use simulation_parts, only: simulation_t
  implicit none (type, external)
  private

  public :: particle_costs

  ! Measured costs (docs/speed.md, Ranks), in units of an awake elastic particle far from tools
  ! (0.06 us). In the stirring plate of benchmarks/speed work at nodes takes 16.2 % of a step of
  ! 2.84 ms, and 1.1 % of it without a tool, for the 314 particles at the face: 1.37 us each, 22
  ! awake ones. Two ranks then wait 1 % of a step; with 9, 14 and 32 for each 9, 7 and 6 %.
  real(rp), parameter :: cost_by_rest(0:2) = [1.0_rp, 0.04_rp, 0.035_rp]  !! awake, held, asleep
  real(rp), parameter :: flow_cost = 0.15_rp                  !! added if a particle of the block
                                                              !! flows
  real(rp), parameter :: contact_cost = 22.0_rp               !! added in contact with a tool
  real(rp), parameter :: contact_distance = 0.75_rp           !! contact of centres with a tool
                                                              !! [spacings]

contains

  !> Cost of each particle of block `b`; 0 for unused lanes.
  pure function particle_costs(sim, b) result(load)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b
    real(rp) :: d(nlane), load(nlane)
    logical :: is_awake(nlane)
    integer :: k, n, rest(nlane)

    n = sim%particles%count(b)
    rest = rests(nlane, sim%particles%tag(:, b))
    load = cost_by_rest(rest)
    load(n + 1:) = 0.0_rp
    is_awake = rest == awake
    is_awake(n + 1:) = .false.
    if (.not. any(is_awake)) return
    associate (ps => sim%particles%ps(:, :, b), &
               reach => contact_distance*sim%scene%body(sim%particles%body(b))%mean_spacing())
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

  !> True if block `b` is known to be farther than `reach` [m] from tool `k`.
  pure logical function is_far(sim, k, b, reach)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: k, b
    real(rp), intent(in) :: reach

    is_far = .false.
    if (.not. allocated(sim%particles%clearance)) return
    if (b > size(sim%particles%clearance, 2)) return
    is_far = sim%particles%clearance(k, b) > reach + sim%clock%displacement &
      + sim%tool(k)%displacement()
  end function is_far

end module run_particle_cost
