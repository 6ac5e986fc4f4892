! SPDX-License-Identifier: MIT
!> Heat loss of boundary faces through half a cell, a film with a constant coefficient and
!> radiation: A (T - T_s)/(d/k) = A (h (T_s - T_a) + r (T_s^4 - T_a^4)).
module heat_mesh_films
  use base_kinds, only: rp
  use heat_mesh_mesh, only: boundary_face_t
  implicit none (type, external)
  private

  public :: wall_films_t

  !> Boundary faces with heat loss.
  type :: wall_films_t
    integer :: n = 0
    logical :: radiates = .false.                 !! any face radiates
    integer, allocatable :: cell(:)               !! own cell of each face
    real(rp), allocatable :: area(:)              !! [m2]
    real(rp), allocatable :: coefficient(:)       !! [W/(m2 K)]
    real(rp), allocatable :: depth(:)             !! depth of the cell centre [m]
    real(rp), allocatable :: ambient(:)           !! temperature [K]
    real(rp), allocatable :: radiation(:)         !! emissivity times sigma [W/(m2 K4)]
    real(rp), allocatable :: conductance(:)       !! A/(1/h + d/k) with the reference k [W/K]
    real(rp), allocatable :: max_conductance(:)   !! upper bound over all temperatures [W/K]
    real(rp), allocatable :: per_capacity(:)      !! conductance over capacity of the cell [1/s]
  contains
    procedure :: init
    procedure :: loss
  end type wall_films_t

contains

  !> List the boundary faces with heat loss, with coefficients by direction and body.
  subroutine init(self, wall, capacity, conductivity, coefficient, radiation, ambient)
    class(wall_films_t), intent(inout) :: self
    type(boundary_face_t), intent(in) :: wall(:)
    real(rp), intent(in) :: capacity(:)           !! capacity of the cells [J/K]
    real(rp), intent(in) :: conductivity(:)       !! conductivity of the bodies [W/(m K)]
    real(rp), intent(in) :: coefficient(:, :)     !! (6, bodies) [W/(m2 K)]
    real(rp), intent(in) :: radiation(:, :)       !! (6, bodies) emissivity times sigma [W/(m2 K4)]
    real(rp), intent(in) :: ambient(:, :)         !! (6, bodies) [K]
    real(rp) :: h
    integer :: i, n

    n = size(wall)
    allocate (self%cell(n), self%area(n), self%coefficient(n), self%depth(n), self%ambient(n), &
              self%radiation(n), self%conductance(n), self%max_conductance(n), self%per_capacity(n))
    n = 0
    do i = 1, size(wall)
      associate (w => wall(i))
        if (coefficient(w%face, w%body) <= 0.0_rp .and. radiation(w%face, w%body) <= 0.0_rp) cycle
        n = n + 1
        self%cell(n) = w%cell
        self%area(n) = w%area
        self%coefficient(n) = coefficient(w%face, w%body)
        self%radiation(n) = radiation(w%face, w%body)
        self%depth(n) = w%depth
        self%ambient(n) = ambient(w%face, w%body)
        h = self%coefficient(n) + 4.0_rp*self%radiation(n)*self%ambient(n)**3
        self%conductance(n) = w%area/(1.0_rp/h + w%depth/conductivity(w%body))
        self%max_conductance(n) = self%conductance(n)
        if (self%radiation(n) > 0.0_rp) then
          self%radiates = .true.
          self%max_conductance(n) = w%area*conductivity(w%body)/w%depth
        end if
        self%per_capacity(n) = self%conductance(n)/capacity(w%cell)
      end associate
    end do
    self%n = n
  end subroutine init

  !> Heat loss of face `i` at a cell temperature, and its derivative. The surface temperature of a
  !> radiating face is found by Newton's method from the hotter side, from which it converges
  !> monotonically.
  elemental subroutine loss(self, i, t, resistivity, heat, slope)
    class(wall_films_t), intent(in) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: t                     !! temperature of the cell [K]
    real(rp), intent(in) :: resistivity           !! 1/k of the cell [m K/W]
    real(rp), intent(out) :: heat                 !! loss [W]
    real(rp), intent(out) :: slope                !! its derivative [W/K]
    integer, parameter :: max_iterations = 50
    real(rp), parameter :: close = 1.0e-14_rp
    real(rp) :: change, s
    integer :: k

    associate (h => self%coefficient(i), r => self%radiation(i), a => self%ambient(i), &
               cell_resistance => self%depth(i)*resistivity)
      if (r <= 0.0_rp) then
        slope = self%area(i)/(1.0_rp/h + cell_resistance)
        heat = slope*(t - a)
        return
      end if
      s = max(t, a)
      do k = 1, max_iterations
        slope = h + 4.0_rp*r*s**3
        heat = (h + r*(s + a)*(s*s + a*a))*(s - a)
        change = (cell_resistance*heat - (t - s))/(1.0_rp + cell_resistance*slope)
        s = s - change
        if (abs(change) <= close*s) exit
      end do
      heat = self%area(i)*(h + r*(s + a)*(s*s + a*a))*(s - a)
      slope = self%area(i)/(1.0_rp/(h + 4.0_rp*r*s**3) + cell_resistance)
    end associate
  end subroutine loss

end module heat_mesh_films
