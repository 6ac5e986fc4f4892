! SPDX-License-Identifier: MIT
!> Load balance: boxes of nodes weighted by the cost of particles, redivided when the coming steps
!> would overload a rank, and a record of the imbalance. The cost depends on the state of particles
!> and not on measured time, so that the same run is always partitioned alike.
module run_balance
  use base_kinds, only: nlane, rp
  use base_world, only: world_t
  use grid_geometry, only: box_t, grid_t, halo, make_patch, nearest_node, storage_nodes
  use grid_partition, only: bisect, imbalance, owner_of
  use particles_migrate, only: wrap_positions
  use particles_store, only: awake, f_pos, f_rate, particles_t, rests
  use state_clock, only: clock_t
  use state_exchange, only: exchange_t
  use state_nodes, only: nodes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: find_reach, make_first_partition, predict_imbalance, reach_of, rebalance, store_nodes

  ! Measured costs (docs/speed.md, Ranks), in units of an awake elastic particle far from tools
  ! (0.06 us). In the stirring plate of benchmarks/speed work at nodes takes 16.2 % of a step of
  ! 2.84 ms, and 1.1 % of it without a tool, for the 314 particles at the face: 1.37 us each, 22
  ! awake ones. Two ranks then wait 1 % of a step; with 9, 14 and 32 for each 9, 7 and 6 %.
  !> Awake, held, asleep.
  real(rp), parameter, public :: cost_by_rest(0:2) = [1.0_rp, 0.04_rp, 0.035_rp]
  !> Cost added for each particle of a block in which one flows.
  real(rp), parameter :: flow_cost = 0.15_rp
  real(rp), parameter :: contact_cost = 22.0_rp  !! cost added for a particle in contact with a tool
  !> Distance of a particle centre from a tool in contact [spacings].
  real(rp), parameter :: contact_distance = 0.75_rp

