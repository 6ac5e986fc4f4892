! SPDX-License-Identifier: MIT
!> Forces of walls and clamps on the sleepers beyond the held layer. Steps record the forces on
!> awake particles and on the layer; the stress of the others is frozen, and so is their part of the
!> force, which is found when the sleepers change: that on all sleepers less that on the layer.
module sleep_held_force
  use base_kinds, only: nlane, rp
  use boundary_clamps, only: hold_walls
  use boundary_symmetry, only: add_lost, reflect, r_momentum
  use grid_geometry, only: halo, storage_nodes
  use grid_marks, only: dilate
  use mapping_blocks, only: force_records, weights_of
  use mapping_nodes, only: clear_nodes, update_nodes
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel
  use simulation_parts, only: simulation_t
  use state_run, only: budget_t, sleepers_t
  use transfer_scatter, only: p2g_block
  use update_constitutive, only: external_acceleration
  implicit none (type, external)
  private

  public :: find_far_force, record_sleeper_impulse

contains

  !> Collective, while the nodes, mirrors and clamps of all particles are listed, the mirrors in the
  !> order of the nodes: the sum must not depend on which particles are awake, or a resumed run
  !> would differ by rounding.
  subroutine find_far_force(sim, sleepers_stay)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: sleepers_stay         !! the sleepers of this rank have not changed
    real(rp) :: of_layer(3, size(sim%scene%condition))
    logical, allocatable :: near(:, :, :)
    logical :: is_known

    if (.not. sim%scene%method%sleep%is_on .or. size(sim%scene%condition) == 0) return
    if (.not. allocated(sim%sleepers%far_force)) then
      allocate (sim%sleepers%far_force(3, size(of_layer, 2)), source=0.0_rp)
    end if
    is_known = sleepers_stay
    if (sim%particles%n_mapped == sim%particles%nblk) then
      if (.not. is_known) sim%sleepers%far_force = 0.0_rp
      is_known = .true.
    end if
    if (sim%world%all_true(is_known)) return
    call mark_held(sim, near)
    call force_on_walls(sim, sim%particles%n_mapped, near, of_layer)
    call force_on_walls(sim, sim%particles%nblk, near, sim%sleepers%far_force)
    sim%sleepers%far_force = sim%sleepers%far_force - of_layer
  end subroutine find_far_force

  !> Record the impulse of walls and clamps in a step on the sleepers beyond the held layer.
  subroutine record_sleeper_impulse(sleepers, budget, dt)
    type(sleepers_t), intent(in) :: sleepers
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt                   !! [s]

    if (allocated(sleepers%far_force)) budget%impulse = budget%impulse + dt*sleepers%far_force
  end subroutine record_sleeper_impulse

  !> Mark the nodes, as (z, y, x), near which a particle reaches nodes held by walls or clamps.
  subroutine mark_held(sim, near)
    type(simulation_t), intent(in) :: sim
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: is_held(0:sim%nodes%patch%nn)
    integer :: i, k, n(3)

    n = 0
    if (sim%nodes%patch%nn > 0) n = sim%nodes%patch%all%hi - sim%nodes%patch%all%lo + 1
    is_held = .false.
    is_held(sim%boundary%mirrors%pair(1, :)) = .true.
    is_held(sim%boundary%mirrors%plane(1, :)) = .true.
    is_held(sim%boundary%fixed(1, :sim%boundary%n_fixed)) = .true.
    do i = 1, sim%boundary%n_columns
      do k = 1, 3
        is_held(sim%boundary%column(i)%node(k)) = .true.
      end do
    end do
    near = reshape(is_held(1:), n([3, 2, 1]))
    call dilate(near, halo)
  end subroutine mark_held

  !> Force of each wall and clamp on the sleepers up to block `last`, at this rank's nodes [N].
  subroutine force_on_walls(sim, last, near, force)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: last
    logical, intent(in) :: near(sim%nodes%patch%nn)
    real(rp), intent(out) :: force(3, size(sim%scene%condition))
    type(budget_t) :: before
    real(rp) :: lost(8, size(sim%scene%symmetry))
    integer :: b

    before = sim%budget
    call clear_nodes(sim%nodes, sim%nodes%g)
    do b = sim%particles%n_awake + 1, last
      call add_force(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, near, &
                     sim%particles%ps(:, :, b), sim%nodes%g(:, :, 1))
    end do
    lost = 0.0_rp
    call reflect(sim, r_momentum, sim%nodes%g(:, :, 1), lost)
    call sim%nodes%resting_halo%sum(sim%world, 8, sim%nodes%patch%nn, sim%nodes%g(:, :, 1))
    sim%budget%impulse = 0.0_rp
    call update_nodes(sim%scene, sim%clock, sim%nodes, 1.0_rp, sim%nodes%g)  ! impulses in a second
    ! Resting material needs no impulse to stay at rest.
    call hold_walls(sim, 0.0_rp, sim%nodes%g)
    force = sim%budget%impulse
    call add_lost(sim%scene, 1.0_rp, lost, force)
    sim%budget = before
    call clear_nodes(sim%nodes, sim%nodes%g)
  end subroutine force_on_walls

  !> Add mass and force of a block to the nodes, if one of its particles is near a held node.
  subroutine add_force(sim, body, n, nf, near, ps, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body, n, nf
    logical, intent(in) :: near(sim%nodes%patch%nn)
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    integer :: first(nlane), node(nlane)
    logical :: is_own(nlane)
    real(rp) :: w(nlane, 18)

    call storage_nodes(sim%scene%grid, sim%nodes%patch, nlane, ps(1, f_pos), node, is_own)
    if (.not. any(near(node(:n)))) return
    call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
    call force_records(sim%clock%mass_scaling, &
                       1.0_rp/sim%scene%material(sim%scene%body(body)%material)%rho, &
                       external_acceleration(sim, body), ps(1, f_mass), ps(1, f_vel), &
                       ps(1, f_tau), ps(1, f_temp), sim%nodes%rec)
    call p2g_block(n, w, first, sim%nodes%rec, sim%nodes%patch%stride, sim%nodes%patch%nn, g)
  end subroutine add_force

end module sleep_held_force
