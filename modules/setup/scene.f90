! SPDX-License-Identifier: MIT
!> Build the scene from the checked input: grid, materials, bodies, walls, tools, method, output.
!> Errors that depend on several groups (shapes outside the grid, methods that exclude each other)
!> are added to the errors found before.
module setup_scene
  use base_kinds, only: i8, rp
  use base_text, only: str
  use grid_geometry, only: grade, grid_t, make_grid
  use grid_grading, only: grading_t, make_grading
  use heat_linear, only: by_cg, by_petsc
  use hooks_list, only: read_hooks
  use input_key_table, only: find
  use input_values, only: input_t
  use mpm_stability, only: default_cfl, fragment_cfl
  use particles_tracers, only: tracers_t
  use setup_bodies, only: check_shapes, read_bodies, read_surfaces
  use setup_boundary, only: read_conditions, read_tractions, tractions_have_boxes
  use setup_contacts, only: read_contacts, read_gaps
  use setup_fields, only: read_fields
  use setup_heat_scene, only: check_heat_scene
  use setup_heat_sources, only: check_heat_sense
  use setup_materials, only: check_properties, read_materials
  use setup_method, only: is_sparse, lay_out_laws, read_elastic_scaling, read_flow, &
                          read_selective_scaling, read_sleeping, shortest_domain
  use setup_motions, only: check_paths
  use setup_sinks, only: read_backings, read_tool_heat
  use setup_tools, only: read_tools
  use setup_tracers, only: read_tracers
  use state_parts, only: held_hook_t
  use state_probes, only: probes_t
  use state_scene, only: method_t, scene_t, scheme_usl, transfer_apic, transfer_fmpm, &
                              transfer_xpic
  use tools_heat_sink, only: backing_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: build_scene

