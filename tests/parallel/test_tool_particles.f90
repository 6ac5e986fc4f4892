! SPDX-License-Identifier: MIT
!> Particles in contact with tools: which ones, where their surfaces lie, and what limits their
!> impulses at edges and by the state of the material.
program test_tool_particles
  use base_kinds, only: nlane, pi, rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use contact_tool_particles, only: update_surface_offset
  use node_samples, only: all_of, map_particles, set_velocity
  use particles_store, only: f_bbar, f_jac, f_pos, f_tau, f_temp
  use state_parts, only: free_simulation, simulation_t
  use step_constraints, only: apply_boundary
  use step_samples, only: add_tool, box_tool, fill, h, make_flow, noise, number_of, plane_tool, &
                          room_temperature, settle, shake, shoulder_tool, sphere_tool, start_scene
  use tool_samples, only: middle, settle_plate, start_plate, touch, touch_dt
  use tools_law, only: find_closing_velocity, of_pressure, of_slip, of_temperature
  use tools_sums, only: s_force
  use tools_tool, only: rigid_t
  implicit none (type, external)

  real(rp), parameter :: dt = touch_dt, up(3) = [0.0_rp, 0.0_rp, 1.0_rp]
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_who_touches()
  call test_flatten()
  call test_edges()
  call test_narrow_tool()
  call test_friction_by_state()
  call end_tests()

