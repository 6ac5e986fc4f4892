! SPDX-License-Identifier: MIT
!> Velocities without the noise that no node sees: v(k) = (1 + A + .. + A^(k-1)) v, A = 1 - S+ S,
!> with S from nodes to particles and S+ back (FMPM: Nairn 2021, CMES 126:1243; of the velocity
!> before the step XPIC: Hammerquist & Nairn 2017, CMAME 318:724).
module time_filter
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use particles_store, only: f_mass
  use time_contacts, only: share_increments
  use time_mirrors, only: fold, r_filter, unfold
  use time_clamps, only: release_held
  use time_nodes, only: clear_nodes
  use time_scene, only: transfer_fmpm, transfer_xpic
  use time_state, only: simulation_t
  use time_weights, only: weights_of
  use transfer_kernels, only: g2p_values_block
  use transfer_scatter, only: p2g_values_block
  implicit none (type, external)
  private

  public :: filter_velocity, filter_is_due

contains

  !> True if this step ends with velocities from the grid (FMPM, XPIC).
  pure logical function filter_is_due(sim)
    type(simulation_t), intent(in) :: sim

    associate (method => sim%scene%method)
      filter_is_due = method%transfer == transfer_fmpm .or. method%transfer == transfer_xpic
      if (filter_is_due) filter_is_due = mod(sim%clock%step, int(method%every, 8)) == 0
    end associate
  end function filter_is_due

  !> Replace the nodes' velocities by v(k); walls keep theirs, since every increment is zero there.
  subroutine filter_velocity(world, sim, g, mapped, increment)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout), dimension(8, sim%patch%nn, sim%n_groups) :: g
    real(rp), intent(inout), dimension(8, sim%patch%nn, sim%n_groups) :: mapped, increment
    real(rp) :: old, lost(8, size(sim%scene%constraint))
    integer :: k, power

    old = merge(1.0_rp, 0.0_rp, sim%scene%method%transfer == transfer_xpic)
    call first_increment(sim, old, g, increment)
    lost = 0.0_rp                                ! nobody asks for it
    do power = 2, sim%scene%method%order
      call clear_nodes(sim, mapped)
      call there_and_back(sim, increment, mapped)
      do k = 1, sim%n_groups
        call fold(sim, r_filter, mapped(:, :, k), lost)
        call sim%halo%sum(world, 8, sim%patch%nn, mapped(:, :, k))
      end do
      call next_increment(sim, g, mapped, increment)
      call release_held(sim, g, increment)
      if (sim%n_groups > 1) call share_increments(sim, g, increment)
      do k = 1, sim%n_groups
        call unfold(sim, r_filter, increment(:, :, k))
      end do
      call add_increment(sim, increment, g)
    end do
  end subroutine filter_velocity

  !> The velocities to begin with, in lanes 5:7: the new ones, or (`old` = 1) those before the step.
  subroutine first_increment(sim, old, g, increment)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: old, g(8, sim%patch%nn, sim%n_groups)
    real(rp), intent(inout) :: increment(8, sim%patch%nn, sim%n_groups)
    integer :: i, k, r

    do k = 1, sim%n_groups
      do r = 1, sim%n_runs
        do i = sim%run(1, r), sim%run(2, r)
          increment(5:7, i, k) = g(1:3, i, k) - old*g(5:7, i, k)
          increment(8, i, k) = 0.0_rp
        end do
      end do
    end do
  end subroutine first_increment

  !> Momentum of the particles that move with the increment.
  subroutine there_and_back(sim, increment, mapped)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: increment(8, sim%patch%nn, sim%n_groups)
    real(rp), intent(inout) :: mapped(8, sim%patch%nn, sim%n_groups)
    integer :: b, k

    do b = 1, sim%particles%nblk
      k = sim%scene%body(sim%particles%body(b))%group
      call map_block(sim, sim%particles%body(b), sim%particles%count(b), sim%particles%nf, &
                     sim%particles%ps(:, :, b), increment(:, :, k), sim%rec, mapped(:, :, k))
    end do
  end subroutine there_and_back

  subroutine map_block(sim, body, n, nf, ps, increment, rec, mapped)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf), increment(8, sim%patch%nn)
    real(rp), intent(inout) :: rec(8, 4, nlane), mapped(8, sim%patch%nn)
    integer :: first(nlane), p
    real(rp) :: w(nlane, 18)

    call weights_of(sim, body, nf, ps, w, first)
    call g2p_values_block(n, w, first, sim%patch%stride, sim%patch%nn, increment, rec)
    do p = 1, n
      rec(1:3, 1, p) = sim%scene%method%mass_scaling*ps(p, f_mass)*rec(5:7, 1, p)
      rec(4, 1, p) = 0.0_rp
    end do
    call p2g_values_block(n, w, first, rec, sim%patch%stride, sim%patch%nn, mapped)
  end subroutine map_block

  !> d' = (1 - S+ S) d.
  subroutine next_increment(sim, g, mapped, increment)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in), dimension(8, sim%patch%nn, sim%n_groups) :: g, mapped
    real(rp), intent(inout) :: increment(8, sim%patch%nn, sim%n_groups)
    integer :: i, k, r

    do k = 1, sim%n_groups
      do r = 1, sim%n_runs
        do i = sim%run(1, r), sim%run(2, r)
          if (g(8, i, k) <= 0.0_rp) cycle
          increment(5:7, i, k) = increment(5:7, i, k) - mapped(1:3, i, k)/g(8, i, k)
        end do
      end do
    end do
  end subroutine next_increment

  subroutine add_increment(sim, increment, g)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: increment(8, sim%patch%nn, sim%n_groups)
    real(rp), intent(inout) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: i, k, r

    do k = 1, sim%n_groups
      do r = 1, sim%n_runs
        do i = sim%run(1, r), sim%run(2, r)
          g(1:3, i, k) = g(1:3, i, k) + increment(5:7, i, k)
        end do
      end do
    end do
  end subroutine add_increment

end module time_filter
