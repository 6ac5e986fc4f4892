! SPDX-License-Identifier: MIT
!> What is done only where metal can flow: removal of null modes, averaging of volume.
module setup_flow
  use base_kinds, only: rp
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use state_scene, only: scene_t, scheme_usl, transfer_flip
  implicit none (type, external)
  private

  public :: read_averaging, read_null_modes

  !> Bulk over shear modulus from which elastic material locks: without averaging the pressure of
  !> neighbours in a thick tube (verify.py tube) differs by 1.5 % of this, with it by 2 to 3 %.
  real(rp), parameter :: nearly_incompressible = 6.0_rp

contains

  !> Whose volume is averaged: as FBAR says, or that of bodies which can flow or are nearly
  !> incompressible. Elsewhere averaging takes accuracy.
  subroutine read_averaging(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    integer :: b

    do b = 1, size(scene%body)
      associate (body => scene%body(b), material => scene%material(scene%body(b)%material))
        body%averages_volume = allocated(material%flow) &
          .or. material%k > nearly_incompressible*material%g
        if (input%given('METHOD', 1, 'FBAR')) then
          body%averages_volume = input%logical('METHOD', 1, 'FBAR')
        end if
      end associate
    end do
    scene%method%fbar = any(scene%body%averages_volume)
  end subroutine read_averaging

  !> NULL_CELLS in steps: after the materials, bodies and the Courant number of the method. An
  !> error if it is given for a scheme that it is not for.
  subroutine read_null_modes(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: cells, courant
    integer :: k, m

    associate (method => scene%method)
      if (method%transfer /= transfer_flip) return
      cells = input%real('METHOD', 1, 'NULL_CELLS')
      if (method%scheme /= scheme_usl .or. input%count('CONTACT') > 0) then
        if (input%given('METHOD', 1, 'NULL_CELLS') .and. cells > 0.0_rp) then
          call input%report(diagnostics, 'METHOD', 1, 'NULL_CELLS', &
                            'is for SCHEME = usl only, and not beside &CONTACT')
        end if
        return
      end if
      if (cells <= 0.0_rp .or. .not. method%has_mechanics) return
      if (.not. any([(scene%can_flow(scene%body(k)%group), k=1, size(scene%body))])) return
      courant = method%cfl
      if (method%fixed_dt > 0.0_rp .and. scene%grid%h > 0.0_rp) then
        courant = method%fixed_dt/scene%grid%h/sqrt(method%mass_scaling) &
                  *maxval([(scene%material(m)%wave_speed(), m=1, size(scene%material))])
      end if
      method%null_steps = nint(max(1.0_rp, min(1.0e6_rp, cells/max(courant, tiny(1.0_rp)))))
    end associate
    call scene%layout%add(3, scene%layout%seen)
  end subroutine read_null_modes

end module setup_flow
