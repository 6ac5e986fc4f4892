! SPDX-License-Identifier: MIT
!> Links of particles to node pairs: which particles have weight at which entries, listed once a
!> step. Node pairs are few, and so are these particles; all others are looked at no more.
module body_contact_links
  use base_kinds, only: nlane, rp
  use body_contact_node_pairs, only: link_t, linked_t, links_t, n_trials, node_pairs_t, &
                                     s_gradient, s_moment
  use contact_pair, only: moves_as_one, normal_regression
  use grid_geometry, only: mean_edge
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, particles_t
  use state_blocks, only: blocks_t, skin
  use state_scene, only: scene_t
  use transfer_weights, only: block_corners
  implicit none (type, external)
  private

  public :: list_links, find_surfaces

  integer, parameter :: lanes = n_trials - 1        !! directions that are looked along at a time
  real(rp), parameter :: least_weight = 1.0e-6_rp   !! of a particle that counts for the gap

contains

  !> List the particles with weight at the entries, and sum volume gradients and moments there.
  subroutine list_links(scene, particles, blocks, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: low(3), high(3), reach
    integer :: b

    pairs%links%n_particles = 0
    pairs%links%n = 0
    pairs%sums = 0.0_rp
    if (pairs%n == 0) return
    call mark_corners(nodes, pairs)
    low = minval(pairs%x, 2)
    high = maxval(pairs%x, 2)
    do b = 1, particles%nblk
      reach = blocks%ball(4, b) + (1.0_rp + skin)*maxval(scene%grid%h)
      if (any(blocks%ball(1:3, b) + reach < low)) cycle
      if (any(blocks%ball(1:3, b) - reach > high)) cycle
      call list_block(scene, nodes, pairs, b, particles%body(b), particles%count(b), &
                      particles%nf, particles%ps(:, :, b))
    end do
  end subroutine list_links

  !> Mark the corners of all stencils of 27 nodes that hold an entry's node.
  pure subroutine mark_corners(nodes, pairs)
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer :: corner, e, i, j, k

    if (allocated(pairs%links%is_near)) then
      if (size(pairs%links%is_near) /= nodes%patch%nn) deallocate (pairs%links%is_near)
    end if
    if (.not. allocated(pairs%links%is_near)) allocate (pairs%links%is_near(nodes%patch%nn))
    pairs%links%is_near = .false.
    do e = 1, pairs%n
      do i = 0, 2
        do j = 0, 2
          do k = 0, 2
            corner = pairs%node(e) - i*nodes%patch%stride(1) - j*nodes%patch%stride(2) - k
            if (corner > 0) pairs%links%is_near(corner) = .true.
          end do
        end do
      end do
    end do
  end subroutine mark_corners

  subroutine list_block(scene, nodes, pairs, b, body, n, nf, ps)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: b, body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: before, c, first(nlane), p, side(size(scene%contact))
    real(rp) :: w(nlane, 18)

    call block_corners(nodes%patch%origin, 1.0_rp/nodes%patch%h, nodes%patch%stride, ps(1, f_pos), &
                       first)
    if (.not. any(pairs%links%is_near(first(:n)))) return
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call pairs%links%reserve(n, 27*n*size(scene%contact))
    do c = 1, size(side)
      side(c) = findloc(scene%contact(c)%group, scene%body(body)%group, 1)
    end do
    do p = 1, n
      if (.not. pairs%links%is_near(first(p))) cycle
      before = pairs%links%n
      call link_particle(scene, nodes, pairs, body, side, first(p), w(p, :), ps(p, :))
      if (pairs%links%n == before) cycle
      pairs%links%n_particles = pairs%links%n_particles + 1
      pairs%links%particle(pairs%links%n_particles) = linked_of(scene, body, ps(p, :))
      associate (particle => pairs%links%particle(pairs%links%n_particles))
        particle%block = b
        particle%lane = p
        particle%last = pairs%links%n
      end associate
    end do
  end subroutine list_block

  !> Links of one particle, and its part of the sums.
  subroutine link_particle(scene, nodes, pairs, body, side, corner, w, ps)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: body, corner
    integer, intent(in) :: side(:)             !! of the body in each contact; 0: in none
    real(rp), intent(in) :: w(18), ps(:)
    real(rp) :: inverse_h, slope(3), volume, weight
    integer :: e, i, j, k, q

    inverse_h = 1.0_rp/mean_edge(nodes%patch%h)
    volume = ps(f_mass)/scene%material(scene%body(body)%material)%rho*ps(f_jac)
    do i = 1, 3
      do j = 1, 3
        do k = 1, 3
          q = corner + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) + k - 1
          e = pairs%first(q)
          if (e == 0) cycle
          weight = w(i)*w(3 + j)*w(6 + k)
          slope = [w(9 + i)*w(3 + j)*w(6 + k), w(i)*w(12 + j)*w(6 + k), w(i)*w(3 + j)*w(15 + k)]
          do while (pairs%node(e) == q)
            associate (c => pairs%pair(e))
              if (side(c) > 0) then
                pairs%links%n = pairs%links%n + 1
                pairs%links%link(pairs%links%n) = link_t(e, side(c), weight)
                if (scene%contact(c)%normal == moves_as_one) then
                  pairs%links%link(pairs%links%n)%side = 0
                else
                  if (weight <= least_weight) pairs%links%link(pairs%links%n)%side = 0
                  call add_particle(scene%contact(c)%normal, side(c), weight, volume*slope, &
                                    (ps(f_pos:f_pos + 2) - pairs%x(:, e))*inverse_h, &
                                    size(pairs%sums, 1), pairs%sums(:, e))
                end if
              end if
            end associate
            e = e + 1
            if (e > pairs%n) exit
          end do
        end do
      end do
    end do
  end subroutine link_particle

  !> Place and size of a particle: edges of its domain and the stretch since they had that length.
  !> cpGIMP knows the edges, others the elastic stretch b, now and at the start.
  pure type(linked_t) function linked_of(scene, body, ps) result(particle)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body
    real(rp), intent(in) :: ps(:)

    particle%body = body
    particle%x = ps(f_pos:f_pos + 2)
    particle%edges = scene%body(body)%spacing
    particle%stretch = [1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp]
    associate (half => scene%layout%half)
      if (half > 0) then
        particle%edges = particle%edges*ps(half:half + 2)/scene%domain(body)
      else
        particle%stretch = ps(f_bbar:f_bbar + 5)*ps(f_jac)**(2.0_rp/3.0_rp)
      end if
    end associate
    particle%longest = 0.5_rp*maxval(particle%edges)*most_stretch(particle%stretch, &
                                                                  first_stretch(scene, body))
  end function linked_of

  !> The stretch b with which a particle of a body had its first edges.
  pure function first_stretch(scene, body) result(stretch)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body
    real(rp) :: stretch(6)

    stretch = [1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp]
    if (scene%layout%half > 0) return
    associate (start => scene%body(body)%start)
      stretch = start%bbar*start%jac**(2.0_rp/3.0_rp)
    end associate
  end function first_stretch

  !> A bound of sqrt(n.b n/n.first n) over all directions n, by the circles of Gershgorin.
  pure real(rp) function most_stretch(b, first)
    real(rp), intent(in) :: b(6), first(6)
    real(rp), parameter :: rounding = 1.0_rp + 1.0e-9_rp
    real(rp) :: least

    least = minval(first(1:3) - off_diagonal(first))
    most_stretch = huge(1.0_rp)
    if (least > 0.0_rp) most_stretch = rounding*sqrt(maxval(b(1:3) + off_diagonal(b))/least)
  end function most_stretch

  pure function off_diagonal(b) result(radius)
    real(rp), intent(in) :: b(6)
    real(rp) :: radius(3)

    radius = [abs(b(4)) + abs(b(6)), abs(b(4)) + abs(b(5)), abs(b(5)) + abs(b(6))]
  end function off_diagonal

  !> A particle's part of the sums of an entry.
  pure subroutine add_particle(normal, side, weight, gradient, y, n, s)
    integer, intent(in) :: normal, side, n
    real(rp), intent(in) :: weight
    real(rp), intent(in) :: gradient(3)        !! of its volume [m2]
    real(rp), intent(in) :: y(3)               !! from the node to the particle [edges of the
                                               !! cell's cube]
    real(rp), intent(inout) :: s(n)
    real(rp) :: label, moment(3)

    ! each sum by itself: vectors put together in memory would have to wait for it
    associate (g => s(s_gradient + 3*(side - 1):))
      g(1) = g(1) + gradient(1)
      g(2) = g(2) + gradient(2)
      g(3) = g(3) + gradient(3)
    end associate
    if (normal /= normal_regression) return
    label = 2*side - 3
    moment = weight*y
    associate (m => s(s_moment:))
      m(1:3) = m(1:3) + moment*y
      m(4) = m(4) + moment(1)*y(2)
      m(5) = m(5) + moment(2)*y(3)
      m(6) = m(6) + moment(1)*y(3)
      m(7:9) = m(7:9) + moment
      m(10) = m(10) + weight
      m(11:13) = m(11:13) + label*moment
      m(14) = m(14) + label*weight
    end associate
  end subroutine add_particle

  !> Farthest a body reaches at each entry along the trial normals `from` to `to`: where the
  !> foremost of its particles with weight at the node ends.
  subroutine find_surfaces(scene, pairs, from, to)
    type(scene_t), intent(in) :: scene
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: from, to
    real(rp) :: trial(lanes, 3, pairs%n), surface(lanes, 2, pairs%n)
    real(rp) :: first(6, size(scene%body))
    integer :: b, e, k

    do b = 1, size(scene%body)
      first(:, b) = first_stretch(scene, b)
    end do
    do e = 1, pairs%n
      do k = 1, lanes
        trial(k, :, e) = pairs%trial(:, min(from + k - 1, to), e)
      end do
    end do
    surface = -huge(1.0_rp)
    call reach_out(pairs%n, pairs%links, pairs%x, size(scene%body), first, trial, surface)
    do e = 1, pairs%n
      do k = from, to
        pairs%surface(2*k - 1:2*k, e) = surface(k - from + 1, :, e)
      end do
    end do
  end subroutine find_surfaces

  !> Surfaces along the directions of all lanes at `n` entries.
  subroutine reach_out(n, links, x, n_bodies, first, trial, surface)
    integer, intent(in) :: n, n_bodies
    type(links_t), intent(in) :: links
    real(rp), intent(in) :: x(3, n)            !! of the nodes [m]
    real(rp), intent(in) :: first(6, n_bodies)
    real(rp), intent(in) :: trial(lanes, 3, n)
    real(rp), intent(inout) :: surface(lanes, 2, n)
    real(rp) :: along(lanes), out, y(3)
    integer :: i, k, l, last

    last = 0
    do i = 1, links%n_particles
      associate (particle => links%particle(i))
        do l = last + 1, particle%last
          associate (e => links%link(l)%entry, side => links%link(l)%side)
            if (side == 0) cycle
            y = (particle%x - x(:, e))*(3 - 2*side)
            out = 0.0_rp                       ! of the surfaces so far
            do k = 1, lanes
              along(k) = y(1)*trial(k, 1, e) + y(2)*trial(k, 2, e) + y(3)*trial(k, 3, e)
              out = max(out, along(k) + particle%longest - surface(k, side, e))
            end do
            if (out > 0.0_rp) call measure(particle, first(:, particle%body), along, &
                                           trial(:, :, e), surface(:, side, e))
          end associate
        end do
        last = particle%last
      end associate
    end do
  end subroutine reach_out

  !> Move surfaces out to where a particle ends: half its edge along a direction n, stretched by
  !> sqrt(n.b n/n.first n).
  pure subroutine measure(particle, first, along, n, surface)
    type(linked_t), intent(in) :: particle
    real(rp), intent(in) :: first(6), along(lanes), n(lanes, 3)
    real(rp), intent(inout) :: surface(lanes)
    real(rp) :: edge2(3), half2, start, stretch
    integer :: k

    edge2 = 0.25_rp*particle%edges**2
    associate (b => particle%stretch)
      do k = 1, lanes
        half2 = edge2(1)*n(k, 1)**2 + edge2(2)*n(k, 2)**2 + edge2(3)*n(k, 3)**2
        stretch = b(1)*n(k, 1)**2 + b(2)*n(k, 2)**2 + b(3)*n(k, 3)**2 &
                  + 2.0_rp*(b(4)*n(k, 1)*n(k, 2) + b(5)*n(k, 2)*n(k, 3) + b(6)*n(k, 1)*n(k, 3))
        start = first(1)*n(k, 1)**2 + first(2)*n(k, 2)**2 + first(3)*n(k, 3)**2 &
                + 2.0_rp*(first(4)*n(k, 1)*n(k, 2) + first(5)*n(k, 2)*n(k, 3) &
                          + first(6)*n(k, 1)*n(k, 3))
        surface(k) = max(surface(k), along(k) + sqrt(half2*stretch/max(start, tiny(start))))
      end do
    end associate
  end subroutine measure

end module body_contact_links
