! SPDX-License-Identifier: MIT
!> A single material point: the flow law along given increments of plastic strain and temperature,
!> without elasticity, to second order in the increment.
module physics_point
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: n_work
  use physics_material, only: material_t
  implicit none (type, external)
  private

  public :: point_t

  !> Strain rate at which the flow stress of a point at rest is evaluated [1/s].
  real(rp), parameter :: rest_rate = 1.0e-12_rp

  type :: point_t
    real(rp) :: alpha = 0.0_rp           !! plastic strain
    real(rp) :: temp = 298.0_rp          !! temperature [K]
    real(rp) :: rate = 1.0_rp            !! plastic strain rate [1/s]
    real(rp) :: sigma = 0.0_rp           !! flow stress at this rate [Pa]
    real(rp), allocatable :: state(:)    !! internal variables
  contains
    procedure :: init, strain_to, strain_adiabatic, anneal, outputs
  end type point_t

contains

  !> Initialise an undeformed point at a temperature [K]; the material has a flow law.
  subroutine init(self, material, temp, rate)
    class(point_t), intent(inout) :: self
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: temp, rate

    if (allocated(self%state)) deallocate (self%state)
    allocate (self%state(material%flow%n_state))
    call material%flow%start(self%state)
    self%alpha = 0.0_rp
    self%temp = temp
    self%rate = rate
    self%sigma = strength(self, material)
  end subroutine init

  !> Increase the plastic strain by `x` at `rate` while the temperature changes to `temp`.
  subroutine strain_to(self, material, x, rate, temp)
    class(point_t), intent(inout) :: self
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: x      !! plastic strain increment [-]
    real(rp), intent(in) :: rate   !! plastic strain rate [1/s]
    real(rp), intent(in) :: temp   !! temperature [K]
    real(rp) :: work(nlane, n_work), lanes(nlane), log_rate(nlane)
    real(rp) :: state(nlane, material%flow%n_state)

    self%rate = rate
    if (x > 0.0_rp) then
      state = spread(self%state, 1, nlane)
      lanes = 0.5_rp*(self%temp + temp)
      call material%flow%prepare(lanes, state, work)
      lanes = x
      log_rate = log(rate)
      call material%flow%advance(work, lanes, log_rate, state)
      self%state = state(1, :)
    end if
    self%alpha = self%alpha + x
    self%temp = temp
    self%sigma = strength(self, material)
  end subroutine strain_to

  !> Increase the plastic strain by `x` at `rate`, with heating by the plastic work.
  subroutine strain_adiabatic(self, material, x, rate)
    class(point_t), intent(inout) :: self
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: x, rate
    type(point_t) :: trial
    real(rp) :: heat, rise

    heat = material%plastic_heat/(material%rho*material%c_p)*x
    trial = self
    rise = material%temperature_rise(self%temp, heat*self%sigma)
    call trial%strain_to(material, x, rate, self%temp + rise)
    rise = material%temperature_rise(self%temp, 0.5_rp*heat*(self%sigma + trial%sigma))
    call self%strain_to(material, x, rate, self%temp + rise)
  end subroutine strain_adiabatic

  !> Static changes of the state over `dt` at the point's temperature and rate.
  subroutine anneal(self, material, dt)
    class(point_t), intent(inout) :: self
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: dt                    !! time step [s]
    real(rp) :: temp(nlane), rate(nlane), state(nlane, material%flow%n_state)

    if (.not. material%flow%anneals) return
    temp = self%temp
    rate = self%rate
    state = spread(self%state, 1, nlane)
    call material%flow%anneal(dt, temp, rate, state)
    self%state = state(1, :)
    self%sigma = strength(self, material)
  end subroutine anneal

  !> Values of the `n` outputs of the law.
  function outputs(self, material, n) result(values)
    class(point_t), intent(in) :: self
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp) :: values(n), block(nlane, n)

    call material%flow%describe(spread(self%state, 1, nlane), n, block)
    values = block(1, :)
  end function outputs

  !> Flow stress of the present state [Pa].
  real(rp) function strength(self, material)
    type(point_t), intent(in) :: self
    type(material_t), intent(in) :: material
    real(rp), dimension(nlane) :: temp, alpha, x, log_rate, sigma, slope
    real(rp) :: work(nlane, n_work), state(nlane, material%flow%n_state)

    temp = self%temp
    alpha = self%alpha
    x = 0.0_rp
    log_rate = log(merge(self%rate, rest_rate, self%rate > 0.0_rp))
    state = spread(self%state, 1, nlane)
    call material%flow%prepare(temp, state, work)
    call material%flow%stress(work, alpha, x, log_rate, sigma, slope)
    strength = sigma(1)
  end function strength

end module physics_point
