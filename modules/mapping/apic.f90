! SPDX-License-Identifier: MIT
!> Affine transfer: particles carry a velocity gradient C besides their velocity, so that the
!> transfer to the grid and back conserves angular momentum (APIC: Jiang et al. 2017, JCP 338:137).
module mapping_apic
  use base_kinds, only: nlane, rp
  use mapping_nodes, only: nodes_t
  use transfer_kernels, only: g2p_block, p2g_affine_block
  use transfer_weights, only: moment_weights
  implicit none (type, external)
  private

  public :: affine_to_grid, gather_gradient

contains

  !> Add the records of a block with the momentum m (v + C (x_i - x_p)) at node i.
  subroutine affine_to_grid(nodes, n, x, c, w, first, rec, g)
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, first(nlane)
    real(rp), intent(in) :: x(nlane, 3), c(nlane, 9), w(nlane, 18)  !! position [m], C row by row
                                                                    !! [1/s]
    real(rp), intent(inout) :: rec(8, 4, nlane), g(8, nodes%patch%nn)
    real(rp) :: moment(nlane, 18), square(nlane, 3)
    integer :: a, b, p

    call moment_weights(nodes%patch%origin, nodes%patch%h, x, w, moment, square)
    do p = 1, n
      do b = 1, 3
        rec(1, 1 + b, p) = 0.0_rp
        do a = 1, 3
          rec(1 + a, 1 + b, p) = rec(1, 1, p)*c(p, 3*(a - 1) + b)
        end do
      end do
    end do
    call p2g_affine_block(n, w, moment, first, rec, nodes%patch%stride, nodes%patch%nn, g)
  end subroutine affine_to_grid

  !> Gather the affine gradient C = sum w v_i (x_i - x_p)^T D^-1 with D = sum w (x_i - x_p)(x_i -
  !> x_p)^T, which is diagonal.
  subroutine gather_gradient(nodes, n, x, w, first, g, rec, c)
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n, first(nlane)
    real(rp), intent(in) :: x(nlane, 3), w(nlane, 18), g(8, nodes%patch%nn)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp), intent(inout) :: c(nlane, 9)
    real(rp) :: moment(nlane, 18), square(nlane, 3)
    integer :: a, b, p

    call moment_weights(nodes%patch%origin, nodes%patch%h, x, w, moment, square)
    call g2p_block(n, moment, first, nodes%patch%stride, nodes%patch%nn, g, rec)
    do p = 1, n
      do a = 1, 3
        do b = 1, 3
          c(p, 3*(a - 1) + b) = rec(a, 1 + b, p)/square(p, b)
        end do
      end do
    end do
  end subroutine gather_gradient

end module mapping_apic
