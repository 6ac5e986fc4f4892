! SPDX-License-Identifier: MIT
!> Shape functions against textbook forms; the two transfers against a plain loop over nodes.
program test_transfer
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use transfer_gather, only: gather_block, lanes_t
  use transfer_kernels, only: g2p_one
  use transfer_scatter, only: p2g_block, p2g_values_block
  use transfer_weights, only: block_weights
  implicit none (type, external)

  integer, parameter :: n_node(3) = [7, 6, 8]
  integer, parameter :: stride(3) = [n_node(2)*n_node(3), n_node(3), 1]
  integer, parameter :: nn = n_node(1)*n_node(2)*n_node(3)
  integer, parameter :: kind_gimp = 1, kind_spline = 2, kind_hat = 3
  real(rp), parameter :: origin(3) = [0.3_rp, -0.2_rp, 1.1_rp]
  real(rp), parameter :: h(3) = [0.05_rp, 0.11_rp, 0.023_rp]    !! edges of a cell

  call begin_tests()
  call random_init(.true., .false.)
  call test_weights('uGIMP', 0.25_rp, kind_gimp, 1.0e-12_rp)
  call test_weights('uGIMP, l = 1/8', 0.125_rp, kind_gimp, 1.0e-12_rp)
  call test_weights('B-spline', 0.5_rp, kind_spline, 1.0e-12_rp)
  call test_weights('short domain', 1.0e-3_rp, kind_hat, 5.1e-4_rp)
  call test_linear_fields()
  call test_to_grid(nlane, [1.0_rp, 1.0_rp, 1.0_rp])
  call test_to_grid(5, [1.0_rp, 1.0_rp, 1.0_rp])
  call test_to_grid(nlane, [0.2_rp, 0.0_rp, 0.3_rp])
  call test_to_grid(nlane - 1, [0.0_rp, 0.0_rp, 0.05_rp])
  call test_to_grid(nlane - 2)
  call test_from_grid(nlane)
  call test_from_grid(5)
  call test_gather(nlane)
  call test_gather(nlane - 3)
  call test_gather(5)
  call test_transpose()
  call end_tests()

