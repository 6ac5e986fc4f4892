! SPDX-License-Identifier: MIT
!> What a tool feels and spends in a step, and what the particles at it get: the friction heat, and
!> the strain of the layer that shears under its face, which the cells do not resolve and the state
!> of the flow law follows.
module tool_contact_books
  use base_kinds, only: nlane, rp
  use contact_tool, only: rigid_t, s_area, s_faster, s_face_heat, s_layer, s_layer_work, &
                          s_motion, s_sliding, s_strength, s_thickness, s_to_plate, tool_t
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_heat, f_plastic, f_pos, f_temp, particles_t
  use physics_flow_law, only: n_work
  use state_scene, only: scene_t
  use tool_contact_limits, only: slow_down
  use tool_contact_lists, only: contact_particle_t, tool_contact_t, v_coulomb, &
                                v_hold, v_push, v_shear
  implicit none (type, external)
  private

  public :: book_tool, give_heat, strain_surface

contains

  !> Force, torque, work and heat of a tool, of this rank's particles; exact at the nodes, since the
  !> weights carry a rigid motion exactly.
  subroutine book_tool(nodes, contact, rigid, tool, g)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(rigid_t), intent(in) :: rigid
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: mean(3), x(3)
    integer :: e

    associate (t => contact)
      do e = 1, t%n_nodes
        if (.not. t%own(v_shear, e) > 0.0_rp) cycle     ! none of its particles touches
        x = nodes%patch%position(t%node(e))
        mean = g(1:3, t%node(e)) - 0.5_rp*g(5:7, t%node(e))
        t%slip(:, e) = mean - rigid%velocity_at(x)
        call tool%book_impulse(rigid, x, t%own(v_push:v_push + 2, e), &
                               t%part(e)*t%own(v_hold:v_hold + 2, e), mean)
      end do
    end associate
  end subroutine book_tool

  !> The friction heat to the particles whose friction it is: the tool's share of it goes into the
  !> body, of what the metal sheared as much as becomes heat of its plastic work. Where there is a
  !> layer, the books of the face. A tool that takes heat gets to know of the area that is covered.
  subroutine give_heat(scene, particles, contact, rigid, dt, tool)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(in) :: contact
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt                 !! [s]
    type(tool_t), intent(inout) :: tool
    real(rp) :: heat, mean(3), share, stored, work
    integer :: i, p

    do p = 1, contact%n
      associate (t => contact%particle(p))
        mean = 0.0_rp
        do i = 1, 27
          if (t%entry(i) == 0) cycle
          mean = mean + t%weight(i)*contact%slip(:, t%entry(i))
        end do
        work = work_of(contact, t)
        if (t%used > 0.0_rp) then
          call book_face(t, rigid, dt, particles%ps(t%lane, f_pos:f_pos + 2, t%block), &
                         particles%ps(t%lane, f_temp, t%block), mean, work, tool)
        end if
        associate (material => scene%material(scene%body(particles%body(t%block))%material))
          stored = t%plastic_part*(1.0_rp - material%plastic_heat)
          share = tool%heat_share(material%effusivity(particles%ps(t%lane, f_temp, t%block)))
        end associate
        heat = share*(1.0_rp - stored)*work
        particles%ps(t%lane, f_heat, t%block) = particles%ps(t%lane, f_heat, t%block) + heat
        tool%sums(s_to_plate) = tool%sums(s_to_plate) + heat
        if (.not. tool%heat%is_on) cycle
        associate (at_tool => particles%ps(t%lane, tool%heat%place:tool%heat%place + 1, t%block))
          at_tool = at_tool + [dt*product(t%spacing)/norm2(t%normal*t%spacing), heat]
        end associate
      end associate
    end do
  end subroutine give_heat

  !> Work of friction of a particle [J]: of that of its nodes the part that it gives of what limits
  !> friction there, the strength of metal or what Coulomb's law lets it give. If it went by what
  !> would hold the particles, molten metal would get as much heat as solid metal beside it. Across
  !> mirrors it does: there nodes do not have the sum of what would hold the particles.
  pure real(rp) function work_of(contact, t) result(work)
    type(tool_contact_t), intent(in) :: contact
    type(contact_particle_t), intent(in) :: t
    real(rp) :: hold(3), part
    integer :: e, i

    work = 0.0_rp
    do i = 1, 27
      e = t%entry(i)
      if (e == 0) cycle
      associate (values => contact%values(:, e))
        if (values(v_shear) < values(v_coulomb)) then
          part = t%weight(i)*t%shear/values(v_shear)
        else
          part = t%weight(i)*t%coulomb/max(values(v_coulomb), tiny(1.0_rp))
        end if
        hold = t%weight(i)*t%hold
        where (.not. contact%is_folded(:, e)) hold = part*values(v_hold:v_hold + 2)
        work = work - contact%part(e)*dot_product(hold, contact%slip(:, e))
      end associate
    end do
  end function work_of

  !> What the face of a tool has on a particle with a layer that shears: area and, times that,
  !> temperature, strength, thickness of the layer, slip by shear and by sliding; its work.
  pure subroutine book_face(t, rigid, dt, x, temp, slip, work, tool)
    type(contact_particle_t), intent(in) :: t
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt, x(3), temp     !! [s], [m], [K]
    real(rp), intent(in) :: slip(3)            !! mean of the step [m/s]
    real(rp), intent(in) :: work               !! of friction [J]
    type(tool_t), intent(inout) :: tool
    real(rp) :: area, sliding, surface(3)

    area = t%face*dt
    sliding = norm2(slip - dot_product(slip, t%normal)*t%normal)
    surface = rigid%velocity_at(x - t%half*t%normal)
    surface = surface - dot_product(surface, t%normal)*t%normal
    associate (s => tool%sums)
      s(s_area) = s(s_area) + area
      s(s_face_heat) = s(s_face_heat) + area*(temp + t%rise)
      s(s_strength) = s(s_strength) + t%strength
      s(s_thickness) = s(s_thickness) + area*t%thickness
      s(s_layer) = s(s_layer) + area*t%plastic_part*sliding
      s(s_sliding) = s(s_sliding) + area*(1.0_rp - t%plastic_part)*sliding
      s(s_motion) = s(s_motion) + area*norm2(surface)
      s(s_layer_work) = s(s_layer_work) + t%plastic_part*work
      s(s_faster) = s(s_faster) + area*t%faster
    end associate
    tool%hottest = max(tool%hottest, temp + t%rise)
  end subroutine book_face

  !> Strain the particles of the layer by what it shears at their centres in `dt` beyond their own
  !> rate. At nodes where friction is less than the layer's strength, by Coulomb's law or because
  !> the metal sticks, it shears by so much less as its sensitivity says.
  subroutine strain_surface(scene, particles, contact, dt)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: dt                 !! [s]
    integer :: at(nlane), body, n, p
    real(rp) :: log_rate(nlane), slower, x(nlane)

    n = 0
    body = 0
    do p = 1, contact%n
      associate (t => contact%particle(p))
        if (t%depth <= 0.0_rp) cycle
        if (n == nlane .or. (n > 0 .and. particles%body(t%block) /= body)) then
          call strain_particles(scene, particles, contact, body, n, at, x, log_rate)
          n = 0
        end if
        body = particles%body(t%block)
        n = n + 1
        at(n) = p
        call slow_down(used_strength(contact, p), norm2(t%normal*t%spacing), t, slower)
        log_rate(n) = t%log_rate + slower
        x(n) = dt*max(0.0_rp, exp(log_rate(n)) - t%resolved_rate)
      end associate
    end do
    if (n > 0) call strain_particles(scene, particles, contact, body, n, at, x, log_rate)
  end subroutine strain_surface

  !> Friction at the nodes of the `p`-th particle in contact over the most that its law gives there,
  !> times that over the strength of the layer.
  pure real(rp) function used_strength(contact, p) result(used)
    type(tool_contact_t), intent(in) :: contact
    integer, intent(in) :: p
    integer :: i

    used = 0.0_rp
    associate (t => contact%particle(p))
      do i = 1, 27
        if (t%entry(i) == 0) cycle
        associate (values => contact%values(:, t%entry(i)))
          used = used + t%weight(i)*contact%part(t%entry(i)) &
                 *norm2(values(v_hold:v_hold + 2))/max(values(v_shear), tiny(1.0_rp))
        end associate
      end do
      used = min(1.0_rp, used*t%shear/t%strength)
    end associate
  end function used_strength

  !> Plastic strain `x` at exp(log_rate) of `n` particles in contact, at places `at` of their list.
  subroutine strain_particles(scene, particles, contact, body, n, at, x, log_rate)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(in) :: contact
    integer, intent(in) :: body, n, at(nlane)
    real(rp), intent(inout) :: x(nlane), log_rate(nlane)
    real(rp) :: state(nlane, scene%layout%n_law), temp(nlane), work(nlane, n_work)
    integer :: i

    associate (flow => scene%material(scene%body(body)%material)%flow, layout => scene%layout)
      x(n + 1:) = 0.0_rp
      log_rate(n + 1:) = log_rate(1)
      temp = 0.0_rp
      do i = 1, n
        associate (t => contact%particle(at(i)))
          associate (ps => particles%ps(t%lane, :, t%block))
            ps(f_plastic) = ps(f_plastic) + x(i)
            temp(i) = ps(f_temp)
            state(i, :) = ps(layout%law:layout%law + layout%n_law - 1)
          end associate
        end associate
      end do
      if (layout%n_law == 0) return
      temp(n + 1:) = temp(1)
      state(n + 1:, :) = spread(state(1, :), 1, nlane - n)
      call flow%prepare(temp, state, work)
      call flow%advance(work, x, log_rate, state)
      do i = 1, n
        associate (t => contact%particle(at(i)))
          particles%ps(t%lane, layout%law:layout%law + layout%n_law - 1, t%block) = state(i, :)
        end associate
      end do
    end associate
  end subroutine strain_particles

end module tool_contact_books
