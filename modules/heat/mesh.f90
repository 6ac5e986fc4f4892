! SPDX-License-Identifier: MIT
!> Finite-volume mesh for conduction in a solid: rectilinear, with lines on the plane faces of the
!> solid. Cells are stored by planes normal to x, z fastest; a rank owns consecutive planes. The
!> geometry of the solid is set by `heat_cut_mesh`.
module heat_mesh
  use base_kinds, only: i8, rp
  use base_world, only: world_t
  implicit none (type, external)
  private

  public :: heat_mesh_t, boundary_face_t, lay_lines

  !> A face of a cell, or part of one, on the surface of the solid.
  type :: boundary_face_t
    integer :: cell = 0                    !! cell that it belongs to
    integer :: body = 1, face = 1          !! face 1..6: direction of its normal
    real(rp) :: area = 0.0_rp              !! [m2]
    real(rp) :: depth = 0.0_rp             !! distance of the cell centre from the face [m]
    integer :: at(3) = 0                   !! indices of the cell in which it lies
  end type boundary_face_t

  !> Mesh of a solid. Rates are conductances over capacities [1/s]; own cells are numbered from 1.
  type :: heat_mesh_t
    real(rp), allocatable :: x(:), y(:), z(:)     !! mesh lines, from 0 [m]
    integer :: n(3) = 0                           !! cells along each axis
    integer :: lo = 1, hi = 0                     !! first and last own plane
    integer :: nx = 0, np = 0                     !! number of own planes, cells of a plane
    integer :: before = -1, after = -1            !! ranks of the planes lo-1 and hi+1; -1: none
    real(rp), allocatable :: xm(:), xp(:)         !! (nx) rates to the previous and next plane
    !> Rates to the cells before and behind along y and z [1/s].
    real(rp), allocatable, dimension(:) :: ym, yp, zm, zp
    real(rp), allocatable :: capacity(:)          !! (np nx) [J/K]; 0: not in the solid
    real(rp) :: volume = 0.0_rp                   !! volume of the own cells [m3]
    integer, allocatable :: void(:)               !! cells that are not in the solid
    integer, allocatable :: irregular(:)          !! cells whose rates are not those of uncut cells
    !> Rates of the irregular cells to their six neighbours [1/s].
    real(rp), allocatable :: irregular_rate(:, :)
    integer, allocatable :: body(:)               !! (np nx) body of each cell
    type(boundary_face_t), allocatable :: wall(:)   !! boundary faces of the own cells
  contains
    procedure :: init, plane_owner, centre, box, place, all_rates, swap
  end type heat_mesh_t

