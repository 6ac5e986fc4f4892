! SPDX-License-Identifier: MIT
!> Contact of particles with rigid analytic tools in a step.
!>
!> Particles in contact (contact_tool_particles) are to lose the closing velocity e along the tool
!> normal. Velocities are those of the particle surface, and impulses act there, with the weights of
!> a face (mpm_faces): a uniform pressure and the corresponding stress cancel at every node, and
!> sticking material has the tool velocity at the point of contact instead of half a spacing away.
!>
!> Impulses are distributed to the nodes by these weights w; s = sum w c_i/m_i, with c_i the mass of
!> the touching particles at node i, is the fraction of a uniform load that returns to the particle.
!> A step starts from the force of the last one (`layout%normal_force`, a particle field); the
!> remainder e' of e takes m e'/s more, without tension. Uniform loads are carried exactly in one
!> step and non-uniform sustained ones after some steps, without penetration: this is Jacobi's
!> method for the contact equations, with one iteration per step. It is stable, since with f/m as
!> unknowns their matrix has no negative entry or eigenvalue, and rows that sum to 1. The impulse
!> that removes penetration acts once and is not kept: integrating both position and force over the
!> steps would add energy. In the zone where gaps close slowly, non-uniform parts of the force decay
!> as fast as the gaps, which damps them.
!>
!> Friction starts from that of the last step as well: without it a non-uniform shear, such as that
!> of a bar in torsion that sticks to the tool, would fall to nothing, since one iteration stops
!> only a uniform slip.
!>
!> Friction is limited at the nodes, where the pressure of neighbouring particles is averaged: by
!> Coulomb's law and by the shear strength of the material.
!>
!> Coulomb's law applies to sustained forces, but contact of single particles is intermittent: a
!> particle resting on the tool touches it in only a part of the steps. Unused Coulomb friction is
!> kept for the relaxation time of contact (`layout%coulomb_reserve`, a particle field). Where metal
!> slides, none is left.
module contact_tool_impulses
  use base_kinds, only: rp
  use boundary_symmetry, only: r_velocity, restore
  use contact_tool_limits, only: find_sliding_limits, molten_limit
  use contact_tool_loads, only: record_tool_load, give_heat, strain_surface
  use contact_tool_particles, only: find_contact_particles, relaxation_time, update_surface_offset
  use contact_tool_walls, only: record_wall_impulse, mark_held, reflect_masses, reflect_values, &
                                restore_masses, restore_fractions, find_separate_sides
  use particles_store, only: particles_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_nodes, only: min_node_inertia, min_node_mass, nodes_t
  use state_scene, only: scene_t
  use state_tool_lists, only: add_values, impulse_of, load_return, m_last_impulse, m_pushed, &
                                   m_touching, n_both, n_masses, n_values, tool_contact_t, &
                                   v_coulomb, v_max_friction, v_normal, v_stick, v_transition
  use tools_law, only: friction_law_t, of_slip
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)
  private

  public :: find_contact, find_impulses, apply_impulses

  !> Distance from the tool up to which nodes are listed [cells]. It is no integer, so that rounding
  !> does not decide and all ranks list the same nodes.
  real(rp), parameter :: band = 3.51_rp
  !> Lower bound of the load-return factor, so that no division is by zero.
  real(rp), parameter :: min_load_return = 1.0e-3_rp

