! SPDX-License-Identifier: MIT
!> Tool shape: a sphere.
module tools_shape_sphere
  use base_kinds, only: pi, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape, only: add_radius, add_tilt, far_larger, no_edge, shape_t, tilted_frame
  implicit none (type, external)
  private

  public :: sphere_t

  type, extends(shape_t) :: sphere_t
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, check_size, distance, distances, bounds, sweep, outline, surface
  end type sphere_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call add_radius(t, 'sphere')
    call add_tilt(t, 'sphere')
  end subroutine add_keys

  subroutine read_keys(self, input, i, frame)
    class(sphere_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(out) :: frame(3, 3)

    self%radius = input%real('TOOL', i, 'RADIUS')
    frame = tilted_frame(input, i)
  end subroutine read_keys

  subroutine check_size(self, input, i, grid, cell, width, spins)
    class(sphere_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: grid, cell(3), width
    logical, intent(in) :: spins

    if (self%radius > 100.0_rp*grid) then
      call input%warn('TOOL', i, 'RADIUS', far_larger(grid))
    end if
  end subroutine check_size

  !> Distance from the sphere, which has no edges.
  pure subroutine distance(self, x, d, normal, edge_distance)
    class(sphere_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), edge_distance

    d = norm2(x)
    normal = x/max(d, tiny(1.0_rp))
    d = d - self%radius
    edge_distance = no_edge
  end subroutine distance

  pure subroutine distances(self, n, x, cutoff, d)
    class(sphere_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff
    real(rp), intent(out) :: d(n)

    d = sqrt(x(:, 1)**2 + x(:, 2)**2 + x(:, 3)**2) - self%radius
  end subroutine distances

  pure subroutine bounds(self, axes, middle, half)
    class(sphere_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)

    middle = 0.0_rp
    half = self%radius
  end subroutine bounds

  pure real(rp) function sweep(self, before, after)
    class(sphere_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)

    sweep = 0.0_rp
  end function sweep

  !> Rings of points from pole to pole.
  subroutine outline(self, x)
    class(sphere_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, parameter :: turns = 24, rings = 12
    real(rp) :: a, s
    integer :: p

    allocate (x(3, turns*(rings + 1)))
    do p = 1, size(x, 2)
      a = 2.0_rp*pi*mod(p, turns)/turns
      s = pi*((p - 1)/turns)/rings
      x(:, p) = self%radius*[sin(s)*cos(a), sin(s)*sin(a), cos(s)]
    end do
  end subroutine outline

  !> Rings of points from pole to pole, with triangles between them.
  subroutine surface(self, x, corner)
    class(sphere_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, allocatable, intent(out) :: corner(:, :)
    integer, parameter :: turns = 72, rings = 36
    real(rp) :: a, s
    integer :: c, k, next, p

    allocate (x(3, turns*(rings + 1)), corner(3, 2*turns*rings))
    do k = 0, rings
      do c = 1, turns
        a = 2.0_rp*pi*c/turns
        s = pi*k/rings
        p = turns*k + c
        x(:, p) = self%radius*[sin(s)*cos(a), sin(s)*sin(a), cos(s)]
        if (k == rings) cycle
        next = turns*k + modulo(c, turns) + 1
        corner(:, 2*p - 1) = [p, p + turns, next]
        corner(:, 2*p) = [next, p + turns, next + turns]
      end do
    end do
  end subroutine surface

end module tools_shape_sphere
