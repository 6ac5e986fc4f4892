! SPDX-License-Identifier: MIT
!> Heat flow between bodies in contact, h A (T_1 - T_2), at each node where both have mass. A is the
!> integral of the nodal shape function over the contact surface. T_1 and T_2 are interpolated
!> between the nodes half a particle spacing inside the bodies. A nodal temperature is the mean over
!> the particles with weight there, which at a surface are all on one side: it belongs to their
!> centroid. The metal from these places to the surfaces is in series with the gap.
module heat_gaps
  use base_kinds, only: rp
  use boundary_symmetry, only: r_flux, reflect
  use contact_body_pairs, only: slack
  use grid_geometry, only: length_along
  use mpm_blocks, only: weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_jac, f_mass, f_pos, f_tau, n_conduction, particles_t
  use state_node_pairs, only: node_pairs_t
  use state_nodes, only: clear_nodes, nodes_t
  use state_scene, only: scene_t
  use transfer_conduction, only: min_capacity, relax, surface_to_grid
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: add_gap_conductances, add_gap_fluxes, find_gaps, gaps_t

  !> Contact points with heat flow through a gap, one per node.
  type :: gaps_t
    integer :: n = 0
    integer, allocatable :: group(:, :)          !! (2, n) heat groups of both bodies
    integer, allocatable :: node(:, :, :)        !! (8, 2, n) surrounding nodes of both bodies
    real(rp), allocatable :: weight(:, :, :)     !! (8, 2, n) interpolation weights
    real(rp), allocatable :: conductance(:)      !! h A [W/K]
  end type gaps_t

