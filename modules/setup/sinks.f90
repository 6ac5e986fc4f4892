! SPDX-License-Identifier: MIT
!> Heat sinks: backing plates behind the faces of bodies, from the &SURFACE groups, and the
!> partition of the friction heat at a tool: a fixed share (given or from effusivities), or a tool
!> with a temperature of its own that conducts heat away.
module setup_sinks
  use base_kinds, only: pi, rp
  use base_log, only: log_line
  use base_text, only: str
  use input_key_table, only: find
  use input_values, only: input_t
  use setup_bodies, only: face_names, is_face
  use setup_boundary, only: wall_of
  use setup_solids, only: extent_of, read_body_solids, solid_t
  use state_conditions, only: wall_t
  use state_scene, only: scene_t, scheme_usl
  use tools_heat_sink, only: backing_t, find_backing, heat_sink_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: log_heat_shares, read_backings, read_tool_heat

  character(16), parameter :: property(3) = [character(16) :: 'CONDUCTIVITY', 'DENSITY', &
                                             'SPECIFIC_HEAT']

contains

  !> Backings of all &SURFACE groups; the last one of a face has effect. The films of the faces must
  !> have been read.
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
        if (.not. is_face(input%text('SURFACE', i, 'FACE'), face)) cycle
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
      call input%report('SURFACE', i, 'BACKING_COOLING', 'needs a BACKING_THICKNESS: an '// &
                        'infinite plate has no far side')
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
    real(rp) :: area, extent(2), lower(3), properties(3), start, thickness, upper(3)
    character(:), allocatable :: kind
    integer :: k

    backing%name = trim(scene%body(body)%name)//'_'//face_names(face)//'_backing'
    backing%body = body
    backing%face = face
    backing%across = pack([1, 2, 3], [1, 2, 3] /= (face + 1)/2)
    call read_body_solids(input, body, solids)
    call extent_of(solids, lower, upper)
    backing%lower = lower(backing%across)
    extent = upper(backing%across) - backing%lower
    kind = input%text('SURFACE', i, 'BACKING')
    if (kind /= 'lumped') then
      backing%n = max(1, ceiling(extent/scene%grid%h(backing%across) - rounding))
    end if
    backing%width = extent/backing%n
    backing%period = scene%grid%h(backing%across)*scene%grid%period(backing%across)
    area = product(backing%width)
    column%coolant = scene%body(body)%film(face)%ambient
    start = input%real('SURFACE', i, 'BACKING_TEMPERATURE', otherwise=column%coolant)
    thickness = 0.0_rp
    select case (kind)
    case ('body')
      start = input%real('SURFACE', i, 'BACKING_TEMPERATURE', &
                         otherwise=input%real('BODY', body, 'TEMPERATURE'))
      associate (metal => scene%material(scene%body(body)%material))
        properties = [metal%conductivity_at(start), metal%rho, metal%specific_heat_at(start)]
      end associate
    case ('plate')
      column%cooling = area*input%real('SURFACE', i, 'BACKING_COOLING')
      thickness = input%real('SURFACE', i, 'BACKING_THICKNESS')
      properties = [(input%real('SURFACE', i, 'BACKING_'//trim(property(k))), k=1, 3)]
    case default
      column%cooling = area*input%real('SURFACE', i, 'BACKING_COOLING')
      call column%make_lumped(input%real('SURFACE', i, 'BACKING_CAPACITY'), start)
    end select
    if (kind /= 'lumped') call column%make_rod(area, thickness, 0.25_rp*minval(scene%body(body) &
        %spacing), properties(1), properties(2)*properties(3), start)
    allocate (backing%column(product(backing%n)), source=column)
  end subroutine make_backing

  !> Read thermal properties of all &TOOL groups; reserve the particle fields of tools that heat up.
  subroutine read_tool_heat(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), intent(inout) :: tool(:)
    integer :: i, n

    n = 0
    do i = 1, input%count('TOOL')
      call read_share(input, i, scene, tool(i))
      tool(i)%heat%is_on = input%text('TOOL', i, 'HEATS') /= 'no'
      if (tool(i)%heat%is_on) n = n + 1
    end do
    if (n == 0) return
    call scene%layout%add(2*n, 'contact and heat at a tool', scene%layout%tool_heat)
    n = 0
    do i = 1, input%count('TOOL')
      if (.not. tool(i)%heat%is_on) cycle
      tool(i)%heat%place = scene%layout%tool_heat + 2*n
      n = n + 1
      call check_heating(input, i, scene)
      call read_heating(input, i, scene, tool(i))
    end do
  end subroutine read_tool_heat

  !> Share of the friction heat that enters the bodies: as given, or from the tool's effusivity.
  subroutine read_share(input, i, scene, tool)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(inout) :: tool
    logical :: heats, is_given(3), share_is_given
    integer :: b, k

    is_given = [(input%given('TOOL', i, trim(property(k))), k=1, 3)]
    share_is_given = input%given('TOOL', i, 'HEAT_SHARE')
    heats = input%text('TOOL', i, 'HEATS') /= 'no'
    if (share_is_given) tool%fixed_heat_share = input%real('TOOL', i, 'HEAT_SHARE')
    if (share_is_given .and. heats) call input%report('TOOL', i, 'HEAT_SHARE', &
      'does not go with HEATS: the share then follows from the temperatures')
    if (.not. any(is_given)) return
    if (.not. all(is_given)) then
      call input%report('TOOL', i, trim(property(findloc(is_given, .true., dim=1))), &
                        'needs CONDUCTIVITY, DENSITY and SPECIFIC_HEAT of the tool together')
    else if (share_is_given .and. .not. heats) then
      call input%report('TOOL', i, 'CONDUCTIVITY', 'the material of the tool has no effect '// &
                        'with HEAT_SHARE')
    end if
    if (heats .or. share_is_given) return
    tool%effusivity = sqrt(product([(input%real('TOOL', i, trim(property(k))), k=1, 3)]))
    do b = 1, size(scene%body)
      if (scene%body(b)%material == 0) cycle
      associate (mat => scene%material(scene%body(b)%material))
        if (mat%conducts() .and. mat%has_heat_capacity) cycle
        call input%report('TOOL', i, 'CONDUCTIVITY', "the share of '"//trim(scene%body(b)%name)// &
                          "' needs a CONDUCTIVITY above 0 and the SPECIFIC_HEAT of '"// &
                          trim(mat%name)//"'")
      end associate
    end do
  end subroutine read_share

  !> Report settings that cannot be combined with a tool that heats up.
  subroutine check_heating(input, i, scene)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    integer :: b

    if (.not. scene%method%conducts) then
      call input%report('TOOL', i, 'HEATS', 'needs a &HEAT group')
    else
      do b = 1, size(scene%body)
        if (scene%body(b)%material == 0) cycle
        if (scene%material(scene%body(b)%material)%conducts()) cycle
        call input%report('TOOL', i, 'HEATS', "needs bodies that conduct: '"// &
                          trim(scene%body(b)%name)//"' has a CONDUCTIVITY of 0")
      end do
    end if
    if (scene%method%scheme /= scheme_usl) then
      call input%report('TOOL', i, 'HEATS', 'needs SCHEME = usl: with others the area in '// &
                        'contact is not known')
    end if
  end subroutine check_heating

  !> Read the heat sink behind the tool face: a lumped capacity or a rod.
  subroutine read_heating(input, i, scene, tool)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(inout) :: tool
    real(rp) :: area, first, k, length, start
    integer :: b

    associate (heat => tool%heat)
      heat%gap_coefficient = input%real('TOOL', i, 'CONTACT_CONDUCTANCE', &
                                        otherwise=heat%gap_coefficient)
      heat%cooling = input%real('TOOL', i, 'COOLING')
      heat%coolant = input%real('TOOL', i, 'COOLING_TEMPERATURE')
      start = input%real('TOOL', i, 'TEMPERATURE')
      if (input%text('TOOL', i, 'HEATS') /= 'rod') then
        call heat%make_lumped(input%real('TOOL', i, 'HEAT_CAPACITY'), start)
        return
      end if
      length = input%real('TOOL', i, 'HEAT_LENGTH')
      if (length <= 0.0_rp .and. heat%cooling > 0.0_rp) then
        call input%report('TOOL', i, 'COOLING', 'needs a HEAT_LENGTH: an infinite rod is '// &
                          'cooled by itself')
      end if
      area = face_area(input, i, scene, tool)
      if (area <= 0.0_rp) call input%report('TOOL', i, 'HEAT_AREA', 'must be given: this tool '// &
                                            'has no RADIUS from which it would follow')
      k = input%real('TOOL', i, 'CONDUCTIVITY')
      if (.not. input%given('TOOL', i, 'CONDUCTIVITY')) call input%report('TOOL', i, 'HEATS', &
        'a rod needs CONDUCTIVITY, DENSITY and SPECIFIC_HEAT of the tool')
      if (input%diagnostics%count() > 0) then
        heat%is_on = .false.
        return
      end if
      first = minval([(0.25_rp*minval(scene%body(b)%spacing), b=1, size(scene%body))])
      call heat%make_rod(area, length, first, k, input%real('TOOL', i, 'DENSITY') &
                         *input%real('TOOL', i, 'SPECIFIC_HEAT'), start)
    end associate
  end subroutine read_heating

  !> Cross-section of the rod behind the face [m2]: as given, or of a circle with the tool's RADIUS,
  !> halved for each wall through its axis; 0 if the tool has no RADIUS.
  real(rp) function face_area(input, i, scene, tool) result(area)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    real(rp), parameter :: slack = 1.0e-6_rp      !! tolerance of distances over the radius
    type(wall_t) :: wall
    integer :: w

    area = input%real('TOOL', i, 'HEAT_AREA')
    if (input%given('TOOL', i, 'HEAT_AREA')) return
    associate (radius => tool%stirring_radius())
      area = pi*radius**2
      do w = 1, input%count('WALL')
        wall = wall_of(input, scene%grid, w)
        if (abs(tool%start(wall%axis) - wall%position) <= slack*radius &
            .and. abs(tool%frame(wall%axis, 3)) <= slack) area = 0.5_rp*area
      end do
    end associate
  end function face_area

  !> Log the share of the friction heat that enters each body, where effusivities determine it.
  subroutine log_heat_shares(scene, tool)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    character(:), allocatable :: at
    real(rp) :: e
    integer :: b, k

    do k = 1, size(tool)
      if (tool(k)%effusivity <= 0.0_rp) cycle
      do b = 1, size(scene%body)
        if (scene%body(b)%is_rigid()) cycle
        associate (mat => scene%material(scene%body(b)%material))
          e = mat%effusivity(mat%t_ref)
          at = ''
          if (allocated(mat%c_table) .or. allocated(mat%k_table)) at = ' at '//str(mat%t_ref)//' K'
        end associate
        call log_line('friction     '// &
                      trim(tool(k)%name)//': '//str(100.0_rp*tool(k)%heat_share(e))// &
                      ' % of its heat enters '//trim(scene%body(b)%name)//' (effusivities '// &
                      str(e)// &
                      ' and '//str(tool(k)%effusivity)//' J/(m2 K s^0.5))'//at)
      end do
    end do
  end subroutine log_heat_shares

end module setup_sinks
