! SPDX-License-Identifier: MIT
!> Contact of two bodies at a node that both have mass on: the impulse between them and what it
!> costs. The velocities are those that the bodies would have at the end of a step without contact.
module contact_pair
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: contact_t
  public :: pair_law_t, pair_impulse, pair_loss

  ! What happens along the surface.
  integer, parameter, public :: law_coulomb = 1, law_stick = 2, law_frictionless = 3
  ! What a node does.
  integer, parameter, public :: is_apart = 0, is_sliding = 1, is_stuck = 2

  type :: pair_law_t
    integer :: kind = law_coulomb
    real(rp) :: friction = 0.0_rp
  end type pair_law_t

  ! How the normal of a pair is found; bodies without a &CONTACT move as one.
  integer, parameter, public :: normal_gradient = 1, normal_regression = 2, moves_as_one = 3

  !> What happens between two groups of bodies.
  type :: contact_t
    integer :: group(2) = 0
    integer :: normal = normal_gradient
    type(pair_law_t) :: law
  end type contact_t

contains

  !> Impulse on the first body (the second gets the opposite) that lets the gap close within the
  !> step and no further; never tensile unless bodies that stick touch. Tangentially as much as
  !> stops the slip, at most friction times the normal impulse. A `surplus` of the normal impulse
  !> parts bodies that overlap by twice the slack or more; less if they overlap less: where impulses
  !> rise over a shorter overlap, nodes bounce, and what is symmetric does not stay so.
  pure subroutine pair_impulse(law, dt, gap, slack, surplus, normal, inverse, v, impulse, state)
    type(pair_law_t), intent(in) :: law
    real(rp), intent(in) :: dt, gap            !! [s], [m]
    real(rp), intent(in) :: slack              !! gap up to which those that stick touch [m]
    real(rp), intent(in) :: surplus            !! over what stops bodies [-]
    real(rp), intent(in) :: normal(3)          !! out of the first body
    real(rp), intent(in) :: inverse(2)         !! 1/mass; 0: rigid [1/kg]
    real(rp), intent(in) :: v(3, 2)            !! velocities of both [m/s]
    real(rp), intent(out) :: impulse(3)        !! [N s]
    integer, intent(out) :: state
    real(rp) :: slip(3), vn, m, push, speed, hold

    impulse = 0.0_rp
    state = is_apart
    slip = v(:, 2) - v(:, 1)
    vn = dot_product(slip, normal)
    slip = slip - vn*normal
    m = 1.0_rp/sum(inverse)
    speed = norm2(slip)
    if (law%kind == law_stick .and. gap <= slack) then
      push = -m*vn
      hold = m
    else
      push = -m*(vn + max(0.0_rp, gap)/dt)
      if (push <= 0.0_rp) return
      push = push*(1.0_rp + surplus*max(0.0_rp, min(1.0_rp, -0.5_rp*gap/slack)))
      hold = limit(law, m, push, speed)
    end if
    state = merge(is_stuck, is_sliding, hold >= m)
    impulse = hold*slip - push*normal
  end subroutine pair_impulse

  !> Friction impulse over slip [kg]: `m` stops it.
  pure real(rp) function limit(law, m, push, speed)
    type(pair_law_t), intent(in) :: law
    real(rp), intent(in) :: m, push, speed

    limit = m
    select case (law%kind)
    case (law_coulomb)
      if (law%friction*push < m*speed) limit = law%friction*push/speed
    case (law_frictionless)
      limit = 0.0_rp
    case default   ! sticks
    end select
  end function limit

  !> Energy that the impulse takes from both bodies together, along and across the surface [J].
  pure subroutine pair_loss(normal, impulse, mean, friction, pressing)
    real(rp), intent(in) :: normal(3), impulse(3)   !! [N s], on the first body
    real(rp), intent(in) :: mean(3, 2)              !! mean velocities of the step, contact included
    real(rp), intent(out) :: friction, pressing
    real(rp) :: slip(3)

    slip = mean(:, 2) - mean(:, 1)
    pressing = dot_product(impulse, normal)*dot_product(slip, normal)
    friction = dot_product(impulse, slip) - pressing
  end subroutine pair_loss

end module contact_pair
