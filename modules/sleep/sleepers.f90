! SPDX-License-Identifier: MIT
!> Material at rest.
module sleep_sleepers
  use base_kinds, only: rp
  use grid_geometry, only: box_t
  implicit none (type, external)
  private

  public :: motion_t, sleepers_t

  ! Sums of a cube over steps (sleep_motion).
  integer, parameter, public :: m_mass = 1, &     !! mass times time [kg s]
                                m_momentum = 2, &  !! momentum times time [kg m], 3
                                m_impulse = 5     !! on held nodes [N s], 3
  integer, parameter, public :: n_motion = 7

  !> Sleepers that share nodes with awake particles (sleep_held_layer).
  type :: layer_t
    logical :: is_stale = .true.
    integer, allocatable :: node(:)          !! where this rank's sleepers give something
    real(rp), allocatable :: record(:, :)    !! (8, nodes) mass, momentum 0, force, heat
    real(rp), allocatable :: volume(:, :)    !! (2 bodies, nodes)
    integer, allocatable :: held(:)          !! nodes where those of any rank do
    real(rp), allocatable :: mass(:)         !! that they give there, of all ranks [kg]
    logical, allocatable :: is_own(:)        !! held node of this rank
    real(rp), allocatable :: impulse(:, :)   !! (3, held) that holding took in this step [N s]
  end type layer_t

  !> What the nodes of each cube did since it was last asked who sleeps (sleep_motion).
  type :: motion_t
    type(box_t) :: box                       !! of cubes
    real(rp) :: time = 0.0_rp                !! since then [s]
    real(rp), allocatable :: sums(:, :)      !! (n_motion, cubes) of this rank
  end type motion_t

  !> What does not change while the same particles sleep in the same blocks.
  type :: sleepers_t
    type(layer_t) :: layer
    type(motion_t) :: motion
    real(rp), dimension(6) :: extent_layer = -huge(1.0_rp), &   !! largest places, largest negative
                                                                !! places
                              extent_any = -huge(1.0_rp)      !! of the layer, of all at rest [m]
    logical, allocatable :: near_layer(:, :, :), near_any(:, :, :)   !! (z, y, x) nodes in reach of
                                                                   !! the layer, of all at rest
    type(box_t) :: cubes                        !! cubes that were asked, numbered from 0
    integer, allocatable :: rest(:, :, :)       !! of the particles in each of them
    real(rp), allocatable :: borne(:, :)      !! (3, conditions) force on those beyond the layer [N]
  end type sleepers_t

end module sleep_sleepers
