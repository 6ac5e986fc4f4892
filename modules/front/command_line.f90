! SPDX-License-Identifier: MIT
!> The command line of the program.
module front_command_line
  implicit none (type, external)
  private

  public :: command_t, read_command

  !> Parsed command line.
  type :: command_t
    character(:), allocatable :: action  !! option that selects the action, or run
    character(:), allocatable :: topic       !! value of --check, --keys or --new
    character(:), allocatable :: input       !! input file, '' if none
    character(:), allocatable :: restart     !! checkpoint, '' if none
    character(:), allocatable :: directory   !! results folder, '' for the default
    character(:), allocatable :: overrides(:)  !! overrides, GROUP.KEY=VALUE
    character(:), allocatable :: problem     !! error in the command line, '' if none
    logical :: is_quiet = .false.
    logical :: overwrites = .false.          !! delete results of an earlier run
  end type command_t

contains

  !> Parse the command line.
  subroutine read_command(command)
    type(command_t), intent(out) :: command
    character(:), allocatable :: option, word
    integer :: i, longest, n_sets

    command%action = 'run'
    command%topic = ''
    command%input = ''
    command%restart = ''
    command%directory = ''
    command%problem = ''
    longest = 1
    do i = 1, command_argument_count()
      longest = max(longest, len(argument(i)))
    end do
    allocate (character(longest) :: command%overrides(command_argument_count()))
    n_sets = 0
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      option = word
      if (index(word, '--') == 1 .and. index(word, '=') > 0) option = word(:index(word, '=') - 1)
      select case (option)
      case ('--check', '--help', '-h', '--keys', '--material', '--materials', '--pairs', &
            '--version', '--where')
        command%action = option(verify(option, '-'):)
        if (option == '-h') command%action = 'help'
        if (any(option == [character(7) :: '--check', '--keys'])) then
          if (option /= word) command%topic = next(i, option)
          if (option == '--check' .and. all(command%topic /= [character(5) :: '', 'scene'])) then
            command%problem = '--check='//command%topic//' is unknown; there is --check=scene'
          end if
        else if (option /= word) then
          command%problem = option//' takes no value (see stirpoint --help)'
        end if
      case ('--new')
        command%action = 'new'
        command%topic = next(i, option)
      case ('--quiet', '-q')
        command%is_quiet = .true.
      case ('--overwrite')
        command%overwrites = .true.
      case ('--restart')
        command%restart = next(i, option)
      case ('--output', '-o')
        command%directory = next(i, option)
      case ('--set')
        n_sets = n_sets + 1
        command%overrides(n_sets) = next(i, option)
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
    command%overrides = command%overrides(:n_sets)
    if (command%problem == '' .and. command%input == '' .and. command%restart == '' &
        .and. any(command%action == [character(8) :: 'run', 'check', 'material', 'where'])) then
      command%problem = 'no input file (see stirpoint --help)'
    end if
  contains
    !> Value of an option: the next word, or the text after its =.
    function next(i, option) result(value)
      integer, intent(inout) :: i
      character(*), intent(in) :: option
      character(:), allocatable :: value

      value = ''
      if (len(option) < len(word)) then
        value = word(len(option) + 2:)
        if (value == '') command%problem = 'the value of '//option//' is empty'
        return
      end if
      if (i == command_argument_count()) then
        command%problem = option//' needs a value (see stirpoint --help)'
        return
      end if
      i = i + 1
      value = argument(i)
      if (value == '') command%problem = 'the value of '//option//' is empty'
    end function next
  end subroutine read_command

  !> Argument `i` of the command line.
  function argument(i) result(word)
    integer, intent(in) :: i
    character(:), allocatable :: word
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: word)
    if (length > 0) call get_command_argument(i, word)
  end function argument

end module front_command_line
