! SPDX-License-Identifier: MIT
!> The layer that shears under the face of a tool, in closed form, against its differential
!> equations integrated numerically: k T" = -q tau gamma, tau even, gamma(T, tau) by the law. From a
!> stress and a temperature of the insulated face downwards, so that nothing is solved for.
program test_shear_layer
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_tool_limits, only: find_shear_layer, limit_beyond_strength, no_limit, shear_layer_t
  use contact_tool_loads, only: reduce_layer_rate
  use contact_tool_loads, only: give_heat
  use linear_law, only: linear_t
  use particles_store, only: f_heat, f_pos, f_temp, n_fields, particles_t
  use physics_flow_law, only: flow_law_t, n_work
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_material, only: material_t
  use state_scene, only: scene_t
  use state_tool_lists, only: contact_particle_t, n_values, tool_contact_t, v_coulomb, &
                                   v_max_friction, v_stick
  use tools_sums, only: n_tool_sums, s_area, s_excess_speed, s_face_temperature, s_layer_slip, &
                        s_layer_strength, s_layer_thickness, s_layer_work, s_surface_slip, &
                        s_surface_speed, s_to_plate
  use tools_tool, only: rigid_t, tool_t
  implicit none (type, external)

  real(rp), parameter :: root3 = sqrt(3.0_rp), conductivity = 391.0_rp, heats = 0.9_rp
  integer, parameter :: n_steps = 1000

  call begin_tests()
  call random_init(.true., .false.)
  call test_linear_laws()
  call test_johnson_cook()
  call test_limits()
  call test_limit_beyond_strength()
  call test_plastic_part()
  call test_mean_of_layer()
  call test_sums_of_face()
  call end_tests()

