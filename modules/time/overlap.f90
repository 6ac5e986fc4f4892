! SPDX-License-Identifier: MIT
!> Exchange while working: blocks that may touch shared nodes, the border, give to the grid first; what
!> they gave is on its way to the other ranks while the other blocks follow. Which blocks these are is
!> decided by a sort and kept in the tags, so that a resumed run adds up in the same order.
module time_overlap
  use base_timers, only: ph_exchange, ph_to_grid
  use base_kinds, only: rp
  use comm_world, only: world_t
  use grid_geometry, only: dilate, nearest_node
  use particles_store, only: f_pos, set_border, tag_border
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
    logical :: is_border
    integer :: b, ijk(3), p

    call mark_nodes(sim, near)
    if (.not. is_sorted_anew) return
    call dilate(near)
    do b = 1, sim%n_awake
      is_border = .not. can_overlap(sim)
      do p = 1, sim%particles%count(b)
        if (is_border) exit
        ijk = nearest_node(sim%scene%grid, sim%particles%ps(p, f_pos:f_pos + 2, b)) &
              - sim%patch%all%lo + 1
        is_border = near(ijk(3), ijk(2), ijk(1))
      end do
      sim%particles%tag(1, b) = set_border(sim%particles%tag(1, b), is_border)
    end do
  end subroutine mark_border

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

    is_border = tag_border(sim%particles%tag(1, :sim%n_awake))
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
