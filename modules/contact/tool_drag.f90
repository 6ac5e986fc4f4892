! SPDX-License-Identifier: MIT
!> Metal that the shear layer under the face of a tool carries along. The layer is thinner than a
!> cell, and its metal moves faster than the grid: around a pin it goes from the front to the back.
!> A particle at the face is displaced in each step by the mean velocity of its layer metal relative
!> to its centre, along the rigid motion of the tool.
!>
!> Where more metal arrives than leaves, the volume ratio of the particles at the face decreases by
!> what the grid does not see, until their pressure pushes metal away; where more leaves it
!> increases. In room that is empty metal arrives without resistance.
module contact_tool_drag
  use base_kinds, only: nlane, rp
  use contact_tool_walls, only: stop_at_wall
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_tau, f_temp, particles_t
  use simulation_run, only: budget_t, e_stress, outcome_t
  use simulation_scene, only: scene_t
  use simulation_tool_lists, only: contact_particle_t, drag_t, tool_contact_t, v_carried, v_mass
  use tools_tool, only: rigid_t
  implicit none (type, external)
  private

  real(rp), parameter :: disorder = 0.1_rp       !! part of the room, as in step_room

  public :: add_carried, carry_metal, find_drag, pack_layer

contains

  !> Add to the nodes of the particles in contact the mass that the layer carries to them in the
  !> step, by its velocity in the last one, and their mass.
  subroutine add_carried(contact, dt)
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: dt   !! time step [s]
    real(rp) :: mass, step(3)
    integer :: c, i, j, k, p

    do p = 1, contact%n
      associate (t => contact%particle(p), values => contact%values)
        mass = t%own_mass
        step = dt*t%drag
        c = 0
        do i = 1, 3
          do j = 1, 3
            do k = 1, 3
              c = c + 1
              if (t%entry(c) == 0) cycle
              associate (w => t%w_centre, dw => t%slope)
                values(v_mass, t%entry(c)) = values(v_mass, t%entry(c)) &
                  + mass*w(i, 1)*w(j, 2)*w(k, 3)
                values(v_carried, t%entry(c)) = values(v_carried, t%entry(c)) &
                  + mass*(dw(i, 1)*w(j, 2)*w(k, 3)*step(1) + w(i, 1)*dw(j, 2)*w(k, 3)*step(2) &
                          + w(i, 1)*w(j, 2)*dw(k, 3)*step(3))
              end associate
            end do
          end do
        end do
      end associate
    end do
  end subroutine add_carried

  !> Change the volume ratios of the particles in contact by the metal that the layer has carried to
  !> them, except in room that is empty; record the energy of the change.
  subroutine pack_layer(scene, particles, contact, budget)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(in) :: contact
    type(budget_t), intent(inout) :: budget
    integer :: at(nlane), body, n, p
    real(rp) :: packed(nlane)

    if (scene%layout%drag == 0) return
    n = 0
    body = 0
    do p = 1, contact%n
      associate (t => contact%particle(p))
        if (.not. t%can_flow) cycle
        if (n == nlane .or. (n > 0 .and. particles%body(t%block) /= body)) then
          call pack_particles(scene, contact, body, n, at, packed, particles, budget)
          n = 0
        end if
        body = particles%body(t%block)
        n = n + 1
        at(n) = p
        packed(n) = packing_of(contact, t)
        if (packed(n) > 0.0_rp) packed(n) = packed(n)*fullness(t%void)
      end associate
    end do
    if (n > 0) call pack_particles(scene, contact, body, n, at, packed, particles, budget)
  end subroutine pack_layer

  !> Fraction by which the metal of a particle is packed in the step.
  pure real(rp) function packing_of(contact, t) result(packing)
    type(tool_contact_t), intent(in) :: contact
    type(contact_particle_t), intent(in) :: t
    integer :: c, i, j, k

    packing = 0.0_rp
    c = 0
    do i = 1, 3
      do j = 1, 3
        do k = 1, 3
          c = c + 1
          if (t%entry(c) == 0) cycle
          associate (values => contact%values(:, t%entry(c)), w => t%w_centre)
            packing = packing + w(i, 1)*w(j, 2)*w(k, 3)*values(v_carried) &
                      /max(values(v_mass), tiny(1.0_rp))
          end associate
        end do
      end do
    end do
  end function packing_of

  !> Reduce the volume ratios of `n` particles in contact, at the positions `at` of their list.
  subroutine pack_particles(scene, contact, body, n, at, packed, particles, budget)
    type(scene_t), intent(in) :: scene
    type(tool_contact_t), intent(in) :: contact
    integer, intent(in) :: body, n, at(nlane)
    real(rp), intent(in) :: packed(nlane)
    type(particles_t), intent(inout) :: particles
    type(budget_t), intent(inout) :: budget
    real(rp) :: after(nlane), b(nlane, 6), before(nlane), energy(nlane), mass(nlane)
    real(rp) :: tau(nlane, 6), temp(nlane)
    integer :: i

    mass = 0.0_rp
    temp = 1.0_rp
    before = 1.0_rp
    tau = 0.0_rp
    b = 0.0_rp
    b(:, 1:3) = 1.0_rp
    do i = 1, n
      associate (t => contact%particle(at(i)))
        associate (ps => particles%ps(t%lane, :, t%block))
          mass(i) = ps(f_mass)
          temp(i) = ps(f_temp)
          before(i) = ps(f_jac)
          tau(i, :) = ps(f_tau:f_tau + 5)
          b(i, :) = ps(f_bbar:f_bbar + 5)
        end associate
      end associate
    end do
    after = before
    after(:n) = before(:n)*exp(-packed(:n))
    associate (material => scene%material(scene%body(body)%material))
      call material%change_volume(n, mass, temp, b, before, after, tau, energy)
    end associate
    do i = 1, n
      associate (t => contact%particle(at(i)))
        associate (ps => particles%ps(t%lane, :, t%block))
          ps(f_jac) = after(i)
          ps(f_tau:f_tau + 5) = tau(i, :)
        end associate
      end associate
    end do
    budget%sums(e_stress) = budget%sums(e_stress) + sum(energy(:n))
  end subroutine pack_particles

  !> Find the velocities at which the layer carries the particles in contact: their displacements at
  !> the end of the step, and what the next step packs.
  subroutine find_drag(drag, particles, contact, rigid, dt)
    integer, intent(in) :: drag                !! field of the particles; 0: none
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(inout) :: contact
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: dt     !! time step [s]
    real(rp) :: part, slip, velocity(3)
    integer :: p

    if (drag == 0) return
    do p = 1, contact%n
      associate (t => contact%particle(p))
        slip = norm2(t%slip)
        velocity = 0.0_rp
        if (slip > 0.0_rp .and. t%layer_strength > 0.0_rp) then
          part = t%excess_velocity/slip*min(1.0_rp, t%normal_impulse/t%layer_strength) &
                 *fullness(t%void) &
                 *curved_part(t, rigid, particles%ps(t%lane, f_pos:f_pos + 2, t%block))
          velocity = -t%slip + 0.5_rp*part*dt*(rigid%velocity_at(rigid%centre - t%slip) &
                                               - rigid%velocity)
          velocity = part*velocity
          call contact%add_drag(drag_t(t%block, t%lane, dt*velocity))
        end if
        particles%ps(t%lane, drag:drag + 2, t%block) = velocity
      end associate
    end do
  end subroutine find_drag

  !> 1 where metal fills its room but for the disorder of particles, 0 where as much again is empty.
  elemental real(rp) function fullness(void)
    real(rp), intent(in) :: void               !! empty part of the room beyond disorder

    fullness = max(0.0_rp, 1.0_rp - max(0.0_rp, void)/disorder)
  end function fullness

  !> Mean velocity of the layer under the face of a turning tool over that under a plane face. At
  !> the distance z from a pin of radius r the shear stress is less by 2 z/r, and the shear rate,
  !> with the rate sensitivity S of the stress, by the factor exp(-2 z/(r S)).
  pure real(rp) function curved_part(t, rigid, x) result(part)
    type(contact_particle_t), intent(in) :: t
    type(rigid_t), intent(in) :: rigid
    real(rp), intent(in) :: x(3)               !! position of the particle [m]
    real(rp) :: axis(3), from_axis(3), y

    part = 1.0_rp
    if (norm2(rigid%omega) <= 0.0_rp) return
    axis = rigid%omega/norm2(rigid%omega)
    from_axis = x - rigid%centre
    from_axis = from_axis - dot_product(from_axis, axis)*axis
    y = dot_product(from_axis, t%normal)/max(tiny(1.0_rp), sum(from_axis**2))   ! curvature [1/m]
    y = 2.0_rp*t%layer_depth*y/t%rate_sensitivity
    if (y > 0.01_rp) part = 2.0_rp*(1.0_rp/y - 1.0_rp/(exp(min(y, 500.0_rp)) - 1.0_rp))
  end function curved_part

  !> Move the particles by what their layers carry them in the step, not through walls.
  subroutine carry_metal(scene, particles, contact, dt, outcome)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(tool_contact_t), intent(inout) :: contact
    real(rp), intent(in) :: dt                  !! time step [s]
    type(outcome_t), intent(inout) :: outcome
    real(rp) :: spacing(3), step(3)
    integer :: i, k

    do i = 1, contact%n_dragged
      associate (drag => contact%drag(i))
        step = drag%step
        spacing = scene%spacing_of(particles%body(drag%block), &
                                       particles%ps(drag%lane, :, drag%block))
        associate (x => particles%ps(drag%lane, f_pos:f_pos + 2, drag%block))
          do k = 1, size(scene%wall)
            call stop_at_wall(scene%wall(k), x, spacing, step)
          end do
          x = x + step
        end associate
        outcome%speed2 = max(outcome%speed2, (norm2(step)/dt)**2)
      end associate
    end do
    contact%n_dragged = 0
  end subroutine carry_metal

end module contact_tool_drag
