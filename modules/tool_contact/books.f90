! SPDX-License-Identifier: MIT
!> What a tool feels and spends in a step, and the friction heat of its contact.
module tool_contact_books
  use base_kinds, only: rp
  use contact_gap_law, only: book_tool_impulse
  use contact_tool, only: rigid_t, s_to_plate, tool_t
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_heat, particles_t
  use state_scene, only: scene_t
  use tool_contact_lists, only: tool_contact_t, v_hold, v_push, v_shear
  implicit none (type, external)
  private

  public :: book_tool, give_heat

contains

  !> Force, torque, work and heat of a tool, of this rank's particles; exact at the nodes, since the
  !> weights carry a rigid motion exactly.
  subroutine book_tool(nodes, contact, rigid, tool, g)
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    type(rigid_t), intent(in) :: rigid
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: mean(3), x(3)
    integer :: e

    associate (t => contact)
      do e = 1, t%n_nodes
        if (.not. t%own(v_shear, e) > 0.0_rp) cycle     ! none of its particles touches
        x = nodes%patch%position(t%node(e))
        mean = g(1:3, t%node(e)) - 0.5_rp*g(5:7, t%node(e))
        t%slip(:, e) = mean - rigid%velocity_at(x)
        call book_tool_impulse(tool, rigid, x, t%own(v_push:v_push + 2, e), &
                               t%part(e)*t%own(v_hold:v_hold + 2, e), mean)
      end do
    end associate
  end subroutine book_tool

  !> The friction heat to the particles whose friction it is: the tool's share of it goes into the
  !> body, of what the metal sheared as much as becomes heat of its plastic work.
  subroutine give_heat(scene, particles, contact, tool)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(in) :: contact
    type(tool_t), intent(inout) :: tool
    real(rp) :: heat, slip(3), stored
    integer :: i, p

    do p = 1, contact%n
      associate (t => contact%particle(p))
        slip = 0.0_rp
        do i = 1, 27
          if (t%entry(i) == 0) cycle
          slip = slip + t%weight(i)*contact%part(t%entry(i))*contact%slip(:, t%entry(i))
        end do
        associate (body => scene%body(particles%body(t%block)))
          stored = t%plastic_part*(1.0_rp - scene%material(body%material)%plastic_heat)
        end associate
        heat = -tool%heat_fraction*(1.0_rp - stored)*dot_product(t%hold, slip)
        particles%ps(t%lane, f_heat, t%block) = particles%ps(t%lane, f_heat, t%block) + heat
        tool%sums(s_to_plate) = tool%sums(s_to_plate) + heat
      end associate
    end do
  end subroutine give_heat

end module tool_contact_books
