! SPDX-License-Identifier: MIT
!> Conduction on its own time step: as many mechanical steps are gathered as stability allows.
module time_heat
  use base_kinds, only: i8, nlane, rp
  use comm_world, only: world_t
  use particles_store, only: f_heat, f_jac, f_mass, f_pos, f_temp, tag_faces
  use thermal_conduction, only: capacity_to_grid, film_to_grid, flux_to_grid, heat_particles, &
                                least_capacity, &
                                nodal_temperature, smooth_particles, smooth_share, &
                                temperature_increment
  use time_audit, only: e_conduction, e_film, e_wall_heat
  use time_microstructure, only: anneal_particles
  use time_mirrors, only: book_heat, fold, r_apart, r_flux, r_heat, r_temperature, r_warming, &
                          unfold
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

  !> Explicit step [s]: FOURIER h^2 rho c/k over all materials.
  pure real(rp) function stable_conduction(sim)
    type(simulation_t), intent(in) :: sim
    integer :: m

    stable_conduction = huge(1.0_rp)
    do m = 1, size(sim%scene%material)
      associate (mat => sim%scene%material(m))
        if (mat%conductivity > 0.0_rp) stable_conduction = min(stable_conduction, &
          sim%scene%method%fourier*sim%scene%grid%h**2*mat%rho*mat%c_p/mat%conductivity)
      end associate
    end do
  end function stable_conduction

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
    real(rp), allocatable :: before(:)                ! nodal temperature
    real(rp) :: heat                                  ! and what left through films and walls [J]
    integer :: b, r

    call swap_lists(sim)
    lost = 0.0_rp
    call give_source_heat(world, sim, dt)
    heat = heat_here(sim) + sim%sums(e_film) - sim%sums(e_wall_heat)
    call gather_temperature(world, sim, f_temp, f_heat, r_heat, lost)
    if (sim%scene%method%implicit_heat) then
      before = sim%g(4, :, 1)
      call foresee_temperature(world, sim, dt)
    end if
    call gather_flux(world, sim, dt, lost)
    if (sim%scene%method%implicit_heat) sim%g(4, :, 1) = before
    do r = 1, sim%n_runs
      call temperature_increment(sim%run(2, r) - sim%run(1, r) + 1, &
                                 sim%g2(:, sim%run(1, r):sim%run(2, r), 1), &
                                 sim%g(:, sim%run(1, r):sim%run(2, r), 1))
    end do
    ! mechanical steps tell probes their temperature, but not where the material sleeps
    if (sim%scene%method%sleep%is_on) call warm_probes(sim%patch, sim%g(:, :, 1), sim%probes)
    call unfold(sim, r_warming, sim%g(:, :, 1))
    call book_heat(sim, 1.0_rp, lost(3, :) + lost(5, :), sim%g(:, :, 1))
    do b = 1, sim%particles%nblk
      call warm_block(sim, sim%particles%body(b), sim%particles%count(b), .false., &
                      sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, sim%g(:, :, 1))
    end do
    lost = 0.0_rp
    call gather_temperature(world, sim, f_heat, 0, r_apart, lost)
    call book_heat(sim, smooth_share, lost(2, :), sim%g(:, :, 1))
    do b = 1, sim%particles%nblk
      call warm_block(sim, sim%particles%body(b), sim%particles%count(b), .true., &
                      sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, sim%g(:, :, 1))
    end do
    sim%sums(e_conduction) = sim%sums(e_conduction) + heat_here(sim) &
                             + sim%sums(e_film) - sim%sums(e_wall_heat) - heat
    call anneal_particles(sim, dt)
    if (sim%scene%method%sleep%is_on) call clear_nodes(sim, sim%g)
    call swap_lists(sim)
  end subroutine conduct

  !> Heat that conduction and films bring to the nodes in `dt` at the temperatures in lane 4: lane 5
  !> of the second grid.
  subroutine gather_flux(world, sim, dt, lost)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), intent(inout) :: lost(8, size(sim%scene%constraint))
    integer :: b

    call clear_nodes(sim, sim%g2)
    do b = 1, sim%particles%nblk
      call diffuse_block(sim, b, sim%particles%body(b), sim%particles%count(b), dt, &
                         sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, sim%g(:, :, 1), &
                         sim%g2(:, :, 1))
    end do
    call fold(sim, r_flux, sim%g2(:, :, 1), lost)
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g2(:, :, 1))
  end subroutine gather_flux

  !> Heat of this rank's particles [J].
  pure real(rp) function heat_here(sim)
    type(simulation_t), intent(in) :: sim
    integer :: b, n

    heat_here = 0.0_rp
    do b = 1, sim%particles%nblk
      n = sim%particles%count(b)
      associate (mat => sim%scene%material(sim%scene%body(sim%particles%body(b))%material))
        heat_here = heat_here + mat%c_p*sum(sim%particles%ps(1:n, f_mass, b) &
                                            *sim%particles%ps(1:n, f_temp, b)) &
                    + sum(sim%particles%ps(1:n, f_heat, b))
      end associate
    end do
  end function heat_here

  !> Lane 4 becomes the temperature at the end of a step of backward Euler: its change x solves
  !> C x - (F(x) - F(0)) = F(T) + waiting heat, F the heat that `gather_flux` finds. The fluxes at
  !> the result are what the nodes get, so that heat is exact whatever the tolerance. The next step
  !> follows from dt^2/2 d2T/dt2, freed of its stiff part by another solve.
  subroutine foresee_temperature(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), parameter :: fine = 1.0e-8_rp, rough = 0.1_rp   ! residuals at the end
    real(rp), dimension(sim%patch%nn) :: at_zero, before, b, error, x
    real(rp) :: lost(8, size(sim%scene%constraint)), film, worst(1)
    logical, dimension(sim%patch%nn) :: is_free, is_own

    lost = 0.0_rp
    film = sim%sums(e_film)                     ! what is lost here is only tried
    call choose_nodes(sim, is_free, is_own)
    before = sim%g(4, :, 1)
    call gather_flux(world, sim, dt, lost)
    b = merge(sim%g2(5, :, 1) + sim%g(3, :, 1), 0.0_rp, is_free)
    sim%g(4, :, 1) = 0.0_rp
    call gather_flux(world, sim, dt, lost)
    at_zero = sim%g2(5, :, 1)
    call conjugate_gradients(world, sim, dt, fine, is_free, is_own, at_zero, b, x)
    associate (method => sim%scene%method)
      if (method%heat_every == 0 .and. method%heat_step <= 0.0_rp) then
        b = merge(0.5_rp*(sim%g(1, :, 1)*x - b), 0.0_rp, is_free)
        call conjugate_gradients(world, sim, dt, rough, is_free, is_own, at_zero, b, error)
        worst = maxval(abs(error), mask=is_own)
        worst = max(worst, tiny(1.0_rp))
        call world%max(worst)
        sim%clock%heat_step = max(stable_conduction(sim), dt*max(0.2_rp, &
          min(1.5_rp, 0.8_rp*sqrt(method%heat_tolerance/worst(1)))))
      end if
    end associate
    sim%g(4, :, 1) = x
    call unfold(sim, r_warming, sim%g(:, :, 1))
    sim%g(4, :, 1) = before + sim%g(4, :, 1)
    sim%sums(e_film) = film
  end subroutine foresee_temperature

  !> x of C x - (F(x) - F(0)) = b on free nodes, by conjugate gradients without a matrix that are
  !> weighted by the capacities C, until the residual is `relative` of b.
  subroutine conjugate_gradients(world, sim, dt, relative, is_free, is_own, at_zero, b, x)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, relative        !! [s]
    logical, dimension(sim%patch%nn), intent(in) :: is_free, is_own
    real(rp), dimension(sim%patch%nn), intent(in) :: at_zero, b   !! F(0), b [J]
    real(rp), intent(out) :: x(sim%patch%nn)    !! [K]
    integer, parameter :: most = 1000
    real(rp), dimension(sim%patch%nn) :: p, q, r
    real(rp) :: lost(8, size(sim%scene%constraint)), rho(1), first, last, curvature(1)
    integer :: i

    lost = 0.0_rp
    x = 0.0_rp
    p = 0.0_rp
    r = b
    first = -1.0_rp
    last = 1.0_rp
    do i = 1, most
      q = 0.0_rp
      where (is_free) q = r/sim%g(1, :, 1)
      rho = sum(r*q, mask=is_own)
      call world%sum(rho)
      if (first < 0.0_rp) first = rho(1)
      if (rho(1) <= relative**2*first .or. rho(1) <= 0.0_rp) exit
      p = q + (rho(1)/last)*p
      last = rho(1)
      sim%g(4, :, 1) = p
      call unfold(sim, r_warming, sim%g(:, :, 1))
      call gather_flux(world, sim, dt, lost)
      q = merge(sim%g(1, :, 1)*p - (sim%g2(5, :, 1) - at_zero), 0.0_rp, is_free)
      curvature = sum(p*q, mask=is_own)
      call world%sum(curvature)
      if (curvature(1) <= 0.0_rp) exit
      x = x + (rho(1)/curvature(1))*p
      r = r - (rho(1)/curvature(1))*q
    end do
  end subroutine conjugate_gradients

  !> Nodes with a temperature of their own: in use, not empty, not behind a wall; and those of them
  !> that count for this rank in a sum.
  subroutine choose_nodes(sim, is_free, is_own)
    type(simulation_t), intent(in) :: sim
    logical, dimension(sim%patch%nn), intent(out) :: is_free, is_own
    integer :: r

    is_free = .false.
    is_own = .false.
    do r = 1, sim%n_runs
      is_free(sim%run(1, r):sim%run(2, r)) = .true.
      if (sim%run(3, r) == 1) is_own(sim%run(1, r):sim%run(2, r)) = .true.
    end do
    is_free = is_free .and. sim%g(1, :, 1) > least_capacity
    is_free(sim%mirrors%pair(1, :sim%mirrors%n_pairs)) = .false.
    is_own = is_own .and. is_free
  end subroutine choose_nodes

  !> Capacities and nodal means of the field `temp_field`; waiting heat from `heat_field` (0: none).
  !> `kind` says how walls mirror the field, `lost` what that changes.
  subroutine gather_temperature(world, sim, temp_field, heat_field, kind, lost)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: temp_field, heat_field, kind
    real(rp), intent(inout) :: lost(8, size(sim%scene%constraint))
    integer :: b, r

    call clear_nodes(sim, sim%g)
    do b = 1, sim%particles%nblk
      call gather_block(sim, sim%particles%body(b), sim%particles%count(b), temp_field, &
                        heat_field, sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, &
                        sim%g(:, :, 1))
    end do
    call fold(sim, kind, sim%g(:, :, 1), lost, sim%mirrors%own(:, 1))
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g(:, :, 1))
    do r = 1, sim%n_runs
      call nodal_temperature(sim%run(2, r) - sim%run(1, r) + 1, &
                             sim%g(:, sim%run(1, r):sim%run(2, r), 1))
    end do
    call unfold(sim, merge(r_temperature, r_apart, kind == r_heat), sim%g(:, :, 1))
  end subroutine gather_temperature

  subroutine gather_block(sim, body, n, temp_field, heat_field, nf, ps, rec, g)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, temp_field, heat_field, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18), heat(nlane)

    heat = 0.0_rp
    if (heat_field > 0) heat = ps(:, heat_field)
    call weights_of(sim, body, nf, ps, w, first)
    call capacity_to_grid(n, w, first, sim%patch%stride, sim%patch%nn, &
                          sim%scene%material(sim%scene%body(body)%material)%c_p, ps(1, f_mass), &
                          ps(1, temp_field), heat, rec, g)
  end subroutine gather_block

  subroutine diffuse_block(sim, b, body, n, dt, nf, ps, rec, g, flux)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b, body, n, nf
    real(rp), intent(in) :: dt, ps(nlane, nf), g(8, sim%patch%nn)
    real(rp), intent(inout) :: rec(8, 4, nlane), flux(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    associate (mat => sim%scene%material(sim%scene%body(body)%material))
      call flux_to_grid(n, w, first, sim%patch%stride, sim%patch%nn, dt, mat%conductivity, &
                        1.0_rp/mat%rho, ps(1, f_jac), ps(1, f_mass), g, rec, flux)
    end associate
    if (any(sim%scene%body(body)%film > 0.0_rp)) then
      call lose_heat(sim, b, body, n, dt, nf, ps, g, flux)
    end if
  end subroutine diffuse_block

  !> Film losses of the particles of a block that lie on a face.
  subroutine lose_heat(sim, b, body, n, dt, nf, ps, g, flux)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b, body, n, nf
    real(rp), intent(in) :: dt, ps(nlane, nf), g(8, sim%patch%nn)
    real(rp), intent(inout) :: flux(8, sim%patch%nn)
    real(rp) :: x(3), area
    integer :: axis, face, faces, p

    associate (body_now => sim%scene%body(body))
      do p = 1, n
        faces = tag_faces(sim%particles%tag(p, b))
        if (faces == 0) cycle
        do face = 1, 6
          if (.not. btest(faces, face - 1) .or. body_now%film(face) <= 0.0_rp) cycle
          axis = (face + 1)/2
          x = ps(p, f_pos:f_pos + 2)
          x(axis) = x(axis) + merge(0.5_rp, -0.5_rp, mod(face, 2) == 0)*body_now%spacing(axis)
          area = product(body_now%spacing)/body_now%spacing(axis)
          call film_to_grid(dt, body_now%film(face), area, body_now%ambient(face), &
                            (x - sim%patch%origin)/sim%patch%h, sim%patch%stride, sim%patch%nn, &
                            g, flux, sim%sums(e_film))
        end do
      end do
    end associate
  end subroutine lose_heat

  !> Take the increment, or (`smooth`) what neighbours differ by.
  subroutine warm_block(sim, body, n, smooth, nf, ps, rec, g)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    logical, intent(in) :: smooth
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane)
    real(rp), intent(in) :: g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    if (smooth) then
      call smooth_particles(n, w, first, sim%patch%stride, sim%patch%nn, g, rec, ps(1, f_temp), &
                            ps(1, f_heat))
    else
      call heat_particles(n, w, first, sim%patch%stride, sim%patch%nn, g, rec, ps(1, f_temp), &
                          ps(1, f_heat))
    end if
  end subroutine warm_block

end module time_heat
