! SPDX-License-Identifier: MIT
!> Sums and maxima over ranks of values kept for a small part of the nodes.
module grid_entries
  use base_kinds, only: rp
  use base_timers, only: wall_time
  use base_world, only: world_t
  use grid_neighbours, only: neighbour_t
  use mpi_f08, only: mpi_double_precision, mpi_irecv, mpi_isend, mpi_request, &
                     mpi_statuses_ignore, mpi_testall, mpi_waitall
  implicit none (type, external)
  private

  public :: entry_exchange_t

  !> Entries exchanged with one other rank.
  type :: message_t
    integer, allocatable :: entry(:)
    real(rp), allocatable :: send(:), receive(:)
  end type message_t

  !> Sums (or maxima) over ranks and images of values kept for a small part of the nodes. The
  !> entries of node q start at `first(q)` and continue with the same `node`; 0: none. All ranks
  !> that share a node, and all its images, must have the same entries there. Ranks that share no
  !> entry send no message.
  type :: entry_exchange_t
    private
    type(message_t), allocatable :: message(:)     !! messages to and from the neighbours
    type(mpi_request), allocatable :: request(:)
    integer :: messages = 0
    integer, allocatable :: pair(:, :)  !! (2, n) entry of an image, entry of the first image
  contains
    procedure :: post, progress_messages, finish
  end type entry_exchange_t

contains

  !> Reduce over images and start sending this rank's values to the others.
  subroutine post(self, neighbour, image, world, largest, nn, first, n, node, width, values)
    class(entry_exchange_t), intent(inout), asynchronous :: self
    type(neighbour_t), intent(in) :: neighbour(:)
    integer, intent(in) :: image(:, :)             !! (2, *) an image, the node's first image
    type(world_t), intent(in) :: world
    logical, intent(in) :: largest                 !! maxima instead of sums
    integer, intent(in) :: nn, first(nn), n, node(n), width
    real(rp), intent(inout) :: values(width, n)
    integer :: i

    call list_pairs(image, nn, first, n, node, self%pair)
    do i = 1, size(self%pair, 2)
      associate (one => self%pair(1, i), main => self%pair(2, i))
        if (largest) then
          values(:, main) = max(values(:, main), values(:, one))
        else
          values(:, main) = values(:, main) + values(:, one)
        end if
      end associate
    end do
    if (allocated(self%message)) deallocate (self%message, self%request)
    allocate (self%message(size(neighbour)), self%request(2*size(neighbour)))
    self%messages = 0
    do i = 1, size(neighbour)
      associate (p => self%message(i), rank => neighbour(i)%rank)
        call list_entries(neighbour(i), nn, first, n, node, p%entry)
        if (size(p%entry) == 0) cycle
        allocate (p%send(width*size(p%entry)), p%receive(width*size(p%entry)))
        p%send(:) = reshape(values(:, p%entry), shape(p%send))
        call mpi_irecv(p%receive, size(p%receive), mpi_double_precision, rank, 2, world%comm, &
                       self%request(self%messages + 1))
        call mpi_isend(p%send, size(p%send), mpi_double_precision, rank, 2, world%comm, &
                       self%request(self%messages + 2))
        self%messages = self%messages + 2
      end associate
    end do
  end subroutine post

  !> Test the pending messages; true if all have arrived.
  logical function progress_messages(self)
    class(entry_exchange_t), intent(inout), asynchronous :: self

    call mpi_testall(self%messages, self%request, progress_messages, mpi_statuses_ignore)
  end function progress_messages

  !> Complete the exchange started by `post`, with the same values.
  subroutine finish(self, neighbour, world, largest, n, width, values, waited)
    class(entry_exchange_t), intent(inout), asynchronous :: self
    type(neighbour_t), intent(in) :: neighbour(:)
    type(world_t), intent(in) :: world
    logical, intent(in) :: largest
    integer, intent(in) :: n, width
    real(rp), intent(inout) :: values(width, n)
    real(rp), intent(inout) :: waited              !! time spent waiting for other ranks [s]
    logical :: is_shared(n), own_added
    real(rp), allocatable :: own(:, :)
    integer :: i

    waited = waited - wall_time()
    call mpi_waitall(self%messages, self%request, mpi_statuses_ignore)
    waited = waited + wall_time()
    is_shared = .false.
    do i = 1, size(neighbour)
      is_shared(self%message(i)%entry) = .true.
    end do
    own_added = largest .or. size(neighbour) == 0
    if (.not. own_added) then
      allocate (own, source=values)
      do i = 1, n
        if (is_shared(i)) values(:, i) = 0.0_rp
      end do
    end if
    do i = 1, size(neighbour)
      if (neighbour(i)%rank > world%rank .and. .not. own_added) then
        call add_local(is_shared, own, values)
        own_added = .true.
      end if
      associate (p => self%message(i))
        if (size(p%entry) > 0) call unpack_entries(largest, width, size(p%entry), p%entry, &
                                                   p%receive, values)
      end associate
    end do
    if (.not. own_added) call add_local(is_shared, own, values)
    do i = 1, size(self%pair, 2)
      values(:, self%pair(1, i)) = values(:, self%pair(2, i))
    end do
  end subroutine finish

  !> Entries of images, and of the first images of the same nodes.
  pure subroutine list_pairs(image, nn, first, n, node, pair)
    integer, intent(in) :: image(:, :), nn, first(nn), n, node(n)
    integer, allocatable, intent(out) :: pair(:, :)
    integer :: all(2, n), c, e, i

    c = 0
    do i = 1, size(image, 2)
      e = first(image(1, i))
      if (e == 0) cycle
      do while (node(e) == image(1, i))
        c = c + 1
        all(:, c) = [e, first(image(2, i)) + e - first(image(1, i))]
        e = e + 1
        if (e > n) exit
      end do
    end do
    pair = all(:, :c)
  end subroutine list_pairs

  !> Entries of the nodes shared with a rank, in an order that is the same on both.
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

  !> Add received values, or take maxima.
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

  !> Add this rank's values to the shared entries.
  pure subroutine add_local(is_shared, own, values)
    logical, intent(in) :: is_shared(:)
    real(rp), intent(in) :: own(:, :)
    real(rp), intent(inout) :: values(:, :)
    integer :: e

    do e = 1, size(is_shared)
      if (is_shared(e)) values(:, e) = values(:, e) + own(:, e)
    end do
  end subroutine add_local

end module grid_entries
