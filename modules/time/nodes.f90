! SPDX-License-Identifier: MIT
!> Work on the nodes in use: clear them, turn momentum and force into velocities.
!> A record comes in as mass, momentum (3), force (3), mass times temperature and goes out as
!> velocity (3), temperature, velocity change (3), mass.
module time_nodes
  use base_kinds, only: rp
  use time_scene, only: scene_t
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: append, clear_nodes, full_mass, least_inertia, update_nodes

  real(rp), parameter, public :: least_mass = 1.0e-30_rp   !! below this a node is empty [kg]
  !> Part of a full cell's mass that a node has at least against forces, where masses are scaled. The
  !> largest eigenvalues of K against M belong to light nodes at free surfaces.
  real(rp), parameter :: share = 0.25_rp

contains

  !> Add `entry` behind the `n` entries of a growing list of nodes.
  pure subroutine append(list, n, entry)
    integer, allocatable, intent(inout) :: list(:, :)
    integer, intent(inout) :: n
    integer, intent(in) :: entry(3)
    integer, allocatable :: longer(:, :)

    if (n == size(list, 2)) then
      allocate (longer(3, 2*n))
      longer(:, 1:n) = list
      call move_alloc(longer, list)
    end if
    n = n + 1
    list(:, n) = entry
  end subroutine append

  !> Zero the records of all nodes in use.
  subroutine clear_nodes(sim, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: k, r

    do k = 1, sim%n_groups
      do r = 1, sim%n_runs
        g(:, sim%run(1, r):sim%run(2, r), k) = 0.0_rp
      end do
    end do
  end subroutine clear_nodes

  !> Mass of a node amid the lightest material, scaled [kg].
  pure real(rp) function full_mass(scene)
    type(scene_t), intent(in) :: scene

    full_mass = scene%method%mass_scaling*scene%grid%h**3*minval(scene%material%rho)
  end function full_mass

  !> Inertia against forces that a node has at least (selective mass scaling) [kg]. What is in
  !> equilibrium stays so.
  pure real(rp) function least_inertia(scene)
    type(scene_t), intent(in) :: scene

    least_inertia = 0.0_rp
    if (scene%method%scales_light_nodes) least_inertia = share*full_mass(scene)
  end function least_inertia

  !> New velocities of the nodes in use (USL: v = p/m + dt f/m).
  subroutine update_nodes(sim, dt, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: dt              !! [s]
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp) :: least
    integer :: k, r

    least = least_inertia(sim%scene)
    do k = 1, sim%n_groups
      do r = 1, sim%n_runs
        call update_run(sim%run(2, r) - sim%run(1, r) + 1, dt, least, g(1, sim%run(1, r), k))
      end do
    end do
  end subroutine update_nodes

  pure subroutine update_run(n, dt, least, g)
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, least
    real(rp), intent(inout) :: g(8, n)
    real(rp) :: m, most, inv, step, d1, d2, d3, v1, v2, v3
    integer :: i

    most = 1.0_rp/max(least, least_mass)
    do i = 1, n
      m = g(1, i)
      inv = 0.0_rp
      if (m > least_mass) inv = 1.0_rp/m
      step = dt*min(inv, most)
      d1 = step*g(5, i)
      d2 = step*g(6, i)
      d3 = step*g(7, i)
      v1 = g(2, i)*inv + d1
      v2 = g(3, i)*inv + d2
      v3 = g(4, i)*inv + d3
      g(1, i) = v1
      g(2, i) = v2
      g(3, i) = v3
      g(4, i) = g(8, i)*inv
      g(5, i) = d1
      g(6, i) = d2
      g(7, i) = d3
      g(8, i) = m
    end do
  end subroutine update_run

end module time_nodes
