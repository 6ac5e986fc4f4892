! SPDX-License-Identifier: MIT
!> Friction heat between bodies.
module contact_body_heat
  use base_kinds, only: nlane, rp
  use contact_body_near, only: may_reach
  use mpm_blocks, only: corners_of, weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_heat, f_mass, particles_t
  use state_clock, only: clock_t
  use state_node_pairs, only: node_pairs_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: give_heat, heat_shares

contains

  !> Fractions of the friction heat that enter two groups of bodies with equal face temperature,
  !> proportional to their effusivities, or to the nodal masses where no heat is conducted. A group
  !> of several materials uses their mean.
  pure function heat_shares(scene, groups, temp, mass) result(share)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: groups(2)
    real(rp), intent(in) :: temp(2), mass(2)     !! nodal temperature [K] and mass [kg]
    real(rp) :: share(2)
    integer :: b, k

    share = 0.0_rp
    do b = 1, size(scene%body)
      do k = 1, 2
        if (scene%body(b)%group /= groups(k)) cycle
        share(k) = share(k) + scene%material(scene%body(b)%material)%effusivity(temp(k)) &
                   /count(scene%body%group == groups(k))
      end do
    end do
    if (.not. sum(share) > 0.0_rp) share = mass
    share = share/sum(share)
  end function heat_shares

  !> Give the friction heat of the nodes to the particles of both bodies, by their weighted masses.
  subroutine give_heat(scene, clock, particles, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(inout) :: particles
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    type(block_t) :: block
    real(rp) :: high(3), low(3)
    integer :: b, e

    if (all(abs(pairs%heat) <= 0.0_rp)) return
    associate (near => pairs%near)
      call gather_heat(scene, nodes, pairs, low, high)
      do b = 1, particles%nblk
        if (.not. may_reach(scene, particles%ball(:, b), low, high)) cycle
        call view_block(particles, b, block)
        call corners_of(scene, nodes, block)
        if (.not. any(near%is_hot(block%first(:block%n)))) cycle
        call weights_of(scene, nodes, block)
        associate (n => block%n, ps => block%ps, body => scene%body(block%body))
          call heat_block(n, nodes%patch%stride, nodes%patch%nn, near%heat(:, body%group), &
                          near%is_hot, block%first, block%w, clock%mass_scaling, ps(:, f_mass), &
                          ps(:, f_heat))
          particles%warming = max(particles%warming, maxval(ps(:n, f_heat) &
            /(ps(:n, f_mass)*scene%material(body%material)%c_p)))
        end associate
      end do
      do e = 1, pairs%n
        if (all(abs(pairs%heat(:, e)) <= 0.0_rp)) cycle
        near%heat(pairs%node(e), scene%contact(pairs%pair(e))%group) = 0.0_rp
        call mark_corners(nodes%patch%stride, pairs%node(e), .false., near%is_hot)
      end do
    end associate
  end subroutine give_heat

  !> Sum the heat of all entries of each node, for each group, mark the corners whose nodes have
  !> any, and find the box of these nodes.
  subroutine gather_heat(scene, nodes, pairs, low, high)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(out) :: low(3), high(3)   !! lower corner, upper corner [m]
    integer :: e, k

    low = huge(1.0_rp)
    high = -huge(1.0_rp)
    associate (near => pairs%near)
      do e = 1, pairs%n
        if (all(abs(pairs%heat(:, e)) <= 0.0_rp)) cycle
        low = min(low, pairs%x(:, e))
        high = max(high, pairs%x(:, e))
        do k = 1, 2
          associate (heat => near%heat(pairs%node(e), scene%contact(pairs%pair(e))%group(k)))
            heat = heat + pairs%heat(k, e)
          end associate
        end do
        call mark_corners(nodes%patch%stride, pairs%node(e), .true., near%is_hot)
      end do
    end associate
  end subroutine gather_heat

  !> Mark the corners of all groups of 27 nodes with node `q`.
  pure subroutine mark_corners(stride, q, mark, is_marked)
    integer, intent(in) :: stride(3), q
    logical, intent(in) :: mark
    logical, intent(inout) :: is_marked(:)
    integer :: corner, i, j

    do i = 0, 2
      do j = 0, 2
        corner = q - i*stride(1) - j*stride(2)
        is_marked(max(1, corner - 2):corner) = mark
      end do
    end do
  end subroutine mark_corners

  !> Interpolate the heat to `n` particles of a block.
  pure subroutine heat_block(n, stride, nn, node_heat, is_hot, first, w, mass_scaling, mass, heat)
    integer, intent(in) :: n, stride(3), nn, first(nlane)
    real(rp), intent(in) :: node_heat(nn)      !! heat over mass [J/kg]
    logical, intent(in) :: is_hot(nn)          !! corners of 27 nodes with heat
    real(rp), intent(in) :: w(nlane, 18), mass_scaling, mass(nlane)
    real(rp), intent(inout) :: heat(nlane)     !! heat [J]
    real(rp) :: plane, all
    integer :: i, j, p, q

    do p = 1, n
      if (.not. is_hot(first(p))) cycle
      all = 0.0_rp
      do i = 1, 3
        plane = 0.0_rp
        do j = 1, 3
          q = first(p) + (i - 1)*stride(1) + (j - 1)*stride(2)
          plane = plane + w(p, 3 + j)*(w(p, 7)*node_heat(q) + w(p, 8)*node_heat(q + 1) &
                                       + w(p, 9)*node_heat(q + 2))
        end do
        all = all + w(p, i)*plane
      end do
      heat(p) = heat(p) + mass_scaling*mass(p)*all
    end do
  end subroutine heat_block

end module contact_body_heat
