! SPDX-License-Identifier: MIT
!> Conduction between particles and nodes: nodal temperatures and heat fluxes.
module heat_nodes
  use base_kinds, only: nlane, pi, rp
  use boundary_symmetry, only: r_flux, r_heat, r_temperature, r_warming, reflect, restore
  use heat_exchange, only: add_conductances, add_exchange, contacts_t, films_need_pressure
  use heat_gaps, only: add_gap_conductances, add_gap_fluxes, gaps_t
  use mpm_blocks, only: weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_heat, f_jac, f_mass, f_tau, f_temp, n_conduction, particles_t
  use state_budget, only: n_sums
  use state_nodes, only: clear_nodes, nodes_t
  use state_scene, only: scene_t
  use transfer_conduction, only: capacity_to_grid, compute_nodal_pressure, &
                                 compute_nodal_temperature, flux_to_grid, min_capacity, &
                                 pressure_to_grid
  implicit none (type, external)
  private

  public :: centre_increment, gather_exchange, gather_flux, gather_temperature, smoothed_fraction
  public :: stable_conduction
  public :: sum_all_nodes

  !> Rate of smoothing over kappa/spacing^2. Heat of a face enters at the scale of a cell, which is
  !> as well resolved by any number of steps; 0.1 to 1 is the range in which the temperature of the
  !> particles at a face does not depend on it by more than 3 % (tests/verification/ablation.md).
  real(rp), parameter :: smoothing = 0.3_rp

