! SPDX-License-Identifier: MIT
!> Everything a running simulation holds: scene, this rank's part of it, clock and sums.
module time_state
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned, free_aligned
  use base_timers, only: phase_timer_t
  use comm_world, only: reduction_t, world_t
  use contact_tool, only: tool_t
  use grid_geometry, only: box_t, patch_t
  use grid_halo, only: halo_t
  use particles_store, only: particles_t
  use physics_flow_law, only: n_alarms
  use time_audit, only: n_sums
  use time_meeting, only: meeting_t
  use time_scene, only: scene_t, scheme_usl
  use time_touching, only: touching_t
  implicit none (type, external)
  private

  public :: clock_t, column_t, mirrors_t, probes_t, simulation_t, source_t
  public :: free_simulation

  !> Room around the particles of a block until the next sort: a cell of way, half a cell that they reach.
  real(rp), parameter, public :: roam = 1.5_rp   !! [cells]
  integer, parameter, public :: source_disc = 1, source_ball = 2

  !> A moving source of heat, and what it does in the present conduction step.
  type :: source_t
    integer :: kind = source_disc
    real(rp) :: power = 0.0_rp               !! [W]
    real(rp) :: position(3) = 0.0_rp         !! of the centre at t = 0 [m]
    real(rp) :: velocity(3) = 0.0_rp         !! [m/s]
    real(rp) :: radius = 0.0_rp              !! [m]
    real(rp) :: begin = 0.0_rp, end = huge(1.0_rp)   !! [s]
    real(rp) :: duration = 0.0_rp            !! how long it gives heat in this step [s]
    real(rp) :: centre(3) = 0.0_rp           !! in the middle of that time [m]
    real(rp) :: share = 0.0_rp               !! heat per covered area or mass [J/m2, J/kg]
    logical :: has_warned = .false.          !! that it touches nothing
  end type source_t

  !> Three nodes across the face of a clamp that lies between nodes (time_clamps).
  type :: column_t
    integer :: node(3) = 0                   !! 0: not stored here
    real(rp) :: weight(3) = 0.0_rp           !! of their velocities at the face
    real(rp) :: tail(3) = 0.0_rp             !! mass of a node that only sees a body up to the face
                                             !! over that of one inside
    integer :: rule = 0                      !! constraint
    logical :: is_owned(3) = .false.
  end type column_t

  !> Nodes behind walls and their mirrors (time_mirrors).
  type :: mirrors_t
    integer :: n_pairs = 0, n_planes = 0
    integer :: early_pairs = 0, early_planes = 0   !! from the first: those of shared nodes
    integer, allocatable :: pair(:, :)    !! (3, n_pairs) node behind, node in front, wall
    integer, allocatable :: plane(:, :)   !! (2, n_planes) node on the wall, wall
    real(rp), allocatable :: own(:, :)    !! (n_pairs, n_groups) mass or capacity behind, own part
    real(rp), allocatable :: lost(:, :)   !! (8, constraints) of the sum of nodes, by folds
  end type mirrors_t

  !> What the rim of sleeping material gives to the nodes (time_rim).
  type :: rim_t
    logical :: is_stale = .true.
    integer, allocatable :: node(:)          !! where this rank's particles give something
    real(rp), allocatable :: record(:, :)    !! (8, nodes) mass, momentum 0, force, heat
    real(rp), allocatable :: volume(:, :)    !! (2 bodies, nodes)
    real(rp), allocatable :: mass(:)         !! (nn) of all ranks
    real(rp), allocatable :: behind(:)       !! (pairs of mirrors) own mass behind the walls
  end type rim_t

  !> Thermocouples that ride in the material.
  type :: probes_t
    integer :: n = 0
    integer, allocatable :: group(:)          !! of the body that each is in
    character(32), allocatable :: name(:)
    real(rp), allocatable :: x(:, :)          !! (3, n) [m]
    real(rp), allocatable :: temperature(:)   !! [K]
    logical, allocatable :: is_mine(:)        !! moved by this rank
  end type probes_t

  !> What does not change while the same particles sleep in the same blocks.
  type :: sleepers_t
    real(rp), dimension(6) :: extent_rim = -huge(1.0_rp), &   !! largest places, largest negative places
                              extent_any = -huge(1.0_rp)      !! of the rim, of all at rest [m]
    logical, allocatable :: near_rim(:, :, :), near_any(:, :, :)   !! (z, y, x) nodes in reach of
                                                                   !! the rim, of all at rest
    type(box_t) :: cubes                        !! cubes that were asked, numbered from 0
    integer, allocatable :: rest(:, :, :)       !! of the particles in each of them
    real(rp), allocatable :: borne(:, :)        !! (3, constraints) force on those beyond the rim [N]
  end type sleepers_t

  !> Time and what decides the next step; equal on all ranks, stored in checkpoints.
  type :: clock_t
    integer(i8) :: step = 0
    real(rp) :: time = 0.0_rp
    real(rp) :: dt = 0.0_rp
    integer(i8) :: sorted_at = -1        !! step that last asked who sleeps, and who moves on
    real(rp) :: travel = 0.0_rp          !! way of the fastest particle since then [m]
    real(rp) :: heat_time = 0.0_rp       !! time of the last conduction step
    real(rp) :: heat_step = 0.0_rp       !! next implicit one [s]; 0: none was made yet
    real(rp) :: next_frame = 0.0_rp, next_history = 0.0_rp, next_checkpoint = 0.0_rp
    real(rp) :: max_speed = 0.0_rp       !! of the last step [m/s]
    integer(i8) :: refused = 0           !! steps that had to be made shorter
    real(rp) :: stiffness = 0.0_rp       !! largest squared wave speed, unscaled [m2/s2]
    real(rp) :: inertial_peak = 0.0_rp   !! largest rho v^2 over flow stress of late
  end type clock_t

  !> What the particles of this rank say at the end of a step, for the middle of the next.
  type :: outcome_t
    real(rp) :: stiffness = 0.0_rp       !! squared wave speed [m2/s2]
    real(rp) :: speed2 = 0.0_rp          !! squared grid velocity at a particle [m2/s2]
  end type outcome_t

  !> Blocks that come back from the grid before all ranks have said that the step stands (time_ahead), and
  !> what a step that does not stand gives back.
  type :: ahead_t
    logical :: is_possible = .false.         !! in this step
    integer :: n_far = 0                     !! blocks that no tool reaches until the next sort
    integer, allocatable :: order(:)         !! (n_awake) those first, then the other awake blocks
    integer :: done = 0                      !! the first ones, which came back already
    real(rp), allocatable :: kept(:, :, :)   !! their particles before
    real(rp) :: sums(n_sums) = 0.0_rp        !! books of the simulation before
    real(rp), allocatable :: impulse(:, :)
    integer :: failed_returns = 0
    real(rp) :: alarms(n_alarms) = 0.0_rp, alarm_place(5, n_alarms) = 0.0_rp
  end type ahead_t

  !> How evenly the steps of this run loaded the ranks: the most loaded rank over the mean.
  type :: balance_t
    real(rp) :: now = 1.0_rp             !! until the next sort
    real(rp) :: worst = 1.0_rp, sum = 0.0_rp   !! largest, and sum, over the steps
    integer :: cuts = 0                  !! divisions of the grid, the first one included
    real(rp) :: waited = 0.0_rp          !! of this rank, for the reductions of the steps [s]
  end type balance_t

  type :: simulation_t
    type(scene_t) :: scene
    type(clock_t) :: clock
    type(tool_t), allocatable :: tool(:)
    type(source_t), allocatable :: source(:) !! of heat
    type(probes_t) :: probes
    type(particles_t) :: particles
    ! Sleeping: how many blocks, from the first, move, and how many give mass and force.
    integer :: n_awake = -1, n_mapped = 0
    integer :: n_border = 0                  !! awake blocks that may touch shared nodes
    integer, allocatable :: turn(:)          !! (n_awake) those first, then the other awake blocks
    type(rim_t) :: rim
    type(sleepers_t) :: sleepers
    integer(i8) :: awake_steps = 0           !! steps of awake particles on this rank in this run
    type(box_t), allocatable :: boxes(:)     !! (0:size-1)
    type(patch_t) :: patch
    type(halo_t) :: halo                     !! of the nodes of steps
    type(halo_t) :: resting_halo             !! of the nodes of all particles, while some sleep
    type(balance_t) :: balance
    ! the grid: records of 8 for each group of bodies, and which of them are in use
    integer :: n_groups = 1                  !! groups of bodies with a velocity field of their own
    real(rp), pointer, contiguous :: g(:, :, :) => null()    !! (8, nn, n_groups)
    real(rp), pointer, contiguous :: g2(:, :, :) => null()   !! second grid: two passes, conduction
    real(rp), pointer, contiguous :: increment(:, :, :) => null()   !! third grid: XPIC, FMPM
    real(rp), pointer, contiguous, dimension(:) :: memory => null(), memory2 => null(), &
                                                   memory3 => null()
    type(meeting_t) :: meeting               !! nodes where groups of bodies meet
    type(touching_t) :: touching             !! particles and nodes in contact with a tool
    logical, allocatable :: is_near(:)       !! tools that particles of any rank may touch
    real(rp), allocatable :: volume(:, :)    !! (2 bodies, nn) mass, mass times J next to a node
    real(rp) :: pic = 0.0_rp                 !! part of the grid velocity taken in this step
    real(rp) :: force_time = 0.0_rp          !! to which its outer forces belong [s]
    integer :: n_runs = 0
    integer, allocatable :: run(:, :)        !! (3, n) first node, last node, 1 if owned
    integer :: n_resting = 0                 !! the same for all particles, while some sleep: of
    integer, allocatable :: resting(:, :)    !! the steps while the other list conducts, and back
    type(mirrors_t) :: resting_mirrors       !! likewise
    logical, allocatable :: is_held(:)       !! (nn) node held by a clamp or wall, or behind one
    integer :: n_fixed = 0
    integer, allocatable :: fixed(:, :)      !! (3, n) node, constraint, 1 if owned
    integer :: n_columns = 0
    type(column_t), allocatable :: column(:) !! nodes across the faces of clamps between nodes
    logical :: columns_are_cut = .false.     !! some rank does not store all nodes of a column
    type(mirrors_t) :: mirrors
    real(rp), allocatable :: clearance(:, :) !! (tools, n_awake) of a block's nearest particle [m] when
                                             !! sorted
    real(rp), allocatable :: ball(:, :)      !! (4, nblk) centre and radius of each block [m] when
                                             !! sorted; particles go up to a cell until the next; only
                                             !! for bodies that meet, and sources of heat
    real(rp) :: sums(n_sums) = 0.0_rp        !! this rank's energy books, see time_audit
    real(rp), allocatable :: impulse(:, :)   !! (3, constraints) on this rank's particles [N s]
    real(rp) :: kinetic0 = 0.0_rp, elastic0 = 0.0_rp   !! energies at t = 0 [J]
    real(rp) :: audit_scale = 0.0_rp         !! largest energy turned over so far [J]
    real(rp), allocatable :: frame_times(:)  !! of the frames written so far [s]
    real(rp) :: row_time = 0.0_rp            !! time of the last history row [s]
    integer(i8) :: rows = 0                  !! of the history so far
    logical :: lost_row = .false.            !! one could not be written: rank 0 knows
    real(rp), allocatable :: row_sums(:, :)  !! tools' books then, of all ranks
    real(rp), allocatable :: row_impulse(:, :)   !! of walls and clamps then, of all ranks
    integer :: failed_returns = 0            !! of this rank that did not converge; most of any
    integer :: worst_returns = 0
    real(rp) :: alarms(n_alarms) = 0.0_rp    !! particle-steps outside the validity of a flow law
    real(rp) :: alarm_place(5, n_alarms) = 0.0_rp   !! time, temperature and place of the first
    ! set by the check in the middle of a step, equal on all ranks
    logical :: is_broken = .false.           !! no step is possible from here
    logical :: is_unsolved = .false.         !! a conduction step was not solved for: all ranks know
    integer :: signal = 0                    !! that arrived on any rank
    logical :: output_is_lost = .false.      !! a row could not be written
    logical :: safety_is_due = .false.       !! time for a checkpoint against a breakdown
    real(rp) :: secured = 0.0_rp             !! wall-clock time of the last checkpoint [s]
    real(rp) :: asked_dt = 0.0_rp            !! before it was found too large [s]
    type(outcome_t) :: last
    type(reduction_t) :: limit               !! of the step, while it is found
    type(ahead_t) :: ahead
    integer :: fastest_node = 0              !! of this rank
    real(rp) :: fastest_speed = 0.0_rp       !! of that node [m/s]
    type(phase_timer_t) :: timer
    ! scratch of the block kernels
    real(rp), pointer, contiguous :: rec(:, :, :) => null()   !! (8, 4, nlane)
    real(rp), pointer, contiguous :: rec_memory(:) => null()
  contains
    procedure :: prepare_scratch
    procedure :: allocate_grid
  end type simulation_t