contains

  !> Tools of all shapes against a plate in a random linear motion: those particles touch whose
  !> surface would be inside at the end of the step, each with the law's closing velocity. The plate
  !> has come nearer since particles were sorted, and half of the tools.
  subroutine test_who_touches()
    type(simulation_t) :: sim
    real(rp), parameter :: shift(3) = 0.5_rp*h*[0.0_rp, 0.0_rp, 1.0_rp]
    real(rp) :: fastest(1), l(3, 3), later, v(3), w(3)
    integer :: a, b, i, n(2)

    do i = 1, 10
      call random_number(l)
      call random_number(v)
      call random_number(w)
      later = merge(2.0e-5_rp, 0.0_rp, mod(i, 2) == 0)
      w = 40.0_rp*(w - [0.5_rp, 0.5_rp, 1.5_rp])
      call start_scene(sim, [5, 5, 2], 3, 1)
      if (mod(i, 3) == 0) call make_flow(sim, 1.0e8_rp)
      select case (mod(i, 5))
      case (0)
        call add_tool(sim, plane_tool([0.0_rp, -0.6_rp, -0.8_rp]), &
                      h*[2.5_rp, 2.5_rp, 1.8_rp] - later*w, w, 0.0_rp)
      case (1)
        call add_tool(sim, sphere_tool(3.0_rp*h), h*[2.2_rp, 2.6_rp, 4.9_rp] - later*w, w, 1.0e4_rp)
      case (2)
        call add_tool(sim, box_tool(h*[1.3_rp, 1.0_rp, 0.9_rp], [0.6_rp, 0.0_rp, 0.8_rp]), &
                      h*[2.2_rp, 2.6_rp, 3.0_rp] - later*w, w, -1.0e4_rp)
      case default
        call add_tool(sim, shoulder_tool(2.0_rp*h, [0.0_rp, 0.1_rp, sqrt(0.99_rp)]), &
                      h*[2.2_rp, 2.6_rp, 2.0_rp + 0.01_rp*i] - later*w, w, 2.0e4_rp)
      end select
      if (mod(i, 4) < 2) sim%tool(1)%friction_coefficient = 0.2_rp
      call fill(world, sim, 1, [0.1_rp, 0.3_rp, -0.3_rp], [5.1_rp, 5.3_rp, 1.7_rp], 2)
      call shake(sim, 0.0_rp, 0.4_rp)
      call settle(world, sim)
      sim%clock%time = later
      sim%clock%displacement = norm2(shift)
      do b = 1, sim%particles%nblk
        do a = 1, 3
          associate (x => sim%particles%ps(:, f_pos + a - 1, b))
            x = x + shift(a)
          end associate
        end do
      end do
      call map_particles(world, sim, 0.0_rp, sim%nodes%g)
      v = 20.0_rp*v - 10.0_rp
      l = 4.0e3_rp*l - 2.0e3_rp
      call set_velocity(sim%nodes, v, l, sim%nodes%g(:, :, 1))
      fastest = maxval(norm2(sim%nodes%g(1:3, :, 1), 1))
      call world%max(fastest)
      call apply_boundary(sim, dt, sim%nodes%g, .false.)
      call touch(world, sim, fastest(1))
      n = 0
      call compare(sim, v, l, n)
      call world%sum(n)
      call expect('some touch, some do not', all(n >= 15))
      call free_simulation(sim)
    end do
  end subroutine test_who_touches

  !> The list of contacts against all particles, in the motion v + L x; how many touch, how many
  !> do not. Velocities agree to the error of the differences that find the way to an edge, 1e-6
  !> cells long in the program.
  subroutine compare(sim, v, l, n)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: v(3), l(3, 3)
    integer, intent(inout) :: n(2)
    type(rigid_t) :: rigid
    real(rp) :: closing, gap, half, normal(3), off, room, slip(3), u(3), x(3), zone
    logical :: can_flow, is_equal, is_listed, is_near, is_whole, touches
    integer :: b, c, p

    rigid = sim%tool(1)%mean_motion(sim%clock%time, dt)
    can_flow = allocated(sim%scene%material(1)%flow)
    zone = 0.02_rp*h
    half = 0.25_rp*h
    is_equal = .true.
    is_whole = .true.
    off = 0.0_rp
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        x = sim%particles%ps(p, f_pos:f_pos + 2, b)
        call sim%tool(1)%distance(x, gap, normal, room)
        u = v + matmul(l, x - half*normal)
        if (.not. can_flow) u = u + matmul(l, to_covered(sim, x, normal, room) &
                                              *(1.0_rp - abs(normal)))
        call sim%tool(1)%distance(x + dt*u, gap, normal, room)
        gap = gap - half
        call find_closing_velocity(dt, dt, zone, &
                                   60.0_rp*h/sqrt(sim%clock%stiffness), &
                                   3.0e-3_rp*sqrt(sim%clock%stiffness), gap, normal, &
                                   u - rigid%velocity_at(x - half*normal + 0.5_rp*dt*u), closing, &
                                   slip)
        touches = gap < zone .and. closing > 0.0_rp
        is_near = sim%tool(1)%friction_coefficient > 0.0_rp .and. gap < half
        n = n + merge([1, 0], [0, 1], touches)
        is_listed = .false.
        do c = 1, sim%contact%n
          associate (t => sim%contact%particle(c))
            if (t%block /= b .or. t%lane /= p) cycle
            is_listed = .true.
            is_equal = is_equal .and. (t%touches .eqv. touches)
            is_whole = is_whole .and. all(t%entry > 0 .or. t%weight <= 0.0_rp)
            off = max(off, norm2(t%normal - normal), norm2(t%slip - slip)/100.0_rp)
            if (t%covered_fraction > 0.0_rp .and. touches) off = max(off, &
                                                                     abs(t%closing_velocity &
                                                                         - closing)/100.0_rp)
          end associate
        end do
        is_equal = is_equal .and. (is_listed .eqv. (touches .or. is_near))
      end do
    end do
    call expect('those whose surface would be inside, or is near if there is friction', is_equal)
    call expect('all their nodes are listed', is_whole)
    call expect_close('their normals and velocities', off, 0.0_rp, atol=1.0e-8_rp)
  end subroutine compare

  !> From `x` to the middle of what the tool covers of a domain there, `room` away from an edge; on
  !> an axis along the normal the place of the surface counts instead.
  function to_covered(sim, x, normal, room) result(way)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(3), normal(3), room
    real(rp) :: way(3), domain(3), gap, less(3), more, step(3), unused(3)
    integer :: a

    way = 0.0_rp
    domain = h*sim%scene%domain(1)
    if (room >= domain(1)) return
    do a = 1, 3
      step = 0.0_rp
      step(a) = 1.0e-3_rp*h
      step = step - dot_product(step, normal)*normal
      call sim%tool(1)%distance(x - step, gap, unused, less(a))
      call sim%tool(1)%distance(x + step, gap, unused, more)
      less(a) = more - less(a)
    end do
    if (norm2(less) > 0.0_rp) way = 0.5_rp*(domain(1) - max(0.0_rp, room))*less/norm2(less)
  end function to_covered

  !> Metal between centre and surface becomes thinner at the rate of the strain along the normal,
  !> and at most half a spacing thick; elastic material is as thick as its deformation makes it.
  subroutine test_flatten()
    type(simulation_t) :: sim
    real(rp), allocatable :: kept(:, :), want(:, :)
    real(rp) :: d, l(3, 3), n(3), room
    integer :: b, c, i, k, p

    do i = 1, 4
      call start_plate(sim, 1 + mod(i, 2), merge(0.0_rp, 1.0e8_rp, i == 4))
      call settle_plate(world, sim)
      k = sim%scene%layout%surface_offset
      allocate (kept(nlane, sim%particles%nblk), source=0.0_rp)
      do b = 1, sim%particles%nblk
        do p = 1, sim%particles%count(b)
          kept(p, b) = 0.01_rp + 0.98_rp*noise(number_of(sim%particles%tag(p, b)), i)
        end do
        sim%particles%ps(:, k, b) = kept(:, b)
      end do
      call touch(world, sim, 40.0_rp)
      call random_number(l)
      l = 3.0e6_rp*(l - 0.5_rp)
      call set_velocity(sim%nodes, 10.0_rp*up, l, sim%nodes%g(:, :, 1))
      want = kept
      if (i == 4) call deform(sim, want)
      do c = 1, sim%contact%n
        if (i == 4) exit
        associate (t => sim%contact%particle(c))
          if (.not. t%touches) cycle
          call sim%tool(1)%distance(sim%particles%ps(t%lane, f_pos:f_pos + 2, t%block), d, n, room)
          want(t%lane, t%block) = min(1.0_rp, kept(t%lane, t%block) &
                                      *exp(dt*dot_product(t%normal, matmul(l, n))))
        end associate
      end do
      sim%particles%ps(:, k, :sim%particles%nblk) = kept
      call update_surface_offset(sim%scene, sim%particles, sim%nodes, sim%contact, dt, sim%nodes%g)
      call expect_close('surfaces come nearer', &
                        maxval(abs(sim%particles%ps(:, k, :sim%particles%nblk) - want)), 0.0_rp, &
                        atol=1.0e-9_rp)
      deallocate (kept, want)
      call free_simulation(sim)
    end do
  end subroutine test_flatten

  !> Give every particle a deformation gradient F of its own; the thickness that is left of a layer
  !> with the normal n now, by the volume over the area (Nanson): det F/|cof F N|, N = F^T n.
  subroutine deform(sim, want)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: want(:, :)
    real(rp) :: area(3), b(3, 3), f(3, 3), first(3), jac
    integer :: c

    do c = 1, sim%contact%n
      associate (t => sim%contact%particle(c))
        if (.not. t%touches) cycle
        call random_number(f)
        f = 0.1_rp*(f - 0.5_rp)
        f(1, 1) = f(1, 1) + 1.0_rp
        f(2, 2) = f(2, 2) + 0.95_rp
        f(3, 3) = f(3, 3) + 0.9_rp
        first = matmul(transpose(f), t%normal)
        area = first(1)*cross(f(:, 2), f(:, 3)) + first(2)*cross(f(:, 3), f(:, 1)) &
               + first(3)*cross(f(:, 1), f(:, 2))
        jac = dot_product(f(:, 1), cross(f(:, 2), f(:, 3)))
        want(t%lane, t%block) = min(1.0_rp, jac*norm2(first)/norm2(area))
        b = matmul(f, transpose(f))/jac**(2.0_rp/3.0_rp)
        associate (ps => sim%particles%ps(t%lane, :, t%block))
          ps(f_jac) = jac
          ps(f_bbar:f_bbar + 5) = [b(1, 1), b(2, 2), b(3, 3), b(1, 2), b(2, 3), b(3, 1)]
        end associate
      end associate
    end do
  end subroutine deform

  pure function cross(a, b)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: cross(3)

    cross = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Metal that flows bears the pressure under a punch for the part of its weight function that is
  !> on the inner side of an edge; elastic material is pushed whole. What would hold it counts all
  !> that touches, whatever part is covered. A point that is deep inside is pushed out at any edge.
  subroutine test_edges()
    type(simulation_t) :: sim
    real(rp), parameter :: v(3) = [3.0_rp, -2.0_rp, 5.0_rp]
    real(rp) :: d, n(3), off, part, room, shear, x(3)
    integer :: c, i, kinds(3)
    logical :: is_out

    kinds = 0
    is_out = .true.
    do i = 1, 4
      call start_plate(sim, 3, merge(1.0e8_rp, 0.0_rp, i > 1))
      call settle_plate(world, sim)
      call set_velocity(sim%nodes, v, spread(0.0_rp*up, 2, 3), sim%nodes%g(:, :, 1))
      call touch(world, sim, 40.0_rp)
      off = 0.0_rp
      do c = 1, sim%contact%n
        associate (t => sim%contact%particle(c), spacing => sim%scene%body(1)%spacing(1))
          x = sim%particles%ps(t%lane, f_pos:f_pos + 2, t%block)
          call sim%tool(1)%distance(x + dt*v, d, n, room)
          part = weight_below(room/h, sim%scene%method%is_bspline, spacing/h)
          if (i == 1) part = 1.0_rp
          shear = dt*spacing**2*1.0e8_rp/sqrt(3.0_rp)
          off = max(off, abs(t%covered_fraction - part), norm2(t%stick_impulse*sum(t%weight &
                    *sim%contact%mass(1, t%entry), t%entry > 0)/t%mass + t%slip)/norm2(t%slip))
          d = d - t%surface_distance + (1.0_rp - part)*spacing*norm2(n)
          kinds = kinds + merge(1, 0, [part < 0.5_rp, part > 0.5_rp .and. part < 0.999_rp, &
                                       part >= 1.0_rp])
          if (part < 0.999_rp) off = max(off, abs(t%max_normal_impulse/((2.0_rp + pi)*shear) &
                                                  - part))
          if (part < 0.999_rp .and. d < -0.1_rp*h) is_out = is_out &
            .and. t%edge_closing_velocity > 0.0_rp
          if (part >= 1.0_rp .or. d > 0.1_rp*h) is_out = is_out &
            .and. .not. t%edge_closing_velocity > 0.0_rp
        end associate
      end do
      call expect_close('part that the tool covers', off, 0.0_rp, atol=1.0e-6_rp)
      call free_simulation(sim)
    end do
    call world%sum(kinds)
    call expect('parts of all sizes', all(kinds > 0))
    call expect('what is deep is pushed out', is_out)
  end subroutine test_edges

  !> Integral of a particle's weight function up to `x` cells, by midpoints.
  pure real(rp) function weight_below(x, is_bspline, spacing) result(part)
    real(rp), intent(in) :: x, spacing
    logical, intent(in) :: is_bspline
    integer, parameter :: n = 4000
    real(rp) :: domain, s
    integer :: k

    if (x > 2.0_rp) then
      part = 1.0_rp
      return
    end if
    domain = merge(1.0_rp, spacing, is_bspline)
    part = 0.0_rp
    do k = 1, n                                  ! x - s runs over the domain
      s = x - domain*((k - 0.5_rp)/n - 0.5_rp)
      s = max(-1.0_rp, min(1.0_rp, s))
      part = part + (0.5_rp + s - 0.5_rp*s*abs(s))/n
    end do
  end function weight_below

  !> Under a box of one cell, wholly near its edges, soft metal bears no more than that.
  subroutine test_narrow_tool()
    type(simulation_t) :: sim
    real(rp) :: most(1)
    real(rp), allocatable :: sums(:)
    real(rp), parameter :: strength = 1.0e5_rp
    integer :: c

    call start_scene(sim, [4, 4, 2], 3, 1)
    call make_flow(sim, strength)
    call add_tool(sim, box_tool(h*[0.5_rp, 0.5_rp, 1.0_rp], up), [middle, 3.0_rp*h], &
                  -20.0_rp*up, 0.0_rp)
    call fill(world, sim, 1, [0.1_rp, 0.2_rp, 0.0_rp], [4.1_rp, 4.2_rp, 2.0_rp], 2)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call apply_boundary(sim, dt, sim%nodes%g, .false.)
    call touch(world, sim, 40.0_rp)
    most = 0.0_rp
    do c = 1, sim%contact%n                      ! some are beyond the edges, with slanted normals
      associate (t => sim%contact%particle(c))
        if (t%closing_velocity > 0.0_rp) most = most - t%covered_fraction*t%normal(3)
      end associate
    end do
    call world%sum(most)
    most = most*dt*(0.5_rp*h)**2*strength/sqrt(3.0_rp)*(2.0_rp + pi)
    sums = all_of(world, sim%tool(1)%sums)
    call expect_close('pressure under an edge', sums(s_force + 2), most(1), rtol=1.0e-10_rp)
    call free_simulation(sim)
  end subroutine test_narrow_tool

  !> A coefficient of friction from a table: of temperature, of the pressure on the surface in the
  !> body, of the speed of sliding with friction.
  subroutine test_friction_by_state()
    type(simulation_t) :: sim
    integer, parameter :: kind(3) = [of_temperature, of_pressure, of_slip]
    real(rp) :: n(3), off, tau(6), want
    integer :: b, c, i

    do i = 1, 6
      call start_plate(sim, 1 + mod(i, 2), 0.0_rp)
      associate (table => sim%tool(1)%friction_table)
        table%of = kind(1 + mod(i, 3))
        table%at = [0.0_rp, 1.0e3_rp]
        if (table%of == of_pressure) table%at = [0.0_rp, 1.0e9_rp]
        table%coefficient = [0.1_rp, 1.1_rp]
      end associate
      call settle_plate(world, sim)
      call random_number(tau)
      tau = 4.0e8_rp*(tau - 0.5_rp) - 2.0e8_rp*[1, 1, 1, 0, 0, 0]
      if (i == 6) tau = -tau
      do b = 1, sim%particles%nblk
        sim%particles%ps(:, f_tau:f_tau + 5, b) = spread(tau, 1, nlane)
        sim%particles%ps(:, f_jac, b) = 1.1_rp
        sim%particles%ps(:, f_temp, b) = room_temperature + 1.0e5_rp*sim%particles%ps(:, f_pos, b)
      end do
      call touch(world, sim, 40.0_rp)
      off = 0.0_rp
      do c = 1, sim%contact%n
        associate (t => sim%contact%particle(c))
          n = t%normal
          select case (sim%tool(1)%friction_table%of)
          case (of_temperature)
            want = 1.0e-3_rp*sim%particles%ps(t%lane, f_temp, t%block)
          case (of_pressure)
            want = -dot_product(n, matmul(reshape(tau([1, 4, 6, 4, 2, 5, 6, 5, 3]), [3, 3]), n)) &
                   /1.1_rp/1.0e9_rp
          case default
            want = 1.0e-3_rp*norm2(t%slip)*(1.0_rp - sim%tool(1)%friction_law%friction( &
                   t%stick_impulse, t%coulomb_impulse, t%max_friction, t%transition))
          end select
          off = max(off, abs(t%coulomb_factor - 0.1_rp - max(0.0_rp, want)))
        end associate
      end do
      call expect_close('friction by the state', off, 0.0_rp, atol=1.0e-10_rp)
      call free_simulation(sim)
    end do
  end subroutine test_friction_by_state

end program test_tool_particles
