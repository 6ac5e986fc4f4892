! SPDX-License-Identifier: MIT
!> Bodies with a prescribed field: initial state, body force and its work.
module mpm_prescribed
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: max_half, min_half
  use particles_block, only: block_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_tau, f_temp, f_vel, layout_t, &
                             particles_t
  use physics_field, only: field_t
  use physics_material, only: material_t
  use physics_stress, only: compute_elastic_stress
  use state_budget, only: budget_t, e_body
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_musl, scheme_usl
  implicit none (type, external)
  private

  public :: start_fields, stagger_velocities, velocity_time, add_prescribed_force
  public :: compute_elastic_state, record_prescribed_work

contains

  !> Set undeformed particles on the lattice to the state of the field of their body at t = 0; the
  !> velocity of the field is added to that of the particles.
  subroutine start_fields(scene, particles)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    integer :: b

    do b = 1, particles%nblk
      associate (body => scene%body(particles%body(b)))
        if (.not. allocated(body%field)) cycle
        call start_block(body%field, scene%material(body%material), scene%layout, &
                         particles%count(b), particles%nf, particles%ps(:, :, b))
      end associate
    end do
  end subroutine start_fields

  subroutine start_block(field, material, layout, n, nf, ps)
    class(field_t), intent(in) :: field
    type(material_t), intent(in) :: material
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: n, nf
    real(rp), intent(inout) :: ps(nlane, nf)
    real(rp) :: v(nlane, 3), f(nlane, 9)
    integer :: a

    if (field%has_temperature) then
      call field%temperature(0.0_rp, ps(1, layout%origin), ps(1, f_temp))
    end if
    if (.not. field%has_motion) return
    call field%motion(0.0_rp, ps(1, layout%origin), ps(1, f_pos), v, f)
    ps(:, f_vel:f_vel + 2) = ps(:, f_vel:f_vel + 2) + v
    call compute_elastic_state(material, n, f, ps(1, f_temp), ps(1, f_bbar), ps(1, f_jac), &
                               ps(1, f_tau))
    if (layout%half == 0) return
    do a = 1, 3
      associate (half => ps(:, layout%half + a - 1))
        half = max(min_half, min(max_half, half*f(:, 4*a - 3)))
      end associate
    end do
  end subroutine start_block

  !> Elastic state of a block with the deformation gradient `f`, and its stress.
  subroutine compute_elastic_state(material, n, f, temp, bbar, jac, tau)
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp), intent(in) :: f(nlane, 9)            !! F row by row
    real(rp), intent(in) :: temp(nlane)            !! temperatures [K]
    real(rp), intent(out) :: bbar(nlane, 6), jac(nlane)
    real(rp), intent(out) :: tau(nlane, 6)         !! Kirchhoff stress [Pa]
    real(rp) :: unused
    integer, parameter :: row(6) = [0, 3, 6, 0, 3, 0], column(6) = [0, 3, 6, 3, 6, 6]
    integer :: c

    jac = f(:, 1)*(f(:, 5)*f(:, 9) - f(:, 6)*f(:, 8)) &
          - f(:, 2)*(f(:, 4)*f(:, 9) - f(:, 6)*f(:, 7)) &
          + f(:, 3)*(f(:, 4)*f(:, 8) - f(:, 5)*f(:, 7))
    do c = 1, 6
      bbar(:, c) = (f(:, row(c) + 1)*f(:, column(c) + 1) + f(:, row(c) + 2)*f(:, column(c) + 2) &
                    + f(:, row(c) + 3)*f(:, column(c) + 3))*jac**(-2.0_rp/3.0_rp)
    end do
    call compute_elastic_stress(material, n, temp, bbar, jac, tau, unused)
  end subroutine compute_elastic_state

  !> Shift the velocities of USL and MUSL, which belong to mid-step times, back from t = 0 by half
  !> of `dt`, and set the velocity gradients of the affine transfer to those of that time.
  subroutine stagger_velocities(scene, clock, particles, dt)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(inout) :: clock
    type(particles_t), intent(inout) :: particles
    real(rp), intent(in) :: dt                     !! first time step [s]
    integer :: b

    do b = 1, particles%nblk
      associate (body => scene%body(particles%body(b)))
        if (.not. allocated(body%field)) cycle
        if (.not. body%field%has_motion) cycle
        clock%dt = dt
        call stagger_block(body%field, velocity_time(scene, clock), dt, scene%layout, &
                           particles%nf, particles%ps(:, :, b))
      end associate
    end do
  end subroutine stagger_velocities

  subroutine stagger_block(field, t, dt, layout, nf, ps)
    class(field_t), intent(in) :: field
    real(rp), intent(in) :: t, dt
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: nf
    real(rp), intent(inout) :: ps(nlane, nf)
    real(rp), dimension(nlane, 3) :: x, start, early
    real(rp), dimension(nlane, 9) :: f, before, after
    real(rp) :: d

    call field%motion(0.0_rp, ps(1, layout%origin), x, start, f)
    call field%motion(t, ps(1, layout%origin), x, early, f)
    ps(:, f_vel:f_vel + 2) = ps(:, f_vel:f_vel + 2) + early - start
    if (layout%affine == 0) return
    d = 0.01_rp*dt
    call field%motion(t - d, ps(1, layout%origin), x, start, before)
    call field%motion(t + d, ps(1, layout%origin), x, early, after)
    call compute_velocity_gradient(f, (after - before)/(2.0_rp*d), ps(1, layout%affine))
  end subroutine stagger_block

  !> Velocity gradient L from dF/dt = L F.
  pure subroutine compute_velocity_gradient(f, rate, l)
    real(rp), intent(in) :: f(nlane, 9), rate(nlane, 9)   !! F [-] and dF/dt [1/s], row by row
    real(rp), intent(out) :: l(nlane, 9)                  !! velocity gradient, row by row [1/s]
    real(rp) :: a(3, 3), inverse(3, 3)
    integer :: p

    do p = 1, nlane
      a = reshape(f(p, :), [3, 3])               ! F^T, as its columns are the rows of F
      inverse(1, :) = cross(a(:, 2), a(:, 3))
      inverse(2, :) = cross(a(:, 3), a(:, 1))
      inverse(3, :) = cross(a(:, 1), a(:, 2))
      inverse = inverse/dot_product(inverse(1, :), a(:, 1))
      l(p, :) = reshape(matmul(inverse, reshape(rate(p, :), [3, 3])), [9])
    end do
  end subroutine compute_velocity_gradient

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Time at which particle velocities are defined [s].
  pure real(rp) function velocity_time(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    velocity_time = clock%time
    if (any(scene%method%scheme == [scheme_usl, scheme_musl])) then
      velocity_time = clock%time - 0.5_rp*clock%dt
    end if
  end function velocity_time

  !> Add the body force of a block's field to its records.
  subroutine add_prescribed_force(scene, clock, block, rec)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(block_t), intent(in) :: block
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp) :: b(nlane, 3)
    integer :: p

    associate (origin => scene%layout%origin)
      call scene%body(block%body)%field%force(clock%now%force_time, &
                                              block%ps(:, origin:origin + 2), b)
    end associate
    do p = 1, nlane
      rec(5:7, 1, p) = rec(5:7, 1, p) + block%ps(p, f_mass)*b(p, :)
    end do
  end subroutine add_prescribed_force

  !> Record the work of the prescribed body force in a step, with the mean grid velocity `v` -
  !> `dv`/2.
  subroutine record_prescribed_work(scene, clock, budget, block, dt, v, dv)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(budget_t), intent(inout) :: budget
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: dt, v(nlane, 3), dv(nlane, 3)
    real(rp) :: b(nlane, 3)
    integer :: p

    associate (origin => scene%layout%origin)
      call scene%body(block%body)%field%force(clock%now%force_time, &
                                              block%ps(:, origin:origin + 2), b)
    end associate
    do p = 1, block%n
      budget%sums(e_body) = budget%sums(e_body) &
        + dt*block%ps(p, f_mass)*dot_product(b(p, :), v(p, :) - 0.5_rp*dv(p, :))
    end do
  end subroutine record_prescribed_work

end module mpm_prescribed
