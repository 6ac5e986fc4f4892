! SPDX-License-Identifier: MIT
!> Operations on the nodes in use: clear them, update velocities from momentum and force. A record
!> holds mass, momentum (3), force (3), mass times temperature before the update, and velocity (3),
!> temperature, velocity change (3), mass after it.
!>
!> Memory of light nodes with selective mass scaling. The inertia M' - m that a node has beyond the
!> mass m of its particles moves with the node: it keeps the velocity of the last step, and a step
!> begins with the mean velocity of both,
!>
!>     v = (p + (M' - m) v_last + dt f)/M'.
!>
!> At a surface the mean velocity p/m of the particles on one side of a node is not that of the
!> material at the node. If the inertia began each step with p/m, forces on light nodes had to give
!> it the difference anew in every step: a drag M'/dt on all deformation of surface cells, 1.6 % of
!> the force of a punch at a mass scaling of 100. A sort that is due forgets the velocities, since
!> its ranks may list other nodes.
module state_nodes
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned, free_aligned
  use base_world, only: world_t
  use grid_geometry, only: box_t, patch_t
  use grid_halo, only: halo_t
  use state_boundary, only: boundary_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t, scheme_usl
  implicit none (type, external)
  private

  !> Nodes of this rank's patch. A record holds 8 reals, for each group of bodies with its own
  !> velocity field.
  type :: nodes_t
    type(patch_t) :: patch
    type(box_t) :: reach          !! nodes that particles of any rank can reach
    type(halo_t) :: halo          !! exchange of the nodes used in steps
    type(halo_t) :: resting_halo  !! exchange of the nodes of all particles, if some sleep
    type(boundary_t) :: boundary  !! nodes whose velocity is prescribed
    integer :: n_groups = 1
    real(rp), pointer, contiguous :: g(:, :, :) => null()     !! (8, nn, n_groups)
    !> Second grid: MUSL and USAVG, conduction, output velocities.
    real(rp), pointer, contiguous :: g2(:, :, :) => null()
    real(rp), pointer, contiguous :: increment(:, :, :) => null()  !! third grid: XPIC, FMPM
    real(rp), pointer, contiguous, dimension(:), private :: &
      memory => null(), memory2 => null(), memory3 => null(), rec_memory => null()
    !> Mass, and mass times J, of the cell above a node, (2 bodies, nn).
    real(rp), allocatable :: volume(:, :)
    !> Velocity of a light node in the last step, additional inertia, `kept` of that step, (5, nn,
    !> n_groups).
    real(rp), allocatable :: light(:, :, :)
    integer, private :: kept = 1             !! number of steps whose light nodes were kept
    integer, private :: n_light_nodes = 0
    !> Node and group of the light nodes of this step, (2, :).
    integer, allocatable, private :: light_node(:, :)
    real(rp), allocatable :: light_kept(:, :)    !! velocities of all ranks, in a checkpoint
    integer :: n_ranges = 0                  !! runs of consecutive nodes in use
    integer, allocatable :: range(:, :)      !! (3, n) first node, last node, 1 if owned
    ! Nodes used by all particles if some sleep; conduction exchanges the two lists.
    integer :: n_resting_ranges = 0
    integer, allocatable :: resting_range(:, :)
    real(rp), pointer, contiguous :: rec(:, :, :) => null()  !! (8, 4, nlane) scratch of the kernels
  contains
    procedure :: allocate_grids, allocate_scratch, bytes, free
  end type nodes_t

  public :: nodes_t
  public :: append, bytes_per_node, clear_nodes, full_mass, min_node_inertia, update_nodes
  public :: forget_light, gather_light, keep_light, momentum_of_light, place_light, recall_light

  !> Mass below which a node is empty [kg].
  real(rp), parameter, public :: min_node_mass = 1.0e-30_rp
  !> Smallest nodal inertia over the mass of a full cell, with selective mass scaling: the largest
  !> eigenvalues of K against M belong to light nodes at free surfaces.
  real(rp), parameter :: min_mass_fraction = 0.25_rp
  !> Numbers of a node in a checkpoint: group, indices, velocity, inertia, rank, 1 if that rank owns
  !> it.
  integer, parameter, public :: n_light = 10

contains

  !> Allocate grids and volumes for the current patch, as the method of the scene needs them.
  subroutine allocate_grids(self, scene)
    class(nodes_t), intent(inout) :: self
    type(scene_t), intent(in) :: scene

    call allocate_grid(self, self%memory, self%g)
    if (has_second_grid(scene)) call allocate_grid(self, self%memory2, self%g2)
    if (scene%method%filters()) call allocate_grid(self, self%memory3, self%increment)
    if (allocated(self%volume)) deallocate (self%volume)
    if (scene%method%fbar) allocate (self%volume(2*size(scene%body), self%patch%nn), source=0.0_rp)
    if (allocated(self%light)) deallocate (self%light)
    if (scene%method%scales_light_nodes) allocate (self%light(5, self%patch%nn, self%n_groups), &
                                                   source=0.0_rp)
    if (.not. allocated(self%light_node)) allocate (self%light_node(2, 1))
    self%kept = 1
  end subroutine allocate_grids

  pure logical function has_second_grid(scene)
    type(scene_t), intent(in) :: scene

    has_second_grid = scene%method%scheme /= scheme_usl .or. scene%method%conducts &
      .or. scene%method%filters() .or. scene%method%shows_motion
  end function has_second_grid

  !> Memory of a node in each group of bodies [bytes].
  pure integer function bytes_per_node(scene)
    type(scene_t), intent(in) :: scene

    bytes_per_node = 64*count([.true., has_second_grid(scene), scene%method%filters()]) &
      + merge(40, 0, scene%method%scales_light_nodes)
  end function bytes_per_node

  subroutine allocate_grid(self, memory, g)
    class(nodes_t), intent(in) :: self
    real(rp), pointer, contiguous, intent(inout) :: memory(:), g(:, :, :)

    call free_aligned(memory)
    call allocate_aligned(8_i8*self%patch%nn*self%n_groups, memory)
    g(1:8, 1:self%patch%nn, 1:self%n_groups) => memory
  end subroutine allocate_grid

  subroutine allocate_scratch(self)
    class(nodes_t), intent(inout) :: self

    if (associated(self%rec)) return
    call allocate_aligned(32_i8*nlane, self%rec_memory)
    self%rec(1:8, 1:4, 1:nlane) => self%rec_memory
  end subroutine allocate_scratch

  !> Memory of the grids, of volume averaging and of light nodes on this rank [bytes].
  pure integer(i8) function bytes(self)
    class(nodes_t), intent(in) :: self

    bytes = 64_i8*self%patch%nn*self%n_groups*count([associated(self%g), associated(self%g2), &
                                                     associated(self%increment)])
    if (allocated(self%volume)) bytes = bytes + 8_i8*size(self%volume, kind=i8)
    if (allocated(self%light)) bytes = bytes + 8_i8*size(self%light, kind=i8)
  end function bytes

  subroutine free(self)
    class(nodes_t), intent(inout) :: self

    call free_aligned(self%memory)
    call free_aligned(self%memory2)
    call free_aligned(self%memory3)
    call free_aligned(self%rec_memory)
  end subroutine free

  !> Append `entry` to a growing list of `n` entries.
  pure subroutine append(list, n, entry)
    integer, allocatable, intent(inout) :: list(:, :)
    integer, intent(inout) :: n
    integer, intent(in) :: entry(3)
    integer, allocatable :: longer(:, :)

    if (n == size(list, 2)) then
      allocate (longer(3, 2*n))
      longer(:, 1:n) = list
      call move_alloc(longer, list)
    end if
    n = n + 1
    list(:, n) = entry
  end subroutine append

  !> Zero the records of all nodes in use.
  subroutine clear_nodes(nodes, g)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: k, r

    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        g(:, nodes%range(1, r):nodes%range(2, r), k) = 0.0_rp
      end do
    end do
  end subroutine clear_nodes

  !> Scaled mass of a node in the interior of the lightest material [kg].
  pure real(rp) function full_mass(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    full_mass = clock%mass_scaling*product(scene%grid%h)*minval(scene%material%rho)
  end function full_mass

  !> Lower bound of the nodal inertia against forces (selective mass scaling) [kg]. It does not
  !> change equilibria.
  pure real(rp) function min_node_inertia(scene, clock)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock

    min_node_inertia = 0.0_rp
    if (scene%method%scales_light_nodes .and. clock%scales_light) then
      min_node_inertia = min_mass_fraction*full_mass(scene, clock)
    end if
  end function min_node_inertia

  !> Update the velocities of the nodes in use: v = p/m + dt f/m; list those with
  !> additional inertia.
  subroutine update_nodes(scene, clock, nodes, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: dt              !! time step [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: least
    integer :: k, r

    least = min_node_inertia(scene, clock)
    nodes%n_light_nodes = 0
    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        associate (first => nodes%range(1, r), last => nodes%range(2, r))
          call update_run(last - first + 1, dt, least, g(1, first, k))
          if (allocated(nodes%light)) call list_light(nodes, k, first, last, least, g)
        end associate
      end do
    end do
  end subroutine update_nodes

  pure subroutine update_run(n, dt, least, g)
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, least
    real(rp), intent(inout) :: g(8, n)
    real(rp) :: m, most, inv, step, d1, d2, d3, v1, v2, v3
    integer :: i

    most = 1.0_rp/max(least, min_node_mass)
    do i = 1, n
      m = g(1, i)
      inv = 0.0_rp
      if (m > min_node_mass) inv = 1.0_rp/m
      step = dt*min(inv, most)
      d1 = step*g(5, i)
      d2 = step*g(6, i)
      d3 = step*g(7, i)
      v1 = g(2, i)*inv + d1
      v2 = g(3, i)*inv + d2
      v3 = g(4, i)*inv + d3
      g(1, i) = v1
      g(2, i) = v2
      g(3, i) = v3
      g(4, i) = g(8, i)*inv
      g(5, i) = d1
      g(6, i) = d2
      g(7, i) = d3
      g(8, i) = m
    end do
  end subroutine update_run

  !> Append the light ones of the nodes `first` to `last` of group `k` to the list.
  subroutine list_light(nodes, k, first, last, least, g)
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: k, first, last
    real(rp), intent(in) :: least           !! lower bound of the nodal inertia [kg]
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: q

    do q = first, last
      if (g(8, q, k) >= least .or. g(8, q, k) <= min_node_mass) cycle
      if (nodes%n_light_nodes == size(nodes%light_node, 2)) then
        nodes%light_node = reshape(nodes%light_node, [2, 2*nodes%n_light_nodes], pad=[0])
      end if
      nodes%n_light_nodes = nodes%n_light_nodes + 1
      nodes%light_node(:, nodes%n_light_nodes) = [q, k]
    end do
  end subroutine list_light

  !> After the update of the nodes: add the velocity of the additional inertia.
  subroutine recall_light(scene, clock, nodes, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: lag(3), least
    integer :: i

    least = min_node_inertia(scene, clock)
    do i = 1, nodes%n_light_nodes
      associate (last => nodes%light(:, nodes%light_node(1, i), nodes%light_node(2, i)), &
                 record => g(:, nodes%light_node(1, i), nodes%light_node(2, i)))
        if (nint(last(5)) /= nodes%kept) cycle
        lag = (1.0_rp - record(8)/least)*(last(1:3) - (record(1:3) - record(5:7)))
        record(1:3) = record(1:3) + lag
        record(5:7) = record(5:7) + lag
      end associate
    end do
  end subroutine recall_light

  !> Keep the velocities of light nodes at the end of a step.
  subroutine keep_light(scene, clock, nodes, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: least
    integer :: i

    if (.not. allocated(nodes%light)) return
    least = min_node_inertia(scene, clock)
    nodes%kept = nodes%kept + 1
    do i = 1, nodes%n_light_nodes
      associate (q => nodes%light_node(1, i), k => nodes%light_node(2, i))
        nodes%light(:, q, k) = [g(1:3, q, k), least - g(8, q, k), real(nodes%kept, rp)]
      end associate
    end do
  end subroutine keep_light

  !> Momentum of the additional inertia of the nodes of this rank [kg m/s].
  pure function momentum_of_light(nodes) result(momentum)
    type(nodes_t), intent(in) :: nodes
    real(rp) :: momentum(3)
    integer :: k, q, r

    momentum = 0.0_rp
    if (.not. allocated(nodes%light)) return
    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        if (nodes%range(3, r) /= 1) cycle
        do q = nodes%range(1, r), nodes%range(2, r)
          associate (light => nodes%light(:, q, k))
            if (nint(light(5)) /= nodes%kept) cycle
            momentum = momentum + light(4)*light(1:3)
          end associate
        end do
      end do
    end do
  end function momentum_of_light

  !> Forget the velocities of light nodes.
  subroutine forget_light(nodes)
    type(nodes_t), intent(inout) :: nodes

    if (allocated(nodes%light)) nodes%light = 0.0_rp
    nodes%kept = 1
  end subroutine forget_light

  !> Collective. List the light nodes of all ranks, for a checkpoint: the copies of ranks may differ
  !> by rounding.
  subroutine gather_light(world, nodes)
    type(world_t), intent(in) :: world
    type(nodes_t), intent(inout) :: nodes
    real(rp), allocatable :: own(:, :)
    integer :: k, n, pass, q, r

    if (.not. allocated(nodes%light)) return
    do pass = 1, 2
      n = 0
      do k = 1, nodes%n_groups
        do r = 1, nodes%n_ranges
          do q = nodes%range(1, r), nodes%range(2, r)
            if (nint(nodes%light(5, q, k)) /= nodes%kept) cycle
            n = n + 1
            if (pass == 2) own(:, n) = [real([k, nodes%patch%indices(q)], rp), &
                                        nodes%light(1:4, q, k), &
                                        real([world%rank, nodes%range(3, r)], rp)]
          end do
        end do
      end do
      if (pass == 1) allocate (own(n_light, n))
    end do
    nodes%light_kept = world%gather(own)
  end subroutine gather_light

  !> Give the listed velocities to the nodes of this rank: its own copies, or with other ranks those
  !> of the owners, also to periodic images.
  subroutine place_light(rank, same_ranks, nodes)
    integer, intent(in) :: rank
    logical, intent(in) :: same_ranks
    type(nodes_t), intent(inout) :: nodes
    integer :: e, i, ijk(3), j, k, q, turns(3)

    if (.not. allocated(nodes%light)) return
    call forget_light(nodes)
    turns = merge(1, 0, nodes%patch%period > 0 .and. .not. same_ranks)
    do e = 1, size(nodes%light_kept, 2)
      if (same_ranks .and. nint(nodes%light_kept(9, e)) /= rank) cycle
      if (.not. same_ranks .and. nint(nodes%light_kept(10, e)) /= 1) cycle
      do i = -turns(1), turns(1)
        do j = -turns(2), turns(2)
          do k = -turns(3), turns(3)
            ijk = nint(nodes%light_kept(2:4, e)) + [i, j, k]*nodes%patch%period
            if (.not. nodes%patch%all%has(ijk)) cycle
            q = 1 + dot_product(ijk - nodes%patch%all%lo, nodes%patch%stride)
            nodes%light(:, q, nint(nodes%light_kept(1, e))) = [nodes%light_kept(5:8, e), &
                                                               real(nodes%kept, rp)]
          end do
        end do
      end do
    end do
  end subroutine place_light

end module state_nodes
