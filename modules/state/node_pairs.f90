! SPDX-License-Identifier: MIT
!> Node pairs: nodes with mass of two bodies with velocity fields of their own, listed in each step.
!> A node has an entry for every pair of bodies with mass on it; its entries are contiguous.
module state_node_pairs
  use base_kinds, only: i8, rp
  use base_sort, only: order_of
  use base_system, only: allocate_aligned, free_aligned, resize_aligned
  use base_world, only: world_t
  implicit none (type, external)
  private

  public :: near_t, node_pairs_t

  ! Indices of the sums of an entry: volume gradients of both bodies; moments of the particles of
  ! both.
  integer, parameter, public :: s_gradient = 1, s_moment = 7, n_sums_gradient = 6, n_sums_all = 20
  ! Values of an entry that are kept between steps: identifier, normal, surfaces, path.
  integer, parameter, public :: n_kept = 7
  !> Smallest weight of a particle that counts for the gap.
  real(rp), parameter, public :: min_weight = 1.0e-6_rp
  ! Number of trial normals; the last one is a mean over the surrounding nodes.
  integer, parameter, public :: n_trials = 5
  ! A bundle: particles of a body with the same 27 nodes, and the data for their surface and the
  ! nodal sums: position, a symmetric tensor of their size (xx, yy, zz and twice xy, yz, xz),
  ! weights of the nodes along each axis, slopes of the weights times volume.
  integer, parameter, public :: bundle_lanes = 8
  integer, parameter, public :: u_place = 1, u_size = 4, u_weights = 10, u_slopes = 19, &
                                n_bundle = 27, n_box = 7

  integer :: i_, j_, k_
  !> Rows of the bundle, counted from the first row of weights (slopes), of the weights (slopes)
  !> along x, y, z of each of the 27 nodes.
  integer, parameter, public :: axis_rows(3, 27) = &
    reshape([(((i_, 3 + j_, 6 + k_, k_=0, 2), j_=0, 2), i_=0, 2)], [3, 27])

  !> Particles with weight at entries, in bundles by the corner of their 27 nodes.
  type :: near_t
    integer :: n_corners = 0
    integer, allocatable :: corner(:)          !! (n_corners) node index of each corner
    !> Last bundle at a corner; 0: none; -1: not a corner, (nn, bodies).
    integer, allocatable :: bin(:, :)
    integer :: n_bundles = 0
    integer, allocatable :: before(:)  !! previous bundle of the same bin; 0: none
    integer, allocatable :: filled(:)                         !! particles in each bundle
    integer, allocatable :: body(:)                           !! body of each bundle
    !> (bundle_lanes, n_bundle, n_bundles or more).
    real(rp), pointer, contiguous :: bundle(:, :, :) => null()
    real(rp), pointer, contiguous, private :: memory(:) => null()
    !> Lower and upper corner of the box around the centres of the particles of a bundle, upper
    !> bound of half their lengths [m], (n_box, n_bundles or more).
    real(rp), allocatable :: box(:, :)
    real(rp), allocatable :: heat(:, :)  !! (nn, groups) friction heat over mass [J/kg]
    logical, allocatable :: is_hot(:)    !! (nn) corners of nodes that receive heat
    integer :: n_items = 0               !! bundles with weight at entries, a list for each entry
    integer, allocatable :: item(:, :)   !! (2, n_items) bundle, place of the node in it
  contains
    procedure :: reset_near, bundle_for, add_item, free
  end type near_t

  type :: node_pairs_t
    integer :: n = 0
    logical :: averages_motion = .false.       !! half of a step moves with old velocities
    logical :: is_known = .false.              !! valid for the current particle positions
    integer, allocatable :: first(:)           !! (nn) first entry of each node; 0: none
    integer, allocatable :: found(:, :)        !! scratch array for listing entries
    integer, allocatable :: node(:), pair(:)   !! (n) node and contact of each entry
    logical, allocatable :: is_owned(:)        !! this rank records the entry
    real(rp), allocatable :: lightest(:)       !! (groups) mass of the lightest particle [kg]
    !> Stretches b at which the particles have their initial edges, (6, bodies).
    real(rp), allocatable :: start(:, :)
    !> The bodies of the entry have a &CONTACT and may have a finite gap.
    logical, allocatable :: may_touch(:)
    logical, allocatable :: is_shared(:)       !! other ranks or images contribute particles
    integer, allocatable :: state(:)           !! is_apart, is_sliding or is_stuck, see tools_pair
    real(rp), allocatable :: x(:, :)           !! (3, n) position of the node [m]
    real(rp), allocatable :: free(:, :)        !! (3, n) 1, or 0 where a wall holds the node
    real(rp), allocatable :: sums(:, :)        !! (n_sums_gradient or n_sums_all, n)
    real(rp), allocatable :: trial(:, :, :)    !! (3, n_trials - 1, n) trial normals
    !> Last trial normal, a mean over the surrounding nodes, (3, n).
    real(rp), allocatable :: mean(:, :)
    !> Positions of both surfaces along the trial normals [m], (2, n_trials, n).
    real(rp), allocatable :: surface(:, :, :)
    real(rp), allocatable :: normal(:, :)      !! (3, n) chosen normal, out of the first body
    !> Positions of both surfaces [m], of the first body along the normal, of the second against it,
    !> (2, n).
    real(rp), allocatable :: ends(:, :)
    real(rp), allocatable :: gap(:)            !! gap [m]
    !> Items of the first body lie behind the first of these indices and those of the second behind
    !> the second, (3, n).
    integer, allocatable :: item(:, :)
    integer, allocatable :: outermost(:, :)    !! (2, n) items with the outermost particles
    real(rp), allocatable :: heat(:, :)        !! (2, n) friction heat over mass of both [J/kg]
    logical, allocatable :: is_due(:)          !! the normal is found in this step
    real(rp), allocatable :: way(:)  !! (n) path of the bodies since the normal was found [m]
    !> Entries of the last step with a gap at nodes of this rank, in the order of their identifiers;
    !> after `gather_kept` at nodes of all ranks, (n_kept, n).
    real(rp), allocatable :: kept(:, :)
    type(near_t) :: near
  contains
    procedure :: reset, reserve, place, gather_kept
  end type node_pairs_t

