! SPDX-License-Identifier: MIT
!> Normals at the nodes where bodies are in contact.
!>
!> Trial normals of a node: out of the first body, out of the second (reversed), their mean, and one
!> from both bodies by the sum of volume gradients or by the plane that separates their particles
!> (linear regression with labels -1 and 1; Nairn, Hammerquist & Smith 2020, CMAME 362:112859, use
!> the logistic one). The one with the largest gap separates the bodies best. At edges, where only
!> few particles belong to a node, none of them may be right: the mean of the normals chosen at the
!> surrounding nodes is tried last.
module contact_body_normals
  use base_kinds, only: rp
  use contact_body_near, only: far_distance
  use grid_geometry, only: length_along, mean_edge, patch_t
  use state_node_pairs, only: node_pairs_t, s_moment
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use tools_pair, only: normal_regression
  implicit none (type, external)
  private

  public :: try_normals, average_normals, overlap_weight

  !> Regularisation of singular matrices [cells^2].
  real(rp), parameter :: ridge = sqrt(epsilon(1.0_rp))

contains

  !> Trial normals of entry `e`, the best founded first: that of both bodies, or a rigid body's own.
  subroutine try_normals(scene, patch, e, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: e
    type(node_pairs_t), intent(inout) :: pairs

    associate (s => pairs%sums(:, e), t => pairs%trial(:, :, e), &
               contact => scene%contact(pairs%pair(e)))
      t = 0.0_rp
      if (.not. pairs%is_due(e)) return
      t(:, 1) = s(1:3) - s(4:6)
      if (contact%normal == normal_regression) then
        t(:, 1) = plane_between(ridge*(patch%h/mean_edge(patch%h))**2, s(s_moment:s_moment + 13))
      end if
      t(:, 3) = unit(pairs%free(:, e)*s(1:3))
      t(:, 4) = unit(-pairs%free(:, e)*s(4:6))
      t(:, 1) = unit(pairs%free(:, e)*t(:, 1))
      t(:, 2) = unit(t(:, 3) + t(:, 4))
      if (scene%is_rigid_group(contact%group(1))) t = t(:, [3, 1, 2, 4])
      if (scene%is_rigid_group(contact%group(2))) t = t(:, [4, 1, 2, 3])
    end associate
  end subroutine try_normals

  pure function unit(a)
    real(rp), intent(in) :: a(3)
    real(rp) :: unit(3), length

    length = norm2(a)
    unit = 0.0_rp
    if (length > 0.0_rp) unit = a/length
  end function unit

  !> Slope of the linear function that best fits the labels of the particles (linear regression).
  pure function plane_between(ridges, s) result(slope)
    !> Regularisation of the matrix [squared edges of the cell's cube].
    real(rp), intent(in) :: ridges(3)
    real(rp), intent(in) :: s(14)
    real(rp) :: slope(3), a(3, 3), b(3), mean(3)
    integer :: i

    mean = s(7:9)/s(10)
    a = reshape([s(1), s(4), s(6), s(4), s(2), s(5), s(6), s(5), s(3)], [3, 3])/s(10)
    do i = 1, 3
      a(:, i) = a(:, i) - mean*mean(i)
      a(i, i) = a(i, i) + ridges(i)
    end do
    b = (s(11:13) - mean*s(14))/s(10)
    slope = [dot_product(b, cross(a(:, 2), a(:, 3))), dot_product(b, cross(a(:, 3), a(:, 1))), &
             dot_product(b, cross(a(:, 1), a(:, 2)))]     ! times det(a) > 0
  end function plane_between

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Mean of the normals chosen at each owned node and its neighbours, weighted by reduced mass and
  !> by how well they separate the bodies.
  subroutine average_normals(scene, nodes, pairs, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: part(3, pairs%n)
    integer :: e, i, j, k, o, q

    do e = 1, pairs%n
      part(:, e) = 0.0_rp
      if (pairs%gap(e) >= far_distance) cycle
      part(:, e) = overlap_weight(pairs%gap(e)/length_along(nodes%patch%edges_at(pairs%x(:, e)), &
                                                      pairs%normal(:, e)))*pairs%normal(:, e) &
                   /sum(1.0_rp/g(8, pairs%node(e), scene%contact(pairs%pair(e))%group))
    end do
    pairs%mean = 0.0_rp
    do e = 1, pairs%n
      if (.not. (pairs%is_owned(e) .and. pairs%is_due(e))) cycle
      do i = -1, 1
        do j = -1, 1
          q = pairs%node(e) + i*nodes%patch%stride(1) + j*nodes%patch%stride(2)
          do k = -1, 1
            o = pairs%place(q + k, pairs%pair(e))
            if (o > 0) pairs%mean(:, e) = pairs%mean(:, e) + part(:, o)
          end do
        end do
      end do
      pairs%mean(:, e) = unit(pairs%free(:, e)*pairs%mean(:, e))
    end do
  end subroutine average_normals

  !> Weight of a normal with a `gap` [cells]: small if the bodies overlap.
  pure real(rp) function overlap_weight(gap)
    real(rp), intent(in) :: gap
    real(rp), parameter :: overlap = 0.02_rp

    overlap_weight = 1.0_rp/(1.0_rp + (max(-1.0_rp, min(0.0_rp, gap))/overlap)**2)**2
  end function overlap_weight

end module contact_body_normals
