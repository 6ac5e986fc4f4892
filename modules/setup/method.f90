! SPDX-License-Identifier: MIT
!> Settings that depend on materials, bodies and tools: storage and warnings of the flow laws,
!> averaging of the volume ratio (F-bar), scaling for larger time steps, sleeping material.
module setup_method
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use input_values, only: input_t
  use physics_material, only: material_t
  use physics_stress, only: compute_flow_strength
  use state_scene, only: average_always, average_flowing, average_never, scene_t, scheme_usl, &
                              transfer_flip
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: elastic_strain, flow_stress_of, is_sparse, lay_out_laws, read_elastic_scaling, &
            read_flow, read_selective_scaling, read_sleeping, shortest_domain, small_strain

  !> Ratio of bulk to shear modulus above which elastic material locks. Without averaging, the
  !> pressures of neighbouring particles in a thick tube (verify.py tube) differ by 1.5 % times this
  !> ratio, with it by 2 to 3 %.
  real(rp), parameter :: nearly_incompressible = 6.0_rp

  !> Elastic strains of flowing material [-]: recommended, and the largest without a warning.
  !> Plastic strains are of order 1; tests/verification/ablation.md has the errors caused by larger
  !> elastic strains.
  real(rp), parameter :: small_strain = 0.02_rp, large_strain = 0.05_rp
  real(rp), parameter :: cubic = 1.0_rp + 1.0e-6_rp   !! largest edge ratio of a cube
  !> Largest ratio of neighbouring cells with selective scaling.
  real(rp), parameter :: max_growth = 1.3_rp + 1.0e-6_rp

