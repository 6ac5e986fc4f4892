! SPDX-License-Identifier: MIT
!> The scene: what does not change while a simulation runs.
module state_scene
  use base_kinds, only: i8, rp
  use conditions_list, only: held_t
  use conditions_symmetry, only: symmetry_t
  use contact_pair, only: contact_t
  use fields_field, only: field_t
  use grid_geometry, only: grid_t, mean_edge
  use particles_store, only: layout_t
  use physics_material, only: material_t
  use state_film, only: film_t
  implicit none (type, external)
  private

  public :: body_t, load_t, method_t, output_t, scene_t, start_t, traction_t

  ! When the stress is updated, and how velocities come back from the grid.
  integer, parameter, public :: scheme_usl = 1, scheme_musl = 2, scheme_usavg = 3
  integer, parameter, public :: transfer_flip = 1, transfer_apic = 2, transfer_xpic = 3, &
                                transfer_fmpm = 4
  ! Where volume ratios of a body approach the mean of their cells.
  integer, parameter, public :: average_never = 0, average_flowing = 1, average_always = 2

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

  !> A body: its material and what acts on all its particles.
  type :: body_t
    character(32) :: name = ''
    integer :: material = 1
    integer :: group = 1                     !! bodies of a group share a velocity field
    integer :: heat_group = 1                !! and of such a group a temperature at each node
    integer :: tool = 0                      !! rigid: the tool whose schedule it follows
    real(rp) :: spacing(3) = 0.0_rp          !! initial distance of its particles, the least along
                                             !! a graded axis [m]
    real(rp) :: widest(3) = 0.0_rp           !! the most [m]
    logical :: own_lattice = .true.          !! they do not lie on the grid's lattice
    integer :: averaging = average_flowing   !! of J in each cell: average_*
    logical :: is_round = .false.            !! they lie on rings around the axis of a cylinder
    type(start_t) :: start
    type(load_t), allocatable :: load(:)
    type(traction_t), allocatable :: traction(:)   !! not allocated: none
    type(film_t) :: film(6)                  !! of heat, on the faces xmin..zmax
    class(field_t), allocatable :: field     !! its known motion or temperature
  contains
    procedure :: is_forced
    procedure :: is_rigid
    procedure :: mean_spacing
    procedure :: longest_diagonal
  end type body_t

  !> When material sleeps (sleep_criteria).
  type :: sleep_t
    logical :: is_on = .false.
    real(rp) :: distance = 0.0_rp        !! from the tools below which it is awake [m]
    real(rp) :: stress = 0.0_rp  !! change of stress over the largest stress above which it is awake
    real(rp) :: heat = 0.0_rp            !! change of temperature that wakes it [K]
  end type sleep_t

  !> Numerical method.
  type :: method_t
    logical :: is_bspline = .false.
    integer :: scheme = scheme_usl
    integer :: transfer = transfer_flip
    integer :: order = 2                 !! of XPIC and FMPM
    integer :: every = 1                 !! steps from filter to filter (XPIC, FMPM)
    real(rp) :: pic = 0.0_rp             !! PIC fraction
    logical :: shows_motion = .false.     !! frames have the velocities of the grid
    logical :: fbar = .true.             !! average J in each cell, of some bodies
    integer :: sort_interval = 100       !! steps
    real(rp) :: rebalance = 1.03_rp      !! imbalance that triggers a new partition
    real(rp) :: cfl = 0.4_rp
    real(rp) :: fixed_dt = 0.0_rp        !! [s]; 0: from the wave speed
    real(rp) :: mass_scaling = 1.0_rp    !! on inertia only; if it adapts, at the start
    logical :: adapts_mass = .false.     !! mass scaling follows the inertial stress
    logical :: scales_light_nodes = .false.   !! more inertia for nodes with little mass
                                              !! (mapping_nodes)
    real(rp) :: scaling_range(2) = 0.0_rp   !! least and largest then
    real(rp) :: elastic_scaling = 1.0_rp      !! divisor of moduli of metal that can flow
    real(rp) :: inertial_fraction = 0.05_rp   !! inertial stress over flow stress that is small
    real(rp) :: debris = 0.0_rp          !! part of all mass that may leave the grid
    real(rp) :: gravity(3) = 0.0_rp      !! [m/s2]
    type(sleep_t) :: sleep
    logical :: conducts = .false.
    logical :: implicit_heat = .false.   !! conduction by backward Euler
    real(rp) :: heat_step = 0.0_rp       !! its step [s]; 0: as its error allows
    integer :: heat_every = 0           !! its step in mechanical ones; 0: by heat_step
    integer :: heat_solver = 0           !! by_cg or by_petsc (heat_solvers_method)
    real(rp) :: heat_tolerance = 2.0_rp  !! of the error of a step [K]
    logical :: has_mechanics = .true.    !! false: heat alone (heat_alone_loop)
    real(rp) :: fourier = 0.15_rp        !! conduction step over h^2/kappa
  contains
    procedure :: filters
    procedure :: filters_in
  end type method_t

  !> What to write and when; intervals in simulated seconds, 0 means never.
  type :: output_t
    character(:), allocatable :: directory, name, input_text
    character(:), allocatable :: scene_text   !! the input with every default
    character(:), allocatable :: files, folder   !! that the input names: checksums, where they are
    character(:), allocatable :: run          !! identity of the run (io_folder)
    real(rp) :: frame_interval = 0.0_rp
    real(rp) :: history_interval = 0.0_rp
    real(rp) :: checkpoint_interval = 0.0_rp
    real(rp) :: progress_interval = 10.0_rp   !! wall-clock seconds
    logical :: progress_is_asked = .false.    !! the input gave it
    real(rp) :: safety_interval = 0.0_rp      !! wall-clock seconds
    logical :: is_quiet = .false.
  end type output_t

  !> What does not change while running.
  type :: scene_t
    character(:), allocatable :: title
    type(grid_t) :: grid
    type(material_t), allocatable :: material(:)
    character(48), allocatable :: warning(:)   !! of all flow laws, each once
    type(body_t), allocatable :: body(:)
    character(32), allocatable :: condition(:)   !! names of walls and clamps, as in the history
    type(symmetry_t), allocatable :: symmetry(:)
    type(held_t), allocatable :: clamp(:)        !! in the order of the conditions
    type(contact_t), allocatable :: contact(:)   !! one for every two groups of bodies
    type(film_t), allocatable :: gap(:)          !! conductance of each; not allocated: all perfect
    integer :: n_heat_groups = 1                 !! groups with a temperature of their own
    integer, allocatable :: tool_of(:)       !! tool of each group of bodies; 0: not rigid
    type(method_t) :: method
    type(layout_t) :: layout             !! of the particles' fields
    type(output_t) :: output
    real(rp) :: end_time = 0.0_rp
    integer(i8) :: max_steps = 0
  contains
    procedure :: domain
    procedure :: has_tractions
    procedure :: spacing_of
    procedure :: can_flow
    procedure :: is_rigid_group
  end type scene_t

