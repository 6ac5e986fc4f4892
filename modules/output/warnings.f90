! SPDX-License-Identifier: MIT
!> Warnings during a run, each kind once.
module output_warnings
  use base_kinds, only: i8, rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use contact_tool, only: tool_t
  use io_row, only: row_t
  use output_audit, only: history_t
  use output_guards, only: guards_t
  use output_melting, only: melting_t
  use output_microstructure, only: warning_message
  use output_numerical_fracture, only: separation_ratio
  use particles_store, only: particles_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  implicit none (type, external)
  private

  public :: warnings_t

  !> Warnings given so far.
  type :: warnings_t
    type(melting_t) :: melting
    type(guards_t), private :: guards
    integer(i8), private :: reported_rejected = 0    !! rejected steps reported so far
    real(rp), private :: inertial_ratio = 0.0_rp     !! largest inertial stress over flow stress
    logical, private :: has_inertia = .false., has_returns = .false., has_fracture = .false., &
                        has_sleep = .false., has_debris = .false.
    logical, allocatable, private :: has_validity(:)   !! for each warning of the flow laws
  contains
    procedure :: check
    procedure :: log_inertial_stress
  end type warnings_t

contains

  !> Collective. Log new warnings at the row `columns` of the history; set `step%is_broken` if the
  !> run must end.
  subroutine check(self, world, scene, clock, step, tool, particles, budget, history, columns)
    class(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(budget_t), intent(in) :: budget
    type(history_t), intent(in) :: history
    type(row_t), intent(in) :: columns

    call report_rejected_steps(self, world, clock)
    call warn_validity(self, world, scene, clock, budget)
    call self%melting%check_particles(world, scene, clock, particles)
    call warn_inertia(self, world, scene, clock, columns)
    call warn_sleep(self, world, clock, history, columns)
    call warn_debris(self, world, clock, columns)
    call warn_returns(self, world, clock, step)
    call warn_fracture(self, world, scene, clock, particles)
    call self%guards%check(world, scene, clock, tool, particles, history, columns, &
                           self%melting%ratio, step)
  end subroutine check

  !> Note that steps were rejected and repeated, at most once between two rows of the history.
  subroutine report_rejected_steps(self, world, clock)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock

    if (clock%refused <= self%reported_rejected) return
    self%reported_rejected = clock%refused
    if (world%is_root()) call say('note: until t = '//str(clock%time)//' s '//str(clock%refused)// &
                                  ' step(s) would have moved a node by more than half a '// &
                                  'cell and were made shorter; the last one is '//str(clock%dt)// &
                                  ' s')
  end subroutine report_rejected_steps

  !> Warn once for each limit of validity of a flow law that particles exceed, with a position.
  subroutine warn_validity(self, world, scene, clock, budget)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(budget_t), intent(in) :: budget
    character(:), allocatable :: message
    integer :: k

    if (.not. allocated(self%has_validity)) then
      allocate (self%has_validity(size(scene%warning)), source=.false.)
    end if
    do k = 1, size(scene%warning)
      if (self%has_validity(k)) cycle
      call warning_message(world, scene, clock, budget, k, message)
      self%has_validity(k) = message /= ''
      if (world%is_root() .and. message /= '') call say(message)
    end do
  end subroutine warn_validity

  !> Warn once if sleeping material has absorbed more than a thousandth of the exchanged energy.
  subroutine warn_sleep(self, world, clock, history, columns)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(history_t), intent(in) :: history
    type(row_t), intent(in) :: columns           !! columns of the history
    real(rp), parameter :: max_share = 1.0e-3_rp
    real(rp) :: share

    share = abs(columns%value('sleep_loss'))/max(history%audit_scale, tiny(1.0_rp))
    if (share <= max_share .or. self%has_sleep) return
    self%has_sleep = .true.
    if (world%is_root()) then
      call say('warning: at t = '//str(clock%time)//' s sleeping material has taken '// &
               str(100.0_rp*share)// &
               ' % of the energy turned over: lower SLEEP_STRESS, or SLEEPING = off')
    end if
  end subroutine warn_sleep

  !> Warn once that torn-off material has left the grid.
  subroutine warn_debris(self, world, clock, columns)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(row_t), intent(in) :: columns           !! columns of the history

    if (self%has_debris .or. columns%value('debris_mass') <= 0.0_rp) return
    self%has_debris = .true.
    if (world%is_root()) call say('warning: by t = '//str(clock%time)//' s '// &
                                  str(1.0e6_rp*columns%value('debris_mass'))// &
                                  ' mg of debris have left the grid; debris_mass of the '// &
                                  'history counts on (DEBRIS = 0: it ends the run)')
  end subroutine warn_debris

  !> Warn once if the inertial stress of a constant mass scaling exceeds its limit.
  subroutine warn_inertia(self, world, scene, clock, columns)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(row_t), intent(in) :: columns           !! columns of the history
    real(rp) :: percent_of_flow

    percent_of_flow = columns%value('inertial_stress_over_flow')
    self%inertial_ratio = max(self%inertial_ratio, 0.01_rp*percent_of_flow)
    if (0.01_rp*percent_of_flow <= scene%method%inertial_fraction) return
    if (clock%mass_scaling <= 1.0_rp .or. scene%method%adapts_mass .or. self%has_inertia) return
    self%has_inertia = .true.
    if (world%is_root()) then
      call say('warning: at t = '//str(clock%time)// &
               ' s the inertial stress of mass scaling, chi rho v^2, is '//str(percent_of_flow)// &
               ' % of the flow stress somewhere (KE/IE '// &
               str(columns%value('kinetic_over_internal'))//' %): try a MASS_SCALING of '// &
               str(allowed_scaling(self, scene, clock)))
    end if
  end subroutine warn_inertia

  !> Mass scaling at which the inertial stress would have stayed at its limit so far: the stress is
  !> proportional to the scaling, since the tool prescribes the velocities.
  pure real(rp) function allowed_scaling(self, scene, clock)
    type(warnings_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    allowed_scaling = max(1.0_rp, clock%mass_scaling*scene%method%inertial_fraction &
                                  /max(self%inertial_ratio, tiny(1.0_rp)))
  end function allowed_scaling

  !> Warn once of return mappings that did not converge.
  subroutine warn_returns(self, world, clock, step)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(step_t), intent(in) :: step

    if (step%worst_returns == 0 .or. self%has_returns) return
    self%has_returns = .true.
    if (world%is_root()) call say('warning: at t = '//str(clock%time)// &
                                  ' s the return mapping of '//str(step%worst_returns)// &
                                  ' particle-steps had not converged')
  end subroutine warn_returns

  !> Collective. Warn once of neighbouring particles that hardly share a grid node.
  subroutine warn_fracture(self, world, scene, clock, particles)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    real(rp), parameter :: max_ratio = 0.9_rp    ! part of the distance at which they share a node
    real(rp) :: ratio

    if (self%has_fracture) return
    ratio = separation_ratio(world, scene, particles)
    self%has_fracture = ratio > max_ratio
    if (self%has_fracture .and. world%is_root()) then
      call say('warning: at t = '//str(clock%time)// &
               ' s neighbouring particles are stretched to '//str(ratio)// &
               ' of the distance up to which nodes join them: numerical fracture '// &
               '(try cpgimp, or more particles per cell)')
    end if
  end subroutine warn_fracture

  !> Log the largest inertial stress of mass scaling at the end of a run.
  subroutine log_inertial_stress(self, scene, clock)
    class(warnings_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    if (.not. (scene%method%adapts_mass .or. clock%mass_scaling > 1.0_rp)) return
    if (self%inertial_ratio <= 0.0_rp) then
      call say('no metal with strength was seen to flow: nothing to judge the mass scaling by')
    else if (scene%method%adapts_mass) then
      call say('inertial stress up to '//str(100.0_rp*self%inertial_ratio)// &
               ' % of the flow stress, mass scaling '//str(clock%mass_scaling)//' in the end')
    else
      call say('inertial stress up to '//str(100.0_rp*self%inertial_ratio)// &
               ' % of the flow stress: MASS_SCALING = '// &
               str(allowed_scaling(self, scene, clock))//' would make that '// &
               str(100.0_rp*scene%method%inertial_fraction)//' %')
    end if
  end subroutine log_inertial_stress

end module output_warnings
