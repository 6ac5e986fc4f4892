! SPDX-License-Identifier: MIT
!> Top plane of cells of a box in an implicit step with a temperature-dependent heat source: u + G
!> (s u) = t, with the solution t of the box without this dependence, the response s >= 0 of the
!> source to temperature, and the response G of the plane to heat in it, which is diagonal in cosine
!> modes. Every rank solves the whole plane.
module heat_surface
  use base_kinds, only: rp
  use heat_cosine, only: cosine_t
  implicit none (type, external)
  private

  public :: surface_t

  !> Relative residual at which the iteration has converged.
  real(rp), parameter :: relative = 1.0e-8_rp
  integer, parameter :: max_iterations = 500

  !> Transforms of the plane.
  type :: surface_t
    integer, private :: nx = 0, ny = 0
    type(cosine_t), private :: along_x, along_y
  contains
    procedure :: init, respond, spectrum, field
  end type surface_t

contains

  !> Initialize the transforms.
  subroutine init(self, nx, ny)
    class(surface_t), intent(inout) :: self
    integer, intent(in) :: nx, ny

    self%nx = nx
    self%ny = ny
    call self%along_x%init(nx, (ny + 1)/2)
    call self%along_y%init(ny, (nx + 1)/2)
  end subroutine init

  !> Cosine transform of a plane.
  subroutine spectrum(self, u, v)
    class(surface_t), intent(in) :: self
    real(rp), intent(in) :: u(self%ny, self%nx)
    real(rp), intent(out) :: v(self%nx, self%ny)
    real(rp) :: w(self%ny, self%nx)

    w = u
    call transform_rows(self%along_x, self%ny, self%nx, .true., w)
    v = transpose(w)
    call transform_rows(self%along_y, self%nx, self%ny, .true., v)
  end subroutine spectrum

  !> Inverse cosine transform of a plane.
  subroutine field(self, v, u)
    class(surface_t), intent(in) :: self
    real(rp), intent(in) :: v(self%nx, self%ny)
    real(rp), intent(out) :: u(self%ny, self%nx)
    real(rp) :: w(self%nx, self%ny)

    w = v
    call transform_rows(self%along_y, self%nx, self%ny, .false., w)
    u = transpose(w)
    call transform_rows(self%along_x, self%ny, self%nx, .false., u)
    u = u*(0.25_rp/(real(self%nx, rp)*real(self%ny, rp)))
  end subroutine field

  !> Transform of w(rows, n) along its second dimension.
  subroutine transform_rows(cosine, rows, n, is_forward, w)
    type(cosine_t), intent(in) :: cosine
    integer, intent(in) :: rows, n
    logical, intent(in) :: is_forward
    real(rp), intent(inout) :: w(rows, n)
    complex(rp) :: x((rows + 1)/2, n), y((rows + 1)/2, n)
    integer :: m

    m = rows/2
    x(:m, :) = cmplx(w(1:2*m:2, :), w(2:2*m:2, :), rp)
    if (2*m < rows) x(m + 1, :) = cmplx(w(rows, :), 0.0_rp, rp)
    if (is_forward) then
      call cosine%forward(size(x, 1), x, y)
    else
      call cosine%backward(size(x, 1), x, y)
    end if
    w(1:2*m:2, :) = y(:m, :)%re
    w(2:2*m:2, :) = y(:m, :)%im
    if (2*m < rows) w(rows, :) = y(m + 1, :)%re
  end subroutine transform_rows

  !> Solve for the transform of s u from the transforms of t and G, by conjugate gradients on
  !> (1 + sqrt(s) G sqrt(s)) v = sqrt(s) t.
  subroutine respond(self, s, t, g, su)
    class(surface_t), intent(in) :: self
    real(rp), intent(in) :: s(self%ny, self%nx), t(self%nx, self%ny), g(self%nx, self%ny)
    real(rp), intent(out) :: su(self%nx, self%ny)
    real(rp), dimension(self%ny, self%nx) :: root, p, q, r, v
    real(rp) :: rr, before, first, alpha
    integer :: i

    root = sqrt(s)
    call self%field(t, r)
    r = root*r
    v = 0.0_rp
    p = 0.0_rp
    first = sum(r**2)
    before = 1.0_rp
    rr = first
    do i = 1, max_iterations
      if (rr <= relative**2*first) exit
      p = r + (rr/before)*p
      before = rr
      call self%spectrum(root*p, su)
      su = g*su
      call self%field(su, q)
      q = p + root*q
      alpha = rr/sum(p*q)
      v = v + alpha*p
      r = r - alpha*q
      rr = sum(r**2)
    end do
    call self%spectrum(root*v, su)
  end subroutine respond

end module heat_surface
