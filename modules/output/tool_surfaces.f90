! SPDX-License-Identifier: MIT
!> Frames with the surfaces of all tools at their current positions.
module output_tool_surfaces
  use base_errors, only: error_t
  use base_kinds, only: rp, sp
  use io_frames, only: frame_name, write_series
  use io_tool_frames, only: write_tool_frame
  use simulation_parts, only: simulation_t
  implicit none (type, external)
  private

  public :: put_tools, list_tools

  character(*), parameter :: ending = '_tools'   !! suffix of the name of their series

contains

  !> Collective. Write frame `k` (from 0) of the tools, if any has a surface.
  subroutine put_tools(sim, k, error)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: k
    type(error_t), intent(inout) :: error
    real(rp), allocatable :: x(:, :)
    real(sp), allocatable :: place(:, :), velocity(:, :), azimuth(:)
    integer, allocatable :: corner(:, :), number(:), part(:, :)
    integer :: i, p

    allocate (place(3, 0), velocity(3, 0), azimuth(0), number(0), corner(3, 0))
    do i = 1, size(sim%tool)
      if (.not. sim%tool(i)%has_shape()) cycle
      call sim%tool(i)%shape%surface(x, part)
      corner = reshape([corner, part + size(number)], [3, size(corner, 2) + size(part, 2)])
      number = [number, spread(i, 1, size(x, 2))]
      azimuth = [azimuth, real(atan2(x(2, :), x(1, :)), sp)]
      x = matmul(sim%tool(i)%axes, x) + spread(sim%tool(i)%position, 2, size(x, 2))
      place = reshape([place, real(x, sp)], [3, size(number)])
      velocity = reshape([velocity, [(real(sim%tool(i)%surface_velocity(x(:, p)), sp), p=1, &
                                      size(x, 2))]], [3, size(number)])
    end do
    if (size(corner) == 0) return
    call write_tool_frame(sim%world, sim%scene%output%directory//'/'// &
                          frame_name(sim%scene%output%name//ending, k), sim%clock%time, &
                          int(sim%clock%step), sim%tool%name, place, velocity, azimuth, number, &
                          corner, error)
  end subroutine put_tools

  !> Collective. Write the index file of these frames, if there are any.
  subroutine list_tools(sim, error)
    type(simulation_t), intent(in) :: sim
    type(error_t), intent(inout) :: error

    call write_series(sim%world, sim%scene%output%directory, sim%scene%output%name//ending, &
                      sim%history%frame_times, error)
  end subroutine list_tools

end module output_tool_surfaces
