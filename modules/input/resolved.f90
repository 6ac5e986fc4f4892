! SPDX-License-Identifier: MIT
!> The resolved input: given, library and override values as an input that can be run again, with
!> the other defaults and the sources of library values as comments.
module input_resolved
  use input_library, only: source_lines
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: resolved_text, scene_text

  character, parameter :: nl = new_line('a')

contains

  !> Text of NAME_input.nml.
  function resolved_text(input) result(text)
    type(input_t), intent(in) :: input
    character(:), allocatable :: text
    character(:), allocatable :: group, one
    integer :: g, i

    text = '! The input as it was run, overrides in place.'//nl//input%text_of_file()//nl//nl// &
      '! Defaults that act besides:'//nl
    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      do i = 1, max(input%count(group), merge(0, 1, input%table%groups(g)%repeats .or. &
                                              group == 'HEAT'))
        one = defaults_of(input, g, i)
        if (one /= '') text = text//'! &'//group//name_of(input, g, i)//nl//one
      end do
    end do
    do i = 1, input%count('MATERIAL')
      one = source_lines(input, i, '!   ')
      if (one /= '') text = text//'! Of material '//input%text('MATERIAL', i, 'NAME')// &
        ' a library gave:'//nl//one
    end do
  end function resolved_text

  !> Text of all groups with their defaults, for comparison by a restart.
  function scene_text(input) result(text)
    type(input_t), intent(in) :: input
    character(:), allocatable :: text
    character(:), allocatable :: group, key, value
    integer :: g, i, k, n

    text = ''
    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      n = input%count(group)
      if (.not. input%table%groups(g)%repeats .and. group /= 'HEAT') n = 1   ! its presence matters
      do i = 1, n
        text = text//'&'//group//nl
        do k = input%table%groups(g)%first, input%table%groups(g)%last
          key = trim(input%table%keys(k)%name)
          value = input%values(group, i, key)
          if (value /= '') text = text//'  '//key//' = '//value//nl
        end do
        text = text//'/'//nl
      end do
    end do
  end function scene_text

  !> Name of a group after a blank; '' if it has none.
  function name_of(input, g, i) result(text)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g, i
    character(:), allocatable :: text

    text = ''
    if (input%table%find_key(g, 'NAME') == 0 .or. .not. input%table%groups(g)%repeats) return
    text = ' '//input%text(trim(input%table%groups(g)%name), i, 'NAME')
  end function name_of

  !> Lines with the defaults of the keys that the `i`-th group of this kind does not give.
  function defaults_of(input, g, i) result(text)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g, i
    character(:), allocatable :: text
    character(:), allocatable :: group, value
    integer :: k

    text = ''
    group = trim(input%table%groups(g)%name)
    do k = input%table%groups(g)%first, input%table%groups(g)%last
      associate (row => input%table%keys(k))
        if (input%given(group, i, trim(row%name))) cycle
        if (.not. input%holds(group, i, row%condition)) cycle
        value = input%values(group, i, trim(row%name))
        if (value /= '') text = text//'!   '//trim(row%name)//' = '//value//nl
      end associate
    end do
  end function defaults_of

end module input_resolved
