! SPDX-License-Identifier: MIT
!> Sums over the particles at node pairs: bundles with weight there, volume gradients of both
!> bodies, moments of the positions of both.
module contact_body_sums
  use base_kinds, only: rp
  use grid_geometry, only: mean_edge, patch_t
  use state_node_pairs, only: axis_rows, bundle_lanes, n_bundle, near_t, node_pairs_t, &
                                   s_gradient, s_moment, u_place, u_slopes, u_weights
  use state_scene, only: scene_t
  use tools_pair, only: normal_regression
  implicit none (type, external)
  private

  public :: sum_particles

  integer, parameter :: n_gradient = 3  !! sums of one body for the gradient
  integer, parameter :: n_part = 13     !! and for gradient and moments

contains

  !> List the bundles with weight at entry `e`, and sum over their particles.
  subroutine sum_particles(scene, patch, e, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: e
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: part(n_part)
    integer :: o, side

    pairs%sums(:, e) = 0.0_rp
    associate (near => pairs%near, contact => scene%contact(pairs%pair(e)))
      pairs%item(:, e) = near%n_items
      if (.not. pairs%is_due(e)) return
      do side = 1, 2
        call list_items(scene, patch, contact%group(side), pairs%node(e), near)
        pairs%item(side + 1, e) = near%n_items
        associate (first => pairs%item(side, e) + 1, last => pairs%item(side + 1, e))
          if (contact%normal == normal_regression) then
            call sum_moments(last - first + 1, near%item(:, first:last), near%n_bundles, &
                             near%bundle, pairs%x(:, e), 1.0_rp/mean_edge(patch%h), part)
            call add_moments(2*side - 3, part(n_gradient + 1:), &
                              pairs%sums(s_moment:s_moment + 13, e))
          else
            call sum_gradients(last - first + 1, near%item(:, first:last), near%n_bundles, &
                               near%bundle, part)
          end if
        end associate
        o = s_gradient + 3*(side - 1)
        pairs%sums(o:o + 2, e) = part(:n_gradient)
      end do
    end associate
  end subroutine sum_particles

  !> List the bundles of a group's bodies with node `q` among their 27.
  pure subroutine list_items(scene, patch, group, q, near)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: group, q
    type(near_t), intent(inout) :: near
    integer :: b, corner, i, j, k, u

    do b = 1, size(scene%body)
      if (scene%body(b)%group /= group) cycle
      do i = 0, 2
        do j = 0, 2
          do k = 0, 2
            corner = q - i*patch%stride(1) - j*patch%stride(2) - k
            if (corner < 1) cycle
            u = near%bin(corner, b)
            do while (u > 0)
              call near%add_item(u, 1 + k + 3*j + 9*i)
              u = near%before(u)
            end do
          end do
        end do
      end do
    end do
  end subroutine list_items

  !> Volume gradient [m2] and moments of the particles in `m` items. Positions are relative to the
  !> node, in edges of the cell's cube: xx, yy, zz, xy, yz, xz, x, y, z, 1, all times weight.
  pure subroutine sum_moments(m, item, n, u, x, inverse_h, sums)
    integer, intent(in) :: m, item(2, m), n
    real(rp), intent(in) :: u(bundle_lanes, n_bundle, n)
    real(rp), intent(in) :: x(3), inverse_h    !! node position [m], [1/m]
    real(rp), intent(out) :: sums(n_part)
    real(rp) :: s(bundle_lanes, n_part), weight, w1, w2, w3, m1, m2, m3, y1, y2, y3
    integer :: b, i, j, k, l, o

    s = 0.0_rp
    do o = 1, m
      b = item(1, o)
      i = axis_rows(1, item(2, o)); j = axis_rows(2, item(2, o)); k = axis_rows(3, item(2, o))
      !$omp simd private(weight, w1, w2, w3, m1, m2, m3, y1, y2, y3)
      do l = 1, bundle_lanes
        w1 = u(l, u_weights + i, b); w2 = u(l, u_weights + j, b); w3 = u(l, u_weights + k, b)
        weight = w1*w2*w3
        s(l, 1) = s(l, 1) + u(l, u_slopes + i, b)*(w2*w3)
        s(l, 2) = s(l, 2) + u(l, u_slopes + j, b)*(w1*w3)
        s(l, 3) = s(l, 3) + u(l, u_slopes + k, b)*(w1*w2)
        y1 = (u(l, u_place, b) - x(1))*inverse_h
        y2 = (u(l, u_place + 1, b) - x(2))*inverse_h
        y3 = (u(l, u_place + 2, b) - x(3))*inverse_h
        m1 = weight*y1; m2 = weight*y2; m3 = weight*y3
        s(l, 4) = s(l, 4) + m1*y1; s(l, 5) = s(l, 5) + m2*y2; s(l, 6) = s(l, 6) + m3*y3
        s(l, 7) = s(l, 7) + m1*y2; s(l, 8) = s(l, 8) + m2*y3; s(l, 9) = s(l, 9) + m1*y3
        s(l, 10) = s(l, 10) + m1; s(l, 11) = s(l, 11) + m2; s(l, 12) = s(l, 12) + m3
        s(l, 13) = s(l, 13) + weight
      end do
    end do
    call sum_lanes(n_part, s, sums)
  end subroutine sum_moments

  !> Volume gradient only.
  pure subroutine sum_gradients(m, item, n, u, sums)
    integer, intent(in) :: m, item(2, m), n
    real(rp), intent(in) :: u(bundle_lanes, n_bundle, n)
    real(rp), intent(out) :: sums(n_part)
    real(rp) :: s(bundle_lanes, n_gradient), w1, w2, w3
    integer :: b, i, j, k, l, o

    s = 0.0_rp
    do o = 1, m
      b = item(1, o)
      i = axis_rows(1, item(2, o)); j = axis_rows(2, item(2, o)); k = axis_rows(3, item(2, o))
      !$omp simd private(w1, w2, w3)
      do l = 1, bundle_lanes
        w1 = u(l, u_weights + i, b); w2 = u(l, u_weights + j, b); w3 = u(l, u_weights + k, b)
        s(l, 1) = s(l, 1) + u(l, u_slopes + i, b)*(w2*w3)
        s(l, 2) = s(l, 2) + u(l, u_slopes + j, b)*(w1*w3)
        s(l, 3) = s(l, 3) + u(l, u_slopes + k, b)*(w1*w2)
      end do
    end do
    sums = 0.0_rp
    call sum_lanes(n_gradient, s, sums)
  end subroutine sum_gradients

  !> Sum over lanes, pairwise.
  pure subroutine sum_lanes(n, s, sums)
    integer, intent(in) :: n
    real(rp), intent(in) :: s(bundle_lanes, n)
    real(rp), intent(inout) :: sums(n_part)
    integer :: i

    do i = 1, n
      sums(i) = ((s(1, i) + s(5, i)) + (s(3, i) + s(7, i))) &
                + ((s(2, i) + s(6, i)) + (s(4, i) + s(8, i)))
    end do
  end subroutine sum_lanes

  !> Add the moments of one body to those of both: unweighted, and weighted by the body's label.
  pure subroutine add_moments(label, part, moments)
    integer, intent(in) :: label               !! -1 or 1
    real(rp), intent(in) :: part(10)
    real(rp), intent(inout) :: moments(14)

    moments(1:10) = moments(1:10) + part
    moments(11:14) = moments(11:14) + label*part(7:10)
  end subroutine add_moments

end module contact_body_sums
