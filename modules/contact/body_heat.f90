! SPDX-License-Identifier: MIT
!> Friction heat between bodies.
module contact_body_heat
  use base_kinds, only: nlane, rp
  use particles_store, only: f_heat, f_mass, particles_t
  use simulation_node_pairs, only: node_pairs_t
  use simulation_nodes, only: nodes_t
  use simulation_run, only: clock_t
  use simulation_scene, only: scene_t
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
    integer :: b, e, k

    if (all(abs(pairs%heat) <= 0.0_rp)) return
    associate (near => pairs%near)
      call gather_heat(scene, nodes, pairs)
      do b = 1, near%n_blocks
        associate (block => near%block(b))
          call heat_block(particles%count(block), nodes%patch%stride, nodes%patch%nn, &
                          near%heat(:, scene%body(particles%body(block))%group), &
                          near%is_hot, near%first(:, b), near%w(:, :, b), clock%mass_scaling, &
                          particles%ps(:, f_mass, block), particles%ps(:, f_heat, block))
        end associate
      end do
      do e = 1, pairs%n
        do k = 1, 2
          near%heat(pairs%node(e), scene%contact(pairs%pair(e))%group(k)) = 0.0_rp
        end do
      end do
    end associate
  end subroutine give_heat

  !> Sum the heat of all entries of each node, for each group, and mark the corners whose nodes have
  !> any.
  pure subroutine gather_heat(scene, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer :: corner, e, i, j, k

    associate (near => pairs%near, stride => nodes%patch%stride)
      near%is_hot(near%corner(1:near%n_corners)) = .false.
      do e = 1, pairs%n
        if (all(abs(pairs%heat(:, e)) <= 0.0_rp)) cycle
        do k = 1, 2
          associate (heat => near%heat(pairs%node(e), scene%contact(pairs%pair(e))%group(k)))
            heat = heat + pairs%heat(k, e)
          end associate
        end do
        do i = 0, 2
          do j = 0, 2
            do k = 0, 2
              corner = pairs%node(e) - i*stride(1) - j*stride(2) - k
              if (corner > 0) near%is_hot(corner) = .true.
            end do
          end do
        end do
      end do
    end associate
  end subroutine gather_heat

  !> Interpolate the heat to `n` particles of a block.
  pure subroutine heat_block(n, stride, nn, node_heat, is_hot, first, w, mass_scaling, mass, heat)
    integer, intent(in) :: n, stride(3), nn, first(nlane)
    real(rp), intent(in) :: node_heat(nn)      !! heat over mass [J/kg]
    logical, intent(in) :: is_hot(nn)          !! corners of 27 nodes with heat
    real(rp), intent(in) :: w(nlane, 9), mass_scaling, mass(nlane)
    real(rp), intent(inout) :: heat(nlane)     !! [J]
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
