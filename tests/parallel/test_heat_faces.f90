! SPDX-License-Identifier: MIT
!> What faces of bodies lose by radiation and to tools, and what friction gives these.
program test_heat_faces
  use base_kinds, only: rp
  use base_world, only: start_world
  use check, only: begin_tests, end_tests, expect, expect_close
  use heat_conduction, only: conduction_step
  use heat_samples, only: build, conduct_for, content, h, spacing, world
  use io_histories, only: row_t
  use output_guards, only: guards_t
  use particles_store, only: f_pos, f_temp, n_fields
  use state_budget, only: e_film, e_tool
  use state_parts, only: free_simulation, simulation_t
  use state_scene, only: of_pressure, stefan_boltzmann
  use tools_shape_plane, only: plane_t
  use tools_tool, only: tool_t
  implicit none (type, external)

  real(rp), parameter :: insulated(6) = 0.0_rp

  call start_world(world)
  call begin_tests()
  call test_radiation()
  call test_tool()
  call test_friction_heat()
  call test_range()
  call end_tests()

contains

  !> A face that radiates beside a film by pressure, of which there is none: one short step at an
  !> even temperature takes dt S q/(1 + q' d/k) with q = h (T - T_a) + eps sigma (T^4 - T_a^4) and
  !> its slope q'; long ones, explicit and implicit, are booked.
  subroutine test_radiation()
    type(simulation_t) :: sim
    real(rp), parameter :: at = 900.0_rp, air = 400.0_rp, dt = 1.0e-9_rp, area = 60.0_rp*h*h
    real(rp), parameter :: flow = 30.0_rp*(at - air) + 0.8_rp*stefan_boltzmann*(at**4 - air**4)
    real(rp), parameter :: slope = 30.0_rp + 3.2_rp*stefan_boltzmann*at**3
    real(rp) :: before, lost(1)
    integer :: b, step

    call build(sim, [10, 6, 3], insulated)
    associate (film => sim%scene%body(1)%film(5))
      film%coefficient = 30.0_rp
      film%of = of_pressure
      film%factor = 1.0e4_rp
      film%emissivity = 0.8_rp
      film%ambient = air
    end associate
    do b = 1, sim%particles%nblk
      sim%particles%ps(:, f_temp, b) = at
    end do
    call conduct_for(sim, dt)
    lost = sim%budget%sums(e_film)
    call world%sum(lost)
    call expect_close('a face that radiates', lost(1), &
                      dt*area*flow/(1.0_rp + slope*0.5_rp*spacing/391.0_rp), rtol=1.0e-6_rp)
    before = content(sim) + lost(1)
    do step = 1, 60
      sim%scene%method%implicit_heat = step > 30
      sim%scene%method%heat_step = 0.5_rp
      call conduct_for(sim, merge(0.5_rp, 0.01_rp, step > 30))
    end do
    lost = sim%budget%sums(e_film)
    call world%sum(lost)
    call expect('much is radiated', lost(1) > 0.05_rp*before)
    call expect_close('radiation is booked', lost(1), before - content(sim), rtol=1.0e-9_rp)
    call free_simulation(sim)
  end subroutine test_radiation

  !> A tool of one temperature, insulated but for the gap at its face.
  function lump(capacity, start, conductance) result(tool)
    real(rp), intent(in) :: capacity, start, conductance   !! [J/K], [K], [W/(m2 K)]
    type(tool_t) :: tool
    integer :: k

    allocate (plane_t :: tool%shape)
    tool%axes = reshape([(merge(1.0_rp, 0.0_rp, mod(k, 4) == 0), k=0, 8)], [3, 3])
    call tool%heat%make_lumped(capacity, start)
    tool%heat%gap_coefficient = conductance
    tool%heat%place = n_fields + 1
  end function lump

  !> Below the plate is the tool, for `dt`, where friction makes `flux`.
  subroutine touch(sim, dt, flux)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt, flux                       !! [s], [W/m2]
    integer :: b, p

    do b = 1, sim%particles%nblk
      associate (ps => sim%particles%ps(:, :, b))
        do p = 1, sim%particles%count(b)
          if (ps(p, f_pos + 2) > spacing) cycle
          ps(p, n_fields + 1) = spacing**2*dt
          ps(p, n_fields + 2) = spacing**2*dt*flux
        end do
      end associate
    end do
  end subroutine touch

  !> A thin plate on a cold tool that gets warm: two lumps, between them the gap and half a particle
  !> of metal; their difference decays by exp(-G (1/C_1 + 1/C_2) t), and no heat is lost.
  subroutine test_tool()
    type(simulation_t) :: sim
    real(rp), parameter :: capacity = 0.4_rp, gap = 2000.0_rp, area = 60.0_rp*h*h
    real(rp), parameter :: plate = 8960.0_rp*386.0_rp*3.0_rp*h*area
    real(rp), parameter :: through = area/(1.0_rp/gap + 0.5_rp*spacing/391.0_rp)
    real(rp) :: before, dt, t, taken(1)
    integer :: b, step

    call build(sim, [10, 6, 3], insulated, lump(capacity, 300.0_rp, gap))
    do b = 1, sim%particles%nblk
      sim%particles%ps(:, f_temp, b) = 400.0_rp
    end do
    before = content(sim)
    dt = conduction_step(sim%scene, sim%clock)
    t = 0.0_rp
    do step = 1, 400
      call touch(sim, dt, 0.0_rp)
      call conduct_for(sim, dt)
      t = t + dt
    end do
    taken = sim%budget%sums(e_tool)
    call world%sum(taken)
    associate (tool => sim%tool(1)%heat)
      call expect_close('plate and tool even out', &
                        content(sim)/plate - (tool%face_temperature - 300.0_rp), &
                        100.0_rp*exp(-through*(1.0_rp/plate + 1.0_rp/capacity)*t), rtol=0.01_rp)
      call expect_close('what the plate loses', before - content(sim), taken(1), rtol=1.0e-9_rp)
      call expect_close('the tool gets', capacity*(tool%face_temperature - 300.0_rp), taken(1), &
                        rtol=1.0e-9_rp)
      call expect_close('and says', tool%gained, taken(1), rtol=1.0e-12_rp)
    end associate
    call free_simulation(sim)
  end subroutine test_tool

  !> A tool as warm as the plate: of the heat of its face it gets what that drives through the gap,
  !> beside half a particle of metal, in one step exactly.
  subroutine test_friction_heat()
    type(simulation_t) :: sim
    real(rp), parameter :: gap = 5.0e5_rp, flux = 1.0e6_rp, dt = 1.0e-9_rp, area = 60.0_rp*h*h
    real(rp), parameter :: metal = 0.5_rp*spacing/391.0_rp
    real(rp) :: taken(1)
    integer :: b

    call build(sim, [10, 6, 3], insulated, lump(1.0e9_rp, 400.0_rp, gap))
    do b = 1, sim%particles%nblk
      sim%particles%ps(:, f_temp, b) = 400.0_rp
    end do
    call touch(sim, dt, flux)
    call conduct_for(sim, dt)
    taken = sim%budget%sums(e_tool)
    call world%sum(taken)
    call expect_close('friction heats the tool', taken(1), &
                      dt*area*flux*metal/(metal + 1.0_rp/gap), rtol=1.0e-6_rp)
    call free_simulation(sim)
  end subroutine test_friction_heat

  !> A run ends where metal is colder than all in the scene by more than a tenth of its
  !> temperatures, or hotter where nothing heats it.
  subroutine test_range()
    type(simulation_t) :: sim
    real(rp), parameter :: low(4) = [300.0_rp, 240.0_rp, 210.0_rp, 300.0_rp]
    real(rp), parameter :: high(4) = [600.0_rp, 600.0_rp, 600.0_rp, 660.0_rp]
    type(guards_t) :: guards
    type(row_t) :: row
    integer :: k

    call build(sim, [10, 6, 3], insulated, lump(1.0_rp, 250.0_rp, 1.0e4_rp))
    sim%scene%method%has_mechanics = .false.
    do k = 1, 4
      row = row_t()
      call row%add('source_heat', 'J', 0.0_rp)
      call row%add('wall_heat', 'J', 0.0_rp)
      call row%add('friction_heat', 'J', 0.0_rp)
      call row%add('plastic_work', 'J', 0.0_rp)
      call row%add('temperature_min', 'K', low(k))
      call row%add('temperature_max', 'K', high(k))
      sim%clock%now%is_broken = .false.
      call guards%check(sim, row, 0.0_rp)
      call expect('range of temperatures', sim%clock%now%is_broken .eqv. k > 2)
    end do
    call free_simulation(sim)
  end subroutine test_range

end program test_heat_faces
