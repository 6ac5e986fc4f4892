! SPDX-License-Identifier: MIT
!> Node pairs: nodes with mass of two bodies with velocity fields of their own, listed in each step.
!> A node has an entry for every pair of bodies with mass on it; its entries lie side by side.
module body_contact_node_pairs
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned, free_aligned, resize_aligned
  implicit none (type, external)
  private

  public :: near_t, node_pairs_t

  ! Sums of an entry: volume gradients of both bodies; moments of the particles of both.
  integer, parameter, public :: s_gradient = 1, s_moment = 7, n_sums_gradient = 6, n_sums_all = 20
  real(rp), parameter, public :: least_weight = 1.0e-6_rp   !! of a particle that counts for the gap
  ! Directions to choose from; the last one is a mean over the nodes around.
  integer, parameter, public :: n_trials = 5
  ! A bundle: particles of a body with the same 27 nodes, and what their surface and the sums at the
  ! nodes follow from: place, a symmetric tensor for their size (xx, yy, zz and twice xy, yz, xz),
  ! weights of the nodes along each axis, slopes of the weights times volume.
  integer, parameter, public :: bundle_lanes = 8
  integer, parameter, public :: u_place = 1, u_size = 4, u_weights = 10, u_slopes = 19, &
                                n_bundle = 27

  integer :: i_, j_, k_
  !> Where the weights (slopes) along x, y, z of the node at each place of the 27 are, behind the
  !> first.
  integer, parameter, public :: axis_rows(3, 27) = &
    reshape([(((i_, 3 + j_, 6 + k_, k_=0, 2), j_=0, 2), i_=0, 2)], [3, 27])

  !> The particles with weight at entries, in bundles by the corner of the 27 nodes that they have
  !> weight at.
  type :: near_t
    integer :: n_corners = 0
    integer, allocatable :: corner(:)          !! (n_corners) node index
    integer, allocatable :: bin(:, :)          !! (nn, bodies) last bundle at a corner; 0: none;
                                               !! elsewhere -1
    integer :: n_bundles = 0
    integer, allocatable :: before(:)          !! bundle of the same bin before each; 0: none
    integer, allocatable :: filled(:)          !! particles in each
    integer, allocatable :: body(:)            !! theirs
    real(rp), pointer, contiguous :: bundle(:, :, :) => null()   !! (bundle_lanes, n_bundle,
                                                                 !! n_bundles or more)
    real(rp), pointer, contiguous, private :: memory(:) => null()
    real(rp), allocatable :: longest(:)        !! (bodies) bound of half a particle's length [m]
    integer :: n_blocks = 0                    !! of particles that may be near, if there is heat
    integer, allocatable :: block(:)           !! (n_blocks)
    integer, allocatable :: first(:, :)        !! (nlane, n_blocks) corners of their particles
    real(rp), allocatable :: w(:, :, :)        !! (nlane, 9, n_blocks) weights along the axes
    real(rp), allocatable :: heat(:, :)        !! (nn, groups) friction heat over mass [J/kg]
    logical, allocatable :: is_hot(:)          !! (nn) corners of nodes that get heat
    integer :: n_items = 0                     !! bundles with weight at entries, a list for each
    integer, allocatable :: item(:, :)         !! (2, n_items) bundle, place of the node in it
  contains
    procedure :: begin
    procedure :: add_block
    procedure :: bundle_for
    procedure :: add_item
    procedure :: free
  end type near_t

  type :: node_pairs_t
    integer :: n = 0
    logical :: is_known = .false.              !! found for the places the particles are at
    integer, allocatable :: first(:)           !! (nn) first entry of each node; 0: none
    integer, allocatable :: found(:, :)        !! (3, n or more) while entries are listed
    integer, allocatable :: node(:), pair(:)   !! (n) of each entry
    logical, allocatable :: is_owned(:)        !! its books are kept by this rank
    real(rp), allocatable :: lightest(:)       !! (groups) mass of their lightest particle [kg]
    logical, allocatable :: is_met(:)          !! bodies with a &CONTACT may have a finite gap
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
    integer, allocatable :: item(:, :)         !! (3, n) the first body's items begin behind the
                                               !! first, the second's behind the second of these
    integer, allocatable :: foremost(:, :)     !! (2, n) items with the surfaces' particles
    real(rp), allocatable :: heat(:, :)        !! (2, n) friction heat over mass of both [J/kg]
    type(near_t) :: near
  contains
    procedure :: forget
    procedure :: reserve
    procedure :: place
  end type node_pairs_t

