! SPDX-License-Identifier: MIT
!> Contact of material points with rigid analytic tools, within the step.
!>
!> The particles that take part (tool_contact_particles) are to lose the velocity e along the tool's
!> normal. Velocities are those of the surface, and impulses act there, by the weights of a
!> face (mapping_faces): an even pressure and the stress that belongs to it cancel at every node,
!> and what sticks has the tool's velocity where it touches, not half a spacing farther out (how far
!> out, says tool_contact_particles).
!>
!> Impulses go to the nodes by these weights w; s = sum w c_i/m_i, c_i the mass of the touching
!> particles at node i, is the share of an even load that comes back to the particle. A step starts
!> from the force of the last one (`press`, a field of the particles): what that leaves of e, e',
!> takes m e'/s more, but nothing pulls. Even loads are carried exactly in one step and uneven
!> lasting ones after some, with no penetration: this is Jacobi's method for the equations of
!> contact, one iteration a step. It is stable, since with f/m as unknowns their matrix has no
!> negative entry or eigenvalue, and rows that sum to 1. What takes back depth acts once and is not
!> kept: position and force, both summed up over the steps, would pump each other. In the zone where
!> gaps close slowly, uneven parts of the force fade as fast as the gaps, which is what damps them.
!>
!> Friction is limited at the nodes, where the pressure of neighbouring particles is already
!> averaged: by Coulomb's law and by the shear strength of the material.
!>
!> With MUSL and USAVG, whose strains follow velocities mapped again from the centres of particles,
!> contact of elastic material happens at the centres: an impulse on the light nodes outside would
!> not reach the strain, and a bar that hits a tool would ring for long. There a step gives a part
!> of m e/s and forgets the last one.
!>
!> Coulomb's law is one of lasting forces, but the surface of metal chatters: a particle that rests
!> on the tool touches in a few of many steps. What friction could have given and did not is kept
!> for the time in which contact follows slow changes (`grip`, a field of the particles). Where
!> metal slides nothing is left to be kept.
module tool_contact_impulses
  use base_kinds, only: rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: r_velocity, restore
  use contact_law, only: friction_law_t
  use contact_tool, only: rigid_t, tool_t
  use mapping_nodes, only: least_inertia, least_mass, nodes_t
  use particles_store, only: particles_t
  use state_blocks, only: blocks_t
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_usl
  use tool_contact_books, only: book_tool, give_heat, strain_surface
  use tool_contact_limits, only: molten
  use tool_contact_lists, only: add_values, m_all, m_last, m_pushed, n_both, n_masses, n_values, &
                                returned, tool_contact_t, v_bend, v_coulomb, v_hold, v_push, &
                                v_shear
  use tool_contact_particles, only: find_contact_particles, relaxation_time, flatten
  use tool_contact_walls, only: book_walls, note_held, reflect_masses, reflect_values, &
                                restore_masses, restore_parts, judge_planes
  implicit none (type, external)
  private

  public :: find_contact, find_impulses, apply_impulses

  real(rp), parameter :: part_mapped_again = 0.7_rp   !! of an impulse where strains follow
                                                      !! velocities mapped again: all of it rings
  real(rp), parameter :: band = 3.51_rp        !! nodes that particles in contact reach [cells]: no
                                               !! whole number, so that all ranks list the same
  real(rp), parameter :: least_returned = 1.0e-3_rp   !! of a load that must come back

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

    call judge_planes(scene, tool%mean_motion(clock%time, dt), contact)
    call list_nodes(scene, nodes, contact, tool, g)
    call note_held(scene, boundary, contact)
    call find_contact_particles(scene, clock, particles, blocks, nodes, contact, tool, k, group, &
                                dt, g)
    call add_masses(nodes, contact, scene%method%scheme /= scheme_usl)
    call reflect_masses(scene, boundary, contact)
  end subroutine find_contact

  !> Their impulses at the nodes of this rank, to be summed over the ranks.
  subroutine find_impulses(scene, clock, nodes, boundary, contact, law, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn)

    call restore_masses(scene, boundary, contact)
    call add_impulses(scene, clock, nodes, contact, law, dt, g)
    contact%own = contact%values(:n_values, :)
    call reflect_values(scene, boundary, contact)
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
    type(rigid_t) :: rigid

    call push_nodes(scene, clock, tool%friction_law, nodes, boundary, contact, books, g)
    call restore(scene, nodes, boundary, r_velocity, g)
    call flatten(scene, particles, nodes, contact, dt, g)
    call keep_grip(scene, clock, particles, nodes, contact, tool%friction_law, dt)
    call strain_surface(scene, particles, contact, dt)
    rigid = tool%mean_motion(clock%time, dt)
    call book_tool(nodes, contact, rigid, tool, g)
    call give_heat(scene, particles, contact, rigid, dt, tool)
  end subroutine apply_impulses

  !> List the nodes with mass near the tool, or in the box around one that has ends: the same on all
  !> ranks that store them.
  subroutine list_nodes(scene, nodes, contact, tool, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: lower(3), upper(3), room(3), x(3)
    integer :: first, i, last, r
    logical :: is_bounded, z_is_graded

    room = band*nodes%patch%h
    z_is_graded = scene%grid%grading%axis == 3
    if (scene%grid%grading%axis > 0) room(scene%grid%grading%axis) = band*scene%grid%longest()
    call tool%bounds(lower, upper)
    where (scene%grid%period > 0) lower = -huge(1.0_rp)
    where (scene%grid%period > 0) upper = huge(1.0_rp)
    is_bounded = all(abs([lower, upper]) < huge(1.0_rp))
    call contact%forget(nodes%patch%nn)
    do r = 1, nodes%n_ranges
      x = nodes%patch%position(nodes%range(1, r))
      if (any(x(1:2) < lower(1:2) - room(1:2)) .or. any(x(1:2) > upper(1:2) + room(1:2))) cycle
      first = nodes%range(1, r)
      last = nodes%range(2, r)
      if (is_bounded .and. z_is_graded) then
        last = first + floor(min(real(last - first, rp), places_up(x(3), upper(3) + room(3))))
        first = first + ceiling(max(0.0_rp, places_up(x(3), lower(3) - room(3))))
      else if (is_bounded) then                  ! a run goes up
        last = first + floor(min(real(last - first, rp), (upper(3) + room(3) - x(3)) &
                                   /nodes%patch%h(3)))
        first = first + ceiling(max(0.0_rp, (lower(3) - room(3) - x(3)) &
                                            /nodes%patch%h(3)))
      end if
      do i = first, last
        if (g(8, i) <= least_mass) cycle
        if (.not. is_bounded) then
          if (nearest_image(nodes, tool, nodes%patch%position(i)) >= maxval(room)) cycle
        end if
        call contact%add_node(i)
      end do
    end do
    call contact%prepare()
  contains
    !> Nodes from the one at `z` up to `limit`.
    pure real(rp) function places_up(z, limit)
      real(rp), intent(in) :: z, limit       !! [m]

      associate (grading => scene%grid%grading)
        places_up = grading%place(limit) - grading%place(z)
      end associate
    end function places_up
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

  !> Masses of the particles in contact, of those that are pushed, and what the last step's forces
  !> would give, at the nodes.
  subroutine add_masses(nodes, contact, maps_again)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    logical, intent(in) :: maps_again          !! strains follow velocities mapped again
    real(rp) :: mass(n_masses)
    integer :: i, p

    associate (contact => contact)
      do p = 1, contact%n
        associate (t => contact%particle(p))
          call contact%spread(nodes%patch%stride, t)
          if (t%closing <= 0.0_rp .or. maps_again) t%pressed = 0.0_rp
          mass = 0.0_rp
          mass(m_all) = t%mass
          if (max(t%closing, t%keep_out) > 0.0_rp) mass(m_pushed) = t%mass
          mass(m_last:m_last + 2) = t%pressed*t%normal
          do i = 1, 27
            if (t%entry(i) == 0) cycle
            contact%mass(:, t%entry(i)) = contact%mass(:, t%entry(i)) + t%weight(i)*mass
          end do
        end associate
      end do
    end associate
  end subroutine add_masses

  !> Impulses of the particles in contact at the nodes.
  subroutine add_impulses(scene, clock, nodes, contact, law, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    real(rp) :: kept, least, part, push, s(3), values(n_values)
    integer :: e, p

    part = merge(1.0_rp, part_mapped_again, scene%method%scheme == scheme_usl)
    least = least_inertia(scene, clock)
    associate (contact => contact)
      do e = 1, contact%n_nodes
        contact%mass(:, e) = contact%mass(:, e)/max(least, g(8, contact%node(e)))
      end do
      do p = 1, contact%n
        associate (t => contact%particle(p))
          s = returned(t%entry, t%weight, t%normal, contact%n_nodes, contact%free, contact%mass)
          s(:2) = max(least_returned, s(:2))
          t%hold = 0.0_rp                            ! molten metal holds nothing
          if (t%shear > molten) t%hold = -t%mass/s(1)*t%slip
          push = part*t%mass/s(2)
          t%lasting = 0.0_rp
          if (t%closing > 0.0_rp) then
            kept = 1.0_rp
            if (t%closing <= t%approach) kept = exp(-dt/relaxation_time(clock, t))
            t%lasting = min(t%most, max(0.0_rp, kept*(t%pressed - push*s(3)) + push*t%approach))
            t%pressed = max(0.0_rp, t%pressed + push*(t%closing - s(3)))
          end if
          t%pressed = max(min(t%pressed, t%most), push*t%keep_out)
          values(v_push:v_push + 2) = t%pressed*t%normal
          values(v_hold:v_hold + 2) = t%hold
          if (law%keeps_mean()) then
            kept = exp(-dt/relaxation_time(clock, t))
            t%coulomb = kept*dt*t%coulomb &
                        + (1.0_rp - kept)*t%friction*t%pressed
          else
            t%coulomb = t%coulomb + t%friction*t%pressed
          end if
          values(v_coulomb) = t%coulomb
          values(v_shear) = t%shear
          values(v_bend) = t%bend
          call add_values(t%entry, t%weight, values, contact%width, contact%n_nodes, contact%values)
        end associate
      end do
    end associate
  end subroutine add_impulses

  !> New velocities of the listed nodes, as far as walls let them; what walls take of the impulse.
  subroutine push_nodes(scene, clock, law, nodes, boundary, contact, books, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(friction_law_t), intent(in) :: law
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    type(books_t), intent(inout) :: books
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp) :: impulse(3), jump(3), least
    integer :: e

    least = least_inertia(scene, clock)
    associate (t => contact)
      do e = 1, t%n_nodes
        t%part(e) = friction_part(law, t%values(:n_values, e))
        impulse = t%values(v_push:v_push + 2, e) + t%part(e)*t%values(v_hold:v_hold + 2, e)
        if (t%width > n_values) then
          associate (behind => t%values(n_values + 1:n_both, e))
            t%part_behind(e) = friction_part(law, behind)
            impulse = impulse + behind(v_push:v_push + 2) &
                      + t%part_behind(e)*behind(v_hold:v_hold + 2)
          end associate
        end if
        associate (record => g(:, t%node(e)))
          jump = t%free(:, e)/max(least, record(8))*impulse
          record(1:3) = record(1:3) + jump
          record(5:7) = record(5:7) + jump
        end associate
      end do
    end associate
    call restore_parts(scene, boundary, contact)
    do e = 1, contact%n_nodes
      contact%unspent(e) = 0.0_rp
      associate (values => contact%values(:, e))
        if (values(v_coulomb) > 0.0_rp) contact%unspent(e) = max(0.0_rp, 1.0_rp &
            - contact%part(e)*norm2(values(v_hold:v_hold + 2))/values(v_coulomb))
      end associate
    end do
    call book_walls(scene, nodes, boundary, contact, books, g)
  end subroutine push_nodes

  !> The part of what would hold a node that friction can give.
  pure real(rp) function friction_part(law, values)
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: values(n_values)

    friction_part = law%friction(values(v_hold:v_hold + 2), values(v_coulomb), values(v_shear), &
                                 values(v_bend))
  end function friction_part

  !> What Coulomb's law would have let friction give and it did not, is kept for a relaxation time;
  !> a law that goes by the mean pressure keeps that, as the force of friction it is good for.
  subroutine keep_grip(scene, clock, particles, nodes, contact, law, dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(in) :: contact
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: dt                 !! [s]
    real(rp) :: unspent
    integer :: i, p

    do p = 1, contact%n
      associate (t => contact%particle(p))
        unspent = 0.0_rp
        do i = 1, 27
          if (t%entry(i) > 0) unspent = unspent + t%weight(i)*contact%unspent(t%entry(i))
        end do
        associate (grip => particles%ps(t%lane, scene%layout%grip, t%block))
          grip = t%coulomb*unspent*exp(-dt/relaxation_time(clock, t))
          if (law%keeps_mean()) grip = t%coulomb/dt
        end associate
        particles%ps(t%lane, scene%layout%press, t%block) = t%lasting/dt
      end associate
    end do
  end subroutine keep_grip

end module tool_contact_impulses
