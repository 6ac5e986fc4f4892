! SPDX-License-Identifier: MIT
!> Moving heat sources, &SOURCE beside mechanics. The power is exact for any particle spacing: the
!> heat of a conduction step is distributed over all particles that the source covers. A particle at
!> the edge counts by the covered part of its width, so that the distribution changes continuously
!> while the source moves.
module hooks_source
  use base_kinds, only: i8, rp
  use base_log, only: log_line
  use base_text, only: str
  use heat_sources, only: heat_source_t, kind_disc
  use heat_volume, only: volume_t
  use heat_volumes, only: make_volume, volume_names
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use particles_store, only: f_heat, f_mass, f_pos, particles_t, tag_faces
  use state_budget, only: e_source
  use state_clock, only: skin
  use state_parts, only: hook_t, simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: source_t

  type, extends(hook_t) :: source_t
    type(heat_source_t) :: source
    integer :: number = 0                    !! index of its &SOURCE
    logical :: has_warned = .false.  !! it was reported that the source covers no particle
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, give_heat
    procedure, private :: covered, covers_none
  end type source_t

contains

  !> Add the group and its keys to the table. KIND = stir is for heat-only runs alone.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
    class(volume_t), allocatable :: volume
    character(:), allocatable :: names, either
    integer :: k

    names = 'disc'
    either = names
    do k = 1, size(volume_names)
      names = names//' '//trim(volume_names(k))
      either = either//' or '//trim(volume_names(k))
    end do
    call t%group('SOURCE', 'repeat', 'A moving source of heat.')
    call t%key('KIND', 'choice', 1, '', 'disc', names//' stir', &
      'disc: on the surface within RADIUS of its axis, along z; ball: in the volume; stir, '// &
      'heat alone: a disc that spins on the surface, with a heat flux of SHARE times shear '// &
      'stress, spin and distance from the axis')
    call t%key('POWER', 'real', 1, 'W', 'required if KIND = '//either, '', &
      'power; all of it enters the material that the source covers')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', 'centre at t = 0')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'velocity of the centre')
    call t%key('RADIUS', 'real', 1, 'm', 'required', '(0,inf)', &
      'distance from the centre, or the axis, within which the source acts')
    call t%key('BEGIN', 'real', 1, 's', '0', '[0,inf)', 'time at which the source starts')
    call t%key('END', 'real', 1, 's', '0', '[0,inf)', 'time at which the source ends; 0: never')
    call t%key('SPIN_RPM', 'real', 1, '1/min', '0 if KIND = stir', '', 'spin of the disc')
    call t%key('CONTACT', 'choice', 1, '', 'sticking if KIND = stir', &
      'sticking sliding limited mixed', &
      'shear stress under the disc: yield stress over sqrt(3); FRICTION times PRESSURE; the '// &
      'smaller one; SLIP times that of sliding and 1 - SLIP times that of sticking')
    call t%key('FRICTION', 'real', 1, '', '0 if CONTACT = sliding or limited or mixed', '[0,inf)', &
      'coefficient of friction under the disc')
    call t%key('PRESSURE', 'real', 1, 'Pa', '0 if CONTACT = sliding or limited or mixed', &
      '[0,inf)', 'pressure under the disc')
    call t%key('SLIP', 'real', 1, '', '0 if CONTACT = mixed', '[0,1]', &
      'weight of the stress of sliding')
    call t%key('SHARE', 'real', 1, '', 'if KIND = stir', '[0,1]', &
      'fraction of the heat that enters the body; not given: e/(e + e_tool), with the '// &
      'effusivities e = sqrt(conductivity density specific heat) of body and tool')
    call t%key('TOOL_DENSITY', 'real', 1, 'kg/m3', '7800 if KIND = stir', '(0,inf)', &
      'density of the tool, for SHARE')
    call t%key('TOOL_SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '460 if KIND = stir', '(0,inf)', &
      'specific heat of the tool, for SHARE')
    call t%key('TOOL_CONDUCTIVITY', 'real', 1, 'W/(m K)', '14.4 if KIND = stir', '[0,inf)', &
      'conductivity of the tool, for SHARE')
    do k = 1, size(volume_names)
      call make_volume(trim(volume_names(k)), volume)
      call volume%add_keys(t)
    end do
  end subroutine add_keys

  !> Read and check the `i`-th &SOURCE.
  subroutine read_keys(self, input, i, scene)
    class(source_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(inout) :: scene

    self%number = i
    call self%source%read_keys(input, i)
    if (self%source%end <= self%source%begin) then
      call input%report('SOURCE', i, 'END', 'must be after BEGIN')
    end if
    if (.not. scene%method%conducts) then
      call input%report('SOURCE', i, '', 'has no effect without a &HEAT group')
    else if (scene%method%has_mechanics .and. .not. any(scene%material%conducts())) then
      call input%report('SOURCE', i, '', 'has no effect without a &MATERIAL with CONDUCTIVITY')
    end if
  end subroutine read_keys

  !> Collective. Add the heat of the source in the conduction step to the pending heat of the
  !> particles and to the energy sums.
  subroutine give_heat(self, sim, dt)
    class(source_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                       !! time since the last conduction step [s]
    real(rp) :: begin, end, centre(3), heat, all(1)
    integer :: b, p

    associate (s => self%source)
      begin = max(s%begin, sim%clock%heat_time)
      end = max(begin, min(s%end, sim%clock%heat_time + dt))
      heat = s%power*(end - begin)
      if (.not. abs(heat) > 0.0_rp) return
      centre = s%position + 0.5_rp*(begin + end)*s%velocity
    end associate
    all = 0.0_rp
    do b = 1, sim%particles%nblk
      if (self%covers_none(sim%scene, sim%particles, centre, b)) cycle
      do p = 1, sim%particles%count(b)
        all = all + self%covered(sim%scene, sim%particles, centre, b, p)
      end do
    end do
    call sim%world%sum(all)
    if (all(1) <= 0.0_rp) then
      if (sim%world%is_root() .and. .not. self%has_warned) call log_line('warning: at t = '// &
        str(sim%clock%heat_time + dt)//' s &SOURCE '//str(self%number)// &
        ' touches no particle: its power is lost')
      self%has_warned = .true.
      return
    end if
    if (sim%world%is_root()) sim%budget%sums(e_source) = sim%budget%sums(e_source) + heat
    do b = 1, sim%particles%nblk
      if (self%covers_none(sim%scene, sim%particles, centre, b)) cycle
      do p = 1, sim%particles%count(b)
        sim%particles%ps(p, f_heat, b) = sim%particles%ps(p, f_heat, b) &
          + heat/all(1)*self%covered(sim%scene, sim%particles, centre, b, p)
      end do
    end do
  end subroutine give_heat

  !> True if no particle of block `b` can be covered.
  pure logical function covers_none(self, scene, particles, centre, b)
    class(source_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(rp), intent(in) :: centre(3)                !! centre of the source [m]
    integer, intent(in) :: b

    covers_none = norm2(scene%grid%nearest_image(particles%ball(1:3, b) - centre)) &
      > particles%ball(4, b) + self%source%radius + (2.0_rp + skin)*scene%grid%longest()
  end function covers_none

  !> Area (disc) or mass (volume) of a particle that the source covers [m2 or kg].
  pure real(rp) function covered(self, scene, particles, centre, b, p)
    class(source_t), intent(in) :: self
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(rp), intent(in) :: centre(3)                !! centre of the source [m]
    integer, intent(in) :: b, p
    real(rp) :: d(3), longest(3), spacing(3), width

    d = scene%grid%nearest_image(particles%ps(p, f_pos:f_pos + 2, b) - centre)
    spacing = scene%spacing_of(particles%body(b), particles%ps(p, :, b))
    if (self%source%kind == kind_disc) then
      longest = scene%grid%longest_edges()
      covered = 0.0_rp
      if (lies_at_height(particles%tag(p, b), d(3), spacing(3), longest(3))) then
        covered = spacing(1)*spacing(2)
      end if
      d(3) = 0.0_rp
      width = sqrt(spacing(1)*spacing(2))
    else
      covered = particles%ps(p, f_mass, b)
      width = product(spacing)**(1.0_rp/3.0_rp)
    end if
    covered = covered*self%source%volume%weight(d, width)
  end function covered

  !> True if a particle has a free face normal to z within one cell edge of the height of a disc.
  pure logical function lies_at_height(tag, d, spacing, h)
    integer(i8), intent(in) :: tag
    real(rp), intent(in) :: d          !! height of the particle above the disc [m]
    real(rp), intent(in) :: spacing    !! edge of the particle along z [m]
    real(rp), intent(in) :: h          !! largest cell edge along z [m]
    integer :: faces

    faces = tag_faces(tag)
    lies_at_height = (btest(faces, 4) .and. abs(d - 0.5_rp*spacing) < h) .or. &
                     (btest(faces, 5) .and. abs(d + 0.5_rp*spacing) < h)
  end function lies_at_height

end module hooks_source
