! SPDX-License-Identifier: MIT
!> Moving heat sources. The power is exact for any particle spacing: the heat of a conduction step
!> is distributed over all particles that the source covers. A particle at the edge counts by the
!> covered part of its width, so that the distribution changes continuously while the source moves.
module heat_sources
  use base_kinds, only: i8, rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_heat, f_mass, f_pos, particles_t, tag_faces
  use state_run, only: budget_t, clock_t, e_source, skin
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: add_source_heat, source_t

  integer, parameter, public :: source_disc = 1, source_ball = 2

  !> A moving heat source, and its state in the current conduction step.
  type :: source_t
    integer :: kind = source_disc
    real(rp) :: power = 0.0_rp               !! [W]
    real(rp) :: position(3) = 0.0_rp         !! centre at t = 0 [m]
    real(rp) :: velocity(3) = 0.0_rp         !! [m/s]
    real(rp) :: radius = 0.0_rp              !! [m]
    real(rp) :: begin = 0.0_rp, end = huge(1.0_rp)   !! times of its action [s]
    real(rp) :: duration = 0.0_rp            !! time of action in this step [s]
    real(rp) :: centre(3) = 0.0_rp           !! centre at the middle of that time [m]
    real(rp) :: share = 0.0_rp               !! heat per covered area or mass [J/m2 or J/kg]
    logical :: has_warned = .false.          !! a warning of no covered particle was given
  end type source_t

contains

  !> Collective. Add the heat of the sources since the last conduction step to the pending heat of
  !> the particles and to the energy sums.
  subroutine add_source_heat(world, scene, clock, source, particles, budget, dt)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(source_t), intent(inout) :: source(:)
    type(particles_t), intent(inout) :: particles
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt                       !! time since the last conduction step [s]
    real(rp) :: begin, end, heat, all(size(source))
    integer :: i

    if (size(source) == 0) return
    do i = 1, size(source)
      associate (s => source(i))
        begin = max(s%begin, clock%heat_time)
        end = max(begin, min(s%end, clock%heat_time + dt))
        s%duration = end - begin
        s%centre = s%position + 0.5_rp*(begin + end)*s%velocity
        all(i) = covered_sum(scene, particles, s)
      end associate
    end do
    call world%sum(all)
    do i = 1, size(source)
      heat = source(i)%power*source(i)%duration
      if (all(i) > 0.0_rp) then
        source(i)%share = heat/all(i)
        if (world%is_root()) budget%sums(e_source) = budget%sums(e_source) + heat
        call heat_particles(scene, particles, source(i))
      else if (abs(heat) > 0.0_rp .and. .not. source(i)%has_warned) then
        source(i)%has_warned = .true.
        if (world%is_root()) call say('warning: at t = '//str(clock%heat_time + dt)// &
                                      ' s &SOURCE '//str(i)// &
                                      ' touches no particle: its power is lost')
      end if
    end do
  end subroutine add_source_heat

  !> Sum of `covered` over the particles of this rank.
  real(rp) function covered_sum(scene, particles, source)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(source_t), intent(in) :: source
    integer :: b, p

    covered_sum = 0.0_rp
    if (source%duration <= 0.0_rp) return
    do b = 1, particles%nblk
      if (is_far(scene, particles, source, b)) cycle
      do p = 1, particles%count(b)
        covered_sum = covered_sum + covered(scene, particles, source, b, p)
      end do
    end do
  end function covered_sum

  !> Add the heat of a source to the pending heat of the particles.
  subroutine heat_particles(scene, particles, source)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(source_t), intent(in) :: source
    integer :: b, p

    do b = 1, particles%nblk
      if (is_far(scene, particles, source, b)) cycle
      do p = 1, particles%count(b)
        particles%ps(p, f_heat, b) = particles%ps(p, f_heat, b) &
          + source%share*covered(scene, particles, source, b, p)
      end do
    end do
  end subroutine heat_particles

  !> True if no particle of block `b` can be covered.
  pure logical function is_far(scene, particles, source, b)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(source_t), intent(in) :: source
    integer, intent(in) :: b

    is_far = norm2(scene%grid%nearest_image(particles%ball(1:3, b) - source%centre)) &
             > particles%ball(4, b) + source%radius + (2.0_rp + skin)*scene%grid%longest()
  end function is_far

  !> Area (disc) or mass (ball) of a particle that a source covers [m2 or kg].
  pure real(rp) function covered(scene, particles, source, b, p)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(source_t), intent(in) :: source
    integer, intent(in) :: b, p
    real(rp) :: d(3), longest(3), spacing(3), width

    d = scene%grid%nearest_image(particles%ps(p, f_pos:f_pos + 2, b) - source%centre)
    spacing = scene%spacing_of(particles%body(b), particles%ps(p, :, b))
    if (source%kind == source_disc) then
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
    covered = covered*max(0.0_rp, min(1.0_rp, (source%radius - norm2(d))/width + 0.5_rp))
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

end module heat_sources
