! SPDX-License-Identifier: MIT
!> Largest stable mechanical step of each method.
!>
!> In units of h/c (c: pressure waves) the limit of a free elastic block in three dimensions with
!> two particles per cell and direction, at the worst offset from the grid, was found by runs of
!> 3,000 steps (Poisson's ratio 0.33, docs/accuracy.md): FLIP with uGIMP 0.473, with quadratic
!> B-splines 0.632. The limits in closed form are those of a frozen lattice,
!> W = (omega dt)^2 <= 4/(2 - lambda) for FLIP and 2 (1 + lambda_k) lambda/lambda_k for FMPM(k),
!> lambda_k = 1 - (1 - lambda)^k, with lambda the eigenvalue of S+ S; free surfaces lower them.
module mpm_stability
  use base_kinds, only: rp
  use state_clock, only: clock_t
  use state_scene, only: method_t, scene_t, scheme_usl, transfer_apic, transfer_fmpm, &
                              transfer_xpic
  implicit none (type, external)
  private

  public :: contact_relaxation, default_cfl, domain_factor, fragment_cfl, stable_step, wave_speed

  !> Number of cells that a wave crosses in the relaxation time of contact with tools.
  real(rp), parameter :: contact_cells = 60.0_rp
  !> Safety factor for nodes lighter than those in the measurements.
  real(rp), parameter :: margin = 0.9_rp
  !> Safety factor with a lower bound of the nodal inertia.
  real(rp), parameter :: margin_selective = 0.95_rp
  real(rp), parameter :: limit_ugimp = 0.473_rp, limit_bspline = 0.632_rp
  !> Limit of B-splines with selective mass scaling (state_nodes). With uGIMP and 0.62 a
  !> stirred plate gained energy.
  real(rp), parameter :: limit_selective = 0.842_rp
  !> Factor of APIC, from a measured limit of 0.531 with uGIMP.
  real(rp), parameter :: apic_gain = 1.12_rp
  !> Half length of a domain [cells] below which the limit of uGIMP falls with the square root of
  !> the half length: a node that a face of a lattice enters has the squared frequency c^2/(l h^2).
  !> Blocks with 4, 5, 6 and 8 particles along an axis of a cell are stable at 0.473, 0.438, 0.374
  !> and 0.346, and not at steps longer by 8 %.
  real(rp), parameter :: short_domain = 0.125_rp
  !> Exponent of the filter order: from limits of 0.376 and 0.531 at order 2, and of 0.282 and 0.398
  !> at order 4, with two particles along each axis of a cell. With B-splines and one particle along
  !> an axis there are modes of the nodes that no particle feels: the mass m over its sum over a row
  !> is near 0, and FMPM of order k multiplies the acceleration by (1 - (1 - m)^k)/m, at most k: the
  !> power is -1/2. Order 2, with 2 - m, is stable at the other power.
  real(rp), parameter :: filter_power = -0.37_rp
  !> Factor for one particle per cell, which leaves modes free that more particles would constrain:
  !> with B-splines the limit is 0.570 instead of 0.665 at Poisson's ratio 0.33, and 0.616 instead
  !> of 0.701 at 0.1. uGIMP functions of such a particle are B-splines, whose limit is above that of
  !> uGIMP with two.
  real(rp), parameter :: sparse_factor = 0.857_rp
  !> Poisson's ratio above which volumetric modes limit the step. Their stiffness is 3 K instead of
  !> the modulus of pressure waves K + 4 G/3, and the squared step is reduced by the ratio (K + 4
  !> G/3)/K = 3 (1 - nu)/(1 + nu). uGIMP loses twice as much: at 0.45 with four particles along each
  !> axis blocks are stable at 0.340 and unstable at 0.378.
  real(rp), parameter :: volumetric_from = 0.35_rp
  !> Factor for body contact with MUSL or USAVG: contact adds energy in proportion to the step,
  !> which only USL dissipates.
  real(rp), parameter :: contact_factor = 0.5_rp

  !> Largest h^2 sum of slope^2/weight of a particle on an axis, at a half length of 1/4 [cells].
  real(rp), parameter :: quarter_ratio = 28.0_rp/3.0_rp

contains

  !> Factors on the squared wave speeds of particles whose domains have the half lengths `half`
  !> [cells], at least 1 (docs/method.md, time step).
  pure function domain_factor(h, half) result(factor)
    real(rp), intent(in) :: h(3)          !! edges of a cell [m]
    real(rp), intent(in) :: half(:, :)    !! half lengths along x, y and z, (particles, 3) [cells]
    real(rp) :: factor(size(half, 1)), ratio(size(half, 1), 3)
    integer :: a

    do a = 1, 3
      ratio(:, a) = (minval(h)/h(a))**2*(2.0_rp/half(:, a) + 1.0_rp/(1.0_rp - half(:, a)))
    end do
    factor = max(1.0_rp, (sum(ratio, 2) + maxval(ratio, 2))/(4.0_rp*quarter_ratio))
  end function domain_factor

  !> Default CFL number: time step over the time in which a wave crosses a cell, for this method,
  !> particle lattice and elasticity.
  pure real(rp) function default_cfl(method, has_contact, is_sparse, is_thin, shortest, poisson)
    type(method_t), intent(in) :: method
    logical, intent(in) :: has_contact             !! contact between bodies
    logical, intent(in) :: is_sparse               !! one particle per cell
    logical, intent(in) :: is_thin                 !! one along an axis of a cell
    !> Shortest half length of a domain of constant size [shortest cell edge].
    real(rp), intent(in) :: shortest
    real(rp), intent(in) :: poisson                !! largest Poisson's ratio of the scene
    logical :: longer              !! steps are longer, with more inertia of light nodes

    default_cfl = limit_ugimp*sqrt(min(1.0_rp, shortest/short_domain))
    if (method%is_bspline) default_cfl = limit_bspline
    longer = method%scales_light_nodes .and. method%scheme == scheme_usl
    if (longer) default_cfl = limit_selective
    if (is_sparse .and. method%is_bspline) default_cfl = sparse_factor*default_cfl
    default_cfl = default_cfl*min(1.0_rp, (1.0_rp - poisson)/(1.0_rp + poisson) &
                                          *(1.0_rp + volumetric_from)/(1.0_rp - volumetric_from)) &
                              **merge(0.5_rp, 1.0_rp, method%is_bspline)
    select case (method%transfer)
    case (transfer_apic)
      default_cfl = apic_gain*default_cfl
    case (transfer_fmpm, transfer_xpic)
      associate (order => real(max(1, method%order), rp))
        if (is_thin .and. method%is_bspline .and. method%transfer == transfer_fmpm &
            .and. method%order > 2) then
          default_cfl = default_cfl/sqrt(order)
        else
          default_cfl = default_cfl*order**filter_power
        end if
      end associate
    case default                               ! FLIP has the limit of the shape functions
    end select
    default_cfl = merge(margin_selective, margin, longer)*default_cfl
    if (has_contact .and. method%scheme /= scheme_usl) default_cfl = contact_factor*default_cfl
  end function default_cfl

  !> Largest CFL number of fragments: bodies, or what is torn from them, of one cell or less along
  !> two axes. A particle alone feels no change of volume of its nodes, so that FLIP forgets that
  !> velocity in each step, and the squared frequency must stay below 2/dt2 instead of 4/dt2. It is
  !> 3 K over the modulus of pressure waves times the sum of slope^2/weight, 6/h^2 with B-splines.
  !> APIC keeps the velocity; MUSL and USAVG strain by velocities of particles; inertia of light
  !> nodes makes the frequency small.
  pure real(rp) function fragment_cfl(method, has_tools, half, poisson)
    type(method_t), intent(in) :: method
    logical, intent(in) :: has_tools          !! steps at tools are those of USL
    real(rp), intent(in) :: half              !! shortest half length of a domain [cells]
    real(rp), intent(in) :: poisson           !! largest Poisson's ratio of the scene
    real(rp) :: ratio                         !! sum of slope^2/weight on an axis, times h^2

    fragment_cfl = huge(1.0_rp)
    if (method%transfer == transfer_apic .or. method%scales_light_nodes) return
    if (method%scheme /= scheme_usl .and. .not. has_tools) return
    ratio = 2.0_rp/half + 1.0_rp/(1.0_rp - half)
    if (method%is_bspline) ratio = 6.0_rp
    fragment_cfl = margin*sqrt(2.0_rp*(1.0_rp - poisson)/(ratio*(1.0_rp + poisson)))
    if (method%transfer == transfer_fmpm) fragment_cfl = fragment_cfl &
                                                         /sqrt(real(max(1, method%order), rp))
  end function fragment_cfl

  !> Stable mechanical step [s]: CFL h over the sum of scaled wave speed and particle speed.
  pure real(rp) function stable_step(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp) :: cfl

    associate (method => scene%method)
      stable_step = method%fixed_dt
      if (stable_step > 0.0_rp) return
      cfl = method%cfl
      if (clock%fragments > 0) cfl = min(cfl, method%fragment_cfl)
      stable_step = cfl*minval(scene%grid%h)/(wave_speed(clock) + clock%max_speed)
    end associate
  end function stable_step

  !> Largest pressure-wave speed, with scaled inertia [m/s].
  pure real(rp) function wave_speed(clock)
    type(clock_t), intent(in) :: clock

    wave_speed = sqrt(clock%stiffness/clock%mass_scaling)
  end function wave_speed

  !> Time in which contact with tools follows slow changes of gaps and forces, for cells with the
  !> length `edge` [s].
  pure real(rp) function contact_relaxation(clock, edge)
    type(clock_t), intent(in) :: clock
    real(rp), intent(in) :: edge

    contact_relaxation = contact_cells*edge/wave_speed(clock)
  end function contact_relaxation

end module mpm_stability
