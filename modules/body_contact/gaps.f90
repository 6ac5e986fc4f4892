! SPDX-License-Identifier: MIT
!> Node pairs of bodies in contact and the gaps there. A gap is that between the particles
!> themselves: a surface is where the foremost of its particles with weight at the node ends.
module body_contact_gaps
  use base_kinds, only: nlane, rp
  use body_contact_node_pairs, only: node_pairs_t, n_sums_all, n_sums_gradient, n_trials, &
                                     s_gradient, s_moment
  use body_contact_normals, only: average_normals, choose_normals, ignore_thin_overlaps, &
                                  try_normals
  use boundary_held, only: boundary_t
  use comm_world, only: world_t
  use contact_pair, only: moves_as_one, normal_regression
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: least_mass, nodes_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, particles_t
  use state_blocks, only: blocks_t, skin
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: find_node_pairs

  real(rp), parameter :: least_weight = 1.0e-6_rp   !! of a particle that counts for the gap
  real(rp), parameter :: clearly = 1.0e-3_rp        !! less gap of a better direction [cells]

contains

  !> Collective. List the nodes with mass of two groups, their normals and gaps.
  subroutine find_node_pairs(world, scene, particles, blocks, nodes, boundary, pairs, g)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)

    integer :: k

    call list_nodes(scene, nodes, pairs, g)
    call note_walls(scene, boundary, pairs)
    call list_near_blocks(scene, particles, blocks, pairs)
    pairs%sums = 0.0_rp
    call visit_blocks(scene, particles, nodes, pairs, 0, 0)
    call sum_entries(world, nodes, pairs, .false., size(pairs%sums, 1), pairs%sums)
    call try_normals(scene, pairs)
    call find_surfaces(world, scene, particles, nodes, pairs, 1, n_trials - 1)
    pairs%gap = -huge(1.0_rp)
    pairs%normal = 0.0_rp
    do k = n_trials - 1, 1, -1
      call choose_normals(pairs, k, merge(0.0_rp, -clearly*nodes%patch%h, k > 2))
    end do
    call average_normals(scene, nodes, pairs, g, pairs%trial(:, n_trials, :))
    call sum_entries(world, nodes, pairs, .false., 3, pairs%trial(:, n_trials, :))
    call find_surfaces(world, scene, particles, nodes, pairs, n_trials, n_trials)
    call choose_normals(pairs, n_trials, -clearly*nodes%patch%h)
    call ignore_thin_overlaps(nodes, pairs)
    pairs%is_known = .true.
  end subroutine find_node_pairs

  !> Surfaces of both bodies along the trial normals `from` to `to`.
  subroutine find_surfaces(world, scene, particles, nodes, pairs, from, to)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: from, to

    pairs%surface(2*from - 1:2*to, :) = -huge(1.0_rp)
    call visit_blocks(scene, particles, nodes, pairs, from, to)
    call sum_entries(world, nodes, pairs, .true., 2*(to - from + 1), &
                     pairs%surface(2*from - 1:2*to, :))
  end subroutine find_surfaces

  subroutine sum_entries(world, nodes, pairs, largest, width, values)
    type(world_t), intent(in) :: world
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    logical, intent(in) :: largest
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, pairs%n)

    call nodes%halo%combine(world, largest, nodes%patch%nn, pairs%first, pairs%n, pairs%node, &
                            width, values)
  end subroutine sum_entries

  !> An entry for each pair of groups with mass at a node.
  subroutine list_nodes(scene, nodes, pairs, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: c, e, i, pass, r, width

    call pairs%forget(nodes%patch%nn)
    width = n_sums_gradient
    if (any(scene%contact%normal == normal_regression)) width = n_sums_all
    do pass = 1, 2
      e = 0
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          do c = 1, size(scene%contact)
            if (any(g(8, i, scene%contact(c)%group) <= least_mass)) cycle
            e = e + 1
            if (pass == 1) cycle
            pairs%node(e) = i
            pairs%pair(e) = c
            pairs%is_owned(e) = nodes%range(3, r) == 1
            pairs%x(:, e) = nodes%patch%position(i)
            if (pairs%first(i) == 0) pairs%first(i) = e
          end do
        end do
      end do
      if (pass == 1) call pairs%reserve(e, width)
    end do
    pairs%free = 1.0_rp
  end subroutine list_nodes

  !> Directions in which a wall or clamp holds the nodes.
  subroutine note_walls(scene, boundary, pairs)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(node_pairs_t), intent(inout) :: pairs
    integer :: i

    do i = 1, boundary%n_fixed
      call note_node(pairs, boundary%fixed(1, i), scene%clamp(boundary%fixed(2, i))%clamp%held)
    end do
    do i = 1, boundary%mirrors%n_planes
      associate (plane => boundary%mirrors%plane(:, i))
        call note_node(pairs, plane(1), scene%symmetry(plane(2))%odd)
      end associate
    end do
  end subroutine note_walls

  !> The entries of node `q` are not free in directions that are `held`.
  pure subroutine note_node(pairs, q, held)
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: q
    logical, intent(in) :: held(3)
    integer :: e

    e = pairs%first(q)
    if (e == 0) return
    do while (pairs%node(e) == q)
      where (held) pairs%free(:, e) = 0.0_rp
      e = e + 1
      if (e > pairs%n) exit
    end do
  end subroutine note_node

  !> Blocks that may have particles with weight at the listed nodes.
  subroutine list_near_blocks(scene, particles, blocks, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: low(3), high(3), reach
    integer :: b

    if (allocated(pairs%near)) deallocate (pairs%near)
    allocate (pairs%near(particles%nblk))
    pairs%n_near = 0
    if (pairs%n == 0) return
    low = minval(pairs%x, 2)
    high = maxval(pairs%x, 2)
    do b = 1, particles%nblk
      reach = blocks%ball(4, b) + (1.0_rp + skin)*scene%grid%h
      if (any(blocks%ball(1:3, b) + reach < low)) cycle
      if (any(blocks%ball(1:3, b) - reach > high)) cycle
      pairs%n_near = pairs%n_near + 1
      pairs%near(pairs%n_near) = b
    end do
  end subroutine list_near_blocks

  !> Surfaces of the particles along the trial normals `from` to `to`; 0: sums over the particles.
  subroutine visit_blocks(scene, particles, nodes, pairs, from, to)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: from, to
    integer :: b, k

    do k = 1, pairs%n_near
      b = pairs%near(k)
      call visit_block(scene, nodes, pairs, from, to, particles%body(b), particles%count(b), &
                       particles%nf, particles%ps(:, :, b))
    end do
  end subroutine visit_blocks

  subroutine visit_block(scene, nodes, pairs, from, to, body, n, nf, ps)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: from, to, body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: e, first(nlane), group, i, j, k, p, q, side
    real(rp) :: w(nlane, 18), weight, slope(3), edges(3), stretch(6, 2)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    group = scene%body(body)%group
    do p = 1, n
      if (from > 0) call size_of(scene, body, ps(p, :), edges, stretch)
      do i = 1, 3
        do j = 1, 3
          do k = 1, 3
            q = first(p) + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) + k - 1
            e = pairs%first(q)
            if (e == 0) cycle
            weight = w(p, i)*w(p, 3 + j)*w(p, 6 + k)
            slope = [w(p, 9 + i)*w(p, 3 + j)*w(p, 6 + k), w(p, i)*w(p, 12 + j)*w(p, 6 + k), &
                     w(p, i)*w(p, 3 + j)*w(p, 15 + k)]
            do while (pairs%node(e) == q)
              associate (contact => scene%contact(pairs%pair(e)))
                side = findloc(contact%group, group, 1)
                if (side > 0 .and. contact%normal /= moves_as_one) then
                  if (from == 0) then
                    call add_particle(scene, nodes, pairs, e, side, weight, slope, body, &
                                      ps(p, f_mass), ps(p, f_jac), ps(p, f_pos:f_pos + 2))
                  else if (weight > least_weight) then
                    call reach_out(pairs, from, to, e, side, edges, stretch, ps(p, f_pos:f_pos + 2))
                  end if
                end if
              end associate
              e = e + 1
              if (e > pairs%n) exit
            end do
          end do
        end do
      end do
    end do
  end subroutine visit_block

  !> Edges of a particle's domain and the stretch since they had that length: cpGIMP knows the
  !> edges, others the elastic stretch b, now and at the start.
  pure subroutine size_of(scene, body, ps, edges, stretch)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body
    real(rp), intent(in) :: ps(:)
    real(rp), intent(out) :: edges(3)          !! [m]
    real(rp), intent(out) :: stretch(6, 2)     !! b now, b at the start: xx, yy, zz, xy, yz, xz

    edges = scene%body(body)%spacing
    associate (half => scene%layout%half)
      if (half > 0) then
        edges = edges*ps(half:half + 2)/scene%domain(body)
        stretch(1:3, :) = 1.0_rp
        stretch(4:6, :) = 0.0_rp
      else
        associate (start => scene%body(body)%start)
          stretch(:, 1) = ps(f_bbar:f_bbar + 5)*ps(f_jac)**(2.0_rp/3.0_rp)
          stretch(:, 2) = start%bbar*start%jac**(2.0_rp/3.0_rp)
        end associate
      end if
    end associate
  end subroutine size_of

  !> A particle's part of the sums of entry `e`.
  pure subroutine add_particle(scene, nodes, pairs, e, side, weight, slope, body, mass, jac, x)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e, side, body
    real(rp), intent(in) :: weight, slope(3), mass, jac, x(3)
    real(rp) :: y(3), label
    integer :: o

    associate (s => pairs%sums(:, e), &
               rho => scene%material(scene%body(body)%material)%rho)
      o = s_gradient + 3*(side - 1)
      s(o:o + 2) = s(o:o + 2) + mass/rho*jac*slope
      if (scene%contact(pairs%pair(e))%normal /= normal_regression) return
      y = (x - pairs%x(:, e))/nodes%patch%h
      label = 2*side - 3
      o = s_moment
      s(o:o + 13) = s(o:o + 13) + weight*[y*y, y(1)*y(2), y(2)*y(3), y(1)*y(3), y, 1.0_rp, &
                                          label*y, label]
    end associate
  end subroutine add_particle

  !> Move the surface of body `side` at entry `e` out to where a particle ends.
  pure subroutine reach_out(pairs, from, to, e, side, edges, stretch, x)
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: from, to, e, side
    real(rp), intent(in) :: edges(3), stretch(6, 2), x(3)
    real(rp) :: along, half
    integer :: k

    do k = from, to
      associate (normal => pairs%trial(:, k, e), s => pairs%surface(2*k - 2 + side, e))
        along = dot_product(x - pairs%x(:, e), normal)*(3 - 2*side)
        half = 0.5_rp*norm2(normal*edges) &
               *sqrt(along_square(stretch(:, 1), normal)/along_square(stretch(:, 2), normal))
        s = max(s, along + half)
      end associate
    end do
  end subroutine reach_out

  !> n . b n of a symmetric tensor: xx, yy, zz, xy, yz, xz.
  pure real(rp) function along_square(b, n)
    real(rp), intent(in) :: b(6), n(3)

    along_square = sum(b(1:3)*n**2) &
                   + 2.0_rp*(b(4)*n(1)*n(2) + b(5)*n(2)*n(3) + b(6)*n(1)*n(3))
  end function along_square

end module body_contact_gaps
