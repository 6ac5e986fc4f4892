! SPDX-License-Identifier: MIT
!> Contact between bodies with velocity fields of their own, at the nodes with mass of both.
module contact_body_pairs
  use base_kinds, only: rp
  use contact_body_gaps, only: find_node_pairs
  use contact_body_heat, only: give_heat, heat_shares
  use grid_geometry, only: length_along
  use mpm_blocks, only: set_rigid_velocities
  use particles_store, only: particles_t
  use state_budget, only: budget_t, e_contact, e_friction, e_normal_loss
  use state_clock, only: clock_t
  use state_node_pairs, only: node_pairs_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use tools_pair, only: compute_pair_impulse, compute_pair_loss, is_apart, is_stuck, law_coulomb, &
                        moves_as_one, pair_law_t
  use tools_sums, only: s_force, s_friction, s_metal_slip, s_normal_impulse, s_normal_loss, &
                        s_to_plate, s_tool_slip, s_torque, s_work
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: resolve_body_contact, join_bodies, join_increments

  !> Part of the energy lost at nodes that is not given back.
  real(rp), parameter :: withheld_fraction = 0.05_rp
  !> Half the overlap from which impulses are doubled to separate bodies, and the gap up to which
  !> sticking bodies touch [cells].
  real(rp), parameter, public :: slack = 0.05_rp

