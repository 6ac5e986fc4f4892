! SPDX-License-Identifier: MIT
!> Particles that take part in contact with a tool in a step. A particle touches if its surface
!> would be inside the tool at the end of the step, with the nodal velocities without contact. A
!> particle nearer than half a spacing takes part in friction, touching or not: the tool face is
!> covered by the supporting surface, not only by the particles that touch in this step.
!>
!> At the edge of a tool the velocity of flowing metal is discontinuous; on the grid it decreases
!> over a cell beyond the last held particle, so that the tool would act half a cell wider. There
!> the tool covers a fraction of a particle's weight function. Material that can flow is pushed with
!> that fraction of the pressure that metal bears at an edge (contact_tool_limits), and may stay
!> inside the tool by the complementary fraction of its size; deeper particles are pushed without
!> limit. Elastic material has no such discontinuity and is pushed up to the edge
!> (tests/verification, groove, punch_plane, punch_circle and punch_elastic; docs/method.md).
!>
!> The surface of a particle is half a spacing from its centre at first and is a point of the
!> material: while a tool presses on it, the layer of metal between them becomes thinner with the
!> nodal velocities (the surface offset, a particle field). A constant surface offset would keep
!> flattened metal off the tool: the foot of a Taylor bar was 8 % wider, and an elastic rod of eight
!> cells 3 % too stiff.
module contact_tool_particles
  use base_kinds, only: nlane, rp
  use contact_tool_limits, only: cut_at_edges, limit_impulses, covered_fraction_of
  use grid_geometry, only: length_along
  use mpm_blocks, only: weights_of
  use mpm_faces, only: surface_weights
  use mpm_stability, only: contact_relaxation, wave_speed
  use particles_block, only: block_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_rate, particles_t
  use state_clock, only: clock_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use state_tool_lists, only: candidates_t, contact_particle_t, tool_contact_t
  use tools_law, only: find_closing_velocity, of_nothing
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: find_contact_particles, update_surface_offset, relaxation_time, velocity_at

  real(rp), parameter :: slop = 0.02_rp  !! width of the zone where gaps close slowly [cells]
  !> Largest speed of removing a penetration [wave speeds].
  real(rp), parameter :: recovery_speed = 3.0e-3_rp
  real(rp), parameter :: friction_distance = 0.5_rp  !! largest gap with friction [spacings]

