! SPDX-License-Identifier: MIT
!> The table of all groups and keys of the input file. A new key is a new row here or in
!> setup_keys_body, setup_keys_boundary or setup_keys_tool; checks, defaults and the reference page
!> follow from it. A restart may change the keys that `may_change` names: they control the rest of
!> the run, not the state. All future phases of &MOTION may change, and a future END of a &SOURCE
!> (setup_check_restart).
module setup_keys
  use hooks_list, only: add_hook_keys
  use input_key_table, only: key_table_t
  use setup_keys_body, only: add_body, add_fields, add_material
  use setup_keys_boundary, only: add_boundary, add_heat
  use setup_keys_tool, only: add_tool
  implicit none (type, external)
  private

  public :: key_table

contains

  !> Add &RUN, &GRID and &TIME to the table.
  subroutine add_run(t)
    type(key_table_t), intent(inout) :: t
    character(*), parameter :: graded = ' if GRADED = x or y or z or xy or xz or yz or xyz'

    call t%group('RUN', 'once', 'Names of the run.')
    call t%key('TITLE', 'text', 1, '', '', '', 'title of the run, one line, written to all results')
    call t%key('NAME', 'text', 1, '', '', 'file name', &
      'stem of the output files; not given: stem of the input file')

    call t%group('GRID', 'once required', 'Background grid: a box of cells.')
    call t%key('CELL', 'real', -3, 'm', 'required', '(0,inf)', &
      'edge length of cubic cells, or one for each axis')
    call t%key('LOWER', 'real', 3, 'm', 'required', '', 'lower corner of the box')
    call t%key('UPPER', 'real', 3, 'm', 'required', '', 'upper corner of the box')
    call t%key('PERIODIC', 'text', 1, '', '', 'xyz', &
      'periodic axes; the length of the box along them must be a whole number of cells')
    call t%key('GRADED', 'choice', 1, '', 'none', 'none x y z xy xz yz xyz', &
      'axes with graded cells: between the two coordinates FINE their edge is that of CELL, '// &
      'and from there it grows to both sides')
    call t%key('FINE', 'real', -6, 'm', 'required'//graded, '', &
      'two coordinates along each graded axis between which cells are equal, in the order of '// &
      'the axes; their distance must be a whole number of cells')
    call t%key('GROWTH', 'real', 1, '', '1.2'//graded, '[1,2]', &
      'largest ratio of the edges of two neighbouring cells along a graded axis')
    call t%key('LARGEST_CELL', 'real', 1, 'm', '0'//graded, '[0,inf)', &
      'largest edge of cells along a graded axis; 0: the longest edge in CELL')

    call t%group('TIME', 'once required', 'Time span, time step, mass scaling and gravity.')
    call t%key('END', 'real', 1, 's', 'required', '[0,inf)', 'end of the run (it starts at 0)')
    call t%key('CFL', 'real', 1, '', '0', '[0,3]', &
      'time step over the time in which a pressure wave crosses a cell; 0: what the method allows')
    call t%key('DT', 'real', 1, 's', '0', '[0,inf)', 'fixed time step; 0: from CFL')
    call t%key('MASS_SCALING', 'real', 1, '', '1', '[1,1e12)', &
      'factor on the inertial mass, for larger time steps')
    call t%key('MASS_SCALING_RANGE', 'real', 2, '', '0 0', '[0,1e12)', &
      'smallest and largest mass scaling, between which the run adapts it so that the '// &
      'inertial stress over the flow stress is INERTIAL_FRACTION; it starts with '// &
      'MASS_SCALING, or with the smallest if that is not given; 0 0: constant mass scaling')
    call t%key('ELASTIC_SCALING', 'real', 1, '', '1', '[1,1000]', &
      'divisor of the elastic moduli of metal that can flow, for larger time steps; the flow '// &
      'stress is unchanged; springback is too large by this factor, thermal stress too small '// &
      'by it')
    call t%key('INERTIAL_FRACTION', 'real', 1, '', '0.05', '(0,1]', &
      'acceptable error of mass scaling: inertial stress (mass scaling times rho v^2) over '// &
      'flow stress, and inertial part of the loads on the tools')
    call t%key('GRAVITY', 'real', 3, 'm/s2', '0 0 0', '', 'acceleration of gravity')
    call t%key('MAX_STEPS', 'integer', 1, '', '0', '[0,inf)', &
      'stop after so many steps; 0: no limit')

    call t%may_change('RUN', '*')
    call t%may_change('TIME', 'END MAX_STEPS CFL DT MASS_SCALING MASS_SCALING_RANGE '// &
                      'INERTIAL_FRACTION GRAVITY')
  end subroutine add_run

  !> Add &METHOD to the table.
  subroutine add_method(t)
    type(key_table_t), intent(inout) :: t

    call t%group('METHOD', 'once', 'Numerical method.')
    call t%key('MECHANICS', 'logical', 1, '', '.true.', '', &
      'false: heat conduction alone, in bodies at rest, on a mesh of cells about as large as '// &
      'those of the grid')
    call t%key('SHAPE', 'choice', 1, '', 'auto', 'auto ugimp cpgimp bspline', &
      'shape functions; auto: bspline with a &TOOL, else ugimp; the particle domains of '// &
      'cpgimp follow the strain')
    call t%key('SCHEME', 'choice', 1, '', 'usl', 'usl musl usavg', &
      'time of the stress update: usl: at the end of the step; musl: at its end, with '// &
      'particle velocities mapped to the grid again; usavg: half at its beginning, half at '// &
      'its end')
    call t%key('TRANSFER', 'choice', 1, '', 'flip', 'flip apic xpic fmpm', &
      'velocity transfer from grid to particles')
    call t%key('ORDER', 'integer', 1, '', '2 if TRANSFER = xpic or fmpm', '[1,20]', &
      'order of xpic and fmpm')
    call t%key('EVERY', 'integer', 1, 'steps', '1 if TRANSFER = xpic or fmpm', '[1,100000]', &
      'xpic or fmpm is applied once in so many steps, FLIP in the others')
    call t%key('PIC_FRACTION', 'real', 1, '', '0', '[0,1]', &
      'fraction of PIC in the velocity update: 0 is FLIP, 1 is PIC')
    call t%key('FBAR', 'logical', 1, '', '', '', &
      'F-bar: average the volume ratio over the particles of a cell in every step, against '// &
      'volumetric locking; not given: fully in bodies with a Poisson ratio above 0.42, '// &
      'elsewhere in part where metal flows, the more the faster it flows')
    call t%key('SELECTIVE_SCALING', 'choice', 1, '', 'auto', 'off auto on', &
      'more inertia of nodes with little mass, for longer steps; auto: on with B-splines, '// &
      'cubic cells, at least two particles in a cell along each axis, MASS_SCALING, a tool, a '// &
      'wall and no molten metal')
    call t%key('SORT_INTERVAL', 'integer', 1, 'steps', '100', '[1,1000]', &
      'largest number of steps between two sorts of particles to cells and ranks')
    call t%key('DEBRIS', 'real', 1, '', '1e-3', '[0,1)', &
      'largest fraction of the mass that is removed where it leaves the grid; the run ends if '// &
      'more leaves, or a particle that is faster than pressure waves')
    call t%key('REBALANCE', 'real', 1, '', '1.03', '[1,inf)', &
      'largest load of a rank over the mean load, above which the grid is repartitioned')
    call t%key('SLEEPING', 'choice', 1, '', 'auto', 'off auto on', &
      'material at rest is left out of the mechanics (it sleeps); auto: with MASS_SCALING, if '// &
      'the scene allows it')
    call t%key('SLEEP_DISTANCE', 'real', 1, 'm', '0 if SLEEPING = auto or on', '[0,inf)', &
      'material nearer to a tool than this, or than 3.5 cells, never sleeps; 0: half the '// &
      'radius of the largest tool')
    call t%key('SLEEP_STRESS', 'real', 1, '', '1e-2 if SLEEPING = auto or on', '(0,1)', &
      'material sleeps only if its change of stress is below this fraction of the largest '// &
      'mean stress, in cubes of two cells')
    call t%key('SLEEP_HEAT', 'real', 1, 'K', '20 if SLEEPING = auto or on', '[1e-6,inf)', &
      'change of temperature that wakes sleeping material')

    call t%may_change('METHOD', &
                      'SELECTIVE_SCALING SORT_INTERVAL DEBRIS REBALANCE SLEEPING '// &
                      'SLEEP_DISTANCE SLEEP_STRESS SLEEP_HEAT')
  end subroutine add_method

  !> Add the rows of &OUTPUT and of the groups of outputs to the table.
  subroutine add_output(t)
    type(key_table_t), intent(inout) :: t

    call t%group('OUTPUT', 'once', 'What is written, and how often.')
    call t%key('FRAME_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'time between two frames of all particles; 0: first and last only')
    call t%key('HISTORY_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'time between two rows of the histories; 0: 500 rows in the run')
    call t%key('CHECKPOINT_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'time between two checkpoints; 0: only at the end of the run or when it is stopped')
    call t%key('PROGRESS_INTERVAL', 'real', 1, 's', '10', '[0,inf)', &
      'wall-clock time between two lines of progress in a log file; not given: a twentieth of '// &
      'the time since the start, at least 10 s; a terminal shows one line, updated every second')
    call t%key('SAFETY_INTERVAL', 'real', 1, 's', '600', '[0,inf)', &
      'wall-clock time between two checkpoints that limit the loss by a crash; 0: none')
    call t%key('INITIAL_POSITION', 'logical', 1, '', '.false.', '', &
      'frames hold the position of each particle at t = 0')

    call t%group('PROBE', 'repeat', &
      'A point whose temperature and position are written to a history of its own.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the probe')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', 'place of the probe at t = 0')

    call t%group('TRACER', 'repeat', &
      'Particles whose paths are written to NAME_tracers.csv: those nearest to given positions.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the group of tracers')
    call t%key('KIND', 'choice', 1, '', 'point', 'point line box', &
      'one position, a line of positions or a lattice of them; in line and box only those in metal')
    call t%key('POSITION', 'real', 3, 'm', 'required if KIND = point', '', &
      'position at t = 0')
    call t%key('FROM', 'real', 3, 'm', 'required if KIND = line', '', 'one end of the line')
    call t%key('TO', 'real', 3, 'm', 'required if KIND = line', '', 'other end of the line')
    call t%key('LOWER', 'real', 3, 'm', 'required if KIND = box', '', 'lower corner')
    call t%key('UPPER', 'real', 3, 'm', 'required if KIND = box', '', &
      'upper corner; a layer is a flat box')
    call t%key('NUMBER', 'integer', -3, '', ' if KIND = line or box', '[1,100000]', &
      'number of tracers on the line, ends included, or along each axis of the box: one '// &
      'number, or three')
    call t%key('SPACING', 'real', 1, 'm', ' if KIND = line or box', '(0,inf)', &
      'distance between tracers, instead of NUMBER; they are centred on the line or in the box')
    call t%key('INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'time between two rows of a tracer; 0: &OUTPUT HISTORY_INTERVAL')

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
      'strain: flow stress at a given plastic strain rate; shear: simple shear by the '// &
      'elastic-plastic stress update; history: as FILE says')
    call t%key('RATE', 'real', 1, '1/s', '1 if KIND = strain or shear', '(0,inf)', &
      'plastic strain rate; shear: the shear rate is sqrt(3) times this')
    call t%key('STRAIN', 'real', 1, '', '1 if KIND = strain or shear', '(0,inf)', &
      'strain at the end')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298', '(0,inf)', &
      'initial temperature')
    call t%key('ADIABATIC', 'logical', 1, '', '.false.', '', &
      'PLASTIC_HEAT of the plastic work heats the point')
    call t%key('STEP', 'real', 1, '', '1e-3', '(0,0.1]', 'longest increment of strain')
    call t%key('ROWS', 'integer', 1, '', '200', '[1,1000000]', 'rows of the curve')
    call t%key('FILE', 'text', 1, '', 'required if KIND = history', '', &
      'CSV with columns time[s], temperature[K] and plastic_strain[1] or strain_rate[1/s], '// &
      'beside the input')

    call t%may_change('PATH', '*')
  end subroutine add_paths

  !> Table of all keys. Columns: name, type, number of values (-n: up to n), unit, default, allowed
  !> values, meaning.
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
    call add_hook_keys(t)
    call add_output(t)
    call add_paths(t)
  end function key_table

end module setup_keys
