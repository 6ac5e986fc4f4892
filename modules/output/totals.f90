! SPDX-License-Identifier: MIT
!> Energies, temperatures and accumulated sums of all ranks, and their balance.
module output_totals
  use base_kinds, only: nlane, rp
  use base_packed, only: packed_t
  use mpm_blocks, only: kinetic_energy
  use output_diagnostics, only: is_finite
  use particles_store, only: f_bbar, f_flow, f_heat, f_jac, f_mass, f_rate, f_temp, f_vel, &
                             particles_t
  use physics_material, only: material_t
  use state_budget, only: budget_t, d_elastic, d_kinetic, e_body, e_conduction, e_contact, e_film, &
                          e_friction, e_plastic, e_scaling, e_sleep, e_source, e_stress, e_tool, &
                          e_wall, e_wall_heat, n_sums
  use state_clock, only: clock_t
  use state_nodes, only: momentum_of_light, nodes_t
  use state_parts, only: history_t, simulation_t
  use state_scene, only: scene_t
  use tools_sums, only: n_tool_sums, s_friction, s_heat, s_normal_loss, s_to_plate, s_work
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: energies, energies_t, inertial_stress_ratio, zero_totals, sum_totals, totals_t

  !> Flow stress over shear modulus below which metal counts as molten.
  real(rp), parameter :: min_strength = 1.0e-4_rp

  !> Current energies and extremes of the particles.
  type :: energies_t
    real(rp) :: kinetic = 0.0_rp             !! kinetic energy with scaled mass [J]
    real(rp) :: elastic = 0.0_rp             !! elastic energy [J]
    real(rp) :: heat = 0.0_rp                !! heat content [J]
    real(rp) :: max_temperature = 0.0_rp     !! [K]
    real(rp) :: min_temperature = huge(1.0_rp)   !! [K]
    real(rp) :: max_strain_rate = 0.0_rp     !! [1/s]
    real(rp) :: inertial_ratio = 0.0_rp      !! largest inertial stress over flow stress
    real(rp) :: packing = 0.0_rp             !! largest excess of the fill over the volume of metal
    real(rp) :: not_finite = 0.0_rp          !! 1: a field of a particle is not finite
    !> Without mass scaling: momentum with that of the inertia added to nodes [kg m/s], kinetic
    !> energy [J].
    real(rp) :: motion(4) = 0.0_rp
  end type energies_t

  !> Totals of all ranks.
  type :: totals_t
    type(energies_t) :: now
    real(rp) :: budget(n_sums) = 0.0_rp       !! accumulated sums, indices of state_budget [J]
    real(rp), allocatable :: tool(:, :)      !! accumulated sums (n_tool_sums, tools)
    real(rp), allocatable :: max_face_temperature(:)  !! maximum temperature of each tool face [K]
    real(rp), allocatable :: impulse(:, :)   !! impulse of walls and clamps (3, n) [N s]
    real(rp), allocatable :: hooks(:)        !! sums of the hooks
    real(rp) :: work = 0.0_rp                !! work of all tools [J]
    real(rp) :: friction_heat = 0.0_rp       !! friction heat [J]
    real(rp) :: to_bodies = 0.0_rp           !! part of the friction heat that enters the bodies [J]
    real(rp) :: contact = 0.0_rp             !! energy lost in contact, normal to the surfaces [J]
    real(rp) :: loss = 0.0_rp                !! energy lost between particles and grid [J]
    real(rp) :: audit_error = 0.0_rp         !! balance error over exchanged energy [%]
    real(rp) :: conduction_error = 0.0_rp    !! error of conduction over exchanged heat [%]
    real(rp) :: over_internal = 0.0_rp       !! kinetic over internal energy [%]
    logical :: is_sound = .true.             !! all fields are finite, energy does not diverge
  end type totals_t

