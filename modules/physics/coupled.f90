! SPDX-License-Identifier: MIT
!> Neo-Hookean elasticity whose energy couples volume and shape (Simo & Pister 1984):
!> P = mu (F - F^-T) + lambda ln(J) F^-T, Kirchhoff tau = mu (b - I) + lambda ln(J) I with
!> b = J^(2/3) Bbar, energy W = mu/2 (tr b - 3) - mu ln J + lambda/2 (ln J)^2.
module physics_coupled
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: finish_coupled, coupled_energy, change_coupled

  real(rp), parameter :: two_thirds = 2.0_rp/3.0_rp

contains

  !> Kirchhoff stress from Bbar and J; upper bound of the squared wave speed times density, lambda
  !> (1 - ln J) + mu (1 + b_max) [Pa], over the first `n` lanes: b_max is the largest row sum of b,
  !> an upper bound of its eigenvalues. Shear waves have mu b_max only.
  pure subroutine finish_coupled(n, lambda, mu, j, b, tau, stiffness)
    integer, intent(in) :: n                       !! particles in the block
    real(rp), intent(in) :: lambda, mu             !! Lame's constants [Pa]
    real(rp), intent(in) :: j(nlane), b(nlane, 6)  !! J, Bbar
    real(rp), intent(out) :: tau(nlane, 6)         !! [Pa]
    real(rp), intent(inout) :: stiffness           !! running maximum [Pa]
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
    !$omp simd private(c) reduction(max: stiffness)
    do p = 1, n
      c = scale(p)*max(b(p, 1) + abs(b(p, 4)) + abs(b(p, 6)), &
                       b(p, 2) + abs(b(p, 4)) + abs(b(p, 5)), &
                       b(p, 3) + abs(b(p, 5)) + abs(b(p, 6))) &
          + max(0.0_rp, lambda*(1.0_rp - log_j(p)) + mu)
      stiffness = max(stiffness, merge(c, huge(1.0_rp), c <= huge(1.0_rp)))   ! NaN counts as huge
    end do
  end subroutine finish_coupled

  !> Elastic energy of `n` particles [J].
  pure real(rp) function coupled_energy(n, lambda, mu, rho, mass, j, b)
    integer, intent(in) :: n
    real(rp), intent(in) :: lambda, mu         !! [Pa]
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
    real(rp), intent(in) :: lambda, mu         !! [Pa]
    real(rp), intent(in) :: rho                !! initial density [kg/m3]
    real(rp), intent(in) :: mass(nlane), b(nlane, 6), before(nlane), after(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)   !! [Pa]
    real(rp), intent(out) :: energy
    real(rp) :: unused, slope(nlane)
    integer :: p

    slope = (tau(:, 1) + tau(:, 2) + tau(:, 3))/before
    unused = 0.0_rp
    call finish_coupled(n, lambda, mu, after, b, tau, unused)
    slope = slope + (tau(:, 1) + tau(:, 2) + tau(:, 3))/after
    energy = 0.0_rp
    !$omp simd reduction(+: energy)
    do p = 1, n
      energy = energy + mass(p)/(6.0_rp*rho)*slope(p)*(after(p) - before(p))
    end do
  end subroutine change_coupled

end module physics_coupled
