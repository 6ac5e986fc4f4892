! SPDX-License-Identifier: MIT
!> Conduction with a time step of its own, which spans as many mechanical steps as stability allows.
module heat_conduction
  use base_kinds, only: i8, nlane, rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: r_warming, record_wall_heat, restore, swap_lists
  use comm_world, only: world_t
  use contact_node_pairs, only: node_pairs_t
  use heat_gaps, only: find_gaps, gaps_t
  use heat_implicit, only: solve_implicit
  use heat_nodes, only: centre_increment, gather_flux, gather_temperature, smoothed_fraction, &
                        stable_conduction
  use heat_sinks, only: advance_sinks, films_vary, find_sinks, reset_contact_sums, sinks_t
  use heat_sources, only: add_source_heat, source_t
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: clear_nodes, nodes_t
  use mapping_probes, only: probes_t, update_probe_temperatures
  use particles_store, only: f_heat, f_mass, f_rate, f_temp, n_conduction, particles_t
  use state_run, only: budget_t, clock_t, e_conduction, e_film, e_tool, e_wall_heat, step_t
  use state_scene, only: scene_t
  use tools_backing, only: backing_t
  use tools_tool, only: tool_t
  use transfer_conduction, only: heat_particles, min_capacity, temperature_increment
  use update_constitutive, only: anneal_particles
  implicit none (type, external)
  private

  public :: conduct, conduction_is_due, conduction_step

