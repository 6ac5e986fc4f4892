! SPDX-License-Identifier: MIT
!> Interface of the shapes of rigid tools. Geometry is in the tool's own axes with its POSITION as
!> the origin: signed distances (negative inside, gradient of length 1), bounding box, motion of the
!> surface in rotation, points of the surface. A shape has its own keys of &TOOL. A new shape is a
!> type in a file of its own and a name in `tools_shapes`.
module tools_shape
  use base_kinds, only: pi, rp
  use base_text, only: str
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_mesh_ridges, only: no_edge
  implicit none (type, external)
  private

  public :: shape_t, add_radius, add_tilt, far_larger, no_edge, tilted_frame, length_text

  !> Shape of a tool.
  type, abstract :: shape_t
    real(rp) :: radius = 0.0_rp   !! outer radius; 0: none [m]
    real(rp) :: pin_radius = 0.0_rp   !! radius of a pin below a shoulder; 0: none [m]
  contains
    procedure(keys_interface), nopass, deferred :: add_keys
    procedure(read_interface), deferred :: read_keys
    procedure :: check_size
    procedure(distance_interface), deferred :: distance
    procedure(distances_interface), deferred :: distances
    procedure :: lower_bounds
    procedure :: near_distance
    procedure(bounds_interface), deferred :: bounds
    procedure(sweep_interface), deferred :: sweep
    procedure :: outline, surface
  end type shape_t

  abstract interface
    !> Add the rows of the shape's keys to &TOOL; shapes may share a key if their rows differ only
    !> in the condition.
    subroutine keys_interface(t)
      import :: key_table_t
      implicit none (type, external)
      type(key_table_t), intent(inout) :: t
    end subroutine keys_interface

    !> Read the keys of the `i`-th &TOOL, and the axes of the tool at t = 0.
    subroutine read_interface(self, input, i, frame)
      import :: shape_t, input_t, rp
      implicit none (type, external)
      class(shape_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      !> Axes of the tool, as columns; the last one is the axis of rotation.
      real(rp), intent(out) :: frame(3, 3)
    end subroutine read_interface

    !> Signed distance of a point, its gradient, and the distance along the surface to the nearest
    !> convex edge (`no_edge` if there is none; negative beyond the edge).
    pure subroutine distance_interface(self, x, d, normal, edge_distance)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), intent(in) :: x(3)                     !! point [m]
      real(rp), intent(out) :: d               !! signed distance [m]
      real(rp), intent(out) :: normal(3)       !! unit normal [-]
      real(rp), intent(out) :: edge_distance   !! distance to the edge [m]
    end subroutine distance_interface

    !> Signed distances of `n` points; beyond the cutoff any value above it may be returned.
    pure subroutine distances_interface(self, n, x, cutoff, d)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      integer, intent(in) :: n
      real(rp), intent(in) :: x(n, 3), cutoff          !! position, cutoff distance [m]
      real(rp), intent(out) :: d(n)                    !! signed distances [m]
    end subroutine distances_interface

    !> Bounding box in scene axes for the tool axes `axes`: from the tool's position to the middle
    !> of the box, and its half edges; huge for infinite extent.
    pure subroutine bounds_interface(self, axes, middle, half)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), intent(in) :: axes(3, 3)
      real(rp), intent(out) :: middle(3), half(3)  !! middle of the box, half edges of the box [m]
    end subroutine bounds_interface

    !> Upper bound of the approach of the surface to any point during a rotation about the last axis
    !> [m].
    pure real(rp) function sweep_interface(self, before, after)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), intent(in) :: before(3, 3), after(3, 3)   !! axes before and after
    end function sweep_interface
  end interface

