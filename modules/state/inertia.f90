! SPDX-License-Identifier: MIT
!> Loads of the tools that accelerate metal: bounds of the error of scaled inertia.
!>
!> By the balance of momentum, chi dP/dt is the difference of the force of the tools and of what
!> bears it; by the balance of energy, chi dK/dt is the part of their power that neither deforms nor
!> heats. Where a load rises faster than waves carry it on, the force of a tool with the impedance
!> rho c chi^(1/2) is all momentum, and half of its power is kinetic energy, as much as the wave
!> stores elastically: 2 chi |dK/dt| is the power. Momenta of symmetric flow cancel, but not its
!> power; the power of a tool that spins hides that of its way, but not its momentum. Steady flow
!> changes neither.
module state_inertia
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: inertia_t

  !> State at the last time looked at, of all ranks, without mass scaling.
  type :: inertia_t
    real(rp) :: at(6) = 0.0_rp           !! time [s], momentum [kg m/s], kinetic energy, work [J]
    real(rp), allocatable :: impulse(:, :)   !! of each tool [N s]
    real(rp) :: load(2) = 0.0_rp         !! largest sum of the forces of the tools [N], power [W]
    real(rp) :: of_inertia(2) = 0.0_rp   !! inertial force [N] and power [W] since the last time
    real(rp) :: largest(2) = 0.0_rp      !! their largest values
  contains
    procedure :: advance, part
  end type inertia_t

contains

  !> Find the inertial loads since the last call, with the mass scaling `chi`.
  subroutine advance(self, chi, now, impulse)
    class(inertia_t), intent(inout) :: self
    real(rp), intent(in) :: chi, now(6), impulse(:, :)
    real(rp) :: change(6), load(2)

    change = now - self%at
    self%of_inertia = 0.0_rp
    if (change(1) > 0.0_rp) then
      load = [sum(norm2(impulse - self%impulse, 1)), abs(change(6))]/change(1)
      self%of_inertia = chi*[norm2(change(2:4)), 2.0_rp*abs(change(5))]/change(1)
      where (load <= 0.0_rp) self%of_inertia = 0.0_rp    ! no tool touches
      self%load = max(self%load, load)
      self%largest = max(self%largest, self%of_inertia)
    end if
    self%at = now
    self%impulse = impulse
  end subroutine advance

  !> Inertial loads over the largest loads so far, the larger of force and power.
  pure real(rp) function part(self, loads)
    class(inertia_t), intent(in) :: self
    real(rp), intent(in) :: loads(2)

    part = maxval(loads/max(self%load, tiny(1.0_rp)))
  end function part

end module state_inertia
