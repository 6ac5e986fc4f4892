! SPDX-License-Identifier: MIT
!> Moving heat sources. The power is exact for any particle spacing: the heat of a conduction step
!> is distributed over all particles that the source covers. A particle at the edge counts by the
!> covered part of its width, so that the distribution changes continuously while the source moves.
module heat_sources
  use base_kinds, only: i8, rp
  use base_log, only: say
  use base_text, only: str
  use particles_store, only: f_heat, f_mass, f_pos, tag_faces
  use simulation_parts, only: simulation_t, source_disc, source_t
  use state_run, only: e_source, skin
  implicit none (type, external)
  private

  public :: add_source_heat

contains

  !> Collective. Add the heat of the sources since the last conduction step to the pending heat of
  !> the particles and to the energy sums.
  subroutine add_source_heat(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                       !! time since the last conduction step [s]
    real(rp) :: begin, end, heat, all(size(sim%source))
    integer :: i

    if (size(sim%source) == 0) return
    do i = 1, size(sim%source)
      associate (s => sim%source(i))
        begin = max(s%begin, sim%clock%heat_time)
        end = max(begin, min(s%end, sim%clock%heat_time + dt))
        s%duration = end - begin
        s%centre = s%position + 0.5_rp*(begin + end)*s%velocity
        all(i) = covered_sum(sim, s)
      end associate
    end do
    call sim%world%sum(all)
    do i = 1, size(sim%source)
      heat = sim%source(i)%power*sim%source(i)%duration
      if (all(i) > 0.0_rp) then
        sim%source(i)%share = heat/all(i)
        if (sim%world%is_root()) sim%budget%sums(e_source) = sim%budget%sums(e_source) + heat
        call heat_particles(sim, sim%source(i))
      else if (abs(heat) > 0.0_rp .and. .not. sim%source(i)%has_warned) then
        sim%source(i)%has_warned = .true.
        if (sim%world%is_root()) call say('warning: at t = '//str(sim%clock%heat_time &
          + dt)//' s &SOURCE '//str(i)//' touches no particle: its power is lost')
      end if
    end do
  end subroutine add_source_heat

  !> Sum of `covered` over the particles of this rank.
  real(rp) function covered_sum(sim, source)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer :: b, p

    covered_sum = 0.0_rp
    if (source%duration <= 0.0_rp) return
    do b = 1, sim%particles%nblk
      if (is_far(sim, source, b)) cycle
      do p = 1, sim%particles%count(b)
        covered_sum = covered_sum + covered(sim, source, b, p)
      end do
    end do
  end function covered_sum

  !> Add the heat of a source to the pending heat of the particles.
  subroutine heat_particles(sim, source)
    type(simulation_t), intent(inout) :: sim
    type(source_t), intent(in) :: source
    integer :: b, p

    do b = 1, sim%particles%nblk
      if (is_far(sim, source, b)) cycle
      do p = 1, sim%particles%count(b)
        sim%particles%ps(p, f_heat, b) = sim%particles%ps(p, f_heat, b) + source%share &
          *covered(sim, source, b, p)
      end do
    end do
  end subroutine heat_particles

  !> True if no particle of block `b` can be covered.
  pure logical function is_far(sim, source, b)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b

    is_far = norm2(sim%scene%grid%nearest_image(sim%particles%ball(1:3, b) &
                                                - source%centre)) > sim%particles%ball(4, b) &
      + source%radius + (2.0_rp + skin)*sim%scene%grid%longest()
  end function is_far

  !> Area (disc) or mass (ball) of a particle that a source covers [m2 or kg].
  pure real(rp) function covered(sim, source, b, p)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b, p
    real(rp) :: d(3), longest(3), spacing(3), width

    d = sim%scene%grid%nearest_image(sim%particles%ps(p, f_pos:f_pos + 2, b) - source%centre)
    spacing = sim%scene%spacing_of(sim%particles%body(b), sim%particles%ps(p, :, b))
    if (source%kind == source_disc) then
      longest = sim%scene%grid%longest_edges()
      covered = 0.0_rp
      if (lies_at_height(sim%particles%tag(p, b), d(3), spacing(3), longest(3))) covered = &
        spacing(1)*spacing(2)
      d(3) = 0.0_rp
      width = sqrt(spacing(1)*spacing(2))
    else
      covered = sim%particles%ps(p, f_mass, b)
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
