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
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: clear_nodes, least_mass
  use particles_store, only: f_mass, f_vel
  use step_simulation, only: simulation_t
  use transfer_gather, only: gather_block, lanes_t
  use transfer_scatter, only: p2g_values_block
  implicit none (type, external)
  private

  public :: remove_null_modes

contains

  !> Collective, after a step (USL, FLIP) and before anything else uses its nodes: v <- v - (d - b)
  !> of the awake particles of bodies that can flow.
  subroutine remove_null_modes(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical :: flows(sim%nodes%n_groups)
    real(rp) :: lost(8, size(sim%scene%symmetry))
    integer :: b, i, k

    flows = [(sim%scene%can_flow(k), k=1, sim%nodes%n_groups)]
    call clear_nodes(sim%nodes, sim%nodes%g2)
    do i = 1, sim%blocks%n_awake
      b = sim%blocks%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      if (flows(k)) call take_unseen(sim, sim%particles%body(b), sim%particles%count(b), &
                                     sim%particles%nf, sim%scene%layout%seen, &
                                     sim%nodes%g(:, :, k), sim%particles%ps(:, :, b), &
                                     sim%nodes%rec, sim%nodes%g2(:, :, k))
    end do
    lost = 0.0_rp                              ! not used
    do k = 1, sim%nodes%n_groups
      call reflect(sim%scene, sim%nodes, sim%boundary, r_filter, sim%nodes%g2(:, :, k), lost)
      call sim%nodes%halo%sum(world, 8, sim%nodes%patch%nn, sim%nodes%g2(:, :, k))
      call divide_by_mass(sim, sim%nodes%g(:, :, k), sim%nodes%g2(:, :, k))
      call restore(sim%scene, sim%nodes, sim%boundary, r_filter, sim%nodes%g2(:, :, k))
    end do
    do i = 1, sim%blocks%n_awake
      b = sim%blocks%turn(i)
      k = sim%scene%body(sim%particles%body(b))%group
      if (flows(k)) call give_back_seen(sim, sim%particles%body(b), sim%particles%count(b), &
                                        sim%particles%nf, sim%scene%layout%seen, &
                                        sim%nodes%g2(:, :, k), sim%nodes%rec, &
                                        sim%particles%ps(:, :, b))
    end do
  end subroutine remove_null_modes

  !> Take d - b from the particles of a block, and add its momentum to the nodes.
  subroutine take_unseen(sim, body, n, nf, seen, g, ps, rec, momentum)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf, seen
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)             !! velocity records
    real(rp), intent(inout) :: ps(nlane, nf), rec(8, 4, nlane), momentum(8, sim%nodes%patch%nn)
    integer :: first(nlane), p
    real(rp) :: unseen(3), u(nlane, 3), w(nlane, 18)

    call gather(sim, body, n, nf, ps, 1, g, rec, w, first, u)
    do p = 1, n
      unseen = ps(p, f_vel:f_vel + 2) - u(p, :) - ps(p, seen:seen + 2)
      ps(p, f_vel:f_vel + 2) = ps(p, f_vel:f_vel + 2) - unseen
      rec(1:3, 1, p) = sim%clock%mass_scaling*ps(p, f_mass)*unseen
      rec(4, 1, p) = 0.0_rp
    end do
    call p2g_values_block(n, w, first, rec, sim%nodes%patch%stride, sim%nodes%patch%nn, momentum)
  end subroutine take_unseen

  !> Momenta, in lanes 1:3, to velocities in lanes 5:7.
  subroutine divide_by_mass(sim, g, momentum)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)             !! velocity records
    real(rp), intent(inout) :: momentum(8, sim%nodes%patch%nn)
    integer :: i, r

    do r = 1, sim%nodes%n_ranges
      do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
        if (g(8, i) > least_mass) momentum(5:7, i) = momentum(1:3, i)/g(8, i)
      end do
    end do
  end subroutine divide_by_mass

  !> Give back to the particles of a block what nodes saw of d - b, and add it to b.
  subroutine give_back_seen(sim, body, n, nf, seen, g, rec, ps)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf, seen
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)             !! in lanes 5:7
    real(rp), intent(inout) :: rec(8, 4, nlane), ps(nlane, nf)
    integer :: a, first(nlane)
    real(rp) :: u(nlane, 3), w(nlane, 18)

    call gather(sim, body, n, nf, ps, 5, g, rec, w, first, u)
    do a = 1, 3
      ps(:n, f_vel + a - 1) = ps(:n, f_vel + a - 1) + u(:n, a)
      ps(:n, seen + a - 1) = ps(:n, seen + a - 1) + u(:n, a)
    end do
  end subroutine give_back_seen

  !> Values `u` of three lanes of the nodes at the particles of a block.
  subroutine gather(sim, body, n, nf, ps, lane, g, rec, w, first, u)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf, lane
    real(rp), intent(in) :: ps(nlane, nf), g(8, sim%nodes%patch%nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp), intent(out) :: w(nlane, 18), u(nlane, 3)
    integer, intent(out) :: first(nlane)
    real(rp) :: none(nlane, 0), no_slopes(nlane, 0)

    call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
    call gather_block(lanes_t(steep=1, n_steep=0, plain=lane, n_plain=3), n, w, first, &
                      sim%nodes%patch%stride, sim%nodes%patch%nn, g, rec, none, no_slopes, u)
  end subroutine gather

end module step_null_modes
