! SPDX-License-Identifier: MIT
!> List of the tool shapes, by KIND of a &TOOL.
module tools_shapes
  use base_errors, only: fatal
  use base_kinds, only: rp
  use base_text, only: joined
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape, only: shape_t
  use tools_shape_box, only: box_shape_t
  use tools_shape_cut_keys, only: has_cut_keys
  use tools_shape_cut_shoulder, only: cut_shoulder_t
  use tools_shape_plane, only: plane_t
  use tools_shape_shoulder, only: shoulder_t
  use tools_shape_sphere, only: sphere_t
  use tools_shape_stl, only: stl_shape_t
  implicit none (type, external)
  private

  public :: add_shape_keys, make_shape, read_shape, shape_names

  !> Names of all shapes, the default first. A new one has its name here and its type in
  !> `make_shape`.
  character(32), parameter :: shape_names(5) = [character(32) :: 'shoulder', 'plane', 'sphere', &
    'box', 'stl']

contains

  !> Make the shape of this name, without its sizes; not allocated for an unknown name.
  subroutine make_shape(name, shape)
    character(*), intent(in) :: name
    class(shape_t), allocatable, intent(out) :: shape

    select case (name)
    case ('shoulder'); allocate (shoulder_t :: shape)
    case ('plane'); allocate (plane_t :: shape)
    case ('sphere'); allocate (sphere_t :: shape)
    case ('box'); allocate (box_shape_t :: shape)
    case ('stl'); allocate (stl_shape_t :: shape)
    case default
    end select
  end subroutine make_shape

  !> Add KIND and the keys of all shapes to &TOOL.
  subroutine add_shape_keys(t)
    type(key_table_t), intent(inout) :: t
    class(shape_t), allocatable :: shape
    integer :: k

    call t%key('KIND', 'choice', 1, '', trim(shape_names(1)), joined(shape_names, ' '), 'geometry')
    do k = 1, size(shape_names)
      call make_shape(trim(shape_names(k)), shape)
      if (.not. allocated(shape)) call fatal('no shape of the list is '//shape_names(k))
      call shape%add_keys(t)
    end do
  end subroutine add_shape_keys

  !> Read the shape of the `i`-th &TOOL and the axes of the tool at t = 0; not allocated for an
  !> unknown KIND. A shoulder with cuts is a separate shape.
  subroutine read_shape(input, i, shape, frame)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    class(shape_t), allocatable, intent(out) :: shape
    real(rp), intent(inout) :: frame(3, 3)         !! axes of the tool, as columns

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

end module tools_shapes
