! SPDX-License-Identifier: MIT
!> What contact with a tool does to a particle and at a node, and the reaction on the tool.
module contact_gap_law
  use base_kinds, only: rp
  use contact_tool, only: rigid_t, s_creep, s_force, s_friction, s_normal, s_press, s_slide, &
                          s_torque, s_work, tool_t
  implicit none (type, external)
  private

  public :: normal_velocity, book_tool_impulse

contains

  !> Velocity along the normal that contact takes from a particle, and its slip along the surface. A
  !> gap is closed and no more; the last `slop` of it closes only in the time `relaxation_time`, so
  !> that a surface that is rough by a few thousandths of a cell carries with all its particles and
  !> not with those that stand out. A penetration is taken back within a step, but no faster than
  !> `recovery_speed` or than the particle comes, which is more than a lasting load needs; what is
  !> left of it in the time `relaxation_time`. A particle that is found deep inside (behind an edge,
  !> say) gets no kick: kicks of depth/dt kept a stirred plate in a tremor by which it flowed under
  !> three quarters of the force.
  pure subroutine normal_velocity(dt, regular, slop, relaxation_time, recovery_speed, gap, &
                                  normal, velocity, closing, slip)
    real(rp), intent(in) :: dt, regular         !! this step and the one before [s]
    real(rp), intent(in) :: slop                !! width of the zone where gaps close slowly [m]
    real(rp), intent(in) :: relaxation_time                !! in which they do [s]
    real(rp), intent(in) :: recovery_speed                !! [m/s]
    real(rp), intent(in) :: gap                 !! at the end of the step, without contact [m]
    real(rp), intent(in) :: normal(3)           !! out of the tool
    real(rp), intent(in) :: velocity(3)         !! against the tool, without contact [m/s]
    real(rp), intent(out) :: closing, slip(3)   !! [m/s]
    real(rp) :: back, before, speed

    speed = dot_product(velocity, normal)
    slip = velocity - speed*normal
    before = gap - dt*speed
    if (before < 0.0_rp) then
      back = min(-before/max(dt, regular), max(recovery_speed, -speed))
      closing = -speed + back + max(0.0_rp, -before - dt*back)/max(relaxation_time, dt)
    else
      closing = -speed - min(before, slop)/max(relaxation_time, dt) - max(0.0_rp, before - slop)/dt
    end if
  end subroutine normal_velocity

  !> Books of a tool for the impulses that it gives at a place: force, torque, work, heat.
  pure subroutine book_tool_impulse(tool, rigid, x, push, hold, mean)
    type(tool_t), intent(inout) :: tool
    type(rigid_t), intent(in) :: rigid          !! its motion in this step
    real(rp), intent(in) :: x(3)                !! [m]
    real(rp), intent(in) :: push(3), hold(3)    !! across and along the surface [N s]
    real(rp), intent(in) :: mean(3)             !! velocity of the material, mean of the step [m/s]
    real(rp), dimension(3) :: arm, impulse, moment, normal, slip, surface
    real(rp) :: friction, press

    press = norm2(push)
    impulse = push + hold
    surface = rigid%velocity_at(x)
    slip = mean - surface
    arm = x - rigid%centre
    moment = [arm(2)*impulse(3) - arm(3)*impulse(2), arm(3)*impulse(1) - arm(1)*impulse(3), &
              arm(1)*impulse(2) - arm(2)*impulse(1)]
    friction = -dot_product(hold, slip)
    normal = push/max(press, tiny(press))
    associate (s => tool%sums)
      s(s_force:s_force + 2) = s(s_force:s_force + 2) - impulse
      s(s_torque) = s(s_torque) - dot_product(moment, tool%axes(:, 3))
      s(s_work) = s(s_work) + dot_product(impulse, surface)
      s(s_friction) = s(s_friction) + friction
      s(s_normal) = s(s_normal) - dot_product(push, slip)
      s(s_press) = s(s_press) + press
      s(s_creep) = s(s_creep) + press*norm2(mean - dot_product(mean, normal)*normal)
      s(s_slide) = s(s_slide) + press*norm2(surface - dot_product(surface, normal)*normal)
    end associate
  end subroutine book_tool_impulse

end module contact_gap_law
