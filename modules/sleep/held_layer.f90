! SPDX-License-Identifier: MIT
!> Held layer: sleepers that share nodes with awake particles. Their mass, frozen force and heat do
!> not change until the next sort or conduction step, so they are gathered once and added to the
!> nodes in every step. The shared nodes are held at rest. The impulse that holds them measures the
!> load by awake material, which shows when the stress of the sleepers is outdated and they have to
!> wake (sleep_cubes).
!>
!> Held nodes do not drift, as nodes would that sleepers only damp: a slowly pressed rod carries its
!> full load. Held nodes reflect waves, which the awake material has to dissipate.
!>
!> Forces of walls and clamps on the sleepers beyond the held layer. Steps record the forces on
!> awake particles and on the layer. The stress of the other sleepers is frozen, and so is the force
!> on them. It is found when the sleepers change: the force on all sleepers less the force on the
!> layer.
module sleep_held_layer
  use base_kinds, only: nlane, rp
  use boundary_clamps, only: hold_walls
  use boundary_symmetry, only: add_lost, r_momentum, reflect
  use grid_geometry, only: halo, storage_nodes
  use grid_neighbours, only: dilate
  use mpm_blocks, only: force_records, weights_of
  use mpm_constitutive, only: external_acceleration
  use mpm_fbar, only: clear_volume
  use mpm_sweeps, only: force_to_grid
  use particles_block, only: block_t, view_block
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel, particles_t
  use state_budget, only: budget_t, e_sleep
  use state_clock, only: clock_t
  use state_nodes, only: clear_nodes, full_mass, min_node_inertia, nodes_t, update_nodes
  use state_scene, only: scene_t
  use state_sleepers, only: sleepers_t
  use transfer_scatter, only: p2g_block
  implicit none (type, external)
  private

  public :: add_layer, find_far_force, freeze_layer, hold_layer, record_sleeper_impulse

  !> Fraction of a node's mass below which no awake particle is near.
  real(rp), parameter :: negligible = 1.0e-9_rp
  !> Mass of a node, over a full one, that a particle gives it by reaching past it by the rounding
  !> errors of 1e4 steps: the square of the length in cells.
  real(rp), parameter :: touch = (1.0e4_rp*epsilon(1.0_rp))**2

