! SPDX-License-Identifier: MIT
!> Options of the command line: help, man page and bash completion from one table.
module front_help
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use base_log, only: say
  use base_system, only: data_file
  use base_text, only: str, upper
  use groups_table, only: key_table
  use input_keys, only: print_keys, print_keys_markdown
  use input_scan, only: read_file
  use input_wording, only: unknown_group
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: print_help, print_keys_of, print_new

  character, parameter :: nl = new_line('a')

  !> Template scenes: share/stirpoint/new/NAME.nml, and files that they read.
  character(10), parameter :: scenes(11) = [character(10) :: 'pin', 'shoulder', 'butt', 'lap', &
                                            'bobbin', 'stationary', 'spot', 'refill', 'curve', &
                                            'curve.csv', 'heat']

  !> An option.
  type :: option_t
    character(12) :: name = ''
    character(20) :: value = ''        !! its value
    character(240) :: about = ''
  end type option_t

  integer, parameter :: indent = 25, width = 96   !! layout of the help [characters]

contains

  !> All options.
  function options() result(list)
    type(option_t), allocatable :: list(:)

    list = [ &
      option_t('--check', '', 'report the scene, its cost and what it skips; write nothing'), &
      option_t('--check', '=scene', &
               'the same at once, without the cost, for which steps are taken'), &
      option_t('--material', '', 'only the flow laws, along the &PATH groups; curves as CSV'), &
      option_t('--set', 'GROUP.KEY=VALUE', &
               'override a value; GROUP(2).KEY or GROUP(name).KEY for one of many'), &
      option_t('--restart', 'FILE', 'go on from a checkpoint (INPUT may be left out)'), &
      option_t('--output', 'DIR', 'directory of the results (default: NAME.out)'), &
      option_t('--overwrite', '', 'delete results of an earlier run of this name there, which '// &
               'else are kept in DIR/previous_1, previous_2, ...'), &
      option_t('--quiet', '', 'no lines of progress and speed'), &
      option_t('--where', '', 'print DIR/NAME, which the names of all results begin with'), &
      option_t('--new', 'SCENE', 'print a commented input to begin with: '//known_scenes()), &
      option_t('--keys', '', 'every group and key with type, unit, default and range'), &
      option_t('--keys', '=GROUP', 'those of one group; --keys=markdown: all as a page'), &
      option_t('--materials', '', 'the library of materials: values and their sources'), &
      option_t('--help', '', &
               'this text; --help=man: the man page, --help=bash: completion for bash'), &
      option_t('--version', '', 'commit, compiler and flags, MPI, HDF5, FFTW, PETSc')]
  end function options

  !> Text `pin, shoulder, butt, lap or heat`.
  function known_scenes() result(text)
    character(:), allocatable :: text
    integer :: k

    text = trim(scenes(1))
    do k = 2, size(scenes)
      text = text//trim(merge(' or ', ',   ', k == size(scenes)))//' '//trim(scenes(k))
    end do
  end function known_scenes

  !> Paragraphs after the options.
  function remarks() result(text)
    character(:), allocatable :: text

    text = 'results in NAME.out/: NAME_history.csv (energies, audit, torque, force), '// &
      'NAME_probes.csv (thermocouples), NAME_000000.hdf ... with NAME.hdf.series (ParaView '// &
      '5.11, h5py), NAME_tools_000000.hdf ... (their surfaces), NAME_checkpoint.h5, '// &
      'NAME_run.txt, NAME_input.nml '// &
      '(the input with its defaults), NAME.log; pictures: stirpost report NAME.out'//nl// &
      'signals: SIGUSR1, SIGTERM, SIGINT or SIGHUP end the run at the next step with a '// &
      'checkpoint, the same again at once; mpirun hands SIGUSR1 on'//nl// &
      'exit status: 0 finished, 2 bad input (nothing written), 3 a particle was lost '// &
      '(checkpoint written), 4 output failed, 75 stopped by a signal (checkpoint written if '// &
      'the run had begun)'//nl
  end function remarks

  !> Print the help, the man page or the completion; `ok` is false for an unknown topic.
  subroutine print_help(topic, ok)
    character(*), intent(in) :: topic    !! '', man or bash
    logical, intent(out) :: ok

    ok = .true.
    select case (topic)
    case ('')
      call print_text()
    case ('man')
      call print_man()
    case ('bash')
      call print_completion()
    case default
      ok = .false.
      write (error_unit, '(3a)') 'stirpoint: error: no help about ', topic, '; there is '// &
        '--help, --help=man and --help=bash'
    end select
  end subroutine print_help

  !> Print the help.
  subroutine print_text()
    type(option_t), allocatable :: list(:)
    character(:), allocatable :: rest
    integer :: k

    write (output_unit, '(a)') &
      'Stirpoint simulates friction stir processing with the Material Point Method.', '', &
      'usage: [mpirun -n RANKS] stirpoint INPUT [options]', ''
    call print_entry('INPUT', 'file of namelist groups (see --new, --keys and docs/input.md)')
    allocate (list, source=options())
    do k = 1, size(list)
      call print_entry(usage_of(list(k)), trim(list(k)%about))
    end do
    write (output_unit, '()')
    rest = remarks()
    do while (rest /= '')
      k = index(rest, nl)
      call print_wrapped(rest(:k - 1), 0, 2)
      rest = rest(k + 1:)
    end do
  end subroutine print_text

  !> Usage of an option, as `--restart FILE`.
  pure function usage_of(option) result(text)
    type(option_t), intent(in) :: option
    character(:), allocatable :: text

    text = trim(option%name)
    if (option%value(1:1) /= '=') text = text//' '
    text = trim(text//trim(option%value))
  end function usage_of

  !> Print an entry with its description.
  subroutine print_entry(name, about)
    character(*), intent(in) :: name, about
    character(indent) :: left

    left = '  '//name
    call print_wrapped(left//about, indent, indent)
  end subroutine print_entry

  !> Print a paragraph in lines of `width`; all but the first are indented.
  subroutine print_wrapped(text, from, margin)
    character(*), intent(in) :: text
    integer, intent(in) :: from          !! number of leading characters that are not broken
    integer, intent(in) :: margin        !! indent of further lines
    character(:), allocatable :: rest
    integer :: cut

    rest = text
    do while (len(rest) > width)
      cut = index(rest(from + 1:width + 1), ' ', back=.true.) + from
      write (output_unit, '(a)') rest(:cut - 1)
      rest = repeat(' ', margin)//rest(cut + 1:)
    end do
    write (output_unit, '(a)') rest
  end subroutine print_wrapped

  !> Print the man page, share/man/man1/stirpoint.1.
  subroutine print_man()
    type(option_t), allocatable :: list(:)
    type(key_table_t) :: table
    character(:), allocatable :: rest
    integer :: k

    write (output_unit, '(a)') '.\" Printed by stirpoint --help=man.', &
      '.TH STIRPOINT 1 "" "Stirpoint" "User commands"', '.SH NAME', &
      'stirpoint \- friction stir processing with the Material Point Method', '.SH SYNOPSIS', &
      '[\fBmpirun\fR \-n \fIRANKS\fR] \fBstirpoint\fR \fIINPUT\fR [\fIoptions\fR]', &
      '.SH DESCRIPTION', &
      'Stirpoint simulates how a rotating rigid tool stirs metal: temperatures, flow, force '// &
      'and torque. \fIINPUT\fR is a file of Fortran namelist groups in SI units; its results '// &
      'go to a directory \fINAME\fR.out.', '.SH OPTIONS'
    allocate (list, source=options())
    do k = 1, size(list)
      write (output_unit, '(a)') '.TP', '\fB'//dashes(usage_of(list(k)))//'\fR', &
        dashes(trim(list(k)%about))
    end do
    write (output_unit, '(a)') '.SH REMARKS'
    rest = remarks()
    do while (rest /= '')
      k = index(rest, nl)
      write (output_unit, '(a)') '.PP', dashes(upper(rest(1:1))//rest(2:k - 1))//'.'
      rest = rest(k + 1:)
    end do
    write (output_unit, '(a)') '.SH GROUPS OF THE INPUT', &
      '\fBstirpoint \-\-keys=\fIGROUP\fR lists the keys of each.'
    table = key_table()
    do k = 1, size(table%groups)
      write (output_unit, '(a)') '.TP', '\fB&'//trim(table%groups(k)%name)//'\fR', &
        dashes(trim(table%groups(k)%about))
    end do
  end subroutine print_man

  !> Text with dashes escaped for the man page.
  pure function dashes(text) result(r)
    character(*), intent(in) :: text
    character(:), allocatable :: r
    integer :: i

    r = ''
    do i = 1, len(text)
      if (text(i:i) == '-') r = r//'\'
      r = r//text(i:i)
    end do
  end function dashes

  !> Print the bash completion, share/bash-completion/completions/stirpoint.
  subroutine print_completion()
    type(option_t), allocatable :: list(:)
    type(key_table_t) :: table
    character(:), allocatable :: groups, keys, words
    integer :: g, k

    allocate (list, source=options())
    words = ''
    do k = 1, size(list)
      if (list(k)%value(1:1) /= '=') words = words//' '//trim(list(k)%name)
    end do
    table = key_table()
    groups = ''
    keys = ''
    do g = 1, size(table%groups)
      groups = groups//' '//trim(table%groups(g)%name)
      keys = keys//'    '//trim(table%groups(g)%name)//') echo "'
      do k = table%groups(g)%first, table%groups(g)%last
        keys = keys//trim(table%keys(k)%name)//merge('"', ' ', k == table%groups(g)%last)
      end do
      keys = keys//' ;;'//nl
    end do
    write (output_unit, '(a)') &
      '# Completion of bash for stirpoint; printed by stirpoint --help=bash.', &
      '_stirpoint_keys() {', '  case $1 in', keys//'  esac', '}'
    write (output_unit, '(a)') '_stirpoint() {', &
      '  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} group', &
      '  if [[ $word == = ]]; then word=; elif [[ $before == = ]]; then before=; fi', &
      '  [[ -n $before ]] || before=${COMP_WORDS[COMP_CWORD - 2]}=', &
      '  [[ ${COMP_WORDS[COMP_CWORD]} != = ]] || before+==', &
      '  compopt +o nospace 2>/dev/null', &
      '  case $before in', &
      '    --keys=) mapfile -t COMPREPLY < <(compgen -W "markdown'//groups// &
      '" -- "${word^^}") ;;', &
      '    --help=) mapfile -t COMPREPLY < <(compgen -W "man bash" -- "$word") ;;', &
      '    --new) mapfile -t COMPREPLY < <(compgen -W "'//scene_words()// &
      '" -- "$word") ;;', &
      '    --output | -o) mapfile -t COMPREPLY < <(compgen -d -- "$word") ;;', &
      '    --restart) mapfile -t COMPREPLY < <(compgen -f -X "!*.h5" -- "$word"; '// &
      'compgen -d -S / -- "$word") ;;', &
      '    --set)', &
      '      compopt -o nospace 2>/dev/null', &
      '      if [[ $word == *.* ]]; then', &
      '        group=${word%%.*}', &
      '        mapfile -t COMPREPLY < <(compgen -P "$group." -S = '// &
      '-W "$(_stirpoint_keys "${group%%(*}")" -- "${word#*.}")', &
      '      else', &
      '        mapfile -t COMPREPLY < <(compgen -S . -W "'//groups(2:)//'" -- "${word^^}")', &
      '      fi', &
      '      ;;', &
      '    *)', &
      '      if [[ $word == -* ]]; then', &
      '        mapfile -t COMPREPLY < <(compgen -W "'//words(2:)//'" -- "$word")', &
      '      else', &
      '        mapfile -t COMPREPLY < <(compgen -f -X "!*.nml" -- "$word"; '// &
      'compgen -d -S / -- "$word")', &
      '      fi', &
      '      ;;', &
      '  esac', '}', 'complete -o filenames -F _stirpoint stirpoint'
  end subroutine print_completion

  !> Template scenes separated by blanks.
  function scene_words() result(text)
    character(:), allocatable :: text
    integer :: k

    text = trim(scenes(1))
    do k = 2, size(scenes)
      text = text//' '//trim(scenes(k))
    end do
  end function scene_words

  !> Print all keys, those of one group, or the reference page; `ok` is false for an unknown group.
  subroutine print_keys_of(topic, ok)
    character(*), intent(in) :: topic    !! '', markdown or a group
    logical, intent(out) :: ok
    type(key_table_t) :: table
    integer :: g

    table = key_table()
    ok = .true.
    if (topic == 'markdown') then
      call print_keys_markdown(table, output_unit)
      return
    end if
    g = 0
    if (topic /= '') then
      g = table%find_group(upper(topic(merge(2, 1, topic(1:1) == '&'):)))
      ok = g > 0
    end if
    if (ok) then
      call print_keys(table, output_unit, g)
    else
      write (error_unit, '(2a)') 'stirpoint: error: ', unknown_group(table, upper(topic))
    end if
  end subroutine print_keys_of

  !> Print a template scene; `ok` is false for an unknown name.
  subroutine print_new(name, ok)
    character(*), intent(in) :: name
    logical, intent(out) :: ok
    character(:), allocatable :: path, problem, text

    ok = any(scenes == name)
    if (.not. ok) then
      write (error_unit, '(4a)') 'stirpoint: error: there is no scene ', name, &
        ' to begin with: --new ', known_scenes()
      return
    end if
    if (index(name, '.') > 0) then                 ! a file that a scene reads
      call data_file('new/'//name, path, problem)
    else
      call data_file('new/'//name//'.nml', path, problem)
    end if
    if (problem == '') call read_file(path, text, problem)
    ok = problem == ''
    if (ok) then
      call say(text(:len(text) - 1))
    else
      write (error_unit, '(4a)') 'stirpoint: error: ', path, ' ', problem
    end if
  end subroutine print_new

end module front_help
