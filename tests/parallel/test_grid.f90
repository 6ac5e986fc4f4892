! SPDX-License-Identifier: MIT
!> Partition of the grid, sums over shared nodes, and particles that move from rank to rank.
program test_grid
  use, intrinsic :: ieee_arithmetic, only: ieee_invalid, ieee_quiet_nan, ieee_set_flag, &
    ieee_set_halting_mode, ieee_value
  use base_kinds, only: i8, nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close, expect_equal
  use comm_world, only: start_world, world_t
  use grid_geometry, only: box_t, grid_t, halo, make_grid, make_patch, nearest_node, patch_t
  use grid_halo, only: halo_t
  use grid_partition, only: bisect, imbalance, owner_of
  use particles_migrate, only: find_outside, redistribute
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_temp, make_tag, n_fields, &
    particles_t, tag_faces, tag_id
  implicit none (type, external)

  integer, parameter :: nbody = 3, nf = n_fields + 2
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .true.)
  call test_geometry()
  call test_balance('uniform', [64, 48, 40], [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp])
  call test_balance('corner', [70, 60, 50], [0.4_rp, 0.1_rp, 0.2_rp], [0.9_rp, 0.7_rp, 0.6_rp])
  call test_balance('plate', [104, 44, 20], [0.02_rp, 0.05_rp, 0.1_rp], [0.98_rp, 0.95_rp, 0.7_rp])
  call test_few_nodes()
  call test_halo([9, 6, 5])
  call test_halo([40, 7, 12])
  call test_redistribute(3000, 1.0_rp)
  call test_redistribute(40, 1.0_rp)
  call test_redistribute(500, 0.2_rp)
  call test_outside()
  call end_tests()

