! SPDX-License-Identifier: MIT
!> Keys of &OUTPUT and &PROBE.
module groups_output
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_output

contains

  !> Add the rows of &OUTPUT and &PROBE to the table.
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
      'wall-clock time between two lines of progress')
    call t%key('SAFETY_INTERVAL', 'real', 1, 's', '600', '[0,inf)', &
      'wall-clock time between two checkpoints against a breakdown; 0: none')

    call t%group('PROBE', 'repeat', 'A point of observation with a history of its own.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the probe')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', 'place of the probe at t = 0')

    call t%may_change('OUTPUT', '*')
  end subroutine add_output

end module groups_output
