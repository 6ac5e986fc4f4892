! SPDX-License-Identifier: MIT
!> Input layer: syntax of values, defaults, overrides, and every kind of complaint.
program test_input
  use base_kinds, only: rp
  use base_text, only: str
  use check, only: begin_tests, end_tests, expect, expect_close, expect_equal, this_rank
  use input_key_table, only: key_table_t
  use input_keys, only: default_item, print_keys, print_keys_markdown
  use input_reading, only: read_input, read_input_text
  use input_scan, only: read_file
  use input_values, only: input_t
  use input_wording, only: check_value
  use setup_keys, only: key_table
  implicit none (type, external)

  character, parameter :: nl = new_line('a')
  character(*), parameter :: grid = '&GRID CELL=1 LOWER=0,0,0 UPPER=3*9. /'//nl
  character(*), parameter :: time = '&TIME END=1 /'//nl
  character(*), parameter :: material = &
    "&MATERIAL NAME='cu' DENSITY=8960 YOUNGS_MODULUS=1.2d11 POISSON_RATIO=0.34 /"//nl
  character(*), parameter :: body = "&BODY NAME='bar' MATERIAL='cu' /"//nl
  character(*), parameter :: shape = "&SHAPE BODY='bar' LOWER=0,0,0 UPPER=1,1,1 /"//nl
  character(*), parameter :: base = grid//time//material//body//shape
  character(40), parameter :: no_sets(0) = ''

  call begin_tests()
  call test_table()
  call test_values()
  call test_layout()
  call test_look_ups()
  call test_bad_syntax()
  call test_bad_names()
  call test_bad_values()
  call test_requirements()
  call test_overrides()
  call test_bad_overrides()
  call test_effective_text()
  call test_files()
  call test_diagnostics()
  call end_tests()

