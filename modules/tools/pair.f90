! SPDX-License-Identifier: MIT
!> Contact of two bodies at a node to which both contribute mass: the impulse between them and the
!> energy it dissipates. Velocities are those at the end of a step without contact.
module tools_pair
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: contact_t
  public :: pair_law_t, compute_pair_impulse, compute_pair_loss

  ! Tangential laws.
  integer, parameter, public :: law_coulomb = 1, law_stick = 2, law_frictionless = 3
  ! Contact states of a node.
  integer, parameter, public :: is_apart = 0, is_sliding = 1, is_stuck = 2

  type :: pair_law_t
    integer :: kind = law_coulomb
    real(rp) :: friction_coefficient = 0.0_rp
  end type pair_law_t

  ! Methods of finding the normal of a pair; bodies without a &CONTACT move as one.
  integer, parameter, public :: normal_gradient = 1, normal_regression = 2, moves_as_one = 3

  !> Contact between two groups of bodies.
  type :: contact_t
    integer :: group(2) = 0, normal = normal_gradient
    type(pair_law_t) :: law
    real(rp) :: melts_at(2) = huge(1.0_rp)   !! temperatures from which on there is no friction [K]
  end type contact_t

contains

  !> Impulse on the first body (the second gets the opposite) that closes the gap within the step
  !> and no further; it is tensile only if sticking bodies touch. The tangential impulse stops the
  !> slip, limited by friction times the normal impulse. A `surplus` of the normal impulse separates
  !> bodies that overlap by twice the slack or more, and is reduced for smaller overlaps: with
  !> impulses that rise over a shorter overlap nodes bounce, and symmetric problems lose their
  !> symmetry.
  pure subroutine compute_pair_impulse(law, dt, gap, slack, surplus, normal, inverse, v, &
                                       impulse, state)
    type(pair_law_t), intent(in) :: law
    real(rp), intent(in) :: dt, gap      !! time step [s], gap [m]
    real(rp), intent(in) :: slack        !! gap up to which sticking bodies touch [m]
    real(rp), intent(in) :: surplus  !! relative excess over the impulse that stops the bodies [-]
    real(rp), intent(in) :: normal(3)    !! unit vector out of the first body
    real(rp), intent(in) :: inverse(2)   !! 1/mass [1/kg]; 0: rigid
    real(rp), intent(in) :: v(3, 2)      !! velocities of both bodies [m/s]
    real(rp), intent(out) :: impulse(3)  !! impulse on the first body [N s]
    integer, intent(out) :: state
    real(rp) :: slip(3), vn, m, normal_impulse, overlap, speed, stick_mass

    impulse = 0.0_rp
    state = is_apart
    slip = v(:, 2) - v(:, 1)
    vn = dot_product(slip, normal)
    slip = slip - vn*normal
    m = 1.0_rp/sum(inverse)
    speed = norm2(slip)
    if (law%kind == law_stick .and. gap <= slack) then
      normal_impulse = -m*vn
      stick_mass = m
    else
      normal_impulse = -m*(vn + max(0.0_rp, gap)/dt)
      if (normal_impulse <= 0.0_rp) return
      overlap = max(0.0_rp, min(1.0_rp, -0.5_rp*gap/slack))
      normal_impulse = normal_impulse*(1.0_rp + surplus*overlap)
      stick_mass = limit(law, m, normal_impulse, speed)
    end if
    state = merge(is_stuck, is_sliding, stick_mass >= m)
    impulse = stick_mass*slip - normal_impulse*normal
  end subroutine compute_pair_impulse

  !> Friction impulse over slip [kg], at most `m`, which stops the slip.
  pure real(rp) function limit(law, m, normal_impulse, speed)
    type(pair_law_t), intent(in) :: law
    real(rp), intent(in) :: m, normal_impulse, speed

    limit = m
    select case (law%kind)
    case (law_coulomb)
      if (law%friction_coefficient*normal_impulse < m*speed) then
        limit = law%friction_coefficient*normal_impulse/speed
      end if
    case (law_frictionless)
      limit = 0.0_rp
    case default   ! sticking bodies have no limit
    end select
  end function limit

  !> Energy that the impulse removes from both bodies together, by friction and in normal direction
  !> [J].
  pure subroutine compute_pair_loss(normal, impulse, mean, friction, normal_loss)
    real(rp), intent(in) :: normal(3), impulse(3)  !! unit vector, impulse on the first body [N s]
    real(rp), intent(in) :: mean(3, 2)             !! mean velocities of the step with contact [m/s]
    real(rp), intent(out) :: friction, normal_loss
    real(rp) :: slip(3)

    slip = mean(:, 2) - mean(:, 1)
    normal_loss = dot_product(impulse, normal)*dot_product(slip, normal)
    friction = dot_product(impulse, slip) - normal_loss
  end subroutine compute_pair_loss

end module tools_pair
