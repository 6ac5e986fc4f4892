! SPDX-License-Identifier: MIT
!> Heat flow between bodies in contact, h A (T_1 - T_2), at each node where both have mass. A is the
!> integral of the nodal shape function over the contact surface. T_1 and T_2 are the temperatures
!> half a particle spacing inside the bodies; this layer is in series with the gap. At the surface
!> itself the nodal capacities may be so small that the stable step would vanish.
module heat_gaps
  use base_kinds, only: nlane, rp
  use boundary_symmetry, only: r_flux, reflect
  use contact_body_pairs, only: slack
  use grid_geometry, only: length_along
  use mpm_blocks, only: weights_of
  use particles_store, only: f_jac, f_mass, f_tau, n_conduction
  use simulation_nodes, only: clear_nodes, nodes_t
  use simulation_parts, only: simulation_t
  use simulation_scene, only: scene_t
  use transfer_conduction, only: min_capacity, surface_to_grid
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: add_gap_fluxes, find_gaps, gaps_t

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
  subroutine find_gaps(sim, gaps)
    type(simulation_t), intent(inout) :: sim
    type(gaps_t), intent(inout) :: gaps
    real(rp) :: lost(8, size(sim%scene%symmetry))
    integer :: b, e, groups(2), k

    gaps%n = 0
    if (.not. allocated(sim%scene%gap)) return
    call clear_nodes(sim%nodes, sim%nodes%g2)
    do b = 1, sim%particles%nblk
      call sim%particles%fetch(b + 1, n_conduction)
      call add_block(sim, b)
    end do
    lost = 0.0_rp
    do k = 1, sim%scene%n_heat_groups
      call reflect(sim, r_flux, sim%nodes%g2(:, :, k), lost)
      call sim%nodes%halo%sum(sim%world, 8, sim%nodes%patch%nn, sim%nodes%g2(:, :, k))
    end do
    if (allocated(gaps%node)) deallocate (gaps%node, gaps%weight, gaps%group, gaps%conductance)
    allocate (gaps%node(8, 2, sim%pairs%n), gaps%weight(8, 2, sim%pairs%n), &
              gaps%group(2, sim%pairs%n), gaps%conductance(sim%pairs%n))
    do e = 1, sim%pairs%n
      associate (body => sim%scene%body, group => sim%scene%contact(sim%pairs%pair(e))%group)
        groups = [(body(findloc(body%group, group(k), dim=1))%heat_group, k=1, 2)]
      end associate
      if (groups(1) == groups(2) .or. .not. sim%pairs%is_owned(e)) cycle
      if (sim%pairs%gap(e) > slack*length_along(sim%nodes%patch%edges_at(sim%pairs%x(:, e)), &
                                                sim%pairs%normal(:, e))) cycle
      call add_gap(sim, e, groups, gaps)
    end do
  end subroutine find_gaps

  !> Add the contact point near the node of entry `e`, if both bodies have mass there.
  subroutine add_gap(sim, e, groups, gaps)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: e, groups(2)
    type(gaps_t), intent(inout) :: gaps
    real(rp) :: area, at(3), coefficient, depth, resistance, temp, weight(0:7, 2), x(3)
    integer :: k, node(0:7, 2)

    call evaluate_contact(sim%scene, sim%pairs%pair(e), sim%pairs%normal(:, e), &
                          sim%nodes%g2(:6, sim%pairs%node(e), groups), area, coefficient)
    if (area <= 0.0_rp .or. coefficient <= 0.0_rp) return
    ! the contact surface is midway between the surfaces of both bodies
    x = sim%pairs%x(:, e) + 0.5_rp*(sim%pairs%ends(1, e) - sim%pairs%ends(2, e)) &
      *sim%pairs%normal(:, e)
    resistance = 1.0_rp/coefficient
    do k = 1, 2
      associate (body => sim%scene%body(findloc(sim%scene%body%group, &
                                                sim%scene%contact(sim%pairs%pair(e))%group(k), &
                                                dim=1)))
        depth = 0.5_rp*norm2(sim%pairs%normal(:, e)*body%spacing*sim%nodes%patch%edges_at(x) &
                             /sim%scene%grid%h)
        at = sim%nodes%patch%linear_place(x + (2*k - 3)*depth*sim%pairs%normal(:, e))
        call point_nodes(at, sim%nodes%patch%stride, 1, min_capacity, sim%nodes%patch%nn, &
                         sim%nodes%g(:, :, groups(k)), node(:, k), weight(:, k))
        if (sum(weight(:, k)) <= 0.0_rp) return
        temp = sum(weight(:, k)*sim%nodes%g(4, node(:, k), groups(k)))
        resistance = resistance + depth/sim%scene%material(body%material)%conductivity_at(temp)
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
    real(rp), intent(out) :: coefficient               !! heat-transfer coefficient of the gap
                                                       !! [W/(m2 K)]
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

  !> Add surface areas and forces of a block of particles to the nodes.
  subroutine add_block(sim, b)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: b
    integer :: first(nlane)
    real(rp) :: w(nlane, 18)

    associate (p => sim%particles, nodes => sim%nodes, &
               body => sim%scene%body(sim%particles%body(b)))
      call weights_of(sim%scene, nodes, p%body(b), p%nf, p%ps(:, :, b), w, first)
      call surface_to_grid(p%count(b), w, first, nodes%patch%stride, nodes%patch%nn, &
                           1.0_rp/sim%scene%material(body%material)%rho, p%ps(:, f_jac, b), &
                           p%ps(:, f_mass, b), p%ps(:, f_tau:f_tau + 5, b), nodes%rec, &
                           nodes%g2(:, :, body%heat_group))
    end associate
  end subroutine add_block

  !> Add the heat flow through the gaps of this rank in `dt` at the temperatures in lane 4 to lane 5
  !> of the second grid, and the conductances to lane 6.
  subroutine add_gap_fluxes(nodes, gaps, dt)
    type(nodes_t), intent(inout) :: nodes
    type(gaps_t), intent(in) :: gaps
    real(rp), intent(in) :: dt                    !! time step [s]
    real(rp) :: heat, t(2)
    integer :: c, e, k

    do e = 1, gaps%n
      do k = 1, 2
        t(k) = sum(gaps%weight(:, k, e)*nodes%g(4, gaps%node(:, k, e), gaps%group(k, e)))
      end do
      heat = dt*gaps%conductance(e)*(t(1) - t(2))
      do k = 1, 2
        do c = 1, 8
          associate (flux => nodes%g2(:, gaps%node(c, k, e), gaps%group(k, e)))
            flux(5) = flux(5) - merge(1.0_rp, -1.0_rp, k == 1)*gaps%weight(c, k, e)*heat
            ! twice, as temperatures of both sides may change in opposite directions
            flux(6) = flux(6) + 2.0_rp*gaps%weight(c, k, e)*gaps%conductance(e)
          end associate
        end do
      end do
    end do
  end subroutine add_gap_fluxes

end module heat_gaps
