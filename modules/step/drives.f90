! SPDX-License-Identifier: MIT
!> Tools as machines have them: pressed with a force or on a machine that gives, their motion along
!> their axes; phases that end at a load or a temperature, and limits (contact_motion).
module step_drives
  use base_kinds, only: rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use contact_tool, only: s_force, s_torque, tool_t
  use mapping_stability, only: wave_speed
  use particles_store, only: f_pos, f_temp
  use state_clock, only: clock_t
  use step_simulation, only: simulation_t
  implicit none (type, external)
  private

  public :: note_impulses, drive_tools

  integer, parameter :: cells = 12         !! that a wave crosses while a load is averaged: some
                                           !! fifteen steps, of which few touch at a point
  integer, parameter :: every = 10         !! steps in which the hottest metal is looked for once

contains

  !> Before a step: what the books of the tools hold.
  pure subroutine note_impulses(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: k

    do k = 1, size(sim%tool)
      sim%tool(k)%watch%noted = sim%tool(k)%sums(s_torque)
      sim%tool(k)%drive%noted = sim%tool(k)%sums(s_force:s_force + 2)
    end do
  end subroutine note_impulses

  !> Collective, at the end of a step of `dt`, whose time the clock has not yet: what the bodies
  !> pushed with moves the tools along their axes in the next one, and may end a phase.
  subroutine drive_tools(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                   !! [s]
    real(rp) :: impulse(2, size(sim%tool)), force, mean(2*size(sim%tool))
    logical :: presses
    integer :: k, phase

    if (.not. any(sim%tool%drive%is_free .or. sim%tool%watch%is_on)) return
    do k = 1, size(sim%tool)
      associate (tool => sim%tool(k))
        impulse(:, k) = [dot_product(tool%sums(s_force:s_force + 2) - tool%drive%noted, &
                                     tool%drive%axis), tool%sums(s_torque) - tool%watch%noted]
      end associate
    end do
    mean = reshape(impulse, [size(impulse)])
    call world%sum(mean)
    impulse = reshape(mean, shape(impulse))
    call watch_tools(world, sim, dt, impulse)
    do k = 1, size(sim%tool)
      associate (tool => sim%tool(k), drive => sim%tool(k)%drive)
        phase = tool%motion%phase_at(sim%clock%time + dt)
        if (drive%presses .and. phase > drive%phase) then
          call warn_of_pin(world, sim, tool, drive%phase)
        end if
        call drive%enter_phase(phase)
        call tool%motion%pressing(sim%clock%time + dt, drive%begin, presses, force)
        call drive%follow(dt, impulse(1, k)/dt, presses, force, sim%clock%mass_scaling)
      end associate
    end do
  end subroutine drive_tools

  !> Collective. End the phases of which the load or temperature is reached, and stop tools beyond
  !> their limits.
  subroutine watch_tools(world, sim, dt, impulse)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, impulse(2, size(sim%tool))   !! [s], [N s, N m s]
    character(:), allocatable :: reason
    real(rp) :: part, t
    integer :: k, was

    t = sim%clock%time + dt
    part = min(1.0_rp, dt*wave_speed(sim%clock)/(cells*minval(sim%scene%grid%h)))
    do k = 1, size(sim%tool)
      if (.not. sim%tool(k)%watch%is_on) cycle
      associate (tool => sim%tool(k), watch => sim%tool(k)%watch)
        call watch%feel(impulse(:, k)/dt, part)
        if (watch%halted >= 0.0_rp) cycle
        was = watch%phase
        watch%phase = tool%motion%phase_at(t)
        if (watch%phase > was) then
          if (tool%motion%phase(was)%ends_early() .and. .not. watch%has_ended) then
            call tell(world, t, tool, was, 'its DURATION is over; '//reading(tool))
          end if
          watch%has_ended = .false.
        end if
        if (watch%phase > size(tool%motion%phase)) cycle
        if (.not. watch%has_ended) then
          reason = what_ends(world, sim, tool)
          if (reason /= '') then
            watch%has_ended = .true.
            call tool%motion%end_phase(watch%phase, t)
            call tell(world, t, tool, watch%phase, reason)
            if (index(reason, 'UNTIL_FORCE') == 1) call warn_of_pin(world, sim, tool, watch%phase)
          end if
        end if
        if (any(abs(watch%load()) > [watch%most_force, watch%most_torque])) then
          call stop_tool(world, t, tool, sim%clock)
        end if
      end associate
    end do
  end subroutine watch_tools

  !> Collective. What ends the phase of a tool now; '' if nothing does.
  function what_ends(world, sim, tool) result(reason)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    type(tool_t), intent(in) :: tool
    character(:), allocatable :: reason
    real(rp) :: load(2), most(1)
    integer :: b

    reason = ''
    load = tool%watch%load()
    associate (phase => tool%motion%phase(tool%watch%phase))
      if (load(1) >= phase%until_force) reason = 'UNTIL_FORCE; '//reading(tool)
      if (load(2) >= phase%until_torque) reason = 'UNTIL_TORQUE; '//reading(tool)
      if (phase%until_temperature >= huge(1.0_rp) .or. mod(sim%clock%step, int(every, kind( &
        sim%clock%step))) /= 0) return
      most = 0.0_rp
      if (phase%until_probe > 0) then
        if (sim%probes%is_mine(phase%until_probe)) most = sim%probes%temperature(phase%until_probe)
      else
        do b = 1, sim%particles%nblk
          if (sim%scene%body(sim%particles%body(b))%is_rigid()) cycle
          most = max(most, maxval(sim%particles%ps(:sim%particles%count(b), f_temp, b)))
        end do
      end if
      call world%max(most)
      if (most(1) >= phase%until_temperature) reason = 'UNTIL_TEMPERATURE; '//str(most(1))// &
          ' K, '//reading(tool)
    end associate
  end function what_ends

  !> Collective. A phase that pressed with a force ends: warn if the pin bears it alone.
  subroutine warn_of_pin(world, sim, tool, phase)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: phase
    real(rp) :: along, d, most(1), normal(3), room, x(3)
    integer :: b, p

    if (.not. tool%has_shape()) return
    if (tool%shape%pin_radius <= 0.0_rp) return
    most = 0.0_rp                                ! 1: a particle touches the shoulder
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        call tool%distance(sim%particles%ps(p, f_pos:f_pos + 2, b), d, normal, room)
        if (d > 0.5_rp*sim%scene%grid%longest()) cycle
        x = sim%particles%ps(p, f_pos:f_pos + 2, b) - d*normal - tool%position   ! on its surface
        along = dot_product(x, tool%axes(:, 3))
        if (norm2(x - along*tool%axes(:, 3)) > 1.01_rp*tool%shape%pin_radius) most = 1.0_rp
      end do
    end do
    call world%max(most)
    if (most(1) > 0.0_rp .or. .not. world%is_root()) return
    call say('warning: phase '//str(phase)//" of tool '"//trim(tool%name)//"' ends with the "// &
             'pin alone in the metal: the shoulder does not touch. Give the plunge a VELOCITY, '// &
             'more force or time, or hotter metal')
  end subroutine warn_of_pin

  !> A tool has met its limit.
  subroutine stop_tool(world, t, tool, clock)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: t                    !! [s]
    type(tool_t), intent(inout) :: tool
    type(clock_t), intent(inout) :: clock
    character(24), parameter :: what(3) = [character(24) :: 'the run ends', 'its feed stops', &
                                           'feed and spindle stop']

    tool%watch%halted = t
    tool%watch%spin = merge(tool%spin, 0.0_rp, tool%watch%at_limit == 2)
    call tool%motion%halt(t, tool%watch%spin)
    clock%is_stopped = tool%watch%at_limit == 1
    if (world%is_root()) call say('warning: t = '//str(t)//" s: tool '"//trim(tool%name)// &
                                  "' is beyond its limit, "//reading(tool)//': '// &
                                  trim(what(tool%watch%at_limit)))
  end subroutine stop_tool

  subroutine tell(world, t, tool, phase, reason)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: t                    !! [s]
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: phase
    character(*), intent(in) :: reason

    if (world%is_root()) call say('t = '//str(t)//' s: phase '//str(phase)//" of tool '"// &
                                  trim(tool%name)//"' ends: "//reason)
  end subroutine tell

  !> The load that a tool feels.
  function reading(tool) result(text)
    type(tool_t), intent(in) :: tool
    character(:), allocatable :: text
    real(rp) :: load(2)

    load = tool%watch%load()
    text = 'force '//str(load(1))//' N, torque '//str(load(2))//' N m'
  end function reading

end module step_drives
