! SPDX-License-Identifier: MIT
!> From the checked input to a scene: grid, materials, bodies, walls, tools, method, output.
!> What only shows here (a name that nobody has, a shape outside the grid) joins the complaints.
module setup_scene
  use base_kinds, only: i8, pi, rp
  use base_text, only: str
  use contact_motion, only: phase_t
  use contact_shapes, only: shoulder_profile
  use contact_tool, only: kind_box, kind_plane, kind_revolved, kind_sphere, tool_t
  use grid_geometry, only: make_grid
  use physics_johnson_cook, only: johnson_cook_t
  use physics_material, only: material_t
  use setup_complaints, only: complaints_t
  use setup_input, only: input_t
  use setup_solids, only: bounds, read_solid, solid_t
  use time_state, only: constraint_t, probes_t, scene_t, scheme_usavg, scheme_usl, simulation_t
  implicit none (type, external)
  private

  public :: build_scene

contains

  !> Fill `sim%scene`, the tools and the probes.
  subroutine build_scene(input, sim, complaints)
    type(input_t), intent(in) :: input
    type(simulation_t), intent(inout) :: sim
    type(complaints_t), intent(inout) :: complaints

    call read_general(input, sim%scene, complaints)
    call read_materials(input, sim%scene, complaints)
    call read_bodies(input, sim%scene, complaints)
    call read_surfaces(input, sim%scene, complaints)
    call check_shapes(input, sim%scene, complaints)
    call read_constraints(input, sim%scene, complaints)
    call read_tools(input, sim%tool, complaints)
    call read_probes(input, sim%scene, sim%probes, complaints)
  end subroutine build_scene

  subroutine read_general(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints
    real(rp) :: lower(3), upper(3), cells(3)

    scene%title = input%text('RUN', 1, 'TITLE')
    lower = input%reals('GRID', 1, 'LOWER', 3)
    upper = input%reals('GRID', 1, 'UPPER', 3)
    cells = (upper - lower)/input%real('GRID', 1, 'CELL')
    if (any(cells < 1.0_rp)) then
      call input%complain(complaints, 'GRID', 1, 'UPPER', 'must be at least one cell above LOWER')
    else if (product(cells) > 2.0e9_rp) then
      call input%complain(complaints, 'GRID', 1, 'CELL', 'makes more than 2e9 cells')
    else
      scene%grid = make_grid(input%real('GRID', 1, 'CELL'), lower, upper)
    end if
    scene%end_time = input%real('TIME', 1, 'END')
    scene%max_steps = int(input%integer('TIME', 1, 'MAX_STEPS'), i8)
    associate (m => scene%method)
      m%cfl = input%real('TIME', 1, 'CFL')
      m%fixed_dt = input%real('TIME', 1, 'DT')
      m%mass_scaling = input%real('TIME', 1, 'MASS_SCALING')
      m%gravity = input%reals('TIME', 1, 'GRAVITY', 3)
      m%is_bspline = input%text('METHOD', 1, 'SHAPE') == 'bspline'
      m%half_length = merge(1.0e-3_rp, 0.5_rp, input%text('METHOD', 1, 'SHAPE') == 'linear')
      m%scheme = merge(scheme_usavg, scheme_usl, input%text('METHOD', 1, 'SCHEME') == 'usavg')
      m%pic = input%real('METHOD', 1, 'PIC_FRACTION')
      m%fbar = input%logical('METHOD', 1, 'FBAR')
      m%sort_interval = input%integer('METHOD', 1, 'SORT_INTERVAL')
      m%rebalance = input%real('METHOD', 1, 'REBALANCE')
      m%conducts = input%count('HEAT') > 0
      if (m%conducts) m%fourier = input%real('HEAT', 1, 'FOURIER')
    end associate
    associate (o => scene%output)
      o%name = input%text('RUN', 1, 'NAME')
      o%frame_interval = input%real('OUTPUT', 1, 'FRAME_INTERVAL')
      o%history_interval = input%real('OUTPUT', 1, 'HISTORY_INTERVAL')
      if (o%history_interval <= 0.0_rp) o%history_interval = scene%end_time/500.0_rp
      o%checkpoint_interval = input%real('OUTPUT', 1, 'CHECKPOINT_INTERVAL')
      o%progress_interval = input%real('OUTPUT', 1, 'PROGRESS_INTERVAL')
    end associate
  end subroutine read_general

  subroutine read_materials(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints
    integer :: i, j

    allocate (scene%material(input%count('MATERIAL')))
    do i = 1, size(scene%material)
      associate (m => scene%material(i))
        m%name = input%text('MATERIAL', i, 'NAME')
        m%rho = input%real('MATERIAL', i, 'DENSITY')
        call m%set_elastic(input%real('MATERIAL', i, 'YOUNGS_MODULUS'), &
                           input%real('MATERIAL', i, 'POISSON_RATIO'))
        m%expansion = input%real('MATERIAL', i, 'EXPANSION')
        m%t_ref = input%real('MATERIAL', i, 'T_ROOM')
        m%c_p = input%real('MATERIAL', i, 'SPECIFIC_HEAT')
        m%conductivity = input%real('MATERIAL', i, 'CONDUCTIVITY')
        m%plastic_heat = input%real('MATERIAL', i, 'PLASTIC_HEAT')
        ! A new flow law is one line here.
        select case (input%text('MATERIAL', i, 'LAW'))
        case ('johnson-cook')
          call read_johnson_cook(input, i, m, complaints)
        end select
        do j = 1, i - 1
          if (scene%material(j)%name == m%name) call input%complain(complaints, 'MATERIAL', i, 'NAME', &
            'another material has this name')
        end do
      end associate
    end do
  end subroutine read_materials

  subroutine read_johnson_cook(input, i, material, complaints)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(inout) :: material
    type(complaints_t), intent(inout) :: complaints
    type(johnson_cook_t) :: law

    law%a = input%real('MATERIAL', i, 'JC_A')
    law%b = input%real('MATERIAL', i, 'JC_B')
    law%n = input%real('MATERIAL', i, 'JC_N')
    law%c = input%real('MATERIAL', i, 'JC_C')
    law%m = input%real('MATERIAL', i, 'JC_M')
    law%rate0 = input%real('MATERIAL', i, 'JC_RATE0')
    law%t_room = input%real('MATERIAL', i, 'T_ROOM')
    law%t_melt = input%real('MATERIAL', i, 'T_MELT')
    if (law%t_melt <= law%t_room) call input%complain(complaints, 'MATERIAL', i, 'T_MELT', &
      'must be above T_ROOM')
    allocate (material%flow, source=law)
  end subroutine read_johnson_cook

  subroutine read_bodies(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints
    integer :: i, j

    allocate (scene%body(input%count('BODY')))
    do i = 1, size(scene%body)
      associate (b => scene%body(i))
        b%name = input%text('BODY', i, 'NAME')
        b%spacing = scene%grid%h/input%integer('BODY', i, 'PARTICLES_PER_CELL')
        b%material = find(scene%material%name, input%text('BODY', i, 'MATERIAL'))
        if (b%material == 0) then
          call input%complain(complaints, 'BODY', i, 'MATERIAL', 'there is no &MATERIAL of this name; ' &
                              //known(scene%material%name))
          b%material = 1
        end if
        do j = 1, i - 1
          if (scene%body(j)%name == b%name) call input%complain(complaints, 'BODY', i, 'NAME', &
            'another body has this name')
        end do
      end associate
    end do
    do i = 1, input%count('LOAD')
      if (find(scene%body%name, input%text('LOAD', i, 'BODY')) == 0) call input%complain(complaints, &
        'LOAD', i, 'BODY', 'there is no &BODY of this name; '//known(scene%body%name))
    end do
  end subroutine read_bodies

  !> Place of `name` in a list, 0 if it is not there.
  pure integer function find(names, name)
    character(*), intent(in) :: names(:), name

    do find = 1, size(names)
      if (names(find) == name) return
    end do
    find = 0
  end function find

  pure function known(names) result(text)
    character(*), intent(in) :: names(:)
    character(:), allocatable :: text
    integer :: i

    text = 'known:'
    do i = 1, size(names)
      text = text//' '//trim(names(i))
    end do
  end function known

  subroutine read_surfaces(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints
    character(4), parameter :: faces(6) = ['xmin', 'xmax', 'ymin', 'ymax', 'zmin', 'zmax']
    character(:), allocatable :: wanted
    integer :: body, face, i

    do i = 1, input%count('SURFACE')
      if (.not. scene%method%conducts) call input%complain(complaints, 'SURFACE', i, '', &
        'has no effect without a &HEAT group')
      body = find(scene%body%name, input%text('SURFACE', i, 'BODY'))
      if (body == 0) then
        call input%complain(complaints, 'SURFACE', i, 'BODY', 'there is no &BODY of this name; '// &
                            known(scene%body%name))
        cycle
      end if
      wanted = input%text('SURFACE', i, 'FACE')
      do face = 1, 6
        if (wanted /= 'all' .and. wanted /= faces(face)) cycle
        scene%body(body)%film(face) = input%real('SURFACE', i, 'COEFFICIENT')
        scene%body(body)%ambient(face) = input%real('HEAT', 1, 'AMBIENT')
        if (input%given('SURFACE', i, 'AMBIENT')) &
          scene%body(body)%ambient(face) = input%real('SURFACE', i, 'AMBIENT')
      end do
    end do
  end subroutine read_surfaces

  !> Shapes must belong to a body and lie inside the grid; bodies must have a shape.
  subroutine check_shapes(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(complaints_t), intent(inout) :: complaints
    type(solid_t) :: solid
    real(rp) :: lower(3), upper(3), top(3), slack
    logical :: has_shape(size(scene%body))
    integer :: body, i

    has_shape = .false.
    top = scene%grid%lower + scene%grid%h*(scene%grid%n - 1)
    slack = 1.0e-9_rp*scene%grid%h
    do i = 1, input%count('SHAPE')
      call read_solid(input, i, solid, complaints)
      body = find(scene%body%name, input%text('SHAPE', i, 'BODY'))
      if (body == 0) then
        call input%complain(complaints, 'SHAPE', i, 'BODY', 'there is no &BODY of this name; '// &
                            known(scene%body%name))
        cycle
      end if
      if (.not. solid%adds) cycle
      has_shape(body) = .true.
      call bounds(solid, lower, upper)
      if (any(lower < scene%grid%lower - slack) .or. any(upper > top + slack)) &
        call input%complain(complaints, 'SHAPE', i, '', 'reaches outside the grid')
    end do
    do body = 1, size(scene%body)
      if (.not. has_shape(body)) call input%complain(complaints, 'BODY', body, 'NAME', &
        'no &SHAPE adds material to this body')
    end do
  end subroutine check_shapes

  !> Walls become clamps of all nodes at and behind them.
  subroutine read_constraints(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints
    character(:), allocatable :: letters
    real(rp) :: far
    integer :: a, i, n, side

    n = input%count('WALL')
    allocate (scene%constraint(n + input%count('CLAMP')))
    far = huge(1.0_rp)
    do i = 1, n
      associate (c => scene%constraint(i))
        c%lower = -far
        c%upper = far
        side = index('xminxmaxyminymaxzminzmax', input%text('WALL', i, 'SIDE'))/4
        a = side/2 + 1
        if (mod(side, 2) == 0) then
          c%upper(a) = scene%grid%lower(a)
          if (input%given('WALL', i, 'POSITION')) c%upper(a) = input%real('WALL', i, 'POSITION')
        else
          c%lower(a) = scene%grid%lower(a) + scene%grid%h*(scene%grid%n(a) - 1)
          if (input%given('WALL', i, 'POSITION')) c%lower(a) = input%real('WALL', i, 'POSITION')
        end if
        c%component = input%text('WALL', i, 'KIND') == 'fixed'
        c%component(a) = .true.
      end associate
    end do
    do i = 1, input%count('CLAMP')
      associate (c => scene%constraint(n + i))
        c%lower = input%reals('CLAMP', i, 'LOWER', 3)
        c%upper = input%reals('CLAMP', i, 'UPPER', 3)
        c%velocity = input%reals('CLAMP', i, 'VELOCITY', 3)
        letters = input%text('CLAMP', i, 'COMPONENTS')
        c%component = [(index(letters, 'xyz'(a:a)) > 0, a=1, 3)]
        if (verify(letters, 'xyz') > 0 .or. .not. any(c%component)) call input%complain(complaints, &
          'CLAMP', i, 'COMPONENTS', 'expected some of the letters x, y and z')
        if (any(c%upper < c%lower)) call input%complain(complaints, 'CLAMP', i, 'UPPER', &
          'must not be below LOWER')
      end associate
    end do
  end subroutine read_constraints

  subroutine read_tools(input, tool, complaints)
    type(input_t), intent(in) :: input
    type(tool_t), allocatable, intent(out) :: tool(:)
    type(complaints_t), intent(inout) :: complaints
    integer :: i, j

    allocate (tool(input%count('TOOL')))
    do i = 1, size(tool)
      tool(i)%name = input%text('TOOL', i, 'NAME')
      tool(i)%start = input%reals('TOOL', i, 'POSITION', 3)
      tool(i)%friction = input%real('TOOL', i, 'FRICTION')
      tool(i)%shear_limit = input%logical('TOOL', i, 'SHEAR_LIMIT')
      tool(i)%heat_share = input%real('TOOL', i, 'HEAT_SHARE')
      call read_tool_shape(input, i, tool(i), complaints)
      call read_motion(input, tool(i))
      call tool(i)%move_to(0.0_rp)
      do j = 1, i - 1
        if (tool(j)%name == tool(i)%name) call input%complain(complaints, 'TOOL', i, 'NAME', &
          'another tool has this name')
      end do
    end do
    do i = 1, input%count('MOTION')
      if (find(tool%name, input%text('MOTION', i, 'TOOL')) == 0) call input%complain(complaints, &
        'MOTION', i, 'TOOL', 'there is no &TOOL of this name; '//known(tool%name))
    end do
  end subroutine read_tools

  !> Kind, size and frame. The tilt turns the shoulder about y: the trailing edge (-x) goes down.
  subroutine read_tool_shape(input, i, tool, complaints)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(tool_t), intent(inout) :: tool
    type(complaints_t), intent(inout) :: complaints
    real(rp) :: tilt, pin, tip, normal(3), side(3)

    tool%radius = input%real('TOOL', i, 'RADIUS')
    tilt = input%real('TOOL', i, 'TILT_DEG')*pi/180.0_rp
    tool%frame(:, 1) = [cos(tilt), 0.0_rp, sin(tilt)]
    tool%frame(:, 2) = [0.0_rp, 1.0_rp, 0.0_rp]
    tool%frame(:, 3) = [-sin(tilt), 0.0_rp, cos(tilt)]
    select case (input%text('TOOL', i, 'KIND'))
    case ('shoulder')
      tool%kind = kind_revolved
      pin = input%real('TOOL', i, 'PIN_RADIUS')
      tip = input%real('TOOL', i, 'PIN_TIP_RADIUS')
      if (tip <= 0.0_rp) tip = pin
      if (pin >= tool%radius .and. tool%radius > 0.0_rp) call input%complain(complaints, 'TOOL', i, &
        'PIN_RADIUS', 'must be below RADIUS')
      tool%profile = shoulder_profile(tool%radius, input%real('TOOL', i, 'HEIGHT'), &
                                      input%real('TOOL', i, 'CONCAVITY_DEG')*pi/180.0_rp, pin, tip, &
                                      input%real('TOOL', i, 'PIN_LENGTH'))
    case ('plane')
      tool%kind = kind_plane
      normal = input%reals('TOOL', i, 'NORMAL', 3)
      if (norm2(normal) <= 0.0_rp) then
        call input%complain(complaints, 'TOOL', i, 'NORMAL', 'must not be zero')
        normal = [0.0_rp, 0.0_rp, 1.0_rp]
      end if
      normal = normal/norm2(normal)
      side = merge([0.0_rp, 1.0_rp, 0.0_rp], [1.0_rp, 0.0_rp, 0.0_rp], abs(normal(1)) > 0.9_rp)
      side = side - dot_product(side, normal)*normal
      side = side/norm2(side)
      tool%frame(:, 1) = side
      tool%frame(:, 2) = [normal(2)*side(3) - normal(3)*side(2), normal(3)*side(1) - normal(1)*side(3), &
                          normal(1)*side(2) - normal(2)*side(1)]
      tool%frame(:, 3) = normal
    case ('sphere')
      tool%kind = kind_sphere
    case default
      tool%kind = kind_box
      tool%half = 0.5_rp*input%reals('TOOL', i, 'SIZE', 3)
      if (any(tool%half <= 0.0_rp)) call input%complain(complaints, 'TOOL', i, 'SIZE', &
        'must be above 0 for KIND = ''box''')
    end select
    if (tool%kind /= kind_plane .and. tool%kind /= kind_box .and. tool%radius <= 0.0_rp) &
      call input%complain(complaints, 'TOOL', i, 'RADIUS', 'must be above 0')
  end subroutine read_tool_shape

  !> The phases of this tool in the order of the file.
  subroutine read_motion(input, tool)
    type(input_t), intent(in) :: input
    type(tool_t), intent(inout) :: tool
    type(phase_t) :: phase
    integer :: i

    allocate (tool%motion%phase(0))
    do i = 1, input%count('MOTION')
      if (input%text('MOTION', i, 'TOOL') /= tool%name) cycle
      phase%duration = input%real('MOTION', i, 'DURATION')
      phase%velocity = input%reals('MOTION', i, 'VELOCITY', 3)
      phase%spin = input%real('MOTION', i, 'SPIN_RPM')*2.0_rp*pi/60.0_rp
      phase%ramp = input%real('MOTION', i, 'RAMP')
      tool%motion%phase = [tool%motion%phase, phase]
    end do
  end subroutine read_motion

  subroutine read_probes(input, scene, probes, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(probes_t), intent(inout) :: probes
    type(complaints_t), intent(inout) :: complaints
    real(rp) :: top(3)
    integer :: i

    probes%n = input%count('PROBE')
    allocate (probes%name(probes%n), probes%x(3, probes%n), probes%temperature(probes%n), &
              probes%is_mine(probes%n))
    probes%temperature = input%real('BODY', 1, 'TEMPERATURE')
    probes%is_mine = .false.
    top = scene%grid%lower + scene%grid%h*(scene%grid%n - 1)
    do i = 1, probes%n
      probes%name(i) = input%text('PROBE', i, 'NAME')
      probes%x(:, i) = input%reals('PROBE', i, 'POSITION', 3)
      if (any(probes%x(:, i) < scene%grid%lower) .or. any(probes%x(:, i) > top)) &
        call input%complain(complaints, 'PROBE', i, 'POSITION', 'lies outside the grid')
    end do
  end subroutine read_probes

end module setup_scene