contains

  !> Reserve particle storage for internal variables of the flow laws; list the warnings of the
  !> laws.
  subroutine lay_out_laws(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    integer :: m

    allocate (scene%warning(0))
    associate (layout => scene%layout)
      do m = 1, size(scene%material)
        if (.not. allocated(scene%material(m)%flow)) cycle
        call list_warnings(scene%material(m), scene%warning)
        layout%n_law = max(layout%n_law, scene%material(m)%flow%n_state)
        if (scene%material(m)%flow%anneals .and. .not. scene%method%conducts) then
          call input%report('MATERIAL', m, '', scene%material(m)%flow%annealing_keys()// &
                            ' go with the conduction steps: there is no &HEAT')
        end if
      end do
      if (layout%n_law == 0) return
      layout%law = 0
      call layout%add(layout%n_law, 'state of its flow law', layout%law)
    end associate
  end subroutine lay_out_laws

  !> Add the warnings of a material's flow law to those of the scene, without duplicates.
  subroutine list_warnings(material, all)
    type(material_t), intent(inout) :: material
    character(48), allocatable, intent(inout) :: all(:)
    character(48), allocatable :: own(:)
    integer :: k

    call material%flow%list_warnings(own)
    do k = 1, size(own)
      if (.not. any(all == own(k))) all = [all, own(k)]
      material%warning(k) = findloc(all, own(k), dim=1)
    end do
  end subroutine list_warnings

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
      if (.not. method%shows_motion) return
      call scene%layout%add(1, 'empty part of its room', scene%layout%void)
      call scene%layout%add(1, 'porosity of metal', scene%layout%porosity)
    end associate
  end subroutine read_flow

  !> Divide the elastic moduli of materials that can flow by ELASTIC_SCALING. Materials must have
  !> been read, and nothing derived from their moduli yet.
  subroutine read_elastic_scaling(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    character(*), parameter :: key = 'ELASTIC_SCALING'
    real(rp) :: factor
    integer :: m

    factor = input%real('TIME', 1, key)
    if (factor <= 1.0_rp) return
    scene%method%elastic_scaling = factor
    if (.not. scene%method%has_mechanics) then
      call input%report('TIME', 1, key, 'has no effect with MECHANICS = F')
    else if (.not. any([(allocated(scene%material(m)%flow), m=1, size(scene%material))])) then
      call input%report('TIME', 1, key, 'has no effect: no &MATERIAL can flow (LAW)')
    else if (input%count('FIELD') > 0) then
      call input%report('TIME', 1, key, 'is wrong with a &FIELD')
    end if
    do m = 1, size(scene%material)
      if (.not. allocated(scene%material(m)%flow)) cycle
      if (abs(scene%material(m)%expansion) <= 0.0_rp) cycle
      call input%warn('MATERIAL', m, 'EXPANSION', 'gives a stress that is '//str(factor)// &
                      ' times too small with ELASTIC_SCALING')
    end do
    call scene%material%scale_moduli(factor)
  end subroutine read_elastic_scaling

  !> Largest elastic strain sigma/E of the bodies that can flow, at their initial temperature, a
  !> plastic strain of 1 and a strain rate of 1/s; 0 if no body can flow [-].
  real(rp) function elastic_strain(input, scene) result(strain)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: b

    strain = 0.0_rp
    do b = 1, size(scene%body)
      if (scene%body(b)%material == 0 .or. scene%body(b)%is_rigid()) cycle
      associate (m => scene%material(scene%body(b)%material))
        strain = max(strain, flow_stress_of(m, input%real('BODY', b, 'TEMPERATURE'), 1.0_rp) &
                             /m%young())
      end associate
    end do
  end function elastic_strain

  !> Decide on selective mass scaling; warn if the elastic scaling leads to large elastic strains of
  !> metal before it flows. Method, bodies and groups of bodies must have been read.
  subroutine read_selective_scaling(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), intent(in) :: tool(:)
    real(rp) :: strain

    strain = 0.0_rp
    if (scene%method%elastic_scaling > 1.0_rp) strain = elastic_strain(input, scene)
    if (strain > large_strain) then
      call input%warn('TIME', 1, 'ELASTIC_SCALING', 'strains metal elastically by '// &
                      str(100.0_rp*strain)//' % before it flows, where a few are small: '// &
                      str(scene%method%elastic_scaling*small_strain/strain)//' makes that '// &
                      str(100.0_rp*small_strain)//' %')
    end if
    scene%method%scales_light_nodes = input%switches_on('METHOD', 'SELECTIVE_SCALING', &
      obstacle_to_scaling(scene), is_harmless(input, scene, tool))
  end subroutine read_selective_scaling

  !> True if selective mass scaling is safe: the process is quasi-static (mass scaling) and the body
  !> at the tool is held by walls or clamps and is not molten (its flow stress is above a millionth
  !> of the shear modulus). Light nodes lose part of the momentum
  !> of internal forces, which would set a free body in motion.
  logical function is_harmless(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    integer :: b

    is_harmless = scene%method%mass_scaling > 1.0_rp .and. size(tool) > 0 &
                  .and. size(scene%condition) > 0
    do b = 1, size(scene%body)
      if (.not. is_harmless) return
      associate (material => scene%material(scene%body(b)%material))
        if (allocated(material%flow)) is_harmless = flow_stress_of(material, &
          input%real('BODY', b, 'TEMPERATURE'), 0.0_rp) > 1.0e-6_rp*material%g_true
      end associate
    end do
  end function is_harmless

  !> Flow stress of a material with initial internal variables at a strain rate of 1/s; 0 if it has
  !> no flow law [Pa].
  real(rp) function flow_stress_of(material, temperature, strain)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: temperature         !! [K]
    real(rp), intent(in) :: strain              !! equivalent plastic strain [-]
    real(rp), allocatable :: initial(:)
    real(rp), dimension(nlane) :: alpha, rate, slope, strength, temp

    flow_stress_of = 0.0_rp
    if (.not. allocated(material%flow)) return
    allocate (initial(material%flow%n_state))
    call material%flow%start(initial)
    alpha = strain
    rate = 1.0_rp
    temp = temperature
    call compute_flow_strength(material, alpha, temp, rate, size(initial), &
                               spread(initial, 1, nlane), strength, slope)
    flow_stress_of = strength(1)
  end function flow_stress_of

  !> True if a deformable body has one particle per cell along at least `axes` of the axes.
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

  !> Least half length of a domain times the square of the edge of the cell along it over the
  !> shortest edge [cells]; 1/2 where domains follow the stretch of their particles (cpGIMP).
  pure real(rp) function shortest_domain(scene)
    type(scene_t), intent(in) :: scene
    integer :: b

    shortest_domain = 0.5_rp
    if (scene%layout%half > 0) return
    do b = 1, size(scene%body)
      if (scene%body(b)%is_rigid()) cycle
      shortest_domain = min(shortest_domain, minval(scene%domain(b)*(scene%grid%h &
                                                                     /minval(scene%grid%h))**2))
    end do
  end function shortest_domain

  !> Reason why selective mass scaling is not possible in this scene; '' if it is. With one particle
  !> per cell along an axis, smallest cells that are not cubes, or cells that grow by more than 0.3
  !> from one to the next, a free elastic block gains energy at time steps that are stable without
  !> the scaling: light nodes withhold part of the internal forces from the particles, which makes
  !> the operator from forces to velocities non-symmetric.
  pure function obstacle_to_scaling(scene) result(text)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: text
    integer :: a

    text = ''
    if (size(scene%tool_of) > 1) then
      text = 'bodies in contact'
    else if (scene%method%transfer /= transfer_flip) then
      text = 'a TRANSFER other than flip'
    else if (.not. scene%method%is_bspline) then
      text = 'a SHAPE other than bspline'
    else if (is_sparse(scene, 1)) then
      text = 'one particle in a cell along an axis: PARTICLES_PER_CELL must be 2 or more'
    else if (any(scene%grid%h > cubic*minval(scene%grid%h))) then
      text = 'cells that are no cubes'
    else
      do a = 1, 3
        if (.not. scene%grid%grading(a)%is_graded) cycle
        if (scene%grid%grading(a)%growth() <= max_growth) cycle
        text = 'cells that grow by more than 0.3'
      end do
    end if
  end function obstacle_to_scaling

  !> Fill `scene%method%sleep`. Tools, bodies and groups of bodies must have been read.
  subroutine read_sleeping(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(tool_t), intent(in) :: tool(:)

    associate (sleep => scene%method%sleep)
      sleep%is_on = input%switches_on('METHOD', 'SLEEPING', obstacle_to_sleep(input, scene, tool), &
                                      scene%method%mass_scaling > 1.0_rp)
      if (.not. sleep%is_on) return
      sleep%distance = input%real('METHOD', 1, 'SLEEP_DISTANCE')
      if (sleep%distance <= 0.0_rp) sleep%distance = 0.5_rp*maxval(tool%stirring_radius())
      sleep%stress = input%real('METHOD', 1, 'SLEEP_STRESS')
      sleep%heat = input%real('METHOD', 1, 'SLEEP_HEAT')
    end associate
    call scene%layout%add(1, 'temperature at falling asleep', scene%layout%rest)
  end subroutine read_sleeping

  !> Reason why material cannot sleep in this scene; '' if it can.
  function obstacle_to_sleep(input, scene, tool) result(text)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    character(:), allocatable :: text
    integer :: i

    text = ''
    if (size(tool) == 0) then
      text = 'no &TOOL'
    else if (.not. all(tool%has_shape()) .or. size(scene%tool_of) > 1) then
      text = 'bodies in contact'
    else if (any([(input%given('CLAMP', i, 'UNTIL'), i=1, input%count('CLAMP'))])) then
      text = 'a &CLAMP that is released'
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
  end function obstacle_to_sleep

end module setup_method
