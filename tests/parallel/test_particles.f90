! SPDX-License-Identifier: MIT
!> Particles that move from rank to rank, and those that leave the grid.
program test_particles
  use, intrinsic :: ieee_arithmetic, only: ieee_invalid, ieee_quiet_nan, ieee_set_flag, &
                                           ieee_set_halting_mode, ieee_value
  use, intrinsic :: iso_c_binding, only: c_loc
  use base_kinds, only: i8, nlane, rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_equal
  use grid_geometry, only: box_t, grid_t, make_grid, make_patch, nearest_node, patch_t
  use grid_partition, only: bisect
  use grid_samples, only: random_loads
  use particles_migrate, only: find_outside, redistribute, wrap_positions
  use particles_sort, only: keep_none
  use particles_store, only: asleep, awake, f_bbar, f_jac, f_mass, f_pos, f_temp, make_tag, &
                             n_fields, particles_t, set_rest, tag_faces, tag_id, tag_rest
  implicit none (type, external)

  integer, parameter :: nbody = 3, nf = n_fields + 2
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .true.)
  call test_redistribute(3000, 1.0_rp)
  call test_redistribute(40, 1.0_rp)
  call test_redistribute(500, 0.2_rp)
  call test_reserve()
  call test_extent()
  call test_with_sleepers(0.0_rp)
  call test_with_sleepers(1.0e-3_rp)
  call test_with_sleepers(0.5_rp)
  call test_outside()
  call end_tests()

