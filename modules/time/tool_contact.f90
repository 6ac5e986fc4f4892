! SPDX-License-Identifier: MIT
!> Contact of material points with rigid analytic tools, within the step.
!>
!> With the velocities that the nodes would have without contact, a particle whose surface would be
!> inside the tool at the end of the step touches: its surface is to lose the velocity e along the
!> tool's normal. Velocities are those of the surface, and impulses act there, by the weights of a
!> face (time_faces): an even pressure and the stress that belongs to it cancel at every node, and
!> what sticks has the tool's velocity where it touches, not half a spacing farther out (how far out,
!> says time_touch_surface). The impulse
!> m e/s goes to the nodes by these weights w; s = sum w c_i/m_i, c_i the mass of the touching
!> particles at node i, is the share of an even load that comes back to the particle, so that even
!> loads are carried exactly in one pass. Friction is limited at the nodes, where the
!> pressure of neighbouring particles is already averaged: by Coulomb's law and by the shear strength
!> of the material. With MUSL and USAVG, whose strains follow velocities mapped again from the centres
!> of particles, contact of elastic material happens at the centres: an impulse on the light nodes
!> outside would not reach the strain, and a bar that hits a tool would ring for long.
!>
!> At the edge of a tool the velocity of metal that flows jumps; on the grid it falls off over a cell
!> beyond the last particle that touches, so that the tool seems wider by half a cell. Therefore
!> material that can flow is not pushed within half a cell of an edge that stands out, only held by
!> friction. Elastic material has no such jump and is pushed up to the edge (tests/verification,
!> punch_plane, punch_circle and punch_elastic).
module time_tool_contact
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_friction_table, only: friction_table_t, of_nothing
  use contact_tool, only: rigid_t, tool_t
  use contact_touch, only: held_part, meet
  use particles_store, only: f_jac, f_mass, f_plastic, f_pos, f_tau, f_temp
  use physics_stress, only: flow_strength
  use time_faces, only: surface_weights
  use time_mirrors, only: r_velocity, unfold
  use time_nodes, only: least_inertia, least_mass
  use time_stability, only: wave_speed
  use time_state, only: scheme_usl, simulation_t
  use time_touch_books, only: book_tool, give_heat
  use time_touch_surface, only: flatten, velocity_at
  use time_touch_walls, only: book_walls, fold_entries, note_held, unfold_entries
  use time_touching, only: add_values, n_values, returned, touch_t, v_coulomb, v_hold, v_push, v_shear
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: touch_tools

  real(rp), parameter :: share = 0.7_rp        !! of the exact impulse: all of it is noisier
  real(rp), parameter :: soft = 0.02_rp        !! zone where gaps close slowly [cells]
  real(rp), parameter :: calm = 60.0_rp        !! time in which they do: waves cross so many cells
  real(rp), parameter :: pace = 3.0e-3_rp      !! at which depth is lost in any case [wave speeds]
  real(rp), parameter :: any_pace = huge(1.0_rp)   !! with true masses: limit loads are more even then
  real(rp), parameter :: band = 3.01_rp        !! nodes that touching particles reach [cells]: no
                                               !! whole number, so that all ranks list the same
  real(rp), parameter :: least_share = 1.0e-3_rp   !! of a load that must come back
  real(rp), parameter :: inset = 0.5_rp        !! of edges that stand out, in metal that flows [cells]
  real(rp), parameter :: unlimited = 1.0e30_rp     !! shear strength of an elastic material

