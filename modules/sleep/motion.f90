! SPDX-License-Identifier: MIT
!> Mean motion of cubes of nodes since the last sleep check: their velocity, and the impulse on held
!> nodes. Means over many steps are used, since waves change no lasting stress.
module sleep_motion
  use base_kinds, only: rp
  use grid_geometry, only: box_t, section_across
  use mapping_nodes, only: nodes_t
  use sleep_cubes, only: edge
  use state_run, only: m_impulse, m_mass, m_momentum, motion_t, n_motion, sleepers_t
  implicit none (type, external)
  private

  public :: start_tracking, track_motion, mean_velocity, mean_traction

contains

  !> Reset the sums, for the cubes of `box`.
  pure subroutine start_tracking(motion, box)
    type(motion_t), intent(inout) :: motion
    type(box_t), intent(in) :: box

    motion%box = box
    motion%time = 0.0_rp
    if (allocated(motion%sums)) deallocate (motion%sums)
    allocate (motion%sums(n_motion, box%count()), source=0.0_rp)
  end subroutine start_tracking

  !> Add the motion of this rank's own nodes to their cubes after a step of length `dt` [s] with the
  !> velocities `g`. Nodes beyond the cubes of particles belong to the nearest one.
  subroutine track_motion(nodes, sleepers, dt, g)
    type(nodes_t), intent(in) :: nodes
    type(sleepers_t), intent(inout) :: sleepers
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    integer :: c, i, ijk(3), q, r

    if (.not. allocated(sleepers%motion%sums)) return
    associate (motion => sleepers%motion, layer => sleepers%layer)
      motion%time = motion%time + dt
      do r = 1, nodes%n_ranges
        if (nodes%range(3, r) /= 1) cycle
        ijk = nodes%patch%indices(nodes%range(1, r))
        c = cube_of(motion%box, ijk)
        do q = nodes%range(1, r), nodes%range(2, r)            ! the nodes of a run ascend in z
          if (mod(ijk(3), edge) == 0) c = cube_of(motion%box, ijk)
          ijk(3) = ijk(3) + 1
          associate (sums => motion%sums(:, c))
            sums(m_mass) = sums(m_mass) + dt*g(8, q)
            sums(m_momentum:m_momentum + 2) = sums(m_momentum:m_momentum + 2) + dt*g(8, q)*g(1:3, q)
          end associate
        end do
      end do
      if (.not. allocated(layer%held)) return
      do i = 1, size(layer%held)
        if (.not. layer%is_own(i)) cycle
        c = cube_of(motion%box, nodes%patch%indices(layer%held(i)))
        associate (sums => motion%sums(m_impulse:m_impulse + 2, c))
          sums = sums + layer%impulse(:, i)
        end associate
      end do
    end associate
  end subroutine track_motion

  !> Index of the cube of `box` that a node is in or next to.
  pure integer function cube_of(box, ijk) result(c)
    type(box_t), intent(in) :: box
    integer, intent(in) :: ijk(3)
    integer :: at(3), n(3)

    n = box%hi - box%lo + 1
    at = max(0, min(n - 1, ijk/edge - box%lo))
    c = 1 + at(1) + n(1)*(at(2) + n(2)*at(3))
  end function cube_of

  !> Mean velocity of a cube from its sums over all ranks [m/s]; 0 for an empty cube.
  pure function mean_velocity(sums) result(v)
    real(rp), intent(in) :: sums(n_motion)
    real(rp) :: v(3)

    v = 0.0_rp
    if (sums(m_mass) > 0.0_rp) v = sums(m_momentum:m_momentum + 2)/sums(m_mass)
  end function mean_velocity

  !> Mean force on the held nodes of a cube over `time`, divided by the cross-section of the cube
  !> [Pa].
  pure real(rp) function mean_traction(sums, time, length) result(traction)
    real(rp), intent(in) :: sums(n_motion)
    real(rp), intent(in) :: time                 !! [s]
    real(rp), intent(in) :: length(3)            !! edges of the cube [m]
    real(rp) :: force

    traction = 0.0_rp
    force = norm2(sums(m_impulse:m_impulse + 2))
    if (time > 0.0_rp .and. force > 0.0_rp) traction = force/(time &
        *section_across(length, sums(m_impulse:m_impulse + 2)/force))
  end function mean_traction

end module sleep_motion
