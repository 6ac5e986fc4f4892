! SPDX-License-Identifier: MIT
!> From the checked input to walls and clamps. A wall on a plane of nodes with no material behind it
!> is a mirror; any other holds the nodes at and behind it.
module setup_walls
  use base_kinds, only: rp
  use base_text, only: str
  use bodies_solids, only: bounds, read_solid, solid_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use state_scene, only: constraint_t, scene_t
  implicit none (type, external)
  private

  public :: read_constraints

contains

  !> Fill `scene%constraint`: walls first, then clamps, each in the order of the file.
  subroutine read_constraints(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i, n

    n = input%count('WALL')
    allocate (scene%constraint(n + input%count('CLAMP')))
    do i = 1, n
      call read_wall(input, i, scene, scene%constraint(i), diagnostics)
      associate (before => scene%constraint(1:i - 1)%name, name => scene%constraint(i)%name)
        if (any(before == name)) name = trim(name)//'_'//str(i)
      end associate
    end do
    do i = 1, input%count('CLAMP')
      call read_clamp(input, i, scene%constraint(n + i), diagnostics)
    end do
  end subroutine read_constraints

  subroutine read_wall(input, i, scene, wall, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    type(constraint_t), intent(inout) :: wall
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: place, row
    integer :: axis, side

    side = index('xminxmaxyminymaxzminzmax', input%text('WALL', i, 'SIDE'))/4
    axis = side/2 + 1
    wall%name = 'wall_'//input%text('WALL', i, 'SIDE')
    wall%faces_up = mod(side, 2) == 0
    wall%lower = -huge(1.0_rp)
    wall%upper = huge(1.0_rp)
    if (scene%grid%period(axis) > 0) call input%report(diagnostics, 'WALL', i, 'SIDE', &
      'the grid is periodic along this axis')
    place = scene%grid%lower(axis)
    if (.not. wall%faces_up) place = place + scene%grid%h*(scene%grid%n(axis) - 1)
    if (input%given('WALL', i, 'POSITION')) place = input%real('WALL', i, 'POSITION')
    if (wall%faces_up) then
      wall%upper(axis) = place
    else
      wall%lower(axis) = place
    end if
    wall%component = input%text('WALL', i, 'KIND') == 'fixed'
    wall%component(axis) = .true.
    row = (place - scene%grid%lower(axis))/scene%grid%h
    if (row >= -0.5_rp .and. row <= scene%grid%n(axis) - 0.5_rp) then
      wall%plane = nint(row)
      if (abs(row - wall%plane) <= 1.0e-6_rp) then
        if (is_bare(input, axis, place, wall%faces_up, 1.0e-6_rp*scene%grid%h)) wall%axis = axis
      end if
    end if
    if (.not. input%given('WALL', i, 'TEMPERATURE')) return
    wall%temperature = input%real('WALL', i, 'TEMPERATURE')
    if (.not. scene%method%conducts) call input%report(diagnostics, 'WALL', i, 'TEMPERATURE', &
      'has no effect without a &HEAT group')
    if (wall%axis == 0) call input%report(diagnostics, 'WALL', i, 'TEMPERATURE', &
      'needs a wall on a plane of nodes with no &SHAPE behind it')
  end subroutine read_wall

  !> True if no shape reaches behind a wall.
  logical function is_bare(input, axis, place, faces_up, slack)
    type(input_t), intent(in) :: input
    integer, intent(in) :: axis
    real(rp), intent(in) :: place, slack   !! [m]
    logical, intent(in) :: faces_up        !! the wall's front is on its upper side
    type(diagnostics_t) :: said             !! elsewhere
    type(solid_t) :: solid
    real(rp) :: lower(3), upper(3)
    integer :: i

    is_bare = .true.
    do i = 1, input%count('SHAPE')
      call read_solid(input, i, solid, said)
      if (.not. solid%adds) cycle
      call bounds(solid, lower, upper)
      if (faces_up) then
        is_bare = is_bare .and. lower(axis) >= place - slack
      else
        is_bare = is_bare .and. upper(axis) <= place + slack
      end if
    end do
  end function is_bare

  subroutine read_clamp(input, i, clamp, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(constraint_t), intent(inout) :: clamp
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: letters
    integer :: a

    clamp%name = 'clamp'//str(i)
    clamp%lower = input%reals('CLAMP', i, 'LOWER', 3)
    clamp%upper = input%reals('CLAMP', i, 'UPPER', 3)
    clamp%velocity = input%reals('CLAMP', i, 'VELOCITY', 3)
    letters = input%text('CLAMP', i, 'COMPONENTS')
    clamp%component = [(index(letters, 'xyz'(a:a)) > 0, a=1, 3)]
    if (any(clamp%upper < clamp%lower)) call input%report(diagnostics, 'CLAMP', i, 'UPPER', &
      'must not be below LOWER')
  end subroutine read_clamp

end module setup_walls
