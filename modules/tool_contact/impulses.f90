! SPDX-License-Identifier: MIT
!> Contact of material points with rigid analytic tools, within the step.
!>
!> With the velocities that the nodes would have without contact, a particle whose surface would be
!> inside the tool at the end of the step touches: its surface is to lose the velocity e along the
!> tool's normal. Velocities are those of the surface, and impulses act there, by the weights of a
!> face (mapping_faces): an even pressure and the stress that belongs to it cancel at every node,
!> and what sticks has the tool's velocity where it touches, not half a spacing farther out (how far
!> out, says tool_contact_surface). The impulse
!> m e/s goes to the nodes by these weights w; s = sum w c_i/m_i, c_i the mass of the touching
!> particles at node i, is the share of an even load that comes back to the particle, so that even
!> loads are carried exactly in one pass. Friction is limited at the nodes, where the
!> pressure of neighbouring particles is already averaged: by Coulomb's law and by the shear
!> strength of the material. With MUSL and USAVG, whose strains follow velocities mapped again from
!> the centres of particles, contact of elastic material happens at the centres: an impulse on the
!> light nodes outside would not reach the strain, and a bar that hits a tool would ring for long.
!>
!> At the edge of a tool the velocity of metal that flows jumps; on the grid it falls off over a
!> cell beyond the last particle that touches, so that the tool seems wider. Therefore material that
!> can flow is pushed less and less over a cell about a line a little inside an edge that stands
!> out, up to the pressure that metal bears there (tool_contact_limits); beyond, it is only held by
!> friction. Elastic material has no such jump and is pushed up to the edge (tests/verification,
!> punch_plane, punch_circle and punch_elastic; docs/method.md).
module tool_contact_impulses
  use base_kinds, only: nlane, rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: r_velocity, restore
  use contact_friction_table, only: of_nothing
  use contact_gap_law, only: stick_fraction, normal_velocity
  use contact_tool, only: rigid_t, tool_t
  use mapping_faces, only: surface_weights
  use mapping_nodes, only: least_inertia, least_mass, nodes_t
  use mapping_stability, only: wave_speed
  use mapping_weights, only: weights_of
  use particles_store, only: f_mass, f_pos, particles_t
  use state_blocks, only: blocks_t
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_usl
  use tool_contact_books, only: book_tool, give_heat
  use tool_contact_candidates, only: candidates_t
  use tool_contact_limits, only: limit_impulses
  use tool_contact_lists, only: tool_contact_t, add_values, n_values, returned, &
                                contact_particle_t, v_coulomb, v_hold, v_push, v_shear
  use tool_contact_surface, only: flatten, velocity_at
  use tool_contact_walls, only: book_walls, reflect_entries, note_held, restore_entries
  implicit none (type, external)
  private

  public :: find_contact, find_impulses, apply_impulses

  real(rp), parameter :: impulse_fraction = 0.7_rp        !! of the exact impulse: all of it is
                                                          !! noisier
  real(rp), parameter :: slop = 0.02_rp        !! zone where gaps close slowly [cells]
  real(rp), parameter :: relaxation = 60.0_rp        !! time in which they do: waves cross so many
                                                     !! cells
  real(rp), parameter :: relaxation_flow = 30.0_rp   !! in metal that flows, which does not rock on
                                                     !! its surface
  real(rp), parameter :: recovery_speed = 3.0e-3_rp      !! at which depth is lost in any case [wave
                                                         !! speeds]
  real(rp), parameter :: any_recovery_speed = huge(1.0_rp)   !! with true masses: limit loads are
                                                             !! more even then
  real(rp), parameter :: band = 3.01_rp        !! nodes that touching particles reach [cells]: no
                                               !! whole number, so that all ranks list the same
  real(rp), parameter :: least_returned = 1.0e-3_rp   !! of a load that must come back
  real(rp), parameter :: inset = 0.4_rp        !! from edges that stand out, of the line about which
                                               !! the
                                               !! push of metal that flows falls off [cells]
  real(rp), parameter :: fade = 0.75_rp        !! width in which it does [cells]

