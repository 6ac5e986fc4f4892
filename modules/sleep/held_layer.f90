! SPDX-License-Identifier: MIT
!> Held layer: sleepers that share nodes with awake particles. Their mass, frozen force and heat do
!> not change until the next sort or conduction step, so they are gathered once and added to the
!> nodes in every step. The shared nodes are held at rest. The impulse of holding measures the load
!> by awake material: it shows when the stress of the sleepers is outdated (sleep_motion), and they
!> wake.
!>
!> Held nodes do not drift, unlike nodes damped by the sleepers: a slowly pressed rod carries its
!> full load. They reflect waves, which the awake material has to dissipate.
module sleep_held_layer
  use base_kinds, only: rp
  use boundary_symmetry, only: reflect, r_momentum
  use mapping_fbar, only: clear_volume
  use mapping_nodes, only: clear_nodes, min_node_inertia, nodes_t
  use simulation_parts, only: simulation_t
  use state_run, only: budget_t, clock_t, e_sleep, sleepers_t
  use state_scene, only: scene_t
  use update_sweeps, only: force_to_grid
  implicit none (type, external)
  private

  public :: freeze_layer, add_layer, hold_layer

  real(rp), parameter :: negligible = 1.0e-9_rp   !! fraction of a node's mass below which no awake
                                                  !! particle is near

contains

  !> Collective. Gather the contributions of the layer, if they may have changed.
  subroutine freeze_layer(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b

    if (.not. sim%scene%method%sleep%is_on .or. .not. sim%sleepers%layer%is_stale) return
    sim%sleepers%layer%is_stale = .false.
    call clear_nodes(sim%nodes, sim%nodes%g)
    call clear_volume(sim%scene, sim%nodes)
    do b = sim%particles%n_awake + 1, sim%particles%n_mapped
      call force_to_grid(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                         sim%particles%ps(:, :, b), sim%nodes%rec, sim%nodes%g(:, :, 1))
    end do
    call store_layer_records(sim, sim%nodes%g(:, :, 1))
    call reflect(sim, r_momentum, sim%nodes%g(:, :, 1), sim%boundary%mirrors%lost, &
                 sim%boundary%mirrors%mass_behind(:, 1))
    sim%boundary%mirrors%resting_mass_behind = sim%boundary%mirrors%mass_behind(:, 1)
    call sim%nodes%halo%sum(sim%world, 8, sim%nodes%patch%nn, sim%nodes%g(:, :, 1))
    call list_held(sim, sim%nodes%g(:, :, 1))
  end subroutine freeze_layer

  !> Store the records of this rank's sleepers: the nodes of `g` that have mass.
  subroutine store_layer_records(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)
    integer :: i

    associate (layer => sim%sleepers%layer)
      layer%node = nodes_with_mass(sim, g)
      layer%record = g(:, layer%node)
      if (allocated(layer%volume)) deallocate (layer%volume)
      allocate (layer%volume(2*size(sim%scene%body), size(layer%node)), source=0.0_rp)
      if (.not. allocated(sim%nodes%volume)) return
      do i = 1, size(layer%node)
        layer%volume(:, i) = sim%nodes%volume(:, layer%node(i))
      end do
    end associate
  end subroutine store_layer_records

  !> List the nodes to hold: those with mass of any rank's sleepers.
  subroutine list_held(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)
    integer :: i, r

    associate (layer => sim%sleepers%layer)
      layer%held = nodes_with_mass(sim, g)
      layer%mass = g(1, layer%held)
      layer%is_own = [(.false., i=1, size(layer%held))]
      i = 0
      do r = 1, sim%nodes%n_ranges
        do while (i < size(layer%held))
          if (layer%held(i + 1) > sim%nodes%range(2, r)) exit
          i = i + 1
          layer%is_own(i) = sim%nodes%range(3, r) == 1
        end do
      end do
      if (allocated(layer%impulse)) deallocate (layer%impulse)
      allocate (layer%impulse(3, size(layer%held)), source=0.0_rp)
    end associate
  end subroutine list_held

  !> Nodes in use with mass, in ascending order.
  pure function nodes_with_mass(sim, g) result(list)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)
    integer, allocatable :: list(:)
    integer :: n, pass, q, r

    do pass = 1, 2
      n = 0
      do r = 1, sim%nodes%n_ranges
        do q = sim%nodes%range(1, r), sim%nodes%range(2, r)
          if (.not. g(1, q) > 0.0_rp) cycle
          n = n + 1
          if (pass == 2) list(n) = q
        end do
      end do
      if (pass == 1) allocate (list(n))
    end do
  end function nodes_with_mass

  !> Add the records of the layer to those of its nodes.
  subroutine add_layer(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    integer :: i, q

    if (.not. allocated(sim%sleepers%layer%node)) return
    do i = 1, size(sim%sleepers%layer%node)
      q = sim%sleepers%layer%node(i)
      g(:, q) = g(:, q) + sim%sleepers%layer%record(:, i)
      if (allocated(sim%nodes%volume)) sim%nodes%volume(:, q) = sim%nodes%volume(:, q) &
        + sim%sleepers%layer%volume(:, i)
    end do
  end subroutine add_layer

  !> Hold the nodes of the layer at rest, after walls and clamps; store the impulse of holding each
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

end module sleep_held_layer