contains

  !> Empty the list; `nn` nodes of the patch, `bodies` in `groups`.
  subroutine begin(self, nn, bodies, groups)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: nn, bodies, groups
    logical :: fits

    fits = allocated(self%bin)
    if (fits) fits = size(self%bin, 1) == nn
    if (fits) then
      self%bin(self%corner(1:self%n_corners), :) = -1
      self%is_hot(self%corner(1:self%n_corners)) = .false.
    else
      if (allocated(self%bin)) deallocate (self%bin, self%corner, self%longest, self%heat, &
                                           self%is_hot)
      allocate (self%corner(nn), self%longest(bodies))
      allocate (self%bin(nn, bodies), source=-1)
      allocate (self%heat(nn, groups), source=0.0_rp)
      allocate (self%is_hot(nn), source=.false.)
    end if
    if (.not. allocated(self%block)) then
      allocate (self%block(1), self%first(nlane, 1), self%w(nlane, 9, 1), self%before(1), &
                self%filled(1), self%body(1), self%item(2, 1))
      call allocate_aligned(int(bundle_lanes*n_bundle, i8), self%memory)
      self%bundle(1:bundle_lanes, 1:n_bundle, 1:1) => self%memory
    end if
    self%n_corners = 0
    self%n_blocks = 0
    self%n_bundles = 0
    self%n_items = 0
    self%longest = 0.0_rp
  end subroutine begin

  !> Another block, `b`, with the corners and weights of its particles.
  pure subroutine add_block(self, b, first, w)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: b, first(nlane)
    real(rp), intent(in) :: w(nlane, 9)
    integer, allocatable :: block(:), corners(:, :)
    real(rp), allocatable :: weights(:, :, :)

    associate (n => self%n_blocks)
      if (n == size(self%block)) then
        allocate (block(2*n), corners(nlane, 2*n), weights(nlane, 9, 2*n))
        block(:n) = self%block
        corners(:, :n) = self%first
        weights(:, :, :n) = self%w
        call move_alloc(block, self%block)
        call move_alloc(corners, self%first)
        call move_alloc(weights, self%w)
      end if
      n = n + 1
      self%block(n) = b
      self%first(:, n) = first
      self%w(:, :, n) = w
    end associate
  end subroutine add_block

  !> The bundle `u` for `m` more particles of a body at a corner, behind lane `l`; `m` becomes the
  !> number of those it has room for.
  subroutine bundle_for(self, body, corner, m, u, l)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: body, corner
    integer, intent(inout) :: m
    integer, intent(out) :: u, l
    logical :: is_full

    u = self%bin(corner, body)
    is_full = u == 0
    if (u > 0) is_full = self%filled(u) == bundle_lanes
    if (is_full) then
      if (self%n_bundles == size(self%before)) call lengthen(self)
      self%n_bundles = self%n_bundles + 1
      self%before(self%n_bundles) = u
      u = self%n_bundles
      self%body(u) = body
      self%filled(u) = 0
      self%bundle(:, :, u) = 0.0_rp
      self%bin(corner, body) = u
    end if
    l = self%filled(u)
    m = min(m, bundle_lanes - l)
    self%filled(u) = l + m
  end subroutine bundle_for

  !> Room for twice as many bundles.
  subroutine lengthen(self)
    type(near_t), intent(inout) :: self
    integer, allocatable :: before(:), filled(:), body(:)

    associate (n => size(self%before))
      allocate (before(2*n), filled(2*n), body(2*n))
      before(:n) = self%before
      filled(:n) = self%filled
      body(:n) = self%body
      call resize_aligned(2_i8*bundle_lanes*n_bundle*n, self%memory)
      self%bundle(1:bundle_lanes, 1:n_bundle, 1:2*n) => self%memory
    end associate
    call move_alloc(before, self%before)
    call move_alloc(filled, self%filled)
    call move_alloc(body, self%body)
  end subroutine lengthen

  subroutine free(self)
    class(near_t), intent(inout) :: self

    call free_aligned(self%memory)
  end subroutine free

  !> Another item: bundle `u` has the node at `place` among its 27.
  pure subroutine add_item(self, u, place)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: u, place
    integer, allocatable :: item(:, :)

    associate (n => self%n_items)
      if (n == size(self%item, 2)) then
        allocate (item(2, 2*n))
        item(:, :n) = self%item
        call move_alloc(item, self%item)
      end if
      n = n + 1
      self%item(1, n) = u
      self%item(2, n) = place
    end associate
  end subroutine add_item

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
      deallocate (self%node, self%pair, self%is_owned, self%is_met, self%is_shared, self%state, &
                  self%x, self%free, self%sums, self%trial, self%mean, self%surface, self%normal, &
                  self%ends, self%gap, self%item, self%foremost, self%heat)
    end if
    allocate (self%node(n), self%pair(n), self%is_owned(n), self%is_met(n), self%is_shared(n), &
              self%state(n), self%gap(n), self%heat(2, n), self%x(3, n), self%free(3, n), &
              self%normal(3, n), self%sums(width, n), self%trial(3, n_trials - 1, n), &
              self%mean(3, n), self%surface(2, n_trials, n), self%ends(2, n), self%item(3, n), &
              self%foremost(2, n))
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
