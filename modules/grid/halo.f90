! SPDX-License-Identifier: MIT
!> Sums the records of nodes that several ranks touch.
!>
!> Every pair of ranks swaps its contributions to the nodes both store; each then adds them up in
!> the order of the ranks, its own among them, so that all copies of a node are equal to the bit.
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
    real(rp), allocatable :: own(:)                      !! own contributions while summing
    integer(i8) :: bytes = 0                             !! sent so far
    integer(i8) :: messages = 0
  contains
    procedure :: init
    procedure :: sum => sum_records
    procedure :: combine => combine_entries
  end type halo_t

contains

  !> Find the ranks whose patches overlap this one and the nodes shared with each.
  subroutine init(self, world, patch, boxes, active)
    class(halo_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:)
    type(box_t), intent(in) :: active          !! box of all nodes in use on any rank
    type(box_t) :: common, other
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
      common = patch%all%meet(other)
      common = common%meet(active)
      if (common%is_empty()) cycle
      self%n = self%n + 1
      associate (nb => self%neighbour(self%n))
        nb%rank = r
        nb%count = common%count()
        allocate (nb%node(nb%count))
        call list_nodes(patch, common, nb%node)
        is_shared(nb%node) = .true.
      end associate
    end do
    self%shared = pack([(i, i=1, patch%nn)], is_shared)
    call widen(self, 8)
  end subroutine init

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

  !> Storage indices of the nodes of `box`.
  pure subroutine list_nodes(patch, box, list)
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: box
    integer, intent(out) :: list(:)
    integer :: i, j, k, c

    c = 0
    do i = box%lo(1), box%hi(1)
      do j = box%lo(2), box%hi(2)
        do k = box%lo(3), box%hi(3)
          c = c + 1
          list(c) = patch%node([i, j, k])
        end do
      end do
    end do
  end subroutine list_nodes

  !> Replace the records of shared nodes by the sums over all ranks.
  subroutine sum_records(self, world, width, nn, g)
    class(halo_t), intent(inout), target :: self
    type(world_t), intent(in) :: world
    integer, intent(in) :: width, nn
    real(rp), intent(inout) :: g(width, nn)
    type(mpi_request) :: requests(2*self%n)
    integer :: i
    logical :: own_added

    if (self%n == 0) return
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
  end subroutine sum_records

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

  !> Sums over ranks (or maxima) of values kept for a few nodes only. The entries of node q are
  !> `first(q)` and those behind it with the same `node`; 0: none. All ranks that share a node must
  !> have the same entries there. Ranks that share no entry swap nothing.
  subroutine combine_entries(self, world, largest, nn, first, n, node, width, values)
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
  end subroutine combine_entries

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
