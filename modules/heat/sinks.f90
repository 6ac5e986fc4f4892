! SPDX-License-Identifier: MIT
!> Heat flow through particle faces and into heat sinks. Faces on the surface of a body lose heat by
!> films, whose coefficient may depend on the pressure there, and radiation; they move with their
!> particles, area and normal are constant. Heat sinks are tools, and backings behind films. A
!> particle that was in contact with a tool since the last conduction step loses h A (T_s - T_f),
!> with its mean contact area A, the resistance 1/h of half a particle spacing and the gap, and the
!> surface temperature T_s, which includes the temperature drop of the friction heat across the half
!> spacing. A particle face in front of a backing loses heat with the coefficient of its film and
!> the nodal temperature at the face. The sink temperature T_f is that at the end of the step
!> (tools_heat_sink).
module heat_sinks
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: weights_of
  use particles_store, only: f_pos, f_temp, tag_faces
  use simulation_parts, only: simulation_t
  use simulation_run, only: e_film, e_tool
  use simulation_scene, only: film_t, of_pressure, scene_t, stefan_boltzmann
  use tools_heat_sink, only: find_backing
  use tools_tool, only: tool_t
  use transfer_conduction, only: film_to_grid, min_capacity
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: add_film_losses, add_sink_fluxes, advance_sinks, face_of, films_need_pressure, &
            films_vary, find_sinks, reset_contact_sums, sinks_t

  !> Contacts of this rank's particles with heat sinks in a conduction step. Sinks are the tools,
  !> followed by the columns of all backings.
  type :: sinks_t
    integer :: n = 0
    integer, allocatable :: sink(:), group(:)          !! sink and heat group of each contact
    integer, allocatable :: node(:, :)                 !! (27, n) nodes of each contact
    real(rp), allocatable :: weight(:, :)              !! (27, n) interpolation weights
    real(rp), allocatable :: conductance(:)            !! h A [W/K]
    real(rp), allocatable :: surface_excess(:)         !! T_s less the nodal temperature [K]
    real(rp), allocatable :: total_conductance(:)  !! conductance to each sink, of all ranks [W/K]
    real(rp), allocatable :: t_face0(:)                !! face temperature without heat flow [K]
    real(rp), allocatable :: dt_face_dp(:)             !! slope of the face temperature with the
                                                       !! heat flow [K/W]
    real(rp), allocatable :: power(:)                  !! heat flow into each sink [W]
  end type sinks_t

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
  subroutine add_film_losses(sim, b, dt)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b
    real(rp), intent(in) :: dt                        !! time step [s]
    real(rp) :: x(3), area, spacing(3)
    integer :: axis, face, faces, p

    associate (body => sim%scene%body(sim%particles%body(b)), ps => sim%particles%ps(:, :, b), &
               patch => sim%nodes%patch)
      do p = 1, sim%particles%count(b)
        faces = tag_faces(sim%particles%tag(p, b))
        if (faces == 0) cycle
        spacing = sim%scene%spacing_of(sim%particles%body(b), ps(p, :))
        do face = 1, 6
          if (.not. btest(faces, face - 1) .or. .not. body%film(face)%acts()) cycle
          if (body%film(face)%has_backing) cycle     ! a heat sink, see list_faces
          call face_of(spacing, face, ps(p, f_pos:f_pos + 2), axis, x, area)
          x = patch%linear_place(x)
          associate (film => body%film(face))
            if (film%varies()) then
              call add_varying_loss(sim, dt, film, body%heat_group, axis, area, x)
            else
              call film_to_grid(dt, film%coefficient, area, film%ambient, x, patch%stride, &
                                patch%nn, sim%nodes%g(:, :, body%heat_group), &
                                sim%nodes%g2(:, :, body%heat_group), sim%budget%sums(e_film))
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

  !> Add the loss of a face in `dt` by a film with a coefficient at the local pressure (lanes 6:8)
  !> and by radiation, linearized about the temperature before the step (lane 5). Lane 6 of the
  !> second grid receives the conductance [W/K].
  subroutine add_varying_loss(sim, dt, film, group, axis, area, s)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                        !! time step [s]
    type(film_t), intent(in) :: film
    integer, intent(in) :: group                      !! heat group
    integer, intent(in) :: axis                       !! axis normal to the face
    real(rp), intent(in) :: area                      !! area of the face [m2]
    real(rp), intent(in) :: s(3)                      !! position of the face from the first node
                                                      !! [cells]
    real(rp) :: before, h, heat, radiation, t, weight(0:7)
    integer :: c, q(0:7)

    associate (g => sim%nodes%g(:, :, group))
      call point_nodes(s, sim%nodes%patch%stride, 1, min_capacity, sim%nodes%patch%nn, g, q, weight)
      if (sum(weight) <= 0.0_rp) return
      t = sum(weight*g(4, q))
      before = sum(weight*g(5, q))
      h = film%coefficient_at(sum(weight*g(5 + axis, q)))
    end associate
    radiation = film%emissivity*stefan_boltzmann*before**3
    heat = h*(t - film%ambient) + radiation*before + 4.0_rp*radiation*(t - before) &
           - film%emissivity*stefan_boltzmann*film%ambient**4
    heat = dt*area*heat
    h = h + 4.0_rp*radiation
    associate (flux => sim%nodes%g2(:, :, group))
      do c = 0, 7
        flux(5, q(c)) = flux(5, q(c)) - heat*weight(c)
        flux(6, q(c)) = flux(6, q(c)) + h*area*weight(c)
      end do
    end associate
    sim%budget%sums(e_film) = sim%budget%sums(e_film) + heat
  end subroutine add_varying_loss

  !> Collective. List the contacts with heat sinks from means over the time since the last
  !> conduction step.
  subroutine find_sinks(sim, elapsed, dt, sinks)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: elapsed                    !! time since the last conduction step [s]
    real(rp), intent(in) :: dt                         !! conduction step [s]
    type(sinks_t), intent(inout) :: sinks
    integer :: b, i, k, n, n_sinks

    sinks%n = 0
    if (.not. any(sim%tool%heat%is_on) .and. size(sim%backing) == 0) return
    n = count_faces(sim)
    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%heat%is_on) cycle
      do b = 1, sim%particles%nblk
        n = n + count(sim%particles%ps(:sim%particles%count(b), sim%tool(k)%heat%place, b) > 0.0_rp)
      end do
    end do
    sinks = sinks_t()
    allocate (sinks%sink(n), sinks%group(n), sinks%node(27, n), sinks%weight(27, n), &
              sinks%conductance(n), sinks%surface_excess(n))
    n_sinks = size(sim%tool) + sum([(size(sim%backing(k)%column), k=1, size(sim%backing))])
    allocate (sinks%total_conductance(n_sinks), sinks%t_face0(n_sinks), sinks%dt_face_dp(n_sinks), &
              sinks%power(n_sinks), source=0.0_rp)
    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%heat%is_on) cycle
      call sim%tool(k)%heat%face_response(dt, sinks%t_face0(k), sinks%dt_face_dp(k))
      do b = 1, sim%particles%nblk
        if (.not. any(sim%particles%ps(:sim%particles%count(b), sim%tool(k)%heat%place, &
                                       b) > 0.0_rp)) cycle
        call list_block(sim, k, b, elapsed, sinks)
      end do
    end do
    if (size(sim%backing) > 0) then
      call list_faces(sim, size(sim%tool), sinks)
      n_sinks = size(sim%tool)
      do k = 1, size(sim%backing)
        do i = 1, size(sim%backing(k)%column)
          n_sinks = n_sinks + 1
          call sim%backing(k)%column(i)%face_response(dt, sinks%t_face0(n_sinks), &
                                                      sinks%dt_face_dp(n_sinks))
        end do
      end do
    end if
    call sim%world%sum(sinks%total_conductance)
  end subroutine find_sinks

  !> Number of particle faces of this rank in front of a backing.
  pure integer function count_faces(sim) result(n)
    type(simulation_t), intent(in) :: sim
    integer :: b, face, p

    n = 0
    do b = 1, sim%particles%nblk
      associate (film => sim%scene%body(sim%particles%body(b))%film)
        if (.not. any(film%has_backing)) cycle
        do p = 1, sim%particles%count(b)
          do face = 1, 6
            if (.not. film(face)%has_backing) cycle
            if (btest(tag_faces(sim%particles%tag(p, b)), face - 1)) n = n + 1
          end do
        end do
      end associate
    end do
  end function count_faces

  !> Add the particle faces in front of backings, with linear weights of the surrounding nodes and
  !> the film coefficient at the local pressure.
  subroutine list_faces(sim, n_tools, sinks)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n_tools
    type(sinks_t), intent(inout) :: sinks
    real(rp) :: area, weight(0:7), x(3)
    integer :: axis, b, face, i, k, p, q(0:7)

    do b = 1, sim%particles%nblk
      associate (body => sim%scene%body(sim%particles%body(b)), t => sinks, &
                 patch => sim%nodes%patch)
        if (.not. any(body%film%has_backing)) cycle
        do p = 1, sim%particles%count(b)
          do face = 1, 6
            if (.not. body%film(face)%has_backing) cycle
            if (.not. btest(tag_faces(sim%particles%tag(p, b)), face - 1)) cycle
            call face_of(sim%scene%spacing_of(sim%particles%body(b), sim%particles%ps(p, :, b)), &
                         face, sim%particles%ps(p, f_pos:f_pos + 2, b), axis, x, area)
            k = find_backing(sim%backing, sim%particles%body(b), face)
            t%n = t%n + 1
            t%sink(t%n) = n_tools + sim%backing(k)%column_at(x) &
              + sum([(size(sim%backing(i)%column), i=1, k - 1)])
            t%group(t%n) = body%heat_group
            call point_nodes(patch%linear_place(x), patch%stride, 1, min_capacity, patch%nn, &
                             sim%nodes%g(:, :, body%heat_group), q, weight)
            t%node(:, t%n) = q(0)
            t%node(:8, t%n) = q
            t%weight(:, t%n) = 0.0_rp
            t%weight(:8, t%n) = weight
            t%surface_excess(t%n) = 0.0_rp
            t%conductance(t%n) = area*sum(weight) &
              *body%film(face)%coefficient_at(sum(weight*sim%nodes%g(5 + axis, q, body%heat_group)))
            t%total_conductance(t%sink(t%n)) = t%total_conductance(t%sink(t%n)) + t%conductance(t%n)
          end do
        end do
      end associate
    end do
  end subroutine list_faces

  !> Add the particles of block `b` in contact with tool `k`.
  subroutine list_block(sim, k, b, elapsed, sinks)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: k, b
    real(rp), intent(in) :: elapsed                    !! time since the last conduction step [s]
    type(sinks_t), intent(inout) :: sinks
    integer :: c, first(nlane), i, j, l, p
    real(rp) :: area, gap, half_spacing_resistance, normal(3), margin, w(nlane, 18)

    associate (t => sinks, tool => sim%tool(k), body => sim%particles%body(b), &
               mat => sim%scene%material(sim%scene%body(sim%particles%body(b))%material), &
               ps => sim%particles%ps(:, :, b))
      call weights_of(sim%scene, sim%nodes, body, sim%particles%nf, ps, w, first)
      do p = 1, sim%particles%count(b)
        if (ps(p, tool%heat%place) <= 0.0_rp) cycle
        t%n = t%n + 1
        c = 0
        do i = 1, 3
          do j = 1, 3
            do l = 1, 3
              c = c + 1
              t%node(c, t%n) = first(p) + (i - 1)*sim%nodes%patch%stride(1) &
                + (j - 1)*sim%nodes%patch%stride(2) + l - 1
              t%weight(c, t%n) = w(p, i)*w(p, 3 + j)*w(p, 6 + l)
            end do
          end do
        end do
        call tool%distance(ps(p, f_pos:f_pos + 2), gap, normal, margin)
        half_spacing_resistance = 0.5_rp*norm2(normal*sim%scene%spacing_of(body, ps(p, :))) &
          /mat%conductivity_at(ps(p, f_temp))
        area = ps(p, tool%heat%place)/elapsed
        t%sink(t%n) = k
        t%group(t%n) = sim%scene%body(body)%heat_group
        t%conductance(t%n) = area/(half_spacing_resistance + 1.0_rp/tool%heat%gap_coefficient)
        t%total_conductance(k) = t%total_conductance(k) + t%conductance(t%n)
        t%surface_excess(t%n) = ps(p, f_temp) &
          - sum(t%weight(:, t%n)*sim%nodes%g(5, t%node(:, t%n), t%group(t%n))) &
          + half_spacing_resistance*ps(p, tool%heat%place + 1)/(elapsed*area)
      end do
    end associate
  end subroutine list_block

  !> Collective. Subtract the heat flow into the sinks in `dt` at the temperatures in lane 4 from
  !> lane 5 of the second grid; add the conductances to lane 6.
  subroutine add_sink_fluxes(sim, dt, sinks)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                         !! time step [s]
    type(sinks_t), intent(inout) :: sinks
    real(rp) :: heat, surface(sinks%n)
    integer :: c, i

    if (.not. allocated(sinks%power)) return
    associate (t => sinks)
      t%power = 0.0_rp
      do i = 1, t%n
        surface(i) = t%surface_excess(i) &
          + sum(t%weight(:, i)*sim%nodes%g(4, t%node(:, i), t%group(i)))
        t%power(t%sink(i)) = t%power(t%sink(i)) + t%conductance(i)*surface(i)
      end do
      call sim%world%sum(t%power)
      t%power = (t%power - t%total_conductance*t%t_face0)/(1.0_rp &
                                                           + t%total_conductance*t%dt_face_dp)
      do i = 1, t%n
        associate (k => t%sink(i))
          heat = dt*t%conductance(i)*(surface(i) - t%t_face0(k) - t%dt_face_dp(k)*t%power(k))
        end associate
        associate (flux => sim%nodes%g2(:, :, t%group(i)))
          do c = 1, 27
            flux(5, t%node(c, i)) = flux(5, t%node(c, i)) - t%weight(c, i)*heat
            flux(6, t%node(c, i)) = flux(6, t%node(c, i)) + t%weight(c, i)*t%conductance(i)
          end do
        end associate
      end do
    end associate
  end subroutine add_sink_fluxes

  !> Advance the sinks by a conduction step and add their heat to the energy sums, on one rank.
  subroutine advance_sinks(sim, dt, sinks)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                         !! time step [s]
    type(sinks_t), intent(in) :: sinks
    integer :: i, k, sink

    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%heat%is_on) cycle
      call sim%tool(k)%heat%absorb(dt, sinks%power(k))
      if (sim%world%is_root()) sim%budget%sums(e_tool) = sim%budget%sums(e_tool) + dt*sinks%power(k)
    end do
    sink = size(sim%tool)
    do k = 1, size(sim%backing)
      do i = 1, size(sim%backing(k)%column)
        sink = sink + 1
        call sim%backing(k)%column(i)%absorb(dt, sinks%power(sink))
        if (sim%world%is_root()) sim%budget%sums(e_film) = sim%budget%sums(e_film) &
          + dt*sinks%power(sink)
      end do
    end do
  end subroutine advance_sinks

  !> Reset contact area and heat of the particles at the end of a conduction step.
  pure subroutine reset_contact_sums(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: k

    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%heat%is_on) cycle
      sim%particles%ps(:, sim%tool(k)%heat%place:sim%tool(k)%heat%place + 1, &
                       :sim%particles%nblk) = 0.0_rp
    end do
  end subroutine reset_contact_sums

end module heat_sinks
