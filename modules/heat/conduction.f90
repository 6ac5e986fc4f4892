! SPDX-License-Identifier: MIT
!> Conduction on its own time step: as many mechanical steps are gathered as stability allows.
module heat_conduction
  use base_kinds, only: i8, nlane, rp
  use body_contact_node_pairs, only: node_pairs_t
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: book_heat, r_warming, restore
  use comm_world, only: world_t
  use contact_backing, only: backing_t
  use contact_tool, only: tool_t
  use heat_films, only: films_vary
  use heat_gaps, only: find_gaps, gaps_t
  use heat_implicit, only: foresee_temperature
  use heat_nodes, only: centre_increment, evened_part, gather_flux, gather_temperature, &
                        stable_conduction
  use heat_sinks, only: find_touched, forget_touched, heat_sinks_by, touched_t
  use heat_sources, only: give_source_heat, source_t
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: clear_nodes, nodes_t
  use mapping_probes, only: probes_t, warm_probes
  use particles_store, only: f_heat, f_mass, f_rate, f_temp, n_conduction, particles_t
  use sleep_criteria, only: swap_lists
  use state_blocks, only: blocks_t
  use state_books, only: books_t, e_conduction, e_film, e_tool, e_wall_heat
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  use transfer_conduction, only: heat_particles, least_capacity, temperature_increment
  use update_annealing, only: anneal_particles
  implicit none (type, external)
  private

  public :: conduct, conduction_is_due, conduction_step

