! SPDX-License-Identifier: MIT
!> Keys of &WALL, &LOAD, &TRACTION, &CONTACT, &HEAT and &SURFACE; the keys of clamps are in
!> state_conditions.
module setup_keys_boundary
  use input_key_table, only: key_table_t
  use input_library, only: add_pair_keys
  use state_conditions, only: add_clamp_keys
  implicit none (type, external)
  private

  public :: add_boundary, add_heat

contains

  !> Add the rows of walls, loads, tractions, contact and heat to the table.
  subroutine add_boundary(t)
    type(key_table_t), intent(inout) :: t

    call t%group('WALL', 'repeat', 'A flat rigid wall.')
    call t%key('SIDE', 'choice', 1, '', 'required', 'xmin xmax ymin ymax zmin zmax', &
      'side of the grid at which the wall stands')
    call add_pair_keys(t)
    call t%key('KIND', 'choice', 1, '', 'sliding', 'fixed sliding', &
      'fixed: no velocity at the wall; sliding: no velocity normal to it')
    call t%key('POSITION', 'real', 1, 'm', '', '', &
      'coordinate of the wall; not given: at the side of the grid')
    call t%key('FRICTION', 'real', 1, '', '0 if KIND = sliding', '[0,inf)', &
      'Coulomb coefficient of friction on the wall')
    call t%key('TEMPERATURE', 'real', 1, 'K', '', '(0,inf)', &
      'temperature of the wall; not given: adiabatic')

    call add_clamp_keys(t)

    call t%group('LOAD', 'repeat', &
      'A force on a body, shared by its particles in proportion to mass.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('FORCE', 'real', 3, 'N', 'required', '', 'total force')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which the force rises linearly from 0')

    call t%group('TRACTION', 'repeat', 'A force per area on the surface of a body.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('FACE', 'choice', 1, '', 'all', 'xmin xmax ymin ymax zmin zmax all', &
      'faces of the body, by the direction of their outward normal')
    call t%key('LOWER', 'real', 3, 'm', '', '', &
      'lower corner of a box: only faces of particles that are initially inside; not given: '// &
      'no limit')
    call t%key('UPPER', 'real', 3, 'm', '', '', &
      'upper corner of that box; not given: no limit')
    call t%key('PRESSURE', 'real', 1, 'Pa', '0', '', 'pressure, positive into the body')
    call t%key('VECTOR', 'real', 3, 'Pa', '0 0 0', '', 'traction vector, force per initial area')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which the traction rises linearly from 0')

    call t%group('CONTACT', 'repeat', &
      'Contact of two bodies; bodies without it that meet stick together.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of one &BODY')
    call t%key('OTHER', 'text', 1, '', 'required', '&BODY', 'NAME of the other &BODY')
    call t%key('LAW', 'choice', 1, '', 'coulomb', 'coulomb stick frictionless', &
      'law of the tangential force in the contact')
    call t%key('FRICTION', 'real', 1, '', '0.2 if LAW = coulomb', '[0,inf)', &
      'Coulomb coefficient of friction')
    call t%key('NORMAL', 'choice', 1, '', 'regression', 'gradient regression', &
      'contact normal: gradient: from gradients of volume; regression: of a plane between the '// &
      'particles of both bodies; or that of one body where it separates them better')
    call t%key('CONDUCTANCE', 'real', 1, 'W/(m2 K)', '', '[0,inf)', &
      'thermal contact conductance; not given: perfect conduction')
    call t%key('CONDUCTANCE_TABLE', 'real', -64, '', '', '[0,inf)', &
      'instead of CONDUCTANCE, pairs of pressure [Pa] and conductance [W/(m2 K)]; linear '// &
      'between, constant outside')

    call t%may_change('WALL', 'FROM LIBRARY')
    call t%may_change('LOAD', 'FORCE')
    call t%may_change('TRACTION', 'PRESSURE VECTOR')
  end subroutine add_boundary

  !> Add the rows of &HEAT and &SURFACE to the table.
  subroutine add_heat(t)
    type(key_table_t), intent(inout) :: t

    call add_conduction(t)
    call add_surface(t)
    call add_backing(t)
    call t%may_change('HEAT', 'FOURIER SOLVER TOLERANCE STEP EVERY')
    call t%may_change('SURFACE', 'FROM LIBRARY')
  end subroutine add_heat

  !> Rows of &HEAT.
  subroutine add_conduction(t)
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
      'linear solver of implicit steps; auto: fftw for heat alone in a box of constant '// &
      'properties, and where there are more than 50000 cells of one material, else cg; beside '// &
      'mechanics cg or petsc')
    call t%key('TOLERANCE', 'real', 1, 'K', '2', '[1e-6,1e4]', &
      'largest estimated error of a time step, for heat alone or implicit steps, in any cell '// &
      'or node (at the rim of a moving source some hundred times the error of the result); '// &
      'implicit: also the largest warming of a node between two steps')
    call t%key('STEP', 'real', 1, 's', '0', '[0,inf)', 'fixed time step; 0: by TOLERANCE')
    call t%key('EVERY', 'integer', 1, '', '0', '[0,inf)', &
      'backward-euler beside mechanics: a step every so many mechanical ones; 0: by STEP or '// &
      'TOLERANCE')
  end subroutine add_conduction

  !> Rows of &SURFACE, but for backings.
  subroutine add_surface(t)
    type(key_table_t), intent(inout) :: t

    call t%group('SURFACE', 'repeat', 'Exchange of heat at the surface of a body.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('FACE', 'choice', 1, '', 'all', 'xmin xmax ymin ymax zmin zmax sides all', &
      'faces of the body, by the direction of their outward normal; sides: those along x and y')
    call add_pair_keys(t)
    call t%key('COEFFICIENT', 'real', 1, 'W/(m2 K)', 'if TABLE_OF = none', '[0,inf)', &
      'heat transfer coefficient; required unless BACKING = body, which without it has no '// &
      'resistance')
    call t%key('PRESSURE_FACTOR', 'real', 1, 'W/(m2 K)', '0 if TABLE_OF = none', '[0,inf)', &
      'term added to COEFFICIENT for a pressure p of the body on the face: PRESSURE_FACTOR '// &
      '(p/1 MPa)^PRESSURE_EXPONENT')
    call t%key('PRESSURE_EXPONENT', 'real', 1, '', '0.95 if TABLE_OF = none', '(0,2]', &
      'exponent of the pressure; 0.95: plastic contact of rough surfaces')
    call t%key('TABLE_OF', 'choice', 1, '', 'none', 'none pressure', &
      'quantity on which the coefficient depends, by a table: pressure of the body on the face')
    call t%key('TABLE_AT', 'real', -64, 'Pa', 'if TABLE_OF = pressure', '[0,inf)', &
      'rising pressures')
    call t%key('TABLE_COEFFICIENT', 'real', -64, 'W/(m2 K)', 'if TABLE_OF = pressure', '[0,inf)', &
      'coefficients there; linear between, constant outside')
    call t%key('EMISSIVITY', 'real', 1, '', '0', '[0,1]', &
      'emissivity of the face, which radiates as well: EMISSIVITY sigma (T^4 - AMBIENT^4)')
    call t%key('AMBIENT', 'real', 1, 'K', '', '(0,inf)', &
      'temperature on the other side; not given: that of &HEAT')
  end subroutine add_surface

  !> Rows of &SURFACE for backings.
  subroutine add_backing(t)
    type(key_table_t), intent(inout) :: t

    call t%key('BACKING', 'choice', 1, '', 'none', 'none plate lumped body', &
      'what the face is in contact with, modelled without particles: plate: heat conduction '// &
      'normal to the face; lumped: a body of one temperature; body: the metal of the body '// &
      'itself, continued to infinity')
    call t%key('BACKING_CONDUCTIVITY', 'real', 1, 'W/(m K)', 'required if BACKING = plate', &
      '(0,1e6]', 'thermal conductivity of the plate')
    call t%key('BACKING_DENSITY', 'real', 1, 'kg/m3', 'required if BACKING = plate', '(0,inf)', &
      'density of the plate')
    call t%key('BACKING_SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', 'required if BACKING = plate', &
      '[1,1e6]', 'specific heat of the plate')
    call t%key('BACKING_THICKNESS', 'real', 1, 'm', '0 if BACKING = plate', '[0,inf)', &
      'thickness of the plate; 0: infinite')
    call t%key('BACKING_CAPACITY', 'real', 1, 'J/K', 'required if BACKING = lumped', '(0,inf)', &
      'heat capacity of the body of one temperature')
    call t%key('BACKING_TEMPERATURE', 'real', 1, 'K', 'if BACKING = plate or lumped or body', &
      '(0,inf)', 'temperature of the backing at t = 0; not given: AMBIENT, with body '// &
      'that of the body')
    call t%key('BACKING_COOLING', 'real', 1, 'W/(m2 K)', '0 if BACKING = plate or lumped', &
      '[0,inf)', &
        'heat transfer coefficient to AMBIENT of the far side of the plate, or of the body of '// &
        'one temperature, over the area of the face')
  end subroutine add_backing

end module setup_keys_boundary
