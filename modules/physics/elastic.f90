! SPDX-License-Identifier: MIT
!> Neo-Hookean elasticity with volume ratio J and isochoric elastic tensor Bbar as state (energy:
!> thesis eq. 3.34): Kirchhoff tau = G dev(Bbar) + K/2 (Je^2 - 1) I, Je = J/J_res.
!>
!> Neo-Hookean elasticity whose energy couples volume and shape (Simo & Pister 1984):
!> P = mu (F - F^-T) + lambda ln(J) F^-T, Kirchhoff tau = mu (b - I) + lambda ln(J) I with
!> b = J^(2/3) Bbar, energy W = mu/2 (tr b - 3) - mu ln J + lambda/2 (ln J)^2.
module physics_elastic
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: change_coupled, change_decoupled, coupled_energy, decoupled_energy, finish_coupled, &
            finish_state, trial_state

  real(rp), parameter :: two_thirds = 2.0_rp/3.0_rp

contains

  !> Advance J and Bbar by dF = exp(dt L) (series to fourth order); returns the deviatoric trial
  !> stress `s`, its von Mises stress `q`, and tr(Bbar)/3 in `mean`.
  subroutine trial_state(dt, g, l, b, j, s, q, mean)
    real(rp), intent(in) :: dt               !! time step [s]
    real(rp), intent(in) :: g                !! shear modulus [Pa]
    real(rp), intent(in) :: l(nlane, 9)      !! velocity gradient, row by row [1/s]
    real(rp), intent(inout) :: b(nlane, 6)   !! Bbar
    real(rp), intent(inout) :: j(nlane)      !! J
    real(rp), intent(out) :: s(nlane, 6)     !! G dev(Bbar) [Pa]
    real(rp), intent(out) :: q(nlane)        !! sqrt(3/2) |s| [Pa]
    real(rp), intent(out) :: mean(nlane)     !! tr(Bbar)/3
    real(rp) :: f11, f12, f13, f21, f22, f23, f31, f32, f33
    real(rp) :: a11, a12, a13, a21, a22, a23, a31, a32, a33
    real(rp) :: e11, e12, e13, e21, e22, e23, e31, e32, e33
    real(rp) :: h11, h12, h13, h21, h22, h23, h31, h32, h33, b1, b2, b3, b4, b5, b6, d, m, y
    real(rp), parameter :: c2 = 0.5_rp, c3 = 1.0_rp/6.0_rp, c4 = 1.0_rp/24.0_rp
    integer :: p

    !$omp simd private(f11, f12, f13, f21, f22, f23, f31, f32, f33, a11, a12, a13, a21, a22, a23, &
    !$omp   a31, a32, a33, e11, e12, e13, e21, e22, e23, e31, e32, e33, h11, h12, h13, h21, h22, &
    !$omp   h23, h31, h32, h33, b1, b2, b3, b4, b5, b6, d, m, y)
    do p = 1, nlane
      a11 = dt*l(p, 1); a12 = dt*l(p, 2); a13 = dt*l(p, 3)
      a21 = dt*l(p, 4); a22 = dt*l(p, 5); a23 = dt*l(p, 6)
      a31 = dt*l(p, 7); a32 = dt*l(p, 8); a33 = dt*l(p, 9)
      ! e = a a;  h = 1/2 + a/6 + e/24;  f = 1 + a + e h
      e11 = a11*a11 + a12*a21 + a13*a31; e12 = a11*a12 + a12*a22 + a13*a32
      e13 = a11*a13 + a12*a23 + a13*a33
      e21 = a21*a11 + a22*a21 + a23*a31; e22 = a21*a12 + a22*a22 + a23*a32
      e23 = a21*a13 + a22*a23 + a23*a33
      e31 = a31*a11 + a32*a21 + a33*a31; e32 = a31*a12 + a32*a22 + a33*a32
      e33 = a31*a13 + a32*a23 + a33*a33
      h11 = c2 + c3*a11 + c4*e11; h12 = c3*a12 + c4*e12;      h13 = c3*a13 + c4*e13
      h21 = c3*a21 + c4*e21;      h22 = c2 + c3*a22 + c4*e22; h23 = c3*a23 + c4*e23
      h31 = c3*a31 + c4*e31;      h32 = c3*a32 + c4*e32;      h33 = c2 + c3*a33 + c4*e33
      f11 = 1.0_rp + a11 + e11*h11 + e12*h21 + e13*h31
      f12 = a12 + e11*h12 + e12*h22 + e13*h32
      f13 = a13 + e11*h13 + e12*h23 + e13*h33
      f21 = a21 + e21*h11 + e22*h21 + e23*h31
      f22 = 1.0_rp + a22 + e21*h12 + e22*h22 + e23*h32
      f23 = a23 + e21*h13 + e22*h23 + e23*h33
      f31 = a31 + e31*h11 + e32*h21 + e33*h31
      f32 = a32 + e31*h12 + e32*h22 + e33*h32
      f33 = 1.0_rp + a33 + e31*h13 + e32*h23 + e33*h33
      d = f11*(f22*f33 - f23*f32) - f12*(f21*f33 - f23*f31) + f13*(f21*f32 - f22*f31)
      j(p) = j(p)*d
      ! y = d**(-1/3) by Newton (|d - 1| < 0.3)
      y = 1.0_rp - (d - 1.0_rp)*(1.0_rp/3.0_rp)
      y = y*(4.0_rp - d*y*y*y)*(1.0_rp/3.0_rp)
      y = y*(4.0_rp - d*y*y*y)*(1.0_rp/3.0_rp)
      y = y*(4.0_rp - d*y*y*y)*(1.0_rp/3.0_rp)
      y = y*y
      b1 = b(p, 1); b2 = b(p, 2); b3 = b(p, 3); b4 = b(p, 4); b5 = b(p, 5); b6 = b(p, 6)
      a11 = f11*b1 + f12*b4 + f13*b6; a12 = f11*b4 + f12*b2 + f13*b5; a13 = f11*b6 + f12*b5 + f13*b3
      a21 = f21*b1 + f22*b4 + f23*b6; a22 = f21*b4 + f22*b2 + f23*b5; a23 = f21*b6 + f22*b5 + f23*b3
      a31 = f31*b1 + f32*b4 + f33*b6; a32 = f31*b4 + f32*b2 + f33*b5; a33 = f31*b6 + f32*b5 + f33*b3
      b1 = (a11*f11 + a12*f12 + a13*f13)*y
      b2 = (a21*f21 + a22*f22 + a23*f23)*y
      b3 = (a31*f31 + a32*f32 + a33*f33)*y
      b4 = (a11*f21 + a12*f22 + a13*f23)*y
      b5 = (a21*f31 + a22*f32 + a23*f33)*y
      b6 = (a11*f31 + a12*f32 + a13*f33)*y
      m = (b1 + b2 + b3)*(1.0_rp/3.0_rp)
      b(p, 1) = b1; b(p, 2) = b2; b(p, 3) = b3; b(p, 4) = b4; b(p, 5) = b5; b(p, 6) = b6
      mean(p) = m
      s(p, 1) = g*(b1 - m); s(p, 2) = g*(b2 - m); s(p, 3) = g*(b3 - m)
      s(p, 4) = g*b4; s(p, 5) = g*b5; s(p, 6) = g*b6
      q(p) = sqrt(1.5_rp*(s(p, 1)**2 + s(p, 2)**2 + s(p, 3)**2 &
                          + 2.0_rp*(s(p, 4)**2 + s(p, 5)**2 + s(p, 6)**2)))
    end do
  end subroutine trial_state

  !> Kirchhoff stress from the deviator `tau` (in) and J; squared wave speeds times density,
  !> K Je^2 + 4/3 G tr(Bbar)/3.
  subroutine finish_state(k, g, expansion, t_ref, temp, j, mean, tau, stiffness)
    real(rp), intent(in) :: k, g               !! bulk and shear modulus [Pa]
    real(rp), intent(in) :: expansion          !! linear thermal expansion [1/K]
    real(rp), intent(in) :: t_ref              !! temperature without thermal strain [K]
    real(rp), intent(in) :: temp(nlane)        !! temperatures [K]
    real(rp), intent(in) :: j(nlane), mean(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)   !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: stiffness(nlane)  !! squared wave speeds times density [Pa]
    real(rp) :: je2(nlane), c
    integer :: p

    if (abs(expansion) > 0.0_rp) then
      !$omp simd
      do p = 1, nlane
        je2(p) = (j(p)*exp(-3.0_rp*expansion*(temp(p) - t_ref)))**2
      end do
    else
      je2 = j*j
    end if
    !$omp simd private(c)
    do p = 1, nlane
      c = 0.5_rp*k*(je2(p) - 1.0_rp)
      tau(p, 1) = tau(p, 1) + c
      tau(p, 2) = tau(p, 2) + c
      tau(p, 3) = tau(p, 3) + c
      stiffness(p) = k*je2(p) + (4.0_rp/3.0_rp)*g*mean(p)
    end do
  end subroutine finish_state

  !> Elastic energy of `n` particles [J]: V0 [K/2 ((Je^2-1)/2 - ln Je) + G/2 (tr Bbar - 3)].
  pure real(rp) function decoupled_energy(n, k, g, expansion, t_ref, rho, mass, temp, j, b)
    integer, intent(in) :: n
    real(rp), intent(in) :: k, g, expansion, t_ref
    real(rp), intent(in) :: rho                !! initial density [kg/m3]
    real(rp), intent(in) :: mass(nlane), temp(nlane), j(nlane), b(nlane, 6)
    real(rp) :: je
    integer :: p

    decoupled_energy = 0.0_rp
    do p = 1, n
      je = j(p)*exp(-3.0_rp*expansion*(temp(p) - t_ref))
      decoupled_energy = decoupled_energy &
                         + mass(p)/rho*(0.5_rp*k*(0.5_rp*(je*je - 1.0_rp) - log(je)) &
                                        + 0.5_rp*g*(b(p, 1) + b(p, 2) + b(p, 3) - 3.0_rp))
    end do
  end function decoupled_energy

  !> Change of the Kirchhoff stress when J goes from `before` to `after` at constant Bbar, and the
  !> energy absorbed by `n` particles [J], by the trapezoidal rule with dU/dJ = K/2 (Je^2 - 1)/J.
  pure subroutine change_decoupled(n, k, expansion, t_ref, rho, mass, temp, before, after, tau, &
                                   energy)
    integer, intent(in) :: n
    real(rp), intent(in) :: k, expansion, t_ref
    real(rp), intent(in) :: rho                !! initial density [kg/m3]
    real(rp), intent(in) :: mass(nlane), temp(nlane), before(nlane), after(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)   !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: energy(nlane)     !! absorbed by each particle [J]
    real(rp) :: free(nlane), c                 !! `free`: (Je/J)^2, below 1 by thermal expansion
    integer :: p

    free = 1.0_rp
    if (abs(expansion) > 0.0_rp) free = exp(-6.0_rp*expansion*(temp - t_ref))
    !$omp simd private(c)
    do p = 1, nlane
      c = 0.5_rp*k*free(p)*(after(p) - before(p))*(after(p) + before(p))
      tau(p, 1) = tau(p, 1) + c
      tau(p, 2) = tau(p, 2) + c
      tau(p, 3) = tau(p, 3) + c
    end do
    energy = 0.0_rp
    !$omp simd
    do p = 1, n
      energy(p) = 0.25_rp*k/rho*mass(p)*(after(p) - before(p))*(after(p) + before(p)) &
                  *(free(p) - 1.0_rp/(after(p)*before(p)))
    end do
  end subroutine change_decoupled

  !> Kirchhoff stress from Bbar and J; upper bounds of the squared wave speeds times density, lambda
  !> (1 - ln J) + mu (1 + b_max): b_max is the largest row sum of b, an upper bound of its
  !> eigenvalues. Shear waves have mu b_max only.
  pure subroutine finish_coupled(lambda, mu, j, b, tau, stiffness)
    real(rp), intent(in) :: lambda, mu             !! Lame's constants [Pa]
    real(rp), intent(in) :: j(nlane), b(nlane, 6)  !! J, Bbar
    real(rp), intent(out) :: tau(nlane, 6)         !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: stiffness(nlane)      !! squared wave speeds times density [Pa]
    real(rp) :: log_j(nlane), scale(nlane), c
    integer :: p

    !$omp simd
    do p = 1, nlane
      log_j(p) = log(j(p))
      scale(p) = mu*exp(two_thirds*log_j(p))
    end do
    !$omp simd private(c)
    do p = 1, nlane
      c = lambda*log_j(p) - mu
      tau(p, 1) = scale(p)*b(p, 1) + c
      tau(p, 2) = scale(p)*b(p, 2) + c
      tau(p, 3) = scale(p)*b(p, 3) + c
      tau(p, 4) = scale(p)*b(p, 4)
      tau(p, 5) = scale(p)*b(p, 5)
      tau(p, 6) = scale(p)*b(p, 6)
    end do
    !$omp simd
    do p = 1, nlane
      stiffness(p) = scale(p)*max(b(p, 1) + abs(b(p, 4)) + abs(b(p, 6)), &
                                  b(p, 2) + abs(b(p, 4)) + abs(b(p, 5)), &
                                  b(p, 3) + abs(b(p, 5)) + abs(b(p, 6))) &
                     + max(0.0_rp, lambda*(1.0_rp - log_j(p)) + mu)
    end do
  end subroutine finish_coupled

  !> Elastic energy of `n` particles [J].
  pure real(rp) function coupled_energy(n, lambda, mu, rho, mass, j, b)
    integer, intent(in) :: n
    real(rp), intent(in) :: lambda, mu         !! Lame's constants [Pa]
    real(rp), intent(in) :: rho                !! initial density [kg/m3]
    real(rp), intent(in) :: mass(nlane), j(nlane), b(nlane, 6)
    real(rp) :: log_j
    integer :: p

    coupled_energy = 0.0_rp
    do p = 1, n
      log_j = log(j(p))
      coupled_energy = coupled_energy &
        + mass(p)/rho*(0.5_rp*mu*(exp(two_thirds*log_j)*(b(p, 1) + b(p, 2) + b(p, 3)) - 3.0_rp) &
                       + (0.5_rp*lambda*log_j - mu)*log_j)
    end do
  end function coupled_energy

  !> Change of the Kirchhoff stress when J goes from `before` to `after` at constant Bbar, and the
  !> energy absorbed by `n` particles [J], by the trapezoidal rule with dW/dJ = tr(tau)/(3 J).
  pure subroutine change_coupled(n, lambda, mu, rho, mass, b, before, after, tau, energy)
    integer, intent(in) :: n
    real(rp), intent(in) :: lambda, mu         !! Lame's constants [Pa]
    real(rp), intent(in) :: rho                !! initial density [kg/m3]
    real(rp), intent(in) :: mass(nlane), b(nlane, 6), before(nlane), after(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)   !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: energy(nlane)     !! absorbed by each particle [J]
    real(rp) :: unused(nlane), slope(nlane)
    integer :: p

    slope = (tau(:, 1) + tau(:, 2) + tau(:, 3))/before
    call finish_coupled(lambda, mu, after, b, tau, unused)
    slope = slope + (tau(:, 1) + tau(:, 2) + tau(:, 3))/after
    energy = 0.0_rp
    !$omp simd
    do p = 1, n
      energy(p) = mass(p)/(6.0_rp*rho)*slope(p)*(after(p) - before(p))
    end do
  end subroutine change_coupled

end module physics_elastic
