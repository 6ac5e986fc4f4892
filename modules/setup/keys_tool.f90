! SPDX-License-Identifier: MIT
!> Keys of &TOOL and &MOTION; the keys of the shapes are in tools_shapes.
module setup_keys_tool
  use base_text, only: joined
  use input_key_table, only: key_table_t
  use input_library, only: add_pair_keys
  use tools_law, only: friction_laws
  use tools_shapes, only: add_shape_keys
  implicit none (type, external)
  private

  public :: add_tool

contains

  !> Add the rows of &TOOL and &MOTION to the table.
  subroutine add_tool(t)
    type(key_table_t), intent(inout) :: t

    call t%group('TOOL', 'repeat', 'A rigid tool that touches the bodies.')
    call t%key('NAME', 'text', 1, '', 'tool', 'name', 'name of the tool')
    call add_pair_keys(t)
    call add_shape_keys(t)
    call t%key('POSITION', 'real', 3, 'm', 'required', '', &
      'place at t = 0: centre of the shoulder face, sphere or box; a point of the plane')
    call t%key('FRICTION_LAW', 'choice', 1, '', 'coulomb', joined(friction_laws, ' '), &
      'friction stress at pressure p and shear strength k of the body: coulomb: min(FRICTION '// &
      'p, k); shear-factor: SHEAR_FACTOR k; wanheim-bay: SHEAR_FACTOR k on the real contact '// &
      'area; schmidt-hattel: STICK_FRACTION k, coulomb on the other part')
    call t%key('FRICTION', 'real', 1, '', '0.2 if FRICTION_LAW = coulomb or schmidt-hattel', &
      '[0,inf)', 'Coulomb coefficient of friction')
    call t%key('SHEAR_FACTOR', 'real', 1, '', '0 if FRICTION_LAW = shear-factor or wanheim-bay', &
      '[0,1]', 'friction stress over shear strength')
    call t%key('STICK_FRACTION', 'real', 1, '', '0 if FRICTION_LAW = schmidt-hattel', '[0,1]', &
      'fraction of the area that sticks')
    call t%key('FRICTION_TABLE_OF', 'choice', 1, '', 'none', 'none temperature pressure slip', &
      'quantity on which the coefficient of friction depends by a table: temperature of the '// &
      'body, contact pressure, sliding speed')
    call t%key('FRICTION_AT', 'real', -64, '', &
      'if FRICTION_TABLE_OF = temperature or pressure or slip', '[0,inf)', &
      'rising temperatures [K], pressures [Pa] or speeds [m/s]')
    call t%key('FRICTION_MU', 'real', -64, '', &
      'if FRICTION_TABLE_OF = temperature or pressure or slip', '[0,inf)', &
      'coefficients of the law there (FRICTION, SHEAR_FACTOR or STICK_FRACTION); linear '// &
      'between, constant outside')
    call t%key('SHEAR_LIMIT', 'logical', 1, '', '.true. if FRICTION_LAW = coulomb', '', &
      'friction does not exceed the shear yield stress of the body')
    call add_machine(t)
    call add_tool_heat(t)
    call t%may_change('TOOL', 'FROM LIBRARY MASS DAMPING')
    call add_motion(t)
  end subroutine add_tool

  !> Rows of &TOOL: compliance and limits of the machine.
  subroutine add_machine(t)
    type(key_table_t), intent(inout) :: t

    call t%key('STIFFNESS', 'real', 1, 'N/m', '0', '[0,inf)', &
      'stiffness of the machine between its slide and the tool, along the axis of the tool; '// &
      '&MOTION moves the slide; 0: rigid')
    call t%key('MASS', 'real', 1, 'kg', '', '(0,inf)', &
      'mass that moves with the tool along its axis, if it has a STIFFNESS or a FORCE; scaled '// &
      'by MASS_SCALING; not given: mass of the metal below it, pi^2/4 RADIUS^3 times density')
    call t%key('DAMPING', 'real', 1, 'N s/m', '', '[0,inf)', &
      'damping of the motion of the tool along its axis, if it has a STIFFNESS or a FORCE; '// &
      'scaled by the root of MASS_SCALING; not given: critical, for the metal under its RADIUS '// &
      'and the machine')
    call t%key('MAX_FORCE', 'real', 1, 'N', '', '(0,inf)', &
      'force along the axis, in either direction, at which the machine stops; recent means count')
    call t%key('MAX_TORQUE', 'real', 1, 'N m', '', '(0,inf)', &
      'torque, in either direction, at which the machine stops')
    call t%key('AT_LIMIT', 'choice', 1, '', 'end', 'end stop-feed stop', &
      'what happens at MAX_FORCE or MAX_TORQUE: end: the run ends; stop-feed: the tool '// &
      'rotates without moving on; stop: it stands still')
  end subroutine add_machine

  !> Rows of &TOOL: partition of the friction heat, and heat sink of the tool.
  subroutine add_tool_heat(t)
    type(key_table_t), intent(inout) :: t

    call t%key('HEAT_SHARE', 'real', 1, '', '', '[0,1]', &
      'fraction of the frictional heat that enters the body; not given: e/(e + e_tool) with '// &
      'the effusivities e = sqrt(CONDUCTIVITY DENSITY SPECIFIC_HEAT), or 1 if the tool has no '// &
      'CONDUCTIVITY')
    call t%key('CONDUCTIVITY', 'real', 1, 'W/(m K)', '', '(0,1e6]', &
      'thermal conductivity of the tool, for its share of the heat and for HEATS')
    call t%key('DENSITY', 'real', 1, 'kg/m3', '', '(0,inf)', &
      'density of the tool, for its share of the heat and for HEATS')
    call t%key('SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '', '[1,1e6]', &
      'specific heat of the tool, for its share of the heat and for HEATS')
    call t%key('HEATS', 'choice', 1, '', 'no', 'no rod lumped', &
      'thermal model of the tool, which takes heat from the metal below its face: none, a rod '// &
      'behind the face, or a body of one temperature')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298 if HEATS = rod or lumped', '(0,inf)', &
      'temperature of the tool at t = 0')
    call t%key('CONTACT_CONDUCTANCE', 'real', 1, 'W/(m2 K)', 'if HEATS = rod or lumped', &
      '(0,inf)', 'conductance between the face and the metal; not given: perfect '// &
      'contact')
    call t%key('HEAT_LENGTH', 'real', 1, 'm', '0 if HEATS = rod', '[0,inf)', &
      'length of the rod; 0: infinite')
    call t%key('HEAT_AREA', 'real', 1, 'm2', 'if HEATS = rod', '(0,inf)', &
      'cross-section of the rod; not given: pi RADIUS^2, halved by a &WALL through the axis')
    call t%key('HEAT_CAPACITY', 'real', 1, 'J/K', 'required if HEATS = lumped', '(0,inf)', &
      'heat capacity of the tool')
    call t%key('COOLING', 'real', 1, 'W/K', '0 if HEATS = rod or lumped', '[0,inf)', &
      'heat loss of the far end of the rod, or of the lumped tool, per kelvin above '// &
      'COOLING_TEMPERATURE')
    call t%key('COOLING_TEMPERATURE', 'real', 1, 'K', '298 if HEATS = rod or lumped', '(0,inf)', &
      'temperature of the coolant of the tool')
  end subroutine add_tool_heat

  !> Rows of &MOTION.
  subroutine add_motion(t)
    type(key_table_t), intent(inout) :: t

    call t%group('MOTION', 'repeat', &
      'A phase of motion of a tool; phases follow in the order of the file.')
    call t%key('TOOL', 'text', 1, '', 'tool', '', 'NAME of the &TOOL, or of a rigid &BODY')
    call t%key('DURATION', 'real', 1, 's', '0', '[0,inf)', &
      'length of the phase; 0: to the end of the run, or of the path of FILE')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', &
      'velocity of the tool; with a FORCE its component along the axis into the metal is the '// &
      'highest speed of sinking')
    call t%key('FILE', 'text', 1, '', '', '', &
      'path of the tool instead of VELOCITY: CSV file, relative to the input file, with '// &
      'columns x[m], y[m], optional z[m] and time[s]. It starts at the position of the tool; '// &
      'RAMP rounds its corners')
    call t%key('SPEED', 'real', 1, 'm/s', '', '(0,inf)', &
      'speed on a path without a column time[s]')
    call t%key('TILT_FOLLOWS', 'logical', 1, '', '.false.', '', &
      'the tilt follows the direction of travel along the path instead of +x; before and '// &
      'after the path it is that of its start and end; FORCE and STIFFNESS act along z')
    call t%key('SPIN_RPM', 'real', 1, '1/min', '0', '', &
      'spin; positive is clockwise seen from above (+z)')
    call t%key('FORCE', 'real', 1, 'N', '', '[0,inf)', &
      'axial force of the tool in this phase; VELOCITY along the axis limits how fast it '// &
      'sinks; after the phase the tool keeps its depth')
    call t%key('FORCE_TABLE', 'real', -64, '', '', '[0,inf)', &
      'instead of FORCE, pairs of time [s] since the phase began and force [N]; linear '// &
      'between, constant outside; RAMP does not act on it')
    call t%key('UNTIL_FORCE', 'real', 1, 'N', '', '(0,inf)', &
      'the phase ends when the axial force on the tool reaches this value, at the latest '// &
      'after DURATION')
    call t%key('UNTIL_TORQUE', 'real', 1, 'N m', '', '(0,inf)', &
      'the phase ends when the torque on the tool reaches this value')
    call t%key('UNTIL_TEMPERATURE', 'real', 1, 'K', '', '(0,1e5)', &
      'the phase ends when the hottest metal, or the probe UNTIL_PROBE, reaches this temperature')
    call t%key('UNTIL_PROBE', 'text', 1, '', '', '&PROBE', &
      'NAME of the &PROBE for UNTIL_TEMPERATURE; not given: the hottest metal')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which velocity, spin and FORCE change linearly from those of the previous phase')
  end subroutine add_motion

end module setup_keys_tool
