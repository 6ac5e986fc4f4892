! SPDX-License-Identifier: MIT
!> Contact of a plate with a plane: the impulses of even loads and of friction.
program test_tool_contact
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_tool_particles, only: velocity_at
  use node_samples, only: balance_of, balance_t, map_particles, set_velocity
  use particles_store, only: f_mass, f_pos
  use state_parts, only: free_simulation, simulation_t
  use step_constraints, only: apply_boundary
  use step_samples, only: add_plane_of_symmetry, add_tool, fill, h, make_flow, noise, plane_tool, &
                          settle, start_scene
  use tool_samples, only: touch, touch_dt
  use tools_sums, only: s_force, s_metal_slip, s_normal_impulse, s_tool_slip
  use tools_tool, only: tool_t
  implicit none (type, external)

  real(rp), parameter :: dt = touch_dt, zero(3) = 0.0_rp, at_rest(3, 3) = 0.0_rp
  type(world_t) :: world

  !> A plate that meets a plane.
  type :: meeting_t
    integer :: axis = 3, side = 1          !! the plane's normal is `side` along `axis`
    real(rp) :: gap = 0.0_rp               !! before the step [m]
    real(rp) :: v(3) = 0.0_rp, w(3) = 0.0_rp   !! velocities of plate and plane [m/s]
    real(rp) :: friction = 0.0_rp
    real(rp) :: strength = 0.0_rp          !! 0: elastic [Pa]
    real(rp) :: mass_scaling = 1.0_rp
    logical :: between_mirrors = .false.   !! else the plate has no end
    logical :: limits_shear = .true.
  end type meeting_t

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_even_load()
  call test_uneven_load()
  call test_stick()
  call test_slide()
  call test_shear_limit()
  call test_kept_friction()
  call end_tests()

