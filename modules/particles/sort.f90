! SPDX-License-Identifier: MIT
!> Puts particles into blocks by body and nearest node, so that a block works on few nodes.
module particles_sort
  use base_kinds, only: i8, nlane, rp
  use particles_store, only: f_bbar, f_jac, f_pos, f_temp, n_fields, particles_t
  implicit none (type, external)
  private

  public :: sort_particles, slot_block, slot_lane

contains

  !> Block of slot `s` (slots number the lanes of all blocks from 0).
  elemental integer function slot_block(s)
    integer, intent(in) :: s

    slot_block = s/nlane + 1
  end function slot_block

  elemental integer function slot_lane(s)
    integer, intent(in) :: s

    slot_lane = mod(s, nlane) + 1
  end function slot_lane

  !> Rebuild the blocks from the particles in `slot(1:n)`; all others are dropped.
  !> `node(1:n)` is the storage index of each one's nearest node, `body(1:n)` its body.
  subroutine sort_particles(particles, n, slot, node, body, nn, nbody)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: n, nn, nbody
    integer, intent(in) :: slot(n), node(n), body(n)
    integer, allocatable :: from(:), to(:), per_body(:)
    integer :: b, c, k, nblk

    allocate (from(n), to(n), per_body(nbody))
    call counting_order(n, slot, node, body, nn, nbody, from, per_body)
    nblk = sum((per_body + nlane - 1)/nlane)
    call particles%reserve(nblk)
    k = 0
    c = 0
    do b = 1, nbody
      call place_body(particles, b, per_body(b), c, to(k + 1:k + per_body(b)))
      k = k + per_body(b)
    end do
    particles%nblk = nblk
    call move_fields(particles, n, from, to)
    call neutralise_padding(particles)
  end subroutine sort_particles

  !> `from` lists the slots by body, then node, then old place; `per_body` counts them.
  pure subroutine counting_order(n, slot, node, body, nn, nbody, from, per_body)
    integer, intent(in) :: n, nn, nbody, slot(n), node(n), body(n)
    integer, intent(out) :: from(n), per_body(nbody)
    integer, allocatable :: start(:)
    integer :: i, key, t, c

    allocate (start(nn*nbody + 1), source=0)
    per_body = 0
    do i = 1, n
      key = (body(i) - 1)*nn + node(i)
      start(key) = start(key) + 1
      per_body(body(i)) = per_body(body(i)) + 1
    end do
    c = 1
    do key = 1, nn*nbody
      t = start(key)
      start(key) = c
      c = c + t
    end do
    do i = 1, n
      key = (body(i) - 1)*nn + node(i)
      from(start(key)) = slot(i)
      start(key) = start(key) + 1
    end do
  end subroutine counting_order

  !> Give the `n` particles of body `b` the slots from block `blocks+1` on.
  subroutine place_body(particles, b, n, blocks, to)
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
  end subroutine place_body

  !> Move every field, one at a time through a buffer: 8 bytes a particle instead of a second store.
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

  !> Unused lanes hold an undeformed particle without mass at the place of the first lane.
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
