! SPDX-License-Identifier: MIT
!> A material point against closed forms of flow: adiabatic Johnson-Cook, shear without oscillation
!> of the stress, Norton's power law.
program test_element
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_law_norton, only: norton_t
  use physics_material, only: material_t
  use physics_return_map, only: default_min_rate, return_map
  use physics_stress, only: advance_stress, stress_sums_t
  implicit none (type, external)

  real(rp) :: none(nlane, 0)   !! no internal variables
  !> State of one block.
  type :: block_t
    real(rp) :: b(nlane, 6), j(nlane), alpha(nlane), temp(nlane), tau(nlane, 6)
    real(rp) :: rate(nlane), flow(nlane), mass(nlane), l(nlane, 9)
  end type block_t

  ! AA6061; T_ROOM = T0 = 300 K
  real(rp), parameter :: a = 324.0e6_rp, b = 114.0e6_rp, n = 0.42_rp, c = 0.002_rp
  real(rp), parameter :: room = 300.0_rp, melt = 925.0_rp
  type(material_t) :: metal

  metal%rho = 2700.0_rp
  metal%c_p = 896.0_rp
  metal%plastic_heat = 0.9_rp
  call metal%set_elastic(69.0e9_rp, 0.33_rp)

  call begin_tests()
  call random_init(.true., .false.)
  call test_adiabatic()
  call test_shear()
  call test_norton_return()
  call test_norton_element()
  call end_tests()