contains

  !> Collective. List the gaps where bodies were in contact in the last mechanical step. The second
  !> grid is overwritten.
  subroutine find_gaps(scene, particles, nodes, pairs, gaps)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    type(gaps_t), intent(inout) :: gaps
    real(rp) :: lost(8, size(scene%symmetry))
    integer :: b, e, groups(2), k

    gaps%n = 0
    if (.not. allocated(scene%gap)) return
    call clear_nodes(nodes, nodes%g2)
    do b = 1, particles%nblk
      call particles%fetch(b + 1, n_conduction)
      call add_block(scene, particles, nodes, pairs, b)
    end do
    lost = 0.0_rp
    do k = 1, scene%n_heat_groups
      call reflect(scene, nodes, r_flux, nodes%g2(:, :, k), lost)
      call nodes%halo%sum(8, nodes%patch%nn, nodes%g2(:, :, k))
    end do
    if (allocated(gaps%node)) deallocate (gaps%node, gaps%weight, gaps%group, gaps%conductance)
    allocate (gaps%node(8, 2, pairs%n), gaps%weight(8, 2, pairs%n), &
              gaps%group(2, pairs%n), gaps%conductance(pairs%n))
    do e = 1, pairs%n
      associate (body => scene%body, group => scene%contact(pairs%pair(e))%group)
        groups = [(body(findloc(body%group, group(k), dim=1))%heat_group, k=1, 2)]
      end associate
      if (groups(1) == groups(2) .or. .not. pairs%is_owned(e)) cycle
      if (pairs%gap(e) > slack*length_along(nodes%patch%edges_at(pairs%x(:, e)), &
                                            pairs%normal(:, e))) cycle
      call add_gap(scene, nodes, pairs, e, groups, gaps)
    end do
  end subroutine find_gaps

  !> Add the contact point near the node of entry `e`, if both bodies have mass there.
  subroutine add_gap(scene, nodes, pairs, e, groups, gaps)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    integer, intent(in) :: e, groups(2)
    type(gaps_t), intent(inout) :: gaps
    real(rp) :: area, at(3), coefficient, depth, inwards(3), resistance, temp, weight(0:7, 2), x(3)
    integer :: c, k, node(0:7, 2)

    call evaluate_contact(scene, pairs%pair(e), pairs%normal(:, e), &
                          nodes%g2(:6, pairs%node(e), groups), area, coefficient)
    if (area <= 0.0_rp .or. coefficient <= 0.0_rp) return
    ! the contact surface is midway between the surfaces of both bodies
    x = pairs%x(:, e) + 0.5_rp*(pairs%ends(1, e) - pairs%ends(2, e))*pairs%normal(:, e)
    resistance = 1.0_rp/coefficient
    do k = 1, 2
      associate (body => scene%body(findloc(scene%body%group, &
                                                scene%contact(pairs%pair(e))%group(k), &
                                                dim=1)), patch => nodes%patch)
        inwards = (2*k - 3)*pairs%normal(:, e)
        depth = 0.5_rp*norm2(inwards*body%spacing*patch%edges_at(x)/scene%grid%h)
        at = patch%linear_place(x + depth*inwards)
        call point_nodes(at, patch%stride, 1, min_capacity, patch%nn, &
                         nodes%g(:, :, groups(k)), node(:, k), weight(:, k))
        if (sum(weight(:, k)) <= 0.0_rp) return
        temp = sum(weight(:, k)*nodes%g(4, node(:, k), groups(k)))
        depth = 0.0_rp
        do c = 0, 7
          at = patch%position(node(c, k)) - x
          associate (first => pairs%first(node(c, k)), sums => nodes%g2(7:8, node(c, k), groups(k)))
            if (first > 0 .and. sums(1) > 0.0_rp) at = at + sums(2)/sums(1)*pairs%normal(:, first)
          end associate
          depth = depth + weight(c, k)*dot_product(at, inwards)
        end do
        resistance = resistance + max(0.0_rp, depth) &
          /scene%material(body%material)%conductivity_at(temp)
      end associate
    end do
    gaps%n = gaps%n + 1
    gaps%group(:, gaps%n) = groups
    gaps%node(:, :, gaps%n) = node
    gaps%weight(:, :, gaps%n) = weight
    gaps%conductance(gaps%n) = area/resistance
  end subroutine add_gap

  !> Contact area at a node, the smaller of the projected areas of both bodies, and conductance at
  !> the mean pressure of the deformable bodies.
  pure subroutine evaluate_contact(scene, contact, normal, surface, area, coefficient)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: contact
    real(rp), intent(in) :: normal(3)                  !! out of the first body
    real(rp), intent(in) :: surface(6, 2)              !! area vectors [m2] and forces [N] of both
    real(rp), intent(out) :: area                      !! [m2]
    real(rp), intent(out) :: coefficient  !! heat-transfer coefficient of the gap [W/(m2 K)]
    real(rp) :: both(2), outwards, pressure
    integer :: k, n

    both = [dot_product(surface(1:3, 1), normal), -dot_product(surface(1:3, 2), normal)]
    area = minval(both)
    coefficient = 0.0_rp
    if (area <= 0.0_rp) return
    pressure = 0.0_rp
    n = 0
    do k = 1, 2
      if (scene%is_rigid_group(scene%contact(contact)%group(k))) cycle
      n = n + 1
      outwards = 3.0_rp - 2.0_rp*k
      pressure = pressure - outwards*dot_product(surface(4:6, k), normal)/both(k)
    end do
    coefficient = scene%gap(contact)%coefficient_at(pressure/max(1, n))
  end subroutine evaluate_contact

  !> Add surface areas, forces and centroids of a block of particles to the nodes.
  subroutine add_block(scene, particles, nodes, pairs, b)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    integer, intent(in) :: b
    type(block_t) :: block

    call view_block(particles, b, block)
    associate (ps => block%ps)
      call weights_of(scene, nodes, block)
      associate (body => scene%body(block%body))
        call surface_to_grid(block%n, block%w, block%first, nodes%patch%stride, nodes%patch%nn, &
                             1.0_rp/scene%material(body%material)%rho, ps(:, f_jac), &
                             ps(:, f_mass), ps(:, f_tau:f_tau + 5), nodes%rec, &
                             nodes%g2(:, :, body%heat_group))
        call add_centroids(block, nodes, pairs, nodes%g2(7:8, :, body%heat_group))
      end associate
    end associate
  end subroutine add_block

  !> Add the mass of a block of particles at the nodes of pairs, and the mass times the distance
  !> from the node along the normal of the pair.
  pure subroutine add_centroids(block, nodes, pairs, sums)
    type(block_t), intent(in) :: block
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    real(rp), intent(inout) :: sums(2, nodes%patch%nn)
    integer :: e, i, j, k, p, q
    real(rp) :: part

    do p = 1, block%n
      do i = 1, 3
        do j = 1, 3
          do k = 1, 3
            q = block%first(p) + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2) &
                + k - 1
            e = pairs%first(q)
            if (e == 0) cycle
            part = block%ps(p, f_mass)*block%w(p, i)*block%w(p, 3 + j)*block%w(p, 6 + k)
            sums(:, q) = sums(:, q) &
              + part*[1.0_rp, dot_product(block%ps(p, f_pos:f_pos + 2) - pairs%x(:, e), &
                                          pairs%normal(:, e))]
          end do
        end do
      end do
    end do
  end subroutine add_centroids

  !> Add the heat flow through the gaps of this rank in `dt` to lane 5 of the second grid, as those
  !> of heat_exchange: at the temperatures in lane 4, or (unless `ends`) the mean of an explicit
  !> step.
  subroutine add_gap_fluxes(nodes, gaps, dt, ends)
    type(nodes_t), intent(inout) :: nodes
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: dt                    !! time step [s]
    logical, intent(in) :: ends
    real(rp) :: heat, increment(2), part, rate, share, t(2)
    integer :: c, e, k

    do e = 1, gaps%n
      rate = 0.0_rp
      increment = 0.0_rp
      do k = 1, 2
        associate (g => nodes%g(:, gaps%node(:, k, e), gaps%group(k, e)), w => gaps%weight(:, k, e))
          t(k) = sum(w*g(4, :))
          if (ends) cycle
          increment(k) = sum(w*g(5, :))
          rate = rate + sum(w*g(2, :))
        end associate
      end do
      call relax(dt*rate, share, part)
      heat = dt*gaps%conductance(e)*(share*(t(1) - t(2)) + part*(increment(1) - increment(2)))
      do k = 1, 2
        do c = 1, 8
          associate (flux => nodes%g2(5, gaps%node(c, k, e), gaps%group(k, e)))
            flux = flux - merge(1.0_rp, -1.0_rp, k == 1)*gaps%weight(c, k, e)*heat
          end associate
        end do
      end do
    end do
  end subroutine add_gap_fluxes

  !> Add the conductances of the gaps of this rank to lane 6 of the second grid.
  subroutine add_gap_conductances(nodes, gaps)
    type(nodes_t), intent(inout) :: nodes
    type(gaps_t), intent(in) :: gaps
    integer :: c, e, k

    do e = 1, gaps%n
      do k = 1, 2
        do c = 1, 8
          associate (sum => nodes%g2(6, gaps%node(c, k, e), gaps%group(k, e)))
            sum = sum + gaps%weight(c, k, e)*gaps%conductance(e)
          end associate
        end do
      end do
    end do
  end subroutine add_gap_conductances

end module heat_gaps
