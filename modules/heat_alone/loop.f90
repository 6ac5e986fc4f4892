! SPDX-License-Identifier: MIT
!> Time loop of a heat-only run: steps end where output is due or a source begins or ends.
module heat_alone_loop
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_log, only: log_line
  use base_system, only: note_step, stop_signal
  use base_text, only: str
  use base_timers, only: wall_time
  use heat_alone_files, only: heat_writer_t
  use heat_alone_state, only: heat_run_t, place_probes, resume_heat, save_heat
  use output_checkpoint, only: checkpoint_path
  use run_loop, only: ended_broken, ended_by_signal, ended_io, ended_well
  use state_probes, only: probes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: begin_heat, next_switch, run_heat

contains

  !> Collective. Initialize probes, heat sums and state, or read them from a checkpoint.
  subroutine begin_heat(probes, run, restart, error)
    type(probes_t), intent(in) :: probes
    type(heat_run_t), intent(inout) :: run
    character(*), intent(in) :: restart          !! file of the checkpoint; '' for a new run
    type(error_t), intent(inout) :: error
    real(rp) :: content(1)

    run%cells = count(run%heat%mesh%capacity > 0.0_rp, kind=i8)
    call run%heat%world%sum(run%cells)
    call place_probes(run%heat%world, probes%x, run)
    allocate (run%frame_times(0))
    content = run%heat%content(run%heat%theta, 0.0_rp)
    call run%heat%world%sum(content)
    run%content0 = content(1)
    if (restart == '') then
      call run%integrator%start(run%heat)
    else
      call resume_heat(restart, run, error)
    end if
  end subroutine begin_heat

  !> Collective. Run to the end, or until a signal, an error or a non-finite state stops the run.
  subroutine run_heat(scene, probes, run, is_resumed, status, message)
    type(scene_t), intent(in) :: scene
    type(probes_t), intent(in) :: probes
    type(heat_run_t), intent(inout) :: run
    logical, intent(in) :: is_resumed
    integer, intent(out) :: status
    character(:), allocatable, intent(out) :: message
    type(heat_writer_t) :: writer
    type(error_t) :: error
    logical :: is_safety_due, is_lost

    status = ended_well
    message = ''
    is_lost = .false.
    call writer%init(scene, probes%name, run, is_resumed, error)
    if (.not. is_resumed) call writer%write_due(scene, run, .false., .false., error)
    do while (.not. scene%is_over(run%time, run%integrator%steps) .and. .not. error%is_set())
      call note_step(run%integrator%steps)
      call run%integrator%advance(run%heat, run%time, &
                                  min(scene%end_time, writer%next_event(), next_switch(run)))
      call check_state(scene, run, writer, is_safety_due, is_lost, status, message)
      if (status == ended_broken .or. is_lost) exit
      call writer%write_due(scene, run, scene%is_over(run%time, run%integrator%steps), &
                            is_safety_due, error)
      call writer%progress%show_line(run%heat%world, scene, run%time, run%integrator%steps, &
                                     run%integrator%last)
      if (status /= ended_well) exit
    end do
    if (status == ended_well .and. .not. (is_lost .or. error%is_set())) then
      call writer%write_due(scene, run, .true., .false., error)
      if (all(abs(run%integrator%heats) <= 0.0_rp) .and. size(run%heat%source) > 0 &
          .and. run%heat%world%is_root()) call log_line( &
        'warning: no &SOURCE has given any heat: do they touch a surface that faces up?')
    else if ((status == ended_by_signal .or. run%integrator%is_stuck) .and. .not. is_lost) then
      call writer%sync()
      call save_heat(scene, run, error)
      message = message//'; checkpoint '//checkpoint_path(scene)
    end if
    call writer%write_summary(scene, run, error)
    call writer%close(error)
    call note_step(-1_i8)
    if (error%is_set()) then
      status = ended_io
      message = error%message
    end if
  end subroutine run_heat

  !> Next time at which a source begins or ends [s]; huge if none does.
  pure real(rp) function next_switch(run)
    type(heat_run_t), intent(in) :: run
    integer :: i

    next_switch = huge(1.0_rp)
    do i = 1, size(run%heat%source)
      associate (s => run%heat%source(i))
        if (s%begin > run%time*(1.0_rp + 1.0e-12_rp)) next_switch = min(next_switch, s%begin)
        if (s%end > run%time*(1.0_rp + 1.0e-12_rp)) next_switch = min(next_switch, s%end)
      end associate
    end do
  end function next_switch

  !> Collective. Check for signals, a checkpoint due by wall-clock time, a non-finite state and lost
  !> output.
  subroutine check_state(scene, run, writer, is_safety_due, is_lost, status, message)
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(in) :: run
    type(heat_writer_t), intent(in) :: writer
    logical, intent(out) :: is_safety_due, is_lost
    integer, intent(inout) :: status
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: local_message
    real(rp) :: flags(4)
    logical :: is_finite

    flags = [real(stop_signal(), rp), 0.0_rp, 0.0_rp, merge(1.0_rp, 0.0_rp, run%lost_row)]
    if (scene%output%safety_interval > 0.0_rp) flags(2) = merge(1.0_rp, 0.0_rp, &
      wall_time() - writer%secured > scene%output%safety_interval)
    is_finite = ieee_is_finite(sum(run%heat%theta(1:run%heat%size())))
    if (.not. is_finite) flags(3) = 1.0_rp
    call run%heat%world%max(flags)
    is_safety_due = flags(2) > 0.0_rp
    is_lost = flags(4) > 0.0_rp
    if (run%integrator%is_stuck .and. .not. flags(3) > 0.0_rp) then
      status = ended_broken
      message = 'conduction: a step of '//str(run%integrator%last)// &
        ' s did not converge: shorten &HEAT STEP'
      if (.not. run%integrator%fixed > 0.0_rp) then
        message = 'conduction: no time step satisfies &HEAT TOLERANCE, not even one of '// &
        str(run%integrator%last)//' s'
      end if
      message = message//' (step '//str(run%integrator%steps)//', t = '//str(run%time)//' s)'
    else if (flags(3) > 0.0_rp) then
      status = ended_broken
      local_message = ''
      if (.not. is_finite) local_message = describe_non_finite(scene, run)
      call run%heat%world%share_message(local_message, message)
      message = message//' (step '//str(run%integrator%steps)//', t = '//str(run%time)//' s)'
    else if (flags(1) > 0.0_rp) then
      status = ended_by_signal
      message = 'signal '//str(nint(flags(1)))//' stopped the run at step '// &
                str(run%integrator%steps)//', t = '//str(run%time)//' s'
    end if
  end subroutine check_state

  !> Description of the first cell of this rank with a non-finite temperature.
  function describe_non_finite(scene, run) result(text)
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(in) :: run
    character(:), allocatable :: text
    real(rp) :: x(3)
    integer :: c

    do c = 1, run%heat%size()
      if (ieee_is_finite(run%heat%theta(c))) cycle
      x = run%heat%mesh%centre(c)
      text = 'the temperature is not a finite number at ('//str(x(1))//', '//str(x(2))//', '// &
             str(x(3))//') m'
      if (run%heat%mesh%body(c) > 0) then
        text = text//' in body '//trim(scene%body(run%heat%mesh%body(c))%name)
      end if
      return
    end do
    text = 'the temperatures are so large that their sum is not finite'
  end function describe_non_finite

end module heat_alone_loop
