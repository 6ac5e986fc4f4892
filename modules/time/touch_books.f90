! SPDX-License-Identifier: MIT
!> What a tool feels and spends in a step, and the friction heat of its contact.
module time_touch_books
  use base_kinds, only: rp
  use contact_tool, only: rigid_t, tool_t
  use contact_touch, only: settle
  use particles_store, only: f_heat
  use time_state, only: simulation_t
  use time_touching, only: v_hold, v_push, v_shear
  implicit none (type, external)
  private

  public :: book_tool, give_heat

contains

  !> Force, torque, work and heat of a tool, of this rank's particles; exact at the nodes, since the
  !> weights carry a rigid motion exactly.
  subroutine book_tool(sim, rigid, tool, g)
    type(simulation_t), intent(inout) :: sim
    type(rigid_t), intent(in) :: rigid
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: g(8, sim%patch%nn)
    real(rp) :: mean(3), x(3)
    integer :: e

    associate (t => sim%touching)
      do e = 1, t%n_nodes
        if (.not. t%own(v_shear, e) > 0.0_rp) cycle     ! none of its particles touches
        x = sim%patch%position(t%node(e))
        mean = g(1:3, t%node(e)) - 0.5_rp*g(5:7, t%node(e))
        t%slip(:, e) = mean - rigid%velocity_at(x)
        call settle(tool, rigid, x, t%own(v_push:v_push + 2, e), &
                    t%part(e)*t%own(v_hold:v_hold + 2, e), mean)
      end do
    end associate
  end subroutine book_tool

  !> The friction heat to the particles whose friction it is.
  subroutine give_heat(sim, heat_share)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: heat_share
    real(rp) :: slip(3)
    integer :: i, p

    do p = 1, sim%touching%n
      associate (t => sim%touching%touch(p))
        slip = 0.0_rp
        do i = 1, 27
          if (t%entry(i) == 0) cycle
          slip = slip + t%weight(i)*sim%touching%part(t%entry(i))*sim%touching%slip(:, t%entry(i))
        end do
        associate (heat => sim%particles%ps(t%lane, f_heat, t%block))
          heat = heat - heat_share*dot_product(t%hold, slip)
        end associate
      end associate
    end do
  end subroutine give_heat

end module time_touch_books
