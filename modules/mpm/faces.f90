! SPDX-License-Identifier: MIT
!> Faces of particles that lie on a face of their body, and the nodes on which surface loads act. A
!> face has the particle's initial area. Along its plane it has the weights of its particle, across
!> it those of `face_weights`: only nodes to which the particle itself contributes mass, so that
!> each rank adds the faces of its own particles before the sum over ranks.
module mpm_faces
  use base_kinds, only: rp
  use grid_geometry, only: patch_t
  use particles_block, only: block_t
  use particles_store, only: f_pos
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use transfer_weights, only: face_weights
  implicit none (type, external)
  private

  public :: face_t, face_of, face_area, place_on_axis, scale_by_spans, surface_weights, &
            add_to_nodes, mean_velocity

  !> Nodes and weights of a face.
  type :: face_t
    integer :: first = 0            !! first of 27 nodes
    real(rp) :: w(3, 3) = 0.0_rp    !! weights of three nodes on each axis
  end type face_t

contains

  !> Face `k` (xmin, xmax, ymin, ymax, zmin, zmax) of particle `p` of a block with its weights.
  pure type(face_t) function face_of(scene, nodes, block, k, p)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    integer, intent(in) :: k, p
    integer :: a

    a = (k + 1)/2
    face_of%first = block%first(p)
    face_of%w = reshape(block%w(p, 1:9), [3, 3])
    face_of%w(:, a) = weights_across(scene, nodes, block, a, 2*mod(k + 1, 2) - 1, p)
  end function face_of

  !> Weights of three nodes on axis `a` of the face on the `side` (-1, 1) of particle `p`. On a
  !> graded axis slopes are differences of linear functions over spans of different widths, and the
  !> weights of the outer nodes are scaled as those of the particles.
  pure function weights_across(scene, nodes, block, a, side, p) result(w)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    integer, intent(in) :: a, side, p
    real(rp) :: w(3), d, half(3), reach, spacing
    integer :: layers

    d = place_on_axis(nodes, a, block%ps(p, f_pos:f_pos + 2), block%first(p))
    half = scene%domain(block%body)
    spacing = scene%body(block%body)%spacing(a)/nodes%patch%h(a)
    layers = 1
    reach = half(a)
    if (scene%method%is_bspline) layers = nint(1.0_rp/spacing)
    if (scene%layout%half > 0) then
      half(a) = block%ps(p, scene%layout%half + a - 1)
      reach = half(a)
    end if
    w = face_weights(d, side, half(a), reach, layers, spacing)
    call scale_by_spans(nodes%patch, a, block%first(p), w)
  end function weights_across

  !> Scale weights of three nodes on axis `a`, calculated for equal cells, by the widths of the
  !> spans of a graded axis, as those of its B-splines are.
  pure subroutine scale_by_spans(patch, a, first, w)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: a, first              !! node index of the first of 27 nodes
    real(rp), intent(inout) :: w(3)

    if (.not. patch%grading(a)%is_graded) return
    w([1, 3]) = 2.0_rp*w([1, 3])*patch%grading(a)%span(3:4, patch%all%lo(a) &
                                                       + middle(patch, a, first))
    w(2) = 1.0_rp - w(1) - w(3)
  end subroutine scale_by_spans

  !> Offset of `x` on axis `a` from the middle one of three nodes [cells].
  pure real(rp) function place_on_axis(nodes, a, x, first) result(d)
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: a, first              !! node index of the first of 27 nodes
    real(rp), intent(in) :: x(3)                 !! position [m]

    associate (patch => nodes%patch)
      d = (x(a) - patch%origin(a))/patch%h(a) - middle(patch, a, first)
      if (patch%grading(a)%is_graded) d = patch%grading(a)%place(x(a)) - patch%all%lo(a) &
                                          - middle(patch, a, first)
    end associate
  end function place_on_axis

  !> Index on axis `a`, from 0, of the middle one of the three nodes.
  pure integer function middle(patch, a, first)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: a, first              !! node index of the first of 27 nodes

    middle = first - 1                           ! storage order: z fastest, then y
    if (a > 1) middle = mod(middle, patch%stride(1))
    if (a > 2) middle = mod(middle, patch%stride(2))
    middle = middle/patch%stride(a) + 1
  end function middle

  !> Weights of three nodes on each axis at the point of contact on the surface of particle `p`, at
  !> `surface_offset` times half its spacing against the `normal`: interpolated between those of its
  !> centre and of its faces.
  pure function surface_weights(scene, nodes, block, normal, surface_offset, p) result(at)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: normal(3)           !! unit vector, out of the other body
    real(rp), intent(in) :: surface_offset
    integer, intent(in) :: p
    real(rp) :: at(3, 3), part
    integer :: a, side

    associate (spacing => scene%spacing_of(block%body, block%ps(p, :)))
      do a = 1, 3
        at(:, a) = block%w(p, 3*a - 2:3*a)
        part = surface_offset*min(1.0_rp, norm2(normal*spacing)*abs(normal(a))/spacing(a))
        if (part <= 0.0_rp) cycle
        side = merge(-1, 1, normal(a) > 0.0_rp)
        at(:, a) = at(:, a) + part*(weights_across(scene, nodes, block, a, side, p) - at(:, a))
      end do
    end associate
  end function surface_weights

  !> Initial area of face `k` of a particle of `body` [m2].
  pure real(rp) function face_area(scene, body, state, k)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body, k
    real(rp), intent(in) :: state(:)           !! fields of the particle
    real(rp) :: spacing(3)

    spacing = scene%spacing_of(body, state)
    face_area = product(spacing)/spacing((k + 1)/2)
  end function face_area

  !> Add the weighted `value` to the lanes of the nodes of a face, from `lane` on.
  pure subroutine add_to_nodes(face, value, lane, stride, nn, g)
    type(face_t), intent(in) :: face
    real(rp), intent(in) :: value(:)
    integer, intent(in) :: lane, stride(3), nn
    real(rp), intent(inout) :: g(8, nn)
    integer :: i, j, k, last, q

    last = lane + size(value) - 1
    do i = 1, 3
      do j = 1, 3
        do k = 1, 3
          q = face%first + sum(([i, j, k] - 1)*stride)
          g(lane:last, q) = g(lane:last, q) + face%w(i, 1)*face%w(j, 2)*face%w(k, 3)*value
        end do
      end do
    end do
  end subroutine add_to_nodes

  !> Mid-step velocity of a face [m/s]; nodes hold the new velocity and its change.
  pure function mean_velocity(face, stride, nn, g) result(v)
    type(face_t), intent(in) :: face
    integer, intent(in) :: stride(3), nn
    real(rp), intent(in) :: g(8, nn)
    real(rp) :: v(3)
    integer :: i, j, k, q

    v = 0.0_rp
    do i = 1, 3
      do j = 1, 3
        do k = 1, 3
          q = face%first + sum(([i, j, k] - 1)*stride)
          v = v + face%w(i, 1)*face%w(j, 2)*face%w(k, 3)*(g(1:3, q) - 0.5_rp*g(5:7, q))
        end do
      end do
    end do
  end function mean_velocity

end module mpm_faces
