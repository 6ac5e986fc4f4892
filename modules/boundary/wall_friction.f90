! SPDX-License-Identifier: MIT
!> Coulomb friction on walls that are mirrors. Reflection leaves the force that presses on the wall
!> at the nodes on it (boundary_symmetry). The tangential velocity at the wall, sum w v of the node
!> on it and the one in front, is brought towards rest by an impulse w lambda on both, at most the
!> coefficient times the pressing impulse. Such a projection cannot add energy. The shear strength
!> of the metal needs no limit of its own: the stress of the particles beside the wall has it.
module boundary_wall_friction
  use base_kinds, only: rp
  use mapping_nodes, only: min_node_inertia, min_node_mass
  use simulation_parts, only: simulation_t
  use state_run, only: e_wall
  implicit none (type, external)
  private

  public :: apply_wall_friction

contains

  !> Stop the metal on walls with friction, and record the impulse and the work of friction. Clamps
  !> and mirrored velocities follow.
  subroutine apply_wall_friction(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)   !! velocity records
    real(rp) :: pressing(sim%boundary%mirrors%n_planes)   !! impulse into the wall [N s]
    real(rp) :: least
    integer :: axis, i, lane

    if (all(sim%scene%symmetry%friction <= 0.0_rp)) return
    least = min_node_inertia(sim%scene, sim%clock)
    associate (plane => sim%boundary%mirrors%plane)
      do i = 1, size(pressing)
        associate (wall => sim%scene%symmetry(plane(2, i)), q => plane(1, i))
          if (wall%friction <= 0.0_rp) cycle
          lane = wall%axis
          pressing(i) = merge(-1.0_rp, 1.0_rp, wall%faces_up)*max(g(8, q), least)*g(4 + lane, q)
          g([lane, 4 + lane], q) = 0.0_rp
        end associate
      end do
      do axis = 1, 3                            ! the same order on all ranks where walls meet
        do i = 1, size(pressing)
          associate (wall => sim%scene%symmetry(plane(2, i)))
            if (wall%axis == axis .and. wall%friction > 0.0_rp) then
              call stop_node(sim, plane(2, i), plane(1, i), wall%friction*pressing(i), least, g)
            end if
          end associate
        end do
      end do
    end associate
  end subroutine apply_wall_friction

  !> Friction on wall `c` at its node `on`, by an impulse of at most `limit`.
  subroutine stop_node(sim, c, on, limit, least, g)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: c, on
    real(rp), intent(in) :: limit, least                  !! [N s], smallest nodal inertia [kg]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    real(rp) :: change(3), impulse(3), spans(3), v(3), w(2), work
    integer :: ijk(3), k, node(2), step

    associate (wall => sim%scene%symmetry(c), patch => sim%nodes%patch)
      if (limit <= 0.0_rp .or. g(8, on) <= min_node_mass) return
      ijk = patch%indices(on)
      step = merge(1, -1, wall%faces_up)
      if (ijk(wall%axis) + step < patch%all%lo(wall%axis)) return   ! no particle of this rank
      if (ijk(wall%axis) + step > patch%all%hi(wall%axis)) return
      node = [on, on + step*patch%stride(wall%axis)]
      w = [1.0_rp, 0.0_rp]
      if (sim%scene%method%is_bspline) w = [0.75_rp, 0.25_rp]
      associate (grading => patch%grading(wall%axis))
        if (grading%is_graded) then
          spans = grading%weights(ijk(wall%axis), 0.0_rp)
          w = [spans(2), spans(1) + spans(3)]
        end if
      end associate
      where (g(8, node) <= min_node_mass) w = 0.0_rp
      v = w(1)*g(1:3, node(1)) + w(2)*g(1:3, node(2))
      v(wall%axis) = 0.0_rp
      impulse = -v/sum(w**2/max(g(8, node), least))
      if (norm2(impulse) > limit) impulse = impulse*(limit/norm2(impulse))
      work = 0.0_rp
      do k = 1, 2
        change = w(k)*impulse/max(g(8, node(k)), least)
        work = work + w(k)*dot_product(impulse, g(1:3, node(k)) + 0.5_rp*change)
        g(1:3, node(k)) = g(1:3, node(k)) + change
        g(5:7, node(k)) = g(5:7, node(k)) + change
      end do
      if (.not. patch%own%has(ijk)) return
      sim%budget%impulse(:, wall%place) = sim%budget%impulse(:, wall%place) + impulse
      sim%budget%sums(e_wall) = sim%budget%sums(e_wall) + work
    end associate
  end subroutine stop_node

end module boundary_wall_friction
