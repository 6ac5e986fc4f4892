! SPDX-License-Identifier: MIT
!> Contact laws with a tool: closing of gaps, and limits of friction.
!>
!> Friction laws between tool and metal, with the pressure p, the shear strength k of the metal and
!> the coefficients of the input:
!>
!>   coulomb         min(mu p, k) (Orowan 1943); mu p alone without shear limit
!>   shear-factor    m k wherever metal is pressed on the tool (Tresca)
!>   wanheim-bay     m times k on the real area of contact (Wanheim & Bay 1978, as given by Bay
!>                   1987): proportional to p up to p', then exponentially to m k
!>   schmidt-hattel  delta k + (1 - delta) min(mu p, k) (Schmidt, Hattel & Wert 2004)
!>
!> The coefficient may depend on temperature, pressure or sliding speed by a table, linear between
!> its points and constant outside.
module tools_law
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: friction_law_t, friction_table_t, find_closing_velocity

  integer, parameter, public :: law_coulomb = 1, law_shear_factor = 2, law_wanheim_bay = 3, &
                                law_schmidt_hattel = 4
  character(14), parameter, public :: friction_laws(4) = &
    [character(14) :: 'coulomb', 'shear-factor', 'wanheim-bay', 'schmidt-hattel']

  !> Coulomb coefficient with which a shear factor is reached from p = k/1000 on.
  real(rp), parameter :: mu_saturated = 1.0e3_rp

  type :: friction_law_t
    integer :: kind = law_coulomb
    real(rp) :: coefficient = 0.0_rp  !! m or delta; 0 for coulomb, whose coefficient is mu
    logical :: shear_limit = .true.   !! Coulomb's law is limited by the shear strength
  contains
    procedure :: limits, friction, uses_mean_pressure, has_no_shear_limit
  end type friction_law_t

  integer, parameter, public :: of_nothing = 0, of_temperature = 1, of_pressure = 2, of_slip = 3

  type :: friction_table_t
    integer :: of = of_nothing      !! variable of the table
    real(rp), allocatable :: at(:)  !! values of the variable, increasing [K], [Pa] or [m/s]
    real(rp), allocatable :: coefficient(:)
  contains
    procedure :: coefficients
  end type friction_table_t

