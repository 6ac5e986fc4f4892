! SPDX-License-Identifier: MIT
!> State of a running simulation: scene, this rank's part of it, constraints on its nodes, clock and
!> budget.
module simulation_parts
  use base_kinds, only: i8, rp
  use base_timers, only: phase_timer_t
  use comm_world, only: world_t
  use mapping_nodes, only: nodes_t
  use mapping_probes, only: probes_t
  use particles_store, only: particles_t
  use particles_tracers, only: tracers_t
  use simulation_node_pairs, only: node_pairs_t
  use simulation_tool_lists, only: tool_contact_t
  use state_run, only: budget_t, clock_t, exchange_t, sleepers_t, step_t
  use state_scene, only: scene_t
  use tools_backing, only: backing_t
  use tools_tool, only: n_tool_sums, tool_t
  implicit none (type, external)
  private

  public :: boundary_t, column_nodes_t, column_t, free_simulation, mirrors_t, simulation_t, &
            source_t

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

  integer, parameter, public :: source_disc = 1, source_ball = 2   !! kinds of sources

  !> A moving heat source, and its state in the current conduction step.
  type :: source_t
    integer :: kind = source_disc
    real(rp) :: power = 0.0_rp               !! [W]
    real(rp) :: position(3) = 0.0_rp         !! centre at t = 0 [m]
    real(rp) :: velocity(3) = 0.0_rp         !! [m/s]
    real(rp) :: radius = 0.0_rp              !! [m]
    real(rp) :: begin = 0.0_rp, end = huge(1.0_rp)   !! times of its action [s]
    real(rp) :: duration = 0.0_rp            !! time of action in this step [s]
    real(rp) :: centre(3) = 0.0_rp           !! centre at the middle of that time [m]
    real(rp) :: share = 0.0_rp               !! heat per covered area or mass [J/m2 or J/kg]
    logical :: has_warned = .false.          !! a warning of no covered particle was given
  end type source_t

  !> State from which rows of the history are computed as differences and means.
  type :: history_t
    real(rp) :: kinetic0 = 0.0_rp, elastic0 = 0.0_rp   !! energies at t = 0 [J]
    real(rp) :: audit_scale = 0.0_rp         !! largest energy exchanged so far [J]
    real(rp), allocatable :: frame_times(:)  !! times of the frames written so far [s]
    real(rp) :: row_time = 0.0_rp            !! time of the last row [s]
    integer(i8) :: rows = 0                  !! rows written so far
    real(rp), allocatable :: row_sums(:, :)  !! sums of each tool at the last row, of all ranks
    real(rp), allocatable :: row_gained(:, :)  !! increase of these between the last two rows
    real(rp), allocatable :: row_impulse(:, :)   !! impulses of conditions at the last row [N s]
  end type history_t

  !> Each part is owned by the library of its type; procedures of lower libraries
  !> take the parts they use.
  type :: simulation_t
    type(world_t) :: world                   !! ranks of the run
    type(scene_t) :: scene                   !! constant during a run
    type(clock_t) :: clock
    type(step_t) :: step
    type(tool_t), allocatable :: tool(:)
    type(backing_t), allocatable :: backing(:)  !! bodies behind heat films
    type(source_t), allocatable :: source(:)    !! moving heat sources
    type(probes_t) :: probes
    type(tracers_t) :: tracers
    type(particles_t) :: particles
    type(nodes_t) :: nodes
    type(boundary_t) :: boundary
    type(sleepers_t) :: sleepers
    type(exchange_t) :: exchange             !! data shared with the other ranks
    type(node_pairs_t) :: pairs              !! nodes where bodies are in contact
    type(tool_contact_t) :: contact          !! particles and nodes in contact with a tool
    type(budget_t) :: budget
    type(history_t) :: history
    type(phase_timer_t) :: timer
  contains
    procedure :: prepare_scratch
  end type simulation_t

contains

  !> Allocate scratch arrays and the budget for the sizes of the scene.
  subroutine prepare_scratch(self)
    class(simulation_t), intent(inout) :: self
    integer :: n

    if (allocated(self%budget%impulse)) return
    allocate (self%step%is_near(size(self%tool)), source=.false.)
    if (allocated(self%scene%tool_of)) self%nodes%n_groups = size(self%scene%tool_of)
    if (.not. allocated(self%scene%warning)) allocate (self%scene%warning(0))
    n = size(self%scene%condition)
    allocate (self%budget%warnings(size(self%scene%warning)), &
              self%budget%warning_place(5, size(self%scene%warning)), &
              self%budget%impulse(3, n), self%history%row_impulse(3, n), &
              self%history%row_sums(n_tool_sums, size(self%tool)), &
              self%boundary%mirrors%lost(8, size(self%scene%symmetry)), source=0.0_rp)
    call self%nodes%allocate_scratch()
  end subroutine prepare_scratch

  !> Free memory that is not released by deallocation.
  subroutine free_simulation(sim)
    type(simulation_t), intent(inout) :: sim

    call sim%particles%free()
    call sim%nodes%free()
    call sim%pairs%near%free()
  end subroutine free_simulation

end module simulation_parts