contains

  !> Collective. Change the velocities of the nodes near tools to what contact leaves of them, keep the
  !> books of the tools and give friction heat to the particles.
  subroutine touch_tools(world, sim, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)   !! velocity records
    integer :: group, k

    do k = 1, size(sim%tool)
      if (.not. sim%is_near(k)) cycle
      do group = 1, sim%n_groups
        if (sim%scene%tool_of(group) > 0) cycle
        call touch_group(world, sim, k, group, dt, g(:, :, group))
      end do
    end do
  end subroutine touch_tools

  subroutine touch_group(world, sim, k, group, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    type(rigid_t) :: rigid

    rigid = sim%tool(k)%mean_motion(sim%clock%time, dt)
    call list_nodes(sim, sim%tool(k), g)
    call note_held(sim)
    call find_touching(sim, k, rigid, group, dt, g)
    call add_masses(sim)
    call fold_entries(sim, 2, sim%touching%mass)
    call share_entries(world, sim, 2, sim%touching%mass)
    call unfold_entries(sim, 2, sim%touching%mass)
    call add_impulses(sim, g)
    sim%touching%own = sim%touching%values
    call fold_entries(sim, n_values, sim%touching%values)
    call share_entries(world, sim, n_values, sim%touching%values)
    call push_nodes(sim, g)
    call unfold(sim, r_velocity, g)
    call flatten(sim, dt, g)
    call book_tool(sim, rigid, sim%tool(k), g)
    call give_heat(sim, sim%tool(k)%heat_share)
  end subroutine touch_group

  !> List the nodes with mass near the tool, or in the box around one that has ends: the same on all
  !> ranks that store them.
  subroutine list_nodes(sim, tool, g)
    type(simulation_t), intent(inout) :: sim
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: g(8, sim%patch%nn)
    real(rp) :: lower(3), upper(3), room, x(3)
    integer :: first, i, last, r
    logical :: is_bounded

    room = band*sim%patch%h
    call tool%bounds(lower, upper)
    where (sim%scene%grid%period > 0) lower = -huge(1.0_rp)
    where (sim%scene%grid%period > 0) upper = huge(1.0_rp)
    is_bounded = all(abs([lower, upper]) < huge(1.0_rp))
    call sim%touching%forget(sim%patch%nn)
    do r = 1, sim%n_runs
      x = sim%patch%position(sim%run(1, r))
      if (any(x(1:2) < lower(1:2) - room) .or. any(x(1:2) > upper(1:2) + room)) cycle
      first = sim%run(1, r)
      last = sim%run(2, r)
      if (is_bounded) then                       ! a run goes up
        last = first + floor(min(real(last - first, rp), (upper(3) + room - x(3))/sim%patch%h))
        first = first + ceiling(max(0.0_rp, (lower(3) - room - x(3))/sim%patch%h))
      end if
      do i = first, last
        if (g(8, i) <= least_mass) cycle
        if (.not. is_bounded) then
          if (nearest_image(sim, tool, sim%patch%position(i)) >= room) cycle
        end if
        call sim%touching%add_node(i)
      end do
    end do
    call sim%touching%prepare()
  end subroutine list_nodes

  !> Distance of the tool from the image of `x` that is nearest to it [m].
  pure real(rp) function nearest_image(sim, tool, x)
    type(simulation_t), intent(in) :: sim
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: x(3)
    real(rp) :: d, length(3), n(3), room
    integer :: i, j, k, turns(3)

    length = sim%patch%h*real(sim%patch%period, rp)
    turns = merge(2, 0, sim%patch%period > 0)
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
  subroutine find_touching(sim, k, rigid, group, dt, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k                    !! tool
    type(rigid_t), intent(in) :: rigid
    integer, intent(in) :: group
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    integer :: b
    real(rp) :: gone, reach(size(sim%scene%body)), way

    ! no particle moves faster than the nodes; a distance changes by no more than the way
    way = dt*sim%clock%max_speed + (0.01_rp + soft)*sim%patch%h
    reach = [(way + 0.5_rp*norm2(sim%scene%body(b)%spacing), b=1, size(reach))]
    gone = sim%clock%travel + sim%tool(k)%way()
    do b = 1, sim%n_awake
      associate (body => sim%particles%body(b))
        if (sim%scene%body(body)%group /= group) cycle
        if (sim%clearance(k, b) > reach(body) + gone) cycle
        call visit_block(sim, sim%tool(k), rigid, b, body, sim%particles%count(b), dt, way, &
                         reach(body), sim%particles%nf, sim%particles%ps(:, :, b), g)
      end associate
    end do
  end subroutine find_touching

  subroutine visit_block(sim, tool, rigid, b, body, n, dt, way, reach, nf, ps, g)
    type(simulation_t), intent(inout) :: sim
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    integer, intent(in) :: b, body, n, nf
    real(rp), intent(in) :: dt, ps(nlane, nf), g(8, sim%patch%nn)
    real(rp), intent(in) :: way                 !! by which a gap may close in the step [m]
    real(rp), intent(in) :: reach               !! from the tool of centres that may touch [m]
    real(rp) :: cover, d(n), edge, gap, room, rate(nlane), strength(nlane)
    real(rp) :: w(nlane, 18), x(3), zone
    integer :: before, first(nlane), i, p
    type(touch_t) :: touch
    logical :: at_surface

    before = sim%touching%n
    edge = 0.0_rp
    if (allocated(sim%scene%material(sim%scene%body(body)%material)%flow)) edge = inset*sim%patch%h
    at_surface = sim%scene%method%scheme == scheme_usl .or. edge > 0.0_rp
    zone = merge(soft*sim%patch%h, 0.0_rp, at_surface)
    call tool%clearances(n, ps(1, f_pos), d)
    do p = 1, n
      if (d(p) > reach) cycle
      x = ps(p, f_pos:f_pos + 2)
      call tool%distance(x, gap, touch%normal, room)
      cover = ps(p, sim%scene%layout%cover)
      touch%half = 0.5_rp*cover*norm2(touch%normal*sim%scene%body(body)%spacing)
      if (gap - touch%half > way) cycle
      if (before == sim%touching%n) call weights_of(sim, body, nf, ps, w, first)
      touch%block = b
      touch%lane = p
      touch%can_flow = edge > 0.0_rp
      touch%first = first(p)
      touch%inner(:, 1) = w(p, 1:3)
      touch%inner(:, 2) = w(p, 4:6)
      touch%inner(:, 3) = w(p, 7:9)
      touch%w = touch%inner
      if (at_surface) touch%w = surface_weights(sim, body, touch%normal, cover, p, nf, ps, w, first)
      touch%mass = sim%scene%method%mass_scaling*ps(p, f_mass)
      if (approaches(sim, tool, rigid, dt, edge, zone, x, &
                     velocity_at(sim, touch%first, touch%w, g), touch)) &
        call sim%touching%add_touch(touch)
    end do
    if (sim%touching%n == before) return
    rate = 1.0_rp
    do i = before + 1, sim%touching%n
      associate (t => sim%touching%touch(i))
        rate(t%lane) = norm2(t%slip)/(sqrt(3.0_rp)*sim%scene%body(body)%mean_spacing())
      end associate
    end do
    call flow_strength(sim%scene%material(sim%scene%body(body)%material), ps(1, f_plastic), &
                       ps(1, f_temp), rate, sim%scene%layout%n_law, &
                       ps(1, sim%scene%layout%law), strength)
    do i = before + 1, sim%touching%n
      associate (t => sim%touching%touch(i), spacing => sim%scene%body(body)%spacing)
        t%shear = unlimited
        if (tool%shear_limit .and. strength(t%lane) > 0.0_rp) then
          t%shear = dt*strength(t%lane)/sqrt(3.0_rp)*product(spacing)/norm2(t%normal*spacing)
        end if
      end associate
    end do
    if (tool%friction_table%of /= of_nothing) then
      call look_up_friction(tool%friction_table, n, nf, ps, &
                            sim%touching%touch(before + 1:sim%touching%n))
    end if
  end subroutine visit_block

  !> Coefficients of friction of the touching particles of a block, from their temperature, the
  !> pressure on the tool's surface in the body, or the speed of sliding.
  pure subroutine look_up_friction(table, n, nf, ps, touch)
    type(friction_table_t), intent(in) :: table
    integer, intent(in) :: n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    type(touch_t), intent(inout) :: touch(:)
    real(rp), dimension(nlane) :: mu, pressure, slip
    integer :: i

    pressure = 0.0_rp
    slip = 0.0_rp
    do i = 1, size(touch)
      associate (a => touch(i)%normal, tau => ps(touch(i)%lane, f_tau:f_tau + 5), &
                 p => touch(i)%lane)
        pressure(p) = max(0.0_rp, -(sum(a**2*tau(1:3)) + 2.0_rp*(a(1)*a(2)*tau(4) &
                          + a(2)*a(3)*tau(5) + a(1)*a(3)*tau(6)))/ps(p, f_jac))
        slip(p) = norm2(touch(i)%slip)
      end associate
    end do
    call table%coefficients(n, ps(1, f_temp), pressure, slip, mu)
    touch%friction = mu(touch%lane)
  end subroutine look_up_friction

  !> Whether the surface of the particle at `x`, with velocity `v`, would be inside the tool at the end
  !> of the step or comes too fast through the soft zone; how fast it is to be, and its slip.
  logical function approaches(sim, tool, rigid, dt, edge, zone, x, v, touch)
    type(simulation_t), intent(in) :: sim
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt, edge, zone, x(3), v(3)
    type(touch_t), intent(inout) :: touch
    real(rp) :: gap, room, wave

    call tool%distance(x + dt*v, gap, touch%normal, room)
    gap = gap - touch%half
    approaches = gap < zone
    if (.not. approaches) return
    wave = wave_speed(sim)                 ! and no step: smaller ones give the same contact
    call meet(dt, sim%clock%dt, zone, calm*sim%patch%h/wave, &
              merge(pace*wave, any_pace, sim%scene%method%mass_scaling > 1.0_rp), gap, touch%normal, &
              v - rigid%velocity_at(x - touch%half*touch%normal + 0.5_rp*dt*v), touch%closing, touch%slip)
    touch%friction = tool%friction
    approaches = touch%closing > 0.0_rp
    if (room < edge) touch%closing = 0.0_rp
  end function approaches

  !> Masses of the touching and of the pushed particles at the nodes.
  subroutine add_masses(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: mass(2)
    integer :: i, p

    associate (touching => sim%touching)
      do p = 1, touching%n
        associate (t => touching%touch(p))
          call touching%spread(sim%patch%stride, t)
          mass = t%mass*[1.0_rp, merge(1.0_rp, 0.0_rp, t%closing > 0.0_rp)]
          do i = 1, 27
            if (t%entry(i) == 0) cycle
            touching%mass(:, t%entry(i)) = touching%mass(:, t%entry(i)) + t%weight(i)*mass
          end do
        end associate
      end do
    end associate
  end subroutine add_masses

  !> Impulses of the touching particles at the nodes.
  subroutine add_impulses(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn)
    real(rp) :: least, s(2), values(n_values)
    integer :: e, p

    least = least_inertia(sim%scene)
    associate (touching => sim%touching)
      do e = 1, touching%n_nodes
        touching%mass(:, e) = touching%mass(:, e)/max(least, g(8, touching%node(e)))
      end do
      do p = 1, touching%n
        associate (t => touching%touch(p))
          s = max(least_share, returned(t%entry, t%weight, t%normal**2, touching%n_nodes, &
                                        touching%free, touching%mass))
          t%hold = -t%mass/s(1)*t%slip
          values(v_push:v_push + 2) = share*t%mass/s(2)*t%closing*t%normal
          values(v_hold:v_hold + 2) = t%hold
          values(v_coulomb) = t%friction*norm2(values(v_push:v_push + 2))
          values(v_shear) = t%shear
          call add_values(t%entry, t%weight, values, touching%n_nodes, touching%values)
        end associate
      end do
    end associate
  end subroutine add_impulses

  !> Sum over the ranks.
  subroutine share_entries(world, sim, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%touching%n_nodes)

    call sim%halo%combine(world, .false., sim%patch%nn, sim%touching%place, &
                          sim%touching%n_nodes, sim%touching%node, width, values)
  end subroutine share_entries

  !> New velocities of the listed nodes, as far as walls let them; what walls take of the impulse.
  subroutine push_nodes(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    real(rp) :: jump(3), least
    integer :: e

    least = least_inertia(sim%scene)
    associate (t => sim%touching)
      do e = 1, t%n_nodes
        t%part(e) = held_part(t%values(v_hold:v_hold + 2, e), t%values(v_coulomb, e), &
                              t%values(v_shear, e))
        associate (record => g(:, t%node(e)))
          jump = t%free(:, e)/max(least, record(8))*(t%values(v_push:v_push + 2, e) &
                                         + t%part(e)*t%values(v_hold:v_hold + 2, e))
          record(1:3) = record(1:3) + jump
          record(5:7) = record(5:7) + jump
        end associate
      end do
    end associate
    call unfold_entries(sim, 1, sim%touching%part)
    call book_walls(sim, g)
  end subroutine push_nodes

end module time_tool_contact
