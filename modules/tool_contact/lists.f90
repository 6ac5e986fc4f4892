! SPDX-License-Identifier: MIT
!> The particles that touch a tool in a step, and the nodes near it: lists made anew in each step.
module tool_contact_lists
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: tool_contact_t, contact_particle_t, returned, add_values

  ! What the touching particles say to a node.
  integer, parameter, public :: &
    v_push = 1, &     !! impulse along the normals [N s], 3
    v_hold = 4, &     !! impulse that would stop the slip [N s], 3
    v_coulomb = 7, &  !! friction times the normal impulse [N s]
    v_shear = 8       !! impulse at which the material shears [N s]
  integer, parameter, public :: n_values = 8

  !> A particle that touches.
  type :: contact_particle_t
    integer :: block = 0, lane = 0, first = 0
    real(rp) :: half = 0.0_rp                  !! from its centre to its surface [m]
    logical :: can_flow = .false.              !! its material, so that this may become less
    real(rp) :: w(3, 3) = 0.0_rp               !! weights of its surface on the axes
    real(rp) :: inner(3, 3) = 0.0_rp           !! those of its centre
    integer :: entry(27) = 0                   !! of its nodes in the list, 0: none
    real(rp) :: weight(27) = 0.0_rp            !! of its surface on its nodes
    real(rp) :: mass = 0.0_rp                  !! inertial [kg]
    real(rp) :: normal(3) = 0.0_rp             !! out of the tool
    real(rp) :: closing = 0.0_rp               !! velocity that contact takes; 0: not pushed [m/s]
    real(rp) :: pushed = 1.0_rp                !! part of its face that is pushed
    real(rp) :: most = 0.0_rp                  !! impulse that it can take along its normal [N s]
    real(rp) :: slip(3) = 0.0_rp               !! along the tool's surface [m/s]
    real(rp) :: friction = 0.0_rp
    real(rp) :: shear = 0.0_rp                 !! impulse at which the material shears [N s]
    real(rp) :: hold(3) = 0.0_rp               !! impulse that would stop the slip [N s]
  end type contact_particle_t

  type :: tool_contact_t
    integer :: n = 0                           !! particles
    type(contact_particle_t), allocatable :: particle(:)
    integer :: n_nodes = 0
    logical :: reaches_mirrors = .false.         !! some of them are on or behind a wall
    integer, allocatable :: entry_of(:)           !! (nn) entry of a node, 0: none
    integer, allocatable :: node(:)
    real(rp), allocatable :: mass(:, :)        !! (2, n_nodes) of the particles that touch, and of
                                               !! what of them is pushed [kg]; then over the node's
    real(rp), allocatable :: values(:, :)      !! (n_values, n_nodes) of all ranks, folded at walls
    real(rp), allocatable :: own(:, :)         !! (n_values, n_nodes) of this rank's particles
    real(rp), allocatable :: free(:, :)        !! (3, n_nodes) 1, or 0 where a wall holds the node
    real(rp), allocatable :: part(:)           !! of `v_hold` that friction can give
    real(rp), allocatable :: slip(:, :)        !! (3, n_nodes) mean velocity against the tool [m/s]
  contains
    procedure :: forget
    procedure :: add_node
    procedure :: add_particle_in_contact
    procedure :: prepare
    procedure :: spread
  end type tool_contact_t

contains

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
      if (size(self%mass, 2) /= self%n_nodes) deallocate (self%mass, self%values, self%own, &
                                                          self%free, self%part, self%slip)
    end if
    if (.not. allocated(self%mass)) allocate (self%mass(2, self%n_nodes), &
      self%values(n_values, self%n_nodes), self%own(n_values, self%n_nodes), &
      self%free(3, self%n_nodes), self%part(self%n_nodes), self%slip(3, self%n_nodes))
    self%mass = 0.0_rp
    self%values = 0.0_rp
    self%slip = 0.0_rp
    self%free = 1.0_rp
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

  !> What comes back to a particle of an even load on all that touch, and on all that are pushed.
  pure function returned(entry, weight, normal2, n, free, mass) result(s)
    integer, intent(in) :: entry(27), n
    real(rp), intent(in) :: weight(27), normal2(3), free(3, n), mass(2, n)
    real(rp) :: s(2), w
    integer :: i

    s = 0.0_rp
    do i = 1, 27
      if (entry(i) == 0) cycle
      w = weight(i)*(free(1, entry(i))*normal2(1) + free(2, entry(i))*normal2(2) &
                     + free(3, entry(i))*normal2(3))
      s = s + w*mass(:, entry(i))
    end do
  end function returned

  !> Add a particle's values to its nodes.
  pure subroutine add_values(entry, weight, own, n, values)
    integer, intent(in) :: entry(27), n
    real(rp), intent(in) :: weight(27), own(n_values)
    real(rp), intent(inout) :: values(n_values, n)
    integer :: i

    do i = 1, 27
      if (entry(i) > 0) values(:, entry(i)) = values(:, entry(i)) + weight(i)*own
    end do
  end subroutine add_values

end module tool_contact_lists
