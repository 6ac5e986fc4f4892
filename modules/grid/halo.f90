! SPDX-License-Identifier: MIT
!> Sums of the records of nodes that several ranks store, or one rank through several images.
!>
!> A rank first adds the images of a node that it stores to the first of them. Every pair of ranks
!> then exchanges its contributions to their common nodes; each adds them in the order of the ranks,
!> including its own, and copies the sum to all images: all copies of a node are bitwise equal.
module grid_halo
  use base_kinds, only: i8, rp
  use base_timers, only: wall_time
  use base_world, only: world_t
  use grid_entries, only: entry_exchange_t
  use grid_geometry, only: box_t, patch_t, halo
  use grid_neighbours, only: common_lines, line_t, list_images, list_nodes, neighbour_t
  use mpi_f08, only: mpi_double_precision, mpi_irecv, mpi_isend, mpi_request, &
                     mpi_statuses_ignore, mpi_testall, mpi_waitall
  implicit none (type, external)
  private

  public :: halo_t

  !> Exchange of the nodes of one patch; `init` sets it up after every sort.
  type :: halo_t
    type(world_t) :: world                        !! ranks that exchange
    integer :: n = 0
    integer :: width = 0                                 !! reals per record that the buffers hold
    type(neighbour_t), allocatable :: neighbour(:)
    integer, allocatable :: shared(:)             !! all nodes shared with other ranks
    integer, allocatable :: image(:, :)           !! (2, n) image, first image of the same node
    real(rp), allocatable :: own(:)               !! this rank's contributions while summing
    type(mpi_request), allocatable :: request(:)  !! (2n) receives and sends
    integer(i8) :: bytes = 0                      !! bytes sent so far
    integer(i8) :: messages = 0                   !! messages sent so far
    real(rp) :: waited = 0.0_rp                   !! time spent waiting for other ranks [s]
    type(entry_exchange_t), private :: entries    !! exchange of values of a few nodes
  contains
    procedure :: init, mark_used, sum => sum_records, post, progress_messages, finish, combine
    procedure :: post_entries, entries_have_arrived, finish_entries
  end type halo_t

