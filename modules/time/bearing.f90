! SPDX-License-Identifier: MIT
!> What walls and clamps bear of the sleepers beyond the rim. Steps book what they bear of awake particles
!> and of the rim; the stress of the others is frozen, and so is its part of their force, which is found
!> when the sleepers change: that on all sleepers less that on the rim.
module time_bearing
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use grid_geometry, only: dilate, halo, storage_nodes
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel
  use time_blocks, only: force_records
  use time_clamps, only: hold_walls
  use time_mirrors, only: fold, r_momentum
  use time_nodes, only: clear_nodes, update_nodes
  use time_rim, only: rim_inertia
  use time_state, only: simulation_t
  use time_update, only: outer_acceleration
  use time_weights, only: weights_of
  use transfer_scatter, only: p2g_block
  implicit none (type, external)
  private

  public :: bear_sleepers

contains

  !> Collective, while the nodes, mirrors and clamps of all particles are listed, the mirrors in the order
  !> of the nodes: the sum must not depend on who is awake, or a resumed run would differ by rounding.
  subroutine bear_sleepers(world, sim, sleepers_stay)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: sleepers_stay         !! on this rank as they were before
    real(rp) :: of_rim(3, size(sim%scene%constraint))
    logical, allocatable :: near(:, :, :)
    logical :: is_known

    if (.not. sim%scene%method%sleep%is_on .or. size(sim%scene%constraint) == 0) return
    if (.not. allocated(sim%sleepers%borne)) allocate (sim%sleepers%borne(3, size(of_rim, 2)), source=0.0_rp)
    is_known = sleepers_stay
    if (sim%n_mapped == sim%particles%nblk) then
      if (.not. is_known) sim%sleepers%borne = 0.0_rp
      is_known = .true.
    end if
    if (world%all_true(is_known)) return
    call mark_held(sim, near)
    call borne_by_walls(world, sim, sim%n_mapped, near, of_rim)
    call borne_by_walls(world, sim, sim%particles%nblk, near, sim%sleepers%borne)
    sim%sleepers%borne = sim%sleepers%borne - of_rim
  end subroutine bear_sleepers

  !> Nodes, as (z, y, x), next to which a particle touches nodes that walls or clamps hold.
  subroutine mark_held(sim, near)
    type(simulation_t), intent(in) :: sim
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: is_held(0:sim%patch%nn)
    integer :: i, k, n(3)

    n = 0
    if (sim%patch%nn > 0) n = sim%patch%all%hi - sim%patch%all%lo + 1
    is_held = .false.
    is_held(sim%mirrors%pair(1, :)) = .true.
    is_held(sim%mirrors%plane(1, :)) = .true.
    is_held(sim%fixed(1, :sim%n_fixed)) = .true.
    do i = 1, sim%n_columns
      do k = 1, 3
        is_held(sim%column(i)%node(k)) = .true.
      end do
    end do
    near = reshape(is_held(1:), n([3, 2, 1]))
    call dilate(near, halo)
  end subroutine mark_held

  !> Force of each wall and clamp on the sleepers up to block `last`, of this rank's nodes [N].
  subroutine borne_by_walls(world, sim, last, near, force)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: last
    logical, intent(in) :: near(sim%patch%nn)
    real(rp), intent(out) :: force(3, size(sim%scene%constraint))
    real(rp) :: books(size(sim%sums)), impulse(3, size(sim%scene%constraint))
    real(rp) :: lost(8, size(sim%scene%constraint)), velocity(3, size(sim%scene%constraint))
    integer :: b, c

    books = sim%sums
    impulse = sim%impulse
    do c = 1, size(sim%scene%constraint)
      velocity(:, c) = sim%scene%constraint(c)%velocity
      sim%scene%constraint(c)%velocity = 0.0_rp      ! what rests needs no impulse to rest
    end do
    call clear_nodes(sim, sim%g)
    do b = sim%n_awake + 1, last
      call give_force(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, near, &
                      sim%particles%ps(:, :, b), sim%g(:, :, 1))
    end do
    lost = 0.0_rp
    call fold(sim, r_momentum, sim%g(:, :, 1), lost)
    call sim%resting_halo%sum(world, 8, sim%patch%nn, sim%g(:, :, 1))
    sim%impulse = 0.0_rp
    call update_nodes(sim, 1.0_rp, sim%g)            ! impulses of a second
    call hold_walls(world, sim, sim%g)
    force = sim%impulse + lost(5:7, :)
    do c = 1, size(sim%scene%constraint)
      sim%scene%constraint(c)%velocity = velocity(:, c)
    end do
    sim%sums = books
    sim%impulse = impulse
    call clear_nodes(sim, sim%g)
  end subroutine borne_by_walls

  !> Mass and force of a block to the nodes, if one of its particles is near a held one.
  subroutine give_force(sim, body, n, nf, near, ps, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    logical, intent(in) :: near(sim%patch%nn)
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: g(8, sim%patch%nn)
    integer :: first(nlane), node(nlane)
    logical :: is_own(nlane)
    real(rp) :: w(nlane, 18)

    call storage_nodes(sim%scene%grid, sim%patch, nlane, ps(1, f_pos), node, is_own)
    if (.not. any(near(node(:n)))) return
    call weights_of(sim, body, nf, ps, w, first)
    call force_records(rim_inertia(sim), 1.0_rp/sim%scene%material(sim%scene%body(body)%material)%rho, &
                       outer_acceleration(sim, body), ps(1, f_mass), ps(1, f_vel), ps(1, f_tau), &
                       ps(1, f_temp), sim%rec)
    call p2g_block(n, w, first, sim%rec, sim%patch%stride, sim%patch%nn, g)
  end subroutine give_force

end module time_bearing
