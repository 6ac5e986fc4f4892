! SPDX-License-Identifier: MIT
!> Whether nodes with little mass have more inertia in this scene (selective mass scaling).
module setup_scaling
  use base_kinds, only: nlane, rp
  use contact_tool, only: tool_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use physics_material, only: material_t
  use physics_stress, only: flow_strength
  use state_scene, only: scene_t, scheme_usl, transfer_flip
  implicit none (type, external)
  private

  public :: read_selective_scaling

contains

  !> Set `scales_light_nodes`; method and groups of bodies stand.
  subroutine read_selective_scaling(input, scene, tool, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(diagnostics_t), intent(inout) :: diagnostics

    scene%method%scales_light_nodes = input%switches_on( &
      diagnostics, 'METHOD', 'SELECTIVE_SCALING', what_forbids(scene), &
      is_harmless(input, scene, tool))
  end subroutine read_selective_scaling

  !> Whether it does no harm: waves are of no interest, and what a tool stirs is held; light nodes
  !> do not pass on all of the momentum of internal forces, which sets free bodies in motion, and
  !> what is molten is as free.
  logical function is_harmless(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    integer :: b

    is_harmless = scene%method%mass_scaling > 1.0_rp .and. size(tool) > 0 &
                  .and. size(scene%condition) > 0
    do b = 1, size(scene%body)
      if (.not. is_harmless) return
      is_harmless = has_strength(scene%material(scene%body(b)%material), &
                                 input%real('BODY', b, 'TEMPERATURE'))
    end do
  end function is_harmless

  !> Whether a material resists flow at a temperature: more than a millionth of its shear modulus.
  logical function has_strength(material, temperature)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: temperature         !! [K]
    real(rp), allocatable :: start(:)
    real(rp), dimension(nlane) :: none, rate, slope, strength, temp

    has_strength = .true.
    if (.not. allocated(material%flow)) return
    allocate (start(material%flow%n_state))
    call material%flow%start(start)
    none = 0.0_rp
    rate = 1.0_rp
    temp = temperature
    call flow_strength(material, none, temp, rate, size(start), spread(start, 1, nlane), strength, &
                       slope)
    has_strength = strength(1) > 1.0e-6_rp*material%g
  end function has_strength

  !> What in the scene its limits were not measured with; '' if nothing.
  pure function what_forbids(scene) result(text)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: text

    text = ''
    if (size(scene%tool_of) > 1) then
      text = 'bodies in contact'
    else if (scene%method%scheme /= scheme_usl) then
      text = 'a SCHEME other than usl'
    else if (scene%method%transfer /= transfer_flip) then
      text = 'a TRANSFER other than flip'
    else if (.not. scene%method%is_bspline) then
      text = 'a SHAPE other than bspline'
    end if
  end function what_forbids

end module setup_scaling
