! SPDX-License-Identifier: MIT
!> Coefficients of friction from a table.
program test_friction
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use tools_law, only: friction_table_t, of_pressure, of_slip, of_temperature
  implicit none (type, external)

  type(friction_table_t) :: table
  real(rp), dimension(nlane) :: temp, pressure, slip, mu, want
  integer :: p

  call begin_tests()
  table%at = [300.0_rp, 500.0_rp, 900.0_rp]
  table%coefficient = [0.4_rp, 0.3_rp, 0.1_rp]
  temp = [(250.0_rp + 12.0_rp*p, p=1, nlane)]
  pressure = temp(nlane:1:-1)
  slip = 1.3_rp*temp
  table%of = of_temperature
  call table%coefficients(nlane, temp, pressure, slip, mu)
  where (temp < 500.0_rp)
    want = 0.4_rp - 0.1_rp*max(0.0_rp, temp - 300.0_rp)/200.0_rp
  else where
    want = max(0.1_rp, 0.3_rp - 0.2_rp*(temp - 500.0_rp)/400.0_rp)
  end where
  call expect_close('by temperature', maxval(abs(mu - want)), 0.0_rp, atol=1.0e-14_rp)
  table%of = of_pressure
  call table%coefficients(nlane, temp, pressure, slip, mu)
  call expect_close('by pressure', maxval(abs(mu - want(nlane:1:-1))), 0.0_rp, atol=1.0e-14_rp)
  table%of = of_slip
  call table%coefficients(nlane, temp, pressure, slip, mu)
  call expect('by speed, constant at the ends', mu(nlane) <= 0.1_rp .and. mu(1) < want(1))
  table%at = [1.0_rp]
  table%coefficient = [0.25_rp]
  call table%coefficients(nlane, temp, pressure, slip, mu)
  call expect('one point is a constant', all(abs(mu - 0.25_rp) <= 0.0_rp))
  call end_tests()
end program test_friction
