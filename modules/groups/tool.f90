! SPDX-License-Identifier: MIT
!> Keys of &TOOL and &MOTION.
module groups_tool
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_tool

contains

  !> Add the rows of &TOOL and &MOTION to the table.
  subroutine add_tool(t)
    type(key_table_t), intent(inout) :: t

    call t%group('TOOL', 'repeat', 'A rigid tool that touches the bodies.')
    call t%key('NAME', 'text', 1, '', 'tool', 'name', 'name of the tool')
    call t%key('KIND', 'choice', 1, '', 'shoulder', 'shoulder plane sphere box', 'geometry')
    call t%key('RADIUS', 'real', 1, 'm', 'required if KIND = shoulder or sphere', '(0,inf)', &
      'radius of the shoulder or sphere')
    call t%key('HEIGHT', 'real', 1, 'm', '0.02 if KIND = shoulder', '(0,inf)', &
      'height of the shoulder above its face')
    call t%key('CONCAVITY_DEG', 'real', 1, 'deg', '0 if KIND = shoulder', '[0,30)', &
      'angle by which the face of the shoulder rises towards its axis')
    call t%key('PIN_RADIUS', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
      'radius of the pin at the face; 0: no pin')
    call t%key('PIN_TIP_RADIUS', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
      'radius of the pin at its tip; 0: as at the face (a cylinder)')
    call t%key('PIN_LENGTH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
      'length of the pin below the face')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', &
      'place at t = 0: centre of the shoulder face, sphere or box; a point of the plane')
    call t%key('NORMAL', 'real', 3, '', '0 0 1 if KIND = plane', '', &
      'plane: direction out of the rigid half space')
    call t%key('SIZE', 'real', 3, 'm', 'required if KIND = box', '(0,inf)', &
      'edge lengths of the box')
    call t%key('TILT_DEG', 'real', 1, 'deg', '0 if KIND = shoulder or sphere or box', '[-10,10]', &
      'the shoulder tips backwards against the travel direction +x: trailing edge deeper')
    call t%key('FRICTION', 'real', 1, '', '0.2', '[0,inf)', 'Coulomb coefficient of friction')
    call t%key('FRICTION_TABLE_OF', 'choice', 1, '', 'none', 'none temperature pressure slip', &
      'what the coefficient depends on instead: temperature of the body, pressure in it on the '// &
      'surface, speed of sliding')
    call t%key('FRICTION_AT', 'real', -64, '', &
               'if FRICTION_TABLE_OF = temperature or pressure or slip', &
      '[0,inf)', &
      'rising temperatures [K], pressures [Pa] or speeds [m/s]')
    call t%key('FRICTION_MU', 'real', -64, '', &
               'if FRICTION_TABLE_OF = temperature or pressure or slip', &
      '[0,inf)', &
      'coefficients there; linear between, constant outside')
    call t%key('SHEAR_LIMIT', 'logical', 1, '', '.true.', '', &
      'friction does not exceed the shear yield stress of the body')
    call t%key('HEAT_SHARE', 'real', 1, '', '1', '[0,1]', &
      'part of the frictional heat that enters the body')

    call t%group('MOTION', 'repeat', &
      'A phase of motion of a tool; phases follow in the order of the file.')
    call t%key('TOOL', 'text', 1, '', 'tool', '', 'NAME of the &TOOL, or of a rigid &BODY')
    call t%key('DURATION', 'real', 1, 's', '0', '[0,inf)', &
      'length of the phase; 0: to the end of the run')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'velocity of the tool')
    call t%key('SPIN_RPM', 'real', 1, '1/min', '0', '', &
      'spin; positive is clockwise seen from above (+z)')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which velocity and spin change linearly from the phase before')
  end subroutine add_tool

end module groups_tool
