! SPDX-License-Identifier: MIT
!> Balance of the ranks: boxes by the cost of their particles, divided anew when the coming steps would
!> load a rank too much, and a record of how even the load was.
module time_balance
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use grid_geometry, only: box_t, make_patch, nearest_node, storage_nodes
  use grid_partition, only: bisect, imbalance, owner_of
  use particles_migrate, only: wrap_positions
  use particles_store, only: f_pos, rests, tag_rest
  use time_sleep, only: load_of
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: first_partition, rebalance, note_balance

contains

  !> Cut the grid for the first time, by where the particles are.
  subroutine first_partition(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim

    if (.not. allocated(sim%boxes)) allocate (sim%boxes(0:world%size - 1), source=box_t())
    call wrap_positions(sim%scene%grid, sim%particles)
    call partition(world, sim)
  end subroutine first_partition

  !> Collective, before particles migrate: new boxes if a rank would have too much with the old ones;
  !> all blocks may have to move then.
  subroutine rebalance(world, sim, n_moving, is_cut)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(inout) :: n_moving       !! blocks whose particles may have to go elsewhere
    logical, intent(out) :: is_cut           !! there are new boxes
    real(rp) :: load(0:world%size - 1)

    is_cut = .false.
    if (world%size == 1) return
    call coming_loads(world, sim, n_moving, load)
    if (imbalance(load) <= sim%scene%method%rebalance) return
    call partition(world, sim)
    is_cut = .true.
    n_moving = sim%particles%nblk
  end subroutine rebalance

  !> Collective, after particles have migrated: the imbalance of the steps until the next sort.
  subroutine note_balance(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp) :: load(0:world%size - 1)
    integer :: b

    load = 0.0_rp
    do b = 1, sim%particles%nblk
      load(world%rank) = load(world%rank) + load_of_block(sim, b)
    end do
    call world%sum(load)
    sim%balance%now = imbalance(load)
  end subroutine note_balance

  !> Cost of a step on every rank, in awake particles, once each particle is with its owner.
  subroutine coming_loads(world, sim, n_moving, load)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n_moving
    real(rp), intent(out) :: load(0:world%size - 1)
    integer :: b, node(nlane), p, r, rest(nlane)
    logical :: is_own(nlane)

    load = 0.0_rp
    do b = n_moving + 1, sim%particles%nblk
      load(world%rank) = load(world%rank) + load_of_block(sim, b)
    end do
    do b = 1, n_moving
      rest = rests(nlane, sim%particles%tag(:, b))
      call storage_nodes(sim%scene%grid, sim%patch, nlane, sim%particles%ps(:, f_pos:f_pos + 2, b), node, is_own)
      do p = 1, sim%particles%count(b)
        r = world%rank
        if (.not. is_own(p)) r = owner_of(sim%boxes, &
                                          nearest_node(sim%scene%grid, sim%particles%ps(p, f_pos:f_pos + 2, b)))
        load(r) = load(r) + load_of(rest(p))
      end do
    end do
    call world%sum(load)
  end subroutine coming_loads

  pure real(rp) function load_of_block(sim, b) result(load)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b

    associate (n => sim%particles%count(b))
      load = sum(load_of(rests(n, sim%particles%tag(:n, b))))
    end associate
  end function load_of_block

  !> New boxes for all ranks by the cost of their particles.
  subroutine partition(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    type(box_t) :: boxes(0:world%size - 1)
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)
    integer :: b, c, p, n, r

    n = sim%particles%total()
    allocate (nodes(3, n), weight(n))
    c = 0
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        c = c + 1
        weight(c) = load_of(tag_rest(sim%particles%tag(p, b)))
        nodes(:, c) = nearest_node(sim%scene%grid, sim%particles%ps(p, f_pos:f_pos + 2, b))
      end do
    end do
    call bisect(world, sim%scene%grid, nodes, weight, boxes)
    if (all([(all(boxes(r)%lo == sim%boxes(r)%lo) .and. all(boxes(r)%hi == sim%boxes(r)%hi), &
              r=0, world%size - 1)]) .and. associated(sim%g)) return   ! no better cut
    sim%balance%cuts = sim%balance%cuts + 1
    sim%boxes = boxes
    sim%patch = make_patch(sim%scene%grid, sim%boxes(world%rank))
    call sim%allocate_grid()
  end subroutine partition

end module time_balance