contains

  !> Find the ranks that store nodes of this patch, the nodes shared with each, and the images.
  subroutine init(self, world, patch, boxes, active)
    class(halo_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:)
    !> Box of the nodes in use on any rank; periodic axes ignore it.
    type(box_t), intent(in) :: active
    type(line_t) :: line(3)
    logical, allocatable :: is_shared(:)
    integer, allocatable :: others(:)
    integer :: r, i

    self%world = world
    allocate (others(0))
    do r = 0, world%size - 1
      if (r == world%rank .or. patch%nn == 0) cycle
      line = common_lines(patch, boxes(r)%grown(halo), active)
      if (all([(size(line(i)%i) > 0, i=1, 3)])) others = [others, r]
    end do
    self%n = size(others)
    if (allocated(self%neighbour)) deallocate (self%neighbour)
    allocate (self%neighbour(self%n))
    allocate (is_shared(patch%nn), source=.false.)
    do r = 1, self%n
      associate (nb => self%neighbour(r))
        nb%rank = others(r)
        line = common_lines(patch, boxes(nb%rank)%grown(halo), active)
        nb%count = product([(size(line(i)%i), i=1, 3)])
        allocate (nb%node(nb%count))
        call list_nodes(patch, line, nb%node)
        is_shared(nb%node) = .true.
      end associate
    end do
    self%shared = pack([(i, i=1, patch%nn)], is_shared)
    if (allocated(self%request)) deallocate (self%request)
    allocate (self%request(2*self%n))
    call list_images(patch, active, self%image)
    call widen(self, 8)
  end subroutine init

  !> Mark in `used` the nodes that must be in use (and cleared before a sum): the shared ones, and
  !> all images of a node in use. Images that are not in use are left out of the sums.
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

  !> Allocate buffers for records of `width` reals.
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

  !> Replace the records of shared nodes and of images by the sums over all ranks and images.
  subroutine sum_records(self, width, nn, g)
    class(halo_t), intent(inout) :: self
    integer, intent(in) :: width, nn
    real(rp), intent(inout) :: g(width, nn)

    call self%post(width, nn, g)
    call self%finish(width, nn, g)
  end subroutine sum_records

  !> Start the sum: this rank's contributions to the shared nodes and to all images are complete and
  !> are sent, those to `more` in the same message. Until `finish`, with the same arrays, only other
  !> nodes may be changed.
  subroutine post(self, width, nn, g, more)
    class(halo_t), intent(inout), asynchronous :: self
    integer, intent(in) :: width, nn
    real(rp), intent(inout) :: g(width, nn)
    real(rp), intent(inout), contiguous, optional :: more(:, :)   !! (reals of a node, nn)
    integer :: i, first, last, all

    all = width
    if (present(more)) all = all + size(more, 1)
    if (all > self%width) call widen(self, all)
    call reflect(width, size(self%image, 2), self%image, nn, g)
    if (present(more)) call reflect(size(more, 1), size(self%image, 2), self%image, nn, more)
    do i = 1, self%n
      associate (nb => self%neighbour(i))
        call mpi_irecv(nb%receive, all*nb%count, mpi_double_precision, nb%rank, 1, &
                       self%world%comm, self%request(2*i - 1))
        last = width*nb%count
        call gather(width, nb%count, nb%node, nn, g, nb%send(:last))
        first = last + 1
        last = all*nb%count
        if (present(more)) call gather(size(more, 1), nb%count, nb%node, nn, more, &
                                       nb%send(first:last))
        call mpi_isend(nb%send, all*nb%count, mpi_double_precision, nb%rank, 1, self%world%comm, &
                       self%request(2*i))
        self%bytes = self%bytes + 8_i8*all*nb%count
        self%messages = self%messages + 1
      end associate
    end do
  end subroutine post

  !> Test the pending messages, so that MPI implementations without asynchronous progress advance
  !> them.
  subroutine progress_messages(self)
    class(halo_t), intent(inout), asynchronous :: self
    logical :: done

    if (self%n > 0) call mpi_testall(2*self%n, self%request, done, mpi_statuses_ignore)
  end subroutine progress_messages

  !> Complete the sum started by `post`.
  subroutine finish(self, width, nn, g, more)
    class(halo_t), intent(inout), asynchronous :: self
    integer, intent(in) :: width, nn
    real(rp), intent(inout) :: g(width, nn)
    real(rp), intent(inout), contiguous, optional :: more(:, :)

    if (self%n > 0) then
      self%waited = self%waited - wall_time()
      call mpi_waitall(2*self%n, self%request, mpi_statuses_ignore)
      self%waited = self%waited + wall_time()
      call add_up(self, self%world%rank, width, 0, nn, g)
      if (present(more)) call add_up(self, self%world%rank, size(more, 1), width, nn, more)
    end if
    call restore(width, size(self%image, 2), self%image, nn, g)
    if (present(more)) call restore(size(more, 1), size(self%image, 2), self%image, nn, more)
  end subroutine finish

  !> Sum the contributions to the shared nodes in the order of the ranks; in the received messages
  !> they follow `before` reals per node.
  subroutine add_up(self, rank, width, before, nn, g)
    class(halo_t), intent(inout) :: self
    integer, intent(in) :: rank, width, before, nn
    real(rp), intent(inout) :: g(width, nn)
    integer :: i, first, last
    logical :: own_added

    call gather(width, size(self%shared), self%shared, nn, g, self%own)
    g(:, self%shared) = 0.0_rp
    own_added = .false.
    do i = 1, self%n
      associate (nb => self%neighbour(i))
        if (nb%rank > rank .and. .not. own_added) then
          call scatter_add(width, size(self%shared), self%shared, self%own, nn, g)
          own_added = .true.
        end if
        first = before*nb%count + 1
        last = (before + width)*nb%count
        call scatter_add(width, nb%count, nb%node, nb%receive(first:last), nn, g)
      end associate
    end do
    if (.not. own_added) call scatter_add(width, size(self%shared), self%shared, self%own, nn, g)
  end subroutine add_up

  !> Add every image to the first image of its node.
  pure subroutine reflect(width, n, image, nn, g)
    integer, intent(in) :: width, n, image(2, n), nn
    real(rp), intent(inout) :: g(width, nn)
    integer :: i

    do i = 1, n
      g(:, image(2, i)) = g(:, image(2, i)) + g(:, image(1, i))
    end do
  end subroutine reflect

  !> Copy the first image of every node to the others.
  pure subroutine restore(width, n, image, nn, g)
    integer, intent(in) :: width, n, image(2, n), nn
    real(rp), intent(inout) :: g(width, nn)
    integer :: i

    do i = 1, n
      g(:, image(1, i)) = g(:, image(2, i))
    end do
  end subroutine restore

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

  !> Sum over ranks and images (or take maxima of) values kept for a few nodes only (grid_entries).
  subroutine combine(self, largest, nn, first, n, node, width, values)
    class(halo_t), intent(inout) :: self
    logical, intent(in) :: largest                 !! maxima instead of sums
    integer, intent(in) :: nn, first(nn), n, node(n), width
    real(rp), intent(inout) :: values(width, n)

    call self%post_entries(largest, nn, first, n, node, width, values)
    call self%finish_entries(largest, n, width, values)
  end subroutine combine

  !> Start the sum over ranks and images of values kept for only a part of the nodes.
  !> `finish_entries` completes it; `entries_have_arrived` is true if that will not wait.
  subroutine post_entries(self, largest, nn, first, n, node, width, values)
    class(halo_t), intent(inout) :: self
    logical, intent(in) :: largest
    integer, intent(in) :: nn, first(nn), n, node(n), width
    real(rp), intent(inout) :: values(width, n)

    call self%entries%post(self%neighbour(:self%n), self%image, self%world, largest, nn, first, n, &
                        node, width, values)
  end subroutine post_entries

  logical function entries_have_arrived(self)
    class(halo_t), intent(inout) :: self

    entries_have_arrived = self%entries%progress_messages()
  end function entries_have_arrived

  subroutine finish_entries(self, largest, n, width, values)
    class(halo_t), intent(inout) :: self
    logical, intent(in) :: largest
    integer, intent(in) :: n, width
    real(rp), intent(inout) :: values(width, n)

    call self%entries%finish(self%neighbour(:self%n), self%world, largest, n, width, values, &
                             self%waited)
  end subroutine finish_entries

end module grid_halo
