! SPDX-License-Identifier: MIT
!> Static annealing of the dislocation structure, for each particle by itself:
!>   recovery           d rho/dt = -C_r(T) rho^n of both densities, not below the initial ones;
!>   coarsening         d(d^m)/dt = C_g(T) of subgrains (rho as 1/d^2) and of recrystallised grains;
!>   recrystallisation  nuclei at the distance D grow into deformed metal at v = M(T) G b^2 rho/2
!>                      while rho is above a threshold: X = 1 - exp(-(2 R/D)^3), dR/dt = v
!>                      (Johnson & Mehl, Avrami, site-saturated); X gets the initial densities.
!> C(T) = C0 exp(-Q/(R T)). During deformation X decays with strain, dX = -X deps/strain: the new
!> grains are deformed as well, which leads to a steady state (dynamic recrystallisation).
module physics_annealing
  use base_kinds, only: nlane, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: annealing_t, anneal_block, deformed_density

  integer, parameter, public :: n_annealing = 2   !! X, size of the recrystallised grains [m]

  !> Arrhenius factor C0 exp(-Q/(R T)); C0 = 0: inactive.
  type, public :: arrhenius_t
    real(rp) :: factor = 0.0_rp        !! C0, in the unit of C
    real(rp) :: energy = 0.0_rp        !! Q [J/mol]
  end type arrhenius_t

  type :: annealing_t
    type(arrhenius_t) :: recovery      !! C0 [m^(2n-2)/s]
    type(arrhenius_t) :: growth        !! C0 [m^m/s]
    type(arrhenius_t) :: mobility      !! C0 [m4/(J s)]
    real(rp) :: recovery_exponent = 2.0_rp, growth_exponent = 2.0_rp
    real(rp) :: threshold = huge(1.0_rp)  !! density above which nuclei grow [1/m2]
    !> D, distance of nuclei and final grain size after recrystallisation [m].
    real(rp) :: spacing = 1.0_rp
    !> Strain over which deformation removes the recrystallised fraction X [-].
    real(rp) :: strain = huge(1.0_rp)
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, is_active
  end type annealing_t

  real(rp), parameter :: gas_constant = 8.314462618_rp      !! [J/(mol K)]
  real(rp), parameter :: nucleus_radius = 0.1_rp            !! initial radius of a nucleus over D/2
  !> Deformed fraction below which recrystallisation is complete.
  real(rp), parameter :: min_deformed_fraction = 1.0e-3_rp

