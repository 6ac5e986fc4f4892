! SPDX-License-Identifier: MIT
!> Sorting of particles into blocks by rest state, body and nearest node, so that a block touches
!> few nodes.
module particles_sort
  use base_kinds, only: i8, nlane, rp
  use particles_store, only: f_bbar, f_jac, f_pos, f_temp, n_fields, particles_t, tag_rest
  implicit none (type, external)
  private

  public :: sort_particles, sort_first, slot_block, slot_lane

  !> Value of `keep` with which `sort_particles` reorders all particles.
  integer, parameter, public :: keep_none = huge(1)

contains

  !> Block of slot `s` (slots number the lanes of all blocks from 0).
  elemental integer function slot_block(s)
    integer, intent(in) :: s

    slot_block = s/nlane + 1
  end function slot_block

  !> Lane of slot `s`.
  elemental integer function slot_lane(s)
    integer, intent(in) :: s

    slot_lane = mod(s, nlane) + 1
  end function slot_lane

  !> Sort the particles in `slot`, all awake, into the first `n_blocks` blocks, which they must
  !> fill; the other blocks are unchanged.
  subroutine sort_first(particles, n_blocks, slot, node, body, keep, nn, nbody)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: n_blocks, slot(:), node(:), body(:), keep, nn, nbody
    integer :: old

    old = particles%nblk
    call sort_particles(particles, size(slot), slot, node, body, keep, nn, nbody)
    if (particles%nblk /= n_blocks) error stop 'sort_first: the particles need other blocks'
    particles%nblk = old
  end subroutine sort_first

  !> Rebuild the blocks from the particles in `slot(1:n)`; all other particles are dropped.
  !> `node(1:n)` is the storage index of the nearest node of each, `body(1:n)` its body. Particles
  !> whose rest state is `keep` or higher keep their slots if these belong to their class; their
  !> order only affects speed. With `keep_none` all particles are reordered.
  subroutine sort_particles(particles, n, slot, node, body, keep, nn, nbody)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: n, keep, nn, nbody, slot(n), node(n), body(n)
    integer, allocatable :: class(:), from(:), to(:), per_class(:)
    integer :: blocks, c, i, k, moves, nclass

    allocate (from(n), to(n), class(n))
    do i = 1, n
      class(i) = body(i) + nbody*tag_rest(particles%tag(slot_lane(slot(i)), slot_block(slot(i))))
    end do
    nclass = nbody
    if (n > 0) nclass = max(nbody, maxval(class))
    allocate (per_class(nclass))
    call sort_by_counting(n, slot, node, class, nclass, &
                          [(merge(1, nn, (c - 1)/nbody >= keep), c=1, nclass)], from, per_class)
    call particles%reserve(sum((per_class + nlane - 1)/nlane))
    k = 0
    blocks = 0
    moves = 0
    do c = 1, nclass
      associate (old => from(k + 1:k + per_class(c)), new => to(k + 1:k + per_class(c)))
        call place_class(particles, mod(c - 1, nbody) + 1, per_class(c), blocks, new)
        if ((c - 1)/nbody >= keep) call keep_slots(per_class(c), old, new)
      end associate
      do i = k + 1, k + per_class(c)
        if (from(i) == to(i)) cycle
        moves = moves + 1
        from(moves) = from(i)
        to(moves) = to(i)
      end do
      k = k + per_class(c)
    end do
    particles%nblk = blocks
    call move_fields(particles, moves, from(:moves), to(:moves))
    call neutralise_padding(particles)
  end subroutine sort_particles

  !> Counting sort: `from` lists the slots by class, then node (if the class has several `keys`),
  !> then old slot; `per_class` counts them.
  pure subroutine sort_by_counting(n, slot, node, class, nclass, keys, from, per_class)
    integer, intent(in) :: n, nclass, keys(nclass), slot(n), node(n), class(n)
    integer, intent(out) :: from(n), per_class(nclass)
    integer, allocatable :: key(:), start(:)
    integer :: base(nclass), i, k, t, c

    base = [(sum(keys(:c - 1)), c=1, nclass)]
    allocate (key(n), start(sum(keys)))
    start = 0
    per_class = 0
    do i = 1, n
      key(i) = base(class(i)) + min(node(i), keys(class(i)))
      start(key(i)) = start(key(i)) + 1
      per_class(class(i)) = per_class(class(i)) + 1
    end do
    c = 1
    do k = 1, size(start)
      t = start(k)
      start(k) = c
      c = c + t
    end do
    do i = 1, n
      from(start(key(i))) = slot(i)
      start(key(i)) = start(key(i)) + 1
    end do
  end subroutine sort_by_counting

  !> Assign slots from block `blocks+1` on to the `n` particles of a class, of body `b`.
  subroutine place_class(particles, b, n, blocks, to)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: b, n
    integer, intent(inout) :: blocks
    integer, intent(out) :: to(n)
    integer :: i

    do i = 1, n
      to(i) = blocks*nlane + i - 1
    end do
    do i = 1, n, nlane
      blocks = blocks + 1
      particles%count(blocks) = min(nlane, n - i + 1)
      particles%body(blocks) = b
    end do
  end subroutine place_class

  !> Particles whose slots `from` are among the consecutive slots `to` keep them; the others get the
  !> remaining slots in order.
  pure subroutine keep_slots(n, from, to)
    integer, intent(in) :: n, from(n)
    integer, intent(inout) :: to(n)
    logical :: is_taken(n)
    integer :: first, i, k

    if (n == 0) return
    first = to(1)
    is_taken = .false.
    do i = 1, n
      k = from(i) - first + 1
      if (k >= 1 .and. k <= n) is_taken(k) = .true.
    end do
    k = 0
    do i = 1, n
      to(i) = from(i)
      if (from(i) >= first .and. from(i) < first + n) cycle
      do
        k = k + 1
        if (.not. is_taken(k)) exit
      end do
      to(i) = first + k - 1
    end do
  end subroutine keep_slots

  !> Move all particles to their new slots, one field after the other through a buffer: 8 bytes per
  !> particle instead of a second store.
  subroutine move_fields(particles, n, from, to)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: n, from(n), to(n)
    real(rp), allocatable :: buffer(:)
    integer(i8), allocatable :: tags(:)
    integer :: f, i

    allocate (buffer(n))
    do f = 1, particles%nf
      do i = 1, n
        buffer(i) = particles%ps(slot_lane(from(i)), f, slot_block(from(i)))
      end do
      do i = 1, n
        particles%ps(slot_lane(to(i)), f, slot_block(to(i))) = buffer(i)
      end do
    end do
    allocate (tags(n))
    do i = 1, n
      tags(i) = particles%tag(slot_lane(from(i)), slot_block(from(i)))
    end do
    do i = 1, n
      particles%tag(slot_lane(to(i)), slot_block(to(i))) = tags(i)
    end do
  end subroutine move_fields

  !> Fill unused lanes with an undeformed massless particle at the position of the first lane.
  subroutine neutralise_padding(particles)
    type(particles_t), intent(inout) :: particles
    integer :: b, n

    do b = 1, particles%nblk
      n = particles%count(b)
      if (n == nlane) cycle
      associate (ps => particles%ps(:, :, b))
        ps(n + 1:, :) = 0.0_rp
        ps(n + 1:, f_pos) = ps(1, f_pos)
        ps(n + 1:, f_pos + 1) = ps(1, f_pos + 1)
        ps(n + 1:, f_pos + 2) = ps(1, f_pos + 2)
        ps(n + 1:, f_bbar:f_bbar + 2) = 1.0_rp
        ps(n + 1:, f_jac) = 1.0_rp
        ps(n + 1:, f_temp) = ps(1, f_temp)
        ps(n + 1:, n_fields + 1:) = spread(ps(1, n_fields + 1:), 1, nlane - n)
      end associate
      particles%tag(n + 1:, b) = 0_i8
    end do
  end subroutine neutralise_padding

end module particles_sort
