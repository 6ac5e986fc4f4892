! SPDX-License-Identifier: MIT
!> Material at rest.
module sleep_sleepers
  use base_kinds, only: rp
  use grid_geometry, only: box_t
  implicit none (type, external)
  private

  public :: sleepers_t

  !> What the rim of sleeping material gives to the nodes (sleep_absorbing_layer).
  type :: layer_t
    logical :: is_stale = .true.
    integer, allocatable :: node(:)          !! where this rank's particles give something
    real(rp), allocatable :: record(:, :)    !! (8, nodes) mass, momentum 0, force, heat
    real(rp), allocatable :: volume(:, :)    !! (2 bodies, nodes)
    real(rp), allocatable :: mass(:)         !! (nn) of all ranks
  end type layer_t

  !> What does not change while the same particles sleep in the same blocks.
  type :: sleepers_t
    type(layer_t) :: layer
    real(rp), dimension(6) :: extent_layer = -huge(1.0_rp), &   !! largest places, largest negative
                                                                !! places
                              extent_any = -huge(1.0_rp)      !! of the rim, of all at rest [m]
    logical, allocatable :: near_layer(:, :, :), near_any(:, :, :)   !! (z, y, x) nodes in reach of
                                                                   !! the rim, of all at rest
    type(box_t) :: cubes                        !! cubes that were asked, numbered from 0
    integer, allocatable :: rest(:, :, :)       !! of the particles in each of them
    real(rp), allocatable :: borne(:, :)        !! (3, constraints) force on those beyond the rim
                                                !! [N]
  end type sleepers_t

end module sleep_sleepers
