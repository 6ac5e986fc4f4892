! SPDX-License-Identifier: MIT
!> Strength tables over temperature of a &MATERIAL for heat-only scenes: pairs of values, or pieces
!> of five values.
module heat_setup_tables
  use base_kinds, only: rp
  use input_diagnostics, only: diagnostics_t
  use input_tables, only: rises
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: check_tables, n_values, split_pairs

contains

  !> Check that strengths are pairs of rising temperature, and that pieces have five values.
  subroutine check_tables(input, diagnostics)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp), allocatable :: t(:), v(:)
    integer :: i, n

    do i = 1, input%count('MATERIAL')
      n = n_values(input, i, 'YIELD_TABLE')
      if (n > 0) then
        call split_pairs(input, i, 'YIELD_TABLE', t, v)
        if (.not. rises(t)) call input%report(diagnostics, 'MATERIAL', i, 'YIELD_TABLE', &
                                              'must be pairs in rising temperature')
      end if
      if (mod(n_values(input, i, 'YIELD_LOGISTIC'), 5) /= 0) then
        call input%report(diagnostics, 'MATERIAL', i, 'YIELD_LOGISTIC', &
                          'must be pieces of five values')
      end if
    end do
  end subroutine check_tables

  !> Number of values given in a list: up to the last nonzero one.
  integer function n_values(input, i, key)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    real(rp) :: x(64)
    integer :: max_values

    n_values = 0
    if (.not. input%given('MATERIAL', i, key)) return
    max_values = merge(25, 64, key == 'YIELD_LOGISTIC')
    x = 0.0_rp
    x(:max_values) = input%reals('MATERIAL', i, key, max_values)
    n_values = findloc(abs(x) > 0.0_rp, .true., dim=1, back=.true.)
    if (key == 'YIELD_TABLE') n_values = n_values + mod(n_values, 2)   ! a table may end with 0 Pa
  end function n_values

  !> Temperatures and values of a table.
  subroutine split_pairs(input, i, key, t, v)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    real(rp), allocatable, intent(out) :: t(:), v(:)
    real(rp) :: x(64)
    integer :: n

    x = input%reals('MATERIAL', i, key, 64)
    n = n_values(input, i, key)
    t = x(1:n:2)
    v = x(2:n:2)
  end subroutine split_pairs

end module heat_setup_tables
