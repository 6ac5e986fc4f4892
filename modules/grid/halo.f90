! SPDX-License-Identifier: MIT
!> Sums the records of nodes that several ranks touch, or one rank through several images.
!>
!> A rank first adds up the images that it stores of a node in the first of them. Every pair of
!> ranks then swaps its contributions to the nodes both store; each adds them up in the order of the
!> ranks, its own among them, and copies the sum to all images: all copies of a node are equal to
!> the bit.
module grid_halo
  use base_kinds, only: i8, rp
  use comm_world, only: world_t
  use grid_geometry, only: box_t, patch_t, halo
  use mpi_f08, only: mpi_double_precision, mpi_irecv, mpi_isend, mpi_request, &
                     mpi_statuses_ignore, mpi_waitall
  implicit none (type, external)
  private

  public :: halo_t

  !> What is swapped with one other rank.
  type :: neighbour_t
    integer :: rank = -1
    integer :: count = 0                                 !! shared active nodes
    integer, allocatable :: node(:)                      !! their storage indices
    real(rp), allocatable :: send(:), receive(:)         !! (width*count)
  end type neighbour_t

  !> Entries swapped with one other rank.
  type :: parcel_t
    integer, allocatable :: entry(:)
    real(rp), allocatable :: send(:), receive(:)
  end type parcel_t

  !> The exchange of one patch; `init` after every sort.
  type :: halo_t
    integer :: n = 0
    integer :: width = 0                                 !! reals of a record that buffers hold
    type(neighbour_t), allocatable :: neighbour(:)
    integer, allocatable :: shared(:)                    !! all nodes shared with anybody
    integer, allocatable :: image(:, :)                  !! (2, n) an image, the node's first image
    real(rp), allocatable :: own(:)                      !! own contributions while summing
    integer(i8) :: bytes = 0                             !! sent so far
    integer(i8) :: messages = 0
  contains
    procedure :: init
    procedure :: mark_used
    procedure :: sum => sum_records
    procedure :: combine => combine_entries
  end type halo_t

  !> Nodes along one axis.
  type :: line_t
    integer, allocatable :: i(:)
  end type line_t

