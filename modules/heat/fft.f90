! SPDX-License-Identifier: MIT
!> Direct solution of an implicit step in a box of constant properties with FFTW: cosine transforms
!> in y and x with a redistribution from planes normal to x to columns along x in between, and
!> tridiagonal systems with Robin boundary conditions in z. The dependence of a stirring source on
!> the surface temperature is solved for in the surface plane alone, at little extra cost. For other
!> solids the solution of their bounding box is a preconditioner.
module heat_fft
  use base_kinds, only: rp, pi
  use heat_cosine, only: cosine_t
  use heat_rates, only: heat_t
  use heat_redistribution, only: redistribution_t
  use heat_surface, only: surface_t
  use heat_tridiagonal, only: tridiagonal_t
  implicit none (type, external)
  private

  public :: fft_t, has_fft

  logical, parameter :: has_fft = .true.

  !> Plans, eigenvalues and work arrays.
  type :: fft_t
    integer, private :: n(3) = 0
    !> Redistribution between planes and columns of the ranks.
    type(redistribution_t), private :: share
    type(cosine_t), private :: along_x, along_y
    type(surface_t), private :: surface
    logical :: is_exact = .false.                    !! `solve` is exact for this solid
    type(tridiagonal_t), private :: along_z
    real(rp), allocatable, private :: lambda_y(:)    !! eigenvalues along y [1/s]
    complex(rp), allocatable, private :: planes(:), work(:)
  contains
    procedure :: start, apply, solve
  end type fft_t

