! SPDX-License-Identifier: MIT
!> What limits the impulses of particles that touch a tool: the strength of the material and
!> Coulomb's law.
module tool_contact_limits
  use base_kinds, only: nlane, pi, rp
  use contact_friction_law, only: friction_law_t, law_coulomb
  use contact_friction_table, only: friction_table_t, of_nothing
  use contact_tool, only: tool_t
  use particles_store, only: f_jac, f_plastic, f_rate, f_tau, f_temp
  use state_scene, only: scene_t
  use tool_contact_lists, only: candidates_t, contact_particle_t
  use tool_contact_shear_layer, only: find_shear_layer, shear_layer_t
  implicit none (type, external)
  private

  public :: limit_impulses

  real(rp), parameter :: unlimited = 1.0e30_rp     !! of what cannot flow [N s]
  real(rp), parameter :: molten = 1.0e-30_rp       !! of what has no strength [N s]
  real(rp), parameter :: least_sensitivity = 1.0e-3_rp   !! of stress to the logarithm of the rate
  real(rp), parameter :: edge_pressure = 2.0_rp + pi   !! of flowing metal at an edge, over its
                                                       !! shear strength

contains

  !> What limits the impulses of the touching particles, which have their `place` among the
  !> candidates: along the surface what the tool's law of friction makes of the strength of the
  !> layer that shears, with a coefficient that may depend on the state; across it at an edge, for
  !> the part of the face that is pushed, the pressure under the edge of a punch (Prandtl 1920,
  !> plane; Shield 1955, round).
  subroutine limit_impulses(scene, tool, dt, near, n, place, particle)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: dt
    type(candidates_t), intent(in) :: near
    integer, intent(in) :: n, place(n)
    type(contact_particle_t), intent(inout) :: particle(n)
    real(rp) :: coefficient(n)

    if (n == 0) return
    coefficient = tool%friction_law%coefficient
    if (tool%friction_table%of /= of_nothing) then
      coefficient = look_up_friction(tool%friction_table, near%n, scene%layout%n, near%ps, n, &
                                     place, particle)
      if (tool%friction_law%kind == law_coulomb) particle%friction = coefficient
    end if
    particle%shear = unlimited
    particle%bend = unlimited
    particle%most = unlimited
    if (particle(1)%can_flow) call limit_by_strength(scene, tool%friction_law, coefficient, dt, &
                                                     near, n, place, particle)
  end subroutine limit_impulses

  !> What the strength of the material lets each touching particle take: along the surface by the
  !> law of friction (nothing when it is molten), and at edges across it.
  subroutine limit_by_strength(scene, law, coefficient, dt, near, n, place, particle)
    type(scene_t), intent(in) :: scene
    type(friction_law_t), intent(in) :: law
    integer, intent(in) :: n, place(n)
    real(rp), intent(in) :: coefficient(n), dt
    type(candidates_t), intent(in) :: near
    type(contact_particle_t), intent(inout) :: particle(n)
    real(rp) :: depth(nlane), face, shear, v(nlane)
    type(shear_layer_t) :: layer
    integer :: i

    associate (body => scene%body(near%body), layout => scene%layout)
      v = 0.0_rp
      depth = 1.0_rp
      do i = 1, n
        depth(place(i)) = particle(i)%half
        v(place(i)) = norm2(particle(i)%slip) &
                      + sqrt(3.0_rp)*near%ps(place(i), f_rate)*particle(i)%half
      end do
      call find_shear_layer(scene%material(body%material), near%n, near%ps(:, f_plastic), &
                            near%ps(:, f_temp), layout%n_law, &
                            near%ps(:, layout%law:layout%law + layout%n_law - 1), depth, v, layer)
      do i = 1, n
        associate (t => particle(i), strength => layer%stress(place(i)))
          face = product(body%spacing)/norm2(t%normal*body%spacing)
          shear = dt*face*max(0.0_rp, strength)
          if (t%pushed < 1.0_rp) t%most = t%pushed*edge_pressure*shear
          call law%limits(coefficient(i), max(molten, shear), t%friction, t%shear, t%bend)
          if (law%is_unlimited() .and. shear > 0.0_rp) t%shear = unlimited
          if (t%shear >= unlimited .or. shear <= 0.0_rp) cycle
          t%depth = depth(place(i))
          t%log_rate = log(layer%inner_rate(place(i)))
          t%strength = shear
          t%sensitivity = max(least_sensitivity, layer%sensitivity(place(i))/strength)
          t%resolved_rate = near%ps(place(i), f_rate)
        end associate
      end do
    end associate
  end subroutine limit_by_strength

  !> Coefficients of friction of the touching ones of `n` candidates, from their temperature, the
  !> pressure on the tool's surface in the body, or the speed of sliding.
  pure function look_up_friction(table, n, nf, ps, n_particles, place, particle) result(found)
    type(friction_table_t), intent(in) :: table
    integer, intent(in) :: n, nf, n_particles, place(n_particles)
    real(rp), intent(in) :: ps(nlane, nf)
    type(contact_particle_t), intent(in) :: particle(n_particles)
    real(rp) :: found(n_particles)
    real(rp), dimension(nlane) :: mu, pressure, slip
    integer :: i, p

    pressure = 0.0_rp
    slip = 0.0_rp
    do i = 1, n_particles
      p = place(i)
      associate (a => particle(i)%normal, tau => ps(p, f_tau:f_tau + 5))
        pressure(p) = max(0.0_rp, -(sum(a**2*tau(1:3)) + 2.0_rp*(a(1)*a(2)*tau(4) &
                          + a(2)*a(3)*tau(5) + a(1)*a(3)*tau(6)))/ps(p, f_jac))
        slip(p) = norm2(particle(i)%slip)
      end associate
    end do
    call table%coefficients(n, ps(1, f_temp), pressure, slip, mu)
    found = mu(place)
  end function look_up_friction

end module tool_contact_limits
