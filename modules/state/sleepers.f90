! SPDX-License-Identifier: MIT
!> Material at rest: data of its cubes and of the layer that touches awake particles.
module state_sleepers
  use base_kinds, only: rp
  use grid_geometry, only: box_t
  implicit none (type, external)
  private

  public :: layer_t, motion_t, sleepers_t

  ! Indices of the sums of a cube over steps (sleep_cubes).
  integer, parameter, public :: m_mass = 1, &      !! mass times time [kg s]
                                m_momentum = 2, &  !! momentum times time [kg m], 3
                                m_impulse = 5      !! impulse on held nodes [N s], 3 components
  integer, parameter, public :: n_motion = 7

  !> Sleepers that share nodes with awake particles (sleep_held_layer).
  type :: layer_t
    logical :: is_stale = .true.            !! contributions must be gathered again
    integer, allocatable :: node(:)         !! nodes to which this rank's sleepers contribute
    real(rp), allocatable :: record(:, :)   !! (8, nodes) mass, zero momentum, force, heat
    real(rp), allocatable :: volume(:, :)   !! (2 bodies, nodes)
    integer, allocatable :: held(:)         !! nodes to which sleepers of any rank contribute
    real(rp), allocatable :: mass(:)  !! mass of the sleepers at the held nodes, of all ranks [kg]
    logical, allocatable :: is_own(:)       !! held nodes owned by this rank
    !> Impulse that holds the nodes in this step [N s], (3, held).
    real(rp), allocatable :: impulse(:, :)
  end type layer_t

  !> Motion of the nodes of each cube since the last sleep check (sleep_cubes).
  type :: motion_t
    type(box_t) :: box                       !! box of cubes
    real(rp) :: time = 0.0_rp                !! time since the last check [s]
    real(rp), allocatable :: sums(:, :)      !! (n_motion, cubes) of this rank
  end type motion_t

  !> Material at rest: data that are constant while the same particles sleep in the same blocks.
  type :: sleepers_t
    type(layer_t) :: layer
    type(motion_t) :: motion
    !> Largest coordinates and largest negative ones of the held layer, and of all sleepers [m].
    real(rp), dimension(6) :: extent_layer = -huge(1.0_rp), extent_any = -huge(1.0_rp)
    !> Nodes (z, y, x) in reach of the held layer, and of all sleepers.
    logical, allocatable :: near_layer(:, :, :), near_any(:, :, :)
    type(box_t) :: cubes                      !! box of cubes at the last check, indexed from 0
    integer, allocatable :: rest(:, :, :)     !! rest state of the particles of each cube
    !> Force on the sleepers beyond the held layer [N], (3, conditions).
    real(rp), allocatable :: far_force(:, :)
  end type sleepers_t

end module state_sleepers
