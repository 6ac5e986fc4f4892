! SPDX-License-Identifier: MIT
!> Keys of &PATH.
module groups_path
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_paths

contains

  !> Add the rows of &PATH, for `stirpoint --material`, to the table.
  subroutine add_paths(t)
    type(key_table_t), intent(inout) :: t

    call t%group('PATH', 'repeat', &
      'A path of a material point for stirpoint --material: one curve NAME.csv. Not used in runs.')
    call t%key('NAME', 'text', 1, '', 'required', 'file name', 'name of the curve and of its file')
    call t%key('MATERIAL', 'text', 1, '', 'required', '&MATERIAL', 'NAME of the &MATERIAL')
    call t%key('KIND', 'choice', 1, '', 'strain', 'strain shear history', &
      'strain: at given plastic strain rate; shear: simple shear through elasticity and '// &
      'return; history: as FILE says')
    call t%key('RATE', 'real', 1, '1/s', '1 if KIND = strain or shear', '(0,inf)', &
      'plastic strain rate; shear: von Mises rate, the shear rate is sqrt(3) of it')
    call t%key('STRAIN', 'real', 1, '', '1 if KIND = strain or shear', '(0,inf)', &
      'strain at the end')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298', '(0,inf)', 'at the start')
    call t%key('ADIABATIC', 'logical', 1, '', '.false.', '', &
      'PLASTIC_HEAT of the plastic work heats the point')
    call t%key('STEP', 'real', 1, '', '1e-3', '(0,0.1]', 'longest increment of strain')
    call t%key('ROWS', 'integer', 1, '', '200', '[1,1000000]', 'rows of the curve')
    call t%key('FILE', 'text', 1, '', 'required if KIND = history', '', &
      'CSV with columns time[s], temperature[K] and plastic_strain[1] or strain_rate[1/s], '// &
      'beside the input')

    call t%may_change('PATH', '*')
  end subroutine add_paths

end module groups_path
