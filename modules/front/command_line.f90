! SPDX-License-Identifier: MIT
!> The command line of the program.
module front_command_line
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)
  private

  public :: command_t, read_command, print_help

  type :: command_t
    character(:), allocatable :: action  !! the option that names it, or run
    character(:), allocatable :: input       !! input file, '' if none
    character(:), allocatable :: restart     !! checkpoint, '' if none
    character(:), allocatable :: directory   !! for outputs, '' for the default
    character(:), allocatable :: sets(:)     !! GROUP.KEY=VALUE
    character(:), allocatable :: problem     !! what is wrong with the command line, '' if nothing
    logical :: is_quiet = .false.
    logical :: overwrites = .false.          !! results of an earlier run
  end type command_t

contains

  subroutine read_command(command)
    type(command_t), intent(out) :: command
    character(:), allocatable :: word
    integer :: i, longest, n_sets

    command%action = 'run'
    command%input = ''
    command%restart = ''
    command%directory = ''
    command%problem = ''
    longest = 1
    do i = 1, command_argument_count()
      longest = max(longest, len(argument(i)))
    end do
    allocate (character(longest) :: command%sets(command_argument_count()))
    n_sets = 0
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      select case (word)
      case ('--help', '-h', '--version', '--keys', '--keys=markdown', '--materials', &
            '--check')
        command%action = word(verify(word, '-'):)
        if (word == '-h') command%action = 'help'
      case ('--material')
        command%action = 'material'
      case ('--quiet', '-q')
        command%is_quiet = .true.
      case ('--overwrite')
        command%overwrites = .true.
      case ('--restart')
        command%restart = next(i, word)
      case ('--output', '-o')
        command%directory = next(i, word)
      case ('--set')
        n_sets = n_sets + 1
        command%sets(n_sets) = next(i, word)
      case ('')
        command%problem = 'an argument is empty (see stirpoint --help)'
      case default
        if (word(1:1) == '-') then
          command%problem = 'unknown option '//word//' (see stirpoint --help)'
        else if (command%input /= '') then
          command%problem = 'more than one input file: '//command%input//' and '//word
        else
          command%input = word
        end if
      end select
    end do
    command%sets = command%sets(:n_sets)
    if (command%problem == '' .and. command%input == '' .and. command%restart == '' &
        .and. any(command%action == [character(8) :: 'run', 'check', 'material'])) then
      command%problem = 'no input file (see stirpoint --help)'
    end if
  contains
    !> The word behind an option.
    function next(i, option) result(value)
      integer, intent(inout) :: i
      character(*), intent(in) :: option
      character(:), allocatable :: value

      value = ''
      if (i == command_argument_count()) then
        command%problem = option//' needs a value (see stirpoint --help)'
        return
      end if
      i = i + 1
      value = argument(i)
      if (value == '') command%problem = 'the value of '//option//' is empty'
    end function next
  end subroutine read_command

  function argument(i) result(word)
    integer, intent(in) :: i
    character(:), allocatable :: word
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: word)
    if (length > 0) call get_command_argument(i, word)
  end function argument

  subroutine print_help()
    write (output_unit, '(a)') &
      'Stirpoint simulates friction stir processing with the Material Point Method.', &
      '', &
      'usage: [mpirun -n RANKS] stirpoint INPUT [options]', &
      '', &
      '  INPUT                  file of namelist groups (see --keys and input/*.nml)', &
      '  --check                report the scene, its cost and what it skips; write nothing', &
      '  --material             only the flow laws, along the &PATH groups; curves as CSV', &
      '  --set GROUP.KEY=VALUE  override a value; '// &
      'GROUP(2).KEY or GROUP(name).KEY for one of many', &
      '  --restart FILE         go on from a checkpoint (INPUT may be left out)', &
      '  --output DIR           directory of the results (default: NAME.out)', &
      '  --overwrite            delete results of an earlier run of this name there, '// &
      'which else are', &
      '                         kept in DIR/previous_1, previous_2, ...', &
      '  --quiet                no progress lines', &
      '  --keys                 every group and key with type, unit, default and range', &
      '  --keys=markdown        the same as a Markdown page', &
      '  --materials            the library of materials: values and their sources', &
      '  --version, --help', &
      '', &
      'results in NAME.out/: NAME_history.csv (energies, audit, torque, force), NAME_probes.csv', &
      '  (thermocouples), NAME_000000.hdf ... with NAME.hdf.series (ParaView 5.11, h5py),', &
      '  NAME_checkpoint.h5, NAME_run.txt; pictures: stirpost report NAME.out', &
      'signals: SIGUSR1, SIGTERM, SIGINT or SIGHUP end the run at the next step '// &
      'with a checkpoint,', &
      '  the same again at once; mpirun hands SIGUSR1 on', &
      'exit status: 0 finished, 2 bad input (nothing written), 3 a particle was lost', &
      '  (checkpoint written), 4 output failed, 75 stopped by a signal (checkpoint written', &
      '  if the run had begun)'
  end subroutine print_help

end module front_command_line
