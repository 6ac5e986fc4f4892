! SPDX-License-Identifier: MIT
!> Tool shape: a box centred at the tool's position.
module tools_shape_box
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape, only: add_tilt, far_larger, shape_t, tilted_frame
  implicit none (type, external)
  private

  public :: box_shape_t

  type, extends(shape_t) :: box_shape_t
    real(rp) :: half(3) = 0.0_rp       !! half edges [m]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, check_size, distance, distances, bounds, sweep, outline, surface
  end type box_shape_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('SIZE', 'real', 3, 'm', 'required if KIND = box', '(0,inf)', &
               'edge lengths of the box')
    call add_tilt(t, 'box')
  end subroutine add_keys

  subroutine read_keys(self, input, i, frame)
    class(box_shape_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(out) :: frame(3, 3)

    self%half = 0.5_rp*input%reals('TOOL', i, 'SIZE', 3)
    frame = tilted_frame(input, i)
  end subroutine read_keys

  subroutine check_size(self, input, i, grid, cell, width, spins)
    class(box_shape_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: grid, cell(3), width
    logical, intent(in) :: spins

    if (maxval(self%half) > 10.0_rp*grid) then
      call input%warn('TOOL', i, 'SIZE', far_larger(grid))
    end if
  end subroutine check_size

  pure subroutine distance(self, x, d, normal, edge_distance)
    class(box_shape_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), edge_distance
    real(rp) :: q(3), outside(3)
    integer :: a

    q = abs(x) - self%half
    normal = 0.0_rp
    if (any(q > 0.0_rp)) then
      outside = max(q, 0.0_rp)
      d = norm2(outside)
      normal = sign(outside/d, x)
    else
      a = maxloc(q, 1)
      d = q(a)
      normal(a) = sign(1.0_rp, x(a))
    end if
    a = maxloc(q, 1)
    q(a) = -huge(1.0_rp)
    edge_distance = -maxval(q)
  end subroutine distance

  pure subroutine distances(self, n, x, cutoff, d)
    class(box_shape_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff
    real(rp), intent(out) :: d(n)
    real(rp) :: q(3)
    integer :: p

    do p = 1, n
      q = abs(x(p, :)) - self%half
      d(p) = norm2(max(q, 0.0_rp)) + min(maxval(q), 0.0_rp)
    end do
  end subroutine distances

  pure subroutine bounds(self, axes, middle, half)
    class(box_shape_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)

    middle = 0.0_rp
    half = matmul(abs(axes), self%half)
  end subroutine bounds

  !> Upper bound of the approach: distance of the corners from the axis times the change of the axes
  !> [m].
  pure real(rp) function sweep(self, before, after)
    class(box_shape_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)

    sweep = norm2(after - before)*norm2(self%half)
  end function sweep

  !> A lattice of points in the box and on its faces.
  subroutine outline(self, x)
    class(box_shape_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, parameter :: parts = 6
    integer :: p

    allocate (x(3, (parts + 1)**3))
    do p = 0, size(x, 2) - 1
      x(:, p + 1) = self%half*(2.0_rp*[mod(p, parts + 1), mod(p/(parts + 1), parts + 1), &
                                       p/(parts + 1)**2]/parts - 1.0_rp)
    end do
  end subroutine outline

  !> Two triangles per face, with separate corners for each face.
  subroutine surface(self, x, corner)
    class(box_shape_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, allocatable, intent(out) :: corner(:, :)
    real(rp) :: along(3), across(3), out(3)
    integer :: a, f, p

    allocate (x(3, 24), corner(3, 12))
    do f = 0, 5
      a = f/2
      out = 0.0_rp
      along = 0.0_rp
      across = 0.0_rp
      out(a + 1) = merge(1.0_rp, -1.0_rp, mod(f, 2) == 0)
      along(modulo(a + 1, 3) + 1) = out(a + 1)
      across(modulo(a + 2, 3) + 1) = 1.0_rp
      p = 4*f
      x(:, p + 1) = self%half*(out - along - across)
      x(:, p + 2) = self%half*(out + along - across)
      x(:, p + 3) = self%half*(out + along + across)
      x(:, p + 4) = self%half*(out - along + across)
      corner(:, 2*f + 1) = p + [1, 2, 3]
      corner(:, 2*f + 2) = p + [1, 3, 4]
    end do
  end subroutine surface

end module tools_shape_box
