! SPDX-License-Identifier: MIT
!> Explicit heat conduction on the grid, from and to the particles: C_i dT_i = -dt sum_p V_p k
!> gradT_p . gradS_ip + stored heat + film losses of the faces, C_i = sum_p m_p c_p S_ip. Particles
!> take the increment (thesis eqs. 3.71-3.80 with the capacity as weight). Stored heat: heat sources
!> since the last conduction step.
module transfer_conduction
  use base_kinds, only: nlane, rp
  use transfer_gather, only: gather_block, lanes_t
  use transfer_scatter, only: p2g_affine_block, p2g_block, p2g_values_block
  implicit none (type, external)
  private

  public :: capacity_to_grid, pressure_to_grid, compute_nodal_temperature, compute_nodal_pressure
  public :: add_increment, compute_increment, flux_to_grid, heat_particles, relax, surface_to_grid

  !> Capacity below which a node is empty [J/K].
  real(rp), parameter, public :: min_capacity = 1.0e-30_rp

contains

  !> Add capacity (lane 1), capacity times temperature (2) and stored heat (3) of a block.
  subroutine capacity_to_grid(n, w, first, stride, nn, c_p, mass, temp, heat, rec, g)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18)   !! weights and slopes
    real(rp), intent(in) :: c_p(nlane)     !! specific heat [J/(kg K)]
    real(rp), intent(in) :: mass(nlane)   !! [kg]
    real(rp), intent(in) :: temp(nlane)   !! temperature [K]
    real(rp), intent(in) :: heat(nlane)   !! [J]
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nn)
    integer :: p

    do p = 1, n
      rec(1, 1, p) = mass(p)*c_p(p)
      rec(2, 1, p) = mass(p)*c_p(p)*temp(p)
      rec(3, 1, p) = heat(p)
      rec(4, 1, p) = 0.0_rp
    end do
    call p2g_values_block(n, w, first, rec, stride, nn, g)
  end subroutine capacity_to_grid

  !> Add capacity times the pressure across each axis (lanes 6:8) of a block.
  subroutine pressure_to_grid(n, w, first, stride, nn, c_p, j, mass, tau, rec, g)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18)   !! weights and slopes
    real(rp), intent(in) :: c_p(nlane)     !! specific heat [J/(kg K)]
    real(rp), intent(in) :: j(nlane), mass(nlane)   !! volume ratio [-], mass [kg]
    real(rp), intent(in) :: tau(nlane, 3)           !! Kirchhoff stress [Pa]
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nn)
    integer :: p

    do p = 1, n
      rec(:, :, p) = 0.0_rp
      rec(6:8, 1, p) = -mass(p)*c_p(p)*tau(p, :)/j(p)
    end do
    call p2g_block(n, w, first, rec, stride, nn, g)
  end subroutine pressure_to_grid

  !> Divide by capacity: mean pressures of a run of nodes, (6:8)/(1).
  subroutine compute_nodal_pressure(n, g)
    integer, intent(in) :: n
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      if (g(1, i) > min_capacity) g(6:8, i) = g(6:8, i)/g(1, i)
    end do
  end subroutine compute_nodal_pressure

  !> Temperature of a run of nodes, (2)/(1): lane 4, used for conduction, and lane 5; 0 at empty
  !> nodes.
  subroutine compute_nodal_temperature(n, g)
    integer, intent(in) :: n
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      g(4, i) = 0.0_rp
      if (g(1, i) > min_capacity) g(4, i) = g(2, i)/g(1, i)
      g(5, i) = g(4, i)
    end do
  end subroutine compute_nodal_temperature

  !> Add the heat conducted in `dt` by a block to lane 5 of `flux`, from the temperature in lane 4
  !> of `g`; add capacity times the fraction `smoothing` to lane 7, and this product times the
  !> difference of the particles from the nodal temperature in lane 5 of `g` to lane 8.
  subroutine flux_to_grid(n, w, first, stride, nn, dt, conductivity, volume, c_p, j, mass, temp, &
                          smoothing, g, rec, flux)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), dt                 !! weights and slopes, time step [s]
    real(rp), intent(in) :: conductivity(nlane)              !! [W/(m K)]
    real(rp), intent(in) :: volume                           !! initial volume over mass [m3/kg]
    real(rp), intent(in) :: c_p(nlane)                       !! specific heat [J/(kg K)]
    real(rp), intent(in) :: j(nlane), mass(nlane), temp(nlane), smoothing(nlane), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane), flux(8, nn)
    type(lanes_t), parameter :: wanted = lanes_t(sloped=4, n_sloped=1, plain=5, n_plain=1)
    real(rp) :: slope(nlane, 3), conducting(nlane, 1), mean(nlane, 1)
    integer :: p

    call gather_block(wanted, n, w, first, stride, nn, g, rec, conducting, slope, mean)
    do p = 1, n
      rec(:, :, p) = 0.0_rp
      rec(7, 1, p) = mass(p)*c_p(p)*smoothing(p)
      rec(8, 1, p) = rec(7, 1, p)*(temp(p) - mean(p, 1))
      rec(5, 2:4, p) = -dt*conductivity(p)*j(p)*mass(p)*volume*slope(p, :)
    end do
    call p2g_block(n, w, first, rec, stride, nn, flux)
  end subroutine flux_to_grid

  !> Add the outward area vector of a block (lanes 1:3), as integrals of the nodal slopes over its
  !> volume, and the surface forces from its stress (lanes 4:6).
  subroutine surface_to_grid(n, w, first, stride, nn, volume, j, mass, tau, rec, g)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), volume              !! initial volume over mass [m3/kg]
    real(rp), intent(in) :: j(nlane), mass(nlane)   !! volume ratio [-], mass [kg]
    real(rp), intent(in) :: tau(nlane, 6)           !! Kirchhoff stress [Pa]
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nn)
    integer, parameter :: place(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
    integer :: a, p

    do p = 1, n
      rec(:, :, p) = 0.0_rp
      do a = 1, 3
        rec(a, 1 + a, p) = j(p)*mass(p)*volume
        rec(4:6, 1 + a, p) = mass(p)*volume*tau(p, place(:, a))
      end do
    end do
    call p2g_affine_block(n, w, w, first, rec, stride, nn, g)
  end subroutine surface_to_grid

  !> Temperature increment of a run of nodes, from conducted heat (lane 5 of `flux`) and stored
  !> heat. Lane 5 becomes the increment, lane 6 the new and lane 8 the old temperature, lane 7 the
  !> mean difference of the particles from lane 8, weighted by the fraction that is smoothed, and
  !> lane 2 the rate of the conductances (lane 6 of `flux`) [1/s].
  subroutine compute_increment(n, flux, g)
    integer, intent(in) :: n
    real(rp), intent(in) :: flux(8, n)
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      g(8, i) = g(5, i)
      g(5, i) = 0.0_rp
      g(7, i) = 0.0_rp
      g(2, i) = 0.0_rp
      if (g(1, i) > min_capacity) then
        g(5, i) = (flux(5, i) + g(3, i))/g(1, i)
        g(2, i) = flux(6, i)/g(1, i)
      end if
      if (flux(7, i) > min_capacity) g(7, i) = flux(8, i)/flux(7, i)
      g(6, i) = g(8, i) + g(5, i)
    end do
  end subroutine compute_increment

  !> Add the heat in lane 5 of `flux` to the increments of a run of nodes.
  subroutine add_increment(n, flux, g)
    integer, intent(in) :: n
    real(rp), intent(in) :: flux(8, n)
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      if (g(1, i) > min_capacity) g(5:6, i) = g(5:6, i) + flux(5, i)/g(1, i)
    end do
  end subroutine add_increment

  !> Exchange in a step of a difference that by itself would fall to exp(-a) of its value: its mean
  !> in the step is `share` of the difference before the step plus `part` of the increment that
  !> other heat gives it at an even rate.
  elemental subroutine relax(a, share, part)
    real(rp), intent(in) :: a                     !! rate of the exchange times the step, >= 0
    real(rp), intent(out) :: share, part
    real(rp), parameter :: small = 1.0e-2_rp      ! below it the series are exact to 1e-11

    if (a < small) then
      share = 1.0_rp - a/2.0_rp + a**2/6.0_rp - a**3/24.0_rp + a**4/120.0_rp
      part = 0.5_rp - a/6.0_rp + a**2/24.0_rp - a**3/120.0_rp
    else
      share = (1.0_rp - exp(-a))/a
      part = (1.0_rp - share)/a
    end if
  end subroutine relax

  !> Update the particle temperatures by the increment in lane 5 and consume their stored heat. They
  !> return the fraction `smoothing` of their difference from the nodes (lane 8) less the nodal mean
  !> of this difference (lane 7), the part that nodes do not resolve: increments alone would
  !> preserve a jump between neighbouring particles. Weighting the mean by `smoothing` conserves
  !> heat to rounding and gives no heat to a particle with little smoothing: with an unweighted mean
  !> a particle at rest drifts by the heat that its flowing neighbours return. A smooth field
  !> changes by (k h)^4 only.
  subroutine heat_particles(n, w, first, stride, nn, g, c_p, mass, smoothing, rec, temp, heat, &
                            gained, smoothing_heat)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn), c_p(nlane), mass(nlane), smoothing(nlane)
    real(rp), intent(inout) :: rec(8, 4, nlane), temp(nlane), heat(nlane)
    real(rp), intent(inout) :: gained  !! heat gained beyond the stored heat, running sum [J]
    !> Heat change by smoothing, non-zero only at walls, running sum [J].
    real(rp), intent(inout) :: smoothing_heat
    type(lanes_t), parameter :: wanted = lanes_t(sloped=1, n_sloped=0, plain=5, n_plain=4)
    real(rp) :: back, change, no_value(nlane, 0), no_slope(nlane, 0), at(nlane, 4)
    integer :: p

    call gather_block(wanted, n, w, first, stride, nn, g, rec, no_value, no_slope, at)
    do p = 1, n
      back = smoothing(p)*(temp(p) - at(p, 4) - at(p, 3))
      smoothing_heat = smoothing_heat - mass(p)*c_p(p)*back
      change = at(p, 1) - back
      gained = gained + (mass(p)*c_p(p)*change - heat(p))
      temp(p) = temp(p) + change
      heat(p) = 0.0_rp
    end do
  end subroutine heat_particles

end module transfer_conduction
