! SPDX-License-Identifier: MIT
!> Moving sources of heat. The power is exact whatever the lattice: the heat of a conduction step is
!> shared over all particles that the source covers. A particle at the rim counts by the part of
!> its width that is covered, so that the shares are continuous while the source moves.
module time_sources
  use, intrinsic :: iso_fortran_env, only: output_unit
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_heat, f_mass, f_pos, tag_faces
  use time_audit, only: e_source
  use time_faces, only: add_to_nodes, face_area, face_of
  use time_state, only: simulation_t, source_disc, source_t
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: heat_of_sources, balls_to_particles, discs_to_grid

contains

  !> Collective: what each source gives per covered area or mass in the `dt` since the last
  !> conduction step [J/m2, J/kg], and its place meanwhile; booked.
  subroutine heat_of_sources(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                       !! [s]
    real(rp), allocatable :: covered(:)
    real(rp) :: begin, end, heat
    integer :: i

    if (.not. allocated(sim%source)) return
    do i = 1, size(sim%source)
      associate (source => sim%source(i))
        begin = max(source%begin, sim%clock%heat_time)
        end = max(begin, min(source%end, sim%clock%heat_time + dt))
        source%duration = end - begin
        source%centre = source%position + 0.5_rp*(begin + end)*source%velocity
      end associate
    end do
    covered = [(covered_here(sim, sim%source(i)), i=1, size(sim%source))]
    call world%sum(covered)
    do i = 1, size(sim%source)
      associate (source => sim%source(i))
        source%share = 0.0_rp
        heat = source%power*source%duration
        if (covered(i) > 0.0_rp) then
          source%share = heat/covered(i)
          if (world%is_root()) sim%sums(e_source) = sim%sums(e_source) + heat
        else if (source%duration > 0.0_rp .and. .not. source%has_warned) then
          source%has_warned = .true.
          if (world%is_root()) write (output_unit, '(a)') 'warning: at t = '// &
            str(sim%clock%heat_time + dt)//' s heat source '//str(i)// &
            ' touches no particle: its power is lost'
        end if
      end associate
    end do
  end subroutine heat_of_sources

  !> Area (disc) or mass (ball) of this rank's particles that a source covers [m2, kg].
  real(rp) function covered_here(sim, source)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer :: b, k, p

    covered_here = 0.0_rp
    if (source%duration <= 0.0_rp) return
    do b = 1, sim%particles%nblk
      if (is_far(sim, source, b)) cycle
      do p = 1, sim%particles%count(b)
        if (source%kind == source_disc) then
          k = disc_face(sim, source, b, p)
          if (k == 0) cycle
          covered_here = covered_here + part_covered(sim, source, b, p) &
                                        *face_area(sim, sim%particles%body(b), k)
        else
          covered_here = covered_here + part_covered(sim, source, b, p) &
                                        *sim%particles%ps(p, f_mass, b)
        end if
      end do
    end do
  end function covered_here

  !> Balls: add their heat to what waits in the particles.
  subroutine balls_to_particles(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b, i, p

    if (.not. allocated(sim%source)) return
    do i = 1, size(sim%source)
      associate (source => sim%source(i))
        if (source%kind == source_disc .or. source%duration <= 0.0_rp) cycle
        do b = 1, sim%particles%nblk
          if (is_far(sim, source, b)) cycle
          do p = 1, sim%particles%count(b)
            associate (ps => sim%particles%ps(p, :, b))
              ps(f_heat) = ps(f_heat) + source%share*ps(f_mass)*part_covered(sim, source, b, p)
            end associate
          end do
        end do
      end associate
    end do
  end subroutine balls_to_particles

  !> Discs: add their heat to the nodes at the faces of block `b`, to lane 5 of `flux`.
  subroutine discs_to_grid(sim, b, nf, ps, w, first, flux)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b, nf, first(nlane)
    real(rp), intent(in) :: ps(nlane, nf), w(nlane, 18)
    real(rp), intent(inout) :: flux(8, sim%patch%nn)
    real(rp) :: heat
    integer :: i, k, p

    if (.not. allocated(sim%source)) return
    do i = 1, size(sim%source)
      associate (source => sim%source(i), body => sim%particles%body(b))
        if (source%kind /= source_disc .or. source%duration <= 0.0_rp) cycle
        if (is_far(sim, source, b)) cycle
        do p = 1, sim%particles%count(b)
          k = disc_face(sim, source, b, p)
          if (k == 0) cycle
          heat = source%share*face_area(sim, body, k)*part_covered(sim, source, b, p)
          call add_to_nodes(face_of(sim, body, k, p, nf, ps, w, first), [heat], 5, &
                            sim%patch%stride, sim%patch%nn, flux)
        end do
      end associate
    end do
  end subroutine discs_to_grid

  !> True if no particle of block `b` can be covered.
  pure logical function is_far(sim, source, b)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b

    is_far = norm2(sim%ball(1:3, b) - source%centre) &
             > sim%ball(4, b) + source%radius + 2.0_rp*sim%scene%grid%h
  end function is_far

  !> The face of a particle that a disc heats: an open one across z, within a cell of the centre's
  !> height; 0 if there is none.
  pure integer function disc_face(sim, source, b, p)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b, p
    real(rp) :: z
    integer :: k

    disc_face = 0
    do k = 5, 6
      if (.not. btest(tag_faces(sim%particles%tag(p, b)), k - 1)) cycle
      z = sim%particles%ps(p, f_pos + 2, b) &
          + (k - 5.5_rp)*sim%scene%body(sim%particles%body(b))%spacing(3)
      if (abs(z - source%centre(3)) < sim%scene%grid%h) disc_face = k
    end do
  end function disc_face

  !> Part of a particle's width that lies within the radius of a source.
  pure real(rp) function part_covered(sim, source, b, p)
    type(simulation_t), intent(in) :: sim
    type(source_t), intent(in) :: source
    integer, intent(in) :: b, p
    real(rp) :: d(3), width

    d = sim%particles%ps(p, f_pos:f_pos + 2, b) - source%centre
    if (source%kind == source_disc) d(3) = 0.0_rp
    associate (spacing => sim%scene%body(sim%particles%body(b))%spacing)
      width = merge(sqrt(spacing(1)*spacing(2)), product(spacing)**(1.0_rp/3.0_rp), &
                    source%kind == source_disc)
    end associate
    part_covered = max(0.0_rp, min(1.0_rp, (source%radius - norm2(d))/width + 0.5_rp))
  end function part_covered

end module time_sources
