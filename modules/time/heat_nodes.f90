! SPDX-License-Identifier: MIT
!> Conduction between particles and nodes: temperatures of the nodes, and the heat they are brought.
module time_heat_nodes
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use particles_store, only: f_heat, f_jac, f_mass, f_pos, f_temp, n_conduction, tag_faces
  use thermal_conduction, only: capacity_to_grid, film_to_grid, flux_to_grid, nodal_temperature
  use time_audit, only: e_film
  use time_mirrors, only: fold, r_flux, r_heat, r_temperature, unfold
  use time_nodes, only: clear_nodes
  use time_state, only: simulation_t
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: gather_flux, gather_temperature, stable_conduction, sum_all_nodes

contains

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

  !> Capacities, temperatures and waiting heat of the nodes; `lost` is what walls change of the sums.
  subroutine gather_temperature(world, sim, lost)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: lost(8, size(sim%scene%constraint))
    integer :: b, r

    call clear_nodes(sim, sim%g)
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      call gather_block(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                        sim%particles%ps(:, :, b), sim%rec, sim%g(:, :, 1))
    end do
    call fold(sim, r_heat, sim%g(:, :, 1), lost, sim%mirrors%own(:, 1))
    call sum_all_nodes(world, sim, 8, sim%g(:, :, 1))
    do r = 1, sim%n_runs
      call nodal_temperature(sim%run(2, r) - sim%run(1, r) + 1, &
                             sim%g(:, sim%run(1, r):sim%run(2, r), 1))
    end do
    call unfold(sim, r_temperature, sim%g(:, :, 1))
  end subroutine gather_temperature

  !> Heat that conduction and films bring to the nodes in `dt` at the temperatures in lane 4: lane 5
  !> of the second grid. Lane 8: capacity times what particles differ by from lane 5.
  subroutine gather_flux(world, sim, dt, lost)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    real(rp), intent(inout) :: lost(8, size(sim%scene%constraint))
    integer :: b

    call clear_nodes(sim, sim%g2)
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      call diffuse_block(sim, b, sim%particles%body(b), sim%particles%count(b), dt, &
                         sim%particles%nf, sim%particles%ps(:, :, b), sim%rec, sim%g(:, :, 1), &
                         sim%g2(:, :, 1))
    end do
    call fold(sim, r_flux, sim%g2(:, :, 1), lost)
    call sum_all_nodes(world, sim, 8, sim%g2(:, :, 1))
  end subroutine gather_flux

  !> Sum over the ranks of what is in all nodes, also in those of sleepers.
  subroutine sum_all_nodes(world, sim, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%patch%nn)

    if (sim%scene%method%sleep%is_on) then
      call sim%resting_halo%sum(world, width, sim%patch%nn, values)
    else
      call sim%halo%sum(world, width, sim%patch%nn, values)
    end if
  end subroutine sum_all_nodes

  subroutine gather_block(sim, body, n, nf, ps, rec, g)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, sim%patch%nn)
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    call capacity_to_grid(n, w, first, sim%patch%stride, sim%patch%nn, &
                          sim%scene%material(sim%scene%body(body)%material)%c_p, ps(1, f_mass), &
                          ps(1, f_temp), ps(1, f_heat), rec, g)
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
                        1.0_rp/mat%rho, mat%c_p, ps(1, f_jac), ps(1, f_mass), ps(1, f_temp), g, rec, &
                        flux)
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

end module time_heat_nodes
