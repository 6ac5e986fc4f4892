! SPDX-License-Identifier: MIT
!> Cosine transforms of many rows by complex transforms of FFTW: even entries first, odd ones last
!> in reverse order (Makhoul 1980, IEEE Trans. ASSP 28, 27), then Y_k = w_k V_k + conj(w_k) V_n-k
!> with w_k = exp(-i pi k/(2 n)). Pairs of real rows are the real and imaginary parts of complex
!> rows.
module heat_cosine
  use, intrinsic :: iso_c_binding, only: c_double_complex, c_int, c_loc, c_null_ptr, c_ptr
  use base_kinds, only: pi, rp
  implicit none (type, external)
  private

  public :: cosine_t

  integer(c_int), parameter :: forwards = -1_c_int, backwards = 1_c_int
  !> FFTW_ESTIMATE, so that every run has the same plan, and FFTW_UNALIGNED.
  integer(c_int), parameter :: flags = ior(64_c_int, 2_c_int)

  interface
    function plan_many(rank, n, howmany, in, inembed, istride, idist, out, onembed, ostride, &
                       odist, sign, flags) bind(c, name='fftw_plan_many_dft') result(plan)
      import :: c_double_complex, c_int, c_ptr
      implicit none (type, external)
      integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, sign, flags
      integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
      complex(c_double_complex), intent(inout) :: in(*)
      type(c_ptr), value :: out
      type(c_ptr) :: plan
    end function plan_many

    subroutine execute(plan, in, out) bind(c, name='fftw_execute_dft')
      import :: c_double_complex, c_ptr
      implicit none (type, external)
      type(c_ptr), value :: plan
      complex(c_double_complex), intent(inout) :: in(*)
      type(c_ptr), value :: out
    end subroutine execute
  end interface

  !> Cosine transforms of length n of `rows` interleaved complex rows.
  type :: cosine_t
    integer, private :: n = 0, rows = 0
    type(c_ptr), private :: forward_plan = c_null_ptr, backward_plan = c_null_ptr
    complex(rp), allocatable, private :: twiddle(:)   !! (n) twiddle factors w_k, from k = 1
  contains
    procedure :: init, forward, backward
    procedure, private :: source_index
  end type cosine_t

contains

  !> Make the plans and the twiddle factors.
  subroutine init(self, n, rows)
    class(cosine_t), intent(inout) :: self
    integer, intent(in) :: n, rows
    integer :: k

    self%n = n
    self%rows = rows
    self%twiddle = [(exp(cmplx(0.0_rp, -0.5_rp*pi*real(k, rp)/real(n, rp), rp)), k=1, n)]
    self%forward_plan = make_plan(n, rows, forwards)
    self%backward_plan = make_plan(n, rows, backwards)
  end subroutine init

  !> FFTW plan for in-place transforms of interleaved rows.
  type(c_ptr) function make_plan(n, rows, sign)
    integer, intent(in) :: n, rows
    integer(c_int), intent(in) :: sign
    complex(rp) :: work(rows, n)
    integer(c_int) :: length(1), m

    length = n
    m = int(rows, c_int)
    make_plan = plan_many(1_c_int, length, m, work, length, m, 1_c_int, address(work), length, m, &
                          1_c_int, sign, flags)
  end function make_plan

  !> Address of an array for FFTW.
  type(c_ptr) function address(work)
    complex(rp), intent(in), target, contiguous :: work(:, :)

    address = c_loc(work)
  end function address

  !> Execute a plan in place.
  subroutine transform(plan, work)
    type(c_ptr), intent(in) :: plan
    complex(rp), intent(inout), target, contiguous :: work(:, :)

    call execute(plan, work, address(work))
  end subroutine transform

  !> Index in natural order of entry `q` in the order of the transform, both from 1.
  pure integer function source_index(self, q)
    class(cosine_t), intent(in) :: self
    integer, intent(in) :: q

    source_index = 2*q - 1
    if (source_index > self%n) source_index = 2*(self%n + 1 - q)
  end function source_index

  !> Forward transform Y_k = 2 sum x_j cos(pi (j + 1/2) k/n), j and k from 0; the entries of x are
  !> `stride` apart.
  subroutine forward(self, stride, x, y)
    class(cosine_t), intent(in) :: self
    integer, intent(in) :: stride
    complex(rp), intent(in) :: x(stride*(self%n - 1) + self%rows)
    complex(rp), intent(inout) :: y(self%rows, 0:self%n - 1)
    complex(rp) :: a, b
    integer :: j, k, o, q

    do q = 1, self%n
      o = stride*(self%source_index(q) - 1)
      y(:, q - 1) = x(o + 1:o + self%rows)
    end do
    call transform(self%forward_plan, y)
    y(:, 0) = 2.0_rp*y(:, 0)
    do k = 1, self%n/2
      o = self%n - k
      do j = 1, self%rows
        a = self%twiddle(k)*y(j, k)
        b = conjg(self%twiddle(k))*y(j, o)
        y(j, o) = cmplx(b%im - a%im, a%re - b%re, rp)   ! i (a - b)
        y(j, k) = a + b
      end do
    end do
  end subroutine forward

  !> Backward transform: x is 2 n times the input of `forward`; y is overwritten.
  subroutine backward(self, stride, y, x)
    class(cosine_t), intent(in) :: self
    integer, intent(in) :: stride
    complex(rp), intent(inout) :: y(self%rows, 0:self%n - 1)
    complex(rp), intent(inout) :: x(stride*(self%n - 1) + self%rows)
    complex(rp) :: a, b
    integer :: j, k, o, q

    do k = 1, self%n/2
      o = self%n - k
      do j = 1, self%rows
        a = y(j, k)
        b = y(j, o)
        y(j, o) = self%twiddle(k)*cmplx(a%re - b%im, a%im + b%re, rp)       ! a + i b
        y(j, k) = conjg(self%twiddle(k))*cmplx(a%re + b%im, a%im - b%re, rp)  ! a - i b
      end do
    end do
    call transform(self%backward_plan, y)
    do q = 1, self%n
      o = stride*(self%source_index(q) - 1)
      x(o + 1:o + self%rows) = y(:, q - 1)
    end do
  end subroutine backward

end module heat_cosine
