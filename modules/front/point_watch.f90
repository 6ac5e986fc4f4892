! SPDX-License-Identifier: MIT
!> Count of increments of a material point outside the validity of its flow law.
module front_point_watch
  use base_kinds, only: i8, nlane, rp
  use base_log, only: log_line
  use base_text, only: str
  use physics_flow_law, only: max_warnings
  use physics_material, only: material_t
  use physics_point, only: point_t
  implicit none (type, external)
  private

  public :: validity_checker_t

  ! Kinds of warnings after those of the law.
  integer, parameter :: unsolved = max_warnings + 1, molten = max_warnings + 2, &
                        n_kinds = max_warnings + 2

  !> Counts of warnings.
  type :: validity_checker_t
    private
    integer(i8) :: increments = 0                !! number of increments
    integer(i8) :: counts(n_kinds) = 0           !! number of warnings
    !> First occurrence: time [s], plastic strain, temperature [K].
    real(rp) :: first(3, n_kinds) = 0.0_rp
  contains
    procedure :: inspect, log_warnings
  end type validity_checker_t

contains

  !> Check the point after an increment.
  subroutine inspect(self, material, time, point, failed)
    class(validity_checker_t), intent(inout) :: self
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: time                 !! end of the increment [s]
    type(point_t), intent(in) :: point
    integer, intent(in), optional :: failed      !! number of return mappings not converged
    real(rp) :: temp(nlane), rate(nlane)
    integer :: found(n_kinds), k, lane(max_warnings)

    self%increments = self%increments + 1
    found = 0
    lane = 0
    temp = point%temp
    rate = point%rate
    call material%flow%inspect(1, temp, rate, spread(point%state, 1, nlane), &
                               found(:max_warnings), lane)
    if (present(failed)) found(unsolved) = failed
    if (point%temp > material%t_melt) found(molten) = 1
    do k = 1, n_kinds
      if (found(k) == 0) cycle
      if (self%counts(k) == 0) self%first(:, k) = [time, point%alpha, point%temp]
      self%counts(k) = self%counts(k) + 1
    end do
  end subroutine inspect

  !> Log the warnings, one line for each kind.
  subroutine log_warnings(self, material, path)
    class(validity_checker_t), intent(in) :: self
    type(material_t), intent(in) :: material
    character(*), intent(in) :: path             !! NAME of the &PATH
    character(48), allocatable :: own(:)
    character(48) :: text(n_kinds)
    integer :: k

    text(unsolved) = 'did not converge in the return mapping'
    text(molten) = 'ended above T_MELT'
    call material%flow%list_warnings(own)
    text(:size(own)) = own
    do k = 1, n_kinds
      if (self%counts(k) == 0) cycle
      call log_line('warning: path '//path//': '//str(self%counts(k))// &
                    ' of '//str(self%increments)// &
                    ' increments '//trim(text(k))//'; the first at t = '//str(self%first(1, k))// &
                    ' s, plastic strain '//str(self%first(2, k))//', '//str(self%first(3, k))//' K')
    end do
  end subroutine log_warnings

end module front_point_watch
