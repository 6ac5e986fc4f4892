! SPDX-License-Identifier: MIT
!> Set-up of heat-only scenes from the checked input: mesh, properties, films and method.
module setup_heat_scene
  use base_kinds, only: i8, rp
  use base_world, only: world_t
  use heat_alone_state, only: heat_run_t
  use heat_curve, only: make_property
  use heat_cut_mesh, only: cut_cells_t, cut_mesh
  use heat_fft, only: has_fft
  use heat_integrator, only: integrator_t
  use heat_linear, only: by_cg, by_fft, method_names, rkl2, solver_names
  use heat_petsc, only: petsc_trouble
  use heat_rates, only: heat_t
  use input_key_table, only: find
  use input_values, only: input_t
  use setup_cut_cells, only: cut_cells, make_mesh
  use setup_heat_sources, only: check_tables, n_values, read_heat_sources
  use setup_solids, only: read_all_solids, solids_t
  use state_conditions, only: clamp_groups
  use state_scene, only: scene_t, stefan_boltzmann
  implicit none (type, external)
  private

  public :: check_heat_scene, build_heat_scene

contains

  !> Check the heat conduction of a scene: missing keys, and features that this build lacks.
  subroutine check_heat_scene(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    character(16), allocatable :: unused(:)
    integer :: g, i

    if (scene%method%has_mechanics) then
      call check_coupled_heat(input, scene)
      return
    end if
    if (scene%method%heat_interval > 0) then
      call input%report('HEAT', 1, 'EVERY', 'has no effect with MECHANICS = F')
    end if
    allocate (unused, source=[character(16) :: 'TOOL', 'MOTION', 'WALL', 'LOAD', 'TRACTION', &
                              'CONTACT', 'FIELD', 'TRACER', clamp_groups])
    do g = 1, size(unused)
      do i = 1, input%count(trim(unused(g)))
        call input%report(trim(unused(g)), i, '', 'has no effect with MECHANICS = F')
      end do
    end do
    if (.not. scene%method%conducts) then
      call input%report('METHOD', 1, 'MECHANICS', 'needs a &HEAT group')
    end if
    if (any(scene%grid%period > 0)) then
      call input%report('GRID', 1, 'PERIODIC', 'does not go with MECHANICS = F')
    end if
    call check_materials(input, scene)
    if (scene%method%conducts) call check_solver(input)
    call check_tables(input)
    if (input%diagnostics%count() > 0) return
    do i = 1, input%count('SOURCE')
      if (input%text('SOURCE', i, 'KIND') /= 'stir') cycle
      if (input%text('SOURCE', i, 'CONTACT') == 'sliding') cycle
      associate (m => scene%body(1)%material)
        if (n_values(input, m, 'YIELD_TABLE') + n_values(input, m, 'YIELD_LOGISTIC') == 0) then
          call input%report('SOURCE', i, 'KIND', 'needs YIELD_TABLE or YIELD_LOGISTIC of the '// &
                            '&MATERIAL')
        end if
      end associate
    end do
  end subroutine check_heat_scene

  !> Check conduction coupled with mechanics.
  subroutine check_coupled_heat(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: i

    do i = 1, input%count('SOURCE')
      if (input%text('SOURCE', i, 'KIND') == 'stir') then
        call input%report('SOURCE', i, 'KIND', 'needs &METHOD MECHANICS = F')
      end if
    end do
    if (.not. scene%method%conducts) return
    select case (input%text('HEAT', 1, 'INTEGRATOR'))
    case ('rkl2', 'tr-bdf2')
      call input%report('HEAT', 1, 'INTEGRATOR', 'needs &METHOD MECHANICS = F')
    case default
    end select
    if (input%integer('HEAT', 1, 'EVERY') > 0) then
      if (.not. scene%method%implicit_heat) then
        call input%report('HEAT', 1, 'EVERY', "needs INTEGRATOR = 'backward-euler'")
      end if
      if (scene%method%heat_step > 0.0_rp) then
        call input%report('HEAT', 1, 'EVERY', 'does not go with STEP')
      end if
    end if
    if (input%text('HEAT', 1, 'SOLVER') == 'fftw') then
      call input%report('HEAT', 1, 'SOLVER', 'needs &METHOD MECHANICS = F: beside mechanics it '// &
                        'is cg or petsc')
    end if
    if (input%text('HEAT', 1, 'SOLVER') /= 'auto' .and. .not. scene%method%implicit_heat) then
      call input%report('HEAT', 1, 'SOLVER', 'needs an implicit INTEGRATOR')
    end if
    call check_solver(input)
  end subroutine check_coupled_heat

  !> Check that several materials have constant properties and conduct.
  subroutine check_materials(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: i, m

    if (all(scene%body%material == scene%body(1)%material)) return
    do i = 1, size(scene%body)
      m = scene%body(i)%material
      if (allocated(scene%material(m)%c_table) .or. allocated(scene%material(m)%k_table)) then
        call input%report('BODY', i, 'MATERIAL', 'with MECHANICS = F tables need all bodies to '// &
                          'be of one material')
      end if
      if (input%real('MATERIAL', m, 'CONDUCTIVITY') <= 0.0_rp) then
        call input%report('BODY', i, 'MATERIAL', 'must have a CONDUCTIVITY above 0 with '// &
                          'MECHANICS = F')
      end if
    end do
  end subroutine check_materials

  !> Report a solver that this build lacks.
  subroutine check_solver(input)
    type(input_t), intent(in) :: input
    character(:), allocatable :: trouble

    select case (input%text('HEAT', 1, 'SOLVER'))
    case ('petsc')
      trouble = petsc_trouble()
      if (trouble /= '') call input%report('HEAT', 1, 'SOLVER', trouble)
    case ('fftw')
      if (.not. has_fft) call input%report('HEAT', 1, 'SOLVER', 'this program was built '// &
                                           'without FFTW (Debian: libfftw3-dev; '// &
                                           '-DSTIRPOINT_FFTW=ON)')
    case default
    end select
  end subroutine check_solver

  !> Build mesh, properties, films, sources, initial state and method. The scene must have no
  !> errors.
  subroutine build_heat_scene(world, input, scene, run)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    type(solids_t), allocatable :: solids(:)
    type(cut_cells_t) :: cuts
    real(rp), allocatable :: t_c(:), c(:), t_k(:), k(:), capacity(:)
    integer :: b, m

    m = scene%body(1)%material
    allocate (c, source=[input%real('MATERIAL', m, 'SPECIFIC_HEAT')])
    k = [input%real('MATERIAL', m, 'CONDUCTIVITY')]
    t_c = [298.0_rp]
    t_k = t_c
    associate (material => scene%material(m))
      if (allocated(material%c_table)) then
        t_c = material%c_table%t
        c = material%c_table%y
      end if
      if (allocated(material%k_table)) then
        t_k = material%k_table%t
        k = material%k_table%y
      end if
    end associate
    associate (heat => run%heat)
      heat%property = make_property(scene%material(m)%rho, t_c, c, t_k, k)
      call read_all_solids(input, solids)
      call make_mesh(world, scene%grid%h, solids, heat%mesh)
      call cut_cells(solids, heat%mesh, cuts)
      heat%conductivity = [(input%real('MATERIAL', scene%body(b)%material, 'CONDUCTIVITY'), &
                            b=1, size(solids))]
      if (allocated(scene%material(m)%k_table)) heat%conductivity = heat%property%k_ref
      capacity = [(scene%material(scene%body(b)%material)%rho &
                   *input%real('MATERIAL', scene%body(b)%material, 'SPECIFIC_HEAT'), &
                   b=1, size(solids))]
      if (allocated(scene%material(m)%c_table)) then
        capacity = heat%property%rho*heat%property%c_ref
      end if
      call cut_mesh(heat%mesh, cuts, heat%property, heat%conductivity, capacity)
      call heat%add_films( &
        reshape([(scene%body(b)%film%coefficient, b=1, size(solids))], [6, size(solids)]), &
        stefan_boltzmann &
        *reshape([(scene%body(b)%film%emissivity, b=1, size(solids))], [6, size(solids)]), &
        reshape([(scene%body(b)%film%ambient, b=1, size(solids))], [6, size(solids)]))
      call read_heat_sources(input, m, heat%property%k_ref, heat%property%rho*heat%property%c_ref, &
                             heat%source)
      call heat%prepare(world)
      heat%theta(1:heat%size()) = heat%property%state_at( &
        [(input%real('BODY', heat%mesh%body(b), 'TEMPERATURE'), b=1, heat%size())])
    end associate
    call choose_method(world, input, run%heat, run%integrator)
  end subroutine build_heat_scene

  !> Set integrator and linear solver by their names; choose a solver with 'auto'.
  subroutine choose_method(world, input, heat, integrator)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(heat_t), intent(in) :: heat
    type(integrator_t), intent(inout) :: integrator

    integrator%method = find(method_names, input%text('HEAT', 1, 'INTEGRATOR'))
    if (integrator%method == 0) integrator%method = rkl2
    integrator%tolerance = input%real('HEAT', 1, 'TOLERANCE')
    integrator%fixed = input%real('HEAT', 1, 'STEP')
    integrator%implicit%solver = find(solver_names, input%text('HEAT', 1, 'SOLVER'))
    if (integrator%implicit%solver == 0) integrator%implicit%solver = fastest_solver(world, heat)
    integrator%implicit%tolerance = 0.1_rp*integrator%tolerance
  end subroutine choose_method

  !> Collective. Fastest solver by measurement (docs/heat.md). In a box of constant properties FFTW
  !> solves directly; in other solids of one material with many cells it is a better preconditioner
  !> than the diagonal.
  integer function fastest_solver(world, heat)
    type(world_t), intent(in) :: world
    type(heat_t), intent(in) :: heat
    integer(i8), parameter :: min_cells = 50000_i8
    integer(i8) :: cells(3)

    cells = [count(heat%mesh%capacity > 0.0_rp, kind=i8), size(heat%mesh%void, kind=i8), &
             size(heat%mesh%irregular, kind=i8)]
    call world%sum(cells)
    fastest_solver = by_cg
    if (.not. has_fft) return
    if (heat%property%is_constant .and. sum(cells(2:)) == 0) fastest_solver = by_fft
    if (cells(1) > min_cells .and. all(abs(heat%conductivity &
                                           - heat%conductivity(1)) <= 0.0_rp)) then
      fastest_solver = by_fft
    end if
  end function fastest_solver

end module setup_heat_scene
