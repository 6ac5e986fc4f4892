! SPDX-License-Identifier: MIT
!> The particles that touch a tool in a step, and the nodes near it: lists made anew in each step.
module tool_contact_lists
  use base_kinds, only: nlane, rp
  use particles_store, only: f_plastic, f_rate, f_tau, layout_t, n_conduction, particles_t
  implicit none (type, external)
  private

  public :: add_values, candidates_t, contact_particle_t, returned, tool_contact_t

  ! What the touching particles say to a node.
  integer, parameter, public :: &
    v_push = 1, &     !! impulse along the normals [N s], 3
    v_hold = 4, &     !! impulse that would stop the slip [N s], 3
    v_coulomb = 7, &  !! what Coulomb's law lets friction give: now, and kept from before [N s]
    v_shear = 8, &    !! the most that friction gives: strength, by the tool's law [N s]
    v_bend = 9        !! where that law bends [N s]
  integer, parameter, public :: n_values = 9
  integer, parameter, public :: n_both = 2*n_values   !! followed by the mirrored values of nodes
                                                      !! behind planes with `sides_apart`

  ! What they say to it before: first masses [kg], later over the node's.
  integer, parameter, public :: &
    m_all = 1, &      !! of all that touch or are near enough for friction
    m_pushed = 2, &   !! of those that are pushed
    m_last = 3        !! impulse along the normals at the last step's force [N s], 3
  integer, parameter, public :: n_masses = 5

  !> Particles that may take part in contact, gathered from their blocks into one: a block at a tool
  !> has only a few, and weights and flow laws work on whole blocks.
  type :: candidates_t
    integer :: n = 0
    integer :: body = 0                        !! of all of them
    integer :: block(nlane) = 0, lane(nlane) = 0   !! where they are
    real(rp) :: half(nlane) = 0.0_rp           !! from their centres to their surfaces [m]
    real(rp) :: normal(3, nlane) = 0.0_rp      !! out of the tool
    integer, allocatable :: field(:)           !! those that are gathered
    real(rp), allocatable :: ps(:, :)          !! (nlane, fields of a particle)
  contains
    procedure :: init
    procedure :: add
    procedure :: fill_up
  end type candidates_t

  !> A particle that touches, or is near enough to be held by friction.
  type :: contact_particle_t
    integer :: block = 0, lane = 0, first = 0
    real(rp) :: half = 0.0_rp                  !! from its centre to its surface [m]
    logical :: can_flow = .false.              !! its material
    logical :: touches = .false.               !! else it is only near
    real(rp) :: w(3, 3) = 0.0_rp               !! weights of its surface on the axes
    real(rp) :: inner(3, 3) = 0.0_rp           !! those of its centre
    integer :: entry(27) = 0                   !! of its nodes in the list, 0: none
    real(rp) :: weight(27) = 0.0_rp            !! of its surface on its nodes
    real(rp) :: mass = 0.0_rp                  !! inertial [kg]
    real(rp) :: normal(3) = 0.0_rp             !! out of the tool
    real(rp) :: edges(3) = 0.0_rp              !! of the cell where it is [m]
    real(rp) :: spacing(3) = 0.0_rp            !! its initial edges [m]
    real(rp) :: closing = 0.0_rp               !! velocity that contact takes; 0: not pushed [m/s]
    real(rp) :: pressed = 0.0_rp               !! impulse along its normal [N s]: at the last
                                               !! step's force, then in this step
    real(rp) :: approach = 0.0_rp              !! what of it takes back no depth [m/s]
    real(rp) :: lasting = 0.0_rp               !! impulse without what takes back depth [N s]
    real(rp) :: keep_out = 0.0_rp              !! what it takes in any case, at an edge [m/s]
    real(rp) :: within = 1.0_rp                !! part of its weight function inside the edges
    real(rp) :: most = 0.0_rp                  !! impulse along its normal, beyond that [N s]
    real(rp) :: slip(3) = 0.0_rp               !! along the tool's surface [m/s]
    real(rp) :: friction = 0.0_rp
    real(rp) :: coulomb = 0.0_rp               !! impulse that Coulomb's law lets it give [N s]
    real(rp) :: shear = 0.0_rp                 !! the most that friction gives [N s]
    real(rp) :: bend = 0.0_rp                  !! where its law bends [N s]
    real(rp) :: hold(3) = 0.0_rp               !! impulse that would stop the slip [N s]
    real(rp) :: depth = 0.0_rp                 !! of the layer that shears under the face [m];
                                               !! 0: none
    real(rp) :: log_rate = 0.0_rp              !! logarithm of its rate of plastic strain at the
                                               !! particle's centre, if it takes all of the slip
    real(rp) :: strength = 0.0_rp              !! impulse of its strength [N s]
    real(rp) :: sensitivity = 0.0_rp           !! of its stress to that, over the stress
    real(rp) :: plastic_part = 0.0_rp          !! part of the slip that the layer shears
    real(rp) :: resolved_rate = 0.0_rp         !! rate that the particle has by itself [1/s]
    real(rp) :: face = 0.0_rp                  !! its part of the face [m2]
    real(rp) :: softening = 0.0_rp             !! x tanh x of the layer
    real(rp) :: rise = 0.0_rp                  !! of temperature, from its centre to the face [K]
    real(rp) :: thickness = 0.0_rp             !! of the layer [m]
    real(rp) :: used = 0.0_rp                  !! of the strength
    real(rp) :: faster = 0.0_rp                !! velocity that the layer's metal has beyond that
                                               !! of the particle's centre, along the slip [m/s]
  end type contact_particle_t

  type :: tool_contact_t
    integer :: n = 0                           !! particles
    type(contact_particle_t), allocatable :: particle(:)
    integer :: n_nodes = 0
    logical :: reaches_mirrors = .false.         !! some of them are on or behind a wall
    logical, allocatable :: sides_apart(:)       !! of planes of symmetry: friction is limited on
                                                 !! either side by itself (tool_contact_walls)
    integer, allocatable :: entry_of(:)           !! (nn) entry of a node, 0: none
    integer, allocatable :: node(:)
    real(rp), allocatable :: mass(:, :)        !! (n_masses, n_nodes)
    integer :: width = n_values                !! rows of `values`: n_both with `sides_apart`
    real(rp), allocatable :: values(:, :)      !! (width, n_nodes) of all ranks, folded at walls
    real(rp), allocatable :: own(:, :)         !! (n_values, n_nodes) of this rank's particles
    real(rp), allocatable :: free(:, :)        !! (3, n_nodes) 1, or 0 where a wall holds the node
    real(rp), allocatable :: part(:)           !! of `v_hold` that friction can give
    real(rp), allocatable :: part_behind(:)    !! the same for nodes behind such planes
    real(rp), allocatable :: unspent(:)        !! part of `v_coulomb` that it did not
    real(rp), allocatable :: slip(:, :)        !! (3, n_nodes) mean velocity against the tool [m/s]
    logical, allocatable :: is_folded(:, :)    !! (3, n_nodes) a mirror turns this component of what
                                               !! is folded onto the node, or away from it
  contains
    procedure :: forget
    procedure :: add_node
    procedure :: add_particle_in_contact
    procedure :: prepare
    procedure :: spread
  end type tool_contact_t

