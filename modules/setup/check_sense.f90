! SPDX-License-Identifier: MIT
!> Plausibility checks of a scene without errors: duplicates, overlaps, objects outside the bodies.
module setup_check_sense
  use base_kinds, only: rp
  use base_text, only: str
  use input_syntax, only: to_real
  use input_values, only: input_t
  use physics_point, only: point_t
  use setup_bodies, only: is_face
  use setup_boundary, only: wall_of
  use setup_solids, only: extent_of, is_in_body, read_all_solids, solids_t
  use setup_volumes, only: filled_share
  use state_conditions, only: wall_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: check_necking, check_sense

  real(rp), parameter :: min_overlap = 0.05_rp   !! overlap that contact tolerates [cells]

contains

  !> Report implausible parts of a scene without errors.
  subroutine check_sense(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(solids_t), allocatable :: solids(:)

    call read_all_solids(input, solids)
    call check_grid(input, scene, solids)
    call check_tables(input, scene)
    call find_duplicates(input)
    call compare_walls(input, scene)
    call compare_clamps(input, scene)
    call find_idle_clamps(input, scene, solids)
    call check_metals(input, scene, tool)
    call compare_surfaces(input)
    call compare_bodies(input, scene, solids)
    call find_separate_bodies(input, scene, solids)
    call check_probes(input, scene, solids)
    call check_sources(input, scene, solids)
    call check_friction_heat(input, scene, tool)
  end subroutine check_sense

  !> Report a grid a hundred times as long as all bodies together.
  subroutine check_grid(input, scene, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    real(rp), dimension(3) :: high, low, lower, upper
    integer :: b

    lower = huge(1.0_rp)
    upper = -huge(1.0_rp)
    do b = 1, size(solids)
      call extent_of(solids(b)%solid, low, high)
      lower = min(lower, low)
      upper = max(upper, high)
    end do
    associate (grid => scene%grid)
      if (maxval(grid%upper() - grid%lower) > 100.0_rp*maxval(upper - lower)) then
        call input%report('GRID', 1, 'UPPER', 'is '//str(maxval(grid%upper() - grid%lower))// &
                          ' m from LOWER, for bodies of '//str(maxval(upper - lower))// &
                          ' m and less: is it in mm?')
      end if
    end associate
  end subroutine check_grid

  !> Warn that without &HEAT the friction heat does not raise temperatures.
  subroutine check_friction_heat(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    integer :: k, m

    if (scene%method%conducts) return
    if (.not. any([(allocated(scene%material(m)%flow), m=1, size(scene%material))])) return
    do k = 1, input%count('TOOL')
      if (tool(k)%has_friction()) call input%warn('TOOL', k, 'NAME', 'the heat of its friction '// &
        'does not warm the metal without &HEAT, only plastic work does')
    end do
  end subroutine check_friction_heat

  !> Report strength tables of materials that only heat-only runs use.
  subroutine check_tables(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    character(14), parameter :: tables(2) = [character(14) :: 'YIELD_TABLE', 'YIELD_LOGISTIC']
    integer :: i, k
    logical :: is_given

    if (.not. scene%method%has_mechanics) return
    do i = 1, input%count('MATERIAL')
      do k = 1, size(tables)
        is_given = input%given('MATERIAL', i, trim(tables(k)))
        if (.not. is_given) cycle
        call input%report('MATERIAL', i, trim(tables(k)), 'has no effect beside mechanics, '// &
                          'only with MECHANICS = F', is_warning=input%line('METHOD', 1, &
                          'MECHANICS') < 0)
      end do
    end do
  end subroutine check_tables

  !> Report identical groups; only warn for groups whose effects add up.
  subroutine find_duplicates(input)
    type(input_t), intent(in) :: input
    character(8), parameter :: groups(5) = [character(8) :: 'LOAD', 'TRACTION', 'SOURCE', &
                                            'FIELD', 'PROBE']
    integer, parameter :: n_sums = 3                 !! number of groups whose effects add up
    character(1024), allocatable :: values(:)
    integer :: g, i, j

    do g = 1, size(groups)
      values = [character(1024) :: (values_of_group(input, trim(groups(g)), i), i=1, &
                                    input%count(trim(groups(g))))]
      do i = 2, size(values)
        j = findloc(values(:i - 1), values(i), dim=1)
        if (j > 0) call input%report(trim(groups(g)), i, '', 'is there twice, first '// &
                                     location_of(input, trim(groups(g)), j)// &
                                     trim(merge('; both act', '          ', g <= n_sums)), &
                                     is_warning=g <= n_sums)
      end do
    end do
  end subroutine find_duplicates

  !> Text of all values of a group, defaults included.
  function values_of_group(input, group, i) result(text)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(:), allocatable :: text, item
    real(rp) :: x
    integer :: g, k, n
    logical :: ok

    text = ''
    g = input%table%find_group(group)
    do k = input%table%groups(g)%first, input%table%groups(g)%last
      associate (row => input%table%keys(k))
        do n = 1, abs(row%n)
          item = input%item(group, i, trim(row%name), trim(row%kind), n)
          if (row%kind == 'real') then
            call to_real(item, x, ok)
            if (ok) item = str(x)
          end if
          text = text//item//' '
        end do
      end associate
    end do
  end function values_of_group

  !> Report two walls on one side of the grid.
  subroutine compare_walls(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(wall_t) :: one, other
    integer :: i, j

    do i = 2, input%count('WALL')
      do j = 1, i - 1
        if (input%text('WALL', i, 'SIDE') /= input%text('WALL', j, 'SIDE')) cycle
        one = wall_of(input, scene%grid, i)
        other = wall_of(input, scene%grid, j)
        if (abs(one%position - other%position) <= 1.0e-6_rp*scene%grid%h(one%axis)) then
          call input%report('WALL', i, 'SIDE', 'there is a wall in this place, '// &
                            location_of(input, 'WALL', j))
        else
          call input%warn('WALL', i, 'SIDE', 'there is another wall of this side, '// &
                          location_of(input, 'WALL', j))
        end if
        exit
      end do
    end do
  end subroutine compare_walls

  !> Report clamps that hold the same nodes.
  subroutine compare_clamps(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    real(rp) :: slack                                ! tolerance of positions [m]
    integer :: i, j, n

    slack = 1.0e-6_rp*minval(scene%grid%h)
    n = input%count('WALL') - size(scene%symmetry)   ! clamps of walls come first
    do i = 2, input%count('CLAMP')
      do j = 1, i - 1
        associate (one => scene%clamp(n + i)%clamp, other => scene%clamp(n + j)%clamp)
          if (.not. any(one%held .and. other%held)) cycle
          if (all(one%lower <= other%lower + slack .and. other%lower <= one%lower + slack .and. &
                  one%upper <= other%upper + slack .and. other%upper <= one%upper + slack)) then
            call input%report('CLAMP', i, '', 'holds the nodes of another, '//location_of(input, &
                              'CLAMP', j))
          else if (all(min(one%upper, other%upper) > max(one%lower, other%lower)) .and. &
                   any(one%held .and. other%held .and. &
                       abs(one%velocity - other%velocity) > 0.0_rp)) then
            call input%warn('CLAMP', i, '', 'overlaps another that moves differently, '// &
                            location_of(input, 'CLAMP', j))
          end if
        end associate
      end do
    end do
  end subroutine compare_clamps

  !> Warn of a clamp at rest that no body reaches.
  subroutine find_idle_clamps(input, scene, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    real(rp), parameter :: reach = 1.5_rp            !! of a quadratic B-spline [cells]
    real(rp) :: lower(3), upper(3)
    logical :: holds
    integer :: b, i

    do i = 1, input%count('CLAMP')
      associate (clamp => scene%clamp(size(scene%clamp) - input%count('CLAMP') + i)%clamp)
        holds = clamp%moves()
        do b = 1, size(solids)
          call extent_of(solids(b)%solid, lower, upper)
          holds = holds .or. all(clamp%lower < upper + reach*scene%grid%h .and. &
                                 clamp%upper > lower - reach*scene%grid%h)
        end do
      end associate
      if (.not. holds) call input%warn('CLAMP', i, '', 'holds nothing: no body is in its box')
    end do
  end subroutine find_idle_clamps

  !> Warn of a metal that a tool stirs whose properties are in other units: lithium is the lightest
  !> and softest metal, osmium the heaviest and stiffest; gold holds least heat, lithium most.
  subroutine check_metals(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    character(14), parameter :: key(3) = [character(14) :: 'DENSITY', 'YOUNGS_MODULUS', &
                                          'SPECIFIC_HEAT']
    character(8), parameter :: unit(3) = [character(8) :: 'kg/m3', 'Pa', 'J/(kg K)']
    real(rp), parameter :: least(3) = [500.0_rp, 4.0e9_rp, 100.0_rp]
    real(rp), parameter :: most(3) = [23000.0_rp, 600.0e9_rp, 4000.0_rp]
    real(rp) :: x
    integer :: i, k

    if (size(tool) == 0) return
    do i = 1, size(scene%material)
      if (.not. allocated(scene%material(i)%flow)) cycle
      do k = 1, size(key)
        if (.not. input%given('MATERIAL', i, trim(key(k)))) cycle
        x = input%real('MATERIAL', i, trim(key(k)))
        if (x >= least(k) .and. x <= most(k)) cycle
        call input%warn('MATERIAL', i, trim(key(k)), 'is that of no metal, '//str(least(k))// &
                        ' to '//str(most(k))//' '//trim(unit(k))//': is it in another unit?')
      end do
    end do
  end subroutine check_metals

  !> Report a &SURFACE that replaces an earlier one of the same face; one face after 'all' is
  !> allowed.
  subroutine compare_surfaces(input)
    type(input_t), intent(in) :: input
    character(:), allocatable :: face
    integer :: i, j

    do i = 2, input%count('SURFACE')
      face = input%text('SURFACE', i, 'FACE')
      do j = 1, i - 1
        if (input%text('SURFACE', i, 'BODY') /= input%text('SURFACE', j, 'BODY')) cycle
        if (.not. covers(face, input%text('SURFACE', j, 'FACE'))) cycle
        call input%report('SURFACE', i, 'FACE', 'takes the place of another, '//location_of(input, &
                          'SURFACE', j))
        exit
      end do
    end do
  end subroutine compare_surfaces

  !> True if one value of FACE has all faces of another.
  pure logical function covers(face, other)
    character(*), intent(in) :: face, other
    integer :: k

    covers = all([(is_face(face, k) .or. .not. is_face(other, k), k=1, 6)])
  end function covers

  !> Report bodies whose shapes overlap.
  subroutine compare_bodies(input, scene, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    real(rp) :: lower(3, 2), upper(3, 2), low(3), size_of(3), volume
    integer :: a, b

    do b = 2, size(solids)
      call extent_of(solids(b)%solid, lower(:, 1), upper(:, 1))
      do a = 1, b - 1
        if (scene%body(a)%is_rigid() .and. scene%body(b)%is_rigid()) cycle
        call extent_of(solids(a)%solid, lower(:, 2), upper(:, 2))
        low = maxval(lower, 2)
        size_of = minval(upper, 2) - low
        if (any(size_of <= min_overlap*scene%grid%h)) cycle
        volume = product(size_of)*filled_share(solids([a, b]), low, size_of)
        if (volume <= product(min_overlap*scene%grid%h)) cycle
        call input%report('BODY', b, 'NAME', 'overlaps the body '//trim(scene%body(a)%name)// &
                          ' by '//str(1.0e9_rp*volume)//' mm3 (cut one away with '// &
                          "OPERATION = 'subtract')")
      end do
    end do
  end subroutine compare_bodies

  !> Warn of separate bodies without &CONTACT, which stick together where they meet.
  subroutine find_separate_bodies(input, scene, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    real(rp), dimension(3) :: lower, upper, low, high
    integer :: a, b

    if (.not. scene%method%has_mechanics) return
    do b = 2, size(scene%body)
      call extent_of(solids(b)%solid, lower, upper)
      do a = 1, b - 1
        if (scene%body(a)%group /= scene%body(b)%group) cycle
        if (scene%body(a)%is_rigid() .and. scene%body(b)%is_rigid()) cycle
        call extent_of(solids(a)%solid, low, high)
        if (all(max(lower - high, low - upper) <= 0.5_rp*scene%grid%h)) cycle
        call input%warn('BODY', b, 'NAME', "has no &CONTACT with '"//trim(scene%body(a)%name)// &
                        "', from which it is apart: where they meet "//'they stick together, '// &
                        'and about a cell before their surfaces touch')
        exit
      end do
    end do
  end subroutine find_separate_bodies

  !> Report probes outside the bodies.
  subroutine check_probes(input, scene, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer :: i

    do i = 1, input%count('PROBE')
      if (.not. is_in_body(solids, input%reals('PROBE', i, 'POSITION', 3), &
                           minval(scene%grid%h))) then
        call input%report('PROBE', i, 'POSITION', 'lies outside the bodies')
      end if
    end do
  end subroutine check_probes

  !> Report heat sources that never touch the box around a body: a volume as far as its radius
  !> reaches, a disc along z within a cell, or within half a cell in heat-only runs.
  subroutine check_sources(input, scene, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, parameter :: times = 64
    real(rp) :: begin, end, lower(3), reach(3), upper(3), x(3)
    integer :: b, i, k
    logical :: touches

    do i = 1, input%count('SOURCE')
      begin = input%real('SOURCE', i, 'BEGIN')
      end = scene%end_time
      if (input%real('SOURCE', i, 'END') > 0.0_rp) end = min(end, input%real('SOURCE', i, 'END'))
      if (begin >= scene%end_time .and. scene%end_time > 0.0_rp) then
        call input%warn('SOURCE', i, 'BEGIN', 'is after the end of the run: it gives no heat')
        cycle
      end if
      reach = input%real('SOURCE', i, 'RADIUS')
      if (any(input%text('SOURCE', i, 'KIND') == ['disc', 'stir'])) reach(3) = &
        merge(1.0_rp, 0.5_rp, scene%method%has_mechanics)*scene%grid%h(3)*(1.0_rp + 1.0e-6_rp)
      touches = .false.
      do b = 1, size(solids)
        call extent_of(solids(b)%solid, lower, upper)
        do k = 0, times
          x = input%reals('SOURCE', i, 'POSITION', 3) &
              + (begin + (end - begin)*k/times)*input%reals('SOURCE', i, 'VELOCITY', 3)
          touches = touches .or. all(x + reach >= lower .and. x - reach <= upper)
        end do
      end do
      if (.not. touches) call input%report('SOURCE', i, 'POSITION', 'the source never touches '// &
                                           'a body')
    end do
  end subroutine check_sources

  !> Text `on line 7`, or group and number if the line is not known.
  function location_of(input, group, i) result(text)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(:), allocatable :: text

    text = '&'//group//' number '//str(i)
    if (input%line(group, i) > 0) text = 'on line '//str(input%line(group, i))
  end function location_of

  !> Warn of bodies that neck from the first plastic strain on, in scenes without tools; under a
  !> tool the material is in compression. By the criterion of Considere (1885) a bar in tension is
  !> stable while its load rises, d(sigma exp(-epsilon))/d(epsilon) > 0. Otherwise the neck is as
  !> wide as the cells, and the results depend on them.
  subroutine check_necking(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    real(rp), parameter :: strain = 0.01_rp        !! plastic strain of the comparison
    real(rp), parameter :: rate = 1.0_rp           !! plastic strain rate of the comparison [1/s]
    type(point_t) :: point
    real(rp) :: yield, temperature
    integer :: b

    if (input%count('TOOL') > 0) return
    do b = 1, size(scene%body)
      associate (material => scene%material(scene%body(b)%material))
        if (scene%body(b)%is_rigid() .or. .not. allocated(material%flow)) cycle
        temperature = input%real('BODY', b, 'TEMPERATURE')
        call point%init(material, temperature, rate)
        yield = point%sigma
        call point%strain_to(material, strain, rate, temperature)
        if (point%sigma*exp(-strain) >= yield) cycle
        call input%warn('BODY', b, 'MATERIAL', 'does not harden: its flow stress '// &
                        'changes by '//str(100.0_rp*(point%sigma/yield - 1.0_rp))// &
                        ' % in the first '//str(100.0_rp*strain)//' % of plastic strain. Where '// &
                        'it is stretched it necks, in a band as wide as the cells')
      end associate
    end do
  end subroutine check_necking

end module setup_check_sense
