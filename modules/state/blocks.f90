! SPDX-License-Identifier: MIT
!> Which blocks of particles take part in a step, in which order, and where they are.
module state_blocks
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: blocks_t

  !> Room around the particles of a block until the next sort: a cell of way, half a cell that they
  !> reach.
  real(rp), parameter, public :: skin = 1.5_rp   !! [cells]

  type :: blocks_t
    integer :: n_awake = -1                  !! the first ones move; -1: nothing was sorted yet
    integer :: n_mapped = 0                  !! the first ones give mass and force
    integer :: n_border = 0                  !! awake blocks that may touch shared nodes
    integer, allocatable :: turn(:)          !! (n_awake) those first, then the other awake blocks
    integer :: n_far = 0                     !! blocks that no tool reaches until the next sort
    integer, allocatable :: order(:)         !! (n_awake) those first, then the other awake blocks
    real(rp), allocatable :: clearance(:, :)  !! (tools, n_awake) of a block's nearest particle [m]
                                             !! when
                                             !! sorted
    real(rp), allocatable :: ball(:, :)      !! (4, nblk) centre and radius of each block [m] when
                                             !! sorted; particles go up to a cell until the next;
                                             !! only for bodies that meet, and sources of heat
    integer(i8) :: awake_steps = 0           !! steps of awake particles on this rank in this run
  end type blocks_t

end module state_blocks
