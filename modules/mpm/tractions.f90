! SPDX-License-Identifier: MIT
!> Tractions, forces per initial area on the faces of bodies, and their work.
module mpm_tractions
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: weights_of
  use mpm_faces, only: add_to_nodes, face_area, face_of, face_t, mean_velocity
  use particles_store, only: tag_faces
  use simulation_parts, only: simulation_t
  use simulation_run, only: e_body, step_t
  use simulation_scene, only: scene_t
  implicit none (type, external)
  private

  public :: tractions_to_grid, record_traction_work

contains

  !> Add the forces of all tractions to the nodes, before their records are summed over ranks.
  subroutine tractions_to_grid(sim, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(face_t) :: face(6*nlane)
    real(rp) :: force(3, 6*nlane)
    integer :: b, group, i, n

    do b = 1, sim%particles%nblk
      call list_loaded_faces(sim, b, sim%particles%nf, sim%particles%ps(:, :, b), n, face, force)
      group = sim%scene%body(sim%particles%body(b))%group
      do i = 1, n
        call add_to_nodes(face(i), force(:, i), 5, sim%nodes%patch%stride, sim%nodes%patch%nn, &
                          g(:, :, group))
      end do
    end do
  end subroutine tractions_to_grid

  !> Record the work of all tractions in a step. Nodes hold the new velocities and their changes;
  !> particles have not moved since the forces were added.
  subroutine record_traction_work(sim, dt, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(face_t) :: face(6*nlane)
    real(rp) :: force(3, 6*nlane)
    integer :: b, group, i, n

    do b = 1, sim%particles%nblk
      call list_loaded_faces(sim, b, sim%particles%nf, sim%particles%ps(:, :, b), n, face, force)
      group = sim%scene%body(sim%particles%body(b))%group
      do i = 1, n
        sim%budget%sums(e_body) = sim%budget%sums(e_body) + dt*dot_product(force(:, i), &
          mean_velocity(face(i), sim%nodes%patch%stride, sim%nodes%patch%nn, g(:, :, group)))
      end do
    end do
  end subroutine record_traction_work

  !> List the `n` loaded faces of block `b` and the current force on each [N].
  subroutine list_loaded_faces(sim, b, nf, ps, n, face, force)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer, intent(out) :: n
    type(face_t), intent(inout) :: face(6*nlane)
    real(rp), intent(inout) :: force(3, 6*nlane)
    integer :: first(nlane), body, faces(nlane), k, p
    real(rp) :: w(nlane, 18), stress(3)

    n = 0
    body = sim%particles%body(b)
    if (.not. allocated(sim%scene%body(body)%traction)) return
    faces = 0
    faces(:sim%particles%count(b)) = tag_faces(sim%particles%tag(:sim%particles%count(b), b))
    if (all(faces == 0)) return
    call weights_of(sim%scene, sim%nodes, body, nf, ps, w, first)
    do p = 1, sim%particles%count(b)
      do k = 1, 6
        if (.not. btest(faces(p), k - 1)) cycle
        stress = stress_on(sim%scene, sim%step, body, k, p, nf, ps)
        if (all(abs(stress) <= 0.0_rp)) cycle
        n = n + 1
        face(n) = face_of(sim%scene, sim%nodes, body, k, p, nf, ps, w, first)
        force(:, n) = face_area(sim%scene, body, ps(p, :), k)*stress
      end do
    end do
  end subroutine list_loaded_faces

  !> Sum of the current tractions on face `k` of particle `p` [Pa].
  pure function stress_on(scene, step, body, k, p, nf, ps) result(stress)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    integer, intent(in) :: body, k, p, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp) :: stress(3), ramped
    integer :: i

    stress = 0.0_rp
    associate (tractions => scene%body(body)%traction, origin => scene%layout%origin)
      do i = 1, size(tractions)
        if (tractions(i)%has_box) then
          if (any(ps(p, origin:origin + 2) < tractions(i)%lower) .or. &
              any(ps(p, origin:origin + 2) > tractions(i)%upper)) cycle
        end if
        ramped = 1.0_rp
        if (step%force_time < tractions(i)%ramp) ramped = step%force_time/tractions(i)%ramp
        stress = stress + ramped*tractions(i)%stress(:, k)
      end do
    end associate
  end function stress_on

end module mpm_tractions
