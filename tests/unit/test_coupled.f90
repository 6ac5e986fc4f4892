! SPDX-License-Identifier: MIT
!> The coupled energy: its stress against the formula and its own derivative, paths with closed
!> forms, the bound of the wave speed, and the energy of a change of volume alone.
program test_coupled
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_material, only: material_t
  use physics_stress, only: advance_stress, compute_elastic_stress, stress_sums_t
  implicit none (type, external)

  real(rp) :: none(nlane, 0)   !! no internal variables
  real(rp), parameter :: unit(3, 3) = reshape([1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp, &
                                               0.0_rp, 0.0_rp, 1.0_rp], [3, 3])
  real(rp), parameter :: still(nlane) = 298.0_rp
  type(material_t) :: rubber, decoupled

  decoupled%rho = 1100.0_rp
  call decoupled%set_elastic(3.0e6_rp, 0.3_rp)
  rubber = decoupled
  rubber%is_coupled = .true.

  call begin_tests()
  call random_init(.true., .false.)
  call test_formula()
  call test_derivative()
  call test_uniaxial()
  call test_simple_shear()
  call test_wave_speed()
  call test_change_of_volume()
  call end_tests()

contains

  !> A deformation gradient with entries up to 0.4 off the unit tensor.
  function random_gradient() result(f)
    real(rp) :: f(3, 3)

    do
      call random_number(f)
      f = unit + 0.4_rp*(2.0_rp*f - 1.0_rp)
      if (determinant(f) > 0.3_rp) exit
    end do
  end function random_gradient

  pure real(rp) function determinant(f)
    real(rp), intent(in) :: f(3, 3)

    determinant = dot_product(f(:, 1), cross(f(:, 2), f(:, 3)))
  end function determinant

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> F^-T: the cofactors over the determinant.
  pure function inverse_transpose(f) result(g)
    real(rp), intent(in) :: f(3, 3)
    real(rp) :: g(3, 3)

    g(:, 1) = cross(f(:, 2), f(:, 3))
    g(:, 2) = cross(f(:, 3), f(:, 1))
    g(:, 3) = cross(f(:, 1), f(:, 2))
    g = g/determinant(f)
  end function inverse_transpose

  !> Bbar and J of F in all lanes.
  pure subroutine state_of(f, b, j)
    real(rp), intent(in) :: f(3, 3)
    real(rp), intent(out) :: b(nlane, 6), j(nlane)
    real(rp) :: c(3, 3)

    j = determinant(f)
    c = matmul(f, transpose(f))*determinant(f)**(-2.0_rp/3.0_rp)
    b = spread([c(1, 1), c(2, 2), c(3, 3), c(1, 2), c(2, 3), c(1, 3)], 1, nlane)
  end subroutine state_of

  !> Kirchhoff stress that the material gives for F, and its squared wave speed.
  subroutine stress_of(f, tau, wave2)
    real(rp), intent(in) :: f(3, 3)
    real(rp), intent(out) :: tau(3, 3), wave2
    real(rp) :: b(nlane, 6), j(nlane), t(nlane, 6)

    call state_of(f, b, j)
    call compute_elastic_stress(rubber, nlane, still, b, j, t, wave2)
    tau = reshape(t(5, [1, 4, 6, 4, 2, 5, 6, 5, 3]), [3, 3])
  end subroutine stress_of

  !> Energy of a unit volume [J/m3] that the material gives for F.
  real(rp) function energy_of(material, f)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: f(3, 3)
    real(rp) :: b(nlane, 6), j(nlane), mass(nlane)

    mass = material%rho
    call state_of(f, b, j)
    energy_of = material%elastic_energy(1, mass, still, j, b)
  end function energy_of

  !> tau = P F^T with P = mu (F - F^-T) + lambda ln(J) F^-T.
  subroutine test_formula()
    real(rp) :: f(3, 3), p(3, 3), tau(3, 3), wave2, worst
    integer :: i

    worst = 0.0_rp
    do i = 1, 100
      f = random_gradient()
      p = rubber%g*(f - inverse_transpose(f)) &
          + (rubber%k - 2.0_rp*rubber%g/3.0_rp)*log(determinant(f))*inverse_transpose(f)
      call stress_of(f, tau, wave2)
      worst = max(worst, maxval(abs(tau - matmul(p, transpose(f)))))
    end do
    call expect_close('stress of the formula', worst/rubber%g, 0.0_rp, atol=1.0e-13_rp)
  end subroutine test_formula

  !> dW/dF_ij = P_ij = (tau F^-T)_ij; the energy of F = 1 is 0.
  subroutine test_derivative()
    real(rp), parameter :: h = 1.0e-5_rp
    real(rp) :: f(3, 3), p(3, 3), tau(3, 3), step(3, 3), wave2, slope, worst
    integer :: i, m, n

    worst = 0.0_rp
    do i = 1, 20
      f = random_gradient()
      call stress_of(f, tau, wave2)
      p = matmul(tau, inverse_transpose(f))
      do n = 1, 3
        do m = 1, 3
          step = 0.0_rp
          step(m, n) = h
          slope = (energy_of(rubber, f + step) - energy_of(rubber, f - step))/(2.0_rp*h)
          worst = max(worst, abs(slope - p(m, n)))
        end do
      end do
    end do
    call expect_close('stress is the derivative of the energy', worst/rubber%g, 0.0_rp, &
                      atol=1.0e-8_rp)
    call expect_close('no energy at rest', energy_of(rubber, unit)/rubber%g, 0.0_rp, &
                      atol=1.0e-15_rp)
  end subroutine test_derivative

  !> Carry a block at rest with a constant gradient for a unit of time.
  subroutine carry(l, steps, b, j, tau, sums)
    real(rp), intent(in) :: l(nlane, 9)
    integer, intent(in) :: steps
    real(rp), intent(out) :: b(nlane, 6), j(nlane), tau(nlane, 6)
    type(stress_sums_t), intent(out) :: sums
    real(rp), dimension(nlane) :: alpha, temp, rate, flow, mass
    integer :: i

    call state_of(unit, b, j)
    tau = 0.0_rp
    alpha = 0.0_rp
    temp = still
    rate = 0.0_rp
    flow = 0.0_rp
    mass = rubber%rho
    do i = 1, steps
      call advance_stress(rubber, nlane, 1.0_rp/steps, l, still, mass, b, j, alpha, temp, tau, &
                          rate, &
                          flow, 0, none, sums)
    end do
  end subroutine carry

  !> F = diag(s, 1, 1): tau_11 = mu (s^2 - 1) + lambda ln s, tau_22 = lambda ln s; work = energy.
  subroutine test_uniaxial()
    real(rp) :: l(nlane, 9), b(nlane, 6), j(nlane), tau(nlane, 6), s, lame, w
    type(stress_sums_t) :: sums
    integer :: i

    lame = rubber%k - 2.0_rp*rubber%g/3.0_rp
    do i = -1, 1, 2
      l = 0.0_rp
      l(:, 1) = 0.5_rp*i
      s = exp(0.5_rp*i)
      call carry(l, 400, b, j, tau, sums)
      call expect_close('uniaxial, axial', tau(9, 1), rubber%g*(s*s - 1.0_rp) + lame*log(s), &
                        rtol=1.0e-10_rp)
      call expect_close('uniaxial, lateral', tau(9, 3), lame*log(s), rtol=1.0e-10_rp)
      call expect_close('uniaxial, no shear', maxval(abs(tau(:, 4:6))), 0.0_rp, atol=1.0e-9_rp)
      w = 0.5_rp*rubber%g*(s*s - 1.0_rp) - rubber%g*log(s) + 0.5_rp*lame*log(s)**2
      call expect_close('uniaxial, work', sums%stress_work/nlane, w, rtol=1.0e-5_rp)
    end do
  end subroutine test_uniaxial

  !> F = 1 + gamma e1 e2 to gamma = 10: tau_12 = mu gamma, tau_11 = mu gamma^2, the rest 0.
  subroutine test_simple_shear()
    real(rp) :: l(nlane, 9), b(nlane, 6), j(nlane), tau(nlane, 6)
    type(stress_sums_t) :: sums

    l = 0.0_rp
    l(:, 2) = 10.0_rp
    call carry(l, 1000, b, j, tau, sums)
    call expect_close('shear stress', tau(3, 4), 10.0_rp*rubber%g, rtol=1.0e-10_rp)
    call expect_close('shear, axial stress', tau(3, 1), 100.0_rp*rubber%g, rtol=1.0e-10_rp)
    call expect_close('shear, lateral stress', maxval(abs(tau(:, 2:3)))/rubber%g, 0.0_rp, &
                      atol=1.0e-9_rp)
  end subroutine test_simple_shear

  !> Waves of direction n and amplitude a (unit vectors) have rho c^2 = a.(dtau - tau L^T) n with
  !> dtau the change of stress for L = a n: the bound is never below, and equal for n = a along the
  !> longest axis of a stretch.
  subroutine test_wave_speed()
    real(rp) :: f(3, 3), tau(3, 3), n(3), a(3), wave2, least
    integer :: i, k

    call stress_of(unit, tau, wave2)
    call expect_close('wave speed at rest', sqrt(wave2), rubber%wave_speed(), rtol=1.0e-12_rp)
    least = huge(1.0_rp)
    do i = 1, 50
      f = random_gradient()
      call stress_of(f, tau, wave2)
      do k = 1, 50
        n = random_direction()
        a = random_direction()
        if (k > 25) a = n
        least = min(least, wave2 - acoustic(f, tau, n, a)/rubber%rho)
      end do
    end do
    call expect('no wave is faster than the bound', least > 0.0_rp)
    f = unit
    f(2, 2) = 1.6_rp
    n = unit(:, 2)
    call stress_of(f, tau, wave2)
    call expect_close('the bound of a stretch', wave2, acoustic(f, tau, n, n)/rubber%rho, &
                      rtol=1.0e-8_rp)
    f = unit*4.0_rp                      ! ln J > 1 + mu/lambda: shear waves are the faster ones
    call stress_of(f, tau, wave2)
    call expect_close('the bound of a large dilation', wave2, &
                      acoustic(f, tau, n, unit(:, 1))/rubber%rho, rtol=1.0e-8_rp)
  end subroutine test_wave_speed

  function random_direction() result(n)
    real(rp) :: n(3)

    call random_number(n)
    n = n - 0.5_rp
    n = n/norm2(n)
  end function random_direction

  !> rho c^2 [Pa] by central differences.
  real(rp) function acoustic(f, tau, n, a)
    real(rp), intent(in) :: f(3, 3), tau(3, 3), n(3), a(3)
    real(rp), parameter :: h = 1.0e-5_rp
    real(rp) :: l(3, 3), plus(3, 3), minus(3, 3), unused

    l = spread(a, 2, 3)*spread(n, 1, 3)
    call stress_of(f + h*matmul(l, f), plus, unused)
    call stress_of(f - h*matmul(l, f), minus, unused)
    acoustic = dot_product(a, matmul((plus - minus)/(2.0_rp*h) - matmul(tau, transpose(l)), n))
  end function acoustic

  !> A change of J alone gives the stress of the new state, and the difference of the energies but
  !> for the third power of the change; with either energy, and when the material is hot.
  subroutine test_change_of_volume()
    type(material_t) :: hot
    real(rp) :: f(3, 3)
    integer :: i

    hot = decoupled
    hot%expansion = -2.0e-5_rp
    do i = 1, 20
      f = random_gradient()
      call compare_change(rubber, f)
      call compare_change(decoupled, f)
      call compare_change(hot, f)
    end do
  end subroutine test_change_of_volume

  subroutine compare_change(material, f)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: f(3, 3)
    real(rp), parameter :: change = 1.0e-3_rp
    real(rp) :: b(nlane, 6), before(nlane), after(nlane), mass(nlane), temp(nlane)
    real(rp) :: tau(nlane, 6), new(nlane, 6), energy(nlane), want, unused

    mass = material%rho
    temp = still + 400.0_rp
    call state_of(f, b, before)
    after = before*(1.0_rp + change)
    call compute_elastic_stress(material, nlane, temp, b, before, tau, unused)
    call compute_elastic_stress(material, nlane, temp, b, after, new, unused)
    call material%change_volume(3, mass, temp, b, before, after, tau, energy)
    want = material%elastic_energy(3, mass, temp, after, b) &
           - material%elastic_energy(3, mass, temp, before, b)
    call expect_close('change of volume, energy', sum(energy)/material%k, want/material%k, &
                      atol=10.0_rp*change**3)
    call expect_close('change of volume, stress', maxval(abs(tau - new))/material%k, 0.0_rp, &
                      atol=1.0e-14_rp)
  end subroutine compare_change

end program test_coupled
