! SPDX-License-Identifier: MIT
!> Roles, order and bounds of the particle blocks.
module state_blocks
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: blocks_t

  !> Reach of the particles of a block until the next sort: a cell of motion and half a cell of
  !> support.
  real(rp), parameter, public :: skin = 1.5_rp   !! [cells]

  type :: blocks_t
    integer :: n_awake = -1                    !! the first blocks are awake; -1: not sorted yet
    integer :: n_mapped = 0                    !! the first blocks contribute mass and force: awake
                                               !! and held layer
    integer :: n_border = 0                    !! awake blocks that may reach shared nodes
    integer, allocatable :: turn(:)            !! (n_awake) order of the transfer to the grid:
                                               !! border blocks first
    integer :: n_far = 0                       !! blocks that no tool reaches before the next sort
    integer, allocatable :: order(:)           !! (n_awake) order of the transfer to the particles:
                                               !! far blocks first
    real(rp), allocatable :: clearance(:, :)   !! (tools, n_awake) distance of the nearest particle
                                               !! of a block from each tool, at the last sort [m]
    real(rp), allocatable :: ball(:, :)        !! (4, nblk) centre and radius of the bounding ball
                                               !! at the last sort [m]; for body contact and heat
                                               !! sources
    integer(i8) :: n_awake_particle_steps = 0  !! awake particles summed over the steps of this run
  end type blocks_t

end module state_blocks
