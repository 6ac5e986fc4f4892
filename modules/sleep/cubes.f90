! SPDX-License-Identifier: MIT
!> Cubes of a few cells, the units of sleeping: their size and position. On graded axes they have
!> as many spans as cells elsewhere.
module sleep_cubes
  use base_kinds, only: rp
  use grid_geometry, only: grid_t
  implicit none (type, external)
  private

  public :: cube_at, cube_middle, cube_size, longest_cube

  integer, parameter, public :: edge = 2          !! edge of a cube [cells]

contains

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
    real(rp), intent(in) :: x(3)            !! [m]
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
