! SPDX-License-Identifier: MIT
!> Names that groups use to refer to one another.
module input_key_names
  implicit none (type, external)
  private

  public :: find, known

contains

  !> Index of `name` in a list; 0 if it is not there.
  pure integer function find(names, name)
    character(*), intent(in) :: names(:), name

    do find = 1, size(names)
      if (names(find) == name) return
    end do
    find = 0
  end function find

  !> Text with the known names, for a diagnostic.
  pure function known(names) result(text)
    character(*), intent(in) :: names(:)
    character(:), allocatable :: text
    integer :: i

    text = 'known:'
    do i = 1, size(names)
      text = text//' '//trim(names(i))
    end do
  end function known

end module input_key_names
