! SPDX-License-Identifier: MIT
!> What takes heat from metal: rods and lumps behind the face of a tool, films of the particles by
!> pressure, films and radiation of the walls of heat alone, each against its exact answer.
program test_heat_loss
  use base_kinds, only: pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use heat_mesh, only: boundary_face_t
  use heat_sources, only: wall_films_t
  use state_scene, only: film_t, of_pressure
  use tools_heat_sink, only: heat_sink_t
  implicit none (type, external)

  call begin_tests()
  call test_lump()
  call test_rod_at_rest()
  call test_half_space()
  call test_answer()
  call test_pressure()
  call test_walls()
  call test_radiation()
  call end_tests()

contains

  !> A lump that gets a power and is cooled: one step of backward Euler by hand, its heat, and the
  !> temperature at which it ends.
  subroutine test_lump()
    type(heat_sink_t) :: lump
    real(rp), parameter :: capacity = 20.0_rp, cooling = 3.0_rp, coolant = 290.0_rp, dt = 2.0_rp, &
                           power = 60.0_rp
    real(rp) :: before
    integer :: k

    lump%cooling = cooling
    lump%coolant = coolant
    call lump%make_lumped(capacity, 350.0_rp)
    before = lump%content()
    call warm(lump, dt, power)
    call expect_close('a step of a lump', lump%face_temperature, (capacity*350.0_rp + dt*(power &
                      + cooling*coolant))/(capacity + dt*cooling))
    do k = 1, 500
      call warm(lump, dt, power)
    end do
    call expect_close('a lump at rest', lump%face_temperature, coolant + power/cooling)
    call expect_close('what a lump got', lump%gained, 501.0_rp*dt*power)
    call expect_close('heat of a lump', lump%content() - before, lump%gained - lump%lost, &
                      rtol=1.0e-9_rp)
  end subroutine test_lump

  !> A rod that is cooled at its end: at rest the whole power goes through it, from face to coolant
  !> through L/(k A) + 1/G.
  subroutine test_rod_at_rest()
    type(heat_sink_t) :: rod
    real(rp), parameter :: area = 1.0e-4_rp, length = 0.02_rp, k = 25.0_rp, power = 10.0_rp
    real(rp) :: before
    integer :: step

    rod%cooling = 0.5_rp
    rod%coolant = 280.0_rp
    call rod%make_rod(area, length, 2.0e-4_rp, k, 3.6e6_rp, 300.0_rp)
    before = rod%content()
    call expect_close('heat in a rod', before, area*length*3.6e6_rp*300.0_rp)
    do step = 1, 400
      call warm(rod, 10.0_rp, power)
    end do
    call expect_close('a rod at rest', rod%face_temperature, &
                      280.0_rp + power*(length/(k*area) + 2.0_rp), &
                      rtol=1.0e-9_rp)
    call expect_close('heat of a rod', rod%content() - before, rod%gained - rod%lost, &
                      rtol=1.0e-9_rp)
  end subroutine test_rod_at_rest

  !> A flux q into a rod without end: its face gets hotter by 2 q sqrt(t/(pi k rho c)); first cell
  !> and steps make an error of 1 %.
  subroutine test_half_space()
    type(heat_sink_t) :: rod
    real(rp), parameter :: area = 2.0e-4_rp, k = 25.0_rp, heat = 3.6e6_rp, q = 1.0e5_rp, &
                           end = 1.0_rp
    real(rp) :: before
    integer :: step, steps

    call rod%make_rod(area, 0.0_rp, 5.0e-5_rp, k, heat, 300.0_rp)
    before = rod%content()
    steps = 1000
    do step = 1, steps
      call warm(rod, end/steps, q*area)
    end do
    call expect_close('a rod without end', rod%face_temperature - 300.0_rp, &
                      2.0_rp*q*sqrt(end/(pi*k*heat)), &
                      rtol=0.01_rp)
    call expect_close('it keeps what it gets', rod%content() - before, q*area*end, &
                      rtol=1.0e-6_rp)
  end subroutine test_half_space

  !> Take a step of a sink with a heat flow.
  subroutine warm(sink, dt, power)
    type(heat_sink_t), intent(inout) :: sink
    real(rp), intent(in) :: dt, power
    real(rp) :: dt_face_dp, t_face0

    call sink%face_response(dt, t_face0, dt_face_dp)
    call sink%absorb(dt, power)
  end subroutine warm

  !> The temperature that a face answers is that which it takes.
  subroutine test_answer()
    type(heat_sink_t) :: rod, lump
    real(rp) :: dt_face_dp, T_face0

    rod%cooling = 2.0_rp
    call rod%make_rod(1.0e-4_rp, 0.01_rp, 3.0e-4_rp, 25.0_rp, 3.6e6_rp, 400.0_rp)
    call warm(rod, 0.1_rp, 30.0_rp)
    call rod%face_response(0.05_rp, T_face0, dt_face_dp)
    call warm(rod, 0.05_rp, 17.0_rp)
    call expect_close('face of a rod', rod%face_temperature, T_face0 + 17.0_rp*dt_face_dp)
    call lump%make_lumped(5.0_rp, 400.0_rp)
    call lump%face_response(0.05_rp, T_face0, dt_face_dp)
    call expect_close('a lump alone stays', T_face0, 400.0_rp)
    call expect_close('a lump gets warm by t/C', dt_face_dp, 0.05_rp/5.0_rp)
  end subroutine test_answer

  !> The coefficient of a film by pressure: power law, table, nothing in tension.
  subroutine test_pressure()
    type(film_t) :: film

    call expect('no film', .not. film%acts() .and. .not. film%varies())
    film%coefficient = 100.0_rp
    call expect('a film of one coefficient', film%acts() .and. .not. film%varies())
    call expect_close('whatever the pressure', film%coefficient_at(5.0e6_rp), 100.0_rp)
    film%of = of_pressure
    film%factor = 50.0_rp
    film%exponent = 2.0_rp
    call expect('it varies', film%varies())
    call expect_close('power of the pressure', film%coefficient_at(3.0e6_rp), 550.0_rp)
    call expect_close('tension is no pressure', film%coefficient_at(-3.0e6_rp), 100.0_rp)
    film%at = [1.0e6_rp, 3.0e6_rp, 4.0e6_rp]
    film%there = [10.0_rp, 30.0_rp, 70.0_rp]
    call expect_close('below a table', film%coefficient_at(0.0_rp), 10.0_rp)
    call expect_close('between its values', film%coefficient_at(1.5e6_rp), 15.0_rp)
    call expect_close('between others', film%coefficient_at(3.5e6_rp), 50.0_rp)
    call expect_close('above it', film%coefficient_at(9.0e6_rp), 70.0_rp)
  end subroutine test_pressure

  !> Walls of two bodies, one without a film: each through its own half cell, A (T - T_a)/(1/h +
  !> d/k).
  subroutine test_walls()
    type(wall_films_t) :: film
    type(boundary_face_t) :: wall(3)
    real(rp), dimension(6, 2) :: coefficient, radiation, ambient
    real(rp) :: heat, slope

    coefficient = 0.0_rp
    radiation = 0.0_rp
    ambient = 298.0_rp
    coefficient(2, 2) = 500.0_rp
    ambient(2, 2) = 310.0_rp
    coefficient(5, 1) = 40.0_rp
    wall(1) = boundary_face_t(cell=2, body=2, face=2, area=3.0e-6_rp, depth=0.5e-3_rp)
    wall(2) = boundary_face_t(cell=1, body=1, face=2, area=7.0e-6_rp, depth=0.5e-3_rp)   ! insulated
    wall(3) = boundary_face_t(cell=1, body=1, face=5, area=2.0e-6_rp, depth=1.0e-3_rp)
    call film%init(wall, [4.0_rp, 8.0_rp], [100.0_rp, 20.0_rp], coefficient, radiation, ambient)
    call expect('walls with a film', film%n == 2 .and. .not. film%radiates)
    call expect('their cells', all(film%cell(:2) == [2, 1]))
    call film%loss(1, 450.0_rp, 1.0_rp/20.0_rp, heat, slope)
    call expect_close('first wall', heat, 140.0_rp*slope)
    call expect_close('its conductance', slope, 3.0e-6_rp/(1.0_rp/500.0_rp + 0.5e-3_rp/20.0_rp))
    call expect_close('known before', film%conductance(1), slope)
    call expect_close('per capacity of its cell', film%per_capacity(1), slope/8.0_rp)
    call film%loss(2, 298.0_rp, 1.0_rp/100.0_rp, heat, slope)
    call expect_close('as warm as the air', heat, 0.0_rp, atol=1.0e-15_rp)
    call expect_close('second wall', slope, 2.0e-6_rp/(1.0_rp/40.0_rp + 1.0e-3_rp/100.0_rp))
    call expect_close('second per capacity', film%per_capacity(2), slope/4.0_rp)
  end subroutine test_walls

  !> A wall that radiates beside its film: the heat that comes through the half cell leaves the
  !> face, hot and cold; the slope is that of the heat.
  subroutine test_radiation()
    type(wall_films_t) :: film
    real(rp), dimension(6, 1) :: coefficient, radiation, ambient
    real(rp), parameter :: area = 2.0e-6_rp, depth = 2.0e-3_rp, k = 0.5_rp, h = 30.0_rp, &
                           r = 5.0e-8_rp, air = 320.0_rp
    real(rp), parameter :: cell(3) = [1500.0_rp, 330.0_rp, 250.0_rp]
    real(rp) :: after, before, face, heat, slope, unused
    integer :: i

    coefficient = h
    radiation = r
    ambient = air
    call film%init([boundary_face_t(cell=1, area=area, depth=depth)], [1.0_rp], [k], coefficient, &
                   radiation, ambient)
    call expect('it radiates', film%radiates)
    do i = 1, size(cell)
      call film%loss(1, cell(i), 1.0_rp/k, heat, slope)
      face = cell(i) - heat/area*depth/k
      call expect_close('what leaves the face', heat, &
                        area*(h*(face - air) + r*(face**4 - air**4)), rtol=1.0e-9_rp)
      call film%loss(1, cell(i) - 0.01_rp, 1.0_rp/k, before, unused)
      call film%loss(1, cell(i) + 0.01_rp, 1.0_rp/k, after, unused)
      call expect_close('its slope', slope, (after - before)/0.02_rp, rtol=1.0e-6_rp)
      call expect('no steeper than the half cell', slope <= film%max_conductance(1))
    end do
  end subroutine test_radiation

end program test_heat_loss
