! SPDX-License-Identifier: MIT
!> Forces of walls and clamps on the sleepers beyond the held layer. Steps record the forces on
!> awake particles and on the layer; the stress of the others is frozen, and so is their part of the
!> force, which is found when the sleepers change: that on all sleepers less that on the layer.
module sleep_held_force
  use base_kinds, only: nlane, rp
  use boundary_clamps, only: hold_walls
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: add_lost, reflect, r_momentum
  use comm_world, only: world_t
  use grid_geometry, only: halo, storage_nodes
  use grid_marks, only: dilate
  use mapping_blocks, only: force_records, weights_of
  use mapping_nodes, only: clear_nodes, nodes_t, update_nodes
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel, particles_t
  use sleep_sleepers, only: sleepers_t
  use state_run, only: blocks_t, budget_t, clock_t, step_t
  use state_scene, only: scene_t
  use transfer_scatter, only: p2g_block
  use update_constitutive, only: external_acceleration
  implicit none (type, external)
  private

  public :: find_far_force, record_sleeper_impulse

contains

  !> Collective, while the nodes, mirrors and clamps of all particles are listed, the mirrors in the
  !> order of the nodes: the sum must not depend on which particles are awake, or a resumed run
  !> would differ by rounding.
  subroutine find_far_force(world, scene, clock, step, particles, blocks, nodes, boundary, &
                        sleepers, budget, sleepers_stay)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(sleepers_t), intent(inout) :: sleepers
    type(budget_t), intent(inout) :: budget
    logical, intent(in) :: sleepers_stay         !! the sleepers of this rank have not changed
    real(rp) :: of_layer(3, size(scene%condition))
    logical, allocatable :: near(:, :, :)
    logical :: is_known

    if (.not. scene%method%sleep%is_on .or. size(scene%condition) == 0) return
    if (.not. allocated(sleepers%far_force)) allocate (sleepers%far_force(3, size(of_layer, 2)), &
                                                   source=0.0_rp)
    is_known = sleepers_stay
    if (blocks%n_mapped == particles%nblk) then
      if (.not. is_known) sleepers%far_force = 0.0_rp
      is_known = .true.
    end if
    if (world%all_true(is_known)) return
    call mark_held(nodes, boundary, near)
    call force_on_walls(world, scene, clock, step, particles, blocks, nodes, boundary, budget, &
                        blocks%n_mapped, near, of_layer)
    call force_on_walls(world, scene, clock, step, particles, blocks, nodes, boundary, budget, &
                        particles%nblk, near, sleepers%far_force)
    sleepers%far_force = sleepers%far_force - of_layer
  end subroutine find_far_force

  !> Record the impulse of walls and clamps in a step on the sleepers beyond the held layer.
  subroutine record_sleeper_impulse(sleepers, budget, dt)
    type(sleepers_t), intent(in) :: sleepers
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt                   !! [s]

    if (allocated(sleepers%far_force)) budget%impulse = budget%impulse + dt*sleepers%far_force
  end subroutine record_sleeper_impulse

  !> Mark the nodes, as (z, y, x), near which a particle reaches nodes held by walls or clamps.
  subroutine mark_held(nodes, boundary, near)
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: is_held(0:nodes%patch%nn)
    integer :: i, k, n(3)

    n = 0
    if (nodes%patch%nn > 0) n = nodes%patch%all%hi - nodes%patch%all%lo + 1
    is_held = .false.
    is_held(boundary%mirrors%pair(1, :)) = .true.
    is_held(boundary%mirrors%plane(1, :)) = .true.
    is_held(boundary%fixed(1, :boundary%n_fixed)) = .true.
    do i = 1, boundary%n_columns
      do k = 1, 3
        is_held(boundary%column(i)%node(k)) = .true.
      end do
    end do
    near = reshape(is_held(1:), n([3, 2, 1]))
    call dilate(near, halo)
  end subroutine mark_held

  !> Force of each wall and clamp on the sleepers up to block `last`, at this rank's nodes [N].
  subroutine force_on_walls(world, scene, clock, step, particles, blocks, nodes, boundary, budget, &
                            last, near, force)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(budget_t), intent(inout) :: budget
    integer, intent(in) :: last
    logical, intent(in) :: near(nodes%patch%nn)
    real(rp), intent(out) :: force(3, size(scene%condition))
    type(budget_t) :: before
    real(rp) :: lost(8, size(scene%symmetry))
    integer :: b

    before = budget
    call clear_nodes(nodes, nodes%g)
    do b = blocks%n_awake + 1, last
      call add_force(scene, clock, step, nodes, particles%body(b), particles%count(b), &
                      particles%nf, near, particles%ps(:, :, b), nodes%g(:, :, 1))
    end do
    lost = 0.0_rp
    call reflect(scene, nodes, boundary, r_momentum, nodes%g(:, :, 1), lost)
    call nodes%resting_halo%sum(world, 8, nodes%patch%nn, nodes%g(:, :, 1))
    budget%impulse = 0.0_rp
    call update_nodes(scene, clock, nodes, 1.0_rp, nodes%g)      ! impulses in a second
    ! Resting material needs no impulse to stay at rest.
    call hold_walls(world, scene, clock, nodes, boundary, budget, 0.0_rp, nodes%g)
    force = budget%impulse
    call add_lost(scene, 1.0_rp, lost, force)
    budget = before
    call clear_nodes(nodes, nodes%g)
  end subroutine force_on_walls

  !> Add mass and force of a block to the nodes, if one of its particles is near a held node.
  subroutine add_force(scene, clock, step, nodes, body, n, nf, near, ps, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: body, n, nf
    logical, intent(in) :: near(nodes%patch%nn)
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: first(nlane), node(nlane)
    logical :: is_own(nlane)
    real(rp) :: w(nlane, 18)

    call storage_nodes(scene%grid, nodes%patch, nlane, ps(1, f_pos), node, is_own)
    if (.not. any(near(node(:n)))) return
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call force_records(clock%mass_scaling, 1.0_rp/scene%material(scene%body(body)%material)%rho, &
                       external_acceleration(scene, step, body), ps(1, f_mass), ps(1, f_vel), &
                       ps(1, f_tau), ps(1, f_temp), nodes%rec)
    call p2g_block(n, w, first, nodes%rec, nodes%patch%stride, nodes%patch%nn, g)
  end subroutine add_force

end module sleep_held_force
