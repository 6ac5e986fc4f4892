! SPDX-License-Identifier: MIT
!> Factor on the squared wave speed of particles with short domains (cpGIMP) against eigenvalues: of
!> one particle whose faces enter nodes, and of columns of particles of different lengths.
program test_stability
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use mpm_stability, only: domain_factor
  use transfer_weights, only: own_weights
  implicit none (type, external)

  integer, parameter :: n_node = 12
  integer, parameter :: stride(3) = [n_node**2, n_node, 1]
  real(rp), parameter :: cubes(3) = 1.0e-3_rp   !! edges of cells [m]

  call begin_tests()
  call random_init(.true., .false.)
  call test_equal_lengths()
  call test_lengths()
  call test_columns()
  call end_tests()

contains

  !> Largest squared frequency of a particle alone, over that of pressure waves c^2/h^2 with the
  !> shortest edge h: the greatest eigenvalue of B M^-1 B^T D with the masses m w of its nodes, the
  !> gradient B of their velocities and the moduli D of Poisson's ratio 1/3.
  real(rp) function frequency2(edge, half, offset)
    real(rp), intent(in) :: edge(3), half(3), offset(3)  !! [m], [cells], from a node [cells]
    real(rp) :: x(nlane, 3), w(nlane, 18), l(nlane, 3), b(3, 27), weight(27), u(3, 27), e(3, 3)
    integer :: first(nlane), a, i, j, k, node

    x = spread(edge*(5.0_rp + offset), 1, nlane)
    l = spread(half, 1, nlane)
    call own_weights([0.0_rp, 0.0_rp, 0.0_rp], 1.0_rp/edge, l, stride, x, w, first)
    node = 0
    do i = 1, 3
      do j = 4, 6
        do k = 7, 9
          node = node + 1
          weight(node) = w(1, i)*w(1, j)*w(1, k)
          b(:, node) = [w(1, i + 9)*w(1, j)*w(1, k), w(1, i)*w(1, j + 9)*w(1, k), &
                        w(1, i)*w(1, j)*w(1, k + 9)]
        end do
      end do
    end do
    e = reshape([1.0_rp, 0.1_rp, 0.2_rp, 0.1_rp, 1.1_rp, 0.3_rp, 0.2_rp, 0.3_rp, 0.9_rp], [3, 3])
    do k = 1, 500
      e = e/norm2(e)
      do node = 1, 27        ! lambda = 1/2, mu = 1/4: lambda + 2 mu = 1
        u(:, node) = 0.5_rp*(e(1, 1) + e(2, 2) + e(3, 3))*b(:, node) &
                     + 0.25_rp*matmul(e + transpose(e), b(:, node))
        u(:, node) = u(:, node)/max(weight(node), tiny(1.0_rp))
      end do
      do a = 1, 3
        e(a, :) = [(dot_product(u(a, :), b(j, :)), j=1, 3)]
      end do
    end do
    frequency2 = norm2(e)*minval(edge)**2
  end function frequency2

  real(rp) function factor(edge, half)
    real(rp), intent(in) :: edge(3), half(3)
    real(rp) :: one(1)

    one = domain_factor(edge, reshape(half, [1, 3]))
    factor = one(1)
  end function factor

  !> Exact: equal lengths on all axes, each face just inside the reach of a node.
  subroutine test_equal_lengths()
    real(rp), parameter :: half(4) = [0.25_rp, 0.15_rp, 0.1_rp, 0.05_rp]
    real(rp), parameter :: inside = 1.0_rp - 1.0e-7_rp
    real(rp) :: at_start
    integer :: k

    at_start = frequency2(cubes, spread(half(1), 1, 3), spread(inside*half(1), 1, 3))
    do k = 1, size(half)
      associate (l => spread(half(k), 1, 3))
        call expect_close('one particle', frequency2(cubes, l, inside*l)/at_start, &
                          factor(cubes, l), rtol=1.0e-5_rp)
      end associate
    end do
    call expect_close('long domain', factor(cubes, [0.5_rp, 0.3_rp, 0.25_rp]), 1.0_rp)
  end subroutine test_equal_lengths

  !> Random lengths and edges: no place has a higher frequency than the factor says, which is at
  !> most a fifth above that where the faces enter nodes.
  subroutine test_lengths()
    real(rp) :: edge(3), half(3), offset(3), at_start, found
    logical :: is_bound, is_close
    integer :: k

    at_start = frequency2(cubes, spread(0.25_rp, 1, 3), spread(0.25_rp*(1.0_rp - 1.0e-7_rp), 1, 3))
    is_bound = .true.
    is_close = .true.
    do k = 1, 500
      call random_number(edge)
      call random_number(half)
      call random_number(offset)
      edge = 1.0e-3_rp*(1.0_rp + 2.0_rp*edge)
      half = 0.05_rp + 0.45_rp*half**2
      found = factor(edge, half)
      is_bound = is_bound .and. frequency2(edge, half, offset - 0.5_rp) <= found*at_start
      if (found > 1.0_rp) is_close = is_close .and. &
        frequency2(edge, half, half*(1.0_rp - 1.0e-7_rp)) > found*at_start/1.2_rp
    end do
    call expect('bound of the frequency', is_bound)
    call expect('closeness of the bound', is_close)
  end subroutine test_lengths

  !> Columns of particles, strained along the axis. Random lengths at random offsets: the squared
  !> step that the shortest one allows, 4/(c^2 largest sum of slope^2/weight), is at most the stable
  !> one, 4/omega^2. Equal lengths, with the lower face entering a node: it is at least 0.4 of that.
  subroutine test_columns()
    integer, parameter :: n = 20
    real(rp) :: length(n), x(nlane, 3), l(nlane, 3), omega2, limit
    logical :: is_stable
    integer :: k, p

    is_stable = .true.
    do k = 1, 200
      call random_number(length)
      length = 0.1_rp + 0.3_rp*length**3
      call random_number(x(1, 1))
      x(1, 1) = 2.0_rp + x(1, 1)
      if (mod(k, 2) == 0) length = length(1)
      if (mod(k, 2) == 0) x(1, 1) = 2.0_rp + (0.5_rp - 1.0e-3_rp)*length(1)
      do p = 2, n
        x(p, 1) = x(p - 1, 1) + 0.5_rp*(length(p - 1) + length(p))
      end do
      x(n + 1:, 1) = x(1, 1)
      x(:, 2:) = 5.0_rp
      l(:, 2:) = 0.5_rp
      l(:n, 1) = 0.5_rp*length
      l(n + 1:, 1) = 0.5_rp
      omega2 = column(n, x, l)
      limit = 2.0_rp/minval(l(:n, 1)) + 1.0_rp/(1.0_rp - minval(l(:n, 1)))
      is_stable = is_stable .and. omega2 <= limit
      if (mod(k, 2) == 0) is_stable = is_stable .and. omega2 > 0.4_rp*limit
    end do
    call expect('stable step of columns', is_stable)
  end subroutine test_columns

  !> Largest squared frequency of a column of `n` particles along x over c^2/h^2, in cells of 1 m.
  real(rp) function column(n, x, l)
    integer, intent(in) :: n
    real(rp), intent(in) :: x(nlane, 3), l(nlane, 3)
    real(rp) :: w(nlane, 18), mass(0:n_node), v(0:n_node), f(0:n_node)
    integer :: first(nlane), at(nlane), k, p

    call own_weights([0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp], l, stride, x, w, first)
    at = nint(x(:, 1))
    mass = 0.0_rp
    do p = 1, n
      mass(at(p) - 1:at(p) + 1) = mass(at(p) - 1:at(p) + 1) + l(p, 1)*w(p, 1:3)
    end do
    call random_number(v)
    do k = 1, 500
      v = v/norm2(v)
      f = 0.0_rp
      do p = 1, n
        associate (span => f(at(p) - 1:at(p) + 1), slope => w(p, 10:12))
          span = span + l(p, 1)*slope*dot_product(slope, v(at(p) - 1:at(p) + 1))
        end associate
      end do
      v = merge(f/max(mass, tiny(1.0_rp)), 0.0_rp, mass > 1.0e-12_rp)
    end do
    column = norm2(v)
  end function column

end program test_stability
