! SPDX-License-Identifier: MIT
!> Node pairs: nodes with mass of two bodies with velocity fields of their own, listed in each step.
!> A node has an entry for every pair of bodies with mass on it; its entries lie side by side.
module body_contact_node_pairs
  use base_kinds, only: nlane, rp
  implicit none (type, external)
  private

  public :: near_t, node_pairs_t

  ! Sums of an entry: volume gradients of both bodies; moments of the particles of both.
  integer, parameter, public :: s_gradient = 1, s_moment = 7, n_sums_gradient = 6, n_sums_all = 20
  ! Directions to choose from; the last one is a mean over the nodes around.
  integer, parameter, public :: n_trials = 5
  ! A bundle: particles of a body with the same 27 nodes, and what their surface follows from:
  ! place, squares of half edges when they had the first stretch, stretch b (xx, yy, zz and twice
  ! xy, yz, xz), weights of the nodes along each axis.
  integer, parameter, public :: bundle_lanes = 8
  integer, parameter, public :: u_place = 1, u_edges = 4, u_stretch = 7, u_weights = 13, &
                                n_bundle = 21

  !> The particles with weight at entries, by the corner of the 27 nodes that they have weight at.
  type :: near_t
    integer :: n_corners = 0
    integer, allocatable :: corner(:)          !! (n_corners) node index
    integer, allocatable :: slot(:)            !! (nn) place of a node in this list; 0: none
    integer, allocatable :: last(:, :)         !! (bodies, n_corners) the last of its particles in
    integer, allocatable :: before(:)          !! a chain, and that before each; 0: none. A particle
                                               !! is (place of its block here - 1) nlane + lane
    integer :: n_blocks = 0                    !! of particles that may be near
    integer, allocatable :: block(:)           !! (n_blocks)
    integer, allocatable :: first(:, :)        !! (nlane, n_blocks) corners of their particles
    real(rp), allocatable :: w(:, :, :)        !! (nlane, 9, n_blocks) weights along the axes
    real(rp), allocatable :: longest(:)        !! (bodies) bound of half a particle's length [m]
    real(rp), allocatable :: gradient(:, :, :)   !! (8, nn, groups) volume gradients in lanes 5:7
                                                 !! [m2], right at the nodes of entries
    real(rp), allocatable :: heat(:, :)        !! (nn, groups) friction heat over mass [J/kg]
    logical, allocatable :: is_hot(:)          !! (nn) corners of nodes that get heat
    integer :: n_bundles = 0
    integer, allocatable :: bundle_of(:, :)    !! (bodies, n_corners) the first; 0: none yet
    integer, allocatable :: bundles_in(:, :)   !! (bodies, n_corners) how many follow it, it counts
    real(rp), allocatable :: bundle(:, :, :)   !! (bundle_lanes, n_bundle, n_bundles)
  contains
    procedure :: begin
    procedure :: add_block
    procedure :: add_bundle
  end type near_t

  type :: node_pairs_t
    integer :: n = 0
    logical :: is_known = .false.              !! found for the places the particles are at
    integer, allocatable :: first(:)           !! (nn) first entry of each node; 0: none
    integer, allocatable :: found(:, :)        !! (3, n or more) while entries are listed
    integer, allocatable :: node(:), pair(:)   !! (n) of each entry
    logical, allocatable :: is_owned(:)        !! its books are kept by this rank
    logical, allocatable :: is_shared(:)       !! other ranks or images have particles there
    integer, allocatable :: state(:)           !! is_apart, is_sliding or is_stuck, see contact_pair
    real(rp), allocatable :: x(:, :)           !! (3, n) place of the node [m]
    real(rp), allocatable :: free(:, :)        !! (3, n) 1, or 0 where a wall holds the node
    real(rp), allocatable :: sums(:, :)        !! (n_sums_gradient or n_sums_all, n)
    real(rp), allocatable :: trial(:, :, :)    !! (3, n_trials - 1, n) normals to choose from
    real(rp), allocatable :: mean(:, :)        !! (3, n) the last of them
    real(rp), allocatable :: surface(:, :, :)  !! (2, n_trials, n) both surfaces along them [m]
    real(rp), allocatable :: normal(:, :)      !! (3, n) out of the first body
    real(rp), allocatable :: ends(:, :)        !! (2, n) both surfaces along it: of the first body
                                               !! along, of the second against it [m]
    real(rp), allocatable :: gap(:)            !! [m]
    real(rp), allocatable :: heat(:)           !! friction heat over mass [J/kg]
    type(near_t) :: near
  contains
    procedure :: forget
    procedure :: reserve
    procedure :: place
  end type node_pairs_t

