! SPDX-License-Identifier: MIT
!> Removal of null modes: of velocities of particles which no node sees (Gritton & Berzins 2017,
!> Comput. Part. Mech. 4:1; Tran & Solowski 2019, CMAME 347:1082).
!>
!> With S from nodes to particles and S+ back, d = v - S S+ v is what the grid does not give back to
!> the particles. A part of it nodes see all the same, S+ d /= 0, above all at surfaces, where S+
!> takes velocities to the centres of mass instead of the nodes: to take away all of d would be a
!> drag. Each particle keeps an estimate b of that part, the least velocity of the kind S q with
!> S+ (d - b) = 0, and comes nearer to it by one step of its Neumann series at each removal:
!> b <- b + S S+ (d - b). Where motion changes slowly against the time between removals, what is
!> taken, d - b, soon is a null mode to rounding. Momentum is kept in any case.
module step_null_modes
  use base_kinds, only: nlane, rp
  use boundary_symmetry, only: r_filter, reflect, restore
  use comm_world, only: world_t
  use mapping_blocks, only: gather_lanes
  use mapping_nodes, only: clear_nodes, least_inertia, least_mass
  use particles_store, only: f_mass, f_vel
  use step_simulation, only: simulation_t
  use transfer_scatter, only: p2g_values_block
  implicit none (type, external)
  private

  public :: remove_null_modes

  integer, parameter :: first_terms = 30   !! of the series of b before the first removal: at a
                                           !! surface each term halves what is left

contains

  !> Collective, after a step (USL, FLIP) and before anything else uses its nodes: v <- v - (d - b)
  !> of the awake particles of bodies that can flow. The first time b, which is 0, gets near first.
  subroutine remove_null_modes(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical :: flows(sim%nodes%n_groups)
    integer :: k

    flows = [(sim%scene%can_flow(k), k=1, sim%nodes%n_groups)]
    call mark_light(sim, sim%nodes%g)
    if (sim%clock%step < sim%scene%method%null_steps) then
      do k = 1, first_terms
        call improve(world, sim, flows, .false.)
      end do
    end if
    call improve(world, sim, flows, .true.)
  end subroutine remove_null_modes

  !> Lane 4 of the nodes, whose temperature nobody needs any more: 1 where a node has more inertia
  !> against forces than mass. Such nodes do not pass on all momentum when their velocity changes,
  !> so that of all particles near them is left alone.
  subroutine mark_light(sim, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    real(rp) :: least
    integer :: i, k, r

    least = least_inertia(sim%scene, sim%clock)
    do k = 1, sim%nodes%n_groups
      do r = 1, sim%nodes%n_ranges
        do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
          g(4, i, k) = merge(1.0_rp, 0.0_rp, g(8, i, k) < least)
        end do
      end do
    end do
  end subroutine mark_light

  !> Collective. One more term of the series of b, and if so wanted the removal.
  subroutine improve(world, sim, flows, removes)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: flows(sim%nodes%n_groups), removes
    real(rp) :: lost(8, size(sim%scene%symmetry))
    integer :: b, i, k

    call clear_nodes(sim%nodes, sim%nodes%g2)
    do i = 1, sim%blocks%n_awake
      b = sim%blocks%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      if (flows(k)) call take_unseen(sim, sim%particles%body(b), sim%particles%count(b), &
                                     sim%particles%nf, sim%scene%layout%seen, removes, &
                                     sim%nodes%g(:, :, k), sim%particles%ps(:, :, b), &
                                     sim%nodes%rec, sim%nodes%g2(:, :, k))
    end do
    lost = 0.0_rp                              ! not used
    do k = 1, sim%nodes%n_groups
      call reflect(sim%scene, sim%nodes, sim%boundary, r_filter, sim%nodes%g2(:, :, k), lost)
      call sim%nodes%halo%sum(world, 8, sim%nodes%patch%nn, sim%nodes%g2(:, :, k))
      call divide_by_mass(sim, sim%nodes%g2(:, :, k))
      call restore(sim%scene, sim%nodes, sim%boundary, r_filter, sim%nodes%g2(:, :, k))
    end do
    do i = 1, sim%blocks%n_awake
      b = sim%blocks%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      if (flows(k)) call give_back_seen(sim, sim%particles%body(b), sim%particles%count(b), &
                                        sim%particles%nf, sim%scene%layout%seen, removes, &
                                        sim%nodes%g(:, :, k), sim%nodes%g2(:, :, k), &
                                        sim%nodes%rec, &
                                        sim%particles%ps(:, :, b))
    end do
  end subroutine improve

  !> Add the momentum of d - b of a block to the nodes, and take it from the particles.
  subroutine take_unseen(sim, body, n, nf, seen, removes, g, ps, rec, momentum)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf, seen
    logical, intent(in) :: removes
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)             !! velocity records
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), momentum(8, sim%nodes%patch%nn)
    integer :: first(nlane), p
    real(rp) :: unseen(3), u(nlane, 4), w(nlane, 18)

    call gather_lanes(sim%scene, sim%nodes, body, n, nf, ps, 1, 4, g, rec, w, first, u)
    do p = 1, n
      rec(1:4, 1, p) = 0.0_rp
      if (u(p, 4) > 0.0_rp) cycle
      unseen = ps(p, f_vel:f_vel + 2) - u(p, 1:3) - ps(p, seen:seen + 2)
      if (removes) ps(p, f_vel:f_vel + 2) = ps(p, f_vel:f_vel + 2) - unseen
      rec(1:3, 1, p) = sim%clock%mass_scaling*ps(p, f_mass)*unseen
      rec(4, 1, p) = sim%clock%mass_scaling*ps(p, f_mass)
    end do
    call p2g_values_block(n, w, first, rec, sim%nodes%patch%stride, sim%nodes%patch%nn, momentum)
  end subroutine take_unseen

  !> Momenta, in lanes 1:3, to velocities in lanes 5:7, by the mass in lane 4.
  subroutine divide_by_mass(sim, momentum)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(inout) :: momentum(8, sim%nodes%patch%nn)
    integer :: i, r

    do r = 1, sim%nodes%n_ranges
      do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
        if (momentum(4, i) > least_mass) momentum(5:7, i) = momentum(1:3, i)/momentum(4, i)
      end do
    end do
  end subroutine divide_by_mass

  !> Add what nodes saw of d - b to b of the particles of a block, and give it back to them.
  subroutine give_back_seen(sim, body, n, nf, seen, removes, g, velocity, rec, ps)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf, seen
    logical, intent(in) :: removes
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)             !! velocity records
    real(rp), intent(in) :: velocity(8, sim%nodes%patch%nn)      !! in lanes 5:7
    real(rp), intent(inout) :: rec(8, 4, nlane), ps(nlane, nf)
    integer :: a, first(nlane)
    real(rp) :: light(nlane, 1), u(nlane, 3), w(nlane, 18)

    call gather_lanes(sim%scene, sim%nodes, body, n, nf, ps, 4, 1, g, rec, w, first, light)
    call gather_lanes(sim%scene, sim%nodes, body, n, nf, ps, 5, 3, velocity, rec, w, first, u)
    do a = 1, 3
      where (light(:n, 1) > 0.0_rp) u(:n, a) = 0.0_rp
      if (removes) ps(:n, f_vel + a - 1) = ps(:n, f_vel + a - 1) + u(:n, a)
      ps(:n, seen + a - 1) = ps(:n, seen + a - 1) + u(:n, a)
    end do
  end subroutine give_back_seen

end module step_null_modes
