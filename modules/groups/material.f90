! SPDX-License-Identifier: MIT
!> Keys of &MATERIAL.
module groups_material
  use flow_laws_list, only: add_law_keys
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_material

contains

  !> Add the rows of &MATERIAL to the table.
  subroutine add_material(t)
    type(key_table_t), intent(inout) :: t

    call t%group('MATERIAL', 'repeat required', 'A material; bodies refer to its NAME.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the material')
    call t%key('FROM', 'text', 1, '', '', '', &
      'entry of the library of materials (stirpoint --materials) whose values hold where this '// &
      'group gives none; library: the entry of this NAME')
    call t%key('LIBRARY', 'text', 1, '', '', '', &
      'file of the library, beside the input; not given: that of the program')
    call t%key('DENSITY', 'real', 1, 'kg/m3', 'required', '(0,inf)', 'mass density')
    call t%key('YOUNGS_MODULUS', 'real', 1, 'Pa', 'required', '(0,inf)', 'elastic modulus')
    call t%key('POISSON_RATIO', 'real', 1, '', 'required', '(-1,0.5)', &
      'ratio of lateral contraction')
    call t%key('ENERGY', 'choice', 1, '', 'decoupled', 'decoupled coupled', &
      'elastic energy: volume and shape apart, or P = mu(F - F^-T) + lambda ln(J) F^-T')
    call add_law_keys(t)
    call t%key('T_ROOM', 'real', 1, 'K', '298', '(0,10000]', &
      'johnson-cook: temperature up to which it does not soften; EXPANSION: temperature '// &
      'without strain')
    call t%key('T_MELT', 'real', 1, 'K', '', '(0,10000]', &
      'temperature from which on no strength is left, with any LAW; required with '// &
      'johnson-cook, where a law with strength is heated, and with a &SOURCE; metal above it '// &
      'is reported')
    call t%key('SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '', '[1,1e6]', &
      'specific heat capacity; it or its table is required where something heats or conducts')
    call t%key('CONDUCTIVITY', 'real', 1, 'W/(m K)', '', '[0,1e6]', &
      'thermal conductivity; it or its table is required with &HEAT')
    call t%key('SPECIFIC_HEAT_TABLE', 'real', -64, '', '', '[0,inf)', &
      'pairs of temperature and SPECIFIC_HEAT, linear between them and constant beyond; it '// &
      'replaces the constant')
    call t%key('CONDUCTIVITY_TABLE', 'real', -64, '', '', '[0,inf)', &
      'pairs of temperature and CONDUCTIVITY, likewise')
    call t%key('YIELD_TABLE', 'real', -64, '', '', '[0,inf)', &
      'heat alone: pairs of temperature and yield stress [Pa], for stirring sources')
    call t%key('YIELD_LOGISTIC', 'real', -25, '', '', '', &
      'heat alone: yield stress by pieces of five values: a, b, T0, n, T1 say '// &
      'a + (b - a)/(1 + (T/T0)^n) up to T1, at most five pieces; 0 above the last')
    call t%key('EXPANSION', 'real', 1, '1/K', '0', '(-0.01,0.01)', &
      'coefficient of linear expansion')
    call t%key('PLASTIC_HEAT', 'real', 1, '', '0.9', '[0,1]', &
      'part of the plastic work that becomes heat (Taylor-Quinney)')

    call t%may_change('MATERIAL', 'FROM LIBRARY')
  end subroutine add_material

end module groups_material
