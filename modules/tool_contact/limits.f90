! SPDX-License-Identifier: MIT
!> What limits the impulses of particles that touch a tool: its edges, the strength of the material
!> and the tool's law of friction.
!>
!> The layer of metal that shears under the face of a tool, as far as the cells do not resolve it.
!>
!> Between a face that moves at V against the metal at depth z1, the centre of the particles there,
!> the shear stress tau is the same at all depths and heat flows down. With a law of sensitivity
!> S = d tau/d ln(rate) and softening a = -(d tau/d T)/S steady conduction k T" = -q tau rate, q the
!> part of plastic work that heats, has the solution (insulated face, depth z)
!>
!>   rate = rate_s sech2(z/l),  T = T_s - (2/a) ln cosh(z/l),  l2 = 2 k/(a q tau rate_s)
!>
!> so that V = rate_s l tanh(z1/l): with x = z1/l,  x tanh x = a q tau V z1/(2 k). The layer is as
!> thick as conduction and softening make it (l = 2 k/(a q tau V) if it is thinner than z1), not
!> as thick as a particle. V is the slip against the velocity of the surface and what the metal
!> itself shears down to z1; as cells are refined x and with it all that is unresolved tend to 0.
module tool_contact_limits
  use base_kinds, only: nlane, pi, rp
  use contact_law, only: friction_law_t, friction_table_t, law_coulomb, of_nothing
  use contact_tool, only: tool_t
  use grid_geometry, only: length_along
  use mapping_faces, only: place_on_axis
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_jac, f_plastic, f_pos, f_rate, f_tau, f_temp
  use physics_material, only: material_t
  use physics_stress, only: flow_strength
  use state_scene, only: scene_t
  use tool_contact_lists, only: candidates_t, contact_particle_t
  use transfer_weights, only: domain_weights
  implicit none (type, external)
  private

  public :: cut_at_edges, extent, part_covered
  public :: find_shear_layer, limit_impulses, shear_layer_t, slow_down

  !> Of the particles of a block.
  type :: shear_layer_t
    real(rp) :: stress(nlane) = 0.0_rp        !! at which the layer takes all of V [Pa]
    real(rp) :: sensitivity(nlane) = 0.0_rp   !! of it to the logarithm of the rate [Pa]
    real(rp) :: log_rate(nlane) = 0.0_rp      !! of plastic strain at the particle's centre [ln 1/s]
    real(rp) :: rise(nlane) = 0.0_rp          !! of temperature, of the face over that centre [K]
    real(rp) :: thickness(nlane) = 0.0_rp     !! V over the rate of shear at the face [m]
    real(rp) :: softening(nlane) = 0.0_rp     !! x tanh x; 0: the layer is even
  end type shear_layer_t

  real(rp), parameter :: root3 = sqrt(3.0_rp)
  real(rp), parameter :: step = 1.0_rp    !! least, of the derivative by temperature [K]
  real(rp), parameter :: least_softening = 1.0e-4_rp   !! x tanh x from which the layer is uneven
  real(rp), parameter :: unlimited = 1.0e30_rp     !! of what cannot flow [N s]
  real(rp), parameter, public :: molten = 1.0e-30_rp   !! limit of metal without strength [N s]
  real(rp), parameter :: least_sensitivity = 1.0e-3_rp   !! of stress to the logarithm of the rate
  real(rp), parameter :: edge_pressure = 2.0_rp + pi   !! of flowing metal at an edge, over its
                                                       !! shear strength

