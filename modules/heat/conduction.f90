! SPDX-License-Identifier: MIT
!> Conduction with a time step of its own, which spans as many mechanical steps as stability allows.
module heat_conduction
  use base_kinds, only: i8, nlane, rp
  use boundary_symmetry, only: r_warming, record_wall_heat, restore
  use heat_exchange, only: contacts_t, exchanges_heat, find_contacts, reset_contact_sums, warm_sinks
  use heat_gaps, only: find_gaps, gaps_t
  use heat_nodes, only: centre_increment, gather_exchange, gather_flux, gather_temperature, &
                        smoothed_fraction, stable_conduction
  use heat_nodes_implicit, only: solve_implicit
  use mpm_blocks, only: weights_of
  use mpm_constitutive, only: anneal_particles
  use particles_block, only: block_t, view_block
  use particles_store, only: f_heat, f_mass, f_temp, n_conduction, particles_t
  use state_boundary, only: mirrors_t
  use state_budget, only: e_conduction, e_film, e_tool, e_wall_heat
  use state_clock, only: clock_t
  use state_nodes, only: clear_nodes, nodes_t
  use state_parts, only: simulation_t
  use state_probes, only: update_probe_temperatures
  use state_scene, only: scene_t
  use transfer_conduction, only: add_increment, compute_increment, heat_particles, min_capacity
  implicit none (type, external)
  private

  public :: conduct, conduction_is_due, conduction_step

  !> Temperature rise of a particle by its stored heat that makes a conduction step due, over
  !> TOLERANCE. On average half of this heat is stored, a particle at a face takes half of it, and
  !> hotter metal is heated less: temperatures are late by a tenth of it (test_heat_exchange.py).
  real(rp), parameter :: stored_share = 10.0_rp