contains

  !> Velocity along the normal that contact removes from a particle, and its slip along the surface.
  !> A gap closes within the step and no further; its last `slop` closes only in the time
  !> `relaxation_time`, so that a surface with a roughness of a few thousandths of a cell is
  !> supported by all its particles instead of the protruding ones. A penetration is removed within
  !> a step, but no faster than `recovery_speed` or than the particle approaches, which suffices for
  !> a sustained load; the rest is removed in `relaxation_time`. A particle deep inside, such as one
  !> behind an edge, gets no impulse of depth/dt: such impulses kept a stirred plate vibrating, by
  !> which it flowed under three quarters of the force.
  pure subroutine find_closing_velocity(dt, dt_before, slop, relaxation_time, recovery_speed, gap, &
                                        normal, velocity, closing, slip, approach)
    real(rp), intent(in) :: dt, dt_before        !! length of this step, of the step before [s]
    real(rp), intent(in) :: slop                 !! width of the zone where gaps close slowly [m]
    real(rp), intent(in) :: relaxation_time      !! time in which gaps below `slop` close [s]
    real(rp), intent(in) :: recovery_speed       !! largest speed of removing a penetration [m/s]
    real(rp), intent(in) :: gap                  !! gap at the end of the step without contact [m]
    real(rp), intent(in) :: normal(3)            !! unit vector out of the tool
    real(rp), intent(in) :: velocity(3)  !! velocity relative to the tool without contact [m/s]
    real(rp), intent(out) :: closing, slip(3)    !! closing velocity, slip velocity [m/s]
    !> `closing` without the removal of penetration [m/s].
    real(rp), intent(out), optional :: approach
    real(rp) :: recovery, gap_before, speed

    speed = dot_product(velocity, normal)
    slip = velocity - speed*normal
    gap_before = gap - dt*speed
    if (gap_before < 0.0_rp) then
      recovery = min(-gap_before/max(dt, dt_before), max(recovery_speed, -speed))
      closing = -speed + recovery + max(0.0_rp, -gap_before - dt*recovery)/max(relaxation_time, dt)
    else
      closing = -speed - min(gap_before, slop)/max(relaxation_time, dt) - max(0.0_rp, &
                                                                              gap_before - slop)/dt
    end if
    if (present(approach)) approach = merge(-speed, closing, gap_before < 0.0_rp)
  end subroutine find_closing_velocity

  !> Friction limits of a particle with shear strength `k` (impulse or stress), for the coefficient
  !> of the law (mu, m or delta): the factor `mu` of the normal impulse, the largest friction, and
  !> the friction at which the law changes its form.
  elemental subroutine limits(self, coefficient, k, mu, max_friction, transition)
    class(friction_law_t), intent(in) :: self
    real(rp), intent(in) :: coefficient, k
    real(rp), intent(inout) :: mu
    real(rp), intent(out) :: max_friction, transition
    real(rp) :: pressure

    max_friction = k
    transition = k
    select case (self%kind)
    case (law_shear_factor)
      mu = mu_saturated
      max_friction = coefficient*k
      transition = max_friction
    case (law_wanheim_bay)
      ! pressure and shear stress, over k, at the end of proportional friction
      transition = 1.0_rp - sqrt(1.0_rp - coefficient)
      pressure = (1.0_rp + 0.5_rp*acos(-1.0_rp) + acos(coefficient) &
                  + sqrt(1.0_rp - coefficient*coefficient))/(1.0_rp + sqrt(1.0_rp - coefficient))
      mu = transition/pressure
      max_friction = coefficient*k
      transition = transition*k
    case (law_schmidt_hattel)
      transition = coefficient*k
    case default
    end select
  end subroutine limits

  !> Fraction of `stick_impulse` that friction provides, for the Coulomb limit `coulomb_impulse`,
  !> the largest friction `max_friction` and the transition of the law.
  pure real(rp) function friction(self, stick_impulse, coulomb_impulse, max_friction, &
                                  transition) result(part)
    class(friction_law_t), intent(in) :: self
    real(rp), intent(in) :: stick_impulse(3)   !! impulse that stops the slip [N s]
    !> Limits of friction [N s].
    real(rp), intent(in) :: coulomb_impulse, max_friction, transition
    real(rp) :: limit, wanted

    wanted = norm2(stick_impulse)
    limit = min(coulomb_impulse, max_friction)
    select case (self%kind)
    case (law_wanheim_bay)
      if (coulomb_impulse > transition .and. max_friction > transition) then
        associate (range => max_friction - transition)
          limit = transition + range*(1.0_rp - exp(-(coulomb_impulse - transition)/range))
        end associate
      end if
    case (law_schmidt_hattel)
      if (coulomb_impulse > 0.0_rp .and. max_friction > 0.0_rp) limit = transition &
          + (1.0_rp - transition/max_friction)*limit
    case default
    end select
    part = 1.0_rp
    if (limit < wanted) part = limit/wanted
  end function friction

  !> True if the law is not a simple limit of the Coulomb friction: then the mean pressure over a
  !> relaxation time counts, otherwise the unused Coulomb friction is kept for that time.
  elemental logical function uses_mean_pressure(self)
    class(friction_law_t), intent(in) :: self

    uses_mean_pressure = self%kind == law_wanheim_bay
  end function uses_mean_pressure

  !> True if the strength of the metal does not limit friction as long as it is above 0.
  elemental logical function has_no_shear_limit(self)
    class(friction_law_t), intent(in) :: self

    has_no_shear_limit = self%kind == law_coulomb .and. .not. self%shear_limit
  end function has_no_shear_limit

  !> Friction coefficients of the first `n` particles of a block.
  pure subroutine coefficients(self, n, temp, pressure, slip, mu)
    class(friction_table_t), intent(in) :: self      !! table of a variable
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane)              !! temperatures [K]
    real(rp), intent(in) :: pressure(nlane)          !! [Pa]
    real(rp), intent(in) :: slip(nlane)              !! sliding speed [m/s]
    real(rp), intent(out) :: mu(nlane)

    select case (self%of)
    case (of_temperature)
      call look_up(self%at, self%coefficient, n, temp, mu)
    case (of_pressure)
      call look_up(self%at, self%coefficient, n, pressure, mu)
    case default
      call look_up(self%at, self%coefficient, n, slip, mu)
    end select
  end subroutine coefficients

  pure subroutine look_up(at, mu, n, value, found)
    real(rp), intent(in) :: at(:), mu(:), value(nlane)
    integer, intent(in) :: n
    real(rp), intent(out) :: found(nlane)
    real(rp) :: share
    integer :: k, p

    found = mu(1)
    do k = 1, size(at) - 1
      do p = 1, n
        if (value(p) <= at(k)) cycle
        share = min(1.0_rp, (value(p) - at(k))/(at(k + 1) - at(k)))
        found(p) = mu(k) + (mu(k + 1) - mu(k))*share
      end do
    end do
  end subroutine look_up

end module tools_law
