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
module time_rim
  use base_kinds, only: rp
  use comm_world, only: world_t
  use time_mirrors, only: fold, r_momentum
  use time_nodes, only: clear_nodes
  use time_state, only: simulation_t
  use time_sweeps, only: force_to_grid
  use time_volume, only: clear_volume
  implicit none (type, external)
  private

  public :: freeze_rim, damp_rim, rim_inertia

contains

  !> Collective: gather what the rim gives, if that may have changed.
  subroutine freeze_rim(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer :: b, r

    if (.not. sim%scene%method%sleep%is_on .or. .not. sim%rim%is_stale) return
    sim%rim%is_stale = .false.
    call clear_nodes(sim, sim%g)
    call clear_volume(sim)
    do b = sim%n_awake + 1, sim%n_mapped
      call force_to_grid(sim, rim_inertia(sim), sim%particles%body(b), &
                         sim%particles%count(b), sim%particles%nf, sim%particles%ps(:, :, b), &
                         sim%rec, sim%g(:, :, 1))
    end do
    call list_rim(sim, sim%g(:, :, 1))
    call fold(sim, r_momentum, sim%g(:, :, 1), sim%mirrors%lost, sim%mirrors%own(:, 1))
    sim%rim%behind = sim%mirrors%own(:, 1)
    call sim%halo%sum(world, 8, sim%patch%nn, sim%g(:, :, 1))
    if (allocated(sim%rim%mass)) deallocate (sim%rim%mass)
    allocate (sim%rim%mass(sim%patch%nn), source=0.0_rp)
    do r = 1, sim%n_runs
      sim%rim%mass(sim%run(1, r):sim%run(2, r)) = sim%g(1, sim%run(1, r):sim%run(2, r), 1)
    end do
  end subroutine freeze_rim

  !> Keep what is in the nodes of `g` that have mass.
  subroutine list_rim(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn)
    integer :: i, n, q, r

    n = 0
    do r = 1, sim%n_runs
      n = n + count(g(1, sim%run(1, r):sim%run(2, r)) > 0.0_rp)
    end do
    associate (rim => sim%rim)
      if (allocated(rim%node)) deallocate (rim%node, rim%record, rim%volume)
      allocate (rim%node(n))
      allocate (rim%record(8, n), rim%volume(2*size(sim%scene%body), n), source=0.0_rp)
      i = 0
      do r = 1, sim%n_runs
        do q = sim%run(1, r), sim%run(2, r)
          if (.not. g(1, q) > 0.0_rp) cycle
          i = i + 1
          rim%node(i) = q
          rim%record(:, i) = g(:, q)
          if (allocated(sim%volume)) rim%volume(:, i) = sim%volume(:, q)
        end do
      end do
    end associate
  end subroutine list_rim

  !> Factor on the mass of resting particles.
  pure real(rp) function rim_inertia(sim)
    type(simulation_t), intent(in) :: sim

    rim_inertia = courant(sim)*sim%scene%method%mass_scaling
  end function rim_inertia

  !> Way of a pressure wave in a step, in cells; the same for the whole run.
  pure real(rp) function courant(sim)
    type(simulation_t), intent(in) :: sim
    real(rp) :: speed
    integer :: m

    courant = sim%scene%method%cfl
    if (sim%scene%method%fixed_dt <= 0.0_rp) return
    speed = maxval([(sim%scene%material(m)%wave_speed(), m=1, size(sim%scene%material))])
    courant = sim%scene%method%fixed_dt*speed/sqrt(sim%scene%method%mass_scaling)/sim%scene%grid%h
  end function courant

  !> The velocity change of the nodes counts from the velocity of their awake particles.
  subroutine damp_rim(sim, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn)     !! velocity, -, change, mass
    real(rp) :: mass
    integer :: q, r

    if (.not. allocated(sim%rim%mass)) return
    do r = 1, sim%n_runs
      do q = sim%run(1, r), sim%run(2, r)
        if (.not. sim%rim%mass(q) > 0.0_rp) cycle
        mass = g(8, q) - sim%rim%mass(q)
        if (mass <= 1.0e-9_rp*g(8, q)) cycle
        g(5:7, q) = g(1:3, q) - (g(1:3, q) - g(5:7, q))*(g(8, q)/mass)
      end do
    end do
  end subroutine damp_rim

end module time_rim
