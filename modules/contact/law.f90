! SPDX-License-Identifier: MIT
!> The law of contact with a tool: how gaps close, and what friction can give.
!>
!> Laws of friction between a tool and metal: with the pressure p, the shear strength k of the metal
!> and what the input gives:
!>
!>   coulomb         least of mu p and k (Orowan 1943); mu p alone without shear limit
!>   shear-factor    m k wherever metal is pressed on the tool (Tresca)
!>   wanheim-bay     m times k on the real area of contact (Wanheim & Bay 1978, as given by Bay
!>                   1987): proportional to p up to p', then exponentially to m k
!>   schmidt-hattel  delta k + (1 - delta) least of mu p and k (Schmidt, Hattel & Wert 2004)
!>
!> Their coefficient may depend on temperature, pressure or sliding speed by a table, linear between
!> its points and constant outside.
module contact_law
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: friction_law_t, friction_table_t, normal_velocity

  integer, parameter, public :: law_coulomb = 1, law_shear_factor = 2, law_wanheim_bay = 3, &
                                law_schmidt_hattel = 4
  character(14), parameter, public :: friction_laws(4) = &
    [character(14) :: 'coulomb', 'shear-factor', 'wanheim-bay', 'schmidt-hattel']

  real(rp), parameter :: everywhere = 1.0e3_rp   !! coefficient of Coulomb's law that does not
                                                 !! limit a shear factor, from p = k/1000 on

  type :: friction_law_t
    integer :: kind = law_coulomb
    real(rp) :: coefficient = 0.0_rp  !! m or delta; 0 for coulomb, which has mu
    logical :: shear_limit = .true.   !! of coulomb
  contains
    procedure :: limits
    procedure :: friction
    procedure :: keeps_mean
    procedure :: is_unlimited
  end type friction_law_t

  integer, parameter, public :: of_nothing = 0, of_temperature = 1, of_pressure = 2, of_slip = 3

  type :: friction_table_t
    integer :: of = of_nothing
    real(rp), allocatable :: at(:)     !! rising [K], [Pa] or [m/s]
    real(rp), allocatable :: mu(:)
  contains
    procedure :: coefficients
  end type friction_table_t

