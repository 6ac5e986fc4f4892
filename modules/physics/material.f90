! SPDX-License-Identifier: MIT
!> A material: elasticity, thermal properties, and flow law.
module physics_material
  use base_kinds, only: nlane, rp
  use physics_elastic, only: change_coupled, change_decoupled, coupled_energy, decoupled_energy
  use physics_flow_law, only: flow_law_t, max_warnings
  implicit none (type, external)
  private

  public :: heat_table_t, material_t

  !> A temperature-dependent property: linear between the points of a table, constant beyond its
  !> ends, with its exact integral over temperature and the inverse of the integral.
  type :: heat_table_t
    real(rp), allocatable :: t(:)         !! increasing temperatures [K]
    real(rp), allocatable :: y(:)         !! values of the property, above 0
    !> Slopes above each temperature, 0 above the last [unit of the property/K].
    real(rp), allocatable :: slope(:)
    real(rp), allocatable :: area(:)      !! integral of the property from 0 K to each temperature
  contains
    procedure :: init, at, integral, rise
  end type heat_table_t

  type :: material_t
    character(32) :: name = ''
    real(rp) :: rho = 1.0_rp                    !! density [kg/m3]
    real(rp) :: k = 0.0_rp                      !! bulk modulus [Pa]
    real(rp) :: g = 0.0_rp                      !! shear modulus [Pa]
    real(rp) :: g_true = 0.0_rp                 !! shear modulus without elastic scaling [Pa]
    logical :: is_coupled = .false.             !! the elastic energy couples volume and shape
    real(rp) :: expansion = 0.0_rp              !! linear thermal expansion [1/K]
    real(rp) :: t_ref = 298.0_rp                !! temperature without thermal strain [K]
    real(rp) :: c_p = 400.0_rp                  !! specific heat if there is no table [J/(kg K)]
    !> c_p was given; otherwise it only scales rounding errors.
    logical :: has_heat_capacity = .false.
    real(rp) :: t_melt = huge(1.0_rp)           !! melting temperature; huge: not given [K]
    real(rp) :: conductivity = 0.0_rp           !! conductivity if there is no table [W/(m K)]
    !> Specific heat [J/(kg K)]; its integral is the enthalpy.
    type(heat_table_t), allocatable :: c_table
    type(heat_table_t), allocatable :: k_table  !! conductivity [W/(m K)]
    real(rp) :: plastic_heat = 0.9_rp           !! fraction of plastic work that becomes heat
    class(flow_law_t), allocatable :: flow      !! flow law; unallocated: elastic only
    integer :: warning(max_warnings) = 0  !! indices of the warnings of the flow law in the scene
  contains
    procedure :: set_elastic, scale_moduli, poisson, young, lambda, wave_speed, elastic_energy
    procedure :: change_volume, anneals, conducts, conductivity_at, effusivity, heat_content
    procedure :: max_diffusivity, specific_heat_at, apply_heat, heat_to_melt, temperature_rise
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

  !> Divide the elastic moduli of metal that can flow by a factor; its flow law keeps the original
  !> shear modulus.
  elemental subroutine scale_moduli(self, factor)
    class(material_t), intent(inout) :: self
    real(rp), intent(in) :: factor

    if (.not. allocated(self%flow)) return
    self%k = self%k/factor
    self%g = self%g/factor
  end subroutine scale_moduli

  !> Poisson's ratio; 0 for a material without elasticity.
  elemental real(rp) function poisson(self)
    class(material_t), intent(in) :: self

    poisson = 0.0_rp
    if (self%k > 0.0_rp) poisson = (3.0_rp*self%k - 2.0_rp*self%g)/(6.0_rp*self%k + 2.0_rp*self%g)
  end function poisson

  !> True if the internal variables of the flow law change with time.
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

  !> True if the material conducts heat.
  elemental logical function conducts(self)
    class(material_t), intent(in) :: self

    conducts = self%conductivity > 0.0_rp .or. allocated(self%k_table)
  end function conducts

  !> Specific heat at a temperature [J/(kg K)].
  elemental real(rp) function specific_heat_at(self, temp) result(c)
    class(material_t), intent(in) :: self
    real(rp), intent(in) :: temp                  !! temperature [K]

    c = self%c_p
    if (allocated(self%c_table)) c = self%c_table%at(temp)
  end function specific_heat_at

  !> Heat that brings metal of a temperature to its melting temperature [J/kg]; 1e30 if it has none.
  elemental real(rp) function heat_to_melt(self, temp)
    class(material_t), intent(in) :: self
    real(rp), intent(in) :: temp                  !! temperature [K]

    heat_to_melt = 1.0e30_rp
    if (self%t_melt < huge(1.0_rp)) heat_to_melt = self%specific_heat_at(temp)*(self%t_melt - temp)
  end function heat_to_melt

  !> Conductivity at a temperature [W/(m K)].
  elemental real(rp) function conductivity_at(self, temp) result(k)
    class(material_t), intent(in) :: self
    real(rp), intent(in) :: temp                  !! temperature [K]

    k = self%conductivity
    if (allocated(self%k_table)) k = self%k_table%at(temp)
  end function conductivity_at

  !> Thermal effusivity at a temperature, sqrt(k rho c) [J/(m2 K s^0.5)].
  elemental real(rp) function effusivity(self, temp)
    class(material_t), intent(in) :: self
    real(rp), intent(in) :: temp                  !! temperature [K]

    effusivity = sqrt(self%conductivity_at(temp)*self%rho*self%specific_heat_at(temp))
  end function effusivity

  !> Conductivity [W/(m K)] and specific heat [J/(kg K)] where their ratio is largest. Between the
  !> points of both tables it is a ratio of linear functions, which is monotone.
  pure subroutine max_diffusivity(self, k, c)
    class(material_t), intent(in) :: self
    real(rp), intent(out) :: k, c

    k = self%conductivity_at(self%t_ref)
    c = self%specific_heat_at(self%t_ref)
    if (allocated(self%c_table)) call update_max_diffusivity(self, self%c_table%t, k, c)
    if (allocated(self%k_table)) call update_max_diffusivity(self, self%k_table%t, k, c)
  end subroutine max_diffusivity

  !> Replace k and c by the properties at the temperatures `temp` [K] if their diffusivity is
  !> larger.
  pure subroutine update_max_diffusivity(material, temp, k, c)
    class(material_t), intent(in) :: material
    real(rp), intent(in) :: temp(:)
    real(rp), intent(inout) :: k, c  !! conductivity [W/(m K)], specific heat [J/(kg K)]
    integer :: i

    do i = 1, size(temp)
      if (material%conductivity_at(temp(i))*c <= k*material%specific_heat_at(temp(i))) cycle
      k = material%conductivity_at(temp(i))
      c = material%specific_heat_at(temp(i))
    end do
  end subroutine update_max_diffusivity

  !> Heat content of `n` particles above 0 K [J].
  pure real(rp) function heat_content(self, n, mass, temp)
    class(material_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: mass(n), temp(n)      !! mass [kg], temperature [K]

    if (allocated(self%c_table)) then
      heat_content = sum(mass*self%c_table%integral(temp))
    else
      heat_content = self%c_p*sum(mass*temp)
    end if
  end function heat_content

  !> Temperature rise [K] by the heat that would cause the rise `rise` with the constant c_p.
  elemental real(rp) function temperature_rise(self, temp, rise)
    class(material_t), intent(in) :: self
    real(rp), intent(in) :: temp, rise            !! temperature, temperature rise [K]

    temperature_rise = rise
    if (allocated(self%c_table)) temperature_rise = self%c_table%rise(temp, self%c_p*rise)
  end function temperature_rise

  !> Correct temperatures that rose from `before` with the constant specific heat `c` for the change
  !> of the specific heat with temperature.
  pure subroutine apply_heat(self, c, before, temp)
    class(material_t), intent(in) :: self
    !> Specific heat [J/(kg K)] and temperature before [K].
    real(rp), intent(in) :: c(nlane), before(nlane)
    real(rp), intent(inout) :: temp(nlane)            !! temperatures [K]

    if (.not. allocated(self%c_table)) return
    temp = before + self%c_table%rise(before, c*(temp - before))
  end subroutine apply_heat

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
    real(rp), intent(in) :: mass(nlane), temp(nlane)   !! mass [kg], temperature [K]
    real(rp), intent(in) :: j(nlane), b(nlane, 6)      !! J, Bbar

    if (self%is_coupled) then
      elastic_energy = coupled_energy(n, self%lambda(), self%g, self%rho, mass, j, b)
    else
      elastic_energy = decoupled_energy(n, self%k, self%g, self%expansion, self%t_ref, self%rho, &
                                        mass, temp, j, b)
    end if
  end function elastic_energy

  !> Change of the stress of a block when J goes from `before` to `after`, and the energy absorbed
  !> by its `n` particles [J].
  pure subroutine change_volume(self, n, mass, temp, b, before, after, tau, energy)
    class(material_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: mass(nlane), temp(nlane), b(nlane, 6)   !! [kg], [K], Bbar
    real(rp), intent(in) :: before(nlane), after(nlane)
    real(rp), intent(inout) :: tau(nlane, 6)           !! Kirchhoff stress [Pa]
    real(rp), intent(out) :: energy(nlane)             !! of each particle [J]

    if (self%is_coupled) then
      call change_coupled(n, self%lambda(), self%g, self%rho, mass, b, before, after, tau, energy)
    else
      call change_decoupled(n, self%k, self%expansion, self%t_ref, self%rho, mass, temp, before, &
                            after, tau, energy)
    end if
  end subroutine change_volume

  !> Make the table of a property with values `y` at `n` increasing temperatures `t` [K].
  pure subroutine init(self, n, t, y)
    class(heat_table_t), intent(inout) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: t(n), y(n)
    integer :: i

    allocate (self%t, source=t)
    allocate (self%y, source=y)
    allocate (self%slope(n), self%area(n), source=0.0_rp)
    self%slope(:n - 1) = (y(2:) - y(:n - 1))/(t(2:) - t(:n - 1))
    self%area(1) = t(1)*y(1)
    do i = 2, n
      self%area(i) = self%area(i - 1) + 0.5_rp*(t(i) - t(i - 1))*(y(i) + y(i - 1))
    end do
  end subroutine init

  !> Property at a temperature [K].
  elemental real(rp) function at(self, t)
    class(heat_table_t), intent(in) :: self
    real(rp), intent(in) :: t
    integer :: i

    i = count(self%t <= t)
    at = self%y(max(1, i))
    if (i > 0) at = at + self%slope(i)*(t - self%t(i))
  end function at

  !> Integral of the property from 0 K to a temperature [K].
  elemental real(rp) function integral(self, t)
    class(heat_table_t), intent(in) :: self
    real(rp), intent(in) :: t
    integer :: i

    i = count(self%t <= t)
    if (i == 0) then
      integral = self%y(1)*t
    else
      integral = self%area(i) + (t - self%t(i))*(self%y(i) + 0.5_rp*self%slope(i)*(t - self%t(i)))
    end if
  end function integral

  !> Temperature rise from `t` [K] over which the integral grows by `d`, of either sign: piece by
  !> piece, which avoids rounding in differences of integrals.
  elemental real(rp) function rise(self, t, d)
    class(heat_table_t), intent(in) :: self
    real(rp), intent(in) :: t, d
    real(rp) :: ahead, left, now, y
    integer :: i, n, next

    n = size(self%t)
    now = t
    left = d
    rise = 0.0_rp
    i = count(self%t <= now)
    if (d < 0.0_rp .and. i > 0) i = count(self%t < now)   ! start in the lower piece
    next = merge(1, 0, d > 0.0_rp)
    do
      y = self%at(now)
      if (i + next < 1 .or. i + next > n) exit
      ahead = self%integral(self%t(i + next)) - self%integral(now)
      if (abs(left) <= abs(ahead)) exit
      rise = self%t(i + next) - t
      now = self%t(i + next)
      left = left - ahead
      i = i + 2*next - 1
    end do
    ahead = 0.0_rp
    if (i > 0) ahead = self%slope(i)
    ! Root of y x + slope x^2/2 = left without cancellation.
    rise = rise + 2.0_rp*left/(y + sqrt(max(0.0_rp, y*y + 2.0_rp*ahead*left)))
  end function rise

end module physics_material