contains

  !> Extent of a particle along the normal of a tool [m]. A surface touches the ellipsoid of the
  !> particle where this is farthest out along the normal, an edge (no room is left) where the
  !> normal goes through it.
  pure real(rp) function extent(spacing, normal, room)
    real(rp), intent(in) :: spacing(3)           !! axes of the ellipsoid [m]
    real(rp), intent(in) :: normal(3), room      !! of length 1, [m]

    extent = norm2(normal*spacing)
    if (room > 0.0_rp .or. all(abs(spacing - spacing(1)) <= 0.0_rp)) return
    extent = 1.0_rp/norm2(normal/spacing)
  end function extent

  !> Part of the weight function of a particle at `x` that the tool covers, `room` away from the
  !> tool's next edge: both count in cells, by the length of a cell along the way to the edge.
  real(rp) function part_covered(tool, is_bspline, x, room, particle) result(part)
    type(tool_t), intent(in) :: tool
    logical, intent(in) :: is_bspline            !! domains are cells
    real(rp), intent(in) :: x(3), room           !! [m]
    type(contact_particle_t), intent(in) :: particle
    real(rp) :: slope(3), width

    associate (h => particle%edges, spacing => particle%spacing)
      width = 1.0_rp
      if (.not. is_bspline) width = maxval(spacing/h)
      part = part_within(width, room/maxval(h))
      if (all(abs(h - h(1)) <= 0.0_rp) .and. &
          (is_bspline .or. all(abs(spacing - spacing(1)) <= 0.0_rp))) return
      if (abs(room) >= 2.0_rp*maxval(h)) return
      slope = way_from_edge(tool, x, particle%normal, minval(h))
      if (.not. norm2(slope) > 0.0_rp) return
      if (.not. is_bspline) width = norm2(slope*spacing)/length_along(h, slope)
      part = part_within(width, room/length_along(h, slope))
    end associate
  end function part_covered

  !> Part of a particle's weight function that is on the inner side of an edge `room` cells away
  !> (below 0: the particle is beyond it). The function is a hat of a cell averaged over the domain:
  !> half a particle on the edge, all of it a cell and half a domain inside.
  elemental real(rp) function part_within(width, room) result(part)
    real(rp), intent(in) :: width               !! of the domain: a cell for B-splines [cells]
    real(rp), intent(in) :: room

    real(rp) :: x

    x = max(-2.0_rp, min(2.0_rp, room))         ! no domain is wider than a cell
    part = (twice(x + 0.5_rp*width) - twice(x - 0.5_rp*width))/width
    part = max(0.0_rp, min(1.0_rp, part))
  contains
    !> The hat integrated twice, from far outside on.
    elemental real(rp) function twice(x)
      real(rp), intent(in) :: x
      real(rp) :: r

      r = max(-1.0_rp, min(1.0_rp, x))
      twice = max(0.0_rp, x - 1.0_rp) + 1.0_rp/6.0_rp + 0.5_rp*(r + r*r) - abs(r)**3/6.0_rp
    end function twice
  end function part_within

  !> Weights `w` of candidates at an edge: those of the part of their domains that the tool
  !> covers. What presses on a whole domain there acts beyond the edge, and the tool as if it were
  !> wider by a fifth of a cell. An axis with graded cells keeps the whole domain.
  subroutine cut_at_edges(scene, nodes, tool, near, first, w)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool
    type(candidates_t), intent(in) :: near
    integer, intent(in) :: first(nlane)
    real(rp), intent(inout) :: w(nlane, 18)
    real(rp) :: cut(3), gap, h(3), half(3), room, slope(3), unused(3), x(3)
    integer :: a, p

    do p = 1, near%n
      x = near%ps(p, f_pos:f_pos + 2)
      h = nodes%patch%edges_at(x)
      half = scene%domain(near%body)
      if (scene%layout%half > 0) half = near%ps(p, scene%layout%half:scene%layout%half + 2)
      call tool%distance(x, gap, unused, room)
      if (room >= norm2(half*h)) cycle
      slope = way_from_edge(tool, x, near%normal(:, p), minval(h))
      cut = min(half, max(0.0_rp, norm2(slope*half*h) - max(0.0_rp, room))*abs(slope)/h)
      do a = 1, 3
        if (a == nodes%patch%grading%axis .or. cut(a) <= 0.0_rp) cycle
        w(p, 3*a - 2:3*a) = domain_weights(place_on_axis(nodes, a, x, first(p)) &
                                           + sign(0.5_rp*cut(a), slope(a)), &
                                           half(a) - 0.5_rp*cut(a))
      end do
    end do
  end subroutine cut_at_edges

  !> Direction along the surface with `normal` in which the room to the tool's next edge grows
  !> fastest at `x`; 0 where it does not.
  function way_from_edge(tool, x, normal, h) result(slope)
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: x(3), normal(3)
    real(rp), intent(in) :: h                    !! shortest edge of the cell there [m]
    real(rp) :: slope(3)
    real(rp), parameter :: small = 1.0e-3_rp     !! step of the difference [cells]
    real(rp) :: gap, rooms(2), step(3), unused(3)
    integer :: a, side

    do a = 1, 3
      do side = 1, 2
        step = 0.0_rp
        step(a) = small*h*(2*side - 3)
        step = step - dot_product(step, normal)*normal
        call tool%distance(x + step, gap, unused, rooms(side))
      end do
      slope(a) = rooms(2) - rooms(1)
    end do
    if (norm2(slope) > 0.0_rp) slope = slope/norm2(slope)
  end function way_from_edge

  !> What limits the impulses of the touching particles, which have their `place` among the
  !> candidates: along the surface what the tool's law of friction makes of the strength of the
  !> layer that shears, with a coefficient that may depend on the state; across it at an edge, for
  !> the part that the tool covers, the pressure under the edge of a punch (Prandtl 1920, plane;
  !> Shield 1955, round).
  subroutine limit_impulses(scene, tool, dt, near, n, place, particle)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: dt
    type(candidates_t), intent(in) :: near
    integer, intent(in) :: n, place(n)
    type(contact_particle_t), intent(inout) :: particle(n)
    real(rp) :: coefficient(n)

    if (n == 0) return
    coefficient = tool%friction_law%coefficient
    if (tool%friction_table%of /= of_nothing) then
      coefficient = look_up_friction(tool%friction_table, near%n, scene%layout%n, near%ps, n, &
                                     place, particle)
      if (tool%friction_law%kind == law_coulomb) particle%friction = coefficient
    end if
    particle%shear = unlimited
    particle%bend = unlimited
    particle%most = unlimited
    if (particle(1)%can_flow) call limit_by_strength(scene, tool%friction_law, coefficient, dt, &
                                                     near, n, place, particle)
  end subroutine limit_impulses

  !> What the strength of the material lets each touching particle take: along the surface by the
  !> law of friction (nothing when it is molten), and at edges across it.
  subroutine limit_by_strength(scene, law, coefficient, dt, near, n, place, particle)
    type(scene_t), intent(in) :: scene
    type(friction_law_t), intent(in) :: law
    integer, intent(in) :: n, place(n)
    real(rp), intent(in) :: coefficient(n), dt
    type(candidates_t), intent(in) :: near
    type(contact_particle_t), intent(inout) :: particle(n)
    real(rp) :: depth(nlane), face, shear, v(nlane)
    type(shear_layer_t) :: layer
    integer :: i

    associate (body => scene%body(near%body), layout => scene%layout)
      v = 0.0_rp
      depth = 1.0_rp
      do i = 1, n
        depth(place(i)) = particle(i)%half
        v(place(i)) = norm2(particle(i)%slip) &
                      + root3*near%ps(place(i), f_rate)*particle(i)%half
      end do
      call find_shear_layer(scene%material(body%material), near%n, near%ps(:, f_plastic), &
                            near%ps(:, f_temp), layout%n_law, &
                            near%ps(:, layout%law:layout%law + layout%n_law - 1), depth, v, layer)
      do i = 1, n
        associate (t => particle(i), strength => layer%stress(place(i)))
          face = product(t%spacing)/norm2(t%normal*t%spacing)
          shear = dt*face*max(0.0_rp, strength)
          if (t%within < 1.0_rp) t%most = t%within*edge_pressure*shear
          shear = t%within*shear
          call law%limits(coefficient(i), max(molten, shear), t%friction, t%shear, t%bend)
          t%shear = max(molten, t%shear)     ! a coefficient of 0 gives none, but the metal touches
          if (law%is_unlimited() .and. shear > 0.0_rp) t%shear = unlimited
          if (t%shear >= unlimited .or. shear <= 0.0_rp) cycle
          t%depth = depth(place(i))
          t%face = t%within*face
          t%softening = layer%softening(place(i))
          t%rise = layer%rise(place(i))
          t%log_rate = layer%log_rate(place(i))
          t%strength = shear
          t%sensitivity = max(least_sensitivity, layer%sensitivity(place(i))/strength)
          t%resolved_rate = near%ps(place(i), f_rate)
        end associate
      end do
    end associate
  end subroutine limit_by_strength

  !> Coefficients of friction of the touching ones of `n` candidates, from their temperature, the
  !> pressure on the tool's surface in the body, or the speed of sliding.
  pure function look_up_friction(table, n, nf, ps, n_particles, place, particle) result(found)
    type(friction_table_t), intent(in) :: table
    integer, intent(in) :: n, nf, n_particles, place(n_particles)
    real(rp), intent(in) :: ps(nlane, nf)
    type(contact_particle_t), intent(in) :: particle(n_particles)
    real(rp) :: found(n_particles)
    real(rp), dimension(nlane) :: mu, pressure, slip
    integer :: i, p

    pressure = 0.0_rp
    slip = 0.0_rp
    do i = 1, n_particles
      p = place(i)
      associate (a => particle(i)%normal, tau => ps(p, f_tau:f_tau + 5))
        pressure(p) = max(0.0_rp, -(sum(a**2*tau(1:3)) + 2.0_rp*(a(1)*a(2)*tau(4) &
                          + a(2)*a(3)*tau(5) + a(1)*a(3)*tau(6)))/ps(p, f_jac))
        slip(p) = norm2(particle(i)%slip)
      end associate
    end do
    call table%coefficients(n, ps(1, f_temp), pressure, slip, mu)
    found = mu(place)
  end function look_up_friction

  !> Stress, rate, rise and thickness of the layer of `n` particles with strain `alpha`, temperature
  !> and state, depth `z` of their centres below the face [m], velocity `v` of the face against them
  !> [m/s]. The law is taken as linear in temperature and logarithm of the rate, from the particle's
  !> temperature on over the rise that an even rate would make. Without conduction the layer is as
  !> thick as `z`.
  subroutine find_shear_layer(material, n, alpha, temp, n_state, state, z, v, layer)
    type(material_t), intent(in) :: material
    integer, intent(in) :: n, n_state
    real(rp), intent(in) :: alpha(nlane), temp(nlane), z(nlane), v(nlane)
    real(rp), intent(in) :: state(nlane, n_state)
    type(shear_layer_t), intent(out) :: layer
    real(rp), dimension(nlane) :: base, conductivity, hot_slope, rate, rise, sigma, slope

    rate = max(v/(root3*z), material%flow%slowest)
    call flow_strength(material, alpha, temp, rate, n_state, state, base, slope)
    layer%stress = base/root3
    layer%sensitivity = slope/root3
    layer%log_rate = log(rate)
    layer%thickness = z
    if (.not. material%conducts()) return
    conductivity = material%conductivity_at(temp)
    layer%rise = material%plastic_heat*v*z/(2.0_rp*conductivity)*layer%stress
    rise = max(step, layer%rise)
    call flow_strength(material, alpha, temp + rise, rate, n_state, state, sigma, hot_slope)
    call balance(material%plastic_heat, conductivity, n, z, v, base, &
                 max(0.0_rp, (base - sigma)/rise), 0.5_rp*(slope + hot_slope), layer)
  end subroutine find_shear_layer

  !> The layer under the linear law sigma = base + slope ln(rate/even rate) - fall rise, by
  !> Newton's method in the stress, on which the rise of temperature depends almost linearly.
  pure subroutine balance(plastic_heat, conductivity, n, z, v, base, fall, slope, layer)
    real(rp), intent(in) :: plastic_heat, conductivity(nlane)   !! [-], [W/(m K)]
    integer, intent(in) :: n
    real(rp), dimension(nlane), intent(in) :: z, v, base, fall, slope
    type(shear_layer_t), intent(inout) :: layer      !! of an even rate before
    integer, parameter :: rounds = 3
    real(rp), parameter :: least_slope = 1.0e-3_rp   !! of the stress: a law without sensitivity
                                                     !! shears in a plane
    real(rp) :: a, log_cosh, m, per_stress, rise, sigma, t, x
    integer :: p, round

    do p = 1, n
      if (base(p) <= 0.0_rp) cycle
      a = fall(p)/max(slope(p), least_slope*base(p))
      per_stress = plastic_heat*v(p)*z(p)/(2.0_rp*root3*conductivity(p))
      if (a*per_stress*base(p) < least_softening) cycle
      sigma = base(p)
      do round = 1, rounds
        m = a*per_stress*sigma
        x = ratio_of(m)
        log_cosh = log_cosh_of(x)
        rise = 2.0_rp/a*log_cosh
        t = tanh(x)
        sigma = sigma + (base(p) + slope(p)*log(x/t) - fall(p)*rise - sigma) &
                /(1.0_rp + fall(p)*rise/sigma)
        sigma = max(sigma, 1.0e-6_rp*base(p))
      end do
      layer%stress(p) = sigma/root3
      layer%sensitivity(p) = slope(p)/root3
      layer%log_rate(p) = layer%log_rate(p) + log(x/t) - 2.0_rp*log_cosh
      layer%rise(p) = rise
      layer%thickness(p) = z(p)*t/x
      layer%softening(p) = x*t
    end do
  end subroutine balance

  !> x = z1/l of x tanh x = m, to a thousandth: one step of Newton's method.
  elemental real(rp) function ratio_of(m) result(x)
    real(rp), intent(in) :: m
    real(rp) :: t

    x = sqrt(m + m*m)
    t = tanh(x)
    x = x - (x*t - m)/(t + x*(1.0_rp - t*t))
  end function ratio_of

  elemental real(rp) function log_cosh_of(x)
    real(rp), intent(in) :: x

    log_cosh_of = x + log(0.5_rp*(1.0_rp + exp(-2.0_rp*x)))
  end function log_cosh_of

  !> The layer of a particle in contact where friction takes the part `used` of its strength: its
  !> rate, and with it all that it shears, is by `slower` [ln] less; the rest of the slip slides.
  !>
  !> Its metal moves faster than the particle's centre, by V (1 - ln cosh x/(x tanh x)) in the mean
  !> from the centre to the face, of which the grid has the half of what the particle shears by
  !> itself. Of all of the particle, `spacing` wide, that is a part: below the centre it moves
  !> with the grid.
  elemental subroutine slow_down(used, spacing, t, slower)
    real(rp), intent(in) :: used, spacing     !! [-], along the normal [m]
    type(contact_particle_t), intent(inout) :: t
    real(rp), intent(out) :: slower
    real(rp) :: m, mean, resolved, slip, speed, x

    t%used = used
    slower = (used - 1.0_rp)/t%sensitivity
    slip = norm2(t%slip)
    resolved = root3*t%resolved_rate*t%depth
    speed = exp(slower)*(slip + resolved)
    t%plastic_part = 0.0_rp
    if (slip > 0.0_rp) t%plastic_part = max(0.0_rp, (speed - resolved)/slip)
    m = t%softening*used*exp(slower)
    if (m < least_softening) then              ! shears evenly
      mean = 0.5_rp
      t%thickness = t%depth
      if (t%softening < least_softening) then
        t%rise = t%rise*used*exp(slower)
      else
        t%rise = t%rise*0.5_rp*m/log_cosh_of(ratio_of(t%softening))
      end if
    else
      x = ratio_of(m)
      mean = 1.0_rp - log_cosh_of(x)/m
      t%thickness = t%depth*tanh(x)/x
      t%rise = t%rise*log_cosh_of(x)/log_cosh_of(ratio_of(t%softening))
    end if
    t%faster = max(0.0_rp, mean*speed - 0.5_rp*resolved)*t%depth/(t%depth + 0.5_rp*spacing)
  end subroutine slow_down

end module tool_contact_limits
