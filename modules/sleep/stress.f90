! SPDX-License-Identifier: MIT
!> Change of the stress of a cube if it slept, compared with SLEEP_STRESS times the largest mean
!> stress of a cube. It is measured at the held nodes of sleeping cubes, and predicted for awake
!> ones.
module sleep_stress
  use base_kinds, only: rp
  use grid_geometry, only: box_t
  use sleep_cubes, only: cube_middle, cube_size, edge, mean_traction, mean_velocity
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_sleepers, only: m_mass, n_motion
  implicit none (type, external)
  private

  public :: find_active_cubes

  ! Indices of the sums over the particles of a cube, followed by those over its nodes
  ! (sleep_cubes).
  integer, parameter, public :: c_wake_requests = 1, &  !! sleepers whose temperature has changed
                                c_mass = 2, &           !! mass of the awake particles [kg]
                                c_stress = 3            !! mass times Kirchhoff stress [kg Pa], 6
  integer, parameter, public :: n_particle_sums = 8, n_cube_sums = n_particle_sums + n_motion

contains

  !> Find the cubes that have to be awake by the sums over their particles and nodes.
  pure subroutine find_active_cubes(scene, clock, time, box, n, sums, is_active)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp), intent(in) :: time                              !! averaging time [s]
    type(box_t), intent(in) :: box                            !! box of the cubes
    integer, intent(in) :: n(3)                               !! number of cubes along each axis
    real(rp), intent(in) :: sums(n_cube_sums, n(1), n(2), n(3))  !! sums over all ranks
    logical, intent(out) :: is_active(n(1), n(2), n(3))
    real(rp) :: limit, v(3, n(1), n(2), n(3))
    integer :: i, j, k

    limit = scene%method%sleep%stress*largest_stress(product(n), sums)
    do k = 1, n(3)
      do j = 1, n(2)
        do i = 1, n(1)
          associate (nodes => sums(n_particle_sums + 1:, i, j, k))
            v(:, i, j, k) = mean_velocity(nodes)
            is_active(i, j, k) = sums(c_wake_requests, i, j, k) > 0.0_rp &
              .or. mean_traction(nodes, time, &
                                 cube_size(scene%grid, box%lo + [i, j, k] - 1)) > limit
          end associate
        end do
      end do
    end do
    is_active = is_active .or. (sums(c_mass, :, :, :) > 0.0_rp &
      .and. stress_change(scene, clock, box, n, v, &
                          sums(n_particle_sums + m_mass, :, :, :) > 0.0_rp) > limit)
  end subroutine find_active_cubes

  !> Largest norm of the mean Kirchhoff stress of a cube's awake particles [Pa].
  pure real(rp) function largest_stress(n, sums) result(largest)
    integer, intent(in) :: n
    real(rp), intent(in) :: sums(n_cube_sums, n)
    integer :: c

    largest = 0.0_rp
    do c = 1, n
      associate (s => sums(c_stress:c_stress + 5, c), mass => sums(c_mass, c))
        if (mass > 0.0_rp) largest = max(largest, sqrt(sum(s(1:3)**2) + 2.0_rp*sum(s(4:6)**2))/mass)
      end associate
    end do
  end function largest_stress

  !> Error of the stress of a cube if it slept from now on [Pa]: by its elastic strain until the
  !> next check, and by the wave that stopping it emits.
  pure function stress_change(scene, clock, box, n, v, is_there) result(change)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(box_t), intent(in) :: box
    integer, intent(in) :: n(3)
    real(rp), intent(in) :: v(3, n(1), n(2), n(3))       !! mean velocities [m/s]
    logical, intent(in) :: is_there(n(1), n(2), n(3))    !! cubes with nodes
    real(rp) :: change(n(1), n(2), n(3)), gradient(3, 3), lambda, rate(3, 3), shear, time
    integer :: a, i, j, k, m

    shear = maxval(scene%material%g)
    lambda = maxval([(scene%material(m)%lambda(), m=1, size(scene%material))])
    time = scene%method%sort_interval*clock%dt
    change = maxval(scene%material%rho)*sqrt(clock%mass_scaling*clock%stiffness)*norm2(v, 1)
    do k = 1, n(3)
      do j = 1, n(2)
        do i = 1, n(1)
          if (.not. is_there(i, j, k)) cycle
          do a = 1, 3
            gradient(:, a) = slope(a)
          end do
          rate = shear*(gradient + transpose(gradient))
          do a = 1, 3
            rate(a, a) = rate(a, a) + lambda*(gradient(1, 1) + gradient(2, 2) + gradient(3, 3))
          end do
          change(i, j, k) = max(change(i, j, k), time*norm2(rate))
        end do
      end do
    end do
  contains
    !> Velocity gradient along axis `a`, from the cubes on both sides [1/s].
    pure function slope(a)
      integer, intent(in) :: a
      real(rp) :: apart(3), slope(3)
      integer :: high(3), low(3)

      low = [i, j, k]
      high = low
      if (low(a) > 1) low(a) = low(a) - 1
      if (.not. is_there(low(1), low(2), low(3))) low(a) = high(a)
      if (high(a) < n(a)) high(a) = high(a) + 1
      if (.not. is_there(high(1), high(2), high(3))) high(a) = high(a) - 1
      slope = (v(:, high(1), high(2), high(3)) - v(:, low(1), low(2), low(3))) &
              /max(1, high(a) - low(a))
      apart = edge*scene%grid%h
      if (scene%grid%grading(a)%is_graded .and. high(a) > low(a)) then
        apart = (cube_middle(scene%grid, box%lo + high - 1) &
                 - cube_middle(scene%grid, box%lo + low - 1))/(high(a) - low(a))
      end if
      slope = slope/apart(a)
    end function slope
  end function stress_change

end module sleep_stress
