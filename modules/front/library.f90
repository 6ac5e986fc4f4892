! SPDX-License-Identifier: MIT
!> Report of the library of materials (`stirpoint --materials`), and of values taken from a library.
module front_library
  use, intrinsic :: iso_fortran_env, only: error_unit
  use base_log, only: say
  use groups_table, only: key_table
  use input_diagnostics, only: diagnostics_t
  use input_library, only: read_library, source_line
  use input_values, only: input_t
  use keys_written, only: split_words
  implicit none (type, external)
  private

  public :: print_materials, log_sources

contains

  !> Print the entries of the program's library with values and sources; `ok` is false without a
  !> library.
  subroutine print_materials(ok)
    logical, intent(out) :: ok
    type(input_t) :: library
    type(diagnostics_t) :: diagnostics
    character(:), allocatable :: problem
    integer :: m, r

    call read_library(key_table(), '', library, diagnostics, problem)
    ok = problem == ''
    if (.not. ok) then
      write (error_unit, '(4a)') 'stirpoint: error: the library of materials ', library%file, &
        ' ', problem
      return
    end if
    call say("&MATERIAL NAME = '"//library%text('MATERIAL', 1, 'NAME')//"', FROM = 'library' "// &
             'takes what it does not give itself from the entry of its name.')
    do m = 1, library%count('MATERIAL')
      call say('')
      call say(library%text('MATERIAL', m, 'NAME')//'  ('//library%text('MATERIAL', m, 'LAW')// &
               ', melts at '//library%values('MATERIAL', m, 'T_MELT')//' K)')
      do r = 1, library%count('REFERENCE')
        if (library%text('REFERENCE', r, 'MATERIAL') /= library%text('MATERIAL', m, 'NAME')) cycle
        call say('  '//values_of(library, m, library%text('REFERENCE', r, 'KEYS')))
        call say('      '//library%text('REFERENCE', r, 'TEXT'))
      end do
    end do
    call say('')
    call say('from '//library%file)
  end subroutine print_materials

  !> Text of the values of `keys` of entry `m`.
  function values_of(library, m, keys) result(text)
    type(input_t), intent(in) :: library
    integer, intent(in) :: m
    character(*), intent(in) :: keys
    character(:), allocatable :: text
    character(48), allocatable :: list(:)
    integer :: k

    call split_words(keys, list)
    text = ''
    do k = 1, size(list)
      if (k > 1) text = text//', '
      text = text//trim(list(k))//' = '//library%values('MATERIAL', m, trim(list(k)))
    end do
  end function values_of

  !> Log the values that materials took from a library, with their sources.
  subroutine log_sources(input)
    type(input_t), intent(in) :: input
    character(:), allocatable :: line
    integer :: i, s

    if (.not. allocated(input%taken)) return
    do i = 1, input%count('MATERIAL')
      if (.not. any(input%taken%instance == i)) cycle
      call say('material '//input%text('MATERIAL', i, 'NAME')//' from the library:')
      s = 1
      do
        line = source_line(input, i, s)
        if (line == '') exit
        call say('  '//line)
        s = s + 1
      end do
    end do
  end subroutine log_sources

end module front_library
