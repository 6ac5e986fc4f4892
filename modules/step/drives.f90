! SPDX-License-Identifier: MIT
!> Tools driven by a machine: force control or an elastic machine along the tool axis, schedule
!> phases that end at a load or a temperature, and load limits (tools_motion).
module step_drives
  use base_kinds, only: i8, rp
  use base_log, only: log_line
  use base_text, only: str
  use base_world, only: world_t
  use mpm_stability, only: wave_speed
  use particles_store, only: f_pos, f_temp, particles_t
  use state_clock, only: clock_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use tools_monitor, only: halt
  use tools_sums, only: s_force, s_torque
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: store_impulses, drive_tools

  !> Cells that an elastic wave crosses in the averaging time of a load, about fifteen steps, since
  !> few particles touch in a single one.
  integer, parameter :: averaging_cells = 12
  !> Steps between checks of the largest temperature.
  integer, parameter :: temperature_check_interval = 10

contains

  !> Store the impulse sums of the tools before a step.
  pure subroutine store_impulses(tools)
    type(tool_t), intent(inout) :: tools(:)
    integer :: k

    do k = 1, size(tools)
      tools(k)%monitor%last_angular_impulse = tools(k)%sums(s_torque)
      tools(k)%drive%last_impulse = tools(k)%sums(s_force:s_force + 2)
    end do
  end subroutine store_impulses

  !> Collective, at the end of a step of `dt`, before the clock advances. Integrate the motion of
  !> the tools along their axes under the reaction of the bodies, and end phases whose condition is
  !> met.
  subroutine drive_tools(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                   !! time step [s]
    real(rp) :: impulse(2, size(sim%tool)), force, mean(2*size(sim%tool))
    logical :: is_force_controlled, is_last
    integer :: k, phase

    is_last = sim%clock%time + dt >= sim%scene%end_time*(1.0_rp - 1.0e-12_rp)
    do k = 1, size(sim%tool)
      associate (tool => sim%tool(k))
        impulse(:, k) = [dot_product(tool%sums(s_force:s_force + 2) - tool%drive%last_impulse, &
                                     tool%drive%axis), tool%sums(s_torque) &
                                       - tool%monitor%last_angular_impulse]
        if (.not. tool%drive%is_free) call tool%drive%follow(dt, impulse(1, k)/dt, &
                                                             sim%clock%mass_scaling)
      end associate
    end do
    if (.not. any(sim%tool%drive%is_free .or. sim%tool%monitor%is_on)) return
    mean = reshape(impulse, [size(impulse)])
    call sim%world%sum(mean)
    impulse = reshape(mean, shape(impulse))
    call monitor_tools(sim, dt, impulse)
    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%drive%is_free) cycle
      associate (tool => sim%tool(k), drive => sim%tool(k)%drive)
        phase = tool%motion%phase_at(sim%clock%time + dt)
        if (drive%is_force_controlled .and. (phase > drive%phase .or. is_last)) then
          call warn_if_pin_alone(sim%world, sim%scene, sim%particles, tool, drive%phase)
        end if
        call drive%enter_phase(phase)
        if (phase <= size(tool%motion%phase)) drive%feed = tool%motion%phase(phase)%feed
        call tool%motion%force_control_at(sim%clock%time + dt, drive%phase_start_force, &
                                          is_force_controlled, force)
        call drive%integrate(dt, impulse(1, k)/dt, is_force_controlled, force, &
                             sim%clock%mass_scaling)
      end associate
    end do
  end subroutine drive_tools

  !> Collective. End the phases whose load or temperature is reached, and stop tools beyond their
  !> limits.
  subroutine monitor_tools(sim, dt, impulse)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                          !! [s]
    real(rp), intent(in) :: impulse(2, size(sim%tool))   !! along the axis [N s], torque [N m s]
    character(:), allocatable :: reason
    real(rp) :: ema_weight, t
    integer :: k, phase_before

    t = sim%clock%time + dt
    ema_weight = min(1.0_rp, dt*wave_speed(sim%clock)/(averaging_cells*minval(sim%scene%grid%h)))
    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%monitor%is_on) cycle
      associate (tool => sim%tool(k), monitor => sim%tool(k)%monitor)
        call monitor%update_load(impulse(:, k)/dt, ema_weight)
        if (monitor%halt_time >= 0.0_rp) cycle
        phase_before = monitor%phase
        monitor%phase = tool%motion%phase_at(t)
        if (monitor%phase > phase_before) then
          if (tool%motion%phase(phase_before)%ends_early() .and. .not. monitor%ended_early) then
            call report_phase_end(sim%world, t, tool, phase_before, 'its DURATION is over; '// &
                                  load_text(tool))
          end if
          monitor%ended_early = .false.
        end if
        if (monitor%phase > size(tool%motion%phase)) cycle
        if (.not. monitor%ended_early) then
          reason = phase_end_reason(sim, tool)
          if (reason /= '') then
            monitor%ended_early = .true.
            call tool%motion%end_phase(monitor%phase, t)
            call report_phase_end(sim%world, t, tool, monitor%phase, reason)
            if (index(reason, 'UNTIL_FORCE') == 1) then
              call warn_if_pin_alone(sim%world, sim%scene, sim%particles, tool, monitor%phase)
            end if
          end if
        end if
        if (any(abs(monitor%load()) > [monitor%max_force, monitor%max_torque])) then
          call stop_tool(sim%world, t, tool, sim%clock)
        end if
      end associate
    end do
  end subroutine monitor_tools

  !> Collective. Reason for which the current phase of a tool ends; '' if it continues.
  function phase_end_reason(sim, tool) result(reason)
    type(simulation_t), intent(in) :: sim
    type(tool_t), intent(in) :: tool
    character(:), allocatable :: reason
    real(rp) :: load(2), t_max(1)
    integer :: b

    reason = ''
    load = tool%monitor%load()
    associate (phase => tool%motion%phase(tool%monitor%phase))
      if (load(1) >= phase%until_force) reason = 'UNTIL_FORCE; '//load_text(tool)
      if (load(2) >= phase%until_torque) reason = 'UNTIL_TORQUE; '//load_text(tool)
      if (phase%until_temperature >= huge(1.0_rp)) return
      if (mod(sim%clock%step, int(temperature_check_interval, i8)) /= 0) return
      t_max = 0.0_rp
      if (phase%until_probe > 0) then
        if (sim%probes%is_mine(phase%until_probe)) t_max = &
          sim%probes%temperature(phase%until_probe)
      else
        do b = 1, sim%particles%nblk
          if (sim%scene%body(sim%particles%body(b))%is_rigid()) cycle
          t_max = max(t_max, maxval(sim%particles%ps(:sim%particles%count(b), f_temp, b)))
        end do
      end if
      call sim%world%max(t_max)
      if (t_max(1) >= phase%until_temperature) reason = &
          'UNTIL_TEMPERATURE; '//str(t_max(1))//' K, '//load_text(tool)
    end associate
  end function phase_end_reason

  !> Collective, at the end of a force-controlled phase or of the run in one: warn if the pin alone
  !> carries the force.
  subroutine warn_if_pin_alone(world, scene, particles, tool, phase)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: phase
    real(rp) :: along, d, touches(1), normal(3), x(3)
    integer :: b, p

    if (.not. tool%has_shape()) return
    if (tool%shape%pin_radius <= 0.0_rp) return
    touches = 0.0_rp                             ! 1: a particle touches the shoulder
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        call tool%distance(particles%ps(p, f_pos:f_pos + 2, b), d, normal)
        if (d > 0.5_rp*scene%grid%longest()) cycle
        ! Nearest point on the tool surface, relative to the tool.
        x = particles%ps(p, f_pos:f_pos + 2, b) - d*normal - tool%position
        along = dot_product(x, tool%axes(:, 3))
        if (norm2(x - along*tool%axes(:, 3)) > 1.01_rp*tool%shape%pin_radius) touches = 1.0_rp
      end do
    end do
    call world%max(touches)
    if (touches(1) > 0.0_rp .or. .not. world%is_root()) return
    call log_line('warning: phase '//str(phase)//" of tool '"//trim(tool%name)// &
                  "' ends with the pin alone in the metal: the shoulder does not touch. "// &
                  'Give the plunge a VELOCITY, more force or time, or hotter metal')
  end subroutine warn_if_pin_alone

  !> Stop a tool whose load exceeds its limit, and the run if the limit requires it.
  subroutine stop_tool(world, t, tool, clock)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: t                    !! time [s]
    type(tool_t), intent(inout) :: tool
    type(clock_t), intent(inout) :: clock
    character(24), parameter :: what(3) = [character(24) :: 'the run ends', 'its feed stops', &
                                           'feed and spindle stop']

    tool%monitor%halt_time = t
    tool%monitor%spin = merge(tool%spin, 0.0_rp, tool%monitor%at_limit == 2)
    call halt(tool%motion, t, tool%monitor%spin)
    clock%is_stopped = tool%monitor%at_limit == 1
    if (world%is_root()) call log_line('warning: t = '//str(t)//" s: tool '"//trim(tool%name)// &
                                       "' is beyond its limit, "//load_text(tool)//': '// &
                                       trim(what(tool%monitor%at_limit)))
  end subroutine stop_tool

  !> Log on rank 0 that a phase ends, and why.
  subroutine report_phase_end(world, t, tool, phase, reason)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: t                    !! time [s]
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: phase
    character(*), intent(in) :: reason

    if (world%is_root()) call log_line('t = '//str(t)//' s: phase '//str(phase)//" of tool '"// &
                                       trim(tool%name)//"' ends: "//reason)
  end subroutine report_phase_end

  !> Current load of a tool, as text.
  function load_text(tool) result(text)
    type(tool_t), intent(in) :: tool
    character(:), allocatable :: text
    real(rp) :: load(2)

    load = tool%monitor%load()
    text = 'force '//str(load(1))//' N, torque '//str(load(2))//' N m'
  end function load_text

end module step_drives
