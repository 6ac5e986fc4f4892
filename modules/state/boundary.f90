! SPDX-License-Identifier: MIT
!> Lists of the nodes whose velocity walls, clamps and planes of symmetry prescribe, made at every
!> sort (boundary_clamp_list, boundary_symmetry).
module state_boundary
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: boundary_t, column_nodes_t, column_t, mirrors_t

  !> Three nodes across the face of a clamp that lies between nodes (boundary_clamps).
  type :: column_t
    integer :: node(3) = 0                   !! storage indices; 0: not stored on this rank
    real(rp) :: weight(3) = 0.0_rp           !! weights of the nodal velocities at the face
    !> Mass of a node at a body that ends at the face, over that of a node inside.
    real(rp) :: tail(3) = 0.0_rp
    integer :: clamp = 0
    integer :: axis = 0                      !! normal to the face
    logical :: is_owned(3) = .false.
    logical :: is_whole = .false.            !! this rank stores all nodes with a weight
  end type column_t

  !> Nodes of all columns along one axis that this rank stores, including columns that only other
  !> ranks list, or nodes in front of those on walls with friction.
  type :: column_nodes_t
    integer, allocatable :: node(:)
    logical, allocatable :: is_known(:)  !! this rank uses the whole column of each node
    logical :: is_cut = .false.  !! some rank does not use the whole columns of all its nodes
  end type column_nodes_t

  !> Nodes behind symmetry planes and their mirror nodes (boundary_symmetry).
  type :: mirrors_t
    integer :: n_pairs = 0, n_planes = 0
    !> The first of the pairs and planes, which involve shared nodes.
    integer :: n_shared_pairs = 0, n_shared_planes = 0
    integer, allocatable :: pair(:, :)  !! (3, n_pairs) node behind, node in front, plane
    integer, allocatable :: plane(:, :)                 !! (2, n_planes) node on a plane, plane
    !> This rank's mass or capacity behind the plane, before reflection, (n_pairs, n_groups).
    real(rp), allocatable :: mass_behind(:, :)
    !> Mass behind the plane of particles at rest, if there are any, (n_pairs).
    real(rp), allocatable :: resting_mass_behind(:)
    !> Change of the sum over the nodes by reflections, (8, planes).
    real(rp), allocatable :: lost(:, :)
  end type mirrors_t

  type :: boundary_t
    logical, allocatable :: is_held(:)       !! (nn) nodes held by a clamp or wall, or behind one
    integer :: n_fixed = 0
    integer, allocatable :: fixed(:, :)      !! (3, n) node, clamp, 1 if owned
    !> `fixed` with the nodes that are released near tools, (3, n).
    integer, allocatable :: listed_node(:, :)
    integer :: n_columns = 0
    type(column_t), allocatable :: column(:)  !! columns of nodes across the faces of clamps
    !> `column` with the columns that are released near tools.
    type(column_t), allocatable :: listed_column(:)
    type(column_nodes_t) :: along(3)          !! nodes of the columns along each axis
    type(column_nodes_t) :: in_front          !! nodes in front of those on walls with friction
    type(mirrors_t) :: mirrors                !! mirror nodes used in steps
    type(mirrors_t) :: resting_mirrors        !! mirror nodes of all particles, if some sleep
  end type boundary_t

end module state_boundary
