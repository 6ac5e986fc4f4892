! SPDX-License-Identifier: MIT
!> What a flow law must offer: the flow stress of a batch of particles and its slope.
!> A new law is a type in a file of its own and one line in `physics_material`.
module physics_flow_law
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: flow_law_t

  integer, parameter, public :: n_work = 4   !! reals a law may prepare per particle

  type, abstract :: flow_law_t
  contains
    procedure(prepare_interface), deferred :: prepare
    procedure(stress_interface), deferred :: stress
  end type flow_law_t

  abstract interface
    !> What depends on temperature alone, once a step.
    subroutine prepare_interface(self, temp, work)
      import :: flow_law_t, nlane, n_work, rp
      implicit none (type, external)
      class(flow_law_t), intent(in) :: self
      real(rp), intent(in) :: temp(nlane)             !! temperature [K]
      real(rp), intent(out) :: work(nlane, n_work)
    end subroutine prepare_interface

    !> Flow stress at plastic strain alpha + x and rate x/dt, and its derivative by ln x.
    subroutine stress_interface(self, work, alpha, x, log_rate, sigma, slope)
      import :: flow_law_t, nlane, n_work, rp
      implicit none (type, external)
      class(flow_law_t), intent(in) :: self
      real(rp), intent(in) :: work(nlane, n_work)
      real(rp), intent(in) :: alpha(nlane)            !! plastic strain at the step's start
      real(rp), intent(in) :: x(nlane)                !! its increment
      real(rp), intent(in) :: log_rate(nlane)         !! ln(x/dt) [ln 1/s]
      real(rp), intent(out) :: sigma(nlane)           !! [Pa]
      real(rp), intent(out) :: slope(nlane)           !! d sigma / d ln x [Pa]
    end subroutine stress_interface
  end interface

end module physics_flow_law
