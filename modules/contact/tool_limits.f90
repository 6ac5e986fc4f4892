! SPDX-License-Identifier: MIT
!> Limits of the impulses of particles that touch a tool: edges of the tool, strength of the
!> material, and the friction law of the tool.
!>
!> Shear layer of metal under the face of a tool, as far as the cells do not resolve it.
!>
!> Between a face that moves at V relative to the metal at depth z1, the centre of the particles
!> there, the shear stress tau is uniform over the depth and heat flows inwards. With a law of
!> sensitivity S = d tau/d ln(rate) and softening a = -(d tau/d T)/S, steady conduction k T" = -q
!> tau rate, q the fraction of plastic work that becomes heat, has the solution (insulated face,
!> depth z)
!>
!>   rate = rate_s sech2(z/l),  T = T_s - (2/a) ln cosh(z/l),  l2 = 2 k/(a q tau rate_s)
!>
!> so that V = rate_s l tanh(z1/l): with x = z1/l, x tanh x = a q tau V z1/(2 k). Conduction and
!> softening determine the thickness of the layer (l = 2 k/(a q tau V) if it is thinner than z1),
!> not the particle size. V is the slip against the surface velocity plus the shear of the metal
!> itself down to z1; with cell refinement x and all unresolved parts tend to 0.
module contact_tool_limits
  use base_kinds, only: nlane, pi, rp
  use grid_geometry, only: length_along
  use mpm_faces, only: place_on_axis, scale_by_spans
  use particles_store, only: f_heat, f_jac, f_mass, f_plastic, f_pos, f_rate, f_tau, f_temp
  use physics_flow_law, only: softening_from
  use physics_material, only: material_t
  use physics_stress, only: compute_flow_strength
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use state_tool_lists, only: candidates_t, contact_particle_t
  use tools_law, only: friction_law_t, friction_table_t, law_coulomb, of_nothing
  use tools_mesh_facets, only: cross
  use tools_tool, only: tool_t
  use transfer_weights, only: domain_weights
  implicit none (type, external)
  private

  public :: cut_at_edges, covered_fraction_of
  public :: find_sliding_limits, limit_impulses
  public :: depth_ratio, find_shear_layer, limit_beyond_strength, log_cosh_of, shear_layer_t

  !> Shear layers of the particles of a block.
  type :: shear_layer_t
    real(rp) :: stress(nlane) = 0.0_rp       !! stress at which the layer accommodates all of V [Pa]
    real(rp) :: sensitivity(nlane) = 0.0_rp  !! derivative of the stress by ln(rate) [Pa]
    real(rp) :: log_rate(nlane) = 0.0_rp     !! plastic strain rate at the particle centre [ln 1/s]
    real(rp) :: rise(nlane) = 0.0_rp         !! face temperature less that of the centre [K]
    real(rp) :: thickness(nlane) = 0.0_rp    !! V over the shear rate at the face [m]
    real(rp) :: softening(nlane) = 0.0_rp    !! x tanh x; 0: uniform layer
  end type shear_layer_t

  real(rp), parameter, public :: root3 = sqrt(3.0_rp)
  real(rp), parameter :: min_rise = 1.0_rp  !! smallest increment of the temperature derivative [K]
  real(rp), parameter, public :: min_softening = 1.0e-4_rp  !! x tanh x of a non-uniform layer
  real(rp), parameter, public :: no_limit = 1.0e30_rp  !! impulse bound of elastic material [N s]
  real(rp), parameter, public :: molten_limit = 1.0e-30_rp  !! impulse bound of molten metal [N s]
  real(rp), parameter :: min_sensitivity = 1.0e-3_rp        !! bound of d ln(stress)/d ln(rate)
  !> Bearing pressure of an edge over shear strength.
  real(rp), parameter :: edge_pressure = 2.0_rp + pi

