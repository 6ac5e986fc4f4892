! SPDX-License-Identifier: MIT
!> Shape functions of a block of particles on this rank's patch.
module time_weights
  use base_kinds, only: nlane, rp
  use particles_store, only: f_pos
  use time_state, only: simulation_t
  use transfer_weights, only: block_weights, own_weights
  implicit none (type, external)
  private

  public :: weights_of

contains

  !> Weights `w`, slopes and first nodes for the particles `ps` of `body`.
  subroutine weights_of(sim, body, nf, ps, w, first)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(out) :: w(nlane, 18)
    integer, intent(out) :: first(nlane)

    if (sim%scene%layout%half > 0) then
      call own_weights(sim%patch%origin, 1.0_rp/sim%patch%h, ps(1, sim%scene%layout%half), &
                       sim%patch%stride, ps(1, f_pos), w, first)
    else
      call block_weights(sim%patch%origin, 1.0_rp/sim%patch%h, sim%scene%domain(body), &
                         sim%patch%stride, ps(1, f_pos), w, first)
    end if
  end subroutine weights_of

end module time_weights