contains

  !> Mesh lines about `h` apart that include all `planes`, except those that would make cells below
  !> h/2. The first two planes are the ends.
  pure subroutine lay_lines(h, planes, lines)
    real(rp), intent(in) :: h, planes(:)              !! cell edge, positions of plane faces [m]
    real(rp), allocatable, intent(out) :: lines(:)
    real(rp) :: fixed(size(planes)), p
    integer :: i, j, m, n, n_cells, k

    n = 2
    fixed(1:2) = [minval(planes(1:2)), maxval(planes(1:2))]
    do i = 3, size(planes)
      p = planes(i)
      if (any(abs(fixed(:n) - p) < 0.5_rp*h) .or. p < fixed(1) .or. p > fixed(n)) cycle
      j = count(fixed(:n) < p)
      fixed(j + 2:n + 1) = fixed(j + 1:n)
      fixed(j + 1) = p
      n = n + 1
    end do
    n_cells = sum([(max(1, nint((fixed(i + 1) - fixed(i))/h)), i=1, n - 1)])
    allocate (lines(0:n_cells))
    k = 0
    lines(0) = fixed(1)
    do i = 1, n - 1
      m = max(1, nint((fixed(i + 1) - fixed(i))/h))
      do j = 1, m
        lines(k + j) = fixed(i) + (fixed(i + 1) - fixed(i))*real(j, rp)/real(m, rp)
      end do
      k = k + m
      lines(k) = fixed(i + 1)
    end do
  end subroutine lay_lines

  !> Initialize the mesh on given lines, and the planes of this rank.
  subroutine init(self, world, x, y, z)
    class(heat_mesh_t), intent(out) :: self
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: x(0:), y(0:), z(0:)

    allocate (self%x(0:ubound(x, 1)), self%y(0:ubound(y, 1)), self%z(0:ubound(z, 1)))
    self%x = x
    self%y = y
    self%z = z
    self%n = [ubound(x, 1), ubound(y, 1), ubound(z, 1)]
    self%lo = first_plane(self%n(1), world%rank, world%size)
    self%hi = first_plane(self%n(1), world%rank + 1, world%size) - 1
    self%nx = self%hi - self%lo + 1
    self%np = self%n(2)*self%n(3)
    if (self%nx > 0) then
      self%before = self%plane_owner(self%lo - 1, world%size)
      self%after = self%plane_owner(self%hi + 1, world%size)
    end if
  end subroutine init

  !> First plane of a rank of `n` planes.
  pure integer function first_plane(n, rank, ranks)
    integer, intent(in) :: n, rank, ranks

    first_plane = 1 + int(int(n, i8)*rank/ranks)
  end function first_plane

  !> Rank that owns a plane; -1 beyond the ends.
  pure integer function plane_owner(self, plane, ranks)
    class(heat_mesh_t), intent(in) :: self
    integer, intent(in) :: plane, ranks

    do plane_owner = ranks - 1, 0, -1
      if (plane > self%n(1)) cycle
      if (first_plane(self%n(1), plane_owner, ranks) <= plane .and. &
          first_plane(self%n(1), plane_owner + 1, ranks) > plane) exit
    end do
  end function plane_owner

  !> Lower and upper corner of cell (i, j, k) [m].
  pure function box(self, i, j, k)
    class(heat_mesh_t), intent(in) :: self
    integer, intent(in) :: i, j, k
    real(rp) :: box(3, 2)

    box(:, 1) = [self%x(i - 1), self%y(j - 1), self%z(k - 1)]
    box(:, 2) = [self%x(i), self%y(j), self%z(k)]
  end function box

  !> Centre of own cell `c` [m].
  pure function centre(self, c) result(x)
    class(heat_mesh_t), intent(in) :: self
    integer, intent(in) :: c
    real(rp) :: x(3)
    integer :: i, j, k

    call place(self, c, i, j, k)
    x = 0.5_rp*sum(self%box(i, j, k), dim=2)
  end function centre

  !> Indices of own cell `c`.
  pure subroutine place(self, c, i, j, k)
    class(heat_mesh_t), intent(in) :: self
    integer, intent(in) :: c
    integer, intent(out) :: i, j, k

    i = self%lo + (c - 1)/self%np
    j = 1 + mod(c - 1, self%np)/self%n(3)
    k = 1 + mod(c - 1, self%n(3))
  end subroutine place

  !> Rates of every own cell to its six neighbours [1/s]: xmin, xmax, ymin, ymax, zmin, zmax.
  pure subroutine all_rates(self, rate)
    class(heat_mesh_t), intent(in) :: self
    real(rp), intent(out) :: rate(6, self%np*self%nx)
    integer :: c, i, p

    do c = 1, self%np*self%nx
      i = 1 + (c - 1)/self%np
      p = 1 + mod(c - 1, self%np)
      rate(:, c) = [self%xm(i), self%xp(i), self%ym(p), self%yp(p), self%zm(p), self%zp(p)]
      if (self%capacity(c) <= 0.0_rp) rate(:, c) = 0.0_rp
    end do
    rate(:, self%irregular) = self%irregular_rate
  end subroutine all_rates

  !> Collective. Fill the halo planes of a field (1-np:np(nx+1)) from the neighbouring ranks.
  subroutine swap(self, world, field)
    class(heat_mesh_t), intent(in) :: self
    type(world_t), intent(in) :: world
    real(rp), intent(inout) :: field(1 - self%np:self%np*(self%nx + 1))
    integer :: n

    if (world%size == 1 .or. self%nx == 0) return
    n = self%np*self%nx
    call world%swap(self%before, self%after, field(1:self%np), field(n - self%np + 1:n), &
                    field(1 - self%np:0), field(n + 1:n + self%np))
  end subroutine swap

end module heat_mesh