contains

  !> Collective. Gather the contributions of the layer, if they may have changed.
  subroutine freeze_layer(scene, clock, particles, nodes, sleepers)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    type(block_t) :: block
    integer :: b

    if (.not. scene%method%sleep%is_on .or. .not. sleepers%layer%is_stale) return
    sleepers%layer%is_stale = .false.
    call clear_nodes(nodes, nodes%g)
    call clear_volume(scene, nodes)
    do b = particles%n_awake + 1, particles%n_mapped
      call view_block(particles, b, block)
      call force_to_grid(scene, clock, nodes, block, nodes%g(:, :, 1))
    end do
    call store_layer_records(scene, nodes, sleepers, nodes%g(:, :, 1))
    call reflect(scene, nodes, r_momentum, nodes%g(:, :, 1), &
                 nodes%boundary%mirrors%lost, nodes%boundary%mirrors%mass_behind(:, 1))
    nodes%boundary%mirrors%resting_mass_behind = nodes%boundary%mirrors%mass_behind(:, 1)
    call nodes%halo%sum(8, nodes%patch%nn, nodes%g(:, :, 1))
    call list_held(scene, clock, nodes, sleepers, nodes%g(:, :, 1))
  end subroutine freeze_layer

  !> Store the records of this rank's sleepers: the nodes of `g` that have mass.
  subroutine store_layer_records(scene, nodes, sleepers, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    integer :: i

    associate (layer => sleepers%layer)
      layer%node = nodes_with_mass(nodes, g, 0.0_rp)
      layer%record = g(:, layer%node)
      if (allocated(layer%volume)) deallocate (layer%volume)
      allocate (layer%volume(2*size(scene%body), size(layer%node)), source=0.0_rp)
      if (.not. allocated(nodes%volume)) return
      do i = 1, size(layer%node)
        layer%volume(:, i) = nodes%volume(:, layer%node(i))
      end do
    end associate
  end subroutine store_layer_records

  !> List the nodes to hold: those with mass of sleepers of any rank. A sleeper whose domain ends at
  !> a node, within the rounding of its position, does not hold it.
  subroutine list_held(scene, clock, nodes, sleepers, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    integer :: i, r

    associate (layer => sleepers%layer)
      layer%held = nodes_with_mass(nodes, g, touch*full_mass(scene, clock))
      layer%mass = g(1, layer%held)
      layer%is_own = [(.false., i=1, size(layer%held))]
      i = 0
      do r = 1, nodes%n_ranges
        do while (i < size(layer%held))
          if (layer%held(i + 1) > nodes%range(2, r)) exit
          i = i + 1
          layer%is_own(i) = nodes%range(3, r) == 1
        end do
      end do
      if (allocated(layer%impulse)) deallocate (layer%impulse)
      allocate (layer%impulse(3, size(layer%held)), source=0.0_rp)
    end associate
  end subroutine list_held

  !> Nodes in use with more mass than `least` [kg], in ascending order.
  pure function nodes_with_mass(nodes, g, least) result(list)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: least
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    integer, allocatable :: list(:)
    integer :: n, pass, q, r

    do pass = 1, 2
      n = 0
      do r = 1, nodes%n_ranges
        do q = nodes%range(1, r), nodes%range(2, r)
          if (.not. g(1, q) > least) cycle
          n = n + 1
          if (pass == 2) list(n) = q
        end do
      end do
      if (pass == 1) allocate (list(n))
    end do
  end function nodes_with_mass

  !> Add the records of the held layer to the records of its nodes.
  subroutine add_layer(nodes, sleepers, g)
    type(nodes_t), intent(inout) :: nodes
    type(sleepers_t), intent(in) :: sleepers
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: i, q

    if (.not. allocated(sleepers%layer%node)) return
    do i = 1, size(sleepers%layer%node)
      q = sleepers%layer%node(i)
      g(:, q) = g(:, q) + sleepers%layer%record(:, i)
      if (allocated(nodes%volume)) then
        nodes%volume(:, q) = nodes%volume(:, q) + sleepers%layer%volume(:, i)
      end if
    end do
  end subroutine add_layer

  !> Hold the nodes of the layer at rest, after walls and clamps; store the impulse that holds each
  !> node [N s] and record the energy [J]. The velocity change of the nodes counts from the velocity
  !> of their awake particles.
  subroutine hold_layer(scene, clock, nodes, sleepers, budget, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    type(budget_t), intent(inout) :: budget
    real(rp), intent(inout) :: g(8, nodes%patch%nn)     !! velocity, -, change, mass
    real(rp) :: awake, before(3), least
    integer :: i

    if (.not. allocated(sleepers%layer%held)) return
    least = min_node_inertia(scene, clock)
    associate (layer => sleepers%layer)
      do i = 1, size(layer%held)
        associate (record => g(:, layer%held(i)))
          awake = record(8) - layer%mass(i)
          before = record(1:3) - record(5:7)
          layer%impulse(:, i) = record(8)*before + max(least, record(8))*record(5:7)
          before = before*merge(record(8)/awake, 0.0_rp, awake > negligible*record(8))
          if (layer%is_own(i)) budget%sums(e_sleep) = budget%sums(e_sleep) &
              + 0.5_rp*dot_product(layer%impulse(:, i), before)
          record(1:3) = 0.0_rp
          record(5:7) = -before
        end associate
      end do
    end associate
  end subroutine hold_layer

  !> Collective. Find the force of walls and clamps on the sleepers beyond the held layer. The
  !> nodes, mirrors and clamps of all particles must be listed, the mirrors in the order of the
  !> nodes: the sum must not depend on which particles are awake, or a resumed run would differ by
  !> rounding.
  subroutine find_far_force(scene, clock, particles, nodes, sleepers, sleepers_stay)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    logical, intent(in) :: sleepers_stay         !! the sleepers of this rank have not changed
    real(rp) :: of_layer(3, size(scene%condition))
    logical, allocatable :: near(:, :, :)
    logical :: is_known

    if (.not. scene%method%sleep%is_on .or. size(scene%condition) == 0) return
    if (.not. allocated(sleepers%far_force)) then
      allocate (sleepers%far_force(3, size(of_layer, 2)), source=0.0_rp)
    end if
    is_known = sleepers_stay
    if (particles%n_mapped == particles%nblk) then
      if (.not. is_known) sleepers%far_force = 0.0_rp
      is_known = .true.
    end if
    if (nodes%halo%world%all_true(is_known)) return
    call mark_held(nodes, near)
    call find_wall_forces(scene, clock, particles, nodes, particles%n_mapped, near, of_layer)
    call find_wall_forces(scene, clock, particles, nodes, particles%nblk, near, sleepers%far_force)
    sleepers%far_force = sleepers%far_force - of_layer
  end subroutine find_far_force

  !> Record the impulse of walls and clamps in a step on the sleepers beyond the held layer.
  subroutine record_sleeper_impulse(sleepers, budget, dt)
    type(sleepers_t), intent(in) :: sleepers
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt                   !! time step [s]

    if (allocated(sleepers%far_force)) budget%impulse = budget%impulse + dt*sleepers%far_force
  end subroutine record_sleeper_impulse

  !> Mark the nodes, as (z, y, x), from which a particle reaches nodes held by walls or clamps.
  subroutine mark_held(nodes, near)
    type(nodes_t), intent(in) :: nodes
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: is_held(0:nodes%patch%nn)
    integer :: i, k, n(3)

    n = 0
    if (nodes%patch%nn > 0) n = nodes%patch%all%hi - nodes%patch%all%lo + 1
    is_held = .false.
    is_held(nodes%boundary%mirrors%pair(1, :)) = .true.
    is_held(nodes%boundary%mirrors%plane(1, :)) = .true.
    is_held(nodes%boundary%fixed(1, :nodes%boundary%n_fixed)) = .true.
    do i = 1, nodes%boundary%n_columns
      do k = 1, 3
        is_held(nodes%boundary%column(i)%node(k)) = .true.
      end do
    end do
    near = reshape(is_held(1:), n([3, 2, 1]))
    call dilate(near, halo)
  end subroutine mark_held

  !> Force of each wall and clamp on the sleepers up to block `last`, at this rank's nodes [N].
  subroutine find_wall_forces(scene, clock, particles, nodes, last, near, force)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: last
    logical, intent(in) :: near(nodes%patch%nn)
    real(rp), intent(out) :: force(3, size(scene%condition))
    type(block_t) :: block
    type(clock_t) :: unscaled               ! the force must not depend on when it was found
    real(rp) :: lost(8, size(scene%symmetry)), unused_work
    integer :: b

    unscaled = clock
    unscaled%mass_scaling = 1.0_rp
    call clear_nodes(nodes, nodes%g)
    do b = particles%n_awake + 1, last
      call view_block(particles, b, block)
      call add_force(scene, unscaled, nodes, near, block, nodes%g(:, :, 1))
    end do
    lost = 0.0_rp
    call reflect(scene, nodes, r_momentum, nodes%g(:, :, 1), lost)
    call nodes%resting_halo%sum(8, nodes%patch%nn, nodes%g(:, :, 1))
    call update_nodes(scene, unscaled, nodes, 1.0_rp, nodes%g)  ! in a step of 1 s
    ! Material at rest needs no impulse to stay at rest.
    force = 0.0_rp
    unused_work = 0.0_rp
    call hold_walls(scene, unscaled, nodes, 0.0_rp, nodes%g, force, unused_work)
    call add_lost(scene, 1.0_rp, lost, force)
    call clear_nodes(nodes, nodes%g)
  end subroutine find_wall_forces

  !> Add mass and force of a block to the nodes, if one of its particles is near a held node.
  subroutine add_force(scene, clock, nodes, near, block, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    logical, intent(in) :: near(nodes%patch%nn)
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: node(nlane)
    logical :: is_own(nlane)

    associate (ps => block%ps, body => scene%body(block%body))
      call storage_nodes(scene%grid, nodes%patch, nlane, ps(1, f_pos), node, is_own)
      if (.not. any(near(node(:block%n)))) return
      call weights_of(scene, nodes, block)
      call force_records(clock%mass_scaling, 1.0_rp/scene%material(body%material)%rho, &
                         external_acceleration(scene, clock, block%body), ps(1, f_mass), &
                         ps(1, f_vel), ps(1, f_tau), ps(1, f_temp), nodes%rec)
      call p2g_block(block%n, block%w, block%first, nodes%rec, nodes%patch%stride, &
                     nodes%patch%nn, g)
    end associate
  end subroutine add_force

end module sleep_held_layer
