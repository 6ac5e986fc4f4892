! SPDX-License-Identifier: MIT
!> The velocity filter of XPIC and FMPM: against its series, linear fields, and PIC.
program test_filter
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use node_samples, only: gather_nodes, gather_particles, map_particles, set_velocity, &
                          shake_nodes, step_once
  use particles_store, only: f_mass, f_pos
  use state_parts, only: free_simulation, simulation_t
  use state_scene, only: transfer_fmpm, transfer_xpic
  use step_constraints, only: apply_boundary
  use step_filter, only: filter_velocity
  use step_samples, only: add_clamp, fill, h, settle, shake, start_scene
  implicit none (type, external)

  integer, parameter :: margin = 3
  real(rp), parameter :: far = 1.0e9_rp
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_linear_field()
  call test_series()
  call test_held()
  call test_first_order()
  call end_tests()

contains

  !> A block of `cells`; nodes have the mass of its particles.
  subroutine prepare(sim, cells, transfer, order, spread)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: cells(3), transfer, order
    real(rp), intent(in) :: spread               !! of the particles' masses
    real(rp) :: corner(3)

    call random_number(corner)
    call start_scene(sim, cells, margin, 1)
    sim%scene%method%transfer = transfer
    sim%scene%method%order = order
    sim%clock%mass_scaling = 3.0_rp
    call fill(world, sim, 1, corner, corner + cells, 2)
    call shake(sim, 0.0_rp, spread)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
  end subroutine prepare

  !> A linear field stays as it is wherever an even lattice is all around.
  subroutine test_linear_field()
    type(simulation_t) :: sim
    real(rp), allocatable :: g(:, :, :, :)
    real(rp) :: l(3, 3), off, v(3), x(3)
    integer :: i, j, k, order

    do order = 2, 4
      call prepare(sim, [10, 10, 10], merge(transfer_xpic, transfer_fmpm, order == 3), order, &
                   0.0_rp)
      call random_number(l)
      call random_number(v)
      l = (l - 0.5_rp)/h
      call set_velocity(sim%nodes, v, l, sim%nodes%g(:, :, 1))
      call filter_velocity(sim, sim%nodes%g, sim%nodes%g2, sim%nodes%increment)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g)
      off = 0.0_rp
      do k = margin + 2*order - 1, margin + 12 - 2*order
        do j = margin + 2*order - 1, margin + 12 - 2*order
          do i = margin + 2*order - 1, margin + 12 - 2*order
            x = sim%scene%grid%lower + h*[i, j, k]
            off = max(off, norm2(g(1:3, i, j, k) - v - matmul(l, x)))
          end do
        end do
      end do
      call expect_close('a linear field stays', off, 0.0_rp, atol=1.0e-12_rp)
      call free_simulation(sim)
    end do
  end subroutine test_linear_field

  !> v + A u + A^2 u + .., where A takes away what particles see of nodes: u is v, or that before
  !> the step (XPIC). Masses are random.
  subroutine test_series()
    integer, parameter :: cells(3) = [3, 2, 2], n = 8*product(cells)
    type(simulation_t) :: sim
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :), d(:, :, :, :)
    real(rp) :: ps(4, n)
    integer :: a, k, order

    do order = 1, 4
      do k = transfer_xpic, transfer_fmpm
        call prepare(sim, cells, k, order, 0.4_rp)
        call shake_nodes(sim%nodes, 10.0_rp, 3.0_rp, 1, sim%nodes%g(:, :, 1))
        call gather_particles(world, sim, 1, f_pos, n, ps)
        call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g1)
        call filter_velocity(sim, sim%nodes%g, sim%nodes%g2, sim%nodes%increment)
        call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g2)
        d = g1(1:3, :, :, :)
        if (k == transfer_xpic) d = d - g1(5:7, :, :, :)
        do a = 2, order
          call subtract_seen(ps, d)
          g1(1:3, :, :, :) = g1(1:3, :, :, :) + d
        end do
        call expect_close('velocities of the series', maxval(abs(g1(1:3, :, :, :) &
                          - g2(1:3, :, :, :)), mask=spread(g1(8, :, :, :), 1, 3) > 0.0_rp), &
                          0.0_rp, atol=1.0e-10_rp)
        call expect('nothing else changes', all(abs(g1(4:8, :, :, :) - g2(4:8, :, :, :)) <= 0.0_rp))
        call free_simulation(sim)
      end do
    end do
  end subroutine test_series

  !> d - S+ S d, with S from nodes to particles and S+ back by their masses.
  subroutine subtract_seen(ps, d)
    real(rp), intent(in) :: ps(:, :)             !! place, mass
    real(rp), intent(inout) :: d(:, 0:, 0:, 0:)
    real(rp) :: momentum(3, 0:ubound(d, 2), 0:ubound(d, 3), 0:ubound(d, 4))
    real(rp), dimension(0:ubound(d, 2), 0:ubound(d, 3), 0:ubound(d, 4)) :: mass, w
    integer :: a, i, j, k, p

    momentum = 0.0_rp
    mass = 0.0_rp
    do p = 1, size(ps, 2)
      do k = 0, ubound(d, 4)
        do j = 0, ubound(d, 3)
          do i = 0, ubound(d, 2)
            w(i, j, k) = product(shape_of(ps(f_pos:f_pos + 2, p)/h - ([i, j, k] - margin)))
          end do
        end do
      end do
      mass = mass + ps(f_mass, p)*w
      do a = 1, 3
        momentum(a, :, :, :) = momentum(a, :, :, :) + ps(f_mass, p)*w*sum(w*d(a, :, :, :))
      end do
    end do
    do a = 1, 3
      where (mass > 0.0_rp) d(a, :, :, :) = d(a, :, :, :) - momentum(a, :, :, :)/mass
    end do
  end subroutine subtract_seen

  !> A linear shape function, averaged over a particle half a cell wide.
  elemental real(rp) function shape_of(x) result(s)
    real(rp), intent(in) :: x                    !! [cells]

    s = 2.0_rp*(integral(x + 0.25_rp) - integral(x - 0.25_rp))
  end function shape_of

  elemental real(rp) function integral(x)
    real(rp), intent(in) :: x

    integral = sign(0.5_rp, x)
    if (abs(x) < 1.0_rp) integral = x - 0.5_rp*x*abs(x)
  end function integral

  !> Nodes in a clamp keep its velocity.
  subroutine test_held()
    type(simulation_t) :: sim
    real(rp), parameter :: v(3) = [1.0_rp, -2.0_rp, 3.0_rp]
    real(rp), allocatable :: g(:, :, :, :)
    integer :: order

    do order = 2, 3
      call start_scene(sim, [4, 2, 2], margin, 1)
      call add_clamp(sim, [-far, -far, -far], [1.0_rp, far, far], [.true., .false., .true.], v)
      sim%scene%method%transfer = transfer_fmpm
      sim%scene%method%order = order
      call fill(world, sim, 1, [0.0_rp, 0.0_rp, 0.0_rp], [4.0_rp, 2.0_rp, 2.0_rp], 2)
      call shake(sim, 10.0_rp, 0.2_rp)
      call settle(world, sim)
      call map_particles(world, sim, 0.0_rp, sim%nodes%g)
      call apply_boundary(sim, 1.0e-6_rp, sim%nodes%g, .false.)
      call filter_velocity(sim, sim%nodes%g, sim%nodes%g2, sim%nodes%increment)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g)
      associate (held => g(:, 3:4, 3:5, 3:5))    ! x from 0 to 1
        call expect('held nodes', all(abs(held(1, :, :, :) - v(1)) + abs(held(3, :, :, :) - v(3)) &
                                      <= 0.0_rp) .and. any(abs(held(2, :, :, :) - v(2)) > 0.1_rp))
      end associate
      call free_simulation(sim)
    end do
  end subroutine test_held

  !> The first order is PIC, bit for bit.
  subroutine test_first_order()
    type(simulation_t) :: sim, pic
    integer :: k, step

    do k = transfer_xpic, transfer_fmpm
      call start_scene(sim, [3, 2, 2], margin, 1)
      call start_scene(pic, [3, 2, 2], margin, 1)
      sim%scene%method%transfer = k
      sim%scene%method%order = 1
      pic%scene%method%pic = 1.0_rp
      call fill(world, sim, 1, [0.1_rp, 0.0_rp, 0.2_rp], [3.1_rp, 2.0_rp, 2.2_rp], 2)
      call fill(world, pic, 1, [0.1_rp, 0.0_rp, 0.2_rp], [3.1_rp, 2.0_rp, 2.2_rp], 2)
      call shake(sim, 10.0_rp, 0.2_rp)
      call shake(pic, 10.0_rp, 0.2_rp)
      call settle(world, sim)
      call settle(world, pic)
      do step = 1, 2
        call step_once(world, sim, 1.0e-7_rp)
        call step_once(world, pic, 1.0e-7_rp)
      end do
      associate (n => sim%particles%nblk)
        call expect('first order is PIC', &
                    all(abs(sim%particles%ps(:, :, :n) - pic%particles%ps(:, :, :n)) <= 0.0_rp))
      end associate
      call free_simulation(sim)
      call free_simulation(pic)
    end do
  end subroutine test_first_order

end program test_filter