contains

  !> Scratch and books of the size of the scene.
  subroutine prepare_scratch(self)
    class(simulation_t), intent(inout) :: self
    integer :: n

    if (associated(self%rec)) return
    allocate (self%is_near(size(self%tool)), source=.false.)
    n = size(self%scene%constraint)
    allocate (self%impulse(3, n), self%row_impulse(3, n), self%mirrors%lost(8, n), source=0.0_rp)
    call allocate_aligned(32_i8*nlane, self%rec_memory)
    self%rec(1:8, 1:4, 1:nlane) => self%rec_memory
  end subroutine prepare_scratch

  !> Storage for the nodes of the current patch.
  subroutine allocate_grid(self)
    class(simulation_t), intent(inout) :: self

    call free_aligned(self%memory)
    call allocate_aligned(8_i8*self%patch%nn*self%n_groups, self%memory)
    self%g(1:8, 1:self%patch%nn, 1:self%n_groups) => self%memory
    if (self%scene%method%scheme /= scheme_usl .or. self%scene%method%conducts &
        .or. self%scene%method%filters()) then
      call free_aligned(self%memory2)
      call allocate_aligned(8_i8*self%patch%nn*self%n_groups, self%memory2)
      self%g2(1:8, 1:self%patch%nn, 1:self%n_groups) => self%memory2
    end if
    if (self%scene%method%filters()) then
      call free_aligned(self%memory3)
      call allocate_aligned(8_i8*self%patch%nn*self%n_groups, self%memory3)
      self%increment(1:8, 1:self%patch%nn, 1:self%n_groups) => self%memory3
    end if
    if (allocated(self%volume)) deallocate (self%volume)
    if (self%scene%method%fbar) then
      allocate (self%volume(2*size(self%scene%body), self%patch%nn), source=0.0_rp)
    end if
  end subroutine allocate_grid

  subroutine free_simulation(sim)
    type(simulation_t), intent(inout) :: sim

    call sim%particles%free()
    call free_aligned(sim%memory)
    call free_aligned(sim%memory2)
    call free_aligned(sim%memory3)
    call free_aligned(sim%rec_memory)
  end subroutine free_simulation

end module time_state