contains

  !> Random places at least one cell inside the patch, or in the lower part of that only.
  subroutine random_places(x, part)
    real(rp), intent(out) :: x(nlane, 3)
    real(rp), intent(in), optional :: part(3)
    integer :: a

    call random_number(x)
    if (present(part)) x = x*spread(part, 1, nlane)
    do a = 1, 3
      x(:, a) = origin(a) + h(a)*(1.0_rp + x(:, a)*(n_node(a) - 3))
    end do
  end subroutine random_places

  !> Random places of which 1, 2, ..., 9, 1, ... in turn have the same nodes.
  subroutine places_in_runs(x)
    real(rp), intent(out) :: x(nlane, 3)
    integer :: m, p, q

    call random_places(x)
    p = 1
    do while (p <= nlane)
      do m = 1, 9
        do q = p, min(p + m - 1, nlane)
          x(q, :) = origin + h*(nint((x(p, :) - origin)/h) + 0.3_rp*sin([1.1_rp, 2.3_rp, 3.7_rp]*q))
        end do
        p = p + m
      end do
    end do
  end subroutine places_in_runs

  !> uGIMP of half length `l`, all in cells (Bardenhagen & Kober 2004, eq. 24): value and slope.
  pure subroutine gimp(l, d, s, slope)
    real(rp), intent(in) :: l, d
    real(rp), intent(out) :: s, slope
    real(rp) :: a

    a = abs(d)
    if (a < l) then
      s = 1.0_rp - (d*d + l*l)/(2.0_rp*l)
      slope = -d/l
    else if (a < 1.0_rp - l) then
      s = 1.0_rp - a
      slope = -sign(1.0_rp, d)
    else if (a < 1.0_rp + l) then
      s = (1.0_rp + l - a)**2/(4.0_rp*l)
      slope = -sign(1.0_rp, d)*(1.0_rp + l - a)/(2.0_rp*l)
    else
      s = 0.0_rp
      slope = 0.0_rp
    end if
  end subroutine gimp

  !> Quadratic B-spline.
  pure subroutine spline(d, s, slope)
    real(rp), intent(in) :: d
    real(rp), intent(out) :: s, slope
    real(rp) :: a

    a = abs(d)
    if (a < 0.5_rp) then
      s = 0.75_rp - d*d
      slope = -2.0_rp*d
    else if (a < 1.5_rp) then
      s = 0.5_rp*(1.5_rp - a)**2
      slope = -sign(1.0_rp, d)*(1.5_rp - a)
    else
      s = 0.0_rp
      slope = 0.0_rp
    end if
  end subroutine spline

  !> Weights and slopes of node `i` (from 0) of one axis at `x`, from the formulae above.
  pure subroutine textbook(kind, l, axis, i, x, s, slope)
    integer, intent(in) :: kind, axis, i
    real(rp), intent(in) :: l, x
    real(rp), intent(out) :: s, slope
    real(rp) :: d

    d = (x - origin(axis))/h(axis) - i
    select case (kind)
    case (kind_gimp)
      call gimp(l, d, s, slope)
    case (kind_spline)
      call spline(d, s, slope)
    case default
      s = max(0.0_rp, 1.0_rp - abs(d))
      slope = merge(-sign(1.0_rp, d), 0.0_rp, abs(d) < 1.0_rp)
    end select
    slope = slope/h(axis)
  end subroutine textbook

  subroutine test_weights(name, l, kind, tolerance)
    character(*), intent(in) :: name
    real(rp), intent(in) :: l, tolerance
    integer, intent(in) :: kind
    real(rp) :: x(nlane, 3), w(nlane, 18), s, slope, d
    real(rp) :: off_sum, off_slopes, off_value, off_slope
    integer :: first(nlane), corner(3), axis, batch, i, p, q
    logical :: is_near

    off_sum = 0.0_rp
    off_slopes = 0.0_rp
    off_value = 0.0_rp
    off_slope = 0.0_rp
    is_near = .true.
    do batch = 1, 50
      call random_places(x)
      call block_weights(origin, 1.0_rp/h, spread(l, 1, 3), stride, x, w, first)
      do p = 1, nlane
        q = first(p) - 1
        corner = [q/stride(1), mod(q, stride(1))/stride(2), mod(q, stride(2))]
        do axis = 1, 3
          is_near = is_near .and. corner(axis) + 1 == nint((x(p, axis) - origin(axis))/h(axis))
          off_sum = max(off_sum, abs(sum(w(p, 3*axis - 2:3*axis)) - 1.0_rp))
          off_slopes = max(off_slopes, abs(sum(w(p, 3*axis + 7:3*axis + 9)))*h(axis))
          do i = 1, 3
            d = (x(p, axis) - origin(axis))/h(axis) - (corner(axis) + i - 1)
            call textbook(kind, l, axis, corner(axis) + i - 1, x(p, axis), s, slope)
            off_value = max(off_value, abs(w(p, 3*(axis - 1) + i) - s))
            if (kind == kind_hat) then      ! the kink of the hat is rounded within l
              if (min(abs(d), abs(abs(d) - 1.0_rp)) < 2.0_rp*l) cycle
            end if
            off_slope = max(off_slope, abs(w(p, 9 + 3*(axis - 1) + i) - slope)*h(axis))
          end do
        end do
      end do
    end do
    call expect(name//': the stencil is that of the nearest node', is_near)
    call expect_close(name//': weights sum to 1', off_sum, 0.0_rp, atol=1.0e-14_rp)
    call expect_close(name//': slopes sum to 0', off_slopes, 0.0_rp, atol=1.0e-13_rp)
    call expect_close(name//': weights', off_value, 0.0_rp, atol=tolerance)
    call expect_close(name//': slopes', off_slope, 0.0_rp, atol=min(tolerance, 1.0e-9_rp))
  end subroutine test_weights

  !> Value and slopes of a linear field come back from the grid.
  subroutine test_linear_fields()
    real(rp), parameter :: slope(3) = [3.0_rp, -2.0_rp, 0.7_rp]
    real(rp) :: x(nlane, 3), w(nlane, 18), g(8, nn), rec(8, 4, nlane), at(3), off_value, off_slope
    integer :: first(nlane), i, j, k, p

    do i = 0, n_node(1) - 1
      do j = 0, n_node(2) - 1
        do k = 0, n_node(3) - 1
          at = origin + h*[i, j, k]
          g(:, 1 + sum([i, j, k]*stride)) = 1.0_rp + dot_product(slope, at)
        end do
      end do
    end do
    call random_places(x)
    call block_weights(origin, 1.0_rp/h, spread(0.25_rp, 1, 3), stride, x, w, first)
    rec = 0.0_rp
    do p = 1, nlane
      call g2p_one(p, w, first, stride, nn, g, rec)
    end do
    off_value = 0.0_rp
    off_slope = 0.0_rp
    do p = 1, nlane
      off_value = max(off_value, maxval(abs(rec(:, 1, p) - 1.0_rp - dot_product(slope, x(p, :)))))
      off_slope = max(off_slope, maxval(abs(rec(1:4, 2:4, p) - spread(slope, 1, 4))))
    end do
    call expect_close('value of a linear field', off_value, 0.0_rp, atol=1.0e-13_rp)
    call expect_close('slope of a linear field', off_slope, 0.0_rp, atol=1.0e-11_rp)
  end subroutine test_linear_fields

  !> Weight (0) and slopes (1:3) of node (i,j,k) at `x`, by the textbook.
  pure function node_weights(i, j, k, x) result(s)
    integer, intent(in) :: i, j, k
    real(rp), intent(in) :: x(3)
    real(rp) :: s(0:3), v(3), g(3)

    call textbook(kind_gimp, 0.25_rp, 1, i, x(1), v(1), g(1))
    call textbook(kind_gimp, 0.25_rp, 2, j, x(2), v(2), g(2))
    call textbook(kind_gimp, 0.25_rp, 3, k, x(3), v(3), g(3))
    s = [v(1)*v(2)*v(3), g(1)*v(2)*v(3), v(1)*g(2)*v(3), v(1)*v(2)*g(3)]
  end function node_weights

  !> Random records of n particles to a grid that holds something, against a loop over all nodes,
  !> and their values alone; particles in a small part share their stencils, those in no part are in
  !> runs.
  subroutine test_to_grid(n, part)
    integer, intent(in) :: n
    real(rp), intent(in), optional :: part(3)
    real(rp) :: x(nlane, 3), w(nlane, 18), g(8, nn), want(8, nn), rec(8, 4, nlane), s(0:3), total(8)
    real(rp) :: values(8, nn)
    integer :: first(nlane), f, i, j, k, p, q

    if (present(part)) then
      call random_places(x, part)
    else
      call places_in_runs(x)
    end if
    call block_weights(origin, 1.0_rp/h, spread(0.25_rp, 1, 3), stride, x, w, first)
    call random_number(rec)
    rec = rec - 0.5_rp
    rec(1:4, 2:4, :) = 0.0_rp                ! as the transfer asks for
    call random_number(g)
    want = g
    values = g
    total = sum(g, 2)
    do i = 0, n_node(1) - 1
      do j = 0, n_node(2) - 1
        do k = 0, n_node(3) - 1
          q = 1 + sum([i, j, k]*stride)
          do p = 1, n
            s = node_weights(i, j, k, x(p, :))
            want(1:4, q) = want(1:4, q) + s(0)*rec(1:4, 1, p)
            do f = 5, 8
              want(f, q) = want(f, q) + dot_product(s, rec(f, :, p))
            end do
          end do
        end do
      end do
    end do
    call p2g_block(n, w, first, rec, stride, nn, g)
    call expect_close('to the grid', maxval(abs(g - want))/maxval(abs(want)), 0.0_rp, &
                      atol=1.0e-13_rp)
    call p2g_values_block(n, w, first, rec, stride, nn, values)
    call expect_close('values to the grid', &
                      maxval(abs(values(1:4, :) - want(1:4, :)))/maxval(abs(want(1:4, :))), &
                      0.0_rp, atol=1.0e-13_rp)
    total = total + sum(rec(:, 1, 1:n), 2)
    call expect_close('sums are conserved', maxval(abs(sum(g, 2) - total))/maxval(abs(total)), &
                      0.0_rp, atol=1.0e-13_rp)
  end subroutine test_to_grid

  !> Velocities at n particles, of which up to nine in turn have the same nodes, are those that come
  !> back one particle at a time.
  subroutine test_gather(n)
    integer, intent(in) :: n
    real(rp) :: x(nlane, 3), w(nlane, 18), g(8, nn), rec(8, 4, nlane), scratch(8, 4, nlane)
    real(rp) :: v(nlane, 3), dv(nlane, 3), l(nlane, 9), off(3)
    integer :: first(nlane), p

    call places_in_runs(x)
    call block_weights(origin, 1.0_rp/h, spread(0.25_rp, 1, 3), stride, x, w, first)
    call expect('runs of the same nodes', count(first(2:) == first(:nlane - 1)) >= nlane/2)
    call random_number(g)
    g = g - 0.5_rp
    rec = 0.0_rp
    do p = 1, n
      call g2p_one(p, w, first, stride, nn, g, rec)
    end do
    call gather_block(lanes_t(1, 3, 5, 3), n, w, first, stride, nn, g, scratch, v, l, dv)
    off = 0.0_rp
    do p = 1, n
      off(1) = max(off(1), maxval(abs(v(p, :) - rec(1:3, 1, p))))
      off(2) = max(off(2), maxval(abs(dv(p, :) - rec(5:7, 1, p))))
      off(3) = max(off(3), maxval(abs(reshape(l(p, :), [3, 3]) &
                               - transpose(rec(1:3, 2:4, p))))*minval(h))
    end do
    call expect_close('gathered velocities', off(1), 0.0_rp, atol=1.0e-14_rp)
    call expect_close('gathered changes of velocity', off(2), 0.0_rp, atol=1.0e-14_rp)
    call expect_close('gathered gradients', off(3), 0.0_rp, atol=1.0e-13_rp)
  end subroutine test_gather

  !> Random node records to n particles, against a loop over all nodes.
  subroutine test_from_grid(n)
    integer, intent(in) :: n
    real(rp) :: x(nlane, 3), w(nlane, 18), g(8, nn), rec(8, 4, nlane), want(8, 4), s(0:3)
    real(rp) :: off_value, off_slope
    integer :: first(nlane), i, j, k, p, q

    call random_places(x)
    call block_weights(origin, 1.0_rp/h, spread(0.25_rp, 1, 3), stride, x, w, first)
    call random_number(g)
    g = g - 0.5_rp
    rec = 7.0_rp
    do p = 1, n
      call g2p_one(p, w, first, stride, nn, g, rec)
    end do
    off_value = 0.0_rp
    off_slope = 0.0_rp
    do p = 1, n
      want = 0.0_rp
      do i = 0, n_node(1) - 1
        do j = 0, n_node(2) - 1
          do k = 0, n_node(3) - 1
            q = 1 + sum([i, j, k]*stride)
            s = node_weights(i, j, k, x(p, :))
            want = want + spread(g(:, q), 2, 4)*spread(s, 1, 8)
          end do
        end do
      end do
      off_value = max(off_value, maxval(abs(rec(:, 1, p) - want(:, 1))))
      off_slope = max(off_slope, maxval(abs(rec(1:4, 2:4, p) - want(1:4, 2:4)))*minval(h))
    end do
    call expect_close('values from the grid', off_value, 0.0_rp, atol=1.0e-13_rp)
    call expect_close('slopes from the grid', off_slope, 0.0_rp, atol=1.0e-13_rp)
    if (n < nlane) call expect('lanes without particles are left alone', &
                               all(rec(:, :, n + 1:) == 7.0_rp))
  end subroutine test_from_grid

  !> The two transfers are transposes of each other: sum_i (P r)_i g_i = sum_p r_p (P^T g)_p.
  subroutine test_transpose()
    real(rp) :: x(nlane, 3), w(nlane, 18), g(8, nn), sums(8, nn), rec(8, 4, nlane)
    real(rp) :: back(8, 4, nlane)
    integer :: first(nlane), p

    call random_places(x)
    call block_weights(origin, 1.0_rp/h, spread(0.4_rp, 1, 3), stride, x, w, first)
    call random_number(rec)
    rec(1:4, 2:4, :) = 0.0_rp
    call random_number(g)
    sums = 0.0_rp
    back = 0.0_rp
    call p2g_block(nlane, w, first, rec, stride, nn, sums)
    do p = 1, nlane
      call g2p_one(p, w, first, stride, nn, g, back)
    end do
    call expect_close('transposes', sum(sums(1:4, :)*g(1:4, :)), &
                      sum(rec(1:4, 1, :)*back(1:4, 1, :)), rtol=1.0e-13_rp)
  end subroutine test_transpose

end program test_transfer
