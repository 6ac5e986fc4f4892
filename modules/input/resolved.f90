! SPDX-License-Identifier: MIT
!> Texts of an input. The resolved input has the given, library and override values, with which it
!> can be run again; other defaults and the sources of library values are comments. The scene text
!> has all defaults. Paths and checksums of the files named by the input identify them in a restart.
module input_resolved
  use base_disk, only: file_bytes, file_sum, full_path, sum_words
  use base_kinds, only: i8
  use base_text, only: str
  use input_library, only: takers
  use input_sources, only: source_lines, taker_label
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: file_path, folder_of_files, resolved_text, scene_text, sums_of_files

  !> Key of file names in all groups; &PATH is not part of a run.
  character(*), parameter :: key = 'FILE'

  character, parameter :: nl = new_line('a')

contains

  !> Path of the file of the `i`-th group of this name, relative to the folder of the input unless
  !> it is absolute; '' if the group names none.
  function file_path(input, group, i) result(path)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(:), allocatable :: path

    path = input%text(group, i, key)
    if (path == '' .or. index(path, '/') == 1) return
    if (allocated(input%folder)) then
      path = input%folder//'/'//path
    else
      path = input%file(:index(input%file, '/', back=.true.))//path
    end if
  end function file_path

  !> Absolute path of the folder to which file paths are relative, for a restart from elsewhere.
  function folder_of_files(input) result(folder)
    type(input_t), intent(in) :: input
    character(:), allocatable :: folder

    if (allocated(input%folder)) then
      folder = input%folder
    else
      folder = full_path(input%file(:index(input%file, '/', back=.true.))//'.')
    end if
  end function folder_of_files

  !> Lines `GROUP i checksum` for all files.
  function sums_of_files(input) result(text)
    type(input_t), intent(in) :: input
    character(:), allocatable :: text, group, path
    character(16) :: digits
    integer(i8) :: bytes, total
    integer :: g, i
    logical :: ok

    text = ''
    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      if (group == 'PATH' .or. input%table%find_key(g, key) == 0) cycle
      do i = 1, input%count(group)
        path = file_path(input, group, i)
        if (path == '') cycle
        bytes = file_bytes(path)
        call file_sum(path, 0_i8, bytes, total, ok)
        write (digits, '(z16.16)') sum_words(bytes, [total], 1_i8)
        text = text//group//' '//str(i)//' '//digits//new_line('a')
      end do
    end do
  end function sums_of_files

  !> Text of the resolved input, NAME_input.nml.
  function resolved_text(input) result(text)
    type(input_t), intent(in) :: input
    character(:), allocatable :: text, group, one
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
    do g = 1, size(takers)
      do i = 1, input%count(takers(g))
        one = source_lines(input, trim(takers(g)), i, '!   ', is_brief=.false.)
        if (one /= '') text = text//'! Of '//taker_label(input, trim(takers(g)), i)// &
          ' a library gave:'//nl//one
      end do
    end do
  end function resolved_text

  !> Text of all groups with their defaults, for comparison by a restart.
  function scene_text(input) result(text)
    type(input_t), intent(in) :: input
    character(:), allocatable :: text, group, key, one, value
    integer :: g, i, k, n

    text = ''
    do g = 1, size(input%table%groups)
      group = trim(input%table%groups(g)%name)
      n = input%count(group)
      ! Absent groups have their defaults, except &HEAT, which has an effect by its presence.
      if (.not. input%table%groups(g)%repeats .and. group /= 'HEAT') n = 1
      do i = 1, n
        one = '&'//group//nl            ! not to copy the whole text for each key
        do k = input%table%groups(g)%first, input%table%groups(g)%last
          key = trim(input%table%keys(k)%name)
          value = input%values(group, i, key)
          if (value /= '') one = one//'  '//key//' = '//value//nl
        end do
        text = text//one//'/'//nl
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
    character(:), allocatable :: text, group, value
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
