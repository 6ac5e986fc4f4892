! SPDX-License-Identifier: MIT
!> Exact solution of an implicit step in a box of constant properties by FFTW: cosine transforms in
!> y and x, in between a redistribution from planes across x to columns along x, and tridiagonal
!> systems with Robin ends in z. For other solids it is a preconditioner: the box around them.
module thermal_fft
  use, intrinsic :: iso_c_binding, only: c_double, c_int, c_loc, c_null_ptr, c_ptr
  use base_kinds, only: pi, rp
  use mpi_f08, only: mpi_alltoallv, mpi_double_precision, mpi_allgather, mpi_integer
  use thermal_rates, only: heat_t
  implicit none (type, external)
  private

  public :: fft_t, has_fft

  logical, parameter :: has_fft = .true.
  integer(c_int), parameter :: dct2 = 5_c_int, dct3 = 4_c_int   !! FFTW_REDFT10, FFTW_REDFT01
  integer(c_int), parameter :: flags = ior(64_c_int, 2_c_int)   !! of FFTW: estimate, unaligned

  interface
    function plan_many(rank, n, howmany, in, inembed, istride, idist, out, onembed, ostride, &
                       odist, kind, flags) bind(c, name='fftw_plan_many_r2r') result(plan)
      import :: c_double, c_int, c_ptr
      implicit none (type, external)
      integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, flags
      integer(c_int), intent(in) :: n(*), inembed(*), onembed(*), kind(*)
      real(c_double), intent(inout) :: in(*)
      type(c_ptr), value :: out
      type(c_ptr) :: plan
    end function plan_many

    subroutine execute(plan, in, out) bind(c, name='fftw_execute_r2r')
      import :: c_double, c_ptr
      implicit none (type, external)
      type(c_ptr), value :: plan
      real(c_double), intent(inout) :: in(*)
      type(c_ptr), value :: out
    end subroutine execute
  end interface

  type :: fft_t
    integer, private :: n(3) = 0
    integer, private :: j0 = 0, nj = 0               !! own rows of y in the columns along x
    integer, allocatable, private :: send(:), receive(:)
    integer, allocatable, private :: j_of(:), nj_of(:), nx_of(:)
    type(c_ptr), private :: y_forth = c_null_ptr, y_back = c_null_ptr, x_forth = c_null_ptr, &
                            x_back = c_null_ptr
    real(rp), allocatable, private :: lambda_x(:), lambda_y(:)   !! [1/s]
    real(rp), allocatable, private :: zm(:), zp(:), loss(:)      !! (nz) [1/s]
    real(rp), allocatable, private :: planes(:), columns(:)
  contains
    procedure :: start
    procedure :: apply
  end type fft_t

