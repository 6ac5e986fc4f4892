! SPDX-License-Identifier: MIT
!> Materials from the input: elasticity, heat, and the flow law that LAW names; checks that the
!> thermal properties needed by the scene are given, as none has a default.
module setup_materials
  use base_kinds, only: rp
  use input_tables, only: rises
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t
  use physics_laws, only: make_law
  use physics_material, only: heat_table_t, material_t
  implicit none (type, external)
  private

  public :: check_properties, read_materials, require_property

  character(*), parameter :: group = 'MATERIAL'
  real(rp), parameter :: reference = 298.0_rp   !! temperature of c_p from a table [K]

contains

  !> Read all materials in the order of the file.
  subroutine read_materials(input, material)
    type(input_t), intent(in) :: input
    type(material_t), allocatable, intent(out) :: material(:)
    integer :: i

    allocate (material(input%count(group)))
    do i = 1, size(material)
      associate (m => material(i))
        m%name = input%text(group, i, 'NAME')
        m%rho = input%real(group, i, 'DENSITY')
        m%has_heat_capacity = input%given(group, i, 'SPECIFIC_HEAT')
        if (m%has_heat_capacity) m%c_p = input%real(group, i, 'SPECIFIC_HEAT')
        call read_table(input, i, 'SPECIFIC_HEAT_TABLE', m%c_table)
        call read_table(input, i, 'CONDUCTIVITY_TABLE', m%k_table)
        if (allocated(m%c_table)) then
          m%has_heat_capacity = .true.
          m%c_p = m%c_table%at(reference)
        end if
        m%t_melt = input%real(group, i, 'T_MELT', otherwise=m%t_melt)
        m%conductivity = input%real(group, i, 'CONDUCTIVITY')
        m%plastic_heat = input%real(group, i, 'PLASTIC_HEAT')
        call read_elasticity(input, i, m)
        call make_law(input%text(group, i, 'LAW'), m%flow)
        if (allocated(m%flow)) call m%flow%read_keys(input, i, m%g)
      end associate
    end do
  end subroutine read_materials

  !> Read a table over temperature, if given.
  subroutine read_table(input, i, key, table)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    type(heat_table_t), allocatable, intent(out) :: table
    real(rp), allocatable :: x(:)

    if (.not. input%given(group, i, key)) return
    x = input%list(group, i, key)
    if (mod(size(x), 2) == 1 .or. .not. rises(x(1::2))) then
      call input%report(group, i, key, 'must be pairs in rising temperature')
    else if (any(x(2::2) <= 0.0_rp)) then
      call input%report(group, i, key, 'must be above 0')
    else
      allocate (table)
      call table%init(size(x)/2, x(1::2), x(2::2))
    end if
  end subroutine read_table

  !> Read the elastic constants and thermal expansion.
  subroutine read_elasticity(input, i, material)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(inout) :: material

    call material%set_elastic(input%real(group, i, 'YOUNGS_MODULUS'), &
                              input%real(group, i, 'POISSON_RATIO'))
    material%expansion = input%real(group, i, 'EXPANSION')
    material%t_ref = input%real(group, i, 'T_ROOM')
    material%is_coupled = input%text(group, i, 'ENERGY') == 'coupled'
    if (.not. material%is_coupled) return
    if (input%text(group, i, 'LAW') /= 'elastic') then
      call input%report(group, i, 'ENERGY', "goes only with LAW = 'elastic'")
    end if
    if (abs(material%expansion) > 0.0_rp) then
      call input%report(group, i, 'EXPANSION', "must be 0 with ENERGY = 'coupled'")
    end if
  end subroutine read_elasticity

  !> Report missing properties of materials with the reason for which they are needed, and
  !> properties without effect.
  subroutine check_properties(input)
    type(input_t), intent(in) :: input
    character(:), allocatable :: heated, law
    class(flow_law_t), allocatable :: flow
    logical :: is_heat_only, conducts, has_own_melting
    integer :: i

    conducts = input%count('HEAT') > 0
    is_heat_only = .not. input%logical('METHOD', 1, 'MECHANICS')
    do i = 1, input%count(group)
      law = input%text(group, i, 'LAW')
      call make_law(law, flow)
      has_own_melting = .false.
      if (allocated(flow)) has_own_melting = flow%has_own_melting()
      heated = ''
      if (law /= 'elastic' .and. .not. is_heat_only .and. &
          input%real(group, i, 'PLASTIC_HEAT') > 0.0_rp) then
        heated = 'plastic work heats it (PLASTIC_HEAT)'
      end if
      if (conducts) heated = 'the scene conducts heat (&HEAT)'
      if (heated /= '' .and. .not. input%given(group, i, 'SPECIFIC_HEAT_TABLE')) then
        call require_property(input, i, 'SPECIFIC_HEAT', heated)
      end if
      if (conducts .and. .not. input%given(group, i, 'CONDUCTIVITY_TABLE')) then
        call require_property(input, i, 'CONDUCTIVITY', heated)
      end if
      if (has_own_melting .and. .not. is_heat_only) then
        call require_property(input, i, 'T_MELT', "LAW = '"//law//"' softens towards it")
      else if (law /= 'elastic' .and. .not. is_heat_only .and. heated /= '') then
        call require_property(input, i, 'T_MELT', heated//', and molten it has no strength')
      else if (input%count('SOURCE') > 0) then
        call require_property(input, i, 'T_MELT', 'a &SOURCE may melt it')
      end if
      if (input%given(group, i, 'T_ROOM') .and. .not. has_own_melting .and. abs(input%real(group, &
        i, 'EXPANSION')) <= 0.0_rp) call input%report(group, i, 'T_ROOM', &
        "has no effect: LAW = '"//law//"' does not heed it, EXPANSION is 0")
    end do
  end subroutine check_properties

  !> Report if &MATERIAL `i` does not give `key`, which is needed for `reason`.
  subroutine require_property(input, i, key, reason)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key, reason

    if (input%given(group, i, key) .or. &
        input%written%groups(input%written%find(group, i))%is_broken) return
    call input%report(group, i, '', "'"//input%text(group, i, 'NAME')//"' has no "//key// &
                      ', which it needs: '//reason)
  end subroutine require_property

end module setup_materials
