! SPDX-License-Identifier: MIT
!> What ends a run because its physics has gone: an energy balance that does not close, metal far
!> above its melting temperature, a torque that the strength of the metal cannot give. Each is
!> checked at every row of the history, whatever its cause.
module output_guards
  use base_kinds, only: rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use contact_tool, only: s_strength, s_torque, tool_t
  use io_row, only: row_t
  use output_audit, only: history_t
  use particles_store, only: f_mass, particles_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_usavg
  use state_step, only: step_t
  use tool_shapes_revolved, only: revolved_t
  implicit none (type, external)
  private

  public :: guards_t

  real(rp), parameter :: warned_error = 0.01_rp   !! of the energy turned over: a warning
  real(rp), parameter :: largest_error = 0.1_rp   !! of the energy turned over: the run ends
  !> Of bulk modulus times volume: energies below it are rounding of elastic energies, which are
  !> differences of terms of that size.
  real(rp), parameter :: rounding = 1.0e-12_rp
  real(rp), parameter :: largest_melt_ratio = 1.15_rp   !! temperature over that of melting
  real(rp), parameter :: torque_slack = 1.01_rp   !! of sums over nodes against sums over particles

  !> What was seen at the rows before.
  type :: guards_t
    private
    real(rp) :: balanced_until = 0.0_rp      !! time of the last row whose balance closed [s]
    logical :: has_warned = .false.          !! of the balance
    logical :: is_first = .true., starts_molten = .false.
  contains
    procedure :: check
  end type guards_t

contains

  !> Collective, at a row of the history, `columns`, with the largest temperature over that of
  !> melting, `melt_ratio`. Sets `step%is_broken` and says why in `step%reason`.
  subroutine check(self, world, scene, clock, tool, particles, history, columns, melt_ratio, step)
    class(guards_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(in) :: particles
    type(history_t), intent(in) :: history
    type(row_t), intent(in) :: columns
    real(rp), intent(in) :: melt_ratio           !! [-]
    type(step_t), intent(inout) :: step
    character(:), allocatable :: reason

    if (step%is_broken) return
    call check_balance(self, world, scene, clock, particles, history, columns, reason)
    if (reason == '') call check_melting(self, columns, melt_ratio, reason)
    if (reason == '') call check_torque(scene, tool, history%row_gained, reason)
    if (reason == '') return
    step%is_broken = .true.
    step%reason = reason
  end subroutine check

  !> The energy that is missing since the balance last closed, against what was turned over. Thermal
  !> expansion turns heat into elastic energy, which the balance of mechanical energies leaves out.
  !> What USAVG misses warns only: its two half updates book the work of noise near the limit of the
  !> step with an error that adds up, while the energy itself stays bounded.
  subroutine check_balance(self, world, scene, clock, particles, history, columns, reason)
    type(guards_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(history_t), intent(in) :: history
    type(row_t), intent(in) :: columns
    character(:), allocatable, intent(out) :: reason
    character(:), allocatable :: began
    real(rp) :: error, part

    reason = ''
    if (.not. scene%method%has_mechanics) return
    if (any(abs(scene%material%expansion) > 0.0_rp)) return
    error = 0.01_rp*columns%value('audit_error')*history%audit_scale
    part = abs(error)/max(history%audit_scale, tiny(1.0_rp))
    if (part <= warned_error .or. abs(error) <= rounding*stiffness(world, scene, particles)) then
      self%balanced_until = clock%time
      return
    end if
    began = 'since t = '//str(self%balanced_until)//' s the energy balance does not close: '// &
            str(error)//' J, '//str(100.0_rp*part)//' % of the energy turned over, are missing'
    if (error < 0.0_rp) began = began(:len(began) - len('are missing'))//'came from nothing'
    if (part > largest_error .and. (error < 0.0_rp .or. scene%method%scheme /= scheme_usavg)) then
      reason = began//'; the time step is too long for this scene: lower &TIME CFL or '// &
               "MASS_SCALING, or set SELECTIVE_SCALING = 'off'"
    else if (.not. self%has_warned) then
      self%has_warned = .true.
      if (world%is_root()) call say('warning: '//began//' (10 % end the run): lower &TIME CFL')
    end if
  end subroutine check_balance

  !> Collective. Bulk modulus times volume of all bodies [J].
  real(rp) function stiffness(world, scene, particles)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(rp) :: sums(1)
    integer :: b

    sums = 0.0_rp
    do b = 1, particles%nblk
      associate (m => scene%material(scene%body(particles%body(b))%material))
        sums = sums + m%k/m%rho*sum(particles%ps(1:particles%count(b), f_mass, b))
      end associate
    end do
    call world%sum(sums)
    stiffness = sums(1)
  end function stiffness

  !> Metal without strength takes no more heat of friction or plastic work, so that only a source or
  !> hot surroundings bring it far above its melting temperature, or it was there from the start.
  subroutine check_melting(self, columns, melt_ratio, reason)
    type(guards_t), intent(inout) :: self
    type(row_t), intent(in) :: columns
    real(rp), intent(in) :: melt_ratio
    character(:), allocatable, intent(out) :: reason

    reason = ''
    if (self%is_first) self%starts_molten = melt_ratio > 1.0_rp
    self%is_first = .false.
    if (melt_ratio <= largest_melt_ratio .or. self%starts_molten) return
    if (abs(columns%value('source_heat')) + abs(columns%value('wall_heat')) > 0.0_rp) return
    reason = 'metal is heated to '//str(melt_ratio)//' times its melting temperature, though '// &
             'nothing but friction and plastic work heats it: the steps are too long; lower '// &
             '&TIME CFL or MASS_SCALING, or &HEAT EVERY and STEP if they are given'
  end subroutine check_melting

  !> The torque of a tool of revolution is that of friction alone, so that it is at most the shear
  !> strength of the metal on its face times its largest radius. At walls the sums count otherwise.
  pure subroutine check_torque(scene, tool, gained, reason)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    real(rp), intent(in) :: gained(:, :)
    character(:), allocatable, intent(out) :: reason
    real(rp) :: most
    integer :: k

    reason = ''
    do k = 1, size(tool)
      if (.not. tool(k)%has_layer()) cycle
      if (.not. is_revolved(tool(k)) .or. size(scene%symmetry) > 0) cycle
      most = torque_slack*gained(s_strength, k)*tool(k)%shape%radius
      if (abs(gained(s_torque, k)) <= most .or. gained(s_strength, k) <= 0.0_rp) cycle
      reason = '&TOOL '//trim(tool(k)%name)//' turns against '// &
               str(abs(gained(s_torque, k))/gained(s_strength, k)/tool(k)%shape%radius)// &
               ' times the torque that the shear strength of the metal on its face allows: '// &
               'the steps are too long; lower &TIME CFL or MASS_SCALING'
      return
    end do
  end subroutine check_torque

  !> Whether its shape is one of revolution, whose pressure has no torque about the axis.
  pure logical function is_revolved(tool)
    type(tool_t), intent(in) :: tool

    select type (shape => tool%shape)
    class is (revolved_t)
      is_revolved = .true.
    class default
      is_revolved = .false.
    end select
  end function is_revolved

end module output_guards
