! SPDX-License-Identifier: MIT
!> Thermocouples, massless points that move with the material and read its nodal temperature. A
!> probe that leaves through a periodic side keeps its unwrapped position and reads the images of
!> the nodes.
module state_probes
  use base_kinds, only: rp
  use base_world, only: world_t
  use grid_geometry, only: grid_t, nearest_node, patch_t, wrap
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: probes_t
  public :: update_probe_temperatures, move_probes, share_probes, assign_probes

  !> Thermocouples that move with the material.
  type :: probes_t
    integer :: n = 0
    integer, allocatable :: group(:)          !! group of the body that each probe is in
    character(32), allocatable :: name(:)
    real(rp), allocatable :: x(:, :)          !! (3, n) positions [m]
    real(rp), allocatable :: temperature(:)   !! [K]
    logical, allocatable :: is_mine(:)        !! probes moved by this rank
  end type probes_t

contains

  !> Move this rank's probes by the velocities of `g` and read the temperature of `g_heat` there
  !> (linear weights); the masses of both grids are the same. Light nodes may be fast, as particles
  !> that hardly reach a node give it more force than mass. Where metal reaches a probe, a node has
  !> the square of its weight there or more as share of the mass, an eighth of it at a corner; with
  !> less it moves the probe less in proportion. Nodes held for sleepers
  !> have received the temperature of only a part of their particles: a probe next to such a node
  !> keeps its temperature of the last conduction step.
  subroutine move_probes(dt, patch, n_groups, g, g_heat, probes, held)
    real(rp), intent(in) :: dt                  !! time step [s]
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: n_groups
    !> Nodal velocity and mass.
    real(rp), intent(in), dimension(8, patch%nn, n_groups) :: g
    !> Nodal temperature and mass.
    real(rp), intent(in), dimension(8, patch%nn, n_groups) :: g_heat
    type(probes_t), intent(inout) :: probes
    integer, intent(in), optional :: held(:)    !! nodes held for sleepers
    real(rp), parameter :: corner_mass = 0.125_rp   !! mass of a corner node, over a full one
    real(rp) :: motion(8), s(3), state(8)
    real(rp), dimension(0:7) :: mass, trust, weight
    integer :: i, n, q(0:7)
    logical :: is_whole

    do n = 1, probes%n
      if (.not. probes%is_mine(n)) cycle
      s = patch%linear_place(probes%x(:, n))
      where (patch%period > 0) s = 0.5_rp + modulo(s - 0.5_rp, real(patch%period, rp))
      associate (nodes => g(:, :, probes%group(n)), heat => g_heat(:, :, probes%group(n)))
        call point_nodes(s, patch%stride, 8, 0.0_rp, patch%nn, nodes, q, weight)
        if (sum(weight) <= 0.0_rp) cycle           ! empty nodes have no temperature
        mass = nodes(8, q)
        trust = weight*mass/max(mass, corner_mass*maxval(mass)*weight**2, tiny(1.0_rp))
        motion = matmul(nodes(:, q), trust)/sum(trust)
        state = matmul(heat(:, q), weight)
        if (patch%is_graded()) then
          call to_mean_place(patch, probes%x(:, n), s)
          call point_nodes(s, patch%stride, 8, 0.0_rp, patch%nn, nodes, q, weight)
          state(4) = sum(heat(4, q)*weight)
        end if
      end associate
      probes%x(:, n) = probes%x(:, n) + dt*motion(1:3)
      is_whole = .true.
      if (present(held)) is_whole = .not. any([(any(held == q(i)), i=0, 7)])
      if (is_whole) probes%temperature(n) = state(4)
    end do
  end subroutine move_probes

  !> Set the temperatures of the probes from the grids `g` of the heat groups, one for all bodies or
  !> one for each group: capacity in lane 1, new temperature in lane 6.
  subroutine update_probe_temperatures(patch, groups, g, probes)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: groups
    real(rp), intent(in) :: g(8, patch%nn, groups)
    type(probes_t), intent(inout) :: probes
    real(rp) :: s(3), weight(0:7)
    integer :: k, n, q(0:7)

    do n = 1, probes%n
      if (.not. probes%is_mine(n)) cycle
      s = patch%linear_place(probes%x(:, n))
      where (patch%period > 0) s = 0.5_rp + modulo(s - 0.5_rp, real(patch%period, rp))
      k = min(groups, probes%group(n))
      call point_nodes(s, patch%stride, 1, 0.0_rp, patch%nn, g(:, :, k), q, weight)
      if (sum(weight) > 0.0_rp) probes%temperature(n) = sum(weight*g(6, q, k))
    end do
  end subroutine update_probe_temperatures

  !> Convert the place `s` on graded axes to the place among the centres of the nodal functions, to
  !> which nodal temperatures belong.
  pure subroutine to_mean_place(patch, x, s)
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: x(3)                !! position [m]
    real(rp), intent(inout) :: s(3)             !! position from the first node [cells]
    integer :: a

    do a = 1, 3
      if (patch%grading(a)%is_graded) s(a) = patch%grading(a)%mean_place(x(a)) - patch%all%lo(a)
    end do
  end subroutine to_mean_place

  !> Share the places and temperatures of all probes among the ranks.
  subroutine share_probes(world, probes)
    type(world_t), intent(in) :: world
    type(probes_t), intent(inout) :: probes
    real(rp), allocatable :: known(:)
    integer :: i, n

    n = probes%n
    if (n == 0) return
    allocate (known(5*n), source=0.0_rp)
    do i = 1, n
      if (.not. probes%is_mine(i)) cycle
      known(5*i - 4:5*i) = [probes%x(:, i), probes%temperature(i), 1.0_rp]
    end do
    call world%sum(known)
    do i = 1, n
      if (known(5*i) < 0.5_rp) cycle
      probes%x(:, i) = known(5*i - 4:5*i - 2)
      probes%temperature(i) = known(5*i - 1)
    end do
  end subroutine share_probes

  !> Assign probes to ranks: each is moved by the owner of its nearest node, unless it has no
  !> material around.
  subroutine assign_probes(grid, patch, probes)
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(probes_t), intent(inout) :: probes
    real(rp) :: x(3)
    integer :: n

    do n = 1, probes%n
      x = probes%x(:, n)
      call wrap(grid, x)
      probes%is_mine(n) = patch%own%has(nearest_node(grid, x)) .and. &
                          all(patch%period > 0 .or. nearest_node(grid, x) < patch%all%hi)
    end do
  end subroutine assign_probes

end module state_probes
