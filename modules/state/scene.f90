! SPDX-License-Identifier: MIT
!> The scene: data that are constant during a run.
!>
!> Heat films on the faces of a body: a heat-transfer coefficient, which may depend on pressure, and
!> radiation.
module state_scene
  use base_kinds, only: i8, rp
  use grid_geometry, only: grid_t, mean_edge
  use particles_store, only: layout_t
  use physics_field, only: field_t
  use physics_material, only: material_t
  use state_conditions, only: held_t, symmetry_t, wall_t
  use tools_pair, only: contact_t
  implicit none (type, external)
  private

  public :: body_t, film_t, load_t, method_t, output_t, scene_t, start_t, stefan_boltzmann, &
            traction_t

  ! Stress-update schemes and transfer methods.
  integer, parameter, public :: scheme_usl = 1, scheme_musl = 2, scheme_usavg = 3
  integer, parameter, public :: transfer_flip = 1, transfer_apic = 2, transfer_xpic = 3, &
                                transfer_fmpm = 4
  ! Modes of F-bar averaging of the volume ratio.
  integer, parameter, public :: average_never = 0, average_flowing = 1, average_always = 2

  !> A body force, distributed by mass.
  type :: load_t
    real(rp) :: acceleration(3) = 0.0_rp     !! force over mass of the body [m/s2]
    real(rp) :: ramp = 0.0_rp                !! time until the force is fully applied [s]
  end type load_t

  !> Initial elastic state of the particles of a body.
  type :: start_t
    real(rp) :: bbar(6) = [1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp]
    real(rp) :: jac = 1.0_rp     !! volume ratio
    real(rp) :: tau(6) = 0.0_rp  !! Kirchhoff stress [Pa]
    real(rp) :: wave2 = 0.0_rp   !! squared wave speed of the stretched state [m2/s2]
  end type start_t

  !> A traction: force per initial area on faces of a body.
  type :: traction_t
    real(rp) :: stress(3, 6) = 0.0_rp  !! tractions on the faces xmin..zmax [Pa]
    real(rp) :: ramp = 0.0_rp          !! time until the traction is fully applied [s]
    logical :: has_box = .false.  !! it acts only on particles that started between two corners [m]
    real(rp) :: lower(3) = -huge(1.0_rp), upper(3) = huge(1.0_rp)
  end type traction_t

  !> Stefan-Boltzmann constant [W/(m2 K4)] (CODATA 2018).
  real(rp), parameter :: stefan_boltzmann = 5.670374419e-8_rp

  integer, parameter, public :: of_nothing = 0, of_pressure = 1
  real(rp), parameter :: unit_pressure = 1.0e6_rp   !! reference pressure of the power law [Pa]

  type :: film_t
    integer :: of = of_nothing                !! variable that the coefficient depends on
    real(rp) :: coefficient = 0.0_rp  !! constant part of the heat-transfer coefficient [W/(m2 K)]
    !> Heat-transfer coefficient that the power law adds at 1 MPa [W/(m2 K)].
    real(rp) :: factor = 0.0_rp
    real(rp) :: exponent = 1.0_rp             !! power law: exponent of the pressure
    real(rp), allocatable :: at(:)            !! pressures of the table [Pa]
    real(rp), allocatable :: there(:)         !! heat-transfer coefficients there [W/(m2 K)]
    real(rp) :: emissivity = 0.0_rp
    real(rp) :: ambient = 298.0_rp    !! ambient temperature beyond the film [K]
    logical :: has_backing = .false.  !! the film leads to a body with a temperature of its own
  contains
    procedure :: acts, varies, coefficient_at
  end type film_t

  !> A body: its material, and loads, films and fields on its particles.
  type :: body_t
    character(32) :: name = ''
    integer :: material = 1
    integer :: group = 1                    !! bodies of a group share a velocity field
    integer :: heat_group = 1               !! bodies of a heat group share nodal temperatures
    integer :: tool = 0  !! tool whose schedule a rigid body follows; 0: deformable body
    !> Initial particle spacing, the smallest one along a graded axis [m].
    real(rp) :: spacing(3) = 0.0_rp
    real(rp) :: widest(3) = 0.0_rp          !! largest initial particle spacing [m]
    logical :: own_lattice = .true.         !! the particles are not on the lattice of the grid
    integer :: averaging = average_flowing  !! F-bar averaging of J in each cell: average_*
    logical :: is_round = .false.           !! particles lie on rings around the axis of a cylinder
    type(start_t) :: start
    type(load_t), allocatable :: load(:)
    type(traction_t), allocatable :: traction(:)  !! tractions; unallocated: none
    type(film_t) :: film(6)                       !! heat films on the faces xmin..zmax
    class(field_t), allocatable :: field          !! prescribed motion or temperature
  contains
    procedure :: is_forced, is_rigid, mean_spacing, longest_diagonal
  end type body_t

  !> Criteria of sleeping (sleep_criteria).
  type :: sleep_t
    logical :: is_on = .false.
    real(rp) :: distance = 0.0_rp  !! distance from tools below which material is awake [m]
    !> Stress change over the largest stress above which material is awake.
    real(rp) :: stress = 0.0_rp
    real(rp) :: heat = 0.0_rp      !! change of temperature that wakes material [K]
  end type sleep_t

  !> Numerical method.
  type :: method_t
    logical :: is_bspline = .false.
    integer :: scheme = scheme_usl, transfer = transfer_flip
    integer :: order = 2               !! order of the filter (XPIC, FMPM)
    integer :: filter_interval = 1     !! steps between two filters (XPIC, FMPM)
    real(rp) :: pic = 0.0_rp           !! PIC fraction
    logical :: shows_motion = .false.  !! output velocities are those of the grid
    logical :: fbar = .true.           !! F-bar averaging of J in each cell, for some bodies
    integer :: sort_interval = 100     !! steps between sorts
    real(rp) :: rebalance = 1.03_rp    !! imbalance that triggers a new partition
    real(rp) :: cfl = 0.4_rp
    real(rp) :: fragment_cfl = huge(1.0_rp)  !! largest CFL number of fragments
    real(rp) :: fixed_dt = 0.0_rp            !! prescribed time step [s]; 0: from the wave speed
    real(rp) :: mass_scaling = 1.0_rp        !! factor on inertia; initial value if adaptive
    logical :: adapts_mass = .false.         !! mass scaling follows the inertial stress
    !> Selective mass scaling, which adds inertia to nodes of little mass (state_nodes).
    logical :: scales_light_nodes = .false.
    real(rp) :: scaling_range(2) = 0.0_rp    !! smallest and largest adaptive mass scaling
    real(rp) :: elastic_scaling = 1.0_rp     !! divisor of the elastic moduli of metal that can flow
    real(rp) :: inertial_fraction = 0.05_rp  !! allowed inertial stress over flow stress
    real(rp) :: debris = 0.0_rp              !! fraction of the total mass that may leave the grid
    real(rp) :: gravity(3) = 0.0_rp          !! [m/s2]
    type(sleep_t) :: sleep
    logical :: conducts = .false.
    logical :: implicit_heat = .false.   !! conduction by backward Euler
    real(rp) :: heat_step = 0.0_rp       !! implicit conduction step [s]; 0: by error control
    integer :: heat_interval = 0         !! mechanical steps per conduction step; 0: by heat_step
    integer :: heat_solver = 0           !! by_cg or by_petsc (heat_linear)
    real(rp) :: heat_tolerance = 2.0_rp  !! allowed error of an implicit conduction step [K]
    logical :: has_mechanics = .true.    !! mechanics, not heat conduction alone
    real(rp) :: fourier = 0.15_rp        !! explicit conduction step over h^2/kappa
  contains
    procedure :: filters, filters_in
  end type method_t

  !> Output settings; intervals in simulated seconds, 0 means never.
  type :: output_t
    character(:), allocatable :: directory, name, input_text
    character(:), allocatable :: scene_text     !! the input with all defaults
    character(:), allocatable :: files     !! checksums of the files named by the input
    character(:), allocatable :: folder    !! their folder
    character(:), allocatable :: run            !! identity of the run (io_folder)
    real(rp) :: frame_interval = 0.0_rp, history_interval = 0.0_rp, checkpoint_interval = 0.0_rp
    real(rp) :: progress_interval = 10.0_rp   !! interval of progress lines, wall-clock time [s]
    logical :: progress_is_given = .false.  !! the interval of progress lines was given in the input
    real(rp) :: safety_interval = 0.0_rp      !! interval of checkpoints, wall-clock time [s]
    logical :: is_quiet = .false.
  end type output_t

  !> Data that are constant during a run.
  type :: scene_t
    character(:), allocatable :: title
    type(grid_t) :: grid
    type(material_t), allocatable :: material(:)
    character(48), allocatable :: warning(:)   !! warnings of all flow laws, without duplicates
    type(body_t), allocatable :: body(:)
    character(32), allocatable :: condition(:)   !! names of walls and clamps, as in the history
    type(wall_t), allocatable :: wall(:)
    type(symmetry_t), allocatable :: symmetry(:)   !! walls that are mirrors
    !> Clamps and walls that are not mirrors, in the order of the conditions.
    type(held_t), allocatable :: clamp(:)
    type(contact_t), allocatable :: contact(:)  !! contact laws, one for every two groups of bodies
    !> Thermal conductance of each contact; not allocated: all are perfect.
    type(film_t), allocatable :: gap(:)
    integer :: n_heat_groups = 1                !! groups with nodal temperatures of their own
    integer, allocatable :: tool_of(:)          !! tool of each group of bodies; 0: deformable
    type(method_t) :: method
    type(layout_t) :: layout             !! optional fields of the particles
    type(output_t) :: output
    real(rp) :: end_time = 0.0_rp
    integer(i8) :: max_steps = 0
  contains
    procedure :: domain, has_tractions, spacing_of, can_flow, is_over, is_rigid_group
  end type scene_t

