! SPDX-License-Identifier: MIT
!> The rim of the sleeping material: what it gives to the nodes that it shares with awake particles.
!> Mass, frozen force and heat of the rim do not change until the next sort or conduction step, so
!> they are gathered once and added in every step.
!>
!> The rim is at rest: a node whose mass has the part f of the rim loses the momentum f/m of its
!> awake particles in each step, by which the rim acts like a dashpot of impedance f/(dt area). With
!> half a cell's mass that is rho h/(2 dt). The nodes feel the mass times the Courant number c dt/h,
!> which makes it near rho c: waves leave the awake part (Lysmer & Kuhlemeyer 1969, J. Eng. Mech.
!> 95:859). Measured on a pulse, 1 % of its energy comes back (tests/system/test_sleeping.py).
module sleep_absorbing_layer
  use base_kinds, only: rp
  use boundary_held, only: boundary_t
  use boundary_symmetry, only: reflect, r_momentum
  use comm_world, only: world_t
  use mapping_fbar, only: clear_volume
  use mapping_nodes, only: clear_nodes, nodes_t
  use particles_store, only: particles_t
  use sleep_sleepers, only: sleepers_t
  use state_blocks, only: blocks_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  use update_sweeps, only: force_to_grid
  implicit none (type, external)
  private

  public :: freeze_layer, add_layer, damp_layer, layer_inertia

contains

  !> Collective: gather what the rim gives, if that may have changed.
  subroutine freeze_layer(world, scene, clock, step, particles, blocks, nodes, boundary, sleepers)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(inout) :: boundary
    type(sleepers_t), intent(inout) :: sleepers
    integer :: b, r

    if (.not. scene%method%sleep%is_on .or. .not. sleepers%layer%is_stale) return
    sleepers%layer%is_stale = .false.
    call clear_nodes(nodes, nodes%g)
    call clear_volume(scene, nodes)
    do b = blocks%n_awake + 1, blocks%n_mapped
      call force_to_grid(scene, step, nodes, layer_inertia(scene, clock), particles%body(b), &
                         particles%count(b), &
                         particles%nf, particles%ps(:, :, b), nodes%rec, nodes%g(:, :, 1))
    end do
    call list_layer(scene, nodes, sleepers, nodes%g(:, :, 1))
    call reflect(scene, nodes, boundary, r_momentum, nodes%g(:, :, 1), boundary%mirrors%lost, &
                 boundary%mirrors%own(:, 1))
    boundary%mirrors%at_rest = boundary%mirrors%own(:, 1)
    call nodes%halo%sum(world, 8, nodes%patch%nn, nodes%g(:, :, 1))
    if (allocated(sleepers%layer%mass)) deallocate (sleepers%layer%mass)
    allocate (sleepers%layer%mass(nodes%patch%nn), source=0.0_rp)
    do r = 1, nodes%n_ranges
      sleepers%layer%mass(nodes%range(1, r):nodes%range(2, r)) = nodes%g(1, &
        nodes%range(1, r):nodes%range(2, r), 1)
    end do
  end subroutine freeze_layer

  !> Keep what is in the nodes of `g` that have mass.
  subroutine list_layer(scene, nodes, sleepers, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    integer :: i, n, q, r

    n = 0
    do r = 1, nodes%n_ranges
      n = n + count(g(1, nodes%range(1, r):nodes%range(2, r)) > 0.0_rp)
    end do
    associate (rim => sleepers%layer)
      if (allocated(rim%node)) deallocate (rim%node, rim%record, rim%volume)
      allocate (rim%node(n))
      allocate (rim%record(8, n), rim%volume(2*size(scene%body), n), source=0.0_rp)
      i = 0
      do r = 1, nodes%n_ranges
        do q = nodes%range(1, r), nodes%range(2, r)
          if (.not. g(1, q) > 0.0_rp) cycle
          i = i + 1
          rim%node(i) = q
          rim%record(:, i) = g(:, q)
          if (allocated(nodes%volume)) rim%volume(:, i) = nodes%volume(:, q)
        end do
      end do
    end associate
  end subroutine list_layer

  !> What the rim of sleeping material gives to its nodes (sleep_absorbing_layer).
  subroutine add_layer(nodes, sleepers, g)
    type(nodes_t), intent(inout) :: nodes
    type(sleepers_t), intent(in) :: sleepers
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: i, q

    if (.not. allocated(sleepers%layer%node)) return
    do i = 1, size(sleepers%layer%node)
      q = sleepers%layer%node(i)
      g(:, q) = g(:, q) + sleepers%layer%record(:, i)
      if (allocated(nodes%volume)) nodes%volume(:, q) = nodes%volume(:, q) &
          + sleepers%layer%volume(:, i)
    end do
  end subroutine add_layer

  !> Factor on the mass of resting particles.
  pure real(rp) function layer_inertia(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    layer_inertia = courant(scene, clock)*clock%mass_scaling
  end function layer_inertia

  !> Way of a pressure wave in a step, in cells; the same for the whole run.
  pure real(rp) function courant(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp) :: speed
    integer :: m

    courant = scene%method%cfl
    if (scene%method%fixed_dt <= 0.0_rp) return
    speed = maxval([(scene%material(m)%wave_speed(), m=1, size(scene%material))])
    courant = scene%method%fixed_dt*speed/sqrt(clock%mass_scaling)/scene%grid%h
  end function courant

  !> The velocity change of the nodes counts from the velocity of their awake particles.
  subroutine damp_layer(nodes, sleepers, g)
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(in) :: sleepers
    real(rp), intent(inout) :: g(8, nodes%patch%nn)     !! velocity, -, change, mass
    real(rp) :: mass
    integer :: q, r

    if (.not. allocated(sleepers%layer%mass)) return
    do r = 1, nodes%n_ranges
      do q = nodes%range(1, r), nodes%range(2, r)
        if (.not. sleepers%layer%mass(q) > 0.0_rp) cycle
        mass = g(8, q) - sleepers%layer%mass(q)
        if (mass <= 1.0e-9_rp*g(8, q)) cycle
        g(5:7, q) = g(1:3, q) - (g(1:3, q) - g(5:7, q))*(g(8, q)/mass)
      end do
    end do
  end subroutine damp_layer

end module sleep_absorbing_layer
