! SPDX-License-Identifier: MIT
!> Parallel grooves of a thread or a scroll: their polygonal profile over a pitch, and the positions
!> of its corners.
module tools_shape_grooves
  use base_kinds, only: pi, rp
  implicit none (type, external)
  private

  public :: grooves_t, profile_names

  character(*), parameter :: profile_names = 'square v round'
  integer, parameter :: max_knots = 16   !! round grooves are approximated to 1 % of their depth

  !> With the coordinate w across the grooves and the angle phi about the axis, the depth of the
  !> groove is `depth` times a function of u = w/pitch + rise phi/(2 pi).
  type :: grooves_t
    real(rp) :: pitch = 0.0_rp, depth = 0.0_rp   !! [m]; depth 0: there are none
    !> Pitches by which w of a groove decreases per turn (counterclockwise seen from above).
    integer :: rise = 0
    integer :: n = 0
    real(rp) :: at(max_knots) = 0.0_rp           !! u of the profile corners, from 0 to 1
    real(rp) :: part(max_knots) = 0.0_rp         !! fraction of the depth at the corners
  contains
    procedure :: set_profile, key_of, part_at, coordinate_of, part_of
  end type grooves_t

contains

  !> Set a profile by its name.
  pure subroutine set_profile(self, name)
    class(grooves_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer :: i

    select case (name)
    case ('v')
      self%n = 2
      self%at(:2) = [0.0_rp, 0.5_rp]
      self%part(:2) = [0.0_rp, 1.0_rp]
    case ('round')
      self%n = max_knots
      self%at = [(real(i, rp)/max_knots, i=0, max_knots - 1)]
      self%part = 0.5_rp*(1.0_rp - cos(2.0_rp*pi*self%at))
    case default
      self%n = 4
      self%at(:4) = [0.25_rp, 0.25_rp, 0.75_rp, 0.75_rp]
      self%part(:4) = [0.0_rp, 1.0_rp, 1.0_rp, 0.0_rp]
    end select
  end subroutine set_profile

  !> Corner number at coordinate `w` and angle `phi`, fractional between corners.
  pure real(rp) function key_of(self, w, phi)
    class(grooves_t), intent(in) :: self
    real(rp), intent(in) :: w, phi               !! coordinate across the grooves [m], angle [rad]
    real(rp) :: from, rest, to, u
    integer :: i

    u = w/self%pitch + self%rise*phi/(2.0_rp*pi)
    rest = u - floor(u)
    i = count(self%at(:self%n) <= rest)
    if (i == 0) then
      from = self%at(self%n) - 1.0_rp
      to = self%at(1)
    else
      from = self%at(i)
      to = self%at(1) + 1.0_rp
      if (i < self%n) to = self%at(i + 1)
    end if
    key_of = real(self%n*floor(u) + i, rp) + (rest - from)/(to - from)
  end function key_of

  !> Fraction of the depth at a fractional corner number.
  pure real(rp) function part_at(self, key)
    class(grooves_t), intent(in) :: self
    real(rp), intent(in) :: key                  !! corner number of `key_of`
    real(rp), parameter :: tolerance = 1.0e-9_rp  !! avoids slivers at a corner
    real(rp) :: excess
    integer :: k

    k = floor(key)
    excess = key - k
    if (excess < tolerance) excess = 0.0_rp
    if (excess > 1.0_rp - tolerance) excess = 1.0_rp
    part_at = (1.0_rp - excess)*self%part_of(k) + excess*self%part_of(k + 1)
  end function part_at

  !> Fraction of the depth at corner number `k`.
  pure real(rp) function part_of(self, k)
    class(grooves_t), intent(in) :: self
    integer, intent(in) :: k

    part_of = self%part(modulo(k - 1, self%n) + 1)
  end function part_of

  !> Coordinate w of corner number `k` [m].
  pure real(rp) function coordinate_of(self, k, phi)
    class(grooves_t), intent(in) :: self
    integer, intent(in) :: k
    real(rp), intent(in) :: phi
    integer :: i, turns

    i = modulo(k - 1, self%n) + 1
    turns = (k - i)/self%n
    coordinate_of = self%pitch*(turns + self%at(i) - self%rise*phi/(2.0_rp*pi))
  end function coordinate_of

end module tools_shape_grooves