contains

  !> Undeformed block at rest.
  subroutine reset(blk)
    type(block_t), intent(out) :: blk

    blk%b = 0.0_rp
    blk%b(:, 1:3) = 1.0_rp
    blk%j = 1.0_rp
    blk%alpha = 0.0_rp
    blk%temp = room
    blk%tau = 0.0_rp
    blk%rate = 0.0_rp
    blk%flow = 0.0_rp
    blk%mass = 1.0_rp
    blk%l = 0.0_rp
  end subroutine reset

  subroutine advance(material, blk, dt)
    type(material_t), intent(in) :: material
    type(block_t), intent(inout) :: blk
    real(rp), intent(in) :: dt
    type(stress_sums_t) :: sums
    real(rp) :: t_node(nlane)

    t_node = blk%temp
    call advance_stress(material, nlane, dt, blk%l, t_node, blk%mass, blk%b, blk%j, blk%alpha, &
                        blk%temp, blk%tau, blk%rate, blk%flow, 0, none, sums)
    call expect('the return converges', sums%failed == 0)
  end subroutine advance

  !> Compress at constant volume and a plastic rate of 1/s to plastic strains of 1, 2 and 5, in
  !> uniaxial (lanes 1) and plane strain (lane 2) flow; temperature and flow stress there.
  subroutine compress(m, step, temp, flow)
    real(rp), intent(in) :: m, step
    real(rp), intent(out) :: temp(3, 2), flow(3, 2)
    real(rp), parameter :: strain(3) = [1.0_rp, 2.0_rp, 5.0_rp]
    type(material_t) :: alloy
    type(block_t) :: blk, before
    real(rp) :: part
    integer :: i, p

    alloy = metal
    allocate (alloy%flow, source=johnson_cook_t(a=a, b=b, n=n, c=c, m=m, t_room=room, &
                                                t_melt=melt))
    call reset(blk)
    blk%l(:, 9) = -1.0_rp                              ! uniaxial: rates -1, 1/2, 1/2
    blk%l(:, 1) = 0.5_rp
    blk%l(:, 5) = 0.5_rp
    blk%l(2, [1, 5, 9]) = sqrt(0.75_rp)*[1.0_rp, 0.0_rp, -1.0_rp]   ! plane strain
    i = 1
    do while (i <= 3)
      before = blk
      call advance(alloy, blk, step)
      do while (minval(blk%alpha(1:2)) >= strain(i))
        do p = 1, 2
          part = (strain(i) - before%alpha(p))/(blk%alpha(p) - before%alpha(p))
          temp(i, p) = before%temp(p) + part*(blk%temp(p) - before%temp(p))
          flow(i, p) = before%flow(p) + part*(blk%flow(p) - before%flow(p))
        end do
        i = i + 1
        if (i > 3) exit
      end do
    end do
  end subroutine compress

  !> rho c dT = 0.9 sigma d(alpha). With m = 1: T = T0 + (Tm - T0) (1 - exp(-0.9 (A e + B e^(n+1)/
  !> (n+1))/(rho c (Tm - T0)))), sigma = (A + B e^n)(1 - theta). m = 1.34: by an integration with
  !> small steps. To 0.1 % of the rise of temperature with strains of 0.2 % a step; the law reads
  !> the temperature at the start of a step, and the heat is by the mean stress of a step: errors of
  !> first order of both signs, which fall seven times and more with steps of a tenth.
  subroutine test_adiabatic()
    real(rp), parameter :: strain(3) = [1.0_rp, 2.0_rp, 5.0_rp]
    real(rp), parameter :: slow(3) = [441.36376_rp, 572.21687_rp, 813.90984_rp]
    real(rp), parameter :: slow_stress(3) = [378.23486e6_rp, 320.06802e6_rp, 126.43715e6_rp]
    real(rp) :: temp(3, 2), flow(3, 2), coarse(3, 2), unused(3, 2), theta(3), want(3)
    integer :: p

    theta = 1.0_rp - exp(-0.9_rp*(a*strain + b*strain**(n + 1.0_rp)/(n + 1.0_rp)) &
                         /(metal%rho*metal%c_p*(melt - room)))
    want = room + (melt - room)*theta
    call compress(1.0_rp, 0.002_rp, temp, flow)
    call compress(1.0_rp, 0.02_rp, coarse, unused)
    do p = 1, 2
      call expect_close('adiabatic temperature', maxval(abs(temp(:, p) - want)/(want - room)), &
                        0.0_rp, atol=1.0e-3_rp)
      call expect_close('adiabatic stress', &
                        maxval(abs(flow(:, p)/((a + b*strain**n) *(1.0_rp - theta)) - 1.0_rp)), &
                        0.0_rp, atol=1.0e-3_rp)
      call expect('the error falls with the step', &
                  maxval(abs(coarse(:, p) - want)) > 7.0_rp*maxval(abs(temp(:, p) - want)))
    end do
    call compress(1.34_rp, 0.002_rp, temp, flow)
    call expect_close('adiabatic temperature, m = 1.34', &
                      maxval(abs(temp(:, 1) - slow)/(slow - room)), 0.0_rp, atol=1.0e-3_rp)
    call expect_close('adiabatic stress, m = 1.34', maxval(abs(flow(:, 1)/slow_stress - 1.0_rp)), &
                      0.0_rp, atol=1.0e-3_rp)
  end subroutine test_adiabatic

  !> Simple shear to gamma = 10 of a hardening metal (no heat): the shear stress never falls, and is
  !> the flow stress over sqrt(3) once the metal flows; normal stresses stay elastic corrections.
  subroutine test_shear()
    type(material_t) :: alloy
    type(block_t) :: blk
    real(rp) :: before, drop, off, normal
    integer :: i

    alloy = metal
    alloy%plastic_heat = 0.0_rp
    allocate (alloy%flow, source=johnson_cook_t(a=a, b=b, n=n, c=c, m=1.0_rp, t_room=room, &
                                                t_melt=melt))
    call reset(blk)
    blk%l(:, 2) = 1.0_rp
    drop = 0.0_rp
    off = 0.0_rp
    normal = 0.0_rp
    do i = 1, 1000
      before = blk%tau(1, 4)
      call advance(alloy, blk, 0.01_rp)
      drop = max(drop, before - blk%tau(1, 4))
      if (i < 10) cycle
      off = max(off, abs(sqrt(3.0_rp)*blk%tau(1, 4)/blk%flow(1) - 1.0_rp))
      normal = max(normal, maxval(abs(blk%tau(1, 1:3)))/blk%flow(1))
    end do
    call expect('plastic strain of 10/sqrt(3)', blk%alpha(1) > 5.7_rp)
    call expect_close('shear stress never falls', drop, 0.0_rp, atol=0.0_rp)
    call expect_close('shear stress is that of the flow', off, 0.0_rp, atol=1.0e-3_rp)
    call expect('normal stresses are of the order of the elastic strain', normal < 0.02_rp)
  end subroutine test_shear

  !> q = g3 x + K (x/dt)^N for N = 1 and N = 1/2, where x has a closed form; below the stress of
  !> the least rate nothing flows.
  subroutine test_norton_return()
    real(rp), parameter :: k = 40.0e6_rp
    real(rp), dimension(nlane) :: temp, alpha, guess, g3, q, x, sigma, want
    real(rp) :: dt, root(nlane), exponent
    integer :: batch, failed, i
    logical :: any_plastic

    temp = 500.0_rp
    alpha = 3.0_rp
    guess = 0.0_rp
    failed = 0
    do batch = 1, 100
      call random_number(q)
      call random_number(g3)
      call random_number(dt)
      dt = 10.0_rp**(-6.0_rp*dt)
      g3 = 3.0e9_rp*(1.0_rp + g3)
      q = 10.0_rp**(4.8_rp + 3.0_rp*q)
      do i = 1, 2
        exponent = 1.0_rp/i
        call return_map(norton_t(k=k, n=exponent), nlane, dt, temp, alpha, guess, q, g3, none, x, &
                        sigma, any_plastic, failed)
        if (i == 1) then
          want = q/(g3 + k/dt)
        else
          root = 2.0_rp*q/(k/sqrt(dt) + sqrt(k**2/dt + 4.0_rp*g3*q))
          want = root**2
        end if
        call expect_close('increment of the power law', maxval(abs(x/want - 1.0_rp)), 0.0_rp, &
                          atol=1.0e-7_rp)
        call expect_close('stress of the power law', maxval(abs(sigma/(q - g3*want) - 1.0_rp)), &
                          0.0_rp, atol=1.0e-7_rp)
      end do
    end do
    call expect('returns of the power law', failed == 0)
    q = 0.999_rp*k*sqrt(default_min_rate)
    call return_map(norton_t(k=k, n=0.5_rp), nlane, dt, temp, alpha, guess, q, g3, none, x, sigma, &
                    any_plastic, failed)
    call expect('no flow below the least rate', .not. any_plastic .and. all(x <= 0.0_rp))
  end subroutine test_norton_return

  !> Stretch at a constant volume and rate: once the elastic strain no longer grows the von Mises
  !> stress is K rate^N, and 0.9 of its power heats. The return is exact to the elastic strain
  !> (1e-6 here) and half the strain of a step (5e-5).
  subroutine test_norton_element()
    real(rp), parameter :: k = 40.0e3_rp, exponent = 0.2_rp, dt = 1.0e-4_rp
    type(material_t) :: paste
    type(block_t) :: blk
    real(rp), dimension(nlane) :: rate, before, stress, power
    integer :: i, p

    paste = metal
    allocate (paste%flow, source=norton_t(k=k, n=exponent))
    call reset(blk)
    do p = 1, nlane
      rate(p) = 10.0_rp**(3.0_rp*(p - 1)/(nlane - 1) - 3.0_rp)   ! 0.001 to 1/s
      blk%l(p, [1, 5, 9]) = rate(p)*[1.0_rp, -0.5_rp, -0.5_rp]
    end do
    do i = 1, 200
      before = blk%temp
      call advance(paste, blk, dt)
    end do
    stress = (blk%tau(:, 1) - blk%tau(:, 2))/(k*rate**exponent)
    power = (blk%temp - before)*paste%rho*paste%c_p/(0.9_rp*k*rate**(exponent + 1.0_rp)*dt)
    call expect_close('stress of steady flow', maxval(abs(stress - 1.0_rp)), 0.0_rp, atol=2.0e-5_rp)
    call expect_close('heat of steady flow', maxval(abs(power - 1.0_rp)), 0.0_rp, atol=1.0e-4_rp)
  end subroutine test_norton_element

end program test_element