contains

  !> Partition the grid for the first time, by the initial particle positions.
  subroutine make_first_partition(sim)
    type(simulation_t), intent(inout) :: sim

    if (.not. allocated(sim%exchange%boxes)) allocate (sim%exchange%boxes(0:sim%world%size - 1), &
                                                       source=box_t())
    call wrap_positions(sim%scene%grid, sim%particles)
    call find_reach(sim%world, sim%scene, sim%particles, sim%nodes)
    call partition(sim)
  end subroutine make_first_partition

  !> Collective. Find the box of nodes that particles of any rank can reach before the next sort.
  subroutine find_reach(world, scene, particles, nodes)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    real(rp) :: extent(6)

    extent = particles%extent(1, particles%nblk)
    call world%max(extent)
    nodes%reach = reach_of(scene%grid, extent)
  end subroutine find_reach

  !> Box of nodes that particles now within `extent` (particles_store) can reach before the next
  !> sort.
  pure type(box_t) function reach_of(grid, extent) result(box)
    type(grid_t), intent(in) :: grid
    real(rp), intent(in) :: extent(6)        !! largest coordinates and largest negative ones [m]

    box = box_t()
    if (extent(1) < -extent(4)) return
    box%lo = nearest_node(grid, -extent(4:6)) - halo
    box%hi = nearest_node(grid, extent(1:3)) + halo
  end function reach_of

  !> Allocate the nodes of this rank's box that particles can reach.
  subroutine store_nodes(world, scene, nodes, exchange)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(exchange_t), intent(in) :: exchange

    nodes%patch = make_patch(scene%grid, exchange%boxes(world%rank), nodes%reach)
    call nodes%allocate_grids(scene)
  end subroutine store_nodes

  !> Collective, before migration: make a new partition if a rank would be overloaded with the
  !> current boxes; then particles of all blocks may change rank. Record the imbalance of the steps
  !> until the next sort.
  subroutine rebalance(sim, n_moving)
    type(simulation_t), intent(inout) :: sim
    integer, intent(inout) :: n_moving       !! blocks whose particles may change rank
    integer :: cuts

    if (sim%world%size == 1) return
    call predict_imbalance(sim, n_moving)
    if (sim%exchange%balance%now <= sim%scene%method%rebalance) return
    cuts = sim%exchange%balance%cuts
    call partition(sim)
    if (sim%exchange%balance%cuts == cuts) return     ! the boxes have not changed
    n_moving = sim%particles%nblk
    call predict_imbalance(sim, n_moving)
  end subroutine rebalance

  !> Collective. Predict the imbalance of the coming steps, after every particle of the first
  !> `n_moving` blocks has gone to its owner.
  subroutine predict_imbalance(sim, n_moving)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: n_moving
    real(rp) :: load(0:sim%world%size - 1)

    call sum_costs(sim, n_moving, load)
    sim%exchange%balance%now = imbalance(load)
  end subroutine predict_imbalance

  !> Sum the cost of a step on every rank, in units of an awake elastic particle, after migration.
  subroutine sum_costs(sim, n_moving, load)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n_moving
    real(rp), intent(out) :: load(0:sim%world%size - 1)
    integer :: b, node(nlane), p, r
    logical :: is_own(nlane)
    real(rp) :: cost(nlane)

    load = 0.0_rp
    do b = n_moving + 1, sim%particles%nblk
      load(sim%world%rank) = load(sim%world%rank) &
        + sum(particle_costs(sim%scene, sim%clock, sim%tool, sim%particles, b))
    end do
    do b = 1, n_moving
      cost = particle_costs(sim%scene, sim%clock, sim%tool, sim%particles, b)
      call storage_nodes(sim%scene%grid, sim%nodes%patch, nlane, &
                         sim%particles%ps(:, f_pos:f_pos + 2, b), node, is_own)
      do p = 1, sim%particles%count(b)
        r = sim%world%rank
        if (.not. is_own(p)) then
          r = owner_of(sim%exchange%boxes, &
                       nearest_node(sim%scene%grid, sim%particles%ps(p, f_pos:f_pos + 2, b)))
        end if
        load(r) = load(r) + cost(p)
      end do
    end do
    call sim%world%sum(load)
  end subroutine sum_costs

  !> Bisect the grid by particle cost; keep the boxes if they would not change.
  subroutine partition(sim)
    type(simulation_t), intent(inout) :: sim
    type(box_t) :: boxes(0:sim%world%size - 1)
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)
    real(rp) :: cost(nlane)
    integer :: b, c, p, n, r

    n = sim%particles%total()
    allocate (nodes(3, n), weight(n))
    c = 0
    do b = 1, sim%particles%nblk
      cost = particle_costs(sim%scene, sim%clock, sim%tool, sim%particles, b)
      do p = 1, sim%particles%count(b)
        c = c + 1
        weight(c) = cost(p)
        nodes(:, c) = nearest_node(sim%scene%grid, sim%particles%ps(p, f_pos:f_pos + 2, b))
      end do
    end do
    call bisect(sim%world, sim%scene%grid, nodes, weight, boxes)
    if (all([(all(boxes(r)%lo == sim%exchange%boxes(r)%lo) &
              .and. all(boxes(r)%hi == sim%exchange%boxes(r)%hi), r=0, sim%world%size - 1)]) &
        .and. associated(sim%nodes%g)) return  ! the boxes would not change
    sim%exchange%balance%cuts = sim%exchange%balance%cuts + 1
    sim%exchange%boxes = boxes
    call store_nodes(sim%world, sim%scene, sim%nodes, sim%exchange)
  end subroutine partition

  !> Cost of each particle of block `b`; 0 for unused lanes.
  pure function particle_costs(scene, clock, tools, particles, b) result(load)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b
    real(rp) :: d(nlane), load(nlane)
    logical :: is_awake(nlane)
    integer :: k, n, rest(nlane)

    n = particles%count(b)
    rest = rests(nlane, particles%tag(:, b))
    load = cost_by_rest(rest)
    load(n + 1:) = 0.0_rp
    is_awake = rest == awake
    is_awake(n + 1:) = .false.
    if (.not. any(is_awake)) return
    associate (ps => particles%ps(:, :, b), &
               reach => contact_distance*scene%body(particles%body(b))%mean_spacing())
      if (any(is_awake .and. ps(:, f_rate) > 0.0_rp)) then
        where (is_awake) load = load + flow_cost
      end if
      do k = 1, size(tools)
        if (is_far(clock, tools, particles, k, b, reach)) cycle
        call tools(k)%clearances(n, ps(:, f_pos:f_pos + 2), reach, d)
        where (is_awake(:n) .and. d(:n) < reach) load(:n) = load(:n) + contact_cost
      end do
    end associate
  end function particle_costs

  !> True if block `b` is known to be farther than `reach` [m] from tool `k`.
  pure logical function is_far(clock, tools, particles, k, b, reach)
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: k, b
    real(rp), intent(in) :: reach

    is_far = .false.
    if (.not. allocated(particles%clearance)) return
    if (b > size(particles%clearance, 2)) return
    is_far = particles%clearance(k, b) > reach + clock%displacement + tools(k)%displacement()
  end function is_far

end module run_balance