contains

  !> Energies and extremes of the particles of this rank.
  type(energies_t) function energies(scene, clock, particles, nodes) result(now)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    integer :: b, n

    do b = 1, particles%nblk
      n = particles%count(b)
      associate (ps => particles%ps(:, :, b), &
                 mat => scene%material(scene%body(particles%body(b))%material))
        now%heat = now%heat + mat%heat_content(n, ps(1:n, f_mass), ps(1:n, f_temp)) &
                   + sum(ps(1:n, f_heat))
        now%max_temperature = max(now%max_temperature, maxval(ps(1:n, f_temp)))
        now%min_temperature = min(now%min_temperature, minval(ps(1:n, f_temp)))
        if (scene%body(particles%body(b))%is_rigid()) cycle
        now%kinetic = now%kinetic + kinetic_energy(ps(:, f_mass), ps(:, f_vel:f_vel + 2))
        now%motion(:3) = now%motion(:3) + matmul(ps(:, f_mass), ps(:, f_vel:f_vel + 2))
        now%elastic = now%elastic &
          + mat%elastic_energy(n, ps(:, f_mass), ps(:, f_temp), ps(:, f_jac), &
                               ps(:, f_bbar:f_bbar + 5))
        now%max_strain_rate = max(now%max_strain_rate, maxval(ps(1:n, f_rate)))
        if (scene%layout%void > 0) then
          now%packing = max(now%packing, -minval(ps(1:n, scene%layout%void)))
        end if
        now%inertial_ratio = max(now%inertial_ratio, &
                                 inertial_stress_ratio(n, mat, clock%mass_scaling, &
                                                       particles%velocity(b), ps(:, f_flow), &
                                                       ps(:, f_rate) > 0.0_rp))
      end associate
    end do
    now%not_finite = merge(0.0_rp, 1.0_rp, is_finite(particles))
    now%motion(4) = now%kinetic
    now%motion(:3) = now%motion(:3) + momentum_of_light(nodes)/clock%mass_scaling
    now%kinetic = clock%mass_scaling*now%kinetic
  end function energies

  !> Largest ratio of inertial stress, chi rho v^2, to flow stress, a measure of too large mass
  !> scaling. Molten particles, which carry no stress, are left out.
  pure real(rp) function inertial_stress_ratio(n, material, chi, v, flow, counts)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: chi              !! mass scaling factor [-]
    real(rp), intent(in) :: v(nlane, 3)      !! velocity [m/s]
    real(rp), intent(in) :: flow(nlane)      !! flow stress [Pa]
    logical, intent(in) :: counts(nlane)     !! particles to include
    integer :: p

    inertial_stress_ratio = 0.0_rp
    do p = 1, n
      if (.not. counts(p) .or. flow(p) <= min_strength*material%g_true) cycle
      inertial_stress_ratio = max(inertial_stress_ratio, chi*material%rho*sum(v(p, :)**2)/flow(p))
    end do
  end function inertial_stress_ratio

  !> Totals of zero.
  type(totals_t) function zero_totals(scene, tools, budget) result(totals)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(budget_t), intent(in) :: budget

    allocate (totals%tool(n_tool_sums, size(tools)), totals%max_face_temperature(size(tools)), &
              totals%impulse(3, size(scene%condition)), totals%hooks(size(budget%hooks)), &
              source=0.0_rp)
  end function zero_totals

  !> Collective. Totals of the current state.
  subroutine sum_totals(sim, totals)
    type(simulation_t), intent(inout) :: sim
    type(totals_t), intent(out) :: totals
    type(packed_t) :: maxima, sums
    integer :: k

    totals = zero_totals(sim%scene, sim%tool, sim%budget)
    totals%now = energies(sim%scene, sim%clock, sim%particles, sim%nodes)
    totals%budget = sim%budget%sums
    do k = 1, size(sim%tool)
      totals%tool(:, k) = sim%tool(k)%sums
    end do
    totals%max_face_temperature = sim%tool%max_face_temperature
    totals%impulse = sim%budget%impulse
    totals%hooks = sim%budget%hooks
    call pass_sums(totals, sums)
    call pass_maxima(totals, maxima)
    call sim%world%sum(sums%value)
    call sim%world%max(maxima%value)
    call pass_sums(totals, sums)
    call pass_maxima(totals, maxima)
    call balance_energies(sim%scene, sim%history, totals)
    totals%is_sound = totals%now%not_finite <= 0.0_rp .and. &
      .not. energy_diverges(sim%scene, sim%history, totals%now)
  end subroutine sum_totals

  !> Pack or unpack what is added over the ranks.
  subroutine pass_sums(totals, sums)
    type(totals_t), intent(inout) :: totals
    type(packed_t), intent(inout) :: sums

    associate (t => totals, now => totals%now)
      call sums%pass(size(t%budget), t%budget)
      call sums%pass_one(now%kinetic)
      call sums%pass_one(now%elastic)
      call sums%pass_one(now%heat)
      call sums%pass(size(now%motion), now%motion)
      call sums%pass(size(t%tool), t%tool)
      call sums%pass(size(t%impulse), t%impulse)
      call sums%pass(size(t%hooks), t%hooks)
    end associate
    call sums%rewind()
  end subroutine pass_sums

  !> Pack or unpack what is the largest value of any rank.
  subroutine pass_maxima(totals, maxima)
    type(totals_t), intent(inout) :: totals
    type(packed_t), intent(inout) :: maxima

    associate (t => totals, now => totals%now)
      call maxima%pass_one(now%max_temperature)
      now%min_temperature = -now%min_temperature
      call maxima%pass_one(now%min_temperature)
      now%min_temperature = -now%min_temperature
      call maxima%pass_one(now%max_strain_rate)
      call maxima%pass_one(now%inertial_ratio)
      call maxima%pass_one(now%packing)
      call maxima%pass_one(now%not_finite)
      call maxima%pass(size(t%max_face_temperature), t%max_face_temperature)
    end associate
    call maxima%rewind()
  end subroutine pass_maxima

  !> Balance the energy supplied to the bodies with its stored and dissipated parts.
  subroutine balance_energies(scene, history, totals)
    type(scene_t), intent(in) :: scene
    type(history_t), intent(inout) :: history
    type(totals_t), intent(inout) :: totals
    real(rp) :: supplied, internal, absorbed, exchanged

    associate (t => totals, now => totals%now, budget => totals%budget, tool => totals%tool)
      t%work = sum(tool(s_work, :))
      t%friction_heat = sum(tool(s_friction, :)) + budget(e_friction)
      t%contact = sum(tool(s_normal_loss, :)) + budget(e_contact)
      tool(s_heat, :) = t%friction_heat + budget(e_plastic)
      supplied = t%work + budget(e_body) + budget(e_wall) + budget(e_scaling)
      t%loss = supplied - t%friction_heat - t%contact - (now%kinetic - history%kinetic0) - &
        budget(d_kinetic) - budget(e_stress) - budget(e_sleep)
      absorbed = t%friction_heat + t%contact + budget(e_plastic) + now%elastic - &
        history%elastic0 + now%kinetic - history%kinetic0 + t%loss + budget(e_sleep) + &
        budget(d_kinetic) + budget(d_elastic)
      ! a floor, so that quotients by it are finite
      history%audit_scale = max(history%audit_scale, abs(t%work) + abs(budget(e_body)) + &
                                abs(budget(e_wall)), abs(budget(e_scaling)), history%kinetic0 + &
                                abs(history%elastic0), 1.0e-200_rp)
      t%audit_error = 100.0_rp*(supplied - absorbed)/history%audit_scale
      t%to_bodies = sum(tool(s_to_plate, :))
      if (scene%method%conducts) t%to_bodies = t%to_bodies + budget(e_friction)
      internal = now%elastic + budget(e_plastic) + t%friction_heat
      t%over_internal = 0.0_rp
      if (.not. internal <= 0.0_rp) t%over_internal = 100.0_rp*now%kinetic/internal
      exchanged = max(t%to_bodies + budget(e_plastic) + abs(budget(e_film)) &
                      + abs(budget(e_wall_heat)) + abs(budget(e_source)) + abs(budget(e_tool)), &
                      1.0e-6_rp*abs(now%heat), tiny(1.0_rp))
      t%conduction_error = 100.0_rp*budget(e_conduction)/exchanged
    end associate
  end subroutine balance_energies

  !> True if the kinetic energy exceeds twice the exchanged energy, the sign of an unstable run. It
  !> is false with thermal expansion, which makes kinetic energy from heat; 1e-9 of the heat content
  !> is a tolerance for rounding.
  pure logical function energy_diverges(scene, history, now)
    type(scene_t), intent(in) :: scene
    type(history_t), intent(in) :: history
    type(energies_t), intent(in) :: now

    energy_diverges = .not. now%kinetic <= 2.0_rp*history%audit_scale + &
      1.0e-9_rp*abs(now%heat) .and. all(abs(scene%material%expansion) <= 0.0_rp)
  end function energy_diverges

end module output_totals