contains

  !> Empty the list, for a patch of `nn` nodes and `bodies` in `groups`.
  subroutine reset_near(self, nn, bodies, groups)
    class(near_t), intent(inout) :: self
    integer, intent(in) :: nn, bodies, groups
    logical :: fits

    fits = allocated(self%bin)
    if (fits) fits = size(self%bin, 1) == nn
    if (fits) then
      self%bin(self%corner(1:self%n_corners), :) = -1
    else
      if (allocated(self%bin)) deallocate (self%bin, self%corner, self%heat, self%is_hot)
      allocate (self%corner(nn))
      allocate (self%bin(nn, bodies), source=-1)
      allocate (self%heat(nn, groups), source=0.0_rp)
      allocate (self%is_hot(nn), source=.false.)
    end if
    if (.not. allocated(self%before)) then
      allocate (self%before(1), self%filled(1), self%body(1), self%box(n_box, 1), self%item(2, 1))
      call allocate_aligned(int(bundle_lanes*n_bundle, i8), self%memory)
      self%bundle(1:bundle_lanes, 1:n_bundle, 1:1) => self%memory
    end if
    self%n_corners = 0
    self%n_bundles = 0
    self%n_items = 0
  end subroutine reset_near

  !> Find the bundle `u` for `m` more particles of a body at a corner, behind lane `l`; `m` is
  !> reduced to the number of free lanes.
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
      if (self%n_bundles == size(self%before)) call grow_bundles(self)
      self%n_bundles = self%n_bundles + 1
      self%before(self%n_bundles) = u
      u = self%n_bundles
      self%body(u) = body
      self%filled(u) = 0
      if (m < bundle_lanes) self%bundle(:, :, u) = 0.0_rp
      self%box(:, u) = [spread(huge(1.0_rp), 1, 3), spread(-huge(1.0_rp), 1, 3), 0.0_rp]
      self%bin(corner, body) = u
    end if
    l = self%filled(u)
    m = min(m, bundle_lanes - l)
    self%filled(u) = l + m
  end subroutine bundle_for

  !> Double the number of allocated bundles.
  subroutine grow_bundles(self)
    type(near_t), intent(inout) :: self
    integer, allocatable :: before(:), filled(:), body(:)
    real(rp), allocatable :: box(:, :)

    associate (n => size(self%before))
      allocate (before(2*n), filled(2*n), body(2*n))
      before(:n) = self%before
      filled(:n) = self%filled
      body(:n) = self%body
      allocate (box(n_box, 2*n))
      box(:, :n) = self%box
      call resize_aligned(2_i8*bundle_lanes*n_bundle*n, self%memory)
      self%bundle(1:bundle_lanes, 1:n_bundle, 1:2*n) => self%memory
    end associate
    call move_alloc(before, self%before)
    call move_alloc(filled, self%filled)
    call move_alloc(body, self%body)
    call move_alloc(box, self%box)
  end subroutine grow_bundles

  subroutine free(self)
    class(near_t), intent(inout) :: self

    call free_aligned(self%memory)
  end subroutine free

  !> Append an item: bundle `u` has the node at `place` among its 27.
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

  !> Empty the list; allocate it for a new patch of `nn` nodes.
  pure subroutine reset(self, nn)
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
  end subroutine reset

  !> Allocate `n` entries with `width` sums.
  pure subroutine reserve(self, n, width)
    class(node_pairs_t), intent(inout) :: self
    integer, intent(in) :: n, width

    self%n = n
    if (allocated(self%node)) then
      if (size(self%node) == n) return
      deallocate (self%node, self%pair, self%is_owned, self%may_touch, self%is_shared, self%state, &
                  self%x, self%free, self%sums, self%trial, self%mean, self%surface, self%normal, &
                  self%ends, self%gap, self%item, self%outermost, self%heat, self%is_due, &
                  self%way)
    end if
    allocate (self%node(n), self%pair(n), self%is_owned(n), self%may_touch(n), self%is_shared(n), &
              self%state(n), self%gap(n), self%heat(2, n), self%x(3, n), self%free(3, n), &
              self%normal(3, n), self%sums(width, n), self%trial(3, n_trials - 1, n), &
              self%mean(3, n), self%surface(2, n_trials, n), self%ends(2, n), self%item(3, n), &
              self%outermost(2, n), self%is_due(n), self%way(n))
  end subroutine reserve

  !> Entry of a pair at node `q`; 0 if there is none.
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

  !> Collective. Give the kept entries of all ranks to every rank, before the nodes get other
  !> owners.
  subroutine gather_kept(self, world)
    class(node_pairs_t), intent(inout) :: self
    type(world_t), intent(in) :: world

    self%kept = world%gather(self%kept)
    self%kept = self%kept(:, order_of(self%kept(:1, :)))
  end subroutine gather_kept

end module state_node_pairs
