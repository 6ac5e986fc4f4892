! SPDX-License-Identifier: MIT
!> Rows of the histories: energies and their audit, temperatures, and what each tool feels.
module time_records
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_tool, only: n_tool_sums, s_creep, s_force, s_friction, s_heat, s_normal, s_press, s_slide, &
                          s_to_plate, s_torque, s_work
  use particles_store, only: f_bbar, f_flow, f_heat, f_jac, f_mass, f_rate, f_temp, f_vel
  use physics_material, only: material_t
  use time_audit, only: e_body, e_conduction, e_contact, e_film, e_friction, e_plastic, e_scaling, &
                        e_source, e_stress, e_wall, e_wall_heat, n_sums
  use time_blocks, only: kinetic_energy
  use time_culprit, only: is_finite
  use time_microstructure, only: micro_columns, micro_row
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: history_columns, history_row, energies, inertial_stress_ratio

  integer, parameter :: n_common = 23, n_per_tool = 14
  integer, parameter :: wide = 96            !! characters of a column's name
  real(rp), parameter :: least_strength = 1.0e-4_rp   !! flow stress over shear modulus: some hundredths of a cold metal's

contains

  !> Column names with units: the common ones, those of each tool, three for each wall and clamp,
  !> those of the microstructure if a law describes it.
  function history_columns(sim) result(columns)
    type(simulation_t), intent(in) :: sim
    character(wide), allocatable :: columns(:)
    integer :: k, c

    allocate (columns(n_columns(sim)))
    columns(1:n_common) = [character(wide) :: &
      'time[s]', 'step', 'dt[s]', 'kinetic[J]', 'elastic[J]', &
      'plastic_work[J]', 'tool_work[J]', 'body_work[J]', 'wall_work[J]', 'friction_heat[J]', &
      'contact_loss[J]', 'numerical_loss[J]', 'audit_error[%]', 'film_loss[J]', 'heat_content[J]', &
      'temperature_max[K]', 'strain_rate_max[1/s]', 'kinetic_over_internal[%]', &
      'inertial_stress_over_flow[%]', 'friction_heat_to_bodies[J]', &
      'wall_heat[J]', 'source_heat[J]', 'conduction_error[%]']
    do k = 1, size(sim%tool)
      c = n_common + n_per_tool*(k - 1)
      associate (name => sim%tool(k)%name)
        columns(c + 1) = trim(name)//'_torque[Nm]'
        columns(c + 2) = trim(name)//'_force_x[N]'
        columns(c + 3) = trim(name)//'_force_y[N]'
        columns(c + 4) = trim(name)//'_force_z[N]'
        columns(c + 5) = trim(name)//'_power[W]'
        columns(c + 6) = trim(name)//'_friction_power[W]'
        columns(c + 7) = trim(name)//'_interface_velocity[m/s]'
        columns(c + 8) = trim(name)//'_tool_velocity[m/s]'
        columns(c + 9) = trim(name)//'_friction_share[%]'
        columns(c + 10) = trim(name)//'_x[m]'
        columns(c + 11) = trim(name)//'_y[m]'
        columns(c + 12) = trim(name)//'_z[m]'
        columns(c + 13) = trim(name)//'_angle[rad]'
        columns(c + 14) = trim(name)//'_tilt[rad]'
      end associate
    end do
    c = n_common + n_per_tool*size(sim%tool)
    do k = 1, size(sim%scene%constraint)
      columns(c + 3*k - 2:c + 3*k) = trim(sim%scene%constraint(k)%name)//'_force_'// &
                                     ['x[N]', 'y[N]', 'z[N]']
    end do
    columns(c + 3*size(sim%scene%constraint) + 1:) = [character(wide) :: micro_columns(sim), &
                                                      scaling_columns(sim)]
  end function history_columns

  !> Columns of a mass scaling that changes.
  function scaling_columns(sim) result(columns)
    type(simulation_t), intent(in) :: sim
    character(48), allocatable :: columns(:)

    allocate (columns(0))
    if (sim%scene%method%adapts_mass) columns = [character(48) :: 'mass_scaling', 'scaling_work[J]']
  end function scaling_columns

  integer function n_columns(sim)
    type(simulation_t), intent(in) :: sim

    n_columns = n_common + n_per_tool*size(sim%tool) + 3*size(sim%scene%constraint) &
                + size(micro_columns(sim)) + size(scaling_columns(sim))
  end function n_columns

  !> Kinetic energy (with mass scaling), elastic energy and heat content of this rank [J], hottest
  !> particle [K], largest strain rate [1/s] and inertial over flow stress where metal flows.
  subroutine energies(sim, kinetic, elastic, heat, hottest, fastest, ratio)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(out) :: kinetic, elastic, heat, hottest, fastest, ratio
    integer :: b, n

    kinetic = 0.0_rp
    elastic = 0.0_rp
    heat = 0.0_rp
    hottest = 0.0_rp
    fastest = 0.0_rp
    ratio = 0.0_rp
    do b = 1, sim%particles%nblk
      n = sim%particles%count(b)
      associate (ps => sim%particles%ps(:, :, b), &
                 mat => sim%scene%material(sim%scene%body(sim%particles%body(b))%material))
        heat = heat + mat%c_p*sum(ps(1:n, f_mass)*ps(1:n, f_temp)) + sum(ps(1:n, f_heat))
        hottest = max(hottest, maxval(ps(1:n, f_temp)))
        if (sim%scene%body(sim%particles%body(b))%tool > 0) cycle
        kinetic = kinetic + kinetic_energy(ps(:, f_mass), ps(:, f_vel:f_vel + 2))
        elastic = elastic + mat%elastic_energy(n, ps(:, f_mass), ps(:, f_temp), ps(:, f_jac), &
                                               ps(:, f_bbar:f_bbar + 5))
        fastest = max(fastest, maxval(ps(1:n, f_rate)))
        ratio = max(ratio, inertial_stress_ratio(n, mat, sim%scene%method%mass_scaling, ps(:, f_vel:f_vel + 2), &
                                                 ps(:, f_flow), ps(:, f_rate) > 0.0_rp))
      end associate
    end do
    kinetic = sim%scene%method%mass_scaling*kinetic
  end subroutine energies

  !> Largest chi rho v^2 over flow stress of the particles that count and have strength: is the mass scaling too
  !> large? What is molten carries nothing, whatever its speed.
  pure real(rp) function inertial_stress_ratio(n, material, chi, v, flow, counts)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: chi, v(nlane, 3), flow(nlane)
    logical, intent(in) :: counts(nlane)
    integer :: p

    inertial_stress_ratio = 0.0_rp
    do p = 1, n
      if (.not. counts(p) .or. flow(p) <= least_strength*material%g) cycle
      inertial_stress_ratio = max(inertial_stress_ratio, chi*material%rho*sum(v(p, :)**2)/flow(p))
    end do
  end function inertial_stress_ratio

  !> Collective: one row of the history, and its warning figures.
  subroutine history_row(world, sim, row)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), allocatable, intent(out) :: row(:)
    real(rp), allocatable :: all(:), tool(:, :)
    real(rp) :: most(4), kinetic, elastic, heat, work, friction, normal, given, taken, loss, inner
    real(rp) :: to_bodies, turned                    ! heat to bodies, all heat turned over [J]
    integer :: k, last, walls

    last = n_sums + 3 + n_tool_sums*size(sim%tool)
    allocate (all(last + size(sim%impulse)), tool(n_tool_sums, size(sim%tool)))
    call energies(sim, kinetic, elastic, heat, most(1), most(2), most(3))
    most(4) = merge(0.0_rp, 1.0_rp, is_finite(sim))
    all(1:n_sums) = sim%sums
    all(n_sums + 1:n_sums + 3) = [kinetic, elastic, heat]
    do k = 1, size(sim%tool)
      all(n_sums + 4 + n_tool_sums*(k - 1):n_sums + 3 + n_tool_sums*k) = sim%tool(k)%sums
    end do
    all(last + 1:) = reshape(sim%impulse, [size(sim%impulse)])
    call world%sum(all)
    call world%max(most)
    kinetic = all(n_sums + 1)
    elastic = all(n_sums + 2)
    heat = all(n_sums + 3)
    tool = reshape(all(n_sums + 4:last), shape(tool))
    work = sum(tool(s_work, :))
    friction = sum(tool(s_friction, :)) + all(e_friction)
    normal = sum(tool(s_normal, :)) + all(e_contact)
    tool(s_heat, :) = friction + all(e_plastic)
    given = work + all(e_body) + all(e_wall) + all(e_scaling)
    loss = given - friction - normal - (kinetic - sim%kinetic0) - all(e_stress)
    taken = friction + normal + all(e_plastic) + elastic - sim%elastic0 + kinetic - sim%kinetic0 &
            + loss
    sim%audit_scale = max(sim%audit_scale, abs(work) + abs(all(e_body)) + abs(all(e_wall)), &
                          abs(all(e_scaling)), sim%kinetic0 + sim%elastic0, tiny(1.0_rp))
    sim%is_broken = sim%is_broken .or. most(4) > 0.0_rp .or. comes_from_nothing(sim, kinetic, heat)
    to_bodies = sum(tool(s_to_plate, :))
    if (sim%scene%method%conducts) to_bodies = to_bodies + all(e_friction)
    inner = elastic + all(e_plastic) + friction
    if (inner > 0.0_rp) inner = 100.0_rp*kinetic/inner
    turned = max(to_bodies + all(e_plastic) + abs(all(e_film)) + abs(all(e_wall_heat)) &
                 + abs(all(e_source)), 1.0e-6_rp*abs(heat), tiny(1.0_rp))
    allocate (row(n_columns(sim)))
    row(1:n_common) = [sim%clock%time, real(sim%clock%step, rp), sim%clock%dt, kinetic, elastic, &
      all(e_plastic), work, all(e_body), all(e_wall), friction, normal, loss, &
      100.0_rp*(given - taken)/sim%audit_scale, all(e_film), &
      merge(heat, 0.0_rp, knows_heat(sim)), most(1), most(2), &
      inner, 100.0_rp*most(3), to_bodies, &
      all(e_wall_heat), all(e_source), 100.0_rp*all(e_conduction)/turned]
    k = n_common + n_per_tool*size(sim%tool)
    call tool_columns(sim, tool, row(n_common + 1:k))
    walls = k + 3*size(sim%scene%constraint)
    call wall_columns(sim, all(last + 1:), row(k + 1:walls))
    last = size(row) - size(scaling_columns(sim))
    call micro_row(world, sim, row(walls + 1:last))
    if (sim%scene%method%adapts_mass) row(last + 1:) = [sim%scene%method%mass_scaling, all(e_scaling)]
    sim%row_time = sim%clock%time
  end subroutine history_row

  !> Whether the specific heat of every material was given; the heat content is written only then.
  pure logical function knows_heat(sim)
    type(simulation_t), intent(in) :: sim

    knows_heat = all(sim%scene%material%knows_heat)
  end function knows_heat

  !> True if there is more kinetic energy than twice what all bodies had and were ever given: a run
  !> away. Expansion makes energy from heat; below 1e-9 of the heat content it may be rounding.
  pure logical function comes_from_nothing(sim, kinetic, heat)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: kinetic, heat            !! [J]

    comes_from_nothing = .not. kinetic <= 2.0_rp*sim%audit_scale + 1.0e-9_rp*abs(heat) &
                         .and. all(abs(sim%scene%material%expansion) <= 0.0_rp)
  end function comes_from_nothing

  !> Means of each tool's force, torque, powers and speeds since the last row, the share of its friction in
  !> all heat of friction and plastic work since then (0 where there is none), and its pose now.
  subroutine tool_columns(sim, tool, columns)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: tool(:, :)
    real(rp), intent(out) :: columns(:)
    real(rp) :: d(n_tool_sums), per_press
    integer :: c, k

    if (.not. allocated(sim%row_sums)) then
      allocate (sim%row_sums(n_tool_sums, size(sim%tool)), source=0.0_rp)
    end if
    do k = 1, size(sim%tool)
      d = tool(:, k) - sim%row_sums(:, k)
      per_press = 0.0_rp
      if (d(s_press) > 0.0_rp) per_press = 1.0_rp/d(s_press)
      c = n_per_tool*(k - 1)
      columns(c + 1) = d(s_torque)*per_second(sim)
      columns(c + 2:c + 4) = d(s_force:s_force + 2)*per_second(sim)
      columns(c + 5) = d(s_work)*per_second(sim)
      columns(c + 6) = d(s_friction)*per_second(sim)
      columns(c + 7) = d(s_creep)*per_press
      columns(c + 8) = d(s_slide)*per_press
      columns(c + 9) = 0.0_rp
      if (d(s_heat) > 0.0_rp) columns(c + 9) = 100.0_rp*d(s_friction)/d(s_heat)
      columns(c + 10:c + 12) = sim%tool(k)%position
      columns(c + 13:c + 14) = [sim%tool(k)%angle, sim%tool(k)%tilt()]
    end do
    sim%row_sums = tool
  end subroutine tool_columns

  !> Mean force of each wall and clamp on the bodies since the last row.
  subroutine wall_columns(sim, impulse, columns)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: impulse(:)               !! since t = 0, of all ranks [N s]
    real(rp), intent(out) :: columns(:)

    columns = (impulse - reshape(sim%row_impulse, shape(impulse)))*per_second(sim)
    sim%row_impulse = reshape(impulse, shape(sim%row_impulse))
  end subroutine wall_columns

  !> One over the time since the last row; 0 in the first [1/s].
  pure real(rp) function per_second(sim)
    type(simulation_t), intent(in) :: sim

    per_second = 0.0_rp
    if (sim%clock%time > sim%row_time) per_second = 1.0_rp/(sim%clock%time - sim%row_time)
  end function per_second

end module time_records
