! SPDX-License-Identifier: MIT
!> What a step does with one block of particles, and how bodies with fields start, with drawn
!> numbers against plain formulas.
program test_blocks
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_value
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use mpm_blocks, only: advance_particles, body_work, force_records, kinetic_energy, max_half, &
                        min_half, momentum_records, stretch_domains
  use mpm_constitutive, only: crush_voids
  use mpm_prescribed, only: start_fields
  use particles_block, only: block_t
  use particles_store, only: f_bbar, f_flow, f_jac, f_mass, f_pos, f_rate, f_tau, f_temp, f_vel, &
                             n_fields, particles_t
  use physics_field_waves, only: waves_t
  use state_budget, only: budget_t, e_plastic, e_stress
  use state_scene, only: scene_t
  implicit none (type, external)

  integer, parameter :: n = nlane - 1          !! the last lane is not in use
  real(rp), dimension(nlane, 3) :: v, vg, dv, x
  real(rp) :: mass(nlane), temperature(nlane), a(3)

  call begin_tests()
  call random_init(.true., .false.)
  call draw(v, 5.0_rp)
  call draw(vg, 3.0_rp)
  call draw(dv, 2.0_rp)
  call draw(x, 1.0_rp)
  call random_number(mass)
  mass = 0.1_rp + mass
  mass(nlane) = 0.0_rp
  call random_number(temperature)
  call random_number(a)
  call test_advance()
  call test_domains()
  call test_energies()
  call test_records()
  call test_fields()
  call test_compaction()
  call end_tests()

