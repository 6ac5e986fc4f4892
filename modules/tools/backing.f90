! SPDX-License-Identifier: MIT
!> Stationary bodies behind heat films, which heat up: a plate in which heat is conducted away from
!> the face in independent columns, or a body of uniform temperature.
module tools_backing
  use base_kinds, only: rp
  use tools_heat_sink, only: heat_sink_t
  implicit none (type, external)
  private

  public :: backing_t, find_backing

  type :: backing_t
    character(:), allocatable :: name
    integer :: body = 0, face = 0   !! body, and its face: 1 to 6 for xmin, xmax, ymin, ...
    integer :: across(2) = 0        !! axes along the face
    real(rp) :: lower(2) = 0.0_rp   !! lower corner of the columns [m]
    real(rp) :: width(2) = 1.0_rp   !! width of a column [m]
    integer :: n(2) = 1             !! numbers of columns along these axes
    real(rp) :: period(2) = 0.0_rp  !! period of the grid along these axes [m]; 0: none
    type(heat_sink_t), allocatable :: column(:)
  contains
    procedure :: column_at, max_face_temperature, content
  end type backing_t

contains

  !> Index of the column in front of which `x`, or its image on a periodic grid, lies, or of the
  !> nearest one.
  pure integer function column_at(self, x)
    class(backing_t), intent(in) :: self
    real(rp), intent(in) :: x(3)                  !! [m]
    integer :: place(2)
    real(rp) :: along(2)                          !! position from the corner of the columns [m]

    along = x(self%across) - self%lower
    where (self%period > 0.0_rp) &
      along = along - self%period*anint((along - 0.5_rp*self%n*self%width)/self%period)
    place = max(0, min(self%n - 1, floor(along/self%width)))
    column_at = 1 + place(1) + self%n(1)*place(2)
  end function column_at

  !> Largest face temperature [K].
  pure real(rp) function max_face_temperature(self)
    class(backing_t), intent(in) :: self

    max_face_temperature = maxval(self%column%face)
  end function max_face_temperature

  !> Heat above 0 K [J].
  pure real(rp) function content(self)
    class(backing_t), intent(in) :: self
    integer :: i

    content = 0.0_rp
    do i = 1, size(self%column)
      content = content + self%column(i)%content()
    end do
  end function content

  !> Index of the backing of a face of a body; 0 if it has none.
  pure integer function find_backing(backing, body, face) result(k)
    type(backing_t), intent(in) :: backing(:)
    integer, intent(in) :: body, face

    do k = size(backing), 1, -1
      if (backing(k)%body == body .and. backing(k)%face == face) exit
    end do
  end function find_backing

end module tools_backing
