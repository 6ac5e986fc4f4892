! SPDX-License-Identifier: MIT
!> The table of all groups and keys of the input file, and its print-outs.
!> A new key is a new row here; checks, defaults and the reference page follow.
module setup_keys
  use setup_complaints, only: describe_allowed
  use setup_keys_table, only: group_row_t, key_row_t, key_table_t, quoted, split_words
  implicit none (type, external)
  private

  public :: default_item, key_table, print_keys, print_keys_markdown

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
    call add_heat(t)
    call add_output(t)
  end function key_table

  subroutine add_run(t)
    type(key_table_t), intent(inout) :: t

    call t%group('RUN', 'once', 'Names of the run.')
    call t%key('TITLE', 'text', 1, '', '', '', 'one line about the run, kept in every output')
    call t%key('NAME', 'text', 1, '', '', '', &
      'stem of the output files; not given: stem of the input file')

    call t%group('GRID', 'once required', 'Background grid: a box of cubic cells.')
    call t%key('CELL', 'real', 1, 'm', 'required', '(0,inf)', 'edge length of a cell')
    call t%key('LOWER', 'real', 3, 'm', 'required', '', 'lower corner of the box')
    call t%key('UPPER', 'real', 3, 'm', 'required', '', 'upper corner of the box')

    call t%group('TIME', 'once required', 'Time span, time step and loads on everything.')
    call t%key('END', 'real', 1, 's', 'required', '[0,inf)', 'end of the run (it starts at 0)')
    call t%key('CFL', 'real', 1, '', '0.4', '(0,1]', &
      'time step as a part of the time in which a wave crosses a cell')
    call t%key('DT', 'real', 1, 's', '0', '[0,inf)', 'fixed time step; 0: from CFL')
    call t%key('MASS_SCALING', 'real', 1, '', '1', '[1,1e12)', &
      'factor on the inertial mass, for larger time steps')
    call t%key('GRAVITY', 'real', 3, 'm/s2', '0 0 0', '', 'acceleration of gravity')
    call t%key('MAX_STEPS', 'integer', 1, '', '0', '[0,inf)', &
      'stop after so many steps; 0: no limit')
  end subroutine add_run

  subroutine add_method(t)
    type(key_table_t), intent(inout) :: t

    call t%group('METHOD', 'once', 'Numerical method.')
    call t%key('SHAPE', 'choice', 1, '', 'ugimp', 'linear ugimp bspline', &
      'shape functions between particles and grid')
    call t%key('SCHEME', 'choice', 1, '', 'usl', 'usl usavg', &
      'stress update last, or the mean of first and last')
    call t%key('PIC_FRACTION', 'real', 1, '', '0', '[0,1]', &
      'part of the velocity taken from the grid: 0 is FLIP, 1 is PIC')
    call t%key('FBAR', 'logical', 1, '', '.true.', '', &
      'average the volume ratio over the particles next to each node, against volumetric locking')
    call t%key('SORT_INTERVAL', 'integer', 1, 'steps', '50', '[1,1000]', &
      'steps between two sorts of the particles by cell')
    call t%key('REBALANCE', 'real', 1, '', '1.1', '[1,inf)', &
      'most loaded rank over the mean load above which the grid is divided anew')
  end subroutine add_method

  subroutine add_material(t)
    type(key_table_t), intent(inout) :: t

    call t%group('MATERIAL', 'repeat required', 'A material; bodies refer to its NAME.')
    call t%key('NAME', 'text', 1, '', 'required', '', 'name of the material')
    call t%key('DENSITY', 'real', 1, 'kg/m3', 'required', '(0,inf)', 'mass density')
    call t%key('YOUNGS_MODULUS', 'real', 1, 'Pa', 'required', '(0,inf)', 'elastic modulus')
    call t%key('POISSON_RATIO', 'real', 1, '', 'required', '(-1,0.5)', &
      'ratio of lateral contraction')
    call t%key('LAW', 'choice', 1, '', 'elastic', 'elastic johnson-cook', 'material law')
    call t%key('JC_A', 'real', 1, 'Pa', 'required if LAW = johnson-cook', '(0,inf)', &
      'initial yield stress at T_ROOM and JC_RATE0')
    call t%key('JC_B', 'real', 1, 'Pa', 'required if LAW = johnson-cook', '[0,inf)', &
      'hardening modulus')
    call t%key('JC_N', 'real', 1, '', 'required if LAW = johnson-cook', '[0,inf)', &
      'hardening exponent')
    call t%key('JC_C', 'real', 1, '', 'required if LAW = johnson-cook', '[0,inf)', &
      'sensitivity to the strain rate')
    call t%key('JC_M', 'real', 1, '', 'required if LAW = johnson-cook', '(0,inf)', &
      'exponent of thermal softening')
    call t%key('JC_RATE0', 'real', 1, '1/s', '1', '(0,inf)', 'reference strain rate')
    call t%key('T_ROOM', 'real', 1, 'K', '298', '(0,inf)', &
      'temperature up to which the law does not soften')
    call t%key('T_MELT', 'real', 1, 'K', '1356', '(0,inf)', &
      'temperature at which no strength is left')
    call t%key('SPECIFIC_HEAT', 'real', 1, 'J/(kg K)', '386', '(0,inf)', 'specific heat capacity')
    call t%key('CONDUCTIVITY', 'real', 1, 'W/(m K)', '0', '[0,inf)', 'thermal conductivity')
    call t%key('EXPANSION', 'real', 1, '1/K', '0', '(-0.01,0.01)', &
      'coefficient of linear expansion')
    call t%key('PLASTIC_HEAT', 'real', 1, '', '0.9', '[0,1]', &
      'part of the plastic work that becomes heat (Taylor-Quinney)')
  end subroutine add_material

  subroutine add_body(t)
    type(key_table_t), intent(inout) :: t

    call t%group('BODY', 'repeat required', 'A deformable body; &SHAPE groups give its geometry.')
    call t%key('NAME', 'text', 1, '', 'required', '', 'name of the body')
    call t%key('MATERIAL', 'text', 1, '', 'required', '', 'NAME of its &MATERIAL')
    call t%key('PARTICLES_PER_CELL', 'integer', 1, '', '2', '[1,8]', &
      'particles per cell and direction')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298', '(0,inf)', 'initial temperature')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'initial velocity')
    call t%key('ANGULAR_VELOCITY', 'real', 3, 'rad/s', '0 0 0', '', &
      'initial rotation, added to VELOCITY')
    call t%key('VELOCITY_GRADIENT', 'real', 9, '1/s', '0 0 0 0 0 0 0 0 0', '', &
      'initial dv/dx row by row, added to VELOCITY: xx xy xz yx yy yz zx zy zz')
    call t%key('CENTRE', 'real', 3, 'm', '0 0 0', '', &
      'the point that moves with VELOCITY when there is rotation or a gradient')

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
    call t%key('AXIS', 'choice', 1, '', 'z', 'x y z', 'direction of the cylinder')
    call t%key('ALONG', 'choice', 1, '', 'x', 'x y z', &
      'trapezoid: direction in which the width changes')
    call t%key('ACROSS', 'choice', 1, '', 'y', 'x y z', &
      'trapezoid: direction of the width, centred between LOWER and UPPER')
    call t%key('WIDTH_LOWER', 'real', 1, 'm', 'required if KIND = trapezoid', '[0,inf)', &
      'width at the LOWER end of ALONG')
    call t%key('WIDTH_UPPER', 'real', 1, 'm', 'required if KIND = trapezoid', '[0,inf)', &
      'width at the UPPER end of ALONG')
  end subroutine add_body

  subroutine add_tool(t)
    type(key_table_t), intent(inout) :: t

    call t%group('TOOL', 'repeat', 'A rigid tool that touches the bodies.')
    call t%key('NAME', 'text', 1, '', 'tool', '', 'name of the tool')
    call t%key('KIND', 'choice', 1, '', 'shoulder', 'shoulder plane sphere box', 'geometry')
    call t%key('RADIUS', 'real', 1, 'm', 'required if KIND = shoulder or sphere', '(0,inf)', &
      'radius of the shoulder or sphere')
    call t%key('HEIGHT', 'real', 1, 'm', '0.02', '(0,inf)', 'height of the shoulder above its face')
    call t%key('CONCAVITY_DEG', 'real', 1, 'deg', '0', '[0,30)', &
      'angle by which the face of the shoulder rises towards its axis')
    call t%key('PIN_RADIUS', 'real', 1, 'm', '0', '[0,inf)', &
      'radius of the pin at the face; 0: no pin')
    call t%key('PIN_TIP_RADIUS', 'real', 1, 'm', '0', '[0,inf)', &
      'radius of the pin at its tip; 0: as at the face (a cylinder)')
    call t%key('PIN_LENGTH', 'real', 1, 'm', '0', '[0,inf)', 'length of the pin below the face')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', &
      'place at t = 0: centre of the shoulder face, sphere or box; a point of the plane')
    call t%key('NORMAL', 'real', 3, '', '0 0 1', '', 'plane: direction out of the rigid half space')
    call t%key('SIZE', 'real', 3, 'm', 'required if KIND = box', '(0,inf)', &
      'edge lengths of the box')
    call t%key('TILT_DEG', 'real', 1, 'deg', '0', '[-10,10]', &
      'the shoulder tips backwards against the travel direction +x: trailing edge deeper')
    call t%key('FRICTION', 'real', 1, '', '0.2', '[0,inf)', 'Coulomb coefficient of friction')
    call t%key('SHEAR_LIMIT', 'logical', 1, '', '.true.', '', &
      'friction does not exceed the shear yield stress of the body')
    call t%key('HEAT_SHARE', 'real', 1, '', '1', '[0,1]', &
      'part of the frictional heat that enters the body')

    call t%group('MOTION', 'repeat', &
      'A phase of motion of a tool; phases follow in the order of the file.')
    call t%key('TOOL', 'text', 1, '', 'tool', '', 'NAME of the &TOOL')
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
  end subroutine add_boundary

  subroutine add_heat(t)
    type(key_table_t), intent(inout) :: t

    call t%group('HEAT', 'once', 'Heat conduction; the presence of this group switches it on.')
    call t%key('AMBIENT', 'real', 1, 'K', '298', '(0,inf)', &
      'temperature of the surroundings, where a &SURFACE gives none')
    call t%key('FOURIER', 'real', 1, '', '0.15', '(0,0.5]', &
      'conduction step is at most FOURIER h^2/kappa (h: cell, kappa: diffusivity)')

    call t%group('SURFACE', 'repeat', 'Exchange of heat at the surface of a body.')
    call t%key('BODY', 'text', 1, '', 'required', '', 'NAME of the &BODY')
    call t%key('FACE', 'choice', 1, '', 'all', 'xmin xmax ymin ymax zmin zmax all', &
      'faces of the body by the direction they look to')
    call t%key('COEFFICIENT', 'real', 1, 'W/(m2 K)', 'required', '[0,inf)', &
      'heat transfer coefficient')
    call t%key('AMBIENT', 'real', 1, 'K', '', '(0,inf)', &
      'temperature on the other side; not given: that of &HEAT')
  end subroutine add_heat

  subroutine add_output(t)
    type(key_table_t), intent(inout) :: t

    call t%group('OUTPUT', 'once', 'What is written, and how often.')
    call t%key('FRAME_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two frames of all particles; 0: first and last only')
    call t%key('HISTORY_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two rows of the histories; 0: 500 rows in the run')
    call t%key('CHECKPOINT_INTERVAL', 'real', 1, 's', '0', '[0,inf)', &
      'between two checkpoints; 0: none but at a stop')
    call t%key('PROGRESS_INTERVAL', 'real', 1, 's', '10', '[0,inf)', &
      'wall-clock time between two lines of progress')

    call t%group('PROBE', 'repeat', 'A point of observation with a history of its own.')
    call t%key('NAME', 'text', 1, '', 'required', '', 'name of the probe')
    call t%key('POSITION', 'real', 3, 'm', 'required', '', 'place of the probe at t = 0')
  end subroutine add_output

  !> The `k`-th default value as it would be written in the input; empty if there is none.
  pure function default_item(row, k) result(r)
    type(key_row_t), intent(in) :: row
    integer, intent(in) :: k
    character(:), allocatable :: r
    character(48), allocatable :: list(:)

    r = ''
    if (row%kind == 'text' .or. row%kind == 'choice') then
      r = quoted(trim(row%default))
    else
      call split_words(row%default, list)
      if (k <= size(list)) r = trim(list(k))
    end if
  end function default_item

  !> The table as text, for `stirpoint --keys`.
  subroutine print_keys(unit)
    integer, intent(in) :: unit
    type(key_table_t) :: t
    character(:), allocatable :: about
    integer :: g, k

    t = key_table()
    do g = 1, size(t%groups)
      write (unit, '(6a)') '&', trim(t%groups(g)%name), ' (', occurrence(t%groups(g)), ')  ', &
        trim(t%groups(g)%about)
      do k = t%groups(g)%first, t%groups(g)%last
        about = trim(t%keys(k)%about)
        if (t%keys(k)%requirement(:11) == 'required if') about = about//'; '//t%keys(k)%requirement
        about = trim(about)
        if (t%keys(k)%allowed /= '') about = about//' ('//describe_allowed(t%keys(k))//')'
        write (unit, '(2x,a20,a21,2a)') t%keys(k)%name, kind_of(t%keys(k), with_unit=.true.), &
          padded(default_of(t%keys(k)), 8), about
      end do
      write (unit, '()')
    end do
  end subroutine print_keys

  !> The reference page docs/input.md, for `stirpoint --keys=markdown`.
  subroutine print_keys_markdown(unit)
    integer, intent(in) :: unit
    type(key_table_t) :: t
    integer :: g, k

    t = key_table()
    call print_introduction(unit)
    do g = 1, size(t%groups)
      write (unit, '(/,2a,/)') '## &', trim(t%groups(g)%name)
      write (unit, '(4a,/)') trim(t%groups(g)%about), ' (', occurrence(t%groups(g)), ')'
      write (unit, '(a)') '| key | type | unit | default | allowed | meaning |'
      write (unit, '(a)') '|---|---|---|---|---|---|'
      do k = t%groups(g)%first, t%groups(g)%last
        write (unit, '(13a)') '| `', trim(t%keys(k)%name), '` | ', &
          trim(kind_of(t%keys(k), with_unit=.false.)), ' | ', trim(t%keys(k)%unit), ' | ', &
          default_of(t%keys(k)), ' | ', describe_allowed(t%keys(k)), ' | ', &
          trim(t%keys(k)%about), ' |'
      end do
    end do
  end subroutine print_keys_markdown

  !> How an input file is written.
  subroutine print_introduction(unit)
    integer, intent(in) :: unit
    character(*), parameter :: fence = repeat('`', 3)

    write (unit, '(a)') '# Input reference', '', &
      'Printed by `stirpoint --keys=markdown`; its source is modules/setup/keys.f90.', &
      '', &
      'An input file is a list of Fortran namelist groups. Units are SI; a name says where not.', &
      '', fence, '! a comment', "&BODY NAME = 'plate', MATERIAL = 'copper',", &
      '      VELOCITY = 0.1, 0, 0 /', fence, '', &
      '- Values are divided by commas or blanks and may go over several lines;', &
      '  `3*0.0` is `0.0 0.0 0.0`; `KEY(2) = 1.5` gives the second value alone.', &
      '- Text stands in `''` or `"`; a doubled quote within is one quote.', &
      '- Groups, keys and choices may be in capitals or small letters; names are literal.', &
      '- Logical values are `.true.`, `true`, `T` or `.false.`, `false`, `F`.', &
      '- A value is replaced for one run by `--set GROUP.KEY=VALUE` (all groups of this name),', &
      '  `--set "GROUP(2).KEY=VALUE"` (the second) or `--set "GROUP(name).KEY=VALUE"` (the one', &
      '  with this `NAME`). Text needs no quotes there.', &
      '- Everything that is wrong is reported at once, with line numbers, before the run begins.'
  end subroutine print_introduction

  !> `once`, `once, required`, `any number`, `at least one`.
  pure function occurrence(row) result(r)
    type(group_row_t), intent(in) :: row
    character(:), allocatable :: r

    if (row%repeats) then
      r = trim(merge('at least one', 'any number  ', row%is_required))
    else
      r = trim(merge('once, required', 'once          ', row%is_required))
    end if
  end function occurrence

  !> `3 real [m/s]`.
  pure function kind_of(row, with_unit) result(r)
    type(key_row_t), intent(in) :: row
    logical, intent(in) :: with_unit
    character(20) :: r

    r = row%kind
    if (row%n > 1) write (r, '(i0,1x,a)') row%n, trim(row%kind)
    if (row%n < 0) write (r, '(a,i0,1x,a)') 'up to ', -row%n, trim(row%kind)
    if (with_unit .and. row%unit /= '') r = trim(r)//' ['//trim(row%unit)//']'
  end function kind_of

  !> `text` without a condition, at least `width` wide, and two blanks.
  pure function padded(text, width) result(r)
    character(*), intent(in) :: text
    integer, intent(in) :: width
    character(:), allocatable :: r

    r = text
    if (index(text, ' if ') > 0) r = '-'
    r = r//repeat(' ', max(2, width + 2 - len(r)))
  end function padded

  !> The default, or `-` if there is none.
  pure function default_of(row) result(r)
    type(key_row_t), intent(in) :: row
    character(:), allocatable :: r

    r = trim(row%default)//trim(row%requirement)
    if (r == '') r = '-'
  end function default_of

end module setup_keys
