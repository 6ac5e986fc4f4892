! SPDX-License-Identifier: MIT
!> The table of all groups and keys of the input file. A new key is a new row here; checks,
!> defaults and the reference page follow.
module keys_rows
  use keys_law_rows, only: add_laws, add_paths
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: key_table

contains

  !> The table. A row: name, type, number of values (-n: up to n), unit, default, allowed, meaning.
  function key_table() result(t)
    type(key_table_t) :: t

    call add_run(t)
    call add_method(t)
    call add_material(t)
    call add_body(t)
    call add_tool(t)
    call add_boundary(t)
    call add_fields(t)
    call add_heat(t)
    call add_output(t)
    call add_paths(t)
    call let_restarts_change(t)
  end function key_table

  !> The keys that a restart may have other values for: they say how to go on, or what will act from
  !> now on, not what the state is. Of &MOTION all that is still to come may change, of &SOURCE an
  !> END that is (checks_same_scene).
  subroutine let_restarts_change(t)
    type(key_table_t), intent(inout) :: t

    call t%may_change('RUN', '*')
    call t%may_change('OUTPUT', '*')
    call t%may_change('PATH', '*')
    call t%may_change('TIME', 'END MAX_STEPS CFL DT MASS_SCALING MASS_SCALING_RANGE '// &
                      'INERTIAL_FRACTION GRAVITY')
    call t%may_change('METHOD', &
                      'SELECTIVE_SCALING SORT_INTERVAL REBALANCE SLEEPING SLEEP_DISTANCE '// &
                      'SLEEP_STRAIN SLEEP_RATE SLEEP_HEAT')
    call t%may_change('CLAMP', 'VELOCITY')
    call t%may_change('LOAD', 'FORCE')
    call t%may_change('TRACTION', 'PRESSURE VECTOR')
    call t%may_change('HEAT', 'FOURIER SOLVER TOLERANCE STEP EVERY')
  end subroutine let_restarts_change

  subroutine add_run(t)
    type(key_table_t), intent(inout) :: t

    call t%group('RUN', 'once', 'Names of the run.')
    call t%key('TITLE', 'text', 1, '', '', '', 'one line about the run, kept in every output')
    call t%key('NAME', 'text', 1, '', '', 'file name', &
      'stem of the output files; not given: stem of the input file')

    call t%group('GRID', 'once required', 'Background grid: a box of cubic cells.')
    call t%key('CELL', 'real', 1, 'm', 'required', '(0,inf)', 'edge length of a cell')
    call t%key('LOWER', 'real', 3, 'm', 'required', '', 'lower corner of the box')
    call t%key('UPPER', 'real', 3, 'm', 'required', '', 'upper corner of the box')
    call t%key('PERIODIC', 'text', 1, '', '', 'xyz', &
      'axes along which the box repeats itself; its length there must be whole cells')

    call t%group('TIME', 'once required', 'Time span, time step and loads on everything.')
    call t%key('END', 'real', 1, 's', 'required', '[0,inf)', 'end of the run (it starts at 0)')
    call t%key('CFL', 'real', 1, '', '0', '[0,3]', &
      'time step as a part of the time in which a wave crosses a cell; 0: as the method allows')
    call t%key('DT', 'real', 1, 's', '0', '[0,inf)', 'fixed time step; 0: from CFL')
    call t%key('MASS_SCALING', 'real', 1, '', '1', '[1,1e12)', &
      'factor on the inertial mass, for larger time steps')
    call t%key('MASS_SCALING_RANGE', 'real', 2, '', '0 0', '[0,1e12)', &
      'least and largest factor: between them it changes while running, so that the inertial '// &
      'stress is INERTIAL_FRACTION; it starts with MASS_SCALING; 0 0: it is constant')
    call t%key('INERTIAL_FRACTION', 'real', 1, '', '0.05', '(0,1]', &
      'inertial stress of mass scaling, chi rho v^2, over flow stress that is small enough')
    call t%key('GRAVITY', 'real', 3, 'm/s2', '0 0 0', '', 'acceleration of gravity')
    call t%key('MAX_STEPS', 'integer', 1, '', '0', '[0,inf)', &
      'stop after so many steps; 0: no limit')
  end subroutine add_run

  subroutine add_method(t)
    type(key_table_t), intent(inout) :: t

    call t%group('METHOD', 'once', 'Numerical method.')
    call t%key('MECHANICS', 'logical', 1, '', '.true.', '', &
      'false: heat alone, in bodies at rest, on a mesh of cells about as large as those of '// &
      'the grid')
    call t%key('SHAPE', 'choice', 1, '', 'auto', 'auto ugimp cpgimp bspline', &
      'shape functions; auto: bspline with a &TOOL, else ugimp; domains of cpgimp follow the '// &
      'strain')
    call t%key('SCHEME', 'choice', 1, '', 'usl', 'usl musl usavg', &
      'stress update: last, last from velocities mapped again, half first and half last')
    call t%key('TRANSFER', 'choice', 1, '', 'flip', 'flip apic xpic fmpm', &
      'velocity transfer from grid to particles')
    call t%key('ORDER', 'integer', 1, '', '2 if TRANSFER = xpic or fmpm', '[1,20]', &
      'order of xpic and fmpm')
    call t%key('EVERY', 'integer', 1, 'steps', '1 if TRANSFER = xpic or fmpm', '[1,100000]', &
      'xpic and fmpm: filter in every so many steps, FLIP in the others')
    call t%key('PIC_FRACTION', 'real', 1, '', '0', '[0,1]', &
      'part of the velocity taken from the grid: 0 is FLIP, 1 is PIC')
    call t%key('FBAR', 'logical', 1, '', '.true.', '', &
      'average the volume ratio over the particles next to each node, against volumetric locking')
    call t%key('SELECTIVE_SCALING', 'choice', 1, '', 'auto', 'off auto on', &
      'nodes with little mass have more inertia, which allows longer steps; auto: with '// &
      'B-splines, MASS_SCALING, a tool, a wall and nothing molten')
    call t%key('SORT_INTERVAL', 'integer', 1, 'steps', '100', '[1,1000]', &
      'most steps from one listing of particles, nodes and ranks to the next')
    call t%key('REBALANCE', 'real', 1, '', '1.03', '[1,inf)', &
      'most loaded rank over the mean load above which the grid is divided anew')
    call t%key('SLEEPING', 'choice', 1, '', 'auto', 'off auto on', &
      'material that is still stops its mechanics; auto: with MASS_SCALING, if the scene allows')
    call t%key('SLEEP_DISTANCE', 'real', 1, 'm', '0 if SLEEPING = auto or on', '[0,inf)', &
      'material nearer than this to a tool is awake; 0: half the radius of the largest tool')
    call t%key('SLEEP_STRAIN', 'real', 1, '', '2e-4 if SLEEPING = auto or on', '(0,1)', &
      'mean speed of the particles of a cube of two cells over wave speed above which it is awake')
    call t%key('SLEEP_RATE', 'real', 1, '1/s', '3e-3 if SLEEPING = auto or on', '(0,inf)', &
      'plastic strain rate above which material is awake')
    call t%key('SLEEP_HEAT', 'real', 1, 'K', '20 if SLEEPING = auto or on', '(0,inf)', &
      'change of temperature by which sleeping material wakes')
  end subroutine add_method

  subroutine add_material(t)
    type(key_table_t), intent(inout) :: t

    call t%group('MATERIAL', 'repeat required', 'A material; bodies refer to its NAME.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the material')
    call t%key('DENSITY', 'real', 1, 'kg/m3', 'required', '(0,inf)', 'mass density')
    call t%key('YOUNGS_MODULUS', 'real', 1, 'Pa', 'required', '(0,inf)', 'elastic modulus')
    call t%key('POISSON_RATIO', 'real', 1, '', 'required', '(-1,0.5)', &
      'ratio of lateral contraction')
    call t%key('ENERGY', 'choice', 1, '', 'decoupled', 'decoupled coupled', &
      'elastic energy: volume and shape apart, or P = mu(F - F^-T) + lambda ln(J) F^-T')
    call add_laws(t)
    call t%key('T_ROOM', 'real', 1, 'K', '298', '(0,10000]', &
      'johnson-cook: temperature up to which it does not soften; EXPANSION: temperature '// &
      'without strain')
    call t%key('T_MELT', 'real', 1, 'K', '', '(0,10000]', &
      'temperature from which on no strength is left, with any LAW; required with '// &
      'johnson-cook, where a law with strength is heated, and with a &SOURCE; metal above it '// &
      'is reported')
    call t%key('SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '', '[1,1e6]', &
      'specific heat capacity; required where something heats or conducts')
    call t%key('CONDUCTIVITY', 'real', 1, 'W/(m K)', '', '[0,1e6]', &
      'thermal conductivity; required with &HEAT')
    call t%key('SPECIFIC_HEAT_TABLE', 'real', -64, '', '', '[0,inf)', &
      'heat alone: pairs of temperature and SPECIFIC_HEAT, linear between them; it replaces '// &
      'the constant')
    call t%key('CONDUCTIVITY_TABLE', 'real', -64, '', '', '[0,inf)', &
      'heat alone: pairs of temperature and CONDUCTIVITY')
    call t%key('YIELD_TABLE', 'real', -64, '', '', '[0,inf)', &
      'heat alone: pairs of temperature and yield stress [Pa], for stirring sources')
    call t%key('YIELD_LOGISTIC', 'real', -25, '', '', '', &
      'heat alone: yield stress by pieces of five values: a, b, T0, n, T1 say '// &
      'a + (b - a)/(1 + (T/T0)^n) up to T1, at most five pieces; 0 above the last')
    call t%key('EXPANSION', 'real', 1, '1/K', '0', '(-0.01,0.01)', &
      'coefficient of linear expansion')
    call t%key('PLASTIC_HEAT', 'real', 1, '', '0.9', '[0,1]', &
      'part of the plastic work that becomes heat (Taylor-Quinney)')
  end subroutine add_material

  subroutine add_body(t)
    type(key_table_t), intent(inout) :: t

    call t%group('BODY', 'repeat required', 'A deformable body; &SHAPE groups give its geometry.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the body')
    call t%key('MATERIAL', 'text', 1, '', 'required', '', 'NAME of its &MATERIAL')
    call t%key('PARTICLES_PER_CELL', 'integer', -3, '', '2', '[1,8]', &
      'particles per cell and direction: one number, or one for each axis')
    call t%key('LATTICE', 'choice', 1, '', 'body', 'body grid round', &
      'anchor of the lattice of particles: lower corner or centre of the first shape, or lower '// &
      'corner of the grid; round: rings or shells that follow the first shape, a cylinder or '// &
      'sphere')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298', '(0,inf)', 'initial temperature')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'initial velocity')
    call t%key('ANGULAR_VELOCITY', 'real', 3, 'rad/s', '0 0 0', '', &
      'initial rotation, added to VELOCITY')
    call t%key('VELOCITY_GRADIENT', 'real', 9, '1/s', '0 0 0 0 0 0 0 0 0', '', &
      'initial dv/dx row by row, added to VELOCITY: xx xy xz yx yy yz zx zy zz')
    call t%key('CENTRE', 'real', 3, 'm', '0 0 0', '', &
      'the point that moves with VELOCITY when there is rotation or a gradient; RIGID: on its axis')
    call t%key('DEFORMATION', 'real', 9, '', '1 0 0 0 1 0 0 0 1', '', &
      'initial elastic deformation gradient row by row; the shapes are the deformed ones')
    call t%key('RIGID', 'logical', 1, '', '.false.', '', &
      'the particles move as a rigid body, by &MOTION groups whose TOOL is this NAME')

    call t%group('SHAPE', 'repeat required', &
      'A piece of a body, added or cut away; the pieces of a body act in the order of the file.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of the &BODY')
    call t%key('KIND', 'choice', 1, '', 'box', 'box cylinder sphere trapezoid', 'geometry')
    call t%key('OPERATION', 'choice', 1, '', 'add', 'add subtract', 'add material or cut it away')
    call t%key('LOWER', 'real', 3, 'm', 'required if KIND = box or trapezoid', '', 'lower corner')
    call t%key('UPPER', 'real', 3, 'm', 'required if KIND = box or trapezoid', '', 'upper corner')
    call t%key('CENTRE', 'real', 3, 'm', 'required if KIND = cylinder or sphere', '', &
      'centre of the sphere, middle of the cylinder')
    call t%key('RADIUS', 'real', 1, 'm', 'required if KIND = cylinder or sphere', '(0,inf)', &
      'radius')
    call t%key('LENGTH', 'real', 1, 'm', 'required if KIND = cylinder', '(0,inf)', &
      'length of the cylinder')
    call t%key('AXIS', 'choice', 1, '', 'z if KIND = cylinder', 'x y z', &
      'direction of the cylinder')
    call t%key('ALONG', 'choice', 1, '', 'x if KIND = trapezoid', 'x y z', &
      'trapezoid: direction in which the width changes')
    call t%key('ACROSS', 'choice', 1, '', 'y if KIND = trapezoid', 'x y z', &
      'trapezoid: direction of the width, centred between LOWER and UPPER')
    call t%key('WIDTH_LOWER', 'real', 1, 'm', 'required if KIND = trapezoid', '[0,inf)', &
      'width at the LOWER end of ALONG')
    call t%key('WIDTH_UPPER', 'real', 1, 'm', 'required if KIND = trapezoid', '[0,inf)', &
      'width at the UPPER end of ALONG')
  end subroutine add_body

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

  subroutine add_boundary(t)
    type(key_table_t), intent(inout) :: t

    call t%group('WALL', 'repeat', 'A flat rigid wall.')
    call t%key('SIDE', 'choice', 1, '', 'required', 'xmin xmax ymin ymax zmin zmax', &
      'side of the grid on which it stands')
    call t%key('KIND', 'choice', 1, '', 'sliding', 'fixed sliding', &
      'holds everything, or only the normal')
    call t%key('POSITION', 'real', 1, 'm', '', '', &
      'coordinate of the wall; not given: at the side of the grid')
    call t%key('TEMPERATURE', 'real', 1, 'K', '', '(0,inf)', &
      'temperature of the wall; not given: it lets no heat through')

    call t%group('CLAMP', 'repeat', 'Nodes of the grid in a box, moved at a given velocity.')
    call t%key('LOWER', 'real', 3, 'm', 'required', '', 'lower corner of the box')
    call t%key('UPPER', 'real', 3, 'm', 'required', '', 'upper corner of the box')
    call t%key('COMPONENTS', 'text', 1, '', 'xyz', 'xyz', &
      'components of the velocity that are held')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'velocity of the nodes')

    call t%group('LOAD', 'repeat', &
      'A force on a body, shared by its particles in proportion to mass.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of the &BODY')
    call t%key('FORCE', 'real', 3, 'N', 'required', '', 'total force')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which the force rises linearly from 0')

    call t%group('TRACTION', 'repeat', 'A force per area on the surface of a body.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of the &BODY')
    call t%key('FACE', 'choice', 1, '', 'all', 'xmin xmax ymin ymax zmin zmax all', &
      'faces of the body by the direction they look to')
    call t%key('LOWER', 'real', 3, 'm', '', '', &
      'only faces whose particles start above this corner; not given: no limit')
    call t%key('UPPER', 'real', 3, 'm', '', '', &
      'only faces whose particles start below this corner; not given: no limit')
    call t%key('PRESSURE', 'real', 1, 'Pa', '0', '', 'normal to the face, positive inwards')
    call t%key('VECTOR', 'real', 3, 'Pa', '0 0 0', '', 'force per initial area')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which the traction rises linearly from 0')

    call t%group('CONTACT', 'repeat', &
      'Contact of two bodies; bodies without it that meet stick together.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of one &BODY')
    call t%key('OTHER', 'text', 1, '', 'required', '', 'NAME of the other &BODY')
    call t%key('LAW', 'choice', 1, '', 'coulomb', 'coulomb stick frictionless', &
      'what happens along the surface')
    call t%key('FRICTION', 'real', 1, '', '0.2 if LAW = coulomb', '[0,inf)', &
      'Coulomb coefficient of friction')
    call t%key('NORMAL', 'choice', 1, '', 'regression', 'gradient regression', &
      'direction of the surface: from gradients of volume, or from a plane between the '// &
      'particles; that of either body instead where it separates them better')
  end subroutine add_boundary

  subroutine add_fields(t)
    type(key_table_t), intent(inout) :: t

    call t%group('FIELD', 'repeat', &
      'A known motion or temperature of a body: its start, body force, and errors in '// &
      'NAME_errors.csv; or noise in its velocities. Shapes and masses are those of the '// &
      'undeformed body, X a place in it.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of the &BODY')
    call t%key('KIND', 'choice', 1, '', 'required', &
      'waves vortex ring mode noise alternating heat-mode', &
      'waves: u_i = A sin(2 pi X_i/L_i + P_i) sin(w t + Q_i) with body force; mode: without; '// &
      'vortex, ring: plane, with force; noise, alternating: initial velocities; heat-mode: '// &
      'TEMPERATURE + A times sines of X_i, decaying')
    call t%key('AMPLITUDE', 'real', 1, '', 'required', '', &
      'A: displacement [m], angle [rad] (vortex), velocity [m/s] (noise, alternating) or '// &
      'temperature [K]')
    call t%key('WAVELENGTH', 'real', 3, 'm', '1 1 1 if KIND = waves or mode or heat-mode', &
               '(0,inf)', &
      'L of each axis')
    call t%key('AXES', 'text', 1, '', &
               'x if KIND = waves or mode or heat-mode or noise or alternating', &
      'xyz', &
      'axes that take part; components of the velocity with noise')
    call t%key('SHIFT', 'real', 3, 'rad', '0 0 0 if KIND = waves or mode or heat-mode', '', &
      'P of each axis')
    call t%key('FREQUENCY', 'real', 1, '1/s', '0 if KIND = waves or mode or vortex or ring', &
      '[0,inf)', &
      'w/(2 pi); mode, ring: 0: from the material, w = 2 pi c/L_i or pi c/(sum of RADII), c '// &
      'the speed of pressure waves')
    call t%key('PHASE', 'real', 3, 'rad', '0 0 0 if KIND = waves or mode', '', 'Q of each axis')
    call t%key('CENTRE', 'real', 3, 'm', '0 0 0 if KIND = vortex or ring', '', &
      'a point of the axis of vortex and ring')
    call t%key('RADII', 'real', 2, 'm', '1 2 if KIND = vortex or ring', '(0,inf)', &
      'inner and outer radius of vortex and ring')
    call t%key('SEED', 'integer', 1, '', '1 if KIND = noise', '', 'of the noise')
  end subroutine add_fields

  subroutine add_heat(t)
    type(key_table_t), intent(inout) :: t

    call t%group('HEAT', 'once', 'Heat conduction; the presence of this group switches it on.')
    call t%key('AMBIENT', 'real', 1, 'K', '298', '(0,inf)', &
      'temperature of the surroundings, where a &SURFACE gives none')
    call t%key('FOURIER', 'real', 1, '', '0.25', '(0,0.5]', &
      'conduction step is at most FOURIER h^2/kappa (h: cell, kappa: diffusivity)')
    call t%key('INTEGRATOR', 'choice', 1, '', 'auto', &
      'auto explicit rkl2 backward-euler tr-bdf2', &
      'time integration; rkl2: explicit, long steps of many stages; tr-bdf2: implicit, '// &
      'order 2; auto: rkl2 for heat alone; beside mechanics explicit or backward-euler, auto: '// &
      'explicit')
    call t%key('SOLVER', 'choice', 1, '', 'auto', 'auto cg fftw petsc', &
      'of implicit steps; auto: fftw for heat alone in a box of constant properties, and where '// &
      'there are more than 50000 cells of one material, else cg; beside mechanics cg or petsc')
    call t%key('TOLERANCE', 'real', 1, 'K', '2', '[1e-6,1e4]', &
      'largest estimate of the error of a time step, of heat alone or implicit, in any cell or '// &
      'node; at the rim of a moving source it is some hundred times that of the temperatures')
    call t%key('STEP', 'real', 1, 's', '0', '[0,inf)', 'fixed time step; 0: by TOLERANCE')
    call t%key('EVERY', 'integer', 1, '', '0', '[0,inf)', &
      'backward-euler beside mechanics: a step every so many mechanical ones; 0: by STEP or '// &
      'TOLERANCE')

    call t%group('SURFACE', 'repeat', 'Exchange of heat at the surface of a body.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of the &BODY')
    call t%key('FACE', 'choice', 1, '', 'all', 'xmin xmax ymin ymax zmin zmax all', &
      'faces of the body by the direction they look to')
    call t%key('COEFFICIENT', 'real', 1, 'W/(m2 K)', 'required', '[0,inf)', &
      'heat transfer coefficient')
    call t%key('AMBIENT', 'real', 1, 'K', '', '(0,inf)', &
      'temperature on the other side; not given: that of &HEAT')

    call t%group('SOURCE', 'repeat', 'A moving source of heat.')
    call t%key('KIND', 'choice', 1, '', 'disc', 'disc ball stir', &
      'disc: on the surface within RADIUS of its axis (z); ball: in the volume; stir: heat '// &
      'alone, a disc that spins on the surface and shears it: SHARE times shear stress, spin '// &
      'and radius')
    call t%key('POWER', 'real', 1, 'W', 'required if KIND = disc or ball', '', &
      'total power, all of it on what the source covers')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', 'centre at t = 0')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'of the centre')
    call t%key('RADIUS', 'real', 1, 'm', 'required', '(0,inf)', 'extent of the source')
    call t%key('BEGIN', 'real', 1, 's', '0', '[0,inf)', 'time of the start')
    call t%key('END', 'real', 1, 's', '0', '[0,inf)', 'time of the end; 0: never')
    call t%key('SPIN_RPM', 'real', 1, '1/min', '0 if KIND = stir', '', 'stir: spin')
    call t%key('CONTACT', 'choice', 1, '', 'sticking if KIND = stir', &
      'sticking sliding limited mixed', &
      'stir: the shear stress: yield stress over sqrt(3); FRICTION PRESSURE; the lesser; '// &
      'SLIP sliding and the rest sticking')
    call t%key('FRICTION', 'real', 1, '', '0 if CONTACT = sliding or limited or mixed', '[0,inf)', &
      'stir: coefficient of friction')
    call t%key('PRESSURE', 'real', 1, 'Pa', '0 if CONTACT = sliding or limited or mixed', &
               '[0,inf)', &
      'stir: pressure under the tool')
    call t%key('SLIP', 'real', 1, '', '0 if CONTACT = mixed', '[0,1]', &
      'stir: part that slides if CONTACT = mixed')
    call t%key('SHARE', 'real', 1, '', 'if KIND = stir', '[0,1]', &
      'stir: part of the heat that enters the body; not given: e/(e + e_tool) with e = '// &
      'sqrt(conductivity density specific heat)')
    call t%key('TOOL_DENSITY', 'real', 1, 'kg/m3', '7800 if KIND = stir', '(0,inf)', &
      'stir: for the SHARE')
    call t%key('TOOL_SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '460 if KIND = stir', '(0,inf)', &
      'stir: for the SHARE')
    call t%key('TOOL_CONDUCTIVITY', 'real', 1, 'W/(m K)', '14.4 if KIND = stir', '[0,inf)', &
      'stir: for the SHARE')
  end subroutine add_heat

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
  end subroutine add_output

end module keys_rows
