! SPDX-License-Identifier: MIT
!> Tool shapes with a surface mesh. An extension reads its keys and makes the mesh.
module tools_shape_meshed
  use base_kinds, only: rp
  use tools_mesh, only: surface_mesh_t
  use tools_mesh_drawing, only: list_outline_points, triangulate_surface
  use tools_shape, only: shape_t
  implicit none (type, external)
  private

  public :: meshed_t

  type, abstract, extends(shape_t) :: meshed_t
    type(surface_mesh_t) :: mesh
  contains
    procedure :: distance
    procedure :: distances
    procedure :: lower_bounds
    procedure :: near_distance
    procedure :: bounds
    procedure :: sweep
    procedure :: outline
    procedure :: surface
  end type meshed_t

contains

  pure subroutine distance(self, x, d, normal, edge_distance)
    class(meshed_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, normal(3), edge_distance

    call self%mesh%distance(x, d, normal, edge_distance)
  end subroutine distance

  pure subroutine distances(self, n, x, cutoff, d)
    class(meshed_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff
    real(rp), intent(out) :: d(n)

    call self%mesh%distances(n, x, cutoff, d)
  end subroutine distances

  pure subroutine lower_bounds(self, n, x, cutoff, d)
    class(meshed_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(n, 3), cutoff
    real(rp), intent(out) :: d(n)

    call self%mesh%lower_bounds(n, x, d)
  end subroutine lower_bounds

  pure subroutine near_distance(self, x, cutoff, edge_cutoff, d, normal, edge_distance)
    class(meshed_t), intent(in) :: self
    real(rp), intent(in) :: x(3), cutoff, edge_cutoff
    real(rp), intent(out) :: d, normal(3), edge_distance

    call self%mesh%near_distance(x, cutoff, edge_cutoff, d, normal, edge_distance)
  end subroutine near_distance

  pure subroutine bounds(self, axes, middle, half)
    class(meshed_t), intent(in) :: self
    real(rp), intent(in) :: axes(3, 3)
    real(rp), intent(out) :: middle(3), half(3)

    call self%mesh%bounds(axes, middle, half)
  end subroutine bounds

  pure real(rp) function sweep(self, before, after)
    class(meshed_t), intent(in) :: self
    real(rp), intent(in) :: before(3, 3), after(3, 3)

    sweep = self%mesh%sweep(before, after)
  end function sweep

  subroutine outline(self, x)
    class(meshed_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)

    call list_outline_points(self%mesh%facets, x)
  end subroutine outline

  subroutine surface(self, x, corner)
    class(meshed_t), intent(in) :: self
    real(rp), allocatable, intent(out) :: x(:, :)
    integer, allocatable, intent(out) :: corner(:, :)

    call triangulate_surface(self%mesh%facets, self%mesh%ridges%patch, x, corner)
  end subroutine surface

end module tools_shape_meshed