contains

  !> Velocity along the normal that contact takes from a particle, and its slip along the surface. A
  !> gap is closed and no more; the last `slop` of it closes only in the time `relaxation_time`, so
  !> that a surface that is rough by a few thousandths of a cell carries with all its particles and
  !> not with those that stand out. A penetration is taken back within a step, but no faster than
  !> `recovery_speed` or than the particle comes, which is more than a lasting load needs; what is
  !> left of it in the time `relaxation_time`. A particle that is found deep inside (behind an edge,
  !> say) gets no kick: kicks of depth/dt kept a stirred plate in a tremor by which it flowed under
  !> three quarters of the force.
  pure subroutine normal_velocity(dt, regular, slop, relaxation_time, recovery_speed, gap, &
                                  normal, velocity, closing, slip, approach)
    real(rp), intent(in) :: dt, regular         !! this step and the one before [s]
    real(rp), intent(in) :: slop                !! width of the zone where gaps close slowly [m]
    real(rp), intent(in) :: relaxation_time                !! in which they do [s]
    real(rp), intent(in) :: recovery_speed                !! [m/s]
    real(rp), intent(in) :: gap                 !! at the end of the step, without contact [m]
    real(rp), intent(in) :: normal(3)           !! out of the tool
    real(rp), intent(in) :: velocity(3)         !! against the tool, without contact [m/s]
    real(rp), intent(out) :: closing, slip(3)   !! [m/s]
    real(rp), intent(out), optional :: approach  !! `closing` without what takes back a
                                                 !! penetration [m/s]
    real(rp) :: back, before, speed

    speed = dot_product(velocity, normal)
    slip = velocity - speed*normal
    before = gap - dt*speed
    if (before < 0.0_rp) then
      back = min(-before/max(dt, regular), max(recovery_speed, -speed))
      closing = -speed + back + max(0.0_rp, -before - dt*back)/max(relaxation_time, dt)
    else
      closing = -speed - min(before, slop)/max(relaxation_time, dt) - max(0.0_rp, before - slop)/dt
    end if
    if (present(approach)) approach = merge(-speed, closing, before < 0.0_rp)
  end subroutine normal_velocity

  !> Of a particle with shear strength `k` (impulse or stress) and the law's own coefficient (mu, m
  !> or delta): `mu`, by which the normal impulse counts, the most that friction reaches, and the
  !> part of it at which a law bends.
  elemental subroutine limits(self, coefficient, k, mu, most, bend)
    class(friction_law_t), intent(in) :: self
    real(rp), intent(in) :: coefficient, k
    real(rp), intent(inout) :: mu
    real(rp), intent(out) :: most, bend
    real(rp) :: pressure

    most = k
    bend = k
    select case (self%kind)
    case (law_shear_factor)
      mu = everywhere
      most = coefficient*k
      bend = most
    case (law_wanheim_bay)
      call wanheim_bay(coefficient, pressure, bend)
      mu = bend/pressure
      most = coefficient*k
      bend = bend*k
    case (law_schmidt_hattel)
      bend = coefficient*k
    case default
    end select
  end subroutine limits

  !> What friction gives of `hold`, if the pressure lets it give `pressed` and the particles `most`,
  !> with the bend of their law: a part of 1.
  pure real(rp) function friction(self, hold, pressed, most, bend) result(part)
    class(friction_law_t), intent(in) :: self
    real(rp), intent(in) :: hold(3), pressed, most, bend    !! [N s]
    real(rp) :: limit, wanted

    wanted = norm2(hold)
    limit = min(pressed, most)
    select case (self%kind)
    case (law_wanheim_bay)
      if (pressed > bend .and. most > bend) limit = bend + (most - bend) &
          *(1.0_rp - exp(-(pressed - bend)/(most - bend)))
    case (law_schmidt_hattel)
      if (pressed > 0.0_rp .and. most > 0.0_rp) limit = bend + (1.0_rp - bend/most)*limit
    case default
    end select
    part = 1.0_rp
    if (limit < wanted) part = limit/wanted
  end function friction

  !> True if friction is no simple limit of what the pressure lets it give: then the mean pressure
  !> of a relaxation time counts, else what it could have given and did not is kept so long.
  elemental logical function keeps_mean(self)
    class(friction_law_t), intent(in) :: self

    keeps_mean = self%kind == law_wanheim_bay
  end function keeps_mean

  !> True if the strength of the metal does not limit friction, as long as it has any.
  elemental logical function is_unlimited(self)
    class(friction_law_t), intent(in) :: self

    is_unlimited = self%kind == law_coulomb .and. .not. self%shear_limit
  end function is_unlimited

  !> End of proportional friction at a friction factor m: pressure and shear stress there, over k.
  elemental subroutine wanheim_bay(m, pressure, shear)
    real(rp), intent(in) :: m                  !! up to 1
    real(rp), intent(out) :: pressure, shear

    shear = 1.0_rp - sqrt(1.0_rp - m)
    pressure = (1.0_rp + 0.5_rp*acos(-1.0_rp) + acos(m) + sqrt(1.0_rp - m*m)) &
               /(1.0_rp + sqrt(1.0_rp - m))
  end subroutine wanheim_bay

  !> Coefficients of the first `n` particles of a block.
  pure subroutine coefficients(self, n, temp, pressure, slip, mu)
    class(friction_table_t), intent(in) :: self      !! of something
    integer, intent(in) :: n
    real(rp), intent(in) :: temp(nlane)              !! [K]
    real(rp), intent(in) :: pressure(nlane)          !! [Pa]
    real(rp), intent(in) :: slip(nlane)              !! speed of sliding [m/s]
    real(rp), intent(out) :: mu(nlane)

    select case (self%of)
    case (of_temperature)
      call look_up(self%at, self%mu, n, temp, mu)
    case (of_pressure)
      call look_up(self%at, self%mu, n, pressure, mu)
    case default
      call look_up(self%at, self%mu, n, slip, mu)
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

end module contact_law