contains

  !> Conduction step of the scene [s]: as long as is stable, or that of implicit steps, at first
  !> the stable one where it follows its error.
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

  !> Is a conduction step due now, if one more mechanical step would be of length `dt`?
  pure logical function conduction_is_due(scene, clock, dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp), intent(in) :: dt                  !! [s]

    if (scene%method%heat_every > 0) then
      conduction_is_due = mod(clock%step, int(scene%method%heat_every, i8)) == 0
    else
      conduction_is_due = clock%time + dt - clock%heat_time > conduction_step(scene, clock)
    end if
  end function conduction_is_due

  !> Conduct for the `waited` since the last time: one step, or several if explicit and tools or
  !> films that vary allow only shorter ones.
  subroutine conduct(world, scene, clock, step, tool, backing, source, probes, particles, &
                     blocks, nodes, boundary, pairs, books, waited)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(inout) :: tool(:)
    type(backing_t), intent(inout) :: backing(:)
    type(source_t), intent(inout) :: source(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(inout) :: boundary
    type(node_pairs_t), intent(in) :: pairs
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: waited              !! [s]
    real(rp) :: left

    call swap_lists(scene, nodes, boundary)
    call give_source_heat(world, scene, clock, source, particles, blocks, books, waited)
    left = waited
    do
      call take_conduction_step(world, scene, clock, step, tool, backing, probes, particles, &
                                nodes, boundary, pairs, books, waited, left)
      if (left <= 0.0_rp) exit
    end do
    call forget_touched(tool, particles)
    call anneal_particles(scene, particles, waited)
    if (scene%method%sleep%is_on) call clear_nodes(nodes, nodes%g)
    call swap_lists(scene, nodes, boundary)
  end subroutine conduct

  !> One conduction step of what is `left` of the time, or of as much of it as is stable.
  subroutine take_conduction_step(world, scene, clock, step, tool, backing, probes, particles, &
                                  nodes, boundary, pairs, books, waited, left)
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
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: waited              !! [s]
    real(rp), intent(inout) :: left             !! [s]
    real(rp) :: lost(8, size(scene%symmetry))   ! what reflections at walls change
    real(rp) :: dt, evened, gained, out         ! by particles, through films, walls and tools [J]
    type(touched_t) :: touched
    type(gaps_t) :: gaps
    integer :: b, k, r

    lost = 0.0_rp
    gained = 0.0_rp
    evened = 0.0_rp
    out = books%sums(e_film) - books%sums(e_wall_heat) + books%sums(e_tool)
    call gather_temperature(world, scene, particles, nodes, boundary, lost)
    call find_gaps(world, scene, particles, nodes, boundary, pairs, gaps)
    call find_fluxes(world, scene, clock, step, tool, backing, particles, nodes, boundary, &
                     books, touched, gaps, waited, left, lost, dt)
    do k = 1, scene%n_heat_groups
      do r = 1, nodes%n_ranges
        call temperature_increment(nodes%range(2, r) - nodes%range(1, r) + 1, &
                                   nodes%g2(:, nodes%range(1, r):nodes%range(2, r), k), &
                                   nodes%g(:, nodes%range(1, r):nodes%range(2, r), k))
      end do
      if (scene%grid%grading%axis > 0) call centre_increment(world, scene, nodes, boundary, books, &
                                                             nodes%g(:, :, k))
    end do
    ! mechanical steps set the temperature of probes, but not where the material sleeps
    if (scene%method%sleep%is_on) call warm_probes(nodes%patch, nodes%g(:, :, 1), probes)
    do k = 1, scene%n_heat_groups
      call restore(scene, nodes, boundary, r_warming, nodes%g(:, :, k))
      call book_heat(scene, nodes, boundary, books, lost(3, :) + lost(5, :), k, &
                     nodes%g(:, :, k))
      lost = 0.0_rp
    end do
    do b = 1, particles%nblk
      call particles%fetch(b + 1, n_conduction)
      k = scene%body(particles%body(b))%heat_group
      call warm_block(scene, nodes, particles%body(b), particles%count(b), particles%nf, &
                      particles%ps(:, :, b), dt, nodes%rec, nodes%g(:, :, k), gained, &
                      evened)
    end do
    if (any(scene%symmetry%temperature > 0.0_rp)) then
      books%sums(e_wall_heat) = books%sums(e_wall_heat) + evened
    end if
    call heat_sinks_by(world, dt, touched, tool, backing, books)
    books%sums(e_conduction) = books%sums(e_conduction) + gained + books%sums(e_film) &
                               - books%sums(e_wall_heat) + books%sums(e_tool) - out
    left = left - dt
  end subroutine take_conduction_step

  !> What goes to the nodes in a step of `dt`, which is what is `left` or an even part of it.
  subroutine find_fluxes(world, scene, clock, step, tool, backing, particles, nodes, boundary, &
                         books, touched, gaps, waited, left, lost, dt)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(books_t), intent(inout) :: books
    type(touched_t), intent(inout) :: touched
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: waited, left              !! [s]
    real(rp), intent(inout) :: lost(8, size(scene%symmetry))
    real(rp), intent(out) :: dt                       !! [s]
    real(rp) :: before(8, size(scene%symmetry)), film, longest

    before = lost
    film = books%sums(e_film)
    dt = left
    call find_touched(world, scene, particles, nodes, tool, backing, waited, dt, touched)
    if (scene%method%implicit_heat) then
      call foresee_temperature(world, scene, clock, step, particles, nodes, boundary, touched, &
                               gaps, books, dt)
    end if
    call gather_flux(world, scene, particles, nodes, boundary, touched, gaps, books, dt, lost)
    if (scene%method%implicit_heat) return
    if (.not. (films_vary(scene) .or. any(tool%heat%is_on) .or. allocated(scene%gap))) return
    longest = longest_step(world, scene, nodes)
    if (dt <= longest) return
    dt = left/(aint(left/longest) + 1.0_rp)
    lost = before
    books%sums(e_film) = film
    call find_touched(world, scene, particles, nodes, tool, backing, waited, dt, touched)
    call gather_flux(world, scene, particles, nodes, boundary, touched, gaps, books, dt, lost)
  end subroutine find_fluxes

  !> Collective. The longest explicit step [s] with the conductances in lane 6 of the second grid:
  !> the bounds of the rates of conduction, 2 over its own longest step, and of these add up.
  real(rp) function longest_step(world, scene, nodes)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp) :: rate(1)
    integer :: i, k, r

    rate = 0.0_rp
    do k = 1, scene%n_heat_groups
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          if (nodes%g(1, i, k) <= least_capacity) cycle
          rate = max(rate, nodes%g2(6, i, k)/nodes%g(1, i, k))
        end do
      end do
    end do
    call world%max(rate)
    longest_step = 1.0_rp/(1.0_rp/stable_conduction(scene) + 0.5_rp*rate(1))
  end function longest_step

  subroutine warm_block(scene, nodes, body, n, nf, ps, dt, rec, g, gained, evened)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), gained, evened
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: before(nlane), c_p(nlane), w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    associate (material => scene%material(scene%body(body)%material))
      before = ps(:, f_temp)
      c_p = material%specific_heat_at(before)
      call heat_particles(n, w, first, nodes%patch%stride, nodes%patch%nn, g, c_p, &
                          ps(1, f_mass), evened_part(scene, body, dt, ps(:, f_mass), before, &
                                                     ps(:, f_rate)), rec, ps(1, f_temp), &
                          ps(1, f_heat), gained, evened)
      call material%take_up(c_p, before, ps(1, f_temp))
    end associate
  end subroutine warm_block

end module heat_conduction
