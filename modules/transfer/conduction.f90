! SPDX-License-Identifier: MIT
!> Explicit heat conduction on the grid, from and to the particles:
!> C_i dT_i = -dt sum_p V_p k gradT_p . gradS_ip + waiting heat + film losses of the faces,
!> C_i = sum_p m_p c_p S_ip; particles take the increment (thesis eqs. 3.71-3.80 with the
!> capacity as weight).
module transfer_conduction
  use base_kinds, only: nlane, rp
  use transfer_gather, only: gather_block, lanes_t
  use transfer_kernels, only: p2g_gradient_block
  use transfer_scatter, only: p2g_block, p2g_values_block
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: capacity_to_grid, pressure_to_grid, nodal_temperature, nodal_pressure, flux_to_grid
  public :: temperature_increment, heat_particles, film_to_grid, surface_to_grid

  real(rp), parameter, public :: least_capacity = 1.0e-30_rp   !! of a node that is not empty [J/K]

contains

  !> Add capacity (lane 1), capacity times temperature (2) and waiting heat (3) of a block.
  subroutine capacity_to_grid(n, w, first, stride, nn, c_p, mass, temp, heat, rec, g)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), c_p(nlane)                !! [J/(kg K)]
    real(rp), intent(in) :: mass(nlane), temp(nlane), heat(nlane)   !! [kg], [K], [J]
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
    real(rp), intent(in) :: w(nlane, 18), c_p(nlane)               !! [J/(kg K)]
    real(rp), intent(in) :: j(nlane), mass(nlane), tau(nlane, 3)   !! [-], [kg], Kirchhoff [Pa]
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nn)
    integer :: p

    do p = 1, n
      rec(:, :, p) = 0.0_rp
      rec(6:8, 1, p) = -mass(p)*c_p(p)*tau(p, :)/j(p)
    end do
    call p2g_block(n, w, first, rec, stride, nn, g)
  end subroutine pressure_to_grid

  !> Mean pressures of a run of nodes, (6:8)/(1).
  subroutine nodal_pressure(n, g)
    integer, intent(in) :: n
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      if (g(1, i) > least_capacity) g(6:8, i) = g(6:8, i)/g(1, i)
    end do
  end subroutine nodal_pressure

  !> Temperature of a run of nodes, (2)/(1), to lane 4, that which conducts, and to lane 5; 0 where
  !> a node is empty.
  subroutine nodal_temperature(n, g)
    integer, intent(in) :: n
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      g(4, i) = 0.0_rp
      if (g(1, i) > least_capacity) g(4, i) = g(2, i)/g(1, i)
      g(5, i) = g(4, i)
    end do
  end subroutine nodal_temperature

  !> Heat conducted in `dt` by a block, to lane 5 of `flux`, at the temperature in lane 4 of `g`; to
  !> lane 7 capacity times the part `even`, and to lane 8 that times what particles differ by from
  !> the temperature of the nodes in lane 5 of `g`.
  subroutine flux_to_grid(n, w, first, stride, nn, dt, conductivity, volume, c_p, j, mass, temp, &
                          even, g, rec, flux)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), dt                 !! [s]
    real(rp), intent(in) :: conductivity(nlane)              !! [W/(m K)]
    real(rp), intent(in) :: volume                           !! initial volume over mass [m3/kg]
    real(rp), intent(in) :: c_p(nlane)                       !! [J/(kg K)]
    real(rp), intent(in) :: j(nlane), mass(nlane), temp(nlane)
    real(rp), intent(in) :: even(nlane), g(8, nn)
    real(rp), intent(inout) :: rec(8, 4, nlane), flux(8, nn)
    type(lanes_t), parameter :: wanted = lanes_t(steep=4, n_steep=1, plain=5, n_plain=1)
    real(rp) :: slope(nlane, 3), conducting(nlane, 1), mean(nlane, 1)
    integer :: p

    call gather_block(wanted, n, w, first, stride, nn, g, rec, conducting, slope, mean)
    do p = 1, n
      rec(:, :, p) = 0.0_rp
      rec(7, 1, p) = mass(p)*c_p(p)*even(p)
      rec(8, 1, p) = rec(7, 1, p)*(temp(p) - mean(p, 1))
      rec(5, 2:4, p) = -dt*conductivity(p)*j(p)*mass(p)*volume*slope(p, :)
    end do
    call p2g_block(n, w, first, rec, stride, nn, flux)
  end subroutine flux_to_grid

  !> Add the surface of a block, its area times the direction outwards (lanes 1:3): integrals of the
  !> slopes of the nodes over the volume; and with the stress the forces on it (lanes 4:6).
  subroutine surface_to_grid(n, w, first, stride, nn, volume, j, mass, tau, rec, g)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), volume         !! initial volume over mass [m3/kg]
    real(rp), intent(in) :: j(nlane), mass(nlane), tau(nlane, 6)   !! Kirchhoff [Pa]
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
    call p2g_gradient_block(n, w, first, rec, stride, nn, g)
  end subroutine surface_to_grid

  !> Film loss in `dt` of a face at `s`, with linear weights on the nodes: lane 5 of `flux`.
  subroutine film_to_grid(dt, film, area, ambient, s, stride, nn, g, flux, lost)
    real(rp), intent(in) :: dt, film, area, ambient   !! [s], [W/(m2 K)], [m2], [K]
    real(rp), intent(in) :: s(3)                      !! from the first node [cells]
    integer, intent(in) :: stride(3), nn
    real(rp), intent(in) :: g(8, nn)
    real(rp), intent(inout) :: flux(8, nn)
    real(rp), intent(inout) :: lost                   !! running sum [J]
    real(rp) :: weight(0:7), heat
    integer :: c, q(0:7)

    call point_nodes(s, stride, 1, least_capacity, nn, g, q, weight)
    heat = -dt*film*area*(sum(weight*g(4, q)) - sum(weight)*ambient)   ! 0 without a node
    do c = 0, 7
      flux(5, q(c)) = flux(5, q(c)) + heat*weight(c)
    end do
    lost = lost - heat
  end subroutine film_to_grid

  !> From the temperature before in lane 5: lane 8 keeps it, lane 5 becomes the increment, from
  !> conducted heat (lane 5 of `flux`) and waiting heat, lane 6 the new temperature, lane 7 the mean
  !> of what particles differ by from lane 8, weighted by the part of it that goes.
  subroutine temperature_increment(n, flux, g)
    integer, intent(in) :: n
    real(rp), intent(in) :: flux(8, n)
    real(rp), intent(inout) :: g(8, n)
    integer :: i

    do i = 1, n
      g(8, i) = g(5, i)
      g(5, i) = 0.0_rp
      g(7, i) = 0.0_rp
      if (g(1, i) > least_capacity) then
        g(5, i) = (flux(5, i) + g(3, i))/g(1, i)
      end if
      if (flux(7, i) > least_capacity) g(7, i) = flux(8, i)/flux(7, i)
      g(6, i) = g(8, i) + g(5, i)
    end do
  end subroutine temperature_increment

  !> Particles take the increment in lane 5 and spend their waiting heat. They give back the part
  !> `even` of what they differ by from the nodes (lane 8) and no node can see: what is left after
  !> its own nodal mean (lane 7) is subtracted. Increments alone would keep a jump between
  !> neighbouring particles for ever. The mean is weighted by `even`, so that the heat is the same
  !> to rounding and yet none goes to a particle that gives little back: an unweighted mean lets a
  !> particle at rest drift away by what its neighbours that flow give. A smooth field changes by
  !> (k h)^4 only.
  subroutine heat_particles(n, w, first, stride, nn, g, c_p, mass, even, rec, temp, heat, gained, &
                            evened)
    integer, intent(in) :: n, first(nlane), stride(3), nn
    real(rp), intent(in) :: w(nlane, 18), g(8, nn), c_p(nlane), mass(nlane), even(nlane)
    real(rp), intent(inout) :: rec(8, 4, nlane), temp(nlane), heat(nlane)
    real(rp), intent(inout) :: gained          !! more heat than was waiting, running sum [J]
    real(rp), intent(inout) :: evened          !! by what is given back: by walls alone, likewise
    type(lanes_t), parameter :: wanted = lanes_t(steep=1, n_steep=0, plain=5, n_plain=4)
    real(rp) :: back, change, no_value(nlane, 0), no_slope(nlane, 0), at(nlane, 4)
    integer :: p

    call gather_block(wanted, n, w, first, stride, nn, g, rec, no_value, no_slope, at)
    do p = 1, n
      back = even(p)*(temp(p) - at(p, 4) - at(p, 3))
      evened = evened - mass(p)*c_p(p)*back
      change = at(p, 1) - back
      gained = gained + (mass(p)*c_p(p)*change - heat(p))
      temp(p) = temp(p) + change
      heat(p) = 0.0_rp
    end do
  end subroutine heat_particles

end module transfer_conduction
