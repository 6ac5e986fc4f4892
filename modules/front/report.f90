! SPDX-License-Identifier: MIT
!> `stirpoint --check`: summary of the scene and its cost.
module front_report
  use base_kinds, only: i8, rp
  use base_log, only: log_line
  use base_text, only: str
  use base_world, only: world_t
  use front_estimate, only: cost_t, estimate_heat, estimate_run, range_of
  use grid_geometry, only: grid_t
  use heat_alone_state, only: heat_run_t
  use heat_conduction, only: conduction_step
  use heat_linear, only: euler, method_names, rkl2, solver_names
  use input_values, only: input_t
  use mpm_stability, only: stable_step, wave_speed
  use particles_store, only: f_pos, particles_t
  use particles_tracers, only: tracers_t
  use setup_check_process, only: report_process
  use setup_method, only: elastic_strain, small_strain
  use setup_sinks, only: log_heat_shares
  use setup_volumes, only: report_volumes, volumes_t
  use state_clock, only: clock_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t, scheme_usl
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: report_heat_scene, report_scene, warn_of_overlap

contains

  !> Collective. Report the scene without writing files. The cost is measured with time steps, after
  !> which the simulation cannot be used.
  subroutine report_scene(world, input, sim, counts, volumes, measures)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(simulation_t), intent(inout) :: sim
    integer(i8), intent(in) :: counts(:)     !! particles of each body
    type(volumes_t), intent(in) :: volumes(:)
    logical, intent(in) :: measures
    type(cost_t) :: cost
    type(tool_t), allocatable :: tools(:)    !! before the measurement, which moves them
    character(:), allocatable :: limited_by
    real(rp) :: dt, memory(1)
    integer :: b, cells(3)

    dt = stable_step(sim%scene, sim%clock)
    limited_by = limit(sim%scene, sim%clock)
    memory = real(sim%particles%bytes() + sim%nodes%bytes(), rp)
    call world%sum(memory)
    tools = sim%tool
    if (measures) call estimate_run(sim, dt, cost)
    if (.not. world%is_root()) return
    call print_line('scene', sim%scene%output%name//'  '//sim%scene%title)
    associate (grid => sim%scene%grid)
      cells = grid%cells()
      call print_line('grid', str(cells(1))//' x '//str(cells(2))//' x '//str(cells(3))// &
                      ' cells of '//grid%edges()//' mm'//periodic_axes(grid))
    end associate
    do b = 1, size(counts)
      associate (body => sim%scene%body(b))
        call print_line('body', trim(body%name)//': '//str(counts(b))//' particles '// &
                        str(1.0e3_rp*body%mean_spacing())//' mm apart, '// &
                        trim(sim%scene%material(body%material)%name))
      end associate
    end do
    call print_line('particles', str(sum(counts)))
    call report_volumes(sim%scene, volumes)
    call print_line('ranks', str(world%size)//', up to '// &
                    str(nint(sim%scene%method%rebalance*100.0_rp - 100.0_rp))//' % imbalance')
    call print_line('memory', str(memory(1)*1.0e-6_rp)//' MB for particles and grid, '// &
                    str(nint(memory(1)/real(sum(counts), rp)))//' bytes per particle, '// &
                    str(8*(sim%particles%nf + 1))//' of them for its fields')
    if (sim%tracers%n > 0) call print_line('tracers', tracer_text(sim%tracers))
    call print_line('method', method(sim%scene))
    call print_line('time step', str(dt)//' s, limited by '//limited_by)
    if (elastic_strain(input, sim%scene) > 0.0_rp) then
      call print_line('elasticity', elasticity(input, sim%scene, sim%tool))
    end if
    if (measures) call print_cost(world, sim%scene, cost, sum(counts), 'particle-steps/s', ', '// &
                                  range_of(anint(100.0_rp*cost%least_awake), &
                                           anint(100.0_rp*cost%awake))//' % of the particles awake')
    call report_process(input, sim%scene, tools)
    call log_heat_shares(sim%scene, sim%tool)
    call print_line('skipped', skipped(sim))
  end subroutine report_scene

  !> Collective. Report a heat-only scene without writing files. Measuring the cost advances the
  !> state, which cannot be used afterwards.
  subroutine report_heat_scene(world, scene, run, measures)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    logical, intent(in) :: measures
    type(cost_t) :: cost
    real(rp) :: volume(1)
    integer(i8) :: irregular

    associate (heat => run%heat, mesh => run%heat%mesh)
      volume = mesh%volume
      irregular = size(mesh%irregular)
      call world%sum(volume)
      call world%sum(irregular)
      if (measures) call estimate_heat(world, scene, run, cost)
      if (.not. world%is_root()) return
      call print_line('scene', scene%output%name//'  '//scene%title)
      call print_line('mesh', str(mesh%n(1))//' x '//str(mesh%n(2))//' x '//str(mesh%n(3))// &
                      ' cells of about '//scene%grid%edges()//' mm, '//str(run%cells)// &
                      ' in the solid, '//str(irregular)//' with rates of their own')
      call print_line('volume', str(1.0e9_rp*volume(1))//' mm3')
      call print_line('ranks', str(world%size))
      call print_line('time step', trim(method_names(run%integrator%method))// &
                      ', error of a step at most '//str(run%integrator%tolerance)// &
                      ' K; an explicit step is stable below '//str(2.0_rp/heat%max_decay_rate)// &
                        ' s')
      if (run%integrator%method /= euler .and. run%integrator%method /= rkl2) then
        call print_line('solver', trim(solver_names(run%integrator%implicit%solver)))
      end if
      if (measures) call print_cost(world, scene, cost, run%cells, 'cell-steps/s', '')
    end associate
  end subroutine report_heat_scene

  !> Print steps, speed and time of a run with `n` particles or cells.
  subroutine print_cost(world, scene, cost, n, unit, note)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(cost_t), intent(in) :: cost
    integer(i8), intent(in) :: n
    character(*), intent(in) :: unit, note
    real(rp) :: steps(2)

    steps = cost%steps*cost%more_steps
    call print_line('steps', range_of(anint(steps(1)), anint(steps(2)))//' for '// &
                    str(scene%end_time)//' s')
    call print_line('speed', str(real(n, rp)*cost%steps/max(cost%seconds, tiny(1.0_rp))*1.0e-6_rp) &
                    //' M '//unit//' of processor time here'//note)
    call print_line('run time', cost%run_time(world%size))
  end subroutine print_cost

  !> Collective. Warn of a tool that starts inside a body.
  subroutine warn_of_overlap(world, input, overrides, scene, tools, particles)
    type(world_t), intent(in) :: world
    type(input_t), intent(inout) :: input
    character(*), intent(in) :: overrides(:)  !! overrides, named in messages
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    real(rp) :: deepest(size(tools)), reach
    integer :: b, k, p

    deepest = 0.0_rp
    do b = 1, particles%nblk
      reach = 0.5_rp*minval(scene%body(particles%body(b))%spacing)
      do k = 1, size(tools)
        do p = 1, particles%count(b)
          deepest(k) = max(deepest(k), &
                           reach - tools(k)%clearance(particles%ps(p, f_pos:f_pos + 2, b)))
        end do
      end do
    end do
    call world%max(deepest)
    if (.not. world%is_root()) return
    allocate (input%diagnostics)               ! remove the messages printed so far
    call input%diagnostics%store_overrides(overrides)
    do k = 1, input%count('TOOL')
      if (deepest(k) > 1.0e-3_rp*minval(scene%grid%h)) then
        call input%warn('TOOL', k, 'POSITION', 'the tool starts '//str(1.0e3_rp*deepest(k))// &
                        ' mm inside the material and will hit it hard: let it start outside '// &
                        'and plunge (&MOTION)')
      end if
    end do
    call input%diagnostics%print(warnings=.true.)
  end subroutine warn_of_overlap

  !> Text on periodic axes, as `, periodic along xy`.
  pure function periodic_axes(grid) result(text)
    type(grid_t), intent(in) :: grid
    character(:), allocatable :: text
    integer :: a

    text = ''
    if (any(grid%period > 0)) text = ', periodic along '
    do a = 1, 3
      if (grid%period(a) > 0) text = text//'xyz'(a:a)
    end do
  end function periodic_axes

  !> Print a line with a label.
  subroutine print_line(name, text)
    character(*), intent(in) :: name, text
    character(12) :: label

    label = name
    call log_line(label//' '//trim(text))
  end subroutine print_line

  !> Text on shape functions, transfer and scheme.
  function method(scene) result(text)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: text
    character(5), parameter :: transfer(4) = ['FLIP ', 'APIC ', 'XPIC ', 'FMPM ']
    character(5), parameter :: scheme(3) = ['USL  ', 'MUSL ', 'USAVG']

    text = 'uGIMP'
    if (scene%layout%half > 0) text = 'cpGIMP'
    if (scene%method%is_bspline) text = 'quadratic B-splines'
    text = text//', '//trim(transfer(scene%method%transfer))//', '// &
      trim(scheme(scene%method%scheme))
    if (scene%method%sleep%is_on) text = text//', material at rest sleeps'
  end function method

  !> Text on the limits of the time step.
  function limit(scene, clock) result(text)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    character(:), allocatable :: text

    if (scene%method%fixed_dt > 0.0_rp) then
      text = '&TIME DT'
      return
    end if
    text = 'CFL '//str(scene%method%cfl)//': pressure waves of '//str(wave_speed(clock))//' m/s'
    if (clock%mass_scaling > 1.0_rp) then
      text = text//' (mass scaling '//str(clock%mass_scaling)//')'
    end if
    if (scene%method%scales_light_nodes) then
      text = text//', more inertia for light nodes (SELECTIVE_SCALING)'
    end if
    if (scene%method%conducts) then
      if (scene%method%heat_interval > 0) then
        text = text//'; conduction every '//str(scene%method%heat_interval)//' step(s)'
      else
        text = text//'; conduction steps of '//str(conduction_step(scene, clock))//' s'
      end if
      if (scene%method%implicit_heat) then
        text = text//' (backward Euler, '//trim(solver_names(scene%method%heat_solver))//')'
      end if
    end if
  end function limit

  !> Text on the tracers of each group, and the number of positions whose particle already belongs
  !> to another tracer.
  function tracer_text(tracers) result(text)
    type(tracers_t), intent(in) :: tracers
    character(:), allocatable :: text
    integer :: g, n

    text = ''
    do g = 1, size(tracers%name)
      n = count(tracers%group == g .and. tracers%id > 0)
      text = text//', '//trim(tracers%name(g))//' '//str(n)
      n = count(tracers%group == g) - n
      if (n > 0) text = text//' ('//str(n)//' more positions have the same nearest particles)'
    end do
    text = text(3:)
  end function tracer_text

  !> Text on the elastic strain of flowing material, with the effect of ELASTIC_SCALING.
  function elasticity(input, scene, tools) result(text)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    character(:), allocatable :: text
    real(rp) :: factor, strain

    strain = elastic_strain(input, scene)
    text = 'metal yields at an elastic strain of '//str(0.01_rp*nint(1.0e4_rp*strain))//' %'
    if (scene%method%elastic_scaling > 1.0_rp) then
      text = text//' (ELASTIC_SCALING '//str(scene%method%elastic_scaling)//')'
      return
    end if
    factor = real(int(small_strain/strain), rp)
    if (scene%method%mass_scaling <= 1.0_rp .or. size(tools) == 0 .or. factor < 2) return
    text = text//'; ELASTIC_SCALING = '//str(factor)//' would make that '// &
           str(0.01_rp*nint(1.0e4_rp*factor*strain))//' %, and steps '// &
           str(0.1_rp*nint(10.0_rp*sqrt(factor)))//' times as long, for scenes in which '// &
           'springback and thermal stress do not matter'
  end function elasticity

  !> Text on the components that this scene does not use.
  function skipped(sim) result(text)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: text
    logical :: any_flow
    integer :: m

    text = ''
    if (size(sim%tool) == 0) text = text//', contact (no &TOOL)'
    if (.not. sim%scene%method%conducts) text = text//', conduction (no &HEAT)'
    any_flow = .false.
    do m = 1, size(sim%scene%material)
      any_flow = any_flow .or. allocated(sim%scene%material(m)%flow)
    end do
    if (.not. any_flow) text = text//', plasticity (elastic materials)'
    if (.not. sim%scene%method%fbar) text = text//', volume averaging (nothing locks, or FBAR = F)'
    if (all(abs(sim%scene%material%expansion) <= 0.0_rp)) text = text//', thermal expansion'
    if (size(sim%scene%condition) == 0) text = text//', walls'
    if (sim%probes%n == 0) text = text//', probes'
    if (sim%tracers%n == 0) text = text//', tracers'
    if (sim%scene%method%sleep%is_on) text = text//', mechanics of material at rest (SLEEPING)'
    if (sim%nodes%halo%n == 0) text = text//', node exchange (one rank)'
    if (sim%scene%method%scheme == scheme_usl) text = text//', second stress pass (USL)'
    text = text//', nodes without material; contact in blocks far from the tool'
    text = text(3:)
  end function skipped

end module front_report
