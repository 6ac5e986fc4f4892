! SPDX-License-Identifier: MIT
!> Grooves side by side, as those of a thread and of a scroll: their profile over a pitch, in
!> straight lines, and where its corners are.
module tool_meshes_grooves
  use base_kinds, only: pi, rp
  implicit none (type, external)
  private

  public :: grooves_t, profile_names

  character(*), parameter :: profile_names = 'square v round'
  integer, parameter :: most_knots = 16        !! a round groove is met within 1 % of its depth

  !> Along the way w across the grooves and the angle phi about the axis, all depends on
  !> u = w/pitch + rise phi/(2 pi): the groove is `depth` times part(u) deep.
  type :: grooves_t
    real(rp) :: pitch = 0.0_rp, depth = 0.0_rp   !! [m]; depth 0: there are none
    integer :: rise = 0                          !! pitches that a groove goes to smaller w in a
                                                 !! turn (counterclockwise seen from above)
    integer :: n = 0
    real(rp) :: at(most_knots) = 0.0_rp          !! corners of the profile over a pitch, from 0 to 1
    real(rp) :: part(most_knots) = 0.0_rp        !! of the depth there
  contains
    procedure :: set_profile
    procedure :: key_of
    procedure :: part_at
    procedure :: place_of
    procedure :: part_of
  end type grooves_t

contains

  !> A profile by its name.
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
      self%n = most_knots
      self%at = [(real(i, rp)/most_knots, i=0, most_knots - 1)]
      self%part = 0.5_rp*(1.0_rp - cos(2.0_rp*pi*self%at))
    case default
      self%n = 4
      self%at(:4) = [0.25_rp, 0.25_rp, 0.75_rp, 0.75_rp]
      self%part(:4) = [0.0_rp, 1.0_rp, 1.0_rp, 0.0_rp]
    end select
  end subroutine set_profile

  !> Number of the corner at place `w` and angle `phi`, with fractions between corners.
  pure real(rp) function key_of(self, w, phi)
    class(grooves_t), intent(in) :: self
    real(rp), intent(in) :: w, phi               !! [m], [rad]
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

  !> Part of the depth there.
  pure real(rp) function part_at(self, key)
    class(grooves_t), intent(in) :: self
    real(rp), intent(in) :: key                  !! of `key_of`
    real(rp), parameter :: least = 1.0e-9_rp     !! no slivers beside a corner
    real(rp) :: beyond
    integer :: k

    k = floor(key)
    beyond = key - k
    if (beyond < least) beyond = 0.0_rp
    if (beyond > 1.0_rp - least) beyond = 1.0_rp
    part_at = (1.0_rp - beyond)*self%part_of(k) + beyond*self%part_of(k + 1)
  end function part_at

  !> Part of the depth at corner number `k`.
  pure real(rp) function part_of(self, k)
    class(grooves_t), intent(in) :: self
    integer, intent(in) :: k

    part_of = self%part(modulo(k - 1, self%n) + 1)
  end function part_of

  !> Place w of corner number `k` [m].
  pure real(rp) function place_of(self, k, phi)
    class(grooves_t), intent(in) :: self
    integer, intent(in) :: k
    real(rp), intent(in) :: phi
    integer :: i, turns

    i = modulo(k - 1, self%n) + 1
    turns = (k - i)/self%n
    place_of = self%pitch*(turns + self%at(i) - self%rise*phi/(2.0_rp*pi))
  end function place_of

end module tool_meshes_grooves
