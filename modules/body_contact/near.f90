! SPDX-License-Identifier: MIT
!> The particles near node pairs, listed once a step by the nodes they have weight at, and what is
!> summed of them there. Node pairs are few, and so are these particles; all others are looked at no
!> more.
module body_contact_near
  use base_kinds, only: nlane, rp
  use body_contact_node_pairs, only: node_pairs_t, s_gradient, s_moment
  use contact_pair, only: moves_as_one, normal_regression
  use grid_geometry, only: mean_edge
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, particles_t
  use state_blocks, only: blocks_t, skin
  use state_scene, only: scene_t
  use transfer_scatter, only: p2g_slopes_block
  use transfer_weights, only: block_corners
  implicit none (type, external)
  private

  public :: first_stretch, list_near

  real(rp), parameter, public :: far = 1.0e30_rp    !! beyond any surface [m]

contains

  !> List the particles with weight at the entries where contact is more than one velocity for both
  !> bodies, and sum volume gradients and moments there.
  subroutine list_near(scene, particles, blocks, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(blocks_t), intent(in) :: blocks
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    logical :: is_met(nodes%n_groups), matters(size(scene%contact))
    real(rp) :: low(3), high(3), reach
    integer :: b, c

    call pairs%near%begin(nodes%patch%nn, size(scene%body), nodes%n_groups)
    pairs%sums = 0.0_rp
    is_met = .false.
    do c = 1, size(matters)
      associate (contact => scene%contact(c))
        matters(c) = contact%normal /= moves_as_one .or. any(scene%is_rigid_group(contact%group))
        if (matters(c)) is_met(contact%group) = .true.
      end associate
    end do
    call list_corners(nodes, pairs, matters, low, high)
    if (pairs%near%n_corners == 0) return
    call clear_gradients(nodes, low, high, is_met, pairs%near%gradient)
    nodes%rec(:, :, :) = 0.0_rp
    do b = 1, particles%nblk
      if (.not. is_met(scene%body(particles%body(b))%group)) cycle
      reach = blocks%ball(4, b) + (1.0_rp + skin)*maxval(scene%grid%h)
      if (any(blocks%ball(1:3, b) + reach < low)) cycle
      if (any(blocks%ball(1:3, b) - reach > high)) cycle
      call list_block(scene, nodes, pairs, b, particles%body(b), particles%count(b), &
                      particles%nf, particles%ps(:, :, b))
    end do
    call take_gradients(scene, pairs)
  end subroutine list_near

  !> List the corners of all groups of 27 nodes with an entry that `matters`, and the box of these
  !> entries.
  subroutine list_corners(nodes, pairs, matters, low, high)
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    logical, intent(in) :: matters(:)          !! of each contact
    real(rp), intent(out) :: low(3), high(3)   !! [m]
    integer :: corner, e, i, j, k

    low = huge(1.0_rp)
    high = -huge(1.0_rp)
    associate (near => pairs%near)
      do e = 1, pairs%n
        if (.not. matters(pairs%pair(e))) cycle
        low = min(low, pairs%x(:, e))
        high = max(high, pairs%x(:, e))
        do i = 0, 2
          do j = 0, 2
            do k = 0, 2
              corner = pairs%node(e) - i*nodes%patch%stride(1) - j*nodes%patch%stride(2) - k
              if (corner < 1) cycle
              if (near%slot(corner) > 0) cycle
              near%n_corners = near%n_corners + 1
              near%slot(corner) = near%n_corners
              near%corner(near%n_corners) = corner
              near%last(:, near%n_corners) = 0
              near%bundle_of(:, near%n_corners) = 0
            end do
          end do
        end do
      end do
    end associate
  end subroutine list_corners

  !> Zero the sums at all nodes that particles with weight in a box may add to.
  subroutine clear_gradients(nodes, low, high, is_met, gradient)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: low(3), high(3)
    logical, intent(in) :: is_met(:)           !! groups
    real(rp), intent(inout) :: gradient(8, nodes%patch%nn, size(is_met))
    integer :: first(3), g, i, j, last(3), q

    associate (patch => nodes%patch)
      first = max(nint((low - patch%origin)/patch%h) - 2, 0)
      last = min(nint((high - patch%origin)/patch%h) + 2, patch%all%hi - patch%all%lo)
      do g = 1, size(is_met)
        if (.not. is_met(g)) cycle
        do i = first(1), last(1)
          do j = first(2), last(2)
            q = 1 + i*patch%stride(1) + j*patch%stride(2)
            gradient(:, q + first(3):q + last(3), g) = 0.0_rp
          end do
        end do
      end do
    end associate
  end subroutine clear_gradients

  subroutine list_block(scene, nodes, pairs, b, body, n, nf, ps)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: b, body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: first(nlane), o, p, slot
    real(rp) :: longest(nlane), w(nlane, 18)

    call block_corners(nodes%patch%origin, 1.0_rp/nodes%patch%h, nodes%patch%stride, ps(1, f_pos), &
                       first)
    if (all(pairs%near%slot(first(:n)) == 0)) return
    call weights_of(scene, nodes, body, nf, ps, w, first)
    call pairs%near%add_block(b)
    call volume_records(n, 1.0_rp/scene%material(scene%body(body)%material)%rho, ps(1, f_mass), &
                        ps(1, f_jac), nodes%rec)
    associate (near => pairs%near, group => scene%body(body)%group)
      call p2g_slopes_block(n, w, first, nodes%rec, nodes%patch%stride, nodes%patch%nn, &
                            near%gradient(:, :, group))
      near%first(:, near%n_blocks) = first
      near%w(:, :, near%n_blocks) = w(:, 1:9)
      longest = lengths(scene, body, n, nf, ps)
      o = (near%n_blocks - 1)*nlane
      do p = 1, n
        slot = near%slot(first(p))
        near%before(o + p) = 0
        if (slot == 0) cycle
        near%before(o + p) = near%last(body, slot)
        near%last(body, slot) = o + p
        near%longest(body) = max(near%longest(body), longest(p))
      end do
      if (any(scene%contact%normal == normal_regression)) then
        do p = 1, n
          if (near%slot(first(p)) > 0) call add_moments(scene, nodes, pairs, group, first(p), &
                                                        w(p, :9), ps(p, f_pos:f_pos + 2))
        end do
      end if
    end associate
  end subroutine list_block

  !> Volumes of particles in the records, to be summed by the slopes of their weights.
  pure subroutine volume_records(n, inverse_rho, mass, jac, rec)
    integer, intent(in) :: n
    real(rp), intent(in) :: inverse_rho, mass(nlane), jac(nlane)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp) :: volume
    integer :: p

    do p = 1, n
      volume = mass(p)*inverse_rho*jac(p)
      rec(5, 2, p) = volume
      rec(6, 3, p) = volume
      rec(7, 4, p) = volume
    end do
  end subroutine volume_records

  !> Bounds of half the lengths of the particles of a block in any direction [m].
  pure function lengths(scene, body, n, nf, ps) result(longest)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp) :: longest(nlane)
    real(rp), parameter :: rounding = 1.0_rp + 1.0e-9_rp
    real(rp) :: first(6), least
    integer :: p

    longest = 0.0_rp
    associate (half => scene%layout%half, edges => scene%body(body)%spacing)
      if (half > 0) then
        do p = 1, n
          longest(p) = 0.5_rp*rounding*maxval(edges*ps(p, half:half + 2)/scene%domain(body))
        end do
        return
      end if
      first = first_stretch(scene, body)
      least = minval(first(1:3) - [abs(first(4)) + abs(first(6)), abs(first(4)) + abs(first(5)), &
                                   abs(first(5)) + abs(first(6))])
      if (least <= 0.0_rp) then
        longest(:n) = far
      else
        call stretched_lengths(n, 0.5_rp*rounding*maxval(edges)/sqrt(least), ps(1, f_bbar), &
                               ps(1, f_jac), longest)
      end if
    end associate
  end function lengths

  !> Lengths stretched by at most the square root of the largest eigenvalue of b, which the circles
  !> of Gershgorin bound.
  pure subroutine stretched_lengths(n, length, bbar, jac, longest)
    integer, intent(in) :: n
    real(rp), intent(in) :: length, bbar(nlane, 6), jac(nlane)
    real(rp), intent(inout) :: longest(nlane)
    real(rp) :: xy, yz, xz
    integer :: p

    do p = 1, n
      xy = abs(bbar(p, 4)); yz = abs(bbar(p, 5)); xz = abs(bbar(p, 6))
      longest(p) = length*sqrt(max(bbar(p, 1) + xy + xz, bbar(p, 2) + xy + yz, &
                                   bbar(p, 3) + yz + xz)*jac(p)**(2.0_rp/3.0_rp))
    end do
  end subroutine stretched_lengths

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

  !> A particle's part of the moments of all entries at its nodes.
  subroutine add_moments(scene, nodes, pairs, group, corner, w, x)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: group, corner
    real(rp), intent(in) :: w(9), x(3)
    real(rp) :: inverse_h
    integer :: e, i, j, k, q, side

    inverse_h = 1.0_rp/mean_edge(nodes%patch%h)
    do i = 1, 3
      do j = 1, 3
        do k = 1, 3
          q = corner + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) + k - 1
          e = pairs%first(q)
          if (e == 0) cycle
          do while (pairs%node(e) == q)
            associate (contact => scene%contact(pairs%pair(e)))
              side = findloc(contact%group, group, 1)
              if (contact%normal == normal_regression .and. side > 0) then
                call add_moment(2*side - 3, w(i)*w(3 + j)*w(6 + k), (x - pairs%x(:, e))*inverse_h, &
                                pairs%sums(s_moment:s_moment + 13, e))
              end if
            end associate
            e = e + 1
            if (e > pairs%n) exit
          end do
        end do
      end do
    end do
  end subroutine add_moments

  !> Moments of one particle.
  pure subroutine add_moment(label, weight, y, m)
    integer, intent(in) :: label               !! -1 or 1, by the body
    real(rp), intent(in) :: weight
    real(rp), intent(in) :: y(3)               !! from the node to the particle [edges of the
                                               !! cell's cube]
    real(rp), intent(inout) :: m(14)
    real(rp) :: moment(3)

    moment = weight*y
    m(1:3) = m(1:3) + moment*y
    m(4) = m(4) + moment(1)*y(2)
    m(5) = m(5) + moment(2)*y(3)
    m(6) = m(6) + moment(1)*y(3)
    m(7:9) = m(7:9) + moment
    m(10) = m(10) + weight
    m(11:13) = m(11:13) + label*moment
    m(14) = m(14) + label*weight
  end subroutine add_moment

  !> Volume gradients of both bodies to the entries.
  pure subroutine take_gradients(scene, pairs)
    type(scene_t), intent(in) :: scene
    type(node_pairs_t), intent(inout) :: pairs
    integer :: e, o, side

    do e = 1, pairs%n
      associate (contact => scene%contact(pairs%pair(e)), q => pairs%node(e))
        if (contact%normal == moves_as_one) cycle
        do side = 1, 2
          o = s_gradient + 3*(side - 1)
          pairs%sums(o:o + 2, e) = pairs%near%gradient(5:7, q, contact%group(side))
        end do
      end associate
    end do
  end subroutine take_gradients

end module body_contact_near
