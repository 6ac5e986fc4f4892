! SPDX-License-Identifier: MIT
!> Keys of &RUN, &GRID, &TIME and &METHOD.
module groups_run
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_method, add_run

contains

  !> Add &RUN, &GRID and &TIME to the table.
  subroutine add_run(t)
    type(key_table_t), intent(inout) :: t

    call t%group('RUN', 'once', 'Names of the run.')
    call t%key('TITLE', 'text', 1, '', '', '', 'one line about the run, kept in every output')
    call t%key('NAME', 'text', 1, '', '', 'file name', &
      'stem of the output files; not given: stem of the input file')

    call t%group('GRID', 'once required', 'Background grid: a box of cells.')
    call t%key('CELL', 'real', -3, 'm', 'required', '(0,inf)', &
      'edge length of cubic cells, or one for each axis')
    call t%key('LOWER', 'real', 3, 'm', 'required', '', 'lower corner of the box')
    call t%key('UPPER', 'real', 3, 'm', 'required', '', 'upper corner of the box')
    call t%key('PERIODIC', 'text', 1, '', '', 'xyz', &
      'axes along which the box repeats itself; its length there must be whole cells')
    call t%key('GRADED', 'choice', 1, '', 'none', 'none x y z', &
      'axis along which only the cells between the places FINE have the edge of CELL; they '// &
      'grow from there to both sides')
    call t%key('FINE', 'real', 2, 'm', 'required if GRADED = x or y or z', '', &
      'ends of the part with equal cells along the graded axis; its length must be whole cells')
    call t%key('GROWTH', 'real', 1, '', '1.2 if GRADED = x or y or z', '[1,2]', &
      'most that a cell is longer than its neighbour')
    call t%key('LARGEST_CELL', 'real', 1, 'm', '0 if GRADED = x or y or z', '[0,inf)', &
      'edge along the graded axis at which cells stop growing; 0: the longest edge in CELL')

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
    call t%key('ELASTIC_SCALING', 'real', 1, '', '1', '[1,1000]', &
      'divisor of the elastic moduli of metal that can flow, for larger time steps; the flow '// &
      'stress stays; springback is so many times too large, stress of thermal expansion too small')
    call t%key('INERTIAL_FRACTION', 'real', 1, '', '0.05', '(0,1]', &
      'inertial stress of mass scaling, chi rho v^2, over flow stress that is small enough')
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
    call t%key('FBAR', 'logical', 1, '', '', '', &
      'average the volume ratio over the particles of a cell in every step, against volumetric '// &
      'locking; not given: where metal flows, by a part that follows from its rate, and all of '// &
      'it in bodies with a Poisson ratio above 0.42')
    call t%key('SELECTIVE_SCALING', 'choice', 1, '', 'auto', 'off auto on', &
      'nodes with little mass have more inertia, which allows longer steps; auto: with '// &
      'B-splines, cubic cells, two or more particles along each axis of one, MASS_SCALING, '// &
      'a tool, a wall and nothing molten')
    call t%key('SORT_INTERVAL', 'integer', 1, 'steps', '100', '[1,1000]', &
      'most steps from one listing of particles, nodes and ranks to the next')
    call t%key('DEBRIS', 'real', 1, '', '1e-3', '[0,1)', &
      'part of all mass that may leave the grid, as long as it is slower than waves; more '// &
      'ends the run, 0: the first particle does')
    call t%key('REBALANCE', 'real', 1, '', '1.03', '[1,inf)', &
      'most loaded rank over the mean load above which the grid is divided anew')
    call t%key('SLEEPING', 'choice', 1, '', 'auto', 'off auto on', &
      'material that is still stops its mechanics; auto: with MASS_SCALING, if the scene allows')
    call t%key('SLEEP_DISTANCE', 'real', 1, 'm', '0 if SLEEPING = auto or on', '[0,inf)', &
      'material nearer than this to a tool, and within 3.5 cells, is awake; 0: half the radius '// &
      'of the largest tool')
    call t%key('SLEEP_STRESS', 'real', 1, '', '1e-2 if SLEEPING = auto or on', '(0,1)', &
      'change of stress over the largest mean stress of a cube of two cells above which '// &
      'material is awake')
    call t%key('SLEEP_HEAT', 'real', 1, 'K', '20 if SLEEPING = auto or on', '(0,inf)', &
      'change of temperature by which sleeping material wakes')

    call t%may_change('METHOD', &
                      'SELECTIVE_SCALING SORT_INTERVAL DEBRIS REBALANCE SLEEPING '// &
                      'SLEEP_DISTANCE SLEEP_STRESS SLEEP_HEAT')
  end subroutine add_method

end module groups_run