contains

  !> Make the plans, the eigenvalues and the redistribution.
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
      call detect_box(self, heat)
    end associate
  end subroutine start

  !> Decay rate of cosine mode `m` along an axis with the mean cell width [1/s].
  pure real(rp) function eigenvalue(m, n, x, heat)
    integer, intent(in) :: m, n
    real(rp), intent(in) :: x(0:)
    type(heat_t), intent(in) :: heat
    real(rp) :: d

    d = (x(n) - x(0))/real(n, rp)
    eigenvalue = heat%property%k_ref/(heat%property%rho*heat%property%c_ref*d**2) &
                 *(2.0_rp - 2.0_rp*cos(pi*real(m, rp)/real(n, rp)))
  end function eigenvalue

  !> Mean film losses of each plane of cells along z [1/s].
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

  !> Collective. Detect a box of constant properties on equidistant lines with films on full faces
  !> normal to z.
  subroutine detect_box(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), parameter :: tolerance = 1.0e-9_rp
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
      if (size(mesh%irregular) + size(mesh%void) > 0 .or. .not. heat%property%is_constant &
          .or. f%radiates) worst = 1.0_rp
    end associate
    call heat%world%max(worst)
    self%is_exact = worst(1) <= tolerance
  end subroutine detect_box

  !> Relative spread of the distances of mesh lines.
  pure real(rp) function unevenness(x)
    real(rp), intent(in) :: x(0:)
    real(rp) :: d(ubound(x, 1))

    d = x(1:) - x(:ubound(x, 1) - 1)
    unevenness = maxval(d)/minval(d) - 1.0_rp
  end function unevenness

  !> Collective. Solution z [K] of the box for a right-hand side r [J] of the own cells.
  subroutine apply(self, heat, a, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a                     !! implicit step [s]
    real(rp), intent(in), contiguous :: r(:)
    real(rp), intent(out), contiguous :: z(:)
    complex(rp), allocatable :: columns(:)

    call transform_to_columns(self, heat, r, columns)
    call solve_columns(self, a, self%share%nj, .true., .true., columns)
    call transform_from_columns(self, heat, columns, z)
  end subroutine apply

  !> Collective. Solution z [K] of the box for a right-hand side r [J] and slopes d <= 0 of the
  !> boundary heat flow [W/K], which exceed those of the films in the top plane only.
  subroutine solve(self, heat, a, d, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a                     !! implicit step [s]
    real(rp), intent(in), contiguous :: d(:), r(:)
    real(rp), intent(out), contiguous :: z(:)
    complex(rp), allocatable :: columns(:)
    real(rp), allocatable, dimension(:) :: s, su, t, g  ! top plane; transforms, except s
    integer :: n

    n = self%n(1)*self%n(2)
    allocate (s(n), source=0.0_rp)
    call slopes_on_top(self, heat, a, d, s)
    call heat%world%sum(s)
    if (maxval(s) <= 0.0_rp) then
      call self%apply(heat, a, r, z)
      return
    end if
    call transform_to_columns(self, heat, r, columns)
    call solve_columns(self, a, self%share%nj, .true., .false., columns)
    allocate (t(n), g(n), source=0.0_rp)
    call get_top_plane(self, a, self%share%nj, columns, t, g)
    call heat%world%sum(t)
    call heat%world%sum(g)
    allocate (su(n))
    call self%surface%respond(s, t, g, su)
    call subtract_from_top(self, self%share%nj, g*su, columns)
    call solve_columns(self, a, self%share%nj, .false., .true., columns)
    call transform_from_columns(self, heat, columns, z)
  end subroutine solve

  !> Collective. Divide r by the capacities, transform along y and redistribute to columns along x.
  subroutine transform_to_columns(self, heat, r, columns)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in), contiguous :: r(:)
    complex(rp), allocatable, intent(out) :: columns(:)
    integer :: i, m, np, o

    np = heat%mesh%np
    m = self%share%pairs*self%n(2)
    do i = 1, heat%mesh%nx
      o = (i - 1)*np
      call pack_row_pairs(self%n(3), self%share%pairs, self%n(2), heat%mesh%capacity(o + 1:o &
                          + np), r(o + 1:o + np), self%planes((i - 1)*m + 1))
      call self%along_y%forward(self%share%pairs, self%planes((i - 1)*m + 1), self%work)
      self%planes((i - 1)*m + 1:i*m) = self%work(:m)
    end do
    if (heat%world%size == 1) then               ! planes are columns
      call move_alloc(self%planes, columns)
    else
      call self%share%to_columns(heat%world, self%planes, columns)
    end if
  end subroutine transform_to_columns

  !> Collective. Inverse of `transform_to_columns`, without the capacities.
  subroutine transform_from_columns(self, heat, columns, z)
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
      call self%along_y%backward(self%share%pairs, self%work, self%planes((i - 1)*m + 1))
      call unpack_row_pairs(self%n(3), self%share%pairs, self%n(2), heat%mesh%capacity(o + 1:o &
                            + np), self%planes((i - 1)*m + 1), 0.25_rp/real(self%n(1)*self%n(2), &
                                                                            rp), z(o + 1:o + np))
    end do
  end subroutine transform_from_columns

  !> s = -a d/C - a loss of the top plane, on this rank's part.
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
    where (s <= 1.0e-9_rp*a*self%along_z%loss(self%n(3))) s = 0.0_rp   ! drop rounding
  end subroutine slopes_on_top

  !> Right-hand side of the top plane after elimination, and the response of the plane to heat in
  !> it, on this rank's rows.
  pure subroutine get_top_plane(self, a, nj, columns, t, g)
    class(fft_t), intent(in) :: self
    real(rp), intent(in) :: a                     !! implicit step [s]
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
  end subroutine get_top_plane

  !> Subtract `amount` from the solution in the top plane.
  pure subroutine subtract_from_top(self, nj, amount, columns)
    class(fft_t), intent(in) :: self
    integer, intent(in) :: nj
    real(rp), intent(in) :: amount(self%n(1), self%n(2))
    complex(rp), intent(inout) :: columns(self%share%pairs, nj, self%n(1))
    integer :: i, j

    do i = 1, self%n(1)
      do j = 1, nj
        associate (top => columns(self%share%pairs, j, i))
          top = top - amount(i, self%share%j0 + j) &
                *merge((1.0_rp, 0.0_rp), (0.0_rp, 1.0_rp), mod(self%n(3), 2) == 1)
        end associate
      end do
    end do
  end subroutine subtract_from_top

  !> Pack pairs of cells along z into complex numbers, r over the capacity; 0 outside the solid.
  pure subroutine pack_row_pairs(nz, pairs, ny, capacity, r, x)
    integer, intent(in) :: nz, pairs, ny
    real(rp), intent(in) :: capacity(nz, ny), r(nz, ny)  !! heat capacity [J/K], right-hand side [J]
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
  end subroutine pack_row_pairs

  !> Inverse of `pack_row_pairs`, without the capacity.
  pure subroutine unpack_row_pairs(nz, pairs, ny, capacity, x, factor, z)
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
  end subroutine unpack_row_pairs

  !> For each row of y: transform along x and elimination of the tridiagonal systems along z for
  !> every pair of cosine modes (`eliminates`), back substitution and inverse transform
  !> (`substitutes`).
  subroutine solve_columns(self, a, nj, eliminates, substitutes, columns)
    class(fft_t), intent(in) :: self
    real(rp), intent(in) :: a                     !! implicit step [s]
    integer, intent(in) :: nj
    logical, intent(in) :: eliminates, substitutes
    complex(rp), intent(inout) :: columns(self%share%pairs, nj, self%n(1))
    complex(rp), allocatable :: work(:, :)
    integer :: j

    allocate (work(self%share%pairs, self%n(1)))
    do j = 1, nj
      if (eliminates) then
        call self%along_x%forward(self%share%pairs*nj, columns(1, j, 1), work)
      else
        work = columns(:, j, :)
      end if
      call self%along_z%solve(a, self%lambda_y(self%share%j0 + j), eliminates, substitutes, work)
      if (substitutes) then
        call self%along_x%backward(self%share%pairs*nj, work, columns(1, j, 1))
      else
        columns(:, j, :) = work
      end if
    end do
  end subroutine solve_columns

end module heat_fft
