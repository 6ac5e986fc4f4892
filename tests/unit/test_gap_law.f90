! SPDX-License-Identifier: MIT
!> The law by which gaps close at a tool, and the limit of friction, for random numbers.
program test_gap_law
  use base_kinds, only: pi, rp
  use check, only: begin_tests, end_tests, expect_close
  use tools_law, only: find_closing_velocity, friction_law_t, law_coulomb, law_schmidt_hattel, &
                       law_shear_factor, law_wanheim_bay
  implicit none (type, external)

  integer, parameter :: n_draws = 5000

  call begin_tests()
  call random_init(.true., .false.)
  call test_gaps()
  call test_friction_laws()
  call end_tests()

contains

  !> Random lengths or times over four decades.
  real(rp) function any_size()
    real(rp) :: u

    call random_number(u)
    any_size = 10.0_rp**(4.0_rp*u - 2.0_rp)
  end function any_size

  !> What is left of a gap or a depth at the end of a step, whatever the times: `slop` closes in the
  !> relaxation time; a depth is taken back within a regular step, but no faster than it comes or
  !> recovers, and the rest in the relaxation time. The slip lies in the surface.
  subroutine test_gaps()
    real(rp) :: before, closing, depth, dt, gap, n(3), off(3), recovery, regular, relaxation
    real(rp) :: slip(3), slop, taken, u(5), v(3), want
    integer :: i

    off = 0.0_rp
    do i = 1, n_draws
      dt = any_size()
      regular = any_size()
      relaxation = any_size()
      recovery = any_size()
      slop = any_size()
      call random_number(u)
      n = u(1:3) - 0.5_rp
      n = n/norm2(n)
      call random_number(v)
      v = any_size()*(v - 0.5_rp)
      before = any_size()*sign(1.0_rp, u(4) - 0.5_rp)
      gap = before + dt*dot_product(v, n)
      call find_closing_velocity(dt, regular, slop, relaxation, recovery, gap, n, v, closing, slip)
      if (before >= 0.0_rp) then
        want = min(before, slop)*(1.0_rp - min(1.0_rp, dt/relaxation))
      else
        depth = -before
        taken = min(depth*min(1.0_rp, dt/regular), dt*max(recovery, -dot_product(v, n)))
        want = -(depth - taken)*(1.0_rp - min(1.0_rp, dt/relaxation))
      end if
      off(1) = max(off(1), abs(gap + dt*closing - want)/(abs(before) + dt*norm2(v)))
      off(2) = max(off(2), abs(dot_product(slip, n))/norm2(v))
      off(3) = max(off(3), norm2(slip + dot_product(v, n)*n - v)/norm2(v))
    end do
    call expect_close('gap at the end of the step', off(1), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('slip in the surface', maxval(off(2:)), 0.0_rp, atol=1.0e-12_rp)
  end subroutine test_gaps

  !> Friction is what is wanted, up to the law's limit: written out here for pressures, strengths
  !> and coefficients of any size.
  subroutine test_friction_laws()
    type(friction_law_t) :: law
    real(rp) :: bend, c, hold(3), k, limit, most, mu, off(4), p
    integer :: i, kind

    off = 0.0_rp
    do i = 1, n_draws
      call random_number(hold)
      call random_number(c)
      hold = any_size()*(hold - 0.5_rp)
      p = any_size()
      k = any_size()
      do kind = law_coulomb, law_schmidt_hattel
        law%kind = kind
        mu = 0.3_rp
        call law%limits(c, k, mu, most, bend)
        select case (kind)
        case (law_coulomb)
          limit = min(0.3_rp*p, k)
        case (law_shear_factor)
          limit = min(c*k, 1.0e3_rp*p)
        case (law_wanheim_bay)
          limit = bay(p/k, c)*k
        case (law_schmidt_hattel)
          limit = c*k + (1.0_rp - c)*min(0.3_rp*p, k)
        case default
          error stop
        end select
        off(kind) = max(off(kind), abs(law%friction(hold, mu*p, most, bend)*norm2(hold) &
                                       - min(norm2(hold), limit))/norm2(hold))
      end do
    end do
    call expect_close('limit of friction', maxval(off), 0.0_rp, atol=1.0e-12_rp)
    law%kind = law_schmidt_hattel
    call expect_close('nothing without pressure', law%friction([1.0_rp, 0.0_rp, 0.0_rp], 0.0_rp, &
                                                               1.0_rp, 0.5_rp), 0.0_rp)
  end subroutine test_friction_laws

  !> Friction stress over k at the pressure `q` k and the friction factor `f` (Bay 1987, eqs. 1 to
  !> 3, with sigma0 = sqrt(3) k).
  pure real(rp) function bay(q, f)
    real(rp), intent(in) :: q, f
    real(rp) :: end, fa

    end = (1.0_rp + pi/2.0_rp + acos(f) + sqrt(1.0_rp - f**2)) &
          /(sqrt(3.0_rp)*(1.0_rp + sqrt(1.0_rp - f)))
    fa = 1.0_rp - sqrt(1.0_rp - f)
    if (q/sqrt(3.0_rp) <= end) then
      bay = fa*q/sqrt(3.0_rp)/end
    else
      bay = fa + (f - fa)*(1.0_rp - exp((end - q/sqrt(3.0_rp))*fa/((f - fa)*end)))
    end if
  end function bay

end program test_gap_law