contains

  !> Numbers between -most and most.
  subroutine draw(y, most)
    real(rp), intent(out) :: y(:, :)
    real(rp), intent(in) :: most

    call random_number(y)
    y = most*(2.0_rp*y - 1.0_rp)
  end subroutine draw

  !> x + dt v_g, (1 - c)(v + dv) + c v_g, and the largest |v_g|^2 of the particles and of before; a
  !> velocity without bound makes that huge.
  subroutine test_advance()
    real(rp), parameter :: dt = 0.3_rp, pic(3) = [0.0_rp, 0.2_rp, 1.0_rp]
    real(rp), dimension(nlane, 3) :: to, w, fast
    real(rp) :: speed2
    integer :: k

    do k = 1, 3
      fast = vg
      fast(nlane, :) = 100.0_rp
      to = x
      w = v
      speed2 = 0.0_rp
      call advance_particles(n, dt, pic(k), fast, dv, to, w, speed2)
      call expect_close('place', maxval(abs(to - x - dt*fast)), 0.0_rp, atol=1.0e-13_rp)
      call expect_close('velocity', maxval(abs(w - (1.0_rp - pic(k))*(v + dv) - pic(k)*fast)), &
                        0.0_rp, atol=1.0e-13_rp)
      call expect_close('largest speed', speed2, maxval(sum(vg(:n, :)**2, dim=2)))
    end do
    speed2 = 1.0e4_rp
    call advance_particles(n, dt, pic(1), fast, dv, to, w, speed2)
    call expect_close('largest speed of blocks before', speed2, 1.0e4_rp)
    fast(2, 3) = ieee_value(1.0_rp, ieee_positive_inf)
    call advance_particles(n, dt, pic(3), fast, dv, to, w, speed2)
    call expect_close('a speed without bound', speed2, huge(1.0_rp), atol=0.0_rp)
  end subroutine test_advance

  !> l' = l exp(dt L_aa) within limits.
  subroutine test_domains()
    real(rp), parameter :: dt = 0.3_rp
    real(rp) :: l(nlane, 9), half(nlane, 3), before(nlane, 3)
    integer :: i

    call draw(l, 5.0_rp)
    call random_number(before)
    before = min_half + (max_half - min_half)*before
    half = before
    call stretch_domains(dt, l, half)
    do i = 1, 3
      before(:, i) = min(max_half, max(min_half, before(:, i)*exp(dt*l(:, 4*i - 3))))
    end do
    call expect_close('domains', maxval(abs(half - before)), 0.0_rp, atol=1.0e-13_rp)
  end subroutine test_domains

  !> m v^2/2, and the work of a body force at the mean velocity of the step.
  subroutine test_energies()
    real(rp), parameter :: dt = 0.3_rp
    real(rp) :: work
    integer :: p

    call expect_close('kinetic energy', kinetic_energy(mass, v), 0.5_rp*sum(mass*sum(v**2, dim=2)))
    work = 0.0_rp
    do p = 1, n
      work = work + dt*mass(p)*sum(a*(vg(p, :) - 0.5_rp*dv(p, :)))
    end do
    call expect_close('work', body_work(n, dt, a, mass, vg, dv), work, atol=1.0e-13_rp)
  end subroutine test_energies

  !> Mass, momentum and heat with mass scaling, body force without, internal force -V tau.
  subroutine test_records()
    real(rp), parameter :: inertia = 7.0_rp, volume = 0.4_rp
    integer, parameter :: of(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
    real(rp) :: rec(8, 4, nlane), plain(8, 4, nlane), want(8, 4, nlane), tau(nlane, 6)
    integer :: p

    call draw(tau, 10.0_rp)
    want = 0.0_rp
    do p = 1, nlane
      want(1, 1, p) = inertia*mass(p)
      want(2:4, 1, p) = inertia*mass(p)*v(p, :)
    end do
    call momentum_records(inertia, mass, v, plain)
    call expect_close('records of momentum', maxval(abs(plain(1:4, 1, :) - want(1:4, 1, :))), &
                      0.0_rp, atol=1.0e-13_rp)
    do p = 1, nlane
      want(8, 1, p) = inertia*mass(p)*temperature(p)
      want(5:7, 1, p) = mass(p)*a
      want(5:7, 2:4, p) = -volume*mass(p)*reshape(tau(p, reshape(of, [9])), [3, 3])
    end do
    rec = 0.0_rp
    call force_records(inertia, volume, a, mass, v, tau, temperature, rec)
    call expect_close('records of forces', maxval(abs(rec(:, 1, :) - want(:, 1, :))), 0.0_rp, &
                      atol=1.0e-13_rp)
    call expect_close('slopes of forces', maxval(abs(rec(5:7, 2:4, :) - want(5:7, 2:4, :))), &
                      0.0_rp, atol=1.0e-13_rp)
  end subroutine test_records

  !> Particles of the second body start on its field: places, velocities beside their own, domains
  !> stretched by F within limits, J and b; those of the first stay as they are.
  subroutine test_fields()
    type(scene_t) :: scene
    type(particles_t) :: particles
    type(waves_t) :: waves
    real(rp), parameter :: young = 3.0e7_rp, poisson = 0.25_rp
    real(rp), dimension(nlane, 3) :: x0, to, speed
    real(rp), dimension(nlane, n_fields + 6) :: before, rest
    real(rp) :: f(nlane, 9), a(3, 3), b(3, 3), j, worst(4)
    integer :: i, p

    waves%amplitude = [0.05_rp, -0.04_rp, 0.03_rp]
    waves%number = [6.0_rp, 3.0_rp, 5.0_rp]
    waves%shift = [0.0_rp, 1.0_rp, 2.0_rp]
    waves%phase = [0.3_rp, 2.0_rp, 4.0_rp]
    waves%rate = [3.0_rp, 4.0_rp, 5.0_rp]
    waves%has_motion = .true.
    allocate (scene%material(1), scene%body(2))
    call scene%material(1)%set_elastic(young, poisson)
    scene%body(:)%material = 1
    scene%layout%half = n_fields + 1
    scene%layout%origin = n_fields + 4
    allocate (scene%body(2)%field, source=waves)
    call particles%init(n_fields + 6)
    call particles%reserve(2)
    particles%nblk = 2
    particles%body(1:2) = [1, 2]
    particles%count(1:2) = nlane
    call random_number(particles%ps(:, :, 1:2))
    associate (half => particles%ps(:, n_fields + 1:n_fields + 3, 1:2))
      half = min_half + (max_half - min_half)*half
    end associate
    rest = particles%ps(:, :, 1)
    before = particles%ps(:, :, 2)
    x0 = before(:, n_fields + 4:)
    call start_fields(scene, particles)
    call expect_close('a body without a field', maxval(abs(particles%ps(:, :, 1) - rest)), 0.0_rp, &
                      atol=0.0_rp)
    call waves%motion(0.0_rp, x0, to, speed, f)
    worst = 0.0_rp
    associate (ps => particles%ps(:, :, 2), own => before(:, f_vel:f_vel + 2))
      worst(1) = maxval(abs(ps(:, f_pos:f_pos + 2) - to)) &
                 + maxval(abs(ps(:, f_vel:f_vel + 2) - own - speed))
      do p = 1, nlane
        a = transpose(reshape(f(p, :), [3, 3]))
        j = a(1, 1)*a(2, 2)*a(3, 3)              ! waves along the axes
        b = matmul(a, transpose(a))
        worst(2) = max(worst(2), abs(ps(p, f_jac) - j))
        b = b*j**(-2.0_rp/3.0_rp)
        worst(3) = max(worst(3), maxval(abs(ps(p, f_bbar:f_bbar + 5) - [b(1, 1), b(2, 2), &
                                                        b(3, 3), b(1, 2), b(2, 3), b(1, 3)])))
        do i = 1, 3
          worst(4) = max(worst(4), abs(ps(p, n_fields + i) &
            - max(min_half, min(max_half, before(p, n_fields + i)*a(i, i)))))
        end do
      end do
      call expect_close('places and velocities of a field', worst(1), 0.0_rp, atol=1.0e-13_rp)
      call expect_close('its J', worst(2), 0.0_rp, atol=1.0e-13_rp)
      call expect_close('its elastic state', worst(3), 0.0_rp, atol=1.0e-13_rp)
      call expect_close('its domains', worst(4), 0.0_rp, atol=1.0e-13_rp)
    end associate
    call particles%free()
  end subroutine test_fields

  !> Porous metal that shears under pressure: dp = -K 3/2 f sinh(3p/2Y) de (Gurson 1977), integrated
  !> with the midpoint rule; whole metal and metal at rest keep their pressure. Plastic
  !> work is the elastic energy that is lost.
  subroutine test_compaction()
    integer, parameter :: steps = 2000, fine = 2000
    real(rp), parameter :: modulus = 70.0e9_rp, dt = 3.5e-7_rp
    type(scene_t) :: scene
    type(budget_t) :: budget
    type(block_t) :: block
    real(rp), target :: ps(nlane, n_fields + 2)
    real(rp) :: c, exact(nlane), half, p0(nlane), worst(2)
    integer :: i, k

    allocate (scene%material(1), scene%body(1))
    scene%body(1)%material = 1
    block%body = 1
    block%n = n
    block%ps => ps
    call scene%material(1)%set_elastic(modulus, 1.0_rp/3.0_rp)       ! K = E
    scene%layout%void = n_fields + 1
    scene%layout%porosity = n_fields + 2
    call random_number(ps)
    ps(:, f_flow) = 20.0e6_rp + 80.0e6_rp*ps(:, f_flow)
    p0 = (0.1_rp + 2.0_rp*ps(:, f_tau))*ps(:, f_flow)
    ps(:, f_jac) = sqrt(1.0_rp - 2.0_rp*p0/modulus)
    ps(:, f_tau:f_tau + 5) = 0.0_rp
    do k = 0, 2
      ps(:, f_tau + k) = -p0
    end do
    ps(:, f_temp) = 700.0_rp
    ps(:, f_rate) = 30.0_rp*ps(:, f_rate)
    ps(:, n_fields + 1) = 0.0_rp
    ps(:, n_fields + 2) = 0.1_rp*ps(:, n_fields + 2)
    ps(1, f_rate) = 0.0_rp
    ps(2, n_fields + 2) = 0.0_rp
    do k = 1, steps
      call crush_voids(scene, budget, dt, block)
    end do
    exact = p0/ps(:, f_flow)
    do i = 1, n
      c = 1.5_rp*modulus*ps(i, n_fields + 2)*ps(i, f_rate)*dt*steps/(fine*ps(i, f_flow))
      do k = 1, fine
        half = exact(i) - 0.5_rp*fall(exact(i), c)
        exact(i) = exact(i) - fall(half, c)
      end do
    end do
    exact = exact*ps(:, f_flow)
    worst(1) = maxval(abs(ps(:n, f_tau) + exact(:n))/p0(:n))
    worst(2) = abs(budget%sums(e_plastic) + 0.5_rp*sum(ps(:n, f_mass)/scene%material(1)%rho &
                   *(exact(:n)**2 - p0(:n)**2)/modulus))/budget%sums(e_plastic)
    call expect_close('pressure of porous metal that shears', worst(1), 0.0_rp, atol=0.01_rp)
    call expect_close('of metal at rest and of whole metal', &
                      maxval(abs(-ps(1:2, f_tau) - p0(1:2))/p0(1:2)), 0.0_rp, atol=1.0e-14_rp)
    call expect_close('its plastic work', worst(2), 0.0_rp, atol=0.01_rp)
    call expect_close('work less elastic energy', budget%sums(e_stress)/budget%sums(e_plastic), &
                      0.0_rp, atol=0.01_rp)
    ps(:n, n_fields + 2) = 1.0e-30_rp
    ps(:n, f_rate) = 1.0e-6_rp
    ps(:n, f_jac) = 1.0_rp
    do k = 0, 2
      ps(:n, f_tau + k) = -100.0_rp*ps(:n, f_flow)
    end do
    call crush_voids(scene, budget, dt, block)
    call expect('pressure far above the strength, hardly any strain', &
                all(ps(:n, f_tau) < -20.0_rp*ps(:n, f_flow)) .and. all(ps(:n, f_jac) < 2.0_rp))
  end subroutine test_compaction

  !> Fall of the pressure `p` in a small step in units of Y, c = K 3/2 f de/Y.
  pure real(rp) function fall(p, c)
    real(rp), intent(in) :: p, c

    fall = c*sinh(1.5_rp*p)
  end function fall

end program test_blocks