contains

  !> Find the particles of `group` that touch tool `k` in this step, and their masses at the nodes
  !> of this rank, to be summed over the ranks.
  subroutine find_contact(scene, clock, tools, particles, nodes, contact, k, group, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt                    !! time step [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn)   !! velocity records of the group

    call find_separate_sides(scene, contact, tools(k)%mean_motion(clock%time, dt))
    call list_nodes(scene, nodes, contact, tools(k), g)
    call mark_held(scene, nodes, contact)
    call find_contact_particles(scene, clock, tools, particles, nodes, contact, k, group, dt, g)
    call add_masses(nodes, contact)
    call reflect_masses(scene, contact)
  end subroutine find_contact

  !> Compute the impulses of tool `k` at the nodes of this rank, to be summed over the ranks.
  subroutine find_impulses(scene, clock, nodes, contact, tool, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: dt                 !! time step [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn)

    call restore_masses(scene, contact)
    call add_impulses(scene, clock, nodes, contact, tool, dt, g)
    contact%local_values = contact%values(:n_values, :)
    call reflect_values(scene, contact)
  end subroutine find_impulses

  !> Apply the impulses of tool `k`: nodal velocities, sums of the tool, and friction heat to the
  !> particles.
  subroutine apply_impulses(scene, clock, particles, nodes, contact, budget, tool, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(budget_t), intent(inout) :: budget
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: dt                 !! time step [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    type(rigid_t) :: rigid

    call push_nodes(scene, clock, nodes, contact, budget, tool%friction_law, g)
    call restore(scene, nodes, r_velocity, g)
    call update_surface_offset(scene, particles, nodes, contact, dt, g)
    call store_contact_history(scene, clock, particles, contact, tool%friction_law, dt)
    call strain_surface(scene, particles, contact, dt)
    rigid = tool%mean_motion(clock%time, dt)
    call record_tool_load(nodes, contact, rigid, tool, g)
    call give_heat(scene, particles, contact, rigid, dt, tool)
  end subroutine apply_impulses

  !> List the nodes with mass near the tool, or in the bounding box of a finite one: the same on all
  !> ranks that store them.
  subroutine list_nodes(scene, nodes, contact, tool, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: lower(3), upper(3), margin(3), x(3)
    integer :: first, i, last, r
    logical :: is_bounded

    margin = band*scene%grid%longest_edges()
    call tool%bounds(lower, upper)
    where (scene%grid%period > 0) lower = -huge(1.0_rp)
    where (scene%grid%period > 0) upper = huge(1.0_rp)
    is_bounded = all(abs([lower, upper]) < huge(1.0_rp))
    call contact%reset(nodes%patch%nn)
    do r = 1, nodes%n_ranges
      x = nodes%patch%position(nodes%range(1, r))
      if (any(x(1:2) < lower(1:2) - margin(1:2)) .or. any(x(1:2) > upper(1:2) + margin(1:2))) cycle
      first = nodes%range(1, r)
      last = nodes%range(2, r)
      if (is_bounded .and. scene%grid%grading(3)%is_graded) then
        last = first + floor(min(real(last - first, rp), nodes_up_to(x(3), upper(3) + margin(3))))
        first = first + ceiling(max(0.0_rp, nodes_up_to(x(3), lower(3) - margin(3))))
      else if (is_bounded) then                  ! nodes of a run ascend in z
        last = first &
          + floor(min(real(last - first, rp), (upper(3) + margin(3) - x(3))/nodes%patch%h(3)))
        first = first + ceiling(max(0.0_rp, (lower(3) - margin(3) - x(3))/nodes%patch%h(3)))
      end if
      do i = first, last
        if (g(8, i) <= min_node_mass) cycle
        if (.not. is_bounded) then
          if (image_distance(nodes, tool, nodes%patch%position(i)) >= maxval(margin)) cycle
        end if
        call contact%add_node(i)
      end do
    end do
    call contact%prepare()
  contains
    !> Number of nodes from the one at `z` up to `limit`.
    pure real(rp) function nodes_up_to(z, limit)
      real(rp), intent(in) :: z, limit       !! height of the node, largest height [m]

      associate (grading => scene%grid%grading(3))
        nodes_up_to = grading%place(limit) - grading%place(z)
      end associate
    end function nodes_up_to
  end subroutine list_nodes

  !> Distance of the tool from the nearest periodic image of `x` [m].
  pure real(rp) function image_distance(nodes, tool, x)
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: x(3)
    real(rp) :: length(3)
    integer :: i, j, k, turns(3)

    length = nodes%patch%h*real(nodes%patch%period, rp)
    turns = merge(2, 0, nodes%patch%period > 0)
    image_distance = huge(1.0_rp)
    do i = -turns(1), turns(1)
      do j = -turns(2), turns(2)
        do k = -turns(3), turns(3)
          image_distance = min(image_distance, tool%clearance(x + length*real([i, j, k], rp)))
        end do
      end do
    end do
  end function image_distance

  !> Sum at the nodes the masses of the particles in contact, the masses of the pushed ones, and the
  !> impulses by the forces of the last step.
  subroutine add_masses(nodes, contact)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    real(rp) :: mass(n_masses)
    integer :: i, p

    do p = 1, contact%n
      associate (t => contact%particle(p))
        call contact%find_nodes(nodes%patch%stride, t)
        if (t%closing_velocity <= 0.0_rp) t%normal_impulse = 0.0_rp
        mass = 0.0_rp
        mass(m_touching) = t%mass
        if (max(t%closing_velocity, t%edge_closing_velocity) > 0.0_rp) mass(m_pushed) = t%mass
        mass(m_last_impulse:m_last_impulse + 2) = t%normal_impulse*t%normal + t%last_friction
        do i = 1, 27
          if (t%entry(i) == 0) cycle
          contact%mass(:, t%entry(i)) = contact%mass(:, t%entry(i)) + t%weight(i)*mass
        end do
      end associate
    end do
  end subroutine add_masses

  !> Sum the impulses of the particles in contact at the nodes.
  subroutine add_impulses(scene, clock, nodes, contact, tool, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    real(rp) :: counted, kept, lasting, least, push, returned, s(5), slip(3), values(n_values)
    integer :: e, p

    least = min_node_inertia(scene, clock)
    do e = 1, contact%n_nodes
      contact%mass(:, e) = contact%mass(:, e)/max(least, g(8, contact%node(e)))
    end do
    do p = 1, contact%n
      associate (t => contact%particle(p))
        s = load_return(t%entry, t%weight, t%normal, contact%n_nodes, contact%free_direction, &
                        contact%mass)
        s(:2) = max(min_load_return, s(:2))
        t%stick_impulse = 0.0_rp                            ! no friction on molten metal
        returned = dot_product(s(3:), t%normal)
        slip = t%slip + s(3:) - returned*t%normal
        if (t%max_friction > molten_limit) t%stick_impulse = t%last_friction - t%mass/s(1)*slip
        push = t%mass/s(2)
        t%lasting_impulse = 0.0_rp
        if (t%closing_velocity > 0.0_rp) then
          kept = 1.0_rp
          if (t%closing_velocity <= t%approach_velocity) then
            kept = exp(-dt/relaxation_time(clock, t))
          end if
          lasting = kept*(t%normal_impulse - push*returned) + push*t%approach_velocity
          t%lasting_impulse = min(t%max_normal_impulse, max(0.0_rp, lasting))
          t%normal_impulse = max(0.0_rp, t%normal_impulse + push*(t%closing_velocity - returned))
        end if
        t%normal_impulse = min(t%normal_impulse, t%max_normal_impulse)
        t%normal_impulse = max(t%normal_impulse, push*t%edge_closing_velocity)
        values(v_normal:v_normal + 2) = t%normal_impulse*t%normal
        values(v_stick:v_stick + 2) = t%stick_impulse
        counted = 1.0_rp
        if (tool%friction_law%uses_mean_pressure()) then
          kept = exp(-dt/relaxation_time(clock, t))
          counted = 1.0_rp - kept
          t%coulomb_impulse = kept*dt*t%coulomb_impulse
        end if
        if (tool%friction_table%of == of_slip) then
          call find_sliding_limits(tool, t%coulomb_impulse, counted, &
                                   norm2(t%stick_impulse)*s(1)/t%mass, t)
        end if
        t%coulomb_impulse = t%coulomb_impulse + counted*t%coulomb_factor*t%normal_impulse
        if (t%max_friction <= molten_limit) t%coulomb_impulse = 0.0_rp
        values(v_coulomb) = t%coulomb_impulse
        values(v_max_friction) = t%max_friction
        values(v_transition) = t%transition
        call add_values(t%entry, t%weight, values, contact%width, contact%n_nodes, contact%values)
      end associate
    end do
  end subroutine add_impulses

  !> Apply the impulses to the listed nodes, as far as walls allow, and record the impulses taken by
  !> walls.
  subroutine push_nodes(scene, clock, nodes, contact, budget, law, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(budget_t), intent(inout) :: budget
    type(friction_law_t), intent(in) :: law
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp) :: impulse(3), jump(3), least
    integer :: e

    least = min_node_inertia(scene, clock)
    associate (t => contact)
      do e = 1, t%n_nodes
        associate (front => t%values(:n_values, e), fraction => t%friction_fraction(e))
          fraction = friction_fraction_of(law, front)
          impulse = impulse_of(front, fraction)
        end associate
        if (t%width > n_values) then
          associate (behind => t%values(n_values + 1:n_both, e))
            t%friction_fraction_behind(e) = friction_fraction_of(law, behind)
            impulse = impulse + behind(v_normal:v_normal + 2) &
                      + t%friction_fraction_behind(e)*behind(v_stick:v_stick + 2)
          end associate
        end if
        associate (record => g(:, t%node(e)))
          jump = t%free_direction(:, e)/max(least, record(8))*impulse
          record(1:3) = record(1:3) + jump
          record(5:7) = record(5:7) + jump
        end associate
      end do
    end associate
    call restore_fractions(scene, contact)
    do e = 1, contact%n_nodes
      contact%coulomb_unused(e) = 0.0_rp
      associate (values => contact%values(:, e))
        if (values(v_coulomb) > 0.0_rp) contact%coulomb_unused(e) = max(0.0_rp, 1.0_rp &
          - contact%friction_fraction(e)*norm2(values(v_stick:v_stick + 2))/values(v_coulomb))
      end associate
    end do
    call record_wall_impulse(scene, nodes, contact, budget, g)
  end subroutine push_nodes

  !> Fraction of the stick impulse of a node that friction provides.
  pure real(rp) function friction_fraction_of(law, values)
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: values(n_values)

    friction_fraction_of = law%friction(values(v_stick:v_stick + 2), values(v_coulomb), &
                                 values(v_max_friction), values(v_transition))
  end function friction_fraction_of

  !> Store the contact history of the particles: the unused Coulomb friction, which decays with the
  !> relaxation time, or, for a law that uses the mean pressure, the mean Coulomb force; and the
  !> sustained normal force.
  subroutine store_contact_history(scene, clock, particles, contact, law, dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(in) :: contact
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: dt                 !! time step [s]
    real(rp) :: used, unused
    integer :: i, p

    do p = 1, contact%n
      associate (t => contact%particle(p))
        unused = 0.0_rp
        used = 0.0_rp
        do i = 1, 27
          if (t%entry(i) == 0) cycle
          unused = unused + t%weight(i)*contact%coulomb_unused(t%entry(i))
          used = used + t%weight(i)*contact%friction_fraction(t%entry(i))
        end do
        associate (reserve => particles%ps(t%lane, scene%layout%coulomb_reserve, t%block))
          reserve = t%coulomb_impulse*unused*exp(-dt/relaxation_time(clock, t))
          if (law%uses_mean_pressure()) reserve = t%coulomb_impulse/dt
        end associate
        associate (force => scene%layout%tool_force)
          particles%ps(t%lane, force:force + 2, t%block) = (t%lasting_impulse*t%normal &
                                                            + used*t%stick_impulse)/dt
        end associate
      end associate
    end do
  end subroutine store_contact_history

end module contact_tool_impulses