contains

  !> Find the ranks that store nodes of this patch, the nodes shared with each, and the images.
  subroutine init(self, world, patch, boxes, active)
    class(halo_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:)
    type(box_t), intent(in) :: active  !! box of all nodes in use on any rank; it does not limit
                                       !! periodic axes
    type(line_t) :: line(3)
    type(box_t) :: other
    logical, allocatable :: is_shared(:)
    integer :: r, i

    self%n = 0
    if (allocated(self%neighbour)) deallocate (self%neighbour)
    allocate (self%neighbour(world%size))
    allocate (is_shared(patch%nn), source=.false.)
    do r = 0, world%size - 1
      if (r == world%rank .or. patch%nn == 0) cycle
      other = boxes(r)%grown(halo)
      if (other%is_empty()) cycle
      line = common_lines(patch, other, active)
      if (any([(size(line(i)%i) == 0, i=1, 3)])) cycle
      self%n = self%n + 1
      associate (nb => self%neighbour(self%n))
        nb%rank = r
        nb%count = product([(size(line(i)%i), i=1, 3)])
        allocate (nb%node(nb%count))
        call list_nodes(patch, line, nb%node)
        is_shared(nb%node) = .true.
      end associate
    end do
    self%shared = pack([(i, i=1, patch%nn)], is_shared)
    call list_images(patch, active, self%image)
    call widen(self, 8)
  end subroutine init

  !> Along each axis the first images in `patch` of the nodes that `other` stores as well, in the
  !> order of the nodes, which is the same for both.
  pure function common_lines(patch, other, active) result(line)
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: other, active
    type(line_t) :: line(3)
    type(box_t) :: common
    integer :: a, i

    common = patch%all%meet(other)
    common = common%meet(active)
    do a = 1, 3
      associate (n => patch%period(a), lo => patch%all%lo(a))
        if (n == 0) then
          line(a)%i = [(i, i=common%lo(a), common%hi(a))]
        else
          line(a)%i = [(lo + modulo(i - lo, n), i=0, n - 1)]
          line(a)%i = pack(line(a)%i, line(a)%i <= patch%all%hi(a) .and. &
                           other%lo(a) + modulo(line(a)%i - other%lo(a), n) <= other%hi(a))
        end if
      end associate
    end do
  end function common_lines

  !> Pairs of storage indices: every image that is not a node's first in the patch, and the first.
  pure subroutine list_images(patch, active, image)
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: active
    integer, allocatable, intent(out) :: image(:, :)
    type(line_t) :: line(3), first(3)
    integer, allocatable :: from(:), to(:)
    integer :: a, i

    allocate (image(2, 0))
    if (patch%nn == 0 .or. all(patch%period == 0)) return
    do a = 1, 3
      associate (n => patch%period(a), lo => patch%all%lo(a), hi => patch%all%hi(a))
        if (n == 0) then
          line(a)%i = [(i, i=max(lo, active%lo(a)), min(hi, active%hi(a)))]
          first(a)%i = line(a)%i
        else
          line(a)%i = [(i, i=lo, hi)]
          first(a)%i = lo + modulo(line(a)%i - lo, n)
        end if
      end associate
    end do
    allocate (from(product([(size(line(i)%i), i=1, 3)])))
    allocate (to(size(from)))
    call list_nodes(patch, line, from)
    call list_nodes(patch, first, to)
    image = transpose(reshape([pack(from, from /= to), pack(to, from /= to)], &
                              [count(from /= to), 2]))
  end subroutine list_images

  !> Mark the nodes that must be in use (cleared before a sum): the shared ones and all images of
  !> one in use. Images that are not in use are left out of the sums.
  pure subroutine mark_used(self, nn, used)
    class(halo_t), intent(inout) :: self
    integer, intent(in) :: nn
    logical, intent(inout) :: used(nn)
    integer, allocatable :: kept(:, :)
    integer :: i, n

    used(self%shared) = .true.
    do i = 1, size(self%image, 2)
      if (used(self%image(1, i))) used(self%image(2, i)) = .true.
    end do
    used(self%image(1, :)) = used(self%image(2, :))
    n = count(used(self%image(1, :)))
    allocate (kept(2, n))
    kept = reshape(pack(self%image, spread(used(self%image(1, :)), 1, 2)), [2, n])
    call move_alloc(kept, self%image)
  end subroutine mark_used

  !> Buffers for records of `width` reals.
  subroutine widen(self, width)
    class(halo_t), intent(inout) :: self
    integer, intent(in) :: width
    integer :: i

    self%width = width
    do i = 1, self%n
      associate (nb => self%neighbour(i))
        if (allocated(nb%send)) deallocate (nb%send, nb%receive)
        allocate (nb%send(width*nb%count), nb%receive(width*nb%count))
      end associate
    end do
    if (allocated(self%own)) deallocate (self%own)
    allocate (self%own(width*size(self%shared)))
  end subroutine widen

  !> Storage indices of the nodes in which `line` cross.
  pure subroutine list_nodes(patch, line, list)
    type(patch_t), intent(in) :: patch
    type(line_t), intent(in) :: line(3)
    integer, intent(out) :: list(:)
    integer :: i, j, k, c

    c = 0
    do i = 1, size(line(1)%i)
      do j = 1, size(line(2)%i)
        do k = 1, size(line(3)%i)
          c = c + 1
          list(c) = patch%node([line(1)%i(i), line(2)%i(j), line(3)%i(k)])
        end do
      end do
    end do
  end subroutine list_nodes

  !> Replace the records of shared nodes and of images by the sums over all ranks and images.
  subroutine sum_records(self, world, width, nn, g)
    class(halo_t), intent(inout), target :: self
    type(world_t), intent(in) :: world
    integer, intent(in) :: width, nn
    real(rp), intent(inout) :: g(width, nn)

    call fold(width, size(self%image, 2), self%image, nn, g)
    if (self%n > 0) call swap(self, world, width, nn, g)
    call unfold(width, size(self%image, 2), self%image, nn, g)
  end subroutine sum_records

  !> Replace the records of shared nodes by the sums over all ranks.
  subroutine swap(self, world, width, nn, g)
    class(halo_t), intent(inout), target :: self
    type(world_t), intent(in) :: world
    integer, intent(in) :: width, nn
    real(rp), intent(inout) :: g(width, nn)
    type(mpi_request) :: requests(2*self%n)
    integer :: i
    logical :: own_added

    if (width > self%width) call widen(self, width)
    do i = 1, self%n
      associate (nb => self%neighbour(i))
        call mpi_irecv(nb%receive, width*nb%count, mpi_double_precision, nb%rank, 1, world%comm, &
                       requests(2*i - 1))
        call gather(width, nb%count, nb%node, nn, g, nb%send)
        call mpi_isend(nb%send, width*nb%count, mpi_double_precision, nb%rank, 1, world%comm, &
                       requests(2*i))
        self%bytes = self%bytes + 8_i8*width*nb%count
        self%messages = self%messages + 1
      end associate
    end do
    call gather(width, size(self%shared), self%shared, nn, g, self%own)
    g(:, self%shared) = 0.0_rp
    call mpi_waitall(2*self%n, requests, mpi_statuses_ignore)
    own_added = .false.
    do i = 1, self%n
      associate (nb => self%neighbour(i))
        if (nb%rank > world%rank .and. .not. own_added) then
          call scatter_add(width, size(self%shared), self%shared, self%own, nn, g)
          own_added = .true.
        end if
        call scatter_add(width, nb%count, nb%node, nb%receive, nn, g)
      end associate
    end do
    if (.not. own_added) call scatter_add(width, size(self%shared), self%shared, self%own, nn, g)
  end subroutine swap

  !> Add every image to its node's first.
  pure subroutine fold(width, n, image, nn, g)
    integer, intent(in) :: width, n, image(2, n), nn
    real(rp), intent(inout) :: g(width, nn)
    integer :: i

    do i = 1, n
      g(:, image(2, i)) = g(:, image(2, i)) + g(:, image(1, i))
    end do
  end subroutine fold

  !> Copy every node's first image to the others.
  pure subroutine unfold(width, n, image, nn, g)
    integer, intent(in) :: width, n, image(2, n), nn
    real(rp), intent(inout) :: g(width, nn)
    integer :: i

    do i = 1, n
      g(:, image(1, i)) = g(:, image(2, i))
    end do
  end subroutine unfold

  pure subroutine gather(width, n, list, nn, g, buffer)
    integer, intent(in) :: width, n, list(n), nn
    real(rp), intent(in) :: g(width, nn)
    real(rp), intent(out) :: buffer(width, n)
    integer :: i

    do i = 1, n
      buffer(:, i) = g(:, list(i))
    end do
  end subroutine gather

  pure subroutine scatter_add(width, n, list, buffer, nn, g)
    integer, intent(in) :: width, n, list(n), nn
    real(rp), intent(in) :: buffer(width, n)
    real(rp), intent(inout) :: g(width, nn)
    integer :: i

    do i = 1, n
      g(:, list(i)) = g(:, list(i)) + buffer(:, i)
    end do
  end subroutine scatter_add

  !> Sums over ranks and images (or maxima) of values kept for a few nodes only. The entries of node
  !> q are `first(q)` and those behind it with the same `node`; 0: none. All ranks that share a
  !> node, and all its images, must have the same entries there. Ranks that share no entry swap
  !> nothing.
  subroutine combine_entries(self, world, largest, nn, first, n, node, width, values)
    class(halo_t), intent(in) :: self
    type(world_t), intent(in) :: world
    logical, intent(in) :: largest                 !! maxima instead of sums
    integer, intent(in) :: nn, first(nn), n, node(n), width
    real(rp), intent(inout) :: values(width, n)
    integer :: pairs(2, n)                         !! entry of an image, that of the first image
    integer :: c, e, i

    c = 0
    do i = 1, size(self%image, 2)
      e = first(self%image(1, i))
      if (e == 0) cycle
      do while (node(e) == self%image(1, i))
        c = c + 1
        pairs(:, c) = [e, first(self%image(2, i)) + e - first(self%image(1, i))]
        e = e + 1
        if (e > n) exit
      end do
    end do
    do i = 1, c
      if (largest) then
        values(:, pairs(2, i)) = max(values(:, pairs(2, i)), values(:, pairs(1, i)))
      else
        values(:, pairs(2, i)) = values(:, pairs(2, i)) + values(:, pairs(1, i))
      end if
    end do
    if (self%n > 0) call swap_entries(self, world, largest, nn, first, n, node, width, values)
    do i = 1, c
      values(:, pairs(1, i)) = values(:, pairs(2, i))
    end do
  end subroutine combine_entries

  !> Sums over ranks (or maxima) of the entries of shared nodes.
  subroutine swap_entries(self, world, largest, nn, first, n, node, width, values)
    class(halo_t), intent(in) :: self
    type(world_t), intent(in) :: world
    logical, intent(in) :: largest                 !! maxima instead of sums
    integer, intent(in) :: nn, first(nn), n, node(n), width
    real(rp), intent(inout) :: values(width, n)
    type(parcel_t) :: parcel(self%n)
    type(mpi_request) :: requests(2*self%n)
    logical :: is_shared(n), own_added
    real(rp), allocatable :: own(:, :)
    integer :: i, messages

    messages = 0
    is_shared = .false.
    do i = 1, self%n
      associate (p => parcel(i), rank => self%neighbour(i)%rank)
        call list_entries(self%neighbour(i), nn, first, n, node, p%entry)
        if (size(p%entry) == 0) cycle
        is_shared(p%entry) = .true.
        allocate (p%send(width*size(p%entry)), p%receive(width*size(p%entry)))
        p%send(:) = reshape(values(:, p%entry), shape(p%send))
        call mpi_irecv(p%receive, size(p%receive), mpi_double_precision, rank, 2, world%comm, &
                       requests(messages + 1))
        call mpi_isend(p%send, size(p%send), mpi_double_precision, rank, 2, world%comm, &
                       requests(messages + 2))
        messages = messages + 2
      end associate
    end do
    call mpi_waitall(messages, requests, mpi_statuses_ignore)
    own_added = largest
    if (.not. largest) then
      allocate (own, source=values)
      do i = 1, n
        if (is_shared(i)) values(:, i) = 0.0_rp
      end do
    end if
    do i = 1, self%n
      if (self%neighbour(i)%rank > world%rank .and. .not. own_added) then
        call add_own(is_shared, own, values)
        own_added = .true.
      end if
      if (size(parcel(i)%entry) > 0) call unpack_entries(largest, width, size(parcel(i)%entry), &
        parcel(i)%entry, parcel(i)%receive, values)
    end do
    if (.not. own_added) call add_own(is_shared, own, values)
  end subroutine swap_entries

  !> Entries of the nodes shared with a rank, in an order that both know.
  pure subroutine list_entries(neighbour, nn, first, n, node, entry)
    type(neighbour_t), intent(in) :: neighbour
    integer, intent(in) :: nn, first(nn), n, node(n)
    integer, allocatable, intent(out) :: entry(:)
    integer :: c, e, k, pass

    do pass = 1, 2
      c = 0
      do k = 1, neighbour%count
        e = first(neighbour%node(k))
        if (e == 0) cycle
        do while (node(e) == neighbour%node(k))
          c = c + 1
          if (pass == 2) entry(c) = e
          e = e + 1
          if (e > n) exit
        end do
      end do
      if (pass == 1) allocate (entry(c))
    end do
  end subroutine list_entries

  pure subroutine unpack_entries(largest, width, n, entry, received, values)
    logical, intent(in) :: largest
    integer, intent(in) :: width, n, entry(n)
    real(rp), intent(in) :: received(width, n)
    real(rp), intent(inout) :: values(:, :)
    integer :: i

    do i = 1, n
      if (largest) then
        values(:, entry(i)) = max(values(:, entry(i)), received(:, i))
      else
        values(:, entry(i)) = values(:, entry(i)) + received(:, i)
      end if
    end do
  end subroutine unpack_entries

  pure subroutine add_own(is_shared, own, values)
    logical, intent(in) :: is_shared(:)
    real(rp), intent(in) :: own(:, :)
    real(rp), intent(inout) :: values(:, :)
    integer :: e

    do e = 1, size(is_shared)
      if (is_shared(e)) values(:, e) = values(:, e) + own(:, e)
    end do
  end subroutine add_own

end module grid_halo
