! SPDX-License-Identifier: MIT
!> Tool shape: a rigid half space, with its normal along the last axis.
module tools_shape_plane
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape, only: no_edge, shape_t
  implicit none (type, external)
  private

  public :: plane_t

  type, extends(shape_t) :: plane_t
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, distance, distances, bounds, sweep
  end type plane_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('NORMAL', 'real', 3, '', '0 0 1 if KIND = plane', '', &
               'plane: direction out of the rigid half space')
  end subroutine add_keys

  !> Read the normal, which is the last axis.
  subroutine read_keys(self, input, i, frame)
    class(plane_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(out) :: frame(3, 3)
    real(rp) :: normal(3), side(3)

    normal = input%reals('TOOL', i, 'NORMAL', 3)
    if (norm2(normal) <= 0.0_rp) then
      call input%report('TOOL', i, 'NORMAL', 'must not be zero')
      normal = [0.0_rp, 0.0_rp, 1.0_rp]
    end if
    normal = normal/norm2(normal)
    side = merge([0.0_rp, 1.0_rp, 0.0_rp], [1.0_rp, 0.0_rp, 0.0_rp], abs(normal(1)) > 0.9_rp)
    side = side - dot_product(side, normal)*normal
    side = side/norm2(side)
    frame(:, 1) = side
    frame(:, 2) = [normal(2)*side(3) - normal(3)*side(2), &
                   normal(3)*side(1) - normal(1)*side(3), &
                   normal(1)*side(2) - normal(2)*side(1)]
    frame(:, 3) = normal
  end subroutine read_keys

  !> Distance from the plane, which has no edges.
  pure subroutine distance(self, x, d, normal, edge_distance)
    class(plane_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), edge_distance

    d = x(3)
    normal = [0.0_rp, 0.0_rp, 1.0_rp]
    edge_distance = no_edge
  end subroutine distance

  pure subroutine distances(self, n, x, cutoff, d)
    class(plane_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff
    real(rp), intent(out) :: d(n)

    d = x(:, 3)
  end subroutine distances

  !> Infinite box.
  pure subroutine bounds(self, axes, middle, half)
    class(plane_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)

    middle = 0.0_rp
    half = huge(1.0_rp)
  end subroutine bounds

  pure real(rp) function sweep(self, before, after)
    class(plane_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)

    sweep = 0.0_rp
  end function sweep

end module tools_shape_plane
