! SPDX-License-Identifier: MIT
!> Flow stress from a table over plastic strain, ln(rate) and temperature: linear between its
!> points, constant outside.
module physics_law_table
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use input_key_table, only: key_table_t
  use input_tables, only: check_rising
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, max_points, n_work
  implicit none (type, external)
  private

  public :: flow_table_t

  type, extends(flow_law_t) :: flow_table_t
    real(rp), allocatable :: strain(:)     !! increasing plastic strains [-]
    real(rp), allocatable :: log_rate(:)   !! increasing logarithms of the rate [ln 1/s]
    real(rp), allocatable :: temp(:)       !! increasing temperatures [K]
    real(rp), allocatable :: sigma(:, :, :)  !! flow stress at (strain, rate, temperature) [Pa]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, prepare, stress
  end type flow_table_t

  integer, parameter :: max_values = 4096   !! largest number of flow stresses of a table

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('TABLE_STRAIN', 'real', -max_points, '', 'required if LAW = table', '[0,inf)', &
               'rising plastic strains of the table')
    call t%key('TABLE_RATE', 'real', -max_points, '1/s', '1 if LAW = table', '(0,inf)', &
               'rising strain rates; between them the stress is linear in ln(rate)')
    call t%key('TABLE_T', 'real', -max_points, 'K', '298 if LAW = table', '(0,inf)', &
               'rising temperatures')
    call t%key('TABLE_STRESS', 'real', -max_values, 'Pa', 'required if LAW = table', '[0,inf)', &
               'flow stress; strain varies fastest, then rate, then temperature; constant '// &
               'outside the table')
  end subroutine add_keys

  subroutine read_keys(self, input, i, shear)
    class(flow_table_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: shear
    real(rp), allocatable :: values(:)
    integer :: wanted

    self%strain = input%list('MATERIAL', i, 'TABLE_STRAIN')
    self%log_rate = log(input%list('MATERIAL', i, 'TABLE_RATE'))
    self%temp = input%list('MATERIAL', i, 'TABLE_T')
    allocate (values, source=input%list('MATERIAL', i, 'TABLE_STRESS'))
    call check_rising(input, 'MATERIAL', i, 'TABLE_STRAIN', self%strain)
    call check_rising(input, 'MATERIAL', i, 'TABLE_RATE', self%log_rate)
    call check_rising(input, 'MATERIAL', i, 'TABLE_T', self%temp)
    wanted = size(self%strain)*size(self%log_rate)*size(self%temp)
    if (wanted > 0 .and. size(values) == wanted) then
      self%sigma = reshape(values, [size(self%strain), size(self%log_rate), size(self%temp)])
      call read_end(self, input, i)
    else
      call input%report('MATERIAL', i, 'TABLE_STRESS', 'has '//str(size(values))// &
                        ' values, the table has '//str(wanted))
      self%strain = [0.0_rp]                    ! no strength in the remaining checks
      self%log_rate = [0.0_rp]
      self%temp = [0.0_rp]
      self%sigma = reshape([0.0_rp], [1, 1, 1])
    end if
  end subroutine read_keys

  !> Check that a table over temperatures ends below T_MELT, and read the melting range.
  subroutine read_end(self, input, i)
    type(flow_table_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: last

    last = 0.0_rp
    if (size(self%temp) > 1) last = self%temp(size(self%temp))
    if (input%given('MATERIAL', i, 'T_MELT') .and. last > input%real('MATERIAL', i, 'T_MELT')) then
      call input%report('MATERIAL', i, 'TABLE_T', 'reaches above T_MELT = '// &
                        str(input%real('MATERIAL', i, 'T_MELT'))//' K')
    end if
    call self%read_melting(input, i, last)
  end subroutine read_end

  !> Store work(:,1) = T and the melting factor in work(:,2).
  subroutine prepare(self, temp, state, work)
    class(flow_table_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    work(:, 1) = temp
    call self%strength_factor(temp, work(:, 2))
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

  !> Points i and i + di around `value`, its weight `w` at the second, and dw/dvalue.
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

end module physics_law_table