contains

  subroutine test_geometry()
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(box_t) :: a, b, c

    grid = make_grid(0.1_rp, [0.0_rp, 1.0_rp, 2.0_rp], [1.0_rp, 1.25_rp, 2.3_rp])
    call expect('nodes that cover a box', all(grid%n == [11, 4, 4]))
    a = box_t([0, 0, 0], [3, 4, 5])
    b = box_t([2, 3, 4], [9, 9, 9])
    c = a%meet(b)
    call expect('common nodes', all(c%lo == [2, 3, 4]) .and. all(c%hi == [3, 4, 5]) &
                .and. c%count() == 8)
    b = box_t([4, 0, 0], [5, 1, 1])
    c = a%meet(b)
    call expect('no common nodes', c%is_empty() .and. c%count() == 0)
    c = box_t()
    b = c%grown(2)
    call expect('an empty box stays empty', b%is_empty())
    patch = make_patch(grid, a)
    call expect('storage of a patch', patch%node(a%lo - halo) == 1 &
                .and. patch%node(a%hi + halo) == patch%nn .and. patch%stride(3) == 1 &
                .and. patch%nn == (4 + 2*halo)*(5 + 2*halo)*(6 + 2*halo))
    call expect_close('origin of a patch', patch%origin(2), 1.0_rp - 0.1_rp*halo)
    call expect('nearest node', all(nearest_node(grid, [0.149_rp, 1.151_rp, 2.0_rp]) == [1, 2, 0]))
  end subroutine test_geometry

  !> Every node of the grid lies in exactly one box, and all ranks have the same boxes.
  subroutine expect_cover(name, grid, boxes)
    character(*), intent(in) :: name
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: boxes(0:)
    type(box_t) :: whole, common
    real(rp) :: mine(6, 0:size(boxes) - 1), first(6*size(boxes))
    integer :: r, s, total
    logical :: apart, within

    total = 0
    apart = .true.
    within = .true.
    whole = box_t([0, 0, 0], grid%n - 1)
    do r = 0, size(boxes) - 1
      total = total + boxes(r)%count()
      common = boxes(r)%meet(whole)
      within = within .and. common%count() == boxes(r)%count()
      do s = 0, r - 1
        common = boxes(r)%meet(boxes(s))
        apart = apart .and. common%is_empty()
      end do
    end do
    call expect(name//': boxes cover the grid', total == product(grid%n) .and. within)
    call expect(name//': boxes do not overlap', apart)
    do r = 0, size(boxes) - 1
      mine(:, r) = real([boxes(r)%lo, boxes(r)%hi], rp)
    end do
    first = reshape(mine, [size(mine)])
    call world%broadcast(first)
    call expect(name//': all ranks agree', all(reshape(mine, [size(mine)]) == first))
  end subroutine expect_cover

  !> Random loads, each rank with others, between the fractions `from` and `to` of the grid.
  subroutine random_loads(grid, from, to, n, nodes, weight)
    type(grid_t), intent(in) :: grid
    real(rp), intent(in) :: from(3), to(3)
    integer, intent(in) :: n
    integer, allocatable, intent(out) :: nodes(:, :)
    real(rp), allocatable, intent(out) :: weight(:)
    real(rp) :: u(3)
    integer :: i

    allocate (nodes(3, n), weight(n))
    do i = 1, n
      call random_number(u)
      nodes(:, i) = min(grid%n - 1, floor((from + u*(to - from))*grid%n))
    end do
    call random_number(weight)
  end subroutine random_loads

  !> Load of every rank, from all ranks' parts.
  subroutine loads_of(boxes, nodes, weight, load)
    type(box_t), intent(in) :: boxes(0:)
    integer, intent(in) :: nodes(:, :)
    real(rp), intent(in) :: weight(:)
    real(rp), intent(out) :: load(0:world%size - 1)
    integer :: i, r

    load = 0.0_rp
    do i = 1, size(weight)
      r = owner_of(boxes, nodes(:, i))
      load(r) = load(r) + weight(i)
    end do
    call world%sum(load)
  end subroutine loads_of

  subroutine test_balance(name, n, from, to)
    character(*), intent(in) :: name
    integer, intent(in) :: n(3)
    real(rp), intent(in) :: from(3), to(3)
    type(grid_t) :: grid
    type(box_t) :: boxes(0:world%size - 1)
    real(rp) :: load(0:world%size - 1)
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], real(n - 1, rp))
    call random_loads(grid, from, to, 20000/world%size, nodes, weight)
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover(name, grid, boxes)
    call loads_of(boxes, nodes, weight, load)
    call expect(name//': balanced within 15 %', imbalance(world, load(world%rank)) <= 1.15_rp)
    call expect_close(name//': imbalance', imbalance(world, load(world%rank)), &
                      maxval(load)*world%size/sum(load), rtol=1.0e-12_rp)
  end subroutine test_balance

  !> Fewer loaded nodes than ranks, no load at all, fewer nodes than ranks.
  subroutine test_few_nodes()
    type(grid_t) :: grid
    type(box_t) :: boxes(0:world%size - 1)
    integer :: nodes(3, 3), none(3, 0)
    real(rp) :: weight(3), no_weight(0)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [19.0_rp, 9.0_rp, 9.0_rp])
    nodes = reshape([3, 4, 5, 3, 4, 6, 12, 1, 1], [3, 3])
    weight = [1.0_rp, 2.0_rp, 1.5_rp]
    if (world%rank > 0) weight = 0.0_rp
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover('three loaded nodes', grid, boxes)
    call bisect(world, grid, none, no_weight, boxes)
    call expect_cover('no load', grid, boxes)
    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], [2.0_rp, 0.0_rp, 0.0_rp])
    nodes = reshape([0, 0, 0, 1, 0, 0, 2, 0, 0], [3, 3])
    call bisect(world, grid, nodes, weight, boxes)
    call expect_cover('three nodes', grid, boxes)
    call expect('nodes outside belong to nobody', owner_of(boxes, [3, 0, 0]) == -1 &
                .and. owner_of(boxes, [-1, 0, 0]) == -1)
  end subroutine test_few_nodes

  !> What rank r contributes to lane f of node ijk: of either sign and many sizes. It ends with a
  !> division, since the compiler would fuse a product and the sum.
  pure real(rp) function contribution(r, f, ijk)
    integer, intent(in) :: r, f, ijk(3)
    real(rp), parameter :: size_of(0:4) = [7.0_rp, 3.0e5_rp, 1.1e-3_rp, 130.0_rp, 9.7e9_rp]

    contribution = real(modulo(7919*ijk(1) + 104729*ijk(2) + 15485*ijk(3) + 6113*f + 3571*r, 2003) &
                        - 1001, rp)/size_of(modulo(sum(ijk) + f + 3*r, 5))
  end function contribution

  !> This rank's contributions to all nodes of its patch.
  subroutine fill(patch, width, g)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: width
    real(rp), intent(out) :: g(width, patch%nn)
    integer :: f, i, j, k

    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          do f = 1, width
            g(f, patch%node([i, j, k])) = contribution(world%rank, f, [i, j, k])
          end do
        end do
      end do
    end do
  end subroutine fill

  !> Sums of records of several widths over one exchange, wider and narrower in turn.
  subroutine test_halo(n)
    integer, intent(in) :: n(3)
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(halo_t) :: exchange
    type(box_t) :: boxes(0:world%size - 1), active
    integer, allocatable :: nodes(:, :)
    real(rp), allocatable :: weight(:)

    grid = make_grid(1.0_rp, [0.0_rp, 0.0_rp, 0.0_rp], real(n - 1, rp))
    call random_loads(grid, [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp], 200, nodes, weight)
    call bisect(world, grid, nodes, weight, boxes)
    patch = make_patch(grid, boxes(world%rank))
    active = box_t([-1, 0, 1], n - [2, 1, 0])
    call exchange%init(world, patch, boxes, active)
    call expect_sums(exchange, patch, boxes, active, 8)
    call expect_sums(exchange, patch, boxes, active, 2)
    call expect_sums(exchange, patch, boxes, active, 12)
    call expect_sums(exchange, patch, boxes, active, 8)
    call expect('one rank sends nothing', world%size > 1 .or. exchange%messages == 0_i8)
  end subroutine test_halo

  !> Shared nodes hold the sum in the order of the ranks, to the bit; the others are left alone.
  subroutine expect_sums(exchange, patch, boxes, active, width)
    type(halo_t), intent(inout) :: exchange
    type(patch_t), intent(in) :: patch
    type(box_t), intent(in) :: boxes(0:), active
    integer, intent(in) :: width
    type(box_t) :: other
    real(rp), allocatable :: g(:, :)
    real(rp) :: want(width)
    integer :: f, i, j, k, r
    logical :: equal, untouched

    allocate (g(width, patch%nn))
    call fill(patch, width, g)
    call exchange%sum(world, width, patch%nn, g)
    equal = .true.
    untouched = .true.
    do i = patch%all%lo(1), patch%all%hi(1)
      do j = patch%all%lo(2), patch%all%hi(2)
        do k = patch%all%lo(3), patch%all%hi(3)
          want = 0.0_rp
          do r = 0, world%size - 1
            other = boxes(r)%grown(halo)
            if (.not. other%has([i, j, k])) cycle
            if (.not. active%has([i, j, k]) .and. r /= world%rank) cycle
            want = want + [(contribution(r, f, [i, j, k]), f=1, width)]
          end do
          if (active%has([i, j, k])) then
            equal = equal .and. all(g(:, patch%node([i, j, k])) == want)
          else
            untouched = untouched .and. all(g(:, patch%node([i, j, k])) == want)
          end if
        end do
      end do
    end do
    call expect('shared nodes hold the sum, to the bit', equal)
    call expect('nodes not in use are left alone', untouched)
  end subroutine expect_sums

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

    grid = make_grid(0.5_rp, [0.0_rp, 0.0_rp, 0.0_rp], [15.0_rp, 8.0_rp, 6.0_rp])
    extent = part*0.5_rp*(grid%n - 1)
    mine = merge(0, each, world%rank == 0 .and. world%size > 1)
    call make_particles(particles, mine, extent)
    do round = 1, 3
      call random_loads(grid, [0.0_rp, 0.0_rp, 0.0_rp], [1.0_rp, 1.0_rp, 1.0_rp]/round, 300, &
                        nodes, weight)
      call bisect(world, grid, nodes, weight, boxes)
      patch = make_patch(grid, boxes(world%rank))
      call redistribute(world, grid, patch, boxes, nbody, particles)
      call expect_kept(particles, mine, extent)
      call expect_sorted(particles, grid, patch)
      call expect_neutral(particles)
      call redistribute(world, grid, patch, boxes, nbody, particles)   ! nothing to do
      call expect_kept(particles, mine, extent)
    end do
    call particles%free()
  end subroutine test_redistribute

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
    call expect_equal('all inside', find_outside(grid, particles), '')
    b = particles%nblk
    particles%tag(2, b) = make_tag(4711_i8, 63)
    particles%ps(2, f_pos:f_pos + 2, b) = [1.0_rp, 8.25_rp, 2.0_rp]
    message = find_outside(grid, particles)
    call expect('the particle outside is named', index(message, 'particle 4711 left the grid') == 1)
    call expect('its place is named', index(message, '(1, 8.25, 2) m') > 0)
    particles%ps(2, f_pos:f_pos + 2, b) = [1.0_rp, 8.0_rp, 2.0_rp]
    call expect_equal('the border is inside', find_outside(grid, particles), '')
    call ieee_set_halting_mode(ieee_invalid, .false.)   ! a debug build traps
    particles%ps(2, f_pos, b) = ieee_value(1.0_rp, ieee_quiet_nan)
    message = find_outside(grid, particles)
    call ieee_set_flag(ieee_invalid, .false.)
    call expect('a particle that is not a number is named', index(message, 'particle 4711 ') == 1)
    call particles%free()
  end subroutine test_outside

end program test_grid
