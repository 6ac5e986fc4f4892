! SPDX-License-Identifier: MIT
!> Flow stress from a table over plastic strain, ln(rate) and temperature: linear between its
!> points, constant outside.
module physics_flow_table
  use base_kinds, only: nlane, rp
  use physics_flow_law, only: flow_law_t, n_work
  implicit none (type, external)
  private

  public :: flow_table_t

  type, extends(flow_law_t) :: flow_table_t
    real(rp), allocatable :: strain(:), log_rate(:), temp(:)   !! rising; [-], [ln 1/s], [K]
    real(rp), allocatable :: sigma(:, :, :)   !! at (strain, rate, temperature) [Pa]
  contains
    procedure :: prepare
    procedure :: stress
  end type flow_table_t

contains

  !> work(:,1) = T, work(:,2): the factor of melting.
  subroutine prepare(self, temp, state, work)
    class(flow_table_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    work(:, 1) = temp
    call self%strength_left(temp, work(:, 2))
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(flow_table_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)
    real(rp) :: plane(2, 2), line(2), e, r, t, per_strain, per_rate
    integer :: i, j, k, di, dj, dk, p

    do p = 1, nlane
      call locate(self%strain, alpha(p) + x(p), i, di, e, per_strain)
      call locate(self%log_rate, log_rate(p), j, dj, r, per_rate)
      call locate(self%temp, work(p, 1), k, dk, t)
      plane = (1.0_rp - t)*self%sigma([i, i + di], [j, j + dj], k) &
              + t*self%sigma([i, i + di], [j, j + dj], k + dk)
      line = (1.0_rp - r)*plane(:, 1) + r*plane(:, 2)
      sigma(p) = work(p, 2)*((1.0_rp - e)*line(1) + e*line(2))
      slope(p) = work(p, 2)*(x(p)*per_strain*(line(2) - line(1)) &
                             + per_rate*((1.0_rp - e)*(plane(1, 2) - plane(1, 1)) &
                                         + e*(plane(2, 2) - plane(2, 1))))
    end do
  end subroutine stress

  !> Points i and i + di beside `value`, its weight `w` at the second, and dw/dvalue.
  pure subroutine locate(points, value, i, di, w, slope)
    real(rp), intent(in) :: points(:), value
    integer, intent(out) :: i, di
    real(rp), intent(out) :: w
    real(rp), intent(out), optional :: slope
    real(rp) :: per_width

    i = max(1, min(size(points) - 1, count(points <= value)))
    di = min(1, size(points) - 1)
    per_width = 0.0_rp
    if (di == 1) per_width = 1.0_rp/(points(i + 1) - points(i))
    w = max(0.0_rp, min(1.0_rp, (value - points(i))*per_width))
    if (present(slope)) slope = merge(per_width, 0.0_rp, w > 0.0_rp .and. w < 1.0_rp)
  end subroutine locate

end module physics_flow_table