contains

  !> The particles of `group` that touch tool `k` in this step, and their masses at the nodes of
  !> this rank, to be summed over the ranks.
  subroutine find_contact(scene, clock, particles, blocks, nodes, boundary, contact, tool, k, &
                          group, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn)   !! velocity records of the group

    call list_nodes(scene, nodes, contact, tool, g)
    call note_held(scene, boundary, contact)
    call find_contact_particles(scene, clock, particles, blocks, nodes, contact, tool, k, group, &
                                dt, g)
    call add_masses(nodes, contact)
    call reflect_entries(scene, boundary, contact, 2, contact%mass)
  end subroutine find_contact

  !> Their impulses at the nodes of this rank, to be summed over the ranks.
  subroutine find_impulses(scene, clock, nodes, boundary, contact, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: g(8, nodes%patch%nn)

    call restore_entries(boundary, contact, 2, contact%mass)
    call add_impulses(scene, clock, nodes, contact, g)
    contact%own = contact%values
    call reflect_entries(scene, boundary, contact, n_values, contact%values)
  end subroutine find_impulses

  !> New velocities of the nodes; the books of the tool, and friction heat to the particles.
  subroutine apply_impulses(scene, clock, particles, nodes, boundary, contact, books, tool, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    type(books_t), intent(inout) :: books
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn)

    call push_nodes(scene, clock, nodes, boundary, contact, books, g)
    call restore(scene, nodes, boundary, r_velocity, g)
    call flatten(scene, particles, nodes, contact, dt, g)
    call book_tool(nodes, contact, tool%mean_motion(clock%time, dt), tool, g)
    call give_heat(particles, contact, tool%heat_fraction)
  end subroutine apply_impulses

  !> List the nodes with mass near the tool, or in the box around one that has ends: the same on all
  !> ranks that store them.
  subroutine list_nodes(scene, nodes, contact, tool, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: lower(3), upper(3), room, x(3)
    integer :: first, i, last, r
    logical :: is_bounded

    room = band*nodes%patch%h
    call tool%bounds(lower, upper)
    where (scene%grid%period > 0) lower = -huge(1.0_rp)
    where (scene%grid%period > 0) upper = huge(1.0_rp)
    is_bounded = all(abs([lower, upper]) < huge(1.0_rp))
    call contact%forget(nodes%patch%nn)
    do r = 1, nodes%n_ranges
      x = nodes%patch%position(nodes%range(1, r))
      if (any(x(1:2) < lower(1:2) - room) .or. any(x(1:2) > upper(1:2) + room)) cycle
      first = nodes%range(1, r)
      last = nodes%range(2, r)
      if (is_bounded) then                       ! a run goes up
        last = first + floor(min(real(last - first, rp), (upper(3) + room - x(3))/nodes%patch%h))
        first = first + ceiling(max(0.0_rp, (lower(3) - room - x(3))/nodes%patch%h))
      end if
      do i = first, last
        if (g(8, i) <= least_mass) cycle
        if (.not. is_bounded) then
          if (nearest_image(nodes, tool, nodes%patch%position(i)) >= room) cycle
        end if
        call contact%add_node(i)
      end do
    end do
    call contact%prepare()
  end subroutine list_nodes

  !> Distance of the tool from the image of `x` that is nearest to it [m].
  pure real(rp) function nearest_image(nodes, tool, x)
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: x(3)
    real(rp) :: d, length(3), n(3), room
    integer :: i, j, k, turns(3)

    length = nodes%patch%h*real(nodes%patch%period, rp)
    turns = merge(2, 0, nodes%patch%period > 0)
    nearest_image = huge(1.0_rp)
    do i = -turns(1), turns(1)
      do j = -turns(2), turns(2)
        do k = -turns(3), turns(3)
          call tool%distance(x + length*real([i, j, k], rp), d, n, room)
          nearest_image = min(nearest_image, d)
        end do
      end do
    end do
  end function nearest_image

  !> List the particles of a group whose surface would be inside the tool at the end of the step.
  subroutine find_contact_particles(scene, clock, particles, blocks, nodes, contact, tool, k, &
                                    group, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(candidates_t) :: near
    type(rigid_t) :: rigid
    integer :: b
    real(rp) :: moved, reach(size(scene%body)), displacement

    rigid = tool%mean_motion(clock%time, dt)
    ! no particle moves faster than the nodes; a distance changes by no more than the way
    displacement = dt*clock%max_speed + (0.01_rp + slop)*nodes%patch%h
    reach = [(displacement + 0.5_rp*norm2(scene%body(b)%spacing), b=1, size(reach))]
    moved = clock%displacement + tool%displacement()
    call near%init(scene%layout, tool%friction_table%of /= of_nothing)
    do b = 1, blocks%n_awake
      associate (body => particles%body(b))
        if (scene%body(body)%group /= group) cycle
        if (blocks%clearance(k, b) > reach(body) + moved) cycle
        if (near%n > 0 .and. near%body /= body) call list_contact_particles(scene, clock, nodes, &
            contact, tool, rigid, dt, &
            g, near)
        call gather_near(scene, clock, particles, nodes, contact, tool, rigid, b, &
                         particles%count(b), reach(body), &
                         displacement, dt, g, near)
      end associate
    end do
    if (near%n > 0) call list_contact_particles(scene, clock, nodes, contact, tool, rigid, dt, g, &
                                                near)
  end subroutine find_contact_particles

  !> The candidates of block `b`; whenever there is a block of them it is looked at.
  subroutine gather_near(scene, clock, particles, nodes, contact, tool, rigid, b, n, reach, &
                         displacement, dt, g, near)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    integer, intent(in) :: b, n
    real(rp), intent(in) :: reach               !! from the tool of centres that may touch [m]
    real(rp), intent(in) :: displacement                 !! by which a gap may close in the step [m]
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(candidates_t), intent(inout) :: near
    real(rp) :: d(n), gap, half, normal(3), room
    integer :: p

    associate (ps => particles%ps(:, :, b), spacing => scene%body(particles%body(b))%spacing)
      call tool%clearances(n, ps(:, f_pos:f_pos + 2), d)
      do p = 1, n
        if (d(p) > reach) cycle
        call tool%distance(ps(p, f_pos:f_pos + 2), gap, normal, room)
        half = 0.5_rp*ps(p, scene%layout%surface_offset)*norm2(normal*spacing)
        if (gap - half > displacement) cycle
        call near%add(particles, b, p, normal, half)
        if (near%n == nlane) call list_contact_particles(scene, clock, nodes, contact, tool, &
            rigid, dt, g, near)
      end do
    end associate
  end subroutine gather_near

  !> Those of the candidates that touch; no candidates are left.
  subroutine list_contact_particles(scene, clock, nodes, contact, tool, rigid, dt, g, near)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    type(candidates_t), intent(inout) :: near
    real(rp) :: w(nlane, 18), zone
    integer :: before, first(nlane), n, p, place(nlane)   ! of a touching particle among the
                                                          ! candidates
    type(contact_particle_t) :: particle
    logical :: at_surface

    before = contact%n
    particle%can_flow = allocated(scene%material(scene%body(near%body)%material)%flow)
    at_surface = scene%method%scheme == scheme_usl .or. particle%can_flow
    zone = merge(slop*nodes%patch%h, 0.0_rp, at_surface)
    call near%fill_up()
    call weights_of(scene, nodes, near%body, scene%layout%n, near%ps, w, first)
    do p = 1, near%n
      particle%block = near%block(p)
      particle%lane = near%lane(p)
      particle%half = near%half(p)
      particle%normal = near%normal(:, p)
      particle%first = first(p)
      particle%inner(:, 1) = w(p, 1:3)
      particle%inner(:, 2) = w(p, 4:6)
      particle%inner(:, 3) = w(p, 7:9)
      particle%w = particle%inner
      if (at_surface) particle%w = surface_weights(scene, nodes, near%body, particle%normal, &
                                                   near%ps(p, &
          scene%layout%surface_offset), p, scene%layout%n, near%ps, w, first)
      particle%mass = clock%mass_scaling*near%ps(p, f_mass)
      if (.not. approaches(clock, nodes, tool, rigid, dt, zone, near%ps(p, f_pos:f_pos + 2), &
                           velocity_at(nodes, &
          particle%first, particle%w, g), particle)) cycle
      call contact%add_particle_in_contact(particle)
      place(contact%n - before) = p
    end do
    n = contact%n - before
    call limit_impulses(scene, tool, dt, near, n, place, contact%particle(before + 1:before + n))
    near%n = 0
  end subroutine list_contact_particles

  !> Whether the surface of the particle at `x`, with velocity `v`, would be inside the tool at the
  !> end of the step or comes too fast through the soft zone; how fast it is to be, and its slip.
  logical function approaches(clock, nodes, tool, rigid, dt, zone, x, v, particle)
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt, zone, x(3), v(3)
    type(contact_particle_t), intent(inout) :: particle
    real(rp) :: gap, room, wave

    call tool%distance(x + dt*v, gap, particle%normal, room)
    gap = gap - particle%half
    approaches = gap < zone
    if (.not. approaches) return
    wave = wave_speed(clock)                 ! and no step: smaller ones give the same contact
    call normal_velocity(dt, clock%dt, zone, &
                         merge(relaxation_flow, relaxation, particle%can_flow)*nodes%patch%h/wave, &
              merge(recovery_speed*wave, any_recovery_speed, clock%mass_scaling > 1.0_rp), gap, &
              particle%normal, &
              v - rigid%velocity_at(x - particle%half*particle%normal + 0.5_rp*dt*v), &
              particle%closing, particle%slip)
    particle%friction = tool%friction
    approaches = particle%closing > 0.0_rp
    particle%pushed = 1.0_rp
    if (particle%can_flow) particle%pushed = max(0.0_rp, min(1.0_rp, 0.5_rp &
        + (room/nodes%patch%h - inset)/fade))
    if (particle%pushed <= 0.0_rp) particle%closing = 0.0_rp
  end function approaches

  !> Masses of the touching particles, and of what of them is pushed, at the nodes.
  subroutine add_masses(nodes, contact)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    real(rp) :: mass(2)
    integer :: i, p

    associate (contact => contact)
      do p = 1, contact%n
        associate (t => contact%particle(p))
          call contact%spread(nodes%patch%stride, t)
          mass = t%mass*[1.0_rp, merge(t%pushed, 0.0_rp, t%closing > 0.0_rp)]
          do i = 1, 27
            if (t%entry(i) == 0) cycle
            contact%mass(:, t%entry(i)) = contact%mass(:, t%entry(i)) + t%weight(i)*mass
          end do
        end associate
      end do
    end associate
  end subroutine add_masses

  !> Impulses of the touching particles at the nodes.
  subroutine add_impulses(scene, clock, nodes, contact, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: least, s(2), values(n_values)
    integer :: e, p

    least = least_inertia(scene, clock)
    associate (contact => contact)
      do e = 1, contact%n_nodes
        contact%mass(:, e) = contact%mass(:, e)/max(least, g(8, contact%node(e)))
      end do
      do p = 1, contact%n
        associate (t => contact%particle(p))
          s = max(least_returned, returned(t%entry, t%weight, t%normal**2, contact%n_nodes, &
                                        contact%free, contact%mass))
          t%hold = -t%mass/s(1)*t%slip
          values(v_push:v_push + 2) = min(impulse_fraction*t%pushed*t%mass/s(2)*t%closing, &
                                          t%most)*t%normal
          values(v_hold:v_hold + 2) = t%hold
          values(v_coulomb) = t%friction*norm2(values(v_push:v_push + 2))
          values(v_shear) = t%shear
          call add_values(t%entry, t%weight, values, contact%n_nodes, contact%values)
        end associate
      end do
    end associate
  end subroutine add_impulses

  !> New velocities of the listed nodes, as far as walls let them; what walls take of the impulse.
  subroutine push_nodes(scene, clock, nodes, boundary, contact, books, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    type(books_t), intent(inout) :: books
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp) :: jump(3), least
    integer :: e

    least = least_inertia(scene, clock)
    associate (t => contact)
      do e = 1, t%n_nodes
        t%part(e) = stick_fraction(t%values(v_hold:v_hold + 2, e), t%values(v_coulomb, e), &
                              t%values(v_shear, e))
        associate (record => g(:, t%node(e)))
          jump = t%free(:, e)/max(least, record(8))*(t%values(v_push:v_push + 2, e) &
                                         + t%part(e)*t%values(v_hold:v_hold + 2, e))
          record(1:3) = record(1:3) + jump
          record(5:7) = record(5:7) + jump
        end associate
      end do
    end associate
    call restore_entries(boundary, contact, 1, contact%part)
    call book_walls(scene, nodes, boundary, contact, books, g)
  end subroutine push_nodes

end module tool_contact_impulses
