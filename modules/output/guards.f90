! SPDX-License-Identifier: MIT
!> Checks that end a run with unphysical results: an energy balance that does not close, metal far
!> above its melting temperature, a torque beyond the shear strength of the metal. They are made at
!> every row of the history.
!>
!> Detection of metal above its melting temperature: one warning, and maxima for the summary.
module output_guards
  use base_kinds, only: rp
  use base_log, only: log_line
  use base_text, only: str
  use base_world, only: world_t
  use io_histories, only: row_t
  use particles_store, only: f_mass, f_pos, f_temp, particles_t
  use state_clock, only: clock_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t, scheme_usavg
  use tools_heat_sink, only: backing_t
  use tools_shape_revolved, only: revolved_t
  use tools_sums, only: s_layer_strength, s_torque
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: guards_t, melt_sample_t, melting_json, melting_t

  !> Balance error over exchanged energy that causes a warning.
  real(rp), parameter :: warned_error = 0.01_rp
  !> Balance error over exchanged energy that ends the run.
  real(rp), parameter :: largest_error = 0.1_rp
  !> Energy error over bulk modulus times volume that is rounding: elastic energies are differences
  !> of terms of that size.
  real(rp), parameter :: rounding = 1.0e-12_rp
  real(rp), parameter :: largest_melt_ratio = 1.15_rp   !! temperature over melting temperature
  real(rp), parameter :: torque_slack = 1.01_rp   !! tolerance of sums over nodes

  !> State of the checks, from previous rows of the history.
  type :: guards_t
    private
    real(rp) :: balanced_until = 0.0_rp      !! time of the last row with a closed balance [s]
    logical :: has_warned = .false.          !! a warning of the balance was given
    logical :: is_first = .true., starts_molten = .false.
    !> Lowest and highest temperature of the metal at the first row and of all with which it has
    !> exchanged heat [K].
    real(rp) :: low = 0.0_rp, high = 0.0_rp
  contains
    procedure :: check
  end type guards_t

  type :: melting_t
    real(rp) :: ratio = 0.0_rp     !! largest temperature/melting temperature at the last row
    logical, private :: is_reported = .false.
  contains
    procedure :: check_particles, update
  end type melting_t

  !> Molten mass and hottest particle or cell of one rank.
  type :: melt_sample_t
    real(rp) :: melted = 0.0_rp, mass = 0.0_rp        !! molten mass, mass [kg]
    real(rp) :: over = -huge(1.0_rp)   !! largest excess over the melting temperature [K]
    real(rp) :: temp = 0.0_rp          !! temperature there [K]
    real(rp) :: x(3) = 0.0_rp                         !! position of the largest excess [m]
    integer :: body = 0
  end type melt_sample_t