contains

  !> No candidates of particles with `layout`; their stress is gathered if it is asked for.
  subroutine init(self, layout, with_stress)
    class(candidates_t), intent(out) :: self
    type(layout_t), intent(in) :: layout
    logical, intent(in) :: with_stress
    integer :: i

    self%field = [(i, i=1, n_conduction), f_plastic, f_rate, layout%surface_offset, layout%grip, &
                  layout%press, (layout%law + i, i=0, layout%n_law - 1)]
    if (with_stress) self%field = [self%field, (f_tau + i, i=0, 5)]
    if (layout%half > 0) self%field = [self%field, (layout%half + i, i=0, 2)]
    allocate (self%ps(nlane, layout%n), source=0.0_rp)
  end subroutine init

  !> Add the particle in lane `p` of block `b`; there must be room.
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
    self%half(self%n) = half
    do i = 1, size(self%field)
      f = self%field(i)
      self%ps(self%n, f) = particles%ps(p, f, b)
    end do
  end subroutine add

  !> The lanes behind the last hold what the first does.
  pure subroutine fill_up(self)
    class(candidates_t), intent(inout) :: self
    integer :: f, i

    do i = 1, size(self%field)
      f = self%field(i)
      self%ps(self%n + 1:, f) = self%ps(1, f)
    end do
  end subroutine fill_up

  !> Empty the lists; on a new patch of `nn` nodes make them.
  pure subroutine forget(self, nn)
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
  end subroutine forget

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

  !> Zero what the listed nodes hold.
  pure subroutine prepare(self)
    class(tool_contact_t), intent(inout) :: self

    if (allocated(self%mass)) then
      if (size(self%mass, 2) /= self%n_nodes .or. size(self%values, 1) /= self%width) then
        deallocate (self%mass, self%values, self%own, self%free, self%part, self%part_behind, &
                    self%unspent, self%slip, self%is_folded)
      end if
    end if
    if (.not. allocated(self%mass)) allocate (self%mass(n_masses, self%n_nodes), &
      self%values(self%width, self%n_nodes), self%own(n_values, self%n_nodes), &
      self%free(3, self%n_nodes), self%part(self%n_nodes), &
      self%part_behind(self%n_nodes), self%unspent(self%n_nodes), &
      self%slip(3, self%n_nodes), self%is_folded(3, self%n_nodes))
    self%mass = 0.0_rp
    self%values = 0.0_rp
    self%slip = 0.0_rp
    self%free = 1.0_rp
    self%is_folded = .false.
  end subroutine prepare

  !> Find the entries and weights of a touching particle's 27 nodes.
  pure subroutine spread(self, stride, particle)
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
  end subroutine spread

  !> What comes back to a particle of an even load on all that touch and on all that are pushed, and
  !> the velocity along its normal that the last step's forces give it [m/s].
  pure function returned(entry, weight, normal, n, free, mass) result(s)
    integer, intent(in) :: entry(27), n
    real(rp), intent(in) :: weight(27), normal(3), free(3, n), mass(n_masses, n)
    real(rp) :: along(3), s(3)
    integer :: i

    s = 0.0_rp
    do i = 1, 27
      if (entry(i) == 0) cycle
      along = weight(i)*free(:, entry(i))*normal
      s(:2) = s(:2) + (along(1)*normal(1) + along(2)*normal(2) + along(3)*normal(3)) &
                      *mass(m_all:m_pushed, entry(i))
      s(3) = s(3) + along(1)*mass(m_last, entry(i)) + along(2)*mass(m_last + 1, entry(i)) &
             + along(3)*mass(m_last + 2, entry(i))
    end do
  end function returned

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

end module tool_contact_lists
