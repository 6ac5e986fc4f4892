! SPDX-License-Identifier: MIT
!> Particles that touch a tool in a step, and the nodes near it; the lists are rebuilt in each step.
module state_tool_lists
  use base_kinds, only: nlane, rp
  use particles_store, only: f_plastic, f_rate, f_tau, layout_t, n_conduction, particles_t
  use tools_tool, only: rigid_t
  implicit none (type, external)
  private

  public :: add_values, candidates_t, contact_particle_t, impulse_of, load_return, &
            tool_contact_t

  ! Indices of the values that touching particles add to a node:
  integer, parameter, public :: &
    v_normal = 1, &        !! normal impulses [N s], 3 components
    v_stick = 4, &         !! impulse that would stop the slip [N s], 3 components
    v_coulomb = 7, &       !! Coulomb limit, of this step and kept [N s]
    v_max_friction = 8, &  !! largest friction, by strength and law [N s]
    v_transition = 9       !! friction at which the law changes its form [N s]
  integer, parameter, public :: n_values = 9
  !> Values of both sides, the second for nodes behind planes with `has_separate_sides`.
  integer, parameter, public :: n_both = 2*n_values

  ! Indices of the values added to a node first: masses [kg], later divided by the mass of the node.
  integer, parameter, public :: &
    m_touching = 1, &     !! particles that touch or are near enough for friction
    m_pushed = 2, &       !! pushed particles
    m_last_impulse = 3    !! impulse by the force of the last step [N s], 3 components
  integer, parameter, public :: n_masses = 5

  !> Candidates for contact, gathered from their blocks into one: a block at a tool has only a few,
  !> and weights and flow laws are evaluated for whole blocks.
  type :: candidates_t
    integer :: tool = 0
    type(rigid_t) :: rigid                        !! mean motion of the tool in the step
    real(rp) :: displacement = 0.0_rp             !! largest decrease of a gap in the step [m]
    integer :: n = 0
    integer :: body = 0                           !! body of all candidates
    integer :: block(nlane) = 0, lane(nlane) = 0  !! block and lane of each candidate
    real(rp) :: surface_distance(nlane) = 0.0_rp  !! distance from centre to surface [m]
    real(rp) :: normal(3, nlane) = 0.0_rp         !! unit vectors out of the tool
    integer, allocatable :: field(:)              !! particle fields that are gathered
    real(rp), allocatable :: ps(:, :)             !! (nlane, fields of a particle)
  contains
    procedure :: init, add, pad_lanes
  end type candidates_t

  !> A particle that touches the tool, or is near enough for friction.
  type :: contact_particle_t
    integer :: block = 0, lane = 0, first = 0
    integer :: candidate = 0                    !! index among the candidates
    real(rp) :: surface_distance = 0.0_rp       !! distance from centre to surface [m]
    logical :: can_flow = .false.               !! the material has a flow law
    logical :: touches = .false.                !! the particle touches; false: it is only near
    real(rp) :: w(3, 3) = 0.0_rp                !! weights of the particle surface along the axes
    real(rp) :: w_centre(3, 3) = 0.0_rp         !! weights of the particle centre along the axes
    integer :: entry(27) = 0  !! entries of the nodes of the particle in the list; 0: not listed
    real(rp) :: weight(27) = 0.0_rp             !! weights of the particle surface at the nodes
    real(rp) :: mass = 0.0_rp                   !! inertial mass [kg]
    real(rp) :: normal(3) = 0.0_rp              !! unit vector out of the tool
    real(rp) :: cell_edges(3) = 0.0_rp          !! edges of the cell of the particle [m]
    real(rp) :: spacing(3) = 0.0_rp             !! initial edges of the particle [m]
    real(rp) :: closing_velocity = 0.0_rp  !! velocity that contact removes [m/s]; 0: no push
    !> Normal impulse by the force of the last step, then that of this one [N s].
    real(rp) :: normal_impulse = 0.0_rp
    !> `closing_velocity` without the removal of penetration [m/s].
    real(rp) :: approach_velocity = 0.0_rp
    !> `normal_impulse` without the removal of penetration [N s].
    real(rp) :: lasting_impulse = 0.0_rp
    !> Normal impulse that closing the gap at once would take at most, without flow [N s].
    real(rp) :: gap_impulse = 0.0_rp
    !> Velocity that an edge removes beyond any limit [m/s].
    real(rp) :: edge_closing_velocity = 0.0_rp
    !> Fraction of the weight function that the tool covers [-].
    real(rp) :: covered_fraction = 1.0_rp
    real(rp) :: max_normal_impulse = 0.0_rp     !! limit of the normal impulse at an edge [N s]
    real(rp) :: slip(3) = 0.0_rp                !! slip velocity along the tool surface [m/s]
    real(rp) :: coulomb_factor = 0.0_rp         !! factor of the normal impulse in the friction law
    real(rp) :: coulomb_impulse = 0.0_rp        !! Coulomb limit of the friction impulse [N s]
    real(rp) :: max_friction = 0.0_rp           !! largest friction impulse [N s]
    real(rp) :: shear_impulse = 0.0_rp          !! impulse of the shear strength of the metal [N s]
    real(rp) :: melting_impulse = 0.0_rp        !! friction whose heat melts the particle [N s]
    real(rp) :: transition = 0.0_rp  !! friction impulse at which the law changes its form [N s]
    real(rp) :: last_friction(3) = 0.0_rp  !! friction impulse by the force of the last step [N s]
    real(rp) :: stick_impulse(3) = 0.0_rp       !! impulse that would stop the slip [N s]
    real(rp) :: layer_depth = 0.0_rp  !! depth of the centre under the face [m]; 0: no shear layer
    !> Plastic strain rate at the centre if the layer accommodates all slip [ln 1/s].
    real(rp) :: log_rate = 0.0_rp
    real(rp) :: layer_strength = 0.0_rp         !! impulse of the layer strength [N s]
    real(rp) :: rate_sensitivity = 0.0_rp       !! d ln(layer stress)/d ln(rate)
    real(rp) :: plastic_fraction = 0.0_rp       !! fraction of the slip accommodated by layer shear
    real(rp) :: resolved_rate = 0.0_rp          !! plastic strain rate of the particle itself [1/s]
    real(rp) :: face_area = 0.0_rp              !! face area of the particle [m2]
    real(rp) :: softening = 0.0_rp              !! x tanh x of the shear layer [-]
    real(rp) :: temperature_rise = 0.0_rp       !! face temperature less that of the centre [K]
    real(rp) :: layer_thickness = 0.0_rp        !! [m]
    real(rp) :: strength_used = 0.0_rp          !! friction over layer strength [-]
    !> Mean velocity of the layer metal relative to the particle, along the slip [m/s].
    real(rp) :: excess_velocity = 0.0_rp
  end type contact_particle_t

  type :: tool_contact_t
    integer :: n = 0                           !! number of particles
    type(contact_particle_t), allocatable :: particle(:)
    integer :: n_nodes = 0
    !> Entry behind a symmetry plane, that in front (0: not listed), plane, (3, pairs).
    integer, allocatable :: pair(:, :)
    integer, allocatable :: plane(:, :)            !! (2, entries on planes) entry, plane
    !> Symmetry planes on whose sides friction is limited separately (contact_tool_walls).
    logical, allocatable :: has_separate_sides(:)
    integer, allocatable :: entry_of(:)            !! (nn) entry of a node; 0: not listed
    integer, allocatable :: node(:)
    real(rp), allocatable :: mass(:, :)                   !! (n_masses, n_nodes)
    integer :: width = n_values  !! rows of `values`: n_both if a plane has separate sides
    real(rp), allocatable :: values(:, :)  !! (width, n_nodes) of all ranks, reflected at walls
    real(rp), allocatable :: local_values(:, :)  !! (n_values, n_nodes) of this rank's particles
    !> 1, or 0 where a wall holds the node, (3, n_nodes).
    real(rp), allocatable :: free_direction(:, :)
    real(rp), allocatable :: friction_fraction(:)  !! fraction of `v_stick` that friction provides
    !> Fraction of `v_stick` that friction provides behind planes with separate sides.
    real(rp), allocatable :: friction_fraction_behind(:)
    real(rp), allocatable :: coulomb_unused(:)            !! unused fraction of `v_coulomb`
    real(rp), allocatable :: slip(:, :)  !! (3, n_nodes) mean velocity relative to the tool [m/s]
    !> Components that a mirror reflects with a change of sign, (3, n_nodes).
    logical, allocatable :: is_folded(:, :)
  contains
    procedure :: reset, add_node, add_particle_in_contact, prepare, find_nodes
  end type tool_contact_t

