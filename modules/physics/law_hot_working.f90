! SPDX-License-Identifier: MIT
!> Cold strength and hot flow in one law: the lower of the stresses of Johnson & Cook and of Sellars
!> & Tegart at the same strain, rate and temperature. Cold metal hardens and yields as in tests
!> below half of the melting temperature; hot metal flows at the rate-controlled stress of hot
!> working, which Johnson & Cook's softening misses by a factor of two and more.
module physics_law_hot_working
  use base_kinds, only: nlane, rp
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, n_work
  use physics_law_johnson_cook, only: johnson_cook_t
  use physics_law_sellars_tegart, only: sellars_tegart_t
  implicit none (type, external)
  private

  public :: hot_working_t

  type, extends(flow_law_t) :: hot_working_t
    type(johnson_cook_t) :: cold
    type(sellars_tegart_t) :: hot
  contains
    procedure :: read_keys
    procedure, nopass :: has_own_melting
    procedure :: prepare, stress
  end type hot_working_t

  integer, parameter :: own = 3   !! first column of `work` that belongs to the hot law

contains

  subroutine read_keys(self, input, i, shear)
    class(hot_working_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear

    call self%cold%read_keys(input, i, shear)
    call self%hot%read_keys(input, i, shear)
  end subroutine read_keys

  !> True, as the cold law decreases from T_ROOM to 0 at T_MELT.
  pure logical function has_own_melting()
    has_own_melting = .true.
  end function has_own_melting

  subroutine prepare(self, temp, state, work)
    class(hot_working_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)
    real(rp) :: hot(nlane, n_work)

    call self%cold%prepare(temp, state, work)
    call self%hot%prepare(temp, state, hot)
    work(:, own:) = hot(:, :n_work - own + 1)
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(hot_working_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: hot(nlane, n_work), sigma_hot(nlane), slope_hot(nlane)

    call self%cold%stress(work, alpha, x, log_rate, sigma, slope)
    hot(:, :n_work - own + 1) = work(:, own:)
    call self%hot%stress(hot, alpha, x, log_rate, sigma_hot, slope_hot)
    slope = merge(slope_hot, slope, sigma_hot < sigma)
    sigma = min(sigma, sigma_hot)
  end subroutine stress

end module physics_law_hot_working
