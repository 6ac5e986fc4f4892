! SPDX-License-Identifier: MIT
!> The surface at which a tool touches a particle. It lies half a spacing from the centre at first
!> and is a point of the material: while a tool presses on the particle, the layer of metal between
!> them becomes thinner as the nodes say (`offset`, a field of the particles), if it can flow. A
!> surface that stayed half a spacing away would hold flattened metal off the tool: the foot of a
!> Taylor bar was 8 % wider.
module tool_contact_surface
  use base_kinds, only: rp
  use mapping_nodes, only: nodes_t
  use particles_store, only: particles_t
  use state_scene, only: scene_t
  use tool_contact_lists, only: tool_contact_t
  implicit none (type, external)
  private

  public :: flatten, velocity_at

  real(rp), parameter :: least_offset = 0.1_rp  !! of half a spacing

contains

  !> Velocity of the nodes at the centre or at the surface of a particle [m/s].
  pure function velocity_at(nodes, first, w, g) result(v)
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: first                !! of 27 nodes
    real(rp), intent(in) :: w(3, 3), g(8, nodes%patch%nn)
    real(rp) :: v(3)
    integer :: i, j, k, q

    v = 0.0_rp
    do i = 1, 3
      do j = 1, 3
        q = first + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) - 1
        do k = 1, 3
          v = v + w(i, 1)*w(j, 2)*w(k, 3)*g(1:3, q + k)
        end do
      end do
    end do
  end function velocity_at

  !> After contact: the surfaces of metal that touches come nearer to the centres, or go back.
  subroutine flatten(scene, particles, nodes, contact, dt, g)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(in) :: contact
    real(rp), intent(in) :: dt, g(8, nodes%patch%nn)
    real(rp) :: apart(3), rate
    integer :: c, i, j, k, p, q

    do p = 1, contact%n
      associate (t => contact%particle(p))
        if (.not. (t%can_flow .and. t%touches)) cycle
        apart = 0.0_rp
        c = 0
        do i = 1, 3
          do j = 1, 3
            q = t%first + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) - 1
            do k = 1, 3
              c = c + 1
              apart = apart + (t%inner(i, 1)*t%inner(j, 2)*t%inner(k, 3) - t%weight(c))*g(1:3, q &
                + k)
            end do
          end do
        end do
        rate = dot_product(t%normal, apart)/t%half
        associate (offset => particles%ps(t%lane, scene%layout%surface_offset, t%block))
          offset = max(least_offset, min(1.0_rp, offset*(1.0_rp + dt*rate)))
        end associate
      end associate
    end do
  end subroutine flatten

end module tool_contact_surface
