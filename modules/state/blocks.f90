! SPDX-License-Identifier: MIT
!> Which blocks of particles take part in a step, in which order, and where they are.
module state_blocks
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: blocks_t

  !> Distance around the particles of a block until the next sort: a cell that they move, half a
  !> cell that they reach.
  real(rp), parameter, public :: skin = 1.5_rp   !! [cells]

  type :: blocks_t
    integer :: n_awake = -1                  !! the first ones move; -1: nothing was sorted yet
    integer :: n_mapped = 0                  !! the first ones give mass and force
    integer :: n_border = 0                  !! awake blocks that may touch shared nodes
    integer, allocatable :: turn(:)          !! (n_awake) those first, then the other awake blocks
    integer :: n_far = 0                     !! blocks that no tool reaches before the next sort
    integer, allocatable :: order(:)         !! (n_awake) those first, then the other awake blocks
    real(rp), allocatable :: clearance(:, :)   !! (tools, n_awake) from the nearest particle of a
                                               !! block to each tool, at the last sort [m]
    real(rp), allocatable :: ball(:, :)      !! (4, nblk) centre and radius of each block at the
                                             !! last sort [m], for contact of bodies and sources
    integer(i8) :: awake_steps = 0           !! steps of awake particles on this rank in this run
  end type blocks_t

end module state_blocks
