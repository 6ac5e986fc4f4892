! SPDX-License-Identifier: MIT
!> What is done only where metal can flow: averaging of volume, velocities of the grid for output.
module setup_flow
  use base_kinds, only: rp
  use input_values, only: input_t
  use state_scene, only: average_always, average_flowing, average_never, scene_t, &
                         transfer_flip
  implicit none (type, external)
  private

  public :: read_flow

  !> Bulk over shear modulus from which elastic material locks: without averaging the pressure of
  !> neighbours in a thick tube (verify.py tube) differs by 1.5 % of this, with it by 2 to 3 %.
  real(rp), parameter :: nearly_incompressible = 6.0_rp

contains

  !> Whose volume is averaged: as FBAR says, or where metal flows, and that of bodies which are
  !> nearly incompressible; elsewhere averaging takes accuracy. Velocities of the grid are shown if
  !> particles that can flow carry others: FLIP. After the bodies and the method.
  subroutine read_flow(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    integer :: b

    do b = 1, size(scene%body)
      associate (body => scene%body(b), material => scene%material(scene%body(b)%material))
        body%averaging = average_never
        if (allocated(material%flow)) body%averaging = average_flowing
        if (material%k > nearly_incompressible*material%g) body%averaging = average_always
        if (input%given('METHOD', 1, 'FBAR')) then
          body%averaging = merge(average_always, average_never, input%logical('METHOD', 1, 'FBAR'))
        end if
      end associate
    end do
    associate (method => scene%method)
      method%fbar = any(scene%body%averaging /= average_never)
      method%shows_motion = .false.
      if (.not. method%has_mechanics .or. method%transfer /= transfer_flip) return
      method%shows_motion = any([(scene%can_flow(scene%body(b)%group), b=1, size(scene%body))])
    end associate
  end subroutine read_flow

end module setup_flow
