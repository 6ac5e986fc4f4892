! SPDX-License-Identifier: MIT
!> Processor time of the kernels alone on blocks of 8 particles a cell, in the cache, as one JSON
!> object: ns per particle of weights, transfers and stress, and what the core can do at most:
!> multiply-adds in registers.
program kernels
  use, intrinsic :: iso_fortran_env, only: output_unit
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned
  use base_text, only: str
  use base_timers, only: cpu_seconds
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_material, only: material_t
  use physics_stress, only: advance_stress, stress_sums_t
  use transfer_gather, only: gather_block, lanes_t
  use transfer_scatter, only: p2g_block
  use transfer_weights, only: block_weights
  implicit none (type, external)

  integer, parameter :: nc = 8                       ! blocks: 8 cells in a row, nc x nc x nc/8
  integer, parameter :: n(3) = nc + 4, nn = product(n), stride(3) = [n(3)*n(2), n(3), 1]
  integer, parameter :: nblk = nc**3/8, rounds = 200
  real(rp), pointer, contiguous :: memory(:), g(:, :)
  real(rp), allocatable :: x(:, :, :), w(:, :, :), rec(:, :, :)
  integer, allocatable :: first(:, :)
  real(rp) :: ns(5)

  call allocate_aligned(int(8*nn, i8), memory)
  g(1:8, 1:nn) => memory
  allocate (x(nlane, 3, nblk), w(nlane, 18, nblk), first(nlane, nblk), rec(8, 4, nlane))
  call place(x)
  call random_number(rec)
  rec(1:4, 2:4, :) = 0.0_rp
  ns(1:3) = huge(1.0_rp)
  call time_transfers(ns(1:3))
  ns(4) = stress_time(5.0e4_rp)
  ns(5) = stress_time(0.0_rp)
  write (output_unit, '(a)') '{"scene": "kernels", "weights_ns": '//str(ns(1))// &
    ', "to_grid_ns": '//str(ns(2))//', "from_grid_ns": '//str(ns(3))//', "stress_plastic_ns": ' &
    //str(ns(4))//', "stress_elastic_ns": '//str(ns(5)) &
    //', "multiply_add_gflops": '//str(peak())//'}'

contains

  !> A lattice with some disorder, cell by cell along z.
  subroutine place(x)
    real(rp), intent(out) :: x(:, :, :)
    real(rp) :: r(3)
    integer :: b, c, p

    do b = 1, nblk
      do p = 1, nlane
        c = (b - 1)*8 + (p - 1)/8
        call random_number(r)
        x(p, :, b) = 2.0_rp + [c/nc**2, mod(c/nc, nc), mod(c, nc)] &
                     + 0.5_rp*([mod(p, 2), mod(p/2, 2), mod(p/4, 2)] + 0.4_rp*r + 0.3_rp) - 0.5_rp
      end do
    end do
  end subroutine place

  !> Least times of weights, particles to grid, grid to particles [ns].
  subroutine time_transfers(best)
    real(rp), intent(inout) :: best(3)
    real(rp) :: t(4), scratch(8, 4, nlane), v(nlane, 3), dv(nlane, 3), l(nlane, 9)
    integer :: b, round

    do round = 1, rounds
      t(1) = cpu_seconds()
      do b = 1, nblk
        call block_weights([0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp], &
                           spread(0.25_rp, 1, 3), stride, x(:, :, b), w(:, :, b), first(:, b))
      end do
      t(2) = cpu_seconds()
      do b = 1, nblk
        call p2g_block(nlane, w(:, :, b), first(:, b), rec, stride, nn, memory)
      end do
      t(3) = cpu_seconds()
      do b = 1, nblk
        call gather_block(lanes_t(1, 3, 5, 3), nlane, w(:, :, b), first(:, b), stride, nn, &
                          memory, scratch, v, l, dv)
      end do
      t(4) = cpu_seconds()
      best = min(best, (t(2:4) - t(1:3))*1.0e9_rp/(nlane*nblk))
      memory = 0.0_rp
    end do
  end subroutine time_transfers

  !> Least time of the stress update of copper at a shear rate [ns].
  real(rp) function stress_time(shear) result(best)
    real(rp), intent(in) :: shear                    !! [1/s]
    type(material_t) :: copper
    type(johnson_cook_t) :: law
    type(stress_sums_t) :: sums
    real(rp) :: no_state(nlane, 0), t, l(nlane, 9), bb(nlane, 6), tau(nlane, 6)
    real(rp), dimension(nlane) :: temp, mass, j, alpha, rate, flow
    integer :: round, step

    call copper%set_elastic(124.0e9_rp, 0.34_rp)
    copper%rho = 8960.0_rp
    copper%c_p = 386.0_rp
    law = johnson_cook_t(a=90.0e6_rp, b=292.0e6_rp, n=0.31_rp, c=0.025_rp, m=1.09_rp, &
                         t_melt=1356.0_rp)
    allocate (copper%flow, source=law)
    l = 0.0_rp
    l(:, 2) = shear
    mass = 1.0e-6_rp
    best = huge(1.0_rp)
    do round = 1, rounds
      bb = spread([1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp], 1, nlane)
      temp = 350.0_rp
      j = 1.0_rp
      alpha = 0.0_rp
      rate = 0.0_rp
      tau = 0.0_rp
      flow = 0.0_rp
      t = cpu_seconds()
      do step = 1, 200
        call advance_stress(copper, nlane, 2.0e-8_rp, l, temp, mass, bb, j, alpha, temp, tau, &
                            rate, &
                            flow, 0, no_state, sums)
      end do
      best = min(best, (cpu_seconds() - t)*1.0e9_rp/(200*nlane))
    end do
  end function stress_time

  !> Most operations per time of chains of multiply-adds [10^9/s].
  real(rp) function peak() result(best)
    integer, parameter :: chain = 16, repeats = 10000
    real(rp) :: a(nlane), c, d, s, t
    integer :: i, round, k

    call random_number(a)
    call random_number(c)
    d = 1.0_rp - c
    best = 0.0_rp
    do round = 1, rounds
      t = cpu_seconds()
      do k = 1, repeats
        !$omp simd private(s)
        do i = 1, nlane
          s = a(i)
          s = c*s + d; s = c*s + d; s = c*s + d; s = c*s + d
          s = c*s + d; s = c*s + d; s = c*s + d; s = c*s + d
          s = c*s + d; s = c*s + d; s = c*s + d; s = c*s + d
          s = c*s + d; s = c*s + d; s = c*s + d; s = c*s + d
          a(i) = s
        end do
      end do
      best = max(best, 2.0e-9_rp*chain*nlane*repeats/(cpu_seconds() - t))
    end do
    if (any(a > 1.1_rp)) error stop 'kernels: multiply-adds'
  end function peak

end program kernels
