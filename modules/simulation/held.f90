! SPDX-License-Identifier: MIT
!> Constraints on the nodes of this rank: clamps, walls, symmetry planes.
module simulation_held
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: boundary_t, column_nodes_t, column_t, mirrors_t

  !> Three nodes across the face of a clamp that lies between nodes (boundary_clamps).
  type :: column_t
    integer :: node(3) = 0                   !! 0: not stored here
    real(rp) :: weight(3) = 0.0_rp           !! weights of the nodal velocities at the face
    real(rp) :: tail(3) = 0.0_rp             !! mass of a node that only sees a body up to the face,
                                             !! over that of one inside
    integer :: clamp = 0
    integer :: axis = 0                      !! normal to the face
    logical :: is_owned(3) = .false.
    logical :: is_whole = .false.            !! this rank stores all nodes with a weight
  end type column_t

  !> Nodes of all columns along one axis that this rank stores, including columns that only other
  !> ranks list.
  type :: column_nodes_t
    integer, allocatable :: node(:)
    logical, allocatable :: is_known(:)  !! this rank stores the whole column of each node
    logical :: is_cut = .false.          !! some rank does not store the whole columns of all its
                                         !! nodes
  end type column_nodes_t

  !> Nodes behind symmetry planes and their mirror nodes (boundary_symmetry).
  type :: mirrors_t
    integer :: n_pairs = 0, n_planes = 0
    integer :: n_shared_pairs = 0, n_shared_planes = 0  !! leading pairs and planes that involve
                                                        !! shared nodes
    integer, allocatable :: pair(:, :)                  !! (3, n_pairs) node behind, node in front,
                                                        !! plane
    integer, allocatable :: plane(:, :)                 !! (2, n_planes) node on a plane, plane
    real(rp), allocatable :: mass_behind(:, :)          !! (n_pairs, n_groups) this rank's mass or
                                                        !! capacity behind the plane, before
                                                        !! reflection
    real(rp), allocatable :: resting_mass_behind(:)     !! (n_pairs) the same of particles at rest,
                                                        !! if there are any
    real(rp), allocatable :: lost(:, :)                 !! (8, planes) change of the sum over the
                                                        !! nodes by reflections
  end type mirrors_t

  type :: boundary_t
    logical, allocatable :: is_held(:)       !! (nn) nodes held by a clamp or wall, or behind one
    integer :: n_fixed = 0
    integer, allocatable :: fixed(:, :)      !! (3, n) node, clamp, 1 if owned
    integer :: n_columns = 0
    type(column_t), allocatable :: column(:)  !! columns of nodes across the faces of clamps
    type(column_nodes_t) :: along(3)          !! nodes of the columns along each axis
    type(mirrors_t) :: mirrors                !! mirror nodes used in steps
    type(mirrors_t) :: resting_mirrors        !! mirror nodes of all particles, if some sleep
  end type boundary_t

end module simulation_held
