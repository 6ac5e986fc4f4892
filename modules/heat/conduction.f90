! SPDX-License-Identifier: MIT
!> Conduction with a time step of its own, which spans as many mechanical steps as stability allows.
module heat_conduction
  use base_kinds, only: i8, nlane, rp
  use boundary_symmetry, only: r_warming, record_wall_heat, restore, swap_lists
  use heat_gaps, only: find_gaps, gaps_t
  use heat_nodes, only: centre_increment, gather_flux, gather_temperature, smoothed_fraction, &
                        stable_conduction
  use heat_nodes_implicit, only: solve_implicit
  use heat_sinks, only: advance_sinks, films_vary, find_sinks, reset_contact_sums, sinks_t
  use mpm_blocks, only: weights_of
  use mpm_constitutive, only: anneal_particles
  use particles_store, only: f_heat, f_mass, f_temp, n_conduction
  use simulation_nodes, only: clear_nodes
  use simulation_parts, only: simulation_t
  use simulation_probes, only: update_probe_temperatures
  use simulation_run, only: e_conduction, e_film, e_tool, e_wall_heat
  use transfer_conduction, only: compute_boundary_rates, compute_increment, heat_particles, &
                                 largest_rate
  implicit none (type, external)
  private

  public :: conduct, conduction_is_due, conduction_step

