! SPDX-License-Identifier: MIT
!> Loads and energies of a tool in a step, and the effects on the particles in contact: friction
!> heat, and the strain of the layer that shears under the face. Cells do not resolve this layer,
!> but the internal variables of the flow law follow its strain.
module contact_tool_loads
  use base_kinds, only: nlane, rp
  use contact_tool_limits, only: depth_ratio, log_cosh_of, min_softening, no_limit, root3
  use particles_store, only: f_heat, f_mass, f_plastic, f_pos, f_temp, particles_t
  use physics_flow_law, only: n_work
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use state_tool_lists, only: contact_particle_t, tool_contact_t, v_coulomb, v_max_friction, &
                                   v_normal, v_stick
  use tools_sums, only: s_area, s_early, s_excess_speed, s_face_temperature, s_layer_slip, &
                        s_layer_strength, s_layer_thickness, s_layer_work, s_surface_slip, &
                        s_surface_speed, s_to_plate
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)
  private

  public :: record_tool_load, give_heat, reduce_layer_rate, strain_surface

contains

  !> Record force, torque, work and heat of a tool, from this rank's particles; exact at the nodes,
  !> since the weights reproduce a rigid motion exactly.
  subroutine record_tool_load(nodes, contact, rigid, tool, g)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(rigid_t), intent(in) :: rigid
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: mean(3), normal(3), x(3)
    integer :: e

    associate (t => contact)
      do e = 1, t%n_nodes
        if (.not. t%local_values(v_max_friction, e) > 0.0_rp) cycle  ! no particle of the node
                                                                     ! touches
        x = nodes%patch%position(t%node(e))
        mean = g(1:3, t%node(e)) - 0.5_rp*g(5:7, t%node(e))
        t%slip(:, e) = mean - rigid%velocity_at(x)
        normal = t%values(v_normal:v_normal + 2, e)
        normal = normal/max(norm2(normal), tiny(1.0_rp))
        call tool%record_impulse(rigid, x, normal, t%local_values(v_normal:v_normal + 2, e), &
                               t%friction_fraction(e)*t%local_values(v_stick:v_stick + 2, e), mean)
      end do
    end associate
  end subroutine record_tool_load

  !> Give the friction heat to the particles at which it arises: the body's share of it, and of the
  !> heat by shear of the layer the fraction of plastic work that becomes heat. Record the sums of
  !> the face where there is a layer. For a tool that absorbs heat, add up the area in contact.
  subroutine give_heat(scene, particles, contact, rigid, dt, tool)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(in) :: contact
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt                 !! time step [s]
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
        tool%sums(s_early) = tool%sums(s_early) + min(t%lasting_impulse, t%gap_impulse)
        if (t%strength_used > 0.0_rp) then
          call record_face(t, rigid, dt, particles%ps(t%lane, f_pos:f_pos + 2, t%block), &
                         particles%ps(t%lane, f_temp, t%block), mean, work, tool)
        end if
        associate (material => scene%material(scene%body(particles%body(t%block))%material), &
                   ps => particles%ps(t%lane, :, t%block))
          stored = t%plastic_fraction*(1.0_rp - material%plastic_heat)
          share = tool%heat_share(material%effusivity(ps(f_temp)))
          heat = share*(1.0_rp - stored)*work
          ps(f_heat) = ps(f_heat) + heat
          particles%warming = max(particles%warming, ps(f_heat)/(ps(f_mass)*material%c_p))
        end associate
        tool%sums(s_to_plate) = tool%sums(s_to_plate) + heat
        if (.not. tool%heat%is_on) cycle
        associate (at_tool => particles%ps(t%lane, tool%heat%place:tool%heat%place + 1, t%block))
          at_tool = at_tool + [dt*product(t%spacing)/norm2(t%normal*t%spacing), heat]
        end associate
      end associate
    end do
  end subroutine give_heat

  !> Work of friction of a particle [J]: its share of the nodal work, by its part of the strength of
  !> the metal there, or of the Coulomb friction where no strength limits it. Shares by the stick
  !> impulse or by pressure would give molten metal as much heat as solid metal beside it. Across
  !> mirrors, shares by the stick impulse are used: the nodes there do not have the sum of the stick
  !> impulses.
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
        if (values(v_max_friction) < epsilon(1.0_rp)*no_limit) then
          part = t%weight(i)*t%max_friction/max(values(v_max_friction), tiny(1.0_rp))
        else
          part = t%weight(i)*t%coulomb_impulse/max(values(v_coulomb), tiny(1.0_rp))
        end if
        hold = t%weight(i)*t%stick_impulse
        where (.not. contact%is_folded(:, e)) hold = part*values(v_stick:v_stick + 2)
        work = work - contact%friction_fraction(e)*dot_product(hold, contact%slip(:, e))
      end associate
    end do
  end function work_of

  !> Record the sums of the face on a particle with a shear layer: area and, weighted by area,
  !> temperature, strength, layer thickness, slip by shear and by sliding; work of the layer.
  pure subroutine record_face(t, rigid, dt, x, temp, slip, work, tool)
    type(contact_particle_t), intent(in) :: t
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt     !! time step [s]
    real(rp), intent(in) :: x(3)   !! position [m]
    real(rp), intent(in) :: temp   !! temperature of the particle [K]
    real(rp), intent(in) :: slip(3)            !! mean slip velocity of the step [m/s]
    real(rp), intent(in) :: work               !! friction work [J]
    type(tool_t), intent(inout) :: tool
    real(rp) :: area, sliding, surface(3)

    area = t%face_area*dt
    sliding = norm2(slip - dot_product(slip, t%normal)*t%normal)
    surface = rigid%velocity_at(x - t%surface_distance*t%normal)
    surface = surface - dot_product(surface, t%normal)*t%normal
    associate (s => tool%sums)
      s(s_area) = s(s_area) + area
      s(s_face_temperature) = s(s_face_temperature) + area*(temp + t%temperature_rise)
      s(s_layer_strength) = s(s_layer_strength) + t%layer_strength
      s(s_layer_thickness) = s(s_layer_thickness) + area*t%layer_thickness
      s(s_layer_slip) = s(s_layer_slip) + area*t%plastic_fraction*sliding
      s(s_surface_slip) = s(s_surface_slip) + area*(1.0_rp - t%plastic_fraction)*sliding
      s(s_surface_speed) = s(s_surface_speed) + area*norm2(surface)
      s(s_layer_work) = s(s_layer_work) + t%plastic_fraction*work
      s(s_excess_speed) = s(s_excess_speed) + area*t%excess_velocity
    end associate
    tool%max_face_temperature = max(tool%max_face_temperature, temp + t%temperature_rise)
  end subroutine record_face

  !> Strain the particles of the layer by the shear at their centres in `dt` beyond their own strain
  !> rate. At nodes where friction is below the strength of the layer, by Coulomb's law or because
  !> the metal sticks, the shear rate is reduced according to the rate sensitivity.
  subroutine strain_surface(scene, particles, contact, dt)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: dt                 !! time step [s]
    integer :: at(nlane), body, n, p
    real(rp) :: log_rate(nlane), log_rate_reduction, x(nlane)

    n = 0
    body = 0
    do p = 1, contact%n
      associate (t => contact%particle(p))
        if (t%layer_depth <= 0.0_rp) cycle
        if (n == nlane .or. (n > 0 .and. particles%body(t%block) /= body)) then
          call strain_particles(scene, particles, contact, body, n, at, x, log_rate)
          n = 0
        end if
        body = particles%body(t%block)
        n = n + 1
        at(n) = p
        call reduce_layer_rate(used_strength(contact, p), norm2(t%normal*t%spacing), t, &
                               log_rate_reduction)
        log_rate(n) = t%log_rate + log_rate_reduction
        x(n) = dt*max(0.0_rp, exp(log_rate(n)) - t%resolved_rate)
      end associate
    end do
    if (n > 0) call strain_particles(scene, particles, contact, body, n, at, x, log_rate)
  end subroutine strain_surface

  !> Fraction of the layer strength used by friction at the nodes of the `p`-th particle in contact.
  pure real(rp) function used_strength(contact, p) result(used)
    type(tool_contact_t), intent(in) :: contact
    integer, intent(in) :: p
    integer :: i

    used = 0.0_rp
    associate (t => contact%particle(p))
      do i = 1, 27
        if (t%entry(i) == 0) cycle
        associate (values => contact%values(:, t%entry(i)))
          used = used + t%weight(i)*contact%friction_fraction(t%entry(i)) &
                 *norm2(values(v_stick:v_stick + 2))/max(values(v_max_friction), tiny(1.0_rp))
        end associate
      end do
      used = min(1.0_rp, used*t%max_friction/t%layer_strength)
    end associate
  end function used_strength

  !> Add the plastic strain `x` at the rate exp(log_rate) to `n` particles in contact, at the
  !> positions `at` of their list.
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

  !> Reduce the rate of the layer of a particle where friction uses only the fraction `used` of its
  !> strength: the logarithm of the rate is lower by `log_rate_reduction`; the remaining slip is
  !> sliding.
  !>
  !> The metal of the layer moves faster than the particle centre, by V (1 - ln cosh x/(x tanh x))
  !> in the mean from the centre to the face, of which the grid resolves half of the particle's own
  !> shear. It is averaged over the particle, `spacing` wide, whose part below the centre moves with
  !> the grid.
  elemental subroutine reduce_layer_rate(used, spacing, t, log_rate_reduction)
    real(rp), intent(in) :: used, spacing     !! [-], width along the normal [m]
    type(contact_particle_t), intent(inout) :: t
    real(rp), intent(out) :: log_rate_reduction
    real(rp) :: m, mean, resolved, slip, speed, x

    t%strength_used = used
    log_rate_reduction = (used - 1.0_rp)/t%rate_sensitivity
    slip = norm2(t%slip)
    resolved = root3*t%resolved_rate*t%layer_depth
    speed = exp(log_rate_reduction)*(slip + resolved)
    t%plastic_fraction = 0.0_rp
    if (slip > 0.0_rp) t%plastic_fraction = max(0.0_rp, (speed - resolved)/slip)
    m = t%softening*used*exp(log_rate_reduction)
    if (m < min_softening) then              ! uniform shear
      mean = 0.5_rp
      t%layer_thickness = t%layer_depth
      if (t%softening < min_softening) then
        t%temperature_rise = t%temperature_rise*used*exp(log_rate_reduction)
      else
        t%temperature_rise = t%temperature_rise*0.5_rp*m/log_cosh_of(depth_ratio(t%softening))
      end if
    else
      x = depth_ratio(m)
      mean = 1.0_rp - log_cosh_of(x)/m
      t%layer_thickness = t%layer_depth*tanh(x)/x
      t%temperature_rise = t%temperature_rise*log_cosh_of(x)/log_cosh_of(depth_ratio(t%softening))
    end if
    t%excess_velocity = max(0.0_rp, mean*speed - 0.5_rp*resolved)*t%layer_depth/(t%layer_depth &
                                                                                 + 0.5_rp*spacing)
  end subroutine reduce_layer_rate

end module contact_tool_loads
