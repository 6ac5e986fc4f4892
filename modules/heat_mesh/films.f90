! SPDX-License-Identifier: MIT
!> Walls that lose heat through half a cell by a film of one coefficient and radiation:
!> A (T - T_s)/(d/k) = A (h (T_s - T_a) + r (T_s^4 - T_a^4)).
module heat_mesh_films
  use base_kinds, only: rp
  use heat_mesh_mesh, only: wall_t
  implicit none (type, external)
  private

  public :: film_t

  type :: film_t
    integer :: n = 0
    logical :: radiates = .false.                 !! any of them
    integer, allocatable :: cell(:)
    real(rp), allocatable :: area(:), coefficient(:), depth(:), ambient(:)   !! [m2] [W/(m2 K)] ..
    real(rp), allocatable :: radiation(:)         !! emissivity times sigma [W/(m2 K4)]
    real(rp), allocatable :: conductance(:)       !! A/(1/h + d/k) with the reference k [W/K]
    real(rp), allocatable :: steepest(:)          !! no less than that at any temperature [W/K]
    real(rp), allocatable :: per_capacity(:)      !! conductance over capacity of the cell [1/s]
  contains
    procedure :: init
    procedure :: loss
  end type film_t

contains

  !> The walls that lose heat, by coefficients, radiation and ambient temperatures of each face.
  subroutine init(self, wall, capacity, conductivity, coefficient, radiation, ambient)
    class(film_t), intent(inout) :: self
    type(wall_t), intent(in) :: wall(:)
    real(rp), intent(in) :: capacity(:)           !! of cells [J/K]
    real(rp), intent(in) :: conductivity(:)       !! of bodies [W/(m K)]
    real(rp), intent(in), dimension(:, :) :: coefficient, radiation, ambient   !! (6, bodies)
    real(rp) :: h
    integer :: i, n

    n = size(wall)
    allocate (self%cell(n), self%area(n), self%coefficient(n), self%depth(n), self%ambient(n), &
              self%radiation(n), self%conductance(n), self%steepest(n), self%per_capacity(n))
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
        self%steepest(n) = self%conductance(n)
        if (self%radiation(n) > 0.0_rp) then
          self%radiates = .true.
          self%steepest(n) = w%area*conductivity(w%body)/w%depth
        end if
        self%per_capacity(n) = self%conductance(n)/capacity(w%cell)
      end associate
    end do
    self%n = n
  end subroutine init

  !> Heat that film `i` takes from its cell at `t` [W], and its derivative by that temperature. The
  !> temperature of a face that radiates by Newton's method from the hotter side, from where it
  !> never goes too far.
  elemental subroutine loss(self, i, t, resistivity, heat, slope)
    class(film_t), intent(in) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: t, resistivity        !! [K], 1/k of the cell [m K/W]
    real(rp), intent(out) :: heat, slope          !! [W], [W/K]
    integer, parameter :: most = 50
    real(rp), parameter :: close = 1.0e-14_rp
    real(rp) :: change, s
    integer :: k

    associate (h => self%coefficient(i), r => self%radiation(i), a => self%ambient(i), &
               metal => self%depth(i)*resistivity)
      if (r <= 0.0_rp) then
        slope = self%area(i)/(1.0_rp/h + metal)
        heat = slope*(t - a)
        return
      end if
      s = max(t, a)
      do k = 1, most
        slope = h + 4.0_rp*r*s**3
        heat = (h + r*(s + a)*(s*s + a*a))*(s - a)
        change = (metal*heat - (t - s))/(1.0_rp + metal*slope)
        s = s - change
        if (abs(change) <= close*s) exit
      end do
      heat = self%area(i)*(h + r*(s + a)*(s*s + a*a))*(s - a)
      slope = self%area(i)/(1.0_rp/(h + 4.0_rp*r*s**3) + metal)
    end associate
  end subroutine loss

end module heat_mesh_films
