! SPDX-License-Identifier: MIT
!> Mean motion of cubes of nodes since the last sleep check: their velocity, and the impulse on held
!> nodes. Means over many steps are used, since waves change no lasting stress.
!>
!> Cubes of a few cells, the units of sleeping: their size and position. On graded axes they have
!> as many spans as cells elsewhere.
module sleep_cubes
  use base_kinds, only: rp
  use grid_geometry, only: box_t, grid_t, section_across
  use state_nodes, only: nodes_t
  use state_sleepers, only: m_impulse, m_mass, m_momentum, motion_t, n_motion, sleepers_t
  implicit none (type, external)
  private

  public :: cube_at, cube_middle, cube_size, longest_cube, mean_traction, mean_velocity, &
            start_tracking, track_motion

  integer, parameter, public :: edge = 2          !! edge of a cube [cells]

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

  !> Edges of cube `c`, indexed from 0 along each axis [m].
  pure function cube_size(grid, c) result(length)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    real(rp) :: length(3)
    integer :: a

    length = edge*grid%h
    do a = 1, 3
      if (grid%grading(a)%is_graded) length(a) = upper_end(grid, a, c(a)) &
                                                 - upper_end(grid, a, c(a) - 1)
    end do
  end function cube_size

  !> Centre of cube `c` [m].
  pure function cube_middle(grid, c) result(x)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    real(rp) :: x(3)
    integer :: a

    x = grid%lower + grid%h*(edge*(c + 0.5_rp) - 0.5_rp)
    do a = 1, 3
      if (grid%grading(a)%is_graded) x(a) = 0.5_rp*(upper_end(grid, a, c(a) - 1) &
                                                    + upper_end(grid, a, c(a)))
    end do
  end function cube_middle

  !> Longest edge of any cube [m].
  pure real(rp) function longest_cube(grid)
    type(grid_t), intent(in) :: grid

    longest_cube = edge*grid%longest()
  end function longest_cube

  !> Position of `x` in cubes from the lower end of the grid.
  pure function cube_at(grid, x) result(place)
    type(grid_t), intent(in) :: grid
    real(rp), intent(in) :: x(3)            !! position [m]
    real(rp) :: place(3)
    integer :: a

    place = (x - grid%lower)/(edge*grid%h)
    do a = 1, 3
      if (grid%grading(a)%is_graded) place(a) = grid%grading(a)%place(x(a))/edge
    end do
  end function cube_at

  !> Upper end of cube `c` on the graded axis `a` [m].
  pure real(rp) function upper_end(grid, a, c)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: a, c

    upper_end = grid%grading(a)%position(edge*(c + 1) - 0.5_rp)
  end function upper_end

end module sleep_cubes