contains

  !> Find the particles of a group whose surface would be inside the tool at the end of the step.
  subroutine find_contact_particles(scene, clock, tools, particles, nodes, contact, k, group, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(candidates_t) :: near
    integer :: b
    real(rp) :: moved, reach(size(scene%body))

    call near%init(scene%layout, tools(k)%friction_table%of /= of_nothing)
    near%tool = k
    near%rigid = tools(k)%mean_motion(clock%time, dt)
    ! Bound of the displacement: no particle is faster than the nodes, and a distance changes by at
    ! most the displacement.
    near%displacement = dt*clock%max_speed + (0.01_rp + slop)*scene%grid%longest()
    reach = near%displacement + (0.5_rp + friction_distance) &
            *[(scene%body(b)%longest_diagonal(), b=1, size(reach))]
    moved = clock%displacement + tools(k)%displacement()
    do b = 1, particles%n_awake
      associate (body => particles%body(b))
        if (scene%body(body)%group /= group) cycle
        if (particles%clearance(k, b) > reach(body) + moved) cycle
        if (near%n > 0 .and. near%body /= body) then
          call list_contact_particles(scene, clock, tools, nodes, contact, dt, g, near)
        end if
        call gather_near(scene, clock, tools, particles, nodes, contact, b, reach(body), dt, g, &
                         near)
      end associate
    end do
    if (near%n > 0) call list_contact_particles(scene, clock, tools, nodes, contact, dt, g, near)
  end subroutine find_contact_particles

  !> Gather the candidates of block `b`; a full list is processed at once.
  subroutine gather_near(scene, clock, tools, particles, nodes, contact, b, reach, dt, g, near)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    integer, intent(in) :: b
    !> Largest distance of touching particle centres from the tool [m].
    real(rp), intent(in) :: reach
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(candidates_t), intent(inout) :: near
    real(rp), parameter :: rounding = 1.0_rp + 1.0e-9_rp
    real(rp) :: cutoff, d(nlane), gap, half, normal(3), edge_distance, spacing(3)
    integer :: p

    associate (ps => particles%ps(:, :, b), n => particles%count(b), tool => tools(near%tool))
      call tool%clearances(n, ps(:, f_pos:f_pos + 2), reach, d, is_bound=.true.)
      do p = 1, n
        spacing = scene%spacing_of(particles%body(b), ps(p, :))
        cutoff = near%displacement + rounding*(0.5_rp*ps(p, scene%layout%surface_offset) &
                                               + friction_distance)*maxval(spacing)
        if (d(p) > cutoff) cycle
        call tool%distance(ps(p, f_pos:f_pos + 2), gap, normal, edge_distance, cutoff, 0.0_rp)
        if (gap > cutoff) cycle
        half = 0.5_rp*ps(p, scene%layout%surface_offset)*extent(spacing, normal, edge_distance)
        if (gap - half > near%displacement + friction_distance*norm2(normal*spacing)) cycle
        call near%add(particles, b, p, normal, half)
        if (near%n == nlane) call list_contact_particles(scene, clock, tools, nodes, contact, dt, &
                                                         g, near)
      end do
    end associate
  end subroutine gather_near

  !> Extent of a particle along the normal of a tool [m]. A surface touches the ellipsoid of the
  !> particle at its outermost point along the normal, an edge (`edge_distance` is not positive)
  !> where the normal intersects it.
  pure real(rp) function extent(spacing, normal, edge_distance)
    real(rp), intent(in) :: spacing(3)                !! axes of the ellipsoid [m]
    real(rp), intent(in) :: normal(3), edge_distance  !! unit vector; distance to the edge [m]

    extent = norm2(normal*spacing)
    if (edge_distance > 0.0_rp .or. all(abs(spacing - spacing(1)) <= 0.0_rp)) return
    extent = 1.0_rp/norm2(normal/spacing)
  end function extent

  !> List the candidates that take part in contact, and empty the list of candidates.
  subroutine list_contact_particles(scene, clock, tools, nodes, contact, dt, g, near)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(candidates_t), intent(inout), target :: near
    real(rp) :: edge, force(3), friction_zone, size, zone
    integer :: before, p
    type(block_t) :: block
    type(contact_particle_t) :: particle

    before = contact%n
    particle%can_flow = allocated(scene%material(scene%body(near%body)%material)%flow)
    associate (tool => tools(near%tool))
      friction_zone = merge(friction_distance, 0.0_rp, tool%has_friction() .or. tool%heat%is_on)
    end associate
    call near%pad_lanes()
    block%body = near%body
    block%n = near%n
    block%ps => near%ps
    call weights_of(scene, nodes, block)
    if (.not. particle%can_flow) then
      call cut_at_edges(scene, tools, nodes, near, block%first, block%w)
    end if
    do p = 1, near%n
      particle%candidate = p
      particle%block = near%block(p)
      particle%lane = near%lane(p)
      particle%surface_distance = near%surface_distance(p)
      particle%normal = near%normal(:, p)
      particle%first = block%first(p)
      particle%w_centre = reshape(block%w(p, 1:9), [3, 3])
      particle%w = surface_weights(scene, nodes, block, particle%normal, &
                                   near%ps(p, scene%layout%surface_offset), p)
      particle%mass = clock%mass_scaling*near%ps(p, f_mass)
      particle%coulomb_impulse = near%ps(p, scene%layout%coulomb_reserve)
      particle%spacing = scene%spacing_of(near%body, near%ps(p, :))
      particle%cell_edges = nodes%patch%edges_at(near%ps(p, f_pos:f_pos + 2))
      size = norm2(particle%normal*particle%spacing)
      edge = length_along(particle%cell_edges, particle%normal)
      zone = slop*edge
      if (.not. takes_part(scene, clock, tools(near%tool), near, dt, zone, friction_zone*size, &
                           near%ps(p, f_pos:f_pos + 2), &
                           velocity_at(nodes, particle%first, particle%w, g), particle)) cycle
      force = near%ps(p, scene%layout%tool_force:scene%layout%tool_force + 2)
      particle%normal_impulse = dt*dot_product(force, particle%normal)
      particle%last_friction = 0.0_rp   ! metal that flows slips at the strength that it has now
      if (near%ps(p, f_rate) <= 0.0_rp) particle%last_friction = dt*force &
        - particle%normal_impulse*particle%normal
      particle%normal_impulse = max(0.0_rp, particle%normal_impulse)
      call contact%add_particle_in_contact(particle)
    end do
    call limit_impulses(scene, tools(near%tool), dt, near, contact%particle(before + 1:contact%n))
    near%n = 0
  end subroutine list_contact_particles

  !> True if a particle at `x`, with surface velocity `v`, takes part in contact: the surface would
  !> be inside the tool at the end of the step, approaches too fast in the slow zone, or is within
  !> the friction zone. Sets its closing velocity, slip and covered fraction.
  logical function takes_part(scene, clock, tool, near, dt, zone, friction_zone, x, v, particle)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool
    type(candidates_t), intent(in) :: near
    real(rp), intent(in) :: dt     !! time step [s]
    real(rp), intent(in) :: x(3)   !! position of the particle [m]
    real(rp), intent(in) :: v(3)   !! velocity of its surface [m/s]
    real(rp), intent(in) :: zone            !! distance from the tool within which it touches [m]
    real(rp), intent(in) :: friction_zone   !! distance within which it has friction [m]
    type(contact_particle_t), intent(inout) :: particle
    real(rp) :: back, gap, relative(3), edge_distance, time, unused(3)

    call tool%distance(x + dt*v, gap, particle%normal, edge_distance, &
                       edge_cutoff=2.0_rp*maxval(particle%cell_edges))
    gap = gap - particle%surface_distance
    takes_part = gap < max(zone, friction_zone)
    if (.not. takes_part) return
    relative = v - near%rigid%velocity_at(x - particle%surface_distance*particle%normal &
                                          + 0.5_rp*dt*v)
    ! Independent of the step size: smaller steps give the same contact.
    time = relaxation_time(clock, particle)
    back = recovery_speed*wave_speed(clock)
    call find_closing_velocity(dt, clock%dt, zone, time, back, gap, particle%normal, relative, &
                               particle%closing_velocity, particle%slip, particle%approach_velocity)
    particle%gap_impulse = dt*particle%mass*wave_speed(clock)**2*max(0.0_rp, gap) &
                           /(norm2(particle%normal*particle%spacing) &
                             *length_along(particle%cell_edges, particle%normal))
    particle%coulomb_factor = tool%friction_coefficient
    particle%touches = gap < zone .and. particle%closing_velocity > 0.0_rp
    takes_part = particle%touches .or. gap < friction_zone
    particle%covered_fraction = 1.0_rp
    if (particle%can_flow) particle%covered_fraction = covered_fraction_of(tool, &
      scene%method%is_bspline, x + dt*v, edge_distance, particle)
    particle%edge_closing_velocity = 0.0_rp
    gap = gap + (1.0_rp - particle%covered_fraction)*norm2(particle%normal*particle%spacing)
    if (particle%covered_fraction < 1.0_rp .and. gap < zone) then
      call find_closing_velocity(dt, clock%dt, zone, time, back, gap, particle%normal, relative, &
                                 particle%edge_closing_velocity, unused)
    end if
    if (particle%covered_fraction <= 0.0_rp &
        .or. .not. particle%touches) particle%closing_velocity = 0.0_rp
  end function takes_part

  !> Relaxation time in which contact follows slow changes of gaps and forces [s].
  pure real(rp) function relaxation_time(clock, particle)
    type(clock_t), intent(in) :: clock
    type(contact_particle_t), intent(in) :: particle

    relaxation_time = contact_relaxation(clock, length_along(particle%cell_edges, particle%normal))
  end function relaxation_time

  !> Nodal velocity at the centre or at the surface of a particle [m/s].
  pure function velocity_at(nodes, first, w, g) result(v)
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: first                !! index of the first of 27 nodes
    real(rp), intent(in) :: w(3, 3), g(8, nodes%patch%nn)
    real(rp) :: v(3)
    integer :: i, j, k, q

    v = 0.0_rp
    do i = 1, 3
      do j = 1, 3
        q = first + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) - 1
        do k = 1, 3
          v = v + w(i, 1)*w(j, 2)*w(k, 3)*g(1:3, q + k)
        end do
      end do
    end do
  end function velocity_at

  !> Update the surface offset of touching particles after contact. Where metal flows, the layer
  !> between centre and surface follows the nodal velocities; in elastic material its thickness
  !> follows from the strain of the particle, so that no drift accumulates over many contacts.
  subroutine update_surface_offset(scene, particles, nodes, contact, dt, g)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(in) :: contact
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    real(rp) :: bbar(6), jac
    integer :: p

    do p = 1, contact%n
      associate (t => contact%particle(p))
        if (.not. t%touches) cycle
        ! Copies: gfortran passes sections of an associate name wrongly.
        bbar = particles%ps(t%lane, f_bbar:f_bbar + 5, t%block)
        jac = particles%ps(t%lane, f_jac, t%block)
        associate (offset => particles%ps(t%lane, scene%layout%surface_offset, t%block))
          if (t%can_flow) then
            offset = min(1.0_rp, offset*exp(dt*normal_strain_rate(nodes, t, g)))
          else
            offset = min(1.0_rp, thickness(bbar, jac, t%normal))
          end if
        end associate
      end associate
    end do
  end subroutine update_surface_offset

  !> Strain rate along the normal between the centre of a particle and its surface [1/s].
  pure real(rp) function normal_strain_rate(nodes, particle, g)
    type(nodes_t), intent(in) :: nodes
    type(contact_particle_t), intent(in) :: particle
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: apart(3)
    integer :: c, i, j, k, q

    apart = 0.0_rp
    c = 0
    associate (w => particle%w_centre)
      do i = 1, 3
        do j = 1, 3
          q = particle%first + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) - 1
          do k = 1, 3
            c = c + 1
            apart = apart + (w(i, 1)*w(j, 2)*w(k, 3) - particle%weight(c))*g(1:3, q + k)
          end do
        end do
      end do
    end associate
    normal_strain_rate = dot_product(particle%normal, apart)/particle%surface_distance
  end function normal_strain_rate

  !> Thickness of a material layer with the `normal` n over that without strain: sqrt(n b n), with
  !> the left Cauchy-Green tensor b.
  pure real(rp) function thickness(bbar, jac, normal)
    real(rp), intent(in) :: bbar(6)              !! isochoric part of b: xx, yy, zz, xy, yz, zx
    real(rp), intent(in) :: jac                  !! volume ratio
    real(rp), intent(in) :: normal(3)

    associate (n => normal)
      thickness = jac**(1.0_rp/3.0_rp)*sqrt(bbar(1)*n(1)**2 + bbar(2)*n(2)**2 + bbar(3)*n(3)**2 &
                  + 2.0_rp*(bbar(4)*n(1)*n(2) + bbar(5)*n(2)*n(3) + bbar(6)*n(3)*n(1)))
    end associate
  end function thickness

end module contact_tool_particles
