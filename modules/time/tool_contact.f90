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
!> beyond the last particle that touches, so that the tool seems wider. Therefore material that can flow
!> is pushed less and less over a cell about a line a little inside an edge that stands out, up to the
!> pressure that metal bears there (time_touch_limits); beyond, it is only held by friction. Elastic material
!> has no such jump and is pushed up to the edge (tests/verification, punch_plane, punch_circle and
!> punch_elastic; docs/method.md).
module time_tool_contact
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_friction_table, only: of_nothing
  use contact_tool, only: rigid_t, tool_t
  use contact_touch, only: held_part, meet
  use particles_store, only: f_mass, f_pos
  use time_ahead, only: share_meanwhile
  use time_candidates, only: candidates_t
  use time_faces, only: surface_weights
  use time_mirrors, only: r_velocity, unfold
  use time_nodes, only: least_inertia, least_mass
  use time_stability, only: wave_speed
  use time_scene, only: scheme_usl
  use time_state, only: simulation_t
  use time_touch_books, only: book_tool, give_heat
  use time_touch_limits, only: limit_impulses
  use time_touch_surface, only: flatten, velocity_at
  use time_touch_walls, only: book_walls, fold_entries, note_held, unfold_entries
  use time_touching, only: add_values, n_values, returned, touch_t, v_coulomb, v_hold, v_push, v_shear
  use time_update, only: report_t
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: touch_tools

  real(rp), parameter :: share = 0.7_rp        !! of the exact impulse: all of it is noisier
  real(rp), parameter :: soft = 0.02_rp        !! zone where gaps close slowly [cells]
  real(rp), parameter :: calm = 60.0_rp        !! time in which they do: waves cross so many cells
  real(rp), parameter :: calm_flow = 30.0_rp   !! in metal that flows, which does not rock on its surface
  real(rp), parameter :: pace = 3.0e-3_rp      !! at which depth is lost in any case [wave speeds]
  real(rp), parameter :: any_pace = huge(1.0_rp)   !! with true masses: limit loads are more even then
  real(rp), parameter :: band = 3.01_rp        !! nodes that touching particles reach [cells]: no
                                               !! whole number, so that all ranks list the same
  real(rp), parameter :: least_share = 1.0e-3_rp   !! of a load that must come back
  real(rp), parameter :: inset = 0.4_rp        !! from edges that stand out, of the line about which the
                                               !! push of metal that flows falls off [cells]
  real(rp), parameter :: fade = 0.75_rp        !! width in which it does [cells]