contains

  !> Fraction of the weight function of a particle at `x` that the tool covers, at `edge_distance`
  !> from the next edge of the tool. Lengths are measured in cells, across the edge.
  real(rp) function covered_fraction_of(tool, is_bspline, x, edge_distance, particle) result(part)
    type(tool_t), intent(in) :: tool
    logical, intent(in) :: is_bspline            !! domains are cells
    real(rp), intent(in) :: x(3), edge_distance  !! particle position, distance to the edge [m]
    type(contact_particle_t), intent(in) :: particle
    real(rp) :: slope(3), width

    associate (h => particle%cell_edges, spacing => particle%spacing)
      width = 1.0_rp
      if (.not. is_bspline) width = maxval(spacing/h)
      part = fraction_inside(width, edge_distance/maxval(h))
      if (all(abs(h - h(1)) <= 0.0_rp) .and. &
          (is_bspline .or. all(abs(spacing - spacing(1)) <= 0.0_rp))) return
      if (abs(edge_distance) >= 2.0_rp*maxval(h)) return
      slope = edge_gradient(tool, x, particle%normal, edge_distance, h)
      if (.not. norm2(slope) > 0.0_rp) return
      if (.not. is_bspline) width = norm2(slope*spacing)/length_along(h, slope)
      part = fraction_inside(width, edge_distance/length_along(h, slope))
    end associate
  end function covered_fraction_of

  !> Fraction of a particle's weight function inside an edge at `edge_distance` (negative: the
  !> particle is beyond it). The function is a hat of a cell averaged over the domain: one half on
  !> the edge, 1 a cell and half a domain inside.
  elemental real(rp) function fraction_inside(width, edge_distance) result(part)
    real(rp), intent(in) :: width          !! width of the domain: a cell for B-splines [cells]
    real(rp), intent(in) :: edge_distance  !! [cells]

    real(rp) :: x

    x = max(-2.0_rp, min(2.0_rp, edge_distance))         ! no domain is wider than a cell
    part = (hat_integral2(x + 0.5_rp*width) - hat_integral2(x - 0.5_rp*width))/width
    part = max(0.0_rp, min(1.0_rp, part))
  contains
    !> Second integral of the hat function, from -infinity.
    elemental real(rp) function hat_integral2(x)
      real(rp), intent(in) :: x
      real(rp) :: r

      r = max(-1.0_rp, min(1.0_rp, x))
      hat_integral2 = max(0.0_rp, x - 1.0_rp) + 1.0_rp/6.0_rp + 0.5_rp*(r + r*r) - abs(r)**3/6.0_rp
    end function hat_integral2
  end function fraction_inside

  !> Replace the weights `w` of candidates at an edge by those of the covered part of their domains:
  !> a pressure on the whole domain would act beyond the edge, as if the tool were wider by a fifth
  !> of a cell.
  subroutine cut_at_edges(scene, tools, nodes, near, first, w)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(nodes_t), intent(in) :: nodes
    type(candidates_t), intent(in) :: near
    integer, intent(in) :: first(nlane)
    real(rp), intent(inout) :: w(nlane, 18)
    real(rp) :: cut(3), d, h(3), half(3), edge_distance, n(3), row(3), slope(3), x(3)
    integer :: a, p

    do p = 1, near%n
      x = near%ps(p, f_pos:f_pos + 2)
      h = nodes%patch%edges_at(x)
      half = scene%domain(near%body)
      if (scene%layout%half > 0) half = near%ps(p, scene%layout%half:scene%layout%half + 2)
      call tools(near%tool)%distance(x, d, n, edge_distance, edge_cutoff=norm2(half*h))
      if (edge_distance >= norm2(half*h)) cycle
      slope = edge_gradient(tools(near%tool), x, near%normal(:, p), edge_distance, h)
      cut = min(half, max(0.0_rp, norm2(slope*half*h) - max(0.0_rp, edge_distance))*abs(slope)/h)
      do a = 1, 3
        if (cut(a) <= 0.0_rp) cycle
        row = domain_weights(place_on_axis(nodes, a, x, first(p)) + sign(0.5_rp*cut(a), slope(a)), &
                             half(a) - 0.5_rp*cut(a))
        call scale_by_spans(nodes%patch, a, first(p), row)
        w(p, 3*a - 2:3*a) = row
      end do
    end do
  end subroutine cut_at_edges

  !> Unit vector along the surface with `normal` in which the distance to the next edge,
  !> `edge_distance` at `x`, grows fastest; 0 if it is constant.
  function edge_gradient(tool, x, normal, edge_distance, h) result(slope)
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: x(3), normal(3)
    real(rp), intent(in) :: edge_distance, h(3)  !! distance to the edge, edges of the cell [m]
    real(rp) :: slope(3)
    real(rp), parameter :: small = 1.0e-6_rp     !! step of the finite difference [cells]
    real(rp) :: along(3, 2), d, n(3), other
    integer :: a

    along(:, 1) = 0.0_rp
    along(minloc(abs(normal), 1), 1) = 1.0_rp
    along(:, 1) = along(:, 1) - dot_product(along(:, 1), normal)*normal
    along(:, 1) = along(:, 1)/norm2(along(:, 1))
    along(:, 2) = cross(normal, along(:, 1))
    slope = 0.0_rp
    do a = 1, 2
      call tool%distance(x + small*minval(h)*along(:, a), d, n, other, &
                         edge_cutoff=3.0_rp*maxval(h))
      slope = slope + (other - edge_distance)*along(:, a)
    end do
    if (norm2(slope) > 0.0_rp) slope = slope/norm2(slope)
  end function edge_gradient

  !> Limit the impulses of the touching ones of the candidates: along the surface by the friction
  !> law with the strength of the shear layer and a coefficient that may depend on the state; normal
  !> to it at an edge, for the covered fraction, by the pressure under the edge of a punch (Prandtl
  !> 1920, plane; Shield 1955, round).
  subroutine limit_impulses(scene, tool, dt, near, particle)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: dt
    type(candidates_t), intent(in) :: near
    type(contact_particle_t), intent(inout) :: particle(:)
    real(rp) :: coefficient(size(particle))

    if (size(particle) == 0) return
    coefficient = tool%friction_law%coefficient
    if (tool%friction_law%kind == law_coulomb) coefficient = tool%friction_coefficient
    if (tool%friction_table%of /= of_nothing) then
      coefficient = look_up_friction(tool%friction_table, near, particle)
    end if
    particle%shear_impulse = no_limit
    particle%melting_impulse = no_limit
    call find_friction_limits(tool%friction_law, coefficient, particle)
    particle%max_normal_impulse = no_limit
    if (particle(1)%can_flow) call limit_by_strength(scene, tool%friction_law, coefficient, dt, &
                                                     near, particle)
  end subroutine limit_impulses

  !> Limit the impulses of each touching particle by the strength of the material: along the surface
  !> by the friction law, and normal to it at edges. Friction heats metal at most to melting.
  subroutine limit_by_strength(scene, law, coefficient, dt, near, particle)
    type(scene_t), intent(in) :: scene
    type(friction_law_t), intent(in) :: law
    type(candidates_t), intent(in) :: near
    type(contact_particle_t), intent(inout) :: particle(:)
    real(rp), intent(in) :: coefficient(size(particle)), dt
    real(rp) :: depth(nlane), face, melting_heat(nlane), shear, v(nlane)
    type(shear_layer_t) :: layer
    integer :: i

    associate (body => scene%body(near%body), layout => scene%layout)
      v = 0.0_rp
      depth = 1.0_rp
      do i = 1, size(particle)
        associate (t => particle(i), p => particle(i)%candidate)
          depth(p) = t%surface_distance
          v(p) = norm2(t%slip) + root3*near%ps(p, f_rate)*t%surface_distance
        end associate
      end do
      call find_shear_layer(scene%material(body%material), near%n, near%ps(:, f_plastic), &
                            near%ps(:, f_temp), layout%n_law, &
                            near%ps(:, layout%law:layout%law + layout%n_law - 1), depth, v, layer)
      melting_heat = no_limit
      if (scene%method%conducts) melting_heat = near%ps(:, f_mass)*scene%material(body%material)% &
        heat_to_melt(near%ps(:, f_temp)) - near%ps(:, f_heat)
      do i = 1, size(particle)
        associate (t => particle(i), p => particle(i)%candidate, &
                   strength => layer%stress(particle(i)%candidate))
          face = product(t%spacing)/norm2(t%normal*t%spacing)
          shear = dt*face*max(0.0_rp, strength)
          if (t%covered_fraction < 1.0_rp) then
            t%max_normal_impulse = t%covered_fraction*edge_pressure*shear
          end if
          shear = t%covered_fraction*shear
          t%shear_impulse = max(molten_limit, shear)
          if (law%has_no_shear_limit() .and. shear > 0.0_rp) then
            t%shear_impulse = limit_beyond_strength(scene%material(body%material), &
                                                    near%ps(p, f_temp), shear)
          end if
          t%melting_impulse = melting_heat(p)/max(1.0_rp/no_limit, norm2(t%slip))
          call find_friction_limits(law, coefficient(i), t)
          if (law%has_no_shear_limit() .or. shear <= 0.0_rp) cycle
          t%layer_depth = depth(p)
          t%face_area = t%covered_fraction*face
          t%softening = layer%softening(p)
          t%temperature_rise = layer%rise(p)
          t%log_rate = layer%log_rate(p)
          t%layer_strength = shear
          t%rate_sensitivity = max(min_sensitivity, layer%sensitivity(p)/strength)
          t%resolved_rate = near%ps(p, f_rate)
        end associate
      end do
    end associate
  end subroutine limit_by_strength

  !> Limit of friction that may exceed the strength `shear` of the metal: none up to a twentieth
  !> below the melting point, and from there on decreasing to the strength at this point, which is
  !> 0. Metal at the face would otherwise go on to heat molten metal at the nodes that they share.
  elemental real(rp) function limit_beyond_strength(material, temp, shear) result(limit)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: temp                  !! temperature [K]
    real(rp), intent(in) :: shear                 !! impulse of the strength [N s]

    limit = no_limit
    associate (from => softening_from(material%t_melt, 0.0_rp))
      if (temp > from) limit = min(no_limit, shear*(material%t_melt - from)/(temp - from))
    end associate
  end function limit_beyond_strength

  !> Limits of the friction of a particle by the law and by melting, for the coefficient of the law.
  elemental subroutine find_friction_limits(law, coefficient, t)
    type(friction_law_t), intent(in) :: law
    real(rp), intent(in) :: coefficient
    type(contact_particle_t), intent(inout) :: t

    t%max_friction = no_limit
    t%transition = no_limit
    if (law%kind == law_coulomb) t%coulomb_factor = coefficient
    if (t%shear_impulse >= no_limit) then
      t%max_friction = min(no_limit, t%melting_impulse)
    else
      call law%limits(coefficient, t%shear_impulse, t%coulomb_factor, t%max_friction, t%transition)
      t%max_friction = min(t%max_friction, t%melting_impulse)
    end if
    t%max_friction = max(molten_limit, t%max_friction)  ! still in contact
    t%transition = min(t%transition, t%max_friction)
  end subroutine find_friction_limits

  !> Set the friction limits of a particle whose coefficient depends on the speed of sliding. With
  !> the friction F, that speed u is v (1 - F(u)/P), where the impulse P stops the slip v; of
  !> several solutions bisection finds one at which the metal can remain.
  subroutine find_sliding_limits(tool, kept, counted, speed, t)
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: kept       !! Coulomb impulse of earlier steps [N s]
    real(rp), intent(in) :: counted    !! part of the normal impulse that counts
    real(rp), intent(in) :: speed      !! slip velocity without friction [m/s]
    type(contact_particle_t), intent(inout) :: t
    integer, parameter :: n_bisections = 40
    real(rp) :: coulomb, least, most, mu(nlane), sliding, u(nlane), unused(nlane)
    integer :: i

    least = 0.0_rp
    most = speed
    unused = 0.0_rp
    do i = 1, n_bisections
      u = 0.5_rp*(least + most)
      call tool%friction_table%coefficients(1, unused, unused, u, mu)
      call find_friction_limits(tool%friction_law, mu(1), t)
      coulomb = kept + counted*t%coulomb_factor*t%normal_impulse
      sliding = 1.0_rp - tool%friction_law%friction(t%stick_impulse, coulomb, t%max_friction, &
                                                    t%transition)
      if (speed*sliding > u(1)) then
        least = u(1)
      else
        most = u(1)
      end if
    end do
  end subroutine find_sliding_limits

  !> Friction coefficients of the touching ones of the candidates, from their temperature, the
  !> contact pressure in the body, or the sliding speed.
  pure function look_up_friction(table, near, particle) result(found)
    type(friction_table_t), intent(in) :: table
    type(candidates_t), intent(in) :: near
    type(contact_particle_t), intent(in) :: particle(:)
    real(rp) :: found(size(particle))
    real(rp), dimension(nlane) :: mu, pressure, slip
    integer :: i, p

    pressure = 0.0_rp
    slip = 0.0_rp
    do i = 1, size(particle)
      p = particle(i)%candidate
      associate (a => particle(i)%normal, tau => near%ps(p, f_tau:f_tau + 5))
        pressure(p) = max(0.0_rp, -(sum(a**2*tau(1:3)) + 2.0_rp*(a(1)*a(2)*tau(4) &
                          + a(2)*a(3)*tau(5) + a(1)*a(3)*tau(6)))/near%ps(p, f_jac))
        slip(p) = norm2(particle(i)%slip)
      end associate
    end do
    call table%coefficients(near%n, near%ps(:, f_temp), pressure, slip, mu)
    found = mu(particle%candidate)
  end function look_up_friction

  !> Compute the shear layers of `n` particles with plastic strain `alpha`, temperature and state,
  !> depth `z` of their centres below the face [m], and velocity `v` of the face relative to them
  !> [m/s]. The law is linearised in temperature and logarithm of the rate, over the temperature
  !> rise of a uniform rate. Without conduction the thickness of the layer is `z`.
  subroutine find_shear_layer(material, n, alpha, temp, n_state, state, z, v, layer)
    type(material_t), intent(in) :: material
    integer, intent(in) :: n, n_state
    real(rp), intent(in) :: alpha(nlane), temp(nlane), z(nlane), v(nlane), state(nlane, n_state)
    type(shear_layer_t), intent(out) :: layer
    real(rp), dimension(nlane) :: base, conductivity, hot_slope, rate, rise, sigma, slope

    rate = max(v/(root3*z), material%flow%min_rate)
    call compute_flow_strength(material, alpha, temp, rate, n_state, state, base, slope)
    layer%stress = base/root3
    layer%sensitivity = slope/root3
    layer%log_rate = log(rate)
    layer%thickness = z
    if (.not. material%conducts()) return
    conductivity = material%conductivity_at(temp)
    layer%rise = material%plastic_heat*v*z/(2.0_rp*conductivity)*layer%stress
    rise = max(min_rise, layer%rise)
    call compute_flow_strength(material, alpha, temp + rise, rate, n_state, state, sigma, hot_slope)
    call solve_layer(material%plastic_heat, conductivity, n, v, base, &
                 max(0.0_rp, (base - sigma)/rise), 0.5_rp*(slope + hot_slope), layer)
  end subroutine find_shear_layer

  !> Solve for the layer under the linear law sigma = base + slope ln(rate/uniform rate) -
  !> softening_rate rise, by Newton's method in the stress, on which the temperature rise depends
  !> almost linearly.
  pure subroutine solve_layer(plastic_heat, conductivity, n, v, base, softening_rate, slope, layer)
    real(rp), intent(in) :: plastic_heat          !! fraction of plastic work that becomes heat [-]
    real(rp), intent(in) :: conductivity(nlane)   !! [W/(m K)]
    integer, intent(in) :: n
    real(rp), dimension(nlane), intent(in) :: v, base, softening_rate, slope
    type(shear_layer_t), intent(inout) :: layer      !! layer of uniform rate on entry
    integer, parameter :: n_newton = 3
    !> Lower bound of the slope over the stress, as a law without sensitivity shears in a plane.
    real(rp), parameter :: min_slope = 1.0e-3_rp
    real(rp) :: a, log_cosh, m, rise_per_stress, rise, sigma, t, x
    integer :: p, iteration

    do p = 1, n
      if (base(p) <= 0.0_rp) cycle
      a = softening_rate(p)/max(slope(p), min_slope*base(p))
      rise_per_stress = plastic_heat*v(p)*layer%thickness(p)/(2.0_rp*root3*conductivity(p))
      if (a*rise_per_stress*base(p) < min_softening) cycle
      sigma = base(p)
      do iteration = 1, n_newton
        m = a*rise_per_stress*sigma
        x = depth_ratio(m)
        log_cosh = log_cosh_of(x)
        rise = 2.0_rp/a*log_cosh
        t = tanh(x)
        sigma = sigma + (base(p) + slope(p)*log(x/t) - softening_rate(p)*rise - sigma) &
                /(1.0_rp + softening_rate(p)*rise/sigma)
        sigma = max(sigma, 1.0e-6_rp*base(p))
      end do
      layer%stress(p) = sigma/root3
      layer%sensitivity(p) = slope(p)/root3
      layer%log_rate(p) = layer%log_rate(p) + log(x/t) - 2.0_rp*log_cosh
      layer%rise(p) = rise
      layer%thickness(p) = layer%thickness(p)*t/x
      layer%softening(p) = x*t
    end do
  end subroutine solve_layer

  !> Solve x tanh x = m for x = z1/l, to a thousandth: one step of Newton's method.
  elemental real(rp) function depth_ratio(m) result(x)
    real(rp), intent(in) :: m
    real(rp) :: t

    x = sqrt(m + m*m)
    t = tanh(x)
    x = x - (x*t - m)/(t + x*(1.0_rp - t*t))
  end function depth_ratio

  !> ln cosh x without overflow.
  elemental real(rp) function log_cosh_of(x)
    real(rp), intent(in) :: x

    log_cosh_of = x + log(0.5_rp*(1.0_rp + exp(-2.0_rp*x)))
  end function log_cosh_of

end module contact_tool_limits