contains

  !> Field f of the particle with identity `id`, between 0 and 1.
  pure real(rp) function field_of(id, f)
    integer(i8), intent(in) :: id
    integer, intent(in) :: f

    field_of = real(modulo(id*id*7919_i8 + id*104729_i8 + f*15485863_i8 + f*id*611953_i8, &
                           999983_i8), rp)/999983.0_rp
  end function field_of

  pure integer function body_of(id)
    integer(i8), intent(in) :: id

    body_of = 1 + int(modulo(id*id, 7_i8))/3
  end function body_of

  !> Particles `mine` of this rank, in a part of the grid; blocks filled body by body.
  subroutine make_particles(particles, mine, extent)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: mine
    real(rp), intent(in) :: extent(3)
    integer(i8) :: id
    integer :: b, body, f, i, p

    call particles%init(nf)
    call particles%reserve(mine/nlane + nbody + 1)
    b = 0
    do body = 1, nbody
      p = nlane
      do i = 1, mine
        id = 1_i8 + world%rank + int(world%size, i8)*(i - 1)
        if (body_of(id) /= body) cycle
        if (p == nlane) then
          b = b + 1
          p = 0
          particles%body(b) = body
        end if
        p = p + 1
        particles%count(b) = p
        do f = 1, nf
          particles%ps(p, f, b) = field_of(id, f)
        end do
        particles%ps(p, f_pos:f_pos + 2, b) = extent*particles%ps(p, f_pos:f_pos + 2, b)
        particles%tag(p, b) = make_tag(id + ishft(1_i8, 40), int(modulo(id, 64_i8)))
      end do
    end do
    particles%nblk = b
  end subroutine make_particles

  !> More room keeps what all blocks hold, those behind the last one too, where arriving particles
  !> wait to be sorted.
  subroutine test_reserve()
    type(particles_t) :: particles
    integer :: b, n

    call particles%init(nf)
    call particles%reserve(5)
    n = particles%capacity
    particles%nblk = 2
    do b = 1, n
      particles%ps(:, :, b) = real(b, rp)
      particles%tag(:, b) = b
      particles%count(b) = b
      particles%body(b) = -b
    end do
    call particles%reserve(n + 1)
    call expect('more room', particles%capacity > n .and. particles%nblk == 2)
    call expect('fields are kept', all([(all(abs(particles%ps(:, :, b) - b) <= 0.0_rp), b=1, n)]))
    call expect('and what else blocks hold', all([(all(particles%tag(:, b) == b) &
                .and. particles%count(b) == b .and. particles%body(b) == -b, b=1, n)]))
    call particles%reserve(3000)                 ! beyond what memory is copied for
    call expect('much more', all([(all(abs(particles%ps(:, :, b) - b) <= 0.0_rp), b=1, n)]) &
                .and. all(abs(particles%ps(:, :, n + 1:)) <= 0.0_rp) &
                .and. modulo(transfer(c_loc(particles%ps), 0_i8), 64_i8) == 0)
    call particles%fit()
    call expect('only a few more than are in use', particles%capacity <= 6 &
                .and. size(particles%ps, 3) == particles%capacity &
                .and. all([(all(abs(particles%ps(:, :, b) - b) <= 0.0_rp) &
                            .and. all(particles%tag(:, b) == b), b=1, 2)]))
    call particles%free()
  end subroutine test_reserve

  !> Largest coordinates of some blocks, and largest negative ones.
  subroutine test_extent()
    type(particles_t) :: particles
    real(rp) :: box(6), want(6)
    integer :: b, p

    call make_particles(particles, 300, [3.0_rp, -2.0_rp, 0.5_rp])
    want = -huge(1.0_rp)
    do b = 2, particles%nblk - 1
      do p = 1, particles%count(b)
        associate (x => particles%ps(p, f_pos:f_pos + 2, b))
          want = max(want, [x, -x])
        end associate
      end do
    end do
    box = particles%extent(2, particles%nblk - 1)
    call expect('extent of blocks', particles%nblk > 3 .and. all(abs(box - want) <= 0.0_rp))
    call particles%free()
  end subroutine test_extent

  !> Particles in a `part` of the grid; rank 0 makes none if there are others.
  subroutine test_redistribute(each, part)
    integer, intent(in) :: each
    real(rp), intent(in) :: part
    type(particles_t) :: particles
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(box_t) :: boxes(0:world%size - 1)
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)
    real(rp) :: extent(3)
    integer :: mine, round
    logical :: stays

    grid = make_grid(0.5_rp, [0.0_rp, 0.0_rp, 0.0_rp], [15.0_rp, 8.0_rp, 6.0_rp])
    extent = part*0.5_rp*(grid%n - 1)
    mine = merge(0, each, world%rank == 0 .and. world%size > 1)
    call make_particles(particles, mine, extent)
    do round = 1, 3
      call random_loads(grid, spread(0.0_rp, 1, 3), spread(1.0_rp/round, 1, 3), 300, nodes, weight)
      call bisect(world, grid, nodes, weight, boxes)
      patch = make_patch(grid, boxes(world%rank))
      call redistribute(world, grid, patch, boxes, nbody, particles%nblk, keep_none, .true., &
                        particles, stays)
      call expect_kept(particles, mine, extent)
      call expect_sorted(particles, grid, patch)
      call expect_neutral(particles)
      call redistribute(world, grid, patch, boxes, nbody, particles%nblk, &
                        merge(keep_none, awake, round == 1), .false., particles, stays)
      call expect_kept(particles, mine, extent)     ! nothing to do
      call expect_sorted(particles, grid, patch)
    end do
    call particles%free()
  end subroutine test_redistribute

  !> Half of the particles sleep; the others move by up to the part `way` of their half. What is
  !> sorted with sleepers left alone is what is sorted as a whole.
  subroutine test_with_sleepers(way)
    real(rp), intent(in) :: way
    type(particles_t) :: whole, some
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(box_t) :: boxes(0:world%size - 1)
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)
    real(rp) :: extent(3)
    integer :: b, n_awake, p
    logical :: stays

    grid = make_grid(0.5_rp, [0.0_rp, 0.0_rp, 0.0_rp], [15.0_rp, 8.0_rp, 6.0_rp])
    extent = 0.5_rp*(grid%n - 1)
    call make_particles(whole, 1000, extent)
    do b = 1, whole%nblk
      do p = 1, whole%count(b)
        if (whole%ps(p, f_pos, b) > 0.5_rp*extent(1)) whole%tag(p, b) = &
          set_rest(whole%tag(p, b), asleep)
      end do
    end do
    call random_loads(grid, spread(0.0_rp, 1, 3), spread(1.0_rp, 1, 3), 300, nodes, weight)
    call bisect(world, grid, nodes, weight, boxes)
    patch = make_patch(grid, boxes(world%rank))
    call redistribute(world, grid, patch, boxes, nbody, whole%nblk, keep_none, .true., whole, stays)
    n_awake = 0
    do b = 1, whole%nblk
      if (tag_rest(whole%tag(1, b)) == asleep) cycle
      n_awake = b
      do p = 1, whole%count(b)
        whole%ps(p, f_pos, b) = (1.0_rp - way)*whole%ps(p, f_pos, b) &
                                + way*(0.5_rp*extent(1) - whole%ps(p, f_pos, b))
      end do
    end do
    call some%init(nf)
    call some%reserve(whole%nblk)
    some%nblk = whole%nblk
    b = whole%nblk
    some%ps(:, :, :b) = whole%ps(:, :, :b)
    some%tag(:, :b) = whole%tag(:, :b)
    some%count(:b) = whole%count(:b)
    some%body(:b) = whole%body(:b)
    call redistribute(world, grid, patch, boxes, nbody, whole%nblk, keep_none, .true., whole, stays)
    call redistribute(world, grid, patch, boxes, nbody, n_awake, keep_none, .true., some, stays)
    b = whole%nblk
    call expect('blocks with sleepers', some%nblk == b)
    call expect('particles of each block', &
                all(some%count(:b) == whole%count(:b)) .and. all(some%body(:b) == whole%body(:b)))
    call expect('order with sleepers', all(some%tag(:, :b) == whole%tag(:, :b)))
    call expect('fields with sleepers', all(abs(some%ps(:, :, :b) - whole%ps(:, :, :b)) <= 0.0_rp))
    call expect_neutral(some)
    do b = awake, asleep
      call random_rest(some, 0.02_rp)
      call redistribute(world, grid, patch, boxes, nbody, some%nblk, b, .true., some, stays)
      call expect_neutral(some)
      call expect_classes(some, whole)
    end do
    call whole%free()
    call some%free()
  end subroutine test_with_sleepers

  !> A `part` of the particles wakes or falls asleep; all others stay as they are.
  subroutine random_rest(particles, part)
    type(particles_t), intent(inout) :: particles
    real(rp), intent(in) :: part
    real(rp) :: u(2)
    integer :: b, p

    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        call random_number(u)
        if (u(1) < part) particles%tag(p, b) = set_rest(particles%tag(p, b), int(3.0_rp*u(2)))
      end do
    end do
  end subroutine random_rest

  !> Blocks are of one body and one rest, in their order and full but for the last of a kind, and
  !> hold all particles of `old` with their fields.
  subroutine expect_classes(particles, old)
    type(particles_t), intent(in) :: particles, old
    integer(i8) :: sums(4)
    integer :: b, class, last, n
    logical :: full, ordered, uniform

    full = .true.
    ordered = .true.
    uniform = .true.
    last = 0
    do b = 1, particles%nblk
      n = particles%count(b)
      class = particles%body(b) + nbody*tag_rest(particles%tag(1, b))
      uniform = uniform .and. all(tag_rest(particles%tag(:n, b)) == tag_rest(particles%tag(1, b)))
      ordered = ordered .and. class >= last
      if (class == last) full = full .and. particles%count(b - 1) == nlane
      last = class
    end do
    sums(1:2) = checksum(particles)
    sums(3:4) = checksum(old)
    call world%sum(sums)
    call expect('blocks of one rest', uniform)
    call expect('rest by rest', ordered)
    call expect('full blocks', full)
    call expect('particles with their fields', all(sums(1:2) == sums(3:4)))
  end subroutine expect_classes

  !> Sums over all particles of identities, and of identities times the bits of their fields.
  function checksum(particles) result(sums)
    type(particles_t), intent(in) :: particles
    integer(i8) :: sums(2)
    integer :: b, f, p

    sums = 0_i8
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        associate (id => modulo(tag_id(particles%tag(p, b)), 100003_i8))
          sums(1) = sums(1) + id
          do f = 1, nf
            sums(2) = sums(2) + id*modulo(transfer(particles%ps(p, f, b), 0_i8), 1000003_i8)
          end do
        end associate
      end do
    end do
  end function checksum

  !> All identities are there once, and every particle carries its own fields, to the bit.
  subroutine expect_kept(particles, mine, extent)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: mine
    real(rp), intent(in) :: extent(3)
    integer(i8) :: id, sums(6)
    integer :: b, f, i, p
    real(rp) :: want(nf)
    logical :: equal, same_body, same_faces

    sums = 0_i8
    do i = 1, mine
      id = 1_i8 + world%rank + int(world%size, i8)*(i - 1)
      sums(1:3) = sums(1:3) + [1_i8, id, modulo(id*id, 1000003_i8)]
    end do
    equal = .true.
    same_body = .true.
    same_faces = .true.
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        id = tag_id(particles%tag(p, b)) - ishft(1_i8, 40)
        sums(4:6) = sums(4:6) + [1_i8, id, modulo(id*id, 1000003_i8)]
        same_body = same_body .and. particles%body(b) == body_of(id)
        same_faces = same_faces .and. tag_faces(particles%tag(p, b)) == modulo(id, 64_i8)
        want = [(field_of(id, f), f=1, nf)]
        want(f_pos:f_pos + 2) = extent*want(f_pos:f_pos + 2)
        equal = equal .and. all(particles%ps(p, :, b) == want)
      end do
    end do
    call world%sum(sums)
    call expect('no particle lost or doubled', all(sums(1:3) == sums(4:6)))
    call expect('fields are carried, to the bit', equal)
    call expect('bodies are kept', same_body)
    call expect('face bits are kept', same_faces)
  end subroutine expect_kept

  !> Particles lie on their owner, by body, then by storage index of the nearest node.
  subroutine expect_sorted(particles, grid, patch)
    type(particles_t), intent(in) :: particles
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    integer :: b, body, last, node, p, ijk(3)
    logical :: owned, sorted, full

    owned = .true.
    sorted = .true.
    full = .true.
    body = 0
    last = 0
    do b = 1, particles%nblk
      if (particles%body(b) /= body) last = 0
      sorted = sorted .and. particles%body(b) >= body
      body = particles%body(b)
      if (b < particles%nblk) then
        if (particles%body(b + 1) == body) full = full .and. particles%count(b) == nlane
      end if
      full = full .and. particles%count(b) > 0
      do p = 1, particles%count(b)
        ijk = nearest_node(grid, particles%ps(p, f_pos:f_pos + 2, b))
        owned = owned .and. patch%own%has(ijk)
        if (.not. patch%own%has(ijk)) cycle
        node = patch%node(ijk)
        sorted = sorted .and. node >= last
        last = node
      end do
    end do
    call expect('particles lie on their owner', owned)
    call expect('particles are sorted by body and node', sorted)
    call expect('only the last block of a body has room', full)
  end subroutine expect_sorted

  !> Lanes without particles are undeformed, massless, and near the others.
  subroutine expect_neutral(particles)
    type(particles_t), intent(in) :: particles
    real(rp) :: want(nf)
    integer :: b, p
    logical :: neutral

    neutral = .true.
    do b = 1, particles%nblk
      want = 0.0_rp
      want(f_pos:f_pos + 2) = particles%ps(1, f_pos:f_pos + 2, b)
      want(f_bbar:f_bbar + 2) = 1.0_rp
      want(f_jac) = 1.0_rp
      want(f_temp) = particles%ps(1, f_temp, b)
      want(f_mass) = 0.0_rp
      want(n_fields + 1:) = particles%ps(1, n_fields + 1:, b)
      do p = particles%count(b) + 1, nlane
        neutral = neutral .and. all(particles%ps(p, :, b) == want) &
                  .and. particles%tag(p, b) == 0_i8
      end do
    end do
    call expect('padding is neutral', neutral)
  end subroutine expect_neutral

  !> The particle that left, or is not a number, is named.
  subroutine test_outside()
    type(particles_t) :: particles
    type(grid_t) :: grid
    character(:), allocatable :: message
    integer :: b

    grid = make_grid(0.5_rp, [0.0_rp, 0.0_rp, 0.0_rp], [15.0_rp, 8.0_rp, 6.0_rp])
    call make_particles(particles, 200, [15.0_rp, 8.0_rp, 6.0_rp])
    call expect_equal('all inside', find_outside(grid, particles%nblk, particles), '')
    b = particles%nblk
    particles%tag(2, b) = make_tag(4711_i8, 63)
    particles%ps(2, f_pos:f_pos + 2, b) = [1.0_rp, 8.25_rp, 2.0_rp]
    message = find_outside(grid, particles%nblk, particles)
    call expect('the particle outside is named', index(message, 'particle 4711 left the grid') == 1)
    call expect('its place is named', index(message, '(1, 8.25, 2) m') > 0)
    particles%ps(2, f_pos:f_pos + 2, b) = [1.0_rp, 8.0_rp, 2.0_rp]
    call expect_equal('the border is inside', find_outside(grid, particles%nblk, particles), '')
    call ieee_set_halting_mode(ieee_invalid, .false.)   ! a debug build traps
    particles%ps(2, f_pos, b) = ieee_value(1.0_rp, ieee_quiet_nan)
    message = find_outside(grid, particles%nblk, particles)
    call ieee_set_flag(ieee_invalid, .false.)
    call expect('a particle that is not a number is named', index(message, 'particle 4711 ') == 1)
    call test_periodic_side(particles, b)
    call particles%free()
  end subroutine test_outside

  !> Through a periodic side a particle may be two cells outside; wrapping brings it back.
  subroutine test_periodic_side(particles, b)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: b
    type(grid_t) :: grid

    grid = make_grid(0.5_rp, [0.0_rp, 0.0_rp, 0.0_rp], [15.0_rp, 8.0_rp, 6.0_rp], &
                     [.false., .true., .false.])
    particles%ps(2, f_pos:f_pos + 2, b) = [1.0_rp, 9.125_rp, 2.0_rp]
    call expect('too far through a periodic side', &
                index(find_outside(grid, particles%nblk, particles), &
                      'particle 4711 left the grid') == 1)
    particles%ps(2, f_pos:f_pos + 2, b) = [1.0_rp, 8.75_rp, 2.0_rp]
    call expect_equal('just through a periodic side', &
                      find_outside(grid, particles%nblk, particles), '')
    call wrap_positions(grid, particles)
    call expect('wrapped', all(particles%ps(2, f_pos:f_pos + 2, b) == [1.0_rp, 0.75_rp, 2.0_rp]))
  end subroutine test_periodic_side

end program test_particles
