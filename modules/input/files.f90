! SPDX-License-Identifier: MIT
!> Files named in an input, whose content is part of the scene: their paths, and checksums by which
!> a restart identifies them.
module input_files
  use base_disk, only: file_bytes, file_sum, full_path, sum_words
  use base_kinds, only: i8
  use base_text, only: str
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: file_path, folder_of_files, sums_of_files

  character(*), parameter :: key = 'FILE'   !! in all groups but &PATH, which no run reads

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
    character(:), allocatable :: text
    character(:), allocatable :: group, path
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

end module input_files
