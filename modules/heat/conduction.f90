! SPDX-License-Identifier: MIT
!> Conduction on its own time step: as many mechanical steps are gathered as stability allows.
module heat_conduction
  use base_kinds, only: i8, nlane, rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: book_heat, r_warming, restore
  use comm_world, only: world_t
  use heat_implicit, only: foresee_temperature
  use heat_nodes, only: evened_part, gather_flux, gather_temperature, stable_conduction
  use heat_sources, only: give_source_heat, source_t
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: clear_nodes, nodes_t
  use mapping_probes, only: probes_t, warm_probes
  use particles_store, only: f_heat, f_mass, f_rate, f_temp, n_conduction, particles_t
  use sleep_criteria, only: swap_lists
  use state_blocks, only: blocks_t
  use state_books, only: books_t, e_conduction, e_film, e_wall_heat
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  use transfer_conduction, only: heat_particles, temperature_increment
  use update_annealing, only: anneal_particles
  implicit none (type, external)
  private

  public :: conduct, conduction_is_due, conduction_step

contains

  !> Conduction step of the scene [s]: as long as is stable, or that of implicit steps, at first
  !> ten times as long where it follows its error.
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
      else
        conduction_step = 10.0_rp*conduction_step
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

  !> One conduction step of length `dt`.
  subroutine conduct(world, scene, clock, step, source, probes, particles, blocks, nodes, &
                     boundary, books, dt)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(step_t), intent(inout) :: step
    type(source_t), intent(inout) :: source(:)
    type(probes_t), intent(inout) :: probes
    type(particles_t), intent(inout) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(inout) :: boundary
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: dt                  !! [s]
    real(rp) :: lost(8, size(scene%symmetry))   ! what reflections at walls change
    real(rp) :: gained, left                          ! by particles, through films and walls [J]
    integer :: b, r

    call swap_lists(scene, nodes, boundary)
    lost = 0.0_rp
    gained = 0.0_rp
    left = books%sums(e_film) - books%sums(e_wall_heat)
    call give_source_heat(world, scene, clock, source, particles, blocks, books, dt)
    call gather_temperature(world, scene, particles, nodes, boundary, lost)
    if (scene%method%implicit_heat) then
      call foresee_temperature(world, scene, clock, step, particles, nodes, boundary, books, dt)
    end if
    call gather_flux(world, scene, particles, nodes, boundary, books, dt, lost)
    do r = 1, nodes%n_ranges
      call temperature_increment(nodes%range(2, r) - nodes%range(1, r) + 1, &
                                 nodes%g2(:, nodes%range(1, r):nodes%range(2, r), 1), &
                                 nodes%g(:, nodes%range(1, r):nodes%range(2, r), 1))
    end do
    ! mechanical steps set the temperature of probes, but not where the material sleeps
    if (scene%method%sleep%is_on) call warm_probes(nodes%patch, nodes%g(:, :, 1), probes)
    call restore(scene, nodes, boundary, r_warming, nodes%g(:, :, 1))
    call book_heat(scene, nodes, boundary, books, lost(3, :) + lost(5, :), 5, &
                   nodes%g(:, :, 1))
    call book_heat(scene, nodes, boundary, books, lost(8, :), 7, nodes%g(:, :, 1))
    do b = 1, particles%nblk
      call particles%fetch(b + 1, n_conduction)
      call warm_block(scene, nodes, particles%body(b), particles%count(b), particles%nf, &
                      particles%ps(:, :, b), dt, nodes%rec, nodes%g(:, :, 1), gained)
    end do
    books%sums(e_conduction) = books%sums(e_conduction) + gained &
                             + books%sums(e_film) - books%sums(e_wall_heat) - left
    call anneal_particles(scene, particles, dt)
    if (scene%method%sleep%is_on) call clear_nodes(nodes, nodes%g)
    call swap_lists(scene, nodes, boundary)
  end subroutine conduct

  subroutine warm_block(scene, nodes, body, n, nf, ps, dt, rec, g, gained)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, n, nf
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), gained
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    call heat_particles(n, w, first, nodes%patch%stride, nodes%patch%nn, g, &
                        scene%material(scene%body(body)%material)%c_p, ps(1, f_mass), &
                        evened_part(scene, body, dt, ps(:, f_rate)), rec, ps(1, f_temp), &
                        ps(1, f_heat), gained)
  end subroutine warm_block

end module heat_conduction
