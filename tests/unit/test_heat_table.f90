! SPDX-License-Identifier: MIT
!> Properties over temperature: values, integrals and their inverse, for random tables; what a
!> material makes of them.
program test_heat_table
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use physics_material, only: heat_table_t, material_t
  implicit none (type, external)

  integer, parameter :: n_draws = 300

  call begin_tests()
  call random_init(.true., .false.)
  call test_table()
  call test_material()
  call end_tests()

contains

  !> A random table of 1 to 8 points between 200 and 2000 K.
  subroutine draw_table(table)
    type(heat_table_t), intent(inout) :: table
    real(rp) :: t(8), u(17), y(8)
    integer :: i, n

    call random_number(u)
    n = 1 + int(8.0_rp*u(17))
    t(1) = 200.0_rp + 400.0_rp*u(1)
    do i = 2, n
      t(i) = t(i - 1) + 1.0_rp + 200.0_rp*u(i)
    end do
    y = 50.0_rp + 1000.0_rp*u(9:16)
    if (allocated(table%t)) deallocate (table%t, table%y, table%slope, table%area)
    call table%init(n, t(:n), y(:n))
  end subroutine draw_table

  !> The integral is that of the midpoint rule over many short steps, its growth takes temperature
  !> there and back, up and down, across any number of points and from a point.
  subroutine test_table()
    integer, parameter :: n_steps = 4000
    type(heat_table_t) :: table
    real(rp) :: a, b, off(4), u(2)
    real(rp) :: middle(n_steps)
    integer :: i, k

    off = 0.0_rp
    do i = 1, n_draws
      call draw_table(table)
      call random_number(u)
      a = 2200.0_rp*u(1)
      b = 2200.0_rp*u(2)
      if (mod(i, 3) == 0) a = table%t(1 + mod(i, size(table%t)))
      if (mod(i, 5) == 0) b = table%t(1 + mod(i, size(table%t)))
      off(1) = max(off(1), maxval(abs(table%at(table%t) - table%y)))
      middle = [(a + (real(k, rp) - 0.5_rp)/n_steps*(b - a), k=1, n_steps)]
      off(2) = max(off(2), abs(table%integral(b) - table%integral(a) &
                               - (b - a)/n_steps*sum(table%at(middle)))/1050.0_rp)
      off(3) = max(off(3), abs(a + table%rise(a, table%integral(b) - table%integral(a)) - b))
      off(4) = max(off(4), abs(table%rise(a, 0.0_rp)))
    end do
    call expect_close('the points of a table [-]', off(1), 0.0_rp, atol=1.0e-10_rp)
    call expect_close('its integral over the largest value [K]', off(2), 0.0_rp, atol=5.0e-3_rp)
    call expect_close('temperature after a growth of the integral [K]', off(3), 0.0_rp, &
                      atol=1.0e-8_rp)
    call expect_close('no growth, no rise [K]', off(4), 0.0_rp, atol=tiny(1.0_rp))
  end subroutine test_table

  !> Heat that is taken up is what the heat content grows by, and no temperature has a larger
  !> diffusivity than the largest. Without tables all is as with constants.
  subroutine test_material()
    type(material_t) :: material, plain
    real(rp) :: gained, given, k, least, most, off
    real(rp), dimension(nlane) :: before, c, mass, temp
    integer :: i

    plain%conductivity = 20.0_rp
    off = 0.0_rp
    least = huge(1.0_rp)
    allocate (material%c_table, material%k_table)
    do i = 1, n_draws
      call draw_table(material%c_table)
      call draw_table(material%k_table)
      call random_number(before)
      call random_number(temp)
      call random_number(mass)
      before = 2200.0_rp*before
      temp = before + 300.0_rp*(temp - 0.5_rp)
      c = material%specific_heat_at(before)
      given = sum(mass*c*(temp - before))
      call material%apply_heat(c, before, temp)
      gained = material%heat_content(nlane, mass, temp) &
               - material%heat_content(nlane, mass, before)
      off = max(off, abs(gained - given)/material%heat_content(nlane, mass, temp))
      call material%max_diffusivity(k, most)
      most = k/most
      least = min(least, most/maxval(material%conductivity_at(temp) &
                                     /material%specific_heat_at(temp)))
    end do
    call expect_close('heat taken up against heat content', off, 0.0_rp, atol=1.0e-12_rp)
    call expect('no temperature spreads heat faster', least >= 1.0_rp - 1.0e-12_rp)
    c = plain%c_p
    off = temp(1)
    call plain%apply_heat(c, before, temp)
    call plain%max_diffusivity(k, most)
    call expect('constants stay', abs(temp(1) - off) <= 0.0_rp .and. abs(k - 20.0_rp) <= 0.0_rp &
                                  .and. abs(most - plain%c_p) <= 0.0_rp)
  end subroutine test_material

end program test_heat_table
