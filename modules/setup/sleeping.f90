! SPDX-License-Identifier: MIT
!> Settings for sleeping material: particles at rest that skip the stress update.
module setup_sleeping
  use base_kinds, only: rp
  use contact_tool, only: tool_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use state_scene, only: scene_t, scheme_usl, transfer_flip
  implicit none (type, external)
  private

  public :: read_sleeping

contains

  !> Fill `scene%method%sleep`. Tools, bodies and groups of bodies must have been read.
  subroutine read_sleeping(input, scene, tool, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (sleep => scene%method%sleep)
      sleep%is_on = input%switches_on(diagnostics, 'METHOD', 'SLEEPING', &
                                      obstacle_in(input, scene, tool), &
                                      is_quasi_static(scene))
      if (.not. sleep%is_on) return
      sleep%distance = input%real('METHOD', 1, 'SLEEP_DISTANCE')
      if (sleep%distance <= 0.0_rp) sleep%distance = 0.5_rp*maxval(tool%stirring_radius())
      sleep%stress = input%real('METHOD', 1, 'SLEEP_STRESS')
      sleep%heat = input%real('METHOD', 1, 'SLEEP_HEAT')
    end associate
    call scene%layout%add(1, scene%layout%rest)
  end subroutine read_sleeping

  !> True if stress waves are not resolved physically, as the inertia is scaled.
  pure logical function is_quasi_static(scene)
    type(scene_t), intent(in) :: scene

    is_quasi_static = scene%method%mass_scaling > 1.0_rp
  end function is_quasi_static

  !> Reason why material cannot sleep in this scene; '' if it can.
  function obstacle_in(input, scene, tool) result(text)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    character(:), allocatable :: text

    text = ''
    if (size(tool) == 0) then
      text = 'no &TOOL'
    else if (.not. all(tool%has_shape()) .or. size(scene%tool_of) > 1) then
      text = 'bodies in contact'
    else if (input%count('LOAD') > 0) then
      text = 'a &LOAD'
    else if (input%count('FIELD') > 0) then
      text = 'a &FIELD'
    else if (any(scene%grid%period > 0)) then
      text = 'a periodic grid'
    else if (scene%method%scheme /= scheme_usl) then
      text = 'a SCHEME other than usl'
    else if (scene%method%transfer /= transfer_flip) then
      text = 'a TRANSFER other than flip'
    end if
  end function obstacle_in

end module setup_sleeping
