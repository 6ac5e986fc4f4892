! SPDX-License-Identifier: MIT
!> Counts where a material point leaves what its flow law is valid for, as a run does of particles.
module front_point_watch
  use base_kinds, only: i8, nlane, rp
  use base_log, only: say
  use base_text, only: str
  use physics_flow_law, only: warning_text, n_validity_warnings
  use physics_material, only: material_t
  use physics_point, only: point_t
  implicit none (type, external)
  private

  public :: point_watch_t

  integer, parameter :: unsolved = n_validity_warnings + 1, molten = n_validity_warnings + 2, &
    n_kinds = n_validity_warnings + 2
  character(48), parameter :: text(n_kinds) = [character(48) :: warning_text, &
    'found no stress that balances the elastic one', 'ended above T_MELT']

  type :: point_watch_t
    private
    integer(i8) :: looks = 0, counts(n_kinds) = 0
    real(rp) :: first(3, n_kinds) = 0.0_rp       !! time [s], plastic strain, temperature [K]
  contains
    procedure :: look
    procedure :: tell
  end type point_watch_t

contains

  !> Look at the point after an increment that ended at `time`; `failed`: returns that did not
  !> converge.
  subroutine look(self, material, time, point, failed)
    class(point_watch_t), intent(inout) :: self
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: time                 !! [s]
    type(point_t), intent(in) :: point
    integer, intent(in), optional :: failed
    real(rp) :: temp(nlane), rate(nlane)
    integer :: validity_warnings(n_kinds), lane(n_validity_warnings), k

    self%looks = self%looks + 1
    validity_warnings = 0
    lane = 0
    temp = point%temp
    rate = point%rate
    if (material%flow%n_state > 0) then
      call material%flow%inspect(1, temp, rate, spread(point%state, 1, nlane), &
                                 validity_warnings(:n_validity_warnings), lane)
    end if
    if (present(failed)) validity_warnings(unsolved) = failed
    if (point%temp > material%t_melt) validity_warnings(molten) = 1
    do k = 1, n_kinds
      if (validity_warnings(k) == 0) cycle
      if (self%counts(k) == 0) self%first(:, k) = [time, point%alpha, point%temp]
      self%counts(k) = self%counts(k) + 1
    end do
  end subroutine look

  !> Write a warning of each kind that there was.
  subroutine tell(self, path)
    class(point_watch_t), intent(in) :: self
    character(*), intent(in) :: path             !! NAME of the &PATH
    integer :: k

    do k = 1, n_kinds
      if (self%counts(k) == 0) cycle
      call say('warning: path '//path//': '//str(self%counts(k))//' of '// &
        str(self%looks)//' increments '//trim(text(k))//'; the first at t = '// &
        str(self%first(1, k))//' s, plastic strain '//str(self%first(2, k))//', '// &
        str(self%first(3, k))//' K')
    end do
  end subroutine tell

end module front_point_watch
