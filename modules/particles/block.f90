! SPDX-License-Identifier: MIT
!> View of a block of particles in a sweep, with the stencils of its particles on the grid.
module particles_block
  use base_kinds, only: nlane, rp
  use particles_store, only: particles_t
  implicit none (type, external)
  private

  public :: block_t, view_block

  type :: block_t
    integer :: body = 0, n = 0       !! body of the particles; lanes in use, the first ones
    real(rp), pointer, contiguous :: ps(:, :) => null()  !! (nlane, nf) fields of the particles
    ! Set by weights_of (mpm_blocks):
    integer :: first(nlane)          !! first of the 27 nodes of each particle
    real(rp) :: w(nlane, 18)         !! weights of three nodes on each axis, and their slopes
  end type block_t

contains

  !> View of block `b`; the stencils remain undefined.
  subroutine view_block(particles, b, block)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b
    type(block_t), intent(inout) :: block

    block%body = particles%body(b)
    block%n = particles%count(b)
    block%ps => particles%ps(:, :, b)
  end subroutine view_block

end module particles_block
