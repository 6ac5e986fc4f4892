! SPDX-License-Identifier: MIT
!> Warnings during a run, each kind once.
module output_warnings
  use base_kinds, only: i8, nlane, rp
  use base_log, only: log_line
  use base_text, only: str
  use base_world, only: world_t
  use io_histories, only: row_t
  use mpm_stability, only: contact_relaxation
  use output_guards, only: guards_t, melting_t
  use output_microstructure, only: make_warning_message
  use particles_store, only: f_bbar, f_jac, f_pos, particles_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_parts, only: history_t, simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: log_inertial_stress, warnings_t

  !> Warnings given so far, and what they depend on.
  type :: warnings_t
    type(melting_t), private :: melting
    type(guards_t), private :: guards
    integer(i8), private :: reported_refused = 0     !! refused steps reported so far
    logical, private :: has_inertia = .false., has_returns = .false., has_fracture = .false., &
                        has_sleep = .false., has_debris = .false.
    logical, allocatable, private :: has_validity(:)   !! warnings of the flow laws given so far
  contains
    procedure :: check
  end type warnings_t

contains

  !> Collective. Log new warnings at the row `columns` of the history; set `step%is_broken` if the
  !> run must end.
  subroutine check(self, sim, columns)
    class(warnings_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    type(row_t), intent(in) :: columns
    real(rp), parameter :: max_sleep_loss = 1.0e-3_rp   ! energy that sleepers may absorb, over the
                                                        ! exchanged energy
    real(rp), parameter :: max_separation = 0.9_rp   ! neighbour distance over that at which
                                                     ! neighbours share a node, above which a
                                                     ! warning is given
    character(:), allocatable :: at
    real(rp) :: inertia, sleep_loss, separation
    integer :: k

    at = 't = '//str(sim%clock%time)//' s '
    if (sim%clock%refused > self%reported_refused) then
      self%reported_refused = sim%clock%refused
      if (sim%world%is_root()) call log_line('note: until '//at//str(sim%clock%refused)// &
        ' step(s) would have moved a node by more than half a cell and were made shorter; '// &
                                             'the last one is '//str(sim%clock%dt)//' s')
    end if
    call warn_validity(self, sim%world, sim%scene, sim%clock, sim%budget)
    call self%melting%check_particles(sim%world, sim%scene, sim%clock, sim%particles, &
                                      sim%history%molten)
    inertia = 0.01_rp*columns%value('inertial_stress_over_flow')
    sim%history%inertial_ratio = max(sim%history%inertial_ratio, inertia)
    sim%history%early_force = max(sim%history%early_force, &
      sum([(columns%value(trim(sim%tool(k)%name)//'_early_force'), k=1, size(sim%tool))]))
    call warn_once(self%has_inertia, sim%world, inertia > sim%scene%method%inertial_fraction .and. &
                   sim%clock%mass_scaling > 1.0_rp .and. .not. sim%scene%method%adapts_mass, at// &
                   'the inertial stress of mass scaling, chi rho v^2, is '// &
                   str(columns%value('inertial_stress_over_flow'))// &
                   ' % of the flow stress somewhere (KE/IE '// &
                   str(columns%value('kinetic_over_internal'))//' %): try a MASS_SCALING of '// &
                   str(allowed_scaling(sim%scene, sim%clock, sim%history)))
    sleep_loss = abs(columns%value('sleep_loss'))/max(sim%history%audit_scale, tiny(1.0_rp))
    call warn_once(self%has_sleep, sim%world, sleep_loss > max_sleep_loss, at// &
                   'sleeping material has taken '//str(100.0_rp*sleep_loss)// &
                   ' % of the energy exchanged: lower SLEEP_STRESS, or SLEEPING = off')
    call warn_once(self%has_debris, sim%world, columns%value('debris_mass') > 0.0_rp, at// &
                   str(1.0e6_rp*columns%value('debris_mass'))// &
                   ' mg of debris have left the grid; debris_mass in the history has the sum '// &
                   '(DEBRIS = 0: it ends the run)')
    call warn_once(self%has_returns, sim%world, sim%clock%now%worst_returns > 0, at// &
                   'the return mapping of '//str(sim%clock%now%worst_returns)// &
                   ' particle-steps had not converged')
    if (.not. self%has_fracture) then
      separation = separation_ratio(sim%world, sim%scene, sim%particles)
      call warn_once(self%has_fracture, sim%world, separation > max_separation, at// &
                     'neighbouring particles are stretched to '//str(separation)// &
                     ' of the distance up to which nodes join them: numerical fracture '// &
                     '(try cpgimp, or more particles per cell)')
    end if
    call self%guards%check(sim, columns, self%melting%ratio)
  end subroutine check

  !> Log a warning when its condition is true for the first time.
  subroutine warn_once(is_given, world, is_true, message)
    logical, intent(inout) :: is_given
    type(world_t), intent(in) :: world
    logical, intent(in) :: is_true
    character(*), intent(in) :: message

    if (is_given .or. .not. is_true) return
    is_given = .true.
    if (world%is_root()) call log_line('warning: at '//message)
  end subroutine warn_once

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
      call make_warning_message(world, scene, clock, budget, k, message)
      self%has_validity(k) = message /= ''
      if (world%is_root() .and. message /= '') call log_line(message)
    end do
  end subroutine warn_validity

  !> Mass scaling at which inertial stress and inertial part of the loads would have stayed at their
  !> limit so far: for prescribed velocities they are proportional to the scaling, while waves run
  !> to its root.
  pure real(rp) function allowed_scaling(scene, clock, history)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(history_t), intent(in) :: history

    allowed_scaling = max(1.0_rp, clock%mass_scaling*scene%method%inertial_fraction &
                          /max(history%inertial_ratio, part_of_loads(history), epsilon(1.0_rp)))
  end function allowed_scaling

  !> Largest inertial load of a row over the largest load of the tools.
  pure real(rp) function part_of_loads(history) result(part)
    type(history_t), intent(in) :: history

    part = history%row_inertia%part(history%row_inertia%largest)
  end function part_of_loads

  !> Collective. Largest ratio of the distance of neighbours to that at which they surely share a
  !> node.
  real(rp) function separation_ratio(world, scene, particles)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(rp) :: largest(1)
    integer :: b

    largest = 0.0_rp
    do b = 1, particles%nblk
      if (scene%body(particles%body(b))%is_rigid()) cycle
      largest(1) = max(largest(1), separation_in_block(scene, particles%body(b), &
                                                       particles%count(b), particles%nf, &
                                                       particles%ps(:, :, b)))
    end do
    call world%max(largest)
    separation_ratio = largest(1)
  end function separation_ratio

  !> Largest ratio in a block, along the grid axes: particles surely share a node up to a distance
  !> of one cell plus one particle domain.
  pure real(rp) function separation_in_block(scene, body, n, nf, ps)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp) :: half(3), distance(3), edges(3), start(3)
    integer :: p

    separation_in_block = 0.0_rp
    half = scene%domain(body)
    associate (s => scene%body(body)%start)
      start = sqrt(s%bbar(1:3))*s%jac**(1.0_rp/3.0_rp)
    end associate
    do p = 1, n
      if (scene%layout%half > 0) half = ps(p, scene%layout%half:scene%layout%half + 2)
      edges = scene%grid%edges_at(ps(p, f_pos:f_pos + 2))
      distance = scene%spacing_of(body, ps(p, :))*sqrt(ps(p, f_bbar:f_bbar + 2)) &
        *ps(p, f_jac)**(1.0_rp/3.0_rp)/start
      separation_in_block = max(separation_in_block, &
                                maxval(distance/(edges*(1.0_rp + 2.0_rp*half))))
    end do
  end function separation_in_block

  !> Log the largest inertial stress of mass scaling at the end of a run.
  subroutine log_inertial_stress(scene, clock, history)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(history_t), intent(in) :: history
    character(:), allocatable :: text

    if (.not. (scene%method%adapts_mass .or. clock%mass_scaling > 1.0_rp)) return
    if (max(history%inertial_ratio, part_of_loads(history)) <= 0.0_rp) then
      call log_line('no metal with strength has flowed: the mass scaling cannot be assessed')
      return
    end if
    text = 'inertial stress up to '//str(100.0_rp*history%inertial_ratio)// &
      ' % of the flow stress, inertial force or power up to '// &
      str(100.0_rp*part_of_loads(history))//' % of the largest of the tools'
    if (scene%method%adapts_mass) then
      call log_line(text//', mass scaling '//str(clock%mass_scaling)//' in the end')
    else
      call log_line(text//': MASS_SCALING = '//str(allowed_scaling(scene, clock, history))// &
                    ' would make that '//str(100.0_rp*scene%method%inertial_fraction)//' %')
    end if
    if (history%row_inertia%load(1) > 0.0_rp) call log_line('loads on the tools act up to '// &
      str(contact_relaxation(clock, maxval(scene%grid%h)))// &
      ' s early, since gaps close slowly: metal that they have not reached bears up to '// &
      str(100.0_rp*history%early_force/history%row_inertia%load(1))//' % of the largest force')
  end subroutine log_inertial_stress

end module output_warnings
