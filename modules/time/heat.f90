! SPDX-License-Identifier: MIT
!> Conduction on its own time step: as many mechanical steps are gathered as stability allows.
module time_heat
  use base_kinds, only: i8, nlane, rp
  use comm_world, only: world_t
  use particles_store, only: f_heat, f_mass, f_temp, n_conduction
  use thermal_conduction, only: heat_particles, smooth_share, temperature_increment
  use time_audit, only: e_conduction, e_film, e_wall_heat
  use time_heat_implicit, only: foresee_temperature
  use time_heat_nodes, only: gather_flux, gather_temperature, stable_conduction
  use time_microstructure, only: anneal_particles
  use time_mirrors, only: book_heat, r_warming, unfold
  use time_nodes, only: clear_nodes
  use time_probes, only: warm_probes
  use time_sleep, only: swap_lists
  use time_sources, only: give_source_heat
  use time_state, only: simulation_t
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: conduct, conduction_is_due, conduction_step

contains

  !> Conduction step of the scene [s]: as long as is stable, or that of implicit steps, at first
  !> ten times as long where it follows its error.
  pure real(rp) function conduction_step(sim)
    type(simulation_t), intent(in) :: sim

    conduction_step = stable_conduction(sim)
    associate (method => sim%scene%method)
      if (.not. method%implicit_heat .or. conduction_step >= huge(1.0_rp)) return
      if (method%heat_every > 0) then
        conduction_step = huge(1.0_rp)
      else if (method%heat_step > 0.0_rp) then
        conduction_step = method%heat_step
      else if (sim%clock%heat_step > 0.0_rp) then
        conduction_step = sim%clock%heat_step
      else
        conduction_step = 10.0_rp*conduction_step
      end if
    end associate
  end function conduction_step

  !> Is a conduction step due now, if one more mechanical step would be of length `dt`?
  pure logical function conduction_is_due(sim, dt)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: dt                  !! [s]

    if (sim%scene%method%heat_every > 0) then
      conduction_is_due = mod(sim%clock%step, int(sim%scene%method%heat_every, i8)) == 0
    else
      conduction_is_due = sim%clock%time + dt - sim%clock%heat_time > conduction_step(sim)
    end if
  end function conduction_is_due

  !> One conduction step of length `dt`.
  subroutine conduct(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp) :: lost(8, size(sim%scene%constraint))   ! what folds at walls change
    real(rp) :: gained, left                          ! by particles, through films and walls [J]
    integer :: b, r

    call swap_lists(sim)
    lost = 0.0_rp
    gained = 0.0_rp
    left = sim%sums(e_film) - sim%sums(e_wall_heat)
    call give_source_heat(world, sim, dt)
    call gather_temperature(world, sim, lost)
    if (sim%scene%method%implicit_heat) call foresee_temperature(world, sim, dt)
    call gather_flux(world, sim, dt, lost)
    do r = 1, sim%n_runs
      call temperature_increment(sim%run(2, r) - sim%run(1, r) + 1, &
                                 sim%g2(:, sim%run(1, r):sim%run(2, r), 1), &
                                 sim%g(:, sim%run(1, r):sim%run(2, r), 1))
    end do
    ! mechanical steps tell probes their temperature, but not where the material sleeps
    if (sim%scene%method%sleep%is_on) call warm_probes(sim%patch, sim%g(:, :, 1), sim%probes)
    call unfold(sim, r_warming, sim%g(:, :, 1))
    call book_heat(sim, 1.0_rp, lost(3, :) + lost(5, :), 5, sim%g(:, :, 1))
    call book_heat(sim, smooth_share, lost(8, :), 7, sim%g(:, :, 1))
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      call warm_block(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                      sim%particles%ps(:, :, b), sim%rec, sim%g(:, :, 1), gained)
    end do
    sim%sums(e_conduction) = sim%sums(e_conduction) + gained &
                             + sim%sums(e_film) - sim%sums(e_wall_heat) - left
    call anneal_particles(sim, dt)
    if (sim%scene%method%sleep%is_on) call clear_nodes(sim, sim%g)
    call swap_lists(sim)
  end subroutine conduct

  subroutine warm_block(sim, body, n, nf, ps, rec, g, gained)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), gained
    real(rp), intent(in) :: g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    call heat_particles(n, w, first, sim%patch%stride, sim%patch%nn, g, &
                        sim%scene%material(sim%scene%body(body)%material)%c_p, ps(1, f_mass), rec, &
                        ps(1, f_temp), ps(1, f_heat), gained)
  end subroutine warm_block

end module time_heat
