! SPDX-License-Identifier: MIT
!> Operations on the nodes in use: clear them, update velocities from momentum and force. A record
!> holds mass, momentum (3), force (3), mass times temperature before the update, and velocity (3),
!> temperature, velocity change (3), mass after it.
module simulation_nodes
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned, free_aligned
  use grid_geometry, only: box_t, patch_t
  use grid_halo, only: halo_t
  use simulation_run, only: clock_t
  use simulation_scene, only: scene_t, scheme_usl
  implicit none (type, external)
  private

  !> Nodes of this rank's patch. A record holds 8 reals, for each group of bodies with its own
  !> velocity field.
  type :: nodes_t
    type(patch_t) :: patch
    type(box_t) :: reach          !! nodes that particles of any rank can reach
    type(halo_t) :: halo          !! exchange of the nodes used in steps
    type(halo_t) :: resting_halo  !! exchange of the nodes of all particles, if some sleep
    integer :: n_groups = 1
    real(rp), pointer, contiguous :: g(:, :, :) => null()     !! (8, nn, n_groups)
    real(rp), pointer, contiguous :: g2(:, :, :) => null()    !! second grid: MUSL and USAVG,
                                                              !! conduction, output velocities
    real(rp), pointer, contiguous :: increment(:, :, :) => null()  !! third grid: XPIC, FMPM
    real(rp), pointer, contiguous, dimension(:), private :: &
      memory => null(), memory2 => null(), memory3 => null(), rec_memory => null()
    real(rp), allocatable :: volume(:, :)    !! (2 bodies, nn) mass, and mass times J, of the cell
                                             !! above a node
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
  public :: append, clear_nodes, full_mass, min_node_inertia, update_nodes

  real(rp), parameter, public :: min_node_mass = 1.0e-30_rp  !! mass below which a node is empty
                                                             !! [kg]
  !> Smallest nodal inertia over the mass of a full cell, with selective mass scaling: the largest
  !> eigenvalues of K against M belong to light nodes at free surfaces.
  real(rp), parameter :: min_mass_fraction = 0.25_rp

contains

  !> Allocate grids and volumes for the current patch, as the method of the scene needs them.
  subroutine allocate_grids(self, scene)
    class(nodes_t), intent(inout) :: self
    type(scene_t), intent(in) :: scene

    call allocate_grid(self, self%memory, self%g)
    if (scene%method%scheme /= scheme_usl .or. scene%method%conducts .or. scene%method%filters() &
        .or. scene%method%shows_motion) then
      call allocate_grid(self, self%memory2, self%g2)
    end if
    if (scene%method%filters()) call allocate_grid(self, self%memory3, self%increment)
    if (allocated(self%volume)) deallocate (self%volume)
    if (scene%method%fbar) allocate (self%volume(2*size(scene%body), self%patch%nn), source=0.0_rp)
  end subroutine allocate_grids

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

  !> Memory of the grids and of volume averaging on this rank [bytes].
  pure integer(i8) function bytes(self)
    class(nodes_t), intent(in) :: self

    bytes = 64_i8*self%patch%nn*self%n_groups*count([associated(self%g), associated(self%g2), &
                                                     associated(self%increment)])
    if (allocated(self%volume)) bytes = bytes + 8_i8*size(self%volume, kind=i8)
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
    if (scene%method%scales_light_nodes) min_node_inertia = min_mass_fraction*full_mass(scene, &
                                                                                        clock)
  end function min_node_inertia

  !> Update the velocities of the nodes in use: v = p/m + dt f/m.
  subroutine update_nodes(scene, clock, nodes, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt              !! time step [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: least
    integer :: k, r

    least = min_node_inertia(scene, clock)
    do k = 1, nodes%n_groups
      do r = 1, nodes%n_ranges
        call update_run(nodes%range(2, r) - nodes%range(1, r) + 1, dt, least, &
                        g(1, nodes%range(1, r), k))
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

end module simulation_nodes