contains

  !> Collective. Change the velocities of the nodes near tools to what contact leaves of them, keep the
  !> books of the tools and give friction heat to the particles.
  subroutine touch_tools(world, sim, dt, g, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)   !! velocity records
    type(report_t), intent(inout) :: report    !! of blocks that come back meanwhile
    integer :: group, k

    do k = 1, size(sim%tool)
      if (.not. sim%is_near(k)) cycle
      do group = 1, sim%n_groups
        if (sim%scene%tool_of(group) > 0) cycle
        call touch_group(world, sim, k, group, dt, g(:, :, group), report)
      end do
    end do
  end subroutine touch_tools

  subroutine touch_group(world, sim, k, group, dt, g, report)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k, group
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    type(report_t), intent(inout) :: report
    type(rigid_t) :: rigid

    rigid = sim%tool(k)%mean_motion(sim%clock%time, dt)
    call list_nodes(sim, sim%tool(k), g)
    call note_held(sim)
    call find_touching(sim, k, rigid, group, dt, g)
    call add_masses(sim)
    call fold_entries(sim, 2, sim%touching%mass)
    call share_entries(world, sim, dt, g, report, 2, sim%touching%mass)
    call unfold_entries(sim, 2, sim%touching%mass)
    call add_impulses(sim, g)
    sim%touching%own = sim%touching%values
    call fold_entries(sim, n_values, sim%touching%values)
    call share_entries(world, sim, dt, g, report, n_values, sim%touching%values)
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
    type(candidates_t) :: near
    integer :: b
    real(rp) :: gone, reach(size(sim%scene%body)), way

    ! no particle moves faster than the nodes; a distance changes by no more than the way
    way = dt*sim%clock%max_speed + (0.01_rp + soft)*sim%patch%h
    reach = [(way + 0.5_rp*norm2(sim%scene%body(b)%spacing), b=1, size(reach))]
    gone = sim%clock%travel + sim%tool(k)%way()
    call near%init(sim%scene%layout, sim%tool(k)%friction_table%of /= of_nothing)
    do b = 1, sim%n_awake
      associate (body => sim%particles%body(b))
        if (sim%scene%body(body)%group /= group) cycle
        if (sim%clearance(k, b) > reach(body) + gone) cycle
        if (near%n > 0 .and. near%body /= body) call list_touching(sim, sim%tool(k), rigid, dt, g, near)
        call gather_near(sim, sim%tool(k), rigid, b, sim%particles%count(b), reach(body), way, dt, g, near)
      end associate
    end do
    if (near%n > 0) call list_touching(sim, sim%tool(k), rigid, dt, g, near)
  end subroutine find_touching

  !> The candidates of block `b`; whenever there is a block of them it is looked at.
  subroutine gather_near(sim, tool, rigid, b, n, reach, way, dt, g, near)
    type(simulation_t), intent(inout) :: sim
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    integer, intent(in) :: b, n
    real(rp), intent(in) :: reach               !! from the tool of centres that may touch [m]
    real(rp), intent(in) :: way                 !! by which a gap may close in the step [m]
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    type(candidates_t), intent(inout) :: near
    real(rp) :: d(n), gap, half, normal(3), room
    integer :: p

    associate (ps => sim%particles%ps(:, :, b), spacing => sim%scene%body(sim%particles%body(b))%spacing)
      call tool%clearances(n, ps(:, f_pos:f_pos + 2), d)
      do p = 1, n
        if (d(p) > reach) cycle
        call tool%distance(ps(p, f_pos:f_pos + 2), gap, normal, room)
        half = 0.5_rp*ps(p, sim%scene%layout%cover)*norm2(normal*spacing)
        if (gap - half > way) cycle
        call near%add(sim%particles, b, p, normal, half)
        if (near%n == nlane) call list_touching(sim, tool, rigid, dt, g, near)
      end do
    end associate
  end subroutine gather_near

  !> Those of the candidates that touch; no candidates are left.
  subroutine list_touching(sim, tool, rigid, dt, g, near)
    type(simulation_t), intent(inout) :: sim
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    type(candidates_t), intent(inout) :: near
    real(rp) :: w(nlane, 18), zone
    integer :: before, first(nlane), n, p, place(nlane)   ! of a touching particle among the candidates
    type(touch_t) :: touch
    logical :: at_surface

    before = sim%touching%n
    touch%can_flow = allocated(sim%scene%material(sim%scene%body(near%body)%material)%flow)
    at_surface = sim%scene%method%scheme == scheme_usl .or. touch%can_flow
    zone = merge(soft*sim%patch%h, 0.0_rp, at_surface)
    call near%fill_up()
    call weights_of(sim, near%body, sim%scene%layout%n, near%ps, w, first)
    do p = 1, near%n
      touch%block = near%block(p)
      touch%lane = near%lane(p)
      touch%half = near%half(p)
      touch%normal = near%normal(:, p)
      touch%first = first(p)
      touch%inner(:, 1) = w(p, 1:3)
      touch%inner(:, 2) = w(p, 4:6)
      touch%inner(:, 3) = w(p, 7:9)
      touch%w = touch%inner
      if (at_surface) touch%w = surface_weights(sim, near%body, touch%normal, near%ps(p, sim%scene%layout%cover), &
                                                p, sim%scene%layout%n, near%ps, w, first)
      touch%mass = sim%scene%method%mass_scaling*near%ps(p, f_mass)
      if (.not. approaches(sim, tool, rigid, dt, zone, near%ps(p, f_pos:f_pos + 2), &
                           velocity_at(sim, touch%first, touch%w, g), touch)) cycle
      call sim%touching%add_touch(touch)
      place(sim%touching%n - before) = p
    end do
    n = sim%touching%n - before
    call limit_impulses(sim, tool, dt, near, n, place, sim%touching%touch(before + 1:before + n))
    near%n = 0
  end subroutine list_touching

  !> Whether the surface of the particle at `x`, with velocity `v`, would be inside the tool at the end
  !> of the step or comes too fast through the soft zone; how fast it is to be, and its slip.
  logical function approaches(sim, tool, rigid, dt, zone, x, v, touch)
    type(simulation_t), intent(in) :: sim
    type(tool_t), intent(in) :: tool
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt, zone, x(3), v(3)
    type(touch_t), intent(inout) :: touch
    real(rp) :: gap, room, wave

    call tool%distance(x + dt*v, gap, touch%normal, room)
    gap = gap - touch%half
    approaches = gap < zone
    if (.not. approaches) return
    wave = wave_speed(sim)                 ! and no step: smaller ones give the same contact
    call meet(dt, sim%clock%dt, zone, merge(calm_flow, calm, touch%can_flow)*sim%patch%h/wave, &
              merge(pace*wave, any_pace, sim%scene%method%mass_scaling > 1.0_rp), gap, touch%normal, &
              v - rigid%velocity_at(x - touch%half*touch%normal + 0.5_rp*dt*v), touch%closing, touch%slip)
    touch%friction = tool%friction
    approaches = touch%closing > 0.0_rp
    touch%pushed = 1.0_rp
    if (touch%can_flow) touch%pushed = max(0.0_rp, min(1.0_rp, 0.5_rp + (room/sim%patch%h - inset)/fade))
    if (touch%pushed <= 0.0_rp) touch%closing = 0.0_rp
  end function approaches

  !> Masses of the touching particles, and of what of them is pushed, at the nodes.
  subroutine add_masses(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: mass(2)
    integer :: i, p

    associate (touching => sim%touching)
      do p = 1, touching%n
        associate (t => touching%touch(p))
          call touching%spread(sim%patch%stride, t)
          mass = t%mass*[1.0_rp, merge(t%pushed, 0.0_rp, t%closing > 0.0_rp)]
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
          values(v_push:v_push + 2) = min(share*t%pushed*t%mass/s(2)*t%closing, t%most)*t%normal
          values(v_hold:v_hold + 2) = t%hold
          values(v_coulomb) = t%friction*norm2(values(v_push:v_push + 2))
          values(v_shear) = t%shear
          call add_values(t%entry, t%weight, values, touching%n_nodes, touching%values)
        end associate
      end do
    end associate
  end subroutine add_impulses

  !> Sum over the ranks.
  subroutine share_entries(world, sim, dt, g, report, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%patch%nn)
    type(report_t), intent(inout) :: report
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%touching%n_nodes)

    call share_meanwhile(world, sim, dt, g, report, sim%touching%place, sim%touching%n_nodes, &
                         sim%touching%node, width, values)
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
