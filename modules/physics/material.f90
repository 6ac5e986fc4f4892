! SPDX-License-Identifier: MIT
!> A material: elastic constants and energy, heat, and its flow law.
module physics_material
  use base_kinds, only: nlane, rp
  use physics_coupled, only: change_coupled, coupled_energy
  use physics_elastic, only: change_decoupled, decoupled_energy
  use physics_flow_law, only: flow_law_t, most_warnings
  implicit none (type, external)
  private

  public :: material_t

  type :: material_t
    character(32) :: name = ''
    real(rp) :: rho = 1.0_rp           !! density [kg/m3]
    real(rp) :: k = 0.0_rp             !! bulk modulus [Pa]
    real(rp) :: g = 0.0_rp             !! shear modulus [Pa]
    real(rp) :: g_true = 0.0_rp        !! shear modulus without elastic scaling [Pa]
    logical :: is_coupled = .false.    !! energy of physics_coupled instead of physics_elastic
    real(rp) :: expansion = 0.0_rp     !! linear thermal expansion [1/K]
    real(rp) :: t_ref = 298.0_rp       !! temperature without thermal strain [K]
    real(rp) :: c_p = 400.0_rp         !! specific heat [J/(kg K)]
    logical :: knows_heat = .false.  !! c_p was given; else only a scale for rounding errors sees it
    real(rp) :: t_melt = huge(1.0_rp)  !! melting temperature; huge: not given [K]
    real(rp) :: conductivity = 0.0_rp  !! [W/(m K)]
    real(rp) :: plastic_heat = 0.9_rp  !! share of plastic work that becomes heat
    class(flow_law_t), allocatable :: flow   !! unallocated: elastic only
    integer :: warning(most_warnings) = 0    !! places of its law's warnings among the scene's
  contains
    procedure :: set_elastic
    procedure :: soften
    procedure :: young
    procedure :: lambda
    procedure :: wave_speed
    procedure :: elastic_energy
    procedure :: change_volume
    procedure :: anneals
    procedure :: effusivity
  end type material_t

contains

  !> Bulk and shear modulus from Young's modulus [Pa] and Poisson's ratio.
  pure subroutine set_elastic(self, young, poisson)
    class(material_t), intent(inout) :: self
    real(rp), intent(in) :: young, poisson

    self%k = young/(3.0_rp*(1.0_rp - 2.0_rp*poisson))
    self%g = young/(2.0_rp*(1.0_rp + poisson))
    self%g_true = self%g
  end subroutine set_elastic

  !> Divide the elastic moduli of metal that can flow by a factor; its law keeps the true ones.
  elemental subroutine soften(self, factor)
    class(material_t), intent(inout) :: self
    real(rp), intent(in) :: factor

    if (.not. allocated(self%flow)) return
    self%k = self%k/factor
    self%g = self%g/factor
  end subroutine soften

  !> True if time alone changes the internal variables of its flow law.
  elemental logical function anneals(self)
    class(material_t), intent(in) :: self

    anneals = .false.
    if (allocated(self%flow)) anneals = self%flow%anneals
  end function anneals

  !> Young's modulus [Pa].
  elemental real(rp) function young(self)
    class(material_t), intent(in) :: self

    young = 9.0_rp*self%k*self%g/(3.0_rp*self%k + self%g)
  end function young

  !> Thermal effusivity, sqrt(k rho c) [J/(m2 K s^0.5)].
  pure real(rp) function effusivity(self)
    class(material_t), intent(in) :: self

    effusivity = sqrt(self%conductivity*self%rho*self%c_p)
  end function effusivity

  !> Lame's first constant [Pa].
  pure real(rp) function lambda(self)
    class(material_t), intent(in) :: self

    lambda = self%k - 2.0_rp/3.0_rp*self%g
  end function lambda

  !> Speed of pressure waves at rest [m/s], without mass scaling.
  pure real(rp) function wave_speed(self)
    class(material_t), intent(in) :: self

    wave_speed = sqrt((self%k + 4.0_rp/3.0_rp*self%g)/self%rho)
  end function wave_speed

  !> Elastic energy of `n` particles of a block [J].
  pure real(rp) function elastic_energy(self, n, mass, temp, j, b)
    class(material_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: mass(nlane), temp(nlane)   !! [kg], [K]
    real(rp), intent(in) :: j(nlane), b(nlane, 6)      !! J, Bbar

    if (self%is_coupled) then
      elastic_energy = coupled_energy(n, self%lambda(), self%g, self%rho, mass, j, b)
    else
      elastic_energy = decoupled_energy(n, self%k, self%g, self%expansion, self%t_ref, self%rho, &
                                        mass, temp, j, b)
    end if
  end function elastic_energy

  !> Stress of a block whose J alone goes from `before` to `after`, and the energy that its `n`
  !> particles take up [J].
  pure subroutine change_volume(self, n, mass, temp, b, before, after, tau, energy)
    class(material_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: mass(nlane), temp(nlane), b(nlane, 6)   !! [kg], [K], Bbar
    real(rp), intent(in) :: before(nlane), after(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)           !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: energy

    if (self%is_coupled) then
      call change_coupled(n, self%lambda(), self%g, self%rho, mass, b, before, after, tau, energy)
    else
      call change_decoupled(n, self%k, self%expansion, self%t_ref, self%rho, mass, temp, before, &
                            after, tau, energy)
    end if
  end subroutine change_volume

end module physics_material