contains

  !> A random meeting: `speed` is that of the approach.
  type(meeting_t) function draw(i, speed) result(m)
    integer, intent(in) :: i
    real(rp), intent(in) :: speed
    real(rp) :: u(8)

    call random_number(u)
    m%axis = 1 + mod(i, 3)
    m%side = merge(1, -1, mod(i, 2) == 0)
    m%v = 2.0_rp*speed*(u(1:3) - 0.5_rp)
    m%w = 2.0_rp*speed*(u(4:6) - 0.5_rp)
    m%gap = 0.04_rp*h*u(7)
    m%w(m%axis) = m%v(m%axis) + m%side*(m%gap/dt + speed*u(8))
  end function draw

  pure function normal_of(m) result(n)
    type(meeting_t), intent(in) :: m
    real(rp) :: n(3)

    n = 0.0_rp
    n(m%axis) = m%side
  end function normal_of

  !> The plate, its lower face anywhere in a cell, before the step; columns of particles across it
  !> have random masses, if light nodes do not get more inertia.
  subroutine prepare(m, sim)
    type(meeting_t), intent(in) :: m
    type(simulation_t), intent(inout) :: sim
    type(tool_t) :: tool
    real(rp) :: place(3), u(3)
    integer :: a, b, p, ijk(3)
    logical :: across(3)

    call random_number(u)
    across = [(a /= m%axis, a=1, 3)]
    call start_scene(sim, [3, 3, 3], 3, 1, across .and. .not. m%between_mirrors)
    if (m%between_mirrors) then
      do a = 1, 3
        if (.not. across(a)) cycle
        call add_plane_of_symmetry(sim, a, 0, .true.)
        call add_plane_of_symmetry(sim, a, 3, .false.)
      end do
    end if
    if (m%strength > 0.0_rp) call make_flow(sim, m%strength)
    sim%clock%mass_scaling = m%mass_scaling
    sim%scene%method%scales_light_nodes = m%mass_scaling > 1.0_rp
    tool = plane_tool(normal_of(m))
    tool%friction_coefficient = m%friction
    tool%friction_law%shear_limit = m%limits_shear
    place = h*u - m%gap*normal_of(m)
    if (m%side < 0) place = place + 2.0_rp*h
    call add_tool(sim, tool, place, m%w, 0.0_rp)
    where (across) u = merge(0.2_rp - 0.4_rp*u, 0.0_rp, m%between_mirrors)   ! some reach behind
    call fill(world, sim, 1, u, u + merge(3.0_rp, 2.0_rp, across), 2)
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        ijk = floor(2.0_rp*(sim%particles%ps(p, f_pos:f_pos + 2, b)/h - u))
        ijk(m%axis) = 0
        associate (mass => sim%particles%ps(p, f_mass, b))
          if (m%mass_scaling <= 1.0_rp) mass = mass*(0.5_rp + noise(sum(ijk*[1, 7, 49]), 1))
        end associate
      end do
    end do
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call set_velocity(sim%nodes, m%v, at_rest, sim%nodes%g(:, :, 1))
  end subroutine prepare

  !> What contact is to take from the approach, from its description in docs/method.md: the last
  !> fiftieth of a cell closes in the time in which waves cross 60 cells; a penetration is taken
  !> back in a step, but no faster than the metal moves or, if that is more, than 0.003 of the wave
  !> speed.
  real(rp) function closing_of(m, sim) result(e)
    type(meeting_t), intent(in) :: m
    type(simulation_t), intent(in) :: sim
    real(rp) :: back, speed, time, wave

    wave = sqrt(sim%clock%stiffness/m%mass_scaling)
    time = max(dt, 60.0_rp*h/wave)
    speed = dot_product(m%v - m%w, normal_of(m))
    if (m%gap >= 0.0_rp) then
      e = -speed - min(m%gap, 0.02_rp*h)/time - max(0.0_rp, m%gap - 0.02_rp*h)/dt
    else
      back = min(-m%gap/dt, max(3.0e-3_rp*wave, -speed))
      e = -speed + back + (-m%gap - dt*back)/time
    end if
  end function closing_of

  !> Sum over the ranks of the sums of the tool.
  function sums_of(sim) result(sums)
    type(simulation_t), intent(in) :: sim
    real(rp), allocatable :: sums(:)

    sums = sim%tool(1)%sums
    call world%sum(sums)
  end function sums_of

  !> Largest difference of the velocities of the surfaces in contact from `v` [m/s].
  real(rp) function off_surface(sim, v) result(off)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: v(3)
    integer :: p

    off = 0.0_rp
    do p = 1, sim%contact%n
      associate (t => sim%contact%particle(p))
        off = max(off, maxval(abs(velocity_at(sim%nodes, t%first, t%w, sim%nodes%g) - v)))
      end associate
    end do
  end function off_surface

  !> All ranks together: how many particles touch.
  integer function count_contacts(sim) result(n)
    type(simulation_t), intent(in) :: sim
    integer :: sums(1)

    sums = sim%contact%n
    call world%sum(sums)
    n = sums(1)
  end function count_contacts

  !> Without friction: every surface that touches loses the closing velocity in one pass, wherever
  !> it lies in a cell, along any axis, with scaled masses, in a penetration and between mirrors;
  !> the tool feels the momentum that the plate got.
  subroutine test_even_load()
    type(meeting_t) :: m
    type(simulation_t) :: sim
    type(balance_t) :: after, before
    real(rp), allocatable :: sums(:)
    real(rp) :: e, n(3), v(3)
    integer :: i

    do i = 1, 9
      m = draw(i, 20.0_rp)
      if (i == 4 .or. i == 5) m%mass_scaling = 25.0_rp
      if (i == 2 .or. i == 5) m%gap = -m%gap
      if (i == 5) m%v = m%w - normal_of(m)
      if (i == 4 .or. i == 7) m%strength = 1.0e9_rp
      m%between_mirrors = i >= 6
      n = normal_of(m)
      if (m%between_mirrors) m%v = dot_product(m%v, n)*n
      call prepare(m, sim)
      e = closing_of(m, sim)
      before = balance_of(world, sim, zero, sim%nodes%g)
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call touch(world, sim, norm2(m%v))
      after = balance_of(world, sim, zero, sim%nodes%g)
      call expect('even load: the outermost layer touches', count_contacts(sim) == 36)
      v = m%v + e*n
      call expect_close('even load is carried in one pass', off_surface(sim, v), 0.0_rp, &
                        atol=1.0e-10_rp*norm2(m%v))
      sums = sums_of(sim)
      if (.not. m%between_mirrors) then
        call expect_close('the tool feels the momentum', &
                          norm2(sums(s_force:s_force + 2) + after%momentum - before%momentum), &
                          0.0_rp, atol=1.0e-11_rp*sums(s_normal_impulse))
        call expect_close('normal impulse', sums(s_normal_impulse), &
                          dot_product(after%momentum - before%momentum, n), rtol=1.0e-11_rp)
      end if
      call expect_close('slide: impulse times speed of the tool', sums(s_tool_slip), &
                        sums(s_normal_impulse)*norm2(m%w - dot_product(m%w, n)*n), rtol=1.0e-11_rp)
      call expect_close('creep: impulse times speed of the plate', sums(s_metal_slip), &
                        sums(s_normal_impulse)*norm2(m%v - dot_product(m%v, n)*n), &
                        rtol=1.0e-11_rp, atol=1.0e-12_rp*sums(s_normal_impulse))
      call free_simulation(sim)
    end do
  end subroutine test_even_load

  !> A load that lasts and is uneven over less than a cell: each step starts from the force of the
  !> last one, so that what is left of the closing velocity falls in every step until no surface
  !> enters the tool, along any axis and between mirrors, while the tool feels all of the momentum.
  subroutine test_uneven_load()
    type(meeting_t) :: m
    type(simulation_t) :: sim
    real(rp) :: first, off(1), last, n(3)
    integer :: i, k

    do i = 1, 6
      m = draw(i, 20.0_rp)
      m%gap = -1.0e-9_rp*h                       ! in contact, not in the zone of slow gaps
      if (i == 3) m%mass_scaling = 25.0_rp
      if (i == 2) m%strength = 1.0e12_rp
      m%between_mirrors = i > 3
      n = normal_of(m)
      m%v = dot_product(m%v, n)*n
      m%w = m%v + 20.0_rp*n
      call prepare(m, sim)
      last = huge(last)
      do k = 1, 100
        call set_wave(sim, m, 8.0_rp)
        sim%particles%ps(:, sim%scene%layout%surface_offset, :) = 1.0_rp
        call apply_boundary(sim, dt, sim%nodes%g, .false.)
        call touch(world, sim, norm2(m%v) + 8.0_rp)
        off = off_surface(sim, m%w)
        call world%max(off)
        call expect('what is left of an uneven load falls', off(1) < last)
        if (k == 1) first = off(1)
        last = off(1)
        if (last < 1.0e-3_rp*first) exit
      end do
      call expect('the first step leaves some of it', first > 0.1_rp)
      call expect('in the end nothing is left', last < 1.0e-3_rp*first)
      call free_simulation(sim)
    end do
  end subroutine test_uneven_load

  !> Velocity of the plate, with a wave across it along the normal.
  subroutine set_wave(sim, m, height)
    type(simulation_t), intent(inout) :: sim
    type(meeting_t), intent(in) :: m
    real(rp), intent(in) :: height             !! [m/s]
    real(rp) :: phase, x(3)
    integer :: a, q

    a = 1 + mod(m%axis, 3)
    call set_velocity(sim%nodes, m%v, at_rest, sim%nodes%g(:, :, 1))
    do q = 1, sim%nodes%patch%nn
      x = sim%nodes%patch%position(q)
      phase = height*cos(2.0_rp*acos(-1.0_rp)*x(a)/(3.0_rp*h))
      sim%nodes%g(1:3, q, 1) = sim%nodes%g(1:3, q, 1) + phase*normal_of(m)
    end do
  end subroutine set_wave

  !> Much friction: along the surface the plate gets all of the tool's velocity.
  subroutine test_stick()
    type(meeting_t) :: m
    type(simulation_t) :: sim
    real(rp) :: n(3), v(3)
    integer :: i

    do i = 1, 3
      m = draw(i, 20.0_rp)
      m%friction = 1.0e4_rp
      n = normal_of(m)
      call prepare(m, sim)
      v = m%w + dot_product(m%v - m%w, n)*n + closing_of(m, sim)*n
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call touch(world, sim, norm2(m%v))
      call expect_close('what sticks has the velocity of the tool', off_surface(sim, v), 0.0_rp, &
                        atol=1.0e-10_rp*norm2(m%v))
      call free_simulation(sim)
    end do
  end subroutine test_stick

  !> Little friction: the force on the tool is the coefficient times the normal one, against its
  !> sliding.
  subroutine test_slide()
    type(meeting_t) :: m
    type(simulation_t) :: sim
    real(rp), allocatable :: sums(:)
    real(rp) :: force(3), n(3), slip(3)
    integer :: i

    do i = 1, 3
      m = draw(i, 20.0_rp)
      m%friction = 0.01_rp*i
      n = normal_of(m)
      call prepare(m, sim)
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call touch(world, sim, norm2(m%v))
      sums = sums_of(sim)
      force = sums(s_force:s_force + 2)
      slip = (m%w - m%v) - dot_product(m%w - m%v, n)*n
      call expect_close('normal force', -dot_product(force, n), sums(s_normal_impulse), &
                        rtol=1.0e-11_rp)
      call expect_close('Coulomb friction against the sliding', &
                        norm2(force + sums(s_normal_impulse)*(n + m%friction*slip/norm2(slip))), &
                        0.0_rp, atol=1.0e-11_rp*sums(s_normal_impulse))
      call free_simulation(sim)
    end do
  end subroutine test_slide

  !> Friction of soft metal: the shear strength of its face, strength/sqrt(3), unless the tool's
  !> limit is off.
  subroutine test_shear_limit()
    type(meeting_t) :: m
    type(simulation_t) :: sim
    real(rp), allocatable :: sums(:)
    real(rp) :: along(3), limit, n(3), slip(3)
    integer :: i

    do i = 1, 4
      m = draw(i, 20.0_rp)
      m%friction = 0.5_rp
      m%strength = 1.0e6_rp*i
      m%limits_shear = i < 4
      n = normal_of(m)
      call prepare(m, sim)
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call touch(world, sim, norm2(m%v))
      sums = sums_of(sim)
      along = sums(s_force:s_force + 2) - dot_product(sums(s_force:s_force + 2), n)*n
      slip = (m%w - m%v) - dot_product(m%w - m%v, n)*n
      limit = (3.0_rp*h)**2*m%strength/sqrt(3.0_rp)*dt
      if (i == 4) limit = 0.5_rp*sums(s_normal_impulse)
      call expect('the strength is below what friction could give', limit <= 0.5_rp &
                  *sums(s_normal_impulse))
      call expect_close('shear limit', norm2(along + limit*slip/norm2(slip)), 0.0_rp, &
                        atol=1.0e-10_rp*limit)
      call free_simulation(sim)
    end do
  end subroutine test_shear_limit

  !> What friction could give and does not, since nothing slides, is kept while contact relaxes; it
  subroutine test_kept_friction()
    type(meeting_t) :: m
    type(simulation_t) :: sim
    real(rp), allocatable :: sums(:)
    real(rp) :: kept(1), n(3), relaxation, slip(3)
    integer :: i

    do i = 1, 6
      m = draw(i, 20.0_rp)
      m%friction = 0.3_rp
      if (i > 3) m%strength = 1.0e9_rp
      m%limits_shear = .false.
      n = normal_of(m)
      slip = m%v - dot_product(m%v, n)*n
      m%w = dot_product(m%w, n)*n
      m%v = m%v - slip
      call prepare(m, sim)
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call touch(world, sim, norm2(m%v))
      sums = sums_of(sim)
      kept = sum_of_grip(sim)
      call world%sum(kept)
      relaxation = 60.0_rp*h/sqrt(sim%clock%stiffness)
      call expect_close('friction that is kept', kept(1), &
                        m%friction*sums(s_normal_impulse)*exp(-dt/relaxation), rtol=1.0e-11_rp)
      call expect_close('nothing slides', norm2(sums(s_force:s_force + 2) &
                        + sums(s_normal_impulse)*n), 0.0_rp, atol=1.0e-11_rp*sums(s_normal_impulse))
      call set_velocity(sim%nodes, slip*1.0e4_rp/norm2(slip) + 0.15_rp*h/dt*n, at_rest, &
                        sim%nodes%g(:, :, 1))
      sim%tool(1)%sums = 0.0_rp
      call touch(world, sim, 1.0e4_rp)
      sums = sums_of(sim)
      call expect('nothing touches', sums(s_normal_impulse) <= 0.0_rp)
      call expect_close('what was kept holds', &
                        norm2(sums(s_force:s_force + 2) - kept(1)*slip/norm2(slip)), 0.0_rp, &
                        atol=1.0e-10_rp*kept(1))
      kept = sum_of_grip(sim)
      call world%sum(kept)
      call expect_close('and is spent', kept(1), 0.0_rp, atol=1.0e-10_rp*norm2(sums(s_force:)))
      call free_simulation(sim)
    end do
  end subroutine test_kept_friction

  !> Friction that this rank's particles may yet get [N s].
  real(rp) function sum_of_grip(sim)
    type(simulation_t), intent(in) :: sim
    integer :: b

    sum_of_grip = 0.0_rp
    do b = 1, sim%particles%nblk
      sum_of_grip = sum_of_grip + sum(sim%particles%ps(:sim%particles%count(b), &
                                                       sim%scene%layout%coulomb_reserve, b))
    end do
  end function sum_of_grip

end program test_tool_contact
