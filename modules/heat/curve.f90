! SPDX-License-Identifier: MIT
!> Functions of one variable as equidistant values, linear between them and beyond the ends.
module heat_curve
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: curve_t, property_t, make_property, table_value

  !> Piecewise linear function with equidistant abscissas.
  type :: curve_t
    real(rp) :: first = 0.0_rp, step = 1.0_rp
    real(rp), allocatable :: value(:)     !! values at first, first + step, ...
  contains
    procedure :: at
  end type curve_t

  !> Thermal properties of a material. The state of a cell is its volumetric enthalpy over rho
  !> c_ref, theta = T_ref + int c_p dT/c_ref [K]; the heat flux is the gradient of the Kirchhoff
  !> potential phi = T_ref + int k dT/k_ref [K]. With constant c_p and k both equal T.
  type :: property_t
    real(rp) :: rho = 1.0_rp              !! density [kg/m3]
    real(rp) :: c_ref = 1.0_rp            !! reference specific heat [J/(kg K)]
    real(rp) :: k_ref = 0.0_rp            !! reference conductivity [W/(m K)]
    logical :: is_constant = .true.
    type(curve_t) :: state                !! theta over T
    type(curve_t) :: temperature          !! T over theta
    type(curve_t) :: potential            !! phi over theta
    type(curve_t) :: resistivity          !! 1/k over T [m K/W]
    type(curve_t) :: capacity             !! c_p/c_ref over T
  contains
    procedure :: state_at, temperature_at
  end type property_t

contains

  !> Value of a curve at `x`.
  elemental real(rp) function at(self, x)
    class(curve_t), intent(in) :: self
    real(rp), intent(in) :: x
    real(rp) :: s
    integer :: i

    s = (x - self%first)/self%step
    i = int(max(0.0_rp, min(s, real(size(self%value) - 2, rp))))
    s = s - real(i, rp)
    at = self%value(i + 1) + s*(self%value(i + 2) - self%value(i + 1))
  end function at

  !> Value at `t` of a table, linear between its entries and constant beyond its ends.
  pure real(rp) function table_value(t, x, y)
    real(rp), intent(in) :: t, x(:), y(:)
    integer :: i, n

    n = size(x)
    if (t <= x(1)) then
      table_value = y(1)
    else if (t >= x(n)) then
      table_value = y(n)
    else
      i = count(x <= t)
      table_value = y(i) + (t - x(i))/(x(i + 1) - x(i))*(y(i + 1) - y(i))
    end if
  end function table_value

  !> Properties from tables over temperature; a single entry is a constant. Integrals of the tables
  !> are exact at multiples of the resolution `fine` [K].
  function make_property(rho, t_c, c, t_k, k) result(p)
    real(rp), intent(in) :: rho                   !! density [kg/m3]
    real(rp), intent(in) :: t_c(:), c(:)          !! temperatures [K], specific heat [J/(kg K)]
    real(rp), intent(in) :: t_k(:), k(:)          !! temperatures [K], conductivity [W/(m K)]
    type(property_t) :: p
    real(rp), parameter :: fine = 0.25_rp, t_ref = 298.0_rp
    real(rp) :: t, before(2), now(2), mid(2)
    real(rp), allocatable :: theta(:), phi(:)
    type(curve_t) :: phi_of_t
    integer :: i, n, j

    p%rho = rho
    p%is_constant = all(abs(c - c(1)) <= 0.0_rp) .and. all(abs(k - k(1)) <= 0.0_rp)
    p%c_ref = table_value(t_ref, t_c, c)
    p%k_ref = table_value(t_ref, t_k, k)
    if (p%is_constant) return
    n = nint(max(4000.0_rp, 2.0_rp*t_c(size(t_c)), 2.0_rp*t_k(size(t_k)))/fine) + 1
    allocate (theta(n), phi(n))
    theta(1) = 0.0_rp
    phi(1) = 0.0_rp
    before = [table_value(0.0_rp, t_c, c), table_value(0.0_rp, t_k, k)]
    do i = 2, n
      t = fine*real(i - 1, rp)
      mid = [table_value(t - 0.5_rp*fine, t_c, c), table_value(t - 0.5_rp*fine, t_k, k)]
      now = [table_value(t, t_c, c), table_value(t, t_k, k)]
      theta(i) = theta(i - 1) + fine/6.0_rp*(before(1) + 4.0_rp*mid(1) + now(1))/p%c_ref
      phi(i) = phi(i - 1) + fine/6.0_rp*(before(2) + 4.0_rp*mid(2) + now(2))/p%k_ref
      before = now
    end do
    j = nint(t_ref/fine) + 1
    theta = theta - theta(j) + t_ref
    phi = phi - phi(j) + t_ref
    p%state = curve_t(0.0_rp, fine, theta)
    p%resistivity = curve_t(0.0_rp, fine, [(1.0_rp/table_value(fine*real(i - 1, rp), t_k, k), &
                                            i=1, n)])
    p%capacity = curve_t(0.0_rp, fine, [(table_value(fine*real(i - 1, rp), t_c, c)/p%c_ref, &
                                         i=1, n)])
    p%temperature = inverse(p%state, theta(1), (theta(n) - theta(1))/real(n - 1, rp), n)
    p%potential = p%temperature
    phi_of_t = curve_t(0.0_rp, fine, phi)
    do i = 1, n
      p%potential%value(i) = phi_of_t%at(p%temperature%value(i))
    end do
  end function make_property

  !> Inverse of a curve: temperatures at equidistant values of the state.
  pure function inverse(state, first, step, n) result(r)
    type(curve_t), intent(in) :: state
    real(rp), intent(in) :: first, step
    integer, intent(in) :: n
    type(curve_t) :: r
    real(rp) :: x
    integer :: i, j

    r%first = first
    r%step = step
    allocate (r%value(n))
    j = 1
    do i = 1, n
      x = first + step*real(i - 1, rp)
      do while (j < n - 1)
        if (state%value(j + 1) >= x) exit
        j = j + 1
      end do
      r%value(i) = state%first + state%step*(real(j - 1, rp) + (x - state%value(j)) &
                                             /(state%value(j + 1) - state%value(j)))
    end do
  end function inverse

  !> State theta [K] at a temperature [K].
  elemental real(rp) function state_at(self, t)
    class(property_t), intent(in) :: self
    real(rp), intent(in) :: t

    state_at = t
    if (.not. self%is_constant) state_at = self%state%at(t)
  end function state_at

  !> Temperature [K] at a state theta [K].
  elemental real(rp) function temperature_at(self, theta)
    class(property_t), intent(in) :: self
    real(rp), intent(in) :: theta

    temperature_at = theta
    if (.not. self%is_constant) temperature_at = self%temperature%at(theta)
  end function temperature_at

end module heat_curve
