! SPDX-License-Identifier: MIT
!> What a run warns of while it goes on, each kind once.
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
  use output_numerical_fracture, only: stretched_apart
  use particles_store, only: particles_t
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  use state_step, only: step_t
  implicit none (type, external)
  private

  public :: warnings_t

  !> What was warned of so far.
  type :: warnings_t
    type(melting_t) :: melting
    type(guards_t), private :: guards
    integer(i8), private :: reported_refused = 0     !! refused steps when last reported
    real(rp), private :: inertial = 0.0_rp           !! largest inertial stress over flow stress
    logical, private :: has_inertia = .false., has_returns = .false., has_fracture = .false., &
                        has_sleep = .false., has_debris = .false.
    logical, allocatable, private :: has_validity(:)   !! by the warnings of the scene
  contains
    procedure :: watch
    procedure :: say_inertia
  end type warnings_t

contains

  !> Collective. Say what is new to warn of when a row of the history, `columns`, is due, and
  !> whether the run must end.
  subroutine watch(self, world, scene, clock, step, tool, particles, books, history, columns)
    class(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(step_t), intent(inout) :: step
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(books_t), intent(in) :: books
    type(history_t), intent(in) :: history
    type(row_t), intent(in) :: columns

    call note_refused(self, world, clock)
    call warn_validity(self, world, scene, clock, books)
    call self%melting%watch_particles(world, scene, clock, particles)
    call warn_inertia(self, world, scene, clock, columns)
    call warn_sleep(self, world, clock, history, columns)
    call warn_debris(self, world, clock, columns)
    call warn_returns(self, world, clock, step)
    call warn_fracture(self, world, scene, clock, particles)
    call self%guards%check(world, scene, clock, tool, particles, history, columns, &
                           self%melting%ratio, step)
  end subroutine watch

  !> Say that steps were refused, at most once between two rows of the history.
  subroutine note_refused(self, world, clock)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock

    if (clock%refused <= self%reported_refused) return
    self%reported_refused = clock%refused
    if (world%is_root()) call say('note: until t = '//str(clock%time)//' s '//str(clock%refused)// &
                                  ' step(s) would have moved a node by more than half a '// &
                                  'cell and were made shorter; the last one is '//str(clock%dt)// &
                                  ' s')
  end subroutine note_refused

  !> Say once of each kind that particles left the validity of a flow law, and where.
  subroutine warn_validity(self, world, scene, clock, books)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(books_t), intent(in) :: books
    character(:), allocatable :: message
    integer :: k

    if (.not. allocated(self%has_validity)) then
      allocate (self%has_validity(size(scene%warning)), source=.false.)
    end if
    do k = 1, size(scene%warning)
      if (self%has_validity(k)) cycle
      call warning_message(world, scene, clock, books, k, message)
      self%has_validity(k) = message /= ''
      if (world%is_root() .and. message /= '') call say(message)
    end do
  end subroutine warn_validity

  !> Warn once if sleeping material took more than a thousandth of the energy turned over.
  subroutine warn_sleep(self, world, clock, history, columns)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(history_t), intent(in) :: history
    type(row_t), intent(in) :: columns           !! of the history
    real(rp), parameter :: most = 1.0e-3_rp
    real(rp) :: part

    part = abs(columns%value('sleep_loss'))/max(history%audit_scale, tiny(1.0_rp))
    if (part <= most .or. self%has_sleep) return
    self%has_sleep = .true.
    if (world%is_root()) then
      call say('warning: at t = '//str(clock%time)//' s sleeping material has taken '// &
               str(100.0_rp*part)// &
               ' % of the energy turned over: lower SLEEP_STRESS, or SLEEPING = off')
    end if
  end subroutine warn_sleep

  !> Warn once that metal was torn off and has left the grid.
  subroutine warn_debris(self, world, clock, columns)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(row_t), intent(in) :: columns           !! of the history

    if (self%has_debris .or. columns%value('debris_mass') <= 0.0_rp) return
    self%has_debris = .true.
    if (world%is_root()) call say('warning: by t = '//str(clock%time)//' s '// &
                                  str(1.0e6_rp*columns%value('debris_mass'))// &
                                  ' mg of debris have left the grid; debris_mass of the '// &
                                  'history counts on (DEBRIS = 0: it ends the run)')
  end subroutine warn_debris

  !> Warn once if the inertial stress of a constant mass scaling is not small.
  subroutine warn_inertia(self, world, scene, clock, columns)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(row_t), intent(in) :: columns           !! of the history
    real(rp) :: percent_of_flow

    percent_of_flow = columns%value('inertial_stress_over_flow')
    self%inertial = max(self%inertial, 0.01_rp*percent_of_flow)
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

  !> Mass scaling whose inertial stress would have been just small enough so far: it is proportional
  !> to it, since the tool gives the speeds.
  pure real(rp) function allowed_scaling(self, scene, clock)
    type(warnings_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    allowed_scaling = max(1.0_rp, clock%mass_scaling*scene%method%inertial_fraction &
                                  /max(self%inertial, tiny(1.0_rp)))
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

  !> Collective. Warn once of neighbouring particles that no node joins any more.
  subroutine warn_fracture(self, world, scene, clock, particles)
    type(warnings_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    real(rp), parameter :: most_apart = 0.9_rp   ! of the distance up to which nodes join them
    real(rp) :: apart

    if (self%has_fracture) return
    apart = stretched_apart(world, scene, particles)
    self%has_fracture = apart > most_apart
    if (self%has_fracture .and. world%is_root()) then
      call say('warning: at t = '//str(clock%time)// &
               ' s neighbouring particles are stretched to '//str(apart)// &
               ' of the distance up to which nodes join them: numerical fracture '// &
               '(try cpgimp, or more particles per cell)')
    end if
  end subroutine warn_fracture

  !> The inertial stress of mass scaling so far, in a line at the end of a run.
  subroutine say_inertia(self, scene, clock)
    class(warnings_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    if (.not. (scene%method%adapts_mass .or. clock%mass_scaling > 1.0_rp)) return
    if (self%inertial <= 0.0_rp) then
      call say('no metal with strength was seen to flow: nothing to judge the mass scaling by')
    else if (scene%method%adapts_mass) then
      call say('inertial stress up to '//str(100.0_rp*self%inertial)// &
               ' % of the flow stress, mass scaling '//str(clock%mass_scaling)//' in the end')
    else
      call say('inertial stress up to '//str(100.0_rp*self%inertial)// &
               ' % of the flow stress: MASS_SCALING = '// &
               str(allowed_scaling(self, scene, clock))//' would make that '// &
               str(100.0_rp*scene%method%inertial_fraction)//' %')
    end if
  end subroutine say_inertia

end module output_warnings
