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
    !> Particles outside the validity range of their law, by kind.
    integer :: warnings(max_warnings) = 0
    integer :: lane(max_warnings) = 0      !! first particle of each kind
  end type stress_sums_t

contains

  !> Advance the state of a block by `dt` with velocity gradient `l` [1/s]; law and elasticity use
  !> the temperature `t_begin` of the particles before the update [K]; plastic heat raises `temp`.
  subroutine advance_stress(material, n, dt, l, t_begin, mass, b, j, alpha, temp, tau, rate, flow, &
                            n_state, state, sums, factor)
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, l(nlane, 9), t_begin(nlane), mass(nlane)
    real(rp), intent(inout) :: b(nlane, 6), j(nlane), alpha(nlane), temp(nlane)
    real(rp), intent(inout) :: tau(nlane, 6), rate(nlane), flow(nlane)
    integer, intent(in) :: n_state                     !! at least n_state of the law
    real(rp), intent(inout) :: state(nlane, n_state)   !! internal variables of the law
    type(stress_sums_t), intent(inout) :: sums
    real(rp), intent(in), optional :: factor(nlane)    !! factors on the squared wave speeds
    real(rp), dimension(nlane) :: before, dd, det, q, q_before, mean, x, g3, stiffness
    logical :: has_table, plastic

    sums%stress_work = sums%stress_work + 0.5_rp*dt/material%rho*stress_power(n, mass, tau, l)
    if (allocated(material%flow)) q_before = von_mises(tau)
    call trial_state(dt, material%g, l, b, j, tau, q, mean)
    if (allocated(material%flow)) then
      call return_modulus(material%g, tau, q, flow, dd, det, g3)
      call return_map(material%flow, n, dt, t_begin, alpha, rate, q, g3, state, x, flow, &
                      plastic, sums%failed)
      if (plastic) then
        has_table = allocated(material%c_table)
        if (has_table) before = temp
        call apply_return(n, material%g, material%plastic_heat/(material%rho*material%c_p), &
                          1.0_rp/material%rho, dt, q, g3, x, 0.5_rp*(q_before + flow), mass, dd, &
                          det, mean, b, alpha, temp, tau, rate, sums%plastic_work)
        if (has_table) temp = before + material%temperature_rise(before, temp - before)
        call material%flow%inspect(n, t_begin, rate, state, sums%warnings, sums%lane)
      else
        rate = 0.0_rp
      end if
    end if
    call total_stress(material, t_begin, b, j, mean, tau, stiffness)
    if (present(factor)) stiffness = factor*stiffness
    sums%stress_work = sums%stress_work + 0.5_rp*dt/material%rho*stress_power(n, mass, tau, l)
    sums%stiffness = max(sums%stiffness, largest(n, stiffness)/material%rho)
  end subroutine advance_stress

  !> Von Mises stress.
  pure function von_mises(tau) result(q)
    real(rp), intent(in) :: tau(nlane, 6)
    real(rp) :: q(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      q(p) = sqrt(0.5_rp*((tau(p, 1) - tau(p, 2))**2 + (tau(p, 2) - tau(p, 3))**2 &
                          + (tau(p, 3) - tau(p, 1))**2) &
                  + 3.0_rp*(tau(p, 4)**2 + tau(p, 5)**2 + tau(p, 6)**2))
    end do
  end function von_mises

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
    real(rp), intent(in) :: alpha(nlane)   !! plastic strain [-]
    real(rp), intent(in) :: temp(nlane)    !! temperature [K]
    real(rp), intent(in) :: rate(nlane)    !! plastic strain rate [1/s]
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

  !> Loss of von Mises stress per plastic strain, `g3`, of a return that scales the deviator D of
  !> Bbar = a I + D by c and keeps det(Bbar) = 1. The plastic strain is such that the flow stress
  !> times its increment is the work tau : d_p that the return dissipates. For c falling at constant
  !> total strain that is the loss of elastic energy, -3/2 G da per volume, and with
  !> a^3 - a dd + det = 1 (a = 1 + (dd - det)/3 to second order), dd = c^2 D:D/2, det = c^3 det(D),
  !>
  !>     g3 = -dq/d(alpha) = G (3 a^2 - dd)/(a - 3/2 det/dd),
  !>
  !> 3 G to zeroth order in the elastic strain e, with a first-order term of the sign of the load:
  !> without it work and heat of plastic strain would be wrong by a fraction e. It is evaluated
  !> half-way to the flow stress of the last step, which is exact to second order.
  pure subroutine return_modulus(g, s, q, flow, dd, det, g3)
    real(rp), intent(in) :: g
    real(rp), intent(in) :: s(nlane, 6), q(nlane)   !! trial deviator and trial stress [Pa]
    real(rp), intent(in) :: flow(nlane)             !! flow stress of the last step [Pa]
    !> Half of the double contraction of D with itself and determinant of D, of the trial state.
    real(rp), dimension(nlane), intent(out) :: dd, det
    real(rp), intent(out) :: g3(nlane)                           !! [Pa]
    real(rp) :: a, c, c2, d1, d2, inv_g
    integer :: p

    inv_g = 1.0_rp/g
    !$omp simd private(a, c, c2, d1, d2)
    do p = 1, nlane
      dd(p) = (q(p)*inv_g)**2*(1.0_rp/3.0_rp)
      det(p) = inv_g**3*(s(p, 1)*(s(p, 2)*s(p, 3) - s(p, 5)*s(p, 5)) &
                         - s(p, 4)*(s(p, 4)*s(p, 3) - s(p, 5)*s(p, 6)) &
                         + s(p, 6)*(s(p, 4)*s(p, 5) - s(p, 2)*s(p, 6)))
      c = 0.5_rp + 0.5_rp*min(q(p), flow(p))/max(q(p), 1.0e-30_rp)
      c2 = c*c
      d1 = c2*dd(p) + tiny(1.0_rp)
      d2 = c2*c*det(p)
      a = 1.0_rp + (1.0_rp/3.0_rp)*(d1 - d2)
      g3(p) = g*(3.0_rp*a*a - d1)*d1/(a*d1 - 1.5_rp*d2)
    end do
  end subroutine return_modulus

  !> Scale the deviator, restore det(Bbar) = 1, add plastic strain. Work and heat are by the mean
  !> stress of the step, as the work of the stress: both count the same, whatever the step.
  subroutine apply_return(n, g, heat, volume, dt, q, g3, x, stress, mass, dd, det, mean, b, alpha, &
                          temp, s, rate, work)
    integer, intent(in) :: n
    real(rp), intent(in) :: g, heat, volume, dt
    real(rp), dimension(nlane), intent(in) :: q, g3, x, stress, mass, dd, det
    real(rp), dimension(nlane), intent(inout) :: mean, alpha, temp, rate
    real(rp), intent(inout) :: b(nlane, 6), s(nlane, 6), work
    real(rp) :: c, d1, d2, a, inv_g, inv_dt
    integer :: p

    inv_g = 1.0_rp/g
    inv_dt = 1.0_rp/dt
    !$omp simd private(c, d1, d2, a)
    do p = 1, nlane
      c = 1.0_rp - g3(p)*x(p)/max(q(p), 1.0e-30_rp)
      s(p, 1) = c*s(p, 1); s(p, 2) = c*s(p, 2); s(p, 3) = c*s(p, 3)
      s(p, 4) = c*s(p, 4); s(p, 5) = c*s(p, 5); s(p, 6) = c*s(p, 6)
      d1 = c*c*dd(p)
      d2 = c*c*c*det(p)
      ! a^3 - a D:D/2 + det D = 1: two Newton steps from a solution to second order
      a = 1.0_rp + (1.0_rp/3.0_rp)*(d1 - d2)
      a = a - (a*(a*a - d1) + d2 - 1.0_rp)/(3.0_rp*a*a - d1)
      a = a - (a*(a*a - d1) + d2 - 1.0_rp)/(3.0_rp*a*a - d1)
      mean(p) = a
      b(p, 1) = inv_g*s(p, 1) + a; b(p, 2) = inv_g*s(p, 2) + a; b(p, 3) = inv_g*s(p, 3) + a
      b(p, 4) = inv_g*s(p, 4); b(p, 5) = inv_g*s(p, 5); b(p, 6) = inv_g*s(p, 6)
      alpha(p) = alpha(p) + x(p)
      temp(p) = temp(p) + heat*stress(p)*x(p)
      rate(p) = x(p)*inv_dt
    end do
    !$omp simd reduction(+: work)
    do p = 1, n
      work = work + mass(p)*volume*stress(p)*x(p)
    end do
  end subroutine apply_return

end module physics_stress
