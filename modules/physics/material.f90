! SPDX-License-Identifier: MIT
!> A material: elastic constants, heat, and its flow law.
module physics_material
  use base_kinds, only: rp
  use physics_flow_law, only: flow_law_t
  implicit none (type, external)
  private

  public :: material_t

  type :: material_t
    character(32) :: name = ''
    real(rp) :: rho = 1.0_rp           !! density [kg/m3]
    real(rp) :: k = 0.0_rp             !! bulk modulus [Pa]
    real(rp) :: g = 0.0_rp             !! shear modulus [Pa]
    real(rp) :: expansion = 0.0_rp     !! linear thermal expansion [1/K]
    real(rp) :: t_ref = 298.0_rp       !! temperature without thermal strain [K]
    real(rp) :: c_p = 1.0_rp           !! specific heat [J/(kg K)]
    real(rp) :: conductivity = 0.0_rp  !! [W/(m K)]
    real(rp) :: plastic_heat = 0.9_rp  !! share of plastic work that becomes heat
    class(flow_law_t), allocatable :: flow   !! unallocated: elastic only
  contains
    procedure :: set_elastic
    procedure :: wave_speed
  end type material_t

contains

  !> Bulk and shear modulus from Young's modulus [Pa] and Poisson's ratio.
  pure subroutine set_elastic(self, young, poisson)
    class(material_t), intent(inout) :: self
    real(rp), intent(in) :: young, poisson

    self%k = young/(3.0_rp*(1.0_rp - 2.0_rp*poisson))
    self%g = young/(2.0_rp*(1.0_rp + poisson))
  end subroutine set_elastic

  !> Speed of pressure waves at rest [m/s], without mass scaling.
  pure real(rp) function wave_speed(self)
    class(material_t), intent(in) :: self

    wave_speed = sqrt((self%k + 4.0_rp/3.0_rp*self%g)/self%rho)
  end function wave_speed

end module physics_material
