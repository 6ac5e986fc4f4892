! SPDX-License-Identifier: MIT
!> Shape functions of a block of particles on this rank's patch.
module mapping_weights
  use base_kinds, only: nlane, rp
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_pos
  use state_scene, only: scene_t
  use transfer_weights, only: block_weights, own_weights
  implicit none (type, external)
  private

  public :: weights_of

contains

  !> Weights `w`, slopes and first nodes for the particles `ps` of `body`.
  subroutine weights_of(scene, nodes, body, nf, ps, w, first)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: body, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(out) :: w(nlane, 18)
    integer, intent(out) :: first(nlane)

    if (scene%layout%half > 0) then
      call own_weights(nodes%patch%origin, 1.0_rp/nodes%patch%h, ps(1, scene%layout%half), &
                       nodes%patch%stride, ps(1, f_pos), w, first)
    else
      call block_weights(nodes%patch%origin, 1.0_rp/nodes%patch%h, scene%domain(body), &
                         nodes%patch%stride, ps(1, f_pos), w, first)
    end if
  end subroutine weights_of

end module mapping_weights
