! SPDX-License-Identifier: MIT
!> What the motion of a tool is held against: the bodies as they are drawn, the grid, its walls.
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

  public :: around_t, look_around, plate_of, points_in

  real(rp), parameter :: near = 0.05_rp           !! what is no distance yet [cells]

  !> What a tool is held against.
  type :: around_t
    type(solids_t), allocatable :: solids(:)      !! of the other bodies
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! of the bodies that deform [m]
    real(rp) :: grid_lower(3) = 0.0_rp, grid_upper(3) = 0.0_rp
    real(rp) :: side_lower(3) = 0.0_rp, side_upper(3) = 0.0_rp   !! walls, or else sides of the grid
    real(rp), allocatable :: metal(:, :)          !! points of the bodies [m]
    real(rp) :: gap = 0.0_rp                      !! what is no distance yet [m]
  end type around_t

contains

  !> Box around the bodies that deform [m].
  subroutine plate_of(scene, solids, lower, upper)
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
  end subroutine plate_of

  !> What tool `k` meets: the other bodies, their box, the grid and its walls.
  subroutine look_around(input, scene, solids, k, around)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k
    type(around_t), intent(out) :: around
    integer :: b, i

    around%gap = near*minval(scene%grid%h)
    call plate_of(scene, solids, around%lower, around%upper)
    around%solids = pack(solids, scene%body%tool /= k)
    around%grid_lower = scene%grid%lower
    around%grid_upper = scene%grid%upper()
    around%side_lower = around%grid_lower
    around%side_upper = around%grid_upper
    do i = 1, input%count('WALL')
      call add_wall(wall_of(input, scene%grid, i), around)
    end do
    allocate (around%metal(3, 0))
    do b = 1, size(around%solids)
      around%metal = reshape([around%metal, points_in(around%solids(b))], &
                             [3, size(around%metal, 2) + size(points_in(around%solids(b)), 2)])
    end do
  end subroutine look_around

  !> A wall of the grid stands in front of its side.
  pure subroutine add_wall(wall, around)
    type(wall_t), intent(in) :: wall
    type(around_t), intent(inout) :: around

    associate (lower => around%side_lower(wall%axis), upper => around%side_upper(wall%axis))
      if (wall%faces_up) lower = max(lower, wall%position)
      if (.not. wall%faces_up) upper = min(upper, wall%position)
    end associate
  end subroutine add_wall

  !> Points that lie in a body, those near its faces among them.
  pure function points_in(body) result(x)
    type(solids_t), intent(in) :: body
    real(rp), allocatable :: x(:, :)
    integer, parameter :: n = 12
    real(rp) :: all(3, (n + 1)**3), lower(3), upper(3)
    logical :: is_in((n + 1)**3)
    integer :: i, j, k, p

    call extent_of(body, lower, upper)
    p = 0
    do i = 0, n
      do j = 0, n
        do k = 0, n
          p = p + 1
          all(:, p) = lower + (upper - lower)*(1.0e-6_rp + (1.0_rp - 2.0e-6_rp)*[i, j, k]/n)
          is_in(p) = is_inside(body%solid, all(:, p))
        end do
      end do
    end do
    x = reshape(pack(all, spread(is_in, 1, 3)), [3, count(is_in)])
  end function points_in

end module checks_around