contains

  !> Collective. Correct the nodal velocities for contact, record the losses and give the friction
  !> heat to the particles.
  subroutine resolve_body_contact(scene, clock, tool, particles, nodes, &
                                  pairs, budget, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(inout) :: tool(:)
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt                 !! time step [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: record(8, 2), surplus
    integer :: e

    call set_rigid_velocities(scene, clock, tool, nodes, dt, g)
    if (.not. pairs%is_known) then
      call find_node_pairs(scene, clock, particles, nodes, pairs, g)
    end if
    surplus = find_surplus(scene, nodes, pairs, budget, dt, g)
    pairs%heat = 0.0_rp
    do e = 1, pairs%n
      associate (groups => scene%contact(pairs%pair(e))%group, q => pairs%node(e))
        record = g(:, q, groups)
        call resolve_pair(scene, tool, nodes, pairs, budget, e, dt, groups, surplus, &
                          record)
        g(:, q, groups) = record
      end associate
    end do
    if (scene%method%conducts) call give_heat(scene, clock, particles, nodes, pairs)
  end subroutine resolve_body_contact

  !> Collective. Surplus of normal impulses by which overlapping bodies are separated in this step,
  !> at most 1. It returns no more energy than contact took from the bodies before, less the
  !> withheld fraction. The loss is a concave function of the surplus, so that its chord is a bound.
  real(rp) function find_surplus(scene, nodes, pairs, budget, dt, g) result(surplus)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    type(budget_t), intent(in) :: budget
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: sums(4)     ! energy taken before; losses of this step without and with surplus;
                            ! losses at nodes [J]
    real(rp) :: taken
    integer :: e

    surplus = 0.0_rp
    if (all(scene%contact%normal == moves_as_one)) return
    sums = [budget%sums(e_contact), 0.0_rp, 0.0_rp, budget%sums(e_normal_loss)]
    do e = 1, pairs%n
      associate (contact => scene%contact(pairs%pair(e)), q => pairs%node(e))
        if (contact%normal == moves_as_one .or. .not. pairs%is_owned(e)) cycle
        if (any(scene%is_rigid_group(contact%group))) cycle
        sums(2) = sums(2) + normal_loss_at(scene, nodes, pairs, e, dt, contact%group, 0.0_rp, &
                                          g(:, q, contact%group))
        if (pairs%state(e) == is_apart) cycle
        sums(3) = sums(3) + normal_loss_at(scene, nodes, pairs, e, dt, contact%group, 1.0_rp, &
                                          g(:, q, contact%group))
      end associate
    end do
    call nodes%halo%world%sum(sums)
    taken = min(sums(1), sums(1) + sums(2)) - withheld_fraction*sums(4)
    if (taken > 0.0_rp) surplus = taken/max(taken, sums(2) - sums(3))
  end function find_surplus

  !> Energy that the normal impulse at entry `e` removes from both bodies [J].
  real(rp) function normal_loss_at(scene, nodes, pairs, e, dt, groups, surplus, g) &
    result(normal_loss)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e, groups(2)
    real(rp), intent(in) :: dt, surplus, g(8, 2)
    real(rp) :: inverse(2), impulse(3), mean(3, 2), friction
    integer :: k

    inverse = 1.0_rp/g(8, :)
    where (scene%is_rigid_group(groups)) inverse = 0.0_rp
    call find_impulse(scene, nodes, pairs, e, dt, surplus, inverse, g, impulse)
    do k = 1, 2
      mean(:, k) = g(1:3, k) - 0.5_rp*g(5:7, k) + 0.5_rp*(3 - 2*k)*inverse(k)*impulse
    end do
    call compute_pair_loss(pairs%normal(:, e), impulse, mean, friction, normal_loss)
  end function normal_loss_at

  !> Collective. Correct interpolated nodal velocities: rigid bodies have their own, and groups
  !> without a &CONTACT a common one where they meet; `dt` is the step of the velocities [s].
  subroutine join_bodies(scene, clock, tool, particles, nodes, pairs, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: record(8, 2)
    integer :: e, k

    call set_rigid_velocities(scene, clock, tool, nodes, dt, g)
    if (.not. pairs%is_known) then
      call find_node_pairs(scene, clock, particles, nodes, pairs, g)
    end if
    do e = 1, pairs%n
      associate (contact => scene%contact(pairs%pair(e)), q => pairs%node(e))
        if (contact%normal /= moves_as_one) cycle
        record = g(:, q, contact%group)
        k = findloc(scene%is_rigid_group(contact%group), .true., 1)
        if (k == 0) then
          call merge_velocities(record)
        else
          record(1:3, 3 - k) = record(1:3, k)
        end if
        g(:, q, contact%group) = record
      end associate
    end do
  end subroutine join_bodies

  !> Resolve contact at one entry with the records of both bodies.
  subroutine resolve_pair(scene, tool, nodes, pairs, budget, e, dt, groups, surplus, g)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(inout) :: tool(:)
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: e, groups(2)
    real(rp), intent(in) :: dt
    real(rp), intent(in) :: surplus              !! surplus of the normal impulse
    real(rp), intent(inout) :: g(8, 2)
    real(rp) :: inverse(2), impulse(3), mean(3, 2)
    integer :: k

    associate (contact => scene%contact(pairs%pair(e)))
      inverse = 1.0_rp/g(8, :)
      where (scene%is_rigid_group(groups)) inverse = 0.0_rp
      pairs%state(e) = is_stuck
      if (contact%normal == moves_as_one .and. all(inverse > 0.0_rp)) then
        call merge_velocities(g)
        return
      end if
      call find_impulse(scene, nodes, pairs, e, dt, surplus, inverse, g, impulse)
      if (pairs%state(e) == is_apart) return
      do k = 1, 2
        g(1:3, k) = g(1:3, k) + (3 - 2*k)*inverse(k)*impulse
        g(5:7, k) = g(5:7, k) + (3 - 2*k)*inverse(k)*impulse
        mean(:, k) = g(1:3, k) - 0.5_rp*g(5:7, k)
      end do
      call record_contact(scene, tool, pairs, budget, e, groups, impulse, mean, g(4, :), g(8, :))
    end associate
  end subroutine resolve_pair

  !> Impulse on the first body at entry `e`, and the state of the entry. Coulomb friction ends where
  !> a body is molten.
  subroutine find_impulse(scene, nodes, pairs, e, dt, surplus, inverse, g, impulse)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e
    real(rp), intent(in) :: dt, surplus, inverse(2), g(8, 2)
    real(rp), intent(out) :: impulse(3)
    real(rp) :: v(3, 2), before(3), gap, h
    type(pair_law_t) :: law

    v = g(1:3, :)
    v(:, 2) = v(:, 1) + pairs%free(:, e)*(v(:, 2) - v(:, 1))
    gap = pairs%gap(e)
    h = length_along(nodes%patch%edges_at(pairs%x(:, e)), pairs%normal(:, e))
    if (pairs%averages_motion) then
      ! USAVG: half the displacement has the old velocity, and half, in the next step, the new one.
      before = (g(1:3, 2) - g(5:7, 2)) - (g(1:3, 1) - g(5:7, 1))
      gap = gap + 0.5_rp*dt*dot_product(pairs%free(:, e)*before, pairs%normal(:, e))
    end if
    impulse = 0.0_rp
    pairs%state(e) = is_stuck
    associate (contact => scene%contact(pairs%pair(e)))
      if (contact%normal == moves_as_one) then
        impulse = (v(:, 2) - v(:, 1))/sum(inverse)
      else if (gap > h .or. all(abs(pairs%normal(:, e)) <= 0.0_rp)) then
        pairs%state(e) = is_apart              ! too far for contact within a step
      else
        law = contact%law
        if (law%kind == law_coulomb .and. any(g(4, :) >= contact%melts_at)) then
          law%friction_coefficient = 0.0_rp
        end if
        call compute_pair_impulse(law, dt, gap, slack*h, &
                                  merge(0.0_rp, surplus, any(inverse <= 0.0_rp)), &
                                  pairs%normal(:, e), inverse, v, impulse, pairs%state(e))
      end if
    end associate
  end subroutine find_impulse

  !> Merge two sticking deformable bodies: common velocity, velocity change and temperature.
  pure subroutine merge_velocities(g)
    real(rp), intent(inout) :: g(8, 2)
    real(rp) :: mean(7)

    mean = (g(8, 1)*g(1:7, 1) + g(8, 2)*g(1:7, 2))/(g(8, 1) + g(8, 2))
    g(1:7, 1) = mean
    g(1:7, 2) = mean
  end subroutine merge_velocities

  !> Record the energy lost at entry `e`, and the reaction on a rigid body. Molten bodies that stick
  !> also lose energy by tangential impulses, which is not counted as friction.
  subroutine record_contact(scene, tool, pairs, budget, e, groups, impulse, mean, temp, mass)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(inout) :: tool(:)
    type(node_pairs_t), intent(inout) :: pairs
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: e, groups(2)
    real(rp), intent(in) :: impulse(3), mean(3, 2), temp(2), mass(2)
    real(rp) :: friction, normal_loss
    integer :: k

    associate (tools => scene%tool_of(groups), contact => scene%contact(pairs%pair(e)))
      call compute_pair_loss(pairs%normal(:, e), impulse, mean, friction, normal_loss)
      if (any(temp >= contact%melts_at)) then
        normal_loss = normal_loss + friction
        friction = 0.0_rp
      end if
      if (scene%method%conducts .and. abs(friction) > 0.0_rp) then
        pairs%heat(:, e) = friction*heat_shares(scene, groups, temp, mass)/mass
      end if
      if (.not. pairs%is_owned(e)) return
      k = findloc(scene%is_rigid_group(groups), .true., 1)
      if (k > 0) then
        call record_rigid_impulse(tool(tools(k)), pairs%x(:, e), pairs%normal(:, e), (2*k - 3) &
                        *impulse, mean(:, 3 - k), mean(:, k), friction, normal_loss)
        if (scene%method%conducts) then
          associate (s => tool(tools(k))%sums(s_to_plate))
            s = s + friction
          end associate
        end if
      else
        budget%sums(e_friction) = budget%sums(e_friction) + friction
        budget%sums(e_contact) = budget%sums(e_contact) + normal_loss
        budget%sums(e_normal_loss) = budget%sums(e_normal_loss) + max(0.0_rp, normal_loss)
      end if
    end associate
  end subroutine record_contact

  !> Add to the sums of a rigid body that exerts `impulse` on a material of velocity `v`.
  pure subroutine record_rigid_impulse(tool, x, normal, impulse, v, rigid, friction, normal_loss)
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: x(3), normal(3), impulse(3), v(3), rigid(3), friction, normal_loss
    real(rp) :: r(3), press

    r = x - tool%position
    press = abs(dot_product(impulse, normal))
    associate (s => tool%sums)
      s(s_force:s_force + 2) = s(s_force:s_force + 2) - impulse
      s(s_torque) = s(s_torque) - (r(1)*impulse(2) - r(2)*impulse(1))
      s(s_work) = s(s_work) + dot_product(impulse, rigid)
      s(s_friction) = s(s_friction) + friction
      s(s_normal_loss) = s(s_normal_loss) + normal_loss
      s(s_normal_impulse) = s(s_normal_impulse) + press
      s(s_metal_slip) = s(s_metal_slip) + press*norm2(v - dot_product(v, normal)*normal)
      s(s_tool_slip) = s(s_tool_slip) + press*norm2(rigid - dot_product(rigid, normal)*normal)
    end associate
  end subroutine record_rigid_impulse

  !> Constrain the velocity increments (lanes 5:7) of a filter, which must not undo the contact:
  !> touching bodies get a common increment along the normal, sticking bodies a common one; rigid
  !> bodies get none.
  subroutine join_increments(scene, nodes, pairs, g, increment)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(inout) :: increment(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: apart(3), part(2)
    integer :: e, k, r

    do k = 1, nodes%n_groups
      if (.not. scene%is_rigid_group(k)) cycle
      do r = 1, nodes%n_ranges
        increment(5:7, nodes%range(1, r):nodes%range(2, r), k) = 0.0_rp
      end do
    end do
    do e = 1, pairs%n
      if (pairs%state(e) == is_apart) cycle
      associate (groups => scene%contact(pairs%pair(e))%group, q => pairs%node(e), &
                 normal => pairs%normal(:, e))
        apart = increment(5:7, q, groups(2)) - increment(5:7, q, groups(1))
        if (pairs%state(e) /= is_stuck) apart = dot_product(apart, normal)*normal
        part = 1.0_rp/g(8, q, groups)
        where (scene%is_rigid_group(groups)) part = 0.0_rp
        part = part/sum(part)
        increment(5:7, q, groups(1)) = increment(5:7, q, groups(1)) + part(1)*apart
        increment(5:7, q, groups(2)) = increment(5:7, q, groups(2)) - part(2)*apart
      end associate
    end do
  end subroutine join_increments

end module contact_body_pairs
