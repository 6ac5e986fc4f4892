! SPDX-License-Identifier: MIT
!> Migration of particles to the rank that owns their nearest node, and sorting.
module particles_migrate
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use base_world, only: world_t
  use grid_geometry, only: box_t, grid_t, halo, nearest_node, patch_t, storage_nodes, wrap
  use grid_partition, only: owner_of
  use mpi_f08, only: mpi_alltoall, mpi_alltoallv, mpi_double_precision, mpi_integer
  use particles_sort, only: slot_block, slot_lane, sort_first, sort_particles
  use particles_store, only: awake, f_pos, f_vel, particles_t, tag_id, tag_rest
  implicit none (type, external)
  private

  public :: redistribute, wrap_positions, find_outside, is_outside

contains

  !> Move all particles that left through a periodic side by whole periods.
  subroutine wrap_positions(grid, particles)
    type(grid_t), intent(in) :: grid
    type(particles_t), intent(inout) :: particles
    real(rp) :: x(3)
    integer :: b, p

    if (all(grid%period == 0)) return
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        x = particles%ps(p, f_pos:f_pos + 2, b)
        call wrap(grid, x)
        particles%ps(p, f_pos:f_pos + 2, b) = x
      end do
    end do
  end subroutine wrap_positions

  !> Migrate and sort. Every particle must lie inside the grid (see `find_outside`), wrapped.
  !> Particles in blocks behind `n_moving` have not moved since they were sorted. `keep`: rest state
  !> from which particles keep their slots (particles_sort); `has_changed`: particles have changed
  !> their rest state; `rest_stays`: the blocks behind `n_moving` are unchanged.
  subroutine redistribute(world, grid, patch, boxes, nbody, n_moving, keep, has_changed, &
                          particles, rest_stays)
    type(world_t), intent(in) :: world
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:)
    integer, intent(in) :: nbody, n_moving, keep
    logical, intent(in) :: has_changed
    type(particles_t), intent(inout) :: particles
    logical, intent(out) :: rest_stays
    integer, allocatable, dimension(:) :: slot, node, body, owner, slot2, node2, body2
    logical :: may_stay
    integer :: n

    rest_stays = n_moving < particles%nblk .and. .not. has_changed
    may_stay = keep <= awake .and. .not. has_changed
    if (world%size == 1 .and. may_stay) return
    call locate(world, grid, patch, boxes, 1, n_moving, particles, slot, node, body, owner)
    n = size(slot)
    if (world%size > 1) call exchange(world, grid, patch, particles, slot, node, body, owner)
    if (may_stay .and. size(slot) == n .and. all(owner == world%rank)) return
    call keep_own(world%rank, slot, node, body, owner)
    if (n_moving < particles%nblk) then
      if (rest_stays) rest_stays = fit_in(particles, slot, body, nbody, n_moving)
      if (rest_stays) then
        call sort_first(particles, n_moving, slot, node, body, keep, patch%nn, nbody)
        return
      end if
      if (keep > awake) then
        call locate(world, grid, patch, boxes, n_moving + 1, particles%nblk, particles, slot2, &
                    node2, body2, owner)
      else                                       ! particles that wake may need blocks anywhere
        call list_slots(particles, n_moving + 1, particles%nblk, slot2, body2)
        allocate (node2(size(slot2)), source=1)
      end if
      slot = [slot, slot2]
      node = [node, node2]
      body = [body, body2]
    end if
    call sort_particles(particles, size(slot), slot, node, body, keep, patch%nn, nbody)
  end subroutine redistribute

  !> Remove particles owned by other ranks from the lists of slots, nodes and bodies.
  pure subroutine keep_own(rank, slot, node, body, owner)
    integer, intent(in) :: rank, owner(:)
    integer, allocatable, intent(inout) :: slot(:), node(:), body(:)

    if (all(owner == rank)) return
    slot = pack(slot, owner == rank)
    node = pack(node, owner == rank)
    body = pack(body, owner == rank)
  end subroutine keep_own

  !> True if the listed particles are all awake and fit into the first `n_moving` blocks.
  pure logical function fit_in(particles, slot, body, nbody, n_moving)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: slot(:), body(:), nbody, n_moving
    integer :: i, k, b(nbody), n(nbody)

    n = 0
    fit_in = .false.
    do i = 1, size(slot)
      if (tag_rest(particles%tag(slot_lane(slot(i)), slot_block(slot(i)))) /= awake) return
      n(body(i)) = n(body(i)) + 1
    end do
    b = [(count(particles%body(:n_moving) == k), k=1, nbody)]
    fit_in = all((n + nlane - 1)/nlane == b)
  end function fit_in

  !> Slot, nearest node (storage index), body and owner of every particle in blocks `low` to `high`.
  subroutine locate(world, grid, patch, boxes, low, high, particles, slot, node, body, owner)
    type(world_t), intent(in) :: world
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:)
    integer, intent(in) :: low, high
    type(particles_t), intent(in) :: particles
    integer, allocatable, intent(out) :: slot(:), node(:), body(:), owner(:)
    integer :: b, c, n, near(nlane), p
    logical :: is_own(nlane)

    call list_slots(particles, low, high, slot, body)
    allocate (node(size(slot)), owner(size(slot)))
    c = 0
    do b = low, high
      n = particles%count(b)
      call storage_nodes(grid, patch, nlane, particles%ps(:, f_pos:f_pos + 2, b), near, is_own)
      node(c + 1:c + n) = near(:n)
      owner(c + 1:c + n) = world%rank
      do p = 1, n
        if (.not. is_own(p)) owner(c + p) = &
          owner_of(boxes, nearest_node(grid, particles%ps(p, f_pos:f_pos + 2, b)))
      end do
      c = c + n
    end do
  end subroutine locate

  !> Slot and body of every particle in blocks `low` to `high`.
  pure subroutine list_slots(particles, low, high, slot, body)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: low, high
    integer, allocatable, intent(out) :: slot(:), body(:)
    integer :: b, c, p

    c = sum(particles%count(low:high))
    allocate (slot(c), body(c))
    c = 0
    do b = low, high
      associate (n => particles%count(b))
        slot(c + 1:c + n) = [(nlane*(b - 1) + p - 1, p=1, n)]
        body(c + 1:c + n) = particles%body(b)
        c = c + n
      end associate
    end do
  end subroutine list_slots

  !> Send particles to their owners; append arrivals behind the last block and to the lists.
  subroutine exchange(world, grid, patch, particles, slot, node, body, owner)
    type(world_t), intent(in) :: world
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(particles_t), intent(inout) :: particles
    integer, allocatable, intent(inout) :: slot(:), node(:), body(:), owner(:)
    integer, dimension(0:world%size - 1) :: n_out, n_in, at_out, at_in, place
    real(rp), allocatable :: outgoing(:), incoming(:)
    integer :: i, r, width, arrivals

    width = particles%nf + 2
    n_out = 0
    do i = 1, size(slot)
      if (owner(i) /= world%rank) n_out(owner(i)) = n_out(owner(i)) + width
    end do
    call mpi_alltoall(n_out, 1, mpi_integer, n_in, 1, mpi_integer, world%comm)
    at_out(0) = 0
    at_in(0) = 0
    do r = 1, world%size - 1
      at_out(r) = at_out(r - 1) + n_out(r - 1)
      at_in(r) = at_in(r - 1) + n_in(r - 1)
    end do
    allocate (outgoing(max(1, sum(n_out))), incoming(max(1, sum(n_in))))
    place = at_out
    do i = 1, size(slot)
      r = owner(i)
      if (r == world%rank) cycle
      call pack_particle(particles, slot(i), body(i), outgoing(place(r) + 1:place(r) + width))
      place(r) = place(r) + width
    end do
    call mpi_alltoallv(outgoing, n_out, at_out, mpi_double_precision, &
                       incoming, n_in, at_in, mpi_double_precision, world%comm)
    deallocate (outgoing)                        ! free memory before allocating the arrivals
    arrivals = sum(n_in)/width
    call append_arrivals(world, grid, patch, particles, arrivals, width, incoming, &
                         slot, node, body, owner)
  end subroutine exchange

  !> Pack a particle as reals: fields, tag (its bits), body.
  subroutine pack_particle(particles, s, body, buffer)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: s, body
    real(rp), intent(out) :: buffer(:)
    integer :: nf

    nf = particles%nf
    buffer(1:nf) = particles%ps(slot_lane(s), :, slot_block(s))
    buffer(nf + 1) = transfer(particles%tag(slot_lane(s), slot_block(s)), 0.0_rp)
    buffer(nf + 2) = real(body, rp)
  end subroutine pack_particle

  !> Append received particles behind the last block and to the lists.
  subroutine append_arrivals(world, grid, patch, particles, n, width, incoming, &
                             slot, node, body, owner)
    type(world_t), intent(in) :: world
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: n, width
    real(rp), intent(in) :: incoming(width, *)
    integer, allocatable, intent(inout) :: slot(:), node(:), body(:), owner(:)
    integer :: first, old, i, s

    old = size(slot)
    first = particles%nblk*size(particles%ps, 1)
    call particles%reserve(slot_block(first + max(0, n - 1)))
    slot = [slot, (first + i - 1, i=1, n)]
    owner = [owner, (world%rank, i=1, n)]
    body = [body, (nint(incoming(width, i)), i=1, n)]
    node = [node, (0, i=1, n)]
    do i = 1, n
      s = first + i - 1
      particles%ps(slot_lane(s), :, slot_block(s)) = incoming(1:width - 2, i)
      particles%tag(slot_lane(s), slot_block(s)) = transfer(incoming(width - 1, i), 0_i8)
      node(old + i) = patch%node(nearest_node(grid, incoming(f_pos:f_pos + 2, i)))
    end do
  end subroutine append_arrivals

  !> True for particles of block `b` outside the grid or with NaN. Beyond a periodic side they may
  !> be as far outside as a patch reaches.
  pure function is_outside(grid, particles, b)
    type(grid_t), intent(in) :: grid
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b
    logical :: is_outside(nlane)
    real(rp) :: low(3), margin(3), top(3)
    integer :: p

    margin = merge(halo*grid%h, 0.0_rp, grid%period > 0)
    low = grid%lower - margin
    top = grid%upper() + margin
    is_outside = .false.
    do p = 1, particles%count(b)
      associate (x => particles%ps(p, f_pos:f_pos + 2, b))
        is_outside(p) = .not. all(x >= low .and. x <= top)   ! true for NaN
      end associate
    end do
  end function is_outside

  !> Message on the first particle outside the grid or with NaN in the first `n_blocks`; '' if there
  !> is none.
  function find_outside(grid, n_blocks, particles) result(message)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_blocks
    type(particles_t), intent(in) :: particles
    character(:), allocatable :: message
    integer :: b, p

    message = ''
    do b = 1, n_blocks
      p = findloc(is_outside(grid, particles, b), .true., 1)
      if (p == 0) cycle
      associate (x => particles%ps(p, f_pos:f_pos + 2, b), &
                 v => particles%ps(p, f_vel:f_vel + 2, b))
        message = 'particle '//str(tag_id(particles%tag(p, b)))//' left the grid at ('// &
                  str(x(1))//', '//str(x(2))//', '//str(x(3))//') m with velocity ('// &
                  str(v(1))//', '//str(v(2))//', '//str(v(3))//') m/s'
      end associate
      return
    end do
  end function find_outside

end module particles_migrate
