! SPDX-License-Identifier: MIT
!> Exact solution of an implicit step in a box of constant properties by FFTW: cosine transforms in
!> y and x, in between a redistribution from planes across x to columns along x, and tridiagonal
!> systems with Robin ends in z. The response of a stirring source to the temperature of the surface
!> is solved for in its plane alone, so that the whole costs little more than one solution of the
!> box. For other solids it is a preconditioner: the box around them.
module heat_solvers_fft
  use base_kinds, only: rp, pi
  use heat_mesh_rates, only: heat_t
  use heat_solvers_cosine, only: cosine_t
  use heat_solvers_redistribution, only: redistribution_t
  use heat_solvers_surface, only: surface_t
  use heat_solvers_tridiagonal, only: tridiagonal_t
  implicit none (type, external)
  private

  public :: fft_t, has_fft

  logical, parameter :: has_fft = .true.

  type :: fft_t
    integer, private :: n(3) = 0
    type(redistribution_t), private :: share         !! planes and columns of the ranks
    type(cosine_t), private :: along_x, along_y
    type(surface_t), private :: surface
    logical :: is_exact = .false.                    !! the solid is a box that `solve` can do
    type(tridiagonal_t), private :: along_z
    real(rp), allocatable, private :: lambda_y(:)    !! [1/s]
    complex(rp), allocatable, private :: planes(:), work(:)
  contains
    procedure :: start
    procedure :: apply
    procedure :: solve
  end type fft_t

