! SPDX-License-Identifier: MIT
!> Heat sinks behind the faces of bodies (backing plates), from the &SURFACE groups.
module setup_backings
  use base_kinds, only: rp
  use bodies_solids, only: body_solids, extent_of, solid_t
  use contact_backing, only: backing_t, find_backing
  use contact_heat_sink, only: heat_sink_t
  use input_values, only: input_t
  use keys_names, only: find
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: read_backings

  character(4), parameter :: face_names(6) = ['xmin', 'xmax', 'ymin', 'ymax', 'zmin', 'zmax']

contains

  !> Backings of all &SURFACE groups; of several for one face the last holds. The films of the
  !> faces must have been read.
  subroutine read_backings(input, scene, backing)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(backing_t), allocatable, intent(out) :: backing(:)
    type(backing_t) :: new
    integer :: body, face, i, k

    allocate (backing(0))
    do i = 1, input%count('SURFACE')
      if (input%text('SURFACE', i, 'BACKING') == 'none') cycle
      call check_backing(input, i, scene)
      body = find(scene%body%name, input%text('SURFACE', i, 'BODY'))
      if (body == 0 .or. input%diagnostics%count() > 0) cycle
      do face = 1, 6
        if (all(input%text('SURFACE', i, 'FACE') /= ['all ', face_names(face)])) cycle
        if (.not. scene%body(body)%film(face)%has_backing) cycle
        call make_backing(input, i, scene, body, face, new)
        k = find_backing(backing, body, face)
        if (k > 0) then
          backing(k) = new
        else
          backing = [backing, new]
        end if
      end do
    end do
  end subroutine read_backings

  !> Report keys that cannot be combined with a backing.
  subroutine check_backing(input, i, scene)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene

    if (.not. scene%method%has_mechanics) then
      call input%report('SURFACE', i, 'BACKING', 'needs mechanics: with MECHANICS = F make the '// &
                        'backing plate a &BODY')
    end if
    if (input%real('SURFACE', i, 'EMISSIVITY') > 0.0_rp) then
      call input%report('SURFACE', i, 'EMISSIVITY', 'does not go with BACKING: a face radiates '// &
                        'to what is not in contact')
    end if
    if (input%text('SURFACE', i, 'BACKING') == 'plate' .and. &
        input%real('SURFACE', i, 'BACKING_THICKNESS') <= 0.0_rp .and. &
        input%real('SURFACE', i, 'BACKING_COOLING') > 0.0_rp) then
      call input%report('SURFACE', i, 'BACKING_COOLING', 'needs a BACKING_THICKNESS: a plate '// &
                        'without end has no far side')
    end if
  end subroutine check_backing

  !> Backing of one face of a body, from the `i`-th &SURFACE: columns about as wide as grid cells.
  subroutine make_backing(input, i, scene, body, face, backing)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i, body, face
    type(scene_t), intent(in) :: scene
    type(backing_t), intent(out) :: backing
    real(rp), parameter :: rounding = 1.0e-9_rp
    type(heat_sink_t) :: column
    type(solid_t), allocatable :: solids(:)
    real(rp) :: area, extent(2), lower(3), start, upper(3)
    logical :: is_plate

    backing%name = trim(scene%body(body)%name)//'_'//face_names(face)//'_backing'
    backing%body = body
    backing%face = face
    backing%across = pack([1, 2, 3], [1, 2, 3] /= (face + 1)/2)
    call body_solids(input, body, solids)
    call extent_of(solids, lower, upper)
    backing%lower = lower(backing%across)
    extent = upper(backing%across) - backing%lower
    is_plate = input%text('SURFACE', i, 'BACKING') == 'plate'
    if (is_plate) backing%n = max(1, ceiling(extent/scene%grid%h(backing%across) - rounding))
    backing%width = extent/backing%n
    backing%period = scene%grid%h(backing%across)*scene%grid%period(backing%across)
    area = product(backing%width)
    column%cooling = area*input%real('SURFACE', i, 'BACKING_COOLING')
    column%coolant = scene%body(body)%film(face)%ambient
    start = input%real('SURFACE', i, 'BACKING_TEMPERATURE', otherwise=column%coolant)
    if (is_plate) then
      call column%make_rod(area, input%real('SURFACE', i, 'BACKING_THICKNESS'), &
                           0.25_rp*minval(scene%body(body)%spacing), &
                           input%real('SURFACE', i, 'BACKING_CONDUCTIVITY'), &
                           input%real('SURFACE', i, 'BACKING_DENSITY') &
                           *input%real('SURFACE', i, 'BACKING_SPECIFIC_HEAT'), start)
    else
      call column%make_lumped(input%real('SURFACE', i, 'BACKING_CAPACITY'), start)
    end if
    allocate (backing%column(product(backing%n)), source=column)
  end subroutine make_backing

end module setup_backings
