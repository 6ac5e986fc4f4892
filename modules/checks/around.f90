! SPDX-License-Identifier: MIT
!> Surroundings of a tool for checks of its motion: undeformed bodies, grid and walls.
module checks_around
  use base_kinds, only: rp
  use bodies_solids, only: is_inside
  use checks_sense, only: extent_of
  use heat_setup_cut_cells, only: solids_t
  use input_values, only: input_t
  use setup_walls, only: wall_of, wall_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: surroundings_t, collect_surroundings, find_plate_box, sample_points

  real(rp), parameter :: gap_in_cells = 0.05_rp   !! distance that counts as contact [cells]

  !> Surroundings of a tool.
  type :: surroundings_t
    type(solids_t), allocatable :: solids(:)      !! solids of the other bodies
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! box around deformable bodies [m]
    real(rp) :: grid_lower(3) = 0.0_rp, grid_upper(3) = 0.0_rp   !! corners of the grid [m]
    real(rp) :: side_lower(3) = 0.0_rp, side_upper(3) = 0.0_rp   !! walls or grid sides [m]
    real(rp), allocatable :: body_points(:, :)    !! (3, n) sample points in the bodies [m]
    real(rp) :: gap = 0.0_rp                      !! distance that counts as contact [m]
  end type surroundings_t

contains

  !> Bounding box of the deformable bodies, the plate.
  subroutine find_plate_box(scene, solids, lower, upper)
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    real(rp), intent(out) :: lower(3), upper(3)
    real(rp) :: low(3), high(3)
    integer :: b

    lower = huge(1.0_rp)
    upper = -huge(1.0_rp)
    do b = 1, size(solids)
      if (scene%body(b)%is_rigid()) cycle
      call extent_of(solids(b), low, high)
      lower = min(lower, low)
      upper = max(upper, high)
    end do
  end subroutine find_plate_box

  !> Collect the surroundings of tool `k`: other bodies, their box, the grid and its walls.
  subroutine collect_surroundings(input, scene, solids, k, surroundings)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k
    type(surroundings_t), intent(out) :: surroundings
    integer :: b, i

    surroundings%gap = gap_in_cells*minval(scene%grid%h)
    call find_plate_box(scene, solids, surroundings%lower, surroundings%upper)
    surroundings%solids = pack(solids, scene%body%tool /= k)
    surroundings%grid_lower = scene%grid%lower
    surroundings%grid_upper = scene%grid%upper()
    surroundings%side_lower = surroundings%grid_lower
    surroundings%side_upper = surroundings%grid_upper
    do i = 1, input%count('WALL')
      call add_wall(wall_of(input, scene%grid, i), surroundings)
    end do
    allocate (surroundings%body_points(3, 0))
    do b = 1, size(surroundings%solids)
      surroundings%body_points = reshape([surroundings%body_points, &
                                         sample_points(surroundings%solids(b))], [3, &
                                           size(surroundings%body_points, 2) &
                                             + size(sample_points(surroundings%solids(b)), 2)])
    end do
  end subroutine collect_surroundings

  !> Move a side of the grid inwards to a wall.
  pure subroutine add_wall(wall, surroundings)
    type(wall_t), intent(in) :: wall
    type(surroundings_t), intent(inout) :: surroundings

    associate (lower => surroundings%side_lower(wall%axis), &
               upper => surroundings%side_upper(wall%axis))
      if (wall%faces_up) lower = max(lower, wall%position)
      if (.not. wall%faces_up) upper = min(upper, wall%position)
    end associate
  end subroutine add_wall

  !> Sample points in a body, (3, n) [m], including points near its faces.
  pure function sample_points(body) result(x)
    type(solids_t), intent(in) :: body
    real(rp), allocatable :: x(:, :)
    integer, parameter :: n = 12
    real(rp) :: candidate(3, (n + 1)**3), lower(3), upper(3)
    logical :: is_in((n + 1)**3)
    integer :: i, j, k, p

    call extent_of(body, lower, upper)
    p = 0
    do i = 0, n
      do j = 0, n
        do k = 0, n
          p = p + 1
          candidate(:, p) = lower + (upper - lower)*(1.0e-6_rp + (1.0_rp - 2.0e-6_rp)*[i, j, k]/n)
          is_in(p) = is_inside(body%solid, candidate(:, p))
        end do
      end do
    end do
    x = reshape(pack(candidate, spread(is_in, 1, 3)), [3, count(is_in)])
  end function sample_points

end module checks_around
