! SPDX-License-Identifier: MIT
!> Texts on the values that groups take from a library, and on how their sources were read.
module input_sources
  use base_text, only: lower
  use input_diagnostics, only: excerpt
  use input_values, only: input_t, taken_t
  implicit none (type, external)
  private

  public :: source_lines, taker_label, way_of

  !> Beginnings of the notes in sources, and what they say.
  character(7), parameter :: notes(3) = ['[seen  ', '[not se', '[taken ']
  character(11), parameter :: ways(3) = [character(11) :: 'seen', 'from memory', 'taken over']

contains

  !> What the `i`-th group is called in messages: its kind, and its name or place.
  function taker_label(input, group, i) result(text)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(:), allocatable :: text

    select case (group)
    case ('WALL')
      text = 'wall '//input%text(group, i, 'SIDE')
    case ('SURFACE')
      text = 'surface '//input%text(group, i, 'FACE')//' of '//input%text(group, i, 'BODY')
    case default
      text = lower(group)//' '//input%text(group, i, 'NAME')
    end select
  end function taker_label

  !> Lines, each after a `margin`, with the values that the `i`-th group took from a library and
  !> their sources, in the words of the library or brief; '' if it took none.
  function source_lines(input, group, i, margin, is_brief) result(text)
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(*), intent(in) :: margin
    logical, intent(in) :: is_brief
    character(:), allocatable :: text
    type(taken_t), allocatable :: values(:)
    integer :: first, k

    text = ''
    if (.not. allocated(input%taken)) return
    values = pack(input%taken, input%taken%instance == i .and. input%taken%group == group)
    do first = 1, size(values)
      if (any(values(:first - 1)%source == values(first)%source)) cycle
      text = text//margin
      do k = first, size(values)
        if (values(k)%source /= values(first)%source) cycle
        if (k > first) text = text//', '
        text = text//trim(values(k)%key)//' = ' &
               //excerpt(input%values(group, i, trim(values(k)%key)))
      end do
      if (is_brief) then
        text = text//': '//brief_source(trim(values(first)%source))//new_line('a')
      else
        text = text//': '//trim(values(first)%source)//new_line('a')
      end if
    end do
  end function source_lines

  !> Number of the note of a source, where it begins, and 0 if it has none.
  pure subroutine find_note(source, note, at)
    character(*), intent(in) :: source
    integer, intent(out) :: note, at

    do note = 1, size(notes)
      at = index(source, trim(notes(note)))
      if (at > 0) return
    end do
    note = 0
  end subroutine find_note

  !> How a source was read: seen, from memory, taken over; '' if its values follow from others.
  pure function way_of(source) result(text)
    character(*), intent(in) :: source
    character(:), allocatable :: text
    integer :: at, note

    call find_note(source, note, at)
    text = ''
    if (note > 0) text = trim(ways(note))
  end function way_of

  !> A source with a letter in place of the note on how it was read: [s] seen, [m] from memory, [t]
  !> taken over with a model.
  pure function brief_source(source) result(text)
    character(*), intent(in) :: source
    character(:), allocatable :: text
    integer :: at, note

    call find_note(source, note, at)
    text = source
    if (note > 0) text = source(:at)//'smt'(note:note)//']'
  end function brief_source

end module input_sources