contains

  !> Lower bounds of the signed distances of `n` points. The default are the distances themselves,
  !> or any value above the cutoff beyond it.
  pure subroutine lower_bounds(self, n, x, cutoff, d)
    class(shape_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff          !! position, cutoff distance [m]
    real(rp), intent(out) :: d(n)                    !! signed distances [m]

    call self%distances(n, x, cutoff, d)
  end subroutine lower_bounds

  !> Signed distance, gradient and distance to the edge as in `distance`. Beyond the cutoff any
  !> value above it may be returned; beyond that of the edge only the sign of the distance to the
  !> edge is certain.
  pure subroutine near_distance(self, x, cutoff, edge_cutoff, d, normal, edge_distance)
    class(shape_t), intent(in) :: self
    real(rp), intent(in) :: x(3), cutoff, edge_cutoff    !! position, cutoff distances [m]
    real(rp), intent(out) :: d               !! signed distance [m]
    real(rp), intent(out) :: normal(3)       !! unit normal [-]
    real(rp), intent(out) :: edge_distance   !! distance to the edge [m]

    call self%distance(x, d, normal, edge_distance)
  end subroutine near_distance

  !> Report sizes that suggest another unit or do not fit the bodies. The default reports none.
  subroutine check_size(self, input, i, grid, cell, width, spins)
    class(shape_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i                      !! index of the &TOOL
    real(rp), intent(in) :: grid                  !! longest side of the grid [m]
    real(rp), intent(in) :: cell(3)               !! edges of a cell [m]
    real(rp), intent(in) :: width                 !! horizontal extent of deformable bodies [m]
    logical, intent(in) :: spins                  !! the tool rotates in any phase
  end subroutine check_size

  !> Points spread over the surface, (3, n), for checks of the motion. The default, for infinite
  !> extent, has none.
  subroutine outline(self, x)
    class(shape_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)    !! positions [m]

    allocate (x(3, 0))
  end subroutine outline

  !> Surface triangles for visualization: points (3, n), and the indices (3, m) of their corners,
  !> counterclockwise seen from outside. Points on sharp edges are duplicated for each side. The
  !> default has none.
  subroutine surface(self, x, corner)
    class(shape_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)    !! positions [m]
    integer, allocatable, intent(out) :: corner(:, :)

    allocate (x(3, 0), corner(3, 0))
  end subroutine surface

  !> Message on a size far larger than the grid.
  function far_larger(grid) result(text)
    real(rp), intent(in) :: grid                  !! longest side of the grid [m]
    character(:), allocatable :: text

    text = 'is far larger than the grid of '//length_text(grid)//': lengths are in m'
  end function far_larger

  !> Add the row of RADIUS for a shape that has one.
  subroutine add_radius(t, kind)
    type(key_table_t), intent(inout) :: t
    character(*), intent(in) :: kind

    call t%key('RADIUS', 'real', 1, 'm', 'required if KIND = '//kind, '(0,inf)', &
               'radius; of a shoulder that of its face')
  end subroutine add_radius

  !> Add the row of TILT_DEG for a shape that is tilted.
  subroutine add_tilt(t, kind)
    type(key_table_t), intent(inout) :: t
    character(*), intent(in) :: kind

    call t%key('TILT_DEG', 'real', 1, 'deg', '0 if KIND = '//kind, '[-10,10]', &
               'tilt of the tool backwards, against the direction of travel +x: its trailing '// &
               'edge is deeper')
  end subroutine add_tilt

  !> Axes of a tilted tool: rotated about y such that the trailing edge (-x) is lower.
  function tilted_frame(input, i) result(frame)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: frame(3, 3), tilt

    tilt = input%real('TOOL', i, 'TILT_DEG')*pi/180.0_rp
    frame(:, 1) = [cos(tilt), 0.0_rp, sin(tilt)]
    frame(:, 2) = [0.0_rp, 1.0_rp, 0.0_rp]
    frame(:, 3) = [-sin(tilt), 0.0_rp, cos(tilt)]
  end function tilted_frame

  !> Text of a length in mm.
  pure function length_text(x) result(text)
    real(rp), intent(in) :: x                      !! length [m]
    character(:), allocatable :: text

    text = str(1.0e3_rp*x)//' mm'
  end function length_text

end module tools_shape
