! SPDX-License-Identifier: MIT
!> Elastic stress: derivative of its energy, rotation, simple shear, uniaxial strain, expansion.
program test_elastic
  use base_kinds, only: nlane, pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_material, only: material_t
  use physics_stress, only: advance_stress, stress_sums_t
  implicit none (type, external)

  real(rp) :: none(nlane, 0)   !! no internal variables
  !> State of one block.
  type :: block_t
    real(rp) :: b(nlane, 6), j(nlane), alpha(nlane), temp(nlane), tau(nlane, 6)
    real(rp) :: rate(nlane), flow(nlane), mass(nlane), l(nlane, 9)
  end type block_t

  !> Row and column of the stored component of a symmetric tensor.
  integer, parameter :: component(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
  real(rp), parameter :: unit(3, 3) = reshape([1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp, &
                                               0.0_rp, 0.0_rp, 1.0_rp], [3, 3])
  type(material_t) :: copper

  copper%rho = 8960.0_rp
  copper%c_p = 386.0_rp
  copper%expansion = 16.5e-6_rp
  call copper%set_elastic(124.0e9_rp, 0.34_rp)

  call begin_tests()
  call random_init(.true., .false.)
  call test_moduli()
  call test_energy_derivative()
  call test_rotation()
  call test_simple_shear()
  call test_uniaxial()
  call test_expansion()
  call test_wave_speed()
  call end_tests()

contains

  !> Undeformed block at the reference temperature, at rest.
  subroutine reset(blk)
    type(block_t), intent(out) :: blk

    blk%b = 0.0_rp
    blk%b(:, 1:3) = 1.0_rp
    blk%j = 1.0_rp
    blk%alpha = 0.0_rp
    blk%temp = copper%t_ref
    blk%tau = 0.0_rp
    blk%rate = 0.0_rp
    blk%flow = 0.0_rp
    blk%mass = copper%rho          ! a volume of 1 m3
    blk%l = 0.0_rp
  end subroutine reset

  subroutine advance(blk, dt, sums)
    type(block_t), intent(inout) :: blk
    real(rp), intent(in) :: dt
    type(stress_sums_t), intent(out), optional :: sums
    type(stress_sums_t) :: mine
    real(rp) :: t_node(nlane)

    t_node = blk%temp
    call advance_stress(copper, nlane, dt, blk%l, t_node, blk%mass, blk%b, blk%j, blk%alpha, &
                        blk%temp, blk%tau, blk%rate, blk%flow, 0, none, mine)
    if (present(sums)) sums = mine
  end subroutine advance

  !> Deform all lanes at random by strains of about `size`, and heat them.
  subroutine deform(blk, size)
    type(block_t), intent(inout) :: blk
    real(rp), intent(in) :: size
    integer :: step

    call random_number(blk%temp)
    blk%temp = copper%t_ref + 800.0_rp*blk%temp
    do step = 1, 20
      call random_number(blk%l)
      blk%l = size*(2.0_rp*blk%l - 1.0_rp)
      call advance(blk, 1.0_rp)
    end do
  end subroutine deform

  real(rp) function energy_of(blk, lane)
    type(block_t), intent(in) :: blk
    integer, intent(in) :: lane
    real(rp) :: mass(nlane)

    mass = 0.0_rp
    mass(lane) = blk%mass(lane)
    energy_of = copper%elastic_energy(nlane, mass, blk%temp, blk%j, blk%b)
  end function energy_of

  !> The stored stress of one lane as a matrix.
  function stress_of(blk, lane) result(tau)
    type(block_t), intent(in) :: blk
    integer, intent(in) :: lane
    real(rp) :: tau(3, 3)

    tau = reshape(blk%tau(lane, [1, 4, 6, 4, 2, 5, 6, 5, 3]), [3, 3])
  end function stress_of

  subroutine test_moduli()
    call expect_close('bulk modulus', copper%k, 124.0e9_rp/0.96_rp)
    call expect_close('shear modulus', copper%g, 124.0e9_rp/2.68_rp)
  end subroutine test_moduli

  !> With F -> exp(h E_ij) F the energy of a unit volume grows by h tau_ij.
  subroutine test_energy_derivative()
    type(block_t) :: state, plus, minus
    real(rp), parameter :: h = 1.0e-5_rp
    real(rp) :: derivative, worst, scale
    integer :: i, j, lane

    call reset(state)
    call deform(state, 0.1_rp)
    state%l = 0.0_rp
    call advance(state, 1.0_rp)                       ! stress at the final temperature
    call expect('the sample is strained', maxval(abs(state%b(:, 4:6))) > 0.1_rp)
    scale = copper%k
    worst = 0.0_rp
    do i = 1, 3
      do j = 1, 3
        plus = state
        plus%l(:, 3*(i - 1) + j) = h
        minus = state
        minus%l(:, 3*(i - 1) + j) = -h
        call advance(plus, 1.0_rp)
        call advance(minus, 1.0_rp)
        do lane = 1, nlane
          derivative = (energy_of(plus, lane) - energy_of(minus, lane))/(2.0_rp*h)
          worst = max(worst, abs(derivative - state%tau(lane, component(i, j))))
        end do
      end do
    end do
    call expect_close('stress is the derivative of the energy', worst/scale, 0.0_rp, atol=1.0e-8_rp)
  end subroutine test_energy_derivative

  !> Ten revolutions: no volume change, no strain, and the stress turns with the body.
  subroutine test_rotation()
    type(block_t) :: blk, start
    real(rp), parameter :: dt = 1.0e-3_rp
    integer, parameter :: steps = 62832
    real(rp) :: axis(3), omega(3, 3), r(3, 3), tau(3, 3), angle, worst, worst_j, worst_trace
    integer :: lane, step

    call reset(blk)
    call deform(blk, 1.0e-3_rp)
    blk%b(1, :) = [1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp]   ! lane 1 has no strain
    blk%j(1) = 1.0_rp
    blk%temp(1) = copper%t_ref
    axis = [1.0_rp, 2.0_rp, -2.0_rp]/3.0_rp
    omega = reshape([0.0_rp, axis(3), -axis(2), -axis(3), 0.0_rp, axis(1), axis(2), -axis(1), &
                     0.0_rp], [3, 3])
    blk%l = 0.0_rp
    call advance(blk, dt)
    start = blk
    do lane = 1, nlane
      blk%l(lane, :) = reshape(transpose(omega), [9])
    end do
    do step = 1, steps
      call advance(blk, dt)
    end do
    angle = steps*dt
    r = cos(angle)*unit + sin(angle)*omega &
        + (1.0_rp - cos(angle))*spread(axis, 2, 3)*spread(axis, 1, 3)
    worst = 0.0_rp
    do lane = 1, nlane
      tau = matmul(matmul(r, stress_of(start, lane)), transpose(r))
      worst = max(worst, maxval(abs(stress_of(blk, lane) - tau)))
    end do
    worst_j = maxval(abs(blk%j/start%j - 1.0_rp))
    worst_trace = maxval(abs(sum(blk%b(:, 1:3), 2) - sum(start%b(:, 1:3), 2)))
    call expect_close('ten revolutions', angle, 20.0_rp*pi, rtol=1.0e-5_rp)
    call expect_close('rotation keeps the volume', worst_j, 0.0_rp, atol=1.0e-10_rp)
    call expect_close('rotation keeps tr(Bbar)', worst_trace, 0.0_rp, atol=1.0e-10_rp)
    call expect_close('rotation gives no stress', maxval(abs(blk%tau(1, :)))/copper%k, 0.0_rp, &
                      atol=1.0e-10_rp)
    call expect_close('stress turns with the body', worst/maxval(abs(start%tau)), 0.0_rp, &
                      atol=1.0e-8_rp)
    call expect('the turned sample is stressed', maxval(abs(start%tau)) > 1.0e6_rp)
  end subroutine test_rotation

  !> F = 1 + gamma e1 e2: tau_12 = G gamma, tau_11 - tau_22 = G gamma^2, J = 1.
  subroutine test_simple_shear()
    type(block_t) :: blk
    real(rp), parameter :: gamma = 0.5_rp
    integer :: step

    call reset(blk)
    blk%l(:, 2) = gamma
    do step = 1, 100
      call advance(blk, 0.01_rp)
    end do
    call expect_close('shear keeps J', blk%j(7), 1.0_rp, rtol=1.0e-12_rp)
    call expect_close('shear stress', blk%tau(7, 4), copper%g*gamma, rtol=1.0e-11_rp)
    call expect_close('normal stress difference', blk%tau(7, 1) - blk%tau(7, 2), &
                      copper%g*gamma**2, rtol=1.0e-11_rp)
    call expect_close('shear has no pressure', sum(blk%tau(7, 1:3))/copper%k, 0.0_rp, &
                      atol=1.0e-12_rp)
  end subroutine test_simple_shear

  !> F = diag(exp(e), 1, 1).
  subroutine test_uniaxial()
    type(block_t) :: blk
    real(rp), parameter :: e(2) = [0.2_rp, -0.3_rp]
    real(rp) :: j, b1, b2, lame
    integer :: i, lane, step

    call reset(blk)
    do lane = 1, nlane
      blk%l(lane, 1) = e(1 + mod(lane, 2))
    end do
    do step = 1, 200
      call advance(blk, 1.0_rp/200.0_rp)
    end do
    do i = 1, 2
      lane = 3 + i                      ! a lane of either strain
      j = exp(e(i))
      b1 = j**(4.0_rp/3.0_rp)
      b2 = j**(-2.0_rp/3.0_rp)
      call expect_close('uniaxial J', blk%j(lane), j, rtol=1.0e-10_rp)
      call expect_close('uniaxial axial stress', blk%tau(lane, 1), &
                        copper%g*(b1 - b2)/1.5_rp + 0.5_rp*copper%k*(j*j - 1.0_rp), rtol=1.0e-9_rp)
      call expect_close('uniaxial lateral stress', blk%tau(lane, 2), &
                        copper%g*(b2 - b1)/3.0_rp + 0.5_rp*copper%k*(j*j - 1.0_rp), rtol=1.0e-9_rp)
    end do
    lame = copper%k - 2.0_rp/3.0_rp*copper%g        ! small strain: Hooke
    call reset(blk)
    blk%l(:, 9) = 1.0e-6_rp
    call advance(blk, 1.0_rp)
    call expect_close('Hooke, axial', blk%tau(1, 3), (lame + 2.0_rp*copper%g)*1.0e-6_rp, &
                      rtol=1.0e-5_rp)
    call expect_close('Hooke, lateral', blk%tau(1, 1), lame*1.0e-6_rp, rtol=1.0e-5_rp)
  end subroutine test_uniaxial

  !> Free heating gives no stress; held heating gives the pressure of J_e = 1/J_res.
  subroutine test_expansion()
    type(block_t) :: blk
    real(rp) :: j_res(nlane), want(nlane)

    call reset(blk)
    call random_number(blk%temp)
    blk%temp = 250.0_rp + 1100.0_rp*blk%temp
    j_res = exp(3.0_rp*copper%expansion*(blk%temp - copper%t_ref))
    blk%j = j_res
    call advance(blk, 1.0e-6_rp)
    call expect_close('free heating', maxval(abs(blk%tau))/copper%k, 0.0_rp, atol=1.0e-14_rp)
    call expect_close('free heating stores no energy', energy_of(blk, 5)/copper%k, 0.0_rp, &
                      atol=1.0e-14_rp)
    blk%j = 1.0_rp
    call advance(blk, 1.0e-6_rp)
    want = 0.5_rp*copper%k*(j_res**(-2) - 1.0_rp)
    call expect_close('held heating', maxval(abs(blk%tau(:, 2) - want))/copper%k, 0.0_rp, &
                      atol=1.0e-14_rp)
  end subroutine test_expansion

  !> The stiffness reported at rest is the squared speed of pressure waves.
  subroutine test_wave_speed()
    type(block_t) :: blk
    type(stress_sums_t) :: sums

    call reset(blk)
    call advance(blk, 1.0e-6_rp, sums)
    call expect_close('wave speed', sqrt(sums%stiffness), copper%wave_speed(), rtol=1.0e-12_rp)
    call expect_close('speed in copper', copper%wave_speed(), 4616.0_rp, rtol=2.0e-3_rp)
    call expect('an elastic block does no plastic work', sums%plastic_work == 0.0_rp)
  end subroutine test_wave_speed

end program test_elastic