contains

  !> Conduction step [s]: the stable explicit one, or the implicit one as given or controlled by its
  !> error, which starts with the stable one.
  pure real(rp) function conduction_step(sim)
    type(simulation_t), intent(in) :: sim

    conduction_step = stable_conduction(sim%scene)
    associate (method => sim%scene%method)
      if (.not. method%implicit_heat .or. conduction_step >= huge(1.0_rp)) return
      if (method%heat_interval > 0) then
        conduction_step = huge(1.0_rp)
      else if (method%heat_step > 0.0_rp) then
        conduction_step = method%heat_step
      else if (sim%clock%heat_step > 0.0_rp) then
        conduction_step = sim%clock%heat_step
      end if
    end associate
  end function conduction_step

  !> True if a conduction step is due before another mechanical step of length `dt`.
  pure logical function conduction_is_due(sim, dt)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: dt                  !! next mechanical step [s]

    if (sim%scene%method%heat_interval > 0) then
      conduction_is_due = mod(sim%clock%step, int(sim%scene%method%heat_interval, i8)) == 0
    else
      conduction_is_due = sim%clock%time + dt - sim%clock%heat_time > conduction_step(sim)
    end if
  end function conduction_is_due

  !> Collective. Conduct heat over the time since the last conduction step: one step, or several
  !> explicit ones if heat transfer to tools or through films requires it.
  subroutine conduct(sim, elapsed)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: elapsed             !! time since the last conduction step [s]
    real(rp) :: remaining                       ! time not yet covered [s]
    integer :: k

    call swap_lists(sim)
    do k = 1, size(sim%hook)
      call sim%hook(k)%it%give_heat(sim, elapsed)
    end do
    remaining = elapsed
    do
      call take_conduction_step(sim, elapsed, remaining)
      if (remaining <= 0.0_rp) exit
    end do
    call reset_contact_sums(sim)
    call anneal_particles(sim, elapsed)
    if (sim%scene%method%sleep%is_on) call clear_nodes(sim%nodes, sim%nodes%g)
    call swap_lists(sim)
  end subroutine conduct

  !> One conduction step over the remaining time, or over a stable part of it.
  subroutine take_conduction_step(sim, elapsed, remaining)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: elapsed             !! time since the last conduction step [s]
    real(rp), intent(inout) :: remaining        !! time not yet covered [s]
    real(rp) :: dt, smoothed, gained, out       ! heat of smoothing, of the particles, and through
                                                ! boundaries [J]
    type(sinks_t) :: sinks
    type(gaps_t) :: gaps
    integer :: a, b, k, r

    sim%boundary%mirrors%lost = 0.0_rp
    gained = 0.0_rp
    smoothed = 0.0_rp
    out = sim%budget%sums(e_film) - sim%budget%sums(e_wall_heat) + sim%budget%sums(e_tool)
    call gather_temperature(sim)
    call find_gaps(sim, gaps)
    call find_fluxes(sim, sinks, gaps, elapsed, remaining, dt)
    do k = 1, sim%scene%n_heat_groups
      do r = 1, sim%nodes%n_ranges
        associate (low => sim%nodes%range(1, r), high => sim%nodes%range(2, r))
          call compute_increment(high - low + 1, sim%nodes%g2(:, low:high, k), &
                                 sim%nodes%g(:, low:high, k))
        end associate
      end do
      do a = 1, 3
        if (sim%scene%grid%grading(a)%is_graded) call centre_increment(sim, a, sim%nodes%g(:, :, k))
      end do
    end do
    ! mechanical steps set the temperature of probes, except where material sleeps
    if (sim%scene%method%sleep%is_on) call update_probe_temperatures(sim%nodes%patch, &
      sim%nodes%g(:, :, 1), sim%probes)
    do k = 1, sim%scene%n_heat_groups
      call restore(sim, r_warming, sim%nodes%g(:, :, k))
      associate (lost => sim%boundary%mirrors%lost)
        call record_wall_heat(sim, lost(3, :) + lost(5, :), k, sim%nodes%g(:, :, k))
        lost = 0.0_rp
      end associate
    end do
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      call heat_block(sim, b, dt, gained, smoothed)
    end do
    if (any(sim%scene%symmetry%temperature > 0.0_rp)) then
      sim%budget%sums(e_wall_heat) = sim%budget%sums(e_wall_heat) + smoothed
    end if
    call advance_sinks(sim, dt, sinks)
    sim%budget%sums(e_conduction) = sim%budget%sums(e_conduction) + gained &
      + sim%budget%sums(e_film) - sim%budget%sums(e_wall_heat) + sim%budget%sums(e_tool) - out
    remaining = remaining - dt
  end subroutine take_conduction_step

  !> Heat fluxes to the nodes in a step `dt`, the remaining time or an integer fraction of it.
  subroutine find_fluxes(sim, sinks, gaps, elapsed, remaining, dt)
    type(simulation_t), intent(inout) :: sim
    type(sinks_t), intent(inout) :: sinks
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: elapsed         !! time since the last conduction step [s]
    real(rp), intent(in) :: remaining       !! time not yet covered [s]
    real(rp), intent(out) :: dt             !! conduction step [s]
    real(rp) :: before(8, size(sim%scene%symmetry)), film, dt_max

    before = sim%boundary%mirrors%lost
    film = sim%budget%sums(e_film)
    dt = remaining
    call find_sinks(sim, elapsed, dt, sinks)
    if (sim%scene%method%implicit_heat) then
      call solve_implicit(sim, sinks, gaps, dt)
      sim%boundary%mirrors%lost = before
    end if
    call gather_flux(sim, sinks, gaps, dt)
    if (sim%scene%method%implicit_heat) return
    if (.not. (films_vary(sim%scene) .or. any(sim%tool%heat%is_on) &
               .or. allocated(sim%scene%gap))) return
    dt_max = max_stable_step(sim)
    if (dt <= dt_max) return
    dt = remaining/(aint(remaining/dt_max) + 1.0_rp)
    sim%boundary%mirrors%lost = before
    sim%budget%sums(e_film) = film
    call find_sinks(sim, elapsed, dt, sinks)
    call gather_flux(sim, sinks, gaps, dt)
  end subroutine find_fluxes

  !> Collective. Largest stable explicit step [s] with the boundary conductances in lane 6 of the
  !> second grid. Their rate is the largest mean of conductance over capacity at the nodes of a
  !> particle: a node that a face has just entered is stiff, but hardly moves a particle. Boundary
  !> terms reverse no difference of temperatures, since smoothing reverses up to all of it, and
  !> their rate adds to that of conduction (docs/method.md).
  real(rp) function max_stable_step(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: rate(1)
    integer :: b, k

    do k = 1, sim%scene%n_heat_groups
      call find_rates(sim, k)
    end do
    rate = 0.0_rp
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      rate = max(rate, rate_of_block(sim, b))
    end do
    call sim%world%max(rate)
    max_stable_step = 1.0_rp/(1.0_rp/stable_conduction(sim%scene) + rate(1))
  end function max_stable_step

  !> Boundary conductances over capacities at the nodes of heat group `k`, in lane 4 of the second
  !> grid; nodes behind walls have those of their mirrors.
  subroutine find_rates(sim, k)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k
    integer :: i, r

    associate (nodes => sim%nodes, mirrors => sim%boundary%mirrors)
      do r = 1, nodes%n_ranges
        associate (low => nodes%range(1, r), high => nodes%range(2, r))
          call compute_boundary_rates(high - low + 1, nodes%g(:, low:high, k), &
                                      nodes%g2(:, low:high, k))
        end associate
      end do
      do i = mirrors%n_pairs, 1, -1
        nodes%g2(4, mirrors%pair(1, i), k) = nodes%g2(4, mirrors%pair(2, i), k)
      end do
    end associate
  end subroutine find_rates

  !> Largest mean rate of boundary terms at the particles of a block [1/s].
  real(rp) function rate_of_block(sim, b)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    associate (p => sim%particles, nodes => sim%nodes, &
               k => sim%scene%body(sim%particles%body(b))%heat_group)
      call weights_of(sim%scene, nodes, p%body(b), p%nf, p%ps(:, :, b), w, first)
      rate_of_block = largest_rate(p%count(b), w, first, nodes%patch%stride, nodes%patch%nn, &
                                   nodes%g2(:, :, k), nodes%rec)
    end associate
  end function rate_of_block

  !> Update the temperatures of a block of particles from the nodal increments.
  subroutine heat_block(sim, b, dt, gained, smoothed)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp), intent(inout) :: gained, smoothed  !! heat gained by the particles, and heat change by
                                                 !! smoothing [J]
    integer :: first(nlane)
    real(rp) :: before(nlane), c_p(nlane), w(nlane, 18)

    associate (p => sim%particles, nodes => sim%nodes, &
               body => sim%scene%body(sim%particles%body(b)))
      call weights_of(sim%scene, nodes, p%body(b), p%nf, p%ps(:, :, b), w, first)
      associate (material => sim%scene%material(body%material))
        before = p%ps(:, f_temp, b)
        c_p = material%specific_heat_at(before)
        call heat_particles(p%count(b), w, first, nodes%patch%stride, nodes%patch%nn, &
                            nodes%g(:, :, body%heat_group), c_p, p%ps(:, f_mass, b), &
                            smoothed_fraction(sim%scene, p%body(b), dt, p%nf, p%ps(:, :, b)), &
                            nodes%rec, p%ps(:, f_temp, b), p%ps(:, f_heat, b), gained, smoothed)
        call material%apply_heat(c_p, before, p%ps(:, f_temp, b))
      end associate
    end associate
  end subroutine heat_block

end module heat_conduction
