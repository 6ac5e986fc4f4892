! SPDX-License-Identifier: MIT
!> Moving sources of heat. The power is exact whatever the lattice: the heat of a conduction step is
!> shared over all particles that the source covers. A particle at the rim counts by the part of
!> its width that is covered, so that the shares are continuous while the source moves.
module time_sources
  use base_kinds, only: i8, rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_heat, f_mass, f_pos, tag_faces
  use time_audit, only: e_source
  use time_state, only: roam, simulation_t, source_disc, source_t
  implicit none (type, external)
  private

  public :: give_source_heat

contains

  !> Collective: add what the sources gave in the `dt` since the last conduction step to the heat
  !> that waits in the particles, and book it.
  subroutine give_source_heat(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                       !! [s]
    real(rp) :: begin, end, heat, all(size(sim%source))
    integer :: i

    if (size(sim%source) == 0) return
    do i = 1, size(sim%source)
      associate (source => sim%source(i))
        begin = max(source%begin, sim%clock%heat_time)
        end = max(begin, min(source%end, sim%clock%heat_time + dt))
        source%duration = end - begin
        source%centre = source%position + 0.5_rp*(begin + end)*source%velocity
        all(i) = covered_here(sim, source)
      end associate
    end do
    call world%sum(all)
    do i = 1, size(sim%source)
      heat = sim%source(i)%power*sim%source(i)%duration
      if (all(i) > 0.0_rp) then
        sim%source(i)%share = heat/all(i)
        if (world%is_root()) sim%sums(e_source) = sim%sums(e_source) + heat
        call heat_particles(sim, sim%source(i))
      else if (abs(heat) > 0.0_rp .and. .not. sim%source(i)%has_warned) then
        sim%source(i)%has_warned = .true.
        if (world%is_root()) call say('warning: at t = '// &
          str(sim%clock%heat_time + dt)//' s &SOURCE '//str(i)// &
          ' touches no particle: its power is lost')
      end if
    end do
  end subroutine give_source_heat

  !> Sum of `covered` over this rank's particles.
  real(rp) function covered_here(sim, source)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer :: b, p

    covered_here = 0.0_rp
    if (source%duration <= 0.0_rp) return
    do b = 1, sim%particles%nblk
      if (is_far(sim, source, b)) cycle
      do p = 1, sim%particles%count(b)
        covered_here = covered_here + covered(sim, source, b, p)
      end do
    end do
  end function covered_here

  !> Add the heat of a source to what waits in the particles.
  subroutine heat_particles(sim, source)
    type(simulation_t), intent(inout) :: sim
    type(source_t), intent(in) :: source
    integer :: b, p

    do b = 1, sim%particles%nblk
      if (is_far(sim, source, b)) cycle
      do p = 1, sim%particles%count(b)
        sim%particles%ps(p, f_heat, b) = sim%particles%ps(p, f_heat, b) &
                                         + source%share*covered(sim, source, b, p)
      end do
    end do
  end subroutine heat_particles

  !> True if no particle of block `b` can be covered.
  pure logical function is_far(sim, source, b)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b

    is_far = norm2(sim%ball(1:3, b) - source%centre) &
             > sim%ball(4, b) + source%radius + (2.0_rp + roam)*sim%scene%grid%h
  end function is_far

  !> Area (disc) or mass (ball) of a particle that a source covers [m2, kg].
  pure real(rp) function covered(sim, source, b, p)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b, p
    real(rp) :: d(3), width

    d = sim%particles%ps(p, f_pos:f_pos + 2, b) - source%centre
    associate (spacing => sim%scene%body(sim%particles%body(b))%spacing)
      if (source%kind == source_disc) then
        covered = 0.0_rp
        if (lies_at_height(sim%particles%tag(p, b), d(3), spacing(3), sim%scene%grid%h)) then
          covered = spacing(1)*spacing(2)
        end if
        d(3) = 0.0_rp
        width = sqrt(spacing(1)*spacing(2))
      else
        covered = sim%particles%ps(p, f_mass, b)
        width = product(spacing)**(1.0_rp/3.0_rp)
      end if
    end associate
    covered = covered*max(0.0_rp, min(1.0_rp, (source%radius - norm2(d))/width + 0.5_rp))
  end function covered

  !> True if a particle `d` above the centre of a disc has an open face across z within a cell of
  !> that height.
  pure logical function lies_at_height(tag, d, spacing, h)
    integer(i8), intent(in) :: tag
    real(rp), intent(in) :: d, spacing, h          !! [m]
    integer :: faces

    faces = tag_faces(tag)
    lies_at_height = (btest(faces, 4) .and. abs(d - 0.5_rp*spacing) < h) .or. &
                     (btest(faces, 5) .and. abs(d + 0.5_rp*spacing) < h)
  end function lies_at_height

end module time_sources
