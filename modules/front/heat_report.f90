! SPDX-License-Identifier: MIT
!> `stirpoint --check` of a heat-only scene.
module front_heat_report
  use base_kinds, only: i8, rp
  use base_log, only: say
  use base_text, only: str
  use base_timers, only: wall_time
  use comm_world, only: world_t
  use front_estimate, only: cost_t, estimate_heat
  use heat_alone_state, only: heat_run_t
  use heat_setup_scene, only: build_heat_scene
  use heat_solvers_method, only: euler, method_names, rkl2, solver_names
  use input_values, only: input_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: report_heat_scene

contains

  !> Collective. Report a heat-only scene without writing files. Measuring the cost advances the
  !> state, which cannot be used afterwards.
  subroutine report_heat_scene(world, input, scene, names, run, measures)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: names(:)     !! names of the probes
    type(heat_run_t), intent(inout) :: run
    logical, intent(in) :: measures
    type(heat_run_t) :: coarse
    type(cost_t) :: cost
    real(rp) :: best, volume(1)
    integer(i8) :: irregular

    associate (heat => run%heat, mesh => run%heat%mesh)
      volume = mesh%volume
      irregular = size(mesh%irregular)
      call world%sum(volume)
      call world%sum(irregular)
      if (measures) then
        best = fastest_evaluation(run)
        call build_coarse(world, input, scene, run, coarse)
        call estimate_heat(world, scene, names, run, coarse, cost)
      end if
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
      if (measures) then
        call print_line('speed', str(real(run%cells, rp)/best*1.0e-6_rp)// &
                        ' M cells/s in one evaluation')
        call print_line('steps', str(nint(cost%steps, i8))//' for '//str(scene%end_time)// &
                        ' s, about')
        call print_line('run time', cost%run_time(world%size))
      end if
      call print_line('skipped', 'mechanics, contact, particles (MECHANICS = F)')
    end associate
  end subroutine report_heat_scene

  !> Collective. Least wall-clock time of five evaluations of the rates [s].
  real(rp) function fastest_evaluation(run) result(best)
    type(heat_run_t), intent(inout) :: run
    real(rp), allocatable :: rate(:)
    real(rp) :: power(2), started
    integer :: i

    call run%heat%set_sources(0.0_rp, 0.0_rp)
    allocate (rate, mold=run%heat%theta)
    best = huge(1.0_rp)
    do i = 1, 5
      started = wall_time()
      call run%heat%rate(run%heat%theta, 0.0_rp, rate, power)
      best = min(best, wall_time() - started)
    end do
  end function fastest_evaluation

  !> The same scene with larger cells, which is computed in tenths of a second.
  subroutine build_coarse(world, input, scene, run, coarse)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(in) :: run
    type(heat_run_t), intent(out) :: coarse
    real(rp), parameter :: max_cells = 4000.0_rp  !! number of cells, about
    type(scene_t) :: coarser

    coarser = scene
    coarser%grid%h = scene%grid%h*max(1.0_rp, (real(run%cells, rp)/max_cells)**(1.0_rp/3.0_rp))
    call build_heat_scene(world, input, coarser, coarse)
    call coarse%integrator%start(coarse%heat)
    coarse%time = run%time
  end subroutine build_coarse

  !> Print a line with a label.
  subroutine print_line(name, text)
    character(*), intent(in) :: name, text
    character(12) :: label

    label = name
    call say(label//' '//trim(text))
  end subroutine print_line

end module front_heat_report
