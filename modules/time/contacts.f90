! SPDX-License-Identifier: MIT
!> Contact between bodies with velocity fields of their own, at the nodes that both have mass on.
module time_contacts
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_pair, only: is_apart, is_stuck, pair_impulse, pair_loss
  use contact_tool, only: s_creep, s_force, s_friction, s_normal, s_press, s_slide, s_to_plate, &
                          s_torque, s_work, tool_t
  use particles_store, only: f_heat, f_mass
  use time_audit, only: e_contact, e_friction
  use time_gaps, only: find_meeting
  use time_meeting, only: moves_as_one
  use time_rigid, only: hold_rigid
  use time_scene, only: scheme_usavg
  use time_state, only: simulation_t
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: touch_bodies, join_bodies, share_increments

  real(rp), parameter :: slack = 0.05_rp   !! overlap that is left alone [cells]

contains

  !> Collective. Change the nodes' velocities to what contact leaves of them, book what it costs and
  !> give the friction heat to the particles.
  subroutine touch_bodies(world, sim, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                 !! [s]
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp) :: record(8, 2)
    integer :: e

    call hold_rigid(sim, dt, g)
    if (.not. sim%meeting%is_known) call find_meeting(world, sim, g)
    sim%meeting%heat = 0.0_rp
    do e = 1, sim%meeting%n
      associate (groups => sim%scene%contact(sim%meeting%pair(e))%group, q => sim%meeting%node(e))
        record = g(:, q, groups)
        call touch_node(sim, e, dt, groups, record)
        g(:, q, groups) = record
      end associate
    end do
    if (sim%scene%method%conducts) call give_heat(sim)
  end subroutine touch_bodies

  !> Collective. Velocities of the nodes that were only interpolated: rigid bodies have their own,
  !> and groups without a &CONTACT one where they meet; `dt` is that of their step [s].
  subroutine join_bodies(world, sim, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp) :: record(8, 2)
    integer :: e, k

    call hold_rigid(sim, dt, g)
    if (.not. sim%meeting%is_known) call find_meeting(world, sim, g)
    do e = 1, sim%meeting%n
      associate (contact => sim%scene%contact(sim%meeting%pair(e)), q => sim%meeting%node(e))
        if (contact%normal /= moves_as_one) cycle
        record = g(:, q, contact%group)
        k = findloc(sim%scene%tool_of(contact%group) > 0, .true., 1)
        if (k == 0) then
          call unite(record)
        else
          record(1:3, 3 - k) = record(1:3, k)
        end if
        g(:, q, contact%group) = record
      end associate
    end do
  end subroutine join_bodies

  !> One entry: records of both bodies at the node.
  subroutine touch_node(sim, e, dt, groups, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: e, groups(2)
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, 2)
    real(rp) :: inverse(2), v(3, 2), before(3), gap, impulse(3), mean(3, 2)
    integer :: k

    associate (meeting => sim%meeting, contact => sim%scene%contact(sim%meeting%pair(e)))
      inverse = 1.0_rp/g(8, :)
      where (sim%scene%tool_of(groups) > 0) inverse = 0.0_rp
      meeting%state(e) = is_stuck
      if (contact%normal == moves_as_one .and. all(inverse > 0.0_rp)) then
        call unite(g)
        return
      end if
      v = g(1:3, :)
      v(:, 2) = v(:, 1) + meeting%free(:, e)*(v(:, 2) - v(:, 1))
      gap = meeting%gap(e)
      if (sim%scene%method%scheme == scheme_usavg) then
        ! half of this way with the old velocity, and in the next step half with the new one
        before = (g(1:3, 2) - g(5:7, 2)) - (g(1:3, 1) - g(5:7, 1))
        gap = gap + 0.5_rp*dt*dot_product(meeting%free(:, e)*before, meeting%normal(:, e))
      end if
      if (contact%normal == moves_as_one) then
        impulse = (v(:, 2) - v(:, 1))/sum(inverse)
      else if (gap > sim%patch%h .or. all(abs(meeting%normal(:, e)) <= 0.0_rp)) then
        meeting%state(e) = is_apart            ! too far to meet within a step
      else
        call pair_impulse(contact%law, dt, gap, slack*sim%patch%h, &
                          meeting%normal(:, e), inverse, v, impulse, meeting%state(e))
      end if
      if (meeting%state(e) == is_apart) return
      do k = 1, 2
        g(1:3, k) = g(1:3, k) + (3 - 2*k)*inverse(k)*impulse
        g(5:7, k) = g(5:7, k) + (3 - 2*k)*inverse(k)*impulse
        mean(:, k) = g(1:3, k) - 0.5_rp*g(5:7, k)
      end do
      call book(sim, e, groups, impulse, mean, g(8, :))
    end associate
  end subroutine touch_node

  !> Two deformable bodies that stick: one velocity, change of velocity and temperature.
  pure subroutine unite(g)
    real(rp), intent(inout) :: g(8, 2)
    real(rp) :: common(7)

    common = (g(8, 1)*g(1:7, 1) + g(8, 2)*g(1:7, 2))/(g(8, 1) + g(8, 2))
    g(1:7, 1) = common
    g(1:7, 2) = common
  end subroutine unite

  !> Energy lost at entry `e`, and what a rigid body feels.
  subroutine book(sim, e, groups, impulse, mean, mass)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: e, groups(2)
    real(rp), intent(in) :: impulse(3), mean(3, 2), mass(2)
    real(rp) :: friction, pressing
    integer :: k

    associate (meeting => sim%meeting, tools => sim%scene%tool_of(groups))
      call pair_loss(meeting%normal(:, e), impulse, mean, friction, pressing)
      meeting%heat(e) = friction/sum(mass)
      if (.not. meeting%is_owned(e)) return
      k = findloc(tools > 0, .true., 1)
      if (k > 0) then
        call settle_rigid(sim%tool(tools(k)), meeting%x(:, e), meeting%normal(:, e), &
                          (2*k - 3)*impulse, mean(:, 3 - k), mean(:, k), friction, pressing)
        if (sim%scene%method%conducts) then
          associate (s => sim%tool(tools(k))%sums(s_to_plate))
            s = s + friction
          end associate
        end if
      else
        sim%sums(e_friction) = sim%sums(e_friction) + friction
        sim%sums(e_contact) = sim%sums(e_contact) + pressing
      end if
    end associate
  end subroutine book

  !> Books of a rigid body that hands `impulse` to a material of velocity `v`.
  pure subroutine settle_rigid(tool, x, normal, impulse, v, rigid, friction, pressing)
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: x(3), normal(3), impulse(3), v(3), rigid(3), friction, pressing
    real(rp) :: r(3), press

    r = x - tool%position
    press = abs(dot_product(impulse, normal))
    associate (s => tool%sums)
      s(s_force:s_force + 2) = s(s_force:s_force + 2) - impulse
      s(s_torque) = s(s_torque) - (r(1)*impulse(2) - r(2)*impulse(1))
      s(s_work) = s(s_work) + dot_product(impulse, rigid)
      s(s_friction) = s(s_friction) + friction
      s(s_normal) = s(s_normal) + pressing
      s(s_press) = s(s_press) + press
      s(s_creep) = s(s_creep) + press*norm2(v - dot_product(v, normal)*normal)
      s(s_slide) = s(s_slide) + press*norm2(rigid - dot_product(rigid, normal)*normal)
    end associate
  end subroutine settle_rigid

  !> Friction heat of the nodes to the particles of both bodies, by their weighted masses.
  subroutine give_heat(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b, k

    if (all(abs(sim%meeting%heat) <= 0.0_rp)) return
    do k = 1, sim%meeting%n_near
      b = sim%meeting%near(k)
      call heat_block(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                      sim%particles%ps(:, :, b))
    end do
  end subroutine give_heat

  subroutine heat_block(sim, body, n, nf, ps)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(inout) :: ps(nlane, nf)
    integer :: e, first(nlane), i, j, k, p, q
    real(rp) :: w(nlane, 18), heat

    call weights_of(sim, body, nf, ps, w, first)
    do p = 1, n
      heat = 0.0_rp
      do i = 1, 3
        do j = 1, 3
          do k = 1, 3
            q = first(p) + (i - 1)*sim%patch%stride(1) + (j - 1)*sim%patch%stride(2) + k - 1
            e = sim%meeting%first(q)
            if (e == 0) cycle
            do while (sim%meeting%node(e) == q)
              if (any(sim%scene%contact(sim%meeting%pair(e))%group &
                      == sim%scene%body(body)%group)) then
                heat = heat + w(p, i)*w(p, 3 + j)*w(p, 6 + k)*sim%meeting%heat(e)
              end if
              e = e + 1
              if (e > sim%meeting%n) exit
            end do
          end do
        end do
      end do
      ps(p, f_heat) = ps(p, f_heat) + sim%scene%method%mass_scaling*ps(p, f_mass)*heat
    end do
  end subroutine heat_block

  !> Velocity increments (lanes 5:7) of a filter must not undo the contact: bodies that touch get a
  !> common one along the normal, bodies that stick one increment; rigid bodies get none.
  subroutine share_increments(sim, g, increment)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp), intent(inout) :: increment(8, sim%patch%nn, sim%n_groups)
    real(rp) :: apart(3), part(2)
    integer :: e, k, r

    do k = 1, sim%n_groups
      if (sim%scene%tool_of(k) == 0) cycle
      do r = 1, sim%n_runs
        increment(5:7, sim%run(1, r):sim%run(2, r), k) = 0.0_rp
      end do
    end do
    associate (meeting => sim%meeting)
      do e = 1, meeting%n
        if (meeting%state(e) == is_apart) cycle
        associate (groups => sim%scene%contact(meeting%pair(e))%group, q => meeting%node(e), &
                   normal => meeting%normal(:, e))
          apart = increment(5:7, q, groups(2)) - increment(5:7, q, groups(1))
          if (meeting%state(e) /= is_stuck) apart = dot_product(apart, normal)*normal
          part = 1.0_rp/g(8, q, groups)
          where (sim%scene%tool_of(groups) > 0) part = 0.0_rp
          part = part/sum(part)
          increment(5:7, q, groups(1)) = increment(5:7, q, groups(1)) + part(1)*apart
          increment(5:7, q, groups(2)) = increment(5:7, q, groups(2)) - part(2)*apart
        end associate
      end do
    end associate
  end subroutine share_increments

end module time_contacts
