! SPDX-License-Identifier: MIT
!> Diagnosis of a failed run: the particle with a non-finite state, or the fastest one.
module output_diagnostics
  use base_kinds, only: rp
  use base_text, only: str
  use base_world, only: world_t
  use particles_store, only: f_pos, f_vel, particles_t, tag_id
  use state_clock, only: clock_t
  use state_nodes, only: nodes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: describe_failure, is_finite

contains

  !> Collective. Describe a particle with a non-finite field, or else the one at the fastest node.
  subroutine describe_failure(sim, message, why)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable, intent(inout) :: message
    character(*), intent(in) :: why                  !! cause; '' if it is the speed
    character(:), allocatable :: local_message

    local_message = describe_non_finite(sim%scene, sim%particles)
    if (sim%world%all_true(local_message == '')) then
      local_message = near_fastest_node(sim%world, sim%clock, sim%particles, sim%nodes)
      if (local_message /= '' .and. why /= '') local_message = local_message//': '//why
    end if
    call sim%world%share_message(local_message, message)
    if (message == '') message = 'no time step above 0 can be taken'
    message = message//' (step '//str(sim%clock%step)//', t = '//str(sim%clock%time)//' s)'
  end subroutine describe_failure

  !> True if all fields of all particles of this rank, also sleeping ones, are finite numbers.
  pure logical function is_finite(particles)
    type(particles_t), intent(in) :: particles
    integer :: b, f, n

    is_finite = .false.
    do b = 1, particles%nblk
      n = particles%count(b)
      do f = 1, particles%nf
        if (count(abs(particles%ps(1:n, f, b)) <= huge(1.0_rp)) < n) return
      end do
    end do
    is_finite = .true.
  end function is_finite

  !> Description of the first particle of this rank with a non-finite field; '' if none.
  function describe_non_finite(scene, particles) result(text)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    character(:), allocatable :: text
    integer :: b, f, p

    text = ''
    if (is_finite(particles)) return
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        do f = 1, particles%nf
          if (abs(particles%ps(p, f, b)) <= huge(1.0_rp)) cycle
          text = describe_particle(particles, p, b, 'has a '//scene%layout%name_of(f)// &
                                   ' that is not a finite number')
          return
        end do
      end do
    end do
  end function describe_non_finite

  !> Description of the particle nearest to the fastest node, on the rank that has it; else ''.
  function near_fastest_node(world, clock, particles, nodes) result(text)
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    character(:), allocatable :: text
    real(rp) :: largest(1), mine, x(3), d, nearest
    integer :: b, p

    text = ''
    mine = 0.0_rp
    if (clock%now%fastest_node > 0) mine = clock%now%fastest_speed
    largest = mine
    call world%max(largest)
    if (clock%now%fastest_node == 0 .or. mine < largest(1)) return
    x = nodes%patch%position(clock%now%fastest_node)
    nearest = huge(1.0_rp)
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        d = norm2(particles%ps(p, f_pos:f_pos + 2, b) - x)
        if (d >= nearest) cycle
        nearest = d
        text = describe_particle(particles, p, b, 'runs away')//'; the node beside it moves at '// &
          str(largest(1))//' m/s'
      end do
    end do
  end function near_fastest_node

  !> Text with the number of a particle, what is wrong with it, its position and velocity.
  function describe_particle(particles, p, b, what) result(text)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: p, b
    character(*), intent(in) :: what
    character(:), allocatable :: text
    real(rp) :: x(3), v(3)

    x = particles%ps(p, f_pos:f_pos + 2, b)
    v = particles%ps(p, f_vel:f_vel + 2, b)
    text = 'particle '//str(tag_id(particles%tag(p, b)))//' '//what//': at ('//str(x(1))// &
           ', '//str(x(2))//', '//str(x(3))//') m with velocity ('//str(v(1))//', '// &
           str(v(2))//', '//str(v(3))//') m/s'
  end function describe_particle

end module output_diagnostics