contains

  !> True if a body follows the schedule of a tool.
  elemental logical function is_rigid(self)
    class(body_t), intent(in) :: self

    is_rigid = self%tool > 0
  end function is_rigid

  !> True if a body has a known motion that needs a body force.
  elemental logical function is_forced(self)
    class(body_t), intent(in) :: self

    is_forced = .false.
    if (allocated(self%field)) is_forced = self%field%has_force
  end function is_forced

  !> True if tractions act on any body.
  pure logical function has_tractions(self)
    class(scene_t), intent(in) :: self
    integer :: b

    has_tractions = any([(allocated(self%body(b)%traction), b=1, size(self%body))])
  end function has_tractions

  !> True if the body of a group follows the schedule of a tool.
  elemental logical function is_rigid_group(self, group)
    class(scene_t), intent(in) :: self
    integer, intent(in) :: group

    is_rigid_group = self%tool_of(group) > 0
  end function is_rigid_group

  !> Edge of the cube with the volume of a particle [m].
  elemental real(rp) function mean_spacing(self)
    class(body_t), intent(in) :: self

    mean_spacing = mean_edge(self%spacing)
  end function mean_spacing

  !> Longest diagonal of its particles [m].
  pure real(rp) function longest_diagonal(self)
    class(body_t), intent(in) :: self

    longest_diagonal = norm2(self%widest)
  end function longest_diagonal

  !> Initial edges of a particle of a body [m]: along a graded axis its mass tells.
  pure function spacing_of(self, body, mass) result(spacing)
    class(scene_t), intent(in) :: self
    integer, intent(in) :: body
    real(rp), intent(in) :: mass             !! [kg]
    real(rp) :: spacing(3)

    associate (b => self%body(body), a => self%grid%grading%axis)
      spacing = b%spacing
      if (a > 0) spacing(a) = mass*b%start%jac*spacing(a) &
                              /(self%material(b%material)%rho*product(spacing))
    end associate
  end function spacing_of

  !> True if the method needs the grids of a velocity filter.
  pure logical function filters(self)
    class(method_t), intent(in) :: self

    filters = self%transfer == transfer_xpic .or. self%transfer == transfer_fmpm
  end function filters

  !> True if this step ends with velocities from the grid (FMPM, XPIC).
  pure logical function filters_in(self, step)
    class(method_t), intent(in) :: self
    integer(i8), intent(in) :: step

    filters_in = self%filters()
    if (filters_in) filters_in = mod(step, int(self%every, i8)) == 0
  end function filters_in

  !> True if a material of a group of bodies has a flow law.
  pure logical function can_flow(self, group)
    class(scene_t), intent(in) :: self
    integer, intent(in) :: group
    integer :: b

    can_flow = .false.
    do b = 1, size(self%body)
      if (self%body(b)%group /= group .or. self%body(b)%is_rigid()) cycle
      can_flow = can_flow .or. allocated(self%material(self%body(b)%material)%flow)
    end do
  end function can_flow

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

end module state_scene
