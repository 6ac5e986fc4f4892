! SPDX-License-Identifier: MIT
!> Scaling for larger time steps: a softer elasticity of metal that can flow, and whether nodes with
!> little mass have more inertia in this scene (selective mass scaling).
module setup_scaling
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use contact_tool, only: tool_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use physics_material, only: material_t
  use physics_stress, only: flow_strength
  use state_scene, only: scene_t, scheme_usl, transfer_flip
  implicit none (type, external)
  private

  public :: elastic_strain, is_sparse, read_elastic_scaling, read_selective_scaling, small_strain

  !> Elastic strain of metal that flows which is small against the strains of the flow, of order 1:
  !> tests/verification/ablation.md has what larger ones are worth.
  real(rp), parameter :: small_strain = 0.02_rp, large_strain = 0.05_rp
  real(rp), parameter :: cubic = 1.0_rp + 1.0e-6_rp   !! longest over shortest edge of a cube

contains

  !> Soften the materials, which stand; nothing else has looked at them.
  subroutine read_elastic_scaling(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    character(*), parameter :: key = 'ELASTIC_SCALING'
    real(rp) :: factor
    integer :: m

    factor = input%real('TIME', 1, key)
    if (factor <= 1.0_rp) return
    scene%method%elastic_scaling = factor
    if (.not. scene%method%has_mechanics) then
      call input%report(diagnostics, 'TIME', 1, key, 'has no effect with MECHANICS = F')
    else if (.not. any([(allocated(scene%material(m)%flow), m=1, size(scene%material))])) then
      call input%report(diagnostics, 'TIME', 1, key, 'has no effect: no &MATERIAL can flow (LAW)')
    else if (input%count('FIELD') > 0) then
      call input%report(diagnostics, 'TIME', 1, key, 'is wrong with a &FIELD')
    end if
    do m = 1, size(scene%material)
      if (.not. allocated(scene%material(m)%flow)) cycle
      if (abs(scene%material(m)%expansion) <= 0.0_rp) cycle
      call input%warn(diagnostics, 'MATERIAL', m, 'EXPANSION', 'gives a stress that is '// &
                      str(factor)//' times too small with ELASTIC_SCALING')
    end do
    call scene%material%soften(factor)
  end subroutine read_elastic_scaling

  !> Warn where the softer metal is strained much before it flows; materials and bodies stand.
  subroutine judge_elastic_scaling(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: strain

    if (scene%method%elastic_scaling <= 1.0_rp) return
    strain = elastic_strain(input, scene)
    if (strain <= large_strain) return
    call input%warn(diagnostics, 'TIME', 1, 'ELASTIC_SCALING', 'strains metal elastically by '// &
                    str(100.0_rp*strain)//' % before it flows, where a few are small: '// &
                    str(scene%method%elastic_scaling*small_strain/strain)//' makes that '// &
                    str(100.0_rp*small_strain)//' %')
  end subroutine judge_elastic_scaling

  !> Elastic strain sigma/E of the bodies that can flow, at the flow stress of strain and rate 1
  !> [1/s] and the temperature they begin with; the largest. 0: none flows.
  real(rp) function elastic_strain(input, scene) result(strain)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: b

    strain = 0.0_rp
    do b = 1, size(scene%body)
      if (scene%body(b)%material == 0 .or. scene%body(b)%is_rigid()) cycle
      associate (m => scene%material(scene%body(b)%material))
        strain = max(strain, strength_of(m, input%real('BODY', b, 'TEMPERATURE'), 1.0_rp) &
                             /m%young())
      end associate
    end do
  end function elastic_strain

  !> Set `scales_light_nodes`, and judge the elastic scaling; method and groups of bodies stand.
  subroutine read_selective_scaling(input, scene, tool, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(diagnostics_t), intent(inout) :: diagnostics

    call judge_elastic_scaling(input, scene, diagnostics)
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

    has_strength = .true.
    if (.not. allocated(material%flow)) return
    has_strength = strength_of(material, temperature, 0.0_rp) > 1.0e-6_rp*material%g_true
  end function has_strength

  !> Flow stress of a material in its first state at a temperature and a plastic strain, at a rate
  !> of 1/s; 0 if it does not flow [Pa].
  real(rp) function strength_of(material, temperature, strain)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: temperature, strain   !! [K], [-]
    real(rp), allocatable :: start(:)
    real(rp), dimension(nlane) :: alpha, rate, slope, strength, temp

    strength_of = 0.0_rp
    if (.not. allocated(material%flow)) return
    allocate (start(material%flow%n_state))
    call material%flow%start(start)
    alpha = strain
    rate = 1.0_rp
    temp = temperature
    call flow_strength(material, alpha, temp, rate, size(start), spread(start, 1, nlane), &
                       strength, slope)
    strength_of = strength(1)
  end function strength_of

  !> Whether some deformable body has one particle in a cell along all of `axes` axes.
  pure logical function is_sparse(scene, axes)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axes
    integer :: b

    is_sparse = .false.
    do b = 1, size(scene%body)
      if (scene%body(b)%is_rigid()) cycle
      is_sparse = is_sparse .or. count(scene%body(b)%spacing > 0.75_rp*scene%grid%h) >= axes
    end do
  end function is_sparse

  !> What in the scene its limits do not hold with; '' if nothing. With one particle in a cell along
  !> an axis, or in cells of other edges, a free elastic block gains energy at steps that are stable
  !> without it: what light nodes keep of the internal forces is missing from the particles, so
  !> that the operator from forces to velocities is not symmetric.
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
    else if (is_sparse(scene, 1)) then
      text = 'one particle in a cell along an axis: PARTICLES_PER_CELL must be 2 or more'
    else if (scene%grid%grading%axis > 0 .or. any(scene%grid%h > cubic*minval(scene%grid%h))) then
      text = 'cells that are no cubes'
    end if
  end function what_forbids

end module setup_scaling
