! SPDX-License-Identifier: MIT
!> Volume ratios averaged over the particles of a body whose nearest node is the same.
module time_volume
  use base_kinds, only: nlane, rp
  use particles_store, only: f_jac, f_mass, f_pos
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: gather_volume, spread_volume

contains

  !> Sum mass and mass times J at every node in use.
  subroutine gather_volume(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b, r

    do r = 1, sim%n_runs
      sim%volume(:, sim%run(1, r):sim%run(2, r)) = 0.0_rp
    end do
    do b = 1, sim%particles%nblk
      call gather_block(sim, 2*sim%particles%body(b) - 1, sim%particles%count(b), sim%particles%nf, &
                        sim%particles%ps(:, :, b))
    end do
  end subroutine gather_volume

  subroutine gather_block(sim, row, n, nf, ps)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: row, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: p, node(nlane)

    call nearest_nodes(sim, ps(1, f_pos), node)
    do p = 1, n
      sim%volume(row, node(p)) = sim%volume(row, node(p)) + ps(p, f_mass)
      sim%volume(row + 1, node(p)) = sim%volume(row + 1, node(p)) + ps(p, f_mass)*ps(p, f_jac)
    end do
  end subroutine gather_block

  !> Give every particle the mean J of its node.
  subroutine spread_volume(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b

    do b = 1, sim%particles%nblk
      call spread_block(sim, 2*sim%particles%body(b) - 1, sim%particles%count(b), sim%particles%nf, &
                        sim%particles%ps(:, :, b))
    end do
  end subroutine spread_volume

  subroutine spread_block(sim, row, n, nf, ps)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: row, n, nf
    real(rp), intent(inout) :: ps(nlane, nf)
    integer :: p, node(nlane)

    call nearest_nodes(sim, ps(1, f_pos), node)
    do p = 1, n
      ps(p, f_jac) = sim%volume(row + 1, node(p))/sim%volume(row, node(p))
    end do
  end subroutine spread_block

  !> Storage index of each particle's nearest node, rounded as in the shape functions.
  pure subroutine nearest_nodes(sim, x, node)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(nlane, 3)
    integer, intent(out) :: node(nlane)
    real(rp) :: inv_h
    integer :: p

    inv_h = 1.0_rp/sim%patch%h
    do p = 1, nlane
      node(p) = 1 + int((x(p, 1) - sim%patch%origin(1))*inv_h + 0.5_rp)*sim%patch%stride(1) &
                + int((x(p, 2) - sim%patch%origin(2))*inv_h + 0.5_rp)*sim%patch%stride(2) &
                + int((x(p, 3) - sim%patch%origin(3))*inv_h + 0.5_rp)*sim%patch%stride(3)
    end do
  end subroutine nearest_nodes

end module time_volume
