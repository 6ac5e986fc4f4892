! SPDX-License-Identifier: MIT
!> Walls, clamps and tractions from the input. A wall on a plane of nodes with no
!> material behind it is a plane of symmetry; any other wall is a clamp that holds the nodes at and
!> behind it.
module setup_boundary
  use base_kinds, only: rp
  use base_text, only: lower, str
  use grid_geometry, only: grid_t
  use input_key_table, only: find
  use input_values, only: input_t
  use setup_solids, only: extent_of, read_all_solids, solids_t
  use state_clamp, only: clamp_t
  use state_conditions, only: append_clamp, clamp_groups, make_clamp, symmetry_t, wall_t
  use state_scene, only: scene_t, traction_t
  implicit none (type, external)
  private

  public :: read_conditions, read_tractions, tractions_have_boxes, wall_of

contains

  !> Fill `scene%wall`, `scene%symmetry`, `scene%clamp` and the names of the conditions: walls
  !> first, then each kind of clamp, in the order of the input file.
  subroutine read_conditions(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    integer :: i, k

    allocate (scene%wall(0), scene%symmetry(0), scene%clamp(0))
    allocate (scene%condition(input%count('WALL') + &
                              sum([(input%count(trim(clamp_groups(k))), k=1, size(clamp_groups))])))
    do i = 1, input%count('WALL')
      call read_wall(input, i, scene)
      associate (before => scene%condition(1:i - 1), name => scene%condition(i))
        name = 'wall_'//input%text('WALL', i, 'SIDE')
        if (any(before == name)) name = trim(name)//'_'//str(i)
      end associate
    end do
    i = input%count('WALL')
    do k = 1, size(clamp_groups)
      call read_clamps(input, trim(clamp_groups(k)), i, scene)
    end do
  end subroutine read_conditions

  !> Read all groups of one kind of clamp.
  subroutine read_clamps(input, group, place, scene)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(inout) :: place       !! index of the condition read last
    type(scene_t), intent(inout) :: scene
    class(clamp_t), allocatable :: clamp
    integer :: i

    do i = 1, input%count(group)
      call make_clamp(group, clamp)
      call clamp%read_keys(input, i)
      place = place + 1
      clamp%place = place
      associate (period => scene%grid%h*scene%grid%period)
        where (period > 0.0_rp .and. clamp%upper - clamp%lower >= period)   ! no faces
          clamp%lower = -huge(1.0_rp)
          clamp%upper = huge(1.0_rp)
        end where
      end associate
      scene%condition(place) = lower(group)//str(i)
      call append_clamp(scene%clamp, clamp)
    end do
  end subroutine read_clamps

  !> The `i`-th &WALL.
  type(wall_t) function wall_of(input, grid, i) result(wall)
    type(input_t), intent(in) :: input
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: i
    integer :: side

    side = index('xminxmaxyminymaxzminzmax', input%text('WALL', i, 'SIDE'))/4
    wall%axis = side/2 + 1
    wall%faces_up = mod(side, 2) == 0
    wall%position = grid%lower(wall%axis)
    if (.not. wall%faces_up) then
      wall%position = wall%position + grid%h(wall%axis)*(grid%n(wall%axis) - 1)
      associate (grading => grid%grading(wall%axis))
        if (grading%is_graded) wall%position = grading%middle(grid%n(wall%axis) - 1)
      end associate
    end if
    if (input%given('WALL', i, 'POSITION')) wall%position = input%real('WALL', i, 'POSITION')
    wall%held = input%text('WALL', i, 'KIND') == 'fixed'
    wall%held(wall%axis) = .true.
  end function wall_of

  subroutine read_wall(input, i, scene)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(inout) :: scene
    type(wall_t) :: wall
    type(symmetry_t) :: symmetry
    type(clamp_t) :: clamp
    logical :: has_temperature
    character(11), parameter :: of_planes(2) = ['TEMPERATURE', 'FRICTION   ']
    integer :: k

    wall = wall_of(input, scene%grid, i)
    scene%wall = [scene%wall, wall]
    if (scene%grid%period(wall%axis) > 0) then
      call input%report('WALL', i, 'SIDE', 'the grid is periodic along this axis')
    end if
    has_temperature = input%given('WALL', i, 'TEMPERATURE')
    if (has_temperature .and. .not. scene%method%conducts) then
      call input%report('WALL', i, 'TEMPERATURE', 'has no effect without a &HEAT group')
    end if
    if (is_symmetric(input, scene%grid, wall)) then
      symmetry = symmetry_t(place=i, axis=wall%axis, row=row_of(scene%grid, wall), &
                            faces_up=wall%faces_up, odd=wall%held)
      if (.not. all(wall%held)) symmetry%friction_coefficient = input%real('WALL', i, 'FRICTION')
      if (has_temperature) symmetry%temperature = input%real('WALL', i, 'TEMPERATURE')
      scene%symmetry = [scene%symmetry, symmetry]
    else
      clamp = clamp_t(place=i, held=wall%held, is_wall=.true.)
      if (wall%faces_up) clamp%upper(wall%axis) = wall%position
      if (.not. wall%faces_up) clamp%lower(wall%axis) = wall%position
      call append_clamp(scene%clamp, clamp)
      do k = 1, 2
        if (.not. input%given('WALL', i, trim(of_planes(k))) .or. scene%grid%n(1) == 0) cycle
        call input%report('WALL', i, trim(of_planes(k)), &
                          'needs a wall on a plane of nodes with no &SHAPE behind it')
      end do
    end if
  end subroutine read_wall

  !> Position of a wall in units of node rows, 0 at the lowest row.
  pure real(rp) function fractional_row_of(grid, wall)
    type(grid_t), intent(in) :: grid
    type(wall_t), intent(in) :: wall

    if (grid%grading(wall%axis)%is_graded) then
      fractional_row_of = grid%grading(wall%axis)%place(wall%position)
    else
      fractional_row_of = (wall%position - grid%lower(wall%axis))/grid%h(wall%axis)
    end if
  end function fractional_row_of

  !> Row of grid nodes nearest to a wall, from 0; -1 if the wall is outside the grid.
  pure integer function row_of(grid, wall)
    type(grid_t), intent(in) :: grid
    type(wall_t), intent(in) :: wall
    real(rp) :: row

    row = fractional_row_of(grid, wall)
    row_of = -1
    if (row >= -0.5_rp .and. row <= grid%n(wall%axis) - 0.5_rp) row_of = nint(row)
  end function row_of

  !> True if a wall lies on a row of nodes and no shape reaches behind it.
  logical function is_symmetric(input, grid, wall)
    type(input_t), intent(in) :: input
    type(grid_t), intent(in) :: grid
    type(wall_t), intent(in) :: wall
    real(rp) :: row

    row = fractional_row_of(grid, wall)
    is_symmetric = row_of(grid, wall) >= 0 .and. abs(row - row_of(grid, wall)) <= 1.0e-6_rp
    if (is_symmetric .and. grid%grading(wall%axis)%is_graded) then
      is_symmetric = grid%grading(wall%axis)%is_mirrored(row_of(grid, wall))
    end if
    if (is_symmetric) is_symmetric = has_nothing_behind(input, wall, 1.0e-6_rp*grid%h(wall%axis))
  end function is_symmetric

  !> True if no shape reaches behind a wall by more than a tolerance.
  logical function has_nothing_behind(input, wall, slack)
    type(input_t), intent(in) :: input
    type(wall_t), intent(in) :: wall
    real(rp), intent(in) :: slack           !! tolerance [m]
    type(solids_t), allocatable :: list(:)
    real(rp) :: low(3), high(3)
    integer :: b

    has_nothing_behind = .true.
    call read_all_solids(input, list)
    do b = 1, size(list)
      call extent_of(list(b)%solid, low, high)
      if (wall%faces_up) then
        has_nothing_behind = has_nothing_behind .and. low(wall%axis) >= wall%position - slack
      else
        has_nothing_behind = has_nothing_behind .and. high(wall%axis) <= wall%position + slack
      end if
    end do
  end function has_nothing_behind

  !> True if any &TRACTION acts on part of a face only.
  logical function tractions_have_boxes(input)
    type(input_t), intent(in) :: input
    integer :: i

    tractions_have_boxes = any([(has_box(input, i), i=1, input%count('TRACTION'))])
  end function tractions_have_boxes

  logical function has_box(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    has_box = input%given('TRACTION', i, 'LOWER') .or. input%given('TRACTION', i, 'UPPER')
  end function has_box

  !> Read the tractions of each body, in the order of the input file.
  subroutine read_tractions(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(traction_t) :: traction
    integer :: body, i

    do i = 1, input%count('TRACTION')
      call read_traction(input, i, traction)
      body = find(scene%body%name, input%text('TRACTION', i, 'BODY'))
      if (body == 0) cycle
      associate (b => scene%body(body))
        if (.not. allocated(b%traction)) allocate (b%traction(0))
        b%traction = [b%traction, traction]
      end associate
    end do
  end subroutine read_tractions

  subroutine read_traction(input, i, traction)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(traction_t), intent(out) :: traction
    character(4), parameter :: faces(6) = ['xmin', 'xmax', 'ymin', 'ymax', 'zmin', 'zmax']
    character(:), allocatable :: wanted
    real(rp) :: pressure, vector(3)
    integer :: axis, k

    pressure = input%real('TRACTION', i, 'PRESSURE')
    vector = input%reals('TRACTION', i, 'VECTOR', 3)
    wanted = input%text('TRACTION', i, 'FACE')
    do k = 1, 6
      if (wanted /= 'all' .and. wanted /= faces(k)) cycle
      axis = (k + 1)/2
      traction%stress(:, k) = vector
      traction%stress(axis, k) = vector(axis) + merge(pressure, -pressure, mod(k, 2) == 1)
    end do
    traction%ramp = input%real('TRACTION', i, 'RAMP')
    traction%has_box = has_box(input, i)
    if (input%given('TRACTION', i, 'LOWER')) traction%lower = input%reals('TRACTION', i, 'LOWER', 3)
    if (input%given('TRACTION', i, 'UPPER')) traction%upper = input%reals('TRACTION', i, 'UPPER', 3)
    if (all(abs([pressure, vector]) <= 0.0_rp)) then
      call input%report('TRACTION', i, '', 'needs a PRESSURE or a VECTOR')
    end if
    if (any(traction%upper < traction%lower)) then
      call input%report('TRACTION', i, 'UPPER', 'must not be below LOWER')
    end if
  end subroutine read_traction

end module setup_boundary
