! SPDX-License-Identifier: MIT
!> Tools that are pressed with a force or hang on a machine that gives: their motion along their
!> axes (contact_motion).
module step_drives
  use base_kinds, only: rp
  use comm_world, only: world_t
  use contact_tool, only: s_force
  use step_simulation, only: simulation_t
  implicit none (type, external)
  private

  public :: note_impulses, drive_tools

contains

  !> Before a step: what the books of the tools hold.
  pure subroutine note_impulses(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: k

    do k = 1, size(sim%tool)
      sim%tool(k)%drive%noted = sim%tool(k)%sums(s_force:s_force + 2)
    end do
  end subroutine note_impulses

  !> Collective, at the end of a step of `dt`, whose time the clock has not yet: what the bodies
  !> pushed with moves the tools along their axes in the next one.
  subroutine drive_tools(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt                   !! [s]
    real(rp) :: impulse(size(sim%tool)), force
    logical :: presses
    integer :: k

    if (.not. any(sim%tool%drive%is_free)) return
    do k = 1, size(sim%tool)
      associate (tool => sim%tool(k))
        impulse(k) = dot_product(tool%sums(s_force:s_force + 2) - tool%drive%noted, &
                                 tool%drive%axis)
      end associate
    end do
    call world%sum(impulse)
    do k = 1, size(sim%tool)
      associate (tool => sim%tool(k), drive => sim%tool(k)%drive)
        call drive%enter_phase(tool%motion%phase_at(sim%clock%time + dt))
        call tool%motion%pressing(sim%clock%time + dt, drive%begin, presses, force)
        call drive%follow(dt, impulse(k)/dt, presses, force, sim%clock%mass_scaling)
      end associate
    end do
  end subroutine drive_tools

end module step_drives
