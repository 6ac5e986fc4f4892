! SPDX-License-Identifier: MIT
!> Materials from the input: elasticity, heat, and the flow law that LAW names.
module materials_properties
  use base_kinds, only: rp
  use flow_laws_list, only: make_law
  use input_diagnostics, only: diagnostics_t
  use input_tables, only: rises
  use input_values, only: input_t
  use keys_names, only: find
  use physics_material, only: heat_table_t, material_t
  implicit none (type, external)
  private

  public :: read_materials

  real(rp), parameter :: reference = 298.0_rp   !! temperature of c_p from a table [K]

contains

  !> Read all materials in the order of the file.
  subroutine read_materials(input, material, diagnostics)
    type(input_t), intent(in) :: input
    type(material_t), allocatable, intent(out) :: material(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    logical :: is_given
    integer :: i

    allocate (material(input%count('MATERIAL')))
    do i = 1, size(material)
      associate (m => material(i))
        m%name = input%text('MATERIAL', i, 'NAME')
        m%rho = input%real('MATERIAL', i, 'DENSITY')
        m%has_heat_capacity = input%given('MATERIAL', i, 'SPECIFIC_HEAT')
        if (m%has_heat_capacity) m%c_p = input%real('MATERIAL', i, 'SPECIFIC_HEAT')
        call read_table(input, i, 'SPECIFIC_HEAT_TABLE', m%c_table, diagnostics)
        call read_table(input, i, 'CONDUCTIVITY_TABLE', m%k_table, diagnostics)
        if (allocated(m%c_table)) then
          m%has_heat_capacity = .true.
          m%c_p = m%c_table%at(reference)
        end if
        is_given = input%given('MATERIAL', i, 'T_MELT')
        if (is_given) m%t_melt = input%real('MATERIAL', i, 'T_MELT')
        m%conductivity = input%real('MATERIAL', i, 'CONDUCTIVITY')
        m%plastic_heat = input%real('MATERIAL', i, 'PLASTIC_HEAT')
        call read_elasticity(input, i, m, diagnostics)
        call make_law(input%text('MATERIAL', i, 'LAW'), m%flow)
        if (allocated(m%flow)) call m%flow%read_keys(input, i, m%g, diagnostics)
        if (find(material(:i - 1)%name, m%name) > 0) then
          call input%report(diagnostics, 'MATERIAL', i, 'NAME', 'another material has this name')
        end if
      end associate
    end do
  end subroutine read_materials

  !> Read a table over temperature, if given.
  subroutine read_table(input, i, key, table, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    type(heat_table_t), allocatable, intent(out) :: table
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp), allocatable :: x(:)
    logical :: is_given

    is_given = input%given('MATERIAL', i, key)
    if (.not. is_given) return
    x = input%list('MATERIAL', i, key)
    if (mod(size(x), 2) == 1 .or. .not. rises(x(1::2))) then
      call input%report(diagnostics, 'MATERIAL', i, key, 'must be pairs in rising temperature')
    else if (any(x(2::2) <= 0.0_rp)) then
      call input%report(diagnostics, 'MATERIAL', i, key, 'must be above 0')
    else
      allocate (table)
      call table%init(size(x)/2, x(1::2), x(2::2))
    end if
  end subroutine read_table

  !> Read the elastic constants and thermal expansion.
  subroutine read_elasticity(input, i, material, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(inout) :: material
    type(diagnostics_t), intent(inout) :: diagnostics

    call material%set_elastic(input%real('MATERIAL', i, 'YOUNGS_MODULUS'), &
                              input%real('MATERIAL', i, 'POISSON_RATIO'))
    material%expansion = input%real('MATERIAL', i, 'EXPANSION')
    material%t_ref = input%real('MATERIAL', i, 'T_ROOM')
    material%is_coupled = input%text('MATERIAL', i, 'ENERGY') == 'coupled'
    if (.not. material%is_coupled) return
    if (input%text('MATERIAL', i, 'LAW') /= 'elastic') then
      call input%report(diagnostics, 'MATERIAL', i, 'ENERGY', "goes only with LAW = 'elastic'")
    end if
    if (abs(material%expansion) > 0.0_rp) then
      call input%report(diagnostics, 'MATERIAL', i, 'EXPANSION', &
                        "must be 0 with ENERGY = 'coupled'")
    end if
  end subroutine read_elasticity

end module materials_properties
