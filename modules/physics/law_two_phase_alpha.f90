! SPDX-License-Identifier: MIT
!> Coefficient alpha*(T) of the two-phase law: fraction of the wall dislocations that act as sources
!> in cells.
module physics_law_two_phase_alpha
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use input_key_table, only: key_table_t
  use input_tables, only: check_rising
  use input_values, only: input_t
  use physics_flow_law, only: max_points
  implicit none (type, external)
  private

  public :: alpha_star_t

  !> alpha*(T): linear between points, constant outside; or a/(T + b) + c between two temperatures
  !> and constants outside.
  type :: alpha_star_t
    real(rp), allocatable :: t(:), value(:)        !! points, at least one: a table [K], [-]
    real(rp) :: fit(3) = [0.0_rp, 1.0_rp, 0.0_rp]  !! a [K], b [K], c
    real(rp) :: from = 0.0_rp, to = huge(1.0_rp)   !! range of the fit [K]
    real(rp) :: below = 0.0_rp, above = 0.0_rp     !! values below and above that range
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, evaluate
  end type alpha_star_t

contains

  !> Add its keys to &MATERIAL.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('TP_STAR', 'real', -max_points, '', 'if LAW = two-phase', '', &
      'alpha* at the temperatures TP_STAR_T: linear between, constant outside; one value: constant')
    call t%key('TP_STAR_T', 'real', -max_points, 'K', 'if LAW = two-phase', '(0,inf)', &
               'rising temperatures of TP_STAR')
    call t%key('TP_STAR_FIT', 'real', 3, '', 'if LAW = two-phase', '', &
               'instead of TP_STAR: a [K], b [K], c of alpha* = a/(T + b) + c')
    call t%key('TP_STAR_RANGE', 'real', 2, 'K', 'if LAW = two-phase', '(0,inf)', &
               'temperatures between which it holds')
    call t%key('TP_STAR_ENDS', 'real', 2, '', 'if LAW = two-phase', '', 'alpha* below and above')
  end subroutine add_keys

  !> Read a table, a constant or a fit.
  subroutine read_keys(self, input, i)
    class(alpha_star_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    if (input%given('MATERIAL', i, 'TP_STAR_FIT') .eqv. input%given('MATERIAL', i, 'TP_STAR')) then
      call input%report('MATERIAL', i, 'TP_STAR', 'give alpha* either by TP_STAR or by TP_STAR_FIT')
    else if (input%given('MATERIAL', i, 'TP_STAR_FIT')) then
      if (size(input%list('MATERIAL', i, 'TP_STAR_RANGE')) &
          + size(input%list('MATERIAL', i, 'TP_STAR_ENDS')) < 4) then
        call input%report('MATERIAL', i, 'TP_STAR_FIT', 'needs TP_STAR_RANGE and TP_STAR_ENDS')
        return
      end if
      self%fit = input%reals('MATERIAL', i, 'TP_STAR_FIT', 3)
      associate (range => input%reals('MATERIAL', i, 'TP_STAR_RANGE', 2), &
                 ends => input%reals('MATERIAL', i, 'TP_STAR_ENDS', 2))
        self%from = range(1)
        self%to = range(2)
        self%below = ends(1)
        self%above = ends(2)
      end associate
      if (self%to < self%from) call input%report('MATERIAL', i, 'TP_STAR_RANGE', 'must rise')
      if (self%from + self%fit(2) <= 0.0_rp) then
        call input%report('MATERIAL', i, 'TP_STAR_FIT', 'has its pole within TP_STAR_RANGE')
      end if
    else
      self%value = input%list('MATERIAL', i, 'TP_STAR')
      self%t = [1.0_rp]
      if (size(self%value) > 1) self%t = input%list('MATERIAL', i, 'TP_STAR_T')
      call check_rising(input, 'MATERIAL', i, 'TP_STAR_T', self%t)
      if (size(self%t) /= size(self%value)) then
        call input%report('MATERIAL', i, 'TP_STAR', 'has '//str(size(self%value))// &
                          ' values, TP_STAR_T '//str(size(self%t)))
      end if
    end if
  end subroutine read_keys

  !> alpha* at each temperature of a block.
  pure subroutine evaluate(self, temp, value)
    class(alpha_star_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane)
    real(rp), intent(out) :: value(nlane)
    integer :: k, n, p

    if (.not. allocated(self%t)) then
      call fitted(self%fit, self%from, self%to, self%below, self%above, temp, value)
      return
    end if
    n = size(self%t)
    value = self%value(1)
    do k = 1, n - 1
      associate (t1 => self%t(k), v1 => self%value(k), v2 => self%value(k + 1), &
                 scale => 1.0_rp/(self%t(k + 1) - self%t(k)))
        !$omp simd
        do p = 1, nlane
          if (temp(p) > t1) value(p) = v1 + (v2 - v1)*min(1.0_rp, (temp(p) - t1)*scale)
        end do
      end associate
    end do
  end subroutine evaluate

  pure subroutine fitted(fit, from, to, below, above, temp, value)
    real(rp), intent(in) :: fit(3), from, to, below, above, temp(nlane)
    real(rp), intent(out) :: value(nlane)
    integer :: p

    !$omp simd
    do p = 1, nlane
      value(p) = fit(1)/(min(to, max(from, temp(p))) + fit(2)) + fit(3)
      value(p) = merge(below, merge(above, value(p), temp(p) > to), temp(p) < from)
    end do
  end subroutine fitted

end module physics_law_two_phase_alpha
