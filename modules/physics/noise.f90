! SPDX-License-Identifier: MIT
!> Initial velocity noise that the grid does not resolve: random, or alternating between lattice
!> points. It depends on the lattice point only, not on ranks or numbering.
module physics_noise
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: noise_t

  integer(i8), parameter :: word = 4294967295_i8   !! 32 bits

  type :: noise_t
    real(rp) :: amplitude = 0.0_rp          !! A [m/s]
    logical :: takes_part(3) = .false.      !! components that are not zero
    logical :: alternates = .false.         !! alternating +A and -A along these axes
    integer :: seed = 1
    real(rp) :: corner(3) = 0.0_rp          !! a corner between lattice points [m]
    real(rp) :: spacing(3) = 1.0_rp         !! spacing of the lattice [m]
  contains
    procedure :: velocity
  end type noise_t

contains

  !> Velocity of the particle that starts at the lattice point `x0` [m/s].
  pure function velocity(self, x0) result(v)
    class(noise_t), intent(in) :: self
    real(rp), intent(in) :: x0(3)           !! initial position [m]
    real(rp) :: v(3)
    integer :: site(3), a
    integer(i8) :: bits

    site = floor((x0 - self%corner)/self%spacing)
    v = 0.0_rp
    if (self%alternates) then
      where (self%takes_part) &
        v = self%amplitude*(1 - 2*modulo(sum(site, mask=self%takes_part), 2))
      return
    end if
    bits = mixed(int(self%seed, i8))
    do a = 1, 3
      bits = mixed(ieor(bits, int(site(a), i8)))
    end do
    do a = 1, 3
      bits = mixed(bits + a)
      if (self%takes_part(a)) v(a) = self%amplitude*(2.0_rp*real(bits, rp)/real(word, rp) - 1.0_rp)
    end do
  end function velocity

  !> 32 bits, each of which depends on all lower 32 bits of `key`.
  pure integer(i8) function mixed(key)
    integer(i8), intent(in) :: key
    integer(i8), parameter :: factor = 73244475_i8   ! an odd number with scattered bits

    mixed = iand(key, word)
    mixed = iand(ieor(mixed, ishft(mixed, -16))*factor, word)
    mixed = iand(ieor(mixed, ishft(mixed, -16))*factor, word)
    mixed = ieor(mixed, ishft(mixed, -16))
  end function mixed

end module physics_noise
