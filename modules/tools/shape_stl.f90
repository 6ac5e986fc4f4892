! SPDX-License-Identifier: MIT
!> Tool shape: the surface of an STL file, in any unit, orientation and position.
module tools_shape_stl
  use base_kinds, only: pi, rp
  use input_key_table, only: key_table_t
  use input_resolved, only: file_path
  use input_values, only: input_t
  use tools_mesh, only: new_mesh
  use tools_mesh_facets, only: cross, facets_t
  use tools_mesh_stl_file, only: read_stl
  use tools_shape, only: add_tilt, far_larger, tilted_frame
  use tools_shape_meshed, only: meshed_t
  implicit none (type, external)
  private

  public :: read_facets, stl_shape_t

  type, extends(meshed_t) :: stl_shape_t
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, check_size
  end type stl_shape_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('FILE', 'text', 1, '', 'required if KIND = stl', '', &
               'STL file of a closed surface, text or binary, beside the input')
    call t%key('UNIT', 'choice', 1, '', 'required if KIND = stl', 'm cm mm um in', &
               'unit of length of the file')
    call t%key('ORIGIN', 'real', 3, 'm', '0 0 0 if KIND = stl', '', &
               'point of the model that is placed at POSITION, on the axis of rotation')
    call t%key('AXIS', 'real', 3, '', '0 0 1 if KIND = stl', '', &
               'direction in the model that becomes the upward axis of the tool')
    call t%key('TURN_DEG', 'real', 1, 'deg', '0 if KIND = stl', '[-360,360]', &
               'rotation of the model about that axis, counterclockwise seen from above')
    call add_tilt(t, 'stl')
  end subroutine add_keys

  subroutine read_keys(self, input, i, frame)
    class(stl_shape_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(out) :: frame(3, 3)
    type(facets_t) :: facets
    real(rp) :: axes(3, 3), axis(3), origin(3)
    integer :: p
    logical :: ok

    frame = tilted_frame(input, i)
    axis = input%reals('TOOL', i, 'AXIS', 3)
    if (norm2(axis) <= 0.0_rp) then
      call input%report('TOOL', i, 'AXIS', 'must not be zero')
      return
    end if
    call read_facets(input, 'TOOL', i, facets, ok)
    if (.not. ok) return
    axes = axes_of(axis/norm2(axis), input%real('TOOL', i, 'TURN_DEG')*pi/180.0_rp)
    origin = input%reals('TOOL', i, 'ORIGIN', 3)
    do p = 1, size(facets%x, 2)
      facets%x(:, p) = matmul(axes, facets%x(:, p) - origin)
    end do
    call new_mesh(facets, self%mesh)
    self%radius = self%mesh%radius
  end subroutine read_keys

  !> Read the facets of the `i`-th `group` from its FILE in its UNIT [m]; report errors.
  subroutine read_facets(input, group, i, facets, ok)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    type(facets_t), intent(out) :: facets
    logical, intent(out) :: ok
    character(:), allocatable :: path
    real(rp) :: unit
    integer :: before
    logical :: opened

    ok = .false.
    path = file_path(input, group, i)
    unit = metres(input%text(group, i, 'UNIT'))
    if (path == '' .or. unit <= 0.0_rp) return   ! reported before
    before = input%diagnostics%count()
    call read_stl(path, facets, opened, input%diagnostics)
    if (.not. opened) call input%report(group, i, 'FILE', path//' cannot be read')
    ok = input%diagnostics%count() == before
    if (ok) facets%x = unit*facets%x
  end subroutine read_facets

  !> Length of a unit [m]; 0 for an unknown unit.
  pure real(rp) function metres(unit)
    character(*), intent(in) :: unit

    select case (unit)
    case ('m')
      metres = 1.0_rp
    case ('cm')
      metres = 1.0e-2_rp
    case ('mm')
      metres = 1.0e-3_rp
    case ('um')
      metres = 1.0e-6_rp
    case ('in')
      metres = 25.4e-3_rp
    case default
      metres = 0.0_rp
    end select
  end function metres

  !> Rotation matrix that takes `axis` of the model to z and the projection of its x axis (y axis,
  !> if x is along `axis`) to x, followed by a rotation by `angle` about z.
  pure function axes_of(axis, angle) result(axes)
    real(rp), intent(in) :: axis(3)                 !! direction, of length 1
    real(rp), intent(in) :: angle                   !! [rad]
    real(rp) :: axes(3, 3), ahead(3), left(3)

    ahead = merge([0.0_rp, 1.0_rp, 0.0_rp], [1.0_rp, 0.0_rp, 0.0_rp], abs(axis(1)) > 0.9_rp)
    ahead = ahead - dot_product(ahead, axis)*axis
    ahead = ahead/norm2(ahead)
    left = cross(axis, ahead)
    axes(1, :) = cos(angle)*ahead - sin(angle)*left
    axes(2, :) = sin(angle)*ahead + cos(angle)*left
    axes(3, :) = axis
  end function axes_of

  !> Report a size that suggests a wrong unit.
  subroutine check_size(self, input, i, grid, cell, width, spins)
    class(stl_shape_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: grid, cell(3), width
    logical, intent(in) :: spins

    if (maxval(self%mesh%upper - self%mesh%lower) > 10.0_rp*grid) then
      call input%report('TOOL', i, 'UNIT', 'the model '//far_larger(grid))
    else if (maxval(self%mesh%upper - self%mesh%lower) < minval(cell)) then
      call input%report('TOOL', i, 'UNIT', 'the model is smaller than a cell')
    end if
  end subroutine check_size

end module tools_shape_stl