contains

  !> True if a body follows the schedule of a tool.
  elemental logical function is_rigid(self)
    class(body_t), intent(in) :: self

    is_rigid = self%tool > 0
  end function is_rigid

  !> True if the prescribed motion of a body needs a body force.
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

  !> Longest diagonal of the particles of a body [m].
  pure real(rp) function longest_diagonal(self)
    class(body_t), intent(in) :: self

    longest_diagonal = norm2(self%widest)
  end function longest_diagonal

  !> Initial edges of a particle of a body [m]. On a graded grid they are fields.
  pure function spacing_of(self, body, state) result(spacing)
    class(scene_t), intent(in) :: self
    integer, intent(in) :: body
    real(rp), intent(in) :: state(:)         !! fields of the particle
    real(rp) :: spacing(3)

    associate (edges => self%layout%edges)
      spacing = self%body(body)%spacing
      if (edges > 0) spacing = state(edges:edges + 2)
    end associate
  end function spacing_of

  !> True if the method needs the grids of a velocity filter.
  pure logical function filters(self)
    class(method_t), intent(in) :: self

    filters = self%transfer == transfer_xpic .or. self%transfer == transfer_fmpm
  end function filters

  !> True if particle velocities are replaced by filtered grid velocities in this step (FMPM, XPIC).
  pure logical function filters_in(self, step)
    class(method_t), intent(in) :: self
    integer(i8), intent(in) :: step

    filters_in = self%filters()
    if (filters_in) filters_in = mod(step, int(self%filter_interval, i8)) == 0
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

  !> True at the end time or the last step of a run.
  pure logical function is_over(self, time, step)
    class(scene_t), intent(in) :: self
    real(rp), intent(in) :: time               !! [s]
    integer(i8), intent(in) :: step

    is_over = time >= self%end_time*(1.0_rp - 1.0e-12_rp) &
              .or. (self%max_steps > 0 .and. step >= self%max_steps)
  end function is_over

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

  !> True if the film transfers heat.
  elemental logical function acts(self)
    class(film_t), intent(in) :: self

    acts = self%coefficient > 0.0_rp .or. self%emissivity > 0.0_rp .or. self%of /= of_nothing
  end function acts

  !> True if the film is more than a constant coefficient.
  elemental logical function varies(self)
    class(film_t), intent(in) :: self

    varies = self%emissivity > 0.0_rp .or. self%of /= of_nothing .or. self%has_backing
  end function varies

  !> Heat-transfer coefficient at a pressure [W/(m2 K)]: linear in the table and constant outside,
  !> or the power law. Tension counts as zero pressure.
  pure real(rp) function coefficient_at(self, x) result(h)
    class(film_t), intent(in) :: self
    real(rp), intent(in) :: x                     !! pressure [Pa]
    real(rp) :: part
    integer :: i

    h = self%coefficient
    if (self%of == of_nothing) return
    if (.not. allocated(self%at)) then
      if (x > 0.0_rp) h = h + self%factor*(x/unit_pressure)**self%exponent
      return
    end if
    i = count(self%at <= x)
    h = self%there(max(1, i))
    if (i == 0 .or. i == size(self%at)) return
    part = (x - self%at(i))/(self%at(i + 1) - self%at(i))
    h = h + part*(self%there(i + 1) - h)
  end function coefficient_at

end module state_scene
