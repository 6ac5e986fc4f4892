! SPDX-License-Identifier: MIT
!> What the shape of a rigid tool must offer. Geometry is in the tool's own axes, with its POSITION
!> as the origin: signed distances (negative inside, gradient of length 1), a box around it, how
!> its surface moves when it turns, points of its surface. It owns the keys of &TOOL that describe
!> it. A new shape is a type in a file of its own and one line in `tool_shapes_list`.
module tool_shapes_shape
  use base_kinds, only: pi, rp
  use base_text, only: str
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use keys_table, only: key_table_t
  use tool_meshes_ridges, only: no_edge
  implicit none (type, external)
  private

  public :: shape_t, add_radius, add_tilt, far_larger, no_edge, tilted_frame, length_text

  type, abstract :: shape_t
    real(rp) :: radius = 0.0_rp   !! of what stirs; 0: it has none [m]
    real(rp) :: pin_radius = 0.0_rp   !! pin below a shoulder; 0: it has none [m]
  contains
    procedure(keys_interface), nopass, deferred :: add_keys
    procedure(read_interface), deferred :: read_keys
    procedure :: check_size
    procedure(distance_interface), deferred :: distance
    procedure(distances_interface), deferred :: distances
    procedure(bounds_interface), deferred :: bounds
    procedure(sweep_interface), deferred :: sweep
    procedure(outline_interface), deferred :: outline
    procedure :: surface
  end type shape_t

  abstract interface
    !> Add the rows of its keys to &TOOL; several shapes may share a key whose rows differ in the
    !> condition alone.
    subroutine keys_interface(t)
      import :: key_table_t
      implicit none (type, external)
      type(key_table_t), intent(inout) :: t
    end subroutine keys_interface

    !> Read the `i`-th &TOOL: sizes, and the tool's axes at t = 0.
    subroutine read_interface(self, input, i, frame, diagnostics)
      import :: shape_t, diagnostics_t, input_t, rp
      implicit none (type, external)
      class(shape_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      real(rp), intent(out) :: frame(3, 3)             !! columns: its axes; it spins about the last
      type(diagnostics_t), intent(inout) :: diagnostics
    end subroutine read_interface

    !> Distance of a place, its gradient, and the room along the surface to the nearest edge that
    !> stands out (`no_edge`: there is none; below 0: so far beyond it).
    pure subroutine distance_interface(self, x, d, normal, room)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), intent(in) :: x(3)                     !! [m]
      real(rp), intent(out) :: d, normal(3), room      !! [m], [-], [m]
    end subroutine distance_interface

    !> Distances of `n` places; of those beyond `most` any number beyond it will do.
    pure subroutine distances_interface(self, n, x, most, d)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      integer, intent(in) :: n
      real(rp), intent(in) :: x(n, 3), most            !! [m]
      real(rp), intent(out) :: d(n)                    !! [m]
    end subroutine distances_interface

    !> A box of the scene around the shape when its axes are `axes`: from the tool's position to the
    !> middle of the box, and half of its edges; huge where there is no end.
    pure subroutine bounds_interface(self, axes, middle, half)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), intent(in) :: axes(3, 3)
      real(rp), intent(out) :: middle(3), half(3)      !! [m]
    end subroutine bounds_interface

    !> How far, at most, its surface comes nearer to anything while it turns about its last axis.
    pure real(rp) function sweep_interface(self, before, after)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), intent(in) :: before(3, 3), after(3, 3)   !! its axes; the function is in [m]
    end function sweep_interface

    !> Points spread over its surface (3, any number), for checks of its motion; none if it has no
    !> ends.
    subroutine outline_interface(self, x)
      import :: shape_t, rp
      implicit none (type, external)
      class(shape_t), intent(in) :: self
      real(rp), allocatable, intent(out) :: x(:, :)    !! [m]
    end subroutine outline_interface
  end interface

contains

  !> Sizes that look like another unit or do not go with the bodies; all are fine if not overridden.
  subroutine check_size(self, input, i, grid, cell, width, spins, diagnostics)
    class(shape_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i                      !! number of the &TOOL
    real(rp), intent(in) :: grid                  !! longest side of the grid [m]
    real(rp), intent(in) :: cell(3)               !! edges of a cell [m]
    real(rp), intent(in) :: width                 !! of the bodies that deform, seen from above [m]
    logical, intent(in) :: spins                  !! at any time
    type(diagnostics_t), intent(inout) :: diagnostics
  end subroutine check_size

  !> Its surface as triangles, for pictures: points (3, n), and the numbers (3, m) of the corners of
  !> each, counterclockwise seen from outside. Points on an edge that shows are there once a side.
  !> None if not overridden.
  subroutine surface(self, x, corner)
    class(shape_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)    !! [m]
    integer, allocatable, intent(out) :: corner(:, :)

    allocate (x(3, 0), corner(3, 0))
  end subroutine surface

  !> What is wrong with a size far beyond that of the `grid` [m].
  function far_larger(grid) result(text)
    real(rp), intent(in) :: grid
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
               'the tool tips backwards against the travel direction +x: trailing edge deeper')
  end subroutine add_tilt

  !> Axes of a tool that is tilted: turned about y, the trailing edge (-x) goes down.
  function tilted_frame(input, i) result(frame)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: frame(3, 3), tilt

    tilt = input%real('TOOL', i, 'TILT_DEG')*pi/180.0_rp
    frame(:, 1) = [cos(tilt), 0.0_rp, sin(tilt)]
    frame(:, 2) = [0.0_rp, 1.0_rp, 0.0_rp]
    frame(:, 3) = [-sin(tilt), 0.0_rp, cos(tilt)]
  end function tilted_frame

  !> A length in mm, for messages.
  pure function length_text(x) result(text)
    real(rp), intent(in) :: x                      !! [m]
    character(:), allocatable :: text

    text = str(1.0e3_rp*x)//' mm'
  end function length_text

end module tool_shapes_shape
