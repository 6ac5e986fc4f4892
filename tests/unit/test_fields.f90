! SPDX-License-Identifier: MIT
!> Known fields against numerical derivatives: F of places, v and acceleration of time, body force
!> of the divergence of P; the printed formulas of the literature; noise.
program test_fields
  use base_kinds, only: nlane, pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_field, only: field_t
  use physics_field_heat_mode, only: heat_mode_t
  use physics_field_ring, only: ring_t
  use physics_field_vortex, only: vortex_t
  use physics_field_waves, only: waves_t
  use physics_noise, only: noise_t
  implicit none (type, external)

  ! Weights of fourth-order central differences over four neighbours.
  real(rp), parameter :: away(4) = [-2.0_rp, -1.0_rp, 1.0_rp, 2.0_rp]
  real(rp), parameter :: weight(4) = [1.0_rp, -8.0_rp, 8.0_rp, -1.0_rp]/12.0_rp
  type(waves_t) :: waves, mode
  type(vortex_t) :: vortex
  type(ring_t) :: ring

  call begin_tests()
  waves%amplitude = [0.05_rp, -0.04_rp, 0.03_rp]
  waves%number = [2.0_rp*pi, pi, 1.5_rp*pi]
  waves%shift = [0.0_rp, 1.0_rp, 2.0_rp]
  waves%phase = [0.3_rp, 2.0_rp, 4.0_rp]
  waves%rate = [3.0_rp, 4.0_rp, 5.0_rp]
  waves%mu = 4.0_rp
  waves%lambda = 6.0_rp
  call test_motion('waves', waves, 0.0_rp, 1.0_rp)
  call test_force('waves', waves, 0.0_rp, 1.0_rp, 4.0_rp, 6.0_rp)

  vortex%centre = [0.2_rp, -0.1_rp]
  vortex%radii = [0.7_rp, 1.3_rp]
  vortex%amplitude = 0.8_rp
  vortex%rate = 2.5_rp
  vortex%mu = 0.4_rp
  call test_motion('vortex', vortex, 0.75_rp, 1.25_rp)
  call test_force('vortex', vortex, 0.75_rp, 1.25_rp, 0.4_rp, 0.6_rp)
  call test_still_outside()

  ring%centre = [0.2_rp, -0.1_rp]
  call ring%set_radii([0.4_rp, 0.6_rp])
  ring%amplitude = 0.05_rp
  ring%rate = 3.0_rp
  ring%mu = 5.0_rp
  call test_motion('ring', ring, 0.4_rp, 0.6_rp)
  call test_force('ring', ring, 0.4_rp, 0.6_rp, 5.0_rp, 0.0_rp)
  call test_free_ring()

  call test_printed_waves()
  call test_mode()
  call test_heat_mode()
  call test_noise()
  call end_tests()

