! SPDX-License-Identifier: MIT
!> Heat films on the faces of a body: a heat-transfer coefficient, which may depend on pressure, and
!> radiation.
module simulation_film
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: film_t, stefan_boltzmann

  real(rp), parameter :: stefan_boltzmann = 5.670374419e-8_rp   !! [W/(m2 K4)] (CODATA 2018)

  integer, parameter, public :: of_nothing = 0, of_pressure = 1
  real(rp), parameter :: unit_pressure = 1.0e6_rp   !! reference pressure of the power law [Pa]

  type :: film_t
    integer :: of = of_nothing                !! variable that the coefficient depends on
    real(rp) :: coefficient = 0.0_rp          !! constant part [W/(m2 K)]
    real(rp) :: factor = 0.0_rp               !! power law: coefficient added at 1 MPa [W/(m2 K)]
    real(rp) :: exponent = 1.0_rp             !! power law: exponent of the pressure
    real(rp), allocatable :: at(:), there(:)  !! table: pressure [Pa], coefficient [W/(m2 K)]
    real(rp) :: emissivity = 0.0_rp
    real(rp) :: ambient = 298.0_rp    !! temperature beyond the film [K]
    logical :: has_backing = .false.  !! beyond the film is a body with its own temperature
  contains
    procedure :: acts, varies, coefficient_at
  end type film_t

contains

  !> True if the film transfers heat.
  elemental logical function acts(self)
    class(film_t), intent(in) :: self

    acts = self%coefficient > 0.0_rp .or. self%emissivity > 0.0_rp .or. self%of /= of_nothing
  end function acts

  !> True if the film is more than a constant coefficient.
  elemental logical function varies(self)
    class(film_t), intent(in) :: self

    varies = self%emissivity > 0.0_rp .or. self%of /= of_nothing .or. self%has_backing
  end function varies

  !> Heat-transfer coefficient at a pressure [W/(m2 K)]: linear in the table and constant outside,
  !> or the power law. Tension counts as zero pressure.
  pure real(rp) function coefficient_at(self, x) result(h)
    class(film_t), intent(in) :: self
    real(rp), intent(in) :: x                     !! pressure [Pa]
    real(rp) :: part
    integer :: i

    h = self%coefficient
    if (self%of == of_nothing) return
    if (.not. allocated(self%at)) then
      if (x > 0.0_rp) h = h + self%factor*(x/unit_pressure)**self%exponent
      return
    end if
    i = count(self%at <= x)
    h = self%there(max(1, i))
    if (i == 0 .or. i == size(self%at)) return
    part = (x - self%at(i))/(self%at(i + 1) - self%at(i))
    h = h + part*(self%there(i + 1) - h)
  end function coefficient_at

end module simulation_film
