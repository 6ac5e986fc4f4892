! SPDX-License-Identifier: MIT
!> Counts where a material point leaves what its flow law is valid for, as a run does of particles.
module front_point_watch
  use base_kinds, only: i8, nlane, rp
  use base_log, only: say
  use base_text, only: str
  use physics_flow_law, only: most_warnings
  use physics_material, only: material_t
  use physics_point, only: point_t
  implicit none (type, external)
  private

  public :: point_watch_t

  ! Behind the warnings of the law.
  integer, parameter :: unsolved = most_warnings + 1, molten = most_warnings + 2, &
                        n_kinds = most_warnings + 2

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
    integer :: found(n_kinds), k, lane(most_warnings)

    self%looks = self%looks + 1
    found = 0
    lane = 0
    temp = point%temp
    rate = point%rate
    call material%flow%inspect(1, temp, rate, spread(point%state, 1, nlane), &
                               found(:most_warnings), lane)
    if (present(failed)) found(unsolved) = failed
    if (point%temp > material%t_melt) found(molten) = 1
    do k = 1, n_kinds
      if (found(k) == 0) cycle
      if (self%counts(k) == 0) self%first(:, k) = [time, point%alpha, point%temp]
      self%counts(k) = self%counts(k) + 1
    end do
  end subroutine look

  !> Write a warning of each kind that there was.
  subroutine tell(self, material, path)
    class(point_watch_t), intent(in) :: self
    type(material_t), intent(in) :: material
    character(*), intent(in) :: path             !! NAME of the &PATH
    character(48), allocatable :: own(:)
    character(48) :: text(n_kinds)
    integer :: k

    text(unsolved) = 'found no stress that balances the elastic one'
    text(molten) = 'ended above T_MELT'
    call material%flow%list_warnings(own)
    text(:size(own)) = own
    do k = 1, n_kinds
      if (self%counts(k) == 0) cycle
      call say('warning: path '//path//': '//str(self%counts(k))//' of '//str(self%looks)// &
               ' increments '//trim(text(k))//'; the first at t = '//str(self%first(1, k))// &
               ' s, plastic strain '//str(self%first(2, k))//', '//str(self%first(3, k))//' K')
    end do
  end subroutine tell

end module front_point_watch
