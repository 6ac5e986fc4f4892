! SPDX-License-Identifier: MIT
!> What the internal variables of flow laws say in frames and histories, and their alarms.
module time_microstructure
  use base_kinds, only: nlane, rp, sp
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_mass, f_plastic, f_rate, f_temp
  use physics_flow_law, only: alarm_text, flow_law_t, n_alarms, n_outputs
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: anneal_particles, alarm_message, micro_columns, micro_row, n_micro_outputs, &
            pack_outputs

  real(rp), parameter :: stirred = 1.0_rp     !! plastic strain from which material counts as stirred
  integer, parameter :: n_columns = 6

contains

  !> How many of the laws' outputs the scene has: none, those of deformation, or all.
  pure integer function n_micro_outputs(sim)
    type(simulation_t), intent(in) :: sim
    integer :: m

    n_micro_outputs = 0
    if (sim%scene%layout%n_law == 0) return
    n_micro_outputs = n_outputs - 1
    do m = 1, size(sim%scene%material)
      if (.not. allocated(sim%scene%material(m)%flow)) cycle
      if (sim%scene%material(m)%flow%anneals) n_micro_outputs = n_outputs
    end do
  end function n_micro_outputs

  !> Outputs of all particles of this rank, in the order of the blocks; 0 without internal variables.
  subroutine pack_outputs(sim, values)
    type(simulation_t), intent(in) :: sim
    real(sp), allocatable, intent(out) :: values(:, :)
    real(rp) :: block(nlane, n_outputs)
    integer :: b, k, m, n

    k = n_micro_outputs(sim)
    allocate (values(sim%particles%total(), k))
    if (k == 0) return
    n = 0
    do b = 1, sim%particles%nblk
      m = sim%particles%count(b)
      call describe_block(sim, b, sim%particles%nf, sim%particles%ps(:, :, b), block)
      values(n + 1:n + m, :) = real(block(1:m, 1:k), sp)
      n = n + m
    end do
  end subroutine pack_outputs

  subroutine describe_block(sim, b, nf, ps, values)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: b, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(out) :: values(nlane, n_outputs)

    values = 0.0_rp
    associate (material => sim%scene%material(sim%scene%body(sim%particles%body(b))%material))
      if (allocated(material%flow)) call material%flow%describe(ps(1, sim%scene%layout%law), values)
    end associate
  end subroutine describe_block

  !> Recovery, coarsening and recrystallisation over `dt`, at the particles' temperatures.
  subroutine anneal_particles(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                  !! [s]
    integer :: b

    if (n_micro_outputs(sim) < n_outputs) return
    do b = 1, sim%particles%nblk
      associate (material => sim%scene%material(sim%scene%body(sim%particles%body(b))%material))
        if (.not. allocated(material%flow)) cycle
        call anneal_one(material%flow, dt, sim%scene%layout%law, sim%particles%nf, &
                        sim%particles%ps(:, :, b))
      end associate
    end do
  end subroutine anneal_particles

  subroutine anneal_one(law, dt, place, nf, ps)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: dt
    integer, intent(in) :: place, nf
    real(rp), intent(inout) :: ps(nlane, nf)

    call law%anneal(dt, ps(1, f_temp), ps(1, f_rate), ps(1, place))
  end subroutine anneal_one

  !> Columns of the history; means are those of stirred material, by mass.
  function micro_columns(sim) result(columns)
    type(simulation_t), intent(in) :: sim
    character(48), allocatable :: columns(:)

    allocate (columns(merge(n_columns, 0, n_micro_outputs(sim) > 0)))
    if (size(columns) > 0) columns = [character(48) :: &
      'stirred_mass[kg]', 'grain_size[m]', 'dislocation_density[1/m2]', 'wall_fraction[1]', &
      'recrystallised[1]', 'grain_size_min[m]']
  end function micro_columns

  !> Collective: the values of these columns; 0 while nothing is stirred.
  subroutine micro_row(world, sim, row)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    real(rp), intent(out) :: row(:)
    real(rp) :: values(nlane, n_outputs), sums(5), least(1), share(nlane)
    integer :: b, n

    if (size(row) == 0) return
    sums = 0.0_rp
    least = -huge(1.0_rp)
    do b = 1, sim%particles%nblk
      n = sim%particles%count(b)
      call describe_block(sim, b, sim%particles%nf, sim%particles%ps(:, :, b), values)
      associate (ps => sim%particles%ps(:, :, b))
        share = merge(ps(:, f_mass), 0.0_rp, ps(:, f_plastic) > stirred .and. values(:, 1) > 0.0_rp)
        sums = sums + [sum(share(:n)), sum(share(:n)*values(:n, 1)), sum(share(:n)*values(:n, 2)), &
                       sum(share(:n)*values(:n, 5)), sum(share(:n)*values(:n, 6))]
        least = max(least, -minval(values(:n, 1), mask=values(:n, 1) > 0.0_rp))
      end associate
    end do
    call world%sum(sums)
    call world%max(least)
    row(1) = sums(1)
    row(2:5) = 0.0_rp
    if (sums(1) > 0.0_rp) row(2:5) = sums(2:)/sums(1)
    row(6) = -least(1)
  end subroutine micro_row

  !> Collective: what kind `k` of alarm there has been on any rank, how often and where first; ''.
  subroutine alarm_message(world, sim, k, message)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: k
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: mine
    real(rp) :: counts(n_alarms)

    counts = sim%alarms
    call world%sum(counts)
    mine = ''
    associate (place => sim%alarm_place(:, k))
      if (sim%alarms(k) > 0.0_rp) mine = 'warning: until t = '//str(sim%clock%time)//' s '// &
        str(counts(k))//' particle-steps '//trim(alarm_text(k))//'; one of the first at ('// &
        str(place(3))//', '//str(place(4))//', '//str(place(5))//') m, t = '//str(place(1))// &
        ' s, '//str(place(2))//' K'
    end associate
    call world%share_message(mine, message)
  end subroutine alarm_message

end module time_microstructure
