! SPDX-License-Identifier: MIT
!> Particles near node pairs, listed once per step by the nodes at which they have weight. Only a
!> small part of all particles is near node pairs; the others are skipped.
module contact_body_near
  use base_kinds, only: nlane, rp
  use mpm_blocks, only: corners_of, weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, particles_t
  use state_clock, only: skin
  use state_node_pairs, only: bundle_lanes, n_bundle, near_t, node_pairs_t, u_place, u_size, &
                                   u_weights
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use tools_pair, only: moves_as_one
  use transfer_kernels, only: run_length
  implicit none (type, external)
  private

  public :: first_stretch, list_near, may_reach, sizes_along

  real(rp), parameter, public :: far_distance = 1.0e30_rp    !! beyond any surface [m]

contains

  !> List the particles with weight at entries that are due.
  subroutine list_near(scene, particles, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    logical :: may_touch(nodes%n_groups)
    real(rp) :: low(3), high(3)
    type(block_t) :: block
    integer :: b, c

    call pairs%near%reset_near(nodes%patch%nn, size(scene%body), nodes%n_groups)
    may_touch = .false.
    do c = 1, size(scene%contact)
      if (scene%contact(c)%normal /= moves_as_one) may_touch(scene%contact(c)%group) = .true.
    end do
    call list_corners(nodes, pairs, low, high)
    if (pairs%near%n_corners == 0) return
    do b = 1, particles%nblk
      if (.not. may_touch(scene%body(particles%body(b))%group)) cycle
      if (.not. may_reach(scene, particles%ball(:, b), low, high)) cycle
      call view_block(particles, b, block)
      call list_block(scene, nodes, pairs%near, block)
    end do
  end subroutine list_near

  !> True if particles of the block in `ball` may have weight at nodes in the box from `low` to
  !> `high`.
  pure logical function may_reach(scene, ball, low, high)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: ball(4)           !! centre and radius of the ball [m]
    real(rp), intent(in) :: low(3), high(3)   !! corners of the box [m]
    real(rp) :: reach

    reach = ball(4) + (1.0_rp + skin)*scene%grid%longest()
    may_reach = all(ball(:3) + reach >= low) .and. all(ball(:3) - reach <= high)
  end function may_reach

  !> List the corners of all groups of 27 nodes with an entry that is due, and the box of these
  !> entries.
  subroutine list_corners(nodes, pairs, low, high)
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(out) :: low(3), high(3)   !! corners of the box [m]
    integer :: corner, e, i, j, k

    low = huge(1.0_rp)
    high = -huge(1.0_rp)
    associate (near => pairs%near)
      do e = 1, pairs%n
        if (.not. pairs%is_due(e)) cycle
        low = min(low, pairs%x(:, e))
        high = max(high, pairs%x(:, e))
        do i = 0, 2
          do j = 0, 2
            do k = 0, 2
              corner = pairs%node(e) - i*nodes%patch%stride(1) - j*nodes%patch%stride(2) - k
              if (corner < 1) cycle
              if (near%bin(corner, 1) >= 0) cycle
              near%n_corners = near%n_corners + 1
              near%corner(near%n_corners) = corner
              near%bin(corner, :) = 0
            end do
          end do
        end do
      end do
    end associate
  end subroutine list_corners

  !> List the particles of a block.
  subroutine list_block(scene, nodes, near, block)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(near_t), intent(inout) :: near
    type(block_t), intent(inout) :: block
    integer :: a, l, m, p, u
    real(rp) :: half(nlane, 3), longest(nlane), rows(nlane, n_bundle + 1)

    call corners_of(scene, nodes, block)
    if (all(near%bin(block%first(:block%n), block%body) < 0)) return
    call weights_of(scene, nodes, block)
    half = half_lengths(scene, block)
    longest = lengths(scene, block, half)
    rows(:, :u_weights - 1) = rows_of(scene, block, half)
    associate (inverse_rho => 1.0_rp/scene%material(scene%body(block%body)%material)%rho, &
               n => block%n, ps => block%ps, w => block%w)
      do a = 10, 18
        w(:n, a) = ps(:n, f_mass)*inverse_rho*ps(:n, f_jac)*w(:n, a)
      end do
    end associate
    rows(:, u_weights:n_bundle) = block%w
    p = 1
    do while (p <= block%n)
      m = run_length(block%n - p + 1, block%first(p))
      if (near%bin(block%first(p), block%body) >= 0) then
        call near%bundle_for(block%body, block%first(p), m, u, l)
        near%box(:, u) = [min(near%box(1:3, u), minval(rows(p:p + m - 1, 1:3), 1)), &
                          max(near%box(4:6, u), maxval(rows(p:p + m - 1, 1:3), 1)), &
                          max(near%box(7, u), maxval(longest(p:p + m - 1)))]
        call copy_rows(m, l, rows(p, 1), near%bundle(:, :, u))
      end if
      p = p + m
    end do
  end subroutine list_block

  !> Copy the rows `rows` and following of the first `m` particles of a block to the lanes of a
  !> bundle behind lane `l`.
  pure subroutine copy_rows(m, l, rows, bundle)
    integer, intent(in) :: m, l
    real(rp), intent(in) :: rows(nlane, n_bundle)
    real(rp), intent(inout) :: bundle(bundle_lanes, n_bundle)
    integer :: f

    if (m == bundle_lanes) then
      do f = 1, n_bundle
        bundle(:, f) = rows(1:bundle_lanes, f)
      end do
    else if (m == bundle_lanes/2) then
      do f = 1, n_bundle
        bundle(l + 1:l + bundle_lanes/2, f) = rows(1:bundle_lanes/2, f)
      end do
    else
      do f = 1, n_bundle
        bundle(l + 1:l + m, f) = rows(1:m, f)
      end do
    end if
  end subroutine copy_rows

  !> Half the current edges of the particles of a block (cpGIMP), or the initial ones [m].
  pure function half_lengths(scene, block) result(half)
    type(scene_t), intent(in) :: scene
    type(block_t), intent(in) :: block
    real(rp) :: half(nlane, 3), domain(3)
    integer :: a, p

    domain = scene%domain(block%body)
    associate (n => block%n)
      do a = 1, 3
        half(:n, a) = 0.5_rp*scene%body(block%body)%spacing(a)
        if (scene%layout%half > 0) half(:n, a) = half(:n, a)/domain(a) &
                                                 *block%ps(:n, scene%layout%half + a - 1)
      end do
    end associate
    if (.not. scene%grid%is_graded()) return
    do p = 1, block%n
      half(p, :) = 0.5_rp*scene%spacing_of(block%body, block%ps(p, :))
    end do
  end function half_lengths

  !> Positions of the particles of a block and the tensors of their size, as stored in bundles: half
  !> the length along a direction n is sqrt(n.t n f), with f from `sizes_along`. With cpGIMP the
  !> current edges are stored, otherwise the elastic stretch b is applied.
  pure function rows_of(scene, block, half) result(u)
    type(scene_t), intent(in) :: scene
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: half(nlane, 3)
    real(rp) :: u(nlane, u_weights - 1)
    integer, parameter :: first(6) = [1, 2, 3, 1, 2, 1], second(6) = [1, 2, 3, 2, 3, 3]
    real(rp) :: stretch(nlane)
    integer :: a, p

    associate (n => block%n, ps => block%ps)
      u(:n, u_place:u_place + 2) = ps(:n, f_pos:f_pos + 2)
      do a = 1, 6
        u(:n, u_size + a - 1) = half(:n, first(a))*half(:n, second(a))
      end do
      if (scene%layout%half > 0) then
        u(:n, u_size + 3:u_size + 5) = 0.0_rp
        return
      end if
      do p = 1, n
        stretch(p) = ps(p, f_jac)**(2.0_rp/3.0_rp)
      end do
      do a = 0, 5
        u(:n, u_size + a) = merge(2.0_rp, 1.0_rp, a > 2)*ps(:n, f_bbar + a)*stretch(:n) &
                            *u(:n, u_size + a)
      end do
    end associate
  end function rows_of

  !> Factors f of each body in half the lengths of its particles along a direction n: 1 over n.first
  !> n, or 1 where the edges are known.
  pure function sizes_along(scene, start, nn) result(factor)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: start(:, :)        !! initial stretches of all bodies
    real(rp), intent(in) :: nn(6)              !! products of n: xx, yy, zz, xy, yz, xz
    real(rp) :: factor(size(start, 2)), all
    integer :: b

    factor = 1.0_rp
    if (scene%layout%half > 0) return
    do b = 1, size(factor)
      all = start(1, b)*nn(1) + start(2, b)*nn(2) + start(3, b)*nn(3) &
            + 2.0_rp*(start(4, b)*nn(4) + start(5, b)*nn(5) + start(6, b)*nn(6))
      factor(b) = 1.0_rp/max(all, tiny(1.0_rp))
    end do
  end function sizes_along

  !> Upper bounds of half the lengths of the particles of a block in any direction [m].
  pure function lengths(scene, block, half) result(longest)
    type(scene_t), intent(in) :: scene
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: half(nlane, 3)
    real(rp) :: longest(nlane)
    real(rp), parameter :: rounding = 1.0_rp + 1.0e-9_rp
    real(rp) :: first(6), least

    longest = 0.0_rp
    longest(:block%n) = rounding*maxval(half(:block%n, :), dim=2)
    if (scene%layout%half > 0) return
    first = first_stretch(scene, block%body)
    least = minval(first(1:3) - [abs(first(4)) + abs(first(6)), abs(first(4)) + abs(first(5)), &
                                 abs(first(5)) + abs(first(6))])
    if (least <= 0.0_rp) then
      longest(:block%n) = far_distance
    else
      longest(:block%n) = longest(:block%n)/sqrt(least)
      call stretch_lengths(block%n, block%ps(:, f_bbar:f_bbar + 5), block%ps(:, f_jac), longest)
    end if
  end function lengths

  !> Multiply lengths by an upper bound of the square root of the largest eigenvalue of b, from
  !> Gershgorin circles.
  pure subroutine stretch_lengths(n, bbar, jac, longest)
    integer, intent(in) :: n
    real(rp), intent(in) :: bbar(nlane, 6), jac(nlane)
    real(rp), intent(inout) :: longest(nlane)
    real(rp) :: xy, yz, xz
    integer :: p

    do p = 1, n
      xy = abs(bbar(p, 4)); yz = abs(bbar(p, 5)); xz = abs(bbar(p, 6))
      longest(p) = longest(p)*sqrt(max(bbar(p, 1) + xy + xz, bbar(p, 2) + xy + yz, &
                                       bbar(p, 3) + yz + xz)*jac(p)**(2.0_rp/3.0_rp))
    end do
  end subroutine stretch_lengths

  !> Stretch b at which a particle of a body had its initial edges.
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

end module contact_body_near