contains

  !> Stable explicit conduction step [s]: least FOURIER h^2 rho c/k of all materials.
  pure real(rp) function stable_conduction(scene)
    type(scene_t), intent(in) :: scene
    real(rp) :: c, k
    integer :: m

    stable_conduction = huge(1.0_rp)
    do m = 1, size(scene%material)
      call scene%material(m)%max_diffusivity(k, c)
      if (k > 0.0_rp) stable_conduction = min(stable_conduction, &
        scene%method%fourier*minval(scene%grid%h)**2*scene%material(m)%rho*c/k)
    end do
  end function stable_conduction

  !> Collective. Nodal capacities, temperatures and pending heat, and normal pressures along the
  !> axes if films need them (lanes 6:8).
  subroutine gather_temperature(scene, particles, nodes)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    logical :: with_pressure
    integer :: a, b, k, r

    with_pressure = films_need_pressure(scene)
    call clear_nodes(nodes, nodes%g)
    do b = 1, particles%nblk
      call particles%fetch(b + 1, n_conduction)
      call gather_block(scene, particles, nodes, b, with_pressure)
    end do
    do k = 1, scene%n_heat_groups
      call reflect(scene, nodes, r_heat, nodes%g(:, :, k), &
                   nodes%boundary%mirrors%lost, nodes%boundary%mirrors%mass_behind(:, k))
      call sum_all_nodes(scene, nodes, 8, nodes%g(:, :, k))
      do r = 1, nodes%n_ranges
        associate (low => nodes%range(1, r), high => nodes%range(2, r))
          call compute_nodal_temperature(high - low + 1, nodes%g(:, low:high, k))
          if (with_pressure) then
            call compute_nodal_pressure(high - low + 1, nodes%g(:, low:high, k))
          end if
        end associate
      end do
      call restore(scene, nodes, r_temperature, nodes%g(:, :, k))
      do a = 1, 3
        if (.not. scene%grid%grading(a)%is_graded) cycle
        call centre_temperature(scene, nodes, a, nodes%g(:, :, k))
        call restore(scene, nodes, r_temperature, nodes%g(:, :, k))
      end do
    end do
  end subroutine gather_temperature

  !> Extrapolate nodal temperatures along the graded axis `a`. The mean at a node belongs to the
  !> centre of its shape function, which differs from the node where cells grow; the gradient
  !> between the centres of the neighbours takes it to the node, exactly for linear fields. Owners
  !> compute their nodes.
  subroutine centre_temperature(scene, nodes, a, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: a
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp) :: temp(1, nodes%patch%nn)
    logical :: has_any(nodes%patch%nn)
    integer :: ijk(3), q, r

    temp = 0.0_rp
    has_any = .false.
    associate (patch => nodes%patch)
      do r = 1, nodes%n_ranges
        do q = nodes%range(1, r), nodes%range(2, r)
          has_any(q) = g(1, q) > min_capacity
        end do
      end do
      do q = 1, patch%nn
        if (.not. has_any(q)) cycle
        ijk = patch%indices(q)
        if (.not. patch%own%has(ijk)) cycle
        associate (below => q - patch%stride(a), above => q + patch%stride(a))
          temp(1, q) = at_node(ijk(a), [has_any(below), has_any(above)], g(4, [below, q, above]))
        end associate
      end do
      call sum_all_nodes(scene, nodes, 1, temp)
      do q = 1, patch%nn                  ! nodes beyond the ends have no owner
        if (has_any(q) .and. temp(1, q) > 0.0_rp) g(4:5, q) = temp(1, q)
      end do
    end associate
  contains
    !> Temperature at node `i` from the means at the node below, itself and the node above.
    pure real(rp) function at_node(i, is_there, mean) result(t)
      integer, intent(in) :: i
      logical, intent(in) :: is_there(2)     !! the nodes below and above have mass
      real(rp), intent(in) :: mean(3)        !! mean temperatures [K]
      real(rp) :: distance(2), rise(2)

      associate (grading => scene%grid%grading(a))
        distance = [grading%centre(i) - grading%centre(i - 1), &
                    grading%centre(i + 1) - grading%centre(i)]
        rise = mean(2:3) - mean(1:2)
        t = mean(2)
        if (any(is_there)) t = t + (grading%middle(i) - grading%centre(i)) &
                               *sum(rise, is_there)/sum(distance, is_there)
      end associate
    end function at_node
  end subroutine centre_temperature

  !> Shift the nodal increments (lane 5) along the graded axis `a` from the centres of the shape
  !> functions to the nodes, conserving heat: the heat exchanged by two neighbours is proportional
  !> to the difference of their increments times (w1^2 + w1 w2 + w2^2 - 3 w^2)/12 over the distance
  !> of the centres, with the widths w1, w2 of their supports and the smallest width w. This is
  !> exact for linear increments and vanishes between the finest cells. Heat exchanged with a wall
  !> of given temperature is added to `wall_heat`.
  subroutine centre_increment(scene, nodes, a, g, wall_heat)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: a
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), intent(inout) :: wall_heat             !! heat that walls give [J]
    real(rp), allocatable :: capacity(:), new(:, :)  ! capacities [J/K], doubled on walls
    logical, allocatable :: is_given(:)              ! node on a wall of given temperature
    logical, allocatable :: is_image(:)              ! node behind a wall
    real(rp) :: from_above, from_below
    integer :: i, ijk(3), q, r

    call restore(scene, nodes, r_warming, g)
    allocate (capacity(nodes%patch%nn), new(2, nodes%patch%nn), source=0.0_rp)
    allocate (is_given(nodes%patch%nn), is_image(nodes%patch%nn), source=.false.)
    is_image(nodes%boundary%mirrors%pair(1, :nodes%boundary%mirrors%n_pairs)) = .true.
    associate (patch => nodes%patch, planes => scene%symmetry)
      do r = 1, nodes%n_ranges
        associate (low => nodes%range(1, r), high => nodes%range(2, r))
          capacity(low:high) = g(1, low:high)
        end associate
      end do
      do i = 1, nodes%boundary%mirrors%n_planes
        associate (node => nodes%boundary%mirrors%plane(1, i), &
                   plane => nodes%boundary%mirrors%plane(2, i))
          if (planes(plane)%axis /= a) cycle
          capacity(node) = 2.0_rp*capacity(node)
          is_given(node) = planes(plane)%temperature > 0.0_rp
        end associate
      end do
      do q = 1, patch%nn                  ! no heat exchange beyond open ends
        ijk = patch%indices(q)
        if (.not. is_image(q) .and. (ijk(a) < 0 .or. ijk(a) >= scene%grid%n(a))) capacity(q) = &
          0.0_rp
      end do
      do q = 1, patch%nn
        if (capacity(q) <= min_capacity) cycle
        ijk = patch%indices(q)
        if (.not. patch%own%has(ijk)) cycle
        new(:, q) = [g(5, q), 1.0_rp]
        if (is_given(q)) cycle
        associate (below => q - patch%stride(a), above => q + patch%stride(a))
          from_below = exchanged(ijk(a) - 1, below, q)
          from_above = -exchanged(ijk(a), q, above)
          new(1, q) = g(5, q) + (from_below + from_above)/capacity(q)
          if (is_given(below)) wall_heat = wall_heat + from_below
          if (is_given(above)) wall_heat = wall_heat + from_above
        end associate
      end do
      call sum_all_nodes(scene, nodes, 2, new)
      do q = 1, patch%nn                  ! nodes beyond the ends have no owner
        if (new(2, q) > 0.5_rp) g(5:6, q) = [new(1, q), g(8, q) + new(1, q)]
      end do
    end associate
  contains
    !> Heat exchanged between node `i`, stored at `low`, and the next one at `high` [J].
    pure real(rp) function exchanged(i, low, high)
      integer, intent(in) :: i, low, high
      real(rp) :: density

      associate (grading => scene%grid%grading(a))
        density = min(capacity(low)/sum(grading%span(5, i - 1:i + 1)), &
                      capacity(high)/sum(grading%span(5, i:i + 2)))
        associate (w1 => grading%span(5, i), w2 => grading%span(5, i + 1))
          exchanged = 0.25_rp*density*(g(5, high) - g(5, low))*(w1**2 + w1*w2 + w2**2 &
            - 3.0_rp*scene%grid%h(a)**2)/(grading%centre(i + 1) - grading%centre(i))
        end associate
      end associate
    end function exchanged
  end subroutine centre_increment

  !> Collective. Heat to the nodes in `dt` by conduction at the temperatures in lane 4, to lane 5 of
  !> the second grid; with `ends`, lane 4 is the temperature at the end of the step, and the
  !> exchange with what is outside the bodies is included; otherwise its conductances [W/K] are in
  !> lane 6. Lane 8: capacity times the smoothed differences of particles from the nodal field.
  subroutine gather_flux(scene, particles, nodes, contacts, gaps, dt, ends, sums)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(contacts_t), intent(inout) :: contacts
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: dt                  !! time step [s]
    logical, intent(in) :: ends
    real(rp), intent(inout), optional :: sums(n_sums)   !! of a step; absent: a trial
    integer :: b

    call clear_nodes(nodes, nodes%g2)
    do b = 1, particles%nblk
      call particles%fetch(b + 1, n_conduction)
      call diffuse_block(scene, particles, nodes, b, dt)
    end do
    if (ends) then
      call add_exchange(nodes, dt, ends, contacts, sums)
      call add_gap_fluxes(nodes, gaps, dt, ends)
    else
      call add_conductances(nodes, contacts)
      call add_gap_conductances(nodes, gaps)
    end if
    call sum_flux(scene, nodes)
  end subroutine gather_flux

  !> Collective. Heat to the nodes in an explicit step `dt` by the exchange with what is outside the
  !> bodies, to lane 5 of the second grid, with the increments by all other heat in lane 5.
  subroutine gather_exchange(scene, nodes, contacts, gaps, dt, sums)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(contacts_t), intent(inout) :: contacts
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp), intent(inout) :: sums(n_sums)

    call clear_nodes(nodes, nodes%g2)
    call add_exchange(nodes, dt, .false., contacts, sums)
    call add_gap_fluxes(nodes, gaps, dt, .false.)
    call sum_flux(scene, nodes)
  end subroutine gather_exchange

  !> Collective. Reflect the second grid at walls and sum it over the ranks.
  subroutine sum_flux(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    integer :: k

    do k = 1, scene%n_heat_groups
      call reflect(scene, nodes, r_flux, nodes%g2(:, :, k), nodes%boundary%mirrors%lost)
      call sum_all_nodes(scene, nodes, 8, nodes%g2(:, :, k))
    end do
  end subroutine sum_flux

  !> Fraction by which differences of particle temperatures that the grid does not resolve are
  !> smoothed in a conduction step: z/(1 + z) with z = c kappa dt/spacing^2, as in an implicit step,
  !> along the axis of the least spacing, where heat spreads first. Molten metal takes no friction
  !> heat, but shares nodes with colder metal that does; its differences decay at their physical
  !> rate.
  pure function smoothed_fraction(scene, block, dt) result(part)
    type(scene_t), intent(in) :: scene
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: dt                  !! time step [s]
    real(rp) :: part(nlane), spacing(nlane)     !! part, least spacing of the particle [m]
    integer :: p

    spacing = minval(scene%body(block%body)%spacing)
    if (scene%grid%is_graded()) then
      do p = 1, nlane
        spacing(p) = minval(scene%spacing_of(block%body, block%ps(p, :)))
      end do
    end if
    associate (mat => scene%material(scene%body(block%body)%material), &
               temp => block%ps(:, f_temp))
      part = merge(pi**2, smoothing, temp > mat%t_melt)*dt*mat%conductivity_at(temp) &
             /(mat%rho*mat%specific_heat_at(temp)*spacing**2)
      part = part/(1.0_rp + part)
    end associate
  end function smoothed_fraction

  !> Collective. Sum nodal values over the ranks, including nodes of sleeping material.
  subroutine sum_all_nodes(scene, nodes, width, values)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, nodes%patch%nn)

    if (scene%method%sleep%is_on) then
      call nodes%resting_halo%sum(width, nodes%patch%nn, values)
    else
      call nodes%halo%sum(width, nodes%patch%nn, values)
    end if
  end subroutine sum_all_nodes

  !> Add capacity, heat and pressure of a block of particles to the nodes.
  subroutine gather_block(scene, particles, nodes, b, with_pressure)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: b
    logical, intent(in) :: with_pressure
    type(block_t) :: block
    real(rp) :: c_p(nlane)

    call view_block(particles, b, block)
    call weights_of(scene, nodes, block)
    associate (body => scene%body(block%body), ps => block%ps, w => block%w, &
               first => block%first, patch => nodes%patch)
      c_p = scene%material(body%material)%specific_heat_at(ps(:, f_temp))
      call capacity_to_grid(block%n, w, first, patch%stride, patch%nn, c_p, ps(:, f_mass), &
                            ps(:, f_temp), ps(:, f_heat), nodes%rec, &
                            nodes%g(:, :, body%heat_group))
      if (with_pressure) call pressure_to_grid(block%n, w, first, patch%stride, patch%nn, c_p, &
                                               ps(:, f_jac), ps(:, f_mass), &
                                               ps(:, f_tau:f_tau + 2), nodes%rec, &
                                               nodes%g(:, :, body%heat_group))
    end associate
  end subroutine gather_block

  !> Add the conductive fluxes of a block of particles to the nodes.
  subroutine diffuse_block(scene, particles, nodes, b, dt)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: b
    real(rp), intent(in) :: dt                  !! time step [s]
    type(block_t) :: block

    call view_block(particles, b, block)
    call weights_of(scene, nodes, block)
    associate (body => scene%body(block%body), ps => block%ps, temp => block%ps(:, f_temp), &
               mat => scene%material(scene%body(block%body)%material))
      call flux_to_grid(block%n, block%w, block%first, nodes%patch%stride, nodes%patch%nn, dt, &
                        mat%conductivity_at(temp), 1.0_rp/mat%rho, mat%specific_heat_at(temp), &
                        ps(:, f_jac), ps(:, f_mass), temp, smoothed_fraction(scene, block, dt), &
                        nodes%g(:, :, body%heat_group), nodes%rec, &
                        nodes%g2(:, :, body%heat_group))
    end associate
  end subroutine diffuse_block

end module heat_nodes
