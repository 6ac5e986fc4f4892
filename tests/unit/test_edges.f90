! SPDX-License-Identifier: MIT
!> Distances to the edges of shoulders with pins, built from places on their outlines; boxes around
!> meshes.
program test_edges
  use base_kinds, only: pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use tools_mesh, only: surface_mesh_t
  use tools_mesh_drawing, only: triangulate_surface
  use tools_shape, only: no_edge
  use tools_shape_cuts, only: cut_pin_shape_t, make_mesh
  use tools_shape_shoulder, only: new_shoulder, shoulder_t
  implicit none (type, external)

  real(rp), parameter :: off = 1.0e-5_rp       !! distance of places from the outline [m]
  type(shoulder_t) :: tool

  call begin_tests()
  call random_init(.true., .false.)
  call test_shoulders()
  call test_boxes()
  call end_tests()

contains

  real(rp) function random(from, to)
    real(rp), intent(in) :: from, to

    call random_number(random)
    random = from + random*(to - from)
  end function random

  !> Points just outside a side at a part of its length: the way to its ends over 2 sin^2(a/2), a
  !> being the angle by which the outline turns there, at most a right one. Points out of a corner:
  !> how far they are beyond both sides.
  subroutine test_shoulders()
    real(rp) :: away(2), part, place(2), room(2), sides(2, 2), want, weight(2)
    integer :: c, draw, i

    room = 0.0_rp
    do draw = 1, 50
      tool = new_shoulder(random(8.0e-3_rp, 12.0e-3_rp), 20.0e-3_rp, random(0.0_rp, 0.3_rp), &
                          random(3.0e-3_rp, 4.0e-3_rp), random(1.0e-3_rp, 3.0e-3_rp), &
                          random(4.0e-3_rp, 7.0e-3_rp))
      associate (r => tool%profile%r, z => tool%profile%z, n => tool%profile%n)
        do i = 1, n - 1
          sides(:, 1) = [r(i + 1) - r(i), z(i + 1) - z(i)]
          part = random(0.1_rp, 0.9_rp)
          place = [r(i), z(i)] + part*sides(:, 1)
          away = outward(sides(:, 1))
          want = min(no_edge, part*norm2(sides(:, 1))/sharpness(i), &
                     (1.0_rp - part)*norm2(sides(:, 1))/sharpness(i + 1))
          call compare(place, off*away, want, room(1))
        end do
        do c = 2, n - 1
          if (turn(c) >= 0.0_rp) cycle
          sides(:, 1) = [r(c) - r(c - 1), z(c) - z(c - 1)]
          sides(:, 2) = [r(c + 1) - r(c), z(c + 1) - z(c)]
          weight = [random(0.1_rp, 1.0_rp), random(0.1_rp, 1.0_rp)]
          away = off*(weight(1)*outward(sides(:, 1)) + weight(2)*outward(sides(:, 2)))
          want = -max(0.0_rp, min(dot_product(away, sides(:, 1))/norm2(sides(:, 1)), &
                                  -dot_product(away, sides(:, 2))/norm2(sides(:, 2))))
          call compare([r(c), z(c)], away, want, room(2))
        end do
      end associate
    end do
    call expect_close('way to edges along sides', room(1), 0.0_rp, atol=1.0e-9_rp)
    call expect_close('way beyond edges', room(2), 0.0_rp, atol=1.0e-12_rp)
  end subroutine test_shoulders

  !> Angle by which the outline turns at a corner, below 0 at convex ones.
  real(rp) function turn(c)
    integer, intent(in) :: c

    associate (r => tool%profile%r, z => tool%profile%z)
      turn = modulo(atan2(z(c + 1) - z(c), r(c + 1) - r(c)) - atan2(z(c) - z(c - 1), r(c) &
                    - r(c - 1)) + pi, 2.0_rp*pi) - pi
    end associate
  end function turn

  real(rp) function sharpness(c)
    integer, intent(in) :: c

    sharpness = tiny(1.0_rp)/epsilon(1.0_rp)
    if (c == 1 .or. c == tool%profile%n) return
    if (turn(c) < 0.0_rp) sharpness = min(1.0_rp, 2.0_rp*sin(0.5_rp*turn(c))**2)
  end function sharpness

  !> The unit normal of a side out of the body on its right.
  pure function outward(side) result(n)
    real(rp), intent(in) :: side(2)
    real(rp) :: n(2)

    n = [-side(2), side(1)]/norm2(side)
  end function outward

  !> Distance, normal and way to the edge of `place` + `away`, turned anyhow about the axis.
  subroutine compare(place, away, want, worst)
    real(rp), intent(in) :: place(2), away(2), want
    real(rp), intent(inout) :: worst
    real(rp) :: angle, d, normal(3), way

    angle = random(0.0_rp, 6.0_rp)
    associate (q => place + away)
      call tool%distance([q(1)*cos(angle), q(1)*sin(angle), q(2)], d, normal, way)
    end associate
    worst = max(worst, abs(way - want)/max(1.0_rp, abs(want)), abs(d - norm2(away)), &
                off*norm2(normal - [away(1)*cos(angle), away(1)*sin(angle), away(2)]/norm2(away)))
  end subroutine compare

  !> The box around a turned mesh holds all of its points and is that of the box around it or of the
  !> cylinder about its axis, whichever is smaller.
  subroutine test_boxes()
    type(surface_mesh_t) :: mesh
    type(cut_pin_shape_t) :: shape
    real(rp), allocatable :: x(:, :), y(:, :)
    integer, allocatable :: corner(:, :)
    real(rp) :: a, b, axes(3, 3), bound(3, 2), half(3), low(3), high(3), middle(3)
    real(rp), dimension(3) :: along, away
    integer :: draw

    shape = cut_pin_shape_t(radius=9.0e-3_rp, height=4.0e-3_rp, pin_radius=3.0e-3_rp, &
                            tip_radius=2.0e-3_rp, pin_length=5.0e-3_rp)
    shape%n_flats = 3
    shape%flat_depth = 0.5e-3_rp
    call make_mesh(shape, mesh)
    call triangulate_surface(mesh%facets, mesh%ridges%patch, x, corner)
    low = minval(x, dim=2)
    high = maxval(x, dim=2)
    do draw = 1, 20
      a = random(0.0_rp, 6.0_rp)
      b = random(0.0_rp, merge(1.5_rp, 0.0_rp, draw > 5))
      axes = matmul(reshape([cos(b), 0.0_rp, -sin(b), 0.0_rp, 1.0_rp, 0.0_rp, sin(b), 0.0_rp, &
                             cos(b)], [3, 3]), &
                    reshape([cos(a), sin(a), 0.0_rp, -sin(a), cos(a), 0.0_rp, 0.0_rp, 0.0_rp, &
                             1.0_rp], [3, 3]))
      call mesh%bounds(axes, middle, half)
      y = matmul(axes, x)
      call expect('the box holds the mesh', all(minval(y, dim=2) >= middle - half - 1.0e-12_rp) &
                  .and. all(maxval(y, dim=2) <= middle + half + 1.0e-12_rp))
      along = matmul(axes, 0.5_rp*(low + high))
      away = matmul(abs(axes), 0.5_rp*(high - low))
      bound = reshape([along - away, along + away], [3, 2])
      along = 0.5_rp*(low(3) + high(3))*axes(:, 3)
      away = 0.5_rp*(high(3) - low(3))*abs(axes(:, 3)) &
             + maxval(norm2(x(1:2, :), dim=1))*sqrt(max(0.0_rp, 1.0_rp - axes(:, 3)**2))
      bound = reshape([max(bound(:, 1), along - away), min(bound(:, 2), along + away)], [3, 2])
      call expect_close('it is the smaller one', &
                        maxval(abs(reshape([middle - half, middle + half], [3, 2]) - bound)), &
                        0.0_rp, atol=1.0e-12_rp)
    end do
  end subroutine test_boxes

end program test_edges
