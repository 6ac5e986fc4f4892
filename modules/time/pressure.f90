! SPDX-License-Identifier: MIT
!> Mean normal contact force of the particles next to a node. Four particles press where a node can
!> only give way to their sum: what they carry apart from the mean is noise, which would pass into
!> friction, and a force that stays from step to step may only remember the mean.
module time_pressure
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_tool, only: measure_gaps, tool_is_near
  use particles_store, only: f_force, f_pos
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: collect_pressure, mean_press

contains

  !> Collective: count the particles in contact at each node and add up their normal forces.
  subroutine collect_pressure(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer :: b, r

    if (size(sim%tool) == 0) return
    do r = 1, sim%n_runs
      sim%press(:, sim%run(1, r):sim%run(2, r)) = 0.0_rp
    end do
    do b = 1, sim%particles%nblk
      if (.not. tool_is_near(sim%tool, sim%ball(1:3, b), sim%ball(4, b))) cycle
      call collect_block(sim, sim%particles%count(b), sim%particles%nf, &
                         sim%particles%ps(:, :, b), sim%press)
    end do
    call sim%halo%sum(world, 2, sim%patch%nn, sim%press)
  end subroutine collect_pressure

  subroutine collect_block(sim, n, nf, ps, press)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: press(2, sim%patch%nn)
    real(rp) :: d(nlane), normal(nlane, 3)
    integer :: p, q, touched(nlane)

    if (all(abs(ps(1:n, f_force:f_force + 2)) <= 0.0_rp)) return
    call measure_gaps(sim%tool, n, sim%scene%grid%h, ps(1, f_pos), touched, d, normal)
    do p = 1, n
      associate (force => ps(p, f_force:f_force + 2))
        if (all(abs(force) <= 0.0_rp)) cycle
        q = 1 + sum(int((ps(p, f_pos:f_pos + 2) - sim%patch%origin)/sim%patch%h + 0.5_rp) &
                    *sim%patch%stride)
        press(1, q) = press(1, q) + 1.0_rp
        press(2, q) = press(2, q) + dot_product(force, normal(p, :))
      end associate
    end do
  end subroutine collect_block

  !> Mean normal force [N] at the nearest node of each particle of a block; 0 where nothing touches.
  pure function mean_press(sim, n, first) result(mean)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: n, first(nlane)     !! corners of the particles' stencils
    real(rp) :: mean(nlane)
    integer :: p, q

    mean = 0.0_rp
    do p = 1, n
      q = first(p) + sum(sim%patch%stride)
      if (sim%press(1, q) > 0.5_rp) mean(p) = max(0.0_rp, sim%press(2, q)/sim%press(1, q))
    end do
  end function mean_press

end module time_pressure
