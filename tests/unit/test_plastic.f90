! SPDX-License-Identifier: MIT
!> Plasticity: Johnson-Cook's reference points, large strains, heat, and lanes that do not know
!> each other.
program test_plastic
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_law_norton, only: norton_t
  use physics_material, only: material_t
  use physics_return_map, only: default_min_rate
  use physics_stress, only: advance_stress, stress_sums_t
  implicit none (type, external)

  real(rp) :: none(nlane, 0)   !! no internal variables
  !> State of one block.
  type :: block_t
    real(rp) :: b(nlane, 6), j(nlane), alpha(nlane), temp(nlane), tau(nlane, 6)
    real(rp) :: rate(nlane), flow(nlane), mass(nlane), l(nlane, 9)
    logical :: is_isothermal = .false.
  end type block_t

  type(material_t) :: copper, elastic

  elastic%rho = 8960.0_rp
  elastic%c_p = 386.0_rp
  call elastic%set_elastic(124.0e9_rp, 0.34_rp)
  copper = elastic
  allocate (copper%flow, source=johnson_cook_t(a=90.0e6_rp, b=292.0e6_rp, n=0.31_rp, c=0.025_rp, &
                                               m=1.09_rp, t_melt=1356.0_rp))

  call begin_tests()
  call random_init(.true., .false.)
  call test_reference_points()
  call test_large_strain()
  call test_elastic_block()
  call test_mixed_lanes()
  call test_lane_order()
  call test_heat_and_work()
  call test_work_of_any_load()
  call end_tests()

