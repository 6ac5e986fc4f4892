! SPDX-License-Identifier: MIT
!> From the checked input to a scene: grid, materials, bodies, walls, tools, method, output.
!> What only shows here (a name that nobody has, a shape outside the grid) joins the complaints.
module setup_scene
  use base_kinds, only: i8, rp
  use grid_geometry, only: make_grid
  use physics_johnson_cook, only: johnson_cook_t
  use physics_material, only: material_t
  use setup_complaints, only: complaints_t
  use setup_contacts, only: read_contacts
  use setup_input, only: input_t
  use setup_names, only: find, known
  use setup_solids, only: bounds, read_solid, solid_t
  use setup_tools, only: read_tools
  use time_state, only: probes_t, scene_t, scheme_usl, simulation_t, transfer_apic, &
                        transfer_fmpm, transfer_xpic
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
    call lay_out_fields(input, sim%scene, complaints)
    call read_materials(input, sim%scene, complaints)
    call read_bodies(input, sim%scene, complaints)
    call read_surfaces(input, sim%scene, complaints)
    call check_shapes(input, sim%scene, complaints)
    call read_constraints(input, sim%scene, complaints)
    call read_tools(input, sim%scene%body, sim%tool, complaints)
    call read_contacts(input, sim%scene, sim%n_groups, complaints)
    call read_probes(input, sim%scene, sim%probes, complaints)
  end subroutine build_scene

  subroutine read_general(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints

    scene%title = input%text('RUN', 1, 'TITLE')
    call read_grid(input, scene, complaints)
    scene%end_time = input%real('TIME', 1, 'END')
    scene%max_steps = int(input%integer('TIME', 1, 'MAX_STEPS'), i8)
    associate (m => scene%method)
      m%cfl = input%real('TIME', 1, 'CFL')
      if (m%cfl <= 0.0_rp) m%cfl = 0.4_rp
      m%fixed_dt = input%real('TIME', 1, 'DT')
      m%mass_scaling = input%real('TIME', 1, 'MASS_SCALING')
      m%gravity = input%reals('TIME', 1, 'GRAVITY', 3)
      m%is_bspline = input%text('METHOD', 1, 'SHAPE') == 'bspline'
      m%half_length = merge(1.0e-3_rp, 0.5_rp, input%text('METHOD', 1, 'SHAPE') == 'linear')
      m%scheme = find(['usl  ', 'usf  ', 'musl ', 'usavg'], input%text('METHOD', 1, 'SCHEME'))
      m%transfer = find(['flip', 'apic', 'xpic', 'fmpm'], input%text('METHOD', 1, 'TRANSFER'))
      m%order = input%integer('METHOD', 1, 'ORDER')
      m%every = input%integer('METHOD', 1, 'EVERY')
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
      o%safety_interval = input%real('OUTPUT', 1, 'SAFETY_INTERVAL')
    end associate
  end subroutine read_general

  !> Fields of a particle beyond the common ones; methods that do not go together.
  subroutine lay_out_fields(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints

    associate (m => scene%method, layout => scene%layout)
      if (input%text('METHOD', 1, 'SHAPE') == 'cpgimp') call layout%add(3, layout%half)
      if (m%transfer == transfer_apic) call layout%add(9, layout%affine)
      if (m%scheme /= scheme_usl .and. (m%transfer == transfer_xpic .or. &
                                        m%transfer == transfer_fmpm)) then
        call input%complain(complaints, 'METHOD', 1, 'SCHEME', &
          'must be usl with TRANSFER = xpic or fmpm')
      end if
    end associate
  end subroutine lay_out_fields

  !> A grid that cannot be made has no nodes, and nothing is compared with it.
  subroutine read_grid(input, scene, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(complaints_t), intent(inout) :: complaints
    real(rp) :: lower(3), upper(3), h

    lower = input%reals('GRID', 1, 'LOWER', 3)
    upper = input%reals('GRID', 1, 'UPPER', 3)
    h = input%real('GRID', 1, 'CELL')
    if (h <= 0.0_rp .or. .not. input%given('GRID', 1, 'UPPER')) return   ! has its complaint
    if (any(upper - lower < h)) then
      call input%complain(complaints, 'GRID', 1, 'UPPER', 'must be at least one cell above LOWER')
    else if (product((upper - lower)/h) > 2.0e9_rp) then
      call input%complain(complaints, 'GRID', 1, 'CELL', 'makes more than 2e9 cells')
    else
      scene%grid = make_grid(h, lower, upper)
    end if
  end subroutine read_grid

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
        case default   ! elastic
        end select
        do j = 1, i - 1
          if (scene%material(j)%name == m%name) call input%complain(complaints, 'MATERIAL', i, &
            'NAME', 'another material has this name')
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
    integer :: i, j, per_cell(3)

    allocate (scene%body(input%count('BODY')))
    do i = 1, size(scene%body)
      associate (b => scene%body(i))
        b%name = input%text('BODY', i, 'NAME')
        per_cell = input%integers('BODY', i, 'PARTICLES_PER_CELL', 3)
        where (per_cell == 0) per_cell = max(1, per_cell(1))
        b%spacing = scene%grid%h/per_cell
        b%material = find(scene%material%name, input%text('BODY', i, 'MATERIAL'))
        if (b%material == 0) then
          call input%complain(complaints, 'BODY', i, 'MATERIAL', &
            'there is no &MATERIAL of this name; '//known(scene%material%name))
          b%material = 1
        end if
        do j = 1, i - 1
          if (scene%body(j)%name == b%name) call input%complain(complaints, 'BODY', i, 'NAME', &
            'another body has this name')
        end do
      end associate
    end do
    do i = 1, input%count('LOAD')
      if (find(scene%body%name, input%text('LOAD', i, 'BODY')) == 0) then
        call input%complain(complaints, 'LOAD', i, 'BODY', &
          'there is no &BODY of this name; '//known(scene%body%name))
      end if
    end do
  end subroutine read_bodies

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
        if (input%given('SURFACE', i, 'AMBIENT')) then
          scene%body(body)%ambient(face) = input%real('SURFACE', i, 'AMBIENT')
        end if
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
      if (scene%grid%n(1) == 0) cycle
      if (any(lower < scene%grid%lower - slack) .or. any(upper > top + slack)) then
        call input%complain(complaints, 'SHAPE', i, '', 'reaches outside the grid')
      end if
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
        if (any(c%upper < c%lower)) call input%complain(complaints, 'CLAMP', i, 'UPPER', &
          'must not be below LOWER')
      end associate
    end do
  end subroutine read_constraints

  subroutine read_probes(input, scene, probes, complaints)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(probes_t), intent(inout) :: probes
    type(complaints_t), intent(inout) :: complaints
    real(rp) :: top(3)
    integer :: i

    probes%n = input%count('PROBE')
    allocate (probes%name(probes%n), probes%x(3, probes%n), probes%temperature(probes%n), &
              probes%is_mine(probes%n), probes%group(probes%n))
    probes%group = 1
    probes%temperature = 298.0_rp            ! until `warm_probes`
    probes%is_mine = .false.
    top = scene%grid%lower + scene%grid%h*(scene%grid%n - 1)
    do i = 1, probes%n
      probes%name(i) = input%text('PROBE', i, 'NAME')
      probes%x(:, i) = input%reals('PROBE', i, 'POSITION', 3)
      if (scene%grid%n(1) == 0) cycle
      if (any(probes%x(:, i) < scene%grid%lower) .or. any(probes%x(:, i) > top)) then
        call input%complain(complaints, 'PROBE', i, 'POSITION', 'lies outside the grid')
      end if
    end do
  end subroutine read_probes

end module setup_scene