contains

  !> Plans, eigenvalues and the redistribution.
  subroutine start(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    integer :: r, ranks, i

    associate (mesh => heat%mesh)
      self%n = mesh%n
      ranks = heat%world%size
      allocate (self%j_of(0:ranks - 1), self%nj_of(0:ranks - 1))
      allocate (self%nx_of(0:ranks - 1))
      do r = 0, ranks - 1
        self%j_of(r) = (self%n(2)*r)/ranks
        self%nj_of(r) = (self%n(2)*(r + 1))/ranks - self%j_of(r)
      end do
      self%j0 = self%j_of(heat%world%rank)
      self%nj = self%nj_of(heat%world%rank)
      call mpi_allgather(mesh%nx, 1, mpi_integer, self%nx_of, 1, mpi_integer, heat%world%comm)
      self%send = self%n(3)*self%nj_of*mesh%nx
      self%receive = self%n(3)*self%nj*self%nx_of
      allocate (self%planes(mesh%np*mesh%nx), self%columns(self%n(3)*self%nj*self%n(1)))
      self%lambda_x = [(eigenvalue(i, self%n(1), mesh%x, heat), i=0, self%n(1) - 1)]
      self%lambda_y = [(eigenvalue(i, self%n(2), mesh%y, heat), i=0, self%n(2) - 1)]
      self%zm = mesh%zm(1:self%n(3))
      self%zp = mesh%zp(1:self%n(3))
      call mean_losses(self, heat)
      if (mesh%nx > 0) then
        self%y_forth = make_plan(self%n(2), self%n(3), self%planes, dct2)
        self%y_back = make_plan(self%n(2), self%n(3), self%planes, dct3)
      end if
      if (self%nj > 0) then
        self%x_forth = make_plan(self%n(1), self%n(3)*self%nj, self%columns, dct2)
        self%x_back = make_plan(self%n(1), self%n(3)*self%nj, self%columns, dct3)
      end if
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
      self%loss = sums/(p%rho*p%c_ref*(mesh%x(self%n(1)) - mesh%x(0))*(mesh%y(self%n(2)) &
                        - mesh%y(0))*(mesh%z(1:) - mesh%z(:self%n(3) - 1)))
    end associate
  end subroutine mean_losses

  !> Transforms of length `n` over `many` interleaved rows.
  type(c_ptr) function make_plan(n, many, work, kind)
    integer, intent(in) :: n, many
    real(rp), intent(inout), target, contiguous :: work(:)
    integer(c_int), intent(in) :: kind
    integer(c_int) :: length(1), kinds(1)

    length = n
    kinds = kind
    make_plan = plan_many(1_c_int, length, int(many, c_int), work, length, int(many, c_int), &
                          1_c_int, address(work), length, int(many, c_int), 1_c_int, kinds, flags)
  end function make_plan

  type(c_ptr) function address(work)
    real(rp), intent(in), target, contiguous :: work(:)

    address = c_loc(work)
  end function address

  !> Collective: z solves the box with right-hand side r [J], both of own cells.
  subroutine apply(self, heat, a, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, r(:)               !! [s]
    real(rp), intent(out) :: z(:)
    integer :: i, np

    np = heat%mesh%np
    self%planes = 0.0_rp
    where (heat%mesh%capacity > 0.0_rp) self%planes = r/heat%mesh%capacity
    do i = 1, heat%mesh%nx
      call transform(self%y_forth, self%planes((i - 1)*np + 1:i*np))
    end do
    call to_columns(self, heat)
    if (self%nj > 0) call transform(self%x_forth, self%columns)
    call solve_columns(self, a, self%n(3), self%nj, self%columns)
    if (self%nj > 0) call transform(self%x_back, self%columns)
    call to_planes(self, heat)
    do i = 1, heat%mesh%nx
      call transform(self%y_back, self%planes((i - 1)*np + 1:i*np))
    end do
    z = self%planes/(4.0_rp*real(self%n(1)*self%n(2), rp))
    where (heat%mesh%capacity <= 0.0_rp) z = 0.0_rp
  end subroutine apply

  subroutine transform(plan, work)
    type(c_ptr), intent(in) :: plan
    real(rp), intent(inout), target, contiguous :: work(:)

    call execute(plan, work, address(work))
  end subroutine transform

  !> Planes (z, y, own x) to columns (z, own y, x).
  subroutine to_columns(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), allocatable :: packed(:)
    integer :: at, i, m, np, o, r

    np = heat%mesh%np
    allocate (packed(size(self%planes)))
    at = 0
    do r = 0, heat%world%size - 1
      m = self%n(3)*self%nj_of(r)
      do i = 1, heat%mesh%nx
        o = (i - 1)*np + self%n(3)*self%j_of(r)
        packed(at + 1:at + m) = self%planes(o + 1:o + m)
        at = at + m
      end do
    end do
    call mpi_alltoallv(packed, self%send, offsets(self%send), mpi_double_precision, self%columns, &
                       self%receive, offsets(self%receive), mpi_double_precision, heat%world%comm)
  end subroutine to_columns

  subroutine to_planes(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), allocatable :: packed(:)
    integer :: at, i, m, np, o, r

    np = heat%mesh%np
    allocate (packed(size(self%planes)))
    call mpi_alltoallv(self%columns, self%receive, offsets(self%receive), mpi_double_precision, &
                       packed, self%send, offsets(self%send), mpi_double_precision, heat%world%comm)
    at = 0
    do r = 0, heat%world%size - 1
      m = self%n(3)*self%nj_of(r)
      do i = 1, heat%mesh%nx
        o = (i - 1)*np + self%n(3)*self%j_of(r)
        self%planes(o + 1:o + m) = packed(at + 1:at + m)
        at = at + m
      end do
    end do
  end subroutine to_planes

  !> Where each rank's part begins, from 0.
  pure function offsets(counts)
    integer, intent(in) :: counts(:)
    integer :: offsets(size(counts)), r

    offsets = [(sum(counts(:r - 1)), r=1, size(counts))]
  end function offsets

  !> Tridiagonal systems along z, one for every pair of cosines.
  pure subroutine solve_columns(self, a, nz, nj, w)
    class(fft_t), intent(in) :: self
    real(rp), intent(in) :: a
    integer, intent(in) :: nz, nj
    real(rp), intent(inout) :: w(nz, nj, self%n(1))
    real(rp) :: before, d, f, up(nz), up_before
    integer :: i, j, k

    do i = 1, self%n(1)
      do j = 1, nj
        before = 0.0_rp
        up_before = 0.0_rp
        do k = 1, nz
          f = 1.0_rp + a*(self%lambda_x(i) + self%lambda_y(self%j0 + j) + self%zm(k) + self%zp(k) &
                          + self%loss(k))
          d = 1.0_rp/(f - a*self%zm(k)*up_before)
          before = (w(k, j, i) + a*self%zm(k)*before)*d
          up_before = a*self%zp(k)*d
          w(k, j, i) = before
          up(k) = up_before
        end do
        do k = nz - 1, 1, -1
          w(k, j, i) = w(k, j, i) + up(k)*w(k + 1, j, i)
        end do
      end do
    end do
  end subroutine solve_columns

end module thermal_fft