contains

  !> Add the keys of annealing to &MATERIAL.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('RECOVERY', 'real', 2, '', '0 0 if LAW = two-phase', '[0,inf)', &
      'static recovery of the dislocation density: C [m^(2n-2)/s] and Q [J/mol] of d rho/dt = '// &
      '-C exp(-Q/(R T)) rho^n; 0: none')
    call t%key('RECOVERY_EXPONENT', 'real', 1, '', '2 if LAW = two-phase', '(1,10]', &
               'exponent n of RECOVERY')
    call t%key('GROWTH', 'real', 2, '', '0 0 if LAW = two-phase', '[0,inf)', &
      'grain growth: C [m^m/s] and Q [J/mol] of d(d^m)/dt = C exp(-Q/(R T)) for the grain '// &
      'size d; 0: none')
    call t%key('GROWTH_EXPONENT', 'real', 1, '', '2 if LAW = two-phase', '[1,20]', &
               'exponent m of GROWTH')
    call t%key('RECRYSTALLISATION', 'real', 2, '', '0 0 if LAW = two-phase', '[0,inf)', &
               'static recrystallisation: mobility [m4/(J s)] of the boundaries of new grains '// &
               'and its activation energy [J/mol]; 0: none')
    call t%key('NUCLEATION_DENSITY', 'real', 1, '1/m2', '0 if LAW = two-phase', '[0,inf)', &
               'dislocation density above which new grains grow')
    call t%key('NUCLEUS_SPACING', 'real', 1, 'm', '0 if LAW = two-phase', '[0,inf)', &
               'distance of the nuclei and size of the recrystallised grains; above 0 with '// &
               'RECRYSTALLISATION')
    call t%key('RECRYSTALLISED_STRAIN', 'real', 1, '', '0.5 if LAW = two-phase', '(0,inf)', &
               'plastic strain in which the recrystallised fraction falls by the factor e')
  end subroutine add_keys

  subroutine read_keys(self, input, i)
    class(annealing_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    self%recovery = arrhenius('RECOVERY')
    self%growth = arrhenius('GROWTH')
    self%mobility = arrhenius('RECRYSTALLISATION')
    self%recovery_exponent = input%real('MATERIAL', i, 'RECOVERY_EXPONENT')
    self%growth_exponent = input%real('MATERIAL', i, 'GROWTH_EXPONENT')
    self%threshold = input%real('MATERIAL', i, 'NUCLEATION_DENSITY')
    self%spacing = input%real('MATERIAL', i, 'NUCLEUS_SPACING')
    self%strain = input%real('MATERIAL', i, 'RECRYSTALLISED_STRAIN')
    if (self%mobility%factor > 0.0_rp .and. self%spacing <= 0.0_rp) then
      call input%report('MATERIAL', i, 'NUCLEUS_SPACING', 'must be above 0 with RECRYSTALLISATION')
    end if
  contains
    type(arrhenius_t) function arrhenius(key)
      character(*), intent(in) :: key
      real(rp) :: pair(2)

      pair = input%reals('MATERIAL', i, key, 2)
      arrhenius = arrhenius_t(pair(1), pair(2))
    end function arrhenius
  end subroutine read_keys

  !> True if any static process is active.
  pure logical function is_active(self)
    class(annealing_t), intent(in) :: self

    is_active = self%recovery%factor > 0.0_rp .or. self%growth%factor > 0.0_rp &
              .or. self%mobility%factor > 0.0_rp
  end function is_active

  !> Advance the state of a block by `dt`; `size` is K of d = K/sqrt(rho).
  pure subroutine anneal_block(self, dt, line_energy, size, walls, interior, temp, rate, root, &
                               cells, fraction, new)
    type(annealing_t), intent(in) :: self
    real(rp), intent(in) :: dt                       !! time step [s]
    real(rp), intent(in) :: line_energy              !! G b^2/2 [J/m]
    real(rp), intent(in) :: size
    real(rp), intent(in) :: walls, interior           !! initial densities [1/m2]
    real(rp), intent(in) :: temp(nlane), rate(nlane)  !! temperature [K], plastic strain rate [1/s]
    real(rp), intent(inout) :: root(nlane)            !! sqrt(rho_w), root of the wall density [1/m]
    real(rp), intent(inout) :: cells(nlane)           !! rho_c, density in the cells [1/m2]
    real(rp), intent(in) :: fraction(nlane)           !! f, volume fraction of the walls [-]
    real(rp), intent(inout) :: new(nlane, n_annealing)
    real(rp), dimension(nlane) :: wall, total, scale

    wall = root**2
    if (self%recovery%factor > 0.0_rp) then
      call recover(self%recovery_exponent, dt*arrhenius(self%recovery, temp), walls, wall)
      call recover(self%recovery_exponent, dt*arrhenius(self%recovery, temp), interior, cells)
    end if
    if (self%growth%factor > 0.0_rp) then
      total = fraction*wall + (1.0_rp - fraction)*cells
      scale = size/sqrt(total)
      call grow(self%growth_exponent, dt*arrhenius(self%growth, temp), scale)
      scale = size**2/(scale**2*total)
      wall = max(min(wall, walls), scale*wall)
      cells = max(min(cells, interior), scale*cells)
      call grow(self%growth_exponent, dt*arrhenius(self%growth, temp), new(:, 2))
    end if
    if (self%mobility%factor > 0.0_rp) then
      call recrystallise(self, dt*line_energy*arrhenius(self%mobility, temp), walls, interior, &
                         fraction, wall, cells, new)
      new(:, 1) = new(:, 1)*exp(-dt*rate/self%strain)
    end if
    root = sqrt(wall)
  end subroutine anneal_block

  pure function arrhenius(rate, temp) result(value)
    type(arrhenius_t), intent(in) :: rate
    real(rp), intent(in) :: temp(nlane)
    real(rp) :: value(nlane)

    value = rate%factor*exp(-rate%energy/(gas_constant*max(temp, 1.0_rp)))
  end function arrhenius

  !> Integrate d rho = -rho^n dc exactly; a density below `min_density` is unchanged.
  pure subroutine recover(n, dc, min_density, density)
    real(rp), intent(in) :: n, dc(nlane), min_density
    real(rp), intent(inout) :: density(nlane)

    where (density > min_density)
      density = max(min_density, density*(1.0_rp + (n - 1.0_rp)*dc*density**(n - 1.0_rp)) &
                           **(-1.0_rp/(n - 1.0_rp)))
    end where
  end subroutine recover

  !> Integrate d(d^m) = dc exactly; a grain size of 0 is unchanged.
  pure subroutine grow(m, dc, d)
    real(rp), intent(in) :: m, dc(nlane)
    real(rp), intent(inout) :: d(nlane)

    where (d > 0.0_rp) d = d*(1.0_rp + dc/d**m)**(1.0_rp/m)
  end subroutine grow

  !> Dislocation density of the deformed part, from the mean over deformed and recrystallised parts.
  elemental real(rp) function deformed_density(total, initial, x)
    real(rp), intent(in) :: total, initial, x

    deformed_density = max(total, (total - x*initial)/max(1.0_rp - x, min_deformed_fraction))
  end function deformed_density

  !> Advance recrystallisation: boundaries of new grains move by `advance` times the density of the
  !> deformed part.
  pure subroutine recrystallise(self, advance, walls, interior, fraction, wall, cells, new)
    type(annealing_t), intent(in) :: self
    real(rp), intent(in) :: advance(nlane), walls, interior, fraction(nlane)
    real(rp), intent(inout) :: wall(nlane), cells(nlane), new(nlane, n_annealing)
    real(rp) :: density, initial, radius, swept, x
    integer :: p

    do p = 1, nlane
      x = new(p, 1)
      initial = fraction(p)*walls + (1.0_rp - fraction(p))*interior
      density = deformed_density(fraction(p)*wall(p) + (1.0_rp - fraction(p))*cells(p), initial, x)
      if (density <= self%threshold .or. 1.0_rp - x <= min_deformed_fraction) cycle
      radius = max(nucleus_radius, (-log(1.0_rp - x))**(1.0_rp/3.0_rp)) &
               + 2.0_rp*advance(p)*density/self%spacing
      new(p, 1) = 1.0_rp - exp(-min(radius, 8.0_rp)**3)
      swept = (new(p, 1) - x)/(1.0_rp - x)
      wall(p) = wall(p) + swept*(walls - wall(p))
      cells(p) = cells(p) + swept*(interior - cells(p))
      if (x < nucleus_radius) new(p, 2) = 0.0_rp          ! restart from a new generation of grains
      new(p, 2) = max(new(p, 2), self%spacing*min(radius, 1.0_rp))
    end do
  end subroutine recrystallise

end module physics_annealing
