! SPDX-License-Identifier: MIT
!> Node pairs: nodes with mass of two bodies with velocity fields of their own, listed in each step.
!> A node has an entry for every pair of bodies with mass on it; its entries lie side by side.
module body_contact_node_pairs
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: link_t, linked_t, links_t, node_pairs_t

  ! Sums of an entry: volume gradients of both bodies; moments of the particles of both.
  integer, parameter, public :: s_gradient = 1, s_moment = 7, n_sums_gradient = 6, n_sums_all = 20
  ! Directions to choose from; the last one is a mean over the nodes around.
  integer, parameter, public :: n_trials = 5

  !> A particle with links.
  type :: linked_t
    integer :: block = 0, lane = 0             !! where it is
    integer :: body = 0
    integer :: last = 0                        !! of its links, which follow those of the one before
    real(rp) :: x(3) = 0.0_rp                  !! [m]
    real(rp) :: edges(3) = 0.0_rp              !! of its domain when it had the first stretch [m]
    real(rp) :: stretch(6) = 0.0_rp            !! b: xx, yy, zz, xy, yz, xz
    real(rp) :: longest = 0.0_rp               !! bound of half its length in any direction [m]
  end type linked_t

  type :: link_t
    integer :: entry = 0
    integer :: side = 0                        !! 1 or 2 of the pair; 0: does not count for the gap
    real(rp) :: weight = 0.0_rp
  end type link_t

  type :: links_t
    integer :: n_particles = 0, n = 0
    type(linked_t), allocatable :: particle(:)
    type(link_t), allocatable :: link(:)
    logical, allocatable :: is_near(:)         !! (nn) corners of stencils with a node pair
  contains
    procedure :: reserve => reserve_links
  end type links_t

  type :: node_pairs_t
    integer :: n = 0
    logical :: is_known = .false.              !! found for the places the particles are at
    integer, allocatable :: first(:)           !! (nn) first entry of each node; 0: none
    integer, allocatable :: node(:), pair(:)   !! (n) of each entry
    logical, allocatable :: is_owned(:)        !! its books are kept by this rank
    integer, allocatable :: state(:)           !! is_apart, is_sliding or is_stuck, see contact_pair
    real(rp), allocatable :: x(:, :)           !! (3, n) place of the node [m]
    real(rp), allocatable :: free(:, :)        !! (3, n) 1, or 0 where a wall holds the node
    real(rp), allocatable :: sums(:, :)        !! (n_sums_gradient or n_sums_all, n)
    real(rp), allocatable :: trial(:, :, :)    !! (3, n_trials, n) normals to choose from
    real(rp), allocatable :: surface(:, :)     !! (2 n_trials, n) both surfaces along them [m]
    real(rp), allocatable :: normal(:, :)      !! (3, n) out of the first body
    real(rp), allocatable :: gap(:)            !! [m]
    real(rp), allocatable :: heat(:)           !! friction heat over mass [J/kg]
    type(links_t) :: links
  contains
    procedure :: forget
    procedure :: reserve
    procedure :: place
  end type node_pairs_t

contains

  !> Room for `particles` and `links` more.
  pure subroutine reserve_links(self, particles, links)
    class(links_t), intent(inout) :: self
    integer, intent(in) :: particles, links
    type(linked_t), allocatable :: particle(:)
    type(link_t), allocatable :: link(:)

    if (.not. allocated(self%link)) allocate (self%particle(particles), self%link(links))
    if (self%n_particles + particles > size(self%particle)) then
      allocate (particle(2*(self%n_particles + particles)))
      particle(:self%n_particles) = self%particle(:self%n_particles)
      call move_alloc(particle, self%particle)
    end if
    if (self%n + links > size(self%link)) then
      allocate (link(2*(self%n + links)))
      link(:self%n) = self%link(:self%n)
      call move_alloc(link, self%link)
    end if
  end subroutine reserve_links

  !> Empty the list; on a new patch of `nn` nodes make it.
  pure subroutine forget(self, nn)
    class(node_pairs_t), intent(inout) :: self
    integer, intent(in) :: nn

    if (allocated(self%first)) then
      if (size(self%first) /= nn) deallocate (self%first)
    end if
    if (allocated(self%first)) then
      self%first(self%node(1:self%n)) = 0
    else
      allocate (self%first(nn), source=0)
    end if
    self%n = 0
  end subroutine forget

  !> Storage for `n` entries with `width` sums.
  pure subroutine reserve(self, n, width)
    class(node_pairs_t), intent(inout) :: self
    integer, intent(in) :: n, width

    self%n = n
    if (allocated(self%node)) then
      if (size(self%node) == n) return
      deallocate (self%node, self%pair, self%is_owned, self%state, self%x, self%free, self%sums, &
                  self%trial, self%surface, self%normal, self%gap, self%heat)
    end if
    allocate (self%node(n), self%pair(n), self%is_owned(n), self%state(n), self%gap(n), &
              self%heat(n), self%x(3, n), self%free(3, n), self%normal(3, n), self%sums(width, n), &
              self%trial(3, n_trials, n), self%surface(2*n_trials, n))
  end subroutine reserve

  !> The entry of a pair at node `q`; 0 if there is none.
  pure integer function place(self, q, pair)
    class(node_pairs_t), intent(in) :: self
    integer, intent(in) :: q, pair

    place = self%first(q)
    if (place == 0) return
    do while (self%pair(place) /= pair)
      place = place + 1
      if (place > self%n) exit
      if (self%node(place) /= q) exit
    end do
    if (place > self%n) then
      place = 0
    else if (self%node(place) /= q) then
      place = 0
    end if
  end function place

end module body_contact_node_pairs