contains

  !> Parse `text`, which must be good.
  subroutine parse(text, input, overrides)
    character(*), intent(in) :: text
    type(input_t), intent(out) :: input
    character(*), intent(in), optional :: overrides(:)

    if (present(overrides)) then
      call read_input_text(key_table(), 't.nml', text, overrides, input)
    else
      call read_input_text(key_table(), 't.nml', text, no_sets, input)
    end if
    if (input%diagnostics%count() > 0) call input%diagnostics%print(6)
    call expect('no complaint about '//text(:min(30, len(text))), input%diagnostics%count() == 0)
  end subroutine parse

  !> `text` must give `want` as its only complaint.
  subroutine bad(text, want, set)
    character(*), intent(in) :: text, want
    character(*), intent(in), optional :: set
    type(input_t) :: input

    if (present(set)) then
      call read_input_text(key_table(), 't.nml', text, [set], input)
    else
      call read_input_text(key_table(), 't.nml', text, no_sets, input)
    end if
    call expect('one complaint: '//want, input%diagnostics%count() == 1)
    if (input%diagnostics%count() /= 1) call input%diagnostics%print(6)
    if (input%diagnostics%count() == 0) return
    call expect_equal('complaint', input%diagnostics%text(1), want)
  end subroutine bad

  !> The value of a key of &BODY (first line of the input) must give `want`.
  subroutine bad_value(assignment, want, line)
    character(*), intent(in) :: assignment, want
    integer, intent(in), optional :: line   !! 2 if absent
    character :: digit

    digit = '2'
    if (present(line)) write (digit, '(i1)') line
    call bad("&BODY NAME='b' MATERIAL='cu',"//nl//assignment//' /'//nl//base, &
             't.nml:'//digit//': error: &BODY '//want)
  end subroutine bad_value

  !> Every default obeys its own row.
  subroutine test_table()
    type(key_table_t) :: table
    character(:), allocatable :: item, message
    integer :: k, n, unit

    table = key_table()
    do k = 1, table%n_keys()
      associate (row => table%keys(k))
        message = ''
        if (row%default /= '') then
          do n = 1, abs(row%n)
            item = default_item(row, n)
            if (message == '') message = check_value(row, n, item)
          end do
        end if
        if (message /= '') call expect('default of '//trim(row%name)//': '//message, .false.)
        if (all(row%kind /= [character(8) :: 'real', 'integer', 'logical', 'text', 'choice'])) then
          call expect('type of '//trim(row%name), .false.)
        end if
        if (count(table%groups%first <= k .and. table%groups%last >= k) /= 1) then
          call expect('group of '//trim(row%name), .false.)
        end if
      end associate
    end do
    call expect('the table is not empty', table%n_keys() > 90)
    open (newunit=unit, status='scratch', action='readwrite')
    call print_keys(table, unit, 0)
    call print_keys_markdown(table, unit)
    close (unit)
  end subroutine test_table

  !> What a value may look like.
  subroutine test_values()
    type(input_t) :: input
    character(*), parameter :: reals(12) = [character(12) :: '1', '1.', '1.d5', '1e-3', '.5', &
      '+2.5E+1', '-7', '1.5D-2', '3q1', '1e-400', '0.1e008', '00012']
    real(rp), parameter :: want(12) = [1.0_rp, 1.0_rp, 1.0e5_rp, 1.0e-3_rp, 0.5_rp, &
      25.0_rp, -7.0_rp, 1.5e-2_rp, 30.0_rp, 0.0_rp, 1.0e7_rp, 12.0_rp]
    character(*), parameter :: yes(7) = [character(7) :: '.true.', 'T', 'true', '.T.', 't', &
      '.TRUE.', 'True']
    character(*), parameter :: no(6) = [character(7) :: '.false.', 'F', 'false', '.f.', 'f', &
      'FALSE']
    character(*), parameter :: vectors(7) = [character(16) :: '1,2,3', '1 2 3', '1, 2 3,', &
      '1 ,2 , 3', '1'//nl//'2,'//nl//' 3', '1 2 ! x'//nl//'3', '1'//achar(9)//'2 3']
    integer :: k

    do k = 1, size(reals)
      call parse('&MOTION SPIN_RPM = '//trim(reals(k))//'/'//base, input)
      call expect_close('real '//reals(k), input%real('MOTION', 1, 'SPIN_RPM'), want(k))
    end do
    do k = 1, size(yes)
      call parse('&TOOL RADIUS=1 POSITION=3*0 SHEAR_LIMIT = '//trim(yes(k))//'/'//base, input)
      call expect('true: '//yes(k), input%logical('TOOL', 1, 'SHEAR_LIMIT'))
    end do
    do k = 1, size(no)
      call parse('&TOOL RADIUS=1 POSITION=3*0 SHEAR_LIMIT = '//trim(no(k))//'/'//base, input)
      call expect('false: '//no(k), .not. input%logical('TOOL', 1, 'SHEAR_LIMIT'))
    end do
    do k = 1, size(vectors)
      call parse('&MOTION VELOCITY = '//trim(vectors(k))//'/'//base, input)
      call expect('vector', all(nint(input%reals('MOTION', 1, 'VELOCITY', 3)) == [1, 2, 3]))
    end do
    call parse('&MOTION VELOCITY = 2*1.5, -1 /'//base, input)
    call expect('repeat count', all(nint(2*input%reals('MOTION', 1, 'VELOCITY', 3)) == [3, 3, -2]))
    call parse('&MOTION VELOCITY(3) = 2, velocity(1)=5 /'//base, input)
    call expect('indices', all(nint(input%reals('MOTION', 1, 'VELOCITY', 3)) == [5, 0, 2]))
    call parse('&MOTION VELOCITY(2) = 1, 2 /'//base, input)
    call expect('from an index', all(nint(input%reals('MOTION', 1, 'VELOCITY', 3)) == [0, 1, 2]))
    call parse('&TIME END = 1 MAX_STEPS = +12 /'//grid//material//body//shape, input)
    call expect('integer', input%integer('TIME', 1, 'MAX_STEPS') == 12)
  end subroutine test_values

  !> Quotes, comments, line ends.
  subroutine test_layout()
    type(input_t) :: input
    character(*), parameter :: cr = achar(13)

    call parse('&RUN TITLE = ''it''''s "a/b" ! & = x'' NAME="oneil.1"/'//base, input)
    call expect_equal('quotes', input%text('RUN', 1, 'TITLE'), 'it''s "a/b" ! & = x')
    call expect_equal('other quotes', input%text('RUN', 1, 'NAME'), 'oneil.1')
    call parse("! it's & comment / = "//nl//base//'&RUN'//nl//"TITLE='out/x.h5' ! don't"//nl//'/', &
               input)
    call expect_equal('path', input%text('RUN', 1, 'TITLE'), 'out/x.h5')
    call expect('line of a group', input%line('RUN', 1) == 7)
    call expect('line of a key', input%line('RUN', 1, 'TITLE') == 8)
    call expect('line of a key not given', input%line('RUN', 1, 'NAME') == 7)
    call parse('&run'//achar(9)//"title = 'x',"//cr//nl//'/'//cr//nl//cr//nl//base, input)
    call expect_equal('CRLF and tabs', input%text('RUN', 1, 'TITLE'), 'x')
    call parse(char(239)//char(187)//char(191)//base(:len(base) - 1), input)
    call expect('byte order mark, no newline at the end', input%count('SHAPE') == 1)
    call parse('&RUN TITLE='//repeat(' ', 5000)//"'"//repeat('x', 3000)//"' /"//base, input)
    call expect('long lines', len(input%text('RUN', 1, 'TITLE')) == 3000)
    call parse('&RUN/&HEAT/'//base//'&METHOD SHAPE="Bspline"/', input)
    call expect_equal('choice in capitals', input%text('METHOD', 1, 'SHAPE'), 'bspline')
    call expect('empty group', input%count('HEAT') == 1 .and. input%count('OUTPUT') == 0)
  end subroutine test_layout

  !> Counts, defaults, given or not, several groups of a name.
  subroutine test_look_ups()
    type(input_t) :: input

    call parse("&BODY NAME='a' MATERIAL='cu' TEMPERATURE=400 VELOCITY=1,2,3 /"//base, input)
    call expect('count', input%count('BODY') == 2 .and. input%count('TOOL') == 0)
    call expect_equal('text of the first', input%text('BODY', 1, 'NAME'), 'a')
    call expect_equal('text of the second', input%text('BODY', 2, 'NAME'), 'bar')
    call expect_close('given', input%real('BODY', 1, 'TEMPERATURE'), 400.0_rp)
    call expect_close('default', input%real('BODY', 2, 'TEMPERATURE'), 298.0_rp)
    call expect('is given', input%given('BODY', 1, 'TEMPERATURE'))
    call expect('is not given', .not. input%given('BODY', 2, 'TEMPERATURE'))
    call expect('default vector', all(nint(input%reals('BODY', 2, 'VELOCITY', 3)) == 0))
    call expect('some components', all(nint(input%reals('BODY', 1, 'VELOCITY', 2)) == [1, 2]))
    call expect('default integer', input%integer('METHOD', 1, 'SORT_INTERVAL') == 100)
    call expect_equal('default choice', input%text('METHOD', 1, 'SHAPE'), 'auto')
    call expect_equal('default text', input%text('RUN', 1, 'TITLE'), '')
    call expect_equal('name of the run', input%text('RUN', 1, 'NAME'), 't')
    call expect('group not there is not given', .not. input%given('HEAT', 1, 'AMBIENT'))
    call expect('line of a group not there', input%line('HEAT', 1) == 0)
  end subroutine test_look_ups

  !> What the scanner complains about.
  subroutine test_bad_syntax()
    call bad(base//'some words'//nl, 't.nml:6: error: text outside a group: "some words" '// &
             '(a group is &NAME KEY = value, ... /)')
    call bad('&RUN / junk'//nl//base, 't.nml:1: error: text outside a group: "junk" '// &
             '(a group is &NAME KEY = value, ... /)')
    call bad("&RUN TITLE='x'"//nl//base, 't.nml:1: error: &RUN is not closed with /')
    call bad(base//"&RUN TITLE='x'"//nl, 't.nml:6: error: &RUN is not closed with /')
    call bad('&RUN'//nl//" TITLE='x /"//nl//'/'//nl//base, &
             "t.nml:2: error: text in quotes is not closed on this line: 'x /")
    call bad("&RUN TITLE='x, NAME='y' /"//nl//base, &
             "t.nml:1: error: text in quotes is not closed on this line: ' /")
    call bad("&MATERIAL NAME='x, DENSITY=1 /"//nl//base, &
             "t.nml:1: error: text in quotes is not closed on this line: 'x, DENSITY=1 /")
    call bad('&RUN'//nl//"'x' /"//base, 't.nml:2: error: a value without a key: "''x''"')
    call bad('&RUN'//nl//'= 3 /'//base, 't.nml:2: error: there is no key before the =')
    call bad('&RUN'//nl//'TITLE = ,'//nl//" NAME='x' /"//base, 't.nml:2: error: TITLE has no value')
    call bad('&RUN'//nl//'TITLE = /'//base, 't.nml:2: error: TITLE has no value')
    call bad('&MOTION'//nl//'VELOCITY(0) = 1 /'//base, &
             't.nml:2: error: VELOCITY(...): the index must be a whole number above 0')
    call bad('&MOTION'//nl//'VELOCITY(1:2) = 1 /'//base, &
             't.nml:2: error: VELOCITY(...): the index must be a whole number above 0')
  end subroutine test_bad_syntax

  !> Groups and keys that are not in the table, or twice in the file.
  subroutine test_bad_names()
    call bad(base//"&BDY NAME='x' FOO=2 /", &
             't.nml:6: error: unknown group &BDY; did you mean BODY?')
    call bad(base//'&QUITE_OTHER /', 't.nml:6: error: unknown group &QUITE_OTHER; known are '// &
             'RUN GRID TIME METHOD MATERIAL BODY SHAPE TOOL MOTION WALL CLAMP LOAD '// &
             'TRACTION CONTACT FIELD HEAT SURFACE SOURCE OUTPUT PROBE TRACER PATH')
    call bad_value('TEMPRATURE = 3', 'has no key TEMPRATURE; did you mean TEMPERATURE?')
    call bad_value('COLOUR = 3', 'has no key COLOUR; known are NAME MATERIAL '// &
                   'PARTICLES_PER_CELL LATTICE TEMPERATURE VELOCITY ANGULAR_VELOCITY '// &
                   'VELOCITY_GRADIENT CENTRE DEFORMATION RIGID')
    call bad_value('TEMPERATURE = 300'//nl//'TEMPERATURE = 400', &
                   'TEMPERATURE is given twice (first on line 2)', line=3)
    call bad_value('VELOCITY = 1,2,3'//nl//'VELOCITY(2) = 4', &
                   'VELOCITY is given twice (first on line 2)', line=3)
    call bad(base//'&TIME END=2 /', &
             't.nml:6: error: &TIME may be given only once (first on line 2)')
    call bad(grid//material//body//shape, 't.nml: error: there is no &TIME (required)')
    call bad(grid//time//material//shape, 't.nml: error: there is no &BODY (required)')
  end subroutine test_bad_names

  !> What would be common in degrees Celsius is refused by all keys of a temperature, and by no key
  !> of a difference or of another unit in kelvin.
  subroutine test_celsius()
    type(key_table_t) :: table
    character(:), allocatable :: times
    integer :: k, n

    table = key_table()
    n = 0
    do k = 1, table%n_keys()
      associate (row => table%keys(k))
        if (row%unit /= 'K') cycle
        times = str(max(1, row%n))//'*'
        if (all(row%name /= [character(24) :: 'SLEEP_HEAT', 'TOLERANCE', 'TP_CALIBRATED'])) then
          n = n + 1
          call expect(trim(row%name)//' = 25', index(check_value(row, 0, times//'25'), &
                      '77 K: temperatures are in kelvin, 25 C is 298.15 K') > 0)
          call expect(trim(row%name)//' = 298', check_value(row, 0, times//'298') == '')
        else
          call expect(trim(row%name)//' = 25', check_value(row, 0, times//'25') == '')
        end if
      end associate
    end do
    call expect('keys of temperatures', n > 12)
  end subroutine test_celsius

  !> Values that do not fit the table.
  subroutine test_bad_values()
    character(*), parameter :: junk(12) = [character(12) :: "'hot'", 'nan', 'inf', '-Infinity', &
      '1e999', '1.2.3', '1+5', '0x1f', '1e', '.', '--1', '.true.']
    integer :: k

    do k = 1, size(junk)
      call bad_value('TEMPERATURE = '//trim(junk(k)), &
                     'TEMPERATURE = '//trim(junk(k))//': expected a real number [K]')
    end do
    call bad_value('TEMPERATURE = 8,96', 'TEMPERATURE = 8,96: expected a real number [K], '// &
                   'found 2 values (a decimal comma is not possible)')
    call bad_value('TEMPERATURE = 0', 'TEMPERATURE = 0: must be > 0 [K]')
    call test_celsius()
    call bad_value('VELOCITY = 1, x, 3', 'VELOCITY = 1, x, 3: expected 3 real numbers [m/s]')
    call bad_value('VELOCITY = 1, 2', 'VELOCITY = 1, 2: expected 3 real numbers [m/s], found 2')
    call bad_value('VELOCITY = 4*0', 'VELOCITY = 4*0: expected 3 real numbers [m/s], found 4')
    call bad_value('VELOCITY = 1,,3', 'VELOCITY = 1,,3: there is nothing before a comma')
    call bad_value('VELOCITY = 3*', 'VELOCITY = 3*: not a repeat count and a value')
    call bad_value('VELOCITY = 0*1', 'VELOCITY = 0*1: not a repeat count and a value')
    call bad_value('VELOCITY = 99999999999*1', &
                   'VELOCITY = 99999999999*1: not a repeat count and a value')
    call bad_value('VELOCITY(4) = 1', 'VELOCITY(4) = 1: the key has only 3 values')
    call bad_value('TEMPERATURE(2) = 1', 'TEMPERATURE(2) = 1: the key has only 1 value')
    call bad_value('PARTICLES_PER_CELL = 2.5', &
                   'PARTICLES_PER_CELL = 2.5: expected up to 3 integers')
    call bad_value('PARTICLES_PER_CELL = 99999999999', &
                   'PARTICLES_PER_CELL = 99999999999: expected up to 3 integers')
    call bad_value('PARTICLES_PER_CELL = 9', 'PARTICLES_PER_CELL = 9: must be >= 1 and <= 8')
    call bad('&RUN TITLE = cu /'//base, 't.nml:1: error: &RUN TITLE = cu: text must be in quotes')
    call bad('&RUN TITLE = a long title /'//base, &
             't.nml:1: error: &RUN TITLE = a long title: '//'expected a text in quotes, found 3')
    call bad("&RUN TITLE = 'a''/"//nl//'/'//base, &
             "t.nml:1: error: text in quotes is not closed on this line: 'a''/")
    call bad("&METHOD SHAPE = 'bslpine' /"//base, &
             "t.nml:1: error: &METHOD SHAPE = 'bslpine': must be one of "// &
             'auto, ugimp, cpgimp, bspline; did you mean bspline?')
    call bad("&METHOD SHAPE = 'cubic' /"//base, "t.nml:1: error: &METHOD SHAPE = 'cubic': "// &
             'must be one of auto, ugimp, cpgimp, bspline')
    call bad('&METHOD PIC_FRACTION = 1.5 /'//base, &
             't.nml:1: error: &METHOD PIC_FRACTION = 1.5: must be >= 0 and <= 1')
    call bad('&HEAT FOURIER = 0 /'//base, &
             't.nml:1: error: &HEAT FOURIER = 0: must be > 0 and <= 0.5')
    call bad("&CLAMP LOWER=3*0 UPPER=3*1 COMPONENTS = 'xw' /"//base, &
             "t.nml:1: error: &CLAMP COMPONENTS = 'xw': only the characters xyz may be used")
    call bad('&TOOL RADIUS=1 POSITION=3*0 SHEAR_LIMIT=yes /'//base, &
             't.nml:1: error: &TOOL SHEAR_LIMIT = yes: expected .true. or .false.')
  end subroutine test_bad_values

  !> Keys that must be there.
  subroutine test_requirements()
    character :: index(2), value(2)
    integer :: k

    do k = 1, 3
      index = pack(['1', '2', '3'], [1, 2, 3] /= k)
      value = pack(['4', '5', '6'], [1, 2, 3] /= k)
      call bad("&PROBE NAME='p' POSITION("//index(1)//')='//value(1)//' POSITION('//index(2)// &
               ')='//value(2)//' /'//base, 't.nml:1: error: &PROBE POSITION = '//value(2)// &
               ': not all of its 3 values are given')
    end do
    call bad('&PROBE POSITION=3*0 /'//base, 't.nml:1: error: &PROBE has no NAME (required)')
    call bad("&PROBE NAME='' POSITION=3*0 /"//base, &
             "t.nml:1: error: &PROBE NAME = '': must not be empty")
    call bad("&PROBE NAME='p' POSITION(2)=3 /"//base, &
             't.nml:1: error: &PROBE POSITION = 3: not all of its 3 values are given')
    call bad(nl//"&SHAPE BODY='bar' KIND='sphere' CENTRE=3*0 /"//base, &
             't.nml:2: error: &SHAPE has no RADIUS (required if KIND = cylinder or sphere)')
    call bad(nl//"&SHAPE BODY='bar' LOWER=3*0 /"//base, &
             't.nml:2: error: &SHAPE has no UPPER (required if KIND = box or trapezoid)')
    call bad(nl//"&SHAPE BODY='bar' KIND='spheer' /"//base, &
             "t.nml:2: error: &SHAPE KIND = 'spheer': must be one of box, cylinder, sphere, "// &
             'trapezoid, stl; did you mean sphere?')
  end subroutine test_requirements

  !> `--set` in all its forms.
  subroutine test_overrides()
    type(input_t) :: input
    character(*), parameter :: two = "&BODY NAME='plate' MATERIAL='cu' VELOCITY=1,2,3 /"//base

    call parse(two, input, ['BODY.TEMPERATURE=500'])
    call expect_close('first of all', input%real('BODY', 1, 'TEMPERATURE'), 500.0_rp)
    call expect_close('second of all', input%real('BODY', 2, 'TEMPERATURE'), 500.0_rp)
    call expect('set is given', input%given('BODY', 2, 'TEMPERATURE'))
    call expect('line of an override', input%line('BODY', 2, 'TEMPERATURE') == -1)
    call parse(two, input, &
               [character(40) :: 'BODY(2).temperature=500', 'body(2).TEMPERATURE = 600'])
    call expect_close('not the first', input%real('BODY', 1, 'TEMPERATURE'), 298.0_rp)
    call expect_close('the last override counts', input%real('BODY', 2, 'TEMPERATURE'), 600.0_rp)
    call parse(two, input, ['BODY(plate).VELOCITY=4,5,6'])
    call expect('by name', all(nint(input%reals('BODY', 1, 'VELOCITY', 3)) == [4, 5, 6]))
    call parse(two, input, ['BODY(1).VELOCITY(2)=7'])
    call expect('one component', all(nint(input%reals('BODY', 1, 'VELOCITY', 3)) == [1, 7, 3]))
    call parse("&PROBE NAME='p' POSITION=1,1,1 /"//two, input, &
               [character(40) :: 'METHOD.SHAPE=bspline', 'RUN.TITLE="x y"', 'PROBE.NAME=its a.b=c'])
    call expect_equal('group made for it', input%text('METHOD', 1, 'SHAPE'), 'bspline')
    call expect_equal('quoted text', input%text('RUN', 1, 'TITLE'), 'x y')
    call expect_equal('text without quotes', input%text('PROBE', 1, 'NAME'), 'its a.b=c')
    call parse(base, input, ['SHAPE.KIND=box'])
    call parse("&BODY NAME='a(b).c' MATERIAL='cu' TEMPERATURE='bad' /"//base, input, &
               ['BODY.TEMPERATURE=500'])
    call expect_close('a bad value is replaced', input%real('BODY', 1, 'TEMPERATURE'), 500.0_rp)
  end subroutine test_overrides

  !> Overrides that cannot be followed.
  subroutine test_bad_overrides()
    call bad(base, '--set BODY.TEMPERATURE=hot: error: &BODY TEMPERATURE = hot: '// &
             'expected a real number [K]', 'BODY.TEMPERATURE=hot')
    call bad("&BODY NAME='two' MATERIAL='cu' /"//nl//base, &
             '--set BODY.TEMPERATURE=-4: error: &BODY TEMPERATURE = -4: '//'must be > 0 [K]', &
             'BODY.TEMPERATURE=-4')
    call bad(base, '--set BODY: error: expected GROUP.KEY=VALUE', 'BODY')
    call bad(base, '--set BODY.TEMPERATURE: error: expected GROUP.KEY=VALUE', 'BODY.TEMPERATURE')
    call bad(base, '--set BODY.=3: error: expected GROUP.KEY=VALUE', 'BODY.=3')
    call bad(base, '--set .NAME=3: error: expected GROUP.KEY=VALUE', '.NAME=3')
    call bad(base, '--set BODY.TEMPERATURE=: error: expected GROUP.KEY=VALUE', 'BODY.TEMPERATURE=')
    call bad(base, '--set BODY(1.TEMPERATURE=3: error: expected GROUP.KEY=VALUE', &
             'BODY(1.TEMPERATURE=3')
    call bad(base, '--set BODDY.NAME=3: error: unknown group &BODDY; did you mean BODY?', &
             'BODDY.NAME=3')
    call bad(base, '--set BODY.NAMES=3: error: &BODY has no key NAMES; did you mean NAME?', &
             'BODY.NAMES=3')
    call bad(base, '--set BODY(3).NAME=3: error: the input has no such &BODY', 'BODY(3).NAME=3')
    call bad(base, '--set BODY(foo).NAME=3: error: the input has no such &BODY', 'BODY(foo).NAME=3')
    call bad(base, '--set TOOL.NAME=x: error: the input has no such &TOOL', 'TOOL.NAME=x')
    call bad(base, '--set TIME.CFL=4: error: &TIME CFL = 4: must be >= 0 and <= 3', 'TIME.CFL=4')
  end subroutine test_bad_overrides

  !> The effective text says the same as file and overrides together.
  subroutine test_effective_text()
    type(input_t) :: input, again
    character(:), allocatable :: text

    call parse("&RUN TITLE='it''s' ! x"//nl//"/ &MOTION VELOCITY(2)=3 / &BODY NAME='b',"// &
               "MATERIAL='cu' VELOCITY=2*1, 2 /"//base, input, &
               [character(40) :: 'BODY(1).VELOCITY(3)=9', 'HEAT.AMBIENT=300'])
    text = input%text_of_file()
    call parse(text, again)
    call expect_equal('the same text', again%text_of_file(), text)
    call expect_equal('text', again%text('RUN', 1, 'TITLE'), "it's")
    call expect('vector', all(nint(again%reals('BODY', 1, 'VELOCITY', 3)) == [1, 1, 9]))
    call expect('component', all(nint(again%reals('MOTION', 1, 'VELOCITY', 3)) == [0, 3, 0]))
    call expect_close('made group', again%real('HEAT', 1, 'AMBIENT'), 300.0_rp)
    call expect('begins so', index(text, '&RUN'//nl//"  TITLE = 'it''s'"//nl//'/'//nl// &
                                   '&MOTION'//nl//'  VELOCITY(2) = 3'//nl//'/'//nl) == 1)
  end subroutine test_effective_text

  !> Files on disk: this one, none, a directory.
  subroutine test_files()
    type(input_t) :: input
    character(:), allocatable :: text, problem
    character(:), allocatable :: file
    integer :: unit

    file = 'test_input.case'//str(this_rank())//'.nml'   ! every rank has its own
    open (newunit=unit, file=file, access='stream', form='unformatted', status='replace', &
          action='write')
    write (unit) base
    close (unit)
    call read_input(key_table(), './'//file, no_sets, input)
    call expect('a good file', input%diagnostics%count() == 0)
    call expect_equal('stem', input%text('RUN', 1, 'NAME'), file(:len(file) - 4))
    open (newunit=unit, file=file, action='readwrite')
    write (unit, '(a)') input%text_of_file()
    close (unit)
    call read_file(file, text, problem)
    call expect_equal('echo', text, input%text_of_file()//nl)
    open (newunit=unit, file=file, action='readwrite')
    close (unit, status='delete')
    call read_input(key_table(), file, no_sets, input)
    call expect('no file', input%diagnostics%count() == 1)
    call expect('no file: message', &
                index(input%diagnostics%text(1), file//': error: cannot be read: ') == 1)
    call expect('no file: empty input', input%count('BODY') == 0)
    call read_input(key_table(), '.', no_sets, input)
    call expect('a directory', input%diagnostics%count() == 1)
    call read_input_text(key_table(), 't.nml', '', no_sets, input)
    call expect('empty text: five groups are missing', input%diagnostics%count() == 5)
  end subroutine test_files

  !> All at once, in the order of the lines, with those of later checks.
  subroutine test_diagnostics()
    type(input_t) :: input
    character(200) :: line
    integer :: unit

    call read_input_text(key_table(), 't.nml', "&BODY NAME='b'"//nl//"MATERIAL='cu' /"//nl// &
                         '&TIM/'//nl//'x'//nl//grid//"&MATERIAL NAME='al' DENSITY=8960 "// &
                         'YOUNGS_MODULUS=1.2d11 POISSON_RATIO=0.34 /'//nl// &
                         "&SHAPE BODY='b' LOWER=0,0,0 UPPER=1,1,1 /"//nl, ['BODY(b).MATERIAL=al'], &
                         input)
    call input%diagnostics%add('t.nml', 2, 'late')
    call input%report('BODY', 1, 'NAME', 'no such name')
    call input%report('BODY', 1, 'MATERIAL', 'no such material')
    call input%report('BODY', 1, '', 'has no particles')
    call input%report('BODY', 1, 'TEMPERATURE', 'too cold')
    call input%diagnostics%add('t.nml', input%line('BODY', 1, 'MATERIAL'), 'second')
    call input%diagnostics%add('t.nml', 2, 'late')
    call expect('number', input%diagnostics%count() == 9)
    call expect_equal('1', input%diagnostics%text(1), &
                      "t.nml:1: error: &BODY NAME = 'b': no such name")
    call expect_equal('2', input%diagnostics%text(2), 't.nml:1: error: &BODY has no particles')
    call expect_equal('3', input%diagnostics%text(3), 't.nml:1: error: &BODY TEMPERATURE: too cold')
    call expect_equal('4', input%diagnostics%text(4), 't.nml:2: error: late')
    call expect_equal('5', input%diagnostics%text(5), &
                      't.nml:3: error: unknown group &TIM; did you mean TIME?')
    call expect_equal('7', input%diagnostics%text(7), 't.nml: error: there is no &TIME (required)')
    call expect_equal('8', input%diagnostics%text(8), &
                      "--set BODY(b).MATERIAL=al: error: &BODY MATERIAL = 'al': no such material")
    call expect_equal('9', input%diagnostics%text(9), '--set BODY(b).MATERIAL=al: error: second')
    open (newunit=unit, status='scratch', action='readwrite')
    call input%diagnostics%print(unit)
    rewind (unit)
    read (unit, '(a)') line
    close (unit)
    call expect_equal('printed', trim(line), input%diagnostics%text(1))
  end subroutine test_diagnostics

end program test_input
