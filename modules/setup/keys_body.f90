! SPDX-License-Identifier: MIT
!> Keys of &MATERIAL, &BODY, &SHAPE and &FIELD.
module setup_keys_body
  use input_key_table, only: key_table_t
  use physics_laws, only: add_law_keys
  implicit none (type, external)
  private

  public :: add_body, add_fields, add_material

contains

  !> Add the rows of &MATERIAL to the table.
  subroutine add_material(t)
    type(key_table_t), intent(inout) :: t

    call t%group('MATERIAL', 'repeat required', 'A material; bodies refer to its NAME.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the material')
    call t%key('FROM', 'text', 1, '', '', '', &
      'entry of the library of materials (stirpoint --materials) for all keys that are not '// &
      'given here; library: the entry with this NAME')
    call t%key('LIBRARY', 'text', 1, '', '', '', &
      'file of the library, relative to the input file; not given: the library of the program')
    call t%key('DENSITY', 'real', 1, 'kg/m3', 'required', '(0,inf)', 'mass density')
    call t%key('YOUNGS_MODULUS', 'real', 1, 'Pa', 'required', '(0,inf)', 'elastic modulus')
    call t%key('POISSON_RATIO', 'real', 1, '', 'required', '(-1,0.5)', "Poisson's ratio")
    call t%key('ENERGY', 'choice', 1, '', 'decoupled', 'decoupled coupled', &
      'elastic energy: decoupled: volumetric and isochoric part; coupled: first '// &
      'Piola-Kirchhoff stress P = mu(F - F^-T) + lambda ln(J) F^-T')
    call add_law_keys(t)
    call t%key('T_ROOM', 'real', 1, 'K', '298', '(0,10000]', &
      'johnson-cook: temperature above which the metal softens; EXPANSION: temperature '// &
      'without thermal strain')
    call t%key('T_MELT', 'real', 1, 'K', '', '(0,10000]', &
      'temperature above which metal has no strength, with any LAW; required with '// &
      'johnson-cook, for a law with strength that is heated, and with a &SOURCE; metal above '// &
      'it is reported')
    call t%key('SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '', '[1,1e6]', &
      'specific heat capacity; it or its table is required where something heats or conducts')
    call t%key('CONDUCTIVITY', 'real', 1, 'W/(m K)', '', '[0,1e6]', &
      'thermal conductivity; it or its table is required with &HEAT')
    call t%key('SPECIFIC_HEAT_TABLE', 'real', -64, '', '', '[0,inf)', &
      'pairs of temperature and SPECIFIC_HEAT, linear between them and constant beyond; it '// &
      'replaces the constant')
    call t%key('CONDUCTIVITY_TABLE', 'real', -64, '', '', '[0,inf)', &
      'pairs of temperature and CONDUCTIVITY, linear between them and constant beyond; it '// &
      'replaces the constant')
    call t%key('YIELD_TABLE', 'real', -64, '', '', '[0,inf)', &
      'heat alone: pairs of temperature and yield stress [Pa], for stirring sources')
    call t%key('YIELD_LOGISTIC', 'real', -25, '', '', '', &
      'heat alone: yield stress [Pa] in up to five ranges of temperature, each with five '// &
      'values a, b, T0, n, T1: a + (b - a)/(1 + (T/T0)^n) up to T1; 0 above the last T1')
    call t%key('EXPANSION', 'real', 1, '1/K', '0', '(-0.01,0.01)', &
      'coefficient of linear expansion')
    call t%key('PLASTIC_HEAT', 'real', 1, '', '0.9', '[0,1]', &
      'part of the plastic work that becomes heat (Taylor-Quinney)')

    call t%may_change('MATERIAL', 'FROM LIBRARY')
  end subroutine add_material

  !> Add the rows of &BODY and &SHAPE to the table.
  subroutine add_body(t)
    type(key_table_t), intent(inout) :: t

    call t%group('BODY', 'repeat required', 'A deformable body; &SHAPE groups give its geometry.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the body')
    call t%key('MATERIAL', 'text', 1, '', 'required', '&MATERIAL', 'NAME of its &MATERIAL')
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
      'point that moves with VELOCITY, with ANGULAR_VELOCITY or VELOCITY_GRADIENT; with RIGID '// &
      'a point of the axis of rotation')
    call t%key('DEFORMATION', 'real', 9, '', '1 0 0 0 1 0 0 0 1', '', &
      'initial elastic deformation gradient row by row; &SHAPE gives the deformed shape')
    call t%key('RIGID', 'logical', 1, '', '.false.', '', &
      'the body is rigid and moves as the &MOTION groups with this NAME as TOOL say')

    call t%group('SHAPE', 'repeat required', &
      'A shape that is added to a body or cut out of it, in the order of the file.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('KIND', 'choice', 1, '', 'box', 'box cylinder sphere trapezoid stl', &
      'geometry; stl: the solid inside a closed surface from a file')
    call t%key('OPERATION', 'choice', 1, '', 'add', 'add subtract', 'add the shape or cut it out')
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
    call t%key('FILE', 'text', 1, '', 'required if KIND = stl', '', &
      'STL file of a closed surface, text or binary, beside the input')
    call t%key('UNIT', 'choice', 1, '', 'required if KIND = stl', 'm cm mm um in', &
      'unit of length of the file')
    call t%key('POSITION', 'real', 3, 'm', '0 0 0 if KIND = stl', '', &
      'position of the origin of the file')
  end subroutine add_body

  !> Add the rows of &FIELD to the table.
  subroutine add_fields(t)
    type(key_table_t), intent(inout) :: t

    call t%group('FIELD', 'repeat', &
      'A known motion or temperature of a body, which gives its initial values, its body '// &
      'force and the errors in NAME_errors.csv; or noise in its velocities. Shapes and masses '// &
      'are those of the undeformed body, X is a position in it.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('KIND', 'choice', 1, '', 'required', &
      'waves vortex ring mode noise alternating heat-mode', &
      'waves: u_i = A sin(2 pi X_i/L_i + P_i) sin(w t + Q_i) with body force; mode: without; '// &
      'vortex, ring: plane, with force; noise, alternating: initial velocities; heat-mode: '// &
      'TEMPERATURE + A times sines of X_i, decaying')
    call t%key('AMPLITUDE', 'real', 1, '', 'required', '', &
      'A: displacement [m], angle [rad] (vortex), velocity [m/s] (noise, alternating) or '// &
      'temperature [K]')
    call t%key('WAVELENGTH', 'real', 3, 'm', '1 1 1 if KIND = waves or mode or heat-mode', &
      '(0,inf)', 'L of each axis')
    call t%key('AXES', 'text', 1, '', &
      'x if KIND = waves or mode or heat-mode or noise or alternating', 'xyz', &
      'axes of the waves; with noise the components of the velocity')
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
    call t%key('SEED', 'integer', 1, '', '1 if KIND = noise', '', &
      'seed of the random numbers of the noise')
  end subroutine add_fields

end module setup_keys_body
