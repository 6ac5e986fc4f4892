! SPDX-License-Identifier: MIT
!> Metadata of VTKHDF frames that ParaView shows: field data of one number with the text as its
!> name, as readers of VTK do not accept texts of fixed length and parallel HDF5 writes no others.
module io_field_data
  use base_errors, only: error_t
  use base_kinds, only: rp
  use base_text, only: str
  use io_h5_file, only: h5file_t
  use io_h5_notes, only: write_array
  implicit none (type, external)
  private

  public :: note, note_unit, note_units, write_notes

  character(*), parameter :: field_data = '/VTKHDF/FieldData'

contains

  !> Write time and step of a frame, and the names of bodies, numbered as in the point data.
  subroutine write_notes(file, time, step, kind, names, error)
    type(h5file_t), intent(in) :: file
    real(rp), intent(in) :: time                !! [s]
    integer, intent(in) :: step
    character(*), intent(in) :: kind, names(:)
    type(error_t), intent(inout) :: error
    integer :: k

    call file%group(field_data, error)
    call write_array(file, field_data//'/TimeValue', of_root(file, time), error)
    call note(file, 'step', step, error)
    do k = 1, size(names)
      call note(file, kind//' '//str(k)//': '//trim(names(k)), k, error)
    end do
  end subroutine write_notes

  !> Write a number with its name.
  subroutine note(file, name, value, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: value
    type(error_t), intent(inout) :: error

    call write_array(file, field_data//'/'//without_slash(name), of_root(file, real(value, rp)), &
                     error)
  end subroutine note

  !> Write the unit of a field.
  subroutine note_unit(file, field, unit, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: field, unit
    type(error_t), intent(inout) :: error

    call note(file, 'unit of '//field//': '//unit, 1, error)
  end subroutine note_unit

  !> Write the units of all fields.
  subroutine note_units(file, extra_names, extra_units, error)
    type(h5file_t), intent(in) :: file
    character(*), intent(in) :: extra_names(:), extra_units(:)
    type(error_t), intent(inout) :: error
    character(16), parameter :: fields(8) = [character(16) :: 'Points', 'temperature', &
      'strain_rate', 'flow_stress', 'pressure', 'von_mises', 'stress', 'velocity']
    character(4), parameter :: units(8) = [character(4) :: 'm', 'K', '1/s', 'Pa', 'Pa', 'Pa', &
                                           'Pa', 'm/s']
    integer :: k

    do k = 1, size(fields)
      call note_unit(file, trim(fields(k)), trim(units(k)), error)
    end do
    do k = 1, size(extra_names)
      call note_unit(file, trim(extra_names(k)), trim(extra_units(k)), error)
    end do
  end subroutine note_units

  !> Array with a number on rank 0, empty on the others.
  function of_root(file, value) result(values)
    type(h5file_t), intent(in) :: file
    real(rp), intent(in) :: value
    real(rp), allocatable :: values(:)

    allocate (values(merge(1, 0, file%world%is_root())))
    values = value
  end function of_root

  !> Name for HDF5, in which slashes separate groups.
  pure function without_slash(text) result(name)
    character(*), intent(in) :: text
    character(:), allocatable :: name
    integer :: i

    name = ''
    do i = 1, len_trim(text)
      if (text(i:i) == '/') then
        name = name//' per '
      else
        name = name//text(i:i)
      end if
    end do
  end function without_slash

end module io_field_data
