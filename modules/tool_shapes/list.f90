! SPDX-License-Identifier: MIT
!> List of the tool shapes, by KIND of a &TOOL.
module tool_shapes_list
  use base_kinds, only: rp
  use input_values, only: input_t
  use keys_names, only: find
  use keys_table, only: key_table_t
  use tool_shapes_box, only: box_shape_t
  use tool_shapes_cut_keys, only: has_cut_keys
  use tool_shapes_cut_shoulder, only: cut_shoulder_t
  use tool_shapes_plane, only: plane_t
  use tool_shapes_shape, only: shape_t
  use tool_shapes_shoulder, only: shoulder_t
  use tool_shapes_sphere, only: sphere_t
  use tool_shapes_stl, only: stl_shape_t
  implicit none (type, external)
  private

  public :: add_shape_keys, make_shape, read_shape, shape_names

  integer, parameter :: max_shapes = 32

  !> A shape without its sizes.
  type :: named_shape_t
    character(16) :: name = ''
    class(shape_t), allocatable :: shape
  end type named_shape_t

  !> List of shapes.
  type :: shapes_t
    integer :: n = 0
    type(named_shape_t) :: entry(max_shapes)
  contains
    procedure :: add
  end type shapes_t

contains

  !> List all shapes, the default first. A new shape is one line here.
  subroutine list_shapes(shapes)
    type(shapes_t), intent(out) :: shapes

    call shapes%add('shoulder', shoulder_t())
    call shapes%add('plane', plane_t())
    call shapes%add('sphere', sphere_t())
    call shapes%add('box', box_shape_t())
    call shapes%add('stl', stl_shape_t())
  end subroutine list_shapes

  !> Append a shape.
  subroutine add(self, name, shape)
    class(shapes_t), intent(inout) :: self
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape

    self%n = self%n + 1
    self%entry(self%n)%name = name
    allocate (self%entry(self%n)%shape, source=shape)
  end subroutine add

  !> Names of all shapes.
  function shape_names() result(names)
    character(16), allocatable :: names(:)
    type(shapes_t) :: shapes

    call list_shapes(shapes)
    names = shapes%entry(:shapes%n)%name
  end function shape_names

  !> Add KIND and the keys of all shapes to &TOOL.
  subroutine add_shape_keys(t)
    type(key_table_t), intent(inout) :: t
    type(shapes_t) :: shapes
    character(:), allocatable :: names
    integer :: k

    call list_shapes(shapes)
    names = trim(shapes%entry(1)%name)
    do k = 2, shapes%n
      names = names//' '//trim(shapes%entry(k)%name)
    end do
    call t%key('KIND', 'choice', 1, '', trim(shapes%entry(1)%name), names, 'geometry')
    do k = 1, shapes%n
      call shapes%entry(k)%shape%add_keys(t)
    end do
  end subroutine add_shape_keys

  !> Make the shape of this name, without its sizes; not allocated for an unknown name.
  subroutine make_shape(name, shape)
    character(*), intent(in) :: name
    class(shape_t), allocatable, intent(out) :: shape
    type(shapes_t) :: shapes
    integer :: k

    call list_shapes(shapes)
    k = find(shapes%entry%name, name)
    if (k > 0) call move_alloc(shapes%entry(k)%shape, shape)
  end subroutine make_shape

  !> Read the shape of the `i`-th &TOOL and the axes of the tool at t = 0; not allocated for an
  !> unknown KIND. A shoulder with cuts is a separate shape.
  subroutine read_shape(input, i, shape, frame)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    class(shape_t), allocatable, intent(out) :: shape
    real(rp), intent(inout) :: frame(3, 3)         !! columns: axes of the tool

    call make_shape(input%text('TOOL', i, 'KIND'), shape)
    if (.not. allocated(shape)) return
    if (input%text('TOOL', i, 'KIND') == 'shoulder') then
      if (has_cut_keys(input, i)) then
        deallocate (shape)
        allocate (cut_shoulder_t :: shape)
      end if
    end if
    call shape%read_keys(input, i, frame)
  end subroutine read_shape

end module tool_shapes_list
