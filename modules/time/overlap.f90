! SPDX-License-Identifier: MIT
!> Exchange while working: blocks that may touch shared nodes, the border, give to the grid first; what
!> they gave is on its way to the other ranks while the other blocks follow. Which blocks these are is
!> decided by a sort and kept in the tags, so that a resumed run adds up in the same order.
module time_overlap
  use base_timers, only: ph_exchange, ph_to_grid
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use grid_geometry, only: dilate, halo, storage_nodes
  use particles_store, only: border_bit, f_pos, set_bit
  use time_mirrors, only: early, fold, late, r_momentum, split_mirrors
  use time_state, only: simulation_t
  use time_sweeps, only: blocks_to_grid, others_to_grid
  use time_volume, only: clear_volume
  implicit none (type, external)
  private

  public :: mark_border, list_turns, map_and_sum

  integer, parameter :: stretch = 32       !! blocks from one look at the messages to the next

contains

  !> What cannot wait: folds at walls, and after a sort the awake blocks of the border.
  subroutine mark_border(sim, is_sorted_anew)
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: is_sorted_anew
    logical, allocatable :: near(:, :, :)
    integer :: b

    call mark_nodes(sim, near)
    if (.not. is_sorted_anew) return
    call dilate(near, halo)
    do b = 1, sim%n_awake
      associate (tag => sim%particles%tag(1, b))
        tag = set_bit(tag, border_bit, is_near(sim, sim%particles%count(b), sim%particles%ps(:, f_pos:f_pos + 2, b), &
                                      size(near), near))
      end associate
    end do
  end subroutine mark_border

  !> Whether one of the `n` particles of a block has a marked node nearest to it.
  pure logical function is_near(sim, n, x, nn, marked)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n, nn
    real(rp), intent(in) :: x(nlane, 3)
    logical, intent(in) :: marked(nn)
    integer :: node(nlane)
    logical :: is_own(nlane)

    call storage_nodes(sim%scene%grid, sim%patch, nlane, x, node, is_own)
    is_near = any(marked(node(:n)))
  end function is_near

  !> Images, and several velocity fields, are summed without overlap.
  pure logical function can_overlap(sim)
    type(simulation_t), intent(in) :: sim

    can_overlap = sim%halo%n > 0 .and. sim%n_groups == 1 .and. all(sim%patch%period == 0)
  end function can_overlap

  !> Nodes that must be complete before the exchange, as (z, y, x): the shared ones, and those that
  !> walls join with them.
  subroutine mark_nodes(sim, near)
    type(simulation_t), intent(inout) :: sim
    logical, allocatable, intent(out) :: near(:, :, :)
    logical :: marked(sim%patch%nn)
    integer :: n(3)

    n = 0
    if (sim%patch%nn > 0) n = sim%patch%all%hi - sim%patch%all%lo + 1
    marked = .not. can_overlap(sim)
    marked(sim%halo%shared) = .true.
    call split_mirrors(sim, marked)
    near = reshape(marked, n([3, 2, 1]))
  end subroutine mark_nodes

  !> The awake blocks in the order in which they give to the grid: the border first.
  subroutine list_turns(sim)
    type(simulation_t), intent(inout) :: sim
    logical :: is_border(sim%n_awake)
    integer :: b

    is_border = btest(sim%particles%tag(1, :sim%n_awake), border_bit)
    sim%n_border = count(is_border)
    sim%turn = [pack([(b, b=1, sim%n_awake)], is_border), &
                pack([(b, b=1, sim%n_awake)], .not. is_border)]
  end subroutine list_turns

  !> Particles to grid, folds at walls and the sum over ranks, of the records and of the volumes.
  subroutine map_and_sum(world, sim, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: b

    sim%mirrors%lost = 0.0_rp
    call clear_volume(sim)
    call blocks_to_grid(sim, 1, sim%n_border, g)
    call others_to_grid(sim, g)
    call fold(sim, r_momentum, g(:, :, 1), sim%mirrors%lost, sim%mirrors%own(:, 1), early)
    call sim%timer%lap(ph_to_grid)
    call sim%halo%post(world, 8, sim%patch%nn, g(:, :, 1), sim%volume)
    call sim%timer%lap(ph_exchange)
    do b = sim%n_border + 1, sim%n_awake, stretch
      call blocks_to_grid(sim, b, min(b + stretch - 1, sim%n_awake), g)
      call sim%halo%poke()
    end do
    call fold(sim, r_momentum, g(:, :, 1), sim%mirrors%lost, sim%mirrors%own(:, 1), late)
    call sim%timer%lap(ph_to_grid)
    call sim%halo%finish(world, 8, sim%patch%nn, g(:, :, 1), sim%volume)
    call sim%timer%lap(ph_exchange)
  end subroutine map_and_sum

end module time_overlap