contains

  !> Plans, eigenvalues and the redistribution.
  subroutine start(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    integer :: i

    associate (mesh => heat%mesh)
      self%n = mesh%n
      call self%share%init(heat%world, self%n, mesh%nx)
      allocate (self%planes(self%share%pairs*self%n(2)*mesh%nx))
      allocate (self%work(self%share%pairs*maxval(self%n(1:2))))
      self%along_z%nx = self%n(1)
      self%along_z%nz = self%n(3)
      self%along_z%lambda_x = [(eigenvalue(i, self%n(1), mesh%x, heat), i=0, self%n(1) - 1)]
      self%lambda_y = [(eigenvalue(i, self%n(2), mesh%y, heat), i=0, self%n(2) - 1)]
      self%along_z%zm = mesh%zm(1:self%n(3))
      self%along_z%zp = mesh%zp(1:self%n(3))
      call mean_losses(self, heat)
      call self%along_x%init(self%n(1), self%share%pairs)
      call self%along_y%init(self%n(2), self%share%pairs)
      call self%surface%init(self%n(1), self%n(2))
      call look_for_box(self, heat)
    end associate
  end subroutine start

  !> Decay rate of cosine number `m` along an axis with the mean cell [1/s].
  pure real(rp) function eigenvalue(m, n, x, heat)
    integer, intent(in) :: m, n
    real(rp), intent(in) :: x(0:)
    type(heat_t), intent(in) :: heat
    real(rp) :: d

    d = (x(n) - x(0))/real(n, rp)
    eigenvalue = heat%property%k_ref/(heat%property%rho*heat%property%c_ref*d**2) &
                 *(2.0_rp - 2.0_rp*cos(pi*real(m, rp)/real(n, rp)))
  end function eigenvalue

  !> Losses of the films below and above [1/s], as means over the box.
  subroutine mean_losses(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp) :: sums(self%n(3))
    integer :: i, k

    sums = 0.0_rp
    do i = 1, heat%film%n
      k = 1 + mod(heat%film%cell(i) - 1, self%n(3))
      sums(k) = sums(k) + heat%film%conductance(i)
    end do
    call heat%world%sum(sums)
    associate (mesh => heat%mesh, p => heat%property)
      self%along_z%loss = sums/(p%rho*p%c_ref*(mesh%x(self%n(1)) - mesh%x(0))*(mesh%y(self%n(2)) &
                        - mesh%y(0))*(mesh%z(1:) - mesh%z(:self%n(3) - 1)))
    end associate
  end subroutine mean_losses

  !> Is it a box of constant properties on even lines, with films on whole faces across z?
  subroutine look_for_box(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), parameter :: close = 1.0e-9_rp
    real(rp) :: worst(1), d(heat%size())
    integer :: c, k

    associate (mesh => heat%mesh, f => heat%film)
      d = 0.0_rp
      do c = 1, f%n
        d(f%cell(c)) = d(f%cell(c)) + f%per_capacity(c)
      end do
      worst = unevenness(mesh%x) + unevenness(mesh%y)
      do c = 1, heat%size()
        k = 1 + mod(c - 1, self%n(3))
        worst = max(worst, abs(d(c) - self%along_z%loss(k)) &
                    /max(self%along_z%loss(k), tiny(1.0_rp)))
      end do
      if (size(mesh%odd) + size(mesh%void) > 0 .or. .not. heat%property%is_constant &
          .or. f%radiates) worst = 1.0_rp
    end associate
    call heat%world%max(worst)
    self%is_exact = worst(1) <= close
  end subroutine look_for_box

  !> Spread of the distances of lines, relative.
  pure real(rp) function unevenness(x)
    real(rp), intent(in) :: x(0:)
    real(rp) :: d(ubound(x, 1))

    d = x(1:) - x(:ubound(x, 1) - 1)
    unevenness = maxval(d)/minval(d) - 1.0_rp
  end function unevenness

  !> Collective. Z solves the box with right-hand side r [J], both of own cells.
  subroutine apply(self, heat, a, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a                     !! [s]
    real(rp), intent(in), contiguous :: r(:)
    real(rp), intent(out), contiguous :: z(:)
    complex(rp), allocatable :: columns(:)

    call forth_to_columns(self, heat, r, columns)
    call solve_columns(self, a, self%share%nj, .true., .true., columns)
    call back_from_columns(self, heat, columns, z)
  end subroutine apply

  !> Collective. Z solves the box with right-hand side r [J] and slopes `d` <= 0 of what walls give
  !> [W/K], those of the highest plane beyond the films.
  subroutine solve(self, heat, a, d, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a                     !! [s]
    real(rp), intent(in), contiguous :: d(:), r(:)
    real(rp), intent(out), contiguous :: z(:)
    complex(rp), allocatable :: columns(:)
    real(rp), allocatable, dimension(:) :: s, su, t, g   ! of the plane; all but s its cosines
    integer :: n

    n = self%n(1)*self%n(2)
    allocate (s(n), source=0.0_rp)
    call slopes_on_top(self, heat, a, d, s)
    call heat%world%sum(s)
    if (maxval(s) <= 0.0_rp) then
      call self%apply(heat, a, r, z)
      return
    end if
    call forth_to_columns(self, heat, r, columns)
    call solve_columns(self, a, self%share%nj, .true., .false., columns)
    allocate (t(n), g(n), source=0.0_rp)
    call read_top(self, a, self%share%nj, columns, t, g)
    call heat%world%sum(t)
    call heat%world%sum(g)
    allocate (su(n))
    call self%surface%respond(s, t, g, su)
    call lower_top(self, self%share%nj, g*su, columns)
    call solve_columns(self, a, self%share%nj, .false., .true., columns)
    call back_from_columns(self, heat, columns, z)
  end subroutine solve

  !> Collective. R over the capacities, transformed along y, as columns along x.
  subroutine forth_to_columns(self, heat, r, columns)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in), contiguous :: r(:)
    complex(rp), allocatable, intent(out) :: columns(:)
    integer :: i, m, np, o

    np = heat%mesh%np
    m = self%share%pairs*self%n(2)
    do i = 1, heat%mesh%nx
      o = (i - 1)*np
      call take(self%n(3), self%share%pairs, self%n(2), heat%mesh%capacity(o + 1:o + np), &
                r(o + 1:o + np), self%planes((i - 1)*m + 1))
      call self%along_y%forth(self%share%pairs, self%planes((i - 1)*m + 1), self%work)
      self%planes((i - 1)*m + 1:i*m) = self%work(:m)
    end do
    if (heat%world%size == 1) then               ! planes are columns
      call move_alloc(self%planes, columns)
    else
      call self%share%to_columns(heat%world, self%planes, columns)
    end if
  end subroutine forth_to_columns

  !> Collective. The reverse of `forth_to_columns`, without the capacities.
  subroutine back_from_columns(self, heat, columns, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    complex(rp), allocatable, intent(inout) :: columns(:)
    real(rp), intent(out), contiguous :: z(:)
    integer :: i, m, np, o

    if (heat%world%size == 1) then
      call move_alloc(columns, self%planes)
    else
      call self%share%to_planes(heat%world, columns, self%planes)
    end if
    np = heat%mesh%np
    m = self%share%pairs*self%n(2)
    do i = 1, heat%mesh%nx
      o = (i - 1)*np
      self%work(:m) = self%planes((i - 1)*m + 1:i*m)
      call self%along_y%back(self%share%pairs, self%work, self%planes((i - 1)*m + 1))
      call give(self%n(3), self%share%pairs, self%n(2), heat%mesh%capacity(o + 1:o + np), &
                self%planes((i - 1)*m + 1), 0.25_rp/real(self%n(1)*self%n(2), rp), z(o + 1:o + np))
    end do
  end subroutine back_from_columns

  !> s = -a d/C - a loss of the highest plane, own part.
  subroutine slopes_on_top(self, heat, a, d, s)
    class(fft_t), intent(in) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, d(:)
    real(rp), intent(inout) :: s(self%n(2), self%n(1))
    integer :: c, i, j

    do i = 1, heat%mesh%nx
      do j = 1, self%n(2)
        c = (i - 1)*heat%mesh%np + j*self%n(3)
        s(j, heat%mesh%lo + i - 1) = -a*(d(c)/heat%mesh%capacity(c) + self%along_z%loss(self%n(3)))
      end do
    end do
    where (s <= 1.0e-9_rp*a*self%along_z%loss(self%n(3))) s = 0.0_rp   ! films alone, to rounding
  end subroutine slopes_on_top

  !> The highest plane after elimination, and its response to itself: own rows alone.
  pure subroutine read_top(self, a, nj, columns, t, g)
    class(fft_t), intent(in) :: self
    real(rp), intent(in) :: a                     !! [s]
    integer, intent(in) :: nj
    complex(rp), intent(in) :: columns(self%share%pairs, nj, self%n(1))
    real(rp), intent(inout), dimension(self%n(1), self%n(2)) :: t, g
    integer :: j

    do j = 1, nj
      call self%along_z%response(a, self%lambda_y(self%share%j0 + j), g(:, self%share%j0 + j))
      associate (top => columns(self%share%pairs, j, :))
        t(:, self%share%j0 + j) = merge(top%re, top%im, mod(self%n(3), 2) == 1)
      end associate
    end do
  end subroutine read_top

  !> Take `less` from the highest plane.
  pure subroutine lower_top(self, nj, less, columns)
    class(fft_t), intent(in) :: self
    integer, intent(in) :: nj
    real(rp), intent(in) :: less(self%n(1), self%n(2))
    complex(rp), intent(inout) :: columns(self%share%pairs, nj, self%n(1))
    integer :: i, j

    do i = 1, self%n(1)
      do j = 1, nj
        associate (top => columns(self%share%pairs, j, i))
          top = top - less(i, self%share%j0 + j) &
                *merge((1.0_rp, 0.0_rp), (0.0_rp, 1.0_rp), mod(self%n(3), 2) == 1)
        end associate
      end do
    end do
  end subroutine lower_top

  !> Pairs of cells in z as complex numbers, r over the capacity; 0 outside the solid.
  pure subroutine take(nz, pairs, ny, capacity, r, x)
    integer, intent(in) :: nz, pairs, ny
    real(rp), intent(in) :: capacity(nz, ny), r(nz, ny)   !! [J/K], [J]
    complex(rp), intent(out) :: x(pairs, ny)
    real(rp) :: y(2*pairs)
    integer :: j, k

    y = 0.0_rp
    do j = 1, ny
      do k = 1, nz
        y(k) = merge(r(k, j)/max(capacity(k, j), tiny(1.0_rp)), 0.0_rp, capacity(k, j) > 0.0_rp)
      end do
      x(:, j) = cmplx(y(1::2), y(2::2), rp)
    end do
  end subroutine take

  !> The reverse of `take`, without the capacity.
  pure subroutine give(nz, pairs, ny, capacity, x, factor, z)
    integer, intent(in) :: nz, pairs, ny
    real(rp), intent(in) :: capacity(nz, ny), factor
    complex(rp), intent(in) :: x(pairs, ny)
    real(rp), intent(out) :: z(nz, ny)
    real(rp) :: y(2*pairs)
    integer :: j

    do j = 1, ny
      y(1::2) = x(:, j)%re
      y(2::2) = x(:, j)%im
      z(:, j) = merge(factor*y(:nz), 0.0_rp, capacity(:, j) > 0.0_rp)
    end do
  end subroutine give

  !> Along x for each row of y in turn: transform and elimination in tridiagonal systems along z for
  !> every pair of cosines (`is_up`), substitution and transform back (`is_down`).
  subroutine solve_columns(self, a, nj, is_up, is_down, columns)
    class(fft_t), intent(in) :: self
    real(rp), intent(in) :: a                     !! [s]
    integer, intent(in) :: nj
    logical, intent(in) :: is_up, is_down
    complex(rp), intent(inout) :: columns(self%share%pairs, nj, self%n(1))
    complex(rp), allocatable :: work(:, :)
    integer :: j

    allocate (work(self%share%pairs, self%n(1)))
    do j = 1, nj
      if (is_up) then
        call self%along_x%forth(self%share%pairs*nj, columns(1, j, 1), work)
      else
        work = columns(:, j, :)
      end if
      call self%along_z%solve(a, self%lambda_y(self%share%j0 + j), is_up, is_down, work)
      if (is_down) then
        call self%along_x%back(self%share%pairs*nj, work, columns(1, j, 1))
      else
        columns(:, j, :) = work
      end if
    end do
  end subroutine solve_columns

end module heat_solvers_fft