contains

  !> Points about the axis of vortex and ring, from radius `low` to `high`, in all directions.
  subroutine points(low, high, x0)
    real(rp), intent(in) :: low, high
    real(rp), intent(out) :: x0(nlane, 3)
    real(rp) :: angle, r
    integer :: p

    do p = 1, nlane
      angle = 2.4_rp*p
      r = low + (high - low)*(p - 0.5_rp)/nlane
      x0(p, :) = [0.2_rp + r*cos(angle), -0.1_rp + r*sin(angle), 0.03_rp*p]
    end do
  end subroutine points

  !> F = dx/dX, v = dx/dt (fourth order: to 1e-9), motion or rest.
  subroutine test_motion(name, field, low, high)
    character(*), intent(in) :: name
    class(field_t), intent(in) :: field
    real(rp), intent(in) :: low, high
    real(rp), parameter :: t = 0.37_rp, h = 3.0e-4_rp
    real(rp), dimension(nlane, 3) :: x0, x1, x, v, unused
    real(rp) :: f(nlane, 9), numerical(nlane, 9), speed(nlane, 3), other(nlane, 9)
    integer :: i, j, k

    call points(low, high, x0)
    call field%motion(t, x0, x, v, f)
    numerical = 0.0_rp
    speed = 0.0_rp
    do k = 1, 4
      do j = 1, 3
        x1 = x0
        x1(:, j) = x1(:, j) + away(k)*h
        call field%motion(t, x1, x, unused, other)
        do i = 1, 3
          numerical(:, 3*i + j - 3) = numerical(:, 3*i + j - 3) + weight(k)/h*x(:, i)
        end do
      end do
      call field%motion(t + away(k)*h, x0, x, unused, other)
      speed = speed + weight(k)/h*x
    end do
    call expect(name//': moves', maxval(abs(v)) > 0.01_rp)
    call expect(name//': deforms', maxval(abs(f)) > 1.03_rp)
    call expect_close(name//': F', maxval(abs(f - numerical)), 0.0_rp, atol=1.0e-9_rp)
    call expect_close(name//': v', maxval(abs(v - speed)), 0.0_rp, atol=1.0e-9_rp)
  end subroutine test_motion

  !> b = a - Div P/rho with P = mu (F - F^-T) + lambda ln J F^-T, moduli over density (to 1e-7 of
  !> the largest).
  subroutine test_force(name, field, low, high, mu, lambda)
    character(*), intent(in) :: name
    class(field_t), intent(in) :: field
    real(rp), intent(in) :: low, high, mu, lambda
    real(rp), parameter :: t = 0.37_rp, h = 3.0e-4_rp
    real(rp), dimension(nlane, 3) :: x0, x1, x, v, b, expected
    real(rp) :: f(nlane, 9), p(3, 3)
    integer :: i, j, k, lane

    call points(low, high, x0)
    call field%force(t, x0, b)
    expected = 0.0_rp
    do k = 1, 4
      call field%motion(t + away(k)*h, x0, x, v, f)
      expected = expected + weight(k)/h*v
      do j = 1, 3
        x1 = x0
        x1(:, j) = x1(:, j) + away(k)*h
        call field%motion(t, x1, x, v, f)
        do lane = 1, nlane
          p = first_stress(f(lane, :), mu, lambda)
          do i = 1, 3
            expected(lane, i) = expected(lane, i) - weight(k)/h*p(i, j)
          end do
        end do
      end do
    end do
    call expect(name//': body force', maxval(abs(b)) > 0.1_rp)
    call expect_close(name//': body force is a - Div P', maxval(abs(b - expected))/maxval(abs(b)), &
                      0.0_rp, atol=1.0e-7_rp)
  end subroutine test_force

  !> First Piola-Kirchhoff stress of `f`, row by row.
  function first_stress(f, mu, lambda) result(p)
    real(rp), intent(in) :: f(9), mu, lambda
    real(rp) :: p(3, 3), a(3, 3), c(3, 3), j

    a = transpose(reshape(f, [3, 3]))
    c(:, 1) = cross(a(:, 2), a(:, 3))
    c(:, 2) = cross(a(:, 3), a(:, 1))
    c(:, 3) = cross(a(:, 1), a(:, 2))     ! J F^-T
    j = dot_product(a(:, 1), c(:, 1))
    p = mu*a + (lambda*log(j) - mu)*c/j
  end function first_stress

  function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Inside and outside the annulus, and on the axis, nothing moves and no force is needed.
  subroutine test_still_outside()
    real(rp) :: x0(nlane, 3), x(nlane, 3), v(nlane, 3), f(nlane, 9), b(nlane, 3)
    real(rp) :: unit(9), moved

    unit = [1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp]
    call points(0.0_rp, 0.69_rp, x0)
    x0(1, 1:2) = vortex%centre
    call vortex%motion(0.37_rp, x0, x, v, f)
    call vortex%force(0.37_rp, x0, b)
    moved = maxval(abs(x - x0)) + maxval(abs(v)) + maxval(abs(f - spread(unit, 1, nlane)))
    call expect_close('vortex: rest within', moved + maxval(abs(b)), 0.0_rp, atol=1.0e-14_rp)
    call points(1.31_rp, 2.0_rp, x0)
    call vortex%motion(0.37_rp, x0, x, v, f)
    call vortex%force(0.37_rp, x0, b)
    moved = maxval(abs(x - x0)) + maxval(abs(v)) + maxval(abs(f - spread(unit, 1, nlane)))
    call expect_close('vortex: rest outside', moved + maxval(abs(b)), 0.0_rp, atol=1.0e-14_rp)
  end subroutine test_still_outside

  !> The radial traction P N vanishes at both radii (nu = 0), and the outer one moves by A.
  subroutine test_free_ring()
    real(rp) :: x0(nlane, 3), x(nlane, 3), v(nlane, 3), f(nlane, 9), p(3, 3), normal(3)
    real(rp), parameter :: radii(2) = [0.4_rp, 0.6_rp]
    real(rp) :: worst
    integer :: k, lane

    worst = 0.0_rp
    do k = 1, 2
      call points(radii(k), radii(k), x0)
      call ring%motion(pi/6.0_rp, x0, x, v, f)
      do lane = 1, nlane
        p = first_stress(f(lane, :), 5.0_rp, 0.0_rp)
        normal = [x0(lane, 1) - 0.2_rp, x0(lane, 2) + 0.1_rp, 0.0_rp]/radii(k)
        worst = max(worst, maxval(abs(matmul(p, normal))))
      end do
    end do
    call expect_close('ring: free surfaces', worst, 0.0_rp, atol=1.0e-13_rp)
    call expect_close('ring: outer radius', norm2(x(1, 1:2) - ring%centre), 0.65_rp)
  end subroutine test_free_ring

  !> The printed forms: two-dimensional with k = 2 pi, three-dimensional with k = pi, w = pi c.
  subroutine test_printed_waves()
    type(waves_t) :: field
    real(rp), dimension(nlane, 3) :: x0, x, v, b, u, printed
    real(rp) :: f(nlane, 9), lnj(nlane), mu, lambda, rho, c, t
    integer :: a

    call points(0.0_rp, 1.0_rp, x0)
    rho = 1000.0_rp
    mu = 1.0e7_rp/2.6_rp
    lambda = 1.0e7_rp*0.3_rp/(1.3_rp*0.4_rp)
    c = 100.0_rp
    t = 0.003_rp
    field%amplitude = [0.05_rp, 0.05_rp, 0.0_rp]
    field%number = 2.0_rp*pi
    field%phase = [0.0_rp, pi, 0.0_rp]
    field%rate = c*pi
    field%mu = mu/rho
    field%lambda = lambda/rho
    call field%motion(t, x0, x, v, f)
    call field%force(t, x0, b)
    u = 0.0_rp
    u(:, 1) = 0.05_rp*sin(2.0_rp*pi*x0(:, 1))*sin(c*pi*t)
    u(:, 2) = 0.05_rp*sin(2.0_rp*pi*x0(:, 2))*sin(c*pi*t + pi)
    lnj = log((1.0_rp + 0.1_rp*pi*cos(2.0_rp*pi*x0(:, 1))*sin(c*pi*t)) &
              *(1.0_rp + 0.1_rp*pi*cos(2.0_rp*pi*x0(:, 2))*sin(c*pi*t + pi)))
    do a = 1, 3
      printed(:, a) = pi**2*u(:, a)*(4.0_rp*mu/rho - c**2 &
                                     - 4.0_rp*(lambda*(lnj - 1.0_rp) - mu)/(rho*f(:, 4*a - 3)**2))
    end do
    call expect_close('waves: displacement', maxval(abs(x - x0 - u)), 0.0_rp, atol=1.0e-15_rp)
    call expect_close('waves: two-dimensional force', maxval(abs(b - printed))/maxval(abs(b)), &
                      0.0_rp, atol=1.0e-12_rp)

    rho = 1.0_rp
    mu = 3846.15_rp
    lambda = 8333.33_rp - 2.0_rp/3.0_rp*mu
    c = sqrt(1.0e4_rp)
    field%amplitude = 0.05_rp
    field%number = pi
    field%phase = [0.0_rp, 2.0_rp, 4.0_rp]*pi/3.0_rp
    field%rate = c*pi
    field%mu = mu
    field%lambda = lambda
    call field%motion(t, x0, x, v, f)
    call field%force(t, x0, b)
    do a = 1, 3
      u(:, a) = 0.05_rp*sin(pi*x0(:, a))*sin(pi*c*t + 2.0_rp*(a - 1)*pi/3.0_rp)
    end do
    lnj = log(f(:, 1)*f(:, 5)*f(:, 9))
    do a = 1, 3
      printed(:, a) = pi**2*u(:, a)*(mu/rho - c**2 &
                                     - (lambda*(lnj - 1.0_rp) - mu)/(rho*f(:, 4*a - 3)**2))
    end do
    call expect_close('waves: three-dimensional displacement', maxval(abs(x - x0 - u)), 0.0_rp, &
                      atol=1.0e-15_rp)
    call expect_close('waves: three-dimensional force', maxval(abs(b - printed))/maxval(abs(b)), &
                      0.0_rp, atol=1.0e-12_rp)
  end subroutine test_printed_waves

  !> With w = k c, c^2 = (lambda + 2 mu)/rho, the body force is of second order in the amplitude.
  subroutine test_mode()
    real(rp), dimension(nlane, 3) :: x0, b
    real(rp) :: first(2)
    integer :: k

    call points(0.0_rp, 1.0_rp, x0)
    mode%number = 2.0_rp*pi
    mode%phase = [0.3_rp, 0.6_rp, 0.9_rp]
    mode%mu = 4.0_rp
    mode%lambda = 6.0_rp
    mode%rate = mode%number*sqrt(14.0_rp)
    do k = 1, 2
      mode%amplitude = 1.0e-4_rp*10.0_rp**(-k)
      call mode%force(0.37_rp, x0, b)
      first(k) = maxval(abs(b))/mode%rate(1)**2
    end do
    call expect_close('mode: forces of second order', first(1)/first(2), 100.0_rp, rtol=1.0e-3_rp)
  end subroutine test_mode

  !> dT/dt = kappa div grad T (to 1e-7 of it), and its largest value at the start.
  subroutine test_heat_mode()
    type(heat_mode_t) :: field
    real(rp), parameter :: h = 2.0e-3_rp
    real(rp), parameter :: second(0:4) = [-30.0_rp, -1.0_rp, 16.0_rp, 16.0_rp, -1.0_rp]
    real(rp), parameter :: off(0:4) = [0.0_rp, away], first(0:4) = [0.0_rp, weight]
    real(rp) :: x0(nlane, 3), x1(nlane, 3), temp(nlane), rate(nlane), flow(nlane)
    integer :: a, k

    field%mean = 300.0_rp
    field%amplitude = 20.0_rp
    field%takes_part = [.true., .false., .true.]
    field%number = [3.0_rp, 9.0_rp, 4.0_rp]
    field%shift = [0.5_rp*pi, 0.0_rp, 0.2_rp]
    field%diffusivity = 0.1_rp
    call points(0.0_rp, 1.0_rp, x0)
    rate = 0.0_rp
    flow = 0.0_rp
    do k = 0, 4
      call field%temperature(0.2_rp + off(k)*h, x0, temp)
      rate = rate + first(k)/h*temp
      do a = 1, 3
        x1 = x0
        x1(:, a) = x1(:, a) + off(k)*h
        call field%temperature(0.2_rp, x1, temp)
        flow = flow + 0.1_rp*second(k)/(12.0_rp*h**2)*temp
      end do
    end do
    call expect('heat mode: decays', maxval(abs(rate)) > 1.0_rp)
    call expect_close('heat mode: conduction', maxval(abs(rate - flow))/maxval(abs(rate)), 0.0_rp, &
                      atol=1.0e-7_rp)
    x0 = 0.0_rp
    x0(:, 3) = (0.5_rp*pi - 0.2_rp)/4.0_rp
    call field%temperature(0.0_rp, x0, temp)
    call expect_close('heat mode: amplitude', temp(1), 320.0_rp)
  end subroutine test_heat_mode

  !> Random velocities: within bounds, mean 0 and mean square A^2/3 to three standard deviations, no
  !> correlation of neighbours or components, another seed another draw; alternating: by formula.
  subroutine test_noise()
    type(noise_t) :: noise
    integer, parameter :: n = 24
    real(rp), allocatable :: v(:, :, :, :)
    real(rp) :: other(3)
    real(rp), parameter :: amount = real(n, rp)**3
    integer :: i, j, k
    logical :: ok

    allocate (v(3, n, n, n))
    noise%amplitude = 2.0_rp
    noise%takes_part = .true.
    noise%corner = [-1.0_rp, 0.5_rp, 0.0_rp]
    noise%spacing = [0.5_rp, 0.25_rp, 0.1_rp]
    do k = 1, n
      do j = 1, n
        do i = 1, n
          v(:, i, j, k) = noise%velocity(noise%corner + noise%spacing*([i, j, k] - 10.5_rp))
        end do
      end do
    end do
    call expect('noise: bounds', maxval(abs(v)) <= 2.0_rp .and. maxval(abs(v)) > 1.999_rp)
    do i = 1, 3
      call expect_close('noise: mean', sum(v(i, :, :, :))/amount, 0.0_rp, &
                        atol=3.0_rp*sqrt(4.0_rp/3.0_rp/amount))
      call expect_close('noise: mean square', sum(v(i, :, :, :)**2)/amount, 4.0_rp/3.0_rp, &
                        atol=3.0_rp*sqrt(64.0_rp/45.0_rp/amount))
      call expect_close('noise: neighbours', &
                        sum(v(i, :, :, :)*cshift(v(i, :, :, :), 1, i))/amount, 0.0_rp, &
                        atol=3.0_rp*(4.0_rp/3.0_rp)/sqrt(amount))
      call expect_close('noise: components', &
                        sum(v(i, :, :, :)*v(modulo(i, 3) + 1, :, :, :))/amount, &
                        0.0_rp, atol=3.0_rp*(4.0_rp/3.0_rp)/sqrt(amount))
    end do
    noise%seed = -7
    other = noise%velocity(noise%corner + noise%spacing*(1 - 10.5_rp))
    call expect('noise: seed', all(abs(other - v(:, 1, 1, 1)) > 1.0e-6_rp))

    noise%alternates = .true.
    noise%takes_part = [.true., .false., .true.]
    ok = .true.
    do k = 1, 4
      do i = 1, 4
        other = noise%velocity(noise%corner + noise%spacing*([i, 3, k] - 0.5_rp))
        ok = ok .and. all(abs(other - 2.0_rp*[1, 0, 1]*(-1)**(i + k)) <= 0.0_rp)
      end do
    end do
    call expect('alternating: signs', ok)
  end subroutine test_noise

end program test_fields
