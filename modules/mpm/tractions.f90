! SPDX-License-Identifier: MIT
!> Tractions, forces per initial area on the faces of bodies, and their work.
module mpm_tractions
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: weights_of
  use mpm_faces, only: add_to_nodes, face_area, face_of, face_t, mean_velocity
  use particles_block, only: block_t, view_block
  use particles_store, only: particles_t, tag_faces
  use state_budget, only: budget_t, e_body
  use state_clock, only: clock_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: tractions_to_grid, record_traction_work

contains

  !> Add the forces of all tractions to the nodes, before their records are summed over ranks.
  subroutine tractions_to_grid(scene, clock, particles, nodes, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(face_t) :: face(6*nlane)
    real(rp) :: force(3, 6*nlane)
    integer :: b, group, i, n

    do b = 1, particles%nblk
      call list_loaded_faces(scene, clock, particles, nodes, b, n, face, force)
      group = scene%body(particles%body(b))%group
      do i = 1, n
        call add_to_nodes(face(i), force(:, i), 5, nodes%patch%stride, nodes%patch%nn, &
                          g(:, :, group))
      end do
    end do
  end subroutine tractions_to_grid

  !> Record the work of all tractions in a step. Nodes hold the new velocities and their changes;
  !> particles have not moved since the forces were added.
  subroutine record_traction_work(scene, clock, particles, nodes, budget, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn, nodes%n_groups)
    type(face_t) :: face(6*nlane)
    real(rp) :: force(3, 6*nlane)
    integer :: b, group, i, n

    do b = 1, particles%nblk
      call list_loaded_faces(scene, clock, particles, nodes, b, n, face, force)
      group = scene%body(particles%body(b))%group
      do i = 1, n
        budget%sums(e_body) = budget%sums(e_body) + dt*dot_product(force(:, i), &
          mean_velocity(face(i), nodes%patch%stride, nodes%patch%nn, g(:, :, group)))
      end do
    end do
  end subroutine record_traction_work

  !> List the `n` loaded faces of block `b` and the current force on each [N].
  subroutine list_loaded_faces(scene, clock, particles, nodes, b, n, face, force)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: b
    integer, intent(out) :: n
    type(face_t), intent(inout) :: face(6*nlane)
    real(rp), intent(inout) :: force(3, 6*nlane)
    type(block_t) :: block
    integer :: faces(nlane), k, p
    real(rp) :: stress(3)

    n = 0
    call view_block(particles, b, block)
    if (.not. allocated(scene%body(block%body)%traction)) return
    faces = 0
    faces(:block%n) = tag_faces(particles%tag(:block%n, b))
    if (all(faces == 0)) return
    call weights_of(scene, nodes, block)
    do p = 1, block%n
      do k = 1, 6
        if (.not. btest(faces(p), k - 1)) cycle
        stress = stress_on(scene, clock, block, k, p)
        if (all(abs(stress) <= 0.0_rp)) cycle
        n = n + 1
        face(n) = face_of(scene, nodes, block, k, p)
        force(:, n) = face_area(scene, block%body, block%ps(p, :), k)*stress
      end do
    end do
  end subroutine list_loaded_faces

  !> Sum of the current tractions on face `k` of particle `p` [Pa].
  pure function stress_on(scene, clock, block, k, p) result(stress)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(block_t), intent(in) :: block
    integer, intent(in) :: k, p
    real(rp) :: stress(3), ramped
    integer :: i

    stress = 0.0_rp
    associate (tractions => scene%body(block%body)%traction, origin => scene%layout%origin)
      do i = 1, size(tractions)
        if (tractions(i)%has_box) then
          if (any(block%ps(p, origin:origin + 2) < tractions(i)%lower) .or. &
              any(block%ps(p, origin:origin + 2) > tractions(i)%upper)) cycle
        end if
        ramped = 1.0_rp
        associate (time => clock%now%force_time)
          if (time < tractions(i)%ramp) ramped = time/tractions(i)%ramp
        end associate
        stress = stress + ramped*tractions(i)%stress(:, k)
      end do
    end associate
  end function stress_on

end module mpm_tractions