contains

  !> Conduction step [s]: the stable explicit one, or less where sources warm the metal fast; or the
  !> implicit one as given or controlled by its error, which starts with the stable one.
  pure real(rp) function conduction_step(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    conduction_step = stable_conduction(scene)
    associate (method => scene%method)
      if (conduction_step >= huge(1.0_rp)) return
      if (.not. method%implicit_heat) then
        if (clock%heat_step > 0.0_rp) conduction_step = min(conduction_step, clock%heat_step)
      else if (method%heat_interval > 0) then
        conduction_step = huge(1.0_rp)
      else if (method%heat_step > 0.0_rp) then
        conduction_step = method%heat_step
      else if (clock%heat_step > 0.0_rp) then
        conduction_step = clock%heat_step
      end if
    end associate
  end function conduction_step

  !> True if a conduction step is due before another mechanical step of length `dt`, also where the
  !> stored heat of friction makes the flow stress too large.
  pure logical function conduction_is_due(scene, clock, dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp), intent(in) :: dt                  !! next mechanical step [s]

    if (scene%method%heat_interval > 0) then
      conduction_is_due = mod(clock%step, int(scene%method%heat_interval, i8)) == 0
    else
      conduction_is_due = clock%time + dt - clock%heat_time > conduction_step(scene, clock) &
        .or. (clock%warming > stored_share*scene%method%heat_tolerance &
              .and. scene%method%heat_step <= 0.0_rp)
    end if
  end function conduction_is_due

  !> Collective. Conduct heat over the time since the last conduction step.
  subroutine conduct(sim, elapsed)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: elapsed             !! time since the last conduction step [s]
    integer :: k

    call swap_lists(sim%scene, sim%nodes)
    do k = 1, size(sim%hook)
      call sim%hook(k)%it%give_heat(sim, elapsed)
    end do
    call take_conduction_step(sim, elapsed)
    call reset_contact_sums(sim%tool, sim%particles)
    sim%particles%warming = 0.0_rp
    call anneal_particles(sim%scene, sim%particles, elapsed)
    if (sim%scene%method%sleep%is_on) call clear_nodes(sim%nodes, sim%nodes%g)
    call swap_lists(sim%scene, sim%nodes)
  end subroutine conduct

  !> One conduction step of length `dt`.
  subroutine take_conduction_step(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! time since the last conduction step [s]
    real(rp) :: smoothed, gained, out           ! heat of smoothing, of the particles, and through
                                                ! boundaries [J]
    type(contacts_t) :: contacts
    type(gaps_t) :: gaps
    integer :: a, b, k

    sim%nodes%boundary%mirrors%lost = 0.0_rp
    gained = 0.0_rp
    smoothed = 0.0_rp
    out = sim%budget%sums(e_film) - sim%budget%sums(e_wall_heat) + sim%budget%sums(e_tool)
    call gather_temperature(sim%scene, sim%particles, sim%nodes)
    if (size(sim%hook) > 0 .and. .not. sim%scene%method%implicit_heat) call limit_step(sim, dt)
    call find_gaps(sim%scene, sim%particles, sim%nodes, sim%pairs, gaps)
    call find_contacts(sim%scene, sim%tool, sim%backing, sim%particles, sim%nodes, dt, contacts)
    if (sim%scene%method%implicit_heat) then
      call solve_implicit(sim%scene, sim%clock, sim%particles, sim%nodes, contacts, gaps, dt)
    end if
    call find_increments(sim, contacts, gaps, dt)
    do k = 1, sim%scene%n_heat_groups
      do a = 1, 3
        if (.not. sim%scene%grid%grading(a)%is_graded) cycle
        call centre_increment(sim%scene, sim%nodes, a, sim%nodes%g(:, :, k), &
                              sim%budget%sums(e_wall_heat))
      end do
      call restore(sim%scene, sim%nodes, r_warming, sim%nodes%g(:, :, k))
      associate (lost => sim%nodes%boundary%mirrors%lost)
        call record_wall_heat(sim%scene, sim%nodes, sim%budget, lost(3, :) + lost(5, :), k, &
                              sim%nodes%g(:, :, k))
        lost = 0.0_rp
      end associate
    end do
    associate (n => sim%scene%n_heat_groups)
      call update_probe_temperatures(sim%nodes%patch, n, sim%nodes%g(:, :, :n), sim%probes)
    end associate
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      call heat_block(sim%scene, sim%particles, sim%nodes, b, dt, gained, smoothed)
    end do
    if (any(sim%scene%symmetry%temperature > 0.0_rp)) then
      sim%budget%sums(e_wall_heat) = sim%budget%sums(e_wall_heat) + smoothed
    end if
    call warm_sinks(sim%tool, sim%backing, dt, contacts)
    sim%budget%sums(e_conduction) = sim%budget%sums(e_conduction) + gained &
      + sim%budget%sums(e_film) - sim%budget%sums(e_wall_heat) + sim%budget%sums(e_tool) - out
  end subroutine take_conduction_step

  !> Collective. Limit the next explicit step to that in which the heat of the sources would warm a
  !> node by TOLERANCE, but not to less than a mechanical step.
  subroutine limit_step(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp) :: rise(1)                         ! largest rise by stored heat [K]
    integer :: k, q, r

    rise = tiny(1.0_rp)
    do k = 1, sim%scene%n_heat_groups
      do r = 1, sim%nodes%n_ranges
        do q = sim%nodes%range(1, r), sim%nodes%range(2, r)
          associate (capacity => sim%nodes%g(1, q, k), heat => sim%nodes%g(3, q, k))
            if (capacity > min_capacity) rise = max(rise, heat/capacity)
          end associate
        end do
      end do
    end do
    call sim%world%max(rise)
    sim%clock%heat_step = min(stable_conduction(sim%scene), &
                              max(sim%clock%dt, dt*sim%scene%method%heat_tolerance/rise(1)))
  end subroutine limit_step

  !> Temperature increments of the nodes in a step. An implicit step has the temperatures of its end
  !> in lane 4; in an explicit one the exchange with what is outside the bodies follows the
  !> increments by all other heat.
  subroutine find_increments(sim, contacts, gaps, dt)
    type(simulation_t), intent(inout) :: sim
    type(contacts_t), intent(inout) :: contacts
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: dt              !! conduction step [s]
    integer :: k, r

    call gather_flux(sim%scene, sim%particles, sim%nodes, contacts, gaps, dt, &
                     sim%scene%method%implicit_heat, sim%budget%sums)
    do k = 1, sim%scene%n_heat_groups
      do r = 1, sim%nodes%n_ranges
        associate (low => sim%nodes%range(1, r), high => sim%nodes%range(2, r))
          call compute_increment(high - low + 1, sim%nodes%g2(:, low:high, k), &
                                 sim%nodes%g(:, low:high, k))
        end associate
      end do
    end do
    if (sim%scene%method%implicit_heat .or. .not. exchanges_heat(sim%scene, sim%tool)) return
    do k = 1, sim%scene%n_heat_groups
      call restore(sim%scene, sim%nodes, r_warming, sim%nodes%g(:, :, k))
    end do
    call gather_exchange(sim%scene, sim%nodes, contacts, gaps, dt, sim%budget%sums)
    do k = 1, sim%scene%n_heat_groups
      do r = 1, sim%nodes%n_ranges
        associate (low => sim%nodes%range(1, r), high => sim%nodes%range(2, r))
          call add_increment(high - low + 1, sim%nodes%g2(:, low:high, k), &
                             sim%nodes%g(:, low:high, k))
        end associate
      end do
    end do
  end subroutine find_increments

  !> Update the temperatures of a block of particles from the nodal increments.
  subroutine heat_block(scene, particles, nodes, b, dt, gained, smoothed)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: b
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp), intent(inout) :: gained     !! heat gained by the particles [J]
    real(rp), intent(inout) :: smoothed   !! change of heat by smoothing [J]
    type(block_t) :: block
    real(rp) :: before(nlane), c_p(nlane)

    call view_block(particles, b, block)
    call weights_of(scene, nodes, block)
    associate (ps => block%ps, group => scene%body(block%body)%heat_group, &
               material => scene%material(scene%body(block%body)%material))
      before = ps(:, f_temp)
      c_p = material%specific_heat_at(before)
      call heat_particles(block%n, block%w, block%first, nodes%patch%stride, nodes%patch%nn, &
                          nodes%g(:, :, group), c_p, ps(:, f_mass), &
                          smoothed_fraction(scene, block, dt), nodes%rec, ps(:, f_temp), &
                          ps(:, f_heat), gained, smoothed)
      call material%apply_heat(c_p, before, ps(:, f_temp))
    end associate
  end subroutine heat_block

  !> Swap the lists of nodes and mirrors: conduction uses the nodes of all particles, steps those of
  !> awake particles and of the held layer, with zeros elsewhere.
  subroutine swap_lists(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(mirrors_t) :: mirrors
    integer, allocatable :: list(:, :)
    integer :: n

    if (.not. scene%method%sleep%is_on) return
    mirrors = nodes%boundary%mirrors
    nodes%boundary%mirrors = nodes%boundary%resting_mirrors
    nodes%boundary%resting_mirrors = mirrors
    n = nodes%n_ranges
    nodes%n_ranges = nodes%n_resting_ranges
    nodes%n_resting_ranges = n
    call move_alloc(nodes%range, list)
    call move_alloc(nodes%resting_range, nodes%range)
    call move_alloc(list, nodes%resting_range)
  end subroutine swap_lists

end module heat_conduction
