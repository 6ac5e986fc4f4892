! SPDX-License-Identifier: MIT
!> Shape functions of a block of particles on this rank's patch.
module time_weights
  use base_kinds, only: nlane, rp
  use time_state, only: simulation_t
  use transfer_weights, only: block_weights
  implicit none (type, external)
  private

  public :: weights_of

contains

  !> Weights `w`, slopes and first nodes for particles of `body` at `x` [m].
  subroutine weights_of(sim, body, x, w, first)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body
    real(rp), intent(in) :: x(nlane, 3)
    real(rp), intent(out) :: w(nlane, 18)
    integer, intent(out) :: first(nlane)

    call block_weights(sim%patch%origin, 1.0_rp/sim%patch%h, sim%domain(body), sim%patch%stride, &
                       x, w, first)
  end subroutine weights_of

end module time_weights