contains

  !> Collective. Check the row `columns` of the history; on failure set `step%is_broken` and
  !> `step%reason`.
  subroutine check(self, sim, columns, melt_ratio)
    class(guards_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    type(row_t), intent(in) :: columns
    real(rp), intent(in) :: melt_ratio           !! largest temperature over melting temperature
    character(:), allocatable :: reason

    if (sim%clock%now%is_broken) return
    call check_balance(self, sim, columns, reason)
    if (self%is_first) then
      self%starts_molten = melt_ratio > 1.0_rp
      self%low = columns%value('temperature_min')
      self%high = columns%value('temperature_max')
    end if
    self%is_first = .false.
    if (reason == '') call check_melting(self, columns, melt_ratio, reason)
    if (reason == '') call check_range(self, sim%scene, sim%tool, sim%backing, columns, reason)
    if (reason == '') call check_torque(sim%scene, sim%tool, sim%history%row_gained, reason)
    if (reason == '') return
    sim%clock%now%is_broken = .true.
    sim%clock%now%reason = reason
  end subroutine check

  !> Compare the missing energy with the exchanged energy. The check is skipped with thermal
  !> expansion, which turns heat into elastic energy outside of the mechanical balance. Energy
  !> missing with USAVG only warns: near the stability limit its two half updates count the work of
  !> noise with an error that accumulates, while the energy itself stays bounded.
  subroutine check_balance(self, sim, columns, reason)
    type(guards_t), intent(inout) :: self
    type(simulation_t), intent(in) :: sim
    type(row_t), intent(in) :: columns
    character(:), allocatable, intent(out) :: reason
    character(:), allocatable :: began
    real(rp) :: error, part

    reason = ''
    if (.not. sim%scene%method%has_mechanics) return
    if (any(abs(sim%scene%material%expansion) > 0.0_rp)) return
    error = 0.01_rp*columns%value('audit_error')*sim%history%audit_scale
    part = abs(error)/max(sim%history%audit_scale, tiny(1.0_rp))
    if (part <= warned_error .or. abs(error) <= rounding*stiffness(sim%world, sim%scene, &
                                                                   sim%particles)) then
      self%balanced_until = sim%clock%time
      return
    end if
    began = 'since t = '//str(self%balanced_until)//' s the energy balance does not close: '// &
            str(error)//' J, '//str(100.0_rp*part)//' % of the energy exchanged, are missing'
    if (error < 0.0_rp) began = began(:len(began) - len('are missing'))//'were created'
    if (part > largest_error .and. (error < 0.0_rp &
                                    .or. sim%scene%method%scheme /= scheme_usavg)) then
      reason = began//'; the time step is too long for this scene: lower &TIME CFL or '// &
               "MASS_SCALING, or set SELECTIVE_SCALING = 'off'"
    else if (.not. self%has_warned) then
      self%has_warned = .true.
      if (sim%world%is_root()) call log_line('warning: '//began// &
                                             ' (10 % end the run): lower &TIME CFL')
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

  !> Check for metal far above its melting temperature. Molten metal dissipates no friction or
  !> plastic work, so that only heat sources, hot surroundings or the initial state can heat it
  !> there.
  subroutine check_melting(self, columns, melt_ratio, reason)
    type(guards_t), intent(in) :: self
    type(row_t), intent(in) :: columns
    real(rp), intent(in) :: melt_ratio
    character(:), allocatable, intent(out) :: reason

    reason = ''
    if (melt_ratio <= largest_melt_ratio .or. self%starts_molten) return
    if (abs(columns%value('source_heat')) + abs(columns%value('wall_heat')) > 0.0_rp) return
    reason = 'metal is heated to '//str(melt_ratio)//' times its melting temperature, though '// &
             'nothing but friction and plastic work heats it: the steps are too long; lower '// &
             '&TIME CFL or MASS_SCALING, or &HEAT EVERY and STEP if they are given'
  end subroutine check_melting

  !> Check for metal that is colder than all that was or is in the scene, or hotter where nothing
  !> heats it, by more than a tenth of the range of temperatures and a kelvin.
  subroutine check_range(self, scene, tools, backings, columns, reason)
    type(guards_t), intent(inout) :: self
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(backing_t), intent(in) :: backings(:)
    type(row_t), intent(in) :: columns
    character(:), allocatable, intent(out) :: reason
    real(rp) :: slack
    integer :: b, k

    reason = ''
    if (.not. scene%method%conducts) return
    do b = 1, size(scene%body)
      associate (film => scene%body(b)%film)
        if (.not. any(film%acts())) cycle
        call widen(self, film%ambient, film%acts())
      end associate
    end do
    associate (walls => scene%symmetry)
      call widen(self, walls%temperature, walls%temperature > 0.0_rp)
    end associate
    do k = 1, size(tools)
      if (.not. tools(k)%heat%is_on) cycle
      call widen(self, tools(k)%heat%range(), [.true., .true.])
    end do
    do b = 1, size(backings)
      do k = 1, size(backings(b)%column)
        call widen(self, backings(b)%column(k)%range(), [.true., .true.])
      end do
    end do
    associate (coldest => columns%value('temperature_min'), &
               hottest => columns%value('temperature_max'), low => self%low, high => self%high)
      slack = max(1.0_rp, 0.1_rp*(max(high, hottest) - low))
      if (coldest < low - slack) then
        reason = 'metal is at '//str(coldest)//' K, though nothing in the scene was ever below '// &
                 str(low)//' K'
      else if (hottest > high + slack .and. abs(columns%value('friction_heat')) &
               + abs(columns%value('plastic_work')) + abs(columns%value('source_heat')) &
               <= 0.0_rp) then
        reason = 'metal is at '//str(hottest)//' K, though nothing heats it and nothing in the '// &
                 'scene was ever above '//str(high)//' K'
      end if
    end associate
    if (reason /= '') reason = reason//': conduction is unstable; lower &HEAT FOURIER, or '// &
      'EVERY and STEP if they are given'
  end subroutine check_range

  !> Widen the range of temperatures of the scene.
  pure subroutine widen(self, temperature, counts)
    type(guards_t), intent(inout) :: self
    real(rp), intent(in) :: temperature(:)         !! [K]
    logical, intent(in) :: counts(:)               !! temperatures that metal may take

    self%low = min(self%low, minval(temperature, counts))
    self%high = max(self%high, maxval(temperature, counts))
  end subroutine widen

  !> Check the torque of tools of revolution. It comes from friction alone and is at most the shear
  !> strength times area of the face times the largest radius and half a particle spacing, as arms
  !> are those of particle centres. At symmetry planes the sums cover only part of the face.
  pure subroutine check_torque(scene, tools, increase, reason)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    real(rp), intent(in) :: increase(:, :)
    character(:), allocatable, intent(out) :: reason
    real(rp) :: half, max_torque
    integer :: k

    reason = ''
    half = 0.5_rp*maxval(scene%body%mean_spacing())
    do k = 1, size(tools)
      if (.not. tools(k)%has_layer()) cycle
      if (size(scene%symmetry) > 0) cycle
      max_torque = 0.0_rp
      select type (shape => tools(k)%shape)
      class is (revolved_t)                 ! whose contact pressure has no torque about the axis
        max_torque = increase(s_layer_strength, k)*(shape%radius + half)
      end select
      if (abs(increase(s_torque, k)) <= torque_slack*max_torque .or. max_torque <= 0.0_rp) cycle
      reason = '&TOOL '//trim(tools(k)%name)//' has '// &
        str(abs(increase(s_torque, k))/max_torque)// &
        ' times the torque that the shear strength of the metal on its face allows: '// &
        'the steps are too long; lower &TIME CFL or MASS_SCALING'
      return
    end do
  end subroutine check_torque

  !> Collective. Check the particles of deformable bodies at a row of the history.
  subroutine check_particles(self, world, scene, clock, particles, molten)
    class(melting_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    real(rp), intent(inout) :: molten(2)   !! largest molten share and excess [K] so far
    type(melt_sample_t) :: sample
    real(rp) :: t_melt
    integer :: b, n, p

    if (all(scene%material%t_melt >= huge(1.0_rp))) return
    do b = 1, particles%nblk
      n = particles%count(b)
      if (n == 0) cycle
      if (scene%body(particles%body(b))%is_rigid()) cycle
      t_melt = scene%material(scene%body(particles%body(b))%material)%t_melt
      associate (ps => particles%ps(1:n, :, b))
        sample%mass = sample%mass + sum(ps(:, f_mass))
        p = maxloc(ps(:, f_temp), dim=1)
        if (ps(p, f_temp) - t_melt > sample%over) then
          sample%over = ps(p, f_temp) - t_melt
          sample%temp = ps(p, f_temp)
          sample%x = ps(p, f_pos:f_pos + 2)
          sample%body = particles%body(b)
        end if
        if (ps(p, f_temp) > t_melt) sample%melted = sample%melted &
            + sum(ps(:, f_mass), mask=ps(:, f_temp) > t_melt)
      end associate
    end do
    call self%update(world, scene, sample, clock%time, molten)
  end subroutine check_particles

  !> Collective. Update the maxima, and warn with the hottest position when metal is above its
  !> melting temperature for the first time.
  subroutine update(self, world, scene, sample, time, molten)
    class(melting_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(melt_sample_t), intent(in) :: sample
    real(rp), intent(in) :: time                     !! [s]
    real(rp), intent(inout) :: molten(2)   !! largest molten share and excess [K] so far
    real(rp) :: sums(2), maxima(2)
    character(:), allocatable :: local_message, message

    sums = [sample%melted, sample%mass]
    maxima = [sample%over, sample%temp/max(sample%temp - sample%over, tiny(1.0_rp))]
    call world%sum(sums)
    call world%max(maxima)
    self%ratio = maxima(2)
    if (maxima(1) <= 0.0_rp) return
    molten = max(molten, [sums(1)/max(sums(2), tiny(1.0_rp)), maxima(1)])
    if (self%is_reported) return
    self%is_reported = .true.
    local_message = ''
    if (sample%over >= maxima(1)) local_message = 'warning: at t = '//str(time)//' s '// &
      str(100.0_rp*sums(1)/sums(2))//' % of the mass ('//str(sums(1))// &
      ' kg) is above its melting temperature; the hottest, in '// &
      trim(scene%body(sample%body)%name)//' at ('//str(sample%x(1))//', '//str(sample%x(2))// &
      ', '//str(sample%x(3))//') m, has '//str(sample%temp)//' K, T_MELT is '//str(sample%temp &
      - sample%over)//' K'
    call world%share_message(local_message, message)
    if (world%is_root()) call log_line(message)
  end subroutine update

  !> Two members of NAME_summary.json, each with its comma.
  pure function melting_json(molten) result(text)
    real(rp), intent(in) :: molten(2)   !! largest molten share and excess [K]
    character(:), allocatable :: text

    text = '  "melted_share_max": '//str(molten(1))//','//new_line('a')// &
           '  "hottest_over_melting_K": '//str(molten(2))//','
  end function melting_json

end module output_guards
