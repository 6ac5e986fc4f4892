! SPDX-License-Identifier: MIT
!> Heat loss through particle faces on the surface of a body: films, whose coefficient may depend on
!> the pressure there, and radiation. Faces move with their particles; area and normal are constant.
module heat_films
  use base_kinds, only: nlane, rp
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_mass, f_pos, particles_t, tag_faces
  use state_budget, only: budget_t, e_film
  use state_film, only: film_t, of_pressure, stefan_boltzmann
  use state_scene, only: scene_t
  use transfer_conduction, only: film_to_grid, min_capacity
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: face_of, films_need_pressure, films_vary, add_film_losses

contains

  !> True if the coefficient of any film depends on pressure.
  pure logical function films_need_pressure(scene)
    type(scene_t), intent(in) :: scene
    integer :: b

    films_need_pressure = any([(any(scene%body(b)%film%of == of_pressure), b=1, size(scene%body))])
  end function films_need_pressure

  !> True if any face has more than a film with a constant coefficient.
  pure logical function films_vary(scene)
    type(scene_t), intent(in) :: scene
    integer :: b

    films_vary = any([(any(scene%body(b)%film%varies()), b=1, size(scene%body))])
  end function films_vary

  !> Add the film losses of a block of particles to the nodal fluxes.
  subroutine add_film_losses(scene, particles, nodes, budget, b, body, n, dt, nf, ps, g, flux)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: b, body, n, nf
    real(rp), intent(in) :: dt, ps(nlane, nf), g(8, nodes%patch%nn)
    real(rp), intent(inout) :: flux(8, nodes%patch%nn)
    real(rp) :: x(3), area, spacing(3)
    integer :: axis, face, faces, p

    associate (body_now => scene%body(body))
      do p = 1, n
        faces = tag_faces(particles%tag(p, b))
        if (faces == 0) cycle
        spacing = scene%spacing_of(body, ps(p, f_mass))
        do face = 1, 6
          if (.not. btest(faces, face - 1) .or. .not. body_now%film(face)%acts()) cycle
          if (body_now%film(face)%has_backing) cycle     ! heat_sinks
          call face_of(spacing, face, ps(p, f_pos:f_pos + 2), axis, x, area)
          x = nodes%patch%linear_place(x)
          associate (film => body_now%film(face))
            if (film%varies()) then
              call add_varying_loss(dt, film, axis, area, x, nodes%patch%stride, nodes%patch%nn, &
                                    g, flux, budget%sums(e_film))
            else
              call film_to_grid(dt, film%coefficient, area, film%ambient, x, &
                                nodes%patch%stride, nodes%patch%nn, g, flux, budget%sums(e_film))
            end if
          end associate
        end do
      end do
    end associate
  end subroutine add_film_losses

  !> Axis, centre and area of a face of a particle.
  pure subroutine face_of(spacing, face, centre, axis, x, area)
    real(rp), intent(in) :: spacing(3)                !! edges of the particle [m]
    integer, intent(in) :: face                       !! 1..6: xmin .. zmax
    real(rp), intent(in) :: centre(3)                 !! centre of the particle [m]
    integer, intent(out) :: axis
    real(rp), intent(out) :: x(3)                     !! centre of the face [m]
    real(rp), intent(out) :: area                     !! [m2]

    axis = (face + 1)/2
    x = centre
    x(axis) = x(axis) + merge(0.5_rp, -0.5_rp, mod(face, 2) == 0)*spacing(axis)
    area = product(spacing)/spacing(axis)
  end subroutine face_of

  !> Add the loss of a face in `dt` by a film with a coefficient at the local pressure (lanes 6:8 of
  !> `g`) and by radiation, linearized about the temperature before the step (lane 5). Lane 6 of
  !> `flux` receives the conductance [W/K].
  subroutine add_varying_loss(dt, film, axis, area, s, stride, nn, g, flux, lost)
    type(film_t), intent(in) :: film
    integer, intent(in) :: axis, stride(3), nn
    real(rp), intent(in) :: dt                        !! [s]
    real(rp), intent(in) :: area                      !! area of the face [m2]
    real(rp), intent(in) :: s(3)                      !! its position from the first node [cells]
    real(rp), intent(in) :: g(8, nn)
    real(rp), intent(inout) :: flux(8, nn)
    real(rp), intent(inout) :: lost                   !! accumulated loss [J]
    real(rp) :: before, h, heat, radiation, t, weight(0:7)
    integer :: c, q(0:7)

    call point_nodes(s, stride, 1, min_capacity, nn, g, q, weight)
    if (sum(weight) <= 0.0_rp) return
    t = sum(weight*g(4, q))
    before = sum(weight*g(5, q))
    h = film%coefficient_at(sum(weight*g(5 + axis, q)))
    radiation = film%emissivity*stefan_boltzmann*before**3
    heat = h*(t - film%ambient) + radiation*before + 4.0_rp*radiation*(t - before) &
           - film%emissivity*stefan_boltzmann*film%ambient**4
    heat = dt*area*heat
    h = h + 4.0_rp*radiation
    do c = 0, 7
      flux(5, q(c)) = flux(5, q(c)) - heat*weight(c)
      flux(6, q(c)) = flux(6, q(c)) + h*area*weight(c)
    end do
    lost = lost + heat
  end subroutine add_varying_loss

end module heat_films
