! SPDX-License-Identifier: MIT
!> Kernels of heat conduction, of surfaces and of affine momentum against dense matrices: the weight
!> and the slopes of every node at every particle, and sums written as they stand in a textbook.
program test_conduction
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect_close
  use transfer_conduction, only: add_increment, capacity_to_grid, compute_increment, &
                                 compute_nodal_pressure, compute_nodal_temperature, flux_to_grid, &
                                 heat_particles, pressure_to_grid, relax, surface_to_grid
  use transfer_scatter, only: p2g_affine_block
  use transfer_weights, only: block_weights, moment_weights, own_weights
  implicit none (type, external)

  integer, parameter :: n_node(3) = [6, 7, 5]
  integer, parameter :: stride(3) = [n_node(2)*n_node(3), n_node(3), 1]
  integer, parameter :: nn = product(n_node)
  real(rp), parameter :: h(3) = [0.05_rp, 0.11_rp, 0.023_rp]      ! edges of a cell [m]
  real(rp), parameter :: origin(3) = [0.3_rp, -0.2_rp, 1.1_rp]    ! [m]
  integer, parameter :: place(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
  integer :: first(nlane), n
  real(rp) :: x(nlane, 3), w(nlane, 18), rec(8, 4, nlane)
  real(rp) :: s(0:3, nn, nlane)                      ! weight and slopes of each node
  real(rp), dimension(nlane) :: c_p, even, heat, j, k, mass, temp
  real(rp) :: tau(nlane, 6)

  call begin_tests()
  call test_relax()
  call random_init(.true., .false.)
  do n = 1, nlane, 21
    call draw()
    call test_capacity()
    call test_pressure()
    call test_flux()
    call test_surface()
    call test_heating()
    call test_affine()
  end do
  call end_tests()

contains

  !> Particles at random places, of which about three in turn have the same nodes.
  subroutine draw()
    integer :: p

    call random_number(x)
    do p = 1, nlane
      if (mod(p, 3) /= 1) x(p, :) = x(p - 1, :)
      if (mod(p, 3) == 1) x(p, :) = origin + h*(1.0_rp + x(p, :)*(n_node - 3))
    end do
    call block_weights(origin, 1.0_rp/h, [0.25_rp, 0.4_rp, 0.5_rp], stride, x, w, first)
    s = dense(w, first)
    call draw_reals(c_p, 300.0_rp, 900.0_rp)
    call draw_reals(even, 0.0_rp, 1.0_rp)
    call draw_reals(heat, -2.0_rp, 5.0_rp)
    call draw_reals(j, 0.9_rp, 1.1_rp)
    call draw_reals(k, 10.0_rp, 400.0_rp)
    call draw_reals(mass, 1.0e-3_rp, 2.0e-3_rp)
    call draw_reals(temp, 300.0_rp, 900.0_rp)
    call random_number(tau)
    call random_number(rec)                          ! the kernels clear what they use
  end subroutine draw

  subroutine draw_reals(values, low, high)
    real(rp), intent(out) :: values(:)
    real(rp), intent(in) :: low, high

    call random_number(values)
    values = low + (high - low)*values
  end subroutine draw_reals

  !> Products of the weights, and of one slope with two weights, at all nodes.
  pure function dense(w, first) result(s)
    real(rp), intent(in) :: w(nlane, 18)
    integer, intent(in) :: first(nlane)
    real(rp) :: s(0:3, nn, nlane)
    integer :: a, b, c, p

    s = 0.0_rp
    do p = 1, nlane
      do a = 1, 3
        do b = 1, 3
          do c = 1, 3
            s(:, first(p) + dot_product([a, b, c] - 1, stride), p) = &
              [w(p, a)*w(p, 3 + b)*w(p, 6 + c), w(p, 9 + a)*w(p, 3 + b)*w(p, 6 + c), &
               w(p, a)*w(p, 12 + b)*w(p, 6 + c), w(p, a)*w(p, 3 + b)*w(p, 15 + c)]
          end do
        end do
      end do
    end do
  end function dense

  !> Sum over the particles of weight (0) or slope (1:3) `part` times `values`.
  pure function to_nodes(part, values) result(at)
    integer, intent(in) :: part
    real(rp), intent(in) :: values(nlane)
    real(rp) :: at(nn)

    at = matmul(s(part, :, :n), values(:n))
  end function to_nodes

  !> Sum over the nodes of weight (0) or slope (1:3) `part` times `values`.
  pure function to_particles(part, values) result(at)
    integer, intent(in) :: part
    real(rp), intent(in) :: values(nn)
    real(rp) :: at(n)

    at = matmul(values, s(part, :, :n))
  end function to_particles

  !> Check that lanes agree to rounding of the largest.
  subroutine compare(name, got, want)
    character(*), intent(in) :: name
    real(rp), intent(in) :: got(:), want(:)

    if (size(want) == 0) return
    call expect_close(name, maxval(abs(got - want)), 0.0_rp, atol=2.0e-13_rp*maxval(abs(want)))
  end subroutine compare

  !> A difference u with du/dt = -a u + 1 in a step of length 1, from u = 3: what it exchanges, a
  !> times its mean, is what its end lacks of 4. Series for small a.
  subroutine test_relax()
    real(rp), parameter :: a(8) = [1.0e-12_rp, 1.0e-5_rp, 9.9e-3_rp, 1.01e-2_rp, 0.3_rp, 2.0_rp, &
                                   50.0_rp, 1.0e12_rp]
    real(rp) :: last(8), part(8), share(8)

    call relax(a, share, part)
    last = 3.0_rp*exp(-a) + (1.0_rp - exp(-a))/a
    where (a < 1.0e-4_rp) last = 4.0_rp - 3.5_rp*a + 5.0_rp*a**2/3.0_rp
    call expect_close('exchange to an equilibrium', &
                      maxval(abs(4.0_rp - a*(3.0_rp*share + part) - last)), 0.0_rp, &
                      atol=1.0e-11_rp)
    call expect_close('its mean in a short step', 3.0_rp*share(1) + part(1), 3.5_rp, rtol=1.0e-9_rp)
  end subroutine test_relax

  subroutine test_capacity()
    real(rp) :: g(8, nn), before(8, nn)

    call random_number(g)
    before = g
    call capacity_to_grid(n, w, first, stride, nn, c_p, mass, temp, heat, rec, g)
    call compare('capacity', g(1, :), before(1, :) + to_nodes(0, mass*c_p))
    call compare('heat content', g(2, :), before(2, :) + to_nodes(0, mass*c_p*temp))
    call compare('waiting heat', g(3, :), before(3, :) + to_nodes(0, heat))
    call compare('lane 4', g(4, :), before(4, :))
    call compare('lanes that capacity leaves alone', [g(5:, :)], [before(5:, :)])
    call compute_nodal_temperature(nn, g)
    call compare('nodal temperature', g(4, :), g(2, :)/g(1, :))
    call compare('nodal temperature, second copy', g(5, :), g(4, :))
  end subroutine test_capacity

  subroutine test_pressure()
    real(rp) :: g(8, nn)
    integer :: a

    g = 0.0_rp
    g(1, :) = 1.0_rp + to_nodes(0, mass*c_p)
    call pressure_to_grid(n, w, first, stride, nn, c_p, j, mass, tau(:, 1:3), rec, g)
    do a = 1, 3
      call compare('pressure', g(5 + a, :), -to_nodes(0, mass*c_p*tau(:, a)/j))
    end do
    call compare('lanes that pressure leaves alone', [g(2:5, :)], spread(0.0_rp, 1, 4*nn))
    call compute_nodal_pressure(nn, g)
    call compare('nodal pressure', g(6, :)*g(1, :), -to_nodes(0, mass*c_p*tau(:, 1)/j))
  end subroutine test_pressure

  !> -dt k V grad T . grad S, with the temperature of lane 4; differences from that of lane 5.
  subroutine test_flux()
    real(rp), parameter :: dt = 0.7_rp, volume = 1.3e-4_rp
    real(rp) :: flux(8, nn), g(8, nn), kv(nlane), mean(nlane), slope(nlane, 3), want(nn)
    integer :: a

    call random_number(g)
    flux = 0.0_rp
    call flux_to_grid(n, w, first, stride, nn, dt, k, volume, c_p, j, mass, temp, even, g, rec, &
                      flux)
    kv = dt*k*j*mass*volume
    want = 0.0_rp
    mean = 0.0_rp
    mean(:n) = to_particles(0, g(5, :))
    do a = 1, 3
      slope(:, a) = 0.0_rp
      slope(:n, a) = to_particles(a, g(4, :))
      want = want - to_nodes(a, kv*slope(:, a))
    end do
    call compare('conducted heat', flux(5, :), want)
    call compare('capacity that evens out', flux(7, :), to_nodes(0, mass*c_p*even))
    call compare('differences that even out', flux(8, :), to_nodes(0, mass*c_p*even*(temp - mean)))
    call compare('lanes without a flux', [flux([1, 2, 3, 4, 6], :)], spread(0.0_rp, 1, 5*nn))
  end subroutine test_flux

  !> Areas, integrals of the slopes over the volume, and forces, slopes times Kirchhoff stress.
  subroutine test_surface()
    real(rp), parameter :: volume = 1.3e-4_rp
    real(rp) :: g(8, nn), want(nn)
    integer :: a, b

    g = 0.0_rp
    call surface_to_grid(n, w, first, stride, nn, volume, j, mass, tau, rec, g)
    do a = 1, 3
      call compare('area', g(a, :), to_nodes(a, volume*mass*j))
      want = 0.0_rp
      do b = 1, 3
        want = want + to_nodes(b, volume*mass*tau(:, place(a, b)))
      end do
      call compare('force on a surface', g(3 + a, :), want)
    end do
    call compare('lanes without a surface', [g(7:8, :)], spread(0.0_rp, 1, 2*nn))
  end subroutine test_surface

  !> From fluxes to increments of the nodes, and from there to the particles.
  subroutine test_heating()
    real(rp) :: back(n), evened, flux(8, nn), g(8, nn), gained, old_heat(nlane), old_temp(nlane)
    real(rp) :: old(8, nn), want(n), want_nodes(2, nn)

    call random_number(g)
    call random_number(flux)
    old = g
    call compute_increment(nn, flux, g)
    call compare('temperature before', g(8, :), old(5, :))
    call compare('increment', g(5, :), (flux(5, :) + old(3, :))/old(1, :))
    call compare('temperature after', g(6, :), old(5, :) + g(5, :))
    call compare('mean difference', g(7, :), flux(8, :)/flux(7, :))
    call compare('rate of conductances', g(2, :), flux(6, :)/old(1, :))
    want_nodes = g(5:6, :) + spread(flux(5, :)/old(1, :), 1, 2)
    call add_increment(nn, flux, g)
    call compare('increments added', [g(5:6, :)], [want_nodes])
    old_temp = temp
    old_heat = heat
    gained = 2.0_rp
    evened = 3.0_rp
    call heat_particles(n, w, first, stride, nn, g, c_p, mass, even, rec, temp, heat, gained, &
                        evened)
    back = even(:n)*(old_temp(:n) - to_particles(0, g(8, :)) - to_particles(0, g(7, :)))
    want = to_particles(0, g(5, :)) - back
    call compare('particles heated', temp(:n), old_temp(:n) + want)
    call compare('particles of others', temp(n + 1:), old_temp(n + 1:))
    call compare('waiting heat spent', heat, merge(0.0_rp, old_heat, order_of_lanes() <= n))
    call expect_close('heat gained', gained, &
                      2.0_rp + sum(mass(:n)*c_p(:n)*want - old_heat(:n)), atol=1.0e-9_rp)
    call expect_close('heat evened out', evened, 3.0_rp - sum(mass(:n)*c_p(:n)*back), &
                      atol=1.0e-9_rp)
  end subroutine test_heating

  pure function order_of_lanes() result(order)
    integer :: order(nlane), p

    order = [(p, p=1, nlane)]
  end function order_of_lanes

  !> Lanes 1:4 by first moments, lanes 5:8 by slopes, half lengths of each particle's own.
  subroutine test_affine()
    real(rp) :: d(0:3), edges(3), g(8, nn), l(nlane, 3), moment(nlane, 18), own(nlane, 18)
    real(rp) :: square(nlane, 3), want(8, nn)
    real(rp), allocatable :: sums(:, :, :)
    integer :: corner(nlane), f, i, p

    l = spread([0.25_rp, 0.4_rp, 0.5_rp], 1, nlane)
    call own_weights(origin, 1.0_rp/h, l, stride, x, own, corner)
    call compare('own weights', [own], [w])
    call moment_weights(origin, h, x, w, moment, square)
    allocate (sums(0:3, nn, nlane), source=0.0_rp)
    edges = 0.0_rp
    do p = 1, n
      do i = 1, nn
        d = [1.0_rp, origin + h*corner_of(i) - x(p, :)]
        sums(:, i, p) = s(0, i, p)*d
        edges = edges + s(0, i, p)*d(1:3)**2
      end do
    end do
    call expect_close('second moments', sum(square(:n, :)), sum(edges), rtol=1.0e-12_rp)
    call random_number(rec)
    g = 0.0_rp
    want = 0.0_rp
    call p2g_affine_block(n, w, moment, first, rec, stride, nn, g)
    do p = 1, n
      do f = 1, 8
        if (f <= 4) want(f, :) = want(f, :) + matmul(rec(f, :, p), sums(:, :, p))
        if (f > 4) want(f, :) = want(f, :) + matmul(rec(f, :, p), s(:, :, p))
      end do
    end do
    call compare('affine momentum', [g(1:4, :)], [want(1:4, :)])
    call compare('forces beside affine momentum', [g(5:8, :)], [want(5:8, :)])
  end subroutine test_affine

  !> Place of node `i` on the axes, from 0 [cells].
  pure function corner_of(i) result(corner)
    integer, intent(in) :: i
    integer :: corner(3)

    corner = [(i - 1)/stride(1), mod(i - 1, stride(1))/stride(2), mod(i - 1, stride(2))]
  end function corner_of

end program test_conduction
