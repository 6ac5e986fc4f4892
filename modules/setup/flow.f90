! SPDX-License-Identifier: MIT
!> Settings that depend on whether the material can flow plastically: averaging of the volume ratio
!> (F-bar) and output of grid velocities.
module setup_flow
  use base_kinds, only: rp
  use input_values, only: input_t
  use state_scene, only: average_always, average_flowing, average_never, scene_t, &
                         transfer_flip
  implicit none (type, external)
  private

  public :: read_flow

  !> Ratio of bulk to shear modulus above which elastic material locks. Without averaging, the
  !> pressures of neighbouring particles in a thick tube (verify.py tube) differ by 1.5 % times this
  !> ratio, with it by 2 to 3 %.
  real(rp), parameter :: nearly_incompressible = 6.0_rp

contains

  !> Choose where the volume ratio is averaged: as FBAR says, by default in flowing material and in
  !> nearly incompressible bodies (elsewhere averaging costs accuracy). Frames show velocities of
  !> the grid if those of flowing particles are noisy (FLIP). Bodies and method must have been read.
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
