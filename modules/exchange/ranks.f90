! SPDX-License-Identifier: MIT
!> What the ranks share in a step.
module exchange_ranks
  use base_kinds, only: rp
  use comm_world, only: reduction_t
  use grid_geometry, only: box_t
  use state_books, only: books_t
  implicit none (type, external)
  private

  public :: exchange_t

  !> How evenly the steps of this run loaded the ranks: the most loaded rank over the mean.
  type :: balance_t
    real(rp) :: now = 1.0_rp             !! until the next sort
    real(rp) :: worst = 1.0_rp, sum = 0.0_rp   !! largest, and sum, over the steps
    integer :: cuts = 0                  !! divisions of the grid, the first one included
    real(rp) :: waited = 0.0_rp          !! of this rank, for the reductions of the steps [s]
  end type balance_t

  !> Blocks that come back from the grid before all ranks have accepted the step, and what a
  !> step that does not stand gives back (exchange_speculation).
  type :: speculation_t
    logical :: is_possible = .false.         !! in this step
    integer :: done = 0                      !! the first ones in order, which came back already
    real(rp), allocatable :: kept(:, :, :)   !! their particles before
    type(books_t) :: books                   !! of the simulation before
  end type speculation_t

  type :: exchange_t
    type(box_t), allocatable :: boxes(:)     !! (0:size-1) nodes of each rank
    type(balance_t) :: balance
    type(reduction_t) :: acceptance          !! of the step, while it is found
    type(speculation_t) :: speculative
  end type exchange_t

end module exchange_ranks
