! SPDX-License-Identifier: MIT
!> Rows of spans of random gradings; B-splines on them against their definition.
program test_grading
  use base_kinds, only: nlane, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use grid_geometry, only: box_t, grade, grid_t, make_grid, make_patch, nearest_node, patch_t
  use grid_grading, only: grading_t, make_grading
  use mpm_blocks, only: weights_of
  use particles_block, only: block_t
  use particles_store, only: f_pos
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)

  integer :: axis, i

  call begin_tests()
  call random_init(.true., .false.)
  do i = 1, 20
    do axis = 1, 3
      call test_spans(axis)
    end do
  end do
  call test_equal_spans()
  call test_what_does_not_fit()
  call test_spacing()
  call end_tests()

contains

  !> A grid of about 12 cells each way with a random zone, growth and largest cell along axis `axis`
  !> and along some of the others.
  subroutine random_grid(axis, grid, zone, cell, growth, largest)
    integer, intent(in) :: axis
    type(grid_t), intent(out) :: grid
    real(rp), intent(out) :: zone(2), cell, growth, largest   !! of axis `axis`
    type(grading_t) :: grading
    character(:), allocatable :: message
    real(rp) :: ends(2), h, lower(3), r(6), upper(3), y(3)
    integer :: a, k, n

    lower = [-1.0_rp, 2.0_rp, 0.3_rp]
    grid = make_grid([0.5_rp, 0.4_rp, 0.6_rp], lower, lower + 5.0_rp)
    do k = 1, 3
      a = modulo(axis + k - 1, 3) + 1          ! axis `axis` last
      call random_number(r)
      if (a /= axis .and. r(6) > 0.5_rp) cycle
      h = 0.1_rp + 0.3_rp*r(1)
      growth = 1.1_rp + 0.5_rp*r(2)
      largest = h*(1.5_rp + 5.0_rp*r(3))
      ends = lower(a) + h*(8.0_rp + 2.0_rp*r(4))
      ends(2) = ends(2) + h*floor(4.0_rp*r(5))
      upper(a) = ends(2) + h*(9.0_rp + 4.0_rp*r(6))
      call make_grading(lower(a), upper(a), ends, h, growth, largest, grading, n, message)
      call expect('cells of a random grading fit', len(message) == 0)
      call grade(grid, a, grading, n)
      call expect_close('first node', grading%middle(0), lower(a), atol=1.0e-12_rp)
      call expect_close('last node', grading%middle(n - 1), upper(a), atol=1.0e-12_rp)
      y = grid%upper()
      call expect_close('upper corner', y(a), upper(a), atol=1.0e-12_rp)
      zone = ends
      cell = h
    end do
  end subroutine random_grid

  !> Widths are what was asked for; weights are a partition of one, exact for linear fields,
  !> without a jump, and their slopes are their derivatives. A lattice of two particles a span feels
  !> no force from a uniform stress.
  subroutine test_spans(axis)
    integer, intent(in) :: axis
    type(grid_t) :: grid
    type(patch_t) :: patch
    type(box_t) :: own
    real(rp) :: zone(2), cell, growth, largest, w(nlane, 18), later(nlane, 18), x(nlane, 3), y(3)
    real(rp) :: field, gradient(3), off(4)
    real(rp), parameter :: slope(3) = [0.7_rp, -1.3_rp, 2.1_rp], step = 1.0e-6_rp
    integer :: a, first(nlane), i, ijk(3), j, k, next(nlane), p

    call random_grid(axis, grid, zone, cell, growth, largest)
    associate (g => grid%grading(axis), n => grid%n(axis))
      do i = 0, n - 2
        call expect('cells grow as much as they may', &
                    max(g%span(5, i)/g%span(5, i + 1), g%span(5, i + 1)/g%span(5, i)) &
                    <= growth*(1.0_rp + 1.0e-9_rp))
      end do
      call expect('no cell is longer than the largest', g%longest() <= largest*(1.0_rp + 1.0e-9_rp))
      call expect('ends are mirrors', g%is_mirrored(0) .and. g%is_mirrored(n - 1))
      call expect_close('cells in the zone', g%span(5, g%span_of(0.5_rp*sum(zone))), cell, &
                        rtol=1.0e-9_rp)
      call expect_close('the zone begins at a node', &
                        modulo(g%place(zone(1)) + 0.5_rp, 1.0_rp), 0.5_rp, atol=1.0e-9_rp)
    end associate
    own%lo = [1, 2, 1]
    own%hi = grid%n - 2
    patch = make_patch(grid, own)
    off = 0.0_rp
    call random_number(x)
    y = grid%upper()
    do a = 1, 3
      x(:, a) = grid%lower(a) + (0.2_rp + 0.6_rp*x(:, a))*(y(a) - grid%lower(a))
    end do
    call weigh(grid, patch, x, w, first)
    call weigh(grid, patch, x + step, later, next)
    do p = 1, nlane
      ijk = nearest_node(grid, x(p, :))
      call expect('the stencil is that of the nearest node', &
                  patch%node(ijk) == first(p) + sum(patch%stride))
      associate (g => grid%grading(axis))
        off(1) = max(off(1), abs(g%position(g%place(x(p, axis))) - x(p, axis)))
      end associate
      field = 0.0_rp
      gradient = 0.0_rp
      do i = 1, 3
        do j = 1, 3
          do k = 1, 3
            y = patch%position(first(p) + sum(([i, j, k] - 1)*patch%stride))
            associate (v => 1.0_rp + dot_product(slope, y))
              field = field + v*w(p, i)*w(p, 3 + j)*w(p, 6 + k)
              gradient = gradient + v*[w(p, 9 + i)*w(p, 3 + j)*w(p, 6 + k), &
                                       w(p, i)*w(p, 12 + j)*w(p, 6 + k), &
                                       w(p, i)*w(p, 3 + j)*w(p, 15 + k)]
            end associate
          end do
        end do
      end do
      off(2) = max(off(2), abs(field - 1.0_rp - dot_product(slope, x(p, :))))
      off(3) = max(off(3), maxval(abs(gradient - slope)))
      if (first(p) /= next(p)) cycle
      off(4) = max(off(4), maxval(abs((later(p, :9) - w(p, :9))/step &
                                      - 0.5_rp*(later(p, 10:) + w(p, 10:)))))
    end do
    call expect_close('place and position', off(1), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('value of a linear field', off(2), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('slope of a linear field', off(3), 0.0_rp, atol=1.0e-11_rp)
    call expect_close('slopes are derivatives', off(4), 0.0_rp, atol=1.0e-7_rp)
    call test_edges(grid, patch, axis)
    call test_forces(grid%grading(axis), grid%n(axis))
  end subroutine test_spans

  subroutine weigh(grid, patch, x, w, first)
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: x(nlane, 3)
    real(rp), intent(out) :: w(nlane, 18)
    integer, intent(out) :: first(nlane)
    type(scene_t) :: scene
    type(nodes_t) :: nodes
    type(block_t) :: block
    real(rp), target :: ps(nlane, f_pos + 2)

    scene%grid = grid
    nodes%patch = patch
    ps(:, f_pos:) = x
    block%ps => ps
    call weights_of(scene, nodes, block)
    w = block%w
    first = block%first
  end subroutine weigh

  !> Weights and slopes of a node are the same from both sides of an edge.
  subroutine test_edges(grid, patch, axis)
    type(grid_t), intent(in) :: grid
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: axis
    real(rp) :: x(nlane, 3), w(nlane, 18)
    real(rp), parameter :: by = 1.0e-10_rp
    integer :: first(nlane), o

    x = spread(grid%lower + 2.6_rp, 1, nlane)
    x(:, axis) = grid%grading(axis)%edge(5) + by
    x(1, axis) = grid%grading(axis)%edge(5) - by
    call weigh(grid, patch, x, w, first)
    o = 3*(axis - 1)
    call expect('an edge is between two stencils', first(2) - first(1) == patch%stride(axis))
    call expect_close('weights at an edge', norm2(w(1, o + 2:o + 3) - w(2, o + 1:o + 2)), 0.0_rp, &
                      atol=1.0e-8_rp)
    call expect_close('slopes at an edge', norm2(w(1, o + 11:o + 12) - w(2, o + 10:o + 11)), &
                      0.0_rp, atol=1.0e-7_rp)
  end subroutine test_edges

  !> Two, or three, particles a span, evenly in it: the sum of volume times slope is 0 at nodes
  !> that have neighbours on both sides.
  subroutine test_forces(g, n)
    type(grading_t), intent(in) :: g
    integer, intent(in) :: n
    real(rp) :: force(-2:n + 1), w(3), slope(3)
    integer :: i, j, m
    real(rp) :: d

    do m = 2, 3
      force = 0.0_rp
      do i = 0, n - 1
        do j = 1, m
          d = (j - 0.5_rp)/m - 0.5_rp
          w = g%weights(i, d)
          slope = (g%weights(i, d + 1.0e-4_rp) - g%weights(i, d - 1.0e-4_rp)) &
                  /(2.0e-4_rp*g%span(5, i))
          force(i - 1:i + 1) = force(i - 1:i + 1) + slope*g%span(5, i)/m
          call expect_close('weights add up', sum(w), 1.0_rp)
        end do
      end do
      call expect_close('no force of a uniform stress', maxval(abs(force(2:n - 3))), 0.0_rp, &
                        atol=1.0e-9_rp)
    end do
  end subroutine test_forces

  !> With no growth the spans are those of a uniform grid, and the weights those of B-splines.
  subroutine test_equal_spans()
    type(grading_t) :: g
    character(:), allocatable :: message
    integer :: n

    call make_grading(1.0_rp, 3.0_rp, [1.4_rp, 2.2_rp], 0.2_rp, 1.0_rp, 0.5_rp, g, n, message)
    call expect('equal spans fit', len(message) == 0 .and. n == 11)
    call expect_close('longest of equal spans', g%longest(), 0.2_rp)
    call expect_close('weights on equal spans', norm2(g%weights(4, 0.2_rp) &
                      - [0.5_rp*0.3_rp**2, 0.75_rp - 0.04_rp, 0.5_rp*0.7_rp**2]), 0.0_rp, &
                      atol=1.0e-12_rp)
    call expect_close('linear place', g%linear_place(1.53_rp), 2.65_rp, rtol=1.0e-9_rp)
  end subroutine test_equal_spans

  !> A rest of the box that no growing cells can fill is said, with what would do.
  subroutine test_what_does_not_fit()
    type(grading_t) :: g
    character(:), allocatable :: message
    integer :: n

    call make_grading(0.0_rp, 3.0_rp, [0.3_rp, 1.0_rp], 0.2_rp, 1.1_rp, 0.5_rp, g, n, message)
    call expect('what does not fit is said', index(message, 'below') > 0 .and. n == 0)
    call make_grading(0.0_rp, 1.3_rp, [0.0_rp, 1.0_rp], 0.2_rp, 1.1_rp, 0.5_rp, g, n, message)
    call expect('what does not fit above is said', index(message, 'above') > 0 .and. n == 0)
  end subroutine test_what_does_not_fit

  !> The edges of a particle are those of its body, on a graded grid its own.
  subroutine test_spacing()
    type(scene_t) :: scene
    real(rp), parameter :: body(3) = [0.5e-3_rp, 0.4e-3_rp, 0.3e-3_rp], own(3) = 3.0_rp*body
    real(rp) :: found(3)

    allocate (scene%body(1))
    scene%body(1)%spacing = body
    found = scene%spacing_of(1, own)
    call expect_close('edges of all particles', norm2(found - body), 0.0_rp, atol=1.0e-18_rp)
    scene%layout%edges = 1
    found = scene%spacing_of(1, own)
    call expect_close('edges of a particle', norm2(found - own), 0.0_rp, atol=1.0e-18_rp)
  end subroutine test_spacing

end program test_grading
