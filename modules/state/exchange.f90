! SPDX-License-Identifier: MIT
!> Data that the ranks share in a step: their boxes, the load balance, the acceptance.
module state_exchange
  use base_kinds, only: rp
  use base_world, only: reduction_t
  use grid_geometry, only: box_t
  use state_budget, only: budget_t
  implicit none (type, external)
  private

  public :: exchange_t

  !> Load imbalance of the steps of this run: the most loaded rank over the mean.
  type :: balance_t
    real(rp) :: now = 1.0_rp                  !! imbalance until the next sort
    real(rp) :: worst = 1.0_rp                !! largest value over the steps
    real(rp) :: sum = 0.0_rp                  !! sum over the steps
    integer :: cuts = 0                       !! partitions of the grid, including the first one
    real(rp) :: waited = 0.0_rp  !! time that this rank waited for the reductions of the steps [s]
  end type balance_t

  !> Blocks updated before all ranks have accepted the step, and the state restored after a refusal
  !> (step_schedule).
  type :: speculation_t
    logical :: is_possible = .false.         !! speculation is possible in this step
    integer :: n_done = 0  !! blocks already updated, in the order of particles%order
    real(rp), allocatable :: saved(:, :, :)  !! particles of these blocks before the update
    type(budget_t) :: budget                 !! budget before the step
  end type speculation_t

  !> Data that the ranks share in a step.
  type :: exchange_t
    type(box_t), allocatable :: boxes(:)     !! (0:size-1) nodes of each rank
    type(balance_t) :: balance
    type(reduction_t) :: acceptance          !! reduction of the acceptance
    type(speculation_t) :: speculative
  end type exchange_t

end module state_exchange