contains

  !> Initialise an empty list for particles with `layout`; `with_stress`: their stress is gathered.
  subroutine init(self, layout, with_stress)
    class(candidates_t), intent(out) :: self
    type(layout_t), intent(in) :: layout
    logical, intent(in) :: with_stress
    integer :: i

    self%field = [(i, i=1, n_conduction), f_plastic, f_rate, layout%surface_offset, &
                  layout%coulomb_reserve, (layout%tool_force + i, i=0, 2), &
                  (layout%law + i, i=0, layout%n_law - 1)]
    if (with_stress) self%field = [self%field, (f_tau + i, i=0, 5)]
    if (layout%half > 0) self%field = [self%field, (layout%half + i, i=0, 2)]
    if (layout%edges > 0) self%field = [self%field, (layout%edges + i, i=0, 2)]
    allocate (self%ps(nlane, layout%n), source=0.0_rp)
  end subroutine init

  !> Append the particle in lane `p` of block `b`; the list must not be full.
  pure subroutine add(self, particles, b, p, normal, half)
    class(candidates_t), intent(inout) :: self
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b, p
    real(rp), intent(in) :: normal(3), half
    integer :: f, i

    self%n = self%n + 1
    self%body = particles%body(b)
    self%block(self%n) = b
    self%lane(self%n) = p
    self%normal(:, self%n) = normal
    self%surface_distance(self%n) = half
    do i = 1, size(self%field)
      f = self%field(i)
      self%ps(self%n, f) = particles%ps(p, f, b)
    end do
  end subroutine add

  !> Fill unused lanes with the first candidate.
  pure subroutine pad_lanes(self)
    class(candidates_t), intent(inout) :: self
    integer :: f, i

    do i = 1, size(self%field)
      f = self%field(i)
      self%ps(self%n + 1:, f) = self%ps(1, f)
    end do
  end subroutine pad_lanes

  !> Empty the lists; allocate them for a new patch of `nn` nodes.
  pure subroutine reset(self, nn)
    class(tool_contact_t), intent(inout) :: self
    integer, intent(in) :: nn

    if (allocated(self%entry_of)) then
      if (size(self%entry_of) /= nn) deallocate (self%entry_of)
    end if
    if (allocated(self%entry_of)) then
      self%entry_of(self%node(1:self%n_nodes)) = 0
    else
      allocate (self%entry_of(nn), source=0)
    end if
    if (.not. allocated(self%node)) allocate (self%node(64), self%particle(64))
    self%n = 0
    self%n_nodes = 0
  end subroutine reset

  !> Append node `q`.
  pure subroutine add_node(self, q)
    class(tool_contact_t), intent(inout) :: self
    integer, intent(in) :: q
    integer, allocatable :: longer(:)

    if (self%n_nodes == size(self%node)) then
      allocate (longer(2*self%n_nodes))
      longer(1:self%n_nodes) = self%node
      call move_alloc(longer, self%node)
    end if
    self%n_nodes = self%n_nodes + 1
    self%node(self%n_nodes) = q
    self%entry_of(q) = self%n_nodes
  end subroutine add_node

  !> Append a particle in contact.
  pure subroutine add_particle_in_contact(self, particle)
    class(tool_contact_t), intent(inout) :: self
    type(contact_particle_t), intent(in) :: particle
    type(contact_particle_t), allocatable :: longer(:)

    if (self%n == size(self%particle)) then
      allocate (longer(2*self%n))
      longer(1:self%n) = self%particle
      call move_alloc(longer, self%particle)
    end if
    self%n = self%n + 1
    self%particle(self%n) = particle
  end subroutine add_particle_in_contact

  !> Allocate and clear the values of the listed nodes.
  pure subroutine prepare(self)
    class(tool_contact_t), intent(inout) :: self

    if (allocated(self%mass)) then
      if (size(self%mass, 2) /= self%n_nodes .or. size(self%values, 1) /= self%width) then
        deallocate (self%mass, self%values, self%local_values, self%free_direction, &
                    self%friction_fraction, self%friction_fraction_behind, self%coulomb_unused, &
                      self%slip, self%is_folded)
      end if
    end if
    if (.not. allocated(self%mass)) allocate (self%mass(n_masses, self%n_nodes), &
      self%values(self%width, self%n_nodes), self%local_values(n_values, self%n_nodes), &
      self%free_direction(3, self%n_nodes), self%friction_fraction(self%n_nodes), &
      self%friction_fraction_behind(self%n_nodes), self%coulomb_unused(self%n_nodes), &
      self%slip(3, self%n_nodes), self%is_folded(3, self%n_nodes))
    self%mass = 0.0_rp
    self%values = 0.0_rp
    self%slip = 0.0_rp
    self%free_direction = 1.0_rp
    self%is_folded = .false.
  end subroutine prepare

  !> Find the entries and weights of a touching particle's 27 nodes.
  pure subroutine find_nodes(self, stride, particle)
    class(tool_contact_t), intent(in) :: self
    integer, intent(in) :: stride(3)
    type(contact_particle_t), intent(inout) :: particle
    integer :: c, i, j, k, q

    c = 0
    do i = 1, 3
      do j = 1, 3
        q = particle%first + (i - 1)*stride(1) + (j - 1)*stride(2) - 1
        do k = 1, 3
          c = c + 1
          particle%entry(c) = self%entry_of(q + k)
          particle%weight(c) = particle%w(i, 1)*particle%w(j, 2)*particle%w(k, 3)
        end do
      end do
    end do
  end subroutine find_nodes

  !> Load-return factors of a particle for uniform loads on all touching and on all pushed
  !> particles, and its velocity from the forces of the last step [m/s], 3 components.
  pure function load_return(entry, weight, normal, n, free, mass) result(s)
    integer, intent(in) :: entry(27), n
    real(rp), intent(in) :: weight(27), normal(3), free(3, n), mass(n_masses, n)
    real(rp) :: along(3), s(5)
    integer :: i

    s = 0.0_rp
    do i = 1, 27
      if (entry(i) == 0) cycle
      along = weight(i)*free(:, entry(i))
      s(:2) = s(:2) + (along(1)*normal(1)**2 + along(2)*normal(2)**2 + along(3)*normal(3)**2) &
                      *mass(m_touching:m_pushed, entry(i))
      s(3:) = s(3:) + along*mass(m_last_impulse:m_last_impulse + 2, entry(i))
    end do
  end function load_return

  !> Impulse by the values of a node, with friction of `fraction` of what would stop the slip [N s].
  pure function impulse_of(values, fraction) result(impulse)
    real(rp), intent(in) :: values(n_values), fraction
    real(rp) :: impulse(3)

    impulse = values(v_normal:v_normal + 2) + fraction*values(v_stick:v_stick + 2)
  end function impulse_of

  !> Add a particle's values to its nodes.
  pure subroutine add_values(entry, weight, own, width, n, values)
    integer, intent(in) :: entry(27), width, n
    real(rp), intent(in) :: weight(27), own(n_values)
    real(rp), intent(inout) :: values(width, n)
    integer :: i

    do i = 1, 27
      if (entry(i) == 0) cycle
      values(:n_values, entry(i)) = values(:n_values, entry(i)) + weight(i)*own
    end do
  end subroutine add_values

end module state_tool_lists