contains

  !> Grade the axes of `grid` that GRADED names. After an error the grid has no nodes.
  subroutine read_grading(input, upper, grid)
    type(input_t), intent(in) :: input
    real(rp), intent(in) :: upper(3)         !! upper corner of the grid [m]
    type(grid_t), intent(inout) :: grid
    real(rp), allocatable :: fine(:)
    real(rp) :: growth, largest
    character(:), allocatable :: axes
    integer :: i

    allocate (axes, source=trim(input%text('GRID', 1, 'GRADED')))
    if (axes == 'none' .or. .not. input%given('GRID', 1, 'FINE')) return   ! reported before
    allocate (fine, source=input%list('GRID', 1, 'FINE'))
    growth = input%real('GRID', 1, 'GROWTH')
    largest = input%real('GRID', 1, 'LARGEST_CELL')
    if (largest <= 0.0_rp) largest = maxval(grid%h)
    if (growth < 1.0_rp) return              ! reported before
    if (size(fine) /= 2*len(axes)) then
      call input%report('GRID', 1, 'FINE', 'must be two places along each of the axes '//axes)
      grid%n = 0
      return
    end if
    do i = 1, len(axes)
      call grade_axis(input, index('xyz', axes(i:i)), upper, fine(2*i - 1:2*i), growth, largest, &
                      grid)
    end do
  end subroutine read_grading

  !> Grade axis `a` of `grid`, with equal cells between the positions `fine`.
  subroutine grade_axis(input, a, upper, fine, growth, largest, grid)
    type(input_t), intent(in) :: input
    integer, intent(in) :: a
    real(rp), intent(in) :: upper(3)   !! upper corner [m]
    real(rp), intent(in) :: fine(2)    !! range of the fine cells [m]
    real(rp), intent(in) :: growth     !! ratio of neighbouring cells [-]
    real(rp), intent(in) :: largest    !! largest cell [m]
    type(grid_t), intent(inout) :: grid
    real(rp) :: cells, ends(2), h
    type(grading_t) :: grading
    character(:), allocatable :: key, message
    integer :: n

    ends = [grid%lower(a), upper(a)]
    h = grid%h(a)
    cells = (fine(2) - fine(1))/h
    key = 'FINE'
    message = ''
    n = 0
    if (grid%period(a) > 0) then
      key = 'PERIODIC'
      message = 'a graded axis cannot be periodic'
    else if (fine(2) < fine(1) .or. fine(1) < ends(1) - 1.0e-9_rp*h .or. &
             fine(2) > ends(2) + 1.0e-9_rp*h) then
      message = 'must be two places along '//'xyz'(a:a)//', the lower one first, between LOWER '// &
                'and UPPER'
    else if (abs(cells - anint(cells)) > 1.0e-6_rp) then
      message = 'its length along '//'xyz'(a:a)//' must be a whole number of cells; it is '// &
                str(cells)//' of '//str(1.0e3_rp*h)//' mm'
    else if (largest < h*(1.0_rp + 1.0e-9_rp)) then
      key = 'LARGEST_CELL'
      message = 'must be more than the edge '//str(1.0e3_rp*h)//' mm that CELL gives along '// &
                'xyz'(a:a)
    else
      call make_grading(ends(1), ends(2), fine, h, growth, largest, grading, n, message)
    end if
    if (len(message) > 0) then
      call input%report('GRID', 1, key, message)
      grid%n = 0
    else
      call grade(grid, a, grading, n)
    end if
  end subroutine grade_axis

  !> Report methods that cannot be combined with a graded grid.
  subroutine check_grading(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: b

    if (.not. scene%grid%is_graded()) return
    if (.not. scene%method%is_bspline) call input%report('METHOD', 1, 'SHAPE', &
      'must be bspline on a graded grid: domains of particles are of cells with one length')
    if (scene%method%transfer == transfer_apic) call input%report('METHOD', 1, 'TRANSFER', &
      'cannot be apic on a graded grid: its moments are of cells with one length')
    if (.not. scene%method%has_mechanics) call input%report('METHOD', 1, 'MECHANICS', &
      'must be T on a graded grid: the cells of heat alone follow the shapes by themselves')
    do b = 1, size(scene%body)
      if (scene%body(b)%is_rigid()) call input%report('BODY', b, 'RIGID', 'cannot be on a '// &
        'graded grid: particles of a tool do not become finer with its cells')
      if (scene%body(b)%is_round) call input%report('BODY', b, 'LATTICE', 'cannot be round on '// &
        'a graded grid')
    end do
  end subroutine check_grading

  !> Fill the scene, the tools, backings, hooks, probes and tracer positions.
  subroutine build_scene(input, scene, tool, backing, hook, probes, tracers)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), allocatable, intent(inout) :: tool(:)
    type(backing_t), allocatable, intent(inout) :: backing(:)
    type(held_hook_t), allocatable, intent(inout) :: hook(:)
    type(probes_t), intent(inout) :: probes
    type(tracers_t), intent(inout) :: tracers

    call read_general(input, scene)
    call lay_out_fields(input, scene)
    call read_materials(input, scene%material)
    call check_properties(input)
    call read_elastic_scaling(input, scene)
    call lay_out_laws(input, scene)
    call read_bodies(input, scene)
    call read_flow(input, scene)
    call check_shapes(input, scene)
    call read_surfaces(input, scene)
    call read_backings(input, scene, backing)
    call read_fields(input, scene)
    call read_tractions(input, scene)
    call read_hooks(input, scene, hook)
    call read_conditions(input, scene)
    call read_tools(input, scene%body, scene%material, tool)
    call check_paths(input, scene, tool)
    call read_tool_heat(input, scene, tool)
    call read_contacts(input, scene)
    call read_gaps(input, scene)
    call check_grading(input, scene)
    call read_selective_scaling(input, scene, tool)
    associate (m => scene%method, nu => maxval([0.0_rp, scene%material%poisson()]))
      if (m%cfl <= 0.0_rp) m%cfl = default_cfl(m, input%count('CONTACT') > 0, is_sparse(scene, 3), &
                                               is_sparse(scene, 1), shortest_domain(scene), nu)
      m%fragment_cfl = fragment_cfl(m, size(tool) > 0, shortest_domain(scene), nu)
    end associate
    call read_sleeping(input, scene, tool)
    call read_probes(input, scene, probes)
    call read_tracers(input, scene, tracers)
    call check_heat_scene(input, scene)
    call check_heat_sense(input)
  end subroutine build_scene

  !> Read the title, grid, times, numerical method and output settings.
  subroutine read_general(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene

    scene%title = input%text('RUN', 1, 'TITLE')
    call read_grid(input, scene)
    scene%end_time = input%real('TIME', 1, 'END')
    scene%max_steps = int(input%integer('TIME', 1, 'MAX_STEPS'), i8)
    associate (m => scene%method)
      m%cfl = input%real('TIME', 1, 'CFL')
      m%fixed_dt = input%real('TIME', 1, 'DT')
      m%mass_scaling = input%real('TIME', 1, 'MASS_SCALING')
      m%inertial_fraction = input%real('TIME', 1, 'INERTIAL_FRACTION')
      m%debris = input%real('METHOD', 1, 'DEBRIS')
      call read_scaling_range(input, m)
      m%gravity = input%reals('TIME', 1, 'GRAVITY', 3)
      ! 'auto': B-splines in contact with tools, where they depend least on the position of the grid
      m%is_bspline = input%text('METHOD', 1, 'SHAPE') == 'bspline' .or. &
                     (input%text('METHOD', 1, 'SHAPE') == 'auto' .and. input%count('TOOL') > 0)
      m%scheme = find(['usl  ', 'musl ', 'usavg'], input%text('METHOD', 1, 'SCHEME'))
      m%transfer = find(['flip', 'apic', 'xpic', 'fmpm'], input%text('METHOD', 1, 'TRANSFER'))
      m%order = input%integer('METHOD', 1, 'ORDER')
      m%filter_interval = input%integer('METHOD', 1, 'EVERY')
      m%pic = input%real('METHOD', 1, 'PIC_FRACTION')
      m%sort_interval = input%integer('METHOD', 1, 'SORT_INTERVAL')
      m%rebalance = input%real('METHOD', 1, 'REBALANCE')
      m%has_mechanics = input%logical('METHOD', 1, 'MECHANICS')
      m%conducts = input%count('HEAT') > 0
      if (m%conducts) then
        m%fourier = input%real('HEAT', 1, 'FOURIER')
        m%implicit_heat = input%text('HEAT', 1, 'INTEGRATOR') == 'backward-euler'
        m%heat_step = input%real('HEAT', 1, 'STEP')
        m%heat_interval = input%integer('HEAT', 1, 'EVERY')
        m%heat_solver = merge(by_petsc, by_cg, input%text('HEAT', 1, 'SOLVER') == 'petsc')
        m%heat_tolerance = input%real('HEAT', 1, 'TOLERANCE')
      end if
    end associate
    associate (o => scene%output)
      o%name = input%text('RUN', 1, 'NAME')
      o%frame_interval = input%real('OUTPUT', 1, 'FRAME_INTERVAL')
      o%history_interval = input%real('OUTPUT', 1, 'HISTORY_INTERVAL')
      call check_intervals(input, scene)
      if (o%history_interval <= 0.0_rp) o%history_interval = scene%end_time/500.0_rp
      o%checkpoint_interval = input%real('OUTPUT', 1, 'CHECKPOINT_INTERVAL')
      o%progress_interval = input%real('OUTPUT', 1, 'PROGRESS_INTERVAL')
      o%progress_is_given = input%given('OUTPUT', 1, 'PROGRESS_INTERVAL')
      o%safety_interval = input%real('OUTPUT', 1, 'SAFETY_INTERVAL')
    end associate
  end subroutine read_general

  !> Report time steps and output intervals with which the run would never end.
  subroutine check_intervals(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    real(rp), parameter :: step_limit = 1.0e12_rp, max_outputs = 1.0e7_rp
    character(20), parameter :: interval(3) = [character(20) :: 'FRAME_INTERVAL', &
                                               'HISTORY_INTERVAL', &
                                               'CHECKPOINT_INTERVAL']
    integer :: k

    if (scene%max_steps == 0) call check_interval('TIME', 'DT', step_limit, 'steps')
    if (scene%method%conducts) call check_interval('HEAT', 'STEP', step_limit, 'steps')
    do k = 1, size(interval)
      call check_interval('OUTPUT', trim(interval(k)), max_outputs, 'times to write')
    end do
  contains
    subroutine check_interval(group, key, most, what)
      character(*), intent(in) :: group, key, what
      real(rp), intent(in) :: most              !! largest number of intervals until the end
      real(rp) :: interval

      interval = input%real(group, 1, key)
      if (interval > 0.0_rp .and. scene%end_time > most*interval) then
        call input%report(group, 1, key, 'makes '//str(scene%end_time/interval)//' '//what// &
                          ' until &TIME END; at most '//str(most)//' are possible')
      end if
    end subroutine check_interval
  end subroutine check_intervals

  !> Read the range of an adaptive mass scaling.
  subroutine read_scaling_range(input, method)
    type(input_t), intent(in) :: input
    type(method_t), intent(inout) :: method

    associate (range => method%scaling_range, factor => method%mass_scaling)
      range = input%reals('TIME', 1, 'MASS_SCALING_RANGE', 2)
      method%adapts_mass = any(range > 0.0_rp)
      if (.not. method%adapts_mass) return
      if (.not. input%given('TIME', 1, 'MASS_SCALING')) factor = range(1)
      if (range(1) < 1.0_rp .or. range(2) < range(1)) then
        call input%report('TIME', 1, 'MASS_SCALING_RANGE', 'must be two factors of at least 1, '// &
                          'the larger one last')
      else if (method%fixed_dt > 0.0_rp) then
        call input%report('TIME', 1, 'MASS_SCALING_RANGE', 'has no effect with DT')
      else if (input%count('FIELD') > 0) then
        call input%report('TIME', 1, 'MASS_SCALING_RANGE', 'is wrong with a &FIELD')
      else if (factor < range(1) .or. factor > range(2)) then
        call input%report('TIME', 1, 'MASS_SCALING', 'must be within MASS_SCALING_RANGE, as '// &
                          'the run starts with it')
      end if
    end associate
  end subroutine read_scaling_range

  !> Reserve particle fields that only some methods need; report methods that cannot be combined.
  subroutine lay_out_fields(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene

    associate (m => scene%method, layout => scene%layout)
      if (input%text('METHOD', 1, 'SHAPE') == 'cpgimp') then
        call layout%add(3, 'half length of its domain', layout%half)
      end if
      if (scene%grid%is_graded()) call layout%add(3, 'edge', layout%edges)
      if (m%transfer == transfer_apic) call layout%add(9, 'velocity gradient', layout%affine)
      if (tractions_have_boxes(input) .or. input%logical('OUTPUT', 1, 'INITIAL_POSITION')) then
        call layout%add(3, 'initial position', layout%origin, 'm')
      end if
      if (input%count('TOOL') > 0) then
        call layout%add(1, 'distance to the surface', layout%surface_offset)
        call layout%add(1, 'kept impulse of friction', layout%coulomb_reserve)
        call layout%add(3, 'force of tools', layout%tool_force)
      end if
      if (m%scheme /= scheme_usl .and. (m%transfer == transfer_xpic .or. &
                                        m%transfer == transfer_fmpm)) then
        call input%report('METHOD', 1, 'SCHEME', 'must be usl with TRANSFER = xpic or fmpm')
      end if
    end associate
  end subroutine lay_out_fields

  !> Read the grid. After an error it has no nodes, and no further checks use it.
  subroutine read_grid(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    real(rp) :: lower(3), upper(3), h(3)
    real(rp), allocatable :: edges(:)
    logical :: is_periodic(3)
    integer :: a

    lower = input%reals('GRID', 1, 'LOWER', 3)
    upper = input%reals('GRID', 1, 'UPPER', 3)
    allocate (edges, source=input%list('GRID', 1, 'CELL'))
    if (.not. input%given('GRID', 1, 'UPPER') .or. size(edges) == 0) return   ! reported before
    if (any(edges <= 0.0_rp)) return
    if (size(edges) == 2) then
      call input%report('GRID', 1, 'CELL', 'must be one edge of cubes, or one for each of the '// &
                        'three axes')
      return
    end if
    h = edges(1)
    if (size(edges) == 3) h = edges
    is_periodic = [(index(input%text('GRID', 1, 'PERIODIC'), 'xyz'(a:a)) > 0, a=1, 3)]
    if (any(upper - lower < h*(1.0_rp - 1.0e-9_rp))) then
      call input%report('GRID', 1, 'UPPER', 'must be at least one cell above LOWER')
    else if (product((upper - lower)/h) > 2.0e9_rp) then
      call input%report('GRID', 1, 'CELL', 'makes '//str(product((upper - lower)/h))// &
                        ' cells; at most 2e9 are possible')
    else if (any((upper - lower)/h > 1.0e6_rp)) then
      call input%report('GRID', 1, 'CELL', 'makes more than 1e6 cells along an axis')
    else if (any(is_periodic .and. abs((upper - lower)/h - anint((upper - lower)/h)) &
                 > 1.0e-6_rp)) then
      call input%report('GRID', 1, 'PERIODIC', 'along a periodic axis UPPER - LOWER must be a '// &
                        'whole number of cells')
    else
      scene%grid = make_grid(h, lower, upper, is_periodic)
      call read_grading(input, upper, scene%grid)
    end if
  end subroutine read_grid

  !> Read names and positions of the temperature probes.
  subroutine read_probes(input, scene, probes)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(probes_t), intent(inout) :: probes
    real(rp) :: top(3)
    integer :: i

    probes%n = input%count('PROBE')
    allocate (probes%name(probes%n), probes%x(3, probes%n), probes%temperature(probes%n), &
              probes%is_mine(probes%n), probes%group(probes%n))
    probes%group = 1
    probes%temperature = 298.0_rp            ! initial value [K], until `update_probe_temperatures`
    probes%is_mine = .false.
    top = scene%grid%upper()
    do i = 1, probes%n
      probes%name(i) = input%text('PROBE', i, 'NAME')
      probes%x(:, i) = input%reals('PROBE', i, 'POSITION', 3)
      if (scene%grid%n(1) == 0) cycle
      if (any(probes%x(:, i) < scene%grid%lower) .or. any(probes%x(:, i) > top)) then
        call input%report('PROBE', i, 'POSITION', 'lies outside the grid')
      end if
    end do
  end subroutine read_probes

end module setup_scene
