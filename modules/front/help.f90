! SPDX-License-Identifier: MIT
!> Texts that need no input: help, keys, template scenes, and the libraries. The man page
!> and the completion for bash (share/man, share/bash-completion) list the options, too.
module front_help
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use base_log, only: log_line
  use base_system, only: data_file
  use base_text, only: joined, lower, upper
  use input_diagnostics, only: diagnostics_t
  use input_key_table, only: key_table_t
  use input_keys, only: print_keys, print_keys_markdown
  use input_library, only: range_of, read_library, reference_number, takers
  use input_scan, only: read_file
  use input_sources, only: source_lines, taker_label, way_of
  use input_syntax, only: split_words
  use input_values, only: input_t
  use input_wording, only: unknown_group
  use setup_keys, only: key_table
  implicit none (type, external)
  private

  public :: log_sources, print_help, print_keys_of, print_library, print_template

  character, parameter :: nl = new_line('a')

  !> Template scenes: share/stirpoint/new/NAME.nml, and files that they read.
  character(10), parameter :: scenes(11) = [character(10) :: 'pin', 'shoulder', 'butt', 'lap', &
                                            'bobbin', 'stationary', 'spot', 'refill', 'curve', &
                                            'curve.csv', 'heat']

contains

  !> Print the help.
  subroutine print_help()
    write (output_unit, '(a)') &
      'Stirpoint simulates friction stir processing with the Material Point Method.', &
      '', &
      'usage: [mpirun -n RANKS] stirpoint INPUT [options]', &
      '', &
      '  INPUT                  file of namelist groups (see --new, --keys and docs/input.md)', &
      '  --check                report the scene and its cost; write nothing', &
      '  --check=scene          the same at once, without the cost, for which steps are taken', &
      '  --material             only the flow laws, along the &PATH groups; curves as CSV', &
      '  --set GROUP.KEY=VALUE  override a value; GROUP(2).KEY or GROUP(name).KEY for one', &
      '                         of many', &
      '  --restart FILE         go on from a checkpoint (INPUT may be left out)', &
      '  --output DIR           directory of the results (default: NAME.out)', &
      '  --overwrite            delete results of an earlier run of this name there, which else', &
      '                         are kept in DIR/previous_1, previous_2, ...', &
      '  --quiet                no lines of progress and speed', &
      '  --where                print DIR/NAME, which the names of all results begin with', &
      '  --new SCENE            print a commented input to begin with: pin, shoulder, butt, lap,', &
      '                         bobbin, stationary, spot, refill, curve, curve.csv or heat', &
      '  --keys                 every group and key with type, unit, default and range', &
      '  --keys=GROUP           those of one group; --keys=markdown: all as a page', &
      '  --materials            the library of materials: values and their sources', &
      '  --pairs                friction and films of pairs of surfaces, likewise', &
      '  --help                 this text', &
      '  --version              commit, compiler and flags, MPI, HDF5, FFTW, PETSc', &
      '', &
      'results in NAME.out/: NAME_history.csv (energies, audit, torque, force), NAME_probes.csv', &
      '  (thermocouples), NAME_000000.hdf ... with NAME.hdf.series (ParaView 5.11, h5py),', &
      '  NAME_tools_000000.hdf ... (their surfaces), NAME_checkpoint.h5, NAME_run.txt,', &
      '  NAME_input.nml (the input with its defaults), NAME.log; pictures: stirpost', &
      '  report NAME.out', &
      'signals: SIGUSR1, SIGTERM, SIGINT or SIGHUP end the run at the next step with a', &
      '  checkpoint, the same again at once; mpirun forwards SIGUSR1', &
      'exit status: 0 finished, 2 bad input (nothing written), 3 the run broke down (checkpoint', &
      '  written), 4 output failed, 75 stopped by a signal (checkpoint written if the run had', &
      '  begun)'
  end subroutine print_help

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
  subroutine print_template(name, ok)
    character(*), intent(in) :: name
    logical, intent(out) :: ok
    character(:), allocatable :: path, problem, text

    ok = any(scenes == name)
    if (.not. ok) then
      write (error_unit, '(4a)') 'stirpoint: error: there is no scene ', name, &
        ' to begin with: --new ', joined(scenes(:size(scenes) - 1), ', ')//' or '// &
        trim(scenes(size(scenes)))
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
      call log_line(text(:len(text) - 1))
    else
      write (error_unit, '(4a)') 'stirpoint: error: ', path, ' ', problem
    end if
  end subroutine print_template

  !> Print the entries of a library of the program with values and sources; `ok` is false without
  !> the library.
  subroutine print_library(kind, ok)
    character(*), intent(in) :: kind      !! MATERIAL or PAIR
    logical, intent(out) :: ok
    type(input_t) :: library
    type(diagnostics_t), target :: diagnostics
    character(:), allocatable :: line, problem
    integer :: m, r

    call read_library(key_table(), kind, '', library, diagnostics, problem)
    ok = problem == ''
    if (.not. ok) then
      write (error_unit, '(4a)') 'stirpoint: error: the library of ', lower(kind)//'s ', &
        library%file//' ', problem
      return
    end if
    if (kind == 'MATERIAL') then
      call log_line("&MATERIAL NAME = '"//library%text(kind, 1, 'NAME')//"', FROM = 'library' "// &
                    'takes what it does not give itself from the entry of its name.')
    else
      call log_line("FROM = '"//library%text(kind, 1, 'NAME')//"' in a &TOOL, &WALL or "// &
                    '&SURFACE takes the friction and film that the group does not give itself.')
    end if
    do m = 1, library%count(kind)
      call log_line('')
      line = library%text(kind, m, 'NAME')
      r = reference_number(library, kind, m, 'LAW')
      if (r > 0) line = line//'  ('//library%text(kind, m, 'LAW')//', source '// &
        way_of(library%text('REFERENCE', r, 'TEXT'))//'; melts at '// &
        library%values(kind, m, 'T_MELT')//' K)'
      call log_line(line)
      do r = 1, library%count('REFERENCE')
        if (library%text('REFERENCE', r, kind) /= library%text(kind, m, 'NAME')) cycle
        call log_line('  '//values_of(library, kind, m, library%text('REFERENCE', r, 'KEYS')))
        call log_line('      '//range_of(library, r)//library%text('REFERENCE', r, 'TEXT'))
      end do
    end do
    call log_line('')
    call log_line('from '//library%file)
  end subroutine print_library

  !> Text of the values of `keys` of entry `m`.
  function values_of(library, kind, m, keys) result(text)
    type(input_t), intent(in) :: library
    character(*), intent(in) :: kind, keys
    integer, intent(in) :: m
    character(:), allocatable :: text
    character(48), allocatable :: list(:)
    integer :: k

    call split_words(keys, list)
    text = ''
    do k = 1, size(list)
      if (k > 1) text = text//', '
      text = text//trim(list(k))//' = '//library%values(kind, m, trim(list(k)))
    end do
  end function values_of

  !> Log the values that groups took from a library, with their sources.
  subroutine log_sources(input)
    type(input_t), intent(in) :: input
    character(:), allocatable :: group, lines, option
    integer :: g, i

    do g = 1, size(takers)
      group = trim(takers(g))
      option = trim(merge('--materials', '--pairs    ', group == 'MATERIAL'))
      do i = 1, input%count(group)
        lines = source_lines(input, group, i, '  ', is_brief=.true.)
        if (lines /= '') call log_line(taker_label(input, group, i)//' from the library '// &
          '(s: source seen, m: cited from memory; see '//option//'):'//nl//lines(:len(lines) - 1))
      end do
    end do
  end subroutine log_sources

end module front_help