contains

  !> Friction beyond the strength, where none, half or all of the range below melting is passed.
  subroutine test_limit_beyond_strength()
    type(material_t) :: material

    call expect('not molten', limit_beyond_strength(material, 1.0e4_rp, 3.0_rp) >= no_limit)
    material%t_melt = 1000.0_rp
    call expect('below the range', limit_beyond_strength(material, 950.0_rp, 3.0_rp) >= no_limit)
    call expect_close('half the range', limit_beyond_strength(material, 975.0_rp, 3.0_rp), &
                      6.0_rp, rtol=1.0e-12_rp)
    call expect_close('at the melting point', limit_beyond_strength(material, 1000.0_rp, 3.0_rp), &
                      3.0_rp, rtol=1.0e-12_rp)
  end subroutine test_limit_beyond_strength

  !> Rate of plastic strain at which a law gives the stress sqrt(3) tau at strain 1 [1/s].
  real(rp) function rate_of(law, temp, tau)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: temp, tau
    real(rp) :: none(nlane), sigma(nlane), slope(nlane), work(nlane, n_work), x
    integer :: i

    x = 0.0_rp
    none = 0.0_rp
    call law%prepare(none + temp, spread(none, 2, 0), work)
    do i = 1, 20                                 ! linear in the logarithm: the first is exact
      call law%stress(work, none + 1.0_rp, none, none + x, sigma, slope)
      x = x + (root3*tau - sigma(1))/slope(1)
      if (abs(root3*tau - sigma(1)) < 1.0e-6_rp*tau) exit
    end do
    rate_of = exp(x)
  end function rate_of

  !> Temperature at depth `z`, slip down to it and rate there, of a layer with a stress and a
  !> temperature of its face; classical Runge-Kutta.
  subroutine integrate(law, tau, face, z, temp, slip, rate)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: tau, face, z         !! [Pa], [K], [m]
    real(rp), intent(out) :: temp, slip, rate    !! [K], [m/s], [1/s]
    real(rp) :: k(3, 4), h, y(3)                 !! temperature, its gradient, slip
    integer :: i

    h = z/n_steps
    y = [face, 0.0_rp, 0.0_rp]
    do i = 1, n_steps
      k(:, 1) = slope_of(law, tau, y)
      k(:, 2) = slope_of(law, tau, y + 0.5_rp*h*k(:, 1))
      k(:, 3) = slope_of(law, tau, y + 0.5_rp*h*k(:, 2))
      k(:, 4) = slope_of(law, tau, y + h*k(:, 3))
      y = y + h/6.0_rp*(k(:, 1) + 2.0_rp*(k(:, 2) + k(:, 3)) + k(:, 4))
    end do
    temp = y(1)
    slip = y(3)
    rate = rate_of(law, temp, tau)
  end subroutine integrate

  function slope_of(law, tau, y) result(dy)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: tau, y(3)
    real(rp) :: dy(3), shear

    shear = root3*rate_of(law, y(1), tau)
    dy = [y(2), -heats*tau*shear/conductivity, shear]
  end function slope_of

  !> The layer of one particle at strain 1.
  subroutine layer_of(law, temp, z, v, layer, k)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: temp, z, v
    type(shear_layer_t), intent(out) :: layer
    real(rp), intent(in) :: k                    !! conductivity [W/(m K)]
    type(material_t) :: metal
    real(rp) :: none(nlane)

    none = 0.0_rp
    metal%conductivity = k
    metal%plastic_heat = heats
    allocate (metal%flow, source=law)
    call find_shear_layer(metal, 1, none + 1.0_rp, none + temp, 0, spread(none, 2, 0), none + z, &
                          none + v, layer)
  end subroutine layer_of

  !> Layers that hardly soften, and others whose face shears a thousand times as fast as their end.
  subroutine test_linear_laws()
    type(linear_t) :: law
    type(shear_layer_t) :: layer
    real(rp) :: face, rate, slip, tau, temp, u(6), z
    real(rp) :: least_share, most_share
    integer :: i

    least_share = huge(1.0_rp)
    most_share = 0.0_rp
    do i = 1, 60
      call random_number(u)
      tau = 20.0e6_rp + 80.0e6_rp*u(1)
      law%slope = root3*tau*(0.01_rp + 0.05_rp*u(2))
      law%fall = root3*tau*(0.5e-3_rp + 3.0e-3_rp*u(3))
      z = 0.1e-3_rp + 0.9e-3_rp*u(4)
      face = 700.0_rp + 500.0_rp*u(5)
      ! rate of the face so that l is 0.15 to 5 times z
      rate = 2.0_rp*conductivity*law%slope/(law%fall*heats*root3*tau) &
             /(z*0.15_rp*(5.0_rp/0.15_rp)**u(6))**2
      law%base = root3*tau - law%slope*log(rate) + law%fall*(face - law%room)
      call integrate(law, tau, face, z, temp, slip, rate)
      call layer_of(law, temp, z, slip, layer, conductivity)
      call expect_close('stress of the layer', layer%stress(1), tau, rtol=1.0e-3_rp)
      call expect_close('sensitivity', layer%sensitivity(1), law%slope/root3, rtol=1.0e-6_rp)
      call expect_close('rise of temperature', layer%rise(1), face - temp, rtol=1.0e-2_rp, &
                        atol=0.01_rp)
      call expect_close('rate at the centre', layer%log_rate(1), log(rate), atol=0.02_rp)
      call expect_close('thickness', layer%thickness(1), slip/(root3*rate_of(law, face, tau)), &
                        rtol=5.0e-3_rp)
      least_share = min(least_share, layer%thickness(1)/z)
      most_share = max(most_share, layer%thickness(1)/z)
    end do
    call expect('layers thin and thick', least_share < 0.2_rp .and. most_share > 0.95_rp)
  end subroutine test_linear_laws

  !> A law that is neither linear in temperature nor at an end of its range.
  subroutine test_johnson_cook()
    type(johnson_cook_t) :: law
    type(shear_layer_t) :: layer
    real(rp) :: face, rate, slip, tau, temp, u(4), z
    integer :: i

    law = johnson_cook_t(a=90.0e6_rp, b=292.0e6_rp, n=0.31_rp, c=0.025_rp, m=1.09_rp, &
                         t_melt=1356.0_rp)
    do i = 1, 30
      call random_number(u)
      face = 600.0_rp + 600.0_rp*u(1)
      z = 0.125e-3_rp + 0.375e-3_rp*u(2)
      rate = 30.0_rp*100.0_rp**u(3)              ! of the face
      tau = strength_of(law, face, rate)/root3
      call integrate(law, tau, face, z, temp, slip, rate)
      call layer_of(law, temp, z, slip, layer, conductivity)
      call expect_close('stress, Johnson-Cook', layer%stress(1), tau, rtol=0.01_rp)
      call expect_close('rise, Johnson-Cook', layer%rise(1), face - temp, rtol=0.03_rp, &
                        atol=0.1_rp)
    end do
  end subroutine test_johnson_cook

  real(rp) function strength_of(law, temp, rate)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: temp, rate
    real(rp) :: none(nlane), sigma(nlane), slope(nlane), work(nlane, n_work)

    none = 0.0_rp
    call law%prepare(none + temp, spread(none, 2, 0), work)
    call law%stress(work, none + 1.0_rp, none, none + log(rate), sigma, slope)
    strength_of = sigma(1)
  end function strength_of

  !> Without conduction the layer is even; as it gets thinner against the grid it tends to nothing.
  subroutine test_limits()
    type(linear_t) :: law
    type(shear_layer_t) :: fine, layer
    real(rp), parameter :: temp = 900.0_rp, v = 0.3_rp, z = 0.5e-3_rp

    law = linear_t(base=150.0e6_rp, slope=4.0e6_rp, fall=0.1e6_rp)
    call layer_of(law, temp, z, v, layer, 0.0_rp)
    call expect_close('even rate', exp(layer%log_rate(1)), v/(root3*z), rtol=1.0e-12_rp)
    call expect_close('its stress', layer%stress(1), &
                      strength_of(law, temp, v/(root3*z))/root3, rtol=1.0e-12_rp)
    call expect_close('its thickness', layer%thickness(1), z, rtol=1.0e-12_rp)
    call expect('no rise is known', .not. abs(layer%rise(1)) > 0.0_rp)
    call layer_of(law, temp, z, v, layer, conductivity)
    call layer_of(law, temp, 0.01_rp*z, 0.01_rp*v, fine, conductivity)
    call expect('unresolved rise tends to nothing', fine%rise(1) < 2.0e-4_rp*layer%rise(1) &
                .and. fine%rise(1) > 0.5e-4_rp*layer%rise(1))
    call expect_close('and the layer is even', fine%thickness(1), 0.01_rp*z, rtol=1.0e-3_rp)
  end subroutine test_limits

  !> Of a slip of 0.9 beside 0.1 that the metal shears by itself.
  subroutine test_plastic_part()
    call expect_close('the layer takes all', part_of(0.9_rp, 1.0_rp), 1.0_rp)
    call expect_close('half of both', part_of(0.9_rp, 0.5_rp), 0.4_rp/0.9_rp)
    call expect_close('less than is resolved', part_of(0.9_rp, 0.05_rp), 0.0_rp)
    call expect_close('no slip', part_of(0.0_rp, 1.0_rp), 0.0_rp)
  end subroutine test_plastic_part

  !> Part of a slip that is shear where the particle resolves 0.1 m/s and the layer is `slower`
  !> times as fast as at its full strength.
  real(rp) function part_of(slip, slower)
    real(rp), intent(in) :: slip, slower
    type(contact_particle_t) :: t
    real(rp) :: log_slower

    t = contact_particle_t(slip=[0.0_rp, slip, 0.0_rp], layer_depth=1.0e-3_rp, &
                           rate_sensitivity=0.05_rp, resolved_rate=100.0_rp/sqrt(3.0_rp))
    call reduce_layer_rate(1.0_rp + 0.05_rp*log(slower), 1.0e-3_rp, t, log_slower)
    call expect_close('as slow as asked', log_slower, log(slower), atol=1.0e-9_rp)
    part_of = t%plastic_fraction
  end function part_of

  !> Layers of random thickness, at full strength and less: the velocity by which their metal is
  !> faster than the particle, in the mean of it, thickness and rise against the profiles, rate
  !> sech2 from centre to face, integrated numerically.
  subroutine test_mean_of_layer()
    integer, parameter :: n = 4000
    type(contact_particle_t) :: t
    real(rp) :: draw(6), full, mean, resolved, slip, slower, speed, used, x, z(n)
    integer :: i, k

    do i = 1, 40
      call random_number(draw)
      full = 5.0_rp*draw(1)                    ! x at full strength
      slip = 0.01_rp + draw(2)
      resolved = 0.3_rp*slip*draw(3)
      used = 1.0_rp - 0.1_rp*draw(4)*real(mod(i, 2), rp)
      t = contact_particle_t(slip=[slip, 0.0_rp, 0.0_rp], layer_depth=(0.1_rp + draw(5)) &
                             *1.0e-3_rp, rate_sensitivity=0.05_rp, softening=full*tanh(full), &
                             temperature_rise=7.0_rp*log(cosh(full)))
      t%resolved_rate = resolved/(sqrt(3.0_rp)*t%layer_depth)
      call reduce_layer_rate(used, 2.0_rp*t%layer_depth, t, slower)
      speed = exp(slower)*(slip + resolved)
      x = newton(full*tanh(full)*used*exp(slower))
      z = [((real(k, rp) - 0.5_rp)/n, k=1, n)]
      mean = sum(speed*(1.0_rp - tanh(x*z)/tanh(x)) - resolved*(1.0_rp - z))/n
      call expect_close('mean velocity', t%excess_velocity, 0.5_rp*max(0.0_rp, mean), &
                        atol=2.0e-3_rp*speed)
      call expect_close('thickness', t%layer_thickness, t%layer_depth*tanh(x)/x, rtol=4.0e-3_rp)
      call expect_close('rise', t%temperature_rise, 7.0_rp*log(cosh(x)), rtol=0.02_rp, &
                        atol=1.0e-3_rp)
    end do
  end subroutine test_mean_of_layer

  !> x of x tanh x = m.
  real(rp) function newton(m) result(x)
    real(rp), intent(in) :: m
    integer :: k

    x = sqrt(m + m*m)
    do k = 1, 30
      x = x - (x*tanh(x) - m)/(tanh(x) + x/cosh(x)**2)
    end do
  end function newton

  !> Particles on a node each, two under a layer, of which one is limited by its strength and one by
  !> Coulomb's law, and one without: what the face sums, and the heat of each.
  subroutine test_sums_of_face()
    type(scene_t) :: scene
    type(particles_t) :: particles
    type(tool_contact_t) :: contact
    type(tool_t) :: tool
    type(rigid_t) :: rigid
    real(rp), parameter :: dt = 0.3_rp, share = 0.6_rp, normal(3) = [0.36_rp, 0.48_rp, 0.8_rp]
    real(rp) :: along, at_surface(3), heat, r(3), sums(n_tool_sums), work
    integer :: p

    allocate (scene%material(1), scene%body(1))
    scene%material(1)%plastic_heat = heats
    scene%body(1)%material = 1
    call particles%init(n_fields)
    call particles%reserve(1)
    particles%nblk = 1
    particles%body(1) = 1
    call random_number(particles%ps)
    particles%ps(:, f_heat, 1) = 0.0_rp
    tool%fixed_heat_share = share
    call random_number(rigid%centre)
    call random_number(rigid%velocity)
    call random_number(rigid%omega)
    contact%n = 3
    contact%n_nodes = 3
    allocate (contact%particle(3), contact%values(n_values, 3), contact%slip(3, 3), &
              contact%friction_fraction(3), contact%is_folded(3, 3))
    call random_number(contact%values)
    call random_number(contact%slip)
    call random_number(contact%friction_fraction)
    contact%is_folded = .false.
    contact%values([v_max_friction, v_coulomb], 1) = [3.0_rp, 2.0_rp]
    contact%values([v_max_friction, v_coulomb], 2) = [no_limit, 2.0_rp]   ! elastic material
    sums = 0.0_rp
    do p = 1, 3
      associate (t => contact%particle(p), x => particles%ps(p, f_pos:f_pos + 2, 1), &
                 hot => particles%ps(p, f_temp, 1), slip => contact%slip(:, p))
        t%block = 1
        t%lane = p
        t%entry(5) = p
        t%weight(5) = 1.0_rp
        t%normal = normal
        call random_number(r)
        t%max_friction = r(1)
        t%coulomb_impulse = r(2)
        t%surface_distance = r(3)
        call random_number(r)
        t%plastic_fraction = r(1)
        t%layer_strength = r(2)
        t%face_area = r(3)
        call random_number(r)
        t%temperature_rise = r(1)
        t%layer_thickness = r(2)
        t%excess_velocity = r(3)
        t%strength_used = merge(1.0_rp, 0.0_rp, p < 3)
        work = merge(t%max_friction/contact%values(v_max_friction, p), &
                     t%coulomb_impulse/contact%values(v_coulomb, p), &
                     contact%values(v_max_friction, p) < no_limit)
        work = -work*contact%friction_fraction(p) &
               *dot_product(contact%values(v_stick:v_stick + 2, p), slip)
        heat = share*(1.0_rp - t%plastic_fraction*(1.0_rp - heats))*work
        sums(s_to_plate) = sums(s_to_plate) + heat
        if (p == 3) cycle
        r = x - t%surface_distance*normal - rigid%centre
        at_surface = rigid%velocity + [rigid%omega(2)*r(3) - rigid%omega(3)*r(2), rigid%omega(3) &
          *r(1) - rigid%omega(1)*r(3), rigid%omega(1)*r(2) - rigid%omega(2)*r(1)]
        along = sqrt(sum(slip**2) - dot_product(slip, normal)**2)
        sums(s_area) = sums(s_area) + dt*t%face_area
        sums(s_face_temperature) = sums(s_face_temperature) + dt*t%face_area*(hot &
                                                                              + t%temperature_rise)
        sums(s_layer_strength) = sums(s_layer_strength) + t%layer_strength
        sums(s_layer_thickness) = sums(s_layer_thickness) + dt*t%face_area*t%layer_thickness
        sums(s_layer_slip) = sums(s_layer_slip) + dt*t%face_area*t%plastic_fraction*along
        sums(s_surface_slip) = sums(s_surface_slip) + dt*t%face_area*(1.0_rp &
                                                                      - t%plastic_fraction)*along
        sums(s_surface_speed) = sums(s_surface_speed) + dt*t%face_area &
                                *sqrt(sum(at_surface**2) - dot_product(at_surface, normal)**2)
        sums(s_layer_work) = sums(s_layer_work) + t%plastic_fraction*work
        sums(s_excess_speed) = sums(s_excess_speed) + dt*t%face_area*t%excess_velocity
      end associate
    end do
    call give_heat(scene, particles, contact, rigid, dt, tool)
    call expect_close('sums of a face', maxval(abs(tool%sums - sums)), 0.0_rp, atol=1.0e-13_rp)
    call expect_close('heat of the particles', sum(particles%ps(:, f_heat, 1)), sums(s_to_plate), &
                      atol=1.0e-14_rp)
    call expect_close('hottest face', tool%max_face_temperature, &
                      maxval(particles%ps(1:2, f_temp, 1) + contact%particle(1:2)%temperature_rise))
  end subroutine test_sums_of_face

end program test_shear_layer