contains

  !> Johnson-Cook with the parameters of copper, in plain words; 1e-9 is the law's least strain.
  pure real(rp) function flow_stress(strain, rate, temp)
    real(rp), intent(in) :: strain, rate, temp
    real(rp) :: theta

    theta = max(0.0_rp, min(1.0_rp, (temp - 298.0_rp)/(1356.0_rp - 298.0_rp)))
    flow_stress = (90.0e6_rp + 292.0e6_rp*(strain + 1.0e-9_rp)**0.31_rp) &
                  *max(0.5_rp, 1.0_rp + 0.025_rp*log(rate))*(1.0_rp - theta**1.09_rp)
  end function flow_stress

  !> Undeformed block at temperature `temp`.
  subroutine reset(blk, temp)
    type(block_t), intent(out) :: blk
    real(rp), intent(in) :: temp

    blk%b = 0.0_rp
    blk%b(:, 1:3) = 1.0_rp
    blk%j = 1.0_rp
    blk%alpha = 0.0_rp
    blk%temp = temp
    blk%tau = 0.0_rp
    blk%rate = 0.0_rp
    blk%flow = 0.0_rp
    blk%mass = 2.0e-6_rp
    blk%l = 0.0_rp
  end subroutine reset

  subroutine advance(material, blk, dt, sums)
    type(material_t), intent(in) :: material
    type(block_t), intent(inout) :: blk
    real(rp), intent(in) :: dt
    type(stress_sums_t), intent(inout), optional :: sums
    type(stress_sums_t) :: mine
    real(rp) :: t_node(nlane)

    if (present(sums)) mine = sums
    t_node = blk%temp
    call advance_stress(material, nlane, dt, blk%l, t_node, blk%mass, blk%b, blk%j, blk%alpha, &
                        blk%temp, blk%tau, blk%rate, blk%flow, 0, none, mine)
    if (present(sums)) sums = mine
    if (blk%is_isothermal) blk%temp = t_node
  end subroutine advance

  !> Stretch at a constant volume and rate until the plastic strain is `strain`; the flow stress,
  !> the von Mises stress and the temperature there, interpolated within the last step.
  subroutine stretch_to(blk, rate, step_strain, strain, sigma, mises, temp)
    type(block_t), intent(inout) :: blk
    real(rp), intent(in) :: rate, step_strain, strain
    real(rp), intent(out) :: sigma, mises, temp
    real(rp) :: before(3), after(3), alpha, part

    blk%l(:, 1) = rate
    blk%l(:, 5) = -0.5_rp*rate
    blk%l(:, 9) = -0.5_rp*rate
    after = 0.0_rp
    do
      before = after
      alpha = blk%alpha(1)
      call advance(copper, blk, step_strain/rate)
      after = [blk%flow(1), blk%tau(1, 1) - blk%tau(1, 2), blk%temp(1)]
      if (blk%alpha(1) >= strain) exit
    end do
    part = (strain - alpha)/(blk%alpha(1) - alpha)
    sigma = before(1) + part*(after(1) - before(1))
    mises = before(2) + part*(after(2) - before(2))
    temp = before(3) + part*(after(3) - before(3))
  end subroutine stretch_to

  !> Points given by the thesis (physics.md, section 7), to 0.1 %.
  subroutine test_reference_points()
    real(rp), parameter :: within = 1.0e-3_rp
    real(rp), parameter :: strain(3) = [0.1_rp, 1.0_rp, 4.0_rp]
    real(rp), parameter :: stress(3) = [232.309_rp, 359.388_rp, 364.468_rp]
    real(rp), parameter :: kelvin(3) = [303.18_rp, 377.09_rp, 673.71_rp]
    type(block_t) :: blk
    real(rp) :: sigma, mises, temp
    integer :: i

    call reset(blk, 773.0_rp)
    blk%is_isothermal = .true.
    call stretch_to(blk, 25.0_rp, 1.0e-3_rp, 1.0_rp, sigma, mises, temp)
    call expect_close('773 K, 25/s', sigma, 240.32e6_rp, rtol=within)
    call expect_close('773 K, 25/s, von Mises', mises, sigma, rtol=1.0e-7_rp)

    call reset(blk, 1000.0_rp)
    blk%is_isothermal = .true.
    call stretch_to(blk, 25.0_rp, 1.0e-3_rp, 1.0_rp, sigma, mises, temp)
    call expect_close('1000 K, 25/s', sigma, 148.81e6_rp, rtol=within)

    call reset(blk, 1000.0_rp)
    blk%is_isothermal = .true.
    call stretch_to(blk, 8.33e-5_rp, 2.0e-3_rp, 30.0_rp, sigma, mises, temp)
    call expect_close('1000 K, 8.33e-5/s', sigma, 256.03e6_rp, rtol=within)

    call reset(blk, 298.0_rp)
    do i = 1, 3
      call stretch_to(blk, 1.0_rp, 2.0e-4_rp, strain(i), sigma, mises, temp)
      call expect_close('adiabatic stress', sigma, stress(i)*1.0e6_rp, rtol=within)
      call expect_close('adiabatic temperature', temp, kelvin(i), rtol=within)
    end do
  end subroutine test_reference_points

  !> Plastic strain of 30 in simple shear and in random directions: det(Bbar) and J stay 1.
  subroutine test_large_strain()
    type(block_t) :: blk
    type(stress_sums_t) :: sums
    real(rp) :: strain(nlane), worst, dt
    real(rp) :: series(nlane)   !! what the exponential to fourth order may leave out of J
    integer :: p, step

    call reset(blk, 900.0_rp)
    blk%is_isothermal = .true.
    dt = 1.0e-3_rp
    worst = 0.0_rp
    series = 1.0e-10_rp
    do p = 1, nlane
      strain(p) = 2.0e-3_rp*10.0_rp**(real(p, rp)/nlane)   ! equivalent strain a step
    end do
    do step = 1, 15500
      if (mod(step, 100) == 1) call new_directions(strain/dt, blk%l)
      series = series + 2.0_rp*(dt*norm2(blk%l, 2))**5/120.0_rp
      call advance(copper, blk, dt, sums)
      if (mod(step, 10) == 0) worst = max(worst, maxval(abs(determinant(blk%b) - 1.0_rp)))
    end do
    call expect('plastic strain of 30', minval(blk%alpha) >= 30.0_rp)
    call expect_close('det(Bbar) at large strain', worst, 0.0_rp, atol=1.0e-12_rp)
    call expect('J at large strain', all(abs(blk%j - 1.0_rp) < series))
    call expect('returns at large strain', sums%failed == 0)
  end subroutine test_large_strain

  !> Velocity gradients of the wanted equivalent rates, without volume change: even lanes keep to
  !> simple shear, odd lanes turn to random directions.
  subroutine new_directions(rate, gradient)
    real(rp), intent(in) :: rate(nlane)
    real(rp), intent(out) :: gradient(nlane, 9)
    real(rp) :: l(9), d2
    integer :: p

    do p = 1, nlane
      call random_number(l)
      l = l - 0.5_rp
      l([1, 5, 9]) = l([1, 5, 9]) - sum(l([1, 5, 9]))/3.0_rp
      if (mod(p, 2) == 0) then
        l = 0.0_rp
        l(2) = 1.0_rp
      end if
      d2 = l(1)**2 + l(5)**2 + l(9)**2 &
           + 0.5_rp*((l(2) + l(4))**2 + (l(3) + l(7))**2 + (l(6) + l(8))**2)
      gradient(p, :) = l*rate(p)/sqrt(2.0_rp/3.0_rp*d2)
    end do
  end subroutine new_directions

  pure function determinant(b) result(d)
    real(rp), intent(in) :: b(nlane, 6)
    real(rp) :: d(nlane)

    d = b(:, 1)*(b(:, 2)*b(:, 3) - b(:, 5)**2) - b(:, 4)*(b(:, 4)*b(:, 3) - b(:, 5)*b(:, 6)) &
        + b(:, 6)*(b(:, 4)*b(:, 5) - b(:, 2)*b(:, 6))
  end function determinant

  !> Bring the lanes to random plastic states; then lanes `p` with even p strain elastically only.
  subroutine prepare_mixed(blk, dt)
    type(block_t), intent(out) :: blk
    real(rp), intent(in) :: dt
    real(rp) :: scale(nlane)
    integer :: step

    call reset(blk, 298.0_rp)
    call random_number(blk%temp)
    blk%temp = 290.0_rp + 900.0_rp*blk%temp
    call random_number(scale)
    do step = 1, 20
      call random_number(blk%l)
      blk%l = (blk%l - 0.5_rp)*spread(1.0e-2_rp*scale/dt, 2, 9)
      call advance(copper, blk, dt)
    end do
    blk%b(2::2, :) = 0.0_rp
    blk%b(2::2, 1:3) = 1.0_rp
    call random_number(blk%l)
    blk%l = (blk%l - 0.5_rp)*1.0e-2_rp/dt
    blk%l(2::2, :) = blk%l(2::2, :)*1.0e-3_rp
  end subroutine prepare_mixed

  logical function is_same(a, b)
    type(block_t), intent(in) :: a, b

    is_same = all(a%b == b%b) .and. all(a%j == b%j) .and. all(a%alpha == b%alpha) &
              .and. all(a%temp == b%temp) .and. all(a%tau == b%tau) .and. all(a%rate == b%rate)
  end function is_same

  !> A block without plastic lanes is what it would be without a flow law, to the bit.
  subroutine test_elastic_block()
    type(block_t) :: with_law, without
    real(rp), parameter :: dt = 1.0e-6_rp
    real(rp) :: want(nlane)
    integer :: p

    call prepare_mixed(with_law, dt)
    with_law%b = 0.0_rp
    with_law%b(:, 1:3) = 1.0_rp
    with_law%l(1::2, :) = with_law%l(2::2, :)
    without = with_law
    without%rate = 0.0_rp
    do p = 1, nlane
      want(p) = flow_stress(with_law%alpha(p) + default_min_rate*dt, default_min_rate, &
                            with_law%temp(p))
    end do
    call advance(copper, with_law, dt)
    call advance(elastic, without, dt)
    call expect('an elastic block does not know the law', is_same(with_law, without))
    call expect('the rate of an elastic block is zero', all(with_law%rate == 0.0_rp))
    call expect_close('flow stress of an elastic block', maxval(abs(with_law%flow/want - 1.0_rp)), &
                      0.0_rp, atol=1.0e-12_rp)
  end subroutine test_elastic_block

  !> Every lane of a mixed block is as in a block where all lanes are like it.
  subroutine test_mixed_lanes()
    type(block_t) :: blk, start, copies
    real(rp), parameter :: dt = 1.0e-6_rp
    real(rp) :: off_b, off_tau, off_plastic, off_flow(2)
    integer :: p, n_plastic
    logical :: same_kind, same_volume

    call prepare_mixed(start, dt)
    blk = start
    call advance(copper, blk, dt)
    n_plastic = count(blk%alpha > start%alpha)
    same_kind = .true.
    same_volume = .true.
    off_b = 0.0_rp
    off_tau = 0.0_rp
    off_plastic = 0.0_rp
    off_flow = 0.0_rp
    do p = 1, nlane
      copies = copies_of(start, p)
      call advance(copper, copies, dt)
      same_kind = same_kind .and. ((blk%alpha(p) > start%alpha(p)) &
                                   .eqv. (copies%alpha(1) > start%alpha(p)))
      same_volume = same_volume .and. blk%j(p) == copies%j(1)
      off_b = max(off_b, maxval(abs(blk%b(p, :) - copies%b(1, :))))
      off_tau = max(off_tau, maxval(abs(blk%tau(p, :) - copies%tau(1, :)))/copies%flow(1))
      off_plastic = max(off_plastic, abs(blk%alpha(p) - copies%alpha(1))*copper%g/copies%flow(1), &
                        abs(blk%rate(p) - copies%rate(1))*dt*copper%g/copies%flow(1), &
                        abs(blk%temp(p) - copies%temp(1))*1.0e-3_rp)
      associate (worst => off_flow(1 + mod(p, 2)))   ! elastic, plastic
        worst = max(worst, abs(blk%flow(p)/copies%flow(1) - 1.0_rp))
      end associate
    end do
    call expect('half of the mixed lanes are plastic', n_plastic > 20 .and. n_plastic <= 32)
    call expect('mixed lanes: the same ones are plastic', same_kind)
    call expect('mixed lanes: J', same_volume)
    call expect_close('mixed lanes: Bbar', off_b, 0.0_rp, atol=1.0e-12_rp)
    call expect_close('mixed lanes: stress', off_tau, 0.0_rp, atol=1.0e-9_rp)
    call expect_close('mixed lanes: strain, rate, temperature', off_plastic, 0.0_rp, atol=1.0e-9_rp)
    call expect_close('mixed lanes: flow stress of plastic ones', off_flow(2), 0.0_rp, &
                      atol=1.0e-9_rp)
    call expect_close('mixed lanes: flow stress of elastic ones', off_flow(1), 0.0_rp, &
                      atol=1.0e-9_rp)
  end subroutine test_mixed_lanes

  pure type(block_t) function copies_of(blk, lane)
    type(block_t), intent(in) :: blk
    integer, intent(in) :: lane
    integer :: p

    copies_of = blk
    do p = 1, nlane
      copies_of%b(p, :) = blk%b(lane, :)
      copies_of%tau(p, :) = blk%tau(lane, :)
      copies_of%l(p, :) = blk%l(lane, :)
    end do
    copies_of%j = blk%j(lane)
    copies_of%alpha = blk%alpha(lane)
    copies_of%temp = blk%temp(lane)
    copies_of%rate = blk%rate(lane)
    copies_of%flow = blk%flow(lane)
    copies_of%mass = blk%mass(lane)
  end function copies_of

  !> Exchanging lanes exchanges the results, to the bit.
  subroutine test_lane_order()
    type(block_t) :: blk, moved, start
    real(rp), parameter :: dt = 1.0e-6_rp
    integer :: p, order(nlane), step

    call prepare_mixed(start, dt)
    order = [(1 + mod(7 + 29*p, nlane), p=1, nlane)]
    blk = start
    moved = picked(start, order)
    do step = 1, 5
      call advance(copper, blk, dt)
      call advance(copper, moved, dt)
    end do
    blk = picked(blk, order)
    call expect('lanes may change places', is_same(blk, moved))
    call expect('flow stress of lanes that change places', all(blk%flow == moved%flow))
    call expect('lanes differ', blk%tau(1, 1) /= blk%tau(2, 1))
  end subroutine test_lane_order

  pure type(block_t) function picked(blk, order)
    type(block_t), intent(in) :: blk
    integer, intent(in) :: order(nlane)

    picked = blk
    picked%b = blk%b(order, :)
    picked%j = blk%j(order)
    picked%alpha = blk%alpha(order)
    picked%temp = blk%temp(order)
    picked%tau = blk%tau(order, :)
    picked%rate = blk%rate(order)
    picked%flow = blk%flow(order)
    picked%mass = blk%mass(order)
    picked%l = blk%l(order, :)
  end function picked

  !> Nine tenths of the plastic work become heat; the work is that of the stress but for elasticity.
  subroutine test_heat_and_work()
    type(block_t) :: blk
    type(stress_sums_t) :: sums
    real(rp) :: outer, before(nlane), tau12(nlane)
    integer :: step

    call reset(blk, 298.0_rp)
    blk%l(:, 2) = 10.0_rp
    before = blk%temp
    outer = 0.0_rp
    do step = 1, 2000
      tau12 = blk%tau(:, 4)
      call advance(copper, blk, 1.0e-4_rp, sums)
      outer = outer + sum(blk%mass/copper%rho*0.5_rp*(tau12 + blk%tau(:, 4)))*1.0e-3_rp
    end do
    call expect_close('heat of plastic work', copper%c_p*sum(blk%mass*(blk%temp - before)), &
                      0.9_rp*sums%plastic_work, rtol=1.0e-10_rp)
    call expect_close('plastic work is the work of the stress', sums%plastic_work, outer, &
                      rtol=3.0e-3_rp)
  end subroutine test_heat_and_work

  !> The work of the stress is that of plastic strain and the elastic energy, whatever the sign and
  !> direction of the load, with moduli down to a tenth, in 100 steps.
  subroutine test_work_of_any_load()
    integer, parameter :: n_draws = 60
    real(rp), parameter :: axial(9) = [1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, -0.5_rp, 0.0_rp, 0.0_rp, &
                                       0.0_rp, -0.5_rp]
    type(material_t) :: metal
    type(block_t) :: blk
    type(stress_sums_t) :: sums
    real(rp) :: stored, strain, u(2), worst
    integer :: draw, step

    worst = 0.0_rp
    do draw = 1, n_draws
      call random_number(u)
      metal = elastic
      call metal%set_elastic(124.0e9_rp/10.0_rp**u(1), 0.34_rp)
      if (mod(draw, 2) == 0) then
        allocate (metal%flow, source=copper%flow)
      else
        allocate (metal%flow, source=norton_t(k=200.0e6_rp, n=0.2_rp))
      end if
      strain = 10.0_rp**(-3.0_rp + u(2))                 ! of a step
      call reset(blk, 298.0_rp)
      call new_directions(spread(1.0e4_rp*strain, 1, nlane), blk%l)
      blk%l = spread(blk%l(1, :), 1, nlane)
      if (mod(draw, 3) > 0) blk%l = spread((3 - 2*mod(draw, 3))*1.0e4_rp*strain*axial, 1, nlane)
      sums = stress_sums_t()
      do step = 1, 100
        call advance(metal, blk, 1.0e-4_rp, sums)
      end do
      stored = metal%elastic_energy(nlane, blk%mass, blk%temp, blk%j, blk%b)
      worst = max(worst, abs(sums%plastic_work/(sums%stress_work - stored) - 1.0_rp))
    end do
    call expect_close('plastic work of any load', worst, 0.0_rp, atol=1.0e-4_rp)
  end subroutine test_work_of_any_load

end program test_plastic
