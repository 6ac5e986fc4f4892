! SPDX-License-Identifier: MIT
!> Everything a running simulation holds: scene, this rank's part of it, clock and sums.
module time_state
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned, free_aligned
  use base_timers, only: phase_timer_t
  use comm_world, only: world_t
  use contact_tool, only: tool_t
  use fields_field, only: field_t
  use grid_geometry, only: box_t, grid_t, patch_t
  use grid_halo, only: halo_t
  use particles_store, only: layout_t, particles_t
  use physics_flow_law, only: n_alarms
  use physics_material, only: material_t
  use time_audit, only: n_sums
  use time_meeting, only: contact_t, meeting_t
  use time_touching, only: touching_t
  implicit none (type, external)
  private

  public :: body_t, constraint_t, load_t, method_t, output_t, probes_t, scene_t, simulation_t
  public :: clock_t, column_t, mirrors_t, source_t, start_t, traction_t
  public :: free_simulation

  ! When the stress is updated, and how velocities come back from the grid.
  integer, parameter, public :: scheme_usl = 1, scheme_musl = 2, scheme_usavg = 3
  integer, parameter, public :: transfer_flip = 1, transfer_apic = 2, transfer_xpic = 3, &
                                transfer_fmpm = 4
  !> Room around the particles of a block until the next sort: a cell of way, half a cell that they reach.
  real(rp), parameter, public :: roam = 1.5_rp   !! [cells]
  integer, parameter, public :: source_disc = 1, source_ball = 2

  !> A force on a body, shared by mass.
  type :: load_t
    real(rp) :: acceleration(3) = 0.0_rp     !! force over mass of the body [m/s2]
    real(rp) :: ramp = 0.0_rp                !! time until it is whole [s]
  end type load_t

  !> Elastic state in which the particles of a body start.
  type :: start_t
    real(rp) :: bbar(6) = [1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp]
    real(rp) :: jac = 1.0_rp
    real(rp) :: tau(6) = 0.0_rp              !! Kirchhoff stress [Pa]
    real(rp) :: wave2 = 0.0_rp               !! squared wave speed if it is stretched [m2/s2]
  end type start_t

  !> A force per initial area on faces of a body.
  type :: traction_t
    real(rp) :: stress(3, 6) = 0.0_rp        !! on the faces xmin..zmax [Pa]
    real(rp) :: ramp = 0.0_rp                !! time until it is whole [s]
    logical :: has_box = .false.             !! only where particles began between two corners [m]
    real(rp) :: lower(3) = -huge(1.0_rp), upper(3) = huge(1.0_rp)
  end type traction_t

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

  !> A body: its material and what acts on all its particles.
  type :: body_t
    character(32) :: name = ''
    integer :: material = 1
    integer :: group = 1                     !! bodies of a group share a velocity field
    integer :: tool = 0                      !! rigid: the tool whose schedule it follows
    real(rp) :: spacing(3) = 0.0_rp          !! initial distance of its particles [m]
    logical :: own_lattice = .true.          !! they do not lie on the grid's lattice
    logical :: is_round = .false.            !! they lie on rings around the axis of a cylinder
    type(start_t) :: start
    type(load_t), allocatable :: load(:)
    type(traction_t), allocatable :: traction(:)   !! not allocated: none
    real(rp) :: film(6) = 0.0_rp             !! heat transfer of the faces xmin..zmax [W/(m2 K)]
    real(rp) :: ambient(6) = 298.0_rp        !! temperature beyond each face [K]
    class(field_t), allocatable :: field     !! its known motion or temperature
  contains
    procedure :: mean_spacing
  end type body_t

  !> Nodes in a box move with a given velocity (some components), or a wall is a mirror: these
  !> components are odd there.
  type :: constraint_t
    character(32) :: name = ''                         !! in the history
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! [m]
    logical :: component(3) = .true.
    real(rp) :: velocity(3) = 0.0_rp                   !! [m/s]
    integer :: axis = 0                                !! normal of a mirror; 0: nodes are held
    integer :: plane = 0                               !! row of grid nodes on the mirror, from 0
    logical :: faces_up = .true.                       !! the bodies lie above it
    real(rp) :: temperature = 0.0_rp                   !! of a mirror [K]; 0: insulated
  end type constraint_t

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

  !> When material sleeps (time_sleep).
  type :: sleep_t
    logical :: is_on = .false.
    real(rp) :: distance = 0.0_rp        !! from the tools below which it is awake [m]
    real(rp) :: strain = 0.0_rp          !! speed over wave speed above which it is awake
    real(rp) :: rate = 0.0_rp            !! plastic strain rate above which it is awake [1/s]
    real(rp) :: heat = 0.0_rp            !! change of temperature that wakes it [K]
  end type sleep_t

  !> What the rim of sleeping material gives to the nodes (time_rim).
  type :: rim_t
    logical :: is_stale = .true.
    integer, allocatable :: node(:)          !! where this rank's particles give something
    real(rp), allocatable :: record(:, :)    !! (8, nodes) mass, momentum 0, force, heat
    real(rp), allocatable :: volume(:, :)    !! (2 bodies, nodes)
    real(rp), allocatable :: mass(:)         !! (nn) of all ranks
  end type rim_t

  !> Numerical method.
  type :: method_t
    logical :: is_bspline = .false.
    integer :: scheme = scheme_usl
    integer :: transfer = transfer_flip
    integer :: order = 2                 !! of XPIC and FMPM
    integer :: every = 1                 !! steps from filter to filter (XPIC, FMPM)
    real(rp) :: pic = 0.0_rp             !! PIC fraction
    logical :: fbar = .true.             !! average J around each node
    integer :: sort_interval = 100       !! steps
    real(rp) :: rebalance = 1.03_rp      !! imbalance that triggers a new partition
    real(rp) :: cfl = 0.4_rp
    real(rp) :: fixed_dt = 0.0_rp        !! [s]; 0: from the wave speed
    real(rp) :: mass_scaling = 1.0_rp    !! on inertia only; the present one if it adapts
    logical :: adapts_mass = .false.     !! mass scaling follows the inertial stress
    logical :: scales_light_nodes = .false.   !! more inertia for nodes with little mass (time_nodes)
    real(rp) :: scaling_range(2) = 0.0_rp   !! least and largest then
    real(rp) :: inertial_fraction = 0.05_rp   !! inertial stress over flow stress that is small
    real(rp) :: gravity(3) = 0.0_rp      !! [m/s2]
    type(sleep_t) :: sleep
    logical :: conducts = .false.
    logical :: implicit_heat = .false.   !! conduction by backward Euler
    real(rp) :: heat_step = 0.0_rp       !! its step [s]; 0: as its error allows
    integer :: heat_every = 0            !! its step in mechanical ones; 0: as long as heat_step says
    integer :: heat_solver = 0           !! by_cg or by_petsc (thermal_method)
    real(rp) :: heat_tolerance = 2.0_rp  !! of the error of a step [K]
    logical :: has_mechanics = .true.    !! false: heat alone (time_heat_loop)
    real(rp) :: fourier = 0.15_rp        !! conduction step over h^2/kappa
  end type method_t

  !> What to write and when; intervals in simulated seconds, 0 means never.
  type :: output_t
    character(:), allocatable :: directory, name, input_text
    real(rp) :: frame_interval = 0.0_rp
    real(rp) :: history_interval = 0.0_rp
    real(rp) :: checkpoint_interval = 0.0_rp
    real(rp) :: progress_interval = 10.0_rp   !! wall-clock seconds
    real(rp) :: safety_interval = 0.0_rp      !! wall-clock seconds
    logical :: is_quiet = .false.
  end type output_t

  !> Thermocouples that ride in the material.
  type :: probes_t
    integer :: n = 0
    integer, allocatable :: group(:)          !! of the body that each is in
    character(32), allocatable :: name(:)
    real(rp), allocatable :: x(:, :)          !! (3, n) [m]
    real(rp), allocatable :: temperature(:)   !! [K]
    logical, allocatable :: is_mine(:)        !! moved by this rank
  end type probes_t

  !> What does not change while running, but for a mass scaling that adapts (time_mass_scaling).
  type :: scene_t
    character(:), allocatable :: title
    type(grid_t) :: grid
    type(material_t), allocatable :: material(:)
    type(body_t), allocatable :: body(:)
    type(constraint_t), allocatable :: constraint(:)
    type(contact_t), allocatable :: contact(:)   !! one for every two groups of bodies
    integer, allocatable :: tool_of(:)       !! tool of each group of bodies; 0: not rigid
    type(method_t) :: method
    type(layout_t) :: layout             !! of the particles' fields
    type(output_t) :: output
    real(rp) :: end_time = 0.0_rp
    integer(i8) :: max_steps = 0
  contains
    procedure :: domain
  end type scene_t

  !> What does not change while the same particles sleep in the same blocks.
  type :: sleepers_t
    real(rp), dimension(6) :: extent_rim = -huge(1.0_rp), &   !! largest places, largest negative places
                              extent_any = -huge(1.0_rp)      !! of the rim, of all at rest [m]
    logical, allocatable :: near_rim(:, :, :), near_any(:, :, :)   !! (z, y, x) nodes in reach of
                                                                   !! the rim, of all at rest
    type(box_t) :: cubes                        !! cubes that were asked, numbered from 0
    integer, allocatable :: rest(:, :, :)       !! of the particles in each of them
  end type sleepers_t

  !> Time and what decides the next step; equal on all ranks, stored in checkpoints.
  type :: clock_t
    integer(i8) :: step = 0
    real(rp) :: time = 0.0_rp
    real(rp) :: dt = 0.0_rp
    integer(i8) :: sorted_at = -1        !! step that last asked who sleeps, and who moves on
    real(rp) :: travel = 0.0_rp          !! way of the fastest particle since then [m]
    real(rp) :: disorder = 0.0_rp        !! until then, since the awake were put in order by node [m]
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
    real(rp), allocatable :: row_sums(:, :)  !! tools' books then, of all ranks
    real(rp), allocatable :: row_impulse(:, :)   !! of walls and clamps then, of all ranks
    integer :: failed_returns = 0            !! of this rank that did not converge; most of any
    integer :: worst_returns = 0
    real(rp) :: alarms(n_alarms) = 0.0_rp    !! particle-steps outside the validity of a flow law
    real(rp) :: alarm_place(5, n_alarms) = 0.0_rp   !! time, temperature and place of the first
    ! set by the check in the middle of a step, equal on all ranks
    logical :: is_broken = .false.           !! no step is possible from here
    integer :: signal = 0                    !! that arrived on any rank
    logical :: safety_is_due = .false.       !! time for a checkpoint against a breakdown
    real(rp) :: secured = 0.0_rp             !! wall-clock time of the last checkpoint [s]
    real(rp) :: asked_dt = 0.0_rp            !! before it was found too large [s]
    type(outcome_t) :: last
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

  !> Edge of the cube with the volume of a particle [m].
  elemental real(rp) function mean_spacing(self)
    class(body_t), intent(in) :: self

    mean_spacing = self%spacing(1)
    if (any(abs(self%spacing - mean_spacing) > 0.0_rp)) then
      mean_spacing = product(self%spacing)**(1.0_rp/3.0_rp)
    end if
  end function mean_spacing

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
        .or. filters(self%scene%method)) then
      call free_aligned(self%memory2)
      call allocate_aligned(8_i8*self%patch%nn*self%n_groups, self%memory2)
      self%g2(1:8, 1:self%patch%nn, 1:self%n_groups) => self%memory2
    end if
    if (filters(self%scene%method)) then
      call free_aligned(self%memory3)
      call allocate_aligned(8_i8*self%patch%nn*self%n_groups, self%memory3)
      self%increment(1:8, 1:self%patch%nn, 1:self%n_groups) => self%memory3
    end if
    if (allocated(self%volume)) deallocate (self%volume)
    if (self%scene%method%fbar) then
      allocate (self%volume(2*size(self%scene%body), self%patch%nn), source=0.0_rp)
    end if
  end subroutine allocate_grid

  !> True if the method needs the grids of a velocity filter.
  pure logical function filters(method)
    type(method_t), intent(in) :: method

    filters = method%transfer == transfer_xpic .or. method%transfer == transfer_fmpm
  end function filters

  !> Half lengths of the domains of a body's particles [cells].
  pure function domain(self, body)
    class(scene_t), intent(in) :: self
    integer, intent(in) :: body
    real(rp) :: domain(3)

    if (self%method%is_bspline) then
      domain = 0.5_rp
    else
      domain = 0.5_rp*self%body(body)%spacing/self%grid%h
    end if
  end function domain

  subroutine free_simulation(sim)
    type(simulation_t), intent(inout) :: sim

    call sim%particles%free()
    call free_aligned(sim%memory)
    call free_aligned(sim%memory2)
    call free_aligned(sim%memory3)
    call free_aligned(sim%rec_memory)
  end subroutine free_simulation

end module time_state
