! SPDX-License-Identifier: MIT
!> Constitutive update of one block: elastic trial, radial return, plastic heat, Kirchhoff stress.
module physics_stress
  use base_kinds, only: nlane, rp
  use physics_elastic, only: finish_coupled, finish_state, trial_state
  use physics_flow_law, only: max_warnings, n_work
  use physics_material, only: material_t
  use physics_return_map, only: return_map
  implicit none (type, external)
  private

  public :: advance_stress, compute_elastic_stress, stress_sums_t, compute_flow_strength

  !> Results of the update, summed or maximised over blocks.
  type :: stress_sums_t
    real(rp) :: plastic_work = 0.0_rp      !! [J]
    real(rp) :: stress_work = 0.0_rp       !! work of the mean stress of the step [J]
    real(rp) :: stiffness = 0.0_rp         !! largest squared wave speed [m2/s2]
    integer :: failed = 0                  !! return mappings that did not converge
    integer :: warnings(max_warnings) = 0  !! particles outside the validity range of their law, by
                                           !! kind
    integer :: lane(max_warnings) = 0      !! first particle of each kind
  end type stress_sums_t

contains

  !> Advance the state of a block by `dt` with velocity gradient `l` [1/s]; the law reads the nodal
  !> temperature `t_node` interpolated to the particles [K].
  subroutine advance_stress(material, n, dt, l, t_node, mass, b, j, alpha, temp, tau, rate, flow, &
                            n_state, state, sums, factor)
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, l(nlane, 9), t_node(nlane), mass(nlane)
    real(rp), intent(inout) :: b(nlane, 6), j(nlane), alpha(nlane), temp(nlane)
    real(rp), intent(inout) :: tau(nlane, 6), rate(nlane), flow(nlane)
    integer, intent(in) :: n_state                     !! at least n_state of the law
    real(rp), intent(inout) :: state(nlane, n_state)   !! internal variables of the law
    type(stress_sums_t), intent(inout) :: sums
    real(rp), intent(in), optional :: factor(nlane)    !! factors on the squared wave speeds
    real(rp), dimension(nlane) :: before, q, mean, x, g3, stiffness
    logical :: has_table, plastic

    sums%stress_work = sums%stress_work + 0.5_rp*dt/material%rho*stress_power(n, mass, tau, l)
    call trial_state(dt, material%g, l, b, j, tau, q, mean)
    if (allocated(material%flow)) then
      g3 = 3.0_rp*material%g*mean
      call return_map(material%flow, n, dt, t_node, alpha, rate, q, g3, state, x, flow, &
                      plastic, sums%failed)
      if (plastic) then
        has_table = allocated(material%c_table)
        if (has_table) before = temp
        call apply_return(n, material%g, material%plastic_heat/(material%rho*material%c_p), &
                          1.0_rp/material%rho, dt, q, g3, x, flow, mass, mean, b, alpha, temp, &
                          tau, rate, sums%plastic_work)
        if (has_table) temp = before + material%temperature_rise(before, temp - before)
        call material%flow%inspect(n, t_node, rate, state, sums%warnings, sums%lane)
      else
        rate = 0.0_rp
      end if
    end if
    call total_stress(material, t_node, b, j, mean, tau, stiffness)
    if (present(factor)) stiffness = factor*stiffness
    sums%stress_work = sums%stress_work + 0.5_rp*dt/material%rho*stress_power(n, mass, tau, l)
    sums%stiffness = max(sums%stiffness, largest(n, stiffness)/material%rho)
  end subroutine advance_stress

  !> Kirchhoff stress of elastic states, and the largest squared wave speed of the first `n`.
  subroutine compute_elastic_stress(material, n, temp, b, j, tau, wave2)
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane)                   !! temperatures [K]
    real(rp), intent(inout) :: b(nlane, 6), j(nlane)      !! Bbar and J, unchanged
    real(rp), intent(out) :: tau(nlane, 6)                !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: wave2                        !! squared wave speed [m2/s2]
    real(rp) :: l(nlane, 9), q(nlane), mean(nlane), stiffness(nlane)

    l = 0.0_rp
    call trial_state(0.0_rp, material%g, l, b, j, tau, q, mean)
    call total_stress(material, temp, b, j, mean, tau, stiffness)
    wave2 = largest(n, stiffness)/material%rho
  end subroutine compute_elastic_stress

  !> Largest of the first `n` values; NaN counts as huge.
  pure real(rp) function largest(n, x)
    integer, intent(in) :: n
    real(rp), intent(in) :: x(nlane)
    integer :: p

    largest = 0.0_rp
    !$omp simd reduction(max: largest)
    do p = 1, n
      largest = max(largest, merge(x(p), huge(1.0_rp), x(p) <= huge(1.0_rp)))
    end do
  end function largest

  !> Kirchhoff stress from the state, or with the decoupled energy from its deviator, passed in
  !> `tau`.
  subroutine total_stress(material, temp, b, j, mean, tau, stiffness)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: temp(nlane), b(nlane, 6), j(nlane), mean(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)
    real(rp), intent(out) :: stiffness(nlane)   !! squared wave speeds times density [Pa]

    if (material%is_coupled) then
      call finish_coupled(material%lambda(), material%g, j, b, tau, stiffness)
    else
      call finish_state(material%k, material%g, material%expansion, material%t_ref, temp, j, &
                        mean, tau, stiffness)
    end if
  end subroutine total_stress

  !> Sum of mass tau : L [kg Pa/s].
  pure real(rp) function stress_power(n, mass, tau, l)
    integer, intent(in) :: n
    real(rp), intent(in) :: mass(nlane), tau(nlane, 6), l(nlane, 9)
    real(rp) :: power(nlane)
    integer :: p

    power = mass*(tau(:, 1)*l(:, 1) + tau(:, 2)*l(:, 5) + tau(:, 3)*l(:, 9) &
                  + tau(:, 4)*(l(:, 2) + l(:, 4)) + tau(:, 5)*(l(:, 6) + l(:, 8)) &
                  + tau(:, 6)*(l(:, 3) + l(:, 7)))
    stress_power = 0.0_rp
    !$omp simd reduction(+: stress_power)
    do p = 1, n
      stress_power = stress_power + power(p)
    end do
  end function stress_power

  !> Flow stress of a block at given plastic strain rates [Pa], and its derivative by the logarithm
  !> of the rate; 0 for an elastic material.
  subroutine compute_flow_strength(material, alpha, temp, rate, n_state, state, strength, slope)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: alpha(nlane), temp(nlane), rate(nlane)   !! plastic strain [-],
                                                                     !! temperature [K], plastic
                                                                     !! strain rate [1/s]
    integer, intent(in) :: n_state
    real(rp), intent(in) :: state(nlane, n_state)
    real(rp), intent(out) :: strength(nlane), slope(nlane)
    real(rp) :: work(nlane, n_work), x(nlane), log_rate(nlane)

    strength = 0.0_rp
    slope = 0.0_rp
    if (.not. allocated(material%flow)) return
    x = 0.0_rp
    log_rate = log(max(rate, material%flow%min_rate))
    call material%flow%prepare(temp, state, work)
    call material%flow%stress(work, alpha, x, log_rate, strength, slope)
  end subroutine compute_flow_strength

  !> Scale the deviator, restore det(Bbar) = 1, add plastic strain and heat.
  subroutine apply_return(n, g, heat, volume, dt, q, g3, x, flow, mass, mean, b, alpha, temp, s, &
                          rate, work)
    integer, intent(in) :: n
    real(rp), intent(in) :: g, heat, volume, dt
    real(rp), dimension(nlane), intent(in) :: q, g3, x, flow, mass
    real(rp), dimension(nlane), intent(inout) :: mean, alpha, temp, rate
    real(rp), intent(inout) :: b(nlane, 6), s(nlane, 6), work
    real(rp) :: c, d1, d2, d3, d4, d5, d6, dd, det, a, inv_g, inv_dt
    integer :: p

    inv_g = 1.0_rp/g
    inv_dt = 1.0_rp/dt
    !$omp simd private(c, d1, d2, d3, d4, d5, d6, dd, det, a)
    do p = 1, nlane
      c = 1.0_rp - g3(p)*x(p)/max(q(p), 1.0e-30_rp)
      s(p, 1) = c*s(p, 1); s(p, 2) = c*s(p, 2); s(p, 3) = c*s(p, 3)
      s(p, 4) = c*s(p, 4); s(p, 5) = c*s(p, 5); s(p, 6) = c*s(p, 6)
      d1 = inv_g*s(p, 1); d2 = inv_g*s(p, 2); d3 = inv_g*s(p, 3)
      d4 = inv_g*s(p, 4); d5 = inv_g*s(p, 5); d6 = inv_g*s(p, 6)
      dd = 0.5_rp*(d1*d1 + d2*d2 + d3*d3) + d4*d4 + d5*d5 + d6*d6
      det = d1*(d2*d3 - d5*d5) - d4*(d4*d3 - d5*d6) + d6*(d4*d5 - d2*d6)
      ! a^3 - a D:D/2 + det D = 1: three Newton steps from 1
      a = 1.0_rp
      a = a - (a*(a*a - dd) + det - 1.0_rp)/(3.0_rp*a*a - dd)
      a = a - (a*(a*a - dd) + det - 1.0_rp)/(3.0_rp*a*a - dd)
      a = a - (a*(a*a - dd) + det - 1.0_rp)/(3.0_rp*a*a - dd)
      mean(p) = a
      b(p, 1) = d1 + a; b(p, 2) = d2 + a; b(p, 3) = d3 + a
      b(p, 4) = d4; b(p, 5) = d5; b(p, 6) = d6
      alpha(p) = alpha(p) + x(p)
      temp(p) = temp(p) + heat*flow(p)*x(p)
      rate(p) = x(p)*inv_dt
    end do
    !$omp simd reduction(+: work)
    do p = 1, n
      work = work + mass(p)*volume*flow(p)*x(p)
    end do
  end subroutine apply_return

end module physics_stress