contains

  !> Empty the list; `nn` nodes of the patch, `bodies` in `groups`.
  pure subroutine begin(self, nn, bodies, groups)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: nn, bodies, groups
    logical :: fits

    fits = allocated(self%slot)
    if (fits) fits = size(self%slot) == nn
    if (fits) then
      self%slot(self%corner(1:self%n_corners)) = 0
    else
      if (allocated(self%slot)) deallocate (self%slot, self%corner, self%last, self%bundle_of, &
                                            self%bundles_in, self%gradient, self%longest, &
                                            self%heat, self%is_hot)
      allocate (self%slot(nn), source=0)
      allocate (self%corner(nn), self%last(bodies, nn), self%bundle_of(bodies, nn), &
                self%bundles_in(bodies, nn), self%longest(bodies))
      allocate (self%gradient(8, nn, groups), self%heat(nn, groups), source=0.0_rp)
      allocate (self%is_hot(nn), source=.false.)
    end if
    if (.not. allocated(self%block)) then
      allocate (self%block(1), self%first(nlane, 1), self%w(nlane, 9, 1), self%before(nlane), &
                self%bundle(bundle_lanes, n_bundle, 1))
    end if
    self%n_corners = 0
    self%n_blocks = 0
    self%n_bundles = 0
    self%longest = 0.0_rp
  end subroutine begin

  !> Another block, `b`; what belongs to it is to be filled in.
  pure subroutine add_block(self, b)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: b
    integer, allocatable :: block(:), first(:, :), before(:)
    real(rp), allocatable :: w(:, :, :)

    associate (n => self%n_blocks)
      if (n == size(self%block)) then
        allocate (block(2*n), first(nlane, 2*n), w(nlane, 9, 2*n), before(2*n*nlane))
        block(:n) = self%block
        first(:, :n) = self%first
        w(:, :, :n) = self%w
        before(:n*nlane) = self%before
        call move_alloc(block, self%block)
        call move_alloc(first, self%first)
        call move_alloc(w, self%w)
        call move_alloc(before, self%before)
      end if
      n = n + 1
      self%block(n) = b
    end associate
  end subroutine add_block

  !> Another bundle, of nothing that has weight.
  pure subroutine add_bundle(self)
    class(near_t), intent(inout) :: self
    real(rp), allocatable :: bundle(:, :, :)

    associate (n => self%n_bundles)
      if (n == size(self%bundle, 3)) then
        allocate (bundle(bundle_lanes, n_bundle, 2*n))
        bundle(:, :, :n) = self%bundle
        call move_alloc(bundle, self%bundle)
      end if
      n = n + 1
      self%bundle(:, :, n) = 0.0_rp
    end associate
  end subroutine add_bundle

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
      deallocate (self%node, self%pair, self%is_owned, self%is_shared, self%state, self%x, &
                  self%free, self%sums, self%trial, self%mean, self%surface, self%normal, &
                  self%ends, self%gap, self%heat)
    end if
    allocate (self%node(n), self%pair(n), self%is_owned(n), self%is_shared(n), self%state(n), &
              self%gap(n), self%heat(n), self%x(3, n), self%free(3, n), self%normal(3, n), &
              self%sums(width, n), self%trial(3, n_trials - 1, n), self%mean(3, n), &
              self%surface(2, n_trials, n), self%ends(2, n))
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