contains

  !> Conduction step [s]: the stable explicit one, or the implicit one as given or controlled by its
  !> error, which starts with the stable one.
  pure real(rp) function conduction_step(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    conduction_step = stable_conduction(scene)
    associate (method => scene%method)
      if (.not. method%implicit_heat .or. conduction_step >= huge(1.0_rp)) return
      if (method%heat_every > 0) then
        conduction_step = huge(1.0_rp)
      else if (method%heat_step > 0.0_rp) then
        conduction_step = method%heat_step
      else if (clock%heat_step > 0.0_rp) then
        conduction_step = clock%heat_step
      end if
    end associate
  end function conduction_step

  !> True if a conduction step is due before another mechanical step of length `dt`.
  pure logical function conduction_is_due(scene, clock, dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp), intent(in) :: dt                  !! next mechanical step [s]

    if (scene%method%heat_every > 0) then
      conduction_is_due = mod(clock%step, int(scene%method%heat_every, i8)) == 0
    else
      conduction_is_due = clock%time + dt - clock%heat_time > conduction_step(scene, clock)
    end if
  end function conduction_is_due

  !> Collective. Conduct heat over the time since the last conduction step: one step, or several
  !> explicit ones if heat transfer to tools or through films requires it.
  subroutine conduct(world, scene, clock, step, tool, backing, source, probes, particles, nodes, &
                     boundary, pairs, budget, elapsed)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(inout) :: tool(:)
    type(backing_t), intent(inout) :: backing(:)
    type(source_t), intent(inout) :: source(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(inout) :: boundary
    type(node_pairs_t), intent(in) :: pairs
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: elapsed             !! time since the last conduction step [s]
    real(rp) :: remaining                       ! time not yet covered [s]

    call swap_lists(scene, nodes, boundary)
    call add_source_heat(world, scene, clock, source, particles, budget, elapsed)
    remaining = elapsed
    do
      call take_conduction_step(world, scene, clock, step, tool, backing, probes, particles, &
                                nodes, boundary, pairs, budget, elapsed, remaining)
      if (remaining <= 0.0_rp) exit
    end do
    call reset_contact_sums(tool, particles)
    call anneal_particles(scene, particles, elapsed)
    if (scene%method%sleep%is_on) call clear_nodes(nodes, nodes%g)
    call swap_lists(scene, nodes, boundary)
  end subroutine conduct

  !> One conduction step over the remaining time, or over a stable part of it.
  subroutine take_conduction_step(world, scene, clock, step, tool, backing, probes, particles, &
                                  nodes, boundary, pairs, budget, elapsed, remaining)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(inout) :: tool(:)
    type(backing_t), intent(inout) :: backing(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(inout) :: boundary
    type(node_pairs_t), intent(in) :: pairs
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: elapsed             !! time since the last conduction step [s]
    real(rp), intent(inout) :: remaining        !! time not yet covered [s]
    real(rp) :: lost(8, size(scene%symmetry))   ! change of nodal sums by reflection at walls
    real(rp) :: dt, smoothed, gained, out       ! heat of smoothing, particles and boundaries [J]
    type(sinks_t) :: sinks
    type(gaps_t) :: gaps
    integer :: a, b, k, r

    lost = 0.0_rp
    gained = 0.0_rp
    smoothed = 0.0_rp
    out = budget%sums(e_film) - budget%sums(e_wall_heat) + budget%sums(e_tool)
    call gather_temperature(world, scene, particles, nodes, boundary, lost)
    call find_gaps(world, scene, particles, nodes, boundary, pairs, gaps)
    call find_fluxes(world, scene, clock, step, tool, backing, particles, nodes, boundary, &
                     budget, sinks, gaps, elapsed, remaining, lost, dt)
    do k = 1, scene%n_heat_groups
      do r = 1, nodes%n_ranges
        call temperature_increment(nodes%range(2, r) - nodes%range(1, r) + 1, &
                                   nodes%g2(:, nodes%range(1, r):nodes%range(2, r), k), &
                                   nodes%g(:, nodes%range(1, r):nodes%range(2, r), k))
      end do
      do a = 1, 3
        if (scene%grid%grading(a)%is_graded) call centre_increment(world, scene, nodes, boundary, &
                                                                   budget, a, nodes%g(:, :, k))
      end do
    end do
    ! mechanical steps set the temperature of probes, but not where the material sleeps
    if (scene%method%sleep%is_on) call update_probe_temperatures(nodes%patch, nodes%g(:, :, 1), &
                                                                 probes)
    do k = 1, scene%n_heat_groups
      call restore(scene, nodes, boundary, r_warming, nodes%g(:, :, k))
      call record_wall_heat(scene, nodes, boundary, budget, lost(3, :) + lost(5, :), k, &
                     nodes%g(:, :, k))
      lost = 0.0_rp
    end do
    do b = 1, particles%nblk
      call particles%fetch(b + 1, n_conduction)
      k = scene%body(particles%body(b))%heat_group
      call heat_block(scene, nodes, particles%body(b), particles%count(b), particles%nf, &
                      particles%ps(:, :, b), dt, nodes%rec, nodes%g(:, :, k), gained, &
                      smoothed)
    end do
    if (any(scene%symmetry%temperature > 0.0_rp)) then
      budget%sums(e_wall_heat) = budget%sums(e_wall_heat) + smoothed
    end if
    call advance_sinks(world, dt, sinks, tool, backing, budget)
    budget%sums(e_conduction) = budget%sums(e_conduction) + gained + budget%sums(e_film) &
                               - budget%sums(e_wall_heat) + budget%sums(e_tool) - out
    remaining = remaining - dt
  end subroutine take_conduction_step

  !> Heat fluxes to the nodes in a step `dt`, the remaining time or an integer fraction of it.
  subroutine find_fluxes(world, scene, clock, step, tool, backing, particles, nodes, boundary, &
                         budget, sinks, gaps, elapsed, remaining, lost, dt)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(budget_t), intent(inout) :: budget
    type(sinks_t), intent(inout) :: sinks
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: elapsed         !! time since the last conduction step [s]
    real(rp), intent(in) :: remaining       !! time not yet covered [s]
    real(rp), intent(inout) :: lost(8, size(scene%symmetry))
    real(rp), intent(out) :: dt             !! conduction step [s]
    real(rp) :: before(8, size(scene%symmetry)), film, dt_max

    before = lost
    film = budget%sums(e_film)
    dt = remaining
    call find_sinks(world, scene, particles, nodes, tool, backing, elapsed, dt, sinks)
    if (scene%method%implicit_heat) then
      call solve_implicit(world, scene, clock, step, particles, nodes, boundary, sinks, &
                          gaps, budget, dt)
    end if
    call gather_flux(world, scene, particles, nodes, boundary, sinks, gaps, budget, dt, lost)
    if (scene%method%implicit_heat) return
    if (.not. (films_vary(scene) .or. any(tool%heat%is_on) .or. allocated(scene%gap))) return
    dt_max = max_stable_step(world, scene, nodes)
    if (dt <= dt_max) return
    dt = remaining/(aint(remaining/dt_max) + 1.0_rp)
    lost = before
    budget%sums(e_film) = film
    call find_sinks(world, scene, particles, nodes, tool, backing, elapsed, dt, sinks)
    call gather_flux(world, scene, particles, nodes, boundary, sinks, gaps, budget, dt, lost)
  end subroutine find_fluxes

  !> Collective. Largest stable explicit step [s] with the boundary conductances in lane 6 of the
  !> second grid: the bounds of the rates of conduction and of the boundary terms add up.
  real(rp) function max_stable_step(world, scene, nodes)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp) :: rate(1)
    integer :: i, k, r

    rate = 0.0_rp
    do k = 1, scene%n_heat_groups
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          if (nodes%g(1, i, k) <= min_capacity) cycle
          rate = max(rate, nodes%g2(6, i, k)/nodes%g(1, i, k))
        end do
      end do
    end do
    call world%max(rate)
    max_stable_step = 1.0_rp/(1.0_rp/stable_conduction(scene) + 0.5_rp*rate(1))
  end function max_stable_step

  !> Update the temperatures of a block of particles from the nodal increments.
  subroutine heat_block(scene, nodes, body, n, nf, ps, dt, rec, g, gained, smoothed)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), gained, smoothed
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: before(nlane), c_p(nlane), w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    associate (material => scene%material(scene%body(body)%material))
      before = ps(:, f_temp)
      c_p = material%specific_heat_at(before)
      call heat_particles(n, w, first, nodes%patch%stride, nodes%patch%nn, g, c_p, &
                          ps(1, f_mass), smoothed_fraction(scene, body, dt, nf, ps), rec, &
                          ps(1, f_temp), ps(1, f_heat), gained, smoothed)
      call material%apply_heat(c_p, before, ps(1, f_temp))
    end associate
  end subroutine heat_block

end module heat_conduction
