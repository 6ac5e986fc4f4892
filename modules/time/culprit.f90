! SPDX-License-Identifier: MIT
!> Which particle is to blame when no step is possible any more.
module time_culprit
  use base_kinds, only: rp
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_pos, f_vel, tag_id
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: name_culprit, not_a_number

contains

  !> Collective: name a particle that is not a number, or the one at the fastest node.
  subroutine name_culprit(world, sim, message)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: mine

    mine = not_a_number(sim)
    if (world%all_true(mine == '')) mine = near_fastest_node(world, sim)
    call world%share_message(mine, message)
    message = message//' (step '//str(sim%clock%step)//', t = '//str(sim%clock%time)//' s)'
  end subroutine name_culprit

  !> First particle of this rank with a field that is not a finite number; '' if none.
  function not_a_number(sim) result(text)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: text
    integer :: b, p

    text = ''
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        if (all(abs(sim%particles%ps(p, :, b)) <= huge(1.0_rp))) cycle
        text = named(sim, p, b, 'has a state that is not a finite number')
        return
      end do
    end do
  end function not_a_number

  !> The particle nearest to the fastest node of all ranks.
  function near_fastest_node(world, sim) result(text)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: text
    real(rp) :: most(1), mine, x(3), d, least
    integer :: b, p, q

    text = ''
    mine = 0.0_rp
    if (sim%fastest_node > 0) mine = sim%fastest_speed
    most = mine
    call world%max(most)
    if (sim%fastest_node == 0 .or. mine < most(1)) return
    q = sim%fastest_node - 1
    x = sim%patch%origin + sim%patch%h*real([q/sim%patch%stride(1), &
        mod(q, sim%patch%stride(1))/sim%patch%stride(2), mod(q, sim%patch%stride(2))], rp)
    least = huge(1.0_rp)
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        d = norm2(sim%particles%ps(p, f_pos:f_pos + 2, b) - x)
        if (d >= least) cycle
        least = d
        text = named(sim, p, b, 'runs away')//'; the node beside it moves at '//str(most(1))// &
               ' m/s'
      end do
    end do
  end function near_fastest_node

  !> Number of a particle, what happened to it, its place and velocity.
  function named(sim, p, b, what) result(text)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: p, b
    character(*), intent(in) :: what
    character(:), allocatable :: text
    real(rp) :: x(3), v(3)

    x = sim%particles%ps(p, f_pos:f_pos + 2, b)
    v = sim%particles%ps(p, f_vel:f_vel + 2, b)
    text = 'particle '//str(tag_id(sim%particles%tag(p, b)))//' '//what//': at ('//str(x(1))// &
           ', '//str(x(2))//', '//str(x(3))//') m with velocity ('//str(v(1))//', '// &
           str(v(2))//', '//str(v(3))//') m/s'
  end function named

end module time_culprit
