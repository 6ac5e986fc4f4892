! SPDX-License-Identifier: MIT
!> Tractions, forces per initial area on the faces of bodies, and their work.
module update_tractions
  use base_kinds, only: nlane, rp
  use mapping_blocks, only: weights_of
  use mapping_faces, only: add_to_nodes, face_area, face_of, face_t, mean_velocity
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_mass, particles_t, tag_faces
  use state_run, only: budget_t, e_body, step_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: tractions_to_grid, record_traction_work

contains

  !> Add the forces of all tractions to the nodes, before their records are summed over ranks.
  subroutine tractions_to_grid(scene, step, particles, nodes, g)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(face_t) :: face(6*nlane)
    real(rp) :: force(3, 6*nlane)
    integer :: b, group, i, n

    do b = 1, particles%nblk
      call loaded_faces(scene, step, particles, nodes, b, particles%nf, particles%ps(:, :, b), n, &
                        face, force)
      group = scene%body(particles%body(b))%group
      do i = 1, n
        call add_to_nodes(face(i), force(:, i), 5, nodes%patch%stride, nodes%patch%nn, &
                          g(:, :, group))
      end do
    end do
  end subroutine tractions_to_grid

  !> Record the work of all tractions in a step. Nodes hold the new velocities and their changes,
  !> particles are still where the forces were added.
  subroutine record_traction_work(scene, step, particles, nodes, budget, dt, g)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn, nodes%n_groups)
    type(face_t) :: face(6*nlane)
    real(rp) :: force(3, 6*nlane)
    integer :: b, group, i, n

    do b = 1, particles%nblk
      call loaded_faces(scene, step, particles, nodes, b, particles%nf, particles%ps(:, :, b), n, &
                        face, force)
      group = scene%body(particles%body(b))%group
      do i = 1, n
        budget%sums(e_body) = budget%sums(e_body) + dt*dot_product(force(:, i), &
          mean_velocity(face(i), nodes%patch%stride, nodes%patch%nn, g(:, :, group)))
      end do
    end do
  end subroutine record_traction_work

  !> List the `n` loaded faces of block `b` and the current force on each [N].
  subroutine loaded_faces(scene, step, particles, nodes, b, nf, ps, n, face, force)
    type(scene_t), intent(in) :: scene
    type(step_t), intent(in) :: step
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: b, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer, intent(out) :: n
    type(face_t), intent(inout) :: face(6*nlane)
    real(rp), intent(inout) :: force(3, 6*nlane)
    integer :: first(nlane), body, faces(nlane), k, p
    real(rp) :: w(nlane, 18), stress(3)

    n = 0
    body = particles%body(b)
    if (.not. allocated(scene%body(body)%traction)) return
    faces = 0
    faces(:particles%count(b)) = tag_faces(particles%tag(:particles%count(b), b))
    if (all(faces == 0)) return
    call weights_of(scene, nodes, body, nf, ps, w, first)
    do p = 1, particles%count(b)
      do k = 1, 6
        if (.not. btest(faces(p), k - 1)) cycle
        stress = stress_on(scene, step, body, k, p, nf, ps)
        if (all(abs(stress) <= 0.0_rp)) cycle
        n = n + 1
        face(n) = face_of(scene, nodes, body, k, p, nf, ps, w, first)
        force(:, n) = face_area(scene, body, ps(p, :), k)*stress
      end do
    end do
  end subroutine loaded_faces

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

end module update_tractions
