! SPDX-License-Identifier: MIT
!> Keys of &OUTPUT, &PROBE, &TRACER and &PATH.
module groups_output
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_output, add_paths

contains

  !> Add the rows of these groups to the table.
  subroutine add_output(t)
    type(key_table_t), intent(inout) :: t

    call t%group('OUTPUT', 'once', 'What is written, and how often.')
    call t%key('FRAME_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two frames of all particles; 0: first and last only')
    call t%key('HISTORY_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two rows of the histories; 0: 500 rows in the run')
    call t%key('CHECKPOINT_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two checkpoints; 0: none but at the end or a stop')
    call t%key('PROGRESS_INTERVAL', 'real', 1, 's', '10', '[0,inf)', &
      'wall-clock time between two lines of progress in a file; not given: from 10 s on ever '// &
      'longer, a twentieth of the time so far; a terminal has one line, drawn every second')
    call t%key('SAFETY_INTERVAL', 'real', 1, 's', '600', '[0,inf)', &
      'wall-clock time between two checkpoints against a breakdown; 0: none')
    call t%key('INITIAL_POSITION', 'logical', 1, '', '.false.', '', &
      'frames hold the position of each particle at t = 0')

    call t%group('PROBE', 'repeat', 'A point of observation with a history of its own.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the probe')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', 'place of the probe at t = 0')

    call t%group('TRACER', 'repeat', &
      'Material points that are followed: the particles nearest to places, in NAME_tracers.csv.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the group of tracers')
    call t%key('KIND', 'choice', 1, '', 'point', 'point line box', &
      'one place, a row of places or a lattice of them; of line and box those in metal count')
    call t%key('POSITION', 'real', 3, 'm', 'required if KIND = point', '', 'place at t = 0')
    call t%key('FROM', 'real', 3, 'm', 'required if KIND = line', '', 'one end of the line')
    call t%key('TO', 'real', 3, 'm', 'required if KIND = line', '', 'its other end')
    call t%key('LOWER', 'real', 3, 'm', 'required if KIND = box', '', 'lower corner')
    call t%key('UPPER', 'real', 3, 'm', 'required if KIND = box', '', &
      'upper corner; a layer is a flat box')
    call t%key('NUMBER', 'integer', -3, '', ' if KIND = line or box', '[1,100000]', &
      'of places on the line, its ends among them, or along each axis of the box: one number, '// &
      'or three')
    call t%key('SPACING', 'real', 1, 'm', ' if KIND = line or box', '(0,inf)', &
      'between places, instead of NUMBER; centred on the line or in the box')
    call t%key('INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two rows of a tracer; 0: &OUTPUT HISTORY_INTERVAL')

    call t%may_change('OUTPUT', 'FRAME_INTERVAL HISTORY_INTERVAL CHECKPOINT_INTERVAL '// &
                      'PROGRESS_INTERVAL SAFETY_INTERVAL')
    call t%may_change('TRACER', 'INTERVAL')
  end subroutine add_output

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

end module groups_output
